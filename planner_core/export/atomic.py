"""Folders and files that appear whole or not at all: written beside, synced, then renamed.

A folder NAME is staged as `.NAME.partial-<pid>` beside it, on the same file system. Where it replaces an older one, the
two are exchanged in one step (Linux `renameat2`): a run killed at any moment leaves the old folder or the new one under
NAME, and at worst the other one under the staging name, which the next run removes. File systems without that call get
two renames; a run killed between them leaves the old folder as `.NAME.old-<pid>`, which `recover` puts back.

A staging folder is in use while its writer holds a lock on it (`flock`), which ends with the process, however it dies.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from planner_core.errors import OutputExistsError

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.EPERM)


@contextlib.contextmanager
def staged_folder(folder: Path, *, replace: bool) -> Iterator[Path]:
    """Yield an empty staging folder; on leaving it becomes `folder`, on an exception it is removed.

    Raises
    ------
    OutputExistsError
        `folder` appeared meanwhile and `replace` is not set.
    """
    folder = folder.absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    recover(folder)
    staging = folder.with_name(f".{folder.name}.partial-{os.getpid()}")
    staging.mkdir()
    lock = os.open(staging, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield staging
        sync_tree(staging)
        _install(staging, folder, replace=replace)
    finally:
        # After an exchange the staging name holds the old folder; after a rename nothing; after a failure the rest.
        shutil.rmtree(staging, ignore_errors=True)
        os.close(lock)


def recover(folder: Path) -> None:
    """Put back what a killed run left: an old folder moved aside comes back, unused staging folders go."""
    folder = folder.absolute()
    for aside in _siblings(folder, "old"):
        if not folder.exists():
            aside.rename(folder)
        else:
            shutil.rmtree(aside, ignore_errors=True)
    for stale in _siblings(folder, "partial"):
        if not _in_use(stale):
            shutil.rmtree(stale, ignore_errors=True)


@contextlib.contextmanager
def staged_file(path: Path) -> Iterator[Path]:
    """Yield a name beside `path`, of the same suffix; on leaving it becomes `path`, on an exception it is removed."""
    staging = path.with_name(f".{path.stem}.partial-{os.getpid()}{path.suffix}")
    try:
        yield staging
        staging.replace(path)
    finally:
        staging.unlink(missing_ok=True)


def sync_tree(folder: Path) -> None:
    """Have the disk hold every file and folder below `folder` before anything is renamed."""
    for path in (*folder.rglob("*"), folder):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _siblings(folder: Path, what: str) -> list[Path]:
    prefix = f".{folder.name}.{what}-"
    if not folder.parent.is_dir():
        return []
    found = [path for path in folder.parent.iterdir() if path.name.startswith(prefix)]
    return sorted(path for path in found if path.name[len(prefix) :].isdigit())


def _in_use(staging: Path) -> bool:
    try:
        handle = os.open(staging, os.O_RDONLY)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    else:
        return False
    finally:
        os.close(handle)


def _install(staging: Path, folder: Path, *, replace: bool) -> None:
    if replace and folder.exists():
        if not _exchange(staging, folder):
            _swap_by_two_renames(staging, folder)
    else:
        try:
            staging.rename(folder)  # over nothing, or over an empty folder
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise
            raise OutputExistsError(
                f"{folder}: appeared while it was being written, expected a free name; pass --overwrite to replace it"
            ) from error
    _sync_folder(folder.parent)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two names in one step; False where the system or file system can't."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is None:
        return False
    if renameat2(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in _UNSUPPORTED:
        return False
    raise OSError(code, os.strerror(code), str(other))


def _swap_by_two_renames(staging: Path, folder: Path) -> None:
    aside = folder.with_name(f".{folder.name}.old-{os.getpid()}")
    folder.rename(aside)
    try:
        staging.rename(folder)
    except BaseException:
        aside.rename(folder)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
