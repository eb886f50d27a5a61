"""Links between candidates against pair-by-pair links and networkx."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import LinkLimits
from planner_core.network.candidate_links import CandidateLinks, candidate_links, network_of
from planner_core.network.links import overlap_links, with_scanned
from planner_core.network.network_report import registration_report

OVERLAP, STRENGTH = 0.2, 0.01
LIMITS = LinkLimits(OVERLAP, STRENGTH)
#: By probability alone; that of half of the pairs is less.
LIKELY = LinkLimits(probability=0.68)


def links_of(view, **options) -> CandidateLinks:
    options = {"limits": LIMITS, **options}
    return candidate_links(view.visibility, view.area_m2, view.surface, view.position_m, **options)


def as_dict(links) -> dict[tuple[int, int], tuple[float, float]]:
    owner = np.repeat(np.arange(links.n_candidates), np.diff(links.starts))
    figures = zip(owner, links.neighbour, links.overlap, links.strength, strict=True)
    return {(int(i), int(j)): (overlap, strength) for i, j, overlap, strength in figures}


def naive(view) -> dict[tuple[int, int], tuple[float, float]]:
    """All pairs by the definitions, one after the other."""
    share = view.overlaps()
    pairs = {}
    for i, j in np.argwhere(share > 0):
        if i != j:
            pairs[int(i), int(j)] = (share[i, j], view.strength(i, j))
    return pairs


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), rows_a_block=st.integers(1, 40))
@settings(max_examples=25, deadline=None)
def test_links_and_parts_are_those_of_all_pairs_looked_at_one_by_one(make_view, seed, rows_a_block):
    view = make_view(seed)
    pairs = naive(view)
    links = links_of(view, rows_a_block=rows_a_block)
    expected = {pair for pair, (overlap, strength) in pairs.items() if overlap >= OVERLAP and strength >= STRENGTH}
    found = as_dict(links)
    assert set(found) == expected
    for pair, figures in found.items():
        assert figures == pytest.approx(pairs[pair], abs=1e-9)

    graph = nx.Graph(list(expected))
    graph.add_nodes_from(range(links.n_candidates))
    parts = sorted(nx.connected_components(graph), key=min)
    assert [set(np.flatnonzero(links.part == k).tolist()) for k in range(links.n_parts)] == parts


@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_order_of_candidates_changes_no_bit(make_view, seed):
    view = make_view(seed)
    order = np.random.default_rng(seed).permutation(view.visibility.n_positions)
    before, after = links_of(view), links_of(view.with_order(order))
    back = {(int(order[i]), int(order[j])): figures for (i, j), figures in as_dict(after).items()}
    assert back == as_dict(before)
    assert before.n_parts == after.n_parts


@pytest.mark.parametrize("limits", [LIMITS, LIKELY])
def test_links_of_a_plan_are_those_of_its_candidates_to_the_last_bit(make_view, limits):
    view = make_view(7)
    links = as_dict(links_of(view, limits=limits))
    chosen = np.array([20, 3, 11, 8, 1, 17, 14, 5, 9, 0, 12, 6, 15, 2])
    ids = tuple(str(i) for i in chosen)
    found = view.with_order(chosen)
    listed = overlap_links(found.visibility, view.area_m2, ids, view.surface, found.position_m)
    good = {(int(x.a), int(x.b)): (x.overlap, x.strength) for x in listed if x.reaches(limits)}
    inside = {(i, j) for i, j in links if {i, j} <= set(chosen.tolist())}
    assert set(good) | {(j, i) for i, j in good} == inside
    assert len(good) > 2
    for pair, figures in good.items():
        assert links[pair] == figures


@pytest.mark.parametrize("limits", [LIMITS, LIKELY])
def test_scanned_candidates_are_linked_as_they_are_set_up_and_no_others(make_view, limits):
    view, scanned = make_view(7), range(0, 21, 2)
    ids = tuple(str(i) for i in range(view.visibility.n_positions))
    listed = overlap_links(view.visibility, view.area_m2, ids, view.surface, view.position_m)
    marked = with_scanned(listed, {str(i) for i in scanned}, limits)
    for was, now in zip(listed, marked, strict=True):
        both = int(was.a) in scanned and int(was.b) in scanned
        low = OVERLAP > was.overlap >= OVERLAP * 5 / 6 and was.strength >= STRENGTH
        if limits is LIKELY:
            low = 0.68 > was.probability >= 0.04
        assert now == replace(was, as_set_up=both and low)
    registration = registration_report(marked, ids, ["F0"] * len(ids), limits=limits)
    good = {(int(link.a), int(link.b)) for link in marked if registration.counts(link)}
    more = good - {pair for pair in as_dict(links_of(view, limits=limits)) if pair[0] < pair[1]}
    assert more
    assert good == {pair for pair in as_dict(links_of(view, limits=limits, scanned=scanned)) if pair[0] < pair[1]}


def test_network_for_selection_is_the_graph_of_the_links(make_view):
    links = links_of(make_view(3))
    network = network_of(links, loops=True)
    assert network.loops
    assert not network_of(links).loops
    assert network.n_candidates == links.n_candidates
    edges = {(i, int(j)) for i in range(network.n_candidates) for j in network.neighbours(i)}
    assert edges == set(as_dict(links))
    assert all((j, i) in edges and i != j for i, j in edges)
    for i in range(network.n_candidates):
        row = network.neighbours(i)
        assert (np.diff(row) > 0).all()
        assert (network.part[row] == network.part[i]).all()
        np.testing.assert_array_equal(links.neighbour[links.row(i)], row)
    assert links.n_links * 2 == len(edges)
    dtypes = (network.starts.dtype, network.neighbour.dtype, network.part.dtype)
    assert dtypes == (np.int64, np.int32, np.int32)


def test_candidates_that_see_nothing_stand_alone(make_view):
    view = make_view(0)
    links = links_of(view)
    blind = np.flatnonzero(np.diff(view.visibility.starts) == 0)
    assert blind.size == 2
    for candidate in blind:
        assert (links.part == links.part[candidate]).sum() == 1


def test_no_candidates_have_no_links(make_view):
    links = links_of(make_view(0).with_rows([]))
    assert (links.n_candidates, links.n_links, links.n_parts) == (0, 0, 0)


def test_progress_ends_with_all_candidates(make_view):
    events = []
    links_of(make_view(0), rows_a_block=10, progress=events.append)
    assert [(event.stage, event.done, event.total) for event in events] == [("links", n, 25) for n in (10, 20, 25)]


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"overlap": 1.5}, "overlap"),
        ({"overlap": float("nan")}, "overlap"),
        ({"strength": -0.1}, "strength"),
        ({"probability": float("nan")}, "probability"),
    ],
)
def test_thresholds_that_make_no_sense_are_refused(make_view, wrong, word):
    with pytest.raises(RequirementError, match=word):
        links_of(make_view(0), limits=LinkLimits(**wrong))
