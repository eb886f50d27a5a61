"""Folders and files that appear whole or not at all: written beside, synced, then renamed.

A folder NAME is staged as `.NAME.partial-<token>` beside it, on the same file system. Where it replaces an older one,
the two are exchanged in one step (Linux `renameat2`): a run killed at any moment leaves the old folder or the new one
under NAME, and at worst the other one under the staging name, which the next run removes. File systems without that
call get two renames; a run killed between them leaves the old folder as `.NAME.old-<token>`, which `recover` puts back.

Both names belong to whoever holds the lock (`flock`) on the file `.NAME.lock-<token>`, which ends with its process,
however that dies. A writer creates them only once it holds the lock on the file that bears the name, and removes the
file last; whoever cleans up holds the same lock meanwhile. Where the file system knows no locks, nothing is cleaned up.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from planner_core.errors import OutputExistsError, PlanFolderError

_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
_UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.EPERM)


@dataclass(frozen=True)
class _Names:
    """The names beside a folder that one writer uses."""

    lock: Path
    staging: Path
    aside: Path


@contextlib.contextmanager
def staged_folder(
    folder: Path, *, replace: bool, before_install: Callable[[Path], None] | None = None
) -> Iterator[Path]:
    """Yield an empty staging folder; on leaving it becomes `folder`, on an exception it is removed.

    Parameters
    ----------
    before_install
        Called with the staging folder when the disk holds it, as the last thing before it is put in place; it syncs
        what it adds. Raising from it leaves `folder` as it was.

    Raises
    ------
    OutputExistsError
        `folder` appeared meanwhile and `replace` is not set.
    PlanFolderError
        `folder` is in place, but the disk does not confirm it.
    """
    folder = folder.absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    recover(folder)
    names, lock = _claim(folder)
    try:
        names.staging.mkdir()
        yield names.staging
        sync_tree(names.staging)
        if before_install is not None:
            before_install(names.staging)
        _install(names, folder, replace=replace)
        _confirm(folder)
    finally:
        # After an exchange the staging name holds the old folder; after a rename nothing; after a failure the rest.
        _remove(names.staging, names.lock)
        os.close(lock)


def recover(folder: Path) -> None:
    """Put back what a killed run left: an old folder moved aside comes back, unused staging folders go."""
    folder = folder.absolute()
    for names in _left_beside(folder):
        lock = _lock_if_unused(names.lock)
        if lock is None:
            continue
        try:
            if names.aside.exists() and not folder.exists():
                names.aside.rename(folder)
            shutil.rmtree(names.aside, ignore_errors=True)
            _remove(names.staging, names.lock)
        finally:
            os.close(lock)


@contextlib.contextmanager
def staged_file(path: Path) -> Iterator[Path]:
    """Yield a name beside `path`, of the same suffix; on leaving it becomes `path`, on an exception it is removed."""
    staging = path.with_name(f".{path.stem}.partial-{secrets.token_hex(4)}{path.suffix}")
    try:
        yield staging
        staging.replace(path)
    finally:
        staging.unlink(missing_ok=True)


@contextlib.contextmanager
def scratch_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path` for what has to wait; on leaving it is removed, whatever happened."""
    # Its name is chosen before it is there: an interrupt inside `tempfile` can leave a folder that nobody knows of.
    scratch = path.with_name(f".{path.stem}.waiting-{secrets.token_hex(4)}")
    try:
        scratch.mkdir()
        yield scratch
    finally:
        try:
            shutil.rmtree(scratch, ignore_errors=True)
        except BaseException:  # an interrupt while it was being removed
            shutil.rmtree(scratch, ignore_errors=True)
            raise


def sync_tree(folder: Path) -> None:
    """Have the disk hold every file and folder below `folder`; links and devices are not looked into."""
    for path in (*folder.rglob("*"), folder):
        mode = path.lstat().st_mode
        if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            sync(path)


def sync(path: Path) -> None:
    """Have the disk hold a file or a folder's names, as far as the file system knows how: some can't sync folders."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            raise
    finally:
        os.close(handle)


def _names(folder: Path, token: str) -> _Names:
    return _Names(*(folder.with_name(f".{folder.name}.{what}-{token}") for what in ("lock", "partial", "old")))


def _claim(folder: Path) -> tuple[_Names, int]:
    """Names that nobody else uses, and the handle of their lock."""
    prefix = f".{folder.name}.lock-"
    while True:
        handle, path = tempfile.mkstemp(prefix=prefix, dir=folder.parent)
        with contextlib.suppress(OSError):  # a file system without locks: `recover` can't take it either
            fcntl.flock(handle, fcntl.LOCK_EX)
        if _is_named(handle, Path(path)):
            return _names(folder, Path(path).name[len(prefix) :]), handle
        os.close(handle)  # somebody cleaned the file up before it was locked


def _left_beside(folder: Path) -> list[_Names]:
    if not folder.parent.is_dir():
        return []
    lock = re.compile(rf"\.{re.escape(folder.name)}\.lock-([a-z0-9_]{{8}})")
    found = (lock.fullmatch(path.name) for path in folder.parent.iterdir())
    return [_names(folder, token) for token in sorted(match[1] for match in found if match)]


def _lock_if_unused(path: Path) -> int | None:
    """Handle of a lock nobody holds; None where it is held, gone, another user's, or can't be locked at all."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if _is_named(handle, path):
            return handle
    except OSError:
        pass
    os.close(handle)
    return None


def _is_named(handle: int, path: Path) -> bool:
    """Whether the open file is still the one that bears the name."""
    try:
        return os.path.samestat(os.fstat(handle), path.lstat())
    except FileNotFoundError:
        return False


def _remove(staging: Path, lock: Path) -> None:
    """Remove a staging folder, and its lock unless something of the folder stays: the next run tries again."""
    shutil.rmtree(staging, ignore_errors=True)
    if not os.path.lexists(staging):
        with contextlib.suppress(OSError):  # an empty hidden file is no reason to call a written plan failed
            lock.unlink(missing_ok=True)


def _install(names: _Names, folder: Path, *, replace: bool) -> None:
    try:
        names.staging.rename(folder)  # over nothing, or over an empty folder
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
            raise
        if not replace or error.errno == errno.ENOTDIR:
            raise OutputExistsError(
                f"{folder}: appeared while it was being written, expected a free name; pass --overwrite to replace it"
            ) from error
        if not _exchange(names.staging, folder):
            _swap_by_two_renames(names, folder)


def _confirm(folder: Path) -> None:
    try:
        sync(folder.parent)
    except OSError as error:
        raise PlanFolderError(
            f"{folder}: is written and in place, but the disk does not confirm it ({error.strerror or error}); "
            "check the disk and read the plan back"
        ) from error


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


def _swap_by_two_renames(names: _Names, folder: Path) -> None:
    try:
        folder.rename(names.aside)
        names.staging.rename(folder)
    except BaseException as error:
        if os.path.lexists(names.aside) and not os.path.lexists(folder):
            names.aside.rename(folder)
        if isinstance(error, OSError) and os.path.lexists(names.aside):
            raise OutputExistsError(
                f"{folder}: another run wrote it at the same moment, expected to be alone; what was there before is in "
                f"{names.aside}"
            ) from error
        raise
    shutil.rmtree(names.aside, ignore_errors=True)
