"""Native libraries in a child process: what crashes, hangs or takes all memory there is one line here.

`run_isolated` calls a function in a new Python process and returns its result. The two share one nameless file: its
first page has the state of the child (`at`, and progress), what follows is the request, then the answer. So nothing is
left behind however either of them ends, and the last place is known even of a child that was killed. The answer is
JSON and plain arrays: a child that a file has taken over can't make this process do anything.

A child that does nothing is ended after `ASLEEP_S`, one that works without a step to show after the times of
`ChildLimits`. It is a session of its own: a Ctrl-C reaches this process alone, which then kills the child, asleep or
not.
"""

from __future__ import annotations

import json
import mmap
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import IO, Any, NoReturn

from numpy.typing import NDArray

from planner_core import errors
from planner_core.encoding import encoded, parts_of_value, read_tree, read_value
from planner_core.environment_variables import limit_from_env
from planner_core.operating_system import end_with_parent, memory_bytes, own_session, process_use, thread_times_s
from planner_core.progress import Progress, ProgressEvent

LIMIT_VARIABLE = "TLSPLAN_READ_LIMIT_S"
"""Seconds without progress after which a child is ended, on the clock and of one thread's processor time; 0: never."""
MEMORY_VARIABLE = "TLSPLAN_READ_MEMORY_GB"
"""Memory of a child, in units of 1e9 bytes; 0: no limit."""
ASLEEP_S = 6.0
"""A child whose threads all sleep waits for something that never comes. Reading a slow disk does not count as sleep."""
SILENT_S, SILENT_S_PER_BYTE = 120.0, 5e-6
"""On the clock, without a step, also on a machine that does other things."""
STEP_CPU_S, STEP_CPU_S_PER_BYTE = 15.0, 2e-6
"""Processor time of one thread without a step. The longest of sound files is the opening by IfcOpenShell, 0.1 s/MB."""
WHOLE_CPU_S, WHOLE_CPU_S_PER_BYTE = 300.0, 1e-4
"""Processor time of all threads for a whole file: many steps that are slow, each within its limit, end as well. Sound
files take some seconds per MB, and ten times as much where they are packed."""
MEMORY_SHARE = 0.75

_PAGE_BYTES = 4096
_COUNTS = struct.Struct("<QQQ")
_NOTE, _PLACE = slice(24, 280), slice(280, _PAGE_BYTES)
_LOOK_S = 0.05
_TELL_AGAIN_S = 2.0
"""A child that is this long at one thing is reported, with the time."""
_CODE = "from planner_core.child_process import main; main()"

_page: mmap.mmap | None = None
_log: IO[bytes] | None = None


@dataclass(frozen=True)
class ChildLimits:
    """Of one child. silent_s, step_cpu_s : without a step, as of `SILENT_S` and `STEP_CPU_S`. memory_bytes : resident.

    whole_cpu_s : of all steps, as of `WHOLE_CPU_S`. None: no limit.
    """

    silent_s: float | None
    memory_bytes: float | None
    step_cpu_s: float | None = None
    whole_cpu_s: float | None = None


class LostChildError(Exception):
    """A child ended without an answer. `str(error)` completes a sentence that begins with the library's name.

    place : what it was at; empty: not known. log : the numbers that it had logged. is_slow : it made no progress.
    """

    def __init__(self, reason: str, place: str, log: Sequence[int], *, is_slow: bool = False) -> None:
        super().__init__(reason)
        self.place = place
        self.log = tuple(log)
        self.is_slow = is_slow


def limits_for(n_bytes: int) -> ChildLimits:
    """Limits for a child that reads so many bytes: by the environment, else by the file and the machine.

    Raises
    ------
    EnvironmentVariableError
        A variable is no number.
    """
    silent_s = limit_from_env(LIMIT_VARIABLE, "seconds")
    memory_gb = limit_from_env(MEMORY_VARIABLE, "GB")
    own = memory_bytes()
    return ChildLimits(
        silent_s=SILENT_S + SILENT_S_PER_BYTE * n_bytes if silent_s is None else silent_s or None,
        memory_bytes=(MEMORY_SHARE * own if own else None) if memory_gb is None else 1e9 * memory_gb or None,
        step_cpu_s=STEP_CPU_S + STEP_CPU_S_PER_BYTE * n_bytes if silent_s is None else silent_s or None,
        whole_cpu_s=WHOLE_CPU_S + WHOLE_CPU_S_PER_BYTE * n_bytes if silent_s is None else None,
    )


# ------------------------------------------------------------------------------------------------ this side
def run_isolated(
    function: str,
    arguments: Mapping[str, Any],
    *,
    classes: Sequence[type],
    limits: ChildLimits,
    stage: str,
    progress: Progress,
) -> Any:
    """Return what a function returned in a process of its own, or raise what it raised.

    Parameters
    ----------
    function : `package.module:name`. arguments : by name; texts, numbers, None and lists of them.
    classes : dataclasses that the answer may be made of, beside tuples (lists become such), arrays and what JSON has.
    stage : of the events that `progress` gets.

    Raises
    ------
    LostChildError
        The child crashed, hung, or went over a limit.
    PlannerError, OSError, MemoryError
        As the function raised them.
    RuntimeError
        The function raised anything else: a bug of ours; the child's own traceback is a note of it.
    """
    request = json.dumps([function, dict(arguments)]).encode()
    with tempfile.TemporaryFile(buffering=0) as file:
        file.truncate(_PAGE_BYTES)
        file.seek(_PAGE_BYTES)
        file.write(struct.pack("<QQ", os.getpid(), len(request)) + request)
        file.seek(0)
        with mmap.mmap(file.fileno(), _PAGE_BYTES) as page:
            child = subprocess.Popen(
                [sys.executable, "-P", "-c", _CODE],
                stdin=file,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                **own_session(),
            )
            try:
                reason, is_slow = _waited(child, page, limits, stage, progress)
            finally:
                if child.poll() is None:
                    child.kill()
                child.wait()
            if reason:
                file.seek(_PAGE_BYTES + 16 + len(request))
                logged = file.read()
                log = array("Q", logged[: len(logged) // 8 * 8])
                raise LostChildError(reason, _text(page, _PLACE), log, is_slow=is_slow)
        file.seek(_PAGE_BYTES)
        return _answer(file, classes)


def _waited(
    child: subprocess.Popen[bytes], page: mmap.mmap, limits: ChildLimits, stage: str, progress: Progress
) -> tuple[str, bool]:
    """Wait for a child's end, and pass its progress on.

    Returns
    -------
    Why it gave no answer, empty where it did; whether that is for lack of progress.
    """
    seen, shown = b"", (0, 0, "")
    silent_s = asleep_s = since_shown_s = 0.0
    cpu_s, now = -1.0, time.monotonic()
    begun_s: dict[int, float] = {}
    while True:
        try:
            code = child.wait(_LOOK_S)
        except subprocess.TimeoutExpired:
            code = None
        before, now = now, time.monotonic()
        passed_s = min(now - before, 1.0)  # a laptop that slept, or a process that was stopped, has not waited
        silent_s, since_shown_s, asleep_s = silent_s + passed_s, since_shown_s + passed_s, asleep_s + passed_s
        if page[:] != seen:
            seen, silent_s, since_shown_s = page[:], 0.0, 0.0
            begun_s = thread_times_s(child.pid)
        _, done, total = _COUNTS.unpack_from(page)
        news = done, total, _text(page, _NOTE)
        if news != shown or since_shown_s > _TELL_AGAIN_S:
            shown, since_shown_s = news, 0.0
            progress(ProgressEvent(stage, done, total, _doing(page, news[2], silent_s)))
        if code is not None:
            return why_ended(code), False
        use = process_use(child.pid)
        if use is not None:
            if use.cpu_s != cpu_s or not use.is_asleep:
                cpu_s, asleep_s = use.cpu_s, 0.0
            if limits.memory_bytes is not None and use.resident_bytes > limits.memory_bytes:
                most_gb = limits.memory_bytes / 1e9
                return f"took more than {most_gb:.1f} GB of memory ({MEMORY_VARIABLE} changes that)", False
            if limits.whole_cpu_s is not None and use.cpu_s > limits.whole_cpu_s:
                most_s = f"{limits.whole_cpu_s:.0f} s of processor time for the whole file"
                return f"took more than {most_s} ({_so_far(done, total)}{LIMIT_VARIABLE}=0 gives it its time)", False
        if asleep_s > ASLEEP_S:
            return f"hung: it did nothing for {ASLEEP_S:.0f} s", False
        if limits.silent_s is not None and silent_s > limits.silent_s:
            return f"made no progress for {limits.silent_s:.0f} s ({LIMIT_VARIABLE} changes that)", True
        if limits.step_cpu_s is not None and silent_s > limits.step_cpu_s:  # a thread has no more time than the clock
            now_s = thread_times_s(child.pid)
            if any(time_s - begun_s.get(thread, 0.0) > limits.step_cpu_s for thread, time_s in now_s.items()):
                return (
                    f"made no progress for {limits.step_cpu_s:.0f} s of processor time ({LIMIT_VARIABLE} changes that)",
                    True,
                )


def _so_far(done: int, total: int) -> str:
    return f"{done} of {total} steps were done; " if total else f"{done} steps were done; " if done else ""


def _doing(page: mmap.mmap, note: str, silent_s: float) -> str:
    if silent_s < _TELL_AGAIN_S:
        return note
    place = _text(page, _PLACE)
    return f"{note}{': ' if note and place else ''}{place}, for {silent_s:.0f} s"


def why_ended(code: int) -> str:
    """Why a process that ended with `code` did so, behind its name; empty where that is 0."""
    if code == 0:
        return ""
    if code == -signal.Signals.SIGTERM:
        return "was ended by another program"
    if os.name == "posix" and code == -9:
        return "was killed by the system, perhaps for lack of memory"
    if code < 0 and -code in set(signal.Signals):
        return f"crashed ({(signal.strsignal(-code) or signal.Signals(-code).name).lower()})"
    return f"crashed (code {code})"


def _text(page: mmap.mmap, part: slice) -> str:
    return page[part].partition(b"\0")[0].decode("utf-8", "replace").replace("\ufffd", "?")


# ------------------------------------------------------------------------------------------------ the child
def at(place: str) -> None:
    """Say what is read next, before what may crash; nothing where this is no child."""
    if _page is not None:
        _put(_PLACE, place)


def log(number: int) -> None:
    """Note a number (0 to 2**64 - 1) for whoever has to find out why this child ended; nothing where this is none."""
    if _log is not None:
        _log.write(struct.pack("<Q", number))


def main() -> NoReturn:
    """Do what the shared file asks for, as the child that has it as its standard input."""
    global _page, _log
    with open(0, "r+b", buffering=0, closefd=False) as file:
        file.seek(_PAGE_BYTES)
        parent, n_bytes = struct.unpack("<QQ", file.read(16))
        end_with_parent(parent)
        function, arguments = json.loads(file.read(n_bytes))
        _page, _log = mmap.mmap(0, _PAGE_BYTES), file
        arrays: list[NDArray[Any]] = []
        try:
            module, _, name = function.partition(":")
            answer = {"value": encoded(getattr(import_module(module), name)(**arguments), arrays)}
            text = json.dumps(answer).encode()
        except Exception as error:  # noqa: BLE001 (all of them are raised again, on the other side)
            arrays = []
            text = json.dumps({"error": _error(error)}).encode()
        file.seek(_PAGE_BYTES)
        file.truncate()
        try:
            _write(file, text, arrays)
        except OSError as error:  # the disk of temporary files is full
            file.seek(_PAGE_BYTES)
            file.truncate()
            _write(file, json.dumps({"error": _error(error)}).encode(), [])
    os._exit(0)  # a library's own way out may crash, and takes time


def progress_of_child(event: ProgressEvent) -> None:
    """Pass progress on to the process that waits for this child."""
    if _page is not None:
        steps, *_ = _COUNTS.unpack_from(_page)
        _COUNTS.pack_into(_page, 0, steps, event.done, event.total)
        _put(_NOTE, event.note)


def _put(part: slice, text: str) -> None:
    assert _page is not None
    n_bytes = part.stop - part.start
    _page[part] = text.encode("utf-8", "replace")[: n_bytes - 1].ljust(n_bytes, b"\0")
    steps, done, total = _COUNTS.unpack_from(_page)
    _COUNTS.pack_into(_page, 0, steps + 1, done, total)


def _write(file: IO[bytes], text: bytes, arrays: Sequence[NDArray[Any]]) -> None:
    for part in parts_of_value(text, arrays):
        rest = part
        while len(rest):
            rest = rest[file.write(rest) :]


def _error(error: Exception) -> list[Any]:
    of_system = [error.errno, error.strerror, error.filename] if isinstance(error, OSError) else []
    shown = [part if part is None or isinstance(part, int) else str(part) for part in of_system]
    return [type(error).__name__, str(error), shown, "".join(traceback.format_exception(error))]


# ------------------------------------------------------------------------------------------------ the answer
def _answer(file: IO[bytes], classes: Sequence[type]) -> Any:
    answer = read_tree(file)
    if "error" in answer:
        raise _raised(*answer["error"])
    return read_value(answer["value"], file, classes)


def _raised(name: str, text: str, of_system: Sequence[Any], where: str) -> Exception:
    kind = getattr(errors, name, None)
    if isinstance(kind, type) and issubclass(kind, errors.PlannerError):
        return kind(text)
    if of_system:
        return OSError(*of_system) if of_system[0] is not None else OSError(text)
    if name == "MemoryError":
        return MemoryError(text)
    bug = RuntimeError(f"{name}: {text}")
    bug.add_note(where)
    return bug
