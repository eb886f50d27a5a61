"""The ground below a position: against every triangle in turn, and against the ground that candidates stand on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stages import find_candidates

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Floor, PlanSettings, Survey
from planner_core.positions.ground_surface import GroundSurface
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=0.7, max_patch_area_m2=1.0)


@pytest.fixture(scope="module")
def box_survey() -> Survey:
    return make_survey(scenes_synthetic.build("box").scene, SETTINGS)


def surface_of(survey: Survey, corners: np.ndarray) -> GroundSurface:
    """The ground made of triangles (K, 3, 3) alone."""
    scene = scene_from_arrays(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    bounds = np.array([corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))])
    floor = Floor("F0", "Ground", 0.0, 1.0, np.arange(scene.n_triangles, dtype=np.int32), bounds, "slab")
    return GroundSurface(replace(survey, scene=scene), floor)


def height_below(corners: np.ndarray, position: np.ndarray) -> float:
    """Highest point of any triangle on the plumb line at or below `position`, by solving for its weights; or NaN."""
    heights = []
    for a, b, c in corners:
        sides = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        if abs(np.linalg.det(sides)) < 1e-9:
            continue
        lb, lc = np.linalg.solve(sides, position[:2] - a[:2])
        z = a[2] + lb * (b[2] - a[2]) + lc * (c[2] - a[2])
        if min(lb, lc, 1 - lb - lc) >= 0 and z <= position[2]:
            heights.append(z)
    return max(heights, default=np.nan)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**20), n=st.integers(1, 60), size=st.sampled_from([0.2, 1.0, 8.0]))
def test_it_is_the_highest_of_all_triangles_below(seed, n, size, box_survey) -> None:
    stream = np.random.default_rng(seed)
    centre = stream.uniform(-5, 5, (n, 1, 3)) * [1, 1, 0.3]
    corners = centre + stream.uniform(-size, size, (n, 3, 3)) * [1, 1, 0.1]
    surface = surface_of(box_survey, corners)
    place = stream.uniform([-7, -7, -3], [7, 7, 3], (80, 3))
    place[:40, :2] = corners[stream.integers(0, n, 40)].mean(axis=1)[:, :2]
    expected = [height_below(corners, p) for p in place]
    np.testing.assert_allclose(surface.below(place), expected, atol=1e-7, err_msg=f"seed {seed}")


def test_no_place_falls_between_triangles(box_survey) -> None:
    """Vertices, edges and rim of a fan belong to the ground."""
    angle = np.linspace(0, 2 * np.pi, 14)
    rim = np.column_stack([3.7 * np.cos(angle), 3.7 * np.sin(angle), np.full(14, 0.2)])
    rim += np.array([11.3, -4.1, 0])
    centre = np.array([11.3, -4.1, 0.2])
    corners = np.array([[centre, rim[k], rim[k + 1]] for k in range(13)])
    surface = surface_of(box_survey, corners)
    weights = np.linspace(0, 1, 41)[:, None]
    spokes = np.concatenate([centre + weights * (p - centre) for p in rim])
    chords = np.concatenate([rim[k] + weights * (rim[k + 1] - rim[k]) for k in range(13)])
    above = np.concatenate([spokes, chords])
    above[:, 2] += 1.5
    np.testing.assert_allclose(surface.below(above), 0.2, atol=1e-9)


def test_a_position_on_the_ground_stands_on_it_and_one_below_does_not(box_survey) -> None:
    corners = np.array([[[0.0, 0, 1], [4, 0, 1], [0, 4, 1]]])
    found = surface_of(box_survey, corners).below(np.array([[1.0, 1, 1], [1, 1, 1 - 1e-9], [1, 1, 0.99], [3, 3, 2]]))
    np.testing.assert_array_equal(found, [1.0, 1.0, np.nan, np.nan])


def test_without_slab_it_is_the_floors_elevation_where_the_storey_is() -> None:
    survey = make_survey(scenes_synthetic.build("without-slabs").scene, SETTINGS)
    floor = next(floor for floor in survey.floors if floor.origin == "storey-elevation")
    surface = GroundSurface(survey, floor)
    middle = [*floor.bounds_m.mean(axis=0), floor.elevation_m + 1.2]
    outside = [floor.bounds_m[1, 0] + 0.1, middle[1], middle[2]]
    found = surface.below(np.array([middle, outside, [*middle[:2], floor.elevation_m - 0.5]]))
    np.testing.assert_array_equal(found, [floor.elevation_m, np.nan, np.nan])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stairwell", "atrium", "house", pytest.param("duplex", marks=pytest.mark.slow)])
def test_candidates_stand_as_high_above_it_as_they_say(name: str, real_scene) -> None:
    scene = real_scene(name) if name == "duplex" else scenes_synthetic.build(name).scene
    survey = make_survey(scene, SETTINGS)
    engine = open_engine(scene, survey.patches, engine="open3d")
    for index, floor in enumerate(survey.floors):
        found = find_candidates(survey, SETTINGS, engine, floors=(index,), n_halvings=0)
        ground = GroundSurface(survey, floor).below(found.position_m)
        np.testing.assert_allclose(found.position_m[:, 2] - ground, found.instrument_height_m, atol=1e-6)
