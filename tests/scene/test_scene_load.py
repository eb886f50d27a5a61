"""Every format: the same house comes out, with its names, unit and axes."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.scene.load import LoadOptions, load_scene

HOUSE_FILES = (
    "house.obj",
    "binary.stl",
    "text.stl",
    "little.ply",
    "big.ply",
    "text.ply",
    "house.glb",
    "house.usda",
    "house.usdc",
    "two.ifc",
    "four.ifc",
)
NAMED = ("house.obj", "text.stl", "house.glb", "house.usda", "two.ifc", "four.ifc")


def names_of(scene):
    """Last part of the elements' names: USD says the whole prim path."""
    return [e.name.removeprefix("/House/").split("/")[0] for e in scene.elements]


@pytest.mark.parametrize("name", HOUSE_FILES)
def test_house_is_the_same_from_every_format(tmp_path, write_house, house, triangle_set, volumes, name):
    path = write_house(tmp_path, name)
    scene = load_scene(path)
    np.testing.assert_allclose(
        triangle_set(scene.vertices_m, scene.triangles), triangle_set(house.vertices, house.triangles), atol=1e-6
    )
    assert volumes(scene).sum() == pytest.approx(8 * 6 * 0.25 * 2 + 8 * 0.25 * 2.75 + 0.5 * 0.5 * 2.75, rel=1e-9)
    assert not scene.offset_m.any()
    assert scene.report.n_faces_read == 48
    assert scene.report.dropped == ()
    assert scene.report.warnings == ()
    assert scene.vertices_m.dtype == np.float64
    assert scene.triangles.dtype == np.int32
    assert scene.element_of_triangle.dtype == np.int32
    if name in NAMED:
        expected = {"Slab": 12.0, "Wall": 5.5, "Pier": 0.6875, "Roof": 12.0}
        assert dict(zip(names_of(scene), volumes(scene), strict=True)) == pytest.approx(expected)
    # Triangles that share a corner share its vertex.
    assert len(scene.vertices_m) == len(np.unique(np.round(house.vertices, 9), axis=0))
    assert len(np.unique(scene.vertices_m, axis=0)) == len(scene.vertices_m)
    again = load_scene(path)
    for array in ("vertices_m", "triangles", "element_of_triangle"):
        assert getattr(again, array).tobytes() == getattr(scene, array).tobytes(), array
    assert (again.elements, again.report) == (scene.elements, scene.report)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "file_format", "unit", "metres", "up", "schema"),
    [
        ("house.obj", "obj", "metre", 1.0, "Z", ""),
        ("little.ply", "ply", "metre", 1.0, "Z", ""),
        ("binary.stl", "stl", "metre", 1.0, "Z", ""),
        ("house.glb", "gltf", "metre", 1.0, "Y", "glTF 2.0"),
        ("house.usda", "usd", "centimetre", 0.01, "Y", "USD"),
        ("two.ifc", "ifc", "millimetre", 0.001, "Z", "IFC2X3"),
        ("four.ifc", "ifc", "millimetre", 0.001, "Z", "IFC4"),
    ],
)
def test_source_says_what_the_file_says(tmp_path, write_house, name, file_format, unit, metres, up, schema):
    path = write_house(tmp_path, name)
    source = load_scene(path).source
    assert (source.format, source.unit_name, source.metres_per_unit, source.up_axis, source.schema) == (
        file_format,
        unit,
        pytest.approx(metres),
        up,
        schema,
    )
    assert source.path == path
    assert source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["house.obj", "house.glb", "house.usda", "four.ifc"])
def test_unit_option_replaces_the_unit_of_the_file(tmp_path, write_house, name):
    path = write_house(tmp_path, name)
    as_told = load_scene(path)
    in_inches = load_scene(path, options=LoadOptions(metres_per_unit=0.0254))
    factor = 0.0254 / as_told.source.metres_per_unit
    centred = [s.vertices_m + s.offset_m for s in (as_told, in_inches)]
    np.testing.assert_allclose(centred[1], centred[0] * factor, rtol=1e-12, atol=1e-9)
    assert in_inches.source.unit_name == "inch"
    assert in_inches.source.metres_per_unit == 0.0254


def test_storeys_scale_with_the_unit_option(tmp_path, write_building):
    path = tmp_path / "building.ifc"
    write_building(path)
    scene = load_scene(path, options=LoadOptions(metres_per_unit=0.0005))
    assert [s.elevation_m for s in scene.storeys] == pytest.approx([0.0, 1.5])


def test_up_option_turns_the_scene(tmp_path, write_house, house, triangle_set):
    scene = load_scene(write_house(tmp_path, "house.obj"), options=LoadOptions(up_axis="Y"))
    x, y, z = house.vertices.T
    expected = np.stack([x, -z, y], axis=1)
    np.testing.assert_allclose(
        triangle_set(scene.vertices_m, scene.triangles), triangle_set(expected, house.triangles), atol=1e-6
    )
    assert scene.source.up_axis == "Y"


def test_progress_begins_and_ends(tmp_path, write_house):
    events = []
    load_scene(write_house(tmp_path, "four.ifc"), progress=events.append)
    assert {e.stage for e in events} == {"load"}
    assert events[0].done == 0
    assert (events[-1].done, events[-1].total) == (1, 1)


# ------------------------------------------------------------------------------------------------ doubts
def scaled_obj(path: Path, house, factor: float, *, y_up: bool = False) -> Path:
    points = house.vertices * factor
    if y_up:
        points = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    lines = ["v {!r} {!r} {!r}".format(*map(float, p)) for p in points]
    lines += ["f {} {} {}".format(*(t + 1)) for t in house.triangles]
    path.write_text("\n".join(lines))
    return path


def test_y_up_file_without_axes_is_warned_about_by_option(tmp_path, house):
    warnings = load_scene(scaled_obj(tmp_path / "a.obj", house, 1.0, y_up=True)).report.warnings
    assert len(warnings) == 1
    assert "--up y" in warnings[0]
    assert "a.obj" in warnings[0]


def test_y_up_warning_ends_when_the_user_says_the_axis(tmp_path, house):
    path = scaled_obj(tmp_path / "a.obj", house, 1.0, y_up=True)
    assert load_scene(path, options=LoadOptions(up_axis="Y")).report.warnings == ()
    assert load_scene(path, options=LoadOptions(up_axis="Z")).report.warnings == ()


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "--units mm"), (0.001, "--units")])
def test_implausible_size_is_warned_about_by_option(tmp_path, house, factor, unit):
    warnings = [w for w in load_scene(scaled_obj(tmp_path / "a.obj", house, factor)).report.warnings if "--units" in w]
    assert len(warnings) == 1
    assert unit in warnings[0]


def test_stray_face_does_not_put_the_unit_in_doubt(tmp_path, house):
    path = scaled_obj(tmp_path / "a.obj", house, 1.0)
    path.write_text(path.read_text() + "\nv 3000 0 0\nv 3001 0 0\nv 3000 1 0\nf -1 -2 -3\n")
    scene = load_scene(path)
    assert scene.n_triangles == 49
    assert scene.report.warnings == ()


def test_size_warning_ends_when_the_user_says_the_unit(tmp_path, house):
    path = scaled_obj(tmp_path / "a.obj", house, 1000.0)
    assert load_scene(path, options=LoadOptions(metres_per_unit=0.001)).report.warnings == ()


@pytest.mark.parametrize("metres", [0.0, float("nan")])
def test_unit_that_makes_no_sense_is_refused(metres):
    with pytest.raises(SceneError, match="metres per unit"):
        LoadOptions(metres_per_unit=metres)


def test_axis_that_makes_no_sense_is_refused():
    with pytest.raises(SceneError, match="upward axis: got 'x', expected one of Y, Z"):
        LoadOptions(up_axis="x")


@pytest.mark.slow
def test_mesh_formats_load_without_the_heavy_packages(tmp_path, write_house):
    path = write_house(tmp_path, "house.obj")
    program = (
        "import sys; from pathlib import Path; from planner_core.scene.load import load_scene;"
        f"load_scene(Path({str(path)!r}));"
        "heavy = {'ifcopenshell', 'pxr', 'trimesh', 'open3d', 'scipy', 'pyopencl'} & set(sys.modules);"
        "sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
