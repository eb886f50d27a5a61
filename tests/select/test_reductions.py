"""Reductions of selection: the least number of stations stays, whatever is left out."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import problem_of

from planner_core.select.reductions import reduce_problem

SEEDS = st.integers(0, 2**32 - 1)


def random_problem(seed, *, n=7, r=10, n_constraints=2):
    """Sparse: candidates within others, rows of one candidate, rows of none, targets met by given candidates."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < rng.choice([0.15, 0.3])
    ticks, counts_for = rng.choice([0, 1, 3, 10], r), rng.random((n_constraints, r)) < 0.7
    whole = (counts_for * np.where(sees.any(axis=0), ticks, 0)).sum(axis=1)
    required = np.ceil(whole * rng.choice([0.3, 0.8, 1.0], n_constraints)).astype(np.int64)
    return problem_of(sees, ticks, counts_for, required, slack=rng.integers(0, 3, n_constraints))


def solutions(problem, required, given_ones=()):
    """All smallest sets that hold `given_ones` and meet `required`."""
    others = [c for c in range(problem.n_candidates) if c not in given_ones]
    for k in range(len(others) + 1):
        found = [
            (*given_ones, *more)
            for more in itertools.combinations(others, k)
            if (problem.covered([*given_ones, *more]) >= required).all()
        ]
        if found:
            return found
    raise AssertionError("all candidates together must do")


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_reduced_problem_has_the_same_optimum_for_required_and_for_least(seed):
    problem = random_problem(seed)
    given_ones = tuple(range(seed % 3))
    reduced = reduce_problem(problem, given=given_ones)
    assert reduced.forced[: len(given_ones)] == given_ones
    for name in ("required", "least"):
        whole = solutions(problem, getattr(problem, name), given_ones)
        part = solutions(reduced.problem, getattr(reduced.problem, name))
        assert len(part[0]) + len(reduced.forced) == len(whole[0]), f"seed {seed}, {name}"
        for chosen in part:
            back = reduced.whole(chosen)
            assert len(set(back)) == len(back) == len(whole[0])
            assert (problem.covered(list(back)) >= getattr(problem, name)).all(), f"seed {seed}, {name}"


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_reducing_again_finds_nothing_more(seed):
    reduced = reduce_problem(random_problem(seed)).problem
    again = reduce_problem(reduced)
    assert (again.problem.n_candidates, again.problem.n_rows, again.forced) == (
        reduced.n_candidates,
        reduced.n_rows,
        (),
    )


def one_target(rows_of, ticks, required):
    sees = [np.isin(np.arange(len(ticks)), rows) for rows in rows_of]
    return problem_of(sees, ticks, np.ones((1, len(ticks))), [required])


def test_candidate_within_another_goes_and_of_equals_the_first_stays():
    # 0, 1, 2 in a ring, any two will do; 3 lies in 0, 4 equals 1.
    reduced = reduce_problem(one_target([[0, 1], [1, 2], [0, 2], [0], [1, 2]], [1, 1, 1], 3))
    assert reduced.candidate.tolist() == [0, 1, 2]
    assert reduced.n_dominated == 2


def test_candidate_that_alone_sees_too_much_is_forced_and_rows_that_become_equal_merge():
    # Without 0 only 6 of 15 can be had; what is left asks 1 tick of rows 2 and 3, which 1 and 2 both see.
    reduced = reduce_problem(one_target([[0, 1], [2, 3, 4], [2, 3, 5]], [4, 5, 1, 1, 2, 2], 12))
    assert reduced.forced == (0,)
    assert reduced.problem.n_candidates == 2
    assert sorted(reduced.problem.ticks.tolist()) == [2, 2, 2]
    assert reduced.problem.required.tolist() == [3]


def test_problem_solved_by_given_candidates_has_nothing_left():
    reduced = reduce_problem(one_target([[0, 1], [1, 2]], [1, 1, 1], 2), given=(0,))
    assert (reduced.problem.n_candidates, reduced.problem.n_rows, reduced.forced) == (0, 0, (0,))
