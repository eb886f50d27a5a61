"""Folders and files that appear whole or not at all: written beside, synced, then renamed.

A folder NAME is staged as `.NAME.partial-<token>` beside it, on the same file system. Where it replaces an older one,
the two are exchanged in one step (Linux `renameat2`): a run killed at any moment leaves the old folder or the new one
under NAME, and at worst the other one under the staging name, which the next run removes. File systems without that
call get two renames; a run killed between them leaves the old folder as `.NAME.old-<token>`, which `recover` puts back.

A file STEM.SUFFIX is staged likewise, as `.STEM.partial-<token>.SUFFIX`; what has to wait beside a target is in
`.STEM.waiting-<token>`.

These names belong to whoever holds the lock (`flock`) on the file `.NAME.lock-<token>`, of files with their suffix
behind, which ends with its process, however that dies. A writer creates them only once it holds the lock on the file
that bears the name, and removes the file last; whoever cleans up, which is the next writer of the same name, holds the
same lock meanwhile. Where the file system knows no locks, nothing is cleaned up.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.operating_system import NO_FOLLOW, REMOVES_OPEN_FILES, exchange, open_folder, sync, take_lock


@dataclass(frozen=True)
class _Names:
    """The names beside a folder or file that one writer uses."""

    lock: Path
    staging: Path
    aside: Path
    waiting: Path


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
    names, lock = _claim(folder.parent, folder.name)
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
        _release(names, lock)


def recover(folder: Path) -> None:
    """Put back what a killed run left: an old folder moved aside comes back, unused staging folders go."""
    folder = folder.absolute()
    for names, lock in _left_beside(folder.parent, folder.name):
        try:
            if names.aside.exists() and not folder.exists():
                names.aside.rename(folder)
            shutil.rmtree(names.aside, ignore_errors=True)
        finally:
            _release(names, lock)


@contextlib.contextmanager
def staged_file(path: Path) -> Iterator[Path]:
    """Yield a name beside `path`, of the same suffix; on leaving it becomes `path`, on an exception it is removed.

    What writers of the same path left when they were killed goes first.
    """
    names, lock = _claim_anew(path.parent, path.stem, path.suffix)
    try:
        yield names.staging
        names.staging.replace(path)
    finally:
        _release(names, lock)


@contextlib.contextmanager
def scratch_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path` for what has to wait; on leaving it is removed, whatever happened."""
    names, lock = _claim_anew(path.parent, path.stem)
    try:
        names.waiting.mkdir()
        yield names.waiting
    finally:
        try:
            shutil.rmtree(names.waiting, ignore_errors=True)
        finally:  # again, where an interrupt came while it was being removed
            _release(names, lock)


def check_writable(path: Path) -> None:
    """Refuse, before any work, a file or folder that could not be put in place: its staging is made and removed.

    Asking for permissions is not enough: they say nothing of file systems that take no files, of names that are too
    long once staged, and to a superuser. Folders above that are missing are made and removed, too.

    Raises
    ------
    PlanFolderError
        With the system's reason.
    """
    folder = path.absolute().parent
    missing = [each for each in (folder, *folder.parents) if not os.path.lexists(each)]
    made: list[Path] = []
    try:
        for each in reversed(missing):
            each.mkdir()
            made.append(each)
        names, lock = _claim(folder, path.name)
        try:
            names.staging.mkdir()
        finally:
            _release(names, lock)
    except OSError as error:
        remedy = "give a shorter name" if error.errno == errno.ENAMETOOLONG else "give another path"
        raise PlanFolderError(
            f"{path}: can't be written ({error.strerror or error}), expected a writable folder above it; {remedy}, or "
            "check the permissions and the free space"
        ) from error
    finally:
        for each in reversed(made):
            with contextlib.suppress(OSError):  # another run wrote into it meanwhile: it stays
                each.rmdir()


def sync_tree(folder: Path) -> None:
    """Have the disk hold every file and folder below `folder`; links and devices are not followed."""
    for path in (*folder.rglob("*"), folder):
        mode = path.lstat().st_mode
        if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
            sync(path)


def _names(parent: Path, stem: str, token: str, suffix: str) -> _Names:
    return _Names(*(parent / f".{stem}.{what}-{token}{suffix}" for what in ("lock", "partial", "old", "waiting")))


def _claim(parent: Path, stem: str, suffix: str = "") -> tuple[_Names, int]:
    """Names that nobody else uses, and the handle of their lock."""
    # Its folder is the absolute one, or two writers might not mean the same by it.
    parent = parent.absolute()
    while True:
        token = os.urandom(4).hex()
        names = _names(parent, stem, token, suffix)
        try:
            handle = os.open(names.lock, os.O_RDWR | os.O_CREAT | os.O_EXCL | NO_FOLLOW, 0o600)
            with contextlib.suppress(OSError):  # a file system without locks: `recover` can't take it either
                take_lock(handle)
            if _is_named(handle, names.lock):
                return names, handle
            os.close(handle)  # somebody cleaned the file up before it was locked
        except FileExistsError:
            continue
        except KeyboardInterrupt:  # of any moment since the name was taken: its file is ours
            names.lock.unlink(missing_ok=True)
            raise


def _claim_anew(parent: Path, stem: str, suffix: str = "") -> tuple[_Names, int]:
    """As `_claim`, once what killed writers of the same left is gone."""
    for names, lock in _left_beside(parent, stem, suffix):
        _release(names, lock)
    return _claim(parent, stem, suffix)


def _left_beside(parent: Path, stem: str, suffix: str = "") -> Iterator[tuple[_Names, int]]:
    """Names that writers left who are no more, with the handles of their locks: for the caller to release."""
    if not parent.is_dir():
        return
    lock_name = re.compile(rf"\.{re.escape(stem)}\.lock-([a-z0-9_]{{8}}){re.escape(suffix)}")
    found = (lock_name.fullmatch(path.name) for path in parent.iterdir())
    for token in sorted(match[1] for match in found if match):
        names = _names(parent, stem, token, suffix)
        handle = _lock_if_unused(names.lock)
        if handle is not None:
            yield names, handle


def _lock_if_unused(path: Path) -> int | None:
    """Handle of a lock nobody holds; None where it is held, gone, another user's, or can't be locked at all."""
    try:
        handle = os.open(path, os.O_RDWR | NO_FOLLOW)
    except OSError:
        return None
    try:
        take_lock(handle, wait=False)
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


def _release(names: _Names, lock: int) -> None:
    """Remove what is staged, and the lock unless something of it stays: the next run tries again."""
    try:
        left = (names.staging, names.waiting)
        for path in left:
            shutil.rmtree(path, ignore_errors=True)  # of a folder
            with contextlib.suppress(OSError):  # of a file
                path.unlink(missing_ok=True)
        if not any(os.path.lexists(path) for path in left):
            with contextlib.suppress(OSError):  # an empty hidden file is no reason to call what is written failed
                names.lock.unlink(missing_ok=True)
    finally:
        os.close(lock)
        if not REMOVES_OPEN_FILES and not any(os.path.lexists(path) for path in (names.staging, names.waiting)):
            with contextlib.suppress(OSError):
                names.lock.unlink(missing_ok=True)


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
        if not exchange(names.staging, folder):
            _swap_by_two_renames(names, folder)


def _confirm(folder: Path) -> None:
    try:
        sync(folder.parent)
    except OSError as error:
        raise PlanFolderError(
            f"{folder}: is written and in place, but the disk does not confirm it ({error.strerror or error}); "
            "check the disk and read the plan back"
        ) from error


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


# --------------------------------------------------------------------------------------------------------- folder lock
# One writer at a time inside a plan folder: those who change its review, and whoever puts another plan in its place.
# The lock (`flock`) is on the folder itself, so it leaves no file behind and ends with its process, however that dies.


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
