"""STL, binary and ASCII -> `RawScene`. Each solid becomes an element; no unit, no axes.

A reader of our own because the installed library (trimesh 5) returns an empty scene, without an error, for a binary
file that is cut off and for text that is no STL at all. Source: 3D Systems, StereoLithography Interface Specification,
1989: 80 bytes of header, the number of triangles as uint32, then 50 bytes each (normal, three corners, attribute).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from planner_core.errors import SceneError, grouped
from planner_core.model import Element, FloatArray, Int64Array, LoadReport
from planner_core.scene.raw import RawScene, exact, what_it_looks_like

_HEADER_BYTES = 84
_TRIANGLE_BYTES = 50
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_SOLID = re.compile(rb"^[ \t]*solid\b[ \t]*([^\r\n]*)", re.IGNORECASE | re.MULTILINE)
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_FACET = re.compile(rb"\bfacet\s+normal\b", re.IGNORECASE)
_END = re.compile(rb"^[ \t]*endsolid\b", re.IGNORECASE | re.MULTILINE)


def read_stl(path: Path) -> RawScene:
    """Read an STL file. The declared number of triangles decides whether it is binary, the word `solid` does not.

    Raises
    ------
    SceneError
        Not an STL file, or one that is cut off.
    """
    contents = path.read_bytes()
    size = len(contents)
    n_declared = int.from_bytes(contents[80:_HEADER_BYTES], "little") if size >= _HEADER_BYTES else -1
    n_expected = _HEADER_BYTES + _TRIANGLE_BYTES * n_declared
    if n_declared > 0 and n_expected == size:
        return _binary(contents, n_declared, ())
    if _SOLID.match(contents.lstrip()[:256]) and b"\0" not in contents[:4096]:
        return _ascii(path, contents)
    looks = what_it_looks_like(contents[:64])
    if n_declared < 0 or _is_something_else(looks, contents):
        raise SceneError(
            f"{path.name}: not an STL file: {looks}, expected a binary STL or the word solid; "
            "export the model as STL again."
        )
    if n_declared > 0 and n_expected < size:
        extra = f"{path.name}: {grouped(size - n_expected)} bytes after its last triangle were left out."
        return _binary(contents, n_declared, (extra,))
    raise SceneError(
        f"{path.name}: it declares {grouped(n_declared)} triangles ({grouped(n_expected)} bytes) and has "
        f"{grouped(size)} bytes: it is cut off or no STL file; export it again."
    )


def _is_something_else(looks: str, contents: bytes) -> bool:
    """Neither a binary STL that is cut off nor one that is too long: it begins like another format or plain text."""
    if "begins like" in looks:
        return not looks.endswith("an ASCII STL file")
    return "with the text" in looks and b"\0" not in contents[:_HEADER_BYTES]


def _binary(contents: bytes, n_triangles: int, warnings: tuple[str, ...]) -> RawScene:
    records = np.frombuffer(contents, dtype=_TRIANGLE, count=n_triangles, offset=_HEADER_BYTES)
    corners = exact(records["corners"]).reshape(-1, 3)
    title = contents[:80].split(b"\0")[0].decode("ascii", "replace").strip()
    name = title.removeprefix("solid").strip() or "mesh"
    elements = (Element(name, "Mesh", "0"),)
    return _raw(corners, np.zeros(n_triangles, dtype=np.int64), elements, warnings)


def _ascii(path: Path, contents: bytes) -> RawScene:
    facets = np.array([m.start() for m in _FACET.finditer(contents)], dtype=np.int64)
    vertices = _VERTEX.findall(contents)
    solids = list(_SOLID.finditer(contents))
    if not _END.search(contents, solids[-1].end()):
        raise SceneError(f"{path.name}: its last solid has no endsolid: it is cut off; export it again.")
    if len(vertices) != 3 * facets.size:
        raise SceneError(
            f"{path.name}: its {grouped(facets.size)} facets have {grouped(len(vertices))} vertices, "
            "expected three each; it is damaged, export it again."
        )
    try:
        corners = np.array([float(word) for row in vertices for word in row], dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise SceneError(
            f"{path.name}: {error}, expected numbers after vertex; it is damaged, export it again."
        ) from None
    starts = np.array([m.start() for m in solids], dtype=np.int64)
    names = [m.group(1).decode("utf-8", "replace").strip() for m in solids]
    elements = tuple(Element(name or f"solid {i}", "Mesh", str(i)) for i, name in enumerate(names))
    return _raw(corners, np.searchsorted(starts, facets, side="right") - 1, elements, ())


def _raw(
    corners: FloatArray, element: Int64Array, elements: tuple[Element, ...], warnings: tuple[str, ...]
) -> RawScene:
    n_triangles = corners.shape[0] // 3
    return RawScene(
        vertices=corners,
        triangles=np.arange(3 * n_triangles, dtype=np.int64).reshape(-1, 3),
        element_of_triangle=element,
        face_of_triangle=np.arange(n_triangles, dtype=np.int64),
        elements=elements,
        report=LoadReport(n_faces_read=0, warnings=warnings),
    )
