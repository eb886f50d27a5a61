"""A small building with limits of points, what one process sees of it, and Dask clusters of a test's own."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenes_synthetic
from planner_core.cluster.executor import Cluster, open_cluster
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.executor import Executor
from planner_core.model import (
    FloatArray,
    PartRequirement,
    PlanSettings,
    PointLimits,
    Proven,
    Requirements,
    Survey,
    VisibilityMode,
)
from planner_core.progress import Progress, silent
from planner_core.requirements.goals import Goals, goals_of
from planner_core.requirements.observe_candidates import (
    CandidateObservations,
    observe_candidates_here,
    observe_elsewhere,
)
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=360),
    requirements=Requirements(coverage=0.9),
    grid_step_m=0.6,
    instrument_heights_m=(1.5,),
    max_patch_area_m2=0.2,
    scan_mode=VisibilityMode.PATCHES,
    method=Proven(work_limit=0.1),
    refine=False,
)


@dataclass(frozen=True)
class Look:
    """What is looked at, from where, and what this process sees."""

    survey: Survey
    engine: ScanEngine
    goals: Goals
    positions_m: FloatArray
    settings: PlanSettings = SETTINGS

    def here(self, positions_m: FloatArray | None = None) -> CandidateObservations:
        at_m = self.positions_m if positions_m is None else positions_m
        return observe_candidates_here(self.survey, self.engine, at_m, self.goals, notes_needed=True, progress=silent)

    def by(self, executor: Executor, progress: Progress = silent) -> CandidateObservations:
        return observe_elsewhere(
            executor, self.survey, self.engine, self.positions_m, self.goals, notes_needed=True, progress=progress
        )


def made_look(settings: PlanSettings = SETTINGS) -> Look:
    survey = make_survey(scenes_synthetic.build("two-rooms").scene, settings)
    low, high = survey.scene.vertices_m.min(axis=0), survey.scene.vertices_m.max(axis=0)
    at_m = np.random.default_rng(5).uniform(low + 0.4, high - 0.4, (83, 3))
    goals = goals_of(survey, settings.requirements)
    return Look(survey, open_engine(survey.scene, survey.patches), goals, at_m, settings)


@pytest.fixture(scope="session")
def look() -> Look:
    """Limits of all, and others of what is low."""
    low = PartRequirement("low", 0.9, PointLimits(spacing_m=0.05), heights_m=(0.0, 1.0))
    limits = PointLimits(range_m=6.0, incidence_rad=1.2)
    return made_look(replace(SETTINGS, requirements=Requirements(coverage=0.9, limits=limits, parts=(low,))))


def assert_same_bits(found: CandidateObservations, expected: CandidateObservations) -> None:
    for name in ("seen", "met"):
        one, other = getattr(found.rows, name), getattr(expected.rows, name)
        np.testing.assert_array_equal(one.starts, other.starts)
        np.testing.assert_array_equal(one.patch, other.patch)
        assert (one.starts.dtype, one.patch.dtype) == (other.starts.dtype, other.patch.dtype)
        assert one.n_patches == other.n_patches
    assert (found.rows.met is found.rows.seen) == (expected.rows.met is expected.rows.seen)
    assert (found.parts is None) == (expected.parts is None)
    if found.parts is not None and expected.parts is not None:
        for name in ("seen", "met", "any_seen", "any_met"):
            one, other = getattr(found.parts, name), getattr(expected.parts, name)
            assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())
    assert [list(each) for each in found.needed] == [list(each) for each in expected.needed]
    for one, other in zip(found.needed, expected.needed, strict=True):
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)


# ------------------------------------------------------------------------------------------------ clusters
@contextmanager
def threads(n_workers: int) -> Iterator[str]:
    """A cluster inside this process: its workers are what tests make of `planner_core.cluster.worker`."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=n_workers, threads_per_worker=1, processes=False, protocol="inproc://", dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as cluster:  # fmt: skip
        yield cluster.scheduler_address


@contextmanager
def cluster_of(n_workers: int) -> Iterator[tuple[Cluster, list[str]]]:
    told: list[str] = []
    with threads(n_workers) as address, open_cluster(address, tell=told.append) as cluster:
        yield cluster, told


def stand_in(patch: pytest.MonkeyPatch, module: Any, name: str, function: Any) -> None:
    """Let workers of this process find another function under a name of ours: Dask sends names of it."""
    function.__module__, function.__name__, function.__qualname__ = module.__name__, name, name
    patch.setattr(module, name, function)


class Processes:
    """A scheduler and workers in processes of their own, for tests that kill them."""

    def __init__(self, folder: Path, port: int) -> None:
        self.folder, self.port = folder, port
        self.address = f"tcp://127.0.0.1:{port}"
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> None:
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")

    def start_worker(self, *before: str) -> subprocess.Popen[bytes]:
        words = ("worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "60")
        worker = self._start(*words, "--local-directory", str(self.folder), before=before)
        self.workers.append(worker)
        return worker

    def stop(self) -> None:
        for process in [*self.workers, *([self.scheduler] if self.scheduler else [])]:
            process.kill()
            process.wait()
        self.workers.clear()

    def _start(self, *words: str, before: tuple[str, ...] = ()) -> subprocess.Popen[bytes]:
        code = f"{';'.join(before)}\nfrom distributed.cli import dask_{words[0]} as of; of.main()"
        return subprocess.Popen(
            [sys.executable, "-P", "-c", code, *words[1:]],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ),
        )  # fmt: skip


class Killer:
    """Kills a worker at random, and starts another, as the share that is done passes each of some random moments."""

    def __init__(self, processes: Processes, seed: int, *, last: float) -> None:
        self._processes, self._chance = processes, np.random.default_rng(seed)
        self._moments = sorted(self._chance.uniform(0.05, last, 3))
        self.n_killed = 0

    def __call__(self, share: float) -> None:
        if self.n_killed < len(self._moments) and share >= self._moments[self.n_killed]:
            alive = [each for each in self._processes.workers if each.poll() is None]
            alive[int(self._chance.integers(len(alive)))].kill()
            self._processes.start_worker()
            self.n_killed += 1


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    import socket

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    started = Processes(tmp_path, port)
    started.start_scheduler()
    try:
        yield started
    finally:
        started.stop()
