"""A plan of the house of two_rooms.py with a block in it, and what robots are to do there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from two_rooms import PARTS, Box, Point, write_obj

from planner_core.model import KeepOut, PlanSettings, Requirements, Scanner, Site
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scene.load import LoadOptions, load_scene

#: As large as a body, and hollow as all boxes are.
BLOCK: Box = ((2.6, 3.7, 0.0), (3.8, 4.9, 2.2))
HOUSE = {"block": [BLOCK], **PARTS}
[TABLE], STAIRS = PARTS["table"], PARTS["stair"]
ROOMS = [box for name, boxes in HOUSE.items() if name not in ("table", "stair") for box in boxes]
#: id -> x, y, ground z; sensors are 1.4 m above it. S5 is on the roof, where no way leads.
STATIONS = {
    "S1": (0.6, 3.5, 0.0),
    "S2": (3.0, 1.0, 0.0),
    "S3": (7.0, 2.0, 0.0),
    "S4": (2.0, 4.0, 2.8),
    "S5": (5.0, 2.0, 5.8),
}
HEIGHT_M = 1.4
KEEP_OUT = ((8.0, 0.2), (9.5, 0.2), (9.5, 1.2), (8.0, 1.2))
SCANNER = Scanner(
    name="few", title="few beams", source="made up", range_min_m=0.3, range_max_m=20.0, n_azimuths=90,
    elevation_rad=tuple(np.deg2rad(np.linspace(60, -60, 25))), instrument_height_min_m=1.0,
    instrument_height_max_m=2.0,
)  # fmt: skip


def write_plan(folder: Path, at_m: Point = (0.0, 0.0, 0.0)) -> Path:
    """The house, moved by `at_m`, and a plan folder beside it."""
    file = write_obj(folder / "house.obj", HOUSE, at_m)
    scene = load_scene(file, options=LoadOptions(metres_per_unit=1.0, up_axis="Z"))
    outline = tuple((x + at_m[0], y + at_m[1]) for x, y in KEEP_OUT)
    settings = PlanSettings(
        scanner=SCANNER, requirements=Requirements(coverage=0.1), grid_step_m=2.0, instrument_heights_m=(HEIGHT_M,),
        max_patch_area_m2=1.0, special_places=False, seconds_per_scan=90.0, set_up_s=45.0,
        site=Site(keep_out=(KeepOut(outline_m=outline, floor="F0", name="machine"),)),
    )  # fmt: skip
    given = [
        GivenStation(name, np.array([x, y, z + HEIGHT_M]) + at_m, HEIGHT_M, None)
        for name, (x, y, z) in STATIONS.items()
    ]
    plan = evaluate_stations(scene, settings, given, engine="open3d")
    (folder / "plan").mkdir()
    (folder / "plan" / "plan.json").write_text(plan_text(plan, folder / "plan"), encoding="utf-8")
    return folder / "plan"
