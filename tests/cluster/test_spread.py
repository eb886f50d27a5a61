"""Plans over workers: the bytes of one process, whoever is slow, dies, or is another version."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from waiting import until

import scenes_synthetic
from planner_core.cluster import spread, worker
from planner_core.cluster.spread import open_cluster
from planner_core.errors import ClusterError, MissingPackageError
from planner_core.model import Plan
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document
from planner_core.planning.plan import make_plan
from planner_core.requirements import look_spread
from planner_core.requirements.look_around import Looked
from planner_core.spread import spread_over

from .conftest import SETTINGS, Killer, Look, Processes, assert_same_bits, cluster_of, stand_in


def text_of(plan: Plan) -> str:
    document = plan_document(plan, None)
    return json.dumps({key: value for key, value in document.items() if key not in DROPPABLE_KEYS})


@pytest.mark.parametrize("n_workers", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
def test_what_workers_see_is_what_one_process_sees(look: Look, n_workers: int) -> None:
    with cluster_of(n_workers) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
    assert told == []


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


def test_a_worker_without_a_device_is_refused(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    from planner_core.errors import DeviceError

    def no_device(*_: Any, **__: Any) -> None:
        raise DeviceError("no OpenCL platform, expected one; see `tlsplan doctor`")

    monkeypatch.setattr(look_spread, "open_engine", no_device)
    monkeypatch.setattr(worker, "_kept", {})
    with cluster_of(1) as (cluster, told), pytest.raises(ClusterError):
        look.by(cluster)
    assert "got no answer (no OpenCL platform, expected one" in told[0]


def test_a_worker_that_forgot_is_sent_it_again(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    sound, n_looks = worker.answer, 0

    def look_forgetfully(digest: str, task: Any) -> bytes:
        nonlocal n_looks
        n_looks += 1
        if n_looks == 3:
            worker._questions.clear()
            worker._arrays.clear()
        return sound(digest, task)

    stand_in(monkeypatch, worker, "answer", look_forgetfully)
    with cluster_of(1) as (cluster, told):
        assert_same_bits(look.by(cluster), look.here())
    assert (n_looks > 3, told) == (True, [])


@pytest.mark.parametrize("from_the_start", [False, True])
def test_a_slow_worker_does_not_hold_the_others(
    look: Look, monkeypatch: pytest.MonkeyPatch, from_the_start: bool
) -> None:
    """One worker stops for good, in the probe or after it: its batches are done by the other."""
    from distributed import get_worker

    sound, slow, done = worker.answer, set[str](), []

    def look_slowly(digest: str, task: Any) -> bytes:
        at = get_worker().address
        if (from_the_start or len(task) > look_spread.FIRST_POSITIONS) and not slow:
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


def test_where_all_workers_are_gone_this_machine_goes_on_alone(look: Look, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread, "PATIENCE_S", 1.0)
    with cluster_of(1) as (cluster, told):
        monkeypatch.setattr(cluster, "workers", set)
        assert_same_bits(look.by(cluster), look.here())
    assert told == ["no worker for 1 s: this machine goes on alone"]


def test_without_dask_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingPackageError, match=r"pip install tlsplan\[cluster\]"), open_cluster("local", tell=print):
        pass


def test_no_scheduler_and_no_number_are_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread, "_CONNECTS_WITHIN_S", 1.0)
    with pytest.raises(ClusterError, match="expected a Dask scheduler"), open_cluster("tcp://127.0.0.1:9", tell=print):
        pass
    with pytest.raises(ClusterError, match="expected a number of workers"), open_cluster("local:many", tell=print):
        pass


# ------------------------------------------------------------------------------------------------ processes
def looked_while(look: Look, processes: Processes, disturb: Any) -> Looked:
    """What workers see while something goes wrong, told by how far they are."""
    from planner_core.progress import ProgressEvent

    def hear(event: ProgressEvent) -> None:
        disturb(event.done / event.total)

    with open_cluster(processes.address, tell=print) as cluster:
        until(lambda: len(cluster.workers()) == len(processes.workers))
        return look.by(cluster, progress=hear)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
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
