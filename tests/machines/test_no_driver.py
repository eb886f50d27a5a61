"""Whole commands on a machine without OpenCL: they end well, say so once, and choose what they choose elsewhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import scenes_synthetic
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
NO_DRIVER, NO_PYOPENCL = HERE / "no_driver", HERE / "no_pyopencl"
#: Begins the one line that says so, whatever is wrong with OpenCL.
FALLBACK = "no OpenCL device is usable"
TINY = ("--scanner", HERE / "tiny.json", "--grid", "1.0", "--height", "1.5", "--patch-area", "0.3", "--preset", "paper")
QUICK = ("--set", "work_limit=0.3")


def tlsplan(
    *arguments: str | Path, machine: Path | None = NO_DRIVER, timeout_s: float = 900
) -> subprocess.CompletedProcess[str]:
    """Run the command as on that machine; None: on this one."""
    path = os.pathsep.join(str(part) for part in (machine, os.environ.get("PYTHONPATH")) if part)
    return subprocess.run(
        [sys.executable, "-m", "tlsplan", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        env={**os.environ, "PYTHONPATH": path},
    )


def said_once(done: subprocess.CompletedProcess[str]) -> str:
    """The line that says that there is no device; its remedy is in it."""
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if FALLBACK in line]
    assert "instead (slower)" in line
    assert "`" in line, "a remedy is something to type"
    return line.removeprefix("warning: ")


def document_of(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    return document


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corridor with an arm: nobody sees all of it from one place."""
    return scenes_synthetic.write(scenes_synthetic.build("t-corridor"), tmp_path_factory.mktemp("scene") / "t.ifc")


@pytest.fixture(scope="module")
def plan(house: Path) -> Path:
    """A plan made there."""
    folder = house.with_name("plan")
    line = said_once(tlsplan("plan", house, "-o", folder, *TINY, *QUICK))
    assert line in document_of(folder)["warnings"]
    return folder


def test_the_proven_plan_is_that_of_open3d_elsewhere(house: Path, plan: Path, tmp_path: Path) -> None:
    """From what Open3D sees, a machine without OpenCL and one with a device plan the same, to the last digit."""
    elsewhere = tmp_path / "plan"
    done = tlsplan("plan", house, "-o", elsewhere, *TINY, *QUICK, "--engine", "open3d", machine=None)
    assert done.returncode == 0, done.stderr
    documents = [document_of(folder) for folder in (plan, elsewhere)]
    for document in documents:
        for key in DROPPABLE_KEYS:
            document.pop(key)
        document["warnings"] = [line for line in document["warnings"] if FALLBACK not in line]
    assert documents[0] == documents[1]


@pytest.mark.parametrize(
    "method",
    [
        ("--method", "greedy"),
        ("--method", "paper", "--search", "ts", "--set", "spatial.max_iterations=3"),
        pytest.param(("--method", "paper", "--search", "none"), marks=pytest.mark.campaign),
        *(
            pytest.param(
                ("--method", "paper", "--search", search, "--set", "spatial.max_iterations=3"),
                marks=pytest.mark.campaign,
            )
            for search in ("ls", "sa")
        ),
    ],
    ids=lambda words: "-".join(words[1::2][:2]),
)
def test_every_method_plans(house: Path, plan: Path, tmp_path: Path, method: tuple[str, ...]) -> None:
    folder = tmp_path / "plan"
    line = said_once(tlsplan("plan", house, "-o", folder, *TINY, *method))
    document = document_of(folder)
    assert line in document["warnings"]
    assert 0 < len(document["stations"]) <= 3 * len(document_of(plan)["stations"])


def test_scanners_of_many_beams_are_planned_patch_by_patch(house: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    survey = ("--scanner", "rtc360:40mm", *TINY[2:], "--scan-mode", "patches", *QUICK)
    assert said_once(tlsplan("plan", house, "-o", folder, *survey)) in document_of(folder)["warnings"]


def test_a_machine_where_pyopencl_does_not_load_plans_alike(house: Path, plan: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    line = said_once(tlsplan("plan", house, "-o", folder, *TINY, *QUICK, machine=NO_PYOPENCL))
    document = document_of(folder)
    assert "pyopencl can't be loaded" in line
    assert line in document["warnings"]
    assert document["stations"] == document_of(plan)["stations"]


def test_plans_are_evaluated_compared_exported_and_scanned(house: Path, plan: Path, tmp_path: Path) -> None:
    stations = plan / "plan.json"
    said = said_once(tlsplan("evaluate", house, "--stations", stations, "-o", tmp_path / "again", *TINY))
    assert said in document_of(tmp_path / "again")["warnings"]
    assert len(document_of(tmp_path / "again")["stations"]) == len(document_of(plan)["stations"])
    said_once(tlsplan("compare", plan, "--stations", plan / "stations.csv"))
    said_once(tlsplan("simulate", house, "--stations", stations, "--scanner", TINY[1], "-o", tmp_path / "scans"))
    said_once(tlsplan("export", plan, "--format", "e57,las", "-o", tmp_path / "clouds"))
    lists = tlsplan("export", plan, "--format", "all", "-o", tmp_path / "pack")  # nothing of it is scanned
    assert lists.returncode == 0, lists.stderr
    assert FALLBACK not in lists.stderr


def test_live_editing_answers(plan: Path) -> None:
    ask = """
import sys
from pathlib import Path
from planner_core.planning.live.opening import open_live
live = open_live(Path(sys.argv[1]))
first = live.draft.stations[0]
shown = live.preview(live.draft, first.id, first.floor, first.at_m + (0.05, 0.0, 0.0), first.instrument_height_m)
print(live.engine.name, *live.engine.warnings)
"""
    done = subprocess.run(
        [sys.executable, "-c", ask, str(plan)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(NO_DRIVER)},
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"open3d {FALLBACK}")
