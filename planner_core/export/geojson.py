"""Stations, links, walk and floors as GeoJSON (RFC 7946), for GIS and web maps.

Longitude and latitude, WGS84, two coordinates: the third would be a height above the ellipsoid, which a plan does not
know. Heights are in the properties, with the system they are in. On demand in site coordinates, E, N, H: then a member
`crs` names the system, as GeoJSON had it before RFC 7946; few programs but GDAL look at it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.coverage.percent import reached_share
from planner_core.errors import RequirementError
from planner_core.export.chosen import (
    RouteLeg,
    chosen_floors,
    chosen_stations,
    description_of,
    route_remarks,
    ways_of,
    ways_to,
)
from planner_core.export.floor_outlines import FloorOutline, outlines_of
from planner_core.export.geographic import geographic_of
from planner_core.export.options import Options
from planner_core.model import FloatArray, SiteFrame
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

#: From (N, 3) site coordinates to a list of GeoJSON positions.
Positions = Callable[[FloatArray], list[list[float]]]


def write_geojson(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write one feature collection; `kind` of a feature is station, link, walk or floor.

    Raises
    ------
    ExportError
        Longitude and latitude are wanted, and the CRS is not known.
    """
    if options.geojson_crs not in ("wgs84", "local"):
        raise RequirementError(f"--geojson-crs: got {options.geojson_crs!r}, expected wgs84 or local")
    document: dict[str, Any] = {"type": "FeatureCollection", "name": Path(plan.title).stem or "plan"}
    if options.geojson_crs == "wgs84":
        way = geographic_of(plan.frame, "geojson")
        positions, remarks = (lambda site_m: way.degrees(site_m).tolist()), way.remarks
    else:
        document["crs"] = _named_crs(plan.frame)
        positions, remarks = (lambda site_m: local_positions(plan.frame.in_unit(site_m))), (_local_remark(plan.frame),)
    document["coordinates"] = plan.frame.crs_line if options.geojson_crs == "local" else "WGS84 longitude, latitude"
    document["heights"] = f"metres; {plan.frame.in_metres().crs_line}"
    outlines, of_floors = outlines_of(plan, chosen_floors(plan, options))
    features = list(_features(plan, options, positions, outlines))
    text = ",\n".join(json.dumps(feature, ensure_ascii=False, allow_nan=False) for feature in features)
    head = json.dumps(document, ensure_ascii=False)[:-1]
    path.write_text(f'{head}, "features": [\n{text}\n]}}\n', encoding="utf-8")
    return (*remarks, *of_floors, *route_remarks(ways_of(plan)))


def local_positions(site: FloatArray) -> list[list[float]]:
    """Return positions as they are, metres or feet, to 4 decimals; a height that is not known is left out."""
    rounded = np.round(np.asarray(site, dtype=np.float64).reshape(-1, 3), 4) + 0.0
    return [row if math.isfinite(row[2]) else row[:2] for row in rounded.tolist()]


def _local_remark(frame: SiteFrame) -> str:
    if _named_crs(frame) is None:
        return f"geojson in {frame.crs_line}, which GeoJSON can't name: programs take it for longitude and latitude"
    return f"geojson in {frame.crs_line}: programs that follow RFC 7946 take it for longitude and latitude"


def _named_crs(frame: SiteFrame) -> dict[str, Any] | None:
    """Return the member `crs`; null, which means that there is none, where no code names it, or one of another unit."""
    authority, _, code = frame.crs.partition(":")
    if not (authority.isalnum() and code.isalnum() and frame.unit is frame.crs_unit):
        return None
    return {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{authority}::{code}"}}


def _features(
    plan: PlanSource, options: Options, positions: Positions, outlines: Mapping[str, FloorOutline]
) -> Iterator[dict[str, Any]]:
    stations = chosen_stations(plan, options)
    at = {station.id: station for station in stations}
    for floor in chosen_floors(plan, options):
        yield _floor_feature(plan, floor, positions, outlines[floor.id])
    for way in ways_to(ways_of(plan), at):
        yield _route_feature(plan, way, positions)
    for link in plan.links:
        if link.a in at and link.b in at:
            ends = np.stack([at[link.a].site_m, at[link.b].site_m])
            properties = {
                "kind": "link",
                "id": f"{link.a}-{link.b}",
                "from": link.a,
                "to": link.b,
                "overlap": reached_share(link.overlap, plan.min_overlap, 4),
                "strength": _known(link.strength),
                "probability": _known(link.probability),
                "counts": plan.counts(link),
            }
            yield feature("LineString", positions(ends), properties)
    for station in stations:
        yield feature("Point", positions(_ground_in_plan(station))[0], _station_properties(plan, station))


def _floor_feature(
    plan: PlanSource, floor: FloorSection, positions: Positions, outline: FloorOutline
) -> dict[str, Any]:
    """Return a floor's ground: outer rings counter-clockwise, openings clockwise, closed, as RFC 7946 wants them."""
    polygons = [
        [
            positions(plan.frame.to_site(np.column_stack([ring, np.full(len(ring), floor.elevation_m)])))
            for ring in (np.concatenate([open_ring, open_ring[:1]]) for open_ring in rings)
        ]
        for rings in outline.polygons
    ]
    height_m = float(plan.frame.to_site(np.array([*floor.bounds[0], floor.elevation_m]))[2])
    properties = {
        "kind": "floor",
        "id": floor.id,
        "name": floor.name,
        "ground_height_m": round(height_m, 4),
        "outline": outline.made_of,
        "area_m2": round(outline.area_m2, 4),
    }
    if len(polygons) == 1:
        return feature("Polygon", polygons[0], properties)
    return feature("MultiPolygon", polygons, properties)


def _route_feature(plan: PlanSource, way: RouteLeg, positions: Positions) -> dict[str, Any]:
    properties = {
        "kind": "route",
        "id": way.title,
        "from": way.from_id or None,
        "to": way.to_id or None,
        "length_m": _known(way.length_m),
        "floors": ", ".join(way.floors),
    }
    return feature("LineString", positions(plan.frame.to_site(way.points_m)), properties)


def _ground_in_plan(station: FieldStation) -> FloatArray:
    """(3,) the ground point; under the sensor, of unknown height, where the instrument height is not known."""
    if math.isfinite(station.instrument_height_m):
        return station.site_ground_m
    return np.array([station.site_m[0], station.site_m[1], math.nan])


def _station_properties(plan: PlanSource, station: FieldStation) -> dict[str, Any]:
    """Return what GIS shows of a station; heights that are not known are null."""
    return {
        "kind": "station",
        "id": station.id,
        "order": station.order,
        "floor": station.floor_id,
        "floor_name": station.floor_name,
        "ground_height_m": _known(float(station.site_ground_m[2])),
        "instrument_height_m": _known(station.instrument_height_m),
        "sensor_height_m": _known(float(station.site_m[2])),
        "scanned_before": station.id in plan.scanned_before,
        "covered_area_m2": _known(station.covered_area_m2),
        "own_area_m2": _known(station.own_area_m2),
        "description": description_of(plan, station),
    }


def feature(kind: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    """Return a GeoJSON feature."""
    return {
        "type": "Feature",
        "id": f"{properties['kind']} {properties['id']}",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _known(value: float) -> float | None:
    return round(value, 4) + 0.0 if math.isfinite(value) else None
