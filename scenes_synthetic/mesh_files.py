"""Synthetic scenes as OBJ (text, an object a part), PLY (binary, double) and STL (binary, float32).

Metres and z up, unless the scene's `FileFrame` has others.
"""

from __future__ import annotations

import struct

import numpy as np

from planner_core.errors import RequirementError
from scenes_synthetic.model import SyntheticScene


def obj_bytes(synthetic: SyntheticScene) -> bytes:
    """Wavefront OBJ: `o` names each part; coordinates have six decimals, which is all that they have.

    Materials are names alone, by `usemtl`: a scene is one file, and a library would be a second. What has none is
    `opaque` where others have one, as a name holds until the next.
    """
    lines = [f"# tlsplan synthetic scene {synthetic.name}: {synthetic.frame.title}"]
    first = 1
    material = ""
    for part in synthetic.parts:
        lines.append(f"o {part.name}")
        if part.material != material:
            material = part.material
            lines.append(f"usemtl {material or 'opaque'}")
        lines += [
            f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in synthetic.frame.coordinates(part.solid.vertices_m).tolist()
        ]
        lines += [f"f {a} {b} {c}" for a, b, c in (part.solid.triangles + first).tolist()]
        first += len(part.solid.vertices_m)
    return ("\n".join(lines) + "\n").encode("ascii")


def ply_bytes(synthetic: SyntheticScene) -> bytes:
    """PLY 1.0, binary little endian: all parts as one mesh with double coordinates."""
    scene = synthetic.scene
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"comment tlsplan synthetic scene {synthetic.name}: {synthetic.frame.title}\n"
        f"element vertex {len(scene.vertices_m)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {scene.n_triangles}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(scene.n_triangles, dtype=[("count", "u1"), ("vertex", "<i4", (3,))])
    faces["count"] = 3
    faces["vertex"] = scene.triangles
    return (
        header.encode("ascii") + synthetic.frame.coordinates(scene.vertices_m).astype("<f8").tobytes() + faces.tobytes()
    )


def stl_bytes(synthetic: SyntheticScene) -> bytes:
    """STL, binary: all parts as one list of triangles, rounded to float32 (0.5 micrometres at 10 m).

    Raises RequirementError for a scene far from the origin: at 5 400 km, float32 steps are half a metre.
    """
    far_m = max(synthetic.frame.offset_m)
    if far_m:
        raise RequirementError(
            f"scene {synthetic.name}: its origin is at {far_m:.0f} m, where STL's 32-bit numbers "
            "are half a metre apart; write it as ifc, obj, ply, glb or usd."
        )
    scene = synthetic.scene
    corners = synthetic.frame.coordinates(scene.vertices_m)[scene.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0, length, 1.0)  # a face without area has no normal: zero, as the format has it
    record = np.zeros(
        scene.n_triangles, dtype=[("normal", "<f4", (3,)), ("corner", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    record["normal"], record["corner"] = normal, corners
    # The header must not begin with "solid": readers would take the file for text.
    header = f"tlsplan synthetic scene {synthetic.name}: {synthetic.frame.title}".encode("ascii").ljust(80)
    return header + struct.pack("<I", scene.n_triangles) + record.tobytes()
