"""Measures of overlap against sets counted by hand and plain loops over fractions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.model import LinkLimits, OverlapMeasure, Visibility
from planner_core.network.candidate_links import candidate_links
from planner_core.network.links import overlap_links
from planner_core.network.pair_overlap import AREA_TICK_M2, overlapping_pairs

SHARE, JACCARD = OverlapMeasure
Pair = tuple[int, int]

#: Four positions, patches of 1 to 4 m2, and what any two have of each other.
AREA_M2 = np.array([1.0, 2.0, 3.0, 4.0, 1.0, 2.0, 3.0, 4.0])
HALL, ALCOVE, NEXT_DOOR, TWIN = {0, 1, 2, 3, 4, 5}, {4, 5}, {5, 6, 7}, {4, 5}
BY_HAND = {
    (0, 1): (3 / 13, 3 / 13),  # the alcove's 3 m2 are all seen from the hall, which sees 13
    (0, 2): (2 / 13, 2 / 20),
    (0, 3): (3 / 13, 3 / 13),
    (1, 2): (2 / 9, 2 / 10),
    (1, 3): (1.0, 1.0),
    (2, 3): (2 / 9, 2 / 10),
}


def rows_of(sets: list[set[int]], n_patches: int) -> Visibility:
    starts = np.cumsum([0, *map(len, sets)])
    patch = [patch for seen in sets for patch in sorted(seen)]
    return Visibility(starts.astype(np.int64), np.array(patch, dtype=np.int32), n_patches)


def by_pairs(rows: Visibility, area_m2: Any, measure: OverlapMeasure, least: float = 0.0) -> dict[Pair, float]:
    found = {}
    for pairs in overlapping_pairs(rows, area_m2, min_overlap=least, measure=measure, rows_a_block=2):
        found.update(zip(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True), pairs.overlap, strict=True))
    return found


def by_loops(sets: list[set[int]], area_m2: Any) -> Iterator[tuple[Pair, Fraction, Fraction]]:
    """Both measures of each pair that has anything in common, without rounding; areas are whole ticks as told."""
    ticks = [Fraction(round(area / AREA_TICK_M2)) for area in area_m2.tolist()]
    for i, j in combinations(range(len(sets)), 2):
        common = mine = theirs = either = Fraction(0)
        for patch, size in enumerate(ticks):
            mine += size * (patch in sets[i])
            theirs += size * (patch in sets[j])
            common += size * (patch in sets[i] and patch in sets[j])
            either += size * (patch in sets[i] or patch in sets[j])
        if common:
            yield (i, j), min(common / mine, common / theirs), common / either


@st.composite
def positions(draw: st.DrawFn) -> tuple[list[set[int]], Any]:
    n_patches = draw(st.integers(1, 12))
    sets = draw(st.lists(st.sets(st.integers(0, n_patches - 1)), min_size=2, max_size=6))
    area_m2 = draw(st.lists(st.floats(1e-6, 100.0), min_size=n_patches, max_size=n_patches))
    return sets, np.array(area_m2)


def test_measures_are_those_of_sets_counted_by_hand() -> None:
    rows = rows_of([HALL, ALCOVE, NEXT_DOOR, TWIN], 8)
    assert by_pairs(rows, AREA_M2, SHARE) == {pair: share for pair, (share, _) in BY_HAND.items()}
    assert by_pairs(rows, AREA_M2, JACCARD) == {pair: jaccard for pair, (_, jaccard) in BY_HAND.items()}
    # Exactly on the threshold counts, by either.
    assert set(by_pairs(rows, AREA_M2, JACCARD, 3 / 13)) == {(0, 1), (0, 3), (1, 3)}


def test_what_is_not_said_is_the_smaller_share() -> None:
    rows = rows_of([HALL, NEXT_DOOR], 8)
    (pairs,) = overlapping_pairs(rows, AREA_M2, min_overlap=0.0)
    (link,) = overlap_links(rows, AREA_M2, ("A", "B"))
    assert pairs.overlap.tolist() == [link.overlap] == [2 / 13]


@pytest.mark.slow
@given(seen=positions())
@settings(max_examples=40, deadline=None)
def test_measures_are_those_of_plain_loops(seen: tuple[list[set[int]], Any]) -> None:
    sets, area_m2 = seen
    rows = rows_of(sets, area_m2.size)
    share, jaccard = by_pairs(rows, area_m2, SHARE), by_pairs(rows, area_m2, JACCARD)
    expected = list(by_loops(sets, area_m2))
    # A division rounded once is the nearest float to the fraction.
    assert share == {pair: float(exact) for pair, exact, _ in expected}
    assert jaccard == {pair: float(exact) for pair, _, exact in expected}


@pytest.mark.slow
@given(seen=positions())
@settings(max_examples=40, deadline=None)
def test_jaccard_is_never_more_and_both_are_symmetric_and_one_for_the_same_view(
    seen: tuple[list[set[int]], Any],
) -> None:
    sets, area_m2 = seen
    n = len(sets)
    doubled = rows_of([*sets, *sets[::-1]], area_m2.size)
    share, jaccard = by_pairs(doubled, area_m2, SHARE), by_pairs(doubled, area_m2, JACCARD)
    for (i, j), index in jaccard.items():
        assert 0.0 < index <= share[i, j] <= 1.0
        if i < n <= j:
            twin = 2 * n - 1 - j  # sees what j sees
            forth, back = sorted((i, twin)), sorted((2 * n - 1 - i, j))
            if twin == i:
                assert index == share[i, j] == 1.0
            else:
                assert jaccard[forth[0], forth[1]] == index == jaccard[back[0], back[1]]
                assert share[forth[0], forth[1]] == share[i, j] == share[back[0], back[1]]


@pytest.mark.parametrize("seed", range(3))
def test_what_reaches_a_threshold_by_jaccard_reaches_it_by_share(make_view: Callable[[int], Any], seed: int) -> None:
    view = make_view(seed)

    def linked(measure: OverlapMeasure) -> dict[Pair, float]:
        links = candidate_links(
            view.visibility, view.area_m2, view.surface, view.position_m, limits=LinkLimits(0.25), measure=measure
        )
        owner = np.repeat(np.arange(links.n_candidates), np.diff(links.starts)).tolist()
        return dict(zip(zip(owner, links.neighbour.tolist(), strict=True), links.strength.tolist(), strict=True))

    by_share, by_jaccard = linked(SHARE), linked(JACCARD)
    assert 0 < len(by_jaccard) < len(by_share)
    # What is common is common however it is measured: the strength is the same, bit by bit.
    assert by_jaccard.items() < by_share.items()


@pytest.mark.parametrize("measure", list(OverlapMeasure))
def test_links_of_a_plan_are_those_of_its_candidates(make_view: Callable[[int], Any], measure: OverlapMeasure) -> None:
    view = make_view(7)
    ids = tuple(str(number) for number in range(view.visibility.n_positions))
    links = candidate_links(
        view.visibility, view.area_m2, view.surface, view.position_m, limits=LinkLimits(0.2), measure=measure
    )
    listed = overlap_links(
        view.visibility, view.area_m2, ids, view.surface, view.position_m, min_overlap=0.2, measure=measure
    )
    owner = np.repeat(np.arange(links.n_candidates), np.diff(links.starts)).tolist()
    found = {
        (i, j): figures
        for i, j, *figures in zip(owner, links.neighbour.tolist(), links.overlap, links.strength, strict=True)
        if i < j
    }
    assert found == {(int(link.a), int(link.b)): [link.overlap, link.strength] for link in listed}
    assert len(found) > 5
