"""`tlsplan export` of clouds: what is told on the command line arrives in the files."""

import json
from pathlib import Path

import laspy
import numpy as np
import pytest
from click.testing import CliRunner
from cloud_room import expected_scan
from tlsplan.group import cli

from planner_core.export.formats import FORMATS, formats_named


def export(*words: str) -> dict[str, object]:
    done = CliRunner().invoke(cli, ["export", *words, "--json"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)  # type: ignore[no-any-return]


@pytest.mark.slow
def test_options_of_clouds_arrive_in_the_file(plan_folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "one.laz"
    plan = str(plan_folder)
    told = export(plan, "--format", "laz", "-o", str(path), "--stations", "S002", "--max-points", "700", "--noise",
                  "--seed", "3", "--crs", "EPSG:25832", "--origin", "500000,5700000,0")  # fmt: skip
    cloud = laspy.read(path)
    thinned = expected_scan("S002").range_m[::7, ::7].ravel()
    assert len(cloud) == thinned.size
    off_m = cloud["range"] - thinned
    assert 0.0002 < np.std(off_m) < 0.003
    assert cloud.header.parse_crs().to_epsg() == 25832
    warnings = " ".join(told["warnings"])  # type: ignore[arg-type]
    assert "clouds are thinned" in warnings
    assert "by its table of range noise" in warnings
    assert b"seed 3" in cloud.vlrs[-1].record_data


def test_clouds_are_no_part_of_a_pack_unless_named() -> None:
    clouds = {name for name, each in FORMATS.items() if "max_points" in each.options}
    assert {"e57", "las", "laz", "ply", "exr"} <= clouds
    assert not clouds & {each.name for each in formats_named(["all"])}
    assert "laz" in {each.name for each in formats_named(["all", "laz"])}


def test_a_station_that_is_not_there_is_told_in_one_line(plan_folder: Path, tmp_path: Path) -> None:
    words = ["export", str(plan_folder), "--format", "ply", "-o", str(tmp_path / "x.ply"), "--stations", "S002,S9"]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code != 0
    assert str(done.exception).startswith("station: got 'S9', expected one of S001, S002")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("names", ["", " , "])
def test_a_list_of_no_stations_is_not_taken_for_all(names: str, plan_folder: Path, tmp_path: Path) -> None:
    words = ["export", str(plan_folder), "--format", "ply", "-o", str(tmp_path / "x.ply"), "--stations", names]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 2
    assert "names no station, expected ids such as S001,S002" in done.output
    assert list(tmp_path.iterdir()) == []
