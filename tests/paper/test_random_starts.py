"""Random starting positions: where a tripod can stand, evenly, and the same ones however many are asked for."""

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
from planner_core.paper.random_starts import sample_at_random
from planner_core.positions.ground_surface import GroundSurface
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), max_patch_area_m2=1.0)


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
