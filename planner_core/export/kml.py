"""Stations, links and walk as KML 2.2, a folder a floor, for Google Earth and everything that reads its files.

Longitude and latitude, WGS84. Heights, by default, count from the lowest floor, which is put on the ground that the
viewer has (`relativeToGround`); `absolute` takes the site's heights as if they were above the EGM96 geoid, as KML means
them. Both are metres, as KML has them. The document states which, and every station carries its heights as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from planner_core.coverage.percent import probability_percent, reached_percent
from planner_core.errors import RequirementError
from planner_core.export.chosen import (
    FloorStations,
    RouteLeg,
    chosen_floors,
    chosen_stations,
    description_of,
    require_ground,
    route_remarks,
    stations_by_floor,
    ways_of,
    ways_to,
)
from planner_core.export.csv_profiles import figure
from planner_core.export.floor_outlines import GROUND, outlines_of
from planner_core.export.geographic import DECIMALS, Geographic, geographic_of
from planner_core.export.options import Options
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

NAMESPACE = "http://www.opengis.net/kml/2.2"
#: Style -> colour of lines (alpha, blue, green, red in hexadecimal) and their width in pixels.
_LINES = {"link": ("b0d8a03c", "2"), "weak": ("7fa0a0a0", "1"), "route": ("ff2a6fdb", "3"), "floor": ("ff404040", "2")}
_STATION_COLOUR = "ff2a4bd7"
_SCANNED_COLOUR = "ff808080"


class _Places:
    """Writes coordinates: of site points, in degrees and metres of the chosen kind of height."""

    def __init__(self, plan: PlanSource, degrees: Geographic, heights: str) -> None:
        lowest = min((floor.elevation_m for floor in plan.floors), default=0.0)
        self._degrees = degrees
        self.mode = "absolute" if heights == "absolute" else "relativeToGround"
        self._zero_m = 0.0 if heights == "absolute" else float(plan.frame.to_site(np.array([0.0, 0.0, lowest]))[2])

    def text(self, site_m: FloatArray) -> str:
        """`longitude,latitude,height` of points (N, 3), with blanks between them."""
        points = np.asarray(site_m, dtype=np.float64).reshape(-1, 3)
        return " ".join(
            f"{east:.{DECIMALS}f},{north:.{DECIMALS}f},{figure(height - self._zero_m)}"
            for (east, north), height in zip(self._degrees.degrees(points).tolist(), points[:, 2].tolist(), strict=True)
        )


def write_kml(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write folders of stations by floor, of links, of the walk and of the floors' outlines.

    Raises
    ------
    ExportError
        The CRS is not known, or a ground point is not.
    """
    if options.kml_heights not in ("relative", "absolute"):
        raise RequirementError(f"--kml-heights: got {options.kml_heights!r}, expected relative or absolute")
    degrees = geographic_of(plan.frame, "kml")
    stations = chosen_stations(plan, options)
    if options.instrument != "sensor":
        require_ground(stations, "kml")
    places = _Places(plan, degrees, options.kml_heights)
    root = ElementTree.Element("kml", {"xmlns": NAMESPACE})
    document = ElementTree.SubElement(root, "Document")
    _texts(document, name=plan.title, open="1", description=_about(plan, options))
    _add_styles(document)
    for floor in stations_by_floor(plan, options):
        _add_stations(document, plan, floor, places, options)
    kept = {station.id: station for station in stations}
    ways = ways_of(plan)
    _add_route(document, plan, ways_to(ways, kept), places)
    _add_links(document, plan, kept, places)
    of_floors = _add_floors(document, plan, chosen_floors(plan, options), places)
    ElementTree.indent(root, " ")
    path.write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return (*degrees.remarks, *of_floors, *route_remarks(ways))


def _about(plan: PlanSource, options: Options) -> str:
    if options.kml_heights == "absolute":
        heights = "heights as the site has them, which KML takes as above the EGM96 geoid"
    else:
        heights = "heights above the lowest floor, which is put on the ground"
    which = "sensors" if options.instrument == "sensor" else "ground points"
    return f"Stations of a scan plan, their {which}. Made from {plan.frame.crs_line}; {heights}."


def _texts(parent: ElementTree.Element, **texts: str) -> None:
    for tag, text in texts.items():
        ElementTree.SubElement(parent, tag).text = text


def _add_styles(document: ElementTree.Element) -> None:
    for name, colour in (("station", _STATION_COLOUR), ("scanned", _SCANNED_COLOUR)):
        style = ElementTree.SubElement(document, "Style", {"id": name})
        # No picture from elsewhere: the viewer's own pin, in our colour.
        _texts(ElementTree.SubElement(style, "IconStyle"), color=colour, scale="1.0")
        _texts(ElementTree.SubElement(style, "LabelStyle"), scale="0.9")
    for name, (colour, width) in _LINES.items():
        style = ElementTree.SubElement(document, "Style", {"id": name})
        _texts(ElementTree.SubElement(style, "LineStyle"), color=colour, width=width)
        _texts(ElementTree.SubElement(style, "PolyStyle"), fill="0")


def _folder(document: ElementTree.Element, name: str) -> ElementTree.Element:
    folder = ElementTree.SubElement(document, "Folder")
    _texts(folder, name=name)
    return folder


def _placemark(
    folder: ElementTree.Element, name: str, description: str, style: str, values: Sequence[tuple[str, str]] = ()
) -> ElementTree.Element:
    placemark = ElementTree.SubElement(folder, "Placemark")
    _texts(placemark, name=name, description=description, styleUrl=f"#{style}")
    if values:
        extended = ElementTree.SubElement(placemark, "ExtendedData")
        for key, value in values:
            _texts(ElementTree.SubElement(extended, "Data", {"name": key}), value=value)
    return placemark


def _add_stations(
    document: ElementTree.Element, plan: PlanSource, floor: FloorStations, places: _Places, options: Options
) -> None:
    folder = _folder(document, f"{floor.id} {floor.name}" if floor.id else "no floor of the plan")
    for station in floor.stations:
        scanned = station.id in plan.scanned_before
        style = "scanned" if scanned else "station"
        placemark = _placemark(
            folder, station.id, description_of(plan, station), style, list(_values(plan, station, scanned=scanned))
        )
        point = ElementTree.SubElement(placemark, "Point")
        at_m = station.site_m if options.instrument == "sensor" else station.site_ground_m
        _texts(point, altitudeMode=places.mode, coordinates=places.text(at_m))


def _values(plan: PlanSource, station: FieldStation, *, scanned: bool) -> Iterator[tuple[str, str]]:
    yield "order", str(station.order)
    yield "floor", station.floor_id
    unit = plan.frame.unit
    yield f"ground_height_{unit.symbol}", figure(unit.of(float(station.site_ground_m[2])))
    yield f"instrument_height_{unit.symbol}", figure(unit.of(station.instrument_height_m))
    yield f"sensor_height_{unit.symbol}", figure(unit.of(float(station.site_m[2])))
    yield "scanned_before", "true" if scanned else "false"


def _add_line(placemark: ElementTree.Element, site_m: FloatArray, places: _Places) -> None:
    line = ElementTree.SubElement(placemark, "LineString")
    _texts(line, tessellate="0", altitudeMode=places.mode, coordinates=places.text(site_m))


def _add_route(document: ElementTree.Element, plan: PlanSource, ways: list[RouteLeg], places: _Places) -> None:
    if not ways:
        return
    folder = _folder(document, "route")
    for way in ways:
        length = plan.frame.unit.text(way.length_m, 1) if math.isfinite(way.length_m) else ""
        _add_line(_placemark(folder, way.title, length, "route"), plan.frame.to_site(way.points_m), places)


def _add_links(
    document: ElementTree.Element, plan: PlanSource, stations: dict[str, FieldStation], places: _Places
) -> None:
    links = [link for link in plan.links if link.a in stations and link.b in stations]
    if not links:
        return
    folder = _folder(document, "links")
    for link in links:
        strength = f", strength {link.strength:.4f}" if math.isfinite(link.strength) else ""
        overlap = reached_percent(link.overlap, plan.min_overlap)
        known = not math.isnan(link.probability)
        registers = f"probability {probability_percent(link.probability, plan.limits.probability)} %, " if known else ""
        text = f"{registers}overlap {overlap} %{strength}{'' if plan.counts(link) else ', does not count'}"
        placemark = _placemark(folder, f"{link.a}-{link.b}", text, "link" if plan.counts(link) else "weak")
        _add_line(placemark, np.stack([stations[link.a].site_m, stations[link.b].site_m]), places)


def _add_floors(
    document: ElementTree.Element, plan: PlanSource, floors: Sequence[FloorSection], places: _Places
) -> tuple[str, ...]:
    folder = _folder(document, "floors")
    outlines, remarks = outlines_of(plan, floors)
    for floor in floors:
        outline = outlines[floor.id]
        text = f"{'the ground' if outline.made_of == GROUND else 'the rectangle around the ground'} of {floor.id}"
        parent = _placemark(folder, floor.name, f"{text}, {outline.area_m2:.1f} m2", "floor")
        if len(outline.polygons) > 1:
            parent = ElementTree.SubElement(parent, "MultiGeometry")
        for rings in outline.polygons:
            polygon = ElementTree.SubElement(parent, "Polygon")
            _texts(polygon, altitudeMode=places.mode)
            for number, ring in enumerate(rings):
                boundary = ElementTree.SubElement(polygon, "innerBoundaryIs" if number else "outerBoundaryIs")
                closed = np.column_stack([ring, np.full(len(ring), floor.elevation_m)])[[*range(len(ring)), 0]]
                line = ElementTree.SubElement(boundary, "LinearRing")
                _texts(line, coordinates=places.text(plan.frame.to_site(closed)))
    return remarks
