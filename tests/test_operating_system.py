"""What the operating system tells, and what is answered where it does not."""

import ctypes
import os
import threading
import time
from pathlib import Path

import pytest

from planner_core import operating_system


def test_flags_are_those_that_all_processors_have(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "cpuinfo"
    file.write_text("processor\t: 0\nflags\t\t: sse avx fpu\nbugs\t: x\n\nprocessor\t: 1\nflags\t\t: fpu sse\n")
    monkeypatch.setattr(operating_system, "_CPUINFO", file)
    assert operating_system.processor_flags.__wrapped__() == ("fpu", "sse")
    monkeypatch.setattr(operating_system, "_CPUINFO", tmp_path / "none")
    assert operating_system.processor_flags.__wrapped__() == ()


def test_own_memory_is_read_and_a_wild_address_is_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = ctypes.create_string_buffer(b"some text")
    assert operating_system.own_memory(ctypes.addressof(text), 9) == b"some text"
    for wild in (0, 8, 2**47, 2**63, 2**64 - 1):
        assert operating_system.own_memory(wild, 8) == b""
    monkeypatch.setattr(operating_system, "_OWN_MEMORY", tmp_path / "none")
    assert operating_system.own_memory(ctypes.addressof(text), 9) == b""


def test_a_process_may_use_a_core_or_more() -> None:
    assert operating_system.n_usable_cores() >= 1


def test_files_of_others_and_files_open_to_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "file"
    file.touch()
    found = {}
    for mode in (0o600, 0o400, 0o700, 0o640, 0o604, 0o610):
        file.chmod(mode)
        found[mode] = operating_system.is_open_to_others(file.stat())
    assert found == {0o600: False, 0o400: False, 0o700: False, 0o640: True, 0o604: True, 0o610: True}
    status = file.stat()
    assert operating_system.is_own(status)
    with monkeypatch.context() as patched:
        patched.setattr(os, "geteuid", lambda: status.st_uid + 1)
        assert not operating_system.is_own(status)
        patched.delattr(os, "geteuid")
        assert operating_system.is_own(status)


@pytest.mark.slow
def test_time_of_a_thread_is_its_own() -> None:
    """One that works adds to its time, one that waits does not; a process that is gone has no threads."""
    ends = threading.Event()
    waiting = threading.Thread(target=ends.wait)
    waiting.start()
    try:
        before_s = operating_system.thread_times_s(os.getpid())
        end_s = time.thread_time() + 0.5
        while time.thread_time() < end_s:
            pass
        after_s = operating_system.thread_times_s(os.getpid())
    finally:
        ends.set()
        waiting.join()
    own, other = threading.get_native_id(), waiting.native_id
    assert after_s[own] - before_s[own] > 0.4
    assert after_s[other] - before_s[other] < 0.1
    assert operating_system.thread_times_s(2**30) == {}
