"""The rule of what registers, against the rows of the campaign that it is made of."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.model import PreAlignment
from planner_core.network.links import WEIGHTS, probabilities
from tests.benchmarks.registration.rule import features, fitted, read_rows

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("start", list(PreAlignment))
def test_weights_are_those_that_the_campaign_makes(start: PreAlignment) -> None:
    rows = read_rows(ROOT / "docs/benchmarks/registration", [start], ["open3d"])
    registered = rows.registered(start, "open3d")
    tried = ~np.isnan(registered)
    rule = fitted(features(rows.known)[tried], registered[tried])
    assert WEIGHTS[start] == pytest.approx(rule.weight, abs=0.0051)


def test_pairs_that_rarely_register_do_not_count_and_those_that_always_do_count() -> None:
    rows = read_rows(ROOT / "docs/benchmarks/registration", ["tracked", "manual"], ["open3d"])
    known = rows.known
    for start in (PreAlignment.TRACKED, PreAlignment.MANUAL):
        hold_m2 = known["least_normal"] / 3.0 * known["common_m2"]
        found = probabilities(known["overlap"], hold_m2, known["common_range_m"], start)
        counts, registered = found >= 0.99, rows.registered(start, "open3d")
        assert registered[counts].mean() > 0.998
        assert registered[counts & (known["overlap"] < 0.3)].mean() > 0.98
        assert counts[registered == 1].mean() > 0.7


@settings(max_examples=25, deadline=None)
@given(
    share=st.floats(0.0, 1.0), hold_m2=st.floats(0.0, 1e4), range_m=st.floats(0.0, 200.0),
    more=st.floats(1.0, 10.0), start=st.sampled_from(list(PreAlignment)),
)  # fmt: skip
def test_more_in_common_never_lowers_the_probability(
    share: float, hold_m2: float, range_m: float, more: float, start: PreAlignment
) -> None:
    def of(share: float, hold_m2: float, range_m: float) -> float:
        return float(probabilities(np.array([share]), np.array([hold_m2]), np.array([range_m]), start)[0])

    least = of(share, hold_m2, range_m)
    assert 0.0 <= least <= 1.0
    assert of(min(1.0, more * share), hold_m2, range_m) >= least
    assert of(share, more * hold_m2, range_m) >= least
    assert of(share, hold_m2, range_m / more) >= least
    # The better it is known where registration starts, the more registers; this is no part of the rule's form.
    if share >= 0.1 and hold_m2 > 0.1 and 1.0 < range_m < 30.0:
        by_start = [float(probabilities(*np.array([[share], [hold_m2], [range_m]]), each)[0]) for each in PreAlignment]
        assert by_start[0] >= by_start[1] - 0.02
        assert by_start[1] >= by_start[2]
