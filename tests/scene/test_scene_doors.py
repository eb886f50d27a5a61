"""Doors taken open: leaves go, frames stay. Doors are built from known bodies; those of real files are shot through."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.engine.open_engine import open_engine
from planner_core.errors import SceneError
from planner_core.model import Doors, Element, Room, Scene
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.doors import exterior_doors, without_door_leaves
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.patches import make_patches
from scenes_synthetic import build
from scenes_synthetic.write import write

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
WALL: list[Box] = [((-3.0, -0.1, 0.0), (-0.5, 0.1, 2.5)), ((0.5, -0.1, 0.0), (3.0, 0.1, 2.5))]


def corners_of(boxes: list[Box]) -> np.ndarray:
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return np.concatenate([np.where(corner > 0, high, low)[triangles] for low, high in boxes])


def scene_of(parts: list[tuple[str, np.ndarray]], angle_rad: float = 0.0) -> Scene:
    """An element each of (kind, triangles), turned about z."""
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad), 0], [np.sin(angle_rad), np.cos(angle_rad), 0], [0, 0, 1]])
    corners = np.concatenate([corners for _, corners in parts]).reshape(-1, 3) @ turn.T
    return scene_from_arrays(
        corners,
        np.arange(len(corners)).reshape(-1, 3),
        element_of_triangle=np.repeat(np.arange(len(parts)), [len(corners) for _, corners in parts]),
        elements=[Element(f"{kind} {i}", kind, str(i)) for i, (kind, _) in enumerate(parts)],
    )


def shape_of(scene: Scene, element: int) -> list[bytes]:
    """Triangles of an element as sorted bytes."""
    corners = scene.vertices_m[scene.triangles[scene.element_of_triangle == element]]
    return sorted(np.sort(triangle.round(9) + 0.0, axis=0).tobytes() for triangle in corners)


def jambs(width: float, high: float, thick: float) -> list[Box]:
    """A frame of three bodies: two jambs, and the lintel on them."""
    half = width / 2
    return [
        ((-half, -0.06, 0.0), (-half + thick, 0.06, high - thick)),
        ((half - thick, -0.06, 0.0), (half, 0.06, high - thick)),
        ((-half, -0.05, high - thick), (half, 0.05, high)),
    ]


@settings(max_examples=25, deadline=None)
@given(
    width=st.floats(0.7, 2.0),
    high=st.floats(1.9, 2.6),
    thick=st.floats(0.03, 0.08),
    angle=st.floats(0, 3.1),
    side=st.sampled_from([-0.06, -0.02]),
)
def test_leaf_and_handle_go_frame_and_wall_stay(
    width: float, high: float, thick: float, angle: float, side: float
) -> None:
    """The leaf touches the frame all round, as in real files; in one face with it, they share vertices and edges."""
    half = width / 2
    frame = corners_of(jambs(width, high, thick))
    leaf = corners_of([((-half + thick, side, 0.0), (half - thick, side + 0.04, high - thick))])
    handle = corners_of([((half - thick - 0.12, side - 0.05, 1.0), (half - thick - 0.05, side, 1.03))])
    wall = corners_of([((-3.0, -0.1, 0.0), (-half, 0.1, high)), ((half, -0.1, 0.0), (3.0, 0.1, high))])
    shut = scene_of([("IfcDoor", np.concatenate([leaf, frame, handle])), ("IfcWall", wall)], angle)
    bare = scene_of([("IfcDoor", frame), ("IfcWall", wall)], angle)
    opened = without_door_leaves(shut)
    assert opened.report.n_doors_open == 1
    assert opened.elements == shut.elements
    assert shape_of(opened, 0) == shape_of(bare, 0)
    assert shape_of(opened, 1) == shape_of(shut, 1)
    assert opened.vertices_m.shape[0] == np.unique(opened.triangles).size


def test_a_door_of_a_leaf_alone_goes_and_its_element_keeps_its_number() -> None:
    leaf = corners_of([((-0.45, -0.02, 0.0), (0.45, 0.02, 2.0))])
    opened = without_door_leaves(scene_of([("IfcDoor", leaf), ("IfcWall", corners_of(WALL))]))
    assert set(opened.element_of_triangle.tolist()) == {1}
    assert [element.kind for element in opened.elements] == ["IfcDoor", "IfcWall"]


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_leaves_and_boards_that_another_file_holds_go_with_their_door(angle: float) -> None:
    frame, leaf = corners_of(jambs(1.0, 2.1, 0.05)), corners_of([((-0.45, -0.02, 0.0), (0.45, 0.02, 2.05))])
    parts = [
        ("IfcDoor", np.concatenate([frame, leaf])),
        ("IfcPlate", corners_of([((-0.46, -0.07, 0.01), (0.46, -0.02, 2.06))])),
        ("IfcBeam", corners_of([((-0.5, -0.06, 0.0), (-0.45, 0.06, 2.1))])),
        ("IfcMember", corners_of([((-0.45, -0.03, 0.0), (0.45, -0.02, 1.0))])),  # a board: half the door
        ("IfcPlate", corners_of([((-0.45, -0.02, 0.0), (0.45, 0.4, 2.05))])),  # far thicker than the door
        ("IfcWall", corners_of(WALL)),
    ]
    for doors, gone in ((Doors.OPEN, {1, 3}), (Doors.SHUT, set())):
        opened = without_door_leaves(scene_of(parts, angle), doors)
        assert set(range(len(parts))) - set(opened.element_of_triangle.tolist()) == gone
        assert opened.report.n_doors_open == (doors == Doors.OPEN)


def test_only_doors_are_opened_and_a_scene_of_leaves_alone_is_left() -> None:
    leaf = corners_of([((-0.45, -0.02, 0.0), (0.45, 0.02, 2.0))])
    named = scene_of([("Mesh", leaf), ("IfcWindow", leaf + np.array([0.0, 1.0, 0.0])), ("IfcWall", corners_of(WALL))])
    assert without_door_leaves(named) is named
    alone = scene_of([("IfcDoor", leaf)])
    assert without_door_leaves(alone) is alone


def test_what_beams_do_at_the_rest_is_kept() -> None:
    leaf = corners_of([((-0.45, -0.02, 0.0), (0.45, 0.02, 2.0))])
    wall = corners_of(WALL)
    corners = np.concatenate([leaf, wall]).reshape(-1, 3)
    scene = scene_from_arrays(
        corners,
        np.arange(len(corners)).reshape(-1, 3),
        element_of_triangle=np.repeat([0, 1], [len(leaf), len(wall)]),
        elements=[Element("door", "IfcDoor", "0"), Element("pane", "IfcWall", "1")],
        optics_of_triangle=np.repeat([0, 1], [len(leaf), len(wall)]),
    )
    opened = without_door_leaves(scene)
    assert opened.optics_of_triangle is not None
    assert opened.optics_of_triangle.tolist() == [1] * len(wall)


def test_a_word_that_is_neither_open_nor_shut_is_refused() -> None:
    with pytest.raises(SceneError, match="doors: got 'ajar', expected one of shut, open"):
        LoadOptions(doors="ajar")


@pytest.mark.slow
def test_doors_of_a_file_are_shut_unless_open_is_asked_for(tmp_path: Path) -> None:
    synthetic = build("doors-shut")
    path = write(synthetic, tmp_path / "doors.ifc")
    shut = load_scene(path)
    opened = load_scene(path, options=LoadOptions(doors="open"))
    n_doors = sum(element.kind == "IfcDoor" for element in shut.elements)
    assert (shut.source.doors, shut.report.n_doors_open) == ("shut", 0)
    assert (opened.source.doors, opened.report.n_doors_open) == ("open", n_doors)
    assert n_doors == 3
    assert opened.n_triangles == shut.n_triangles - 12 * n_doors


@pytest.mark.slow
def test_single_doors_are_open_or_shut_whatever_is_said_of_all(tmp_path: Path) -> None:
    path = write(build("doors-shut"), tmp_path / "doors.ifc")
    shut = load_scene(path)
    doors = {e.source_id: number for number, e in enumerate(shut.elements) if e.kind == "IfcDoor"}
    first, second, third = doors

    def n_triangles(scene: Scene) -> dict[str, int]:
        return {name: int((scene.element_of_triangle == number).sum()) for name, number in doors.items()}

    whole = n_triangles(shut)
    bare = n_triangles(load_scene(path, options=LoadOptions(doors="all")))
    assert all(bare[name] < whole[name] for name in doors)
    for said in Doors:
        options = LoadOptions(doors=said, doors_open=(first,), doors_shut=(second,))
        scene = load_scene(path, options=options)
        assert n_triangles(scene) == {
            first: bare[first], second: whole[second], third: (whole if said == Doors.SHUT else bare)[third],
        }  # fmt: skip
        assert (scene.source.doors_open, scene.source.doors_shut) == ((first,), (second,))
        assert scene.report.n_doors_open == (1 if said == Doors.SHUT else 2)


def test_doors_that_are_none_are_refused_in_words(tmp_path: Path) -> None:
    path = write(build("doors-shut"), tmp_path / "doors.ifc")
    wall = next(e.source_id for e in load_scene(path).elements if e.kind == "IfcWall")
    for name in (wall, "nothing"):
        for options in (LoadOptions(doors_open=(name,)), LoadOptions(doors="open", doors_shut=(name,))):
            with pytest.raises(
                SceneError, match=rf"door: got '{re.escape(name)}', expected the GlobalId of one of the 3"
            ):
                load_scene(path, options=options)
    with pytest.raises(SceneError, match="door a: got it as open and as shut"):
        LoadOptions(doors_open=("a", "b"), doors_shut=("a",))
    with pytest.raises(SceneError, match="got files with different glass, doors"):
        load_scene([path, path], options=[LoadOptions(), LoadOptions(doors_open=(wall,))])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "n_doors"), [("duplex", 14), ("fzk-haus", 5)])
def test_beams_pass_every_door_of_a_real_file_that_is_open_and_none_that_is_shut(
    name: str, n_doors: int, real_scene: Callable[[str], Scene]
) -> None:
    shut = real_scene(name)
    opened = without_door_leaves(shut, Doors.ALL)
    engines = [open_engine(scene, make_patches(scene, max_area_m2=10.0), engine="open3d") for scene in (shut, opened)]
    assert opened.report.n_doors_open == n_doors
    is_door = np.array([element.kind == "IfcDoor" for element in shut.elements])[shut.element_of_triangle]
    assert is_door.any()
    stays = np.array([element.kind == "IfcDoor" for element in opened.elements])[opened.element_of_triangle]
    assert 0 < stays.sum() < is_door.sum()
    # From 0.5 m before the middle of each door to 0.5 m behind, a metre above its foot and off its cross bars.
    for door in np.unique(shut.element_of_triangle[is_door]):
        corners = shut.vertices_m[shut.triangles[shut.element_of_triangle == door]].reshape(-1, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        thin = int(np.argmin((high - low)[:2]))
        origin = 0.5 * (low + high)
        origin[1 - thin] += 0.11 * (high - low)[1 - thin]
        origin[2], origin[thin] = low[2] + 1.03, low[thin] - 0.5
        way = np.zeros(3)
        way[thin] = 1.0
        length_m = float((high - low)[thin]) + 1.0
        for scene, engine, stops in ((shut, engines[0], True), (opened, engines[1], False)):
            hit = engine.cast_rays(origin[None], way[None], range_max_m=length_m).triangle[0]
            on_door = hit >= 0 and scene.elements[scene.element_of_triangle[hit]].kind == "IfcDoor"
            assert on_door == stops, scene.elements[door].name


@pytest.mark.slow
@pytest.mark.parametrize(("name", "n_inner", "n_doors"), [("duplex", 10, 14), ("fzk-haus", 3, 5)])
def test_outer_doors_stay_shut_unless_all_are_to_be_open(
    name: str, n_inner: int, n_doors: int, real_scene: Callable[[str], Scene]
) -> None:
    """The duplex says which doors lead outdoors; in the other file, only its rooms tell."""
    shut = real_scene(name)
    assert without_door_leaves(shut).report.n_doors_open == n_inner
    assert without_door_leaves(shut, Doors.ALL).report.n_doors_open == n_doors


@pytest.mark.slow
def test_the_outer_doors_of_a_file_are_open_where_all_are_asked_for(tmp_path: Path) -> None:
    path = write(build("house"), tmp_path / "house.ifc")
    n_open = {doors: load_scene(path, options=LoadOptions(doors=doors)).report.n_doors_open for doors in Doors}
    assert n_open == {"shut": 0, "open": 7, "all": 8, "outside": 8}


@pytest.mark.parametrize("said", [None, True, False])
@pytest.mark.parametrize("rooms", ["neither side", "one side", "both sides"])
def test_a_door_leads_outdoors_where_the_file_says_so_or_a_room_lies_on_one_side_alone(
    said: bool | None, rooms: str
) -> None:
    """A wall along x with a door in it; rooms are boxes to either side."""
    leaf = corners_of([((-0.45, -0.02, 0.0), (0.45, 0.02, 2.0))])
    scene = scene_of([("IfcDoor", leaf), ("IfcWall", corners_of(WALL))], 0.4)
    turn = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    sides = {"neither side": (), "one side": (1.0,), "both sides": (1.0, -1.0)}[rooms]
    boxes = [
        ((-3.0, 0.1, 0.0), (3.0, 4.0, 2.5)) if side > 0 else ((-3.0, -4.0, 0.0), (3.0, -0.1, 2.5)) for side in sides
    ]
    made = tuple(
        Room(
            f"R{n}",
            "",
            str(n),
            -1,
            corners_of([box]).reshape(-1, 3) @ turn.T - scene.offset_m,
            np.arange(36).reshape(-1, 3),
        )
        for n, box in enumerate(boxes)
    )
    door = replace(scene.elements[0], is_external=said)
    scene = replace(scene, elements=(door, *scene.elements[1:]), rooms=made)
    expected = said if said is not None else rooms == "one side"
    assert [door.element for door in exterior_doors(scene)] == ([0] if expected else [])
    assert without_door_leaves(scene).report.n_doors_open == (0 if expected else 1)
    assert without_door_leaves(scene, Doors.ALL).report.n_doors_open == 1


@pytest.mark.parametrize(
    ("roof_x1", "gap_m", "is_shut", "leads_out"),
    [
        pytest.param(3.0, 0.0, True, False, id="stairwell"),
        pytest.param(3.0, 0.0, False, False, id="stairwell, doors open"),
        pytest.param(3.0, 0.8, True, True, id="porch"),
        pytest.param(-1.0, 0.0, True, True, id="yard with an eave"),
    ],
)
def test_a_door_to_a_roofed_space_between_walls_leads_indoors_where_that_is_no_room(
    roof_x1: float, gap_m: float, is_shut: bool, leads_out: bool
) -> None:
    """A room to the north of a door, walls to the south of it with a door of their own."""
    leaf = corners_of([*jambs(1.0, 2.1, 0.05), ((-0.45, -0.02, 0.0), (0.45, 0.02, 2.05))])
    south = [
        ((-3.2, -4.0, 0.0), (-3.0, 0.1, 2.5)), ((3.0, -4.0, 0.0), (3.2, 0.1, 2.5)),
        ((-3.0, -4.2, 0.0), (-0.5 - gap_m, -4.0, 2.5)), ((0.5, -4.2, 0.0), (3.0, -4.0, 2.5)),
    ]  # fmt: skip
    roof = corners_of([((-3.2, -4.2, 2.5), (roof_x1, 0.1, 2.7))])
    entrance = leaf + np.array([0.0, -4.1, 0.0])
    parts = [("IfcDoor", leaf), ("IfcDoor", entrance), ("IfcWall", corners_of([*WALL, *south])), ("IfcSlab", roof)]
    scene = scene_of(parts, 0.4)
    turn = np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
    corner_m = corners_of([((-3.0, 0.1, 0.0), (3.0, 4.0, 2.5))]).reshape(-1, 3) @ turn.T - scene.offset_m
    scene = replace(scene, rooms=(Room("R", "", "1", -1, corner_m, np.arange(36).reshape(-1, 3)),))
    if not is_shut:
        scene = without_door_leaves(scene, Doors.ALL)
    assert [door.element for door in exterior_doors(scene)] == ([0] if leads_out else [])


def test_rooms_without_doors_have_none_that_lead_outdoors() -> None:
    corner_m = corners_of([((-3.0, 0.1, 0.0), (3.0, 4.0, 2.5))]).reshape(-1, 3)
    scene = scene_of([("IfcWall", corners_of(WALL))])
    scene = replace(scene, rooms=(Room("R", "", "1", -1, corner_m, np.arange(36).reshape(-1, 3)),))
    assert exterior_doors(scene) == []
    assert without_door_leaves(scene) is scene
