"""Proven selection against exhaustive search on tiny problems, and its promises: limits, interrupts, determinism."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from selection_instances import problem_of

from planner_core.errors import RequirementError
from planner_core.model import Proven, Visibility
from planner_core.select import proven
from planner_core.select.check import SelectionCheckError, check_coverage, check_selection
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import Constraint, cover_problem
from planner_core.select.proven import select
from planner_core.select.relaxation import CutProgram

SEEDS = st.integers(0, 2**32 - 1)
QUICK = Proven(work_limit=0.5, n_walks=2)


def random_problem(seed, *, n=8, r=14, n_constraints=3):
    """Several targets that overlap, ties, rows nobody sees or counts, targets that require nothing or everything."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < rng.choice([0.1, 0.25, 0.4])
    sees[:, rng.random(r) < 0.1] = False
    ticks = rng.choice([0, 1, 2, 5, 1000], r)
    counts_for = rng.random((n_constraints, r)) < 0.6
    whole = (counts_for * np.where(sees.any(axis=0), ticks, 0)).sum(axis=1)
    required = np.ceil(whole * rng.choice([0.0, 0.5, 0.9, 1.0], n_constraints)).astype(np.int64)
    return problem_of(sees, ticks, counts_for, required, slack=int(rng.integers(0, 2)))


def meets(problem, chosen, required):
    """Oracle, in Python's own sets."""
    seen = {int(r) for c in chosen for r in problem.rows_of(c)}
    return all(
        sum(int(problem.ticks[r]) for r in seen if problem.counts_for[k, r]) >= required[k]
        for k in range(len(required))
    )


def fewest(problem, required, given=()):
    others = [c for c in range(problem.n_candidates) if c not in given]
    for k in range(len(others) + 1):
        for more in itertools.combinations(others, k):
            if meets(problem, (*given, *more), required):
                return len(given) + k
    raise AssertionError("all candidates together must do")


def hall(seed=0, *, n=60, r=400, fraction=0.95):
    """Candidates along a corridor, each seeing what lies near: no trivial optimum, several targets."""
    rng = np.random.default_rng(seed)
    at, patch = rng.random(n), rng.random(r)
    sees = np.abs(at[:, None] - patch[None]) < rng.uniform(0.01, 0.08, (n, 1))
    sees &= rng.random((n, r)) < 0.8
    counts_for = np.array([patch < 0.5, patch >= 0.5, np.ones(r, dtype=bool)])
    ticks = rng.integers(1, 50, r)
    whole = (counts_for * np.where(sees.any(axis=0), ticks, 0)).sum(axis=1)
    return problem_of(sees, ticks, counts_for, np.ceil(fraction * whole).astype(np.int64))


def thicket(seed=0, *, n=80, r=300):
    """Candidates that see rows at random: the relaxation is far from the optimum, and there is much to prove."""
    rng = np.random.default_rng(seed)
    sees = rng.random((n, r)) < 0.1
    ticks = rng.integers(1, 50, r)
    whole = int(np.where(sees.any(axis=0), ticks, 0).sum())
    return problem_of(sees, ticks, np.ones((1, r)), [int(0.9 * whole)])


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_selection_finds_and_proves_what_exhaustive_search_finds(seed):
    problem = random_problem(seed)
    result = select(problem, QUICK)
    assert meets(problem, result.chosen, problem.required), f"seed {seed}"
    assert result.lower_bound <= fewest(problem, problem.least), f"seed {seed}"
    assert len(result.chosen) == fewest(problem, problem.required), f"seed {seed}"
    if (problem.least == problem.required).all():
        assert result.proven and result.why_stopped == "proven", f"seed {seed}: {result}"


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_given_candidates_are_in_the_set_and_count(seed):
    problem = random_problem(seed, n=7, r=12)
    given_ones = tuple(int(c) for c in np.random.default_rng(seed).permutation(7)[:2])
    result = select(problem, QUICK, given=given_ones)
    assert result.chosen[:2] == given_ones
    assert result.lower_bound <= len(result.chosen) == fewest(problem, problem.required, given_ones), f"seed {seed}"


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_order_of_candidates_and_rows_does_not_change_the_number(seed):
    problem = random_problem(seed)
    rng = np.random.default_rng(seed)
    sees = np.zeros((problem.n_candidates, problem.n_rows), dtype=bool)
    for c in range(problem.n_candidates):
        sees[c, problem.rows_of(c)] = True
    rows, candidates = rng.permutation(problem.n_rows), rng.permutation(problem.n_candidates)
    other = problem_of(sees[candidates][:, rows], problem.ticks[rows], problem.counts_for[:, rows], problem.required)
    assert len(select(other, QUICK).chosen) == len(select(problem, QUICK).chosen), f"seed {seed}"


def test_nothing_required_needs_no_station():
    result = select(problem_of([[1, 1], [0, 1]], [3, 4], [[1, 1]], [0]))
    assert (result.chosen, result.lower_bound, result.proven, result.gap) == ((), 0, True, 0.0)


@pytest.mark.slow
def test_selection_is_never_larger_than_greedy_and_its_curve_is_monotone():
    for seed in range(3):
        problem = hall(seed)
        result = select(problem, Proven(work_limit=2.0))
        assert result.lower_bound <= len(result.chosen) <= len(select_greedy(problem).chosen) == result.n_greedy
        curve = result.curve
        assert all(a.work <= b.work for a, b in itertools.pairwise(curve))
        assert all(a.stations >= b.stations and a.bound <= b.bound for a, b in itertools.pairwise(curve))
        assert (curve[-1].stations, curve[-1].bound) == (len(result.chosen), result.lower_bound)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_selection_without_any_work_is_no_larger_than_greedy_or_the_start(seed):
    problem = random_problem(seed, n=14, r=30)
    greedy = select_greedy(problem).chosen
    result = select(problem, Proven(work_limit=0.0))
    assert len(result.chosen) <= len(greedy), f"seed {seed}"
    assert (result.curve[-1].stations, result.curve[-1].bound) == (len(result.chosen), result.lower_bound)
    best = select(problem, QUICK).chosen
    assert len(select(problem, Proven(work_limit=0.0), start=best).chosen) == len(best), f"seed {seed}"


def test_a_start_better_than_greedy_is_kept_and_a_start_that_misses_is_refused():
    # Greedy takes the middle one first and then needs both others; the others alone do.
    problem = problem_of([[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1]], [3, 4, 4, 3], [[1, 1, 1, 1]], [14])
    assert set(select(problem, Proven(work_limit=0), start=(0, 2)).chosen) == {0, 2}
    with pytest.raises(RequirementError, match="start of selection"):
        select(problem, start=(1,))
    with pytest.raises(RequirementError, match="start of selection"):
        select(problem, start=(0, 1, 7))


def test_work_limit_ends_the_search_with_a_valid_set_and_bound():
    problem = thicket(1)
    result = select(problem, Proven(work_limit=0.0))
    assert result.why_stopped == "work limit"
    assert 0 < result.lower_bound <= len(result.chosen) == result.n_greedy
    assert not result.proven and 0 < result.gap < 1


def test_as_few_stations_as_are_enough_end_the_search():
    problem = thicket()
    settings = replace(QUICK, prove=False)
    whole = select(problem, settings)
    ended = select(problem, settings, enough=len(whole.chosen))
    assert (ended.chosen, ended.why_stopped, ended.proven) == (whole.chosen, "as few as wanted", False)
    assert ended.work < 0.8 * whole.work
    assert select(problem, settings, enough=len(whole.chosen) - 1).why_stopped == whole.why_stopped


def test_turns_end_where_they_have_long_found_nothing(monkeypatch):
    monkeypatch.setattr(proven, "_PATIENCE", 0.02)
    monkeypatch.setattr(proven, "_PATIENCE_SHARE", 0.0)
    result = select(thicket(1), Proven(work_limit=20.0, n_walks=1))
    assert result.why_stopped == "work limit" and result.lower_bound < len(result.chosen)
    assert 0.02 <= result.work - result.curve[-1].work < 2.0, "one more annealing, and no more of the proof"


def test_time_limit_ends_the_search():
    result = select(thicket(1), Proven(time_limit_s=0.0))
    assert result.why_stopped == "time limit"


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["select", "bound", "prove"])
def test_interrupt_returns_the_best_set_so_far(stage):
    problem = thicket(2)
    seen = []

    def interrupt(event):
        seen.append(event.stage)
        if event.stage == stage and "trying" in event.note + "trying" * (stage != "select"):
            raise KeyboardInterrupt

    result = select(problem, Proven(work_limit=20.0), progress=interrupt)
    assert result.why_stopped == "interrupted" and seen[-1] == stage
    # The rest of the tree is open: a lost node would pass for a proof.
    assert 0 < result.lower_bound < len(result.chosen) <= result.n_greedy


def test_same_seed_gives_the_same_result_on_the_device_and_on_the_host():
    problem = hall(3)
    quick = Proven(work_limit=0.3, n_walks=2, seed=5)
    assert select(problem, quick) == select(problem, quick)


@pytest.mark.parametrize(
    "wrong", [{"work_limit": -1.0}, {"work_limit": float("nan")}, {"time_limit_s": -1.0}, {"seed": -1}, {"n_walks": 0}]
)
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(RequirementError, match="expected"):
        replace(Proven(), **wrong)


def test_given_candidates_that_are_none_are_refused():
    problem = hall()
    for wrong in ((0, 0), (-1,), (problem.n_candidates,)):
        with pytest.raises(RequirementError, match="given candidates"):
            select(problem, given=wrong)


# ---------------------------------------------------------------------------------------------- checker
def test_checker_rejects_sets_that_fall_short_by_one_tick_or_are_no_sets():
    problem = problem_of([[1, 1, 0], [0, 1, 1]], [5, 7, 9], [[1, 1, 0], [0, 1, 1]], [12, 16])
    check_selection(problem, (0, 1))
    check_selection(problem, (1, 0), given=(0,))
    for wrong, given_ones, what in (
        ((0,), (), "9|7 ticks of constraint 1"),
        ((0, 1, 1), (), "twice"),
        ((0, 2), (), "below 2"),
        ((0, -1), (), "below 2"),
        ((1, 0), (2,), "without given"),
    ):
        with pytest.raises(SelectionCheckError, match=what):
            check_selection(problem, wrong, given=given_ones)
    with pytest.raises(SelectionCheckError, match=r"12 ticks of constraint 0 .* at least 13"):
        check_selection(replace(problem, required=problem.required + 1), (0, 1))


def test_checker_of_areas_agrees_with_the_problem_and_rejects_what_misses():
    rng = np.random.default_rng(4)
    sees = rng.random((12, 80)) < 0.2
    rows = [np.flatnonzero(row) for row in sees]
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), 80)
    area_m2 = rng.uniform(0.001, 0.04, 80)
    constraints = (Constraint(np.arange(80) < 30, 0.9), Constraint(np.full(80, True), 0.95))
    chosen = select(cover_problem(visibility, area_m2, constraints), QUICK).chosen
    check_coverage(visibility, area_m2, constraints, chosen)
    for left_out in chosen:
        with pytest.raises(SelectionCheckError, match="m2 of constraint"):
            check_coverage(visibility, area_m2, constraints, [c for c in chosen if c != left_out])


@pytest.mark.slow
def test_interrupt_in_the_middle_of_a_node_proves_nothing(monkeypatch):
    solved = []
    solve = CutProgram.solve

    def interrupted(self):
        solved.append(1)
        if len(solved) == n:
            raise KeyboardInterrupt
        return solve(self)

    monkeypatch.setattr(CutProgram, "solve", interrupted)
    for n in (1, 2, 150, 300, 301):
        solved.clear()
        result = select(thicket(2), Proven(work_limit=20.0))
        assert result.why_stopped == "interrupted", n
        assert result.lower_bound < len(result.chosen), n


def test_annealing_waits_until_the_proof_has_had_three_times_as_much_work_the_next_one_counted():
    search = proven._ProvenSearch.__new__(proven._ProvenSearch)
    search._work, search._n_steps = 10.0, 1000
    search._problem = search._network = None
    search._best = []
    search._work_of_a_step = lambda *_: 5_000_000  # 5 in 1e9 for all steps
    assert search._proof_due(SimpleNamespace(work=44.0)) == pytest.approx(1.0)
    assert search._proof_due(SimpleNamespace(work=45.5)) < 0
