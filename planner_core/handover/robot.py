"""A robot's mission without ROS: stations as waypoints with heading, ways between them, a map of every floor.

A folder: mission.json, the same as mission.yaml, mission.geojson, and maps/F0.png with maps/F0.yaml. Positions are in
the map frame: scene coordinates, less the scene's offset where it lies far from its origin, because robots reckon in
single precision. Metres, radians, headings counter-clockwise from +x; `map_to_site` leads to the site's coordinates.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.ground.free_space import FreeSpace
from planner_core.handover.chosen import chosen_floors, chosen_stations, has_ground, named, scanned_before
from planner_core.handover.geographic import geographic_of
from planner_core.handover.geojson import feature, local_positions
from planner_core.handover.occupancy import FREE, OccupancyMap, occupancy_maps, write_map
from planner_core.handover.options import Options
from planner_core.handover.source import FieldStation, PlanSource
from planner_core.handover.walk import Way, walk_remarks, ways_of
from planner_core.model import FloatArray, PlanSettings, Survey
from planner_core.progress import Progress, ProgressEvent

SCHEMA = "tlsplan/robot-mission/1"
STAGE = "robot"
#: A corner nearer than this to a stop is no direction.
_LEAST_STEP_M = 0.05
#: A robot on wheels climbs no more: then the ways are for legs.
_WHEELS_STEP_M = 0.05


@dataclass(frozen=True, eq=False)
class _Mission:
    """What the files are made of. offset_m : (3,) float64; map frame = scene frame - offset."""

    plan: PlanSource
    settings: PlanSettings
    survey: Survey
    offset_m: FloatArray
    visited: tuple[FieldStation, ...]
    left_out: tuple[FieldStation, ...]
    ways: tuple[Way, ...]
    pieces: tuple[tuple[tuple[str, FloatArray], ...], ...]
    """Of each way: floor ids and corners (M, 3), map frame."""
    maps: tuple[OccupancyMap, ...]
    clearance_m: dict[str, float]
    """Of visited stations that stand on free ground."""

    def place(self, scene_m: FloatArray) -> list[float]:
        """Position in the map frame, to 0.1 mm."""
        return [float(value) for value in np.round(scene_m - self.offset_m, 4) + 0.0]


def write_robot(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write mission and maps into an empty folder; remarks tell of what the walk lacks and what it climbs.

    Raises
    ------
    HandoverError
        The scene is not found.
    """
    mission, remarks = _mission(plan, options, progress)
    (path / "maps").mkdir()
    for each in mission.maps:
        floor = mission.survey.floors[each.floor]
        said = f"{floor.id} {' '.join(floor.name.split())}, ground at z = {floor.elevation_m:.4f} m of the map frame"
        write_map(each, path / "maps", floor.id, said)
    document = _document(mission)
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    (path / "mission.json").write_text(text + "\n", encoding="utf-8")
    (path / "mission.yaml").write_text(_yaml(document), encoding="utf-8")
    more = _write_geojson(mission, document, path / "mission.geojson")
    progress(ProgressEvent(STAGE, 3, 3))
    return (*remarks, *more)


def _mission(plan: PlanSource, options: Options, progress: Progress) -> tuple[_Mission, tuple[str, ...]]:
    from planner_core.export.plan_settings import settings_of
    from planner_core.ground.free_space import free_space
    from planner_core.ground.local_site import local_site
    from planner_core.ground.reach import reachability
    from planner_core.route.floors_passed import floor_under, pieces_by_floor

    stations = chosen_stations(plan, options)
    progress(ProgressEvent(STAGE, 0, 3, "scene"))
    settings, survey = settings_of(plan.document), plan.survey(progress=progress)
    site = local_site(survey, settings.site)
    progress(ProgressEvent(STAGE, 1, 3, "free space"))
    space = free_space(survey, site.mover, zones=site.zones, progress=progress)
    chosen = {floor.id for floor in chosen_floors(plan, options)}
    floors = tuple(index for index, floor in enumerate(survey.floors) if floor.id in chosen)
    progress(ProgressEvent(STAGE, 2, 3, "maps"))
    all_ways, ids = ways_of(plan), {station.id for station in stations}
    ways = tuple(way for way in all_ways if way.walkable and {way.from_id, way.to_id} & ids)
    offset_m = survey.scene.offset_m
    pieces = []
    for way in ways:
        corners_m, floor = pieces_by_floor(space, way.points_m - offset_m)
        pieces.append(_runs(corners_m, [survey.floors[index].id for index in floor.tolist()]))
    visited, left_out = _visits(plan, stations, all_ways)
    maps = occupancy_maps(survey, reachability(survey, space, site.entrances_m), floors)
    feet_m = np.array([station.ground_m for station in visited]).reshape(-1, 3) - offset_m
    stands = dict(zip((each.id for each in visited), floor_under(space, feet_m) >= 0, strict=True))
    room = {
        each.id: _clearance_m(space, foot_m) for each, foot_m in zip(visited, feet_m, strict=True) if stands[each.id]
    }
    mission = _Mission(plan, settings, survey, offset_m, visited, left_out, ways, tuple(pieces), maps, room)
    return mission, (*_remarks(mission, site.mover.step_m), *walk_remarks(all_ways))


def _clearance_m(space: FreeSpace, foot_m: FloatArray) -> float:
    """Return the distance to the nearest obstacle from ground (3,), as far as the free space looked for one."""
    node = space.node_below(foot_m + np.array([0.0, 0.0, space.mover.step_m]))
    return float(space.clearance_m[node]) if node >= 0 else 0.0


def _runs(corners_m: FloatArray, floors: list[str]) -> tuple[tuple[str, FloatArray], ...]:
    """Join pieces between corners (M, 3), floors (M - 1), to runs on one floor each."""
    runs = []
    start = 0
    for end in range(1, len(floors) + 1):
        if end == len(floors) or floors[end] != floors[start]:
            runs.append((floors[start], corners_m[start : end + 1]))
            start = end
    return tuple(runs)


def _visits(
    plan: PlanSource, stations: tuple[FieldStation, ...], ways: tuple[Way, ...]
) -> tuple[tuple[FieldStation, ...], tuple[FieldStation, ...]]:
    """Part stations into those of the walk and the others: scanned before, with no way to them, over unknown ground."""
    route = plan.document.get("route")
    stays = set() if route is None else {str(name) for name in route["left_out"]}
    scanned = scanned_before(plan)
    on_way = {name for way in ways for name in (way.from_id, way.to_id)}
    goes = [each.id in on_way or not (each.id in scanned or each.id in stays) for each in stations]
    goes = [yes and has_ground(each) for each, yes in zip(stations, goes, strict=True)]
    visited = tuple(each for each, yes in zip(stations, goes, strict=True) if yes)
    return visited, tuple(each for each, yes in zip(stations, goes, strict=True) if not yes)


def _remarks(mission: _Mission, step_m: float) -> tuple[str, ...]:
    remarks = []
    room = mission.clearance_m
    off = [each.id for each in mission.visited if each.id not in room or _cell(mission, each) not in (None, FREE)]
    if off:
        remarks.append(f"{named(off)} not on free ground of the map: a robot can't stand there")
    if step_m > _WHEELS_STEP_M:
        remarks.append(
            f"free ground and ways climb steps of up to {step_m:g} m, stairs too; for a robot on wheels plan with "
            "its own step (`robot` in the site of the requirements)"
        )
    if mission.left_out:
        remarks.append(f"{named([station.id for station in mission.left_out])} not in the walk: no waypoints")
    return tuple(remarks)


def _cell(mission: _Mission, station: FieldStation) -> int | None:
    """Return the cell that a station stands on; None where its floor has no map."""
    for each in mission.maps:
        if mission.survey.floors[each.floor].id == station.floor_id:
            return int(each.at((station.ground_m - mission.offset_m)[None, :2])[0])
    return None


# ------------------------------------------------------------------------------------------------- the document
def _document(mission: _Mission) -> dict[str, Any]:
    plan, mover = mission.plan, mission.settings.site
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
        "opens_doors": mover.opens_doors,
        "maps": [_map_entry(mission, each) for each in mission.maps],
        "waypoints": [_waypoint(mission, station) for station in mission.visited],
        "paths": [_path(way, pieces) for way, pieces in zip(mission.ways, mission.pieces, strict=True)],
        "not_visited": [{"id": station.id, "reason": _reason(plan, station)} for station in mission.left_out],
        "keep_out": [_zone(mission, row) for row in mission.plan.document["site"]["keep_out"]],
    }


def _map_entry(mission: _Mission, occupancy: OccupancyMap) -> dict[str, Any]:
    floor = mission.survey.floors[occupancy.floor]
    return {
        "floor": floor.id,
        "name": floor.name,
        "ground_z_m": round(floor.elevation_m, 4),
        "yaml": f"maps/{floor.id}.yaml",
    }


def _waypoint(mission: _Mission, station: FieldStation) -> dict[str, Any]:
    heading_rad, heading_of = _heading(station.id, mission.ways)
    settings = mission.settings
    scan_s = settings.seconds_per_scan if settings.seconds_per_scan is not None else settings.scanner.seconds_per_scan
    return {
        "id": station.id,
        "order": station.number,
        "floor": station.floor_id,
        "position_m": mission.place(station.ground_m),
        "heading_rad": heading_rad,
        "heading_of": heading_of,
        "clearance_m": round(mission.clearance_m[station.id], 2) if station.id in mission.clearance_m else None,
        "instrument_height_m": round(station.instrument_height_m, 4),
        "sensor_m": mission.place(station.position_m),
        "site_ground_m": [round(float(value), 4) + 0.0 for value in station.site_ground_m],
        "scan_s": scan_s,
        "set_up_s": settings.set_up_s,
        "wait_s": None if scan_s is None else scan_s + settings.set_up_s,
    }


def _heading(station_id: str, ways: tuple[Way, ...]) -> tuple[float | None, str | None]:
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


def _path(way: Way, pieces: tuple[tuple[str, FloatArray], ...]) -> dict[str, Any]:
    return {
        "from": way.from_id or None,
        "to": way.to_id or None,
        "length_m": round(way.length_m, 3) if math.isfinite(way.length_m) else None,
        "pieces": [
            {"floor": floor, "points_m": (np.round(corners_m, 4) + 0.0).tolist()} for floor, corners_m in pieces
        ],
    }


def _reason(plan: PlanSource, station: FieldStation) -> str:
    if not has_ground(station):
        return "its instrument height is not known"
    return "scanned before" if station.id in scanned_before(plan) else "no way leads there"


def _zone(mission: _Mission, row: Mapping[str, Any]) -> dict[str, Any]:
    outline_m = np.array(row["outline"], dtype=np.float64).reshape(-1, 2) - mission.offset_m[:2]
    return {**row, "outline": (np.round(outline_m, 4) + 0.0).tolist()}


def _yaml(document: dict[str, Any]) -> str:
    import yaml

    return str(yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110))


def _write_geojson(mission: _Mission, document: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Write waypoints and paths in longitude and latitude, or in the map frame where no CRS is known; say which."""
    frame = mission.plan.frame
    head: dict[str, Any] = {"type": "FeatureCollection", "name": "mission"}
    remarks: tuple[str, ...] = ()
    if frame.crs:
        degrees = geographic_of(frame, "robot")
        head["coordinates"], remarks = "WGS84 longitude, latitude", degrees.remarks
    else:
        head |= {"crs": None, "coordinates": f"map frame: {document['frame']['coordinates']}"}

    def positions(map_m: FloatArray) -> list[list[float]]:
        if not frame.crs:
            return local_positions(map_m)
        return degrees.degrees(frame.to_site(np.atleast_2d(map_m) + mission.offset_m)).tolist()  # type: ignore[no-any-return]

    features = [
        feature("Point", positions(np.array(row["position_m"]))[0], {"kind": "waypoint", **_flat(row)})
        for row in document["waypoints"]
    ]
    for way, pieces in zip(mission.ways, mission.pieces, strict=True):
        for number, (floor, corners_m) in enumerate(pieces, start=1):
            told = {"kind": "path", "id": f"{way.title} {number}", "from": way.from_id, "to": way.to_id, "floor": floor}
            features.append(feature("LineString", positions(corners_m), told))
    text = json.dumps({**head, "features": features}, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")
    return remarks


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Return a waypoint without its lists, which GIS can't show."""
    return {key: value for key, value in row.items() if not isinstance(value, list)}
