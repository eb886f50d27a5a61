"""Simulated scans and links by workers: the bytes of one process, whoever is slow, dies, or has no room."""

from __future__ import annotations

import errno
import os
import pickle
import time
from collections.abc import Callable
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import until

from planner_core.cluster import file_jobs
from planner_core.cluster.executor import Cluster, open_cluster
from planner_core.errors import ExportError
from planner_core.executor import Outcome, Place, spread_over
from planner_core.export.clouds import e57, each_station, las
from planner_core.export.clouds.each_station import one_file, write_each
from planner_core.export.clouds.noise import noise_model
from planner_core.export.clouds.points import BeamTally, Clouds
from planner_core.export.clouds.simulated import FORMATS, simulated_clouds, write_simulated_scans
from planner_core.model import LinkLimits, OverlapMeasure, PreAlignment, Station
from planner_core.network import candidate_links as links
from planner_core.network.candidate_links import CandidateLinks, LinkJob, candidate_links
from planner_core.network.links import surface_of_patches
from planner_core.progress import Progress, ProgressEvent, silent

from .conftest import SETTINGS, Killer, Look, Processes, cluster_of

N_STATIONS = 6


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_jobs, "_WAIT_S", 0.05)
    monkeypatch.setattr(links, "_WORTH_SPREADING", 1)


def clouds_of(look: Look, progress: Progress = silent) -> Clouds:
    stations = [
        Station(f"S{order:03d}", "F0", order, at_m, instrument_height_m=1.5)
        for order, at_m in enumerate(look.positions_m[:N_STATIONS], start=1)
    ]
    return simulated_clouds(look.survey, SETTINGS, stations, look.engine, progress=progress)


def written(look: Look, folder: Path, cluster: Cluster | None = None, progress: Progress = silent) -> dict[str, Any]:
    """What is told of the scans, and their files."""
    with spread_over(cluster):
        told = write_simulated_scans(clouds_of(look, progress), FORMATS, folder)
    return {"told": told, **{path.name: path.read_bytes() for path in sorted(folder.iterdir())}}


def linked(look: Look, n: int, progress: Progress = silent, rows_a_block: int = 16) -> CandidateLinks:
    """Links of n positions that see alike: enough of them for some blocks."""
    seen = look.here().rows.seen
    seen = look.here(np.tile(look.positions_m, (-(-n // seen.n_positions), 1))[:n]).rows.seen
    is_seen = np.zeros(seen.n_patches, dtype=bool)
    is_seen[seen.patch] = True
    surface = surface_of_patches(look.survey.scene, look.survey.patches, is_seen)
    return candidate_links(
        seen, look.survey.patches.area_m2, surface, np.zeros((n, 3)), limits=LinkLimits(0.2, 0.01, 0.5),
        rows_a_block=rows_a_block, progress=progress,
    )  # fmt: skip


def assert_same_links(found: CandidateLinks, expected: CandidateLinks) -> None:
    assert expected.n_links > 100
    for name in ("starts", "neighbour", "overlap", "strength", "part"):
        one, other = getattr(found, name), getattr(expected, name)
        assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes()), name


@pytest.mark.parametrize("n_workers", [2, *(pytest.param(n, marks=pytest.mark.campaign) for n in (1, 4))])
def test_links_by_workers_are_those_of_one_process(look: Look, n_workers: int) -> None:
    with cluster_of(n_workers) as (cluster, told), spread_over(cluster):
        found = linked(look, 83)
    assert_same_links(found, linked(look, 83))
    assert told == []


def test_a_job_of_links_travels_without_what_was_worked_out_from_it(look: Look) -> None:
    seen = look.here(look.positions_m[:12]).rows.seen
    surface = surface_of_patches(look.survey.scene, look.survey.patches, np.ones(seen.n_patches, dtype=bool))
    scanned = np.arange(12) < 3
    figures = (look.positions_m[:12], LinkLimits(0.2, 0.01, 0.9), PreAlignment.TRACKED, OverlapMeasure.JACCARD, scanned)
    job = LinkJob(seen, look.survey.patches.area_m2, surface, *figures)
    before = pickle.dumps(job)
    answer = job.answer((0, 12))
    assert pickle.dumps(job) == before
    assert pickle.loads(before).answer((0, 12)) == answer


@pytest.mark.slow
@pytest.mark.parametrize("n_workers", [2, *(pytest.param(n, marks=pytest.mark.campaign) for n in (1, 4))])
def test_scans_by_workers_are_the_files_of_one_process(look: Look, tmp_path: Path, n_workers: int) -> None:
    with cluster_of(n_workers) as (cluster, told):
        found = written(look, tmp_path / "there", cluster)
    assert found == written(look, tmp_path / "here")
    assert len(found) == 1 + N_STATIONS * len(FORMATS)
    assert told == []


@pytest.mark.slow
def test_a_worker_whose_disk_fills_up_is_told_and_another_writes(
    look: Look, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound, n_failed = each_station.write_station, 0

    def write(clouds: Clouds, passes: Any, number: int, folder: Path) -> BeamTally:
        nonlocal n_failed
        if n_failed == 0:
            n_failed += 1
            (folder / "half.ply").write_bytes(b"half")
            raise OSError(errno.ENOSPC, "kein Platz", str(folder))
        return sound(clouds, passes, number, folder)

    monkeypatch.setattr(each_station, "write_station", write)
    with cluster_of(2) as (cluster, told):
        found = written(look, tmp_path / "there", cluster)
    assert found == written(look, tmp_path / "here")
    (line,) = told
    assert "is not used: " in line
    assert "kein Platz" in line


def test_a_full_disk_here_leaves_nothing(look: Look, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Path.open

    def opened(self: Path, *of: Any, **more: Any) -> Any:
        if self.name == "S003.ply" and any(part.startswith(".2-") for part in self.parts):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))
        return sound(self, *of, **more)

    monkeypatch.setattr(Path, "open", opened)
    with cluster_of(2) as (cluster, _), pytest.raises(ExportError, match=os.strerror(errno.ENOSPC)):
        written(look, tmp_path / "there", cluster)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_slow_worker_does_not_hold_the_scans(look: Look, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound, held = each_station.StationClouds.do, list[Place]()

    def do(self: Any, number: int, place: Place) -> Outcome:
        if not held:
            held.append(place)
            while place.is_wanted():
                time.sleep(0.05)
        return sound(self, number, place)

    monkeypatch.setattr(each_station.StationClouds, "do", do)
    monkeypatch.setattr(file_jobs, "_LONG_S", 0.5)
    with cluster_of(2) as (cluster, _):
        found = written(look, tmp_path / "there", cluster)
    assert found == written(look, tmp_path / "here")
    assert len(held) == 1


# ------------------------------------------------------------------------------------------------ processes
Work = Callable[[Cluster | None, Progress], Any]


def disturbed(processes: Processes, work: Work, disturb: Callable[[float], None]) -> Any:
    def hear(event: ProgressEvent) -> None:
        disturb(event.done / event.total)

    with open_cluster(processes.address, tell=print) as cluster:
        until(lambda: len(cluster.workers()) == len(processes.workers))
        return work(cluster, hear)


def works(look: Look, folder: Path) -> dict[str, Work]:
    def by_links(cluster: Cluster | None, progress: Progress) -> dict[str, bytes]:
        with spread_over(cluster):
            found = linked(look, 249, progress, rows_a_block=4)
        return {name: getattr(found, name).tobytes() for name in ("starts", "neighbour", "overlap", "strength")}

    def by_scans(cluster: Cluster | None, progress: Progress) -> dict[str, Any]:
        return written(look, folder / ("here" if cluster is None else "there"), cluster, progress)

    def by_clouds(cluster: Cluster | None, progress: Progress) -> dict[str, Any]:
        into = folder / ("here" if cluster is None else "there")
        into.mkdir(parents=True)
        clouds = replace(clouds_of(look, progress), noise=noise_model(SETTINGS.scanner), seed=3)
        with spread_over(cluster):
            told = write_each(clouds, [one_file(".e57", e57._write), one_file(".laz", las._write_compressed)], into)
        beams = [astuple(each) for each in (*told, clouds.tally)]
        return {"beams": beams, **{path.name: path.read_bytes() for path in sorted(into.iterdir())}}

    return {"links": by_links, "scans": by_scans, "clouds": by_clouds}


@pytest.mark.slow
@pytest.mark.parametrize(
    "what", ["scans", *(pytest.param(each, marks=pytest.mark.campaign) for each in ("links", "clouds"))]
)
@pytest.mark.parametrize("seed", [1])
def test_workers_killed_at_random_moments_change_no_byte(
    look: Look, processes: Processes, tmp_path: Path, what: str, seed: int
) -> None:
    for _ in range(2):
        processes.start_worker()
    killer = Killer(processes, seed, last=0.8)
    work = works(replace(look), tmp_path / "scans")[what]
    found = disturbed(processes, work, killer)
    assert killer.n_killed >= 2
    assert found == work(None, silent)


@pytest.mark.campaign
@pytest.mark.parametrize("what", ["links", "scans", "clouds"])
def test_a_scheduler_that_is_started_anew_changes_no_byte(
    look: Look, processes: Processes, tmp_path: Path, what: str
) -> None:
    processes.start_worker()
    restarted = False

    def disturb(share: float) -> None:
        nonlocal restarted
        if not restarted and share > 0.15:
            processes.stop()
            processes.start_scheduler()
            processes.start_worker()
            restarted = True

    work = works(look, tmp_path / "scans")[what]
    found = disturbed(processes, work, disturb)
    assert restarted
    assert found == work(None, silent)
