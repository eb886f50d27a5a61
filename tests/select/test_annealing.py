"""Annealing of station sets against NumPy, what sets miss against its definition."""

import numpy as np
import pytest
from numpy_annealer import NumpyAnnealer
from selection_instances import problem_of

from planner_core.select.annealing import Annealer
from planner_core.select.annealing_problem import AnnealingProblem, acceptance_table, nearest_candidates, temperatures
from planner_core.select.greedy import select_greedy


def random_problem(seed, *, n=40, r=200, n_constraints=3):
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < 0.1
    ticks, counts_for = rng.integers(0, 10**9, r), rng.random((n_constraints, r)) < 0.6
    whole = (counts_for * np.where(sees.any(axis=0), ticks, 0)).sum(axis=1)
    required = (whole * 0.9).astype(np.int64)
    return problem_of(sees, ticks, counts_for, required)


def first_sets(problem, size, n_sets=3):
    rng = np.random.default_rng(1)
    return np.array([rng.permutation(problem.n_candidates)[:size] for _ in range(n_sets)], dtype=np.int32)


@pytest.mark.parametrize("shape", [(40, 200, 3), (2, 5, 1), (30, 64, 5), (300, 30, 2)])
@pytest.mark.parametrize("size", [1, 12])
def test_annealing_takes_the_steps_of_numpy(shape, size):
    n, r, n_constraints = shape
    problem = random_problem(7, n=n, r=r, n_constraints=n_constraints)
    size = min(size, n - 1)
    annealed = AnnealingProblem(problem, seed=2**63 + 5)
    ours, theirs = first_sets(problem, size), first_sets(problem, size)
    for steps in ((0, 60), (60, 150)):
        a = Annealer(annealed).anneal(ours, round_=3, steps=steps, n_steps=150)
        b = NumpyAnnealer(annealed).anneal(theirs, round_=3, steps=steps, n_steps=150)
        assert np.array_equal(ours, theirs)
        assert np.array_equal(a, b)


@pytest.mark.slow
def test_annealing_takes_more_classes_of_rows_than_a_byte_counts():
    # Every row is counted by a target of its own, and all by one.
    n_rows = 300
    rng = np.random.default_rng(2)
    sees = rng.random((40, n_rows)) < 0.1
    counts_for = np.concatenate([np.eye(n_rows, dtype=bool), np.ones((1, n_rows), dtype=bool)])
    ticks = rng.integers(1, 10**9, n_rows)
    required = (counts_for * np.where(sees.any(axis=0), ticks, 0)).sum(axis=1)
    problem = problem_of(sees, ticks, counts_for, required)
    annealed = AnnealingProblem(problem, seed=4)
    assert annealed.counts.shape[1] == n_rows
    ours, theirs = first_sets(problem, 12), first_sets(problem, 12)
    a = Annealer(annealed).anneal(ours, round_=1, steps=(0, 40), n_steps=40)
    b = NumpyAnnealer(annealed).anneal(theirs, round_=1, steps=(0, 40), n_steps=40)
    assert np.array_equal(ours, theirs)
    assert np.array_equal(a, b)
    for chosen, left in zip(ours, a, strict=True):
        assert int(np.maximum(required - problem.covered(chosen.tolist()), 0).sum()) == left


def test_annealing_reports_what_sets_miss_and_keeps_them_sets():
    problem = random_problem(3)
    sets = first_sets(problem, 14)
    missing = Annealer(AnnealingProblem(problem, seed=1)).anneal(sets, round_=0, steps=(0, 2000), n_steps=2000)
    for chosen, left in zip(sets, missing, strict=True):
        assert len(set(chosen.tolist())) == 14
        assert int(np.maximum(problem.required - problem.covered(chosen.tolist()), 0).sum()) == left


def test_annealing_in_pieces_ends_where_it_ends_in_one_piece():
    problem = random_problem(4)
    annealer = Annealer(AnnealingProblem(problem, seed=1))
    whole, pieces = first_sets(problem, 9), first_sets(problem, 9)
    annealer.anneal(whole, round_=1, steps=(0, 900), n_steps=900)
    for first in range(0, 900, 300):
        annealer.anneal(pieces, round_=1, steps=(first, first + 300), n_steps=900)
    assert np.array_equal(whole, pieces)


def test_annealing_differs_between_sets_rounds_and_seeds():
    problem = random_problem(5)
    same = np.repeat(first_sets(problem, 9, n_sets=1), 3, axis=0)
    ends = []
    for seed, round_ in ((1, 1), (1, 2), (2, 1)):
        sets = same.copy()
        Annealer(AnnealingProblem(problem, seed=seed)).anneal(sets, round_=round_, steps=(0, 300), n_steps=300)
        ends += [tuple(chosen) for chosen in sets.tolist()]
    assert len(set(ends)) == len(ends)


@pytest.mark.slow
def test_annealing_finds_a_hidden_cover_that_greedy_does_not():
    # Eight candidates part the rows among them; decoys see a little of several, and greedy selection takes them.
    rng = np.random.default_rng(0)
    r, k = 160, 8
    parts = np.repeat(np.eye(k, dtype=bool), r // k, axis=1)
    decoys = rng.random((60, r)) < 0.11
    sees = np.concatenate([decoys, parts])
    problem = problem_of(sees, np.ones(r, dtype=np.int64), np.ones((1, r), dtype=bool), [r])
    assert len(select_greedy(problem).chosen) > k
    sets = first_sets(problem, k)
    missing = Annealer(AnnealingProblem(problem, seed=0)).anneal(sets, round_=0, steps=(0, 20_000), n_steps=20_000)
    assert missing.min() == 0
    assert sorted(sets[int(np.argmin(missing))].tolist()) == list(range(60, 68))


def test_acceptance_is_exponential_and_the_temperature_falls_to_a_fiftieth():
    assert abs(float(acceptance_table().mean()) / 65536 - 1) < 2e-3
    assert (np.diff(acceptance_table().astype(np.int64)) < 0).all()
    falling = temperatures(10**12)
    assert falling[0] == 10**12 // 20 and (np.diff(falling) < 0).all()
    assert 0.018 < falling[-1] / falling[0] < 0.022


def test_nearest_candidates_share_most():
    problem = random_problem(6, n=30, r=90)
    rows = [set(problem.rows_of(c).tolist()) for c in range(30)]
    nearest = nearest_candidates(problem, 5)
    for c in range(30):
        share = {o: len(rows[c] & rows[o]) / max(len(rows[c] | rows[o]), 1) for o in range(30) if o != c}
        expected = sorted(share, key=lambda o: (-np.float32(share[o]), o))[:5]
        assert nearest[c].tolist() == expected
