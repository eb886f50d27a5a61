"""Wavefront OBJ: text lines -> `RawScene`. Groups and objects become elements; polygons are split; no unit, no axes.

Of materials, what they do to beams is read: by their names, and by the figures of libraries beside the file. A library
is a help, not a need: one that is missing, can't be read or should not be is left out with a line for the user. Nothing
outside the OBJ's folder is opened, nor anything large: an OBJ from elsewhere could name any file.

A reader of our own because the installed library (trimesh 5) ends in a bare IndexError on a face that names a missing
vertex, joins objects into one mesh, and fans polygons that have notches.

Sources: Wavefront, Object Files, appendix B1, and its MTL material format; Pm and Pr from its widespread PBR extension.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from planner_core.errors import SceneError, one_line
from planner_core.model import Element, FloatArray, Int64Array, Optics, UInt8Array
from planner_core.scene.materials import optics_of_material, optics_of_name
from planner_core.scene.raw import RawScene, triangulate, what_it_looks_like

_AFTER_SLASH = re.compile(rb"/\S*")
_LARGEST_BYTES = 16 * 2**20
"""Of all libraries together. A material takes some hundred bytes."""
_MOST_LIBRARIES = 100
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""What some programs begin UTF-8 with; no part of the first line."""


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
    contents = path.read_bytes().removeprefix(_BYTE_ORDER_MARK)
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


@dataclass
class _Library:
    """Materials read so far, and what there is to say about them."""

    figures: dict[str, dict[bytes, float]] = field(default_factory=dict)
    """By name of the material, by keyword of the line."""
    warnings: list[str] = field(default_factory=list)
    n_bytes: int = 0


def _optics_of_uses(obj: Path, names: Sequence[str], libraries: Iterable[str]) -> tuple[UInt8Array, tuple[str, ...]]:
    """Tell what the materials do that an OBJ uses.

    Parameters
    ----------
    obj : the OBJ file. names : what its `usemtl` lines say. libraries : what its `mtllib` lines say.

    Returns
    -------
    (len(names),) uint8 of `Optics`, and lines for the user.
    """
    library = _Library()
    wanted = list(dict.fromkeys(libraries))
    for line in wanted[:_MOST_LIBRARIES]:
        for path in _files(obj, line, library.warnings):
            _read(obj, path, library)
    if len(wanted) > _MOST_LIBRARIES:
        library.warnings.append(f"{obj.name} names {len(wanted)} material libraries: {_MOST_LIBRARIES} were read.")
    if wanted and not library.figures and not library.warnings:
        named = ", ".join(one_line(line[:100]) for line in wanted[:3])
        library.warnings.append(
            f"{obj.name}: no material was read from its material library ({named}): glass and mirrors are recognised "
            "by material names only; put the library beside it."
        )
    optics_of = {name: _optics(name, library.figures.get(name)) or Optics.RETURNS for name in dict.fromkeys(names)}
    return np.array([optics_of[name] for name in names], dtype=np.uint8), tuple(library.warnings)


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
    of_use, warnings = _optics_of_uses(path, lines.materials, lines.libraries)
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


def _files(obj: Path, line: str, warnings: list[str]) -> list[Path]:
    """Files that a `mtllib` line names and that are there: one whose name may have blanks, or several."""
    whole = _file_beside(obj, line, warnings)
    if whole is not None or len(line.split()) < 2:
        return [] if whole is None else [whole]
    return [path for word in line.split() if (path := _file_beside(obj, word, warnings)) is not None]


def _file_beside(obj: Path, name: str, warnings: list[str]) -> Path | None:
    """A file in the folder of `obj` or below it; None where there is none, with a warning where it lies elsewhere."""
    try:
        folder = obj.parent.resolve()
        path = (folder / name.replace("\\", "/")).resolve()
        if path.is_relative_to(folder):
            return path if path.is_file() else None
    except (OSError, ValueError):  # no file can have such a name
        return None
    warnings.append(f"{obj.name}: its material library {one_line(name[:200])} is outside its folder and was not read.")
    return None


def _read(obj: Path, path: Path, library: _Library) -> None:
    """Take in a library's materials; the first of a name counts."""
    try:
        with path.open("rb") as file:
            contents = file.read(_LARGEST_BYTES - library.n_bytes + 1)
    except OSError as error:
        reason = error.strerror or error
        library.warnings.append(f"{obj.name}: its material library {one_line(path.name)} can't be read ({reason}).")
        return
    if library.n_bytes + len(contents) > _LARGEST_BYTES:
        library.warnings.append(
            f"{obj.name}: its material library {one_line(path.name)} was not read: libraries of more than "
            f"{_LARGEST_BYTES // 2**20} MiB are not read."
        )
        return
    library.n_bytes += len(contents)
    figures: dict[bytes, float] = {}
    for line in contents.removeprefix(_BYTE_ORDER_MARK).splitlines():
        word, _, rest = line.partition(b"#")[0].replace(b"\t", b" ").strip().partition(b" ")
        if word == b"newmtl":
            figures = {}
            library.figures.setdefault(rest.strip().decode("utf-8", "replace"), figures)
        elif word in (b"d", b"Tr", b"Pm", b"Pr"):
            figures.update(_figure(word, rest))


def _figure(word: bytes, rest: bytes) -> dict[bytes, float]:
    """The figure of a line; nothing where there is none, as where `d -halo` depends on the angle of view."""
    try:
        return {word: float(rest)}
    except ValueError:
        return {}


def _optics(name: str, figures: dict[bytes, float] | None) -> Optics | None:
    """Optics by a material's name, else by its figures: dissolve `d`, 1 opaque; transparency `Tr`; metal and roughness.

    `Tr 1` without `d` is ambiguous: half of the programs that write it mean opaque.
    """
    if figures is None:
        return optics_of_name(name)
    transparency = figures.get(b"Tr")
    if b"d" in figures:
        transparency = 1.0 - figures[b"d"]
    elif transparency == 1.0:
        transparency = None
    return optics_of_material(
        [name], transparency=transparency, metallic=figures.get(b"Pm"), roughness=figures.get(b"Pr")
    )
