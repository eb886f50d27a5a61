"""Jobs of a batch on Dask workers: the same folder as by this machine alone, whatever becomes of a worker."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tlsplan.batch import on_workers
from waiting import until

from planner_core.cluster import connection, file_jobs, worker, worker_files
from planner_core.errors import PlanFolderError
from planner_core.executor import Outcome, Place
from planner_core.plan_folder import folder

from ...cluster.conftest import Processes, processes, stand_in, threads  # noqa: F401 - a fixture
from .test_batch import PROGRAM, STAND_IN, begun, is_alive, process_of, rows, sites, some_plan, stood_in  # noqa: F401

Batch = Callable[..., Any]
#: What the system of a worker says of a full disk where its language is German.
NO_ROOM = "Auf dem Gerät ist kein Speicherplatz mehr verfügbar"


@pytest.fixture
def fit(stood_in: Path, monkeypatch: pytest.MonkeyPatch) -> Path:  # noqa: F811
    """Workers of the same process scan as it does."""
    monkeypatch.setattr(on_workers, "fit_for_jobs", lambda *_: lambda address: True)
    monkeypatch.setattr(file_jobs, "_WAIT_S", 0.05)
    return stood_in


@pytest.fixture
def two_workers() -> Iterator[str]:
    with threads(2) as address:
        yield address


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a batch, but when and how long its jobs ran."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
        if "jobs" not in path.relative_to(folder).parts and path.name != ".batch.lock"
    }


@pytest.mark.slow
def test_the_folder_is_the_one_of_this_machine_alone(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str
) -> None:
    path = sites(tmp_path, a="plan", b="crash", c="plan", d="refuse")
    alone, there = tmp_path / "alone", tmp_path / "there"
    one = tlsplan("batch", path, "-o", alone)
    other = tlsplan("batch", path, "-o", there, "--scheduler", two_workers)
    assert (one.returncode, other.returncode) == (8, 8), other.stderr
    assert {name: row["message"] for name, row in rows(there).items() if row["state"] == "failed"} == {
        name: row["message"] for name, row in rows(alone).items() if row["state"] == "failed"
    }
    found, expected = contents(there), contents(alone)
    assert list(found) == list(expected)
    words = {name for name in found if name.endswith("words.txt")}
    assert {name for name in found if found[name] != expected[name]} == words, "these name the folders"
    assert sorted(path.name for path in (there / "jobs").iterdir()) == sorted(
        path.name for path in (alone / "jobs").iterdir()
    )
    again = tlsplan("batch", path, "-o", there)
    assert again.returncode == 8
    assert f"{there}" not in "".join(rows(there)["d"]["message"])


@pytest.mark.slow
def test_storeys_are_found_and_planned_there_and_nothing_is_done_twice(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str
) -> None:
    path, out = sites(tmp_path, "floors: each", a="plan"), tmp_path / "out"
    assert tlsplan("batch", path, "-o", out, "--scheduler", two_workers).returncode == 0
    assert list(rows(out)) == ["a-F0", "a-F1"]
    first = begun(out)
    assert tlsplan("batch", path, "-o", out, "--scheduler", two_workers).returncode == 0
    assert begun(out) == first
    assert tlsplan("batch", path, "-o", out).returncode == 0
    assert begun(out) == first, "where it was planned is of no account"


@pytest.mark.slow
def test_a_worker_of_another_version_is_told_and_another_does_its_jobs(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import get_worker

    own, other = worker.greet(), set[str]()

    def greet() -> dict[str, str]:
        if not other:
            other.add(get_worker().address)
        return {**own, "libraries": "numpy 1.0"} if get_worker().address in other else own

    stand_in(monkeypatch, worker, "greet", greet)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert f"worker {other.pop()} is not used: got libraries numpy 1.0, expected numpy" in line


def test_where_all_workers_are_of_another_version_it_is_refused_in_a_line(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch, worker, "greet", lambda: {"version": "0"})
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 6
    assert "none of 2 workers can be used" in done.stderr.splitlines()[-1]
    assert rows(out)["a"]["state"] == "not planned yet"


@pytest.mark.slow
@pytest.mark.parametrize(
    "where",
    [
        "of its cache",
        *(
            pytest.param(each, marks=pytest.mark.slow)
            for each in ("at the start", "while it plans", "while files come")
        ),
    ],
)
def test_a_full_disk_of_a_worker_is_told_and_nothing_is_lost(
    where: str, tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first worker that is asked has no room, and says so in German; in one case the job's process does."""
    from distributed import get_worker

    full, full_disk = set[str](), OSError(errno.ENOSPC, NO_ROOM, "there")

    def is_full() -> bool:
        if not full:
            full.add(get_worker().address)
        return get_worker().address in full

    if where == "at the start":
        sound = worker_files._own_folder
        monkeypatch.setattr(worker_files, "_own_folder", lambda name: raise_(full_disk) if is_full() else sound(name))
    elif where == "while files come":
        take = worker_files.take_piece
        stand_in(monkeypatch, worker_files, "take_piece", lambda *of: raise_(full_disk) if is_full() else take(*of))
    else:
        begin, do = worker_files.begin, on_workers.Command.do

        def begin_there(number: str, *rest: Any) -> None:
            begin(f"full-{number}" if is_full() else number, *rest)
            if is_full():
                worker_files._going[number] = worker_files._going[f"full-{number}"]

        def do_there(self: Any, task: Any, place: Place) -> Outcome:
            if "full-" not in place.folder.name:
                return do(self, task, place)
            if where == "of its cache":
                raise PlanFolderError("kein Platz") from full_disk
            return do(on_workers.Command(("plan", "nothing", "full"), (), "", "."), task, place)

        stand_in(monkeypatch, worker_files, "begin", begin_there)
        monkeypatch.setattr(on_workers.Command, "do", do_there)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan", c="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert f"worker {full.pop()} is not used: " in line
    assert NO_ROOM in line or "kein Platz" in line
    assert {row["state"] for row in rows(out).values()} == {"planned"}
    assert not (out / "jobs" / ".fetched").exists()


@pytest.mark.slow
def test_a_full_disk_here_ends_the_batch_and_it_goes_on_later(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = sites(tmp_path, a="plan", b="plan"), tmp_path / "out"
    sound, n_opened = Path.open, 0

    def opened(self: Path, *of: Any, **more: Any) -> Any:
        nonlocal n_opened
        if ".fetched" in self.parts and self.name == "plan.json":
            n_opened += 1
            if n_opened == 2:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))
        return sound(self, *of, **more)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", opened)
        done = tlsplan("batch", path, "-o", out, "--scheduler", two_workers, "--jobs", 1)
    assert done.returncode == 9
    assert "disk is full" in done.stderr.splitlines()[-1]
    assert {name: row["state"] for name, row in rows(out).items()} == {"a": "planned", "b": "not planned yet"}
    first = begun(out)
    assert tlsplan("batch", path, "-o", out, "--scheduler", two_workers).returncode == 0
    assert begun(out)["a"] == first["a"]


@pytest.mark.slow
def test_a_job_of_a_worker_without_a_device_goes_to_another(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One device is lost after the worker was found fit: the job there ends with the code of what is missing."""
    sound, lost = on_workers.Command.do, list[str]()

    def do(self: Any, task: Any, place: Place) -> Outcome:
        if not lost:
            lost.append("")
            self = on_workers.Command(("scan", "nothing", "lacks"), (), "", ".")
        return sound(self, task, place)

    monkeypatch.setattr(on_workers.Command, "do", do)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert line.endswith("is not used: no OpenCL device; what it had is given to others")


@pytest.mark.parametrize("n_struck", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_bug_at_workers_is_told_and_counted_in_the_end_and_the_batch_is_whole(
    n_struck: int, tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound, struck = on_workers.Command.do, list[str]()

    def do(self: Any, task: Any, place: Place) -> Outcome:
        if len(struck) < n_struck:
            struck.append("")
            raise ZeroDivisionError("odd")
        return sound(self, task, place)

    monkeypatch.setattr(on_workers.Command, "do", do)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 0, done.stderr
    assert {row["state"] for row in rows(out).values()} == {"planned"}
    told = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert "internal error: ZeroDivisionError: odd (" in told[0]
    assert told[1:-1] == ["warning: no worker can do this: this machine goes on alone"][: n_struck - 1]
    assert f"workers: {'1 internal error' if n_struck == 1 else '2 internal errors'}, reported above" in told[-1]
    assert told[-1] == done.stderr.splitlines()[-1]


@pytest.mark.slow
def test_a_slow_worker_does_not_hold_the_others(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One stops for good over a job: when there is nothing else, the other one does it, and the batch ends."""
    sound, held = on_workers.Command.do, list[Place]()

    def do(self: Any, task: Any, place: Place) -> Outcome:
        if not held:
            held.append(place)
            while place.is_wanted():
                worker_files.time.sleep(0.05)
        return sound(self, task, place)

    monkeypatch.setattr(on_workers.Command, "do", do)
    monkeypatch.setattr(file_jobs, "_LONG_S", 0.5)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan", c="plan"), "-o", out, "--scheduler", two_workers)
    assert (done.returncode, len(held)) == (0, 1), done.stderr
    assert not held[0].is_wanted()


def test_where_all_workers_are_gone_this_machine_does_the_rest(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "PATIENCE_S", 1.0)
    calls = iter(range(100_000))
    sound = connection.Connection.workers
    monkeypatch.setattr(connection.Connection, "workers", lambda self: sound(self) if next(calls) < 1 else set())
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="refuse"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 8
    assert {name: row["state"] for name, row in rows(out).items()} == {"a": "planned", "b": "failed"}


def test_a_plan_that_was_reviewed_is_kept(tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str) -> None:
    path, out = sites(tmp_path, a="plan"), tmp_path / "out"
    assert tlsplan("batch", path, "-o", out, "--scheduler", two_workers).returncode == 0
    (out / "plans" / "a" / "review.usda").write_text("mine")
    path.write_text(path.read_text().replace("a.obj", "a.obj, coverage: 90"))
    assert tlsplan("batch", path, "-o", out, "--scheduler", two_workers).returncode == 8
    assert "holds reviewers' changes" in rows(out)["a"]["message"]
    assert (out / "plans" / "a" / "review.usda").read_text() == "mine"


def test_a_plan_that_has_no_place_here_fails_alone(
    tlsplan: Batch, fit: Path, tmp_path: Path, two_workers: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = folder.staged_plan_folder

    def staged(of: Path, **how: Any) -> Any:
        return raise_(PlanFolderError("the review is damaged")) if of.name == "a" else sound(of, **how)

    monkeypatch.setattr(folder, "staged_plan_folder", staged)
    out = tmp_path / "out"
    done = tlsplan("batch", sites(tmp_path, a="plan", b="plan"), "-o", out, "--scheduler", two_workers)
    assert done.returncode == 8
    assert {name: row["message"] for name, row in rows(out).items()} == {"a": "the review is damaged", "b": ""}


def test_a_process_ends_whatever_becomes_of_its_file_job(
    stood_in: Path,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started, sound = list[subprocess.Popen[bytes]](), subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *of, **more: started.append(sound(*of, **more)) or started[0])
    (tmp_path / "made").mkdir()
    (tmp_path / "a.obj").write_text("wait")
    place = Place(tmp_path, tmp_path / "made", lambda name: tmp_path, lambda: True, lambda note: raise_(KeyError()),
                  lambda key, make: make())  # fmt: skip
    with pytest.raises(KeyError):
        on_workers.Command(("plan", str(tmp_path / "a.obj"), "-o", "a"), (), "a", ".").do(None, place)
    assert started[0].poll() is not None


# ------------------------------------------------------------------------------------------------ processes
#: What worker processes do before they work: jobs are stood in for, and a lease ends soon.
BEFORE = (
    f"from tlsplan.batch import runner; runner._PROGRAM = {STAND_IN!r}",
    "from planner_core.cluster import worker_files; worker_files.LEASE_S = 5.0",
)


def by_processes(path: Path, out: Path, scheduler: Processes) -> subprocess.Popen[str]:
    """The command in a process of its own; its workers are found fit."""
    code = f"from tlsplan.batch import on_workers; on_workers.fit_for_jobs = lambda *_: lambda _: True; {PROGRAM}"
    return subprocess.Popen(
        [sys.executable, "-c", code, "batch", str(path), "-o", str(out), "--scheduler", scheduler.address],
        env=dict(os.environ), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def n_done(out: Path) -> int:
    return len(list((out / "jobs").glob("*.json")))


@pytest.mark.slow
@pytest.mark.parametrize("n_workers", [2, *(pytest.param(n, marks=pytest.mark.campaign) for n in (1, 4))])
def test_workers_killed_at_random_moments_change_no_byte(
    n_workers: int,
    tlsplan: Batch,
    fit: Path,
    tmp_path: Path,
    processes: Processes,  # noqa: F811
) -> None:
    chance = np.random.default_rng(n_workers)
    path = sites(tmp_path, **{f"s{number}": "pause" for number in range(6)})
    for _ in range(n_workers):
        processes.start_worker(*BEFORE)
    out = tmp_path / "out"
    batch = by_processes(path, out, processes)
    for moment in sorted(chance.integers(1, 5, 2)):
        until(lambda moment=moment: n_done(out) >= moment)
        alive = [each for each in processes.workers if each.poll() is None]
        alive[int(chance.integers(len(alive)))].kill()
        processes.start_worker(*BEFORE)
    _, said = batch.communicate(timeout=240)
    assert batch.returncode == 0, said
    assert tlsplan("batch", path, "-o", tmp_path / "alone").returncode == 0
    found, expected = contents(out), contents(tmp_path / "alone")
    assert list(found) == list(expected)
    assert {name for name in found if found[name] != expected[name]} == {f"plans/s{n}/words.txt" for n in range(6)}


@pytest.mark.slow
def test_a_scheduler_that_is_started_anew_loses_no_job(
    tlsplan: Batch,
    fit: Path,
    tmp_path: Path,
    processes: Processes,  # noqa: F811
) -> None:
    path, out = sites(tmp_path, **{f"s{number}": "pause" for number in range(4)}), tmp_path / "out"
    processes.start_worker(*BEFORE)
    batch = by_processes(path, out, processes)
    until(lambda: n_done(out) >= 1)
    processes.stop()
    processes.start_scheduler()
    processes.start_worker(*BEFORE)
    _, said = batch.communicate(timeout=240)
    assert batch.returncode == 0, said
    assert {row["state"] for row in rows(out).values()} == {"planned"}


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks at processes as Linux shows them")
@pytest.mark.parametrize("number", [pytest.param(signal.SIGTERM, marks=pytest.mark.campaign), signal.SIGKILL])
def test_jobs_of_a_batch_that_is_ended_end_at_workers_and_it_goes_on(
    number: int,
    tlsplan: Batch,
    fit: Path,
    tmp_path: Path,
    processes: Processes,  # noqa: F811
) -> None:
    path, out = sites(tmp_path, a="pause", b="wait"), tmp_path / "out"
    processes.start_worker(*BEFORE)
    processes.start_worker(*BEFORE)
    batch = by_processes(path, out, processes)

    def below() -> list[Path]:  # folders that go meanwhile are no error, as they are to `rglob`
        walk = os.walk(processes.folder)
        return [Path(folder) / name for folder, folders, files in walk for name in (*folders, *files)]

    def log() -> Path:
        return next((each for each in below() if each.name == "log" and process_of(each)), Path("none"))

    pid = until(lambda: n_done(out) == 1 and process_of(log()))
    refused = tlsplan("batch", path, "-o", out)
    assert (refused.returncode, refused.stderr.count("\n")) == (5, 1)
    batch.send_signal(number)
    batch.communicate(timeout=60)
    until(lambda: not is_alive(pid))
    until(lambda: not [each for each in below() if each.parent.name == "file_jobs"])
    assert not (out / "plans" / "b").exists()
    first = begun(out)
    (tmp_path / "b.obj").write_text("plan")
    again = by_processes(path, out, processes)
    assert (again.communicate(timeout=120), again.returncode)[1] == 0
    assert begun(out)["a"] == first["a"]


@pytest.mark.campaign
def test_a_disk_that_fills_up_at_one_worker_is_told(
    fit: Path,
    tmp_path: Path,
    processes: Processes,  # noqa: F811
) -> None:
    """The system refuses one worker's process, and its jobs', files of more than some bytes."""
    path, out = sites(tmp_path, **{f"s{number}": "pause" for number in range(4)}), tmp_path / "out"
    limit = (
        "import resource as r, signal as s; s.signal(s.SIGXFSZ, s.SIG_IGN); r.setrlimit(r.RLIMIT_FSIZE, (2000, 2000))"
    )
    processes.start_worker(*BEFORE, limit)
    processes.start_worker(*BEFORE)
    batch = by_processes(path, out, processes)
    _, said = batch.communicate(timeout=240)
    assert batch.returncode == 0, said
    told = [line for line in said.splitlines() if line.startswith("warning")]
    assert len(told) == 1
    assert "is not used: " in told[0]
    assert os.strerror(errno.EFBIG) in told[0]


@pytest.mark.slow
def test_the_plan_of_a_worker_is_that_of_the_command_alone(tlsplan: Batch, tmp_path: Path) -> None:
    """By real commands, and workers of another process that are asked to scan first."""
    assert tlsplan("scene", "box", "-o", tmp_path / "box.obj").returncode == 0
    options = {"grid": 1, "patch_area": 0.5, "coverage": 80, "judge": 0, "method": "greedy"}
    (tmp_path / "sites.json").write_text(json.dumps({"defaults": options, "sites": [{"scene": "box.obj"}]}))
    for name, more in (("alone", ()), ("there", ("--scheduler", "local:1"))):
        done = tlsplan("batch", tmp_path / "sites.json", "-o", tmp_path / name, *more)
        assert done.returncode == 0, done.stderr
    found, expected = contents(tmp_path / "there"), contents(tmp_path / "alone")
    assert list(found) == list(expected)
    documents = [json.loads(each.pop("plans/box/plan.json")) for each in (found, expected)]
    assert documents[0].pop("timings_s") != documents[1].pop("timings_s")
    assert documents[0] == documents[1], "the way to the scene included"
    assert {name for name in found if found[name] != expected[name]} <= {"plans/box/report/index.html"}


def raise_(error: Exception) -> Any:
    raise error
