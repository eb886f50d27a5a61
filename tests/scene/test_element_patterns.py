"""Patterns of names, and that no pattern takes for ever.

Elements left out by class or name, and IFC's classes above a class.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import SceneError
from planner_core.model import Element
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.element_patterns import elements_named, fits, without_elements
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.raw import placed
from tests.coverage.conftest import BOX_FACES, box_corners
from tests.reality_files import reality

ELEMENTS = (
    Element("Basic Wall", "IfcWallStandardCase", "1", parents=("IfcWall", "IfcElement")),
    Element("Oak chair", "IfcFurniture", "2", parents=("IfcFurnishingElement", "IfcElement")),
    Element("IfcWall mark", "IfcBuildingElementProxy", "3", parents=("IfcElement",)),
)


@pytest.mark.parametrize(
    ("pattern", "name", "does"),
    [
        ("IfcWall*", "IfcWallStandardCase", True),
        ("IfcWall", "IfcWallStandardCase", False),
        ("ifcwall", "IfcWall", False),
        ("a*a", "a", False),
        ("*ab*b", "ab", False),
        ("a**a", "aa", True),
        ("*?", "", False),
        ("", "", True),
        ("a?c", "a\nc", True),
        ("[ab]", "a", False),
        ("[ab]*", "[ab] 1", True),
        ("a.c", "abc", False),
    ],
)
def test_stars_and_question_marks_stand_for_letters_and_nothing_else_does(pattern: str, name: str, does: bool) -> None:
    assert fits(pattern, name) == does


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.lists(st.text("ab", max_size=4), min_size=1, max_size=6), st.data())
def test_a_name_fits_itself_with_parts_of_it_left_open(parts: list[str], data: st.DataObject) -> None:
    name = "".join(parts)
    signs = [data.draw(st.sampled_from([part, "*", "?" * len(part)])) for part in parts]
    assert fits("".join(signs), name)


@pytest.mark.parametrize("pattern", ["*" * 60 + "x", "*a" * 50 + "x", "*a?" * 40 + "*x*", "a*" * 60 + "?x"])
def test_patterns_of_many_stars_come_to_an_end(pattern: str) -> None:
    assert not fits(pattern, "a" * 150)


@pytest.fixture
def scene():
    corners = np.concatenate([box_corners((4.0 * k, 0, 0), (4.0 * k + 1, 2, 3)) for k in range(3)])
    faces = np.concatenate([BOX_FACES + 8 * k for k in range(3)])
    return scene_from_arrays(corners, faces, element_of_triangle=np.repeat(np.arange(3), 12), elements=ELEMENTS)


@pytest.mark.parametrize(
    ("pattern", "meant"),
    [
        ("IfcWall", [True, False, False]),
        ("ifcwall*", [True, False, True]),  # a name may fit, too
        ("IfcFurnishingElement", [False, True, False]),
        ("IfcFurnishing*", [False, False, False]),  # patterns are of the class itself
        ("IfcElement", [True, True, True]),
        ("name=*mark", [False, False, True]),
        ("name=IfcFurniture", [False, False, False]),
        ("*chair*", [False, True, False]),
    ],
)
def test_elements_are_meant_by_class_by_the_classes_above_and_by_name(pattern: str, meant: list[bool]) -> None:
    assert elements_named(ELEMENTS, pattern).tolist() == meant


def test_what_is_left_out_is_gone_and_its_area_told(scene) -> None:
    left = without_elements(scene, ("IfcFurnishingElement", "name=*chair", "name=*mark"))
    assert np.unique(left.element_of_triangle).tolist() == [0]
    assert left.elements == scene.elements
    box_m2 = 2 * (1 * 2 + 2 * 3 + 1 * 3)
    assert left.report.left_out_m2 == pytest.approx((box_m2, 0.0, box_m2))  # nothing counts twice
    expected = placed(box_corners((0, 0, 0), (1, 2, 3)), np.eye(4))
    assert {tuple(row) for row in left.vertices_m} == {tuple(row) for row in expected}


def test_what_is_not_there_and_leaving_all_out_are_refused_in_one_line(scene) -> None:
    with pytest.raises(SceneError, match=r"leave out: got 'IfcFurnitur', of which .* expected IfcFurniture;"):
        without_elements(scene, ("IfcFurnitur",))
    with pytest.raises(SceneError, match="which is all there is"):
        without_elements(scene, ("IfcElement",))


def test_a_file_is_loaded_without_them(tmp_path: Path) -> None:
    path = tmp_path / "two.obj"
    path.write_text(
        "o floor\nv 0 0 0\nv 4 0 0\nv 4 4 0\nf 1 2 3\no tree\nv 9 9 0\nv 9 9 2\nv 9 8 0\nf 4 5 6\n", encoding="utf-8"
    )
    scene = load_scene(path, options=LoadOptions(leave_out=("name=tree",)))
    assert scene.n_triangles == 1
    assert scene.source.leave_out == ("name=tree",)
    assert scene.report.left_out_m2 == (1.0,)


def test_ifc_tells_the_classes_above(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    import scenes_synthetic

    path = scenes_synthetic.write(scenes_synthetic.build("l-room"), tmp_path / "room.ifc")
    scene = load_scene(path)
    walls = [element for element in scene.elements if element.kind.startswith("IfcWall")]
    assert walls
    for element in scene.elements:
        assert "IfcProduct" in element.parents
    whole = load_scene(path, options=LoadOptions(leave_out=(walls[0].kind,)))
    assert whole.n_triangles < scene.n_triangles
    assert replace(whole.elements[0]) == scene.elements[0]


@pytest.mark.parametrize("name", ["IfcSpace gym", "ifcspace_4711", "IfcSpace/Hall", "4IfcSpace.001"])
@pytest.mark.parametrize("ending", ["obj", "glb", "usda"])
def test_volumes_of_rooms_are_left_out_with_a_warning(tmp_path, name, ending):
    hall, room = box_corners((0, 0, 0), (9, 8, 4)), box_corners((0.5, 0.5, 0), (8.5, 7.5, 3))
    path = tmp_path / f"hall.{ending}"
    write_two(path, hall, room, name)
    scene = load_scene(path)
    assert np.ptp(scene.vertices_m, axis=0).max() == pytest.approx(9)
    assert scene.n_triangles == 12
    (line,) = (each for each in scene.report.warnings if "volume" in each)
    assert line.startswith(f"hall.{ending}: a volume of a room is left out, since no beam ends there: ")


def test_only_volumes_of_rooms_are_refused(tmp_path):
    path = tmp_path / "rooms.obj"
    write_two(path, box_corners((0, 0, 0), (9, 8, 4)), box_corners((9, 0, 0), (12, 8, 4)), "IfcSpace b", "IfcSpace a")
    with pytest.raises(SceneError, match="it has only volumes of rooms"):
        load_scene(path)


def test_hall_is_the_same_with_and_without_the_volume_of_its_room():
    made, plain = (load_scene(reality(f"hall_{name}_space_volume.glb")) for name in ("with", "without"))
    assert np.array_equal(made.vertices_m, plain.vertices_m)
    assert np.array_equal(made.triangles, plain.triangles)
    assert made.elements == plain.elements


@pytest.mark.parametrize("ending", ["obj", "glb", "usda"])
def test_faces_of_a_room_leave_those_of_walls_in_their_place_alone(tmp_path, ending):
    hall = box_corners((0, 0, 0), (9, 8, 4))
    path = tmp_path / f"hall.{ending}"
    write_two(path, hall, hall, "hall", "IfcSpace hall")  # before the walls, which would be its copies
    scene = load_scene(path)
    assert scene.n_triangles == 12
    assert len(scene.elements) == 1
    assert scene.report.n_duplicate == 0


def write_two(path, hall, room, name, hall_name="hall"):
    faces = BOX_FACES
    if path.suffix == ".obj":
        lines = [f"v {x} {y} {z}" for x, y, z in np.concatenate([hall, room]).tolist()]
        for title, first in ((hall_name, 1), (name, 9)):
            lines += [f"o {title}", *(f"f {a + first} {b + first} {c + first}" for a, b, c in faces.tolist())]
        path.write_text("\n".join(lines) + "\n")
    elif path.suffix == ".glb":
        import trimesh

        shown = trimesh.Scene()
        for title, corners in ((hall_name, hall), (name, room)):
            shown.add_geometry(trimesh.Trimesh(corners[:, [1, 2, 0]], faces, process=False), node_name=title)
        shown.export(path)
    else:
        prims = [
            f'def Mesh "{"".join(c if c.isalnum() else "_" for c in f"m{title}")}" {{\n'
            f" point3f[] points = {[tuple(row) for row in corners.tolist()]}\n"
            f" int[] faceVertexCounts = {[3] * len(faces)}\n"
            f" int[] faceVertexIndices = {faces.ravel().tolist()}\n}}\n"
            for title, corners in ((hall_name, hall), (name, room))
        ]
        path.write_text('#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"\n)\n' + "".join(prims))
