"""Bounds of joined sets: no set that is connected is smaller, whatever the prices, on problems tried out in full."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import instance
from selection_instances import network_of, problem_of

from planner_core.model import Proven
from planner_core.select.attachments import attachment_modes
from planner_core.select.large_bound import large_bound, price_bound
from planner_core.select.proven import select
from planner_core.select.relaxation import BOUND_UNIT, TARGET_UNIT

SEEDS = st.integers(0, 2**32 - 1)


def joined_sets(problem, graph, *, given_ones=()):
    """All sets that meet the targets and whose members of each part are connected, with their number of parts."""
    whole = {i: number for number, part in enumerate(nx.connected_components(graph)) for i in part}
    for bits in itertools.product((0, 1), repeat=problem.n_candidates):
        chosen = [i for i, bit in enumerate(bits) if bit]
        if not set(given_ones) <= set(chosen) or (problem.covered(chosen) < problem.least).any():
            continue
        n_parts = len({whole[i] for i in chosen})
        if nx.number_connected_components(graph.subgraph(chosen)) == n_parts:
            yield chosen, n_parts


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 2), st.integers(1, 8), st.integers(0, 2), st.sampled_from([0.15, 0.4, 0.8]), st.booleans())
def test_no_joined_set_is_smaller_than_prices_prove_nor_holds_whom_they_fix_out(
    seed, looks, n_parts, n_given, linked, searched
):
    problem, network, graph = instance(seed, looks=looks, linked=linked)
    rng = np.random.default_rng(seed)
    lower = np.zeros(8, dtype=np.int64)
    lower[:n_given] = 1
    times = np.unique(problem.seen_from)
    # Prices near those that prove most: what a row is worth, over what a station sees.
    fair = BOUND_UNIT * problem.ticks // max(int(problem.ticks.sum()) // 3, 1)
    row_price = (fair * rng.random((times.size, problem.n_rows)) * rng.choice([0.3, 1.0, 2.0])).astype(np.int64)
    per_tick = TARGET_UNIT * BOUND_UNIT // max(int(problem.ticks.sum()) // 3, 1)
    prices = tuple(int(per_tick * each) for each in rng.random(2))
    if searched:
        good = large_bound(
            problem, n_stations=3, given=range(n_given), network=network, n_parts=n_parts, work_limit=0.02
        )
        row_price, prices = good.row_price, good.constraint_price
    modes = attachment_modes(problem, network)
    scaled, margin = price_bound(problem, row_price, prices, lower, modes, n_parts=n_parts)
    assert not searched or (scaled, margin.tolist()) == (good.scaled, good.margin.tolist())
    for chosen, parts in joined_sets(problem, graph, given_ones=range(n_given)):
        if parts <= n_parts:
            assert scaled <= len(chosen) * BOUND_UNIT, f"{chosen}"
            out = [i for i in chosen if i >= n_given and margin[i] > 0]
            assert all(scaled + int(margin[i]) <= len(chosen) * BOUND_UNIT for i in out), f"{chosen}"


@pytest.mark.slow
def test_bound_of_joined_sets_is_above_that_of_sets_that_only_cover_and_below_a_joined_set():
    for seed in range(2):
        problem, network, _ = instance(seed, n=60, r=600, linked=0.6, reach=0.04)
        found = select(problem, Proven(work_limit=0.3), network=network)
        plain = large_bound(problem, n_stations=len(found.chosen), work_limit=0.3)
        bound = large_bound(problem, n_stations=len(found.chosen), network=network, work_limit=0.6)
        assert plain.value + 0.5 < bound.value <= len(found.chosen), f"seed {seed}"


@pytest.mark.slow
def test_bound_of_sets_in_fewer_parts_is_higher():
    # Five rooms of one candidate each, and five candidates that are joined and see two thirds of the rooms each pair.
    rooms = np.kron(np.eye(5, dtype=bool), np.ones(6, dtype=bool))
    halls = np.kron(np.eye(5, dtype=bool), np.array([1, 1, 1, 0, 0, 0], dtype=bool)) | np.kron(
        np.roll(np.eye(5, dtype=bool), 1, axis=1), np.array([0, 0, 1, 1, 1, 0], dtype=bool)
    )
    sees = np.concatenate([rooms, halls])
    graph = nx.path_graph(10)
    graph.remove_edges_from([(i, i + 1) for i in range(5)])
    ticks = np.full(30, 10)
    required = np.array([240])
    problem = problem_of(sees, ticks, np.ones((1, 30), dtype=bool), required)
    values = [
        large_bound(problem, n_stations=6, network=network_of(graph), n_parts=most, work_limit=0.1).value
        for most in (6, 2, 1)
    ]
    assert values[0] < values[1] < values[2]
    for value, most in zip(values, (6, 2, 1), strict=True):
        fewest = min((len(c) for c, parts in joined_sets(problem, graph) if parts <= most), default=11)
        assert value <= fewest


@pytest.mark.parametrize("seed", range(3))
def test_modes_leave_out_rows_that_all_of_some_neighbours_see_and_every_neighbour_is_in_some_group(seed):
    problem, network, graph = instance(seed, n=30, r=200, linked=0.9)
    modes = attachment_modes(problem, network)
    sees = [set(problem.rows_of(i).tolist()) for i in range(30)]
    for i in range(30):
        mine = range(modes.starts[i], modes.starts[i + 1])
        left_out = [set(modes.again[modes.again_starts[w] : modes.again_starts[w + 1]].tolist()) for w in mine]
        assert left_out[-1] == set()
        assert modes.first_of[mine[-1]] == network.part[i]
        assert (modes.first_of[mine[:-1]] == -1).all()
        assert len(left_out) - 1 <= 6
        for other in graph[i]:
            assert any(rows <= sees[i] & sees[other] for rows in left_out[:-1])
    assert modes.again.size > 0
