"""Candidates in rooms that a regular grid passes by."""

from collections.abc import Callable

import numpy as np
import pytest
from stages import find_candidates

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Candidates, PlanSettings, Scene
from planner_core.positions.candidates import N_HALVINGS
from planner_core.scanner.load_scanner import load_scanner

WALL_M = 0.1
HEIGHT_M = 2.5
SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=0.5, instrument_heights_m=(1.5,))


def candidates_of(scene: Scene) -> Candidates:
    survey = make_survey(scene, SETTINGS)
    engine = open_engine(scene, survey.patches, engine="open3d")
    return find_candidates(survey, SETTINGS, engine, floors=(0,))


def hall_with_closet(boxes_scene: Callable[..., Scene], closet_width_m: float) -> Scene:
    """A hall of 4 x 3 m and, behind a wall, a closet of 3 m by the given width; nothing else."""
    x = (0.0, 4.0, 4.0 + WALL_M, 4.0 + WALL_M + closet_width_m)
    solids = [
        ((x[0], 0.0, -0.2), (x[3], 3.0, 0.0)),
        ((x[0], 0.0, HEIGHT_M), (x[3], 3.0, HEIGHT_M + 0.2)),
        ((x[1], 0.0, 0.0), (x[2], 3.0, HEIGHT_M)),
        ((x[0] - WALL_M, 0.0, -0.2), (x[0], 3.0, HEIGHT_M + 0.2)),
        ((x[3], 0.0, -0.2), (x[3] + WALL_M, 3.0, HEIGHT_M + 0.2)),
        ((x[0], -WALL_M, -0.2), (x[3], 0.0, HEIGHT_M + 0.2)),
        ((x[0], 3.0, -0.2), (x[3], 3.0 + WALL_M, HEIGHT_M + 0.2)),
    ]
    return boxes_scene(solids)


@pytest.mark.parametrize("closet_width_m", [0.95, 1.1, 1.3])
def test_a_closet_just_wider_than_the_clearance_has_candidates_in_its_middle(
    boxes_scene: Callable[..., Scene], closet_width_m: float
) -> None:
    candidates = candidates_of(hall_with_closet(boxes_scene, closet_width_m))
    x = candidates.position_m[:, 0]
    inside = x[x > 4.0 + WALL_M]
    assert inside.size, "the closet was passed by"
    assert (inside >= 4.0 + WALL_M + SETTINGS.clearance_m).all()
    assert (inside <= 4.0 + WALL_M + closet_width_m - SETTINGS.clearance_m).all()
    assert candidates.n_tried == candidates.floor.size + sum(candidates.rejected.values())


def test_no_two_candidates_are_closer_than_the_finest_grid_allows_and_the_order_is_y_x(
    boxes_scene: Callable[..., Scene],
) -> None:
    place = candidates_of(hall_with_closet(boxes_scene, 1.1)).position_m[:, :2]
    apart = np.linalg.norm(place[:, None] - place[None], axis=-1)[~np.eye(len(place), dtype=bool)]
    assert apart.min() >= SETTINGS.grid_step_m / 2**N_HALVINGS - 1e-9
    assert (np.diff(np.lexsort((place[:, 0], place[:, 1]))) == 1).all()
