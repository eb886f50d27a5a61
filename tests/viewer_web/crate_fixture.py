"""Writes a small USD crate file with every kind of value the viewer reads, for the reader's tests: `python ... OUT`."""

import sys
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom

N_FACES = 40


def write_stage(path: Path) -> None:
    """Write the stage; the test in viewer_web/src/load/crate.test.ts holds the same values."""
    stage = Usd.Stage.CreateNew(str(path))
    plan = UsdGeom.Xform.Define(stage, "/Plan").GetPrim()
    plan.CreateAttribute("tlsplan:offset", Sdf.ValueTypeNames.Double3).Set(Gf.Vec3d(5e5 + 0.1, 5.4e6, 12))
    plan.CreateAttribute("small:offset", Sdf.ValueTypeNames.Double3).Set(Gf.Vec3d(1, -2, 3))
    plan.CreateAttribute("tlsplan:offsetX", Sdf.ValueTypeNames.Double).Set(500000.1)
    plan.CreateAttribute("tlsplan:half", Sdf.ValueTypeNames.Double).Set(0.5)
    for parent in ("/Plan/Empty", "/Plan/Building/Storey_0/Group_0"):
        UsdGeom.Xform.Define(stage, parent)
    for index in range(3):
        mesh = UsdGeom.Mesh.Define(stage, f"/Plan/Building/Storey_0/Group_0/Wall_{index}")
        _fill_mesh(mesh, index)
    stage.GetRootLayer().Save()


def _fill_mesh(mesh: UsdGeom.Mesh, index: int) -> None:
    prim = mesh.GetPrim()
    mesh.CreatePointsAttr([(0.1 * i, float(index), -1.5 * i) for i in range(N_FACES)])
    mesh.CreateFaceVertexCountsAttr([3] * N_FACES)
    mesh.CreateFaceVertexIndicesAttr([(7 * i) % N_FACES for i in range(3 * N_FACES)])
    matrix = Gf.Matrix4d(1) if index == 0 else Gf.Matrix4d().SetTranslate(Gf.Vec3d(0.25, 1e-9, index))
    mesh.AddTransformOp().Set(matrix)
    prim.CreateAttribute("tlsplan:name", Sdf.ValueTypeNames.String).Set(f"Außenwand {index}")
    prim.CreateAttribute("tlsplan:floor", Sdf.ValueTypeNames.String).Set("")
    prim.CreateAttribute("tlsplan:kind", Sdf.ValueTypeNames.Token).Set("IfcWall")
    prim.CreateAttribute("tlsplan:element", Sdf.ValueTypeNames.Int).Set(index - 1)
    primvars = UsdGeom.PrimvarsAPI(prim)
    integers, floats, uniform = Sdf.ValueTypeNames.IntArray, Sdf.ValueTypeNames.FloatArray, UsdGeom.Tokens.uniform
    values = {
        "large": (integers, [(1 << 30) + 1000003 * i if i % 2 else -i for i in range(N_FACES)]),
        "steps": (integers, [300 * i * (-1) ** i for i in range(N_FACES)]),
        "same": (integers, [7] * N_FACES),
        "short": (integers, [3, -1, 2]),
        "empty": (integers, []),
        "whole": (floats, [float(i - 3) for i in range(N_FACES)]),
        "few": (floats, [(0.1, 0.7, -1.0)[i % 3] for i in range(N_FACES)]),
        "many": (floats, [0.1 * i * i for i in range(N_FACES)]),
    }
    for name, (kind, numbers) in values.items():
        primvars.CreatePrimvar(f"tlsplan:{name}", kind, uniform).Set(numbers)


if __name__ == "__main__":
    write_stage(Path(sys.argv[1]))
