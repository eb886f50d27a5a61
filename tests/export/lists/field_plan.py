"""A plan of four stations on two floors, one more on none, made in memory; its site turned by 30 degrees on UTM 32."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.model import Link, SiteFrame
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource

ANGLE_RAD = math.radians(30.0)
ORIGIN_M = (691234.5, 5334567.25, 515.0)
#: id -> floor, x, y, ground z, instrument height, scanned before; scene frame.
STATIONS: dict[str, tuple[str, float, float, float, float, bool]] = {
    "S001": ("F0", 9.0, 5.0, 0.0, 1.5, False),
    "S002": ("F0", 1.25, 2.5, 0.02, 1.3, True),
    "S003": ("F1", 4.0, 3.0, 2.8, 1.62345, False),
    "S004": ("F1", -2.5, 7.0, 2.8, 1.5, False),
}
LEGS: list[dict[str, Any]] = [
    {
        "from": "S001",
        "to": "S002",
        "length_m": 8.2,
        "floors": ["F0"],
        "points": [[9.0, 5.0, 0.0], [5.0, 4.0, 0.0], [1.25, 2.5, 0.02]],
    },
    {
        "from": "S002",
        "to": "S003",
        "length_m": 6.0,
        "floors": ["F0", "F1"],
        "points": [[1.25, 2.5, 0.02], [4.0, 3.0, 2.8]],
    },
    {"from": "S003", "to": "S004", "length_m": None, "floors": [], "points": []},
]


def floor(
    name: str, title: str, elevation_m: float, bounds: tuple[tuple[float, float], tuple[float, float]]
) -> FloorSection:
    return FloorSection(
        id=name, name=title, elevation_m=elevation_m, ground_area_m2=None, bounds=bounds, origin="slab", n_stations=0
    )


def site_frame(crs: str = "EPSG:25832", vertical_crs: str = "") -> SiteFrame:
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(ANGLE_RAD), -math.sin(ANGLE_RAD)], [math.sin(ANGLE_RAD), math.cos(ANGLE_RAD)]]
    matrix[:3, 3] = ORIGIN_M
    name = crs or "local site coordinates"
    return SiteFrame(matrix=matrix, crs=crs, vertical_crs=vertical_crs, name=name, source="given epsg")


def on_site(x: float, y: float, z: float) -> tuple[float, float, float]:
    """E, N, H worked out by hand, with none of the library's code."""
    cos, sin = math.cos(ANGLE_RAD), math.sin(ANGLE_RAD)
    return ORIGIN_M[0] + cos * x - sin * y, ORIGIN_M[1] + sin * x + cos * y, ORIGIN_M[2] + z


def station(
    name: str, floor: str, x: float, y: float, z: float, height: float, _: bool, number: int, frame: SiteFrame
) -> FieldStation:
    return FieldStation(
        id=name,
        number=number,
        floor_id=floor,
        floor_name={"F0": "Erdgeschoß", "F1": "Upper floor"}.get(floor, floor),
        order=number,
        position_m=np.array([x, y, z + (0.0 if math.isnan(height) else height)]),
        instrument_height_m=height,
        frame=frame,
        fixed=True,  # of scanned and of given ones: it tells nothing
        own_area_m2=3.5,
        covered_area_m2=44.25,
    )


def field_plan(
    frame: SiteFrame | None = None,
    stations: dict[str, tuple[str, float, float, float, float, bool]] | None = None,
    legs: list[dict[str, Any]] | None = None,
) -> PlanSource:
    frame = frame or SiteFrame()
    given = STATIONS if stations is None else stations
    scanned = [name for name, row in given.items() if row[-1]]
    route = {"legs": LEGS if legs is None else legs, "left_out": []}
    return PlanSource(
        folder=Path("nowhere"),
        document={
            "route": route,
            "site": {"settled": [{"id": name, "role": "scanned"} for name in scanned]},
            "registration": {"threshold": 0.3, "min_strength": 0.01},
        },
        frame=frame,
        stations=tuple(station(name, *row, number, frame) for number, (name, row) in enumerate(given.items(), start=1)),
        floors=(
            floor("F0", "Erdgeschoß", 0.0, ((0.0, 0.0), (10.0, 8.0))),
            floor("F1", "Upper floor", 2.8, ((-3.0, 0.0), (10.0, 8.0))),
        ),
        links=(Link("S001", "S002", 0.5649, 0.153), Link("S003", "S004", 0.2, math.nan)),
        title="house.ifc",
    )
