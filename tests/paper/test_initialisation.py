"""Random starting positions: where a tripod can stand, evenly, and the same ones however many are asked for.

The paper's three tests, in rooms where their outcome follows from the drawing, with both engines.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare, kstest
from stages import find_candidates, tripod_tests, tripods_of

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import PlanSettings, Scene, Survey
from planner_core.paper.initialisation import sample_at_random, stands_by_published_tests
from planner_core.positions.ground_surface import GroundSurface
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0)
BOTH_ENGINES = pytest.mark.parametrize("engine", ["open3d", "auto"])


def opened(scene: Scene) -> tuple[Survey, ScanEngine]:
    survey = make_survey(scene, SETTINGS)
    return survey, open_engine(scene, survey.patches, engine="open3d")


@pytest.fixture(scope="module")
def box() -> tuple[Survey, ScanEngine]:
    return opened(scenes_synthetic.build("box").scene)


@pytest.fixture(scope="module")
def house() -> tuple[Survey, ScanEngine]:
    return opened(scenes_synthetic.build("house").scene)


def test_they_are_spread_evenly_over_free_ground_and_heights(box) -> None:
    """A room of 6 x 4 m: free is what is 0.4 m from the walls; heights are 0.5 to 2 m."""
    found = sample_at_random(tripods_of(box[0], SETTINGS, box[1]), n_each=2000, seed=1)
    assert found.floor.size == 2000
    low, high = np.array([0.4, 0.4]), np.array([5.6, 3.6])
    share = (found.position_m[:, :2] - low) / (high - low)
    assert share.min() > -0.002 and share.max() < 1.002  # clearance looks in eight directions, a little off the axes
    cell = np.floor(np.clip(share, 0, 1 - 1e-9) * [6, 4]).astype(int)
    counted = np.bincount(cell[:, 0] * 4 + cell[:, 1], minlength=24)
    assert chisquare(counted).pvalue > 1e-3, counted
    assert kstest((found.instrument_height_m - 0.5) / 1.5, "uniform").pvalue > 1e-3
    np.testing.assert_allclose(found.position_m[:, 2], found.instrument_height_m, atol=1e-9)


@pytest.mark.slow
def test_a_tripod_can_stand_at_all_of_them(house) -> None:
    survey, engine = house
    found = sample_at_random(tripods_of(survey, SETTINGS, engine), n_each=150, seed=3)
    for index in (0, 1):
        floor, place = survey.floors[index], found.position_m[found.floor == index]
        assert len(place) == 150
        ground = GroundSurface(survey, floor).below(place)
        np.testing.assert_allclose(place[:, 2] - ground, found.instrument_height_m[found.floor == index], atol=1e-6)
        assert tripod_tests(survey, SETTINGS, engine, floor).reject(place, ground)[0].all()
    assert found.n_tried == found.floor.size + sum(found.rejected.values())


def test_asking_for_more_or_other_floors_gives_the_same_ones_first(house) -> None:
    survey, engine = house
    few = sample_at_random(tripods_of(survey, SETTINGS, engine, (1,)), n_each=20, seed=3).position_m
    more = sample_at_random(tripods_of(survey, SETTINGS, engine), n_each=400, seed=3)
    np.testing.assert_array_equal(more.position_m[more.floor == 1][:20], few)
    other = sample_at_random(tripods_of(survey, SETTINGS, engine, (1,)), n_each=20, seed=4).position_m
    assert (few != other).all(axis=1).all()


def test_given_heights_are_drawn_among(box) -> None:
    settings = replace(SETTINGS, instrument_heights_m=(1.2, 1.6))
    found = sample_at_random(tripods_of(box[0], settings, box[1], (0,)), n_each=300, seed=2)
    values, counted = np.unique(found.instrument_height_m, return_counts=True)
    assert values.tolist() == [1.2, 1.6]
    assert chisquare(counted).pvalue > 1e-3, counted


def test_a_floor_without_free_ground_gives_fewer_and_ends(box) -> None:
    crowded = replace(SETTINGS, clearance_m=3.0)  # the room is 4 m wide
    found = sample_at_random(tripods_of(box[0], crowded, box[1], (0,)), n_each=5, seed=2)
    assert found.position_m.shape == (0, 3) and found.n_tried == 1000 == sum(found.rejected.values())


def test_counts_below_zero_are_refused(box) -> None:
    for n_each, seed in ((-1, 0), (1, -1)):
        with pytest.raises(RequirementError, match="random starts"):
            sample_at_random(tripods_of(box[0], SETTINGS, box[1], (0,)), n_each=n_each, seed=seed)


def test_the_plain_matrix_is_the_grid_without_its_halvings(box) -> None:
    settings = replace(SETTINGS, grid_step_m=0.5)
    matrix = find_candidates(box[0], settings, box[1], floors=(0,), n_halvings=0).position_m
    plan = np.unique(matrix[:, :2].round(9), axis=0)
    x, y = 0.5 * np.arange(1, 12), 0.5 * np.arange(1, 8)  # inside 0..6 x 0..4, 0.4 m from the walls
    assert {tuple(p) for p in plan.tolist()} == {(a, b) for a in x.tolist() for b in y.tolist()}
    np.testing.assert_allclose(np.unique(matrix[:, 2].round(9)), [0.5, 0.9, 1.3, 1.7])
    coarse = replace(SETTINGS, grid_step_m=0.9)  # so coarse that the halved grid finds places between
    matrix, refined = (
        {tuple(p) for p in find_candidates(box[0], coarse, box[1], floors=(0,), n_halvings=n).position_m.tolist()}
        for n in (0, 2)
    )
    assert matrix < refined


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


@BOTH_ENGINES
def test_in_an_empty_room_walls_keep_their_distance_along_the_axes(engine) -> None:
    place = [(x, y, 1.5) for x in (0.39, 0.41, 3.0, 5.59, 5.61) for y in (0.39, 0.41, 2.0, 3.59, 3.61)]
    expected = [0.4 < x < 5.6 and 0.4 < y < 3.6 for x, y, _ in place]
    assert stands(room(), place, engine) == expected


@BOTH_ENGINES
def test_over_a_table_or_with_feet_under_it_nothing_stands(engine) -> None:
    table = ((2.0, 1.0, 0.7), (4.0, 3.0, 0.75))
    # Over it; with the ring of 0.2 m over its edge; beside it; and beside it with the sensor as high as the top.
    place = [(3.0, 2.0, 1.5), (1.85, 2.0, 1.5), (1.75, 2.0, 1.5), (1.75, 2.0, 0.72), (1.55, 2.0, 0.72)]
    assert stands(room(table), place, engine) == [False, False, True, False, True]


@BOTH_ENGINES
def test_feet_count_one_by_one(engine) -> None:
    # A block 3 cm wide stands 0.2 m to the south-east, under one of 16 rays; a ring of four rays goes by.
    x, y = 3.0 + 0.2 * np.cos(-np.pi / 4), 2.0 + 0.2 * np.sin(-np.pi / 4)
    block = ((x - 0.015, y - 0.015, 0.0), (x + 0.015, y + 0.015, 0.3))
    assert stands(room(block), [(3.0, 2.0, 1.5)], engine) == [False]
    assert stands(room(block), [(3.0, 2.0, 1.5)], engine, replace(SETTINGS, n_ground_ring_rays=4)) == [True]


@BOTH_ENGINES
@pytest.mark.slow
def test_four_rays_miss_what_stands_diagonally_and_ours_do_not(engine) -> None:
    column = ((3.22, 2.22, 0.0), (3.3, 2.3, 2.6))  # 0.31 m away, to the north-east
    assert stands(room(column), [(3.0, 2.0, 1.5)], engine) == [True]
    settings = replace(SETTINGS, instrument_heights_m=(1.5,))
    survey = make_survey(room(column), settings)
    scan_engine = open_engine(room(column), survey.patches, engine=engine)
    ours = find_candidates(survey, settings, scan_engine, floors=(0,), n_halvings=0).position_m
    assert np.abs(ours[:, :2] - [3.0, 2.0]).max(axis=1).min() > 0.4


@BOTH_ENGINES
def test_on_the_plane_of_a_floor_without_slab_tripods_stand(engine) -> None:
    survey = make_survey(scenes_synthetic.build("without-slabs").scene, SETTINGS)
    index, floor = next((i, floor) for i, floor in enumerate(survey.floors) if floor.origin == "storey-elevation")
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine)
    ours = find_candidates(survey, SETTINGS, scan_engine, floors=(index,), n_halvings=0).position_m
    outside = np.array([[floor.bounds_m[1, 0] + 2.0, *ours[0, 1:]]])
    found = stands_by_published_tests(tripods_of(survey, SETTINGS, scan_engine), index, np.vstack([ours, outside]))
    assert found[:-1].mean() > 0.98 and not found[-1]


@pytest.mark.slow
@BOTH_ENGINES
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
