"""Whose turn it is, across processes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from planner_core.plan_folder.carry_over import carry_over
from viewer_web.server.jobs.turn import Holder, holder_of_turn, last_run, take_turn, tell_turn

WAIT = "import sys; print('here', flush=True); sys.stdin.read()"


def hold(folder: Path, run: str) -> subprocess.Popen[str]:
    """A process that inherits the turn, which is let go here."""
    turn = take_turn(folder)
    assert turn is not None
    process = subprocess.Popen(
        [sys.executable, "-c", WAIT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, pass_fds=(turn,)
    )
    tell_turn(turn, run, process.pid)
    os.close(turn)
    assert process.stdout is not None
    assert process.stdout.readline() == "here\n"
    return process


@pytest.mark.slow
def test_a_turn_lasts_as_long_as_the_process_that_inherited_it(tmp_path: Path) -> None:
    assert holder_of_turn(tmp_path) is None
    with hold(tmp_path, "R007") as process:
        try:
            assert holder_of_turn(tmp_path) == Holder("R007", process.pid)
            assert take_turn(tmp_path) is None
        finally:
            process.kill()
    assert holder_of_turn(tmp_path) is None
    assert last_run(tmp_path) == "R007"
    turn = take_turn(tmp_path)
    assert turn is not None
    os.close(turn)


@pytest.mark.slow
def test_a_turn_is_still_held_where_the_plan_around_it_is_replaced(hall: Path, tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    shutil.copytree(hall / "plan", old)
    shutil.copytree(hall / "plan", new)
    (old / "runs").mkdir()
    with hold(old / "runs", "R001") as process:
        try:
            assert "runs/.turn" in carry_over(old, new)
            assert holder_of_turn(new / "runs") == Holder("R001", process.pid)
        finally:
            process.kill()


def test_a_file_that_somebody_else_wrote_names_nobody(tmp_path: Path) -> None:
    (tmp_path / ".turn").write_text("[]")
    assert last_run(tmp_path) == ""
    assert holder_of_turn(tmp_path) is None
