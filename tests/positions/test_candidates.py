"""Candidates off the grid: around chosen stations, above and below them, and the same once they went through a file."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stages import tripod_tests, tripods_of

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Candidates, PlanSettings, Survey
from planner_core.plan_folder.results_json import rounded
from planner_core.positions.admissibility import RefusalTally
from planner_core.positions.candidates import (
    N_DIRECTIONS,
    SET_UP_DIGITS,
    as_written_m,
    local_of_written_m,
    places_nearby,
)
from planner_core.positions.ground_surface import GroundSurface
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0)
METRES = st.floats(-2000.0, 2000.0)
#: Offsets are whole metres, up to those of national grids.
OFFSETS = st.integers(-9_999_999, 9_999_999)


def opened(name: str) -> tuple[Survey, ScanEngine]:
    scene = scenes_synthetic.build(name).scene
    survey = make_survey(scene, SETTINGS)
    return survey, open_engine(scene, survey.patches, engine="open3d")


@pytest.fixture(scope="module")
def box() -> tuple[Survey, ScanEngine]:
    return opened("box")


def standing(position_m: list[tuple[float, float, float]]) -> Candidates:
    """Stations over a floor at height 0."""
    position = np.array(position_m)
    return Candidates(position, np.zeros(len(position), np.int32), position[:, 2].copy(), n_tried=0)


def test_in_the_middle_of_a_room_all_of_them_can_be_stood_at(box) -> None:
    found = places_nearby(
        tripods_of(*box[:1], SETTINGS, box[1]), standing([(3, 2, 1.2)]), radii_m=(0.25, 0.5), rises_m=(0.3, -0.3)
    )
    away = np.linalg.norm(found.position_m[:, :2] - [3, 2], axis=1)
    np.testing.assert_allclose(np.sort(away), [0] * 2 + [0.25] * N_DIRECTIONS + [0.5] * N_DIRECTIONS, atol=1e-4)
    np.testing.assert_allclose(np.sort(found.position_m[away < 0.1, 2]), [0.9, 1.5])
    np.testing.assert_allclose(found.position_m[:, 2], found.instrument_height_m, atol=1e-9)
    directions = np.degrees(np.arctan2(*(found.position_m[away > 0.1, :2] - [3, 2]).T[::-1])) % 360
    assert np.unique(np.round(directions)).size == 2 * N_DIRECTIONS  # the circles are turned against each other


def test_they_have_as_many_digits_as_files_keep_of_them(box) -> None:
    odd = standing([(3.0 + 1 / 7, 2.0 - 1 / 9, 1.2 + 1 / 3)])
    found = places_nearby(tripods_of(*box[:1], SETTINGS, box[1]), odd, radii_m=(1 / 3,), rises_m=(1 / 7,))
    assert found.floor.size == N_DIRECTIONS + 1
    for place in (*found.position_m.ravel().tolist(), *found.instrument_height_m.tolist()):
        assert float(f"{place:.4f}") == place


def test_walls_and_the_tripods_own_heights_limit_them(box) -> None:
    near_wall = places_nearby(
        tripods_of(*box[:1], SETTINGS, box[1]), standing([(0.5, 2, 1.9)]), radii_m=(0.3,), rises_m=(0.4, -0.4)
    )
    assert near_wall.position_m[:, 0].min() >= 0.4 - 0.002
    assert near_wall.instrument_height_m.max() <= SETTINGS.scanner.instrument_height_max_m
    assert near_wall.n_tried == N_DIRECTIONS + 1
    assert near_wall.rejected == {"too close to something": near_wall.n_tried - near_wall.floor.size}
    assert near_wall.floor.size < near_wall.n_tried


def test_a_height_that_the_user_fixed_is_kept(box) -> None:
    fixed = replace(SETTINGS, instrument_heights_m=(1.7,))
    found = places_nearby(tripods_of(box[0], fixed, box[1]), standing([(3, 2, 1.7)]), radii_m=(0.25,), rises_m=(0.2,))
    np.testing.assert_allclose(found.instrument_height_m, 1.7)
    assert found.floor.size == N_DIRECTIONS


@pytest.mark.slow
def test_on_several_floors_each_stays_on_its_own_and_the_order_is_that_of_the_stations() -> None:
    survey, engine = opened("house")
    places = []
    for index, floor in enumerate(survey.floors):
        ground = GroundSurface(survey, floor)
        plan = np.mean(floor.bounds_m, axis=0) + np.array([[x, y] for x in np.arange(-2, 2, 0.5) for y in (-1, 1.0)])
        z = ground.below(np.column_stack([plan, np.full(len(plan), floor.elevation_m + 0.5)]))
        position = np.column_stack([plan, z + 1.5])[~np.isnan(z)]
        kept = tripod_tests(survey, SETTINGS, engine, floor).keep(position, z[~np.isnan(z)], RefusalTally())
        places += [(index, place) for place in position[kept][:2]]
    places = places[::-1]
    near = Candidates(
        np.array([place for _, place in places]),
        np.array([index for index, _ in places], dtype=np.int32),
        np.full(len(places), 1.5),
        n_tried=0,
    )
    found = places_nearby(tripods_of(survey, SETTINGS, engine), near, radii_m=(0.25,), rises_m=())
    source = np.argmin(np.linalg.norm(found.position_m[:, None] - near.position_m, axis=2), axis=1)
    assert (np.diff(source) >= 0).all() and np.unique(source).size == len(places)
    np.testing.assert_array_equal(found.floor, near.floor[source])
    assert np.linalg.norm(found.position_m - near.position_m[source], axis=1).max() < 0.25 + 1e-4


@settings(max_examples=200, deadline=None)
@given(place_m=st.tuples(METRES, METRES, METRES), offset_m=st.tuples(OFFSETS, OFFSETS, OFFSETS))
def test_a_place_is_the_same_once_plan_json_has_kept_it(place_m, offset_m):
    for digits in (6, SET_UP_DIGITS):
        local_m = as_written_m(np.array(place_m), digits)
        scene_m = local_m + np.array(offset_m, dtype=np.float64)
        kept = json.loads(json.dumps([rounded(float(value)) for value in scene_m]))
        back_m = local_of_written_m(kept, np.array(offset_m, dtype=np.float64))
        assert back_m.tobytes() == local_m.tobytes()


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(value_m=METRES)
def test_rounded_places_stay_as_they_are_and_are_near(value_m):
    rounded_m = as_written_m(np.array([value_m]))
    assert as_written_m(rounded_m).tobytes() == rounded_m.tobytes()
    assert abs(rounded_m[0] - value_m) <= 0.5e-6 + 1e-12
    assert not np.signbit(as_written_m(np.array([-1e-9])))[0]
