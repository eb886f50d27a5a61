"""Synthetic scenes as binary glTF 2.0: a node with its own mesh a part; metres, y up as glTF demands, float32.

A part's material is glTF's way of saying it, glass by KHR_materials_transmission and a mirror by a smooth metal, and
`extras.material` of its node. A far origin is the double translation of a root node.

Format: Khronos glTF 2.0 specification, section 4.4 (GLB): a 12-byte header, a JSON chunk, a binary chunk, each chunk
padded to 4 bytes.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from scenes_synthetic.model import SyntheticScene
from scenes_synthetic.solids import Solid

_FLOAT, _UNSIGNED_INT, _TRIANGLES = 5126, 5125, 4
_TRANSMISSION = "KHR_materials_transmission"
_MATERIALS: dict[str, dict[str, Any]] = {
    "glass": {
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {_TRANSMISSION: {"transmissionFactor": 1.0}},
    },
    "mirror": {"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}},
}
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963


def glb_bytes(synthetic: SyntheticScene) -> bytes:
    """Return the scene as one GLB file; the IFC class of a part is its node's `extras.kind`."""
    binary = bytearray()
    tree: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "tlsplan scenes_synthetic"},
        "scene": 0,
        "scenes": [{"name": synthetic.name, "nodes": list(range(len(synthetic.parts)))}],
        "nodes": [],
        "meshes": [],
        "accessors": [],
        "bufferViews": [],
    }
    for index, part in enumerate(synthetic.parts):
        extras = {"kind": part.kind}
        primitive = _primitive(part.solid, tree, binary)
        if part.material:
            extras["material"] = part.material
            primitive["material"] = _material(part.material, tree)
        tree["nodes"].append({"name": part.name, "mesh": index, "extras": extras})
        tree["meshes"].append({"name": part.name, "primitives": [primitive]})
    if any(synthetic.frame.offset_m):
        x, y, z = synthetic.frame.offset_m
        children = list(range(len(synthetic.parts)))
        tree["nodes"].append({"name": "Origin", "translation": [x, z, -y], "children": children})
        tree["scenes"][0]["nodes"] = [len(synthetic.parts)]
    tree["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(tree, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _material(name: str, tree: dict[str, Any]) -> int:
    """Index of a material, described where it is used first."""
    materials = tree.setdefault("materials", [])
    names = [material["name"] for material in materials]
    if name not in names:
        materials.append({"name": name, **_MATERIALS[name]})
        if "extensions" in _MATERIALS[name]:
            tree["extensionsUsed"] = [_TRANSMISSION]
        return len(names)
    return names.index(name)


def _primitive(solid: Solid, tree: dict[str, Any], binary: bytearray) -> dict[str, Any]:
    """Append a solid's arrays to the buffer and describe them; every array is a multiple of 4 bytes long."""
    x, y, z = solid.vertices_m.T
    points = np.stack([x, z, -y], axis=1).astype("<f4")  # z up to y up: a quarter turn about x
    indices = solid.triangles.astype("<u4").ravel()
    accessor = len(tree["accessors"])
    bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    for array, target, layout in (
        (points, _ARRAY_BUFFER, {"componentType": _FLOAT, "count": len(points), "type": "VEC3", **bounds}),
        (indices, _ELEMENT_ARRAY_BUFFER, {"componentType": _UNSIGNED_INT, "count": len(indices), "type": "SCALAR"}),
    ):
        view = {"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes, "target": target}
        tree["accessors"].append({"bufferView": len(tree["bufferViews"]), **layout})
        tree["bufferViews"].append(view)
        binary += array.tobytes()
    return {"attributes": {"POSITION": accessor}, "indices": accessor + 1, "mode": _TRIANGLES}
