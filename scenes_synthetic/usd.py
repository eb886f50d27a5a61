"""Synthetic scenes as OpenUSD: an Xform a storey, a Mesh a part; metres, z up.

A Mesh carries `tlsplan:name` and `tlsplan:kind`; its prim's name is the part's with signs replaced by underscores.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, Vt

from scenes_synthetic.model import Part, SyntheticScene


def write_usd(synthetic: SyntheticScene, path: Path) -> None:
    """Write the stage to `path`, whose extension says text (`.usda`) or binary (`.usd`, `.usdc`)."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, f"/{_prim_name(synthetic.name)}")
    stage.SetDefaultPrim(root.GetPrim())
    for index, (name, _) in enumerate(synthetic.truth.storeys):
        storey = root.GetPath().AppendChild(_prim_name(name))
        UsdGeom.Xform.Define(stage, storey)
        for part in synthetic.parts:
            if part.storey == index:
                _define_mesh(stage, storey, part)
    if not stage.GetRootLayer().Export(str(path)):
        raise OSError(f"{path}: usd-core could not write the stage")


def _define_mesh(stage: Usd.Stage, parent: Sdf.Path, part: Part) -> None:
    mesh = UsdGeom.Mesh.Define(stage, parent.AppendChild(_prim_name(part.name)))
    solid = part.solid
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(solid.vertices_m.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(solid.triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(solid.triangles.ravel()))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(solid.bounds_m.astype(np.float32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    for key, value in (("name", part.name), ("kind", part.kind)):
        mesh.GetPrim().CreateAttribute(f"tlsplan:{key}", Sdf.ValueTypeNames.String, custom=True).Set(value)


def _prim_name(name: str) -> str:
    return re.sub(r"\W", "_", name)
