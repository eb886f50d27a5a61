"""Signals that get lost, caches that can't be written, closed streams."""

import contextlib
import io
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tlsplan import environment
from tlsplan.exit_codes import exit_code_of
from tlsplan.progress import ProgressReporter

from planner_core.environment_variables import memory_from_env
from planner_core.errors import EnvironmentVariableError
from planner_core.progress import ProgressEvent


def run(program: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=240, env={**os.environ, **variables}
    )


def test_an_interrupt_that_a_package_swallowed_ends_the_work_at_the_next_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment, "_interrupted", False)
    environment.prepare(debug=True)
    with contextlib.suppress(KeyboardInterrupt):  # as compiled packages do while they start
        signal.raise_signal(signal.SIGINT)
    with ProgressReporter(quiet=True) as reporter, pytest.raises(KeyboardInterrupt):
        reporter.show(ProgressEvent("scan", 1, 2))


SHOW_CACHE = (
    "import os; from tlsplan.environment import prepare; prepare(debug=False);"
    "print(os.environ.get('XDG_CACHE_HOME', ''), os.access(os.environ.get('XDG_CACHE_HOME', '/nonexistent'), os.W_OK))"
)


def test_a_home_that_is_a_device_sends_caches_to_a_folder_that_is_gone_afterwards() -> None:
    # Nobody, root included, can make a folder below /proc.
    folder, writable = run(SHOW_CACHE, HOME="/proc/self", XDG_CACHE_HOME="").stdout.split()
    assert writable == "True"
    assert "tlsplan-cache-" in folder
    assert not Path(folder).exists()


LEAVE = (
    "import atexit, os; from tlsplan.environment import leave_at_once, prepare; prepare(debug=False);"
    "atexit.register(print, 'as Python ends'); print(os.environ['XDG_CACHE_HOME']); leave_at_once(7)"
)


def test_a_process_that_leaves_at_once_says_all_it_had_to_and_leaves_no_folder() -> None:
    done = run(LEAVE, HOME="/proc/self", XDG_CACHE_HOME="")
    [folder] = done.stdout.split()
    assert done.returncode == 7
    assert "tlsplan-cache-" in folder
    assert not Path(folder).exists()


def test_a_home_that_can_be_written_is_left_alone(tmp_path: Path) -> None:
    assert run(SHOW_CACHE, HOME=str(tmp_path), XDG_CACHE_HOME="").stdout.split() == ["False"]


@pytest.mark.slow
def test_closed_standard_error_is_no_error() -> None:
    command = f"{sys.executable} -m tlsplan scanners 2>&-"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0
    assert "hdl-64e" in done.stdout


@pytest.mark.parametrize("date", ["", "abc", "-1", "1.5", "1_000", "253402300800", "9" * 5000])
def test_a_date_that_numpy_could_not_be_imported_with_is_refused_in_one_line(
    date: str, tlsplan: Callable[..., Any]
) -> None:
    done = tlsplan("scanners", env={"SOURCE_DATE_EPOCH": date})
    assert done.returncode == 2
    assert done.stderr == (
        f"tlsplan: SOURCE_DATE_EPOCH: got {date[:40]!r}, expected whole seconds since 1970-01-01, up to the year 9999; "
        "correct or unset it\n"
    )


def test_the_last_second_of_the_year_9999_is_a_date(tlsplan: Callable[..., Any]) -> None:
    assert tlsplan("scanners", env={"SOURCE_DATE_EPOCH": "253402300799"}).returncode == 0


def test_a_backend_that_matplotlib_does_not_know_is_left_aside() -> None:
    program = "from tlsplan.environment import prepare; prepare(debug=False); import matplotlib"
    assert run(program, MPLBACKEND="no-such").returncode == 0


@pytest.mark.parametrize("variable", ["TLSPLAN_MEMORY", "TLSPLAN_VISIBILITY_MEMORY"])
@pytest.mark.parametrize("size", ["much", "0GB", "0.0000001MB", "9" * 400 + "GB"])
def test_sizes_that_are_none_are_refused_in_one_line(variable: str, size: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(variable, size)
    with pytest.raises(EnvironmentVariableError) as refused:
        memory_from_env(variable)
    assert exit_code_of(refused.value) == 2
    assert str(refused.value) == (
        f"{variable}: got {size[:40]!r}, expected a size such as 8GB or 500MB; correct or unset it"
    )


@pytest.mark.parametrize("arguments", [["plan"], ["plan", "x.ifc", "--grid", "abc"], ["view", "x", "--port", "99999"]])
def test_usage_errors_are_one_line_that_names_the_help(arguments: list[str], tlsplan: Callable[..., Any]) -> None:
    done = tlsplan(*arguments)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"tlsplan {arguments[0]} --help" in done.stderr


def test_who_asks_the_process_to_end_is_not_told_of_a_plan_that_will_not_come(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    note = ProgressEvent("select", 0, 0, "the best plan so far is taken", settles_interrupts=True)
    stream = io.StringIO()
    monkeypatch.setattr(environment, "_interrupted", False)
    monkeypatch.setattr(environment, "_must_end", False)
    environment.prepare(debug=True)
    with ProgressReporter(quiet=True, stream=stream) as reporter:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        reporter.show(note)
        assert "best plan so far" in stream.getvalue()
    stream.truncate(0)
    with ProgressReporter(quiet=True, stream=stream) as reporter:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            reporter.show(note)
        assert "best plan so far" not in stream.getvalue()
