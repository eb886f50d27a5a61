"""Scenes of absurd size: refused before floors, patches and grids are made of them."""

from dataclasses import replace

import numpy as np
import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.errors import SceneError
from planner_core.model import PlanSettings, Scene
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.extent import check_extent, extent_m
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from tests.reality_files import reality


def box_scene(*sides_m: float) -> Scene:
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) * np.array(sides_m)
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7)]
    faces += [(0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    return scene_from_arrays(corners, np.array(faces))


@pytest.mark.parametrize(
    "sides_m",
    [
        (12.0, 9.0, 6.0),
        (0.6, 0.4, 0.2),  # a vitrine
        (19_000.0, 12.0, 8.0),  # a tunnel
        (4_000.0, 3_000.0, 40.0),  # an airport
        (60.0, 60.0, 900.0),  # the highest of towers
    ],
)
def test_what_can_be_built_is_taken(sides_m):
    check_extent(box_scene(*sides_m))


@pytest.mark.parametrize(
    ("sides_m", "words", "unit"),
    [
        ((12_000.0, 9_000.0, 3_000.0), "12000 x 9000 x 3000 m", "mm"),  # one storey, millimetres taken for metres
        ((25_000.0, 12.0, 8.0), "25000 x 12 x 8 m", "mm"),
        ((0.4, 0.3, 0.2), "0.4 x 0.3 x 0.2 m", "km"),
        ((0.012, 0.009, 0.006), "0.012 x 0.009 x 0.006 m", "km"),
    ],
)
def test_what_cannot_is_refused_with_its_size_and_the_unit_to_pass(sides_m, words, unit):
    with pytest.raises(SceneError) as error:
        check_extent(box_scene(*sides_m))
    assert words in str(error.value)
    assert f"--units {unit}" in str(error.value)


def test_a_house_in_millimetres_is_refused_before_its_floors_are_looked_for(monkeypatch):
    house = scenes_synthetic.build("house").scene
    large = replace(house, vertices_m=1000.0 * house.vertices_m)
    monkeypatch.setattr("planner_core.coverage.survey.find_floors", lambda *_: pytest.fail("floors were looked for"))
    with pytest.raises(SceneError, match="--units mm"):
        make_survey(large, PlanSettings(scanner=load_scanner("hdl-64e")))


@pytest.mark.slow
def test_a_stray_face_makes_no_building_too_large():
    house = scenes_synthetic.build("house").scene
    n = house.vertices_m.shape[0]
    vertices = np.concatenate([house.vertices_m, 15_000.0 + np.eye(3)])
    scene = scene_from_arrays(vertices, np.concatenate([house.triangles, [[n, n + 1, n + 2]]]))
    assert np.ptp(scene.vertices_m, axis=0).min() > 14_000
    assert extent_m(scene).max() < 100
    check_extent(scene)


def test_levels_of_many_square_kilometres_are_refused_and_a_road_is_not():
    levels = np.concatenate(
        [box_scene(10_000.0, 10_000.0, 1.0).vertices_m + np.array([0, 0, 3.0 * k]) for k in range(3)]
    )
    faces = np.concatenate([box_scene(1.0, 1.0, 1.0).triangles + 8 * k for k in range(3)])
    with pytest.raises(SceneError, match=r"surfaces cover 600 km2 seen from above.*--units mm, in which it is 10 m"):
        check_extent(scene_from_arrays(levels, faces))
    on_grid = box_scene(5_000.0, 30.0, 1.0).vertices_m + np.array([500_000.0, 5_800_000.0, 40.0])
    check_extent(scene_from_arrays(on_grid, faces[:12]))


@pytest.mark.parametrize("side_m", [2e7, 4e4])
def test_no_unit_is_named_where_none_makes_a_building(side_m):
    scene = box_scene(side_m, side_m, side_m)
    with pytest.raises(SceneError) as error:
        check_extent(scene)
    assert ("--units mm" in str(error.value)) == (side_m == 4e4)
    assert ("no unit makes a building of it" in str(error.value)) == (side_m == 2e7)


def test_floors_of_what_is_no_building_are_refused_before_plumb_lines_are_cast(monkeypatch):
    monkeypatch.setattr("planner_core.scene.floors.LevelSurvey", lambda _: pytest.fail("plumb lines were cast"))
    with pytest.raises(SceneError, match=r"expected 0\.5 m to 20 km"):
        find_floors(box_scene(12_000.0, 9_000.0, 3_000.0))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("usd-sphere-radius-1e7.usda", "no unit makes a building of it"),
        pytest.param("usd-metersperunit-1e7.usda", "--units m, in which it is 2 m long", marks=pytest.mark.slow),
        ("usd-sphere-radius-1e20.usda", "not finite"),
        pytest.param("obj-300-levels-10km.obj", "surfaces cover 15000 km2", marks=pytest.mark.slow),
    ],
)
def test_real_scenes_of_kilometres_are_refused_in_one_line(name, words):
    path = reality(name)
    with pytest.raises(SceneError) as error:
        find_floors(load_scene(path))
    assert words in str(error.value)
