"""Where a tripod can stand, in rooms where that can be counted by hand, with both engines."""

from dataclasses import replace

import numpy as np
import pytest
from stages import find_candidates

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Element, PlanSettings, Scene, Scope, SurveyScope
from planner_core.scanner.load_scanner import load_scanner
from tests.scene.floor_scenes import scene_of

SETTINGS = PlanSettings(scanner=load_scanner("hdl-64e"), grid_step_m=0.5, instrument_heights_m=(1.5,))
pytestmark = pytest.mark.parametrize("engine", ["open3d", "auto"])


def candidates_of(scene: Scene, settings: PlanSettings, engine: str):
    survey = make_survey(scene, settings)
    scan_engine = open_engine(scene, survey.patches, engine=engine)
    return find_candidates(survey, settings, scan_engine, floors=tuple(range(len(survey.floors))))


def with_rectangle(scene: Scene, low, high, *, first: bool) -> Scene:
    """The scene and a rectangle of no thickness, low and high two opposite corners (x, y, z), as element `Extra`."""
    (x0, y0, z), (x1, y1, _) = low, high
    corners = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], dtype=float)
    extra = scene.vertices_m.shape[0] + np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    owner = np.full(2, len(scene.elements), dtype=np.int32)
    order = slice(None, None, -1 if first else 1)
    return replace(
        scene,
        vertices_m=np.concatenate([scene.vertices_m, corners]),
        triangles=np.concatenate([scene.triangles, extra][order]),
        element_of_triangle=np.concatenate([scene.element_of_triangle, owner][order]),
        elements=(*scene.elements, Element("Extra", "IfcPlate", "Extra", 0)),
    )


def places(candidates) -> set[tuple[float, float]]:
    return {(x, y) for x, y in candidates.position_m[:, :2].round(6).tolist()}


def test_empty_room_has_the_grid_points_clear_of_its_walls(engine):
    # Inside 0..6 x 0..4, slab 0.2 m wider all round: the grid is centred on (3, 2), spots keep 0.4 m from the walls.
    found = candidates_of(scenes_synthetic.build("box").scene, SETTINGS, engine)
    x, y = 3 + 0.5 * np.arange(-6, 7), 2 + 0.5 * (np.arange(9) - 4)
    on_grid = {(a, b) for a in x.tolist() for b in y.tolist() if 0.4 <= a <= 5.6 and 0.4 <= b <= 3.6}
    assert {p for p in places(found) if all(abs(v * 2 - round(v * 2)) < 1e-9 for v in p)} == on_grid
    assert (found.position_m[:, 2] == pytest.approx(1.5)) and (found.instrument_height_m == 1.5).all()
    assert ((found.position_m[:, 0] >= 0.4) & (found.position_m[:, 0] <= 5.6)).all()
    assert found.n_tried == found.floor.size + sum(found.rejected.values())


@pytest.mark.slow
def test_spots_by_a_table_keep_clear_of_it(engine):
    table = ((2.0, 1.0, 0.75), (4.0, 3.0, 0.75))
    room = scenes_synthetic.build("box").scene
    found = candidates_of(with_rectangle(room, *table, first=False), SETTINGS, engine)
    free = candidates_of(room, SETTINGS, engine)
    near = {(x, y) for x, y in places(free) if 2.0 - 0.19 < x < 4.0 + 0.19 and 1.0 - 0.19 < y < 3.0 + 0.19}
    assert near and not places(found) & near
    assert (1.0, 2.0) in places(found)


@pytest.mark.slow
def test_what_is_flush_with_the_ground_is_no_obstacle(engine):
    # The undersides of doors and cabinets lie in the ground's plane; which of two equal hits is told is chance.
    room = scenes_synthetic.build("box").scene
    for first in (False, True):
        flush = with_rectangle(room, (0.5, 0.5, 0.0), (5.5, 3.5, 0.0), first=first)
        assert places(candidates_of(flush, SETTINGS, engine)) == places(candidates_of(room, SETTINGS, engine))


@pytest.mark.slow
def test_sensor_under_something_needs_headroom(engine):
    room = scenes_synthetic.build("box").scene
    for height_m, expected in ((1.6, 0), (1.75, 1)):
        shelf = with_rectangle(room, (0.01, 0.01, height_m), (5.99, 3.99, height_m), first=False)
        assert bool(candidates_of(shelf, SETTINGS, engine).floor.size) == bool(expected)


def test_heights_default_to_the_scanners_range_in_steps(engine):
    del engine
    heights = replace(SETTINGS, instrument_heights_m=(), height_step_m=0.4).heights.to_try_m
    np.testing.assert_allclose(heights, [0.5, 0.9, 1.3, 1.7])
    assert replace(SETTINGS, instrument_heights_m=(1.6, 1.2, 1.6)).heights.to_try_m == (1.2, 1.6)


@pytest.mark.slow
def test_grid_moves_and_turns_with_the_building(engine):
    room = scenes_synthetic.build("two-rooms").scene
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([12.0, -7.0, 0.0])
    moved = replace(room, vertices_m=room.vertices_m @ turn.T + shift)
    one, other = (candidates_of(scene, SETTINGS, engine).position_m for scene in (room, moved))
    key = lambda p: sorted(p.round(5).tolist())  # noqa: E731
    np.testing.assert_allclose(key(one @ turn.T + shift), key(other), atol=1e-5)


@pytest.mark.parametrize("kind", [Scope.ALL, Scope.INTERIOR])
def test_room_without_ceiling_has_positions_where_all_is_in_scope(engine, kind):
    # A room of 6 x 4 m with a ceiling, and one of 4 x 4 m without beside it, joined by a doorway.
    walls = [
        ("w", "Mesh", 0, (-0.2, -0.2, -0.2), (0, 4.2, 2.7)), ("e", "Mesh", 0, (10, -0.2, -0.2), (10.2, 4.2, 2.7)),
        ("s", "Mesh", 0, (0, -0.2, -0.2), (10, 0, 2.7)), ("n", "Mesh", 0, (0, 4, -0.2), (10, 4.2, 2.7)),
        ("m", "Mesh", 0, (6, 0, -0.2), (6.1, 2.8, 2.7)),
    ]  # fmt: skip
    floor, ceiling = ("floor", "Mesh", 0, (0, 0, -0.2), (10, 4, 0)), ("top", "Mesh", 0, (0, 0, 2.5), (6, 4, 2.7))
    survey = make_survey(scene_of([*walls, floor, ceiling]), SETTINGS)
    scope = SurveyScope(kind, *[np.ones(survey.patches.n_patches, bool)] * 2, np.empty((0, 3)), np.empty(0, bool))
    scan_engine = open_engine(survey.scene, survey.patches, engine=engine)
    found = find_candidates(replace(survey, scope=scope), SETTINGS, scan_engine, floors=(0,))
    assert {"covered": any(x < 6 for x, _ in places(found)), "open": any(x > 6.1 for x, _ in places(found))} == {
        "covered": True,
        "open": kind == Scope.ALL,
    }
