"""Whose turn it is: one run at a time in a plan folder, whichever server started it, and whether it still is alive.

The turn is a lock (`flock`) on a file. The server takes it, and its run inherits it: it ends with the run's process,
however that dies, and outlives the server. Where the file system knows no locks nobody ever holds a turn.
"""

import contextlib
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path

from planner_core.operating_system import take_lock

FILE = ".turn"
#: Others that look whether there is a holder hold the lock for an instant themselves.
_TRIES, _PAUSE_S = 50, 0.02


@dataclass(frozen=True)
class Holder:
    """The run that has its turn. pid : of its process; None: not known yet."""

    run: str
    pid: int | None


def take_turn(folder: Path) -> int | None:
    """Return the handle of the lock, to be closed once the run has inherited it; None where another run has it."""
    handle = os.open(folder / FILE, os.O_RDWR | os.O_CREAT, 0o644)
    for _ in range(_TRIES):
        try:
            take_lock(handle, wait=False)
        except BlockingIOError:
            time.sleep(_PAUSE_S)
        except OSError:  # a file system without locks
            return handle
        else:
            return handle
    os.close(handle)
    return None


def tell_turn(handle: int, run: str, pid: int | None = None) -> None:
    """Write down who holds the lock."""
    os.lseek(handle, 0, os.SEEK_SET)
    os.write(handle, json.dumps({"run": run, "pid": pid}).ljust(128).encode())


def holder_of_turn(folder: Path) -> Holder | None:
    """Return who has the turn; None where nobody has."""
    try:
        handle = os.open(folder / FILE, os.O_RDONLY)
    except OSError:
        return None
    try:
        with contextlib.suppress(BlockingIOError):
            take_lock(handle, shared=True, wait=False)
            return None
        return _holder(handle)
    except OSError:  # a file system without locks
        return None
    finally:
        os.close(handle)


def last_run(folder: Path) -> str:
    """Return the run that had the turn last, whether or not it still has it; empty where there was none."""
    try:
        handle = os.open(folder / FILE, os.O_RDONLY)
    except OSError:
        return ""
    try:
        return _holder(handle).run
    finally:
        os.close(handle)


def _holder(handle: int) -> Holder:
    try:
        row = json.loads(os.read(handle, 1024))
        return Holder(str(row["run"]), row["pid"])
    except (ValueError, KeyError, TypeError):  # somebody has just taken the lock, or somebody else wrote this
        return Holder("", None)
