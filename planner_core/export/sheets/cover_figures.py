"""The figures on the first sheet: of the whole plan, or of some floors. PlanSource, floors -> names and values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planner_core.coverage.percent import not_planned, reached_percent
from planner_core.export.sheets.figures import area_words, length_words
from planner_core.export.sheets.floor_view import is_planned
from planner_core.export.sheets.tables import required_on
from planner_core.plan_folder.plan_source import FieldFloor, PlanSource
from planner_core.requirements.wording import overlap_noun

WHOLE_PLAN = "whole plan"
LEFT_OUT = "Left out"
"""Name of the figures that are written in red."""


def part_words(plan: PlanSource, part: Sequence[FieldFloor]) -> str:
    """Say which floors of how many the sheets are of; nothing where they are of the whole plan."""
    if not part:
        return ""
    return f"Only {', '.join(floor.name for floor in part)}: {len(part)} of {len(plan.floors)} floors"


def cover_figures(plan: PlanSource, part: Sequence[FieldFloor] = ()) -> list[tuple[str, str]]:
    """Names and values. part : the floors that the sheets are of, empty for all; figures of more floors are marked."""
    return [*(_part_figures(plan, part) if part else _plan_figures(plan)), *_basis_figures(plan)]


def _plan_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    document = plan.document
    yield "Stations", stations_words(document)
    yield "Coverage", _coverage(plan, document["coverage"], float(document["requirements"]["coverage"]))
    yield from _left_out(plan)
    yield from _team_figures(plan)


def _left_out(plan: PlanSource) -> Iterator[tuple[str, str]]:
    document = plan.document
    for line in not_planned(
        sealed_m2=[room["area_m2"] for room in document.get("sealed", ())],
        scope=(document.get("scope") or {"kind": "all"})["kind"],
        achievable_m2=document["coverage"]["achievable_area_m2"],
        total_m2=document["coverage"]["total_area_m2"],
        area_by_reason_m2=(document.get("why") or {}).get("area_by_reason_m2", {}),
        area=lambda area_m2: area_words(plan.frame.unit, area_m2),
    ):
        yield LEFT_OUT, line


def _part_figures(plan: PlanSource, part: Sequence[FieldFloor]) -> Iterator[tuple[str, str]]:
    here = sum(len(plan.stations_of(floor.id)) for floor in part)
    yield "Sheets of", f"{', '.join(floor.name for floor in part)}; the plan has {len(plan.floors)} floors"
    yield "Stations", f"{here} here; {WHOLE_PLAN}: {stations_words(plan.document)}"
    seen = [_floor_coverage(plan, floor) for floor in part]
    yield (
        "Coverage",
        seen[0]
        if len(part) == 1
        else "; ".join(f"{floor.name} {words}" for floor, words in zip(part, seen, strict=True)),
    )
    for name, value in (*_left_out(plan), *_team_figures(plan)):
        yield name, f"{WHOLE_PLAN}: {value}"


def _floor_coverage(plan: PlanSource, floor: FieldFloor) -> str:
    found = [each for each in plan.document["coverage"]["floors"] if each["floor"] == floor.id]
    if not found or not is_planned(plan, floor):
        return "not planned"
    return _coverage(plan, found[0], required_on(plan, floor))


def _coverage(plan: PlanSource, figures: Mapping[str, Any], required: float) -> str:
    reached = reached_percent(float(figures["fraction_of_achievable"]), required)
    scannable = area_words(plan.frame.unit, figures["achievable_area_m2"])
    return f"{reached} % of {scannable} scannable; required: {100 * required:g} %"


def _team_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    """What all floors have together: networks, the walk, the day."""
    yield "Registration", network_words(plan)
    route, time = plan.document.get("route"), plan.document.get("field_time")
    if route is not None:
        back = ", and back to the start" if route["returns"] else ""
        yield "Route", f"{length_words(plan.frame.unit, route['length_m'], 0)} between the stations{back}"
    if time is not None:
        yield "Field time", time_words(time)


def _basis_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    """What the plan was made with: scanner, coordinates, scene."""
    document = plan.document
    scanner, settings, scene = document["scanner"], document["settings"], document["scene"]
    mode = f", mode {scanner['mode']}" if scanner["mode"] else ""
    range_m = scanner["range_max_m"]
    reach = length_words(plan.frame.unit, range_m, 0) if plan.frame.unit.is_feet else f"{range_m:g} m"
    yield "Scanner", f"{scanner['title']}{mode}; range {reach}"
    yield "Coordinates", plan.frame.crs_line + _accuracy(plan)
    yield "North", north_words(plan)
    if plan.frame.place:
        yield "Location", f"{plan.frame.place}, roughly: as in the {scene['format'].upper()} file"
    yield "Scene", f"{scene['file']} ({scene['format'].upper()}), SHA-256 {scene['sha256'][:16]}…"
    made = document.get("versions", {}).get("tlsplan")
    basis = f"{_thousands(settings['n_patches'])} patches, {_thousands(settings['n_candidates'])} candidates"
    yield "Computed", basis + (f"; tlsplan {made}" if made else "")


def north_words(plan: PlanSource) -> str:
    """Say which north the drawings show, where it comes from, and how they are turned to it."""
    frame = plan.frame
    turned = _turned(frame.grid_north_rad)
    if not frame.is_scene:
        kind = "grid north" if frame.crs else "axis N of the site's coordinates"
        return f"arrow N on the drawings: {kind}, {turned}"
    if frame.true_north_rad is None:
        return "not known; drawings are aligned with x and y of the scene"
    text = f"true north as in the {plan.document['scene']['format'].upper()} file"
    return f"{text}, {turned}; coordinates are not rotated to it"


def _turned(north_rad: float) -> str:
    """Say how far north is from up on the drawings."""
    degrees = round(math.degrees(north_rad), 1)
    if degrees == 0:
        return "up on the sheet"
    return f"{abs(degrees):.1f}° {'clockwise' if degrees > 0 else 'counter-clockwise'} from up"


def _thousands(number: int) -> str:
    return f"{number:,}".replace(",", "\u202f")


def stations_words(document: Mapping[str, Any]) -> str:
    """Say how many stations there are, and how few there can be."""
    n, best = len(document["stations"]), document["optimality"]
    if best["proven"]:
        return f"{n}: proven to be the fewest on these candidates"
    if best["lower_bound"] is None:
        return str(n)
    gap = "" if best["gap"] is None else f" (gap {100 * best['gap']:.0f} %)"
    return f"{n}; lower bound {best['lower_bound']} (on these candidates){gap}"


def network_words(plan: PlanSource) -> str:
    """Say how the stations hang together."""
    of = plan.document["registration"]
    counted = sum(map(plan.counts, plan.links))
    required = plan.document["requirements"]
    overlap = overlap_noun(required["overlap_measure"], required["overlap_of"])
    low = ", or as set up" if any(link.as_set_up for link in plan.links) else ""
    links = f"{counted} links of at least {100 * of['threshold']:g} % {overlap}{low}"
    if of["connected"]:
        return f"{len(plan.stations)} stations, all connected; {links}"
    sizes = [len(network["stations"]) for network in of["networks"]]
    listed = ", ".join(map(str, sizes[:12])) + (" …" if len(sizes) > 12 else "")
    return f"NOT all connected: {len(sizes)} groups, of {listed} stations; {links}"


def time_words(time: Mapping[str, Any]) -> str:
    """Say how long the day is, as far as that is known."""
    parts = (("scanning", time["scanning_s"]), ("setting up", time["set_up_s"]), ("walking", time["walking_s"]))
    listed = ", ".join(f"{_minutes(seconds)} {name}" for name, seconds in parts if seconds is not None)
    if time["total_s"] is None:
        return f"{listed}; scan time not known"
    return f"{_hours(time['total_s'])}: {listed}"


def _minutes(seconds: float) -> str:
    return "less than 1 min" if 0 < seconds < 30 else f"{seconds / 60:.0f} min"


def _hours(seconds: float) -> str:
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"


def _accuracy(plan: PlanSource) -> str:
    scale, residuals = plan.frame.horizontal_scale, plan.frame.residuals_m
    words = "" if abs(scale - 1.0) < 1e-7 else f"; grid scale factor {scale:.6f}"
    if not residuals:
        return words
    unit = plan.frame.unit
    largest = unit.text(max(residuals), 3) if unit.is_feet else f"{1000 * max(residuals):.1f} mm"
    return f"{words}; {len(residuals)} control points, largest residual {largest}"
