"""Synthetic scenes as binary glTF 2.0: a node with its own mesh a part; metres, y up as glTF demands, float32.

A part's material is glTF's way of saying it, glass by KHR_materials_transmission and a mirror by a smooth metal, and
`extras.material` of its node. A far origin is the double translation of a root node.

Format: Khronos glTF 2.0 specification, section 4.4 (GLB): a 12-byte header, a JSON chunk, a binary chunk, each chunk
padded to 4 bytes.
"""

from __future__ import annotations

import io
import json
import shutil
import struct
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from scenes_synthetic.model import Part, SyntheticScene
from scenes_synthetic.solids import Point, Solid

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
    file = io.BytesIO()
    with io.BytesIO() as binary:
        writer = GlbWriter(binary)
        nodes = [writer.add_part(part) for part in synthetic.parts]
        if any(synthetic.frame.offset_m):
            x, y, z = synthetic.frame.offset_m
            nodes = [writer.add_group("Origin", nodes, translation_m=(x, z, -y))]
        writer.finish(file, synthetic.name, nodes)
    return file.getvalue()


class GlbWriter:
    """Writes a GLB part by part: arrays go to a file at once, their descriptions wait as text.

    binary : an empty file, open for writing and reading.
    """

    def __init__(self, binary: BinaryIO) -> None:
        self._binary = binary
        self._n_bytes = self._n_text_bytes = 0
        self._text: dict[str, list[str]] = {"nodes": [], "meshes": [], "accessors": [], "bufferViews": []}
        self._materials: list[str] = []

    @property
    def n_bytes(self) -> int:
        """Size of the file as it stands, but for some hundred bytes and the numbers of top nodes."""
        return self._n_bytes + self._n_text_bytes

    def add_part(self, part: Part) -> int:
        """Write a part's arrays; return the number of its node."""
        extras = {"kind": part.kind}
        primitive = self._primitive(part.solid)
        if part.material:
            extras["material"] = part.material
            primitive["material"] = self._material(part.material)
        mesh = self._add("meshes", {"name": part.name, "primitives": [primitive]})
        return self._add("nodes", {"name": part.name, "mesh": mesh, "extras": extras})

    def add_group(self, name: str, nodes: Sequence[int], *, translation_m: Point | None = None) -> int:
        """Put nodes under a new one, moved by `translation_m` in glTF's axes (y up); return its number."""
        moved = {} if translation_m is None else {"translation": list(translation_m)}
        return self._add("nodes", {"name": name, **moved, "children": list(nodes)})

    def finish(self, file: BinaryIO, name: str, nodes: Sequence[int]) -> None:
        """Write the whole GLB to `file`: a scene of that name, of these top nodes."""
        head: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "tlsplan scenes_synthetic"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": list(nodes)}],
        }
        tail: dict[str, Any] = {"buffers": [{"byteLength": self._n_bytes}]}
        if self._materials:
            described = [{"name": material, **_MATERIALS[material]} for material in self._materials]
            used = {"extensionsUsed": [_TRANSMISSION]} if "glass" in self._materials else {}
            tail = {"materials": described, **used, **tail}
        lists = ",".join(f'"{key}":[{",".join(items)}]' for key, items in self._text.items())
        text = f"{_json(head)[:-1]},{lists},{_json(tail)[1:]}".encode("ascii")
        text += b" " * (-len(text) % 4)
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + self._n_bytes))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", self._n_bytes, b"BIN\0"))
        self._binary.seek(0)
        shutil.copyfileobj(self._binary, file, 1 << 22)

    def _add(self, key: str, item: dict[str, Any]) -> int:
        text = _json(item)
        self._text[key].append(text)
        self._n_text_bytes += len(text) + 1
        return len(self._text[key]) - 1

    def _material(self, name: str) -> int:
        """Index of a material, described in the order of first use."""
        if name not in self._materials:
            self._materials.append(name)
        return self._materials.index(name)

    def _primitive(self, solid: Solid) -> dict[str, Any]:
        """Write a solid's arrays and describe them; every array is a multiple of 4 bytes long."""
        x, y, z = solid.vertices_m.T
        points = np.stack([x, z, -y], axis=1).astype("<f4")  # z up to y up: a quarter turn about x
        indices = solid.triangles.astype("<u4").ravel()
        bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        of_points = {"componentType": _FLOAT, "count": len(points), "type": "VEC3", **bounds}
        of_indices = {"componentType": _UNSIGNED_INT, "count": len(indices), "type": "SCALAR"}
        return {
            "attributes": {"POSITION": self._accessor(points, _ARRAY_BUFFER, of_points)},
            "indices": self._accessor(indices, _ELEMENT_ARRAY_BUFFER, of_indices),
            "mode": _TRIANGLES,
        }

    def _accessor(self, array: NDArray[Any], target: int, layout: dict[str, Any]) -> int:
        view = {"buffer": 0, "byteOffset": self._n_bytes, "byteLength": array.nbytes, "target": target}
        self._binary.write(array.tobytes())
        self._n_bytes += array.nbytes
        return self._add("accessors", {"bufferView": self._add("bufferViews", view), **layout})


def _json(tree: dict[str, Any]) -> str:
    return json.dumps(tree, separators=(",", ":"))
