"""Recognition of two rooms, and of real buildings drawn from their IFC."""

from pathlib import Path

import ezdxf
import pytest
import shapely

from planner_core.drawings.dxf import read_dxf
from planner_core.drawings.floor_plan import floor_plans
from planner_core.drawings.layer_names import Kind
from planner_core.drawings.room_outlines import PlacedText, rooms_of
from planner_core.errors import SceneError
from planner_core.export.dxf import write_dxf
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import open_plan
from planner_core.progress import silent
from tests.drawings.drawn_buildings import ROOM_WALLS, cut_area, draw, draw_two_rooms

ROOMS = [("101", "Office"), ("102", "Kitchen")]
SECRET = {"wall": "P1", "door": "P2", "window": "P3", "text": "P4"}


def walls_of(plan):
    return shapely.union_all([piece.area for piece in plan.walls])


def far_apart(a, b, by_m=0.02):
    """Length of the outlines of two areas that lie farther from the other's."""
    lines = (a.boundary, b.boundary)
    return sum(shapely.difference(one, shapely.buffer(other, by_m)).length for one, other in (lines, lines[::-1]))


def kinds(plan):
    return sorted((str(o.kind), round(o.width_m, 2)) for o in plan.openings)


@pytest.mark.parametrize(("unit_m", "insunits"), [(0.001, 4), (1.0, 6), (0.0254, 1)])
def test_two_rooms_are_recognised_in_any_unit(tmp_path, unit_m, insunits):
    draw_two_rooms(tmp_path / "a.dxf", unit_m=unit_m, insunits=insunits)
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert far_apart(walls_of(plan), ROOM_WALLS) < 0.01
    assert kinds(plan) == [("door", 0.9), ("door", 1.0), ("window", 1.5)]
    assert [(room.name, room.long_name) for room in plan.rooms] == ROOMS
    assert [room.outline.area for room in plan.rooms] == pytest.approx([12.0, 12.0], abs=0.01)
    assert plan.outline.area == pytest.approx(6.5 * 4.4, abs=0.01)
    assert plan.warnings == ()


def test_layers_of_any_name_are_read_by_patterns_and_swings(tmp_path):
    path = tmp_path / "a.dxf"
    draw_two_rooms(path, layers=SECRET, window_gap=False)
    (plan,) = floor_plans(read_dxf(str(path)))
    assert kinds(plan) == [("door", 0.9), ("door", 1.0)]
    assert "walls, so they are what looks like walls on layer P1 and no other layer" in plan.warnings[0]
    (plan,) = floor_plans(read_dxf(str(path)), patterns={"P1": Kind.WALL, "P3": Kind.WINDOW})
    assert kinds(plan) == [("door", 0.9), ("door", 1.0), ("window", 1.5)]


def test_furniture_alone_is_no_floor_plan_unless_its_layer_is_named(tmp_path):
    document = ezdxf.new("R2010", units=6)
    for number in range(5):
        desk = [(2.0 * number + x, y) for x, y in ((0.0, 0.0), (1.4, 0.0), (1.4, 0.4), (0.0, 0.4))]
        document.modelspace().add_lwpolyline(desk, close=True, dxfattribs={"layer": "P1"})
    document.saveas(tmp_path / "a.dxf")
    with pytest.raises(SceneError, match=r"on layer P1 encloses no room, expected a floor plan.*--layer wall=NAME"):
        floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")), patterns={"P1": Kind.WALL})
    assert plan.rooms == ()


def test_gaps_without_symbols_are_doubtful_and_named(tmp_path):
    draw_two_rooms(tmp_path / "a.dxf", symbols=False)
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert kinds(plan) == [("passage", 0.9), ("passage", 1.0), ("passage", 1.5)]
    (line,) = plan.warnings
    assert "3 gaps in the walls have no door or window drawn" in line
    assert "--doubtful as-wall" in line


def test_walls_at_two_heights_are_two_storeys(tmp_path):
    document = draw_two_rooms(tmp_path / "a.dxf")
    draw_two_rooms(tmp_path / "a.dxf", z_m=3.1, document=document)
    plans = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert [plan.height_m for plan in plans] == [0.0, 3.1]
    assert [kinds(plan) for plan in plans] == [[("door", 0.9), ("door", 1.0), ("window", 1.5)]] * 2
    assert [[room.name for room in plan.rooms] for plan in plans] == [["101", "102"]] * 2


def test_unit_that_doors_contradict_is_refused_unless_given(tmp_path):
    draw_two_rooms(tmp_path / "a.dxf", unit_m=1.0, insunits=4)
    drawing = read_dxf(str(tmp_path / "a.dxf"))
    with pytest.raises(SceneError, match=r"doors 0\.00095 m wide and walls .* thick.*--units m;"):
        floor_plans(drawing)
    (plan,) = floor_plans(drawing, unit_m=1.0)
    assert far_apart(walls_of(plan), ROOM_WALLS) < 0.01


def test_wall_layer_that_holds_a_point_alone_is_refused(tmp_path):
    drawing = draw_lines(tmp_path / "a.dxf", [([(1, 1), (1, 1)], False)])
    with pytest.raises(SceneError, match="its wall layers hold no walls"):
        floor_plans(drawing, unit_m=1.0)


def draw_lines(path, lines, *, layer="A-WALL", insunits=6, doors=()):
    document = ezdxf.new(units=insunits)
    for points, closed in lines:
        document.modelspace().add_lwpolyline(points, close=closed, dxfattribs={"layer": layer})
    for centre, begin, end in doors:
        document.modelspace().add_arc(centre, 0.5, begin, end, dxfattribs={"layer": "A-DOOR"})
    document.saveas(path)
    return read_dxf(str(path))


def ring(x0, y0, x1, y1, thick):
    return [([(x0 - t, y0 - t), (x1 + t, y0 - t), (x1 + t, y1 + t), (x0 - t, y1 + t)], True) for t in (0.0, thick)]


def test_walls_of_one_line_get_a_thickness_and_a_warning(tmp_path):
    walls = [([(0, 0), (8, 0), (8, 5), (0, 5)], True), ([(4, 0), (4, 2)], False), ([(4, 3), (4, 5)], False)]
    doors = [((4, 2), 0, 90), ((4, 3), 270, 360)]  # a double door
    drawing = draw_lines(tmp_path / "a.dxf", walls, doors=doors)
    (plan,) = floor_plans(drawing)
    assert [room.outline.area for room in plan.rooms] == pytest.approx([3.9 * 4.9] * 2, abs=0.01)
    assert kinds(plan) == [("door", 0.9)]
    assert "100 % of the lines on its wall layers" in plan.warnings[0]
    assert "no line beside them and are walls 0.1 m thick" in plan.warnings[0]
    facade = draw_lines(tmp_path / "facade.dxf", walls)
    with pytest.raises(SceneError, match="its wall layers hold no walls"):
        floor_plans(facade, unit_m=1.0)
    with pytest.raises(SceneError, match=r"walls 5 m thick .* no other fits, so name the layer of its walls"):
        floor_plans(facade)


def test_walls_of_old_buildings_are_as_thick_as_they_are_drawn(tmp_path):
    (plan,) = floor_plans(draw_lines(tmp_path / "a.dxf", ring(0, 0, 20, 10, 0.9)), unit_m=1.0)
    assert plan.warnings == ()
    assert walls_of(plan).area == pytest.approx(21.8 * 11.8 - 200.0, abs=0.01)


def test_lines_that_bound_no_wall_are_a_warning_or_put_the_unit_in_doubt(tmp_path):
    # Of walls 0.13 m thick, in centimetres: read in inches, those of 0.25 m are no walls any more.
    walls = [*ring(0, 0, 1000, 600, 25), *ring(1100, 0, 1500, 600, 13), *ring(1600, 0, 2000, 600, 13)]
    drawing = draw_lines(tmp_path / "a.dxf", walls, insunits=1)
    with pytest.raises(
        SceneError, match=r"% of the lines on its wall layers.* fit cm as well as.*such as --units cm\."
    ):
        floor_plans(drawing)
    (plan,) = floor_plans(drawing, unit_m=0.0254)
    assert "bound no wall and are left out" in plan.warnings[0]
    assert floor_plans(drawing, unit_m=0.01)[0].warnings == ()


def test_lines_of_no_name_are_windows_outside_and_doors_between_rooms(tmp_path):
    outside = [(0, 0), (8, 0), (8, 5), (5, 5)], [(3, 5), (0, 5), (0, 0)]  # a gap of 2 m in the upper wall
    beyond = (
        [(0, -0.2), (8.2, -0.2), (8.2, 5.2), (5, 5.2), (5, 5)],
        [(3, 5), (3, 5.2), (-0.2, 5.2), (-0.2, -0.2), (0, -0.2)],
    )
    between = [(4, 0), (4, 1.5), (4.1, 1.5), (4.1, 0)], [(4, 5), (4, 2.5), (4.1, 2.5), (4.1, 5)]
    walls = [(points, False) for points in (*outside, *beyond, *between)]
    draw_lines(tmp_path / "a.dxf", walls)
    document = ezdxf.readfile(tmp_path / "a.dxf")
    for one, other in (
        ((3, 5.08), (5, 5.08)),
        ((3, 5.12), (5, 5.12)),
        ((4.03, 1.5), (4.03, 2.5)),
        ((4.07, 1.5), (4.07, 2.5)),
    ):
        document.modelspace().add_line(one, other, dxfattribs={"layer": "A-OPENING"})
    document.saveas(tmp_path / "a.dxf")
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert kinds(plan) == [("door", 1.0), ("window", 2.0)]
    assert len(plan.rooms) == 2
    assert plan.warnings == ()


def test_sizes_of_doors_are_no_numbers_of_rooms():
    walls = shapely.difference(shapely.box(-0.2, -0.2, 5.2, 4.2), shapely.box(0, 0, 5, 4))
    (room,) = rooms_of(walls, shapely.Polygon(), [PlacedText("2668", 1.0, 1.0), PlacedText("KITCHEN", 2.0, 2.0)])
    assert (room.name, room.long_name) == ("1", "KITCHEN")
    (room,) = rooms_of(walls, shapely.Polygon(), [PlacedText("214", 1.0, 1.0), PlacedText("KITCHEN", 2.0, 2.0)])
    assert (room.name, room.long_name) == ("214", "KITCHEN")


def test_drawing_without_walls_is_refused(tmp_path):
    document = ezdxf.new("R2010", units=6)
    document.modelspace().add_circle((0, 0), 3, dxfattribs={"layer": "WALL"})
    document.saveas(tmp_path / "a.dxf")
    with pytest.raises(SceneError, match="its wall layers hold no walls"):
        floor_plans(read_dxf(str(tmp_path / "a.dxf")), unit_m=1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "z_m", "doors", "windows", "rooms"),
    [("duplex", 1.2, 6, 4, 4), ("duplex", 4.3, 8, 10, 10), ("fzk-haus", 1.2, 5, 9, 4)],
)
def test_walls_of_a_real_building_come_back_within_two_centimetres(
    name, z_m, doors, windows, rooms, real_scene, tmp_path
):
    walls = draw(real_scene(name), z_m, tmp_path / "a.dxf")
    (plan,) = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    assert far_apart(walls_of(plan), walls) < 0.01
    assert [kind for kind, _ in kinds(plan)] == ["door"] * doors + ["window"] * windows
    assert len(plan.rooms) == rooms


@pytest.mark.slow
def test_own_drawing_of_a_plan_comes_back(house_plan, tmp_path: Path):
    """Our own export has hatches, storeys at their heights, and much that is no wall."""
    write_dxf(open_plan(house_plan.folder), tmp_path / "a.dxf", Options(), silent)
    plans = floor_plans(read_dxf(str(tmp_path / "a.dxf")))
    scene = house_plan.plan.survey.scene
    assert [plan.height_m for plan in plans] == [round(storey.elevation_m, 1) for storey in scene.storeys[: len(plans)]]
    for plan in plans:
        walls = cut_area(scene, ("IfcWall", "IfcColumn"), plan.height_m + 1.2)
        assert far_apart(walls_of(plan), walls) < 0.01
