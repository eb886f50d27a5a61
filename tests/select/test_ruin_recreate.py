"""Sets taken apart and grown again: they meet all and are connected, and come near what trying all sets finds."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import instance

from planner_core.model import Proven
from planner_core.select.check import check_selection
from planner_core.select.greedy import select_greedy
from planner_core.select.large import select_large
from planner_core.select.network import Network, connect
from planner_core.select.problem import CoverProblem
from planner_core.select.ruin_recreate import RuinRecreate

SEEDS = st.integers(0, 2**32 - 1)


def first_set(problem, network, given_ones=()):
    return connect(problem, network, list(select_greedy(problem, given=given_ones).chosen))


def keys_of(problem, graph):
    """(components, stations) of every set that meets all and is connected."""
    whole = {i: number for number, part in enumerate(nx.connected_components(graph)) for i in part}
    for size in range(1, problem.n_candidates + 1):
        for chosen in itertools.combinations(range(problem.n_candidates), size):
            parts = {whole[i] for i in chosen}
            meets = (problem.covered(list(chosen)) >= problem.required).all()
            if meets and nx.number_connected_components(graph.subgraph(chosen)) == len(parts):
                yield len(parts), size, chosen


@settings(max_examples=8, deadline=None)
@given(SEEDS, st.integers(0, 2), st.sampled_from([0.15, 0.5]))
def test_sets_meet_all_hang_together_and_never_get_worse(seed, n_given, linked):
    problem, network, _ = instance(seed, n=20, r=150, linked=linked, reach=0.12)
    given_ones = list(range(n_given))
    start = first_set(problem, network, given_ones)
    local_search = RuinRecreate(problem, start, network=network, given=given_ones, seed=seed)
    key = (np.unique(network.part[start]).size, len(start))
    for _ in range(4):
        better = local_search.tries(25)
        now = local_search.chosen
        check_selection(problem, now, given=given_ones, network=network)
        assert now[:n_given] == given_ones
        new = (np.unique(network.part[now]).size, len(now))
        assert (new < key) == better
        assert new[1] <= len(start)
        key = new


@pytest.mark.slow
def test_fewest_components_come_first_then_fewest_stations_by_trying_all_sets():
    n_best = n_fewer_parts = 0
    for seed in range(14):
        problem, network, graph = instance(seed, n=11, r=60, linked=0.35, reach=0.15)
        start = first_set(problem, network)
        best = min(key[:2] for key in keys_of(problem, graph) if key[1] <= len(start))
        fewest = min(key[1] for key in keys_of(problem, graph))
        local_search = RuinRecreate(problem, start, network=network)
        local_search.tries(400)
        now = local_search.chosen
        found = (np.unique(network.part[now]).size, len(now))
        assert found >= best, f"seed {seed}"
        n_best += found == best
        n_fewer_parts += best[1] > fewest
    assert n_best >= 12
    assert n_fewer_parts >= 1, "no problem here has to give up a station for a component"


def test_more_stations_are_let_in_for_fewer_components_and_no_more_than_allowed():
    # Two lone candidates see all, some rows both; so do three that are linked.
    problem, network, _ = two_alone_or_three_in_a_row()
    local_search = RuinRecreate(problem, [0, 1], network=network, most=3)
    local_search.tries(60)
    assert sorted(local_search.chosen) == [2, 3, 4]
    local_search = RuinRecreate(problem, [0, 1], network=network)
    assert not local_search.tries(60)
    assert local_search.chosen == [0, 1]


def two_alone_or_three_in_a_row():
    rows = [range(8), range(5, 12), range(4), range(4, 8), range(8, 12)]
    problem = CoverProblem(
        starts=np.cumsum([0, *map(len, rows)]),
        row=np.concatenate([np.array(each) for each in rows]),
        ticks=np.full(12, 5),
        counts_for=np.ones((1, 12), dtype=bool),
        required=np.array([60]),
        least=np.array([60]),
    )
    network = Network(np.array([0, 0, 0, 1, 3, 4]), np.array([3, 2, 4, 3], dtype=np.int32), np.array([0, 1, 2, 2, 2]))
    return problem, network, None


def test_same_seed_goes_the_same_way_however_the_tries_are_dealt_out():
    problem, network, _ = instance(3, n=40, r=400, linked=0.5, reach=0.07)
    start = first_set(problem, network)
    at_once, in_turns, other = (RuinRecreate(problem, start, network=network, seed=seed) for seed in (5, 5, 6))
    at_once.tries(120)
    for n in (1, 50, 69):
        in_turns.tries(n)
    other.tries(120)
    assert at_once.chosen == in_turns.chosen
    assert at_once.work == pytest.approx(in_turns.work)
    assert at_once.work != other.work


def test_several_looks_and_loops_are_refused():
    problem, network, _ = instance(1, looks=2)
    with pytest.raises(ValueError, match="expected neither"):
        RuinRecreate(problem, range(8), network=network)


@pytest.mark.slow
def test_large_selection_takes_the_set_of_fewest_components_and_bounds_those():
    problem, network, graph = instance(9, n=40, r=400, linked=0.35, reach=0.08)
    found = select_large(problem, Proven(work_limit=0.4), network=network)
    greedy = first_set(problem, network)
    assert np.unique(network.part[list(found.chosen)]).size <= np.unique(network.part[greedy]).size
    assert found.lower_bound <= len(found.chosen) <= found.n_greedy
    assert (
        nx.number_connected_components(graph.subgraph(found.chosen)) == np.unique(network.part[list(found.chosen)]).size
    )
