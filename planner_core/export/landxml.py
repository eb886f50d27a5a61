"""Stations as LandXML 1.2: points by floor, ground and sensor apart, and the walk as plan features.

Site frame, in metres or one of the two feet, as the element Units states; a point's text is northing, easting, height,
in this order. The schema wants a date: it is always 1970-01-01, so that the same plan gives the same bytes.

    <CgPoints name="F0 ground points"><CgPoint name="S001" ... role="to stake out">5.0000 9.0000 0.0000</CgPoint>

Source: LandXML-1.2.xsd: elements Units, CoordinateSystem, Project, Application, CgPoints, PlanFeatures.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from planner_core.export.chosen import (
    FloorStations,
    RouteLeg,
    chosen_stations,
    description_of,
    has_ground,
    route_remarks,
    stations_by_floor,
    ways_of,
    ways_to,
    without_ground_remark,
)
from planner_core.export.csv_profiles import figure
from planner_core.export.options import Options
from planner_core.model import US_SURVEY_FOOT, FloatArray, SiteFrame
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

NAMESPACE = "http://www.landxml.org/schema/LandXML-1.2"
#: No clock in what is written.
_DATE, _TIME = "1970-01-01", "00:00:00"
_METRIC = {
    "areaUnit": "squareMeter",
    "linearUnit": "meter",
    "volumeUnit": "cubicMeter",
    "temperatureUnit": "celsius",
    "pressureUnit": "milliBars",
    "angularUnit": "decimal degrees",
    "directionUnit": "decimal degrees",
}
_IMPERIAL = {
    "areaUnit": "squareFoot",
    "linearUnit": "foot",
    "volumeUnit": "cubicFeet",
    "temperatureUnit": "fahrenheit",
    "pressureUnit": "inchHG",
    "angularUnit": "decimal degrees",
    "directionUnit": "decimal degrees",
}


def write_landxml(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write points and walk; remarks tell of ground points that are not known, and of what the walk lacks."""
    stations = chosen_stations(plan, options)
    ways = ways_of(plan)
    root = ElementTree.Element(
        "LandXML",
        {
            "xmlns": NAMESPACE,
            "version": "1.2",
            "date": _DATE,
            "time": _TIME,
            "language": "English",
            "readOnly": "false",
        },
    )
    _add_units(_add(root, "Units"), plan.frame)
    _add(root, "CoordinateSystem", _system(plan.frame))
    _add(root, "Project", {"name": plan.title, "desc": "stations of terrestrial laser scanning", "state": "proposed"})
    _add(root, "Application", {"name": "tlsplan"})
    for floor in stations_by_floor(plan, options):
        _add_points(root, plan, floor, kind="ground")
        _add_points(root, plan, floor, kind="sensor")
    kept = {station.id for station in stations}
    _add_route(root, plan.frame, ways_to(ways, kept))
    ElementTree.indent(root, " ")
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return (*without_ground_remark(stations, "it has a sensor only"), *route_remarks(ways))


def _add(parent: ElementTree.Element, tag: str, attributes: dict[str, str] | None = None) -> ElementTree.Element:
    return ElementTree.SubElement(parent, tag, attributes or {})


def _add_units(units: ElementTree.Element, frame: SiteFrame) -> None:
    if not frame.unit.is_feet:
        _add(units, "Metric", _METRIC)
    elif frame.unit is US_SURVEY_FOOT:
        _add(units, "Imperial", {**_IMPERIAL, "linearUnit": "USSurveyFoot"})
    else:
        _add(units, "Imperial", _IMPERIAL)


def _system(frame: SiteFrame) -> dict[str, str]:
    """Return attributes of CoordinateSystem: an EPSG code as such, anything else as well-known text or in words."""
    out = {"desc": frame.crs_line, "name": frame.name}
    authority, _, code = frame.crs.partition(":")
    if frame.unit is not frame.crs_unit:
        return out  # a code would say another unit than these coordinates have
    if authority.upper() == "EPSG" and code.isdigit():
        out["epsgCode"] = code
    elif frame.crs:
        out["ogcWktCode"] = frame.crs
    if frame.vertical_crs:
        out["verticalCoordinateSystemName"] = frame.vertical_crs
    return out


def _add_points(root: ElementTree.Element, plan: PlanSource, floor: FloorStations, *, kind: str) -> None:
    """Add a group of points; a sensor's have names of their own, for programs that put all groups together."""
    stations = floor.stations if kind == "sensor" else tuple(each for each in floor.stations if has_ground(each))
    if not stations:
        return
    what = "ground points, to be set out" if kind == "ground" else "sensors, at instrument height above the ground"
    name = f"{floor.id or 'other'} {kind} points"
    group = _add(root, "CgPoints", {"name": name, "desc": f"{floor.name or 'no floor of the plan'}: {what}"})
    scanned = plan.scanned_before
    for station in stations:
        at_m = station.site_ground_m if kind == "ground" else station.site_m
        attributes = {
            "name": station.id if kind == "ground" else f"{station.id}-sensor",
            "desc": description_of(plan, station),
            "code": station.floor_id,
            "state": "existing" if station.id in scanned else "proposed",
            "featureRef": f"{station.id} {kind}",
        }
        if kind == "ground":
            attributes["role"] = "to stake out"
        _add(group, "CgPoint", attributes).text = _north_east_height(plan.frame, at_m)
    for station in stations:
        feature = _add(group, "Feature", {"name": f"{station.id} {kind}", "code": "station"})
        for label, value in _properties(plan.frame, station, scanned=station.id in scanned):
            _add(feature, "Property", {"label": label, "value": value})


def _properties(frame: SiteFrame, station: FieldStation, *, scanned: bool) -> Iterator[tuple[str, str]]:
    yield "floor", station.floor_name
    yield "order", str(station.order)
    unit = frame.unit
    yield f"instrument_height_{unit.symbol}", figure(unit.of(station.instrument_height_m))
    yield f"ground_height_{unit.symbol}", figure(unit.of(float(station.site_ground_m[2])))
    yield f"sensor_height_{unit.symbol}", figure(unit.of(float(station.site_m[2])))
    yield "scanned_before", "true" if scanned else "false"


def _add_route(root: ElementTree.Element, frame: SiteFrame, ways: list[RouteLeg]) -> None:
    if not ways:
        return
    features = _add(root, "PlanFeatures", {"name": "route", "desc": "the route from station to station, on the ground"})
    for number, way in enumerate(ways, start=1):
        feature = _add(features, "PlanFeature", {"name": f"route {number}", "desc": way.title})
        length = {"length": figure(frame.unit.of(way.length_m))} if math.isfinite(way.length_m) else {}
        line = _add(_add(feature, "CoordGeom", {"name": f"route {number}"}), "IrregularLine", length)
        points = [_north_east_height(frame, at_m) for at_m in frame.to_site(way.points_m)]
        _add(line, "Start").text = points[0]
        _add(line, "End").text = points[-1]
        _add(line, "PntList3D").text = " ".join(points)


def _north_east_height(frame: SiteFrame, site_m: FloatArray) -> str:
    east, north, height = frame.in_unit(site_m).tolist()
    return f"{figure(north)} {figure(east)} {figure(height)}"
