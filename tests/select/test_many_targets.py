"""More targets than an integer has bits."""

import numpy as np
import pytest
from oracles import floor_constraints

from planner_core.model import Visibility
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem


@pytest.mark.slow
def test_every_one_of_a_hundred_floors_is_covered() -> None:
    n_floors = 100
    floor = np.arange(n_floors, dtype=np.int32)  # one patch a floor, one position a patch
    visibility = Visibility(np.arange(n_floors + 1), np.arange(n_floors, dtype=np.int32), n_floors)
    constraints = floor_constraints(floor, tuple(range(n_floors)), np.ones(n_floors, dtype=bool), 1.0)
    problem = cover_problem(visibility, np.full(n_floors, 0.04), constraints)
    assert (problem.required > 0).all()
    assert sorted(select_greedy(problem).chosen) == list(range(n_floors))
