"""Separators: every joined set that meets the targets satisfies what they say; they say more than coverage alone."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from joined_instances import points, random_problem, solutions, sparse_graph
from selection_instances import network_of, problem_of

from planner_core.select import branching
from planner_core.select.branching import BranchAndBound
from planner_core.select.check import check_selection
from planner_core.select.relaxation import BOUND_UNIT, CutMaker, CutProgram, exact_bound
from planner_core.select.separators import Separators

SEEDS = st.integers(0, 2**32 - 1)


def rooms_on_a_corridor(n_rooms=4):
    """Rooms of three places, of which the one at the door sees little and is the only one linked to the corridor.

    Each room has six rows, each seen from one of its two inner places; the corridor has eight places in a line, with
    two rows each.
    """
    graph, sees = nx.path_graph(2 * n_rooms), []
    n_rows = 6 * n_rooms + 4 * n_rooms
    for place in range(2 * n_rooms):
        sees.append({6 * n_rooms + 2 * place, 6 * n_rooms + 2 * place + 1})
    for room in range(n_rooms):
        door, one, other = range(len(sees), len(sees) + 3)
        graph.add_edges_from([(2 * room, door), (door, one), (door, other), (one, other)])
        rows = list(range(6 * room, 6 * room + 6))
        sees += [{rows[0]}, set(rows[:4]), set(rows[2:])]
    matrix = np.zeros((len(sees), n_rows), dtype=bool)
    for number, rows in enumerate(sees):
        matrix[number, list(rows)] = True
    ticks = np.full(n_rows, 10)
    least = np.array([int(0.8 * ticks.sum())])
    return problem_of(matrix, ticks, np.ones((1, n_rows), dtype=bool), least, seen_from=[1]), graph


def relaxed(problem, separators):
    """Value of the relaxation by cuts, to the end, with and without."""
    maker, program = CutMaker(problem), CutProgram(problem.n_candidates, slack_price=100.0)
    none, all_ = np.zeros(problem.n_candidates, dtype=np.int64), np.ones(problem.n_candidates, dtype=np.int64)
    program.set_range(none, all_)
    best = 0
    for _ in range(200):
        x, price = program.solve()
        best = max(best, exact_bound(program.cuts, program.right, price, none, all_, program.most).scaled)
        cuts = separators.sweep(x) if separators is not None else []
        cuts += maker.violated(x, separators.through(x) if separators is not None else None)
        if not cuts:
            break
        program.add(cuts)
    return best / BOUND_UNIT


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(SEEDS, st.integers(1, 2), st.sampled_from([0.5, 0.7, 0.9]), st.booleans(), st.integers(1, 2))
def test_what_separators_say_holds_for_every_joined_set_that_meets_the_targets(seed, n_parts, share, loops, seen_from):
    rng = np.random.default_rng(seed)
    graph = sparse_graph(rng, 9, n_parts=n_parts, more=0.3)
    problem = random_problem(rng, 9, share=share, seen_from=seen_from)
    maker, found = CutMaker(problem), solutions(problem, graph, loops=loops)
    separators = Separators(maker, network_of(graph, loops=loops))
    for x in points(rng, 9):
        for cut in separators.sweep(x):
            assert float(cut.coefficient @ x) < cut.right, f"seed {seed}: not violated"
            assert (found @ cut.coefficient >= cut.right).all(), f"seed {seed}: {cut}"
        for cut in maker.violated(x, separators.through(x)):
            assert (found @ cut.coefficient >= cut.right).all(), f"seed {seed}: {cut}"
    for chosen in found:  # the rows of each
        rows = np.unique(
            np.concatenate([problem.rows_of(int(i)) for i in np.flatnonzero(chosen)] or [np.zeros(0, int)])
        )
        for between, bounded in zip(separators.between, separators._rows, strict=True):
            assert chosen[between].sum() >= 1 or not np.isin(rows, bounded).any(), f"seed {seed}"


def test_both_kinds_turn_up_in_such_checks():
    n_cuts = n_kept = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        graph, problem = sparse_graph(rng, 10, n_parts=1, more=0.3), random_problem(rng, 10, share=0.7)
        separators = Separators(CutMaker(problem), network_of(graph))
        n_cuts += sum(len(separators.sweep(x)) for x in points(rng, 10))
        n_kept += len(separators.between)
    assert n_cuts > 10
    assert n_kept > 10


@pytest.mark.slow
def test_doors_raise_the_relaxation_of_rooms_on_a_corridor():
    problem, graph = rooms_on_a_corridor()
    separators = Separators(CutMaker(problem), network_of(graph))
    plain, with_doors = relaxed(problem, None), relaxed(problem, separators)
    tree = BranchAndBound(problem, n_stations=problem.n_candidates, network=network_of(graph))
    tree.root()
    tree.advance(work=30)
    check_selection(problem, tree.best, network=network_of(graph))  # a plan, whatever the tree made of its cuts
    assert plain + 1 <= with_doors <= len(tree.best)


@pytest.mark.slow
def test_nodes_look_for_separators_where_the_root_did_not(monkeypatch):
    problem, graph = rooms_on_a_corridor(6)
    n_nodes, bounds = [], []
    for n_sweeps in (0, branching._NODE_SWEEPS):
        monkeypatch.setattr(branching, "_NODE_SWEEPS", n_sweeps)
        tree = BranchAndBound(problem, n_stations=problem.n_candidates, network=network_of(graph))
        tree.root(sweeping=0.0)
        tree.advance(work=60)
        assert tree.finished
        n_nodes.append(tree.n_nodes)
        bounds.append(tree.lower_bound)
    assert bounds[0] == bounds[1] == len(tree.best)
    assert n_nodes[1] < n_nodes[0] / 2


def test_sweeps_give_the_same_on_every_run_and_nothing_twice():
    problem, graph = rooms_on_a_corridor()
    x = np.full(problem.n_candidates, 0.4)
    runs = [Separators(CutMaker(problem), network_of(graph)) for _ in range(2)]
    first, second = ([cut.coefficient.tolist() for cut in each.sweep(x)] for each in runs)
    assert first == second
    assert [b.tolist() for b in runs[0].between] == [b.tolist() for b in runs[1].between]
    assert runs[0].between
    n_before = len(runs[0].between)
    assert not runs[0].sweep(x)
    assert len(runs[0].between) == n_before


@pytest.mark.parametrize("value", [1.0, 0.2])
def test_least_of_several_separators_bounds_a_row(value):
    problem, graph = rooms_on_a_corridor()
    separators = Separators(CutMaker(problem), network_of(graph))
    separators.sweep(np.full(problem.n_candidates, 0.4))
    x = np.full(problem.n_candidates, value)
    through = separators.through(x)
    for row in range(problem.n_rows):
        values = [x[b].sum() for b, rows in zip(separators.between, separators._rows, strict=True) if row in rows]
        least = min([1.0, *values])
        assert through.part[row] == pytest.approx(least)
        assert (through.number[row] >= 0) == (least < 1.0)
