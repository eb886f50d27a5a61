"""A device is used only after a child process has run its kernels and found them right; the verdict is kept."""

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from planner_core import self_check
from planner_core.device import Device, check
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.engine.tuning import tile_shape
from planner_core.model import ScanBatch


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path / "cache"))
    check._kept_verdict.cache_clear()
    check._checked_here.clear()
    return tmp_path / "cache"


@pytest.fixture
def child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Let the child be a module of these lines; `.asked()` says how often it was started."""

    def play(lines: str) -> None:
        (tmp_path / "played_check.py").write_text(f"open({str(tmp_path / 'asked')!r}, 'a').write('x')\n{lines}\n")
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setattr(check, "_CHILD", "played_check")

    play.asked = lambda: len((tmp_path / "asked").read_text())
    return play


@pytest.mark.slow
def test_the_device_here_is_found_right_and_asked_once(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    assert check.problem_of(device, 0) == ""

    def no_child(*_: object, **__: object) -> None:
        raise AssertionError("asked again")

    monkeypatch.setattr(subprocess, "run", no_child)
    assert check.problem_of(device, 0) == ""
    check._kept_verdict.cache_clear()
    assert check.problem_of(device, 0) == "", "read from the file"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ("print('noise of a driver'); print('all well')", ""),
        ("import sys; print('it computes wrongly: ranges'); sys.exit(3)", "it computes wrongly: ranges"),
        ("import os; os.kill(os.getpid(), 4)", "its driver crashes (illegal instruction)"),
        ("import os; os.kill(os.getpid(), 11)", "its driver crashes (bad address)"),
        ("import os; os.abort()", "its driver crashes (abort)"),
    ],
)
def test_a_verdict_that_would_be_the_same_again_is_kept(
    device: Device, child, monkeypatch: pytest.MonkeyPatch, lines: str, problem: str
) -> None:
    child(lines)
    monkeypatch.setattr(device, "max_lanes", 8)
    for _ in range(2):
        check._kept_verdict.cache_clear()
        assert check.problem_of(device, 0) == problem
    assert child.asked() == 1
    assert check.problem_of(device, 0, anew=True) == problem
    assert child.asked() == 2


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ("import os; os.kill(os.getpid(), 9)", "ended with -9"),
        ("import os; os.kill(os.getpid(), 15)", "ended with -15"),
        ("raise MemoryError('no room')", "no room"),
        ("print('half a word')", "ended with 0"),
        ("", "ended with 0 (no message)"),
    ],
)
def test_what_may_be_bad_luck_refuses_the_device_and_is_not_kept(
    device: Device, child, cache: Path, lines: str, problem: str
) -> None:
    child(lines)
    assert problem in check.problem_of(device, 0)
    assert not cache.exists()
    assert problem in check.problem_of(device, 0)
    assert child.asked() == 2


@pytest.mark.parametrize(
    "wide_fails", ["sys.exit(print('wrong ranges') or 3)", "os.abort()", "os.kill(os.getpid(), 4)"]
)
def test_where_wide_packets_fail_narrow_ones_are_used(
    device: Device, child, monkeypatch: pytest.MonkeyPatch, wide_fails: str
) -> None:
    child(f"import os, sys\nif sys.argv[3] == '16': {wide_fails}\nprint('all well')")
    for times_asked in (2, 2):
        check._kept_verdict.cache_clear()
        monkeypatch.setattr(device, "max_lanes", 16)
        assert check.problem_of(device, 0) == ""
        assert device.max_lanes == 8
        assert tile_shape(device)[2] == 8
        assert child.asked() == times_asked


def test_where_narrow_packets_fail_too_the_device_is_refused(
    device: Device, child, monkeypatch: pytest.MonkeyPatch
) -> None:
    child("import sys; print(f'wrong in {sys.argv[3]}'); sys.exit(3)")
    monkeypatch.setattr(device, "max_lanes", 16)
    assert check.problem_of(device, 0) == "wrong in 8"


def test_a_child_without_end_is_ended_and_not_waited_for_again(
    device: Device, child, monkeypatch: pytest.MonkeyPatch
) -> None:
    child("import time; time.sleep(600)")
    monkeypatch.setattr(check, "_TIME_LIMIT_S", 2.0)
    monkeypatch.setattr(device, "max_lanes", 8)
    for _ in range(2):
        assert "within 2 s (`tlsplan doctor` tries again)" in check.problem_of(device, 0)
    assert child.asked() == 1


def test_a_child_that_can_not_start_refuses_the_device(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    assert "could not be started" in check.problem_of(device, 0)


def test_without_a_place_to_keep_it_a_process_asks_once(
    device: Device, child, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    child("print('all well')")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path / "file" / "below"))
    for _ in range(2):
        assert check.problem_of(device, 0) == ""
    assert child.asked() == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '{"schema": "tlsplan/device-check/2"}',
        '{"schema": "tlsplan/device-check/2", "problem": "", "max_lanes": null}',
        '{"schema": "other"}',
    ],
)
def test_a_damaged_verdict_counts_as_none(device: Device, child, cache: Path, text: str) -> None:
    child("print('all well')")
    check.problem_of(device, 0)
    (file,) = cache.iterdir()
    file.write_text(text)
    check._kept_verdict.cache_clear()
    assert check.problem_of(device, 0) == ""
    assert child.asked() == 2


@pytest.mark.slow
@pytest.mark.parametrize("what", ["processor", "driver", "name"])
def test_another_processor_driver_or_device_is_asked_anew(
    device: Device, child, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    child("print('all well')")
    check.problem_of(device, 0)
    if what == "processor":
        monkeypatch.setattr(check, "processor_flags", lambda: ("other",))
    else:
        monkeypatch.setattr(device, what, "other")
    check.problem_of(device, 0)
    assert child.asked() == 2


def test_an_interrupt_while_the_child_works_is_the_users(device: Device, child, cache: Path) -> None:
    child(f"import os, time; os.kill(os.getppid(), {signal.SIGINT.value}); time.sleep(600)")
    with pytest.raises(KeyboardInterrupt):
        check.problem_of(device, 0)
    assert not cache.exists()


@pytest.mark.opencl
def test_the_box_is_scanned_rightly_by_both_engines_and_wrong_ranges_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, patches = self_check.box()
    for name in ("opencl", "open3d"):
        assert self_check.ranges_wrongly(open_engine(scene, patches, engine=name), scene, patches) == ""
    engine = open_engine(scene, patches, engine="open3d")
    real = Open3DEngine.scan

    def a_little_off(self: Open3DEngine, *arguments: Any) -> ScanBatch:
        batch = real(self, *arguments)
        batch.range_m[0, 80, 180] *= 1.001
        return batch

    monkeypatch.setattr(Open3DEngine, "scan", a_little_off)
    assert "wrong ranges" in self_check.ranges_wrongly(engine, scene, patches)


@pytest.mark.opencl
def test_a_device_that_is_not_there_is_said_in_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    assert self_check.main("99", "no such device", "8") == check.FAULT_FOUND
    assert capfd.readouterr().out.count("\n") == 1
    assert self_check.main("0", "another label", "8") == check.FAULT_FOUND
    assert "expected another label" in capfd.readouterr().out
