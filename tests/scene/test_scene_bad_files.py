"""Files that can't be used end in one clear line with the remedy: no traceback, no crash, nothing on stderr."""

from __future__ import annotations

import base64
import json
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from slow_cases import all_slow_but

from planner_core.errors import PlannerError, SceneError, SceneNotFoundError
from planner_core.scene.file_formats import FORMAT_OF_EXTENSION
from planner_core.scene.load import LoadOptions, load_scene
from tests.reality_files import reality

JPEG = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(range(256)) * 8
HOUSE_FILES = (
    "house.obj", "binary.stl", "text.stl", "little.ply", "big.ply", "text.ply", "house.glb", "house.usda", "house.usdc",
    "four.ifc",
)  # fmt: skip


def message_of(path: Path, **options) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path, options=LoadOptions(**options))
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    assert message.endswith(".")
    return message


def written(folder: Path, name: str, contents: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(contents.encode() if isinstance(contents, str) else contents)
    return path


def test_missing_file_says_so(tmp_path):
    with pytest.raises(SceneNotFoundError, match=r"nothing\.ifc: there is no such file; check the name"):
        load_scene(tmp_path / "nothing.ifc")
    with pytest.raises(FileNotFoundError):
        load_scene(tmp_path / "nothing.ifc")


def test_folder_says_so(tmp_path):
    assert "it is a folder" in message_of(tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_unreadable_file_says_so(tmp_path):
    path = written(tmp_path, "a.obj", "v 0 0 0\n")
    path.chmod(0)
    with pytest.raises(SceneNotFoundError, match="permissions"):
        load_scene(path)


def test_name_that_no_system_allows_says_so(tmp_path):
    with pytest.raises(SceneNotFoundError, match="can't be read"):
        load_scene(tmp_path / ("x" * 5000 + ".obj"))


@pytest.mark.parametrize("name", ["model.fbx", "model", "model.rvt"])
def test_unknown_extension_lists_the_known_ones(tmp_path, name):
    message = message_of(written(tmp_path, name, "v 0 0 0\n"))
    assert all(extension in message for extension in FORMAT_OF_EXTENSION)


@pytest.mark.parametrize("name", ["room.pcd", "ROOM.E57", "room.laz"])
def test_point_cloud_says_how_to_make_a_mesh(tmp_path, name):
    message = message_of(written(tmp_path, name, "# .PCD v.7 - Point Cloud Data file format\n"))
    assert "it is a point cloud" in message
    assert "mesh" in message


@pytest.mark.parametrize("extension", FORMAT_OF_EXTENSION)
def test_empty_file_says_so(tmp_path, extension):
    assert "the file is empty" in message_of(written(tmp_path, "model" + extension, b""))


@pytest.mark.parametrize("extension", FORMAT_OF_EXTENSION)
def test_picture_in_disguise_is_called_a_picture(tmp_path, extension):
    assert "begins like a JPEG picture" in message_of(written(tmp_path, "model" + extension, JPEG))


@pytest.mark.parametrize("extension", FORMAT_OF_EXTENSION)
def test_text_in_disguise_is_quoted(tmp_path, extension):
    assert "'hello, this is no model" in message_of(
        written(tmp_path, "model" + extension, "hello, this is no model\n" * 9)
    )


CUTS = [
    pytest.param(name, share, marks=() if share in {0.3, 0.02} and name != "house.usda" else pytest.mark.slow)
    for name in HOUSE_FILES
    for share in (0.99, 0.7, 0.3, 0.02)
    if name != "house.obj" or share == 0.02  # an OBJ has no end: what is left of one may be a valid smaller one
    if not name.endswith((".usda", ".usdc", ".ifc")) or share in (0.99, 0.3)  # in a child process each
]


@pytest.mark.parametrize(("name", "share"), CUTS)
def test_file_that_is_cut_off_is_refused(tmp_path, write_house, read_apart, name, share):
    whole = write_house(tmp_path, name).read_bytes()
    message_of(written(tmp_path, name, whole[: int(len(whole) * share)]))


def test_obj_cut_off_inside_a_vertex_names_the_line(tmp_path):
    message = message_of(written(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1"))
    assert message.startswith("a.obj, line 3: 'v 0 1' is not a vertex")


@pytest.mark.parametrize("word", ["f 1 2 x", "f 1 2 99999999999999999999999"])
def test_obj_face_that_is_no_number_names_the_line(tmp_path, word):
    message = message_of(written(tmp_path, "a.obj", f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{word}\n"))
    assert message.startswith(f"a.obj, line 4: {word[:40]!r} is not a face")


# ---------------------------------------------------------------------------------------- missing vertices
TRIANGLE_PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 {}\n"
)


def gltf_text(corners) -> str:
    """A triangle soup of three vertices."""
    points = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    buffer = points + struct.pack(f"<{len(corners)}H", *corners)
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"name": "M", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5123, "count": len(corners), "type": "SCALAR"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 2 * len(corners)},
            ],
            "buffers": [
                {
                    "byteLength": len(buffer),
                    "uri": "data:application/octet-stream;base64," + base64.b64encode(buffer).decode(),
                }
            ],
        }
    )


USDA = (
    '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\ndef Mesh "M"\n{{\n    int[] faceVertexCounts = [3, 3]\n'
    "    int[] faceVertexIndices = [0, 1, 2, 0, 1, {}]\n    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}}\n"
)


@pytest.mark.parametrize(
    ("name", "contents", "expected"),
    [
        (
            "wall.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 7\n",
            "wall.obj: 1 of 2 faces names vertex 7, the file has 3.",
        ),
        ("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 0 1 2\n", "zero.obj: 1 of 2 faces names vertex 0,"),
        ("back.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf -9 1 2\n", "back.obj: 1 of 2 faces names vertex -9,"),
        ("wall.ply", TRIANGLE_PLY.format(7), "wall.ply: 1 of 2 faces names vertex 7, the file has 3, the last is 2."),
        ("minus.ply", TRIANGLE_PLY.format(-1), "minus.ply: 1 of 2 faces names vertex -1, the file has 3"),
        ("wall.gltf", gltf_text([0, 1, 2, 0, 1, 7]), "wall.gltf, mesh M: 1 of 2 faces names vertex 7, the mesh has 3"),
        ("wall.usda", USDA.format(7), "wall.usda, prim /M: 1 of 2 faces names vertex 7, the mesh has 3"),
    ],
)
def test_face_that_names_a_missing_vertex_is_counted_and_the_remedy_named(tmp_path, name, contents, expected):
    message = message_of(written(tmp_path, name, contents))
    assert message.startswith(expected)
    assert message.endswith("Repair it or pass --skip-bad-faces.")
    scene = load_scene(tmp_path / name, options=LoadOptions(skip_bad_faces=True))
    assert (scene.n_triangles, scene.report.n_bad_index, scene.report.n_faces_read) == (1, 1, 2)
    assert len(scene.report.dropped) == 1
    assert "a vertex that does not exist" in scene.report.dropped[0]


def test_large_counts_are_grouped(tmp_path):
    vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" * 400
    message = message_of(written(tmp_path, "a.obj", vertices + "f 1 2 3\n" * 1000 + "f 1 2 90331\n" * 3))
    assert message.startswith("a.obj: 3 of 1 003 faces name vertex 90 331, the file has 1 200.")


# ------------------------------------------------------------------------------------------- no triangles
@pytest.mark.parametrize(
    ("name", "contents"),
    [
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\n"),
        ("points.ply", TRIANGLE_PLY.partition("element face")[0] + "end_header\n0 0 0\n1 0 0\n0 1 0\n"),
        ("none.stl", "solid none\nendsolid none\n"),
        ("none.gltf", '{"asset": {"version": "2.0"}}'),
        ("none.usda", '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\ndef Xform "A"\n{\n}\n'),
    ],
)
def test_file_without_faces_says_so(tmp_path, name, contents):
    assert "it has no faces" in message_of(written(tmp_path, name, contents))


@pytest.mark.parametrize(
    ("added", "words"),
    [
        ({}, "it holds 1 IfcBuilding, 1 IfcBuildingStorey, 1 IfcSite and no element with a surface"),
        ({"IfcSpace": 3}, "it holds 3 IfcSpace, "),
        ({"IfcGrid": 1, "IfcAnnotation": 2}, "it holds 2 IfcAnnotation, "),
        ({"IfcWall": 2, "IfcSpace": 1}, "none of its 2 elements has a surface, expected"),
    ],
)
def test_ifc_without_geometry_says_what_is_there(tmp_path, ifc_writer, added, words):
    writer = ifc_writer("IFC4", "MILLI")
    writer.storeys({"Ground": 0.0}, (0, 0, 0))
    for kind, count in added.items():
        for number in range(count):
            writer.model.create_entity(kind, GlobalId=f"{kind[3:]:0<21}{number}", Name=f"{kind} {number}")
    writer.model.write(str(tmp_path / "hollow.ifc"))
    assert words in message_of(tmp_path / "hollow.ifc")


def test_rooms_without_walls_are_named_as_what_is_there():
    path = reality("rooms_only.ifc")
    assert "it holds 3 IfcSpace, 1 IfcBuilding, 1 IfcBuildingStorey and no element with a surface" in message_of(path)


def test_file_with_nothing_but_flat_faces_counts_them(tmp_path):
    message = message_of(written(tmp_path, "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n"))
    assert "none of its 2 faces can be used (1 not finite, 1 without area" in message


def test_ifc_shape_that_names_a_missing_instance_is_refused_by_number(tmp_path, write_house):
    """IfcOpenShell 0.9 ends the process with a segmentation fault on such a file."""
    text = write_house(tmp_path, "four.ifc").read_text()
    number, brep = re.search(r"#(\d+)(=IFCFACETEDBREP)", text).groups()
    message = message_of(written(tmp_path, "a.ifc", text.replace(f"#{number}{brep}", f"#999999{brep}")))
    assert f"names #{number}, which is not in the file" in message
    assert "IFCSHAPEREPRESENTATION" in message


def test_ifc_relation_that_names_a_missing_instance_is_read(tmp_path, write_house):
    text = write_house(tmp_path, "four.ifc").read_text()
    relation = (
        "#999999=IFCRELDEFINESBYPROPERTIES('0123456789012345678901',$,'not #5, but #77777',$,(#888888),#888889);\n"
    )
    path = written(tmp_path, "a.ifc", text.replace("ENDSEC;\nEND-ISO", relation + "ENDSEC;\nEND-ISO"))
    assert "888888" in path.read_text()
    assert load_scene(path).n_triangles == 48


@pytest.mark.slow
@pytest.mark.parametrize(
    "comment", ["/* it's a comment */", "/* not #77777 */", "/* several\nlines' with #77777 */", "/* ' */ /* */"]
)
def test_ifc_comment_may_hold_what_strings_and_references_begin_with(tmp_path, write_house, comment):
    text = write_house(tmp_path, "four.ifc").read_text()
    number = re.search(r"#(\d+)=IFCFACETEDBREP", text).group(1)
    commented = text.replace("DATA;\n", f"DATA;\n{comment}\n", 1)
    assert load_scene(written(tmp_path, "a.ifc", commented)).n_triangles == 48
    lost = commented.replace(f"#{number}=IFCFACETEDBREP", "#999999=IFCFACETEDBREP")
    assert f"names #{number}, which is not in the file" in message_of(written(tmp_path, "b.ifc", lost))


def test_ifc_string_may_hold_what_comments_begin_with(tmp_path, write_house):
    text = write_house(tmp_path, "four.ifc").read_text()
    number = re.search(r"#(\d+)=IFCFACETEDBREP", text).group(1)
    named = text.replace("'Slab'", "'Slab /* 1'")
    assert load_scene(written(tmp_path, "a.ifc", named)).n_triangles == 48
    lost = named.replace(f"#{number}=IFCFACETEDBREP", "#999999=IFCFACETEDBREP")
    assert f"names #{number}, which is not in the file" in message_of(written(tmp_path, "b.ifc", lost))


def test_ifc_whose_attributes_have_wrong_types_is_refused(tmp_path, write_house):
    text = write_house(tmp_path, "four.ifc").read_text()
    broken = re.sub(r"(IFCBUILDINGSTOREY\('[^']*',\$,'Ground',\$,\$,)#\d+", r"\g<1>#1", text)
    assert broken != text
    assert "do not follow IFC4" in message_of(written(tmp_path, "a.ifc", broken))


def test_ifc_placement_of_the_wrong_class_is_refused(tmp_path, write_house):
    """IfcOpenShell ends in an AssertionError of its own."""
    text = write_house(tmp_path, "four.ifc").read_text()
    direction = re.search(r"#(\d+)=IFCDIRECTION", text).group(1)
    broken = re.sub(r"(IFCLOCALPLACEMENT\(\$,)#\d+", rf"\g<1>#{direction}", text)
    assert broken != text
    assert "do not follow IFC4" in message_of(written(tmp_path, "a.ifc", broken))


def test_usd_text_with_bytes_that_are_no_text_is_refused(tmp_path, write_house):
    contents = write_house(tmp_path, "house.usda").read_bytes()
    broken = contents.replace(b"metersPerUnit", b"meters\xd6\xd6Unit")
    assert "it holds bytes that are not text" in message_of(written(tmp_path, "a.usda", broken))


def test_usd_unit_of_the_wrong_type_is_refused(tmp_path):
    contents = USDA.format(2).replace("metersPerUnit = 1", 'metersPerUnit = "one"')
    assert "not a readable USD file" in message_of(written(tmp_path, "a.usda", contents))


@pytest.mark.parametrize(
    ("was", "becomes", "expected"),
    [
        ("point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]", "int[] points = [1, 2]", "points are not"),
        ("point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]", 'string[] points = ["a"]', "points are not"),
        ("int[] faceVertexCounts = [3, 3]", "float[] faceVertexCounts = [3, nan]", "faceVertexCounts are not a list"),
        ("int[] faceVertexCounts = [3, 3]", "int faceVertexCounts = 3", "faceVertexCounts are not a list"),
        ("metersPerUnit = 1", "metersPerUnit = 0", "its unit is 0 m long"),
        ("metersPerUnit = 1", "metersPerUnit = nan", "its unit is nan m long"),
    ],
)  # fmt: skip
def test_usd_value_of_the_wrong_kind_is_named(tmp_path, was, becomes, expected):
    contents = USDA.format(2).replace(was, becomes)
    assert contents != USDA.format(2)
    assert expected in message_of(written(tmp_path, "a.usda", contents))


def test_usd_unit_that_is_no_length_gives_way_to_the_users(tmp_path):
    path = written(tmp_path, "a.usda", USDA.format(2).replace("metersPerUnit = 1", "metersPerUnit = 0"))
    assert load_scene(path, options=LoadOptions(metres_per_unit=0.01)).n_triangles == 1


# ----------------------------------------------------------------------------------------- bugs of our own
OWN_CODE = [
    ("four.ifc", "ifc_storeys._choose_elevations"),
    ("four.ifc", "ifc_shapes._outside_out"),
    ("four.ifc", "ifc_shapes.placed"),
    ("house.usda", "usd.triangulate"),
    ("house.usda", "usd.placed"),
    ("house.usda", "usd._add_mesh"),
    ("house.glb", "gltf.placed"),
    ("house.glb", "gltf._local_matrix"),
    ("house.glb", "gltf._triangles"),
    ("little.ply", "ply.triangulate"),
    ("house.obj", "obj.triangulate"),
    ("text.stl", "stl._raw"),
]


@pytest.mark.parametrize(
    "kind",
    all_slow_but([KeyError], [AttributeError, TypeError, ValueError, IndexError, KeyError, RuntimeError]),
)
@pytest.mark.parametrize(("name", "function"), OWN_CODE)
def test_bug_of_our_own_is_not_told_as_a_fault_of_the_file(tmp_path, write_house, monkeypatch, name, function, kind):
    path = write_house(tmp_path, name)

    def fail(*args, **options):
        raise kind("planted")

    monkeypatch.setattr(f"planner_core.scene.{function}", fail)
    with pytest.raises(kind, match="planted") as caught:
        load_scene(path)
    assert not isinstance(caught.value, PlannerError)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four.ifc", "house.obj"])
def test_error_of_a_progress_callback_comes_through(tmp_path, write_house, read_apart, name):
    path = write_house(tmp_path, name)

    def fail(event):
        if event.done:
            raise ValueError("the caller's own")

    with pytest.raises(ValueError, match="the caller's own") as caught:
        load_scene(path, progress=fail)
    assert not isinstance(caught.value, PlannerError)


def test_ifc_of_an_unknown_schema_says_so(tmp_path, write_house):
    text = write_house(tmp_path, "four.ifc").read_text().replace("IFC4'", "IFC9'")
    assert "IFC2X3, IFC4 or IFC4X3" in message_of(written(tmp_path, "nine.ifc", text))


def test_binary_stl_that_is_too_long_is_read_and_says_so(tmp_path, write_house):
    whole = write_house(tmp_path, "binary.stl").read_bytes()
    scene = load_scene(written(tmp_path, "long.stl", whole + b"0123456789"))
    assert scene.n_triangles == 48
    assert scene.report.warnings == ("long.stl: 10 bytes after its last triangle were left out.",)


# ---------------------------------------------------------------------------------------------------- PLY
def ply_text(*, axis="float x", corners="int", counts="uchar", rows="0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n") -> str:
    return (
        f"ply\nformat ascii 1.0\nelement vertex 3\nproperty {axis}\nproperty float y\nproperty float z\n"
        f"element face 1\nproperty list {counts} {corners} vertex_indices\nend_header\n{rows}"
    )


TRIANGLE = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("contents", "expected"),
    [
        (ply_text(rows=TRIANGLE + f"3 0 1 {10**20 - 1}\n"), "the number 99999999999999999999 among the rows of face"),
        (ply_text(rows=TRIANGLE + f"3 0 1 -{2**63}\n"), f"the number -{2**63} among the rows of face"),
        (ply_text(rows=TRIANGLE + f"{10**20} 0 1 2\n"), f"a list of length {10**20} among the rows of face"),
        (ply_text(corners="float", rows=TRIANGLE + "3 0 1 nan\n"), "1 vertex numbers of its faces are not whole"),
        (ply_text(corners="float", rows=TRIANGLE + "3 0 inf 1.5\n"), "2 vertex numbers of its faces are not whole"),
        (ply_text(corners="double", rows=TRIANGLE + "3 0 1 1e300\n"), "not whole numbers, such as 1e+300"),
        (ply_text(axis="list uchar float x", rows="2 0 0 0 0\n1 1 0 0\n1 0 1 0\n3 0 1 2\n"), "vertices is a list"),
        (ply_text(axis="list uchar float x", rows="0 0 0\n0 0 0\n0 1 0\n3 0 1 2\n"), "x of its vertices is a"),
        (ply_text(counts="float"), "property list float int vertex_indices' can't be read"),
        (ply_text().replace("vertex 3", f"vertex {10**30}"), f"element vertex {10**30}' can't be read"),
    ],
)  # fmt: skip
def test_ply_fault_is_named(tmp_path, contents, expected):
    assert expected in message_of(written(tmp_path, "a.ply", contents))


def test_binary_ply_with_a_float_vertex_number_that_is_none_is_refused(tmp_path):
    head = ply_text(corners="float", rows="").replace("ascii", "binary_little_endian")
    body = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<Bfff", 3, 0, 1, float("nan"))
    assert "not whole numbers, such as nan" in message_of(written(tmp_path, "a.ply", head.encode() + body))


@pytest.mark.filterwarnings("error")
def test_signalling_nan_in_a_binary_file_is_dropped_without_a_warning(tmp_path, write_house):
    """NumPy warns of such a bit pattern when it becomes a float64."""
    signalling = (0x7F800001).to_bytes(4, "little")
    stl = write_house(tmp_path, "binary.stl").read_bytes()
    scene = load_scene(written(tmp_path, "a.stl", stl[:96] + signalling + stl[100:]))
    assert (scene.n_triangles, scene.report.n_non_finite) == (47, 1)
    head = ply_text(rows="").replace("ascii", "binary_little_endian")
    body = struct.pack("<8f", 0, 0, 0, 1, 0, 0, 0, 1) + signalling + struct.pack("<Biii", 3, 0, 1, 2)
    assert "1 not finite" in message_of(written(tmp_path, "a.ply", head.encode() + body))


def test_ply_with_whole_float_vertex_numbers_is_read(tmp_path):
    assert load_scene(written(tmp_path, "a.ply", ply_text(corners="float"))).n_triangles == 1


# --------------------------------------------------------------------------------------------------- glTF
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"asset": {"version": "1.0"}}, "it states glTF 1.0"),
        ({"asset": {}}, "it states no version"),
        ({"asset": []}, "do not follow glTF 2.0 (asset is a list, expected an object)"),
        ({"nodes": 5}, "do not follow glTF 2.0 (nodes is 5, expected a list)"),
        ({"nodes": [5]}, "do not follow glTF 2.0 (nodes/0 is 5, expected an object)"),
        ({"nodes": [{"mesh": 1}]}, "(nodes/0/mesh is 1, expected a whole number from 0 to 0)"),
        ({"nodes": [{"mesh": True}]}, "(nodes/0/mesh is True, expected a whole number from 0 to 0)"),
        ({"nodes": [{"mesh": 0, "matrix": [1, 2]}]}, "(nodes/0/matrix is a list, expected 16 numbers)"),
        ({"nodes": [{"mesh": 0, "scale": [1, 1, 10**400]}]}, "(nodes/0/scale is a list, expected 3 numbers)"),
        ({"nodes": [{"mesh": 0, "name": 7}]}, "(nodes/0/name is 7, expected text)"),
        ({"meshes": [{}]}, "do not follow glTF 2.0 (meshes/0/primitives is missing)"),
        ({"scene": 3}, "(scene is 3, expected a whole number from 0 to 0)"),
        ({"accessors": [{"componentType": 1, "count": 3, "type": "VEC3"}] * 2}, "accessors/0/componentType is 1"),
        ({"buffers": [{"byteLength": 48, "uri": "a\0b\nc.bin"}]}, "which can't be read (embedded null byte)"),
        ({"buffers": [{"byteLength": 48, "uri": "\ud800.bin"}]}, "refers to \ufffd.bin, which can't be read"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "has two parents"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "or run gltf-transform copy on it"),
        (
            {"nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {}}}}]},
            "its instances have placements of none, expected as many of each",
        ),
        (
            {"extensionsUsed": ["EXT_meshopt_compression"], "buffers": [{"byteLength": 48}]},
            "uses EXT_meshopt_compression, which is not read",
        ),
        ({"buffers": [{"byteLength": 48, "uri": "beside.bin"}]}, "refers to beside.bin, which can't be read"),
        ({"buffers": [{"byteLength": 48, "uri": "/etc/passwd"}]}, "expected a file beside it"),
        ({"buffers": [{"byteLength": 48, "uri": "../beside.bin"}]}, "expected a file beside it"),
        ({"buffers": [{"byteLength": 48, "uri": "a/..%2F..%2Fbeside.bin"}]}, "expected a file beside it"),
        ({"buffers": [{"byteLength": 48, "uri": "data:a/b;base64,@@@"}]}, "not valid base64"),
        ({"buffers": [{"byteLength": 48, "uri": "data:a/b;base64,AAAA"}]}, "declares 48 bytes and has 3"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteLength": 4}]}, "ends at byte 4"),
    ],
)
def test_gltf_fault_is_named(tmp_path, change, expected):
    tree = json.loads(gltf_text([0, 1, 2])) | change
    assert expected in message_of(written(tmp_path, "a.gltf", json.dumps(tree)))


def test_gltf_reads_no_file_of_another_folder(tmp_path):
    """Not even by a link inside its own: the file that it names is there and would do."""
    (tmp_path / "other").mkdir()
    (tmp_path / "scene").mkdir()
    tree = json.loads(gltf_text([0, 1, 2]))
    contents = base64.b64decode(tree["buffers"][0]["uri"].partition(",")[2])
    outside = written(tmp_path / "other", "a.bin", contents)
    (tmp_path / "scene" / "link.bin").symlink_to(outside)
    for uri in ("../other/a.bin", "link.bin"):
        changed = tree | {"buffers": [{"byteLength": len(contents), "uri": uri}]}
        scene = written(tmp_path / "scene", "a.gltf", json.dumps(changed))
        assert f"it refers to {uri}, expected a file beside it" in message_of(scene)
        assert load_scene(written(tmp_path / "other", "b.gltf", json.dumps(changed).replace(uri, "a.bin"))).n_triangles


def test_pipe_in_place_of_a_file_is_not_waited_for(tmp_path):
    tree = json.loads(gltf_text([0, 1, 2])) | {"buffers": [{"byteLength": 48, "uri": "a.bin"}]}
    os.mkfifo(tmp_path / "a.bin")
    assert "a.bin, which is no file" in message_of(written(tmp_path, "a.gltf", json.dumps(tree)))
    for extension in (".obj", ".ply", ".stl", ".glb", ".ifc", ".usda"):
        path = tmp_path / f"pipe{extension}"
        os.mkfifo(path)
        assert "it is a pipe or a device, expected a file" in message_of(path)


def test_device_without_an_end_is_not_read(tmp_path):
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    assert "it is a pipe or a device" in message_of(tmp_path / "zero.obj")


def test_gltf_name_with_half_a_surrogate_pair_can_be_written(tmp_path):
    tree = json.loads(gltf_text([0, 1, 2, 0, 1, 2])) | {"nodes": [{"mesh": 0, "name": "Wall \ud83c \ud83c\udfe0"}]}
    scene = load_scene(written(tmp_path, "a.gltf", json.dumps(tree)))
    assert [e.name for e in scene.elements] == ["Wall \ufffd \U0001f3e0"]
    assert scene.report.dropped == ("Wall \ufffd \U0001f3e0, face 1: is the same as face 0",)


def test_gltf_sparse_accessor_that_replaces_a_missing_value_is_refused(tmp_path):
    tree = json.loads(gltf_text([0, 1, 9]))
    tree["accessors"][0]["sparse"] = {
        "count": 3,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 0},
    }
    assert "names a value that does not exist, the last is 2" in message_of(
        written(tmp_path, "a.gltf", json.dumps(tree))
    )


# ----------------------------------------------------------------------------------------- native libraries
@pytest.mark.slow
def test_bad_files_neither_crash_the_process_nor_reach_stderr(tmp_path, write_house):
    """Native libraries write to the process's stderr, which only a process of its own shows."""
    paths = [written(tmp_path, "jpeg.usdc", JPEG)]
    for name in ("house.usdc", "four.ifc"):
        whole = write_house(tmp_path, name).read_bytes()
        middle = len(whole) // 2
        paths.append(written(tmp_path, "hole-" + name, whole[:middle] + b"\0" * 64 + whole[middle + 64 :]))
    unresolved = '#usda 1.0\n(\n    subLayers = [@./missing.usda@]\n)\ndef "A" (references = @./gone.usda@)\n{\n}\n'
    paths.append(written(tmp_path, "unresolved.usda", unresolved))
    program = (
        "import sys\nfrom pathlib import Path\nfrom planner_core.errors import PlannerError\n"
        "from planner_core.scene.load import load_scene\n"
        "for name in sys.argv[1:]:\n"
        "    try:\n        load_scene(Path(name))\n"
        "    except PlannerError as error:\n        print(str(error).count(chr(10)))\n"
        "    else:\n        print('loaded')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, paths)], capture_output=True, text=True, check=False, timeout=240
    )
    assert (done.returncode, done.stderr) == (0, "")
    answers = done.stdout.split()
    assert len(answers) == len(paths)
    assert answers[0] == "0"
    assert set(answers) <= {"0", "loaded"}


def test_missing_layers_of_a_stage_become_warnings(tmp_path):
    contents = USDA.format(1).replace('upAxis = "Z"', 'upAxis = "Z"\n    subLayers = [@./missing.usda@]')
    scene = load_scene(written(tmp_path, "a.usda", contents))
    assert len(scene.report.warnings) == 1
    assert "missing.usda" in scene.report.warnings[0]


def test_all_errors_are_the_planners_own(tmp_path):
    with pytest.raises(PlannerError):
        load_scene(written(tmp_path, "a.stl", JPEG))
    with pytest.raises(ValueError, match="not an STL file"):
        load_scene(tmp_path / "a.stl")
