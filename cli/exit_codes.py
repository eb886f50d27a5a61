"""Exit codes and the one line an error ends in; the table in `docs/reference/cli.md` is made from `EXIT_CODES`."""

from __future__ import annotations

import errno
import os
from pathlib import Path

#: That of a disk that takes no more.
FULL_DISK = 9
EXIT_CODES: dict[int, str] = {
    0: "done",
    1: "internal error: a bug of tlsplan; please report it with the output of --debug. Of doctor: something is "
    "missing, or a plan would fall back to the host",
    2: "the command line is wrong: unknown option, missing argument, bad value; or an environment variable is",
    3: "an input file can't be used: scene, station list, plan folder; or a file can't be read or written",
    4: "an option or requirement can't be met: unknown or unusable scanner, unknown scene or floor, no valid tripod "
    "position, a value out of its range, port in use",
    5: "the output exists; pass --overwrite",
    6: "the OpenCL device, a cluster, or a package or system library is missing or failed",
    7: "compare: scanned stations do not meet the requirements, or their network is worse than planned",
    8: "batch: a building could not be planned; export: a format could not be written; the others are",
    9: "a disk is full, or its quota used up",
    130: "interrupted (Ctrl-C or SIGTERM)",
}


def exit_code_of(error: BaseException) -> int:
    """Return the documented exit code of an error."""
    from planner_core import errors

    if errors.is_of_full_disk(error):
        return FULL_DISK
    by_type: tuple[tuple[type[BaseException], int], ...] = (
        (errors.EnvironmentVariableError, 2),
        (errors.RequirementError, 4),
        (errors.OutputExistsError, 5),
        (errors.DeviceError, 6),
        (errors.ClusterError, 6),
        (errors.MissingPackageError, 6),
        (errors.PlannerError, 3),
        (OSError, 3),
        (MemoryError, 6),
    )
    return next((code for kind, code in by_type if isinstance(error, kind)), 1)


def line_of(error: BaseException) -> str:
    """Return the line to show: the message itself for errors raised on purpose, a plea to report it for bugs."""
    from planner_core import errors

    return errors.one_line(_line_of(error))


def _line_of(error: BaseException) -> str:
    from planner_core.errors import PlannerError

    text = str(error).strip() or type(error).__name__
    if isinstance(error, PlannerError):
        return f"tlsplan: {text}"
    if isinstance(error, MemoryError):
        return (
            f"tlsplan: out of memory ({text}). Use a larger --patch-area or --grid, or plan floor by floor (--floor)."
        )
    if isinstance(error, OSError):
        return f"tlsplan: {_of_system(error)}"
    return (
        f"tlsplan: internal error: {type(error).__name__}: {text}. "
        "This is a bug: please report it with the output of `tlsplan --debug ...`."
    )


_REMEDIES = {
    errno.ENOSPC: "the disk is full; free some or give another path",
    errno.EDQUOT: "the disk quota is used up; free some or give another path",
    errno.EACCES: "permission is denied; give another path or change the permissions",
    errno.EPERM: "permission is denied; give another path or change the permissions",
    errno.EROFS: "the disk is read-only; give another path",
    errno.ENOENT: "there is no such file or folder; check the path",
    errno.ENOTDIR: "part of the path is a file, expected a folder; check the path",
    errno.EISDIR: "it is a folder, expected a file; name a file in it",
    errno.ENAMETOOLONG: "the name is too long for the disk; give a shorter one",
}


def _of_system(error: OSError) -> str:
    """What an error of the operating system means for the path that the user gave: not for our file beside it."""
    remedy = _REMEDIES.get(error.errno or 0)
    if remedy is None:
        return str(error).strip() or type(error).__name__
    if error.filename is None:
        return f"a file can't be read or written: {remedy}"
    path = Path(os.fsdecode(error.filename))
    while path.name.startswith("."):  # our own files beside the output are hidden
        path = path.parent
    return f"{path}: {remedy}"
