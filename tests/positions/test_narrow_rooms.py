"""Candidates in rooms that a regular grid passes by."""

import numpy as np
import pytest
from stages import find_candidates

from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import open_engine
from planner_core.model import PlanSettings, Scene
from planner_core.positions.grid import N_HALVINGS
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays

WALL_M = 0.1
HEIGHT_M = 2.5


def closed_box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """(12, 3, 3) corners of a box's triangles."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    points = np.array(low) + corner * (np.array(high) - np.array(low))
    return np.array([[points[i] for i in t] for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def hall_with_closet(closet_width_m: float) -> Scene:
    """A hall of 4 x 3 m and, behind a wall, a closet of 3 m by the given width; nothing else."""
    x = (0.0, 4.0, 4.0 + WALL_M, 4.0 + WALL_M + closet_width_m)
    solids = [
        closed_box((x[0], 0.0, -0.2), (x[3], 3.0, 0.0)),
        closed_box((x[0], 0.0, HEIGHT_M), (x[3], 3.0, HEIGHT_M + 0.2)),
        closed_box((x[1], 0.0, 0.0), (x[2], 3.0, HEIGHT_M)),
        closed_box((x[0] - WALL_M, 0.0, -0.2), (x[0], 3.0, HEIGHT_M + 0.2)),
        closed_box((x[3], 0.0, -0.2), (x[3] + WALL_M, 3.0, HEIGHT_M + 0.2)),
        closed_box((x[0], -WALL_M, -0.2), (x[3], 0.0, HEIGHT_M + 0.2)),
        closed_box((x[0], 3.0, -0.2), (x[3], 3.0 + WALL_M, HEIGHT_M + 0.2)),
    ]
    corners = np.concatenate(solids).reshape(-1, 3)
    return scene_from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))


@pytest.mark.parametrize("closet_width_m", [0.95, 1.1, 1.3])
def test_a_closet_just_wider_than_the_clearance_has_candidates_in_its_middle(closet_width_m: float) -> None:
    scene = hall_with_closet(closet_width_m)
    settings = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=0.5, instrument_heights_m=(1.5,))
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches, engine="open3d")
    candidates = find_candidates(survey, settings, engine, floors=(0,))
    x = candidates.position_m[:, 0]
    inside = x[x > 4.0 + WALL_M]
    assert inside.size, "the closet was passed by"
    assert (inside >= 4.0 + WALL_M + settings.clearance_m).all()
    assert (inside <= 4.0 + WALL_M + closet_width_m - settings.clearance_m).all()
    assert candidates.n_tried == candidates.floor.size + sum(candidates.rejected.values())


def test_no_two_candidates_are_closer_than_the_finest_grid_allows_and_the_order_is_y_x() -> None:
    scene = hall_with_closet(1.1)
    settings = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=0.5, instrument_heights_m=(1.5,))
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches, engine="open3d")
    place = find_candidates(survey, settings, engine, floors=(0,)).position_m[:, :2]
    apart = np.linalg.norm(place[:, None] - place[None], axis=-1)[~np.eye(len(place), dtype=bool)]
    assert apart.min() >= settings.grid_step_m / 2**N_HALVINGS - 1e-9
    assert (np.diff(np.lexsort((place[:, 0], place[:, 1]))) == 1).all()
