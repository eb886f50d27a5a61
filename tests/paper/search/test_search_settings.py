"""Settings are the paper's by default, and nonsense is refused in one line that names it."""

import dataclasses

import numpy as np
import pytest

from planner_core.errors import RequirementError
from planner_core.paper.search import SearchSettings, search


def test_defaults_are_those_of_table_1() -> None:
    options = SearchSettings()
    assert (options.max_iterations, options.max_without_improvement) == (60, 10)
    assert (options.n_directions, options.step_m) == (16, 0.05)
    assert (options.initial_temperature, options.cooling) == (450.0, 0.8)
    assert 1 < options.tabu_voxel_steps < 2


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", -1),
        ("max_iterations", 0),
        ("max_without_improvement", 0),
        ("neighbourhood", "ring"),
        ("n_directions", 15),
        ("n_directions", 2),
        ("n_directions", 1_000_000),
        ("step_m", 0.0),
        ("step_m", float("nan")),
        ("reversal_slack", 0.0),
        ("initial_temperature", 0.0),
        ("cooling", 1.0),
        ("least_temperature", 0.0),
        ("least_temperature", 451.0),
        ("tabu_voxel_steps", 1.0),
        ("tabu_voxel_steps", 2.0),
        ("memo_cell_steps", 1.01),
        ("memo_cell_steps", 0.0),
        ("lattice_origin_m", (0.0, float("inf"), 0.0)),
        ("lattice_origin_m", (0.0, 0.0)),
    ],
)
def test_settings_without_sense_are_refused_by_name(name, value) -> None:
    with pytest.raises(RequirementError, match=f"^{name}: got .*expected .*; ") as raised:
        dataclasses.replace(SearchSettings(), **{name: value})
    assert "\n" not in str(raised.value)


BOUNDS = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])


@pytest.mark.parametrize(
    ("method", "starts", "bounds"),
    [
        ("hill", np.zeros((1, 3)), BOUNDS),
        ("ls", np.zeros((1, 2)), BOUNDS),
        ("ls", np.full((1, 3), np.nan), BOUNDS),
        ("ls", np.zeros((1, 3)), BOUNDS[::-1]),
        ("ls", np.zeros((1, 3)), BOUNDS[:1]),
        ("ls", np.zeros((1, 3)), BOUNDS + np.inf),
        ("ts", np.zeros((1, 3)), np.array([[0.0, 0, 0.01], [1, 1, 0.04]])),
        ("ts", np.full((1, 3), 9e4), BOUNDS),
    ],
)
def test_starts_bounds_and_methods_are_checked(method, starts, bounds, make_terrain, make_bowl) -> None:
    with pytest.raises(RequirementError):
        at_zero = SearchSettings(lattice_origin_m=(0.0, 0.0, 0.0))
        search(method, starts, make_terrain(make_bowl((0, 0, 0))), at_zero, bounds_m=bounds)


def test_a_valid_position_without_f2_is_refused(make_terrain) -> None:
    with pytest.raises(RequirementError, match="F2 of the valid position"):
        search("ls", np.zeros((1, 3)), make_terrain(lambda p: np.full(len(p), np.nan)), bounds_m=BOUNDS)
