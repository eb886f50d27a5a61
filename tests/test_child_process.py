"""What a child process does to the one that waits for it: an answer, or one reason why there is none; nothing is left.

The children here run functions of Python's own modules: `timeit` runs any statement.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from planner_core import child_process
from planner_core.child_process import ChildLimits, LostChildError, limits_for, run_isolated
from planner_core.errors import RequirementError, SceneError
from planner_core.model import Element
from planner_core.progress import ProgressEvent, silent

FREE = ChildLimits(silent_s=None, memory_bytes=None)
IMPORTS = "import os, signal, time; from planner_core import child_process as c; "
DEAF = IMPORTS + "[signal.signal(n, signal.SIG_IGN) for n in (signal.SIGINT, signal.SIGTERM)]; "


def run(function: str, limits: ChildLimits = FREE, progress=silent, classes=(), **arguments):
    return run_isolated(function, arguments, classes=classes, limits=limits, stage="load", progress=progress)


def statement(text: str, **options):
    return run("timeit:timeit", stmt=text, number=1, **options)


def lost(text: str, **options) -> LostChildError:
    with pytest.raises(LostChildError) as caught:
        statement(text, **options)
    return caught.value


# ------------------------------------------------------------------------------------------------ answers
@pytest.mark.slow
def test_answer_comes_back():
    assert run("textwrap:shorten", text="a long \ud83c way \udce4", width=99) == "a long \ud83c way \udce4"
    assert run("json:loads", s="[1, [2.5, null], -Infinity, true]") == (1, (2.5, None), float("-inf"), True)


@pytest.mark.parametrize(
    ("shape", "dtype"),
    [([], "bool"), ([0, 3], "uint8"), ([3], ">f8"), ([2, 0], "int64"), ([5, 4, 3], "float32")],
)
def test_array_comes_back_bit_by_bit(shape, dtype):
    expected = np.full(shape, 1, dtype=dtype)
    found = run("numpy:full", shape=shape, fill_value=1, dtype=dtype)
    assert (found.dtype, found.shape, found.tobytes()) == (expected.dtype, expected.shape, expected.tobytes())
    found += found  # it is ours to change


def test_dataclasses_come_back_where_they_are_expected():
    plain = "planner_core.model:Element"
    arguments = {"name": "Wand", "kind": "IfcWall", "source_id": "x", "parents": ["IfcElement"]}
    assert run(plain, **arguments, classes=[Element]) == Element("Wand", "IfcWall", "x", parents=("IfcElement",))
    with pytest.raises(KeyError, match="Element"):
        run(plain, **arguments)


def test_errors_are_those_of_the_function():
    raising = "from planner_core import errors; raise "
    with pytest.raises(SceneError, match=r"^a\.ifc: is \u00e9mpty\.$"):
        statement(raising + "errors.SceneError('a.ifc: is \u00e9mpty.')")
    with pytest.raises(FileNotFoundError) as caught:
        run("os:listdir", path="/nowhere at all")
    assert caught.value.filename == "/nowhere at all"
    with pytest.raises(MemoryError):
        statement("raise MemoryError('all gone')")
    with pytest.raises(RuntimeError, match="KeyError: 'planted'") as bug:
        statement("raise KeyError('planted')")
    assert "<timeit-src>" in bug.value.__notes__[0]


@pytest.mark.slow
def test_what_a_library_prints_goes_nowhere(capfd):
    statement("import os; os.write(1, b'noise'); os.write(2, b'noise')")
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_answer_that_the_disk_does_not_hold_is_an_error_of_the_system():
    """Here no file may be longer than 0.1 MB."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            run("numpy:zeros", shape=[20_000])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


# ------------------------------------------------------------------------------------------------ losses
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("import faulthandler; faulthandler._sigsegv()", "crashed (segmentation fault)"),
        ("import os; os.abort()", "crashed (aborted)"),
        ("import os; os.kill(os.getpid(), 9)", "was killed by the system, perhaps for lack of memory"),
        ("import os; os.kill(os.getpid(), 15)", "was ended by another program"),
        ("import os; os._exit(7)", "crashed (code 7)"),
    ],
)
def test_end_of_a_child_has_a_reason(text, expected):
    error = lost(IMPORTS + "c.at('the third w\u00e4ll'); c.log(3); c.log(2**64 - 1); " + text)
    assert str(error) == expected
    assert error.place == "the third w\u00e4ll"
    assert error.log == (3, 2**64 - 1)


def test_child_that_sleeps_for_ever_is_ended(monkeypatch):
    monkeypatch.setattr(child_process, "ASLEEP_S", 1.0)
    assert str(lost(DEAF + "c.at('#12'); signal.pause()")) == "hung: it did nothing for 1 s"


def test_child_that_works_and_shows_no_step_is_ended():
    error = lost("while True: pass", limits=ChildLimits(silent_s=1.0, memory_bytes=None))
    assert str(error) == "made no progress for 1 s (TLSPLAN_READ_LIMIT_S changes that)"


def test_processor_time_of_one_thread_without_a_step_is_limited():
    """Of a child that works half of the time; what others do on this machine does not count."""
    half = "end = time.monotonic() + 60\nwhile time.monotonic() < end:\n sum(range(10**6)); time.sleep(0.03)"
    start_s = time.monotonic()
    error = lost(IMPORTS + half, limits=ChildLimits(silent_s=None, memory_bytes=None, step_cpu_s=0.5))
    assert str(error) == "made no progress for 0 s of processor time (TLSPLAN_READ_LIMIT_S changes that)"
    assert error.is_slow
    assert time.monotonic() - start_s > 0.8


@pytest.mark.slow
def test_processor_time_begins_anew_with_a_step():
    steps = (
        "for i in range(4):\n c.at(str(i)); end = time.process_time() + 0.35\n while time.process_time() < end: pass"
    )
    assert statement(IMPORTS + "\n" + steps, limits=ChildLimits(silent_s=None, memory_bytes=None, step_cpu_s=1.0)) > 1.3


@pytest.mark.slow
def test_child_that_takes_steps_goes_on_as_long_as_it_wants(monkeypatch):
    monkeypatch.setattr(child_process, "ASLEEP_S", 3.0)
    steps = "for i in range(50):\n c.at(str(i)); time.sleep(0.09); end = time.monotonic() + 0.01\n"
    steps += " while time.monotonic() < end: pass"
    assert statement(IMPORTS + "\n" + steps, limits=ChildLimits(silent_s=3.0, memory_bytes=None)) > 4.5


def test_child_that_takes_too_much_memory_is_ended():
    error = lost("x = [b'x' * 10**7 for _ in range(10**5)]", limits=ChildLimits(silent_s=None, memory_bytes=3e8))
    assert str(error) == "took more than 0.3 GB of memory (TLSPLAN_READ_MEMORY_GB changes that)"


# ------------------------------------------------------------------------------------------------ progress
def test_progress_is_passed_on():
    events: list[ProgressEvent] = []
    event = "c.progress_of_child(ProgressEvent('x', {0}, 9, 'wall {0}')); time.sleep(0.3); "
    text = IMPORTS + "from planner_core.progress import ProgressEvent; " + event.format(1) + event.format(2)
    statement(text, progress=events.append)
    assert events == [ProgressEvent("load", 1, 9, "wall 1"), ProgressEvent("load", 2, 9, "wall 2")]


@pytest.mark.slow
def test_long_silence_is_told_with_the_place(monkeypatch):
    monkeypatch.setattr(child_process, "_TELL_AGAIN_S", 0.2)
    events: list[ProgressEvent] = []
    statement(IMPORTS + "c.at('#12 IfcWall'); time.sleep(1.5)", progress=events.append)
    assert any(event.note == "#12 IfcWall, for 1 s" for event in events)


@pytest.mark.slow
def test_error_of_the_callback_ends_the_child(tmp_path):
    def fail(event):
        raise ZeroDivisionError

    told = tmp_path / "pid"
    with pytest.raises(ZeroDivisionError):
        statement(told_pid(told) + "c.progress_of_child(ProgressEvent('x', 1, 2)); signal.pause()", progress=fail)
    assert is_gone(told)


# ------------------------------------------------------------------------------------------------ interrupts
def told_pid(file: Path) -> str:
    return f"{DEAF}from planner_core.progress import ProgressEvent; open({str(file)!r}, 'w').write(str(os.getpid())); "


def is_gone(file: Path) -> bool:
    """The process whose number is in the file ends; the test's own time limit is the only one."""
    while not (file.exists() and file.read_text()):
        time.sleep(0.02)
    status = Path(f"/proc/{file.read_text()}/stat")
    with suppress(FileNotFoundError, ProcessLookupError):
        while status.read_text().rpartition(")")[2].split()[0] != "Z":
            time.sleep(0.02)
    return True


@pytest.mark.slow
@pytest.mark.timeout(60)
def test_interrupt_ends_a_child_that_is_deaf_and_asleep(tmp_path, monkeypatch):
    monkeypatch.setattr(child_process, "ASLEEP_S", 1e9)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    told = tmp_path / "pid"

    def interrupt():
        while not told.exists():
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        statement(told_pid(told) + "signal.pause()")
    assert is_gone(told)
    assert list(tmp_path.iterdir()) == [told]


@pytest.mark.timeout(60)
def test_child_ends_with_the_process_that_waits_for_it(tmp_path):
    """Which is killed and can clean nothing up."""
    told = tmp_path / "pid"
    program = (
        "import sys; from planner_core.child_process import ChildLimits, run_isolated\n"
        "run_isolated('timeit:timeit', {'stmt': sys.argv[1], 'number': 1}, classes=(), limits=ChildLimits(None, None), "
        "stage='load', progress=lambda event: None)"
    )
    waiting = subprocess.Popen(
        [sys.executable, "-c", program, told_pid(told) + "\nwhile True: pass"],
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )
    while not (told.exists() and told.read_text()):
        time.sleep(0.02)
    waiting.kill()
    waiting.wait()
    assert is_gone(told)
    assert list(tmp_path.iterdir()) == [told]


# ------------------------------------------------------------------------------------------------ limits
def test_limits_grow_with_the_file_and_follow_the_environment(monkeypatch):
    for variable in (child_process.LIMIT_VARIABLE, child_process.MEMORY_VARIABLE):
        monkeypatch.delenv(variable, raising=False)
    small, large = limits_for(1_000_000), limits_for(1_000_000_000)
    assert (small.silent_s, small.step_cpu_s) == (pytest.approx(125.0), pytest.approx(17.0))
    assert (large.silent_s, large.step_cpu_s) == (pytest.approx(5120.0), pytest.approx(2015.0))
    assert small.memory_bytes is not None
    assert 0 < small.memory_bytes < os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    monkeypatch.setenv(child_process.LIMIT_VARIABLE, "7.5")
    monkeypatch.setenv(child_process.MEMORY_VARIABLE, "2")
    assert limits_for(10**9) == ChildLimits(7.5, 2e9, 7.5)
    monkeypatch.setenv(child_process.LIMIT_VARIABLE, "0")
    monkeypatch.setenv(child_process.MEMORY_VARIABLE, "0")
    assert limits_for(10**9) == FREE


@pytest.mark.parametrize("text", ["soon", "-1", "nan", "inf"])
def test_limit_that_is_no_number_is_refused(monkeypatch, text):
    monkeypatch.setenv(child_process.LIMIT_VARIABLE, text)
    with pytest.raises(RequirementError, match=f"TLSPLAN_READ_LIMIT_S: got '{text}', expected seconds, or 0"):
        limits_for(1)
