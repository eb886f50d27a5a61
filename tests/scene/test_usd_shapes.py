"""USD's basic shapes have the areas, volumes and places that geometry gives them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.scene.load import load_scene
from planner_core.scene.usd_shapes import DEVIATION_M


@pytest.fixture
def stage(tmp_path):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    return stage


def load_stage(stage):
    stage.Save()
    return load_scene(stage.GetRootLayer().realPath)


def define(stage, kind: str, path: str = "/shape", **attributes):
    from pxr import UsdGeom

    shape = getattr(UsdGeom, kind).Define(stage, path)
    for name, value in attributes.items():
        shape.GetPrim().GetAttribute(name).Set(value)
    return shape


def corners_of(scene, element: int = 0):
    return scene.vertices_m[scene.triangles[scene.element_of_triangle == element]] + scene.offset_m


def area_m2(corners) -> float:
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


def volume_m3(corners) -> float:
    """Positive where triangles run counter-clockwise seen from outside."""
    return float(np.einsum("ij,ij->i", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]).sum() / 6)


ROUND = [
    ("Sphere", {"radius": 1.5}, 4 * math.pi * 1.5**2, 4 / 3 * math.pi * 1.5**3, (1.5, 1.5, 1.5)),
    ("Cylinder", {"radius": 0.5, "height": 3.0}, math.pi * (3.0 + 0.5), math.pi * 0.25 * 3, (0.5, 0.5, 1.5)),
    (
        "Cylinder_1",
        {"radiusBottom": 1.0, "radiusTop": 0.0, "height": 2.0},
        math.pi * (1 + math.sqrt(5)),
        math.pi * 2 / 3,
        (1, 1, 1),
    ),
    ("Cone", {"radius": 1.0, "height": 2.0}, math.pi * (1 + math.sqrt(5)), math.pi * 2 / 3, (1, 1, 1)),
    ("Capsule", {"radius": 0.5, "height": 2.0}, 3 * math.pi, math.pi * (0.5 + 1 / 6), (0.5, 0.5, 1.5)),
]
"""Kind, sizes, area, volume, and half its box with the axis along z."""


@pytest.mark.parametrize(("kind", "sizes", "area", "volume", "half"), ROUND)
@pytest.mark.parametrize("axis", "XYZ")
def test_round_shape_has_its_area_its_volume_and_its_box(stage, kind, sizes, area, volume, half, axis):
    define(stage, kind, **sizes, **({} if kind == "Sphere" else {"axis": axis}))
    corners = corners_of(load_stage(stage))
    assert 0.995 * area < area_m2(corners) < area
    assert 0.995 * volume < volume_m3(corners) < volume
    half = np.roll(half, "XYZ".index(axis) - 2)
    assert np.allclose(corners.max(axis=(0, 1)), half, atol=2 * DEVIATION_M)
    assert np.allclose(corners.min(axis=(0, 1)), -half, atol=2 * DEVIATION_M)


@pytest.mark.parametrize(("radius", "unit_m", "scale"), [(0.15, 1.0, 1.0), (15.0, 0.01, 1.0), (0.15, 0.01, 100.0)])
def test_chords_stay_within_the_deviation_whatever_the_unit(stage, radius, unit_m, scale):
    """One column of 15 cm in three ways. Oracle: the middle of every edge of its upper rim."""
    from pxr import UsdGeom

    UsdGeom.SetStageMetersPerUnit(stage, unit_m)
    define(stage, "Cylinder", radius=radius, height=radius).AddScaleOp().Set((scale, scale, scale))
    corners = corners_of(load_stage(stage))
    on_rim = np.isclose(np.hypot(*np.moveaxis(corners[..., :2], -1, 0)), 0.15)
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)[on_rim & np.roll(on_rim, -1, axis=1)]
    level = np.isclose(edges[:, 0, 2], edges[:, 1, 2])
    middle = edges[level].mean(axis=1)
    gap = 0.15 - np.hypot(middle[:, 0], middle[:, 1])
    assert DEVIATION_M / 4 < gap.max() <= DEVIATION_M


def test_cube_is_placed_scaled_and_exact(stage):
    """As RoomPlan writes a wall: a cube, scaled, turned by a quarter and moved."""
    cube = define(stage, "Cube", size=1.0)
    cube.AddTranslateOp().Set((10, 0, 1.25))
    cube.AddRotateZOp().Set(90)
    cube.AddScaleOp().Set((4, 0.25, 2.5))
    corners = corners_of(load_stage(stage))
    assert len(corners) == 12
    assert area_m2(corners) == pytest.approx(2 * (4 * 0.25 + 4 * 2.5 + 0.25 * 2.5))
    assert volume_m3(corners - corners.mean(axis=(0, 1))) == pytest.approx(2.5)
    assert np.allclose(corners.min(axis=(0, 1)), [9.875, -2, 0], atol=1e-6)


@pytest.mark.parametrize(("axis", "half"), [("X", (0, 1.5, 1)), ("Y", (1, 0, 1.5)), ("Z", (1, 1.5, 0))])
def test_plane_faces_along_its_axis(stage, axis, half):
    define(stage, "Plane", width=2.0, length=3.0, axis=axis)
    define(stage, "Cube", "/far").AddTranslateOp().Set((9, 9, 9))
    corners = corners_of(load_stage(stage))
    assert np.allclose(corners.max(axis=(0, 1)), half)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0) / 2
    assert np.allclose(normal, 6.0 * np.eye(3)["XYZ".index(axis)])


def test_left_handed_and_mirrored_shapes_face_outwards_only_when_both(stage):
    for i, (hand, sign) in enumerate([("rightHanded", 1), ("leftHanded", 1), ("rightHanded", -1), ("leftHanded", -1)]):
        cube = define(stage, "Cube", f"/cube{i}", size=1.0, orientation=hand)
        cube.AddTranslateOp().Set((3.0 * i, 0, 0))
        cube.AddScaleOp().Set((sign, 1, 1))
    scene = load_stage(stage)
    volumes = [volume_m3(corners_of(scene, i) - [3.0 * i, 0, 0]) for i in range(4)]
    assert volumes == pytest.approx([1, -1, 1, -1])


def test_shapes_in_referenced_and_sublayered_files_beside_are_read(stage, tmp_path):
    """As RoomPlan exports a scan: a root that refers to a file an object, in folders beside it."""
    from pxr import Usd, UsdGeom

    (tmp_path / "parts").mkdir()
    part = Usd.Stage.CreateNew(str(tmp_path / "parts" / "wall.usda"))
    part.SetDefaultPrim(UsdGeom.Xform.Define(part, "/Wall").GetPrim())
    define(part, "Cube", "/Wall/body", size=2.0)
    part.Save()
    under = Usd.Stage.CreateNew(str(tmp_path / "parts" / "under.usda"))
    define(under, "Cylinder", "/post", radius=1.0, height=1.0).AddTranslateOp().Set((0, 20, 0))
    under.Save()
    for i in range(2):
        wall = UsdGeom.Xform.Define(stage, f"/wall{i}")
        wall.AddTranslateOp().Set((5.0 * i, 0, 0))
        wall.GetPrim().GetReferences().AddReference("./parts/wall.usda")
        wall.GetPrim().SetInstanceable(True)
    stage.GetRootLayer().subLayerPaths.append("./parts/under.usda")
    scene = load_stage(stage)
    assert sorted(element.name for element in scene.elements) == ["/post", "/wall0/body", "/wall1/body"]
    assert {element.kind for element in scene.elements} == {"Cube", "Cylinder"}
    number = {element.name: i for i, element in enumerate(scene.elements)}
    assert area_m2(corners_of(scene, number["/wall1/body"])) == pytest.approx(24)


@pytest.mark.parametrize(
    ("kind", "name", "value", "expected"),
    [
        ("Cube", "size", -1.0, "its size is -1.0, expected 0 or more"),
        ("Sphere", "radius", math.nan, "its radius is nan, expected 0 or more"),
        ("Cone", "height", math.inf, "its height is inf, expected 0 or more"),
        ("Plane", "axis", "W", "its axis is W, expected X, Y or Z"),
    ],
)
def test_size_that_is_none_is_refused(stage, kind, name, value, expected):
    define(stage, kind, **{name: value})
    with pytest.raises(SceneError, match="prim /shape") as caught:
        load_stage(stage)
    assert expected in str(caught.value)
