"""Selection of joined networks, and of more than one look, against exhaustive search."""

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import hangs_together, network_of, problem_of, random_network

from planner_core.errors import RequirementError
from planner_core.model import Proven, Visibility
from planner_core.select.check import SelectionCheckError, check_coverage, check_selection
from planner_core.select.greedy import drop_redundant, select_greedy
from planner_core.select.network import connect
from planner_core.select.problem import Constraint, cover_problem
from planner_core.select.proven import select
from planner_core.select.reductions import reduce_problem

SEEDS = st.integers(0, 2**32 - 1)
QUICK = Proven(work_limit=0.1, n_walks=1)


def random_problem(seed, *, n=8, r=14, seen_from=(1, 1)):
    """Targets that overlap, ties, rows nobody sees, targets that require nothing or everything."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < rng.choice([0.15, 0.3, 0.5])
    ticks = rng.choice([0, 1, 2, 5, 1000], r)
    counts_for = (rng.random((len(seen_from), r)) < 0.7) & (sees.sum(axis=0) >= np.array(seen_from)[:, None])
    whole = (counts_for * ticks).sum(axis=1)
    required = np.ceil(whole * rng.choice([0.0, 0.5, 0.9, 1.0], len(seen_from))).astype(np.int64)
    return problem_of(sees, ticks, counts_for, required, slack=int(rng.integers(0, 2)), seen_from=seen_from)


def meets(problem, chosen, required):
    """Oracle, in Python's own numbers."""
    looks = [sum(r in problem.rows_of(c) for c in chosen) for r in range(problem.n_rows)]
    return all(
        sum(int(problem.ticks[r]) for r in range(problem.n_rows) if problem.counts_for[k, r] and looks[r] >= m)
        >= required[k]
        for k, m in enumerate(problem.seen_from)
    )


def fewest(problem, required, network=None, given=()):
    """Size of the smallest of all subsets that do."""
    n = problem.n_candidates
    sees = np.zeros((n, problem.n_rows), dtype=np.int64)
    for candidate in range(n):
        sees[candidate, problem.rows_of(candidate)] = 1
    sets = np.array(list(itertools.product((0, 1), repeat=n)))
    sets = sets[(sets[:, list(given)] == 1).all(axis=1)]
    sets = sets[np.argsort(sets.sum(axis=1), kind="stable")]
    enough = (sets @ sees)[:, None, :] >= problem.seen_from[:, None]
    met = ((enough & problem.counts_for) @ problem.ticks >= required).all(axis=1)
    return next(int(x.sum()) for x in sets[met] if hangs_together(network, np.flatnonzero(x).tolist()))


# ------------------------------------------------------------------------------------------ more than one look
@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(2, 2), (2, 1), (3, 1), (1, 2)]))
def test_selection_of_several_looks_finds_what_exhaustive_search_finds(seed, seen_from):
    problem = random_problem(seed, seen_from=seen_from)
    result = select(problem, QUICK)
    assert meets(problem, result.chosen, problem.required), f"seed {seed}"
    assert result.lower_bound <= fewest(problem, problem.least), f"seed {seed}"
    assert len(result.chosen) == fewest(problem, problem.required), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(2, 2), (3, 1)]))
def test_greedy_selection_of_several_looks_meets_the_targets_and_needs_every_station(seed, seen_from):
    problem = random_problem(seed, n=12, r=40, seen_from=seen_from)
    given_ones = [int(c) for c in np.random.default_rng(seed).permutation(12)[: seed % 3]]
    chosen = list(select_greedy(problem, given=given_ones).chosen)
    assert chosen[: len(given_ones)] == given_ones
    assert meets(problem, chosen, problem.required), f"seed {seed}"
    for station in chosen[len(given_ones) :]:
        assert not meets(problem, [c for c in chosen if c != station], problem.required), f"seed {seed}: {station}"


def plain_greedy(problem):
    """Every gain of every candidate in every round, from the definition at the head of greedy.py."""
    chosen = []
    while not meets(problem, chosen, problem.required):
        looks = problem.times_seen(chosen)
        gains = []
        for c in set(range(problem.n_candidates)) - set(chosen):
            sees = np.isin(np.arange(problem.n_rows), problem.rows_of(c))
            gain = whole = 0
            for k, m in enumerate(problem.seen_from):
                added = int((problem.counts_for[k] & sees & (looks < m)) @ problem.ticks)
                left = int(problem.required[k] - (problem.counts_for[k] & (looks >= m)) @ problem.ticks)
                whole += added
                gain += 0 if left <= 0 else min(added, left) if m == 1 else added
            gains.append((gain, whole, -c))
        chosen.append(-max(gains)[2])
    return chosen


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(2, 2), (2, 1), (3, 1)]))
def test_lazy_greedy_of_several_looks_chooses_what_plain_greedy_chooses(seed, seen_from):
    problem = random_problem(seed, n=15, r=60, seen_from=seen_from)
    assert list(select_greedy(problem).chosen) == drop_redundant(problem, plain_greedy(problem)), f"seed {seed}"


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_rows_alone_are_left_out_where_candidates_need_each_other(seed):
    problem = random_problem(seed, seen_from=(2, 1))
    given_ones = tuple(range(seed % 3))
    reduced = reduce_problem(problem, given=given_ones)
    assert reduced.pinned[: len(given_ones)] == given_ones and reduced.forced == ()
    assert reduced.candidate.tolist() == list(range(problem.n_candidates))
    for name in ("required", "least"):
        required = getattr(problem, name)
        whole = fewest(problem, required, given=given_ones)
        assert fewest(reduced.problem, getattr(reduced.problem, name), given=reduced.pinned) == whole, f"seed {seed}"


def test_candidates_whose_looks_nobody_else_has_are_pinned_and_given_ones_come_first():
    # Row 0 needs two looks and has just 1 and 3; all of it is required.
    problem = problem_of([[0, 1], [1, 1], [0, 1], [1, 0]], [5, 5], [[1, 1]], [10], seen_from=[2])
    assert reduce_problem(problem).pinned == (1, 3)
    assert reduce_problem(problem, given=(2, 3)).pinned == (2, 3, 1)


def test_target_of_two_looks_counts_what_two_candidates_see_as_achievable():
    # Patch 0 by one, 1 by two, 2 by three; 3 by nobody.
    visibility = Visibility(np.array([0, 3, 5, 6]), np.array([0, 1, 2, 1, 2, 2], dtype=np.int32), 4)
    everything = np.ones(4, dtype=bool)
    constraints = (Constraint(everything, 1.0, 2), Constraint(everything, 1.0, 3), Constraint(everything, 1.0))
    problem = cover_problem(visibility, np.array([1.0, 2.0, 4.0, 8.0]), constraints)
    assert problem.required.tolist() == [6 * 10**9, 4 * 10**9, 7 * 10**9]
    assert problem.covered([0, 1]).tolist() == [6 * 10**9, 0, 7 * 10**9]
    check_coverage(visibility, np.array([1.0, 2.0, 4.0, 8.0]), constraints, [0, 1, 2])
    with pytest.raises(SelectionCheckError, match="constraint 1"):
        check_coverage(visibility, np.array([1.0, 2.0, 4.0, 8.0]), constraints, [0, 1])
    with pytest.raises(SelectionCheckError, match="constraint 1"):
        check_selection(problem, [0, 1])


def test_looks_that_make_no_sense_are_refused():
    with pytest.raises(RequirementError, match="seen from"):
        cover_problem(
            Visibility(np.array([0, 1]), np.array([0], dtype=np.int32), 1),
            np.ones(1),
            (Constraint(np.array([True]), 1, 0),),
        )
    with pytest.raises(RequirementError, match="seen from"):
        problem_of([[1]], [1], [[1]], [1], seen_from=[1, 1])


# --------------------------------------------------------------------------------------------------- networks
@settings(max_examples=10, deadline=None)
@given(SEEDS, st.booleans(), st.sampled_from([0.1, 0.25, 0.5]), st.integers(0, 2))
def test_selection_with_a_network_finds_what_exhaustive_search_finds(seed, loops, share, n_given):
    problem = random_problem(seed, seen_from=(1, 1 + seed % 2))
    network = random_network(seed + 1, 8, share=share, loops=loops)
    given_ones = tuple(int(c) for c in np.random.default_rng(seed).permutation(8)[:n_given])
    result = select(problem, QUICK, network=network, given=given_ones)
    assert set(given_ones) <= set(result.chosen)
    assert meets(problem, result.chosen, problem.required), f"seed {seed}"
    assert hangs_together(network, result.chosen), f"seed {seed}"
    assert result.lower_bound <= fewest(problem, problem.least, network, given_ones), f"seed {seed}"
    assert len(result.chosen) == fewest(problem, problem.required, network, given_ones), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans(), st.sampled_from([0.05, 0.1, 0.2]))
def test_any_set_can_be_joined_and_nothing_spare_stays(seed, loops, share):
    problem = random_problem(seed, n=18, r=30)
    network = random_network(seed, 18, share=share, loops=loops)
    start = select_greedy(problem).chosen
    whole = connect(problem, network, start)
    assert whole[: len(start)] == list(start) and len(set(whole)) == len(whole)
    assert hangs_together(network, whole), f"seed {seed}"
    kept = drop_redundant(problem, whole, given=start[:1], network=network)
    assert set(start[:1]) <= set(kept)
    assert hangs_together(network, kept) and meets(problem, kept, problem.required), f"seed {seed}"
    for station in set(kept) - set(start[:1]):
        rest = [c for c in kept if c != station]
        assert not (hangs_together(network, rest) and meets(problem, rest, problem.required)), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([0.03, 0.06, 0.1]))
def test_two_stations_are_joined_by_as_few_as_a_shortest_path_has(seed, share):
    problem, network = random_problem(seed, n=40, r=30), random_network(seed, 40, share=share)
    graph = nx.Graph((a, int(b)) for a in range(40) for b in network.neighbours(a))
    graph.add_nodes_from(range(40))
    a, b = np.random.default_rng(seed).choice(40, 2, replace=False).tolist()
    expected = len(nx.shortest_path(graph, a, b)) if nx.has_path(graph, a, b) else 2
    whole = connect(problem, network, [a, b])
    assert len(whole) == expected, f"seed {seed}"
    assert hangs_together(network, whole), f"seed {seed}"


def test_a_way_between_two_stations_is_the_shortest_and_of_equals_that_which_sees_more():
    # 0 and 5 apart; over 1, 2 or over 3, 4, or over 6, 7, 8. 4 sees what nobody else does.
    graph = nx.Graph()
    graph.add_nodes_from(range(9))
    graph.add_edges_from([(0, 1), (1, 2), (2, 5), (0, 3), (3, 4), (4, 5), (0, 6), (6, 7), (7, 8), (8, 5)])
    sees = np.zeros((9, 3), dtype=bool)
    sees[[0, 5, 4], [0, 1, 2]] = True
    problem = problem_of(sees, [4, 4, 1], np.ones((1, 3)), [8])
    assert sorted(connect(problem, network_of(graph), [0, 5])) == [0, 3, 4, 5]


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans())
def test_check_refuses_just_the_sets_that_do_not_hang_together(seed, loops):
    network = random_network(seed, 9, share=0.3, loops=loops)
    problem = problem_of(np.ones((9, 1)), [1], np.ones((1, 1)), [0])
    for size in range(1, 9):
        chosen = [int(c) for c in np.random.default_rng(seed + size).permutation(9)[:size]]
        if hangs_together(network, chosen):
            check_selection(problem, chosen, network=network)
        else:
            with pytest.raises(SelectionCheckError, match="connected by"):
                check_selection(problem, chosen, network=network)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans(), st.sampled_from([0.1, 0.3]))
def test_candidates_complete_a_set_just_where_it_hangs_together_with_them(seed, loops, share):
    network = random_network(seed, 9, share=share, loops=loops)
    order = [int(c) for c in np.random.default_rng(seed).permutation(9)]
    for size in range(9):
        rest, others = order[:size], order[size:]
        completes = network.completes(rest)
        assert [completes(one) for one in others] == [hangs_together(network, [*rest, one]) for one in others]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans(), st.sampled_from([0.1, 0.2, 0.3]))
def test_a_set_can_spare_just_those_without_whom_it_hangs_together(seed, loops, share):
    network = random_network(seed, 12, share=share, loops=loops)
    order = [int(c) for c in np.random.default_rng(seed).permutation(12)]
    for size in range(1, 13):
        chosen = order[:size]
        can_spare = network.can_spare(chosen)
        rests = [[*chosen[:place], *chosen[place + 1 :]] for place in range(size)]
        assert [can_spare(place) for place in range(size)] == [hangs_together(network, rest) for rest in rests]


def test_a_start_that_is_not_joined_is_joined_and_network_and_host_agree():
    problem = random_problem(5, n=14, r=40, seen_from=(1, 2))
    network = random_network(6, 14, share=0.2)
    quick = Proven(work_limit=0.02, n_walks=1)
    start = select_greedy(problem).chosen
    one = select(problem, quick, network=network, start=start)
    assert one == select(problem, quick, network=network, start=start)
    again = select(problem, Proven(work_limit=0.0), network=network, start=one.chosen)
    assert len(again.chosen) <= len(one.chosen)


def test_bound_counts_given_candidates_that_add_nothing():
    # 0 sees all; 3 sees nothing, hangs on 2, and that on 0.
    graph = nx.path_graph(4)
    graph.add_edge(0, 2)
    problem = problem_of([[1, 1], [1, 0], [0, 1], [0, 0]], [1, 1], [[1, 1]], [2])
    result = select(problem, QUICK, network=network_of(graph), given=(3,))
    assert result.proven and result.lower_bound == 3
    assert result.chosen[0] == 3 and set(result.chosen) in ({3, 2, 0}, {3, 2, 1})


def test_a_network_of_other_candidates_is_refused():
    with pytest.raises(RequirementError, match="network: got one of 7"):
        select(random_problem(0), network=random_network(0, 7))
