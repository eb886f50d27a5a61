"""The material libraries beside a Wavefront OBJ: which of its materials return beams, let them pass, or stop them.

Scene stage. A library is a help, not a need: materials of a missing one are recognised by their names alone, and one
that is missing, can't be read or should not be is left out with a line for the user. Nothing outside the OBJ's folder
is opened, nor anything large: an OBJ from elsewhere could name any file.
Source: Wavefront, MTL material format; Pm and Pr from its widespread PBR extension.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from planner_core.errors import one_line
from planner_core.model import Optics, UInt8Array
from planner_core.scene.materials import optics_of_material, optics_of_name

_LARGEST_BYTES = 16 * 2**20
"""Of all libraries together. A material takes some hundred bytes."""
_MOST_LIBRARIES = 100
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""What some programs begin UTF-8 with; no part of the first line."""


@dataclass
class _Library:
    """Materials read so far, and what there is to say about them."""

    figures: dict[str, dict[bytes, float]] = field(default_factory=dict)
    """By name of the material, by keyword of the line."""
    warnings: list[str] = field(default_factory=list)
    n_bytes: int = 0


def optics_of_uses(obj: Path, names: Sequence[str], libraries: Iterable[str]) -> tuple[UInt8Array, tuple[str, ...]]:
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
    for line in contents.removeprefix(BYTE_ORDER_MARK).splitlines():
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
