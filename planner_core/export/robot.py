"""A robot's mission without ROS: stations as waypoints with heading, ways between them, a map of every floor.

A folder: mission.json, the same as mission.yaml, maps/F0.png with maps/F0.yaml, and, where the CRS is known,
mission.geojson. Ways keep to free cells of the maps; stations stay where they are, and the file names what they stand
on. Positions are in the map frame: scene coordinates, less the scene's offset where it lies far from its origin,
because robots reckon in single precision. Metres, radians, headings counter-clockwise from +x; `map_to_site` leads to
the site's coordinates.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.export.chosen import (
    RouteLeg,
    chosen_floors,
    chosen_stations,
    has_ground,
    named,
    route_remarks,
    ways_of,
    ways_to,
)
from planner_core.export.geographic import geographic_of
from planner_core.export.geojson import feature
from planner_core.export.occupancy import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyMap,
    entered,
    map_sheets,
    occupancy_maps,
    write_map,
)
from planner_core.export.options import Options
from planner_core.export.robot_ways import MappedGround, RobotWay, WayPiece, robot_ways
from planner_core.model import FloatArray, PlanSettings, Survey
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.positions.local_site import LocalSite, local_site
from planner_core.progress import Progress, ProgressEvent
from planner_core.route.route import nodes_under

SCHEMA = "tlsplan/robot-mission/1"
GEOJSON = "mission.geojson"
STAGE = "robot"
#: A corner nearer than this to a stop is no direction.
_LEAST_STEP_M = 0.05
#: A robot on wheels climbs no more: then the ways are for legs.
_WHEELS_STEP_M = 0.05
_CELLS = {FREE: "free", OCCUPIED: "occupied", UNKNOWN: "unknown"}


@dataclass(frozen=True)
class _Stand:
    """A station on the maps. sheet : of its map, -1 for none. cell : what it stands on there, None for no map.

    clearance_m : to the nearest obstacle; None where there is no ground right below.
    """

    sheet: int
    cell: str | None
    clearance_m: float | None


@dataclass(frozen=True, eq=False)
class _Mission:
    """What the files are made of. offset_m : (3,) float64; map frame = scene frame - offset."""

    plan: PlanSource
    settings: PlanSettings
    survey: Survey
    offset_m: FloatArray
    visited: tuple[FieldStation, ...]
    left_out: tuple[FieldStation, ...]
    ways: tuple[RobotWay, ...]
    ground: MappedGround
    floors: frozenset[int]
    """Those whose maps are written."""
    stands: dict[str, _Stand]
    """Of visited stations."""

    @property
    def maps(self) -> tuple[OccupancyMap, ...]:
        """What is written."""
        return tuple(each for each in self.ground.maps if each.floor in self.floors)

    def map_name(self, sheet: int) -> str | None:
        """Name of a sheet's map; None where there is none, or it is not written."""
        each = self.ground.maps[sheet] if sheet >= 0 else None
        return each.name if each is not None and each.floor in self.floors else None

    def place(self, scene_m: FloatArray) -> list[float]:
        """Position in the map frame, to 0.1 mm."""
        return [float(value) for value in np.round(scene_m - self.offset_m, 4) + 0.0]


def write_robot(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write mission and maps into an empty folder; remarks tell of what the walk lacks and what it climbs.

    Raises
    ------
    ExportError
        The scene is not found.
    """
    mission, remarks = _mission(plan, options, progress)
    (path / "maps").mkdir()
    for each in mission.maps:
        write_map(each, path / "maps", _remark(mission, each))
    document = _document(mission)
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    (path / "mission.json").write_text(text + "\n", encoding="utf-8")
    (path / "mission.yaml").write_text(_yaml(document), encoding="utf-8")
    more = _write_geojson(mission, document, path / GEOJSON)
    progress(ProgressEvent(STAGE, 3, 3))
    return (*remarks, *more)


def _remark(mission: _Mission, occupancy: OccupancyMap) -> str:
    floor = mission.survey.floors[occupancy.floor]
    name = " ".join(floor.name.split())
    what = "what lies over its ground" if occupancy.over else "ground"
    return f"{floor.id} {name}, {what} at z = {floor.elevation_m:.4f} m of the map frame"


def _mission(plan: PlanSource, options: Options, progress: Progress) -> tuple[_Mission, tuple[str, ...]]:
    from planner_core.plan_folder.plan_settings import settings_of

    stations = chosen_stations(plan, options)
    progress(ProgressEvent(STAGE, 0, 3, "scene"))
    settings, survey = settings_of(plan.document), plan.survey(progress=progress)
    site = local_site(survey, settings.site)
    progress(ProgressEvent(STAGE, 1, 3, "free space"))
    ground = _ground(survey, site, progress)
    progress(ProgressEvent(STAGE, 2, 3, "ways"))
    chosen = {floor.id for floor in chosen_floors(plan, options)}
    floors = frozenset(index for index, floor in enumerate(survey.floors) if floor.id in chosen)
    all_ways, ids = ways_of(plan), {station.id for station in stations}
    ways, of_ways = robot_ways(ground, tuple(ways_to(all_ways, ids)), survey.scene.offset_m)
    visited, left_out = _visits(plan, stations, all_ways)
    index_of = {floor.id: index for index, floor in enumerate(survey.floors)}
    stands = {
        each.id: _stand(ground, each.ground_m - survey.scene.offset_m, index_of.get(each.floor_id, -1))
        for each in visited
    }
    mission = _Mission(
        plan, settings, survey, survey.scene.offset_m, visited, left_out, ways, ground, floors, stands
    )  # fmt: skip
    return mission, (*_remarks(mission, site.carrier.step_m), *of_ways, *route_remarks(all_ways))


def _ground(survey: Survey, site: LocalSite, progress: Progress) -> MappedGround:
    from planner_core.positions.free_space import free_space
    from planner_core.positions.reach import reachability

    space = free_space(survey, site.carrier, zones=site.zones, progress=progress)
    reach = reachability(survey, space, site.entrances_m)
    sheets = map_sheets(space, survey.floors, entered(reach))
    return MappedGround(reach, sheets, occupancy_maps(survey, space, sheets))


def _stand(ground: MappedGround, foot_m: FloatArray, floor: int) -> _Stand:
    """Look a station up: its ground point (3,), local frame, and its floor's index, -1 for none."""
    node = int(nodes_under(ground.space, foot_m[None])[0])
    shown = node >= 0 and ground.sheets.of_node[node] >= 0
    sheet = int(ground.sheets.of_node[node]) if shown else floor  # the sheets of floors come first
    cell = _CELLS[int(ground.maps[sheet].at(foot_m[None, :2])[0])] if sheet >= 0 else None
    return _Stand(sheet, cell, float(ground.space.clearance_m[node]) if shown else None)


def _visits(
    plan: PlanSource, stations: tuple[FieldStation, ...], ways: tuple[RouteLeg, ...]
) -> tuple[tuple[FieldStation, ...], tuple[FieldStation, ...]]:
    """Part stations into those of the walk and the others: scanned before, with no way to them, over unknown ground."""
    route = plan.document.get("route")
    stays = set() if route is None else {str(name) for name in route["left_out"]}
    scanned = plan.scanned_before
    on_way = {name for way in ways for name in (way.from_id, way.to_id)}
    goes = [each.id in on_way or not (each.id in scanned or each.id in stays) for each in stations]
    goes = [yes and has_ground(each) for each, yes in zip(stations, goes, strict=True)]
    visited = tuple(each for each, yes in zip(stations, goes, strict=True) if yes)
    return visited, tuple(each for each, yes in zip(stations, goes, strict=True) if not yes)


def _remarks(mission: _Mission, step_m: float) -> tuple[str, ...]:
    remarks = []
    taken = [name for name, stand in mission.stands.items() if stand.cell == "occupied"]
    if taken:
        remarks.append(
            f"{named(taken)} on an occupied cell of the map, where something stands or the ground ends: a robot can't "
            "stop there"
        )
    nowhere = [name for name, stand in mission.stands.items() if stand.clearance_m is None and name not in taken]
    if nowhere:
        remarks.append(f"{named(nowhere)} not above walkable ground: a robot can't get there")
    if step_m > _WHEELS_STEP_M:
        remarks.append(
            f"free ground and paths climb steps of up to {step_m:g} m, stairs too; for a robot on wheels plan with "
            "its own step (`robot` in the site of the requirements)"
        )
    if mission.left_out:
        remarks.append(f"{named([station.id for station in mission.left_out])} not on the route: no waypoints")
    return tuple(remarks)


# ------------------------------------------------------------------------------------------------- the document
def _document(mission: _Mission) -> dict[str, Any]:
    plan, carrier = mission.plan, mission.settings.site
    to_map = np.eye(4)
    to_map[:3, 3] = mission.offset_m
    return {
        "schema": SCHEMA,
        "plan": plan.title,
        "frame": {
            "name": "map",
            "scene_offset_m": [float(value) for value in mission.offset_m],
            "coordinates": "scene coordinates less scene_offset_m, metres, z up; headings in radians, "
            "counter-clockwise from +x",
        },
        "site": {
            "coordinates": plan.frame.crs_line,
            "crs": plan.frame.crs or None,
            "vertical_crs": plan.frame.vertical_crs or None,
            "map_to_site": [[float(value) for value in row] for row in plan.frame.matrix @ to_map],
        },
        "scanner": mission.settings.scanner.name,
        "speed_m_per_s": mission.settings.walking_m_per_s,
        "opens_doors": carrier.opens_doors,
        "maps": [_map_entry(mission, each) for each in mission.maps],
        "waypoints": [_waypoint(mission, station) for station in mission.visited],
        "paths": [_path(mission, way) for way in mission.ways],
        "not_visited": [{"id": station.id, "reason": _reason(plan, station)} for station in mission.left_out],
        "keep_out": [_zone(mission, row) for row in mission.plan.document["site"]["keep_out"]],
    }


def _map_entry(mission: _Mission, occupancy: OccupancyMap) -> dict[str, Any]:
    floor = mission.survey.floors[occupancy.floor]
    return {
        "map": occupancy.name,
        "floor": floor.id,
        "name": floor.name,
        "ground_z_m": round(floor.elevation_m, 4),
        "yaml": f"maps/{occupancy.name}.yaml",
    }


def _waypoint(mission: _Mission, station: FieldStation) -> dict[str, Any]:
    heading_rad, heading_of = _heading(station.id, mission.ways)
    crew, stand = mission.settings.crew, mission.stands[station.id]
    return {
        "id": station.id,
        "order": station.order,
        "floor": station.floor_id,
        "map": mission.map_name(stand.sheet),
        "cell": stand.cell,
        "position_m": mission.place(station.ground_m),
        "heading_rad": heading_rad,
        "heading_of": heading_of,
        "clearance_m": None if stand.clearance_m is None else round(stand.clearance_m, 2),
        "instrument_height_m": round(station.instrument_height_m, 4),
        "sensor_m": mission.place(station.position_m),
        "site_ground_m": [round(float(value), 4) + 0.0 for value in station.site_ground_m],
        "scan_s": crew.scan_s,
        "set_up_s": crew.set_up_s,
        "wait_s": None if crew.scan_s is None else crew.scan_s + crew.set_up_s,
    }


def _heading(station_id: str, ways: tuple[RobotWay, ...]) -> tuple[float | None, str | None]:
    """Return the direction in which the walk comes to a station; of the first stop, in which it leaves; else None."""
    first = ways[0].from_id if ways else ""
    comes = next((way for way in ways if way.to_id == station_id), None)
    if comes is not None and station_id != first:
        return _direction(comes.points_m[::-1], -1.0), "arrival"
    leaves = next((way for way in ways if way.from_id == station_id), None)
    if leaves is not None:
        return _direction(leaves.points_m, 1.0), "departure"
    return None, None


def _direction(points_m: FloatArray, sense: float) -> float | None:
    """Return the angle in plan from the first corner to the next one that is not on it; `sense` -1: towards it."""
    steps_m = sense * (points_m[1:, :2] - points_m[0, :2])
    far = np.flatnonzero(np.hypot(*steps_m.T) >= _LEAST_STEP_M)
    if not far.size:
        return None
    x, y = steps_m[far[0]].tolist()
    return round(math.atan2(y, x), 6) + 0.0


def _path(mission: _Mission, way: RobotWay) -> dict[str, Any]:
    return {
        "from": way.from_id or None,
        "to": way.to_id or None,
        "length_m": round(way.length_m, 3) if math.isfinite(way.length_m) else None,
        "as_planned": way.as_planned,
        "pieces": [
            {**_where(mission, piece), "points_m": (np.round(piece.points_m, 4) + 0.0).tolist()} for piece in way.pieces
        ],
    }


def _where(mission: _Mission, piece: WayPiece) -> dict[str, Any]:
    return {"floor": mission.survey.floors[piece.floor].id, "map": mission.map_name(piece.sheet)}


def _reason(plan: PlanSource, station: FieldStation) -> str:
    if not has_ground(station):
        return "its instrument height is not known"
    return "scanned before" if station.id in plan.scanned_before else "no way leads there"


def _zone(mission: _Mission, row: Mapping[str, Any]) -> dict[str, Any]:
    outline_m = np.array(row["outline"], dtype=np.float64).reshape(-1, 2) - mission.offset_m[:2]
    return {**row, "outline": (np.round(outline_m, 4) + 0.0).tolist()}


def _yaml(document: dict[str, Any]) -> str:
    import yaml

    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110))


def _write_geojson(mission: _Mission, document: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Write waypoints and paths in longitude and latitude; nothing where no CRS is known: readers know no others."""
    frame = mission.plan.frame
    if not frame.crs:
        return (
            f"{GEOJSON} is left out: GeoJSON is in longitude and latitude, and the plan in {frame.name} without a CRS; "
            "give --crs and --origin (or --control-points). mission.json holds the same in the map frame",
        )
    degrees = geographic_of(frame, "robot")
    head = {"type": "FeatureCollection", "name": "mission", "coordinates": "WGS84 longitude, latitude"}

    def positions(map_m: FloatArray) -> list[list[float]]:
        return degrees.degrees(frame.to_site(np.atleast_2d(map_m) + mission.offset_m)).tolist()  # type: ignore[no-any-return]

    features = [
        feature("Point", positions(np.array(row["position_m"]))[0], {"kind": "waypoint", **_flat(row)})
        for row in document["waypoints"]
    ]
    for way in mission.ways:
        for number, piece in enumerate(way.pieces, start=1):
            properties = {"kind": "path", "id": f"{way.title} {number}", "from": way.from_id, "to": way.to_id}
            features.append(feature("LineString", positions(piece.points_m), {**properties, **_where(mission, piece)}))
    text = json.dumps({**head, "features": features}, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")
    return degrees.remarks


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Return a waypoint without its lists, which GIS can't show."""
    return {key: value for key, value in row.items() if not isinstance(value, list)}
