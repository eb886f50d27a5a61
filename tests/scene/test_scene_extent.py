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


def test_a_stray_face_makes_no_building_too_large():
    house = scenes_synthetic.build("house").scene
    n = house.vertices_m.shape[0]
    vertices = np.concatenate([house.vertices_m, 15_000.0 + np.eye(3)])
    scene = scene_from_arrays(vertices, np.concatenate([house.triangles, [[n, n + 1, n + 2]]]))
    assert np.ptp(scene.vertices_m, axis=0).min() > 14_000
    assert extent_m(scene).max() < 100
    check_extent(scene)
