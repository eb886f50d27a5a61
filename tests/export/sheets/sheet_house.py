"""Two rooms below, one above, up a flight of stairs; a plan of six stations, and its folder as sheets need it.

y 5 +------------+-------+---------------+
    |            |       | flight, well  |     Walls are 0.2 m thick and lie outside of these lines,
  4 |            |       +---------------+     the one between the rooms from x 4.0 to 4.2.
  3 |   Küche    |                       |
    |            ' gap, y 2 to 3         |
  2 | table      '                       |
  1 | (1,1)-(2,2)|                       |
    +------------+-----------------------+
    0            4                      10  x
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.engine.scan_engine import open_engine
from planner_core.model import PlanSettings, PointLimits, Requirements, Scanner
from planner_core.plan_folder.face_results import face_results
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.plan_folder.usd_stage import write_stage
from planner_core.plan_folder.viewer_files import patches_bytes
from planner_core.plan_folder.viewer_layers import layer_files
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scene.load import LoadOptions, load_scene

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
N_STEPS, STEP_M, TREAD_M, FOOT_X_M = 14, 0.2, 2.7 / 14, 8.2
#: An element that tries to be markup.
EVIL = "wall <b>&amp; Küche Ψ"
PARTS: dict[str, list[Box]] = {
    "slab ground": [((-0.2, -0.2, -0.2), (10.2, 5.2, 0.0))],
    "wall west": [((-0.2, -0.2, 0.0), (0.0, 5.2, 5.6))],
    "wall east": [((10.0, -0.2, 0.0), (10.2, 5.2, 5.6))],
    "wall south": [((0.0, -0.2, 0.0), (10.0, 0.0, 5.6))],
    EVIL: [((0.0, 5.0, 0.0), (10.0, 5.2, 5.6))],
    "wall between south": [((4.0, 0.0, 0.0), (4.2, 2.0, 2.6))],
    "wall between north": [((4.0, 3.0, 0.0), (4.2, 5.0, 2.6))],
    "wall lintel": [((4.0, 2.0, 2.1), (4.2, 3.0, 2.6))],
    "slab upper south": [((0.0, 0.0, 2.6), (10.0, 4.0, 2.8))],
    "slab upper west": [((0.0, 4.0, 2.6), (5.5, 5.0, 2.8))],
    "slab upper east": [((8.2, 4.0, 2.6), (10.0, 5.0, 2.8))],
    "slab roof": [((-0.2, -0.2, 5.6), (10.2, 5.2, 5.8))],
    "table": [((1.0, 1.0, 0.0), (2.0, 2.0, 0.75))],
    "stair": [
        ((FOOT_X_M - (k + 1) * TREAD_M, 4.0, 0.0), (FOOT_X_M - k * TREAD_M, 5.0, (k + 1) * STEP_M))
        for k in range(N_STEPS)
    ],
}
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
OFFSET_M = (40_300.0, 20_200.0, 50.0)
"""Of the scene from the lines above, so that a frame mixed up with another is told."""


def write_obj(path: Path) -> Path:
    """Boxes as triangles, a group a part."""
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    lines, n = [], 0
    for name, boxes in PARTS.items():
        lines.append(f"o {name}")
        for low, high in boxes:
            for z in (0, 1):
                for y in (0, 1):
                    for x in (0, 1):
                        corner = [(high if up else low)[i] + OFFSET_M[i] for i, up in enumerate((x, y, z))]
                        lines.append(f"v {' '.join(f'{value:.6f}' for value in corner)}")
            lines += [
                f"f {a + n + 1} {b + n + 1} {c + n + 1}\nf {a + n + 1} {c + n + 1} {d + n + 1}" for a, b, c, d in faces
            ]
            n += 8
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_plan(folder: Path) -> Path:
    """What the sheets read of a plan folder: plan.json, the viewer's stage, patches and layers, the overview."""
    scene = load_scene(write_obj(folder / "house.obj"), options=LoadOptions(metres_per_unit=1.0, up_axis="Z"))
    settings = PlanSettings(
        scanner=SCANNER, requirements=Requirements(coverage=0.6, overlap=0.2, asked=ASKED), grid_step_m=1.0,
        instrument_heights_m=(HEIGHT_M,), max_patch_area_m2=0.1, special_places=False, scan_mode="beams",
    )  # fmt: skip
    up = np.array([0.0, 0.0, HEIGHT_M])
    given = [GivenStation(name, np.array(at) + up + OFFSET_M, HEIGHT_M, None) for name, at in STATIONS.items()]
    plan = evaluate_stations(scene, settings, given, engine="open3d")
    engine = open_engine(plan.survey.scene, plan.survey.patches, engine="open3d")
    target = folder / "plan"
    results = face_results(plan, np.full(plan.survey.patches.n_patches, np.inf))
    write_stage(plan, results, target)
    files = dict(layer_files(plan, engine))
    files["viewer/patches.u8"] = patches_bytes(plan.times_seen, plan.achievable)
    files["plan.json"] = plan_text(plan, target).encode()
    for name, content in files.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_bytes(content)
    _write_picture(target / "report" / "overview.png")
    return target


def _write_picture(path: Path) -> None:
    from PIL import Image

    path.parent.mkdir()
    Image.new("RGB", (16, 9), (200, 210, 220)).save(path)


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
