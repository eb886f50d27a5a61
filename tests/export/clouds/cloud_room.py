"""One box of a room, whose every beam has an answer on paper; a plan of it, and its clouds as they should be."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner_core.coordinates.request import FrameRequest
from planner_core.model import PlanSettings, Requirements, Scanner
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scanner.template import directions, make_template
from planner_core.scene.load import LoadOptions, load_scene

Floats = NDArray[np.float64]

#: Corners of the room, scene frame.
LOW_M, HIGH_M = np.array([100.0, 200.0, 30.0]), np.array([106.0, 204.0, 32.8])
STATIONS_M = {"S001": (101.5, 201.25, 31.6), "S002": (104.75, 202.5, 31.35)}
HEIGHTS_M = {"S001": 1.6, "S002": 1.35}
REFLECTIVITY = 0.6
#: Turned by 30 degrees, 250 ppm smaller.
ORIGIN_M, ROTATION_RAD, SCALE = (500_000.0, 5_700_000.0, 120.0), np.radians(30.0), 0.99975
FRAME = FrameRequest(
    crs="EPSG:25832", vertical_crs="EPSG:7837", origin_m=ORIGIN_M, rotation_rad=ROTATION_RAD, scale=SCALE
)

SCANNER = Scanner(
    name="test", title="Test scanner", source="made up", range_min_m=0.5, range_max_m=20.0, n_azimuths=400,
    elevation_rad=tuple(np.deg2rad(np.linspace(90, -60, 76))), instrument_height_min_m=1.0,
    instrument_height_max_m=2.0, angular_accuracy_rad=1e-4,
    range_noise=((1.0, 0.1, 0.0008), (10.0, 0.1, 0.002), (1.0, 0.8, 0.0004), (20.0, 0.8, 0.001)),
)  # fmt: skip
SHAPE = (76, 400)


def write_room(path: Path) -> Path:
    """The room as twelve triangles."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    lines = [f"v {' '.join(str(v) for v in np.where(corner, HIGH_M, LOW_M))}" for corner in corners]
    lines += [f"f {a + 1} {b + 1} {c + 1}\nf {a + 1} {c + 1} {d + 1}" for a, b, c, d in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_plan(folder: Path, scanner: Scanner = SCANNER) -> Path:
    """The room, and a plan folder beside it with the two stations."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = load_scene(write_room(folder / "room.obj"), options=LoadOptions(metres_per_unit=1.0, up_axis="Z"))
    settings = PlanSettings(
        scanner=replace(scanner, n_azimuths=120, elevation_rad=scanner.elevation_rad[::4]),
        requirements=Requirements(coverage=0.1, reflectivity=REFLECTIVITY),
        grid_step_m=2.0, instrument_heights_m=(1.6,), max_patch_area_m2=0.5, special_places=False,
    )  # fmt: skip
    given = [GivenStation(name, np.array(at), HEIGHTS_M[name], None) for name, at in STATIONS_M.items()]
    plan = evaluate_stations(scene, settings, given, engine="open3d")
    # Planned with few beams, which is quick; scanned with all.
    plan = replace(plan, settings=replace(plan.settings, scanner=scanner))
    (folder / "plan").mkdir()
    (folder / "plan" / "plan.json").write_text(plan_text(plan, folder / "plan"), encoding="utf-8")
    return folder / "plan"


@dataclass(frozen=True)
class Expected:
    """On paper: (R, C) ranges, NaN where none; cosines of incidence; (R, C, 3) points, scene frame."""

    range_m: Floats
    cosine: Floats
    scene_m: Floats
    elevation_rad: Floats


def expected_scan(station_id: str, scanner: Scanner = SCANNER) -> Expected:
    """What a beam from inside of a box meets: the nearest of the three walls that it runs towards."""
    at = np.array(STATIONS_M[station_id])
    beams = directions(make_template(scanner))
    with np.errstate(divide="ignore"):
        ways = np.where(beams > 0, HIGH_M - at, LOW_M - at) / beams
    ways[ways <= 0] = np.inf
    axis = np.argmin(ways, axis=-1)
    range_m = np.take_along_axis(ways, axis[..., None], axis=-1)[..., 0]
    cosine = np.abs(np.take_along_axis(beams, axis[..., None], axis=-1)[..., 0])
    missed = (range_m < scanner.range_min_m) | (range_m > scanner.range_max_m)
    range_m[missed] = np.nan
    elevation = np.broadcast_to(np.array(scanner.elevation_rad)[:, None], range_m.shape)
    return Expected(range_m, np.where(missed, np.nan, cosine), at + beams * range_m[..., None], elevation)


def to_site(scene_m: Floats) -> Floats:
    """By hand, what `FRAME` says."""
    east = SCALE * (np.cos(ROTATION_RAD) * scene_m[..., 0] - np.sin(ROTATION_RAD) * scene_m[..., 1])
    north = SCALE * (np.sin(ROTATION_RAD) * scene_m[..., 0] + np.cos(ROTATION_RAD) * scene_m[..., 1])
    return np.stack([east, north, scene_m[..., 2]], axis=-1) + ORIGIN_M


def edited_plan(plan_folder: Path, folder: Path, **scanner: object) -> Path:
    """A copy of a plan, beside the same room, whose scanner has other figures."""
    document = json.loads((plan_folder / "plan.json").read_text())
    document["scanner"].update(scanner)
    (folder / "plan").mkdir(parents=True)
    (folder / "plan" / "plan.json").write_text(json.dumps(document))
    (folder / "room.obj").write_bytes((plan_folder.parent / "room.obj").read_bytes())
    return folder / "plan"
