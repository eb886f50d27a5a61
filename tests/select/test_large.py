"""Selection for large problems, on small ones: sets against all others, the core, networks, limits."""

import itertools
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import problem_of

from planner_core.errors import RequirementError
from planner_core.model import Proven
from planner_core.select import large
from planner_core.select.greedy import select_greedy
from planner_core.select.large import core_problem, select_by_size, select_large
from planner_core.select.large_bound import large_bound
from planner_core.select.network import Network

SEEDS = st.integers(0, 2**32 - 1)
LITTLE = Proven(work_limit=0.012, n_walks=2)


def random_problem(seed, *, n=10, r=60, density=0.25, looks=1):
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < density
    ticks = rng.integers(1, 10**6, r)
    counts_for = np.array([rng.random(r) < 0.5, np.ones(r, dtype=bool)]) & (sees.sum(axis=0) >= looks)
    required = ((counts_for * ticks).sum(axis=1) * 0.9).astype(np.int64)
    return problem_of(sees, ticks, counts_for, required, seen_from=[looks, looks])


def ring_network(n, *, loops):
    """Everybody is linked to the next three either way round a ring."""
    rows = [sorted({(i + step) % n for step in (-3, -2, -1, 1, 2, 3)} - {i}) for i in range(n)]
    starts = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    graph = nx.Graph([(i, j) for i, row in enumerate(rows) for j in row])
    return Network(starts, np.concatenate(rows).astype(np.int32), np.zeros(n, dtype=np.int32), loops), graph


def fewest_by_trial(problem, *, given_ones=()):
    for size in range(1, problem.n_candidates + 1):
        for chosen in itertools.combinations(range(problem.n_candidates), size):
            if set(given_ones) <= set(chosen) and (problem.covered(list(chosen)) >= problem.required).all():
                return size
    raise AssertionError("all candidates together miss a target")


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.integers(1, 2), st.integers(0, 2))
def test_set_meets_all_targets_and_no_set_is_smaller_than_the_bound(seed, looks, n_given):
    problem = random_problem(seed, looks=looks)
    found = select_large(problem, LITTLE, given=range(n_given))
    fewest = fewest_by_trial(problem, given_ones=range(n_given))
    assert (problem.covered(list(found.chosen)) >= problem.required).all()
    assert found.chosen[:n_given] == tuple(range(n_given))
    assert found.lower_bound <= fewest <= len(found.chosen), f"seed {seed}"
    assert (found.why_stopped == "proven") == (found.lower_bound == len(found.chosen))


@pytest.mark.slow
def test_sets_are_the_smallest_on_nearly_all_small_problems():
    n_smallest = 0
    for seed in range(10):
        problem = random_problem(seed, n=14, r=100)
        n_smallest += len(select_large(problem, LITTLE).chosen) == fewest_by_trial(problem)
    assert n_smallest >= 9


@pytest.mark.slow
def test_set_of_a_larger_problem_is_smaller_than_greedy_selection_s():
    problem = random_problem(1, n=150, r=1500, density=0.04)
    found = select_large(problem, Proven(work_limit=0.5, n_walks=2))
    assert len(found.chosen) < found.n_greedy == len(select_greedy(problem).chosen)
    stations, bounds = [point.stations for point in found.curve], [point.bound for point in found.curve]
    assert stations == sorted(stations, reverse=True)
    assert bounds == sorted(bounds)
    assert (stations[-1], bounds[-1]) == (len(found.chosen), found.lower_bound)


@pytest.mark.slow
@pytest.mark.parametrize("loops", [pytest.param(False, marks=pytest.mark.slow), True])
def test_set_with_a_network_hangs_together_by_networkx(loops):
    for seed in range(2):
        problem = random_problem(seed, n=40, r=300, density=0.1)
        network, graph = ring_network(40, loops=loops)
        found = select_large(problem, Proven(work_limit=0.04, n_walks=1), network=network, given=[7])
        own = graph.subgraph(found.chosen)
        assert nx.is_connected(own)
        assert not loops or not list(nx.bridges(own))
        assert found.chosen[0] == 7
        assert found.lower_bound <= len(found.chosen) <= found.n_greedy


def test_annealing_saves_stations_where_growing_finds_nothing(monkeypatch):
    def grows_in_vain(search, work):
        search._work += min(work, 0.01)

    monkeypatch.setattr(large._LargeSearch, "_search_locally", grows_in_vain)
    problem = random_problem(5, n=60, r=400, density=0.1)
    network, graph = ring_network(60, loops=False)
    found = select_large(problem, Proven(work_limit=0.2, n_walks=2), network=network, given=[7])
    assert nx.is_connected(graph.subgraph(found.chosen))
    assert found.chosen[0] == 7
    assert len(found.chosen) < found.curve[0].stations == found.n_greedy


@pytest.mark.slow
def test_core_keeps_who_matters_with_rows_targets_and_links_as_they_are():
    problem = random_problem(2, n=80, r=600, density=0.06)
    network, graph = ring_network(80, loops=False)
    bound = large_bound(problem, n_stations=40, work_limit=0.1)
    core = core_problem(problem, bound, n_stations=40, also=[3, 79], network=network)
    assert 10 < core.candidate.size < 80
    assert {3, 79} <= set(core.candidate.tolist())
    assert not (set(core.candidate.tolist()) - {3, 79}) & set(np.flatnonzero(bound.fixed_out(40)).tolist())
    assert set(np.flatnonzero(bound.share > 0.01).tolist()) <= set(core.candidate.tolist())
    assert core.own(core.whole([0, 2, 1])) == [0, 2, 1]
    for number, candidate in enumerate(core.candidate.tolist()):
        np.testing.assert_array_equal(core.problem.rows_of(number), problem.rows_of(candidate))
        linked = set(core.whole(core.network.neighbours(number)))
        assert linked == set(graph[candidate]) & set(core.candidate.tolist())
    np.testing.assert_array_equal(core.problem.required, problem.required)


def test_core_with_loops_keeps_all_candidates():
    problem = random_problem(2, n=80, r=600, density=0.06)
    network, _ = ring_network(80, loops=True)
    bound = large_bound(problem, n_stations=40, work_limit=0.1)
    assert core_problem(problem, bound, n_stations=40, network=network).candidate.size == 80


@pytest.mark.slow
def test_same_settings_give_the_same_result_on_device_and_host():
    problem = random_problem(4, n=16, r=100, density=0.15)
    limits = Proven(work_limit=0.0055, n_walks=1)
    first = select_large(problem, limits)
    assert first == select_large(problem, limits)


def test_start_that_is_smaller_is_kept():
    problem = random_problem(5, n=14, r=100)
    best = next(
        chosen
        for chosen in itertools.combinations(range(14), fewest_by_trial(problem))
        if (problem.covered(list(chosen)) >= problem.required).all()
    )
    found = select_large(problem, Proven(work_limit=0.0), start=best)
    assert len(found.chosen) == len(best)
    assert found.why_stopped == "work limit"


def test_interrupted_search_returns_the_set_and_bound_it_has():
    problem = random_problem(6, n=150, r=1500, density=0.04)

    def interrupt(event):
        if event.stage == "bound" and event.done >= 80:
            raise KeyboardInterrupt

    found = select_large(problem, Proven(work_limit=5.0), progress=interrupt)
    assert found.why_stopped == "interrupted"
    assert found.n_greedy >= len(found.chosen) > found.lower_bound


def test_requests_that_make_no_sense_are_refused():
    problem = random_problem(7)
    other, _ = ring_network(9, loops=False)
    for words in ({"given": [10]}, {"given": [1, 1]}, {"start": [0]}, {"start": [-1]}, {"network": other}):
        with pytest.raises(RequirementError):
            select_large(problem, LITTLE, **words)


def test_candidates_outside_the_core_are_no_numbers_in_it() -> None:
    """On a device such a number would be a wild address: sets were once begun with some."""
    problem = random_problem(3, n=30)
    bound = large_bound(problem, n_stations=problem.n_candidates, work_limit=0.1)
    core = core_problem(problem, bound, n_stations=problem.n_candidates)
    inside = core.candidate.tolist()
    assert core.own(inside[::-1]) == list(range(len(inside)))[::-1]
    outside = replace(core, candidate=core.candidate[:-1])
    with pytest.raises(ValueError, match="expected candidates that are in it"):
        outside.own([inside[0], inside[-1]])


@pytest.mark.parametrize(
    ("most_candidates", "most_entries", "is_large"), [(29, 10**6, True), (30, 0, True), (30, 10**6, False)]
)
def test_many_candidates_or_entries_make_a_problem_large(monkeypatch, most_candidates, most_entries, is_large):
    used = []
    monkeypatch.setattr(large, "_MOST_CANDIDATES", most_candidates)
    monkeypatch.setattr(large, "_MOST_ENTRIES", most_entries)
    monkeypatch.setattr(large, "select", lambda problem, settings, **how: used.append(False))
    monkeypatch.setattr(large, "select_large", lambda problem, settings, **how: used.append(True))
    select_by_size(random_problem(1, n=30), LITTLE)
    assert used == [is_large]
