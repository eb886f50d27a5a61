"""What single formats allow beyond plain triangles: groups, polygons, instances, strips, purposes."""

from __future__ import annotations

import base64
import json
import math
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.scene.load import LoadOptions, load_scene
from tests.reality_files import reality

SQUARE_OBJ = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"


def load_text(folder, name, text, **options):
    path = folder / name
    path.write_text(text)
    return load_scene(path, options=LoadOptions(**options))


# ---------------------------------------------------------------------------------------------------- OBJ
def test_obj_objects_and_groups_name_the_elements(tmp_path):
    text = SQUARE_OBJ + "f 1 2 3\no Hall\nf 1 3 4\ng Wall\nf 1 2 4\no Yard\nf 2 3 4\no Hall\ng Wall\n"
    scene = load_text(tmp_path, "a.obj", text + "v 0 0 1\nf 1 2 5\n")
    assert [e.name for e in scene.elements] == ["mesh", "Hall", "Hall/Wall", "Yard"]
    assert scene.element_of_triangle.tolist() == [0, 1, 2, 3, 2]


@pytest.mark.parametrize(
    "face",
    ["f 1 2 3 4", "f 1/1 2/2 3/3 4/4", "f 1//9 2//9 3//9 4//9", "f 1/1/9 2/1/9 3/1/9 4/1/9", "f -4 -3 -2 -1",
     "\tf\t1 2  3 4  # comment", "f 1 2 \\\n 3 4", "f 1 2 3 4\r"],
)  # fmt: skip
def test_obj_face_is_read_in_every_notation(tmp_path, face):
    scene = load_text(tmp_path, "a.obj", "# comment\nmtllib a.mtl\n" + SQUARE_OBJ + "vt 0 0\nvn 0 0 1\ns off\n" + face)
    assert scene.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert scene.vertices_m.tolist() == [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]


def test_obj_negative_numbers_count_back_from_the_face(tmp_path):
    scene = load_text(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -4 -3 -1\n")
    assert scene.vertices_m[scene.triangles].tolist() == [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0, 0, 0], [1, 0, 0], [5, 5, 5]],
    ]


def test_obj_vertex_with_weight_or_colour_is_read(tmp_path):
    scene = load_text(tmp_path, "a.obj", "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 0 1e0 0\nf 1 2 3\n")
    assert scene.vertices_m.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_obj_byte_order_mark_is_no_part_of_the_first_vertex(tmp_path):
    path = tmp_path / "a.obj"
    path.write_bytes(b"\xef\xbb\xbfv 0 0 7\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")
    scene = load_scene(path)
    assert scene.vertices_m[scene.triangles].tolist() == [[[0, 0, 7], [1, 0, 0], [0, 1, 0]]]


def test_obj_report_numbers_faces_as_the_file_does(tmp_path):
    scene = load_text(tmp_path, "a.obj", SQUARE_OBJ + "g W\nf 1 2 3\nf 1 1 2\nf 1 3 4\nf 2 3 1\n")
    assert scene.report.dropped == ("W, face 2: has two corners in one place", "W, face 4: is the same as face 1")


# ---------------------------------------------------------------------------------------------------- PLY
PLY_HEAD = "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(("order", "title"), [("<", "binary_little_endian"), (">", "binary_big_endian")])
def test_ply_with_triangles_squares_and_other_tables_is_read(tmp_path, order, title):
    points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    head = (
        PLY_HEAD.format(title) + "element note 2\nproperty list uchar short words\nproperty int n\n"
        "element face 2\nproperty uchar flags\nproperty list uchar uint vertex_index\nproperty list uchar float uv\n"
        "end_header\n"
    )
    body = b"".join(struct.pack(order + "3f", *p) for p in points)
    body += struct.pack(order + "BhhiBi", 2, 7, 8, 9, 0, 10)
    body += struct.pack(order + "BB4IB1f", 1, 4, 0, 1, 2, 3, 1, 0.5)
    body += struct.pack(order + "BB3IB", 1, 3, 0, 1, 3, 0)
    (tmp_path / "a.ply").write_bytes(head.encode() + body)
    scene = load_scene(tmp_path / "a.ply")
    assert scene.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3]]
    assert scene.vertices_m.tolist() == [list(map(float, p)) for p in points]


def test_ply_in_ascii_with_triangles_and_squares_is_read(tmp_path):
    head = PLY_HEAD.format("ascii") + "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    scene = load_text(tmp_path, "a.ply", head + "0 0 0\n2 0 0\n2 2 0\n0 2 0\n4 0 1 2 3\n3 0 1 3\n")
    assert scene.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3]]


# ---------------------------------------------------------------------------------------------------- STL
def test_binary_stl_whose_title_begins_with_solid_is_read(tmp_path, house, write_house):
    contents = bytearray(write_house(tmp_path, "binary.stl").read_bytes())
    contents[:80] = b"solid but binary".ljust(80)
    (tmp_path / "a.stl").write_bytes(contents)
    scene = load_scene(tmp_path / "a.stl")
    assert scene.n_triangles == len(house.triangles)
    assert scene.elements[0].name == "but binary"


def test_ascii_stl_in_capitals_is_read(tmp_path, write_house, house):
    text = write_house(tmp_path, "text.stl").read_text().upper()
    scene = load_text(tmp_path, "a.stl", text)
    assert scene.n_triangles == len(house.triangles)
    assert [e.name for e in scene.elements] == ["SLAB", "WALL", "PIER", "ROOF"]


# --------------------------------------------------------------------------------------------------- glTF
class GltfWriter:
    """Collects accessors in one embedded buffer."""

    def __init__(self):
        self.buffer = b""
        self.tree = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "meshes": [], "nodes": []}

    def view(self, packed: bytes, **more) -> int:
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(packed)} | more)
        self.buffer += packed
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, packed, component, count, kind, view=None, **more) -> int:
        entry = {"componentType": component, "count": count, "type": kind} | more
        if packed is not None:
            entry["bufferView"] = self.view(packed, **(view or {}))
        self.tree["accessors"].append(entry)
        return len(self.tree["accessors"]) - 1

    def floats(self, points) -> int:
        return self.accessor(np.asarray(points, "<f4").tobytes(), 5126, len(points), "VEC3")

    def shorts(self, corners) -> int:
        return self.accessor(np.asarray(corners, "<u2").tobytes(), 5123, len(corners), "SCALAR")

    def mesh(self, *primitives, **node) -> None:
        self.tree["meshes"].append({"primitives": list(primitives)})
        self.tree["nodes"].append({"mesh": len(self.tree["meshes"]) - 1} | node)

    def load(self, folder):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
        self.tree["buffers"] = [{"byteLength": len(self.buffer), "uri": uri}]
        (folder / "a.gltf").write_text(json.dumps(self.tree))
        return load_scene(folder / "a.gltf", options=LoadOptions(up_axis="Z"))


POINTS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (-1, 1, 0)]


@pytest.mark.parametrize(
    ("mode", "corners", "expected"),
    [
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3, 4], [[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
    ],
)
def test_gltf_lists_strips_and_fans_have_one_winding(tmp_path, mode, corners, expected):
    writer = GltfWriter()
    writer.mesh({"attributes": {"POSITION": writer.floats(POINTS)}, "indices": writer.shorts(corners), "mode": mode})
    scene = writer.load(tmp_path)
    found = scene.vertices_m[scene.triangles]
    assert found.tolist() == np.array(POINTS, dtype=float)[expected].tolist()
    a, b, c = np.moveaxis(found, 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_gltf_without_indices_takes_corners_in_threes(tmp_path):
    writer = GltfWriter()
    writer.mesh({"attributes": {"POSITION": writer.floats(POINTS[:3])}})
    assert writer.load(tmp_path).triangles.tolist() == [[0, 1, 2]]


def test_gltf_quantised_positions_are_exact(tmp_path):
    """KHR_mesh_quantization, as gltfpack writes it: unsigned shorts, padded to 8 bytes, and the scale in the node."""
    writer = GltfWriter()
    writer.tree["extensionsUsed"] = writer.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    packed = np.array([(0, 0, 0, 7), (65535, 0, 0, 7), (0, 65535, 1, 7)], "<u2").tobytes()
    position = writer.accessor(packed, 5123, 3, "VEC3", view={"byteStride": 8})
    normalised = writer.accessor(packed, 5123, 3, "VEC3", view={"byteStride": 8}, normalized=True)
    writer.mesh({"attributes": {"POSITION": position}}, scale=[0.5, 0.5, 0.5], translation=[1, 2, 3])
    writer.mesh({"attributes": {"POSITION": normalised}}, scale=[2, 2, 2])
    scene = writer.load(tmp_path)
    first, second = (scene.vertices_m[scene.triangles[i]] + scene.offset_m for i in (0, 1))
    assert first.tolist() == [[1, 2, 3], [32768.5, 2, 3], [1, 32769.5, 3.5]]
    assert second.tolist() == [[0, 0, 0], [2, 0, 0], [0, 2, 2 / 65535]]


def test_gltf_whose_level_surfaces_face_z_is_doubted(tmp_path, write_house):
    """A building that was modelled z up, and exported as glTF without turning it; and one that was turned."""
    import trimesh

    path = write_house(tmp_path, "house.glb")
    assert not any("--up z" in warning for warning in load_scene(path).report.warnings)
    turned = trimesh.load(path)
    turned.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    turned.export(tmp_path / "turned.glb")
    (told,) = load_scene(tmp_path / "turned.glb").report.warnings
    assert "turned.glb is y up by the rules of glTF and is read with y up" in told
    assert told.endswith("if z is up, pass --up z.")
    assert load_scene(tmp_path / "turned.glb", options=LoadOptions(up_axis="Z")).report.warnings == ()


def test_gltf_points_and_lines_are_left_out(tmp_path):
    writer = GltfWriter()
    positions = writer.floats(POINTS[:3])
    writer.mesh({"attributes": {"POSITION": positions}}, {"attributes": {"POSITION": positions}, "mode": 1})
    assert writer.load(tmp_path).report.n_faces_read == 1


def test_gltf_interleaved_quantised_and_sparse_positions_are_read(tmp_path):
    writer = GltfWriter()
    rows = b"".join(struct.pack("<3f3f", *p, 0, 0, 1) for p in POINTS[:3])
    interleaved = writer.accessor(rows, 5126, 3, "VEC3", view={"byteStride": 24})
    writer.mesh({"attributes": {"POSITION": interleaved}}, name="interleaved")
    quantised = writer.accessor(
        struct.pack("<3hxx3hxx3hxx", 0, 0, 32767, 32767, 0, 32767, 0, -32768, 32767),
        5122, 3, "VEC3", view={"byteStride": 8}, normalized=True,
    )  # fmt: skip
    writer.mesh({"attributes": {"POSITION": quantised}}, name="quantised")
    sparse = writer.accessor(
        None, 5126, 3, "VEC3",
        sparse={
            "count": 2,
            "indices": {"bufferView": writer.view(struct.pack("<2H", 1, 2)), "componentType": 5123},
            "values": {"bufferView": writer.view(struct.pack("<6f", 5, 0, 0, 0, 5, 0))},
        },
    )  # fmt: skip
    writer.mesh({"attributes": {"POSITION": sparse}}, name="sparse")
    scene = writer.load(tmp_path)
    assert [e.name for e in scene.elements] == ["interleaved", "quantised", "sparse"]
    assert scene.vertices_m[scene.triangles].tolist() == [
        [[0, 0, 0], [2, 0, 0], [2, 2, 0]],
        [[0, 0, 1], [1, 0, 1], [0, -1, 1]],
        [[0, 0, 0], [5, 0, 0], [0, 5, 0]],
    ]


def test_gltf_nodes_inherit_placements_and_mirrored_ones_keep_their_outside(tmp_path):
    writer = GltfWriter()
    half = float(np.sqrt(0.5))
    writer.mesh({"attributes": {"POSITION": writer.floats(POINTS[:3])}}, name="leaf", scale=[-1, 1, 1])
    writer.tree["nodes"].append({"name": "turned", "rotation": [0, 0, half, half], "children": [0]})
    matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1]
    writer.tree["nodes"].append({"name": "moved", "matrix": matrix, "children": [1]})
    scene = writer.load(tmp_path)
    assert [(e.name, e.source_id) for e in scene.elements] == [("leaf", "0")]
    a, b, c = scene.vertices_m[scene.triangles[0]]
    # (x, y) -> (-x, y) -> (-y, -x), then moved; the winding is turned over, so that the normal stays +z
    np.testing.assert_allclose([a, b, c], [[10, 20, 30], [8, 18, 30], [10, 18, 30]], atol=1e-6)
    assert np.cross(b - a, c - a)[2] > 0


def test_gltf_with_a_buffer_beside_it_is_read(tmp_path):
    writer = GltfWriter()
    writer.mesh({"attributes": {"POSITION": writer.floats(POINTS[:3])}})
    writer.load(tmp_path)
    (tmp_path / "my buffer.bin").write_bytes(writer.buffer)
    writer.tree["buffers"] = [{"byteLength": len(writer.buffer), "uri": "my%20buffer.bin"}]
    (tmp_path / "b.gltf").write_text(json.dumps(writer.tree))
    assert load_scene(tmp_path / "b.gltf").n_triangles == 1


# ---------------------------------------------------------------------------------------------------- USD
@pytest.fixture
def stage(tmp_path):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    return stage


def add_square(stage, path, counts=(4,), corners=(0, 1, 2, 3)):
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(POINTS)
    mesh.CreateFaceVertexCountsAttr(list(counts))
    mesh.CreateFaceVertexIndicesAttr(list(corners))
    return mesh


def load_stage(stage):
    stage.Save()
    return load_scene(Path(stage.GetRootLayer().realPath))


def upward_area_m2(scene):
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    return np.bincount(scene.element_of_triangle, np.cross(b - a, c - a)[:, 2] / 2, len(scene.elements)).tolist()


def test_usd_polygons_of_mixed_size_and_holes_are_split(stage):
    mesh = add_square(stage, "/a", (4, 3, 3), (0, 1, 2, 3, 0, 3, 4, 0, 1, 3))
    mesh.CreateHoleIndicesAttr([2])
    scene = load_stage(stage)
    assert scene.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
    assert scene.elements[0].kind == "Mesh"


def test_usd_left_handed_and_mirrored_meshes_keep_their_outside(stage):
    from pxr import UsdGeom

    add_square(stage, "/plain")
    add_square(stage, "/left").CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    add_square(stage, "/mirrored").AddScaleOp().Set((-1, 1, 1))
    both = add_square(stage, "/both")
    both.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    both.AddScaleOp().Set((1, -1, 1))
    for i, path in enumerate(("/plain", "/left", "/mirrored", "/both")):  # apart, so that none repeats another
        UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp().Set((0, 0, i))
    assert upward_area_m2(load_stage(stage)) == [4.0, -4.0, 4.0, -4.0]


def test_usd_leaves_out_what_is_hidden_and_names_what_is_no_mesh(stage):
    from pxr import UsdGeom

    add_square(stage, "/shown")
    add_square(stage, "/guide").CreatePurposeAttr(UsdGeom.Tokens.guide)
    add_square(stage, "/proxy").CreatePurposeAttr(UsdGeom.Tokens.proxy)
    add_square(stage, "/render", corners=(1, 2, 3, 4)).CreatePurposeAttr(UsdGeom.Tokens.render)
    UsdGeom.Xform.Define(stage, "/dark").MakeInvisible()
    add_square(stage, "/dark/inside")
    add_square(stage, "/off").GetPrim().SetActive(False)
    stage.CreateClassPrim("/recipe")
    add_square(stage, "/recipe/part")
    UsdGeom.NurbsPatch.Define(stage, "/sail")
    scene = load_stage(stage)
    assert [e.name for e in scene.elements] == ["/shown", "/render"]
    assert scene.report.warnings == (
        "a.usda: shapes of other kinds were left out: 1 NurbsPatch; convert them to meshes if they matter.",
    )


def test_usd_point_instancer_gives_one_element_an_instance_that_is_not_masked(stage):
    from pxr import UsdGeom

    instancer = UsdGeom.PointInstancer.Define(stage, "/group/trees")
    UsdGeom.Xform.Define(stage, "/group").AddTranslateOp().Set((0, 0, 100))
    UsdGeom.Xform.Define(stage, "/group/trees/kinds/tree").AddTranslateOp().Set((0, 10, 0))
    add_square(stage, "/group/trees/kinds/tree/leaf").AddTranslateOp().Set((0, 0, 1))
    instancer.CreatePrototypesRel().AddTarget("/group/trees/kinds/tree")
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (50, 0, 0), (70, 0, 0)])
    instancer.CreateInvisibleIdsAttr([1])
    scene = load_stage(stage)
    assert [e.name for e in scene.elements] == ["/group/trees[0]/leaf", "/group/trees[2]/leaf"]
    lows = [scene.vertices_m[scene.triangles[scene.element_of_triangle == i]].min(axis=(0, 1)) for i in (0, 1)]
    assert [low.tolist() for low in lows] == [[0, 10, 101], [70, 10, 101]]


def test_usd_nested_placements_are_composed_in_double(stage):
    from pxr import UsdGeom

    UsdGeom.Xform.Define(stage, "/far").AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set((500_000.125, 5_400_000, 0))
    UsdGeom.Xform.Define(stage, "/far/back").AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set((0.0625, 0, 0))
    add_square(stage, "/far/back/mesh")
    scene = load_stage(stage)
    low = scene.vertices_m.min(axis=0) + scene.offset_m
    assert low.tolist() == [500_000.1875, 5_400_000.0, 0.0]


def test_usd_stage_without_unit_and_axis_takes_usds_own_and_says_so(tmp_path):
    from pxr import Usd

    stage = Usd.Stage.CreateNew(str(tmp_path / "bare.usda"))
    add_square(stage, "/m")
    scene = load_stage(stage)
    assert (scene.source.metres_per_unit, scene.source.up_axis) == (0.01, "Y")
    for option in ("--units", "--up z"):
        assert any("is assumed" in line and option in line for line in scene.report.warnings)


def test_usd_mesh_whose_faces_and_corners_disagree_is_refused(stage):
    add_square(stage, "/m", counts=(4, 4))
    with pytest.raises(SceneError, match="prim /m: its faces need 8 corners and it lists 4"):
        load_stage(stage)


def test_usd_file_that_changed_on_disk_is_read_again(tmp_path):
    text = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
    text += 'def Mesh "m"\n{\n    int[] faceVertexCounts = [3]\n    int[] faceVertexIndices = [0, 1, 2]\n'
    text += "    point3f[] points = [(0, 0, 0), (%d, 0, 0), (0, 1, 0)]\n}\n"
    from pxr import Usd

    (tmp_path / "a.usda").write_text(text % 1)
    held = Usd.Stage.Open(str(tmp_path / "a.usda"))  # someone in this process still has the old layer
    (tmp_path / "a.usda").write_text(text % 25)
    assert load_scene(tmp_path / "a.usda").vertices_m[:, 0].max() == 25.0
    assert held.GetPrimAtPath("/m").IsValid()


def instanced(writer, **attributes):
    corner = writer.floats([(0, 0, 0), (1, 0, 0), (0, 2, 0)])
    writer.tree["extensionsUsed"] = writer.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    extension = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    writer.mesh({"attributes": {"POSITION": corner}}, translation=[10, 0, 0], extensions=extension)


def test_gltf_instances_are_elements_with_placements_of_their_own(tmp_path):
    """Turned, mirrored and scaled; rotations as floats, and as normalised shorts and bytes."""
    half = math.sqrt(0.5)
    expected = [
        [[11, 0, 0], [11, 1, 0], [9, 0, 0]],  # turned by 90 degrees about z
        [[10, 0, 3], [10, 4, 3], [8, 0, 3]],  # mirrored: the winding is turned over
    ]
    turns = np.array([[0, 0, half, half], [0, 0, 0, 1]])
    for component, dtype, largest in ((5126, "<f4", 1), (5122, "<i2", 32767), (5120, "<i1", 127)):
        writer = GltfWriter()
        packed = np.round(turns * largest).astype(dtype) if largest > 1 else turns.astype(dtype)
        more = {"normalized": True} if largest > 1 else {}
        instanced(
            writer,
            TRANSLATION=writer.floats([(1, 0, 0), (0, 0, 3)]),
            ROTATION=writer.accessor(packed.tobytes(), component, 2, "VEC4", **more),
            SCALE=writer.floats([(1, 1, 1), (-2, 2, 1)]),
        )
        scene = writer.load(tmp_path)
        assert len(scene.elements) == 2
        found = scene.vertices_m[scene.triangles]
        np.testing.assert_allclose(found[0], expected[0], atol=0.03)
        np.testing.assert_allclose(found[1], expected[1], atol=1e-6)


def test_gltf_instances_of_translation_alone_keep_the_mesh(tmp_path):
    writer = GltfWriter()
    instanced(writer, TRANSLATION=writer.floats([(0, 0, 0), (0, 5, 0), (0, 0, 7)]))
    scene = writer.load(tmp_path)
    lowest = scene.vertices_m[scene.triangles].min(axis=1)
    assert lowest.tolist() == [[10, 0, 0], [10, 5, 0], [10, 0, 7]]


def test_gltf_instances_of_different_number_are_refused(tmp_path):
    writer = GltfWriter()
    instanced(writer, TRANSLATION=writer.floats([(0, 0, 0), (0, 5, 0)]), SCALE=writer.floats([(1, 1, 1)]))
    with pytest.raises(SceneError, match="TRANSLATION 2, SCALE 1, expected as many of each"):
        writer.load(tmp_path)


def test_gltf_instanced_cupboards_are_those_of_plain_nodes(triangle_set):
    plain, made = (load_scene(reality(f"{name}_cupboards.glb")) for name in ("plain", "instanced"))
    np.testing.assert_allclose(
        triangle_set(made.vertices_m, made.triangles), triangle_set(plain.vertices_m, plain.triangles), atol=1e-6
    )


@pytest.mark.parametrize("count", [2_000_000, 10**7, 10**12])
def test_gltf_sparse_values_beyond_what_the_file_holds_are_refused(tmp_path, count):
    writer = GltfWriter()
    rows = writer.view(np.array([1], "<u4").tobytes())
    values = writer.view(np.ones(3, "<f4").tobytes())
    sparse = {"count": 1, "indices": {"bufferView": rows, "componentType": 5125}, "values": {"bufferView": values}}
    writer.mesh({"attributes": {"POSITION": writer.accessor(None, 5126, count, "VEC3", sparse=sparse)}})
    with pytest.raises(SceneError, match="values without a buffer, expected 1 000 000 at most for its 16 bytes"):
        writer.load(tmp_path)


@pytest.mark.parametrize("kind", ["float x", "list uchar int x"])
@pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
def test_ply_header_of_very_many_properties_is_refused(tmp_path, order, kind):
    lines = [
        "ply",
        f"format {order} 1.0",
        "element vertex 1",
        *(f"property {kind}{i}" for i in range(1100)),
        "end_header",
    ]
    (tmp_path / "wide.ply").write_text("\n".join(lines) + "\n")
    with pytest.raises(SceneError, match="its header has 1 100 properties, expected 1 000 at most"):
        load_scene(tmp_path / "wide.ply")


USD_HEAD = '#usda 1.0\n(\n defaultPrim = "W"\n metersPerUnit = {unit}\n upAxis = "{up}"\n)\n'
USD_FLOOR = """def Mesh "floor" {
 point3f[] points = [(0,0,0),(8,0,0),(8,6,0),(0,6,0)]
 int[] faceVertexCounts = [4]
 int[] faceVertexIndices = [0,1,2,3]
}
"""


@pytest.mark.parametrize("arc", ["references = @walls.usd@", "payload = @parts/walls.usda@", "references = @C:/w.usd@"])
@pytest.mark.parametrize("floor", [USD_FLOOR, ""])
def test_usd_files_that_are_not_there_are_named(tmp_path, arc, floor):
    text = USD_HEAD.format(unit=1, up="Z") + f'def Xform "W" {{\n{floor}def "walls" ( prepend {arc} ) {{}}\n}}\n'
    path = tmp_path / "site.usda"
    path.write_text(text)
    name = arc.split("@")[1]
    if floor:
        (line,) = load_scene(path).report.warnings
    else:
        with pytest.raises(SceneError) as error:
            load_scene(path)
        line = str(error.value)
        assert "no faces without them" in line
    assert "site.usda: a file that holds parts of it could not be opened: " in line
    assert name in line
    assert str(tmp_path) not in line


@pytest.mark.parametrize(
    ("unit", "up", "words"),
    [
        (0.01, "Z", "centimetres with z up"),
        (1, "Y", "metres with y up"),
        (0.001, "Y", "millimetres with y up"),
        (1, "Z", ""),
    ],
)
def test_usd_metrics_of_referenced_layers_are_compared(tmp_path, unit, up, words):
    part = USD_HEAD.format(unit=unit, up=up) + 'def Xform "W" {\n' + USD_FLOOR + "}\n"
    (tmp_path / "desk.usda").write_text(part)
    text = (
        USD_HEAD.format(unit=1, up="Z")
        + f'def Xform "W" {{\n{USD_FLOOR}def "desk" ( prepend references = @desk.usda@ )'
    )
    (tmp_path / "room.usda").write_text(
        text
        + ' { double3 xformOp:translate = (0, 0, 1)\n uniform token[] xformOpOrder = ["xformOp:translate"]\n }\n}\n'
    )
    scene = load_scene(tmp_path / "room.usda")
    assert np.ptp(scene.vertices_m, axis=0).tolist() == [8, 6, 1]
    lines = scene.report.warnings
    assert len(lines) == bool(words)
    for line in lines:
        assert line.startswith("room.usda is in metres with z up, and parts in 'desk.usda' are in " + words)


@pytest.mark.slow
@pytest.mark.parametrize("fill", [b" ", b"#1=IFCCARTESIANPOINT((0.,0.,0.));\n", b"/* */"])
def test_ifczip_that_unpacks_to_far_more_than_it_holds_is_refused(tmp_path, fill):
    path = tmp_path / "bomb.ifczip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.ifc", b"ISO-10303-21;\n" + fill * (40 * 1024**2 // len(fill)))
    with pytest.raises(SceneError, match="the file in it is longer than 32 MiB, which is not unpacked"):
        load_scene(path)
