"""Least cuts and sides of cuts, compiled: against networkx."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import sparse_graph
from selection_instances import network_of

from planner_core.select.compiled_cuts import add_up, least_cut, part_about

SEEDS = st.integers(0, 2**32 - 1)
ENOUGH = 2**60


def split_at_candidates(graph, limit, sources, far) -> nx.DiGraph:
    split = nx.DiGraph()
    split.add_nodes_from(["from", "to"])
    for i in graph:
        if limit[i] >= 0:
            split.add_edge((i, "in"), (i, "out"), capacity=int(limit[i]))
            split.add_edges_from([((i, "out"), (j, "in")) for j in graph[i] if limit[j] >= 0])
    split.add_edges_from([("from", (i, "in")) for i in sources if limit[i] >= 0])
    split.add_edges_from([((i, "out"), "to") for i in far if limit[i] >= 0])
    return split


def instance(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 30))
    graph = sparse_graph(rng, n, n_parts=1, more=float(rng.choice([0.1, 0.4, 0.8])))
    limit = rng.integers(0, 20, n)
    limit[rng.random(n) < 0.2] = 0
    limit[rng.random(n) < 0.1] = -1
    order = rng.permutation(n)
    n_source = int(rng.integers(1, n))
    n_far = int(rng.integers(1, n - n_source + 1))
    return graph, limit, order[:n_source], order[n_source : n_source + n_far]


def mask(n, at):
    found = np.zeros(n, dtype=bool)
    found[at] = True
    return found


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(SEEDS)
def test_a_least_cut_is_that_of_networkx_and_the_nearest_to_its_sources(seed):
    graph, limit, sources, far = instance(seed)
    n, network = len(graph), network_of(graph)
    side = np.full(n, 9, dtype=np.uint8)
    of = network.starts, network.neighbour, network.opposite, limit, mask(n, sources), mask(n, far)
    found = least_cut(*of, ENOUGH, side)
    split = split_at_candidates(graph, limit, sources, far)
    least = nx.maximum_flow_value(split, "from", "to")
    assert found == least == limit[side == 1].sum()
    # Nothing leads past the cut, and whoever is on its side is there in the residual of networkx's own flow.
    past = split.copy()
    past.remove_edges_from([((i, "in"), (i, "out")) for i in np.flatnonzero(side == 1).tolist()])
    assert not nx.has_path(past, "from", "to")
    residual = nx.algorithms.flow.preflow_push(split, "from", "to")
    open_edges = [(a, b) for a, b, of in residual.edges(data=True) if of["flow"] < of["capacity"]]
    reached = nx.descendants(nx.DiGraph([("from", "from"), *open_edges]), "from")
    assert [i for i in range(n) if side[i] == 2] == [i for i in range(n) if (i, "out") in reached]
    assert [i for i in range(n) if side[i] == 1] == [
        i for i in range(n) if (i, "in") in reached and (i, "out") not in reached
    ]


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.integers(1, 40))
def test_who_asks_for_less_hears_no_less_than_that(seed, enough):
    graph, limit, sources, far = instance(seed)
    n, network = len(graph), network_of(graph)
    side = np.zeros(n, dtype=np.uint8)
    of = network.starts, network.neighbour, network.opposite, limit, mask(n, sources), mask(n, far)
    whole, found = least_cut(*of, ENOUGH, side), least_cut(*of, enough, side)
    assert found == whole if whole < enough else enough <= found <= whole


def test_what_flows_back_is_undone():
    """The shortest way, 0 - 1 - 2 - 3 - 4 over the middle link, has to give way for two that are longer."""
    graph = nx.Graph([(0, 1), (1, 2), (2, 3), (0, 4), (4, 5), (5, 2), (1, 6), (6, 7), (7, 3)])
    network, side = network_of(graph), np.zeros(8, dtype=np.uint8)
    limit = np.array([10, 1, 1, 10, 1, 1, 1, 1])
    of = network.starts, network.neighbour, network.opposite, limit, mask(8, [0]), mask(8, [3])
    assert least_cut(*of, ENOUGH, side) == 2
    assert side.tolist() == [2, 1, 0, 0, 1, 0, 0, 0]


def test_what_flows_back_through_a_candidate_leaves_room_in_it():
    """First 0 1 2 3 4; then 0 8 9 10 3 takes its end, and it ends by 5 6 7; then 2 is free for 11 .. 15, 16 .. 20."""
    graph = nx.Graph()
    for way in ([0, 1, 2, 3, 4], [1, 5, 6, 7, 4], [0, 8, 9, 10, 3], [0, *range(11, 16), 2, *range(16, 21), 4]):
        nx.add_path(graph, way)
    network, side, limit = network_of(graph), np.zeros(21, dtype=np.uint8), np.ones(21, dtype=np.int64)
    limit[[0, 4]] = 10
    of = network.starts, network.neighbour, network.opposite, limit, mask(21, [0]), mask(21, [4])
    assert least_cut(*of, ENOUGH, side) == 3
    assert np.flatnonzero(side == 1).tolist() == [1, 8, 11]


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_sides_about_a_piece_are_those_of_networkx(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 25))
    graph = sparse_graph(rng, n, n_parts=1, more=float(rng.choice([0.1, 0.4])))
    network, x, inside = network_of(graph), np.round(rng.random(n), 1), rng.random(n) < 0.9
    start = int(rng.integers(n))
    inside[start] = True
    piece = {start} | {i for i in graph[start] if inside[i] and rng.random() < 0.5}
    side = np.full(n, 9, dtype=np.uint8)
    mine, other = part_about(network.starts, network.neighbour, inside, mask(n, sorted(piece)), x, side)
    here = graph.subgraph(np.flatnonzero(inside).tolist())
    touched = piece | {j for i in piece for j in graph[i]}
    away = [i for i in here if i not in touched]
    assert mine == max(sorted(piece), key=lambda i: x[i])
    assert other == (max(sorted(away), key=lambda i: x[i]) if away else -1)
    if other < 0:
        assert not side.any()
        return
    there = nx.node_connected_component(graph.subgraph(away), other)
    kept = there | {j for i in there for j in graph[i]}
    near = nx.node_connected_component(graph.subgraph({i for i in here if i not in kept} | {mine}), mine)
    between = {j for i in near for j in here if graph.has_edge(i, j)} - near
    assert set(np.flatnonzero(side == 2).tolist()) == near
    assert set(np.flatnonzero(side == 1).tolist()) == between


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_sums_over_rows_and_over_who_sees_them_are_those_of_matrices(seed):
    rng = np.random.default_rng(seed)
    sees = rng.random((int(rng.integers(1, 8)), int(rng.integers(1, 12)))) < 0.5
    x, ticks = rng.integers(0, 3, sees.shape[0]) / 4, rng.integers(-3, 4, sees.shape[1])
    starts, first = (np.concatenate([[0], np.cumsum(sees.sum(axis=axis))]).astype(np.int64) for axis in (1, 0))
    row, seer = np.nonzero(sees)[1].astype(np.int32), np.nonzero(sees.T)[1].astype(np.int32)
    cover, seen = np.full(sees.shape[1], 0.5), np.full(sees.shape[0], 7)
    add_up(starts, row, x, cover)
    add_up(first, seer, ticks, seen)
    assert cover.tolist() == (0.5 + sees.T @ x).tolist()
    assert seen.tolist() == (7 + sees @ ticks).tolist()
