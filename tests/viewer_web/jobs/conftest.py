"""A hall with columns and a coarse plan of it, to plan again from; made once, and copied by tests that change it."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import small_pictures

import scenes_synthetic
from planner_core.model import Greedy, PartRequirement, PlanSettings, Requirements
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from viewer_web.server.jobs import runs

PART = PartRequirement(name="upper half", coverage=0.5, heights_m=(1.0, 4.0))


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep all of them on one worker: they share the plan."""
    for item in items:
        if item.path.parent == Path(__file__).parent:
            item.add_marker(pytest.mark.xdist_group("runs"))


@pytest.fixture(autouse=True)
def drawn_small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave pictures out of plans, here and in the processes of runs: nobody looks at them."""
    small_pictures.draw_blank(monkeypatch)
    popen = SimpleNamespace(Popen=small_pictures.begin_without, DEVNULL=subprocess.DEVNULL)
    monkeypatch.setattr(runs, "subprocess", popen)


@pytest.fixture(scope="session")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder `plan`, and the scene `hall.ply` beside it."""
    root = tmp_path_factory.mktemp("hall")
    scene = scenes_synthetic.write(scenes_synthetic.build("column-hall"), root / "hall.ply")
    settings = PlanSettings(
        scanner=replace(load_scanner("hdl-64e"), n_azimuths=900),
        requirements=Requirements(coverage=0.9, network="none", parts=(PART,)),
        grid_step_m=1.0,
        instrument_heights_m=(1.3,),
        max_patch_area_m2=0.25,
        special_places=False,
        method=Greedy(),
    )
    write_plan_folder(make_plan(load_scene(scene), settings), root / "plan", pictures=False)
    return root


@pytest.fixture
def own_hall(hall: Path, tmp_path: Path) -> Path:
    """A copy that a test may change: its plan folder."""
    shutil.copytree(hall, tmp_path / "copy")
    return tmp_path / "copy" / "plan"


@pytest.fixture
def until() -> Callable[[Callable[[], bool]], None]:
    """Wait until something holds; its test times out where it never does."""

    def wait(holds: Callable[[], bool]) -> None:
        while not holds():
            time.sleep(0.1)

    return wait
