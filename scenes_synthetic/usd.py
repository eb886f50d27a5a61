"""Synthetic scenes as OpenUSD: an Xform a storey, a Mesh a part; metres and z up, unless its frame says otherwise.

A Mesh carries `tlsplan:name`, `tlsplan:kind` and, where it has one, `tlsplan:material`; its prim's name is the part's
with signs replaced by underscores.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from scenes_synthetic.model import FileFrame, Part, SyntheticScene


def write_usd(synthetic: SyntheticScene, path: Path) -> None:
    """Write the stage to `path`, whose extension says text (`.usda`) or binary (`.usd`, `.usdc`)."""
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
