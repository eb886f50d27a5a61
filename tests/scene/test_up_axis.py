"""Which axis is up: models on their side are turned or doubted, upright ones left alone, in every format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import FloatArray, Int64Array, Scene
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.floors import find_floors
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.scene.up_axis import UpAxes, up_axis_doubt
from tests.reality_files import reality

Mesh = tuple[FloatArray, Int64Array]


def box(low: tuple[float, ...], high: tuple[float, ...]) -> Mesh:
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    faces += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    return np.array(low) + corners * (np.array(high) - np.array(low)), np.array(faces)


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(points) for points, _ in meshes)])
    return np.concatenate([m[0] for m in meshes]), np.concatenate(
        [faces + start for (_, faces), start in zip(meshes, starts, strict=False)]
    )


def tower() -> Mesh:
    """12 m x 10 m and 45 m high: 15 storeys without inner walls."""
    slabs = [box((0, 0, z - 0.2), (12, 10, z)) for z in range(0, 46, 3)]
    walls = [box((x, 0, 0), (x + 0.2, 10, 45)) for x in (0, 11.8)]
    return joined(*slabs, *walls, *(box((0, y, 0), (12, y + 0.2, 45)) for y in (0, 9.8)))


def cells() -> Mesh:
    """Two storeys of six rooms of 4 m x 4 m, all doors shut: what a hotel is."""
    slabs = [box((0, 0, z - 0.2), (12, 8, z)) for z in (0, 2.8, 5.6)]
    across = [box((x - 0.1, 0, 0), (x + 0.1, 8, 5.4)) for x in (0, 4, 8, 12)]
    return joined(*slabs, *across, *(box((0, y - 0.1, 0), (12, y + 0.1, 5.4)) for y in (0, 4, 8)))


def terrain() -> Mesh:
    """A hill of 60 m x 60 m, up to 9 m high, as one sheet."""
    n = 13
    x, y = np.meshgrid(np.arange(n) * 5.0, np.arange(n) * 5.0)
    points = np.stack([x, y, 4.5 - 4.5 * np.cos(x / 10) * np.sin(y / 12)], axis=2).reshape(-1, 3)
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel())
    return points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


BUILDINGS = {"tower": tower, "cells": cells}
OTHERS = {
    "wall": lambda: box((0, 0, 0), (10, 0.3, 3)),
    "terrain": terrain,
    "walls without slabs": lambda: joined(
        *(box((x, 0, 0), (x + 0.2, 9, 2.7)) for x in (0, 6, 12)),
        *(box((0, y, 0), (12, y + 0.2, 2.7)) for y in (0, 8.8)),
    ),
}


def lying(scene: Scene, way: str, read_as: str) -> Scene:
    """The upright scene as it comes out where a file of the other axis is read as `read_as`; turned about first."""
    x, y, z = scene.vertices_m.T
    if way == "turned":
        x, y = y, -x
    points = np.stack([x, z, -y] if read_as == "Z" else [x, -z, y], axis=1)
    return replace(
        scene, vertices_m=np.ascontiguousarray(points), source=replace(scene.source, up_axis=read_as), storeys=()
    )


def scene_of(name: str) -> Scene:
    made = (BUILDINGS | OTHERS).get(name)
    return scene_from_arrays(*made()) if made else scenes_synthetic.build(name).scene


def write_obj(path: Path, mesh: Mesh, up: str) -> None:
    points = mesh[0] if up == "z" else np.stack([mesh[0][:, 0], mesh[0][:, 2], -mesh[0][:, 1]], axis=1)
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1].tolist()]
    path.write_text("\n".join(lines) + "\n")


UPRIGHT = ("house", "box", "closed-rooms", "doors-shut", "stairwell", "atrium", "tunnel", "facade", "without-slabs")


@pytest.mark.parametrize("read_as", ["Z", "Y"])
@pytest.mark.parametrize("name", [*UPRIGHT, *BUILDINGS, *OTHERS])
def test_up_axis_of_upright_scenes_is_not_doubted(name, read_as):
    scene = scene_of(name)
    assert up_axis_doubt(UpAxes(replace(scene, source=replace(scene.source, up_axis=read_as)))) is None


@pytest.mark.slow
@pytest.mark.parametrize("read_as", ["Z", "Y"])
@pytest.mark.parametrize("way", ["straight", "turned"])
@pytest.mark.parametrize("name", ["house", "hole-walls", "atrium", "double-height-hall", "corridor-comb", "tower"])
def test_up_axis_of_a_building_on_its_side_is_the_other(name, way, read_as):
    doubt = up_axis_doubt(UpAxes(lying(scene_of(name), way, read_as)))
    assert doubt is not None
    assert doubt.is_certain, doubt
    assert doubt.other_m2 > doubt.read_m2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["box", "closed-rooms", "doors-shut", "cells"])
def test_up_axis_of_small_rooms_on_their_side_is_doubted(name):
    """Rooms as high as they are wide: not enough to turn the model over, and never nothing."""
    assert up_axis_doubt(UpAxes(lying(scene_of(name), "straight", "Z"))) is not None


def test_up_axis_of_an_empty_shaft_is_doubted_and_kept():
    """A shaft that stands and a hall that lies look the same."""
    doubt = up_axis_doubt(UpAxes(scene_from_arrays(*box((0, 0, 0), (10, 10, 40)))))
    assert doubt is not None
    assert not doubt.is_certain


@pytest.mark.slow
@pytest.mark.parametrize("up", ["y", "z"])
def test_up_axis_of_an_obj_is_found(tmp_path, up):
    write_obj(tmp_path / "tower.obj", tower(), up)
    scene = load_scene(tmp_path / "tower.obj")
    assert len(find_floors(scene).floors) == 15
    assert scene.source.up_axis == up.upper()
    warnings = scene.report.warnings
    if up == "z":
        assert warnings == ()
        return
    (warning,) = warnings
    assert warning.startswith("tower.obj states no up axis, but its largest ground in one piece is ")
    assert warning.endswith("it is read with y up; if z is up, pass --up z.")
    as_said = load_scene(tmp_path / "tower.obj", options=LoadOptions(up_axis="Z"))
    assert as_said.source.up_axis == "Z"
    assert as_said.report.warnings == ()


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["ply", "stl", "glb"])
def test_up_axis_of_meshes_of_other_formats_is_found(tmp_path, ending):
    """PLY and STL of phones are y up; glTF that no exporter turned is z up."""
    import trimesh

    points, faces = tower()
    if ending != "glb":
        points = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    path = tmp_path / f"tower.{ending}"
    trimesh.Trimesh(points, faces, process=False).export(path)
    scene = load_scene(path)
    assert scene.source.up_axis == ("Z" if ending == "glb" else "Y")
    assert np.ptp(scene.vertices_m, axis=0) == pytest.approx([12, 10, 45.2], abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "unit_m", "words"),
    [
        ("cells", 0.0254, "rooms 102 m high"),
        ("tower", 0.0254, "rooms 55 m high"),
    ],
)
def test_unit_of_rooms_without_measure_is_doubted(tmp_path, name, unit_m, words):
    """A house in inches is 470 units long, as a large building is in metres; no room is 100 m high."""
    points, faces = BUILDINGS[name]()
    path = tmp_path / "building.obj"
    write_obj(path, (0.5 * points / unit_m if name == "tower" else points / unit_m, faces), "z")
    warnings = load_scene(path).report.warnings
    assert any(words in each and "--units in" in each for each in warnings), warnings
    assert not any("--units" in each for each in load_scene(path, options=LoadOptions(unit_m)).report.warnings)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "up_axis", "n_floors", "n_warnings"),
    [
        ("flat_y_up.obj", "Y", 1, 1),
        ("flat_z_up.obj", "Z", 1, 0),
        ("museito_reduced.glb", "Z", 1, 1),
        ("ramp_corridor.obj", "Z", 1, 0),
        ("interior_shell.obj", "Z", 1, 0),
        ("gallery_reduced.glb", "Y", 1, 0),
    ],
)
def test_up_axis_of_real_meshes(name, up_axis, n_floors, n_warnings):
    path = reality(name)
    scene = load_scene(path)
    assert scene.source.up_axis == up_axis
    assert len(find_floors(scene).floors) == n_floors
    assert len(scene.report.warnings) == n_warnings
