"""A planned box, as a folder with nothing but its plan.json beside its scene file; and plans written by hand."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_once import MadeOnce
from oldest_plan import floor, link, oldest_plan, station

import scenes_synthetic
from planner_core.model import Greedy, PlanSettings, Requirements, Scanner
from planner_core.plan_folder.plan_json import plan_text
from planner_core.planning.plan import make_plan
from planner_core.scene.load import LoadOptions, load_scene

SCANNER = Scanner(
    name="test", title="Test scanner", source="made up", range_min_m=0.3, range_max_m=20.0, n_azimuths=90,
    elevation_rad=tuple(np.deg2rad(np.linspace(45, -60, 30))), instrument_height_min_m=1.5, instrument_height_max_m=1.5,
)  # fmt: skip


@pytest.fixture(scope="session")
def planned_box(made_once: MadeOnce) -> Path:
    """The folder `plan` beside `box.ifc`, which says where on earth it is; for copying."""
    return made_once("planned-box", plan_box)


def plan_box(folder: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.on_map(scenes_synthetic.build("box")), folder / "box.ifc")
    settings = PlanSettings(
        scanner=SCANNER, requirements=Requirements(coverage=0.5), grid_step_m=1.5, refine=False, method=Greedy()
    )
    plan = make_plan(load_scene(path, options=LoadOptions(doors="shut")), settings, engine="open3d")
    (folder / "plan").mkdir()
    (folder / "plan" / "plan.json").write_text(plan_text(plan, folder / "plan"), encoding="utf-8")


@pytest.fixture
def box_folder(planned_box: Path, tmp_path: Path) -> Path:
    """A copy of `planned_box` to do as one likes with."""
    return Path(shutil.copytree(planned_box, tmp_path / "box"))


@pytest.fixture
def written_plan(tmp_path: Path) -> Callable[..., Path]:
    """Write a plan.json that holds what every format reads, with keys replaced; returns the folder."""

    def write(**instead: Any) -> Path:
        folder = tmp_path / "written"
        folder.mkdir(exist_ok=True)
        (folder / "plan.json").write_text(json.dumps({**by_hand(), **instead}), encoding="utf-8")
        return folder

    return write


def by_hand() -> dict[str, Any]:
    """Three stations on two floors; the second to be visited comes first."""
    plan = oldest_plan()
    extent = [[0.0, 0.0], [10.0, 8.0]]
    return {
        **plan,
        "scene": {**plan["scene"], "file": "some\\where/house.ifc", "offset": [0.0, 0.0, 0.0]},
        "floors": [
            floor("F0", 0.0, name="Ground floor", bounds=extent),
            floor("F1", 2.8, name="Upper floor", bounds=extent),
        ],
        "stations": [
            _station("S002", "F1", 2, [2.0, 3.0, 4.3], 1.5),
            _station("S001", "F0", 1, [5.0, 4.0, 1.6], 1.6),
            _station("S003", "F1", 3, [7.0, 3.0, 4.5], None),
        ],
        "registration": {
            "threshold": 0.3,
            "min_strength": 0.01,
            "connected": True,
            "links": [
                link("S001", "S002", 0.2, 0.2),
                link("S002", "S003", 0.5, 0.1),
                link("S001", "S003", 0.5, 0.001),
                link("S001", "S003", 0.5, None),
            ],
        },
    }


def _station(name: str, on: str, order: int, position: list[float], height_m: float | None) -> dict[str, Any]:
    areas = {"own_area_m2": 1.0, "covered_area_m2": 2.0}
    return station(name, on, order, position, instrument_height_m=height_m, fixed=name == "S003", **areas)
