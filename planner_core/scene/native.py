"""Readers that stand on a native library, IfcOpenShell, USD's or Draco, each in a child process.

A damaged file makes such a library crash, hang, or take all memory: here that is a `SceneError` which names the file
and what was being read. IfcOpenShell makes shapes in several threads, and so nobody knows whose shape it crashed on:
a second child then makes the missing ones one by one.
"""

from __future__ import annotations

import os
from pathlib import Path

from planner_core import child_process
from planner_core.child_process import LostChildError, limits_for, progress_of_child
from planner_core.errors import SceneError, one_line
from planner_core.model import Element, Georeference, LoadReport, Room, Storey
from planner_core.progress import Progress
from planner_core.scene.ifc_shapes import SHAPES
from planner_core.scene.raw import RawScene

_CLASSES = (RawScene, Element, Storey, Room, LoadReport, Georeference)
_LIBRARY = {"ifc": "IfcOpenShell", "usd": "the USD library", "gltf": "the Draco library"}
_CHECK = {"ifc": "an IFC validator", "usd": "usdchecker", "gltf": "a glTF validator"}


def read_apart(path: Path, file_format: str, *, skip_bad_faces: bool, progress: Progress) -> RawScene:
    """Read a file of a format with a native library (`ifc`, `usd`, `gltf`) in a child process.

    Raises
    ------
    SceneError
        As the reader does, and where its library crashes, hangs or takes too much memory.
    MissingPackageError
        The library is not installed.
    """
    limits = limits_for(path.stat().st_size)
    arguments = {"path": os.fspath(path), "file_format": file_format, "skip_bad_faces": skip_bad_faces}
    try:
        raw: RawScene = child_process.run_apart(
            "planner_core.scene.native:read",
            arguments,
            classes=_CLASSES,
            limits=limits,
            stage="load",
            progress=progress,
        )
    except LostChildError as lost:
        place = _culprit(path, lost, progress) if lost.place == SHAPES else lost.place
        reading = f" while reading {one_line(place)}" if place else ""
        raise SceneError(
            f"{path.name}: {_LIBRARY[file_format]} {lost}{reading}, expected a file that it can read; repair or leave "
            f"out what is named, check the file with {_CHECK[file_format]}, or export it again."
        ) from lost
    except MemoryError as error:
        raise SceneError(
            f"{path.name}: reading it takes more memory than there is; export it in parts, or without furniture."
        ) from error
    return raw


def read(path: str, file_format: str, skip_bad_faces: bool) -> RawScene:
    """What the child does."""
    if file_format == "ifc":
        from planner_core.scene.ifc import read_ifc

        return read_ifc(Path(path), progress=progress_of_child)
    if file_format == "gltf":
        from planner_core.scene.gltf import read_gltf

        return read_gltf(Path(path), skip_bad_faces=skip_bad_faces)
    from planner_core.scene.usd import read_usd

    return read_usd(Path(path), skip_bad_faces=skip_bad_faces, progress=progress_of_child)


def _culprit(path: Path, lost: LostChildError, progress: Progress) -> str:
    """The element whose shape ends a child, when those that were not yet made are made one by one."""
    try:
        child_process.run_apart(
            "planner_core.scene.ifc:make_one_by_one",
            {"path": os.fspath(path), "made": list(lost.log)},
            classes=(),
            limits=limits_for(path.stat().st_size),
            stage="load",
            progress=progress,
        )
    except LostChildError as found:
        return found.place
    return lost.place
