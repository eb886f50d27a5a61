"""What a share of the scannable area leaves out, in words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.coverage.percent import not_planned, reached_percent, reached_share


@pytest.mark.parametrize(
    ("unreachable_m2", "scope", "achievable_m2", "expected"),
    [
        ([], "interior", 80.0, ()),
        ([], "interior", 60.0, ("Not scannable: 40 m2 of 100 m2 in scope, from no valid tripod position",)),
        ([], "all", 60.0, ()),
        ([12.4], "all", 60.0, ("Not planned: 12 m2 of floor that can't be reached on foot, in one area",)),
        ([12.4, 3.0], "exterior", 90.0, ("Not planned: 15 m2 of floor that can't be reached on foot, in 2 areas",)),
    ],
)
def test_what_the_coverage_leaves_out_is_named_from_a_third_of_the_scope_on(
    unreachable_m2: list[float], scope: str, achievable_m2: float, expected: tuple[str, ...]
) -> None:
    found = not_planned(
        unreachable_m2=unreachable_m2, scope=scope, achievable_m2=achievable_m2, total_m2=100.0, area_by_reason_m2={}
    )
    assert found == expected


@pytest.mark.parametrize(
    ("reasons", "scope", "expected"),
    [
        ({"too oblique": 5.0}, "interior", ()),
        ({"too oblique": 40.0, "too sparse": 5.5, "occluded": 30.0}, "all",
         ("Not scannable as required: 46 m2 that valid positions see, beside the 50 m2 that count",)),
        ({"out of range": 6.0, "covered": 45.0, "not worth a station": 5.0}, "interior",
         ("Not scannable as required: 6 m2 that valid positions see, beside the 50 m2 that count",
          "Not scannable: 44 m2 of 100 m2 in scope, from no valid tripod position")),
        ({"too few spots see it": 48.0, "occluded": 2.0}, "exterior",
         ("Not scannable as required: 48 m2 that valid positions see, beside the 50 m2 that count",)),
    ],
)  # fmt: skip
def test_what_is_seen_but_not_as_required_is_named_from_a_tenth_of_what_counts_on(
    reasons: dict[str, float], scope: str, expected: tuple[str, ...]
) -> None:
    total_m2 = 90.0 if scope == "interior" and not expected else 100.0
    achievable_m2 = 85.0 if not expected else 50.0
    found = not_planned(
        unreachable_m2=[], scope=scope, achievable_m2=achievable_m2, total_m2=total_m2, area_by_reason_m2=reasons
    )
    assert found == expected


@pytest.mark.parametrize(
    ("share", "required", "words"),
    [
        (0.2997, 0.3, "just below 30"),
        (0.2994, 0.3, "29.9"),
        (0.3, 0.3, "30.0"),
        (0.06996, 0.07, "just below 7"),
        (0.2958, 0.296, "just below 29.6"),
        (0.07966, 0.0, "8.0"),
    ],
)
def test_a_share_is_rounded_and_what_is_short_never_reads_as_enough(share: float, required: float, words: str) -> None:
    assert reached_percent(share, required) == words


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.integers(3, 6))
def test_a_share_of_few_decimals_stays_on_its_side_of_what_is_required(share: float, required: float, n: int) -> None:
    short = reached_share(share, required, n)
    assert abs(short - share) <= 0.5 * 10.0**-n + 1e-15
    assert not share < required <= short
    assert reached_share(0.29997, 0.3, 4) == 0.29997
