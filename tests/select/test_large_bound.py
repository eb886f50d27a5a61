"""Bounds from prices: they hold for any prices, come near the linear relaxation, and leave better plans possible."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import every_solution, problem_of

from planner_core.select import primal_dual
from planner_core.select.attachments import attachment_modes
from planner_core.select.large_bound import large_bound, price_bound
from planner_core.select.relaxation import BOUND_UNIT, TARGET_UNIT

SEEDS = st.integers(0, 2**32 - 1)


def random_problem(seed, *, n=8, r=20, density=0.4, looks=(1, 1), large=False):
    """Two targets, the second of all rows; rows count where so many candidates see them as the target asks for."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < density
    ticks = rng.integers(1, 10**14 if large else 20, r)
    enough = sees.sum(axis=0) >= np.array(looks)[:, None]
    counts_for = np.array([rng.random(r) < 0.5, np.ones(r, dtype=bool)]) & enough
    whole = [sum(int(t) for t, c in zip(ticks, k, strict=True) if c) for k in counts_for]
    required = np.array([w * int(rng.integers(60, 100)) // 100 for w in whole], dtype=np.int64)
    return problem_of(sees, ticks, counts_for, required, seen_from=looks)


def matrix(problem):
    sees = np.zeros((problem.n_candidates, problem.n_rows))
    for candidate in range(problem.n_candidates):
        sees[candidate, problem.rows_of(candidate)] = 1
    return sees


def relaxation(problem, lower):
    """Value of the linear relaxation, by HiGHS: x, and z for each number of looks."""
    from scipy.optimize import linprog

    n, r = problem.n_candidates, problem.n_rows
    times = np.unique(problem.seen_from)
    sees = matrix(problem).T
    seen = np.concatenate([np.hstack([-sees, *((m if m == each else 0) * np.eye(r) for each in times)]) for m in times])
    met = np.array(
        [
            np.concatenate([np.zeros(n), *(-(counted * problem.ticks) * (m == looks) for m in times)])
            for counted, looks in zip(problem.counts_for, problem.seen_from, strict=True)
        ]
    )
    n_z = times.size * r
    found = linprog(
        np.append(np.ones(n), np.zeros(n_z)),
        A_ub=np.vstack([seen, met]),
        b_ub=np.concatenate([np.zeros(n_z), -problem.least]),
        bounds=[*((each, 1) for each in lower), *((0, 1) for _ in range(n_z))],
    )
    return found.fun


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(1, 1), (2, 1), (2, 3)]), st.booleans())
def test_bound_of_any_prices_is_that_of_the_formula_and_no_solution_is_smaller(seed, looks, large):
    problem = random_problem(seed, looks=looks, large=large)
    rng = np.random.default_rng(seed)
    times = np.unique(problem.seen_from)
    row_price = rng.integers(0, BOUND_UNIT // 4, (times.size, problem.n_rows))
    dear = 4 * BOUND_UNIT * TARGET_UNIT // max(int(problem.ticks.sum()), 1)
    constraint_price = tuple(int(p) for p in rng.integers(0, dear + 1, 2))
    lower = (rng.random(problem.n_candidates) < 0.2).astype(np.int64)
    scaled, margin = price_bound(problem, row_price, constraint_price, lower, attachment_modes(problem, None))
    p = [Fraction(each, BOUND_UNIT * TARGET_UNIT) for each in constraint_price]
    value = sum(a * int(b) for a, b in zip(p, problem.least, strict=True))
    for i in range(problem.n_candidates):
        own = 1 - sum(Fraction(int(u[r]), BOUND_UNIT) for u in row_price for r in problem.rows_of(i))
        assert own == Fraction(int(margin[i]), BOUND_UNIT)
        value += own if lower[i] else min(own, 0)
    for m, prices in zip(times, row_price, strict=True):
        for r in range(problem.n_rows):
            paid = sum(p[k] for k in range(2) if problem.counts_for[k, r] and problem.seen_from[k] == m)
            value += min(0, int(m) * Fraction(int(prices[r]), BOUND_UNIT) - int(problem.ticks[r]) * paid)
    assert 0 <= value - Fraction(scaled, BOUND_UNIT) < Fraction(1, BOUND_UNIT)
    for x in every_solution(problem):
        if (x >= lower).all():
            assert scaled <= int(x.sum()) * BOUND_UNIT, f"seed {seed}: {x}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(1, 1), (2, 1), (2, 2)]), st.integers(0, 2))
def test_bound_is_at_most_the_optimum_and_fixes_nothing_that_a_smaller_plan_holds(seed, looks, n_given):
    problem = random_problem(seed, looks=looks)
    given_ones = list(range(n_given))
    solutions = [x for x in every_solution(problem) if x[given_ones].all()]
    bound = large_bound(problem, n_stations=problem.n_candidates, given=given_ones, work_limit=1e-3)
    assert bound.stations <= min(int(x.sum()) for x in solutions), f"seed {seed}"
    for size in range(1, problem.n_candidates + 1):
        out = bound.fixed_out(size)
        assert all(not (x.astype(bool) & out).any() for x in solutions if x.sum() < size), f"seed {seed}, {size}"


@pytest.mark.slow
@pytest.mark.parametrize("looks", [(1, 1), (2, 1), (2, 2)])
@pytest.mark.parametrize("n_given", [0, 3])
def test_bound_comes_within_a_percent_of_the_linear_relaxation_whatever_targets_overlap(looks, n_given):
    problem = random_problem(n_given, n=120, r=500, density=0.04, looks=looks)
    lower = np.zeros(120, dtype=np.int64)
    lower[:n_given] = 1
    value = relaxation(problem, lower)
    bound = large_bound(problem, n_stations=60, given=range(n_given), work_limit=0.5)
    assert bound.value <= value + 1e-6
    assert value <= bound.relaxation_at_most + 1e-6
    # It also stops where no more than the whole number it has can be proven.
    assert bound.value >= 0.99 * value or bound.stations >= bound.relaxation_at_most


@pytest.mark.slow
@pytest.mark.parametrize("factor", [100, pytest.param(0.01, marks=pytest.mark.slow)])
def test_steps_that_begin_out_of_balance_find_it(monkeypatch, factor):
    # With a balance that stays as it was set, 38.5 and 38.9 are proven of 40.1.
    monkeypatch.setattr(primal_dual, "_BALANCE", factor * primal_dual._BALANCE)
    problem = random_problem(1, n=120, r=500, density=0.04)
    value = relaxation(problem, np.zeros(120, dtype=np.int64))
    bound = large_bound(problem, n_stations=60, work_limit=0.5)
    assert 0.99 * value <= bound.value <= value + 1e-6


@pytest.mark.slow
def test_bound_fixes_most_candidates_out_where_it_lies_near_the_plan():
    # One row a candidate, and one candidate that sees all but one row: two stations, and nobody else is of use.
    n = 30
    sees = np.eye(n, dtype=bool)
    sees[0] = True
    sees[0, n - 1] = False
    problem = problem_of(sees, np.full(n, 1000), np.ones((1, n), dtype=bool), [n * 1000])
    bound = large_bound(problem, n_stations=5)
    assert bound.stations == 2
    assert bound.fixed_out(3).sum() == n - 2
    assert not bound.fixed_out(3)[[0, n - 1]].any()


@pytest.mark.slow
def test_same_problem_gives_the_same_prices_and_they_prove_the_same_again():
    problem = random_problem(1, n=40, r=300, looks=(2, 1))
    first, second = (large_bound(problem, n_stations=20, work_limit=0.05) for _ in range(2))
    assert first.scaled == second.scaled
    assert first.constraint_price == second.constraint_price
    np.testing.assert_array_equal(first.row_price, second.row_price)
    np.testing.assert_array_equal(first.share, second.share)
    none = np.zeros(40, dtype=np.int64)
    scaled, margin = price_bound(
        problem, first.row_price, first.constraint_price, none, attachment_modes(problem, None)
    )
    assert scaled == first.scaled
    np.testing.assert_array_equal(margin, first.margin)


def test_more_work_makes_no_worse_a_bound_and_no_more_is_done_than_allowed():
    problem = random_problem(2, n=120, r=500, density=0.04)
    bounds = [large_bound(problem, n_stations=60, work_limit=limit) for limit in (1e-4, 2e-2, 1e-1)]
    values = [bound.value for bound in bounds]
    assert values == sorted(values)
    assert values[0] < values[-1]
    assert bounds[1].work <= 2e-2


def test_problem_that_asks_for_nothing_needs_no_stations():
    problem = random_problem(3)
    nothing = replace(problem, required=np.zeros(2, dtype=np.int64), least=np.zeros(2, dtype=np.int64))
    assert large_bound(nothing, n_stations=3).stations == 0
    bare = replace(
        nothing,
        starts=np.zeros(9, dtype=np.int64),
        row=np.zeros(0, dtype=np.int64),
        ticks=np.zeros(0, dtype=np.int64),
        counts_for=np.zeros((2, 0), dtype=bool),
    )
    assert large_bound(bare, n_stations=3).stations == 0


def test_prices_below_zero_or_beyond_63_bits_or_of_another_shape_are_refused():
    problem = random_problem(4)
    none = np.zeros(8, dtype=np.int64)
    good = np.zeros((1, problem.n_rows), dtype=np.int64)
    for rows, constraints in (
        (good - 1, (0, 0)),
        (good + 2**60, (0, 0)),
        (good, (-1, 0)),
        (good, (0,)),
        (good[:, :-1], (0, 0)),
    ):
        with pytest.raises(ValueError, match="prices"):
            price_bound(problem, rows, constraints, none, attachment_modes(problem, None))
