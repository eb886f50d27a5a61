"""`tlsplan evaluate` as it is typed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import scenes_synthetic


@pytest.mark.slow
def test_plans_are_verified_unless_by_the_papers_preset_or_told_not_to(
    tmp_path: Path, tlsplan: Callable[..., Any]
) -> None:
    building, stations = tmp_path / "box.ifc", tmp_path / "mine.csv"
    scenes_synthetic.write(scenes_synthetic.build("box"), building)
    stations.write_text("id,x_m,y_m,z_m\nA,2,2,1.5\nB,3,2,1.5\n")
    asked = ("evaluate", building, "--stations", stations, "--scanner", "hdl-64e", "--deliverable", "none", "--grid", 2)
    usual = json.loads(tlsplan(*asked, "--json").stdout)
    assert usual["judge"]["n_points"] == 20_000
    assert usual["settings"]["scan_mode"] == "patches"
    short = tlsplan(*asked).stdout
    assert re.search(r"^judge +[\d.]+ % \+- [\d.]+ by 20000 random points$", short, re.MULTILINE)
    for option in ("--verify", "--judge"):  # the latter of earlier versions
        assert json.loads(tlsplan(*asked, option, 0, "--json").stdout)["judge"] is None
    assert "--judge" not in tlsplan("evaluate", "--help").stdout
    paper = json.loads(tlsplan(*asked[:4], "--preset", "paper", "--grid", 2, "--json").stdout)
    assert (paper["judge"], paper["settings"]["scan_mode"]) == (None, "beams")


@pytest.mark.slow
def test_the_check_is_printed_beside_the_plan(tmp_path: Path, tlsplan: Callable[..., Any]) -> None:
    building, stations = tmp_path / "box.ifc", tmp_path / "mine.csv"
    scenes_synthetic.write(scenes_synthetic.build("box"), building)
    stations.write_text("id,x_m,y_m,z_m\nA,2,2,1.5\nB,3,2,1.5\n")
    asked = ("evaluate", building, "--stations", stations, "--preset", "paper", "--grid", 2, "--verify", 2000)
    run = tlsplan(*asked)
    assert run.returncode == 0, run.stderr
    assert "judge         2000 random points, cast by Open3D" in run.stdout
    assert re.search(r"covered +[\d.]+ m2 \+- [\d.]+, the plan has [\d.]+, \+\d", run.stdout)
    assert "overlap of A and B, which differs most:" in run.stdout
    document = json.loads(tlsplan(*asked, "--json").stdout)
    told = document["judge"]["share"]
    assert told["told"] == pytest.approx(document["coverage"]["fraction_of_achievable"])
    assert 0.5 < told["judged"] <= told["told"]
