"""Most coverage with n stations: against all sets of so many, with and without a network, and its bound."""

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
from planner_core.select.large_bound import large_bound
from planner_core.select.most_coverage import coverage_bound, fill, most_coverage
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

SEEDS = st.integers(0, 2**32 - 1)
LITTLE = Proven(work_limit=0.004, n_walks=2)
ENOUGH = Proven(work_limit=0.025, n_walks=2)


def random_problem(seed, *, n=9, r=40, density=0.3, looks=1):
    """A first target that no few stations meet, which must not matter, and a second one of nearly all rows."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < density
    counts_for = np.array([np.ones(r, dtype=bool), (rng.random(r) < 0.9) & (sees.sum(axis=0) >= looks)])
    ticks = rng.integers(1, 10**9, r)
    whole = (counts_for * ticks).sum(axis=1)
    return problem_of(sees, ticks, counts_for, whole, seen_from=[1, looks])


def last_target(problem, *, share=1.0):
    required = (problem.required[1:] * share).astype(np.int64)
    return CoverProblem(
        problem.starts, problem.row, problem.ticks, problem.counts_for[1:], required, required, problem.seen_from[1:]
    )


def random_network(seed, n, *, loops, density=0.25):
    graph = nx.gnp_random_graph(n, density, seed=seed % 2**32)
    part = np.zeros(n, dtype=np.int32)
    for number, members in enumerate(nx.connected_components(graph)):
        part[list(members)] = number
    rows = [sorted(graph[i]) for i in range(n)]
    starts = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    return Network(starts, np.concatenate(rows).astype(np.int32), part, loops), graph


def hangs_together(graph, network, chosen):
    """By networkx: each part's chosen ones connected, and with loops without bridges, but for those of the graph."""
    free = {tuple(sorted(link)) for link in nx.bridges(graph)}
    for part in np.unique(network.part[list(chosen)]):
        own = graph.subgraph([c for c in chosen if network.part[c] == part])
        if not nx.is_connected(own):
            return False
        if network.loops and len(own) > 2 and {tuple(sorted(link)) for link in nx.bridges(own)} - free:
            return False
    return True


def best_by_trial(problem, n, *, given_ones=(), allowed=lambda chosen: True):
    sets = (
        chosen
        for size in range(1, n + 1)
        for chosen in itertools.combinations(range(problem.n_candidates), size)
        if set(given_ones) <= set(chosen) and allowed(chosen)
    )
    return max(int(problem.covered(list(chosen))[-1]) for chosen in sets)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 5), st.integers(1, 2), st.integers(0, 1))
def test_set_covers_what_it_says_and_no_set_of_so_many_passes_the_bound(seed, n, looks, n_given):
    problem = random_problem(seed, looks=looks)
    found = most_coverage(problem, n, LITTLE, given=range(n_given))
    best = best_by_trial(problem, n, given_ones=range(n_given))
    assert found.ticks == int(problem.covered(list(found.chosen))[-1]) <= best <= found.bound_ticks
    assert len(found.chosen) <= n
    assert set(range(n_given)) <= set(found.chosen)
    assert (found.why_stopped == "proven") == (found.ticks == found.bound_ticks)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 5), st.booleans())
def test_set_with_a_network_hangs_together_and_no_such_set_passes_the_bound(seed, n, loops):
    problem = random_problem(seed)
    network, graph = random_network(seed, 9, loops=loops)
    found = most_coverage(problem, n, LITTLE, network=network)
    assert len(found.chosen) <= n
    assert hangs_together(graph, network, found.chosen), f"seed {seed}"
    best = best_by_trial(problem, n, allowed=lambda chosen: hangs_together(graph, network, chosen))
    assert found.ticks == int(problem.covered(list(found.chosen))[-1]) <= best <= found.bound_ticks, f"seed {seed}"


@pytest.mark.slow
@pytest.mark.parametrize("with_network", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sets_are_the_best_of_so_many_on_nearly_all_small_problems(with_network):
    n_best = 0
    for seed in range(10):
        problem = random_problem(seed)
        network, graph = random_network(seed, 9, loops=False) if with_network else (None, None)
        found = most_coverage(problem, 4, ENOUGH, network=network)
        fits = (lambda c, g=graph, n=network: hangs_together(g, n, c)) if with_network else lambda c: True
        n_best += found.ticks == best_by_trial(problem, 4, allowed=fits)
    assert n_best >= 9


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans(), st.booleans(), st.integers(1, 9))
def test_filling_keeps_a_set_joined_and_takes_who_adds_most(seed, with_network, loops, n):
    problem = random_problem(seed)
    last = last_target(problem)
    network, graph = random_network(seed, 9, loops=loops) if with_network else (None, None)
    chosen = fill(last, [], n, network=network)
    assert len(set(chosen)) == len(chosen) <= n
    for place, candidate in enumerate(chosen):
        before = chosen[:place]
        others = [c for c in range(9) if c not in before]
        if network is not None:
            assert hangs_together(graph, network, [*before, candidate])
            others = [candidate]  # who else might have come is for the network to say
        gains = {c: int(last.covered([*before, c])[0]) for c in others}
        assert gains[candidate] == max(gains.values()), f"seed {seed}"


def test_more_stations_that_begin_with_fewer_never_cover_less():
    problem = random_problem(3, n=40, r=400, density=0.08)
    curve = []
    for number in (1, 3, 5, 8, 12):
        start = curve[-1].chosen if curve else None
        curve.append(most_coverage(problem, number, Proven(work_limit=0.05, n_walks=1), start=start))
    ticks = [point.ticks for point in curve]
    assert ticks == sorted(ticks)
    assert ticks[0] < ticks[-1]
    assert all(point.ticks <= point.bound_ticks for point in curve)
    # One station: the best one is found by looking.
    assert ticks[0] == best_by_trial(problem, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("looks", "n_given"), [pytest.param(1, 2, marks=pytest.mark.slow), (2, 0)])
def test_bound_comes_within_a_percent_of_the_linear_relaxation(looks, n_given):
    from scipy.optimize import linprog

    n, r, n_stations = 100, 400, 15
    problem = random_problem(5, n=n, r=r, density=0.05, looks=looks)
    sees = np.zeros((r, n))
    for candidate in range(n):
        sees[problem.rows_of(candidate), candidate] = 1
    relaxed = linprog(
        np.concatenate([np.zeros(n), -problem.ticks * problem.counts_for[1] / 1e9]),
        A_ub=np.vstack([np.hstack([-sees, looks * np.eye(r)]), np.append(np.ones(n), np.zeros(r))]),
        b_ub=np.append(np.zeros(r), n_stations),
        bounds=[(1 if i < n_given else 0, 1) for i in range(n)] + [(0, 1)] * r,
    )
    value = -relaxed.fun * 1e9
    found = most_coverage(problem, n_stations, Proven(work_limit=0.8, n_walks=1), given=range(n_given))
    assert value * (1 - 1e-6) <= found.bound_ticks <= 1.01 * value
    if looks == 1:
        assert found.ticks >= 0.9 * value


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 6), st.integers(1, 2))
def test_bound_of_any_prices_holds_for_every_set(seed, n, looks):
    problem = random_problem(seed, looks=looks)
    last = last_target(problem, share=0.5)
    good = large_bound(last, n_stations=n, work_limit=1e-3)
    rng = np.random.default_rng(seed)
    odd = rng.integers(0, 2**44 // 8, good.row_price.shape)
    margin = 2**44 - np.array([int(odd[0, last.rows_of(i)].sum()) for i in range(9)])
    price = int(rng.integers(1, 2**64, dtype=np.uint64)) // int(last.ticks.sum())
    nonsense = replace(good, row_price=odd, margin=margin, constraint_price=(price + 1,))
    best = best_by_trial(problem, n)
    for prices in (good, nonsense):
        if prices.constraint_price[0] > 0:
            assert coverage_bound(last, prices, n) >= best, f"seed {seed}"


@pytest.mark.slow
def test_same_settings_give_the_same_set_on_device_and_host():
    problem = random_problem(11, n=20, r=100, density=0.15)
    limits = Proven(work_limit=0.01, n_walks=2)
    first, again = most_coverage(problem, 5, limits), most_coverage(problem, 5, limits)
    assert first == again


def test_start_that_covers_more_is_kept_and_stations_that_add_nothing_are_not():
    problem = random_problem(12, n=12)
    best = max(itertools.combinations(range(12), 3), key=lambda chosen: int(problem.covered(list(chosen))[-1]))
    none = Proven(work_limit=0.0)
    assert most_coverage(problem, 3, none, start=best).ticks == int(problem.covered(list(best))[-1])
    alone = CoverProblem(
        starts=np.array([0, 4, 5, 6]),
        row=np.array([0, 1, 2, 3, 1, 2]),
        ticks=np.full(4, 10),
        counts_for=np.ones((1, 4), dtype=bool),
        required=np.array([40]),
        least=np.array([40]),
    )
    found = most_coverage(alone, 3, LITTLE, start=[1, 2, 0])
    assert found.chosen == (0,)
    assert (found.fraction, found.bound_fraction, found.why_stopped) == (1.0, 1.0, "proven")


def test_interrupted_search_returns_the_set_it_has():
    problem = random_problem(13, n=40, r=400, density=0.08)

    def interrupt(event):
        raise KeyboardInterrupt

    found = most_coverage(problem, 6, Proven(work_limit=10.0), progress=interrupt)
    assert found.why_stopped == "interrupted"
    assert len(found.chosen) == 6
    assert found.ticks <= found.bound_ticks == found.whole_ticks


def test_given_stations_that_need_others_to_be_joined_get_them():
    # A chain 0 - 1 - 2 - 3: the ends need both between them.
    links = {0: [1], 1: [0, 2], 2: [1, 3], 3: [2]}
    network = Network(
        np.array([0, 1, 3, 5, 6]),
        np.array([c for i in range(4) for c in links[i]], dtype=np.int32),
        np.zeros(4, dtype=np.int32),
    )
    problem = random_problem(14, n=4)
    assert set(most_coverage(problem, 4, LITTLE, network=network, given=[0, 3]).chosen) == {0, 1, 2, 3}
    with pytest.raises(RequirementError, match="connect"):
        most_coverage(problem, 3, LITTLE, network=network, given=[0, 3])


def test_requests_that_make_no_sense_are_refused():
    problem = random_problem(15)
    other, _ = random_network(1, 5, loops=False)
    for words in (
        {"n_stations": 0},
        {"n_stations": 1, "given": [0, 1]},
        {"n_stations": 2, "given": [9]},
        {"n_stations": 2, "given": [1, 1]},
        {"n_stations": 2, "start": [0, 1, 2]},
        {"n_stations": 2, "network": other},
    ):
        with pytest.raises(RequirementError):
            most_coverage(problem, words.pop("n_stations"), LITTLE, **words)
    none = np.zeros(0, dtype=np.int64)
    bare = CoverProblem(problem.starts, problem.row, problem.ticks, problem.counts_for[:0], none, none)
    with pytest.raises(RequirementError, match="target"):
        most_coverage(bare, 2, LITTLE)
