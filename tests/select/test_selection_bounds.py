"""Bounds of selection: cuts hold for every solution, bounds for every price, and all meet the optimum in the end."""

import itertools
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import every_solution, problem_of

from planner_core.select.branching import BranchAndBound, groups_of
from planner_core.select.problem import CoverProblem
from planner_core.select.quick_bound import counting_bound, lower_bound
from planner_core.select.relaxation import (
    BOUND_UNIT,
    CUT_UNIT,
    NO_MOST,
    Cut,
    CutMaker,
    CutProgram,
    exact_bound,
    independent_constraints,
)

SEEDS = st.integers(0, 2**32 - 1)


def random_problem(seed, *, n=8, r=16, large=False, most_looks=1):
    """Two overlapping targets; a row counts for them from 1 .. most_looks stations on."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < 0.2 + 0.1 * most_looks
    seen_from = rng.integers(1, most_looks + 1, 2)
    ticks = rng.integers(1, 10**14 if large else 20, r)
    counts_for = np.array([rng.random(r) < 0.5, np.ones(r, dtype=bool)])
    whole = [
        sum(int(t) for t, c, s in zip(ticks, k, sees.sum(axis=0), strict=True) if c and s >= m)
        for k, m in zip(counts_for, seen_from, strict=True)
    ]
    required = np.array([w * int(rng.integers(50, 100)) // 100 for w in whole], dtype=np.int64)
    return problem_of(sees, ticks, counts_for, required, seen_from=seen_from)


def tangle(seed, *, n=12, r=60, seen_from=1):
    """Random rows, one target: the relaxation lies stations below the optimum, so that there is something to prune."""
    rng = np.random.default_rng(seed)
    sees, ticks = rng.random((n, r)) < 0.25 * seen_from, rng.integers(1, 20, r)
    least = np.array([int(0.9 * ticks[sees.sum(axis=0) >= seen_from].sum())])
    return problem_of(sees, ticks, np.ones((1, r), dtype=bool), least, seen_from=[seen_from])


def smallest_solutions(problem):
    """All of them, from all subsets at once."""
    sees = np.zeros((problem.n_candidates, problem.n_rows), dtype=np.int64)
    for candidate in range(problem.n_candidates):
        sees[candidate, problem.rows_of(candidate)] = 1
    sets = np.array(list(itertools.product((0, 1), repeat=problem.n_candidates)))
    looks = sets @ sees
    met = np.ones(len(sets), dtype=bool)
    for counted, m, least in zip(problem.counts_for, problem.seen_from, problem.least, strict=True):
        met &= (looks >= m) @ (counted * problem.ticks) >= least
    met = sets[met]
    return met[met.sum(axis=1) == met.sum(axis=1).min()]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.booleans(), st.integers(1, 3))
def test_cuts_of_any_rows_hold_for_every_solution(seed, large, most_looks):
    problem = random_problem(seed, large=large, most_looks=most_looks)
    rng = np.random.default_rng(seed)
    maker = CutMaker(problem)
    cuts = maker.violated(rng.random(problem.n_candidates) * 0.3)
    for constraint, m in enumerate(problem.seen_from.tolist()):
        share = maker.shares(np.round(rng.random(problem.n_candidates), 1), m)
        for rows in (rng.random(problem.n_rows) < 0.4, share.part >= 1):
            cuts += [
                cut for cut in (maker.cut(constraint, rows), maker.cut(constraint, rows, share)) if cut is not None
            ]
    assert all(cut.right == CUT_UNIT for cut in cuts)
    for x in every_solution(problem):
        for cut in cuts:
            assert int(cut.coefficient @ x) >= cut.right, f"seed {seed}: {x}"


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 3))
def test_cuts_are_those_of_the_definition_rounded_up_by_little(seed, m):
    problem = random_problem(seed, most_looks=1)
    problem = replace(problem, seen_from=np.array([m, 1]))
    rng = np.random.default_rng(seed)
    full, x = rng.random(problem.n_rows) < 0.4, rng.random(problem.n_candidates)
    maker = CutMaker(problem)
    cut = maker.cut(0, full, maker.shares(x, m))
    viewers = [[c for c in range(problem.n_candidates) if r in problem.rows_of(c)] for r in range(problem.n_rows)]
    counted = [r for r in range(problem.n_rows) if problem.counts_for[0, r] and len(viewers[r]) >= m]
    need = int(problem.least[0]) - sum(int(problem.ticks[r]) for r in counted if full[r])
    if need <= 0:
        assert cut is None
        return
    area = [Fraction(0)] * problem.n_candidates
    for r in (r for r in counted if not full[r]):
        first = sorted(viewers[r], key=lambda c: -x[c])
        t = min(range(m), key=lambda t: sum(x[c] for c in first[t:]) / (m - t))
        for c in first[t:]:
            area[c] += Fraction(int(problem.ticks[r]), m - t)
    for candidate in range(problem.n_candidates):
        exact = min(area[candidate], Fraction(need)) / need
        got = Fraction(int(cut.coefficient[candidate]), CUT_UNIT)
        assert exact <= got <= min(exact + Fraction(2, CUT_UNIT), 1) or exact == 0


def test_cut_for_two_looks_leaves_out_the_candidate_that_does_not_help():
    # One row, three viewers, two looks needed: x = (1, .3, .3) covers it to 0.8 by halves, to 0.6 without the first.
    problem = CoverProblem(
        starts=np.array([0, 1, 2, 3]),
        row=np.zeros(3, dtype=np.int64),
        ticks=np.array([12]),
        counts_for=np.ones((1, 1), dtype=bool),
        required=np.array([12]),
        least=np.array([12]),
        seen_from=np.array([2]),
    )
    x = np.array([1.0, 0.3, 0.3])
    maker = CutMaker(problem)
    assert maker.shares(x, 2).part == pytest.approx([0.6])
    (cut,) = maker.violated(x)
    assert cut.coefficient.tolist() == [0, CUT_UNIT, CUT_UNIT]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_bound_holds_for_any_prices_and_equals_its_definition(seed):
    problem = random_problem(seed)
    rng = np.random.default_rng(seed)
    n = problem.n_candidates
    made = CutMaker(problem).violated(np.zeros(n)) + CutMaker(problem).violated(rng.random(n) * 0.2)
    # And some that hold for every x in {0, 1}, with terms of either sign and right sides that are not 1.
    made += [Cut(np.array([CUT_UNIT, CUT_UNIT, -CUT_UNIT, -CUT_UNIT] + [0] * (n - 4)), -2 * CUT_UNIT)]
    made += [Cut(np.array([CUT_UNIT // 3, 0, 0, 0, -CUT_UNIT] + [0] * (n - 5)), -CUT_UNIT)]
    cuts = np.array([cut.coefficient for cut in made])
    right = np.array([cut.right for cut in made])
    lower = (rng.random(n) < 0.2).astype(np.int64)
    upper = np.maximum(lower, rng.random(n) < 0.8).astype(np.int64)
    price = rng.normal(1.0, 1.0, len(cuts))
    bound = exact_bound(cuts, right, price, lower, upper)
    whole = [Fraction(int(max(p, 0.0) * 2**20), 2**20) for p in price]
    value = sum((p * Fraction(int(b), CUT_UNIT) for p, b in zip(whole, right, strict=True)), Fraction(0))
    for i in range(n):
        margin = 1 - sum((p * Fraction(int(c[i]), CUT_UNIT) for p, c in zip(whole, cuts, strict=True)), Fraction(0))
        assert Fraction(int(bound.margin[i]), BOUND_UNIT) == margin
        value += min(margin * int(lower[i]), margin * int(upper[i]))
    assert Fraction(bound.scaled, BOUND_UNIT) == value
    within = [x for x in every_solution(problem) if (x >= lower).all() and (x <= upper).all()]
    assert all(bound.stations <= int(x.sum()) for x in within), f"seed {seed}"


def test_targets_that_others_add_up_to_make_no_cuts():
    rng = np.random.default_rng(5)
    floor = rng.random(16) < 0.5
    counts_for = np.array([np.ones(16, dtype=bool), floor, ~floor, ~floor])
    problem = random_problem(5)
    ticks = problem.ticks
    least = np.array([0, ticks[floor].sum() // 2, ticks[~floor].sum() // 2, ticks[~floor].sum() // 3])
    least[0] = least[1] + least[2]
    once = np.ones(4, dtype=np.int64)
    problem = replace(problem, counts_for=counts_for, least=least, required=least, seen_from=once)
    assert independent_constraints(problem) == [1, 2]
    assert len(CutMaker(problem).violated(np.zeros(8))) == 2
    # A tick more, or a second look, and the whole asks for something of its own.
    assert independent_constraints(replace(problem, least=least + np.array([1, 0, 0, 0]))) == [0, 1, 2]
    assert independent_constraints(replace(problem, seen_from=once + np.array([1, 0, 0, 0]))) == [0, 1, 2]
    assert independent_constraints(replace(problem, seen_from=once + np.array([0, 1, 1, 1]))) == [1, 2]
    # Parts that overlap do not add up.
    overlapping = np.array([np.ones(16, dtype=bool), np.arange(16) < 10, np.arange(16) > 5])
    ask = np.array([30, 15, 15])
    apart = replace(problem, counts_for=overlapping, least=ask, required=ask, seen_from=once[:3])
    assert independent_constraints(apart) == [0, 1, 2]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 2))
def test_targets_left_out_of_cuts_are_met_wherever_the_others_are(seed, most_looks):
    problem = random_problem(seed, most_looks=most_looks)
    rng = np.random.default_rng(seed)
    # Two parts, disjoint or not.
    counts_for = np.vstack([np.ones(16, dtype=bool), rng.random((2, 16)) < rng.choice([0.2, 0.7])])
    least = rng.integers(0, 40, 3)
    seen_from = rng.integers(1, most_looks + 1, 3)
    problem = replace(problem, counts_for=counts_for, least=least, required=least, seen_from=seen_from)
    kept = independent_constraints(problem)
    for bits in itertools.product((0, 1), repeat=8):
        covered = problem.covered([i for i in range(8) if bits[i]])
        if (covered[kept] >= least[kept]).all():
            assert (covered >= least).all(), f"seed {seed}"


@pytest.mark.slow
def test_probes_that_prove_something_fix_candidates_without_losing_the_optimum(monkeypatch):
    fixed = []
    prove = BranchAndBound._prove_probes

    def noted(self, *arguments):
        found = prove(self, *arguments)
        fixed.append(found)
        return found

    monkeypatch.setattr(BranchAndBound, "_prove_probes", noted)
    for seed in range(12):
        problem = tangle(seed, n=14)
        optimum = int(smallest_solutions(problem)[0].sum())
        tree = BranchAndBound(problem, n_stations=optimum + 1)
        tree.root()
        while not tree.finished:
            tree.advance(work=1e-3)
        assert tree.lower_bound == optimum == tree.n_stations, f"seed {seed}"
    assert any(fixed)


def test_prices_that_whole_numbers_cannot_hold_are_refused():
    cuts = np.full((2, 3), CUT_UNIT, dtype=np.int64)
    with pytest.raises(ValueError, match="prices"):
        exact_bound(
            cuts, cuts[:, 0], np.array([2.0**17, 2.0**17]), np.zeros(3, dtype=np.int64), np.ones(3, dtype=np.int64)
        )


@pytest.mark.slow
def test_relaxation_by_cuts_reaches_the_linear_relaxation_at_least():
    from scipy.optimize import linprog

    for seed in range(5):
        problem = random_problem(seed, n=20, r=60)
        n, r = problem.n_candidates, problem.n_rows
        sees = np.zeros((r, n))
        for candidate in range(n):
            sees[problem.rows_of(candidate), candidate] = 1
        # y_r <= number of stations that see r; covered area of each target >= least.
        weights = problem.counts_for * problem.ticks
        relaxed = linprog(
            np.append(np.ones(n), np.zeros(r)),
            A_ub=np.block([[-sees, np.eye(r)], [np.zeros((2, n)), -weights]]),
            b_ub=np.append(np.zeros(r), -problem.least),
            bounds=(0, 1),
        )
        tree = BranchAndBound(problem, n_stations=n)
        tree.root()
        x, _ = tree._solve()
        assert x.sum() >= relaxed.fun - 1e-4, f"seed {seed}"
        assert tree.lower_bound >= np.ceil(relaxed.fun - 1e-3), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(SEEDS, st.integers(1, 3))
def test_branch_and_bound_finds_the_optimum_from_a_bad_plan_and_never_passes_it(seed, seen_from):
    problem = tangle(seed, seen_from=seen_from)
    optimum = int(smallest_solutions(problem)[0].sum())
    tree = BranchAndBound(problem, n_stations=problem.n_candidates + 1)
    assert tree.lower_bound <= optimum
    tree.root()
    assert tree.lower_bound <= optimum
    while not tree.finished:
        tree.advance(work=1e-4)
        assert tree.lower_bound <= optimum, f"seed {seed}"
    assert tree.lower_bound == optimum == tree.n_stations
    assert tree.best is not None and (problem.covered(list(tree.best)) >= problem.required).all()


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(SEEDS, st.integers(1, 2))
def test_tree_that_branches_on_groups_alone_ends_at_the_optimum(seed, seen_from):
    problem = tangle(seed, seen_from=seen_from)
    optimum = int(smallest_solutions(problem)[0].sum())
    tree = BranchAndBound(problem, n_stations=problem.n_candidates + 1)
    tree.root()
    # Single candidates only where there is no other way: all numbers of groups are whole.
    every = tree._branches

    def groups_first(x, lower, upper):
        found = every(x, lower, upper)
        groups = [branch for branch in found if branch.group >= 0]
        taken.extend(groups)
        return groups or found

    taken = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tree, "_branches", groups_first)
        while not tree.finished:
            tree.advance(work=1e-4)
            assert tree.lower_bound <= optimum, f"seed {seed}"
    assert tree.lower_bound == optimum == tree.n_stations
    assert taken or tree.n_nodes < 3


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_counts_of_groups_fit_exactly_where_some_choice_has_them(seed):
    rng = np.random.default_rng(seed)
    tree = BranchAndBound(tangle(seed, n=8), n_stations=9)
    lower = (rng.random(8) < 0.2).astype(np.int64)
    upper = np.maximum(lower, rng.random(8) < 0.8).astype(np.int64)
    counts = {}
    for group in rng.choice(len(tree._groups), 3, replace=False).tolist():
        low = int(rng.integers(0, tree._groups[group].sum() + 1))
        counts[group] = (low, low + int(rng.integers(0, 2)))
    choices = np.array(list(itertools.product((0, 1), repeat=8)))
    fit = (choices >= lower).all(axis=1) & (choices <= upper).all(axis=1)
    for group, (low, high) in counts.items():
        n = choices[:, tree._groups[group]].sum(axis=1)
        fit &= (n >= low) & (n <= high)
    then_lower, then_upper = lower.copy(), upper.copy()
    assert tree._counts_fit(then_lower, then_upper, counts) == bool(fit.any()), f"seed {seed}"
    if fit.any():  # what is fixed is so in every choice that has the counts
        assert (choices[fit] >= then_lower).all() and (choices[fit] <= then_upper).all(), f"seed {seed}"


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_groups_hold_each_other_or_share_nobody(seed):
    problem = random_problem(seed, n=9)
    groups = groups_of(problem)
    assert len(groups) == 7
    assert ((groups.sum(axis=1) > 1) & (groups.sum(axis=1) < 9)).all()
    for a, b in itertools.combinations(groups, 2):
        shared = a & b
        assert not shared.any() or (shared == a).all() or (shared == b).all()


def test_first_group_is_of_those_who_see_most_nearly_the_same():
    sees = np.array([[1, 1, 1, 0, 0], [0, 0, 0, 1, 1], [1, 1, 0, 0, 0], [0, 0, 0, 0, 1]], dtype=bool)
    problem = replace(
        random_problem(0, n=4, r=5), starts=np.concatenate([[0], np.cumsum(sees.sum(axis=1))]), row=np.nonzero(sees)[1]
    )
    assert groups_of(problem).astype(int).tolist() == [[1, 0, 1, 0], [0, 1, 0, 1]]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_bound_with_sums_bounded_above_holds_for_any_prices(seed):
    problem = random_problem(seed)
    rng = np.random.default_rng(seed)
    n = problem.n_candidates
    sums = rng.random((3, n)) < 0.5
    least = rng.integers(0, 2, 3)
    most = least + rng.integers(0, 3, 3)
    made = CutMaker(problem).violated(np.zeros(n))
    cuts = np.concatenate([[cut.coefficient for cut in made], sums * CUT_UNIT]).astype(np.int64)
    right = np.append([cut.right for cut in made], least * CUT_UNIT)
    sides = np.append([NO_MOST] * len(made), most * CUT_UNIT).astype(np.int64)
    lower, upper = np.zeros(n, dtype=np.int64), np.ones(n, dtype=np.int64)
    fit = [x for x in every_solution(problem) if (sums @ x >= least).all() and (sums @ x <= most).all()]
    for price in rng.normal(0.0, 1.5, (8, len(cuts))):
        bound = exact_bound(cuts, right, price, lower, upper, sides)
        assert all(bound.stations <= int(x.sum()) for x in fit), f"seed {seed}"
        # By the definition: a negative price of a cut alone counts for nothing, that of a sum is one of `most`.
        whole = [Fraction(int(p * 2**20), 2**20) for p in price]
        whole = [p if p > 0 or side < NO_MOST else Fraction(0) for p, side in zip(whole, sides.tolist(), strict=True)]
        paid = [p * (r if p > 0 else m) for p, r, m in zip(whole, right.tolist(), sides.tolist(), strict=True)]
        value = sum(paid, Fraction(0)) / CUT_UNIT
        for i in range(n):
            margin = 1 - sum((p * int(c[i]) for p, c in zip(whole, cuts, strict=True)), Fraction(0)) / CUT_UNIT
            value += min(margin, Fraction(0))
        assert Fraction(bound.scaled, BOUND_UNIT) == value, f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_candidates_fixed_at_the_root_leave_a_better_plan_possible(seed):
    problem = tangle(seed)
    best = smallest_solutions(problem)
    tree = BranchAndBound(problem, n_stations=int(best[0].sum()) + 1)
    tree.root()
    # Every smallest one, not just one of them: what is fixed is in none, or in all.
    for x in best:
        assert (x >= tree._lower).all() and (x <= tree._upper).all(), f"seed {seed}"


def test_a_node_that_is_interrupted_stays_open(monkeypatch):
    problem = tangle(0, n=24)
    tree = BranchAndBound(problem, n_stations=24)
    tree.root()
    before = tree.lower_bound

    def interrupt(node):
        raise KeyboardInterrupt

    monkeypatch.setattr(tree, "_look_at", interrupt)
    with pytest.raises(KeyboardInterrupt):
        tree.advance(work=1.0)
    assert tree.lower_bound == before < 24
    assert not tree.finished


def test_solver_that_returns_nonsense_does_not_break_the_bound(monkeypatch):
    rng = np.random.default_rng(0)

    def nonsense(self):
        return rng.random(self.n_candidates), rng.normal(0, 3, len(self.cuts))

    monkeypatch.setattr(CutProgram, "solve", nonsense)
    for seed in range(8):
        problem = random_problem(seed)
        tree = BranchAndBound(problem, n_stations=problem.n_candidates)
        tree.root()
        tree.advance(work=1e-3)
        assert tree.lower_bound <= min(int(x.sum()) for x in every_solution(problem)), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 3))
def test_quick_bounds_never_pass_the_smallest_solution(seed, most_looks):
    problem = random_problem(seed, most_looks=most_looks)
    optimum = int(smallest_solutions(problem)[0].sum())
    assert counting_bound(problem) <= optimum, f"seed {seed}"
    assert lower_bound(problem, n_stations=optimum + 1) <= optimum, f"seed {seed}"


def test_quick_bounds_ask_for_as_many_stations_as_looks():
    problem = replace(tangle(1), seen_from=np.array([3]), least=np.array([1]), required=np.array([1]))
    assert counting_bound(problem) == lower_bound(problem, n_stations=12) == 3
