"""A plan in rows of sheets: what was required and reached, stations, networks, unseen surface.

PlanSource -> text; no layout. Coordinates are the site's; coordinates and lengths are in its unit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.coverage.percent import reached_percent
from planner_core.export.chosen import scanned_before
from planner_core.export.sheets.figures import area, area_unit, length_words, short_length_words
from planner_core.export.sheets.floor_view import is_planned
from planner_core.model import FOOT, FloatArray, LengthUnit, WeakMotion
from planner_core.model.unseen import reason_in_words
from planner_core.network.network_report import groups_first
from planner_core.network.weak_motion import motion_words, overlap_percent
from planner_core.plan_folder.drawing.marks import rise_words
from planner_core.plan_folder.plan_source import FieldFloor, FieldStation, PlanSource

#: Coordinates on paper are for people who set up a tripod: to the millimetre, or a thousandth of a foot.
_DIGITS = 3
#: Networks are listed largest first, up to so many: a plan of many rooms with doors shut has one a room.
_MAX_NETWORKS = 24
#: Listed of what the plan leaves out, and of what no position sees.
_MAX_SURFACES = 12
_LEFT_OUT = "not worth a station"
TICK = "☐"


@dataclass(frozen=True)
class Column:
    """A column of a table. share : of the width, beside the others'. number : aligned to the right."""

    title: str
    share: float
    number: bool = False
    bold: bool = False


@dataclass(frozen=True)
class Table:
    """Rows under a heading. note : a line below the heading."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def warnings_of(plan: PlanSource) -> list[str]:
    """Warnings of unconnected groups, then those of coordinates, then the others of the plan."""
    return groups_first([*plan.frame.warnings, *(str(line) for line in plan.document.get("warnings", ()))])


def required_on(plan: PlanSource, floor: FieldFloor) -> float:
    """Return the share of a floor's achievable surface that is required."""
    required = plan.document["requirements"]
    # The results begin with those of the planned floors, each by the name, id or pattern that the client wrote.
    planned = [each.id for each in plan.floors if is_planned(plan, each)]
    results = dict(zip(planned, required["results"], strict=False))  # older plans have none
    return float(results.get(floor.id, {"required": required["coverage"]})["required"])


# ------------------------------------------------------------------------------------------------- tables
def floors_table(plan: PlanSource, part: Sequence[FieldFloor] = ()) -> Table:
    """Stations and coverage by floor. part : the floors that are listed; empty: all."""
    reached = {each["floor"]: each for each in plan.document["coverage"]["floors"]}
    rows, unit = [], plan.frame.unit
    for floor in part or plan.floors:
        figures = reached.get(floor.id, {})
        share, scannable_m2 = figures.get("fraction_of_achievable"), figures.get("achievable_area_m2")
        known = share is not None and scannable_m2 is not None
        seen = ("", "")
        if known and scannable_m2 > 0:
            seen = (reached_percent(share, required_on(plan, floor)), f"{area(unit, scannable_m2):.0f}")
        elif known:
            seen = ("none", "0")
        seen = seen if is_planned(plan, floor) else ("not planned", "")
        height = unit.of(plan.frame.to_site(_middle(floor))[2])
        rows.append((floor.id, floor.name, f"{height:.2f}", str(len(plan.stations_of(floor.id))), *seen))
    columns = (
        Column("Id", 8),
        Column("Floor", 40),
        Column(f"Ground H, {unit.symbol}", 14, number=True),
        Column("Stations", 12, number=True),
        Column("Seen, %", 12, number=True),
        Column(f"Scannable, {area_unit(unit)}", 16, number=True),
    )
    return Table("Floors", columns, tuple(rows))


def _middle(floor: FieldFloor) -> FloatArray:
    return np.array([*floor.bounds.mean(axis=0), floor.elevation_m])


def requirements_table(plan: PlanSource) -> Table:
    """What was required and what was reached."""
    rows = tuple(_requirement_row(result, plan.frame.unit) for result in plan.document["requirements"]["results"])
    columns = (
        Column("Requirement", 34),
        Column("Points", 46),
        Column("Required, %", 13, number=True),
        Column("Reached, %", 13, number=True),
        Column("Result", 12, bold=True),
        Column(f"Of scannable, {area_unit(plan.frame.unit)}", 17, number=True),
    )
    return Table("Required and reached", columns, rows)


def _requirement_row(result: Mapping[str, Any], unit: LengthUnit) -> tuple[str, ...]:
    required = float(result["required"])
    return (
        str(result["name"]),
        limits_words(result["asked"], int(result["seen_from"]), unit),
        f"{100 * required:g}",
        reached_percent(float(result["fraction_of_achievable"]), 0.0 if result["met"] else required),
        "met" if result["met"] else "NOT met",
        f"{area(unit, float(result['achievable_area_m2'])):.1f}",
    )


def limits_words(required: Mapping[str, Any], seen_from: int, unit: LengthUnit) -> str:
    """Put the limits of points into words."""
    limits = []
    if required["range_m"] is not None:
        text = f"{FOOT.of(required['range_m']):.4g} ft" if unit.is_feet else f"{required['range_m']:g} m"
        limits.append(f"range {text}")
    if required["incidence_rad"] is not None:
        limits.append(f"incidence {math.degrees(required['incidence_rad']):.4g}°")
    if required["spacing_m"] is not None:
        limits.append(f"spacing {short_length_words(unit, required['spacing_m'])}")
    if required["noise_m"] is not None:
        limits.append(f"noise {short_length_words(unit, required['noise_m'])}")
    words = "at most " + ", ".join(limits) if limits else "seen"
    return words + (f", from {seen_from} stations" if seen_from > 1 else "")


def stations_table(plan: PlanSource, where: str, stations: Sequence[FieldStation]) -> Table:
    """Stations in walking order: coordinates and heights, links, notes, and a box to tick."""
    unit = plan.frame.unit
    names = ("x", "y") if plan.frame.is_scene else ("E", "N")
    columns = (
        Column("No.", 8, number=True, bold=True),
        Column("Id", 15, bold=True),
        Column(f"{names[0]}, {unit.symbol}", 21, number=True),
        Column(f"{names[1]}, {unit.symbol}", 22, number=True),
        Column(f"H ground, {unit.symbol}", 17, number=True),
        Column("Instrument height" if unit.is_feet else "Instrument height, m", 17, number=True),
        Column(f"H sensor, {unit.symbol}", 17, number=True),
        Column("Links: to number (overlap, %)", 58),
        Column(f"Unique, {area_unit(unit)}", 13, number=True),
        Column("Notes", 34),
        Column("Done", 11),
    )
    links = _links_by_station(plan)
    rows = tuple(_station_row(plan, station, links) for station in stations)
    note = f"Coordinates: {plan.frame.crs_line}. Unique: area that no other station sees."
    return Table(f"Stations of {where}", columns, rows, note)


def _station_row(
    plan: PlanSource, station: FieldStation, links: Mapping[str, list[tuple[float, int]]]
) -> tuple[str, ...]:
    unit = plan.frame.unit
    east, north, sensor = plan.frame.in_unit(station.site_m).tolist()
    height_m = station.instrument_height_m
    linked = sorted(links.get(station.id, []), key=lambda link: (-link[0], link[1]))
    return (
        str(station.number),
        station.id,
        _figure(east),
        _figure(north),
        _figure(unit.of(float(station.site_ground_m[2]))),
        length_words(unit, height_m, _DIGITS) if unit.is_feet else _figure(height_m),
        _figure(sensor),
        ", ".join(f"{number} ({overlap_percent(overlap)})" for overlap, number in linked) or "NONE",
        f"{area(unit, station.own_area_m2):.1f}",
        "; ".join(_notes(plan, station)),
        TICK,
    )


def _figure(value: float) -> str:
    return f"{value:.{_DIGITS}f}" if math.isfinite(value) else "not known"


def _links_by_station(plan: PlanSource) -> dict[str, list[tuple[float, int]]]:
    """Overlap and number of the stations that each one's scan can be registered to."""
    number = {station.id: station.number for station in plan.stations}
    links: dict[str, list[tuple[float, int]]] = {}
    for link in plan.links:
        if plan.counts(link) and link.a in number and link.b in number:
            links.setdefault(link.a, []).append((link.overlap, number[link.b]))
            links.setdefault(link.b, []).append((link.overlap, number[link.a]))
    return links


def _notes(plan: PlanSource, station: FieldStation) -> Iterator[str]:
    if station.note:
        yield station.note
    for floor in plan.floors:
        rise = rise_words(float(station.ground_m[2]) - floor.elevation_m, plan.frame.unit)
        if floor.id == station.floor_id and rise:
            yield f"{rise} from its floor's"
    if station.id in scanned_before(plan):
        yield "scanned before"
    if any(station.id in network["articulations"] for network in plan.document["registration"]["networks"]):
        yield "critical station"
    route = plan.document.get("route")
    if route is not None and station.id in route["left_out"]:
        yield "not on the route"


def networks_table(plan: PlanSource) -> Table | None:
    """Networks of scans and what holds them together; None where there is nothing to say: one station, or none."""
    networks = plan.document["registration"]["networks"]
    if len(plan.stations) < 2:
        return None
    number = {station.id: station.number for station in plan.stations}
    rows = []
    for place, network in enumerate(networks, start=1):
        weakest = network["bottleneck"]
        hangs = "" if weakest is None else _weakest_words(plan, weakest, number)
        bridges = ", ".join(f"{number.get(a, a)} to {number.get(b, b)}" for a, b in network["bridges"])
        stations = ", ".join(str(number.get(name, name)) for name in network["stations"])
        rows.append((str(place), stations, ", ".join(network["floors"]), hangs, bridges or "none"))
    columns = (
        Column("No.", 7, number=True, bold=True),
        Column("Stations, by number", 62),
        Column("Floors", 14),
        Column("Weakest link of the network, and its weakest direction", 44),
        Column("Single-link connections", 40),
    )
    more = len(rows) - _MAX_NETWORKS
    note = f"{more} more: see plan.json." if more > 0 else ""
    return Table("Registration of scans", columns, tuple(rows[:_MAX_NETWORKS]), note)


def _weakest_words(plan: PlanSource, link: Mapping[str, Any], number: Mapping[str, int]) -> str:
    """`4 to 5: 32.7 %, tilt about E–W`: the motion by grid north, or by the scene's axes where that is not known."""
    north_rad = None if plan.frame.is_scene else plan.frame.grid_north_rad
    weak = link.get("weak_motion")  # plans of older versions have none
    motion = motion_words(weak and WeakMotion(weak["kind"], tuple(weak["direction"])), north_rad=north_rad)
    return f"{_pair(link, number)}: {overlap_percent(link['overlap'])} %" + (f", {motion}" if motion else "")


def gaps_table(plan: PlanSource) -> Table | None:
    """What comes nearest to joining separate networks; None where there is one network."""
    gaps = plan.document["registration"]["gaps"]
    if not gaps:
        return None
    number = {station.id: station.number for station in plan.stations}
    rows = tuple(
        (
            f"{gap['networks'][0] + 1} and {gap['networks'][1] + 1}",
            _pair(gap["best"], number),
            overlap_percent(gap["best"]["overlap"]),
        )
        for gap in gaps[:_MAX_NETWORKS]
    )
    columns = (Column("Groups", 30), Column("Best link, by number", 30), Column("Overlap, %", 20, number=True))
    note = "Unconnected groups need targets, an open door or another station between them."
    note += f" {len(gaps) - len(rows)} more: see plan.json." if len(gaps) > len(rows) else ""
    return Table("Between unconnected groups", columns, rows, note)


def _pair(link: Mapping[str, Any], number: Mapping[str, int]) -> str:
    return f"{number.get(link['a'], link['a'])} to {number.get(link['b'], link['b'])}"


def unseen_table(plan: PlanSource, part: Sequence[FieldFloor] = ()) -> Table | None:
    """Largest surfaces that are not covered, with the reason; None where reasons were not computed.

    part : the floors whose surfaces are listed; empty: all.
    """
    why = plan.document.get("why")
    if why is None:
        return None
    floors = {floor.id for floor in part}
    wanted = [each for each in why["unseen_surfaces"] if not floors or each["floor"] in floors]
    surfaces = sorted(wanted, key=lambda each: (-each["area_m2"], each["element"]))
    left_out = [each for each in surfaces if each["reason"] == _LEFT_OUT][:_MAX_SURFACES]
    others = [each for each in surfaces if each["reason"] != _LEFT_OUT][:_MAX_SURFACES]
    rows = tuple(_unseen_row(each, plan.frame.unit) for each in (*left_out, *others))
    if not rows:
        return None
    columns = (
        Column("Element", 50),
        Column("Room", 30),
        Column("Floor", 10),
        Column("Reason", 40),
        Column(f"Area, {area_unit(plan.frame.unit)}", 14, number=True),
    )
    left = len(surfaces) - len(rows)
    note = f"{left} more: see report/unseen_surfaces.csv of the plan folder." if left > 0 else ""
    return Table("What stays unseen", columns, rows, note)


def _unseen_row(surface: Mapping[str, Any], unit: LengthUnit) -> tuple[str, ...]:
    room = surface["room"]
    name = "" if room is None else str(room["name"])
    return (
        str(surface["name"]),
        name,
        str(surface["floor"]),
        reason_in_words(str(surface["reason"])),
        f"{area(unit, surface['area_m2']):.2f}",
    )
