"""Synthetic scenes as OpenUSD: an Xform a storey, a Mesh a part; metres and z up, unless its frame has others.

A Mesh carries `tlsplan:name`, `tlsplan:kind` and, where it has one, `tlsplan:material`; its prim's name is the part's
with signs replaced by underscores.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from scenes_synthetic.model import FileFrame, Part, SyntheticScene


def write_usd(synthetic: SyntheticScene, path: Path) -> None:
    """Write the stage to `path`, whose extension means text (`.usda`) or binary (`.usd`, `.usdc`)."""
    stage = Usd.Stage.CreateInMemory()
    frame = synthetic.frame
    UsdGeom.SetStageUpAxis(stage, frame.up_axis)
    UsdGeom.SetStageMetersPerUnit(stage, frame.metres_per_unit)
    root = UsdGeom.Xform.Define(stage, f"/{_prim_name(synthetic.name)}")
    stage.SetDefaultPrim(root.GetPrim())
    if any(frame.offset_m):
        # Points are 32 bits wide; the way to a far origin goes into the double matrix above them.
        (origin,) = frame.coordinates(np.zeros((1, 3))).tolist()
        root.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*origin))
    near = replace(frame, offset_m=(0.0, 0.0, 0.0))
    for index, (name, _) in enumerate(synthetic.truth.storeys):
        storey = root.GetPath().AppendChild(_prim_name(name))
        UsdGeom.Xform.Define(stage, storey)
        for part in synthetic.parts:
            if part.storey == index:
                _define_mesh(stage, storey, part, near)
    _export(stage, path)


def write_group(name: str, parts: Iterable[Part], path: Path) -> None:
    """Write one layer of a stage in layers: an Xform with a Mesh a part, in metres and z up."""
    stage = _metric_stage()
    root = UsdGeom.Xform.Define(stage, f"/{_prim_name(name)}")
    stage.SetDefaultPrim(root.GetPrim())
    for part in parts:
        _define_mesh(stage, root.GetPath(), part, FileFrame())
    _export(stage, path)


def write_root(name: str, layers: Mapping[str, str], path: Path) -> None:
    """Write the layer that has the others as payloads.

    layers : by the name of each group, its layer's path from `path`.
    """
    # With nothing loaded, the stage does not look for layers that do not lie at their place yet.
    stage = _metric_stage(Usd.Stage.LoadNone)
    root = UsdGeom.Xform.Define(stage, f"/{_prim_name(name)}")
    stage.SetDefaultPrim(root.GetPrim())
    for group, layer in layers.items():
        prim = UsdGeom.Xform.Define(stage, root.GetPath().AppendChild(_prim_name(group))).GetPrim()
        prim.GetPayloads().AddPayload(f"./{layer}")
    _export(stage, path)


def _metric_stage(load: Usd.Stage.InitialLoadSet = Usd.Stage.LoadAll) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory(load)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    return stage


def _export(stage: Usd.Stage, path: Path) -> None:
    if not stage.GetRootLayer().Export(str(path)):
        raise OSError(f"{path}: usd-core could not write the stage")


def _define_mesh(stage: Usd.Stage, parent: Sdf.Path, part: Part, frame: FileFrame) -> None:
    mesh = UsdGeom.Mesh.Define(stage, parent.AppendChild(_prim_name(part.name)))
    solid = part.solid
    points = frame.coordinates(solid.vertices_m).astype(np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(solid.triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(solid.triangles.ravel()))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    for key, value in (("name", part.name), ("kind", part.kind), ("material", part.material)):
        if not value:
            continue
        mesh.GetPrim().CreateAttribute(f"tlsplan:{key}", Sdf.ValueTypeNames.String, custom=True).Set(value)


def _prim_name(name: str) -> str:
    return re.sub(r"\W", "_", name)
