"""Makes the process fit for a user before anything heavy is imported: signals, caches, streams, warnings.

- A Ctrl-C that arrives while a compiled package starts up would be lost there, or reported as an error of the package:
it
  waits until it is loaded. One that strikes what Python calls by the way (`__del__`, a callback of a weak reference)
  would be printed and lost: it is raised again at once. Any other that is lost is, at the next step of progress.
- Compilers and fonts keep caches below the home folder. Where that can't be written they go to a temporary folder.
- Warnings of packages are for developers: they are shown with --debug only.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import signal
import sys
import tempfile
import warnings
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from planner_core.operating_system import Alarm

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

#: Between two looks whether what an interrupt waits for is over.
_LOOK_AGAIN_S = 0.005

_interrupted = False
_waits = False
_must_end = False
_caches_are_kept = True
_own_caches: str | None = None
_alarm: Alarm | None = None


def prepare(*, debug: bool) -> None:
    """Do all of it; safe to call once, first."""
    global _alarm
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller (`2>&-`)
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123 (lives with the process)
    signal.signal(signal.SIGINT, _note_interrupt)
    signal.signal(signal.SIGTERM, _note_interrupt)  # logout and batch queues send it: what is half-written has to go
    _alarm = Alarm(_look_again)
    sys.unraisablehook = _hear_unraisable
    if not debug:
        warnings.simplefilter("ignore")
    os.environ.pop("MPLBACKEND", None)  # no window is opened, and matplotlib can't be imported with an unknown one
    _use_writable_caches()


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt where one was swallowed since the last call."""
    global _interrupted
    if _interrupted:
        _interrupted = False
        _raise()


def is_interrupted() -> bool:
    """Whether a Ctrl-C came that has ended nothing yet: what fails then may be a package that took it for an error."""
    return _interrupted


def raise_what_waits() -> None:
    """Raise KeyboardInterrupt where one still waits: the work ended before the next look."""
    if _waits:
        _raise()


def settle_interrupts() -> None:
    """Forget a Ctrl-C that ended what it was meant to end; SIGTERM ends all of it."""
    global _interrupted
    _interrupted = _must_end


def leave_at_once(code: int) -> NoReturn:
    """End the process but for Python's own way out, which aborts under a thread that is inside a compiler."""
    _remove_own_caches()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # its reader went away
            stream.flush()
    os._exit(code)


def check_caches_are_kept(variable: str) -> None:
    """Refuse work whose only use is to be kept, where caches go with the process and `variable` names no other place.

    Raises
    ------
    RequirementError
        The home folder can't be written.
    """
    if _caches_are_kept or os.environ.get(variable):
        return
    from planner_core.errors import RequirementError

    raise RequirementError(
        "cache folder: got a home folder that can't be written, expected a writable one for the result; set "
        f"{variable} to one"
    )


def _note_interrupt(number: int, frame: FrameType | None) -> None:
    global _interrupted, _must_end
    _interrupted = True
    _must_end = _must_end or number == signal.SIGTERM
    _raise_unless_loading(frame)


def _look_again(number: int, frame: FrameType | None) -> None:
    if _waits:
        _raise_unless_loading(frame)


def _raise_unless_loading(frame: FrameType | None) -> None:
    while frame is not None:
        if isinstance(frame.f_locals.get("self"), ExtensionFileLoader):  # its C code may be what imports, as in pxr
            _wait()
            return
        frame = frame.f_back
    _raise()


def _hear_unraisable(unraisable: UnraisableHookArgs) -> None:
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        _wait()
    else:
        sys.__unraisablehook__(unraisable)


def _wait() -> None:
    global _waits
    _waits = True
    if _alarm is not None:
        _alarm.set(_LOOK_AGAIN_S)


def _raise() -> NoReturn:
    global _waits
    _waits = False
    if _alarm is not None:
        _alarm.set(0)
    raise KeyboardInterrupt


def _use_writable_caches() -> None:
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path(os.environ.get("HOME") or "/nonexistent") / ".cache")
    if os.access(_nearest(root), os.W_OK | os.X_OK):
        return
    global _caches_are_kept, _own_caches
    _caches_are_kept = False
    _own_caches = tempfile.mkdtemp(prefix="tlsplan-cache-")
    atexit.register(_remove_own_caches)
    for variable in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR"):
        os.environ[variable] = _own_caches


def _nearest(folder: Path) -> Path:
    """Return the folder, or the one above it that is there; one that can't be read counts as there."""
    for each in (folder, *folder.parents):
        try:
            each.stat()
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError:  # no permission to enter the one above, a name too long
            return each
        return each
    return folder


def _remove_own_caches() -> None:
    if _own_caches is not None:
        shutil.rmtree(_own_caches, ignore_errors=True)
