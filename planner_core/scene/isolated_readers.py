"""Readers that stand on a native library, IfcOpenShell, USD's or Draco, each in a child process.

A damaged file makes such a library crash, hang, or take all memory: here that is a `SceneError` which names the file
and what was being read. IfcOpenShell makes shapes in several threads, and so nobody knows whose shape it crashed on:
a second child then makes the missing ones one by one. So are elements found whose shape takes without end: they are
left out, and the file is read without them.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner_core import child_process
from planner_core.child_process import LIMIT_VARIABLE, ChildLimits, LostChildError, limits_for, progress_of_child
from planner_core.errors import SceneError, grouped, one_line
from planner_core.kept import Shelf
from planner_core.model import Element, Georeference, LoadReport, Room, Storey
from planner_core.progress import Progress, silent
from planner_core.scene.ifc_shapes import SHAPES
from planner_core.scene.raw import RawScene

_CLASSES = (RawScene, Element, Storey, Room, LoadReport, Georeference)
_LIBRARY = {"ifc": "IfcOpenShell", "usd": "the USD library", "gltf": "the Draco library"}
_CHECK = {"ifc": "an IFC validator", "usd": "usdchecker", "gltf": "a glTF validator"}
MOST_LEFT_OUT = 20
"""Elements of one file whose shape takes without end."""
_LEAST_SHARE = 0.125
"""Each that is found halves the time of the next ones, down to this share: in a file of many, all are found in about a
minute, and those that are a little slow go with them. Opening the file, which every search begins with, takes less."""
_ELEMENT = re.compile(r"#(\d+) ")


def read_apart(
    path: Path, file_format: str, *, skip_bad_faces: bool, progress: Progress, user_unit_m: float | None = None
) -> RawScene:
    """Read a file of a format with a native library (`ifc`, `usd`, `gltf`) in a child process.

    user_unit_m : of the user, for IFC that names no unit.

    Raises
    ------
    SceneError
        As the reader does, and where its library crashes, hangs or takes too much memory.
    MissingPackageError
        The library is not installed.
    """
    arguments = {
        "path": os.fspath(path),
        "file_format": file_format,
        "skip_bad_faces": skip_bad_faces,
        "user_unit_m": user_unit_m,
    }
    limits = limits_for(path.stat().st_size)
    try:
        try:
            return _read_before_or_now(path, arguments, limits, progress)
        except LostChildError as lost:
            if not (lost.is_slow and lost.place == SHAPES):
                raise
            slow = _slow_elements(path, lost, limits, progress)
        # The others take their time: none of them was too slow alone.
        return _read_without(path, slow, arguments, replace(limits, step_cpu_s=None), progress)
    except LostChildError as lost:
        place = _culprit(path, lost, progress) if lost.place == SHAPES and not lost.is_slow else lost.place
        raise _unreadable(path, file_format, lost, place) from lost
    except MemoryError as error:
        raise SceneError(
            f"{path.name}: reading it takes more memory than there is; export it in parts, or without furniture."
        ) from error


def open_tried(path: Path) -> Any:
    """IfcOpenShell's model of an IFC file, for who writes into it; a child process has opened and written it before.

    Raises
    ------
    SceneError
        As `open_model` does, and where the library crashes, hangs or takes too much memory.
    """
    from planner_core.scene.ifc import open_model

    try:
        child_process.run_isolated(
            "planner_core.scene.ifc:try_model",
            {"path": os.fspath(path)},
            classes=(),
            limits=limits_for(path.stat().st_size),
            stage="load",
            progress=silent,
        )
    except LostChildError as lost:
        raise _unreadable(path, "ifc", lost, lost.place) from lost
    return open_model(path)


def _unreadable(path: Path, file_format: str, lost: LostChildError, place: str) -> SceneError:
    reading = f" while reading {one_line(place)}" if place else ""
    return SceneError(
        f"{path.name}: {_LIBRARY[file_format]} {lost}{reading}, expected a file that it can read; repair or leave "
        f"out what is named, check the file with {_CHECK[file_format]}, or export it again."
    )


def _read_before_or_now(path: Path, arguments: dict[str, object], limits: ChildLimits, progress: Progress) -> RawScene:
    """Read a file, or have what was read of it before; other formats than IFC name further files, and are read anew."""
    if arguments["file_format"] != "ifc":
        return _read_apart(arguments, limits, progress)
    before = path.stat()
    with path.open("rb") as file:
        content = hashlib.file_digest(file, "sha256").hexdigest()
    facts = {**arguments, "path": path.name, "content": content}  # messages have its name
    shelf = Shelf("file", [*facts.values()], classes=_CLASSES)
    found: RawScene | None = shelf.find()
    if found is None:
        found = _read_apart(arguments, limits, progress)
        after = path.stat()
        if (after.st_mtime_ns, after.st_size) == (before.st_mtime_ns, before.st_size):
            shelf.put(found)
    return found


def _read_apart(arguments: dict[str, object], limits: ChildLimits, progress: Progress) -> RawScene:
    raw: RawScene = child_process.run_isolated(
        "planner_core.scene.isolated_readers:read",
        arguments,
        classes=_CLASSES,
        limits=limits,
        stage="load",
        progress=progress,
    )
    return raw


def _read_without(
    path: Path, slow: dict[int, str], arguments: dict[str, object], limits: ChildLimits, progress: Progress
) -> RawScene:
    """Read an IFC file but for the elements that are too slow, by number and title, and warn of them."""
    if not slow:
        return _read_apart(arguments, limits, progress)
    noun = "element takes" if len(slow) == 1 else "elements take"
    line = (
        f"{len(slow)} {noun} IfcOpenShell too long and {'is' if len(slow) == 1 else 'are'} left out: "
        f"{', '.join(one_line(title) for title in slow.values())}; simplify what is named, or set {LIMIT_VARIABLE}."
    )
    try:
        raw = _read_apart(arguments | {"left_out": list(slow)}, limits, progress)
    except SceneError as error:
        raise SceneError(f"{str(error).removesuffix('.')}; {line}") from error
    return replace(raw, report=replace(raw.report, warnings=(*raw.report.warnings, f"{path.name}: {line}")))


def read(
    path: str,
    file_format: str,
    skip_bad_faces: bool,
    user_unit_m: float | None = None,
    left_out: tuple[int, ...] = (),
) -> RawScene:
    """What the child does."""
    if file_format == "ifc":
        from planner_core.scene.ifc import read_ifc

        return read_ifc(Path(path), progress=progress_of_child, left_out=left_out, user_unit_m=user_unit_m)
    if file_format == "gltf":
        from planner_core.scene.gltf import read_gltf

        return read_gltf(Path(path), skip_bad_faces=skip_bad_faces)
    from planner_core.scene.usd import read_usd

    return read_usd(Path(path), skip_bad_faces=skip_bad_faces, progress=progress_of_child)


def _culprit(path: Path, lost: LostChildError, progress: Progress) -> str:
    """The element whose shape ends a child, when those that were not yet made are made one by one."""
    try:
        _make_one_by_one(path, lost.log, limits_for(path.stat().st_size), progress)
    except LostChildError as found:
        return found.place
    return lost.place


def _slow_elements(path: Path, lost: LostChildError, limits: ChildLimits, progress: Progress) -> dict[int, str]:
    """Number and title of the elements, of those not yet made, that are too slow when made one by one.

    Raises
    ------
    SceneError
        They are too many.
    """
    slow: dict[int, str] = {}
    made = set(lost.log)
    while True:
        try:
            _make_one_by_one(path, sorted(made), _limits_of_next(limits, len(slow)), progress)
        except LostChildError as found:
            element = _ELEMENT.match(found.place)
            if not (found.is_slow and element):
                raise
            slow[int(element.group(1))] = found.place
            made |= {*found.log, int(element.group(1))}
        else:
            return slow
        if len(slow) > MOST_LEFT_OUT:
            raise SceneError(
                f"{path.name}: more than {grouped(MOST_LEFT_OUT)} elements take IfcOpenShell too long, the first is "
                f"{one_line(next(iter(slow.values())))}; simplify them, or set {LIMIT_VARIABLE}."
            )


def _limits_of_next(limits: ChildLimits, n_found: int) -> ChildLimits:
    """Limits of the search for a slow element behind some that are found; as the user set them, where he did."""
    if limits.step_cpu_s is None or limits.whole_cpu_s is None:
        return limits
    return replace(limits, step_cpu_s=limits.step_cpu_s * max(0.5**n_found, _LEAST_SHARE))


def _make_one_by_one(path: Path, made: Collection[int], limits: ChildLimits, progress: Progress) -> None:
    child_process.run_isolated(
        "planner_core.scene.ifc:make_one_by_one",
        {"path": os.fspath(path), "made": list(made)},
        classes=(),
        limits=limits,
        stage="load",
        progress=progress,
    )
