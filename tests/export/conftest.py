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

import scenes_synthetic
from planner_core.model import Greedy, PlanSettings, Requirements, Scanner
from planner_core.plan_folder.plan_json import SCHEMA, plan_text
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
    return {
        "schema": SCHEMA,
        "scene": {"file": "some\\where/house.ifc", "sha256": "0" * 64},
        "floors": [
            {"id": "F0", "name": "Ground floor", "elevation_m": 0.0, "bounds": [[0.0, 0.0], [10.0, 8.0]]},
            {"id": "F1", "name": "Upper floor", "elevation_m": 2.8, "bounds": [[0.0, 0.0], [10.0, 8.0]]},
        ],
        "stations": [
            _station("S002", "F1", 2, [2.0, 3.0, 4.3], 1.5),
            _station("S001", "F0", 1, [5.0, 4.0, 1.6], 1.6),
            _station("S003", "F1", 3, [7.0, 3.0, 4.5], None),
        ],
        "registration": {
            "threshold": 0.3,
            "min_strength": 0.01,
            "links": [
                {"a": "S001", "b": "S002", "overlap": 0.2, "strength": 0.2},
                {"a": "S002", "b": "S003", "overlap": 0.5, "strength": 0.1},
                {"a": "S001", "b": "S003", "overlap": 0.5, "strength": 0.001},
                {"a": "S001", "b": "S003", "overlap": 0.5, "strength": None},
            ],
        },
    }


def _station(name: str, floor: str, order: int, position: list[float], height_m: float | None) -> dict[str, Any]:
    return {
        "id": name, "floor": floor, "order": order, "position": position, "instrument_height_m": height_m,
        "fixed": name == "S003", "own_area_m2": 1.0, "covered_area_m2": 2.0,
    }  # fmt: skip
