"""Folders at workers: files that are sent there once, by content, and file jobs whose files are fetched in pieces.

A file job is a job whose tasks leave files. It runs in a thread beside the worker's own, which answer how far it
is; one that nobody asks about for `LEASE_S` is ended, and its folder goes: whoever gave it is gone. All of it lies in
the worker's own directory, which Dask removes.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Thread
from typing import Any

from planner_core.cluster.worker import FAULTS, LackingError, bug_of, job_of, kept
from planner_core.errors import DeviceError, MissingPackageError, PlannerError, is_of_full_disk, one_line
from planner_core.executor import NotWantedError, Outcome, Place

LEASE_S = 120.0
#: Nothing larger travels at once.
PIECE_BYTES = 4_000_000
#: With less than this no file job is begun.
LEAST_FREE_BYTES = 50_000_000
#: Files beyond these go, unless the next file job needs them.
_MOST_FILE_BYTES = 8_000_000_000


@dataclass(frozen=True)
class State:
    """How far a file job is. outcome : None while it goes on. made : names and sizes of its files; of folders, -1."""

    note: str
    outcome: Outcome | None
    made: tuple[tuple[str, int], ...] = ()


@dataclass
class _Going:
    folder: Path
    renewed_s: float
    is_wanted: bool = True
    note: str = ""
    outcome: Outcome | None = None
    ended: Event = field(default_factory=Event)

    def goes_on(self) -> bool:
        """Whether somebody waits for it."""
        return self.is_wanted and time.monotonic() - self.renewed_s < LEASE_S


_going: dict[str, _Going] = {}


# -------------------------------------------------------------------------------------------------- files
def lacks_files(digests: Sequence[str]) -> list[str]:
    """Return which files are not here; others go where there are too many, unless somebody may just need them."""
    folder = _own_folder("files")
    there = {path.name: path.stat() for path in folder.iterdir()}
    if sum(each.st_size for each in there.values()) > _MOST_FILE_BYTES:
        for name in there.keys() - set(digests):
            if time.time() - there[name].st_mtime > LEASE_S:
                (folder / name).unlink(missing_ok=True)
    for digest in there.keys() & set(digests):
        (folder / digest).touch()
    return [digest for digest in digests if digest not in there]


def take_piece(digest: str, sender: str, offset: int, content: bytes, is_last: bool) -> None:
    """Take the next piece of a file.

    Raises
    ------
    LackingError
        The pieces before it are not here.
    OSError
        The disk is full, or something else came than was sent.
    """
    target = _own_folder("files") / digest
    partial = target.with_name(f"{digest}.{sender}")
    if offset and not (partial.is_file() and partial.stat().st_size == offset):
        raise LackingError(digest)
    try:
        with partial.open("ab" if offset else "wb") as file:
            file.write(content)
    except OSError:
        partial.unlink(missing_ok=True)
        raise
    if is_last:
        with partial.open("rb") as file:
            arrived = hashlib.file_digest(file, "sha256").hexdigest()
        if arrived != digest:
            raise OSError(errno.EIO, "a file changed while it was sent")
        partial.replace(target)


# ------------------------------------------------------------------------------------------------- file jobs
def begin(number: str, digest: str, task: Any) -> None:
    """Begin a file job: a task of a job that was sent.

    Raises
    ------
    LackingError
        The job is not here.
    OSError
        The disk has no room.
    """
    job = job_of(digest)
    folder = _own_folder("file_jobs")
    free = shutil.disk_usage(folder).free
    if free < LEAST_FREE_BYTES:
        raise OSError(errno.ENOSPC, f"its disk has {free / 1e6:.0f} MB left, expected {LEAST_FREE_BYTES / 1e6:.0f}")
    files = _own_folder("files")
    going = _Going(folder / number, time.monotonic())

    def tell(note: str) -> None:
        going.note = note

    def work() -> None:
        place = Place(going.folder, going.folder / "made", lambda name: files / name, going.goes_on, tell, kept)
        try:
            place.made.mkdir(parents=True)
            going.outcome = job.do(task, place)
        except NotWantedError:
            going.is_wanted = False
        except BaseException as error:  # noqa: BLE001 - reported by `state`; Rust and C++ raise what is no Exception
            going.outcome = _outcome_of(error)
        going.ended.set()
        while going.goes_on():  # until it is fetched
            time.sleep(0.1)
        _going.pop(number, None)  # nobody gets a folder that goes
        shutil.rmtree(going.folder, ignore_errors=True)

    _going[number] = going
    Thread(target=work, name=f"file job {number}", daemon=True).start()


def _outcome_of(error: BaseException) -> Outcome:
    """What an error of a file job means: that this worker can't do it, that nobody can, or a bug."""
    if not isinstance(error, FAULTS):
        return Outcome(one_line(bug_of(error, error.__traceback__)), is_of_worker=True, is_bug=True)
    of_all = isinstance(error, PlannerError) and not isinstance(error, (DeviceError, MissingPackageError))
    message = one_line(str(error) or type(error).__name__)
    return Outcome(message, is_of_worker=not of_all or is_of_full_disk(error))


def state(number: str, wait_s: float) -> State:
    """Return how far a file job is, at once or, where it ends meanwhile, within some seconds; raises `LackingError`."""
    going = _of(number)
    going.ended.wait(wait_s)
    if going.outcome is None:
        return State(going.note, None)
    return State(going.note, going.outcome, tuple(_listed(going.folder / "made")))


def piece(number: str, offset: int) -> bytes:
    """Return a piece of what a file job made, its files one behind the other; raises `LackingError`."""
    made, parts, left = _of(number).folder / "made", list[bytes](), PIECE_BYTES
    for name, size in _listed(made):
        if offset < size and left > 0:
            with (made / name).open("rb") as file:
                file.seek(offset)
                parts.append(file.read(left))
            left -= len(parts[-1])
        offset = max(offset - max(size, 0), 0)
    return b"".join(parts)


def drop(number: str) -> None:
    """End a file job, and remove what it made."""
    going = _going.get(number)
    if going is not None:
        going.is_wanted = False


def _of(number: str) -> _Going:
    going = _going.get(number)
    if going is None or not going.goes_on():
        raise LackingError(number)
    going.renewed_s = time.monotonic()
    return going


def _listed(made: Path) -> Iterable[tuple[str, int]]:
    for path in sorted(made.rglob("*")):
        yield path.relative_to(made).as_posix(), -1 if path.is_dir() else path.stat().st_size


def _own_folder(name: str) -> Path:
    from distributed import get_worker

    # A worker imports from its folder, where one named as a package would hide that.
    folder = Path(get_worker().local_directory) / "tlsplan-files" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def linked(source: Path, target: Path) -> None:
    """Give a file another name, or copy it where that can't be."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileExistsError):
        try:
            os.link(source, target)
        except FileExistsError:
            raise
        except OSError:
            shutil.copyfile(source, target)
