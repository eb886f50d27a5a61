"""What operating systems do differently, all in one place: locks, opening, exchanging names, priority, alarms.

No other module may use what Windows lacks (tests/test_portability.py). What is tested where: docs/howto/systems.md.
Windows has none of these locks: it is treated as a file system without locks is.
"""

from __future__ import annotations

import errno
import os
import signal
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import threading

if sys.platform == "win32":  # spelt like this for mypy
    fcntl: Any = None
else:
    import fcntl

_CPUINFO = Path("/proc/cpuinfo")
_OWN_MEMORY = Path("/proc/self/mem")
_CONTAINER_MEMORY = Path("/sys/fs/cgroup/memory.max")
_PR_SET_PDEATHSIG = 1
_AT_FDCWD = -100
_RENAME_EXCHANGE = 2
UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.EPERM)
"""Error numbers of what a system or file system can't do."""

NO_FOLLOW: int = getattr(os, "O_NOFOLLOW", 0)
"""Flag of `os.open`: refuse a link."""
HANDS_ON_LOCKS = fcntl is not None
"""Whether a process can begin another one that inherits its locks."""
REMOVES_OPEN_FILES = sys.platform != "win32"
"""Whether the name of a file that is open can go."""


# --------------------------------------------------------------------------------------------- locks, files, folders
def take_lock(handle: int, *, shared: bool = False, wait: bool = True) -> None:
    """Take the lock (`flock`) on an open file; it ends with the last process that has the handle.

    Raises
    ------
    BlockingIOError
        Another one has it, and `wait` is not set.
    OSError
        There are no locks here.
    """
    if fcntl is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB))


def open_folder(folder: Path) -> int | None:
    """Return a handle of a folder, to lock it or to have the disk hold its names; None where folders have none.

    Raises
    ------
    OSError
        There is no such folder, or it is none.
    """
    if sys.platform == "win32":
        os.scandir(folder).close()
        return None
    else:  # noqa: RET505 (mypy leaves out a branch, not what follows)
        return os.open(folder, os.O_RDONLY | os.O_DIRECTORY)


def sync(path: Path) -> None:
    """Have the disk hold a file or a folder's names, as far as the file system knows how: some can't sync folders."""
    if path.is_dir():
        handle = open_folder(path)
        if handle is None:
            return
    else:  # Windows syncs only what may be written
        handle = os.open(path, os.O_RDWR if sys.platform == "win32" else os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise
    finally:
        os.close(handle)


def is_own(status: os.stat_result) -> bool:
    """Whether a file or folder belongs to the user of this process; yes where the system has no numbers of users."""
    return not hasattr(os, "geteuid") or status.st_uid == os.geteuid()


def is_open_to_others(status: os.stat_result) -> bool:
    """Whether its permissions let other users read, write or run a file or folder; no where the system has none."""
    return sys.platform != "win32" and stat.S_IMODE(status.st_mode) & 0o077 != 0


def is_disk_full(path: Path) -> bool:
    """Whether the disk has no room for a hundredth more than is written of a file.

    For where a library could not write it: what these say of a full disk has no number, or is something else.
    """
    import shutil  # here, as others below: the command line begins without them

    written = path.stat().st_size if path.exists() else 0
    return shutil.disk_usage(path.parent).free < max(written // 100, 64 * 1024)


def not_written(path: Path, reason: str) -> OSError:
    """Return the error of a file that a library could not write: that of a full disk, or the library's own reason."""
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path)) if is_disk_full(path) else OSError(reason)


def exchange(one: Path, other: Path) -> bool:
    """Exchange two names in one step; False where the system or file system can't."""
    import ctypes

    renameat2 = None if sys.platform == "win32" else getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is None:
        return False
    if renameat2(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in UNSUPPORTED:
        return False
    raise OSError(code, os.strerror(code), str(other))


# ----------------------------------------------------------------------------------------------- processes, alarms
def apart(handle: int) -> dict[str, Any]:
    """Options of `Popen`: the process inherits an open file, out of reach of a Ctrl-C that is meant for this one."""
    return {"start_new_session": True, "pass_fds": (handle,)}


def own_session() -> dict[str, Any]:
    """Options of `Popen`: the process is out of reach of a Ctrl-C that is meant for this one."""
    return {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}


def end_with_parent(parent: int) -> None:
    """Have the system kill this process once the one that began it, by number, is gone; Linux only."""
    if sys.platform != "linux":
        return
    import ctypes

    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:  # it was gone before
        os._exit(1)


@dataclass(frozen=True)
class ProcessUse:
    """What a process has used until now. is_asleep : its main thread waits, for something else than a disk."""

    cpu_s: float
    resident_bytes: int
    is_asleep: bool


def process_use(pid: int) -> ProcessUse | None:
    """Return what a process has used; None where it is gone, or the system does not say."""
    try:
        words = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
        ticks, page_bytes = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")
    except (OSError, AttributeError):
        return None
    return ProcessUse((int(words[11]) + int(words[12])) / ticks, int(words[21]) * page_bytes, words[0] == b"S")


def thread_times_s(pid: int) -> dict[int, float]:
    """Processor time of each thread of a process; empty where it is gone, or the system does not say."""
    times_s = {}
    with suppress(OSError, AttributeError):
        ticks = os.sysconf("SC_CLK_TCK")
        for thread in Path(f"/proc/{pid}/task").iterdir():
            words = (thread / "stat").read_bytes().rpartition(b")")[2].split()
            times_s[int(thread.name)] = (int(words[11]) + int(words[12])) / ticks
    return times_s


def memory_bytes() -> int | None:
    """Memory of the machine, or of the container where that has less; None where the system does not say."""
    try:
        own = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (OSError, AttributeError, ValueError):
        return None
    try:
        return min(own, int(_CONTAINER_MEMORY.read_text(encoding="ascii")))
    except (OSError, ValueError):  # there is none, or it has no limit (`max`)
        return own


def lower_priority(by: int) -> None:
    """Let other processes go before this one, where the system has a call for it."""
    if sys.platform != "win32":
        os.nice(by)


class Alarm:
    """Calls a handler of signals in the main thread in a moment; Windows has no alarm: there, that of Ctrl-C."""

    def __init__(self, handler: Callable[[int, FrameType | None], object]) -> None:
        self._timer: threading.Timer | None = None
        if sys.platform != "win32":
            signal.signal(signal.SIGALRM, handler)

    def set(self, seconds: float) -> None:
        """Call it once, after so many seconds; 0: not at all."""
        if sys.platform != "win32":
            signal.setitimer(signal.ITIMER_REAL, seconds)
        else:
            import _thread
            import threading

            if self._timer is not None:
                self._timer.cancel()
            if seconds > 0:
                self._timer = threading.Timer(seconds, _thread.interrupt_main)
                self._timer.start()


# ------------------------------------------------------------------------------------ processor and memory
def n_usable_cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def processor_flags() -> tuple[str, ...]:
    """Instructions that programs may use here, as /proc/cpuinfo names them, sorted; empty where it does not."""
    try:
        lines = _CPUINFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ()
    # Processors of one machine may differ: what all of them have.
    flags = [frozenset(line.partition(":")[2].split()) for line in lines if line.partition(":")[0].strip() == "flags"]
    return tuple(sorted(frozenset.intersection(*flags))) if flags else ()


def own_memory(address: int, n_bytes: int) -> bytes:
    """Return bytes of this process's memory, or none where nothing is mapped or the system does not say: no crash."""
    try:
        with _OWN_MEMORY.open("rb", buffering=0) as memory:
            memory.seek(address)
            return memory.read(n_bytes) or b""
    except (OSError, ValueError, OverflowError):
        return b""
