"""A house of boxes: two rooms below, joined by a door gap, one above, up a flight of stairs; and a plan of it.

y 5 +--------------+--------+-------------------+
    |              |        | flight  <- up     |      The flight climbs from x 8.2 to x 5.5, y 4 to 5;
  4 |              |        +----well-----------+      the well above it is as large.
  3 |              |                            |
    |              ' gap, y 2 to 3              |
  2 | table        '                            |
  1 | (1,1)-(2,2)  |                            |
    +--------------+----------------------------+
    0              4                           10  x
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner_core.model import KeepOut, PlanSettings, Requirements, Scanner, Site
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scene.load import LoadOptions, load_scene

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
N_STEPS, STEP_M, TREAD_M, FOOT_X_M = 14, 0.2, 2.7 / 14, 8.2
TABLE: Box = ((1.0, 1.0, 0.0), (2.0, 2.0, 0.75))
#: As large as a body, and hollow as all boxes are.
BLOCK: Box = ((2.6, 3.7, 0.0), (3.8, 4.9, 2.2))
ROOMS: list[Box] = [
    BLOCK,
    ((-0.2, -0.2, -0.2), (10.2, 5.2, 0.0)),
    ((-0.2, -0.2, 0.0), (0.0, 5.2, 5.6)),
    ((10.0, -0.2, 0.0), (10.2, 5.2, 5.6)),
    ((0.0, -0.2, 0.0), (10.0, 0.0, 5.6)),
    ((0.0, 5.0, 0.0), (10.0, 5.2, 5.6)),
    ((4.0, 0.0, 0.0), (4.2, 2.0, 2.6)),
    ((4.0, 3.0, 0.0), (4.2, 5.0, 2.6)),
    ((4.0, 2.0, 2.1), (4.2, 3.0, 2.6)),
    ((0.0, 0.0, 2.6), (10.0, 4.0, 2.8)),
    ((0.0, 4.0, 2.6), (5.5, 5.0, 2.8)),
    ((8.2, 4.0, 2.6), (10.0, 5.0, 2.8)),
    ((-0.2, -0.2, 5.6), (10.2, 5.2, 5.8)),
]
STAIRS: list[Box] = [
    ((FOOT_X_M - (k + 1) * TREAD_M, 4.0, 0.0), (FOOT_X_M - k * TREAD_M, 5.0, (k + 1) * STEP_M)) for k in range(N_STEPS)
]
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


def write_house(path: Path, at_m: tuple[float, float, float]) -> Path:
    lines, first = [], 1
    for low, high in [*ROOMS, *STAIRS, TABLE]:
        lines.append(f"o box{first // 8}")
        for z in (low[2], high[2]):
            for x, y in ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])):
                lines.append(f"v {x + at_m[0]:.6f} {y + at_m[1]:.6f} {z + at_m[2]:.6f}")
        for a, b, c, d in ((3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)):
            lines.append("f " + " ".join(str(first + corner) for corner in (a, b, c, d)))
        first += 8
    path.write_text("\n".join(lines) + "\n")
    return path


def write_plan(folder: Path, at_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Path:
    """The house, moved by `at_m`, and a plan folder beside it."""
    scene = load_scene(write_house(folder / "house.obj", at_m), options=LoadOptions(metres_per_unit=1.0, up_axis="Z"))
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
