"""Drawings raised to a building and written as IFC4, read back by IfcOpenShell and by the loader."""

from types import SimpleNamespace

import ifcopenshell
import numpy as np
import pytest
from ifcopenshell.util.element import get_pset

from planner_core.drawings import lift
from planner_core.drawings.building import Doubtful, Heights, levels_of
from planner_core.drawings.ifc_file import write_building
from planner_core.drawings.layer_names import Kind
from planner_core.drawings.lift import DrawingOptions, lift_drawings
from planner_core.errors import SceneError
from planner_core.model import Doors
from planner_core.scene.floors import find_floors
from planner_core.scene.load import LoadOptions, load_scene
from tests.drawings.drawn_buildings import draw_two_rooms


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    path = tmp_path_factory.mktemp("drawn") / "house.dxf"
    draw_two_rooms(path)
    return path


def lifted_file(paths, to, **options):
    write_building(lift_drawings(paths, DrawingOptions(**options)), to)
    return to


@pytest.fixture(scope="module")
def model(drawn):
    return ifcopenshell.open(lifted_file([drawn], drawn.with_suffix(".ifc")))


@pytest.mark.slow
def test_same_drawing_same_bytes(drawn, model, tmp_path):
    assert lifted_file([drawn], tmp_path / "again.ifc").read_bytes() == drawn.with_suffix(".ifc").read_bytes()


def test_doors_and_windows_fill_openings_of_walls(model):
    fillings = {
        relation.RelatedBuildingElement.is_a(): relation.RelatingOpeningElement.VoidsElements[0].RelatingBuildingElement
        for relation in model.by_type("IfcRelFillsElement")
    }
    assert {kind: wall.is_a() for kind, wall in fillings.items()} == {"IfcDoor": "IfcWall", "IfcWindow": "IfcWall"}
    doors = model.by_type("IfcDoor")
    assert [get_pset(door, "Pset_DoorCommon", "IsExternal") for door in doors] == [True, False]
    assert [door.OverallHeight for door in doors] == [2.1, 2.1]
    assert len({entity.GlobalId for entity in model.by_type("IfcRoot")}) == len(model.by_type("IfcRoot"))


@pytest.mark.slow
def test_scene_of_the_file_is_a_building_with_rooms_doors_and_glass(drawn, model):
    scene = load_scene(drawn.with_suffix(".ifc"), options=LoadOptions(doors=Doors.OPEN))
    assert [(room.name, room.long_name) for room in scene.rooms] == [("101", "Office"), ("102", "Kitchen")]
    assert [storey.elevation_m for storey in scene.storeys] == [0.0]
    assert scene.report.n_doors_open == 1  # the inner one; the entrance stays shut
    assert scene.report.glass_area_m2 == pytest.approx(2 * 1.5 * 1.2, rel=0.1)
    assert scene.report.warnings == ()
    (floor,) = find_floors(scene).floors
    assert floor.elevation_m == pytest.approx(0.0)
    assert scene.vertices_m.min(axis=0) == pytest.approx([0, 0, -0.2])
    assert scene.vertices_m.max(axis=0) == pytest.approx([6.5, 4.4, 3.0])


@pytest.mark.slow
def test_heights_of_rooms_doors_and_sills_are_those_given(drawn, tmp_path):
    heights = Heights(room_m=3.4, door_m=2.0, sill_m=0.5, window_head_m=2.4)
    scene = load_scene(lifted_file([drawn], tmp_path / "a.ifc", heights=heights))
    spans = {}
    for number, element in enumerate(scene.elements):
        z = scene.vertices_m[scene.triangles[scene.element_of_triangle == number]][..., 2]
        spans.setdefault(element.kind, (z.min(), z.max()))
    assert spans["IfcDoor"] == pytest.approx((0.0, 2.0))
    assert spans["IfcWindow"] == pytest.approx((0.5, 2.4))
    assert spans["IfcWall"] == pytest.approx((0.0, 3.4))


@pytest.mark.slow
def test_drawings_are_storeys_from_below(drawn, tmp_path):
    building = lift_drawings([drawn, drawn], DrawingOptions(heights=Heights(storey_m=3.3)))
    assert [storey.elevation_m for storey in building.storeys] == [0.0, 3.3]
    write_building(building, tmp_path / "a.ifc")
    scene = load_scene(tmp_path / "a.ifc")
    assert [floor.elevation_m for floor in find_floors(scene).floors] == pytest.approx([0.0, 3.3])
    assert len({element.source_id for element in scene.elements}) == len(scene.elements)


def test_more_lines_than_can_be_recognised_are_refused_unless_their_layer_is_left_out(tmp_path, monkeypatch):
    draw_two_rooms(tmp_path / "a.dxf")
    monkeypatch.setattr(lift, "MOST_POINTS", 20)
    with pytest.raises(SceneError, match=r"most of them on A-DOOR, A-WALL, A-GLAZ, expected at most 20"):
        lift_drawings([tmp_path / "a.dxf"])
    ignored = DrawingOptions(patterns={"A-WALL": Kind.IGNORED, "A-*": Kind.IGNORED})
    with pytest.raises(SceneError, match="has a name for walls"):
        lift_drawings([tmp_path / "a.dxf"], ignored)


def test_rooms_end_at_their_ceilings_where_these_are_given_and_at_the_next_slab_else():
    plans = [SimpleNamespace(height_m=0.0), SimpleNamespace(height_m=3.1)]
    assert levels_of(plans, Heights())[1] == pytest.approx([2.9, 5.9])
    assert levels_of(plans, Heights(room_m=2.6))[1] == pytest.approx([2.6, 5.7])
    with pytest.raises(SceneError, match=r"got 3.2 m with floors 3.1 m above each other, expected at most 3.05 m"):
        levels_of(plans, Heights(room_m=3.2))


def test_doubtful_gaps_bound_the_building_from_both_sides(tmp_path):
    draw_two_rooms(tmp_path / "a.dxf", symbols=False)
    closed = lifted_file([tmp_path / "a.dxf"], tmp_path / "closed.ifc", doubtful=Doubtful.AS_WALL)
    opened = lifted_file([tmp_path / "a.dxf"], tmp_path / "opened.ifc")
    with_walls, without = ifcopenshell.open(closed), ifcopenshell.open(opened)
    walls = with_walls.by_type("IfcWall")
    doubtful = [wall.Name for wall in walls if get_pset(wall, "TLSPLAN_Drawing", "Doubtful")]
    assert doubtful == ["Gap 1 (doubtful)", "Gap 2 (doubtful)", "Gap 3 (doubtful)"]
    assert len(without.by_type("IfcWall")) == len(walls) - 3
    assert [gap.Name for gap in without.by_type("IfcVirtualElement")] == doubtful
    scene = load_scene(opened)
    assert not any("doubtful" in element.name for element in scene.elements)
    assert scene.report.warnings == ()


@pytest.mark.slow
def test_stairs_of_two_storeys_join_them(tmp_path):
    """Five treads below, thirteen above: a flight of even steps through a void of the slab."""
    for name, n in (("lower", 5), ("upper", 13)):
        document = draw_two_rooms(tmp_path / f"{name}.dxf")
        for tread in range(n):
            y = 500 + 270 * tread
            document.modelspace().add_line((300, y), (1200, y), dxfattribs={"layer": "A-FLOR-STRS"})
        document.saveas(tmp_path / f"{name}.dxf")
    building = lift_drawings([tmp_path / "lower.dxf", tmp_path / "upper.dxf"])
    (flight,) = [e for e in building.storeys[0].elements if e.kind == "IfcStairFlight"]
    tops = np.array([prism.high_m for prism in flight.prisms])
    assert np.diff(tops) == pytest.approx(np.full(len(tops) - 1, 3.0 / 17))
    assert tops[-1] + 3.0 / 17 == pytest.approx(3.0)
    assert flight.prisms[0].area.bounds[1] == pytest.approx(0.5)
    slab = next(e for e in building.storeys[0].elements if e.name == "Ceiling")
    assert sum(prism.area.area for prism in slab.prisms) == pytest.approx(6.5 * 4.4 - 0.9 * 12 * 0.27, abs=0.01)
    alone = lift_drawings([tmp_path / "lower.dxf"])
    assert "1 flight of stairs: a single storey does not show which way" in alone.warnings[0]


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        ({"room_m": 2.0}, "room height: got 2 m, expected at least the head of doors and windows at 2.1 m"),
        ({"sill_m": 2.2}, "sill height: got 2.2 m"),
        ({"storey_m": 2.5}, "storey height: got 2.5 m, expected at least the room height, 2.8 m"),
        ({"door_m": float("nan")}, "door height: got nan m"),
    ],
)
def test_heights_that_fit_no_room_are_refused(heights, words):
    with pytest.raises(SceneError, match=words):
        Heights(**heights)


@pytest.mark.slow
def test_drawing_that_takes_too_much_memory_in_child_is_one_line(drawn, monkeypatch):
    assert len(lift_drawings([drawn]).storeys[0].rooms) == 2
    monkeypatch.setenv("TLSPLAN_READ_MEMORY_GB", "0.01")
    with pytest.raises(SceneError, match=r"house\.dxf: ezdxf took more than 0\.0 GB of memory"):
        lift_drawings([drawn])


def test_office_file_names_layers_after_the_user_and_has_to_fit_some(tmp_path):
    draw_two_rooms(tmp_path / "house.dxf", layers={"wall": "L1", "door": "L2", "window": "L3", "text": "L4"})
    office = {"L[12]": Kind.WALL, "L3": Kind.WINDOW, "L4": Kind.TEXT, "L9": Kind.IGNORED}
    options = DrawingOptions(patterns={"L2": Kind.DOOR}, office_patterns=office)
    (storey,) = lift_drawings([tmp_path / "house.dxf"], options).storeys
    assert [room.long_name for room in storey.rooms] == ["Office", "Kitchen"]
    assert sorted(each.kind for each in storey.elements if each.kind in ("IfcDoor", "IfcWindow")) == [
        "IfcDoor", "IfcDoor", "IfcWindow",
    ]  # fmt: skip
    with pytest.raises(
        SceneError, match=r"^--layers: no layer or block has a name of its 1 patterns, expected some of "
    ):
        lift_drawings([tmp_path / "house.dxf"], DrawingOptions(office_patterns={"X*": Kind.WALL}))
