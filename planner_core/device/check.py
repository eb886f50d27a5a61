"""Whether a device can be trusted: its kernels are run in a child process first, and what they compute is checked.

A driver may crash the process that uses it, or compute wrong results without a word; both were seen. So before a device
is used, a child process runs `planner_core.self_check` on it; where kernels of the widest packets fail, once more with
narrower ones. That is done once for each driver, processor and state of
the kernels: the verdict is kept in the cache folder, unless it may have been bad luck (memory, a signal from outside).
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

from planner_core.cache import keep, kept_file, read_kept
from planner_core.device.runtime import NARROW_LANES, Device
from planner_core.operating_system import processor_flags

#: The module that the child runs: it knows all layers whose kernels it exercises, this one knows its name alone.
_CHILD = "planner_core.self_check"
#: What the child prints where all is well.
ALL_WELL = "all well"
#: Exit code of a child that can say in one line what is wrong.
FAULT_FOUND = 3
_SCHEMA = "tlsplan/device-check/2"
#: Compiling all kernels takes some seconds; on a busy machine a minute. A compiler given a wrong processor was seen to
#: hang: that verdict is kept, too, since every command would wait so long.
_TIME_LIMIT_S = 300.0
#: SIGILL, SIGTRAP, SIGABRT, SIGBUS, SIGFPE, SIGSEGV: the driver's own crashes. Others come from outside.
_CRASHES = {4: "illegal instruction", 5: "trap", 6: "abort", 7: "bus error", 8: "arithmetic error", 11: "bad address"}


def problem_of(device: Device, index: int, *, anew: bool = False) -> str:
    """Return why a device can't be trusted, or nothing where its kernels compute rightly.

    Lowers the device's `max_lanes` to what they do so with.

    Parameters
    ----------
    index
        Its number in `planner_core.device.list_devices`.
    anew
        Check again, whatever is kept.
    """
    holds_for = {**device.identity(), "processor": _processor()}
    file = kept_file("device-check", holds_for)
    kept = None if anew or file is None else _kept(file)
    if kept is not None:
        problem, device.max_lanes = kept[0], min(kept[1], device.max_lanes)
        return problem
    problem, is_certain = _ask_child(device, index)
    if problem and is_certain and device.max_lanes > NARROW_LANES:
        device.max_lanes = NARROW_LANES
        problem, is_certain = _ask_child(device, index)
    if is_certain and file is not None:
        _kept_verdict.cache_clear()
        lanes = device.max_lanes
        try:
            keep(file, {"schema": _SCHEMA, **holds_for, "problem": problem, "max_lanes": lanes})
        except OSError:
            _checked_here[file] = problem, lanes  # this process knows, the next will ask again
    return problem


def _processor() -> str:
    return hashlib.sha256(" ".join(processor_flags()).encode()).hexdigest()[:16]


#: Verdicts that could not be written.
_checked_here: dict[Path, tuple[str, int]] = {}


@lru_cache(maxsize=64)
def _kept_verdict(file: Path) -> tuple[str, int]:
    verdict = read_kept(file, _SCHEMA)
    return str(verdict["problem"]), int(verdict["max_lanes"])


def _kept(file: Path) -> tuple[str, int] | None:
    try:
        return _kept_verdict(file)
    except (OSError, ValueError, TypeError, KeyError):
        return _checked_here.get(file)


def _ask_child(device: Device, index: int) -> tuple[str, bool]:
    """What the child finds, and whether it would find so again."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-m", _CHILD, str(index), device.label, str(device.max_lanes)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=_TIME_LIMIT_S,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
    except subprocess.TimeoutExpired:
        return f"its kernels did not compile and run within {_TIME_LIMIT_S:g} s (`tlsplan doctor` tries again)", True
    except OSError as error:
        return f"a process to check it in could not be started ({error.strerror or error})", False
    # The last line: drivers print, too.
    last_line = (done.stdout.strip().splitlines() or [""])[-1]
    if done.returncode == 0 and last_line == ALL_WELL:
        return "", True
    if done.returncode == FAULT_FOUND:
        return last_line, True
    if -done.returncode in _CRASHES:
        return f"its driver crashes ({_CRASHES[-done.returncode]})", True
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return f"the process that checked it ended with {done.returncode} ({last[:200]})", False
