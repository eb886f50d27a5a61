"""Settings: the paper's defaults, and what is refused."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from planner_core.errors import RequirementError
from planner_core.paper.genetic import GeneticSettings, select_genetic

BAD = [
    ({"objective": "most"}, "objective"),
    ({"selection": "roulette"}, "selection"),
    ({"crossover": "three-point"}, "crossover"),
    ({"replacement": "none"}, "replacement"),
    ({"crossover_rate": 1.5}, "crossover rate"),
    ({"crossover_rate": float("nan")}, "crossover rate"),
    ({"individual_mutation_rate": -0.1}, "individual mutation rate"),
    ({"gene_mutation_rate": "much"}, "gene mutation rate"),
    ({"population": 1}, "population"),
    ({"population": 500.0}, "population"),
    ({"n_parents": 501}, "n parents"),
    ({"n_parents": 1}, "n parents"),
    ({"tournament_size": 0}, "tournament size"),
    ({"n_elite": 500, "replacement": "generational"}, "n elite"),
    ({"n_elite": 1}, "n elite"),
    ({"distinct": True, "replacement": "generational"}, "distinct"),
    ({"max_iterations": -1}, "max iterations"),
    ({"patience": 0}, "patience"),
    ({"seed": -1}, "seed"),
    ({"seed": 2**64}, "seed"),
    ({"objective": "coverage-at-most-n"}, "n stations"),
    ({"expected_active": "half"}, "expected active"),
    ({"expected_active": 0}, "expected active"),
    ({"expected_active": float("inf")}, "expected active"),
]


@pytest.mark.parametrize(("bad", "words"), BAD, ids=lambda value: str(value))
def test_settings_that_make_no_sense_are_refused_in_one_line(bad, words):
    with pytest.raises(RequirementError, match=words) as caught:
        GeneticSettings(**bad)
    assert "\n" not in str(caught.value)
    assert "got" in str(caught.value)
    assert "expected" in str(caught.value)


def test_defaults_are_those_of_table_3():
    settings = GeneticSettings()
    assert (settings.max_iterations, settings.population, settings.n_parents) == (50_000, 500, 250)
    assert (settings.gene_mutation_rate, settings.individual_mutation_rate, settings.crossover_rate) == (0.02, 0.1, 0.8)
    assert (settings.patience, settings.crossover, settings.tournament_size) == (30, "two-point", 2)
    assert (settings.selection, settings.replacement) == ("tournament", "stationary")


def test_settings_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        GeneticSettings().seed = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"engine": "gpu"}, "engine"),
        ({"given": [np.array([40])]}, "candidate 40"),
        ({"given": [np.array([3, -1])]}, "candidate -1"),
        ({"given": [np.array([0])] * 5}, "5 given sets"),
    ],
    ids=lambda value: str(value),
)
def test_selection_refuses_calls_that_make_no_sense(make_problem, call, words):
    with pytest.raises(RequirementError, match=words):
        select_genetic(make_problem(0), GeneticSettings(population=4, n_parents=2), **call)


@pytest.mark.parametrize("engine", ["host", "device"])
def test_selection_refuses_a_problem_without_candidates(matrix_problem, engine):
    nobody = matrix_problem(np.zeros((0, 3), bool), np.ones(3), np.full((1, 3), True), np.array([1]))
    with pytest.raises(RequirementError, match="no candidates"):
        select_genetic(nobody, engine=engine)


def test_selection_refuses_weights_that_keys_cannot_hold(matrix_problem):
    heavy = matrix_problem(np.ones((3, 2), bool), np.array([2**60, 2**60]), np.full((1, 2), True), np.array([1]))
    with pytest.raises(RequirementError, match="product"):
        select_genetic(heavy, engine="host")
