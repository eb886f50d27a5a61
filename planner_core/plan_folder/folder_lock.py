"""One writer at a time inside a plan folder: those who change its review, and whoever puts another plan in its place.

The lock (`flock`) is on the folder itself, so it leaves no file behind and ends with its process, however that dies.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from planner_core.errors import PlanFolderError
from planner_core.operating_system import open_folder, take_lock


@contextlib.contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Hold the lock on the folder that bears this name, waiting for it; where a file system has no locks, nothing.

    Raises
    ------
    PlanFolderError
        There is no such folder.
    """
    handle = _lock(folder)
    try:
        yield
    finally:
        if handle is not None:
            os.close(handle)


def _lock(folder: Path) -> int | None:
    while True:
        try:
            handle = open_folder(folder)
        except OSError as error:
            raise PlanFolderError(
                f"{folder}: can't be opened ({error.strerror}), expected a plan folder; check the path"
            ) from error
        if handle is None:
            return None
        with contextlib.suppress(OSError):  # a file system without locks
            take_lock(handle)
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(handle), folder.stat()):
                return handle
        os.close(handle)  # another folder took its place meanwhile
