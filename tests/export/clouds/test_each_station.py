"""Clouds by station, written by workers: the bytes, remarks and figures of one process, in every format."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import pytest
from click.testing import CliRunner
from tlsplan.group import cli

from planner_core.cluster import file_jobs
from planner_core.cluster.executor import Cluster
from planner_core.executor import Outcome, Place, spread_over
from planner_core.export.clouds.each_station import StationClouds, write_each
from planner_core.export.clouds.points import Clouds, open_clouds
from planner_core.export.formats import FORMATS
from planner_core.export.options import Options
from planner_core.export.write import export_plan
from planner_core.plan_folder.plan_source import FieldStation, PlanSource

from ...cluster.conftest import cluster_of, threads

BY_STATION = [each.name for each in FORMATS.values() if each.by_station]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*"))}


def exported(
    source: PlanSource, name: str, folder: Path, cluster: Cluster | None = None
) -> tuple[dict[str, bytes], tuple[str, ...]]:
    with spread_over(cluster):
        told = export_plan(name, source, folder, Options(noise=True, seed=3, max_points=4000))
    return contents(folder), told.remarks


MORE = [pytest.param(name, marks=pytest.mark.campaign) for name in ("laz-split", "ply-split")]


@pytest.mark.parametrize("name", ["e57-split", "exr", pytest.param("las-split", marks=pytest.mark.slow), *MORE])
def test_clouds_by_workers_are_the_files_of_one_process(
    name: str, source: PlanSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_jobs, "_WAIT_S", 0.05)
    with cluster_of(2) as (cluster, told):
        found = exported(source, name, tmp_path / "there", cluster)
    assert found == exported(source, name, tmp_path / "here")
    assert sum(path.startswith("S00") for path in found[0]) == (4 if name == "exr" else 2), "files of two stations"
    assert any("weak returns dropped" in remark for remark in found[1])
    assert told == []


def test_a_bug_at_workers_is_in_the_last_line_and_the_clouds_are_whole(
    plan_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def strikes(self: StationClouds, number: int, place: Place) -> Outcome:
        raise ZeroDivisionError("odd beams")

    monkeypatch.setattr(StationClouds, "do", strikes)
    monkeypatch.setattr(file_jobs, "_WAIT_S", 0.05)
    words = ["export", str(plan_folder), "-o", str(tmp_path / "out"), "--max-points", "700", "--format", "las-split"]
    with threads(2) as address:
        done = CliRunner().invoke(cli, [*words, "--scheduler", address, "-q"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    bug, alone, *_, last = done.stderr.splitlines()
    assert "internal error: ZeroDivisionError: odd beams (" in bug
    assert alone == "warning: no worker can do this: this machine goes on alone"
    assert "workers: 2 internal errors, reported above" in last
    there = contents(tmp_path / "out")
    CliRunner().invoke(cli, [*words, "--overwrite", "-q"], catch_exceptions=False)
    assert contents(tmp_path / "out") == there


def test_what_became_of_the_beams_is_told_by_station_and_added_up(source: PlanSource, tmp_path: Path) -> None:
    clouds = open_clouds(source, Options())

    def write(own: Clouds, station: FieldStation, path: Path) -> None:
        own.tally.n_points, own.tally.n_dropped, own.tally.n_beyond_table = station.order, 10, 100 * station.order

    assert [astuple(each) for each in write_each(clouds, [write], tmp_path)] == [(1, 10, 100), (2, 10, 200)]
    assert astuple(clouds.tally) == (3, 20, 300)


def test_every_format_with_a_file_a_station_is_known() -> None:
    assert BY_STATION == ["e57-split", "las-split", "laz-split", "ply-split", "exr"]


def test_a_scheduler_is_taken_for_clouds_with_a_file_a_station_alone(plan_folder: Path, tmp_path: Path) -> None:
    words = ["export", str(plan_folder), "-o", str(tmp_path / "out"), "--max-points", "700", "--format"]
    refused = CliRunner().invoke(cli, [*words, "las", "--scheduler", "tcp://nobody:1"])
    assert refused.exit_code == 2
    assert "got it with las, expected a cloud with a file per station (e57-split, las-split" in refused.output
    assert list(tmp_path.iterdir()) == []
    with threads(1) as address:
        done = CliRunner().invoke(cli, [*words, "las-split", "--scheduler", address, "-q"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    there = contents(tmp_path / "out")
    CliRunner().invoke(cli, [*words, "las-split", "--overwrite", "-q"], catch_exceptions=False)
    assert contents(tmp_path / "out") == there
