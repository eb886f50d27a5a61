"""The plan of a box as a folder with nothing but its plan.json beside its scene file; and plans written by hand."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from oldest_plan import floor, link, oldest_plan, station
from shared_plans import SharedPlan

_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import two_rooms  # noqa: F401 - folders below know it by its name from here on
finally:
    sys.path.remove(_FOLDER)


@pytest.fixture
def box_folder(box_plan: SharedPlan, tmp_path: Path) -> Path:
    """The folder `plan` beside `box.ifc`, which has a position on earth; the test may change it."""
    folder = tmp_path / "box"
    (folder / "plan").mkdir(parents=True)
    shutil.copy(box_plan.scene_file, folder)
    shutil.copy(box_plan.folder / "plan.json", folder / "plan")
    return folder


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
