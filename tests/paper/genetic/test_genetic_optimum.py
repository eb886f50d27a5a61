"""What the search finds on instances small enough to look at all sets; and that Eq. 9 is degenerate."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.paper.genetic import GeneticSettings, select_genetic
from planner_core.select.greedy import select_greedy

#: Much mutation: the paper's is made for hundreds of candidates, of eleven it would flip one in fifty individuals.
THOROUGH = {
    "population": 200,
    "n_parents": 100,
    "distinct": True,
    "individual_mutation_rate": 0.5,
    "gene_mutation_rate": 0.2,
    "patience": 60,
    "max_iterations": 400,
    "seed": 1,
}


def every_set(problem):
    """(stations, covered ticks, targets met) of all sets but the empty one."""
    n = problem.n_candidates
    for size in range(1, n + 1):
        for chosen in itertools.combinations(range(n), size):
            seen = np.zeros(problem.n_rows, dtype=bool)
            for candidate in chosen:
                seen[problem.rows_of(candidate)] = True
            ticks = np.where(seen, problem.ticks, 0)
            yield size, int(ticks.sum()), bool(((problem.counts_for * ticks).sum(axis=1) >= problem.required).all())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("crossover", ["one-point", "two-point", "uniform"])
def test_fewest_stations_are_found_on_small_instances(make_problem, device, seed, crossover):
    problem = make_problem(seed, n_candidates=11, n_patches=60, density=0.25)
    best = max((-size, covered) for size, covered, met in every_set(problem) if met)
    result = select_genetic(problem, GeneticSettings(**THOROUGH, crossover=crossover), device=device)
    assert (-result.chosen.size, result.covered_by_iteration[-1]) == best


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("replacement", ["stationary", "generational"])
def test_most_coverage_of_at_most_n_is_found_on_small_instances(make_problem, device, seed, replacement):
    problem = make_problem(seed, n_candidates=11, n_patches=60, density=0.25)
    best = max((covered, -size) for size, covered, _ in every_set(problem) if size <= 3)
    few = {"objective": "coverage-at-most-n", "n_stations": 3, "expected_active": 3}
    chosen = GeneticSettings(**(THOROUGH | few | {"replacement": replacement, "distinct": replacement == "stationary"}))
    result = select_genetic(problem, chosen, device=device)
    assert (result.covered_by_iteration[-1], -result.chosen.size) == best


@pytest.mark.parametrize("seed", range(3))
def test_eq9_ends_with_the_one_best_station(make_problem, device, seed):
    problem = make_problem(seed, n_candidates=30, n_patches=300)
    result = select_genetic(problem, GeneticSettings(**THOROUGH, objective="eq9"), device=device)
    areas = [int(problem.ticks[problem.rows_of(c)].sum()) for c in range(30)]
    assert result.chosen.tolist() == [int(np.argmax(areas))]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_eq9_is_never_greater_for_a_set_than_for_its_best_station(make_problem, seed):
    rng = np.random.default_rng(seed)
    problem = make_problem(seed % 50, n_candidates=12, n_patches=50, density=rng.uniform(0.05, 0.6))
    area = [int(problem.ticks[problem.rows_of(c)].sum()) for c in range(12)]
    chosen = np.flatnonzero(rng.random(12) < 0.5)
    if chosen.size:
        seen = np.zeros(problem.n_rows, dtype=bool)
        for candidate in chosen:
            seen[problem.rows_of(candidate)] = True
        assert int(problem.ticks[seen].sum()) <= chosen.size * max(area[c] for c in chosen)


@pytest.mark.parametrize("engine", ["host", "device"])
def test_search_never_falls_behind_a_greedy_selection_that_was_given(make_problem, engine):
    for seed in range(3):
        problem = make_problem(seed)
        greedy = select_greedy(problem).chosen
        chosen = GeneticSettings(population=40, n_parents=20, max_iterations=40)
        result = select_genetic(problem, chosen, engine=engine, given=[np.array(greedy)])
        assert result.chosen.size <= len(greedy)
        assert (problem.covered(result.chosen.tolist()) >= problem.required).all()
