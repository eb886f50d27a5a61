"""glTF 2.0 (.gltf, .glb) -> `RawScene`. Every node with a mesh becomes an element; metres, y up.

A reader of our own because the installed library (trimesh 5) ends in whatever exception the damage happens to cause (a
JSON error for half a GLB), and because nodes must keep their names and order. Read are triangles, strips and fans,
indexed or not, sparse and quantised positions, embedded and separate buffers, Draco compression. Other compressed
geometry is refused by name. Materials are read for what they do to beams (`planner_core.scene.materials`), a primitive
at a time.
Source: Khronos Group, glTF 2.0 Specification, 2021, and its extension KHR_materials_transmission.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from planner_core.errors import SceneError, grouped, one_line
from planner_core.model import Element, FloatArray, Int64Array, LoadReport, Optics
from planner_core.scene.gltf_file import (
    DRACO,
    JsonObject,
    decoded,
    embedded,
    file_beside,
    glb_chunks,
    material_optics,
    node_optics,
)
from planner_core.scene.raw import (
    MeshParts,
    RawScene,
    chained,
    exact,
    is_mirrored,
    placed,
    turned_over,
    what_it_looks_like,
)
from planner_core.scene.repair import bad_index_error

_COMPONENT = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_LARGEST = {"<i1": 127.0, "<u1": 255.0, "<i2": 32767.0, "<u2": 65535.0}
"""What a normalised integer is divided by."""
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_LEAST_SPARSE = 1_000_000
"""Values that an accessor without a buffer may declare whatever the file holds: what a file of few bytes may take."""
_INSTANCING = "EXT_mesh_gpu_instancing"
_COMPRESSED = "export it without compression, or run gltf-transform copy on it, which undoes compression"
_REMEDY_OF_EXTENSION = {
    "EXT_meshopt_compression": _COMPRESSED,
    "KHR_meshopt_compression": _COMPRESSED,
}
"""What to do about extensions without which the geometry would be wrong or missing, and which are not read."""


_Read = TypeVar("_Read")


@dataclass
class _Document:
    """The JSON part and the buffers, both checked where they are used."""

    path: Path
    tree: JsonObject
    glb_buffer: bytes | None
    contents: dict[int, bytes] = field(default_factory=dict)
    """Of buffers, by number."""
    nodes: list[JsonObject] = field(init=False)
    meshes: list[JsonObject] = field(init=False)
    accessors: list[JsonObject] = field(init=False)
    views: list[JsonObject] = field(init=False)
    buffers: list[JsonObject] = field(init=False)
    optics: list[Optics | None] = field(init=False)
    """Of materials, by number; None where one has nothing of the kind."""
    faults: list[str] = field(default_factory=list)
    """What is wrong with materials: their surfaces return beams, and the geometry is as good as ever."""

    def __post_init__(self) -> None:
        self.nodes = self.tree.objects("nodes")
        self.meshes = self.tree.objects("meshes")
        self.accessors = self.tree.objects("accessors")
        self.views = self.tree.objects("bufferViews")
        self.buffers = self.tree.objects("buffers")
        self.optics = []
        for material in self._of_materials(partial(self.tree.objects, "materials")) or ():
            self.optics.append(self._of_materials(partial(material_optics, material)))

    def optics_of(self, primitive: JsonObject) -> Optics | None:
        """Optics of the material of a primitive; None where it has none, or one that is not there."""
        if not primitive.has("material"):
            return None
        return self._of_materials(lambda: self.optics[primitive.whole("material", below=len(self.optics))])

    def _of_materials(self, read: Callable[[], _Read]) -> _Read | None:
        """What `read` gives; None where the file is at fault, which is noted instead of refused."""
        try:
            return read()
        except SceneError as fault:
            self.faults.append(str(fault))
            return None


@dataclass(frozen=True)
class _MeshPart:
    """One primitive: vertices (V, 3) float64, triangles (T, 3), and their numbers in the file (T,)."""

    vertices: FloatArray
    triangles: Int64Array
    face: Int64Array
    n_bad: int
    """Triangles left out because they name a missing vertex."""
    optics: Optics | None
    """Optics of its material; None where it has none."""


def read_gltf(path: Path, *, skip_bad_faces: bool) -> RawScene:
    """Read a glTF file.

    Raises
    ------
    SceneError
        Not glTF 2.0, cut off, a missing buffer, compressed geometry, or a face that names a missing vertex.
    """
    return _scene(_open(path), skip_bad_faces=skip_bad_faces)


# ------------------------------------------------------------------------------------------------- file
def _open(path: Path) -> _Document:
    contents = path.read_bytes()
    glb_buffer: bytes | None = None
    text = contents
    if contents[:4] == b"glTF":
        text, glb_buffer = glb_chunks(path, contents)
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
    if not isinstance(tree, dict):
        raise SceneError(f"{path.name}: its JSON is not an object, expected one; export it again.")
    root = JsonObject(path.name, "", tree)
    version = root.object("asset").text("version") if root.has("asset") else ""
    if not version.startswith("2."):
        raise SceneError(
            f"{path.name}: it states {'glTF ' + version if version else 'no version'}, expected glTF 2.0; "
            "export it as glTF 2.0."
        )
    return _Document(path, root, glb_buffer)


def _buffer(document: _Document, number: int) -> bytes:
    """Bytes of a buffer: the GLB's own, embedded as base64, or a file beside."""
    if number in document.contents:
        return document.contents[number]
    name = document.path.name
    entry = document.buffers[number]
    uri = entry.text("uri")
    n_declared = entry.whole("byteLength")
    if not uri:
        if document.glb_buffer is None or number != 0:
            _refuse_if_used(document, "extensionsUsed")  # the buffer of a compressed file may be a mere place
            raise SceneError(f"{name}: buffer {number} has no contents; export it again.")
        contents = document.glb_buffer
    elif uri.startswith("data:"):
        contents = embedded(name, number, uri)
    else:
        contents = file_beside(document.path, uri)
    if len(contents) < n_declared:
        raise SceneError(
            f"{name}: buffer {number} declares {grouped(n_declared)} bytes and has {grouped(len(contents))}: "
            "it is cut off; copy or export it again."
        )
    document.contents[number] = contents
    return contents


# ------------------------------------------------------------------------------------------------ scene
def _scene(document: _Document, *, skip_bad_faces: bool) -> RawScene:
    _refuse_if_used(document, "extensionsRequired")
    meshes: dict[int, list[_MeshPart]] = {}
    elements: list[Element] = []
    parts = MeshParts()
    n_bad = 0
    placements = (
        (number, placement)
        for number, matrix in _placed_nodes(document)
        for placement in _instances(document, document.nodes[number], matrix)
    )
    for number, matrix in placements:
        node = document.nodes[number]
        mesh = node.whole("mesh", below=len(document.meshes))
        if mesh not in meshes:
            meshes[mesh] = list(_mesh_parts(document, mesh, skip_bad_faces=skip_bad_faces))
        name = node.text("name") or document.meshes[mesh].text("name") or f"node {number}"
        elements.append(Element(name, "Mesh", str(number)))
        of_node = node_optics(node)
        n_faces = 0
        for part in meshes[mesh]:
            triangles = turned_over(part.triangles) if is_mirrored(matrix) else part.triangles
            optics_of_part = of_node if part.optics is None else part.optics
            optics = np.full(len(triangles), optics_of_part, dtype=np.uint8) if optics_of_part else None
            parts.add(len(elements) - 1, placed(part.vertices, matrix), triangles, part.face + n_faces, optics)
            n_faces += len(part.face) + part.n_bad
            n_bad += part.n_bad
    vertices, triangles, owner, face = parts.joined()
    dropped = (f"{grouped(n_bad)} faces name a vertex that does not exist",) if n_bad else ()
    return RawScene(
        vertices=vertices,
        triangles=triangles,
        element_of_triangle=owner,
        face_of_triangle=face,
        optics_of_triangle=parts.joined_optics(),
        elements=tuple(elements),
        unit_name="metre",
        up_axis="Y",
        schema=f"glTF {document.tree.object('asset').text('version')}",
        report=LoadReport(
            n_faces_read=n_bad, n_bad_index=n_bad, dropped=dropped, warnings=_material_warnings(document)
        ),
    )


def _refuse_if_used(document: _Document, key: str) -> None:
    """Refuse a file that lists, under `key`, an extension that geometry hangs on and that is not read."""
    for name in document.tree.texts(key):
        if name in _REMEDY_OF_EXTENSION:
            raise SceneError(
                f"{document.path.name}: its geometry uses {name}, which is not read; {_REMEDY_OF_EXTENSION[name]}."
            )


def _material_warnings(document: _Document) -> tuple[str, ...]:
    """A line about materials that can't be read, where there are any."""
    faults = list(dict.fromkeys(document.faults))
    if not faults:
        return ()
    more = f" (and {grouped(len(faults) - 1)} more)" if len(faults) > 1 else ""
    return (f"Materials are damaged, and their surfaces are taken to return beams{more}: {faults[0]}",)


def _placed_nodes(document: _Document) -> Iterator[tuple[int, FloatArray]]:
    """Nodes with a mesh below the shown scene, depth first, with their placement in the scene (4x4, float64)."""
    nodes = document.nodes
    stack = [(number, np.eye(4)) for number in reversed(_roots(document))]
    seen: set[int] = set()
    while stack:
        number, above = stack.pop()
        if number in seen:
            raise SceneError(
                f"{document.path.name}: node {number} has two parents, expected a tree; export the model again."
            )
        seen.add(number)
        node = nodes[number]
        matrix = chained(above, _local_matrix(node))
        if node.has("mesh"):
            yield number, matrix
        stack += [(child, matrix) for child in reversed(node.wholes("children", below=len(nodes)))]


def _roots(document: _Document) -> list[int]:
    n_nodes = len(document.nodes)
    scenes = document.tree.objects("scenes")
    if scenes:
        return scenes[document.tree.whole("scene", 0, below=len(scenes))].wholes("nodes", below=n_nodes)
    children = {child for node in document.nodes for child in node.wholes("children", below=n_nodes)}
    return [number for number in range(n_nodes) if number not in children]


def _local_matrix(node: JsonObject) -> FloatArray:
    """A node's placement in its parent: its matrix (stored by columns), or translation * rotation * scale."""
    if node.has("matrix"):
        return np.array(node.numbers("matrix", _IDENTITY)).reshape(4, 4).T
    return _matrix_of(
        node.numbers("translation", (0.0, 0.0, 0.0)),
        node.numbers("rotation", (0.0, 0.0, 0.0, 1.0)),
        node.numbers("scale", (1.0, 1.0, 1.0)),
    )


def _matrix_of(translation: list[float], rotation: list[float], scale: list[float]) -> FloatArray:
    """Placement of translation * rotation (a quaternion x, y, z, w) * scale."""
    x, y, z, w = rotation
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    with np.errstate(over="ignore", invalid="ignore"):  # vertices that end up nowhere are dropped with the repair
        matrix[:3, :3] = turn * np.array(scale)
    matrix[:3, 3] = translation
    return matrix


def _instances(document: _Document, node: JsonObject, matrix: FloatArray) -> Iterator[FloatArray]:
    """Placements of a node's mesh: its own, or one for each instance of EXT_mesh_gpu_instancing."""
    extensions = node.object("extensions") if node.has("extensions") else None
    if extensions is None or not extensions.has(_INSTANCING):
        yield matrix
        return
    attributes = extensions.object(_INSTANCING).object("attributes")
    columns: dict[str, FloatArray] = {}
    for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
        if attributes.has(name):
            number = attributes.whole(name, below=len(document.accessors))
            columns[name] = _accessor(document, number, width)
    counts = {len(values) for values in columns.values()}
    if len(counts) != 1:
        found = ", ".join(f"{name} {len(values)}" for name, values in columns.items()) or "none"
        raise SceneError(
            f"{document.path.name}, {node.place}: its instances have placements of {found}, expected as many of each; "
            "export it again."
        )
    still = (("TRANSLATION", (0.0, 0.0, 0.0)), ("ROTATION", (0.0, 0.0, 0.0, 1.0)), ("SCALE", (1.0, 1.0, 1.0)))
    for at in range(counts.pop()):
        translation, rotation, scale = (
            columns[name][at].tolist() if name in columns else list(default) for name, default in still
        )
        yield chained(matrix, _matrix_of(translation, rotation, scale))


# ------------------------------------------------------------------------------------------------- mesh
def _mesh_parts(document: _Document, mesh: int, *, skip_bad_faces: bool) -> Iterator[_MeshPart]:
    entry = document.meshes[mesh]
    title = one_line(f"{document.path.name}, mesh {entry.text('name') or mesh}")
    n_accessors = len(document.accessors)
    for primitive in entry.required_objects("primitives"):
        mode = primitive.whole("mode", _TRIANGLES)
        attributes = primitive.object("attributes")
        if mode not in (_TRIANGLES, _STRIP, _FAN) or not attributes.has("POSITION"):
            continue  # points and lines have no surface
        packed = primitive.object("extensions") if primitive.has("extensions") else None
        if packed is not None and packed.has(DRACO):
            vertices, triangles = _draco(document, packed.object(DRACO))
        else:
            vertices = _accessor(document, attributes.whole("POSITION", below=n_accessors), 3)
            if primitive.has("indices"):
                corners = _corner_numbers(document, primitive.whole("indices", below=n_accessors))
            else:
                corners = np.arange(vertices.shape[0], dtype=np.int64)
            triangles = _triangles(title, corners, mode)
        is_missing = (triangles < 0) | (triangles >= vertices.shape[0])  # below 0 where their type is a signed one
        bad = is_missing.any(axis=1)
        if bad.any() and not skip_bad_faces:
            worst = int(triangles[is_missing][0])
            raise bad_index_error(
                title, int(bad.sum()), bad.size, worst, vertices.shape[0], first_number=0, owner="mesh"
            )
        optics = document.optics_of(primitive)
        yield _MeshPart(vertices, triangles[~bad], np.flatnonzero(~bad), int(bad.sum()), optics)


def _draco(document: _Document, packed: JsonObject) -> tuple[FloatArray, Int64Array]:
    """Vertices and triangles of a compressed primitive; its accessors are not read."""
    number = packed.whole("bufferView", below=len(document.views))
    view = document.views[number]
    contents = _buffer(document, view.whole("buffer", below=len(document.buffers)))
    start, length = view.whole("byteOffset", 0), view.whole("byteLength")
    if start + length > len(contents):
        raise SceneError(
            f"{document.path.name}: buffer view {number} ends at byte {grouped(start + length)}, its buffer at "
            f"{grouped(len(contents))}: it is cut off or damaged; export it again."
        )
    position = packed.object("attributes").whole("POSITION")
    return decoded(document.path.name, contents[start : start + length], position)


def _corner_numbers(document: _Document, accessor: int) -> Int64Array:
    values = _accessor(document, accessor, 1).ravel()
    if not (np.abs(values) < 2**32).all():
        raise SceneError(
            f"{document.path.name}: accessor {accessor} holds values that are not vertex numbers; export it again."
        )
    return values.astype(np.int64)


def _triangles(title: str, corners: Int64Array, mode: int) -> Int64Array:
    """(T, 3) of a list, strip or fan of corners. Every second triangle of a strip is turned over."""
    if mode == _TRIANGLES:
        if corners.size % 3:
            raise SceneError(
                f"{title}: it has {grouped(corners.size)} corners, expected three per face; export it again."
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
    entry = document.accessors[number]
    component = _component(document, entry)
    shape = entry.text("type")
    if shape != ("SCALAR" if width == 1 else f"VEC{width}"):
        raise SceneError(
            f"{document.path.name}: accessor {number} is a {shape or 'thing of no type'}, expected "
            f"{'a SCALAR' if width == 1 else f'a VEC{width}'}; export it again."
        )
    if entry.has("bufferView"):
        values = _view(document, entry, component, entry.whole("count"), width)
    elif entry.has("sparse"):
        values = np.zeros((_sparse_count(document, entry), width))
    else:
        _refuse_if_used(document, "extensionsUsed")
        raise SceneError(f"{document.path.name}: accessor {number} has no contents; export it again.")
    if entry.has("sparse"):
        values = _with_sparse(document, entry.object("sparse"), values, component)
    if entry.members.get("normalized") is True and component in _LARGEST:
        values = np.maximum(values / _LARGEST[component], -1.0)
    return values


def _sparse_count(document: _Document, entry: JsonObject) -> int:
    """Length of an accessor that is zero but for what a sparse part replaces: no longer than the file in bytes.

    Vertices at zero make no surface, and no mesh has more of them than it has bytes for the rest.
    """
    count = entry.whole("count")
    held = sum(len(_buffer(document, number)) for number in range(len(document.buffers)))
    if count > max(held, _LEAST_SPARSE):
        raise SceneError(
            f"{document.path.name}: {entry.place} declares {grouped(count)} values without a buffer, expected "
            f"{grouped(max(held, _LEAST_SPARSE))} at most for its {grouped(held)} bytes; export it again."
        )
    return count


def _component(document: _Document, entry: JsonObject) -> str:
    """The dtype of one value."""
    code = entry.whole("componentType")
    if code not in _COMPONENT:
        raise SceneError(
            f"{document.path.name}: {entry.place}/componentType is {code}, expected one of "
            f"{', '.join(map(str, _COMPONENT))}; export it again."
        )
    return _COMPONENT[code]


def _view(document: _Document, user: JsonObject, component: str, count: int, width: int) -> FloatArray:
    """(count, width) float64 out of the buffer view that `user` names, rows `byteStride` apart."""
    view = user.whole("bufferView", below=len(document.views))
    entry = document.views[view]
    contents = _buffer(document, entry.whole("buffer", below=len(document.buffers)))
    row = np.dtype(component).itemsize * width
    stride = entry.whole("byteStride", 0) or row
    start = entry.whole("byteOffset", 0) + user.whole("byteOffset", 0)
    end = start + (stride * (count - 1) + row if count else 0)
    limit = min(entry.whole("byteOffset", 0) + entry.whole("byteLength"), len(contents))
    if stride < row or max(start, end) > limit:
        raise SceneError(
            f"{document.path.name}: buffer view {view} ends at byte {grouped(limit)}, {grouped(count)} values need "
            f"{grouped(end)}: it is cut off or damaged; export it again."
        )
    values = np.ndarray((count, width), component, contents, start, (stride, np.dtype(component).itemsize))
    return exact(values)


def _with_sparse(document: _Document, sparse: JsonObject, values: FloatArray, component: str) -> FloatArray:
    """Values of a sparse accessor: some rows are replaced."""
    count = sparse.whole("count")
    where = sparse.object("indices")
    rows = _view(document, where, _component(document, where), count, 1).ravel()
    new = _view(document, sparse.object("values"), component, count, values.shape[1])
    if not ((rows >= 0) & (rows < values.shape[0])).all():
        raise SceneError(
            f"{document.path.name}: {where.place} names a value that does not exist, the last is "
            f"{values.shape[0] - 1}; it is damaged, export it again."
        )
    values = values.copy()
    values[rows.astype(np.int64)] = new
    return values
