"""What a share of the scannable area leaves out, in words."""

import pytest

from planner_core.coverage.percent import not_planned


@pytest.mark.parametrize(
    ("sealed_m2", "scope", "achievable_m2", "expected"),
    [
        ([], "interior", 80.0, ()),
        ([], "interior", 60.0, ("Not scannable: 40 m2 of 100 m2 in scope, from no valid tripod position",)),
        ([], "all", 60.0, ()),
        ([12.4], "all", 60.0, ("Not planned: 12 m2 of floor that can't be reached on foot, in one area",)),
        ([12.4, 3.0], "exterior", 90.0, ("Not planned: 15 m2 of floor that can't be reached on foot, in 2 areas",)),
    ],
)
def test_what_the_coverage_leaves_out_is_named_from_a_third_of_the_scope_on(
    sealed_m2: list[float], scope: str, achievable_m2: float, expected: tuple[str, ...]
) -> None:
    found = not_planned(sealed_m2=sealed_m2, scope=scope, achievable_m2=achievable_m2, total_m2=100.0)
    assert found == expected
