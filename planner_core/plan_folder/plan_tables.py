"""Tables of a plan for the report and the sheets: required and reached, stations, networks, unseen surface.

PlanSource -> rows of text, made once; pages lay them out. Coordinates are the site's; all lengths are in its unit.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.coverage.percent import reached_percent
from planner_core.model import REASONS, FloatArray, LengthUnit, Link
from planner_core.model.unseen import COVERED, NOT_WORTH, reason_in_words
from planner_core.network.network_report import HANDHELD, HANDHELD_MM
from planner_core.network.weak_motion import motion_words
from planner_core.plan_folder.drawing.marks import rise_words
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource, link_of
from planner_core.plan_folder.plan_words import (
    NOT_PLANNED,
    area,
    area_unit,
    area_words,
    floor_coverage,
    floor_percent,
    length_words,
    limits_words,
    seconds_per_station,
    short_length_words,
)

#: Coordinates on paper are for people who set up a tripod: to the millimetre, or a thousandth of a foot.
_DIGITS = 3
_AS_SET_UP = "As set up, %"
#: Networks are listed largest first, up to so many: a plan of many rooms with doors shut has one a room.
_MAX_NETWORKS = 24
#: Surfaces that are listed of each reason, and of what the plan leaves out, which a further station would see.
_MAX_SURFACES, _MAX_LEFT_OUT = 6, 12
_MAX_ELEMENTS = 30
#: Surface of less is not listed.
_SLIVER_M2 = 0.05
TICK = "☐"

#: What the reasons mean, for people.
REASON_TEXTS = {
    "not worth a station": "Positions that see it exist; the requirement is met without them.",
    "too few spots see it": "Seen, but from fewer positions than required.",
    "out of range": "In view, but beyond the maximum range of the scanner or the requirement.",
    "outside the field of view": "In view, but above or below the scanner's field of view.",
    "too oblique": "In view, but at too large an angle of incidence.",
    "too sparse": "In view, but at too large a point spacing, or without a point.",
    "too noisy": "In view, but with more range noise than allowed.",
    "returns no beam": "Glass or mirror.",
    "occluded": "Hidden by something else from every position.",
    "no admissible spot": "In a room, or outdoors, without a valid tripod position.",
    "inside solids": "Faces between building parts: no position sees them.",
}


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

    def without(self, titles: Collection[str]) -> Table:
        """The same without some columns."""
        kept = [place for place, column in enumerate(self.columns) if column.title not in titles]
        rows = tuple(tuple(row[place] for place in kept) for row in self.rows)
        return Table(self.title, tuple(self.columns[place] for place in kept), rows, self.note)


def floors_table(plan: PlanSource, part: Sequence[FloorSection] = ()) -> Table:
    """Stations and coverage by floor. part : the floors that are listed; empty: all."""
    rows, unit = [], plan.frame.unit
    for floor in part or plan.floors:
        figures, percent = floor_coverage(plan.document, floor.id), floor_percent(plan.document, floor.id)
        scannable = "" if figures is None else f"{area(unit, figures['achievable_area_m2']):.0f}"
        scannable = "" if percent == NOT_PLANNED else scannable
        height = unit.of(plan.frame.to_site(_middle(floor))[2])
        row = (floor.id, floor.name, f"{height:.2f}", str(len(plan.stations_of(floor.id))), percent, scannable)
        rows.append(row)
    columns = (
        Column("Id", 8),
        Column("Floor", 40),
        Column(f"Ground H, {unit.symbol}", 14, number=True),
        Column("Stations", 12, number=True),
        Column("Seen, %", 12, number=True),
        Column(f"Scannable, {area_unit(unit)}", 16, number=True),
    )
    return Table("Floors", columns, tuple(rows))


def _middle(floor: FloorSection) -> FloatArray:
    return np.array([*np.mean(floor.bounds, axis=0), floor.elevation_m])


def requirements_table(plan: PlanSource) -> Table | None:
    """What was required and what was reached; None of older plans, which have no results."""
    results = plan.document["requirements"]["results"]
    columns = (
        Column("Requirement", 34),
        Column("Points", 46),
        Column("Required, %", 13, number=True),
        Column("Reached, %", 13, number=True),
        Column(_AS_SET_UP, 13, number=True),
        Column("Result", 12, bold=True),
        Column(f"Of scannable, {area_unit(plan.frame.unit)}", 17, number=True),
    )
    rows = tuple(_requirement_row(result, plan.frame.unit) for result in results)
    known = any(result.get("as_set_up") is not None for result in results)
    return Table("Required and reached", columns, rows).without(() if known else (_AS_SET_UP,)) if rows else None


def _requirement_row(result: Mapping[str, Any], unit: LengthUnit) -> tuple[str, ...]:
    required, as_set_up = float(result["required"]), result.get("as_set_up")
    return (
        str(result["name"]),
        limits_words(result["asked"], int(result["seen_from"]), unit),
        f"{100 * required:g}",
        reached_percent(float(result["fraction_of_achievable"]), 0.0 if result["met"] else required),
        "" if as_set_up is None else reached_percent(float(as_set_up), required),
        "met" if result["met"] else "NOT met",
        f"{area(unit, float(result['achievable_area_m2'])):.1f}",
    )


def stations_tables(plan: PlanSource, *, for_crew: bool = False) -> list[Table]:
    """Stations floor by floor, and those of no floor; see `stations_table`."""
    floors = [(floor.name, plan.stations_of(floor.id)) for floor in plan.floors]
    known = {floor.id for floor in plan.floors}
    floors.append(("no floor", tuple(each for each in plan.stations if each.floor_id not in known)))
    return [stations_table(plan, where, there, for_crew=for_crew) for where, there in floors if there]


def stations_table(plan: PlanSource, where: str, stations: Sequence[FieldStation], *, for_crew: bool = True) -> Table:
    """Stations in visiting order: coordinates and heights, links, what each adds, notes.

    for_crew : with a box to tick, and without what is weighed in the office alone.
    """
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
        Column(f"Links: to number ({plan.link_noun}, %)", 58),
        Column(f"Sees, {area_unit(unit)}", 13, number=True),
        Column(f"Unique, {area_unit(unit)}", 13, number=True),
        Column("Unique surface", 70),
        Column("Time on station", 13, number=True),
        Column("Notes", 34),
        Column("Done", 11),
    )
    links, own = _links_by_station(plan), _own_parts(plan)
    rows = tuple(_station_row(plan, station, links, own.get(station.id, "")) for station in stations)
    note = f"Coordinates: {plan.frame.crs_line}. Unique: area that no other station sees."
    in_office = (f"Sees, {area_unit(unit)}", "Unique surface", "Time on station")
    left_out = in_office if for_crew else ("Done",) if own else ("Done", "Unique surface")
    return Table(f"Stations of {where}", columns, rows, note).without(left_out)


def _station_row(
    plan: PlanSource, station: FieldStation, links: Mapping[str, list[tuple[Link, int]]], own: str
) -> tuple[str, ...]:
    unit = plan.frame.unit
    east, north, sensor = plan.frame.in_unit(station.site_m).tolist()
    height_m = station.instrument_height_m
    linked = sorted(links.get(station.id, []), key=lambda link: (-link[0].overlap, link[1]))
    return (
        str(station.number),
        station.id,
        _figure(east),
        _figure(north),
        _figure(unit.of(float(station.site_ground_m[2]))),
        length_words(unit, height_m, _DIGITS) if unit.is_feet else _figure(height_m),
        _figure(sensor),
        ", ".join(f"{number} ({plan.link_percent(link)})" for link, number in linked) or "NONE",
        f"{area(unit, station.covered_area_m2):.1f}",
        f"{area(unit, station.own_area_m2):.1f}",
        own,
        _time_there(plan, station),
        "; ".join(_notes(plan, station)),
        TICK,
    )


def _figure(value: float) -> str:
    return f"{value:.{_DIGITS}f}" if math.isfinite(value) else "not known"


def _own_parts(plan: PlanSource) -> dict[str, str]:
    """Surface that each station alone sees; empty where reasons were not computed."""
    words = {}
    for reason in (plan.document.get("why") or {"stations": ()})["stations"]:
        parts = [
            f"{part['name']}{_room(part, ' in ')} ({area_words(plan.frame.unit, part['area_m2'], 1)})"
            for part in reason["own_parts"]
            if part["area_m2"] >= _SLIVER_M2
        ]
        words[reason["station"]] = "; ".join(parts) or "none; it connects others"
    return words


def _room(row: Mapping[str, Any], before: str = "") -> str:
    return "" if row["room"] is None else f"{before}{row['room']['name']}"


def _time_there(plan: PlanSource, station: FieldStation) -> str:
    """Set-up and scan, minutes and seconds; without the scan where nobody knows how long one takes."""
    if station.id in plan.scanned_before:
        return "scanned"
    set_up_s, scan_s = seconds_per_station(plan.document)
    total_s = round(set_up_s + (scan_s or 0.0))
    return f"{total_s // 60}:{total_s % 60:02d}" + (" + scan" if scan_s is None else "")


def _links_by_station(plan: PlanSource) -> dict[str, list[tuple[Link, int]]]:
    """Links to, and numbers of, the stations that each one's scan can be registered to."""
    number = {station.id: station.number for station in plan.stations}
    links: dict[str, list[tuple[Link, int]]] = {}
    for link in plan.links:
        if plan.counts(link) and link.a in number and link.b in number:
            links.setdefault(link.a, []).append((link, number[link.b]))
            links.setdefault(link.b, []).append((link, number[link.a]))
    return links


def _notes(plan: PlanSource, station: FieldStation) -> Iterator[str]:
    if station.note:
        yield station.note
    for floor in plan.floors:
        rise = rise_words(float(station.ground_m[2]) - floor.elevation_m, plan.frame.unit)
        if floor.id == station.floor_id and rise:
            yield f"{rise} from its floor's"
    if station.id in plan.scanned_before:
        yield "scanned before"
    elif station.fixed:
        yield "given"
    registration = plan.document["registration"]
    for join in registration.get("joins", ()):
        if station.id in join["stations"]:
            yield f"joins {join['n_groups']} groups" if join["n_groups"] > 1 else "makes the network hold as set up"
    pairs = [(link.a, link.b) for link in plan.links if link.targets_m and station.id in (link.a, link.b)]
    if pairs:
        partners = {end for pair in pairs for end in pair} - {station.id}
        others = [str(other.number) for other in plan.stations if other.id in partners]
        yield f"three targets each with {', '.join(others)}" if len(others) > 1 else f"three targets with {others[0]}"
    if any(station.id in network["articulations"] for network in registration["networks"]):
        yield "critical station"
    route = plan.document.get("route")
    if route is not None and station.id in route["left_out"]:
        yield "not on the route"


def networks_table(plan: PlanSource) -> Table | None:
    """Networks of scans and what holds them together; None of one station, or none."""
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
    """`4 to 5: 99.3 %, tilt about E–W`: the motion by grid north, or by the scene's axes where that is not known."""
    north_rad = None if plan.frame.is_scene else plan.frame.grid_north_rad
    motion = motion_words(link_of(link).weak_motion, north_rad=north_rad)
    return f"{_pair(link, number)}: {plan.link_percent(link_of(link))} %" + (f", {motion}" if motion else "")


def targets_table(plan: PlanSource) -> Table | None:
    """Pairs of stations that targets register, and where these hang; None of none."""
    number = {station.id: station.number for station in plan.stations}
    linked = [link for link in plan.links if link.targets_m]
    rows = tuple(
        (
            f"{number.get(link.a, link.a)} to {number.get(link.b, link.b)}",
            "; ".join(_place(plan, place) for place in link.targets_m),
        )
        for link in linked[:_MAX_NETWORKS]
    )
    note = f"{len(linked) - len(rows)} more: see plan.json." if len(linked) > len(rows) else ""
    columns = (Column("Stations, by number", 40), Column("Places for targets that both see", 140))
    return Table("Registration by targets", columns, rows, note) if rows else None


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
            plan.link_percent(link_of(gap["best"])),
            "; ".join(_place(plan, place) for place in gap.get("targets", ())) or "none found",
        )
        for gap in gaps[:_MAX_NETWORKS]
    )
    columns = (
        Column("Groups", 24),
        Column("Best link, by number", 28),
        Column(f"{plan.link_noun.capitalize()}, %", 18, number=True),
        Column("Places for targets that both stations see", 110),
    )
    within = " to ".join(short_length_words(plan.frame.unit, each / 1000) for each in HANDHELD_MM)
    note = f"Unconnected groups need targets, an open door, another station between them, or {HANDHELD} ({within} off)."
    note += f" {len(gaps) - len(rows)} more: see plan.json." if len(gaps) > len(rows) else ""
    return Table("Between unconnected groups", columns, rows, note)


def _pair(link: Mapping[str, Any], number: Mapping[str, int]) -> str:
    return f"{number.get(link['a'], link['a'])} to {number.get(link['b'], link['b'])}"


# ------------------------------------------------------------------------------------------------ what is unseen
def unseen_tables(plan: PlanSource, part: Sequence[FloorSection] = ()) -> list[Table]:
    """What stays unseen: by reason and the largest surfaces of each; by element where reasons were not computed.

    part : the floors whose surfaces are listed, without sums; empty: all.
    """
    why = plan.document.get("why")
    tables = [_elements_table(plan, part)] if why is None else [_surfaces_table(plan, why["unseen_surfaces"], part)]
    if why is not None and not part:
        tables.insert(0, _reasons_table(plan, why["area_by_reason_m2"]))
    return [table for table in tables if table.rows]


def _reasons_table(plan: PlanSource, area_by_reason_m2: Mapping[str, float]) -> Table:
    total_m2, unit = sum(area_by_reason_m2.values()), plan.frame.unit
    rows = tuple(
        (
            reason_in_words(reason),
            REASON_TEXTS.get(reason, ""),
            f"{area(unit, area_m2):.1f}",
            f"{100 * area_m2 / total_m2:.1f}" if total_m2 > 0 else "",
        )
        for reason, area_m2 in area_by_reason_m2.items()
        if area_m2 > 0 or reason == REASONS[COVERED]
    )
    columns = (
        Column("Reason", 40),
        Column("What it means", 90),
        Column(f"Area, {area_unit(unit)}", 14, number=True),
        Column("Of all, %", 14, number=True),
    )
    return Table("What stays unseen, and why", columns, rows)


def _surfaces_table(plan: PlanSource, surfaces: Sequence[Mapping[str, Any]], part: Sequence[FloorSection]) -> Table:
    floors = {floor.id for floor in part}
    wanted = [each for each in surfaces if not floors or each["floor"] in floors]
    rows, n_listed = [], 0
    for reason in REASONS:
        of_reason = [each for each in wanted if each["reason"] == reason and each["area_m2"] >= _SLIVER_M2]
        largest = sorted(of_reason, key=lambda each: (-each["area_m2"], each["element"]))
        shown = largest[: _MAX_LEFT_OUT if reason == REASONS[NOT_WORTH] else _MAX_SURFACES]
        rows += [_surface_row(plan, each) for each in shown]
        n_listed += len(largest)
    unit = plan.frame.unit
    columns = (
        Column("Element", 44),
        Column("Kind", 28),
        Column("Room", 26),
        Column("Floor", 9),
        Column("Reason", 30),
        Column(f"Area, {area_unit(unit)}", 13, number=True),
        Column("Largest piece, at", 44),
        Column("Best position, sees", 44),
    )
    left = n_listed - len(rows)
    note = f"{left} more: see report/unseen_surfaces.csv of the plan folder." if left > 0 else ""
    return Table("Largest unseen surfaces", columns, tuple(rows), note)


def _surface_row(plan: PlanSource, surface: Mapping[str, Any]) -> tuple[str, ...]:
    unit, piece, best = plan.frame.unit, surface["pieces"][0], surface["best_spot"]
    of = f", of {surface['n_pieces']}" if surface["n_pieces"] > 1 else ""
    position = ""
    if best is not None:
        sees, adds = (area_words(unit, best[key], 2) for key in ("sees_m2", "adds_m2"))
        position = f"{_place(plan, best['position'])}: {sees}, in all {adds}"
    return (
        str(surface["name"]),
        str(surface["kind"]),
        _room(surface),
        str(surface["floor"]),
        reason_in_words(str(surface["reason"])),
        f"{area(unit, surface['area_m2']):.2f}",
        f"{area_words(unit, piece['area_m2'], 2)}{of}, at {_place(plan, piece['centroid'])}",
        position,
    )


def _place(plan: PlanSource, scene_m: Sequence[float]) -> str:
    """A place of the scene frame in site coordinates."""
    return ", ".join(f"{value:.2f}" for value in plan.frame.in_unit(plan.frame.to_site(np.array(scene_m))))


def _elements_table(plan: PlanSource, part: Sequence[FloorSection]) -> Table:
    floors, unit = {floor.id for floor in part}, plan.frame.unit
    wanted = [each for each in plan.document["unseen"] if not floors or each["floor"] in floors]
    largest = sorted(wanted, key=lambda each: (-each["unseen_area_m2"], each["element"], each["floor"]))
    rows = tuple(
        (each["name"], each["kind"], each["floor"], *(f"{area(unit, each[key]):.2f}" for key in _AREAS))
        for each in largest[:_MAX_ELEMENTS]
    )
    columns = (
        Column("Element", 60),
        Column("Kind", 40),
        Column("Floor", 10),
        Column(f"Unseen, {area_unit(unit)}", 16, number=True),
        Column(f"Scannable, {area_unit(unit)}", 16, number=True),
    )
    left = len(largest) - len(rows)
    note = f"{left} more: see report/unseen.csv of the plan folder." if left > 0 else ""
    return Table("What stays unseen", columns, rows, note)


_AREAS = ("unseen_area_m2", "achievable_area_m2")
