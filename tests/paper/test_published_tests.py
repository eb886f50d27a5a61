"""The paper's three tests, in rooms where their outcome follows from the drawing, with both engines."""

from dataclasses import replace

import numpy as np
import pytest
from stages import find_candidates, tripods_of

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings, Scene
from planner_core.paper.published_tests import stands_by_published_tests
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0)
pytestmark = pytest.mark.parametrize("engine", ["open3d", "auto"])


def box_corners(low, high) -> np.ndarray:
    """(12, 3, 3) corners of a closed box's triangles."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    points = np.array(low) + corner * (np.array(high) - np.array(low))
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([[points[i] for i in t] for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def room(*furniture) -> Scene:
    """6 x 4 m, 2.6 m high, floor and ceiling slabs, walls; and boxes (low, high) in it."""
    walls = [
        ((-0.2, -0.2, -0.2), (6.2, 4.2, 0.0)),
        ((-0.2, -0.2, 2.6), (6.2, 4.2, 2.8)),
        ((-0.2, -0.2, 0.0), (0.0, 4.2, 2.6)),
        ((6.0, -0.2, 0.0), (6.2, 4.2, 2.6)),
        ((0.0, -0.2, 0.0), (6.0, 0.0, 2.6)),
        ((0.0, 4.0, 0.0), (6.0, 4.2, 2.6)),
    ]
    corners = np.concatenate([box_corners(*box) for box in (*walls, *furniture)]).reshape(-1, 3)
    return scene_from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))


def stands(scene: Scene, positions, engine: str, settings: PlanSettings = SETTINGS) -> list[bool]:
    survey = make_survey(scene, settings)
    scan_engine = open_engine(scene, survey.patches, engine=engine)
    place = np.array(positions, dtype=float).reshape(-1, 3)
    return stands_by_published_tests(tripods_of(survey, settings, scan_engine), 0, place).tolist()


def test_in_an_empty_room_walls_keep_their_distance_along_the_axes(engine) -> None:
    place = [(x, y, 1.5) for x in (0.39, 0.41, 3.0, 5.59, 5.61) for y in (0.39, 0.41, 2.0, 3.59, 3.61)]
    expected = [0.4 < x < 5.6 and 0.4 < y < 3.6 for x, y, _ in place]
    assert stands(room(), place, engine) == expected


def test_over_a_table_or_with_feet_under_it_nothing_stands(engine) -> None:
    table = ((2.0, 1.0, 0.7), (4.0, 3.0, 0.75))
    # Over it; with the ring of 0.2 m over its edge; beside it; and beside it with the sensor as high as the top.
    place = [(3.0, 2.0, 1.5), (1.85, 2.0, 1.5), (1.75, 2.0, 1.5), (1.75, 2.0, 0.72), (1.55, 2.0, 0.72)]
    assert stands(room(table), place, engine) == [False, False, True, False, True]


def test_feet_count_one_by_one(engine) -> None:
    # A block 3 cm wide stands 0.2 m to the south-east, under one of 16 rays; a ring of four rays goes by.
    x, y = 3.0 + 0.2 * np.cos(-np.pi / 4), 2.0 + 0.2 * np.sin(-np.pi / 4)
    block = ((x - 0.015, y - 0.015, 0.0), (x + 0.015, y + 0.015, 0.3))
    assert stands(room(block), [(3.0, 2.0, 1.5)], engine) == [False]
    assert stands(room(block), [(3.0, 2.0, 1.5)], engine, replace(SETTINGS, n_ground_ring_rays=4)) == [True]


@pytest.mark.slow
def test_four_rays_miss_what_stands_diagonally_and_ours_do_not(engine) -> None:
    column = ((3.22, 2.22, 0.0), (3.3, 2.3, 2.6))  # 0.31 m away, to the north-east
    assert stands(room(column), [(3.0, 2.0, 1.5)], engine) == [True]
    settings = replace(SETTINGS, instrument_heights_m=(1.5,))
    survey = make_survey(room(column), settings)
    scan_engine = open_engine(room(column), survey.patches, engine=engine)
    ours = find_candidates(survey, settings, scan_engine, floors=(0,), n_halvings=0).position_m
    assert np.abs(ours[:, :2] - [3.0, 2.0]).max(axis=1).min() > 0.4


def test_on_the_plane_of_a_floor_without_slab_tripods_stand(engine) -> None:
    survey = make_survey(scenes_synthetic.build("without-slabs").scene, SETTINGS)
    index, floor = next((i, floor) for i, floor in enumerate(survey.floors) if floor.origin == "storey-elevation")
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine)
    ours = find_candidates(survey, SETTINGS, scan_engine, floors=(index,), n_halvings=0).position_m
    outside = np.array([[floor.bounds_m[1, 0] + 2.0, *ours[0, 1:]]])
    found = stands_by_published_tests(tripods_of(survey, SETTINGS, scan_engine), index, np.vstack([ours, outside]))
    assert found[:-1].mean() > 0.98 and not found[-1]


def test_what_passes_ours_passes_the_papers(engine) -> None:
    """In the furnished house, whose furniture is flush with nothing."""
    scene = scenes_synthetic.build("house").scene
    settings = replace(SETTINGS, grid_step_m=0.45)
    survey = make_survey(scene, settings)
    scan_engine = open_engine(scene, survey.patches, engine=engine)
    for index in range(len(survey.floors)):
        ours = find_candidates(survey, settings, scan_engine, floors=(index,), n_halvings=0).position_m
        theirs = stands_by_published_tests(tripods_of(survey, settings, scan_engine), index, ours)
        assert len(ours) > 50
        assert theirs.mean() > 0.98, ours[~theirs]
