"""Wavefront OBJ: text lines -> `RawScene`. Groups and objects become elements; polygons are split; no unit, no axes.

Of materials, what they do to beams is read: by their names, and by the figures of libraries beside the file.

A reader of our own because the installed library (trimesh 5) ends in a bare IndexError on a face that names a missing
vertex, joins objects into one mesh, and fans polygons that have notches. Source: Wavefront, Object Files, appendix B1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import Element, FloatArray, Int64Array, UInt8Array
from planner_core.scene.mtl import BYTE_ORDER_MARK, optics_of_uses
from planner_core.scene.raw import RawScene, triangulate, what_it_looks_like

_AFTER_SLASH = re.compile(rb"/\S*")


@dataclass
class _Lines:
    """The lines that matter, in the order of the file."""

    vertices: list[bytes] = field(default_factory=list)
    vertex_line: list[int] = field(default_factory=list)
    faces: list[bytes] = field(default_factory=list)
    face_line: list[int] = field(default_factory=list)
    n_vertices_before: list[int] = field(default_factory=list)
    """Of each face: what its negative numbers count back from."""
    owner: list[int] = field(default_factory=list)
    """Of each face: its element."""
    elements: dict[str, int] = field(default_factory=dict)
    materials: list[str] = field(default_factory=list)
    """Of each `usemtl` line: its name."""
    n_faces_before: list[int] = field(default_factory=list)
    """Of each `usemtl` line."""
    libraries: list[str] = field(default_factory=list)


def read_obj(path: Path, *, skip_bad_faces: bool) -> RawScene:
    """Read an OBJ file.

    Raises
    ------
    SceneError
        Not an OBJ file, a line that can't be read, or a face that names a missing vertex.
    """
    contents = path.read_bytes().removeprefix(BYTE_ORDER_MARK)
    if b"\0" in contents[:4096]:
        raise SceneError(_not_obj(path, contents))
    lines = _sort_lines(contents)
    if not lines.vertices and not lines.faces:
        raise SceneError(_not_obj(path, contents))
    vertices = _vertices(path, lines)
    n_corners, corners, as_written = _corners(path, lines)
    faces = triangulate(
        vertices,
        n_corners,
        corners,
        name=path.name,
        skip_bad_faces=skip_bad_faces,
        first_number=1,
        as_written=as_written,
    )
    owner = np.array(lines.owner, dtype=np.int64)
    optics, warnings = _optics_of_faces(path, lines)
    return RawScene(
        vertices=vertices,
        triangles=faces.triangles,
        element_of_triangle=owner[faces.polygon],
        face_of_triangle=faces.polygon + 1,
        optics_of_triangle=None if optics is None else optics[faces.polygon],
        elements=tuple(Element(name, "Mesh", name) for name in lines.elements),
        report=replace(faces.report(), warnings=warnings),
    )


def _not_obj(path: Path, contents: bytes) -> str:
    return (
        f"{path.name}: not an OBJ file: {what_it_looks_like(contents[:64])}, expected lines that begin with v and f; "
        "export the model as OBJ again."
    )


def _sort_lines(contents: bytes) -> _Lines:
    """Pick vertex and face lines; follow objects (o) and groups (g)."""
    lines = _Lines()
    labels = {b"o": "", b"g": ""}
    owner = -1
    for number, line in enumerate(contents.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines(), 1):
        word, rest = _split_line(line)
        if word == b"v":
            lines.vertices.append(rest)
            lines.vertex_line.append(number)
        elif word == b"f":
            if owner < 0:
                owner = lines.elements.setdefault(_element_name(labels), len(lines.elements))
            lines.faces.append(rest)
            lines.face_line.append(number)
            lines.n_vertices_before.append(len(lines.vertices))
            lines.owner.append(owner)
        elif word in labels:
            if word == b"o":
                labels[b"g"] = ""  # a new object begins without a group
            labels[word] = rest.strip().decode("utf-8", "replace")
            owner = -1
        elif word == b"usemtl":
            lines.materials.append(rest.strip().decode("utf-8", "replace"))
            lines.n_faces_before.append(len(lines.faces))
        elif word == b"mtllib":
            lines.libraries.append(rest.strip().decode("utf-8", "replace"))
    return lines


def _optics_of_faces(path: Path, lines: _Lines) -> tuple[UInt8Array | None, tuple[str, ...]]:
    """(F,) `Optics` of the faces, None where all return; and lines for the user. A material holds until the next."""
    of_use, warnings = optics_of_uses(path, lines.materials, lines.libraries)
    if not of_use.any():
        return None, warnings
    n_faces = np.diff([0, *lines.n_faces_before, len(lines.faces)])
    return np.repeat(np.concatenate([np.zeros(1, np.uint8), of_use]), n_faces), warnings


def _split_line(line: bytes) -> tuple[bytes, bytes]:
    """First word and rest of a line, without its comment."""
    if line[1:2] == b" " and b"#" not in line:  # nearly all lines of nearly all files
        return line[:1], line[2:]
    word, _, rest = line.partition(b"#")[0].replace(b"\t", b" ").strip().partition(b" ")
    return word, rest


def _element_name(labels: dict[bytes, str]) -> str:
    named, group = labels[b"o"], labels[b"g"]
    if named and group and named != group:
        return f"{named}/{group}"
    return named or group or "mesh"


def _vertices(path: Path, lines: _Lines) -> FloatArray:
    """(V, 3) float64. A weight or colour after the coordinates is left out."""
    words = [line.split()[:3] for line in lines.vertices]
    try:
        flat = [float(word) for row in words for word in row]
    except ValueError:
        flat = []
    if len(flat) != 3 * len(words):
        at = next(i for i, row in enumerate(words) if len(row) != 3 or not all(_is_number(word) for word in row))
        raise SceneError(
            f"{path.name}, line {lines.vertex_line[at]}: {_quoted(b'v ' + lines.vertices[at])} is not a vertex, "
            "expected three numbers; the file is damaged or cut off, export it again."
        )
    return np.array(flat, dtype=np.float64).reshape(-1, 3)


def _corners(path: Path, lines: _Lines) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Corners a face, vertex numbers from 0, and as the file has them (from 1, negative ones count back).

    Texture and normal numbers (after /) are left out.
    """
    words = [_AFTER_SLASH.sub(b"", line).split() if b"/" in line else line.split() for line in lines.faces]
    n_corners = np.fromiter(map(len, words), dtype=np.int64, count=len(words))
    try:
        numbers = np.array([int(word) for row in words for word in row], dtype=np.int64)
    except (ValueError, OverflowError):
        at = next(i for i, row in enumerate(words) if not all(_is_vertex_number(word) for word in row))
        raise SceneError(
            f"{path.name}, line {lines.face_line[at]}: {_quoted(b'f ' + lines.faces[at])} is not a face, expected "
            "vertex numbers; the file is damaged or cut off, export it again."
        ) from None
    before = np.repeat(np.array(lines.n_vertices_before, dtype=np.int64), n_corners)
    return n_corners, np.where(numbers < 0, before + numbers, numbers - 1), numbers


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _is_vertex_number(word: bytes) -> bool:
    try:
        return abs(int(word)) < 2**62
    except ValueError:
        return False


def _quoted(line: bytes) -> str:
    return repr(line[:40].decode("utf-8", "replace"))
