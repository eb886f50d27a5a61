"""Storeys without coordinates, moved over each other."""

import numpy as np
import pytest
import shapely

from planner_core.drawings.alignment import moved, over
from planner_core.drawings.dxf import read_dxf
from planner_core.drawings.floor_plan import floor_plans
from planner_core.drawings.lift import DrawingOptions, lift_drawings
from tests.drawings.drawn_buildings import ROOM_WALLS, draw_two_rooms


@pytest.fixture(scope="module")
def lower(tmp_path_factory):
    path = tmp_path_factory.mktemp("storeys") / "lower.dxf"
    draw_two_rooms(path)
    return path


def test_storey_is_moved_over_the_walls_below(lower):
    (plan,) = floor_plans(read_dxf(str(lower)))
    there = moved(plan, np.array([12.34, -5.67]))
    assert shapely.union_all([wall.area for wall in there.walls]).bounds[:2] == pytest.approx((12.34, -5.67))
    back, line = over(plan, there, "upper.pdf")
    walls = shapely.union_all([wall.area for wall in back.walls])
    assert shapely.symmetric_difference(walls, ROOM_WALLS).area < 0.2
    assert "is moved by x -12.34, y 5.6" in line
    assert back.rooms[0].outline.bounds == pytest.approx(plan.rooms[0].outline.bounds, abs=0.02)
    assert back.openings[0].corners_m == pytest.approx(plan.openings[0].corners_m, abs=0.02)


def test_point_that_both_show_decides(lower):
    points = ((0.0, 0.0), (6500.0, 4400.0))
    building = lift_drawings([lower, lower], DrawingOptions(common_points=points))
    bounds = [
        shapely.union_all([p.area for e in storey.elements if e.kind == "IfcWall" for p in e.prisms]).bounds
        for storey in building.storeys
    ]
    assert bounds[0] == pytest.approx((0.0, 0.0, 6.5, 4.4))
    assert bounds[1] == pytest.approx((-6.5, -4.4, 0.0, 0.0))


def test_storeys_side_by_side_in_one_drawing_are_named(tmp_path):
    document = draw_two_rooms(tmp_path / "a.dxf")
    for entity in list(document.modelspace()):
        copy = entity.copy()
        document.modelspace().add_entity(copy)
        copy.translate(9000, 0, 0)
    document.saveas(tmp_path / "a.dxf")
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert "its walls are 2 groups more than 2 m apart" in plan.warnings[0]
    boxes = ((-1e3, -1e3, 8e3, 8e3), (8e3, -1e3, 18e3, 8e3))
    two = lift_drawings([tmp_path / "a.dxf"], DrawingOptions(parts=(boxes,)))
    assert [len(storey.rooms) for storey in two.storeys] == [2, 2]
    (line,) = two.warnings
    assert "moved by x -9.00, y 0.00 m over the storey below, with 100 %" in line
