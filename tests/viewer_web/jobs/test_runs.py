"""Runs as processes: begun, watched, killed, found again, resumed, cancelled, deleted."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from planner_core.errors import PlanFolderError, RequirementError
from planner_core.plan_folder.plan_json import read_plan_json
from viewer_web.server.jobs import runs as runs_module
from viewer_web.server.jobs.documents import RunDocument, RunRequest
from viewer_web.server.jobs.files import read_begun
from viewer_web.server.jobs.runs import LeftRun, RunBusyError, RunNotFoundError, Runs
from viewer_web.server.jobs.turn import holder_of_turn

Until = Callable[[Callable[[], bool]], None]
#: Goes on for minutes: the most that three stations cover is not soon proven.
LONG = RunRequest(title="three", objective="coverage", max_stations=3)


@pytest.fixture
def runs(own_hall: Path) -> Iterator[Runs]:
    found = Runs(own_hall)
    yield found
    found.stop()
    if (pid := pid_of_run(own_hall)) is not None:
        with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
            os.kill(pid, signal.SIGKILL)


def pid_of_run(plan_folder: Path) -> int | None:
    holder = holder_of_turn(plan_folder / "runs")
    return None if holder is None else holder.pid


def is_stopped(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"


def is_searching(runs: Runs, run: str) -> bool:
    document = runs.get(run)
    assert document.state == "running", document.message
    return document.best is not None


@pytest.mark.slow
def test_a_run_outlives_its_server_and_goes_on_where_a_killed_one_was(
    own_hall: Path, runs: Runs, until: Until, tmp_path: Path
) -> None:
    plan_bytes = (own_hall / "plan.json").read_bytes()
    first = runs.start(LONG)
    assert (first.id, first.state, first.title) == ("R001", "running", "three")
    with pytest.raises(RunBusyError, match="R001"):
        runs.start(RunRequest())
    with pytest.raises(RunBusyError, match="R001"):
        runs.resume("R001")
    until(lambda: is_searching(runs, "R001"))
    holder = holder_of_turn(own_hall / "runs")
    assert holder is not None
    assert holder.pid is not None
    os.kill(holder.pid, signal.SIGSTOP)  # else it finds a better one until it is killed
    until(lambda: is_stopped(holder.pid))
    best = runs.get("R001").best
    assert best is not None
    assert len(best.stations) == 3

    other = Runs(own_hall)  # as after the server was killed
    assert other.get("R001").state == "running"
    with pytest.raises(RunBusyError, match="R001"):
        other.start(RunRequest())
    with pytest.raises(RunBusyError, match="cancel"):
        other.delete("R001")
    os.kill(holder.pid, signal.SIGKILL)
    until(lambda: other.get("R001").state != "running")
    gone = other.get("R001")
    assert (gone.state, gone.plan, gone.best) == ("failed", None, best)
    assert "memory" in str(gone.message)

    again = other.resume("R001")
    assert (again.id, again.resumed_from, again.request) == ("R002", "R001", LONG)
    assert read_begun(own_hall / "runs" / "R002") == tuple(map(tuple, best.stations))
    until(lambda: is_searching(other, "R002"))
    better = other.get("R002").best
    assert better is not None
    assert better.fraction_of_achievable >= best.fraction_of_achievable
    runs.cancel("R002", why="it is late")  # by the one that did not begin it
    until(lambda: runs.get("R002").state != "running")
    ended = runs.get("R002")
    assert (ended.state, ended.plan) == ("cancelled", "runs/R002/plan")
    assert "because it is late" in str(ended.message)
    plan = read_plan_json(own_hall / "runs/R002/plan")
    assert len(plan["stations"]) <= 3
    assert plan["optimality"]["why_stopped"] == "interrupted"

    runs.delete("R002")
    assert [run.id for run in runs.all()] == ["R001"]
    assert (own_hall / "plan.json").read_bytes() == plan_bytes


def test_a_run_that_is_cancelled_at_once_has_no_plan_and_its_number_is_not_given_again(
    runs: Runs, own_hall: Path, until: Until
) -> None:
    told: list[dict[str, Any]] = []
    deleted: list[str] = []
    watching = Runs(own_hall, tell=told.append, tell_deleted=deleted.append)
    watching.watch()
    runs.start(LONG)
    runs.cancel("R001")
    until(lambda: bool(told) and told[-1]["state"] != "running")
    assert deleted == []
    assert (told[-1]["id"], told[-1]["state"], told[-1]["plan"]) == ("R001", "cancelled", None)
    assert "before it had a plan" in told[-1]["message"]
    with pytest.raises(RunBusyError, match="cancelled already"):
        runs.cancel("R001")
    runs.delete("R001")
    until(lambda: deleted == ["R001"])
    assert watching.stop() is None
    with pytest.raises(RunNotFoundError, match="R001"):
        runs.get("R001")
    assert runs.start(LONG).id == "R002"


def test_deleting_is_told_though_no_look_ever_saw_the_run(own_hall: Path, until: Until) -> None:
    """A run may begin, be cancelled and deleted between two looks of the watcher; pages know it."""
    deleted: list[str] = []
    runs = Runs(own_hall, tell_deleted=deleted.append)
    runs.start(LONG)
    runs.cancel("R001")
    until(lambda: runs.get("R001").state != "running")
    runs.delete("R001")
    assert deleted == ["R001"]


def test_a_run_that_is_cancelled_before_its_process_is_there_is_cancelled(
    runs: Runs, own_hall: Path, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page hears of a run as soon as its folder is there, and its Cancel may come before the process does."""
    spawn = runs_module._spawn

    def spawn_late(*arguments: Any) -> Any:
        assert Runs(own_hall).cancel("R001").cancelling
        return spawn(*arguments)

    monkeypatch.setattr(runs_module, "_spawn", spawn_late)
    runs.start(LONG)
    until(lambda: runs.get("R001").state != "running")
    ended = runs.get("R001")
    assert (ended.state, ended.plan) == ("cancelled", None)


def test_a_server_that_stops_tells_of_the_run_that_goes_on(runs: Runs, own_hall: Path, until: Until) -> None:
    assert Runs(own_hall).stop() is None
    run = runs.start(LONG).id
    plan = own_hall.absolute() / "runs" / run / "plan"
    assert Runs(own_hall).stop() == LeftRun(run, is_ending=False, plan=plan)  # another server's
    until(lambda: pid_of_run(own_hall) is not None)
    pid = pid_of_run(own_hall)
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)  # else it may have ended before it is looked at
    until(lambda: is_stopped(pid))
    try:
        assert runs.stop() == LeftRun(run, is_ending=True, plan=plan)
    finally:
        os.kill(pid, signal.SIGCONT)
    until(lambda: runs.get(run).state == "cancelled")
    assert not list((own_hall / "runs").glob(".*-*"))


def test_what_can_not_be_run_leaves_nothing_behind(runs: Runs, own_hall: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RequirementError, match="covverage"):
        runs.start(RunRequest(requirements={"covverage": 1}))
    usage = shutil.disk_usage(own_hall)._replace(free=1000)
    with monkeypatch.context() as patch, pytest.raises(PlanFolderError, match="MB left"):
        patch.setattr(runs_module.shutil, "disk_usage", lambda _: usage)
        runs.start(RunRequest())
    with monkeypatch.context() as patch, pytest.raises(PlanFolderError, match="not started"):
        patch.setattr(runs_module.subprocess, "Popen", _fails)
        runs.start(RunRequest())
    (own_hall.parent / "hall.ply").unlink()
    with pytest.raises(PlanFolderError, match="--scene"):
        runs.start(RunRequest())
    assert runs.all() == []
    assert [path.name for path in (own_hall / "runs").iterdir()] == [".turn"]


def test_what_is_in_the_way_of_a_run_is_told_while_it_is(own_hall: Path, tmp_path: Path) -> None:
    runs, scene = Runs(own_hall), own_hall.parent / "hall.ply"
    assert runs.obstacle() is None
    away = scene.rename(tmp_path / "away.ply")
    assert "hall.ply is not found" in str(runs.obstacle())
    assert Runs(own_hall, scene=away).obstacle() is None
    scene.write_bytes(b"another building")
    assert "has changed" in str(runs.obstacle())
    away.replace(scene)
    assert runs.obstacle() is None


def _fails(*_: object, **__: object) -> None:
    raise OSError(12, "Cannot allocate memory")


def test_what_is_no_run_is_not_taken_for_one(runs: Runs, own_hall: Path) -> None:
    (own_hall / "runs" / "R003").mkdir(parents=True)
    (own_hall / "runs" / "R003" / "run.json").write_text("{}")
    (own_hall / "runs" / "notes").mkdir()
    assert runs.all() == []
    with pytest.raises(PlanFolderError, match="delete"):
        runs.get("R003")
    for name in ("..", "R003/../R003", "notes", "R004", ""):
        with pytest.raises(RunNotFoundError):
            runs.get(name)
    runs.delete("R003")
    assert (own_hall / "runs" / "notes").is_dir()


def test_a_server_that_only_reads_tells_of_dead_runs_and_writes_nothing(own_hall: Path) -> None:
    folder = own_hall / "runs" / "R001"
    folder.mkdir(parents=True)
    document = RunDocument(
        id="R001", title="t", state="running", created="2026-11-21T16:30:00Z", request=LONG, plan_sha256="", revision=0
    )
    runs_module.write_run(folder, document, keep=False)
    before = (folder / "run.json").read_bytes()
    (folder / "output.txt").write_text("Traceback\nOSError: [Errno 28] No space left on device\n")
    told = Runs(own_hall, read_only=True).get("R001")
    assert (told.state, "No space left" in str(told.message)) == ("failed", True)
    assert (folder / "run.json").read_bytes() == before
    (folder / "cancel").touch()
    assert Runs(own_hall).get("R001").state == "cancelled"
    assert (folder / "run.json").read_bytes() != before


def test_a_document_reads_back_as_it_was_written(runs: Runs, own_hall: Path) -> None:
    folder = own_hall / "runs" / "R001"
    folder.mkdir(parents=True)
    document = RunDocument(
        id="R001",
        title="Café",
        state="finished",
        created="2026-11-21T16:30:00Z",
        request=LONG,
        plan_sha256="ab",
        revision=3,
    )
    runs_module.write_run(folder, document, keep=True)
    assert runs.get("R001") == document
    assert [path.name for path in folder.iterdir()] == ["run.json"]
