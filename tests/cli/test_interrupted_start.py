"""Ctrl-C in the first tenths of a second, while the command is still being imported: one line, exit code 130."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

INTERRUPTED = "tlsplan: interrupted; nothing was left half-written. Run the same command to start again."

#: Begins the command, and interrupts it when a module is about to be imported, as a user would from outside.
AT_IMPORT = """
import os, signal, sys
_, module, sent, how, *arguments = sys.argv
def strike():
    os.kill(os.getpid(), getattr(signal, sent))
class ByTheWay:
    def __del__(self):  # whatever is raised in here is printed and goes no further
        strike()
class Interrupting:
    def find_spec(name, path=None, target=None):
        if name == module:
            try:
                if how == "by the way":
                    ByTheWay()
                elif how == "inside exec":  # dataclasses and compilers run text
                    exec("strike()")
                else:
                    strike()
            except KeyboardInterrupt:
                raise OSError("it is not there") if how == "error" else KeyboardInterrupt
sys.meta_path.insert(0, Interrupting)
from tlsplan.main import main
sys.argv[1:] = arguments
main()
"""


def some_slow(*modules: str) -> list[Any]:
    return [pytest.param(module, marks=pytest.mark.slow) for module in modules]


def interrupted_at(
    module: str,
    sent: str = "SIGINT",
    arguments: Sequence[str | Path] = ("export", "plan", "--list"),
    *,
    how: str = "import",
) -> subprocess.CompletedProcess[str]:
    return python(AT_IMPORT, module, sent, how, *map(str, arguments))


def python(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)


@pytest.mark.parametrize(
    "module",
    ["click", "tlsplan.commands.export", *some_slow(
        "click.core", "tlsplan.environment", "tlsplan.exit_codes", "tlsplan.group", "tlsplan.options",
        "planner_core.export.formats", "numpy",
    )],
)  # fmt: skip
def test_an_interrupt_of_any_import_is_one_line_and_exit_code_130(module: str) -> None:
    done = interrupted_at(module)
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


def test_who_asks_the_process_to_end_while_it_begins_is_answered_alike() -> None:
    done = interrupted_at("tlsplan.group", "SIGTERM")
    assert (done.returncode, done.stderr) == (130, f"{INTERRUPTED}\n")


def test_the_command_begins_without_any_import_that_takes_time() -> None:
    program = (
        "import json, sys; before = set(sys.modules); import tlsplan.main; "
        "print(json.dumps(sorted(set(sys.modules) - before)))"
    )
    done = python(program)
    added = [name for name in json.loads(done.stdout) if not name.startswith("tlsplan")]
    assert set(added) <= {"signal", "_signal", "enum"}


def test_an_interrupt_while_standard_error_is_closed_is_no_traceback() -> None:
    command = f"{sys.executable} -c '{AT_IMPORT}' click SIGINT import 2>&-; echo $?"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, timeout=240)
    assert done.stdout == "130\n"


@pytest.mark.slow
def test_an_interrupt_from_outside_at_any_moment_after_the_beginning_is_one_line(tmp_path: Path) -> None:
    # The child says when it heeds interrupts; then it is interrupted after longer and longer waits.
    program = (
        "import os, sys, signal; from tlsplan import main as begun\n"
        "heed = signal.signal\n"
        "def told(number, handler):\n"
        "    before = heed(number, handler)\n"
        "    if number == signal.SIGTERM and handler is begun._leave: os.write(1, b'heeds\\n')\n"
        "    return before\n"
        "signal.signal = told\n"
        "sys.argv[1:] = ['demo', '-o', sys.argv[1]]\n"
        "begun.main()\n"
    )
    for wait_s in (0.0, 0.03, 0.1, 0.3):
        child = subprocess.Popen(
            [sys.executable, "-c", program, str(tmp_path / "demo")],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "COLUMNS": "100"},
        )  # fmt: skip
        assert child.stdout is not None
        assert child.stdout.readline() == "heeds\n"
        time.sleep(wait_s)
        child.send_signal(signal.SIGINT)
        _, said = child.communicate(timeout=240)
        assert child.returncode == 130, said
        assert [line for line in said.splitlines() if line.startswith("tlsplan")] == [INTERRUPTED]
        assert "Traceback" not in said
    assert not (tmp_path / "demo").exists()


@pytest.mark.slow
@pytest.mark.parametrize("module", ["pxr.Vt._vt", *some_slow("pxr.Ar", "pxr.Plug._plug")])
def test_an_interrupt_of_an_import_by_compiled_code_waits_until_that_is_loaded(module: str, tmp_path: Path) -> None:
    # The C++ of pxr imports other modules of it, and prints a traceback for whatever is raised there.
    done = interrupted_at(module, arguments=("plan", tmp_path / "none.ifc", "-o", tmp_path / "plan"))
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


@pytest.mark.parametrize("module", ["numpy", *some_slow("click.decorators", "planner_core.export.formats")])
def test_an_interrupt_of_what_python_calls_by_the_way_is_neither_lost_nor_a_traceback(module: str) -> None:
    done = interrupted_at(module, how="by the way")
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


def test_an_interrupt_of_text_that_python_runs_ends_by_the_exit_code_and_not_by_a_signal(tmp_path: Path) -> None:
    (tmp_path / "begun.py").write_text(AT_IMPORT)  # `-m` alone asks Python how it ends
    arguments = ("planner_core.export.formats", "SIGINT", "inside exec", "export", "plan", "--list")
    command = [sys.executable, "-m", "begun", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False, cwd=tmp_path)
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


def test_an_interrupt_that_a_package_takes_for_an_error_of_its_own_is_told_as_what_it_is() -> None:
    done = interrupted_at("planner_core.export.formats", how="error")
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


def test_who_interrupts_again_while_it_is_told_is_told_once() -> None:
    program = AT_IMPORT.replace(
        "from tlsplan.main import main\n",
        "import click\n"
        "def interrupted_echo(*words, echo=click.echo, **how):\n"
        "    strike()\n"
        "    echo(*words, **how)\n"
        "click.echo = interrupted_echo\n"
        "from tlsplan.main import main\n",
    )
    done = python(program, "numpy", "SIGINT", "import", "export", "plan", "--list")
    assert (done.returncode, done.stderr.strip(), done.stdout) == (130, INTERRUPTED, "")


def test_an_interrupt_of_the_end_of_the_process_leaves_its_result_as_it_is() -> None:
    program = (
        "import atexit, os, signal, sys; from tlsplan.main import main; sys.argv[1:] = ['--version'];"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT)); main()"
    )
    done = python(program)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("tlsplan")
