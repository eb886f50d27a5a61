"""The building of a plan folder, from the stage that its viewer loads. viewer/ -> Scene, Patches, figures by patch.

The sheets need no scene file: geometry, patches and what became of them are all in the plan folder. Frame of `scene`:
local, as everywhere; `scene.offset_m` leads to the scene frame. Geometry is float32, as the stage holds it.

A child process reads the stage: plan folders are passed on, and the USD library crashes on some damaged files.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core import child_process
from planner_core.child_process import LostChildError, limits_for
from planner_core.errors import ExportError, one_line
from planner_core.model import (
    BoolArray,
    Element,
    FloatArray,
    Floor,
    Int32Array,
    LoadReport,
    Patches,
    Scene,
    SceneSource,
    UInt8Array,
)
from planner_core.model.arrays import area_normals
from planner_core.model.unseen import OUT_OF_SCOPE
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.viewer_layers import NONE, NOT_ACHIEVABLE
from planner_core.progress import silent

STAGE_FILE = "viewer/stage.usdc"


@dataclass(frozen=True, eq=False)
class Building:
    """What sheets show of a building.

    element_numbers : (E,) int32, of `scene.elements`, as plan.json counts them: here are only those with triangles.
    ground_of_triangle : (T,) int32, number of the floor whose ground a triangle is, from 0; -1 where it is none.
    times_seen : (P,) int32, stations that see each patch, 254 for more. achievable : (P,) bool, some candidate sees it.
    required : (P,) bool, it is to be covered; of plans that do not say, all.
    """

    scene: Scene
    patches: Patches
    ground_of_triangle: Int32Array
    times_seen: Int32Array
    achievable: BoolArray
    required: BoolArray
    element_numbers: Int32Array

    def ground_m(self, number: int) -> FloatArray:
        """(K, 3, 2) ground of the floor of that number, scene frame."""
        ground = self.scene.triangles[self.ground_of_triangle == number]
        return np.asarray(self.scene.vertices_m[ground, :2] + self.scene.offset_m[:2])

    def local_floor(self, plan: PlanSource, floor: FloorSection) -> Floor:
        """A floor of the plan in the local frame, with its ground."""
        number = next(index for index, each in enumerate(plan.floors) if each.id == floor.id)
        ground = np.flatnonzero(self.ground_of_triangle == number).astype(np.int32)
        area_m2 = float(self.patches.triangle_area_m2[ground].sum())
        elevation_m = floor.elevation_m - float(self.scene.offset_m[2])
        bounds_m = np.array(floor.bounds) - self.scene.offset_m[:2]
        return Floor(floor.id, floor.name, elevation_m, area_m2, ground, bounds_m, "surface")


def building_of(plan: PlanSource) -> Building | str:
    """Read the building of a plan, once for all formats. Raises as `read_building`."""
    return plan.once("building", lambda: read_building(plan.folder))


def read_building(folder: Path) -> Building | str:
    """Read the building of a plan folder, or say in one line why it can't be drawn.

    Raises
    ------
    ExportError
        Its stage can't be read.
    """
    stage, seen = folder / STAGE_FILE, folder / "viewer" / "patches.u8"
    for path in (stage, seen):
        if not path.is_file():
            return f"{path.relative_to(folder)} is not in the plan folder: walls and unseen surface are not drawn"
    scene, patches, ground, numbers = _read_stage(stage)
    reason = folder / "viewer" / "reason.u8"
    seen_bytes = np.fromfile(seen, dtype=np.uint8)
    reasons = np.fromfile(reason, dtype=np.uint8) if reason.is_file() else np.zeros_like(seen_bytes)
    for path, values in ((seen, seen_bytes), (reason, reasons)):
        if values.size != patches.n_patches:
            return (
                f"{path.relative_to(folder)} has {values.size} patches, {STAGE_FILE} {patches.n_patches}: walls and "
                "unseen surface are not drawn; plan again"
            )
    achievable = seen_bytes != NOT_ACHIEVABLE
    times_seen = np.where(achievable, seen_bytes, 0).astype(np.int32)
    return Building(scene, patches, ground, times_seen, achievable, reasons != OUT_OF_SCOPE, numbers)


def read_figures(folder: Path, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Read layers of the viewer by their ids; those that the plan folder has not are left out.

    Returns
    -------
    dict of (P,) float64
        In the layer's unit, metres or degrees; NaN where no station sees the patch.

    Raises
    ------
    ExportError
        A file that is named is not there, or is no layer.
    """
    document = folder / "viewer" / "layers.json"
    if not document.is_file():
        return {}
    try:
        layers = {str(layer["id"]): layer for layer in json.loads(document.read_bytes())["layers"]}
        return {name: _figures(folder, layers[name]) for name in names if name in layers}
    except (KeyError, TypeError, ValueError, OSError) as error:
        raise ExportError(
            f"{document}: its layers can't be read ({type(error).__name__}: {error}), expected those of a plan folder; "
            "plan again"
        ) from error


def _figures(folder: Path, layer: dict[str, Any]) -> FloatArray:
    steps = np.fromfile(folder / "viewer" / str(layer["file"]), dtype="<u2")
    return np.where(steps == NONE, np.nan, steps * float(layer["step"]))


@dataclass(frozen=True, eq=False)
class _Mesh:
    element: Element
    number: int
    points_m: FloatArray
    corners: Int32Array
    triangle: Int32Array
    floor_number: Int32Array
    first_patch: Int32Array
    depth: UInt8Array


def _read_stage(path: Path) -> tuple[Scene, Patches, Int32Array, Int32Array]:
    """Scene, patches, the floor whose ground each triangle is, and the numbers of the elements."""
    try:
        meshes, offset_m = child_process.run_isolated(
            "planner_core.export.sheets.building:read_meshes",
            {"path": os.fspath(path)},
            classes=(_Mesh, Element),
            limits=limits_for(path.stat().st_size),
            stage="export",
            progress=silent,
        )
    except LostChildError as lost:
        at = f" at {one_line(lost.place)}" if lost.place else ""
        raise ExportError(f"{path}: the USD library {lost}{at}, expected a plan's stage; plan again") from lost
    numbers = np.array([mesh.number for mesh in meshes], dtype=np.int32)
    return *_joined(path, list(meshes), offset_m), numbers


def read_meshes(path: str) -> tuple[list[_Mesh], FloatArray]:
    """Read the meshes of a plan's stage, by their elements' numbers, and the scene's offset: what the child does."""
    from pxr import Tf, Usd, UsdGeom

    child_process.at("its layers")
    try:
        stage = Usd.Stage.Open(path)
        root = stage.GetPrimAtPath("/Plan")
        prims = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh) and prim.GetAttribute(_TRIANGLE)]
        if not prims or not root.HasAttribute("tlsplan:offsetX"):
            raise ExportError(f"{path}: holds no building of a plan, expected the stage that a plan wrote; plan again")
        meshes = sorted((_mesh(prim) for prim in prims), key=lambda mesh: mesh.number)
        offset_m = np.array([float(root.GetAttribute(f"tlsplan:offset{axis}").Get()) for axis in "XYZ"])
    except Tf.ErrorException as error:
        reason = str(error).strip().splitlines()[-1].strip()
        raise ExportError(f"{path}: can't be read as USD ({reason}), expected a plan's stage; plan again") from error
    except (TypeError, ValueError, UnicodeDecodeError, OverflowError) as error:  # values that are missing or others
        raise _damaged(path, str(error)) from error
    for mesh in meshes:
        n = len(mesh.corners)
        if not (
            {mesh.triangle.shape, mesh.floor_number.shape, mesh.first_patch.shape, mesh.depth.shape} == {(n,)}
            and (n == 0 or 0 <= mesh.corners.min() <= mesh.corners.max() < len(mesh.points_m))
            and mesh.depth.max(initial=0) <= _DEEPEST
        ):
            raise _damaged(path, f"{mesh.element.name}: figures by triangle, or corners, that do not fit")
    return meshes, offset_m


def _damaged(path: str, what: str) -> ExportError:
    return ExportError(f"{path}: is damaged ({what}), expected the stage that a plan wrote; plan again")


_TRIANGLE = "primvars:tlsplan:triangle"
_DEEPEST = 30
"""Halvings of a triangle: there is no patch number for more."""


def _mesh(prim: Any) -> _Mesh:
    child_process.at(str(prim.GetPath()))

    def numbers(name: str, kind: type[np.generic]) -> NDArray[Any]:
        return np.asarray(prim.GetAttribute(name).Get(), dtype=kind)

    def text(name: str) -> str:
        return str(prim.GetAttribute(name).Get() or "")

    element = Element(text("tlsplan:name"), text("tlsplan:kind"), text("tlsplan:sourceId"))
    return _Mesh(
        element=element,
        number=int(prim.GetAttribute("tlsplan:element").Get()),
        points_m=numbers("points", np.float64).reshape(-1, 3),
        corners=numbers("faceVertexIndices", np.int32).reshape(-1, 3),
        triangle=numbers(_TRIANGLE, np.int32),
        floor_number=numbers("primvars:tlsplan:floorIndex", np.int32),
        first_patch=numbers("primvars:tlsplan:firstPatch", np.int32),
        depth=numbers("primvars:tlsplan:patchDepth", np.uint8),
    )


def _joined(path: Path, meshes: list[_Mesh], offset_m: FloatArray) -> tuple[Scene, Patches, Int32Array]:
    """Put the meshes' triangles in the order of the scene's."""
    empty_floats, empty = np.zeros((0, 3)), np.zeros(0, dtype=np.int32)
    points_m = np.concatenate([empty_floats, *(mesh.points_m for mesh in meshes)])
    first = np.cumsum([0, *(len(mesh.points_m) for mesh in meshes)])
    corners = np.concatenate(
        [empty.reshape(0, 3), *(mesh.corners + at for mesh, at in zip(meshes, first[:-1].tolist(), strict=True))]
    )
    order = np.argsort(np.concatenate([empty, *(mesh.triangle for mesh in meshes)]), kind="stable")
    element = np.concatenate([empty, *(np.full(mesh.triangle.size, i) for i, mesh in enumerate(meshes))])[order]
    depth = np.concatenate([empty, *(mesh.depth for mesh in meshes)])[order].astype(np.uint8)
    ground = np.concatenate([empty, *(mesh.floor_number for mesh in meshes)])[order] - 1
    scene = Scene(
        source=SceneSource(path, "", "usd", "metre", 1.0, "Z"),
        vertices_m=points_m,
        triangles=corners[order].astype(np.int32),
        element_of_triangle=element.astype(np.int32),
        elements=tuple(mesh.element for mesh in meshes),
        storeys=(),
        offset_m=offset_m,
        report=LoadReport(n_faces_read=len(order)),
    )
    return scene, _patches(scene, depth), ground.astype(np.int32)


def _patches(scene: Scene, depth: UInt8Array) -> Patches:
    corners = scene.vertices_m[scene.triangles]
    cross = area_normals(corners)
    area_m2: FloatArray = 0.5 * np.linalg.norm(cross, axis=1)
    first = np.zeros(depth.size + 1, dtype=np.int32)
    first[1:] = np.cumsum(np.exp2(depth.astype(np.float64)).astype(np.int64))
    largest_m2 = float((area_m2 / np.exp2(depth.astype(np.float64))).max(initial=0.0))
    return Patches(max_area_m2=largest_m2, depth=depth, first_patch=first, triangle_area_m2=area_m2)
