"""Plans over workers: the bytes of one process, whoever is slow, dies, or is another version."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from slow_cases import all_slow_but
from waiting import until

import scenes_synthetic
from planner_core.cluster import connection, task_dispatcher, worker
from planner_core.cluster.executor import open_cluster
from planner_core.cluster.payloads import Packer
from planner_core.errors import ClusterError, DeviceError
from planner_core.executor import Kept, NotWantedError, Task, spread_over
from planner_core.model import Plan
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document
from planner_core.planning.plan import make_plan
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements import observe_candidates
from planner_core.requirements.observe_candidates import CandidateObservations

from .conftest import SETTINGS, Killer, Look, Processes, assert_same_bits, cluster_of, stand_in


def text_of(plan: Plan) -> str:
    document = plan_document(plan, None)
    return json.dumps({key: value for key, value in document.items() if key not in DROPPABLE_KEYS})


@pytest.mark.slow
@pytest.mark.parametrize("n_workers", [1, 2, pytest.param(4, marks=pytest.mark.campaign)])
def test_what_workers_see_is_what_one_process_sees(look: Look, n_workers: int) -> None:
    with cluster_of(n_workers) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
    assert told == []


@pytest.mark.slow
def test_a_plan_over_workers_has_the_bytes_of_one_process() -> None:
    scene = scenes_synthetic.build("two-rooms").scene
    with cluster_of(2) as (cluster, told), spread_over(cluster):
        spread_out = make_plan(scene, SETTINGS)
    assert text_of(spread_out) == text_of(make_plan(scene, SETTINGS))
    assert told == []


def test_a_worker_of_another_version_is_refused_in_one_line(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    own = worker.greet()
    stand_in(monkeypatch, worker, "greet", lambda: {**own, "sources": "other"})
    with cluster_of(1) as (cluster, told), pytest.raises(ClusterError, match="none of 1 workers can be used"):
        look.by(cluster)
    (line,) = told
    assert f"got sources other, expected {own['sources']}" in line


def test_a_worker_that_scans_otherwise_is_refused_and_the_others_do_all(
    look: Look, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two workers one answers something else, as another device may."""
    from distributed import get_worker

    sound, odd = worker.answer, set[str]()

    def look_oddly(digest: str, task: Any) -> bytes:
        at = get_worker().address
        if not odd:
            odd.add(at)
        return b"other bits" if at in odd else sound(digest, task)

    stand_in(monkeypatch, worker, "answer", look_oddly)
    with cluster_of(2) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
    (line,) = told
    assert line.startswith(f"worker {odd.pop()} is not used: got an answer that differs")


@pytest.mark.parametrize("kind", [DeviceError, OSError, MemoryError, ImportError])
def test_a_worker_without_a_device_room_or_package_is_refused(
    look: Look, monkeypatch: pytest.MonkeyPatch, kind: type[Exception]
) -> None:
    def no_device(*_: Any, **__: Any) -> None:
        raise kind("no OpenCL platform, expected one; see `tlsplan doctor`")

    monkeypatch.setattr(observe_candidates, "open_engine", no_device)
    monkeypatch.setattr(worker, "_kept", {})
    with cluster_of(1) as (cluster, told), pytest.raises(ClusterError):
        look.by(cluster)
    (line,) = told
    assert "got no answer (no OpenCL platform, expected one" in line


@pytest.mark.slow
def test_workers_that_are_refused_later_on_leave_the_rest_to_this_machine(
    look: Look, monkeypatch: pytest.MonkeyPatch
) -> None:
    with cluster_of(2) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
        stand_in(monkeypatch, worker, "answer", lambda digest, task: raise_(MemoryError("no room")))
        assert_same_bits(look.by(cluster), look.here())
    *refused, alone = told
    assert len(refused) == 2
    assert all("is not used: got no answer (no room)" in line for line in refused)
    assert alone == "no worker can do this: this machine goes on alone"


# ---------------------------------------------------------------------------------------------------- bugs
@pytest.mark.parametrize("when", all_slow_but(["first asked"], ["first asked", "later", "at once after"]))
def test_a_bug_at_workers_is_told_with_where_and_counted_and_this_machine_goes_on_alone(
    look: Look, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    """Nobody is waited for, and nobody is asked the same again."""
    from distributed import get_worker

    sound, asked = observe_candidates.observe_candidates_here, list[str]()

    def observed(survey: Any, engine: Any, at_m: Any, *of: Any, **more: Any) -> CandidateObservations:
        with contextlib.suppress(ValueError):  # this is no worker
            asked.append(get_worker().address)
            if when != "later" or len(at_m) > observe_candidates.FIRST_POSITIONS:
                raise ZeroDivisionError("odd rows")
        return sound(survey, engine, at_m, *of, **more)

    monkeypatch.setattr(observe_candidates, "observe_candidates_here", observed)
    monkeypatch.setattr(connection, "PATIENCE_S", 120.0)
    with cluster_of(2) as (cluster, told):
        assert cluster.last_words() == []
        if when == "at once after":
            monkeypatch.setattr(observe_candidates, "observe_candidates_here", sound)
            assert_same_bits(look.by(cluster), look.here())
            monkeypatch.setattr(observe_candidates, "observe_candidates_here", observed)
        assert_same_bits(look.by(cluster), look.here())
        n_bugs = cluster.n_bugs
        (last,) = cluster.last_words()
    assert n_bugs == 2 if when != "later" else 2 <= n_bugs <= 2 * task_dispatcher._AHEAD
    assert len(set(asked)) == 2
    assert len(asked) <= (2 if when != "later" else 2 + 2 * task_dispatcher._AHEAD)
    bug, alone = told
    assert bug.startswith("worker inproc://")
    assert "internal error: ZeroDivisionError: odd rows (planner_core.requirements.observe_candidates:" in bug
    assert "in answer). This is a bug: please report it" in bug
    assert alone == "no worker can do this: this machine goes on alone"
    assert f"{n_bugs} internal errors, reported above" in last


def test_a_bug_over_one_task_takes_no_more_workers_than_others_are_left(
    look: Look, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three of five fail at it: then it is done here, and the others do the rest."""
    sound, struck = worker.answer, set[str]()
    monkeypatch.setattr(observe_candidates, "TASK_POSITIONS", 5)
    odd = look.positions_m[-3:]

    def answer(digest: str, task: Any) -> bytes:
        from distributed import get_worker

        if np.array_equal(task, odd):
            struck.add(get_worker().address)
            raise KeyError("odd rows")
        return sound(digest, task)

    stand_in(monkeypatch, worker, "answer", answer)
    at_m = look.positions_m[:82]
    odd = at_m[-3:]
    with cluster_of(5) as (cluster, told):
        assert_same_bits(replace(look, positions_m=at_m).by(cluster), look.here(at_m))
        assert 3 <= cluster.n_bugs <= len(struck) <= 4, "a copy of it may be out"
    (line,) = told
    assert "internal error: KeyError: 'odd rows' (" in line


def test_a_task_that_failed_often_is_done_here_whoever_has_a_copy() -> None:
    cluster = connection.Connection("nowhere", SimpleNamespace(), print)
    dealt = task_dispatcher.TaskDispatcher(
        cluster, Packer().payload(0), [Task(0, 1), Task(1, 1)], bytes, "scan", silent, None
    )
    dealt._waiting, dealt._out = [], {"copy": ("w2", 1)}
    for n_failures in range(1, 5):
        dealt._failed("w1", 1, SimpleNamespace(status="lost"))
        assert dealt._for_here == ([1] if n_failures >= 3 else [])


def test_the_last_task_goes_to_two_who_are_idle_at_once() -> None:
    """A copy of what was dealt in this very look."""
    cluster = connection.Connection("nowhere", SimpleNamespace(submit=lambda *_, **how: Future()), print)
    dealt = task_dispatcher.TaskDispatcher(
        cluster, Packer().payload(0), [Task(0, 1), Task(1, 1)], bytes, "scan", silent, None
    )
    dealt._pool.used = {"w1", "w2", "w3"}
    dealt._dispatch()
    assert sorted(dealt._out.values()) == [("w1", 1), ("w2", 1)]
    assert dealt._waiting == []


def test_a_bug_while_tasks_are_dealt_is_told_and_this_machine_goes_on_alone(
    look: Look, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(task_dispatcher.TaskDispatcher, "_dispatch", lambda self: raise_(KeyError("odd")))
    with cluster_of(1) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
        assert cluster.n_bugs == 1
    bug, alone = told
    assert bug.startswith("this machine: internal error: KeyError: 'odd' (")
    assert alone == "no worker can do this: this machine goes on alone"


@pytest.mark.slow
def test_a_task_that_could_not_be_sent_is_sent_again(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the scheduler goes in just this moment."""
    sound, n_sent = task_dispatcher.TaskDispatcher._send, 0

    def send(self: Any, address: str, number: int) -> None:
        nonlocal n_sent
        n_sent += 1
        if n_sent == 2:
            raise OSError("gone")
        sound(self, address, number)

    def hear(event: ProgressEvent, n_heard: list[None] = []) -> None:  # noqa: B006 - counts all
        n_heard.append(None)
        assert len(n_heard) < 200, "it is dealt no more"

    monkeypatch.setattr(task_dispatcher.TaskDispatcher, "_send", send)
    with cluster_of(1) as (cluster, told):
        assert_same_bits(look.by(cluster, hear), look.here())
    assert told == []


class Breaks:
    """Can't be unpacked: as a job of ours with a bug."""

    def __reduce__(self) -> Any:
        return raise_, (KeyError("odd"),)


def test_a_job_that_breaks_while_it_is_unpacked_is_no_job_that_lacks_an_array() -> None:
    packed = Packer().payload(np.arange(5000))
    with pytest.raises(worker.LackingError):
        worker.take_job("digest", packed.body, list(packed.arrays))
    with pytest.raises(KeyError, match="odd"):
        worker.take_job("digest", pickle.dumps(Breaks()), [])


# ------------------------------------------------------------------------------------------------- the end
@dataclass(frozen=True)
class Endless:
    """A job whose tasks end when nobody waits, but for the first and those that are quick."""

    def answer(self, task: str, kept: Kept, progress: Progress = silent) -> bytes:
        if task.startswith("endless"):
            _begun.append(task)
            until_s = time.monotonic() + 60
            try:
                while time.monotonic() < until_s:
                    progress(ProgressEvent("scan", 0, 0))
                    time.sleep(0.01)
            except NotWantedError:
                _ended.append(task)
                raise
        return task.encode()


_begun, _ended = list[str](), list[str]()


def test_what_progress_raises_ends_the_wait_and_the_work_of_workers_and_answers_stay() -> None:
    _begun.clear(), _ended.clear()
    heard: dict[int, bytes] = {}
    tasks = [Task(name, 1) for name in ("first", "quick 1", "endless 1", "endless 2", "quick 2")]

    def interrupt(event: ProgressEvent) -> None:
        if _begun and event.done >= 2:
            raise KeyboardInterrupt

    with cluster_of(1) as (cluster, told):  # two in one process wait for each other: an endless task before a quick one
        with pytest.raises(KeyboardInterrupt):
            cluster.answers(
                Endless(), tasks, here=str.encode, stage="scan", progress=interrupt, answered=heard.__setitem__
            )
        until(lambda: sorted(_ended) == sorted(_begun))
        assert cluster.ask(sorted(cluster.workers())[0], worker.greet) == worker.greet()
    assert set(heard) <= {0, 1, 4}
    assert len(heard) >= 2
    assert all(heard[number] == tasks[number].of.encode() for number in heard)
    assert told == []


def test_a_worker_that_forgot_is_sent_it_again(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    sound, n_looks = worker.answer, 0

    def look_forgetfully(digest: str, task: Any) -> bytes:
        nonlocal n_looks
        n_looks += 1
        if n_looks == 3:
            worker._jobs.clear()
            worker._arrays.clear()
        return sound(digest, task)

    stand_in(monkeypatch, worker, "answer", look_forgetfully)
    with cluster_of(1) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
    assert (n_looks > 3, told) == (True, [])


@pytest.mark.slow
@pytest.mark.parametrize("from_the_start", [False, True])
def test_a_slow_worker_does_not_hold_the_others(
    look: Look, monkeypatch: pytest.MonkeyPatch, from_the_start: bool
) -> None:
    """One worker stops for good, in the probe or after it: its batches are done by the other."""
    from distributed import get_worker

    sound, slow, done = worker.answer, set[str](), []

    def look_slowly(digest: str, task: Any) -> bytes:
        at = get_worker().address
        if (from_the_start or len(task) > observe_candidates.FIRST_POSITIONS) and not slow:
            slow.add(at)
        if at in slow:
            while not done:
                time.sleep(0.05)
        return sound(digest, task)

    stand_in(monkeypatch, worker, "answer", look_slowly)
    with cluster_of(2) as (cluster, _):
        try:
            found = look.by(cluster)
        finally:
            done.append(True)
    assert len(slow) == 1
    assert_same_bits(found, look.here())


@pytest.mark.slow
def test_where_all_workers_are_gone_this_machine_goes_on_alone(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "PATIENCE_S", 1.0)
    with cluster_of(1) as (cluster, told):
        monkeypatch.setattr(cluster, "workers", set)
        assert_same_bits(look.by(cluster), look.here())
    assert told == ["no worker for 1 s: this machine goes on alone"]


# ------------------------------------------------------------------------------------------------ processes
def looked_while(look: Look, processes: Processes, disturb: Any) -> CandidateObservations:
    """What workers see while something goes wrong, told by how far they are."""

    def hear(event: ProgressEvent) -> None:
        disturb(event.done / event.total)

    with open_cluster(processes.address, tell=print) as cluster:
        until(lambda: len(cluster.workers()) == len(processes.workers))
        return look.by(cluster, progress=hear)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.campaign) for n in (2, 3))])
def test_workers_killed_at_random_moments_change_no_bit(look: Look, processes: Processes, seed: int) -> None:
    for _ in range(2):
        processes.start_worker()
    killer = Killer(processes, seed, last=0.9)
    found = looked_while(replace(look, positions_m=np.tile(look.positions_m, (3, 1))), processes, killer)
    assert killer.n_killed >= 2
    assert_same_bits(found, look.here(np.tile(look.positions_m, (3, 1))))


@pytest.mark.slow
def test_a_scheduler_that_is_started_anew_changes_no_bit(look: Look, processes: Processes) -> None:
    processes.start_worker()
    restarted = False

    def disturb(share: float) -> None:
        nonlocal restarted
        if not restarted and share > 0.2:
            processes.stop()
            processes.start_scheduler()
            processes.start_worker()
            restarted = True

    at_m = np.tile(look.positions_m, (3, 1))
    found = looked_while(replace(look, positions_m=at_m), processes, disturb)
    assert restarted
    assert_same_bits(found, look.here(at_m))


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="stops a process as POSIX does")
def test_a_scheduler_that_never_answers_is_not_waited_for(
    look: Look, processes: Processes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is stopped for good: this machine goes on alone; with what went wrong it is woken up after a minute."""
    monkeypatch.setattr(connection, "PATIENCE_S", 3.0)
    monkeypatch.setattr(connection, "FETCHES_WITHIN_S", 1.0)
    processes.start_worker()
    told, woken = list[str](), threading.Event()

    def wake() -> None:
        woken.set()
        os.kill(processes.scheduler.pid, signal.SIGCONT)

    alarm = threading.Timer(60.0, wake)

    def disturb(event: ProgressEvent) -> None:
        if event.done >= 20 and not alarm.is_alive() and not woken.is_set():
            os.kill(processes.scheduler.pid, signal.SIGSTOP)
            alarm.start()

    with open_cluster(processes.address, tell=told.append) as cluster:
        try:
            found = look.by(cluster, progress=disturb)
        finally:
            alarm.cancel()
            os.kill(processes.scheduler.pid, signal.SIGCONT)
    assert told == ["no worker for 3 s: this machine goes on alone"]
    assert not woken.is_set()
    assert_same_bits(found, look.here())


#: What a worker's process does before it works: it goes on for ever, and leaves files of what it began and ended.
ENDLESS = """exec('''
import pathlib, time
from planner_core.progress import ProgressEvent
from planner_core.requirements import observe_candidates
from planner_core.executor import NotWantedError
sound, folder = observe_candidates.ObservationJob.answer, pathlib.Path({folder!r})
def answer(self, task, kept, progress):
    if len(task) <= observe_candidates.FIRST_POSITIONS:
        return sound(self, task, kept, progress)
    (folder / f"begun-{{task[0, 0]}}").touch()
    try:
        while True:
            progress(ProgressEvent("scan", 0, 0))
            time.sleep(0.01)
    except NotWantedError:
        (folder / f"ended-{{task[0, 0]}}").touch()
        raise
observe_candidates.ObservationJob.answer = answer
''')"""
#: A process that asks workers.
ASKS = """
import sys
sys.path[:0] = [sys.argv[1]]
from cluster.conftest import made_look
from planner_core.cluster.executor import open_cluster
look = made_look()
with open_cluster(sys.argv[2], tell=print) as cluster:
    look.by(cluster)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.campaign), signal.SIGKILL])
def test_workers_end_what_nobody_waits_for_where_who_asked_is_interrupted_or_killed(
    number: int, processes: Processes, tmp_path: Path
) -> None:
    for _ in range(2):
        processes.start_worker(ENDLESS.format(folder=str(tmp_path)))
    asks = subprocess.Popen([sys.executable, "-c", ASKS, str(Path(__file__).parent.parent), processes.address])

    def named(what: str) -> set[str]:
        return {path.name.removeprefix(what) for path in tmp_path.glob(f"{what}*")}

    try:
        until(lambda: len(named("begun-")) == 2)
        asks.send_signal(number)
        asks.wait(60)
        until(lambda: named("ended-") == named("begun-"))
    finally:
        asks.kill()
        asks.wait()


def raise_(error: Exception) -> Any:
    raise error


def test_of_two_answers_to_a_task_the_first_counts_and_is_heard_of_once() -> None:
    heard: list[tuple[int, bytes]] = []
    dealt = task_dispatcher.TaskDispatcher.__new__(task_dispatcher.TaskDispatcher)
    dealt._answers, dealt._answered = {}, lambda number, answer: heard.append((number, answer))
    for answer in (b"first", b"late"):
        dealt._keep(1, answer)
    assert (dealt._answers, heard) == ({1: b"first"}, [(1, b"first")])
