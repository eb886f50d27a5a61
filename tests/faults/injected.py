"""Faults of disk, system and clock, put into this process at the n-th change that it makes to files below a folder.

`install` follows the variable TLSPLAN_FAULT (`Fault` as JSON) and takes it out of the environment, so that processes
which this one begins are sound. A change is: a file opened for writing, what is written to it, a sync, a rename, a
removal, a folder made. It is met just before it happens, in whatever thread.

Why in Python, and not by strace or a library loaded before others: that needs neither tracing rights, nor a compiler,
nor Linux, and the count of a run is the same in the next one. What native libraries write is not met: that goes into
staged folders and files, and it is Python that syncs them and gives them their names.
"""

from __future__ import annotations

import builtins
import errno
import io
import json
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any

VARIABLE = "TLSPLAN_FAULT"
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES = ("os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link", "os.symlink", "os.truncate")
_NOT_MET = {
    "ENOSPC": ("os.remove", "os.rmdir", "os.truncate"),
    "EDQUOT": ("os.remove", "os.rmdir", "os.truncate"),
    "EIO": ("os.remove",),
}
"""What a fault spares: a full disk lets files be removed."""


@dataclass(frozen=True)
class Fault:
    """One fault.

    kind : `kill`, the name of an error number (`ENOSPC`), or `clock`; empty: none, changes are counted only.
    at : of which change, from 1. below : folder. told : file that gets a line for each change. lasts : all changes from
    there on fail, as on a disk that is full; else that one.
    """

    below: str
    told: str = ""
    kind: str = ""
    at: int = 0
    lasts: bool = True


class _Faulty:
    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        self.n = 0
        self.lock = threading.RLock()
        self.jump_s = 0.0
        self.told = os.open(fault.told, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600) if fault.told else None

    def meet(self, what: str, path: Any) -> None:
        # Not pathlib: its calls would be met, too.
        name = os.path.abspath(os.fsdecode(path)) if isinstance(path, str | bytes | os.PathLike) else str(path)  # noqa: PTH100
        if not name.startswith(self.fault.below):
            return
        with self.lock:
            self.n += 1
            n = self.n
            if self.told is not None:
                _write(self.told, f"{n} {what} {name}\n".encode(errors="replace"))
        kind = self.fault.kind
        if not kind or n < self.fault.at or (n > self.fault.at and not self.fault.lasts):
            return
        if kind == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        elif kind == "clock":
            self.jump_s = 3e7 if n % 2 else -3e8
        elif what not in _NOT_MET.get(kind, ()):
            code = getattr(errno, kind)
            raise OSError(code, os.strerror(code), name)


_write, _sync, _open, _time = os.write, os.fsync, io.open, time.time


def install() -> None:
    """Put in what TLSPLAN_FAULT says."""
    faulty = _Faulty(Fault(**json.loads(os.environ.pop(VARIABLE))))

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            if isinstance(arguments[2], int) and arguments[2] & _WRITES:
                faulty.meet("open", arguments[0])
        elif event in _CHANGES:
            faulty.meet(event, arguments[1] if event in ("os.rename", "os.link", "os.symlink") else arguments[0])

    class Raw(io.FileIO):
        """A file whose every write is met."""

        def write(self, data: Any) -> Any:
            faulty.meet("write", self.name)
            return super().write(data)

    def opened(
        file: Any, mode: str = "r", buffering: int = -1, encoding: Any = None, errors: Any = None, newline: Any = None,
        closefd: bool = True, opener: Any = None,
    ) -> Any:  # fmt: skip
        if not set(mode) & set("wax+"):
            return _open(file, mode, buffering, encoding, errors, newline, closefd, opener)
        raw = Raw(file, mode.replace("b", "").replace("t", ""), closefd, opener)
        if buffering == 0:
            return raw
        buffer = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        if "b" in mode:
            return buffer
        text = io.TextIOWrapper(buffer, encoding, errors, newline, line_buffering=buffering == 1)
        text.mode = mode
        return text

    def path_of(handle: int) -> str:
        try:
            return os.readlink(f"/proc/self/fd/{handle}")  # noqa: PTH115
        except OSError:
            return ""

    def sync(handle: Any) -> None:
        faulty.meet("fsync", path_of(handle if isinstance(handle, int) else handle.fileno()))
        _sync(handle)

    def write(handle: int, data: Any) -> int:
        faulty.meet("write", path_of(handle))
        return _write(handle, data)

    sys.addaudithook(audit)
    builtins.open = io.open = opened  # type: ignore[assignment]
    os.fsync, os.write = sync, write
    time.time = lambda: _time() + faulty.jump_s
