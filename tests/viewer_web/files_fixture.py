"""Writes a stage of several files as docs/formats/stage.md has it, a triangle an element: `python ... OUT FILE...`.

An argument `NAME=ELEMENTS` is a file; none: a scene of one file, of two elements.
"""

import sys
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

TYPES = Sdf.ValueTypeNames


def write_stage(path: Path, files: list[tuple[str, int]]) -> None:
    """Write it; the test in viewer_web/src/load/stage.test.ts reads it."""
    stage = Usd.Stage.CreateNew(str(path))
    plan = UsdGeom.Xform.Define(stage, "/Plan").GetPrim()
    for axis in "XYZ":
        plan.CreateAttribute(f"tlsplan:offset{axis}", TYPES.Double).Set(0.0)
    UsdGeom.Xform.Define(stage, "/Plan/Building")
    index = 0
    for number, (name, n_elements) in enumerate(files or [("", 2)]):
        folder = f"/Plan/Building/File_{number}_{name.replace('.', '_')}" if files else "/Plan/Building"
        if files:
            prim = UsdGeom.Xform.Define(stage, folder).GetPrim()
            prim.CreateAttribute("tlsplan:file", TYPES.String).Set(name)
        for _ in range(n_elements):
            _add_mesh(stage, f"{folder}/Storey_0/Group_000/Wall_{index}", index, name)
            index += 1
    stage.GetRootLayer().Save()


def _add_mesh(stage: Usd.Stage, path: str, index: int, file: str) -> None:
    mesh = UsdGeom.Mesh.Define(stage, path)
    prim = mesh.GetPrim()
    mesh.CreatePointsAttr([(0, 0, index), (1, 0, index), (0, 1, index)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    told = {
        "name": f"Wall {index}",
        "kind": "IfcWall",
        "sourceId": f"id-{index}",
        "floor": "",
        **({"file": file} if file else {}),
    }
    for name, text in told.items():
        prim.CreateAttribute(f"tlsplan:{name}", TYPES.String).Set(text)
    prim.CreateAttribute("tlsplan:element", TYPES.Int).Set(index)
    for name in ("firstPatch", "patchDepth", "floorIndex"):
        primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(f"tlsplan:{name}", TYPES.IntArray, UsdGeom.Tokens.uniform)
        primvar.Set([0])


if __name__ == "__main__":
    named = [argument.rsplit("=", 1) for argument in sys.argv[2:]]
    write_stage(Path(sys.argv[1]), [(name, int(n_elements)) for name, n_elements in named])
