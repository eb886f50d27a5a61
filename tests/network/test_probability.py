"""The rule of what registers, against the rows of the campaign that it is made of."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from planner_core.model import PreAlignment
from planner_core.network.links import WEIGHTS, probabilities
from planner_core.network.pair_overlap import HeldPairs
from tests.benchmarks.registration.rule import held_of, read_rows

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
@pytest.mark.parametrize("start", list(PreAlignment))
def test_weights_are_those_that_the_campaign_makes(start: PreAlignment) -> None:
    rows = read_rows(ROOT / "docs/benchmarks/registration", [start], ["open3d"])
    assert WEIGHTS[start] == pytest.approx(rows.rule(start, "open3d").weight, abs=0.0051)


def test_pairs_that_rarely_register_do_not_count_and_those_that_always_do_count() -> None:
    rows = read_rows(ROOT / "docs/benchmarks/registration", ["tracked", "manual"], ["open3d"])
    known = rows.known
    for start in (PreAlignment.TRACKED, PreAlignment.MANUAL):
        found = probabilities(known["overlap"], held_of(known), start)
        counts, registered = (found >= 0.99) & rows.is_strong, rows.registered(start, "open3d")
        assert registered[counts].mean() > 0.998
        assert registered[counts & (known["overlap"] < 0.3)].mean() > 0.98
        assert counts[registered == 1].mean() > 0.7


@pytest.mark.parametrize("start", [PreAlignment.TRACKED, PreAlignment.MANUAL])
def test_what_counts_registers_in_each_scene(start: PreAlignment) -> None:
    """A rule made of rooms took nearly all pairs of a tunnel for links, of which a third register.

    Of the Angel house the failures are no more than chance leaves, in one of a thousand such scenes, of pairs of which
    99 % register: its far walls are beyond the kernel of the method, see docs/benchmarks/registration.md.
    """
    rows = read_rows(ROOT / "docs/benchmarks/registration", [start], ["open3d"])
    counts = probabilities(rows.known["overlap"], held_of(rows.known), start) >= 0.99
    counts &= rows.is_strong
    failed = counts & (rows.registered(start, "open3d") == 0)
    for scene in np.unique(rows.scene):
        here = rows.scene == scene
        n = counts[here].sum()
        most = binom.ppf(0.999, n, 0.01) if scene == "angel-house" else max(1, 0.01 * n)
        assert failed[here].sum() <= most, scene


@settings(max_examples=25, deadline=None)
@given(
    share=st.floats(0.0, 1.0),
    hold_m2=st.floats(0.0, 1e3),
    more=st.floats(1.0, 10.0),
    start=st.sampled_from(list(PreAlignment)),
)
def test_more_in_common_never_lowers_the_probability(
    share: float, hold_m2: float, more: float, start: PreAlignment
) -> None:
    def of(share: float, hold_m2: float, start: PreAlignment = start) -> float:
        held = HeldPairs(*np.array([[np.nan], [hold_m2]]))
        return float(probabilities(np.array([share]), held, start)[0])

    least = of(share, hold_m2)
    assert 0.0 <= least <= 1.0
    assert of(min(1.0, more * share), hold_m2) >= least
    assert of(share, more * hold_m2) >= least
    # The better it is known where registration starts, the more registers; this is no part of the rule's form.
    if share >= 0.1 and hold_m2 > 0.1:
        by_start = [of(share, hold_m2, each) for each in PreAlignment]
        assert by_start[0] >= by_start[1] - 0.02
        assert by_start[1] >= by_start[2]
        assert by_start[2] >= by_start[3] - 0.02
