"""Coverage and keys of chromosomes, host and device, against plain sums of Python's whole numbers."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.model import Visibility
from planner_core.model.methods import OBJECTIVES, GeneticSettings
from planner_core.paper.genetic.host import HostCoverage
from planner_core.paper.genetic.objective import objective_of
from planner_core.paper.genetic.on_device import DEFAULT_SHAPE, SHAPES, Population, WorkShape
from planner_core.select.bit_rows import PART_BITS, lay_out
from planner_core.select.problem import Constraint, cover_problem

FORMS = {
    "lanes of 8": SHAPES["cpu"],
    "lanes of 4": WorkShape(lanes=4, depth=2, slots=2, n_runs=3, n_breeders=2),
    "lanes of 1": DEFAULT_SHAPE,
}


def by_hand(sees, problem, genes):
    """Covered and missing ticks of one chromosome, row by row."""
    seen = [any(sees[g][r] for g in np.flatnonzero(genes)) for r in range(sees.shape[1])]
    ticks = [int(t) for t in problem.ticks]
    covered = sum(t for t, s in zip(ticks, seen, strict=True) if s)
    missing = 0
    for counted, required in zip(problem.counts_for, problem.required, strict=True):
        got = sum(t for t, s, c in zip(ticks, seen, counted, strict=True) if s and c)
        missing += max(0, int(required) - got)
    return covered, missing


def key_by_hand(objective, n_candidates, total, n_stations, covered, missing, active):
    """What orders chromosomes, as a tuple or a fraction: compared with the keys by order alone."""
    if objective == "eq9":
        return (Fraction(covered, active),)
    if objective == "coverage-at-most-n":
        return (1, covered, -active) if active <= n_stations else (0, -active)
    return (1, -active, covered) if missing == 0 else (0, -missing, -active)


def on_device(problem, genes, chosen, device, shape):
    """Key, covered ticks and stations of given chromosomes."""
    objective = objective_of(problem, chosen)
    with Population(device, shape, lay_out(problem, words=shape.words), chosen, objective, problem) as population:
        population.start(genes)
        facts = np.empty((3, len(genes)), dtype=np.int64)
        device.read(population.buffers["facts"], facts)
    return facts


def on_host(problem, genes, chosen):
    with HostCoverage(problem, n_threads=2) as coverage:
        covered, missing = coverage.evaluate(genes)
    active = genes.sum(axis=1, dtype=np.int64)
    return np.stack([objective_of(problem, chosen).keys(covered, active, missing), covered, active])


@st.composite
def problems(draw):
    """Few candidates and rows, weights about the limits of the kernel's parts."""
    n_candidates, n_rows = draw(st.integers(1, 40)), draw(st.integers(0, 70))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sees = rng.random((n_candidates, n_rows)) < draw(st.sampled_from([0.02, 0.2, 0.9]))
    heavy = draw(st.sampled_from([1, 2**PART_BITS - 1, 2**PART_BITS, 2**40, 2**44]))
    ticks = rng.integers(0, heavy + 1, n_rows)
    counts_for = rng.random((draw(st.integers(0, 3)), n_rows)) < 0.6
    required = (counts_for * ticks).sum(axis=1) * draw(st.integers(0, 10)) // 10
    genes = rng.random((draw(st.integers(2, 9)), n_candidates)) < draw(st.sampled_from([0.05, 0.5]))
    genes[np.arange(len(genes)), rng.integers(0, n_candidates, len(genes))] = True
    return sees, ticks, counts_for, required, genes


@pytest.mark.parametrize("kind", ["host", *FORMS])
@given(problems())
@settings(max_examples=25, deadline=None)
def test_coverage_and_missing_ticks_are_plain_sums(matrix_problem, device, kind, case):
    sees, ticks, counts_for, required, genes = case
    problem = matrix_problem(sees, ticks, counts_for, required)
    chosen = GeneticSettings(population=len(genes), n_parents=2, max_iterations=0)
    if kind == "host":
        got = on_host(problem, genes, chosen)
    else:
        got = on_device(problem, genes, chosen, device, FORMS[kind])
    n, total = len(sees), int(ticks.sum())
    for row, (key, covered, active) in zip(genes, got.T.tolist(), strict=True):
        expected, missing = by_hand(sees, problem, row)
        assert (covered, active) == (expected, int(row.sum()))
        met = (n - active) * (total + 1) + covered
        assert key == (met if missing == 0 else -(missing * (n + 1) + active))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("bits", [PART_BITS, PART_BITS + 1, 2 * PART_BITS - 5])
def test_coverage_adds_up_where_every_row_has_the_greatest_weight(matrix_problem, device, form, bits):
    n_rows = 2100  # more than a tile, so that all places of a lane are taken
    ticks = np.full(n_rows, 2**bits - 1)
    problem = matrix_problem(np.full((2, n_rows), True), ticks, np.full((1, n_rows), True), np.array([1]))
    chosen = GeneticSettings(population=2, n_parents=2, max_iterations=0, objective="eq9")
    facts = on_device(problem, np.array([[True, False], [True, True]]), chosen, device, FORMS[form])
    assert facts[1].tolist() == [n_rows * (2**bits - 1)] * 2


@pytest.mark.slow
@pytest.mark.parametrize("objective", OBJECTIVES)
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_keys_order_chromosomes_as_the_objective_says(make_problem, device, objective, seed):
    problem = make_problem(seed % 1000, n_candidates=12, n_patches=40, density=0.3)
    sees = np.zeros((12, problem.n_rows), dtype=bool)
    for c in range(12):
        sees[c, problem.rows_of(c)] = True
    genes = np.random.default_rng(seed).random((14, 12)) < 0.4
    genes[:, 0] = True
    chosen = GeneticSettings(population=14, n_parents=2, max_iterations=0, objective=objective, n_stations=4)
    facts = on_device(problem, genes, chosen, device, SHAPES["cpu"])
    assert (facts == on_host(problem, genes, chosen)).all()
    values = []
    for row, active in zip(genes, facts[2].tolist(), strict=True):
        covered, missing = by_hand(sees, problem, row)
        values.append(key_by_hand(objective, 12, int(problem.ticks.sum()), 4, covered, missing, active))
    for a in range(14):
        for b in range(14):
            # Eq. 9 rounds quotients: what differs by less than 2^-shift ticks may count as equal.
            if objective == "eq9" and abs(values[a][0] - values[b][0]) < 1:
                continue
            assert (facts[0][a] > facts[0][b]) == (values[a] > values[b]), (values[a], values[b])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_coverage_of_merged_rows_is_the_area_of_patches_that_are_seen(seed):
    rng = np.random.default_rng(seed)
    n_patches = 200
    sees = rng.random((15, n_patches)) < 0.15
    rows = [np.flatnonzero(row) for row in sees]
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), n_patches)
    area_m2 = rng.uniform(0.0, 0.04, n_patches)
    problem = cover_problem(visibility, area_m2, (Constraint(np.full(n_patches, True), 1.0),))
    genes = rng.random((5, 15)) < 0.3
    with HostCoverage(problem) as coverage:
        covered, _ = coverage.evaluate(genes)
    expected_m2 = [area_m2[sees[row].any(axis=0)].sum() for row in genes]
    # Areas are rounded to 1e-9 m^2, half a tick a patch.
    np.testing.assert_allclose(covered * 1e-9, expected_m2, rtol=0, atol=0.5e-9 * n_patches + 1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_coverage_grows_with_stations(make_problem, seed):
    problem = make_problem(seed % 100)
    rng = np.random.default_rng(seed)
    fewer = rng.random((4, 40)) < 0.2
    more = fewer | (rng.random((4, 40)) < 0.2)
    with HostCoverage(problem) as coverage:
        few_covered, few_missing = coverage.evaluate(fewer)
        more_covered, more_missing = coverage.evaluate(more)
    assert (more_covered >= few_covered).all()
    assert (more_missing <= few_missing).all()
