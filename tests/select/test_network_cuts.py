"""Cuts that join: every joined set satisfies them, no other whole point does, and the tree proves joined plans."""

import pickle

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import hangs_together, points, random_problem, solutions, sparse_graph
from selection_instances import network_of

from planner_core.select.branching import BranchAndBound
from planner_core.select.network_cuts import NetworkCuts, least_cut
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import CUT_UNIT, CutMaker, CutProgram

SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(SEEDS, st.integers(1, 2), st.sampled_from([0.3, 0.6, 0.9]), st.booleans())
def test_network_cuts_hold_for_every_solution_that_hangs_together(seed, n_parts, share, loops):
    rng = np.random.default_rng(seed)
    graph, problem = sparse_graph(rng, 9, n_parts=n_parts, more=0.8), random_problem(rng, 9, share=share)
    cuts = NetworkCuts(network_of(graph, loops=loops), CutMaker(problem).reaches)
    found = solutions(problem, graph, loops=loops)
    for x in [x for _ in range(5) for x in points(rng, 9)]:
        for cut in cuts.violated(x):
            assert float(cut.coefficient @ x) < cut.right, f"seed {seed}: not violated"
            assert (found @ cut.coefficient >= cut.right).all(), f"seed {seed}: {cut}"


@pytest.mark.slow
def test_all_kinds_of_cuts_turn_up_in_such_checks():
    kinds = set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        graph, problem = (
            sparse_graph(rng, 9, n_parts=1, more=0.8),
            random_problem(rng, 9, share=float(rng.choice([0.2, 0.6]))),
        )
        cuts = NetworkCuts(network_of(graph, loops=True), CutMaker(problem).reaches)
        for cut in [cut for x in points(rng, 9) for cut in cuts.violated(x)]:
            kinds.add((cut.right / CUT_UNIT, cut.coefficient.max() / CUT_UNIT))
    assert kinds == {(1, 1), (0, 1), (-1, 1), (-2, 1), (-1, 0.5), (0, 0.5)}


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 3), st.booleans())
def test_whole_points_are_cut_off_exactly_where_they_do_not_hang_together(seed, n_parts, loops):
    rng = np.random.default_rng(seed)
    graph, problem = sparse_graph(rng, 14, n_parts=n_parts, more=0.8), random_problem(rng, 14, share=0.5)
    cuts = NetworkCuts(network_of(graph, loops=loops), CutMaker(problem).reaches)
    x = (rng.random(14) < rng.choice([0.3, 0.7])).astype(float)
    chosen = np.flatnonzero(x).tolist()
    found = cuts.violated(x)
    if not hangs_together(graph, chosen, loops=loops):
        assert found, f"seed {seed}"
    elif (problem.covered(chosen) >= problem.least).all():
        assert not found, f"seed {seed}"


def test_flows_find_a_cut_that_no_piece_shows():
    # Two stations of 1 and two ways between them, 0.2 each: everything is connected at 1e-6, nothing at 0.4.
    graph = nx.Graph([(0, 2), (2, 1), (0, 3), (3, 1)])
    cuts = NetworkCuts(network_of(graph), lambda allowed: bool(allowed[[0, 1]].all()))
    x = np.array([1.0, 1.0, 0.2, 0.2])
    (by_flow,) = cuts._by_flow(x, np.ones(4, dtype=bool))
    assert by_flow.coefficient.tolist() == [0, 0, 2**24, 2**24]
    assert by_flow.right == 2**24


def test_what_was_worked_out_from_a_network_does_not_travel():
    """Else the same question would have another key after its use."""
    network = network_of(nx.path_graph(4))
    fresh = pickle.dumps(network)
    assert (network.n_parts, network.graph.nnz, network.opposite.size, len(network.bridges)) == (1, 6, 6, 3)
    assert pickle.dumps(network) == fresh
    assert pickle.loads(fresh).opposite.tolist() == network.opposite.tolist()


def test_a_least_cut_of_one_and_more_is_none():
    """Nor are source and far candidate cut themselves where they are to stay whole."""
    network, inside = network_of(nx.Graph([(0, 1), (1, 2), (2, 3)])), np.ones(4, dtype=bool)
    source, far = inside & [True, False, False, False], inside & [False, False, False, True]
    for through, whole, expected in [(0.75, True, [0, 1, 0, 0]), (0.75, False, [1, 0, 0, 0]), (1.0, True, None)]:
        found = least_cut(network, np.array([0.5, through, through, 0.5]), inside, source, far, whole=whole)
        assert found is None if expected is None else found[1].tolist() == list(map(bool, expected))


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 2), st.integers(1, 2), st.booleans())
def test_tree_with_network_ends_at_the_smallest_set_that_hangs_together(seed, n_parts, seen_from, loops):
    rng = np.random.default_rng(seed)
    graph = sparse_graph(rng, 9, n_parts=n_parts, more=0.8 if loops else 0.4)
    problem = random_problem(rng, 9, seen_from=seen_from, share=0.85)
    optimum = int(solutions(problem, graph, loops=loops).sum(axis=1).min())
    tree = BranchAndBound(problem, n_stations=10, network=network_of(graph, loops=loops))
    tree.root()
    assert tree.lower_bound <= optimum, f"seed {seed}"
    while not tree.finished:
        tree.advance(work=1e-4)
        assert tree.lower_bound <= optimum, f"seed {seed}"
    assert tree.lower_bound == optimum == tree.n_stations, f"seed {seed}"
    assert hangs_together(graph, tree.best, loops=loops), f"seed {seed}"
    assert (problem.covered(list(tree.best)) >= problem.required).all()


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_given_candidates_are_in_every_plan_of_the_tree(seed):
    rng = np.random.default_rng(seed)
    graph, problem = sparse_graph(rng, 9, n_parts=1), random_problem(rng, 9, share=0.7)
    fixed = rng.choice(9, 2, replace=False).tolist()
    found = solutions(problem, graph)
    optimum = int(found[found[:, fixed].all(axis=1)].sum(axis=1).min())
    tree = BranchAndBound(problem, n_stations=10, network=network_of(graph), given=fixed)
    tree.root()
    while not tree.finished:
        tree.advance(work=1e-4)
    assert tree.lower_bound == optimum == tree.n_stations, f"seed {seed}"
    assert set(fixed) <= set(tree.best)


def test_joining_raises_the_bound_where_coverage_alone_is_cheap():
    # A row at each end of a path: two stations see both, all have to be there to join them.
    graph = nx.path_graph(7)
    problem = CoverProblem(
        starts=np.array([0, 1, 1, 1, 1, 1, 1, 2]),
        row=np.array([0, 1]),
        ticks=np.array([1, 1]),
        counts_for=np.ones((1, 2), dtype=bool),
        required=np.array([2]),
        least=np.array([2]),
    )
    alone, joined = (
        BranchAndBound(problem, n_stations=8),
        BranchAndBound(problem, n_stations=8, network=network_of(graph)),
    )
    alone.root()
    joined.root()
    assert (alone.lower_bound, joined.lower_bound) == (2, 7)


@pytest.mark.slow
def test_nonsense_of_the_solver_leaves_the_bound_with_network_valid(monkeypatch):
    rng = np.random.default_rng(0)

    def nonsense(self):
        return rng.random(self.n_candidates), rng.normal(0, 3, len(self.cuts))

    monkeypatch.setattr(CutProgram, "solve", nonsense)
    for seed in range(6):
        of_seed = np.random.default_rng(seed)
        graph, problem = sparse_graph(of_seed, 9, n_parts=1), random_problem(of_seed, 9)
        tree = BranchAndBound(problem, n_stations=9, network=network_of(graph))
        tree.root()
        tree.advance(work=1e-3)
        assert tree.lower_bound <= solutions(problem, graph).sum(axis=1).min(), f"seed {seed}"


def test_cuts_of_networks_are_the_same_on_a_second_run():
    rng = np.random.default_rng(3)
    graph, problem = sparse_graph(rng, 40, n_parts=2), random_problem(rng, 40, r=120)
    x = rng.random(40) * (rng.random(40) < 0.6)
    runs = [NetworkCuts(network_of(graph), CutMaker(problem).reaches).violated(x) for _ in range(2)]
    assert len(runs[0]) > 0
    for first, second in zip(*runs, strict=True):
        assert (first.coefficient == second.coefficient).all()
        assert first.right == second.right


@pytest.mark.parametrize("inside", [[0, 6], [2]])
def test_only_what_can_be_joined_with_those_that_are_in_stays_allowed(inside):
    graph = nx.path_graph(7)
    cuts = NetworkCuts(network_of(graph), lambda allowed: True)
    lower, upper = np.zeros(7, dtype=np.int64), np.ones(7, dtype=np.int64)
    lower[inside], upper[4] = 1, 0
    keep = cuts.reachable(lower, upper)
    if inside == [0, 6]:
        assert keep is None
    else:
        assert keep.tolist() == [True] * 4 + [False] * 3
