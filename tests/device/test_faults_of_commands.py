"""Faults of a driver as a user meets them: one line, the documented exit code, nothing half-written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pyopencl
import pytest

from planner_core.engine import opencl
from planner_core.model import Greedy, PlanSettings
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from scenes_synthetic import build
from scenes_synthetic.mesh_files import ply_bytes

pytestmark = pytest.mark.opencl

COARSE = ("--preset", "paper", "--grid", "1.5", "--height", "1.5", "--patch-area", "0.5", "--coverage", "80")
QUICK = (*COARSE, "--set", "work_limit=0.2")
Command = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "room.ply"
    path.write_bytes(ply_bytes(build("l-room")))
    return path


def last_line(err: str) -> str:
    return err.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("kernel", "status", "cause", "remedy"),
    [
        ("list_patches", "DEVICE_NOT_AVAILABLE", "was lost", "--engine open3d"),
        pytest.param("scan_tiles", "INVALID_COMMAND_QUEUE", "was lost", "--engine open3d", marks=pytest.mark.slow),
        pytest.param("list_patches", "OUT_OF_RESOURCES", "ran out of memory", "smaller scene", marks=pytest.mark.slow),
    ],
    ids=["lost among candidates", "lost while scans are written", "never enough memory"],
)
def test_a_device_that_fails_during_a_plan_ends_it_with_the_remedy_and_no_folder(
    command: Command, scene_file: Path, tmp_path: Path, faults: SimpleNamespace, kernel: str, status: str, cause: str,
    remedy: str,
) -> None:  # fmt: skip
    with faults.abort(kernel, status) as seen:
        code, out, err = command("plan", scene_file, "-o", tmp_path / "plan", "--json", *QUICK)
    assert seen.aborted >= 1
    assert (code, out) == (6, "")
    assert last_line(err).startswith("tlsplan: ")
    assert cause in last_line(err)
    assert remedy in last_line(err)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_memory_that_suffices_for_fewer_candidates_at_a_time_gives_the_same_plan_and_one_warning(
    scene_file: Path, faults: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opencl, "_CHUNK", 6)
    scene = load_scene(scene_file)
    settings = PlanSettings(
        load_scanner("hdl-64e"), grid_step_m=0.7, instrument_heights_m=(1.5,), max_patch_area_m2=0.5, method=Greedy()
    )
    expected = make_plan(scene, settings)
    with faults.abort("list_patches", "OUT_OF_RESOURCES", more_than=3) as seen:
        plan = make_plan(scene, settings)
    assert seen.aborted >= 2
    told = [line for line in plan.warnings if "ran out of memory" in line]
    assert len(told) == 1
    assert "same results" in told[0]
    assert "\n" not in told[0]
    assert plan_document(plan)["warnings"][: len(plan.warnings)] == list(plan.warnings)
    documents = [plan_document(each) for each in (plan, expected)]
    for document in documents:
        for key in (*DROPPABLE_KEYS, "warnings"):
            del document[key]
    assert documents[0] == documents[1]


@pytest.mark.slow
def test_without_a_device_open3d_scans_and_a_warning_is_in_the_document_too(
    command: Command, scene_file: Path, tmp_path: Path, faults: SimpleNamespace
) -> None:
    stations = tmp_path / "stations.csv"
    stations.write_text("id,x_m,y_m,z_m\nA,1.5,1.5,1.5\n", encoding="utf-8")
    with faults.refuse(pyopencl, "get_platforms", "PLATFORM_NOT_FOUND_KHR"):
        code, out, err = command("evaluate", scene_file, "--stations", stations, "--json", *COARSE)
    assert code == 0
    assert "Open3D instead" in err
    document = json.loads(out)
    assert any("Open3D instead" in line for line in document["warnings"])
    assert "open3d" in document["device"].casefold()


@pytest.mark.parametrize("asked", [("--engine", "opencl"), ("--device", "0")])
def test_a_device_that_was_asked_for_and_is_not_there_is_an_error(
    command: Command, scene_file: Path, tmp_path: Path, faults: SimpleNamespace, asked: tuple[str, str]
) -> None:
    with faults.refuse(pyopencl, "get_platforms", "PLATFORM_NOT_FOUND_KHR"):
        code, _, err = command("plan", scene_file, "-o", tmp_path / "plan", "-q", *asked, *QUICK)
    assert code == 6
    assert "no OpenCL device" in last_line(err)
    assert list(tmp_path.iterdir()) == []


def test_measuring_devices_where_there_is_none_is_refused_with_a_remedy(
    command: Command, faults: SimpleNamespace
) -> None:
    with faults.refuse(pyopencl, "get_platforms", "PLATFORM_NOT_FOUND_KHR"):
        code, _, err = command("tune", "--quick")
    assert code == 6
    (line,) = err.splitlines()
    assert "no OpenCL device" in line
    assert "`pip install" in line
