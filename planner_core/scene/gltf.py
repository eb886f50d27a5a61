"""glTF 2.0 (.gltf, .glb) -> `RawScene`. Every node with a mesh becomes an element; metres, y up.

A reader of our own because the installed library (trimesh 5) ends in whatever exception the damage happens to cause (a
JSON error for half a GLB), and because nodes must keep their names and order. Read are triangles, strips and fans,
indexed or not, sparse and quantised positions, embedded and separate buffers. Compressed geometry is refused by name.
Source: Khronos Group, glTF 2.0 Specification, 2021.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import Element, FloatArray, Int64Array, LoadReport
from planner_core.scene.build import bad_index_error, grouped
from planner_core.scene.raw import Parts, RawScene, chained, is_mirrored, placed, turned_over, what_it_looks_like

_COMPONENT = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_LARGEST = {"<i1": 127.0, "<u1": 255.0, "<i2": 32767.0, "<u2": 65535.0}
"""What a normalised integer is divided by."""
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_GEOMETRY_EXTENSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing")
"""Extensions without which the geometry would be wrong or missing, and which are not read."""
_GLB_HEADER = struct.Struct("<4sII")
_CHUNK_HEADER = struct.Struct("<II")
_JSON_CHUNK, _BIN_CHUNK = 0x4E4F534A, 0x004E4942


@dataclass
class _Document:
    """The JSON part and the buffers, both checked where they are used."""

    path: Path
    tree: dict[str, Any]
    glb_buffer: bytes | None
    buffers: dict[int, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class _MeshPart:
    """One primitive: vertices (V, 3) float64, triangles (T, 3), and their numbers in the file (T,)."""

    vertices: FloatArray
    triangles: Int64Array
    face: Int64Array
    n_bad: int
    """Triangles left out because they name a missing vertex."""


def read_gltf(path: Path, *, skip_bad_faces: bool) -> RawScene:
    """Read a glTF file.

    Raises
    ------
    SceneError
        Not glTF 2.0, cut off, a missing buffer, compressed geometry, or a face that names a missing vertex.
    """
    document = _open(path)
    try:
        return _scene(document, skip_bad_faces=skip_bad_faces)
    except SceneError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        detail = f"{type(error).__name__}: {error}"
        raise SceneError(
            f"{path.name}: its contents do not follow glTF 2.0 ({detail}); validate it and export it again."
        ) from error


# ------------------------------------------------------------------------------------------------- file
def _open(path: Path) -> _Document:
    contents = path.read_bytes()
    glb_buffer: bytes | None = None
    text = contents
    if contents[:4] == b"glTF":
        text, glb_buffer = _glb_chunks(path, contents)
    elif not contents.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        raise SceneError(
            f"{path.name}: not a glTF file: {what_it_looks_like(contents[:64])}, expected glTF 2.0 (text or binary); "
            "export the model as glTF again."
        )
    try:
        tree = json.loads(text.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise SceneError(
            f"{path.name}: its JSON can't be read ({error}): cut off or damaged; export it again."
        ) from error
    version = str(tree.get("asset", {}).get("version", "")) if isinstance(tree, dict) else ""
    if not version.startswith("2."):
        raise SceneError(
            f"{path.name}: it says {'glTF ' + version if version else 'nothing of its version'}, expected glTF 2.0; "
            "export it as glTF 2.0."
        )
    return _Document(path, tree, glb_buffer)


def _glb_chunks(path: Path, contents: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB."""
    if len(contents) < _GLB_HEADER.size:
        raise SceneError(f"{path.name}: it ends inside its header: it is cut off; export it again.")
    _, version, length = _GLB_HEADER.unpack_from(contents)
    if version != 2:
        raise SceneError(f"{path.name}: it is binary glTF {version}, expected version 2; export it as glTF 2.0.")
    if length > len(contents):
        raise SceneError(
            f"{path.name}: it declares {grouped(length)} bytes and has {grouped(len(contents))}: it is cut off; "
            "copy or export it again."
        )
    chunks: dict[int, bytes] = {}
    at = _GLB_HEADER.size
    while at + _CHUNK_HEADER.size <= length:
        size, kind = _CHUNK_HEADER.unpack_from(contents, at)
        at += _CHUNK_HEADER.size
        if at + size > length:
            raise SceneError(f"{path.name}: a chunk of {grouped(size)} bytes runs past its end; export it again.")
        chunks.setdefault(kind, contents[at : at + size])
        at += size
    if _JSON_CHUNK not in chunks:
        raise SceneError(f"{path.name}: it has no JSON chunk, expected one; export it again.")
    return chunks[_JSON_CHUNK], chunks.get(_BIN_CHUNK)


def _buffer(document: _Document, number: int) -> bytes:
    """Bytes of a buffer: the GLB's own, embedded as base64, or a file beside."""
    if number in document.buffers:
        return document.buffers[number]
    name = document.path.name
    entry = document.tree["buffers"][number]
    uri = entry.get("uri")
    if uri is None:
        if document.glb_buffer is None or number != 0:
            raise SceneError(f"{name}: buffer {number} has no contents; export it again.")
        contents = document.glb_buffer
    elif uri.startswith("data:"):
        contents = _decoded(name, number, uri)
    else:
        contents = _file_beside(document.path, uri)
    if len(contents) < entry["byteLength"]:
        raise SceneError(
            f"{name}: buffer {number} declares {grouped(entry['byteLength'])} bytes and has {grouped(len(contents))}: "
            "it is cut off; copy or export it again."
        )
    document.buffers[number] = contents
    return contents


def _decoded(name: str, number: int, uri: str) -> bytes:
    head, comma, body = uri.partition(",")
    if not comma or not head.endswith(";base64"):
        raise SceneError(f"{name}: buffer {number} is embedded as {head[:40]!r}, expected base64; export it again.")
    try:
        return base64.b64decode(body, validate=True)
    except binascii.Error as error:
        raise SceneError(f"{name}: buffer {number} is no valid base64 ({error}); export it again.") from error


def _file_beside(path: Path, uri: str) -> bytes:
    relative = Path(unquote(uri))
    if "://" in uri or relative.is_absolute():
        raise SceneError(
            f"{path.name}: it refers to {uri}, expected a file beside it; export it with embedded buffers."
        )
    try:
        return (path.parent / relative).read_bytes()
    except OSError as error:
        raise SceneError(
            f"{path.name}: it refers to {uri}, which can't be read ({error.strerror}); put that file beside it, "
            "or export the model as GLB."
        ) from error


# ------------------------------------------------------------------------------------------------ scene
def _scene(document: _Document, *, skip_bad_faces: bool) -> RawScene:
    tree = document.tree
    needed = [name for name in tree.get("extensionsRequired", ()) if name in _GEOMETRY_EXTENSIONS]
    if needed:
        raise SceneError(
            f"{document.path.name}: its geometry uses {needed[0]}, which is not read; export it without compression."
        )
    meshes: dict[int, list[_MeshPart]] = {}
    elements: list[Element] = []
    parts = Parts()
    n_bad = 0
    for number, matrix in _placed_nodes(document):
        node = tree["nodes"][number]
        mesh = node["mesh"]
        if mesh not in meshes:
            meshes[mesh] = list(_mesh_parts(document, mesh, skip_bad_faces=skip_bad_faces))
        name = node.get("name") or tree["meshes"][mesh].get("name") or f"node {number}"
        elements.append(Element(str(name), "Mesh", str(number)))
        n_faces = 0
        for part in meshes[mesh]:
            triangles = turned_over(part.triangles) if is_mirrored(matrix) else part.triangles
            parts.add(len(elements) - 1, placed(part.vertices, matrix), triangles, part.face + n_faces)
            n_faces += len(part.face) + part.n_bad
            n_bad += part.n_bad
    vertices, triangles, owner, face = parts.joined()
    dropped = (f"{grouped(n_bad)} faces name a vertex that does not exist",) if n_bad else ()
    return RawScene(
        vertices=vertices,
        triangles=triangles,
        element_of_triangle=owner,
        face_of_triangle=face,
        elements=tuple(elements),
        unit_name="metre",
        up_axis="Y",
        schema=f"glTF {tree['asset']['version']}",
        report=LoadReport(n_faces_read=n_bad, n_bad_index=n_bad, dropped=dropped),
    )


def _placed_nodes(document: _Document) -> Iterator[tuple[int, FloatArray]]:
    """Nodes with a mesh below the shown scene, depth first, with their placement in the scene (4x4, float64)."""
    nodes = document.tree.get("nodes", [])
    stack = [(number, np.eye(4)) for number in reversed(_roots(document.tree))]
    seen: set[int] = set()
    while stack:
        number, above = stack.pop()
        if number in seen:
            raise SceneError(
                f"{document.path.name}: node {number} hangs in two places, expected a tree; export the model again."
            )
        seen.add(number)
        node = nodes[number]
        matrix = chained(above, _local_matrix(node))
        if "mesh" in node:
            yield number, matrix
        stack += [(child, matrix) for child in reversed(node.get("children", ()))]


def _roots(tree: dict[str, Any]) -> list[int]:
    scenes = tree.get("scenes")
    if scenes:
        return list(scenes[tree.get("scene", 0)].get("nodes", ()))
    children = {child for node in tree.get("nodes", ()) for child in node.get("children", ())}
    return [number for number in range(len(tree.get("nodes", ()))) if number not in children]


def _local_matrix(node: dict[str, Any]) -> FloatArray:
    """A node's placement in its parent: its matrix (stored by columns), or translation * rotation * scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = (float(v) for v in node.get("rotation", (0, 0, 0, 1)))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


# ------------------------------------------------------------------------------------------------- mesh
def _mesh_parts(document: _Document, mesh: int, *, skip_bad_faces: bool) -> Iterator[_MeshPart]:
    entry = document.tree["meshes"][mesh]
    title = f"{document.path.name}, mesh {entry.get('name') or mesh}"
    for primitive in entry["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in primitive["attributes"]:
            continue  # points and lines have no surface
        vertices = _accessor(document, primitive["attributes"]["POSITION"], 3)
        if "indices" in primitive:
            corners = _accessor(document, primitive["indices"], 1).astype(np.int64).ravel()
        else:
            corners = np.arange(vertices.shape[0], dtype=np.int64)
        triangles = _triangles(title, corners, mode)
        bad = (triangles >= vertices.shape[0]).any(axis=1)
        if bad.any() and not skip_bad_faces:
            worst = int(triangles[triangles >= vertices.shape[0]][0])
            raise bad_index_error(
                title, int(bad.sum()), bad.size, worst, vertices.shape[0], first_number=0, owner="mesh"
            )
        yield _MeshPart(vertices, triangles[~bad], np.flatnonzero(~bad), int(bad.sum()))


def _triangles(title: str, corners: Int64Array, mode: int) -> Int64Array:
    """(T, 3) of a list, strip or fan of corners. Every second triangle of a strip is turned over."""
    if mode == _TRIANGLES:
        if corners.size % 3:
            raise SceneError(
                f"{title}: it has {grouped(corners.size)} corners, expected three a face; export it again."
            )
        return corners.reshape(-1, 3)
    n = max(corners.size - 2, 0)
    if mode == _FAN:
        return np.stack([corners[1 : n + 1], corners[2 : n + 2], np.repeat(corners[:1], n)], axis=1)
    strip = np.stack([corners[:n], corners[1 : n + 1], corners[2 : n + 2]], axis=1)
    strip[1::2] = strip[1::2][:, [0, 2, 1]]
    return strip


def _accessor(document: _Document, number: int, width: int) -> FloatArray:
    """(count, width) float64: exact for every component type."""
    entry = document.tree["accessors"][number]
    component = _COMPONENT[entry["componentType"]]
    if entry["type"] != ("SCALAR" if width == 1 else f"VEC{width}"):
        raise SceneError(
            f"{document.path.name}: accessor {number} is a {entry['type']}, expected "
            f"{'a SCALAR' if width == 1 else f'a VEC{width}'}; export it again."
        )
    count = int(entry["count"])
    if "bufferView" in entry:
        values = _view(document, entry["bufferView"], entry.get("byteOffset", 0), component, count, width)
    elif "sparse" in entry:
        _check_sparse_count(document, count)
        values = np.zeros((count, width))
    elif "KHR_draco_mesh_compression" in document.tree.get("extensionsUsed", ()):
        raise SceneError(
            f"{document.path.name}: its geometry uses KHR_draco_mesh_compression, which is not read; "
            "export it without compression."
        )
    else:
        raise SceneError(f"{document.path.name}: accessor {number} has no contents; export it again.")
    if "sparse" in entry:
        values = _with_sparse(document, entry["sparse"], values, component)
    if entry.get("normalized", False):
        values = np.maximum(values / _LARGEST[component], -1.0)
    return values


def _check_sparse_count(document: _Document, count: int) -> None:
    if not 0 <= count <= 2**31:
        raise SceneError(f"{document.path.name}: an accessor declares {count} values; it is damaged, export it again.")


def _view(document: _Document, view: int, offset: int, component: str, count: int, width: int) -> FloatArray:
    """(count, width) float64 out of a buffer view, rows `byteStride` apart."""
    entry = document.tree["bufferViews"][view]
    contents = _buffer(document, entry["buffer"])
    row = np.dtype(component).itemsize * width
    stride = int(entry.get("byteStride", 0)) or row
    start = int(entry.get("byteOffset", 0)) + int(offset)
    end = start + (stride * (count - 1) + row if count else 0)
    limit = min(int(entry.get("byteOffset", 0)) + int(entry["byteLength"]), len(contents))
    if count < 0 or start < 0 or stride < row or end > limit:
        raise SceneError(
            f"{document.path.name}: buffer view {view} ends at byte {grouped(limit)}, {grouped(count)} values need "
            f"{grouped(end)}: it is cut off or damaged; export it again."
        )
    values = np.ndarray((count, width), component, contents, start, (stride, np.dtype(component).itemsize))
    return values.astype(np.float64)


def _with_sparse(document: _Document, sparse: dict[str, Any], values: FloatArray, component: str) -> FloatArray:
    """Values of a sparse accessor: some rows are replaced."""
    count = int(sparse["count"])
    where, what = sparse["indices"], sparse["values"]
    index_type = _COMPONENT[where["componentType"]]
    rows = _view(document, where["bufferView"], where.get("byteOffset", 0), index_type, count, 1)
    new = _view(document, what["bufferView"], what.get("byteOffset", 0), component, count, values.shape[1])
    values = values.copy()
    values[rows.astype(np.int64).ravel()] = new
    return values
