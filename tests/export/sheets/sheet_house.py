"""A plan of six stations in the house of two_rooms.py, and its folder as sheets need it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from two_rooms import PARTS, write_obj

from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings, PointLimits, Requirements, Scanner
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scene.load import LoadOptions, load_scene

HEIGHT_M = 1.4
#: id -> x, y, ground z. No two are far from the walk, and two are nearly at one place.
STATIONS = {
    "S001": (1.0, 3.5, 0.0),
    "S002": (3.0, 1.0, 0.0),
    "S003": (7.0, 2.0, 0.0),
    "S004": (7.05, 2.03, 0.0),
    "S005": (2.0, 3.0, 2.8),
    "S006": (9.0, 1.0, 2.8),
}
SCANNER = Scanner(
    name="few", title="few beams", source="made up", range_min_m=0.3, range_max_m=20.0, n_azimuths=120,
    elevation_rad=tuple(np.deg2rad(np.linspace(20, -60, 33))), instrument_height_min_m=1.0,
    instrument_height_max_m=2.0,
)  # fmt: skip
ASKED = PointLimits(range_m=4.0, incidence_rad=float(np.radians(75.0)), spacing_m=0.5)
#: Of the house, so that a frame mixed up with another is noticed.
OFFSET_M = (40_300.0, 20_200.0, 50.0)


def write_plan(folder: Path) -> Path:
    """The plan folder; the only picture is an overview of one colour."""
    scene = load_scene(
        write_obj(folder / "house.obj", PARTS, OFFSET_M), options=LoadOptions(metres_per_unit=1.0, up_axis="Z")
    )
    settings = PlanSettings(
        scanner=SCANNER, requirements=Requirements(coverage=0.6, overlap=0.2, limits=ASKED), grid_step_m=1.0,
        instrument_heights_m=(HEIGHT_M,), max_patch_area_m2=0.1, special_places=False, scan_mode="beams",
    )  # fmt: skip
    up = np.array([0.0, 0.0, HEIGHT_M])
    given = [GivenStation(name, np.array(at) + up + OFFSET_M, HEIGHT_M, None) for name, at in STATIONS.items()]
    plan = evaluate_stations(scene, settings, given, engine="open3d")
    engine = open_engine(plan.survey.scene, plan.survey.patches, engine="open3d")
    write_plan_folder(plan, folder / "plan", engine=engine, pictures=False)
    Image.new("RGB", (16, 9), (200, 210, 220)).save(folder / "plan" / "report" / "overview.png")
    return folder / "plan"


def edited(plan: Path, folder: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    """A plan folder like another one, whose plan.json is edited; the rest is linked."""
    document = json.loads((plan / "plan.json").read_text(encoding="utf-8"))
    edit(document)
    folder.mkdir(parents=True)
    for name in ("viewer", "report"):
        (folder / name).symlink_to(plan / name)
    (folder / "plan.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def rename_station(document: Any, old: str, new: str) -> None:
    """Give a station of plan.json another id, wherever it is named as a value."""
    for key, value in list(document.items()) if isinstance(document, dict) else list(enumerate(document)):
        if value == old:
            document[key] = new
        elif isinstance(value, dict | list):
            rename_station(value, old, new)
