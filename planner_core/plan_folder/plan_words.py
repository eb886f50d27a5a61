"""A plan in words: figures and sentences of the summary, the report, maps and sheets, each composed here alone.

Input plan.json's document, or the `PlanSource` made of it; lengths and areas are written in a unit, metres or feet.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import ROUND_CEILING, Decimal
from typing import Any

from planner_core.coverage.percent import (
    link_limits_words,
    not_as_required_m2,
    not_planned,
    probability_percent,
    reached_percent,
)
from planner_core.model import FOOT, METRE, LengthUnit, Scope
from planner_core.model.site_frame import feet_and_inches
from planner_core.network.network_report import groups_first, weakest_link
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import PlanSource, limits_of, link_of, links_of
from planner_core.requirements.goals import OVERALL
from planner_core.requirements.wording import overlap_defined, overlap_noun

Document = Mapping[str, Any]
"""Of plan.json, or a part of it."""
WHOLE_PLAN = "whole plan"
NOT_PLANNED = "not planned"
LEFT_OUT = "Left out"
"""Name of the figures that are written in red."""
#: Groups that do not register are counted by their stations up to so many.
_MOST_GROUPS = 12


# ------------------------------------------------------------------------------------- lengths, areas, times
def length_words(unit: LengthUnit, length_m: float, digits: int) -> str:
    """`1.20 m`; in feet `3' 11 1/4"`, and without digits `12 ft`. Coordinates have decimals instead."""
    if not unit.is_feet:
        return f"{length_m:.{digits}f} m"
    return FOOT.text(length_m, 0) if digits == 0 else feet_and_inches(length_m)


def cut_words(unit: LengthUnit, height_m: float) -> str:
    """Height of a section plane: `1.2 m`, `3' 11 1/4"`."""
    return feet_and_inches(height_m) if unit.is_feet else f"{height_m:.3g} m"


def short_length_words(unit: LengthUnit, length_m: float) -> str:
    """Millimetres, or inches."""
    return f"{length_m / 0.0254:.3g} in" if unit.is_feet else f"{1000 * length_m:g} mm"


def area(unit: LengthUnit, area_m2: float) -> float:
    """Square metres, or square feet."""
    return area_m2 / FOOT.metres**2 if unit.is_feet else area_m2


def area_unit(unit: LengthUnit) -> str:
    """Unit of `area`."""
    return "sq ft" if unit.is_feet else "m²"


def area_words(unit: LengthUnit, area_m2: float, digits: int = 0) -> str:
    """An area and its unit."""
    return f"{area(unit, area_m2):.{digits}f} {area_unit(unit)}"


def duration_words(seconds: float) -> str:
    """`46 min`, `3 h 05 min`."""
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"


# -------------------------------------------------------------------------------------------------- sentences
def stations_words(n_stations: int) -> str:
    """`8 stations`."""
    return f"{n_stations} station{'' if n_stations == 1 else 's'}"


def bound_words(optimality: Document) -> str:
    """What is known of how good the number of stations is, to stand behind it; empty where nothing is."""
    if optimality["objective"] == "most coverage":
        # A bound from above, to one digit and never lower; exact, as 100 * share is not.
        most = (100 * Decimal(str(optimality["bound"]))).quantize(Decimal("0.1"), ROUND_CEILING)
        return f", no plan with so many covers more than {most} %"
    bound = optimality["lower_bound"]
    if bound is None:
        return ""
    stopped = {"interrupted": "; interrupted", "time limit": "; time limit reached"}.get(optimality["why_stopped"], "")
    if bound > optimality["stations"]:
        return f", below the lower bound {bound} on the candidates of the grid{stopped}"
    if bound == optimality["stations"]:
        return ", proven to be the fewest on these candidates"
    return f" (lower bound {bound} on these candidates{stopped})"


def coverage_words(document: Document, unit: LengthUnit = METRE) -> str:
    """`96.5 % of the 577 m² scannable from valid tripod positions`."""
    figures = document["coverage"]
    reached = reached_percent(figures["fraction_of_achievable"], document["requirements"]["coverage"])
    scannable = area_words(unit, figures["achievable_area_m2"])
    return f"{reached} % of the {scannable} scannable from valid tripod positions"


def total_words(document: Document, unit: LengthUnit = METRE) -> str:
    """`95.9 % of all 580 m² in scope`."""
    figures = document["coverage"]
    of_all = f"{100 * figures['fraction_of_total']:.1f} % of all {area_words(unit, figures['total_area_m2'])}"
    if _scope(document) == Scope.ALL:
        return f"{of_all} in the model, including what no position sees, such as the inside of walls"
    return f"{of_all} in scope"


def set_up_words(document: Document, unit: LengthUnit = METRE) -> str:
    """`94.9 % or more as set up, within 0.1 m of the marks`, of all that is planned; empty where it is not known."""
    shares = [each.get("as_set_up") for each in document["requirements"]["results"] if each["name"] == OVERALL]
    if not shares or shares[0] is None:
        return ""
    reached = reached_percent(shares[0], document["requirements"]["coverage"])
    tolerance_m = float(document["settings"]["set_up_tolerance_m"])
    within = short_length_words(unit, tolerance_m) if unit.is_feet else f"{tolerance_m:g} m"
    return f"{reached} % or more as set up, within {within} of the marks"


def left_out_lines(document: Document, unit: LengthUnit = METRE) -> tuple[str, ...]:
    """Lines on what the share of the scannable area does not count; see `not_planned`."""
    return not_planned(
        unreachable_m2=[room["area_m2"] for room in document["sealed"]],
        scope=_scope(document),
        achievable_m2=document["coverage"]["achievable_area_m2"],
        total_m2=document["coverage"]["total_area_m2"],
        area_by_reason_m2=(document.get("why") or {}).get("area_by_reason_m2", {}),
        area=lambda area_m2: area_words(unit, area_m2),
    )


def _scope(document: Document) -> str:
    return str((document.get("scope") or {"kind": Scope.ALL})["kind"])


def registration_words(document: Document) -> str:
    """How many links count, what they connect, and the one that fails first."""
    registration, required = document["registration"], document["requirements"]
    limits = limits_of(registration)
    counted = [link for link in links_of(registration) if link.counts(limits)]
    n_by_targets = sum(bool(link.targets_m) for link in counted)
    noun = overlap_noun(required["overlap_measure"], required["overlap_of"])
    low = ", or as set up" if any(link.as_set_up for link in counted) else ""
    n_links = len(counted) - n_by_targets
    links = f"{n_links} {'link' if n_links == 1 else 'links'}"
    needs = link_limits_words(limits, noun, registration.get("pre_alignment", ""))
    states = ", with doors open and shut" if limits.doors_change else ""
    by_targets = f" and {n_by_targets} by three targets each" if n_by_targets else ""
    words = f"{links} of {needs}{low}{states}{by_targets}; {_groups_words(registration)}{_joins_words(document)}"
    needed = [link_of(each["bottleneck"]) for each in registration["networks"] if each["bottleneck"] is not None]
    weakest = weakest_link(needed, limits)
    if weakest is None or weakest.targets_m:
        return words
    strength = "" if math.isnan(weakest.strength) else f", strength {weakest.strength:.3f}"
    overlap = f"{reached_percent(weakest.overlap, limits.overlap)} %"
    if limits.probability > 0.0:
        overlap = f"{probability_percent(weakest.probability, limits.probability)} %, overlap {overlap}"
    return f"{words}; weakest: {weakest.a} to {weakest.b}, {overlap}{strength}"


def _groups_words(registration: Document) -> str:
    sizes = [len(each["stations"]) for each in registration["networks"]]
    n_doors = len(registration.get("doors_needed", ()))
    doors = f" while {n_doors} {'door stays' if n_doors == 1 else 'doors stay'} open" if n_doors else ""
    if len(sizes) > 1:
        listed = ", ".join(map(str, sizes[:_MOST_GROUPS])) + (" …" if len(sizes) > _MOST_GROUPS else "")
        return f"{len(sizes)} unconnected groups{doors}, of {listed} stations"
    return f"all stations are connected{doors}" if registration["connected"] else "not all stations are connected"


def _joins_words(document: Document) -> str:
    """`; 2 of 16 stations only join the network (S003, S007), about 4 min`: the price of its joins; empty of none."""
    joining = [station for join in document["registration"].get("joins", ()) for station in join["stations"]]
    if not joining:
        return ""
    listed = ", ".join(joining[:_MOST_GROUPS]) + (" …" if len(joining) > _MOST_GROUPS else "")
    set_up_s, scan_s = seconds_per_station(document)
    minutes = f"{max(1, round(len(joining) * (set_up_s + (scan_s or 0.0)) / 60))} min"
    return (
        f"; {len(joining)} of {stations_words(len(document['stations']))} only "
        f"{'joins' if len(joining) == 1 else 'join'} the network ({listed}), about {minutes}"
        f"{' and the scans' if scan_s is None else ''}"
    )


def seconds_per_station(document: Document) -> tuple[float, float | None]:
    """Seconds to set up, and of a scan; None where nobody knows how long one takes."""
    settings, scan_s = document["settings"], document["scanner"]["seconds_per_scan"]
    return settings["set_up_s"], scan_s if settings["seconds_per_scan"] is None else settings["seconds_per_scan"]


def route_words(route: Document, unit: LengthUnit = METRE) -> str:
    """`48 m between the stations`, and what that leaves out."""
    back = ", and back to the start" if route["returns"] else ""
    return f"{length_words(unit, route['length_m'], 0)} between the stations{back}{not_walked_words(route)}"


def not_walked_words(route: Document | None) -> str:
    """`, without 2 legs that have no way`: what length and time of a route leave out; empty where that is nothing."""
    if route is None:
        return ""
    n_legs, n_stations = route["n_unwalkable"], len(route["left_out"])
    legs = f"{n_legs} {'leg that has' if n_legs == 1 else 'legs that have'} no way" if n_legs else ""
    stations = f"{stations_words(n_stations)} that no way leads to" if n_stations else ""
    left_out = " and ".join(filter(None, (legs, stations)))
    return f", without {left_out}" if left_out else ""


def time_words(time: Document, route: Document | None = None) -> str:
    """How long the day is, as far as that is known. route : what walking is along."""
    parts = (("scanning", time["scanning_s"]), ("setting up", time["set_up_s"]), ("walking", time["walking_s"]))
    listed = ", ".join(f"{_minutes(seconds)} {name}" for name, seconds in parts if seconds is not None)
    listed += not_walked_words(route)
    if time["total_s"] is None:
        return f"{listed}; scan time not known"
    return f"{duration_words(time['total_s'])}: {listed}"


def _minutes(seconds: float) -> str:
    return "less than 1 min" if 0 < seconds < 30 else f"{seconds / 60:.0f} min"


def scanner_words(document: Document, unit: LengthUnit = METRE) -> str:
    """`Leica RTC360, 6 mm at 10 m, range 130 m`."""
    scanner = document["scanner"]
    range_m = scanner["range_max_m"]
    reach = length_words(unit, range_m, 0) if unit.is_feet else f"{range_m:g} m"
    return f"{scanner['title']}, range {reach}"


def beams_words(document: Document) -> str:
    """`45,699,808 beams per scan`, and whether visibility was computed by them."""
    sampled = "patches sampled instead of " if document["settings"]["scan_mode"] == "patches" else ""
    return f"{sampled}{document['scanner']['n_azimuths'] * document['scanner']['n_channels']:,} beams per scan"


def limits_words(required: Document, seen_from: int, unit: LengthUnit) -> str:
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


def north_words(plan: PlanSource) -> str:
    """Which north drawings show, and how it is known; empty where it is not."""
    frame = plan.frame
    if not frame.is_scene:
        return "grid north" if frame.crs else "axis N of the site's coordinates"
    known = frame.true_north_rad is not None
    return f"true north as in the {plan.document['scene']['format'].upper()} file" if known else ""


# ---------------------------------------------------------------------------------------------------- floors
def planned_floors(document: Document) -> list[str]:
    """Ids of the floors that the plan is of: one that is not required counts as seen, whatever is seen of it."""
    wanted = {str(name).casefold() for name in document["requirements"]["floors"]}
    return [
        each["id"]
        for each in document["floors"]
        if not wanted or wanted & {each["id"].casefold(), each["name"].casefold()}
    ]


def required_on(document: Document, floor_id: str) -> float:
    """Return the share of a floor's achievable surface that is required."""
    required = document["requirements"]
    # The results begin with those of the planned floors, each by the name, id or pattern that the client wrote.
    results = dict(zip(planned_floors(document), required["results"], strict=False))  # older plans have none
    return float(results.get(floor_id, {"required": required["coverage"]})["required"])


def floor_percent(document: Document, floor_id: str) -> str:
    """Percentage of a floor that is seen, or `not planned`, or `none` where nothing is scannable; empty: not known."""
    figures = floor_coverage(document, floor_id)
    if floor_id not in planned_floors(document):
        return NOT_PLANNED
    if figures is None:
        return ""
    if figures["achievable_area_m2"] <= 0:
        return "none"
    return reached_percent(float(figures["fraction_of_achievable"]), required_on(document, floor_id))


def floor_coverage(document: Document, floor_id: str) -> Document | None:
    """Figures of a floor's coverage; None where the plan has none."""
    return next((each for each in document["coverage"]["floors"] if each["floor"] == floor_id), None)


def floor_words(document: Document, floor_id: str, unit: LengthUnit = METRE) -> str:
    """`95.7 % of 284 m²`, `not planned` or `nothing scannable`; empty: not known."""
    percent, figures = floor_percent(document, floor_id), floor_coverage(document, floor_id)
    if figures is None or percent == NOT_PLANNED:
        return percent
    scannable = area_words(unit, figures["achievable_area_m2"])
    return "nothing scannable" if percent == "none" else f"{percent} % of {scannable}"


def missed_on(document: Document, floor_id: str) -> float:
    """Surface of a floor that positions see, and none as required, m2; 0 where that is little."""
    figures, by_reason = floor_coverage(document, floor_id), dict[str, float]()
    for each in (document.get("why") or {"unseen_surfaces": ()})["unseen_surfaces"]:
        if each["floor"] == floor_id:
            by_reason[each["reason"]] = by_reason.get(each["reason"], 0.0) + each["area_m2"]
    return 0.0 if figures is None else not_as_required_m2(by_reason, figures["achievable_area_m2"])


def part_words(plan: PlanSource, part: Sequence[FloorSection]) -> str:
    """Name the floors that the sheets are of, and of how many; nothing where they are of the whole plan."""
    if not part:
        return ""
    return f"Only {', '.join(floor.name for floor in part)}: {len(part)} of {len(plan.floors)} floors"


# ---------------------------------------------------------------------------------------------------- figures
def warnings_of(plan: PlanSource) -> list[str]:
    """Warnings of unconnected groups, then those of coordinates, then the others of the plan."""
    return groups_first([*plan.frame.warnings, *(str(line) for line in plan.document.get("warnings", ()))])


def plan_figures(plan: PlanSource, part: Sequence[FloorSection] = ()) -> list[tuple[str, str]]:
    """Names and values. part : the floors that they are of, empty for all; figures of more floors are marked."""
    return [*(_part_figures(plan, part) if part else _whole_figures(plan)), *_basis_figures(plan)]


def _whole_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    document, unit = plan.document, plan.frame.unit
    yield "Stations", f"{len(plan.stations)}{bound_words(document['optimality'])}"
    required = f"required: {100 * document['requirements']['coverage']:g} %"
    words = (coverage_words(document, unit), required, set_up_words(document, unit), total_words(document, unit))
    yield "Coverage", "; ".join(filter(None, words))
    yield from _team_figures(plan)


def _part_figures(plan: PlanSource, part: Sequence[FloorSection]) -> Iterator[tuple[str, str]]:
    document, unit = plan.document, plan.frame.unit
    here = sum(len(plan.stations_of(floor.id)) for floor in part)
    yield "Sheets of", f"{', '.join(floor.name for floor in part)}; the plan has {len(plan.floors)} floors"
    yield "Stations", f"{here} here; {WHOLE_PLAN}: {len(plan.stations)}{bound_words(document['optimality'])}"
    seen = [
        f"{floor.name} {floor_words(document, floor.id, unit)}; required: {100 * required_on(document, floor.id):g} %"
        for floor in part
    ]
    yield "Coverage", "; ".join(seen)
    for name, value in _team_figures(plan):
        yield name, f"{WHOLE_PLAN}: {value}"


def _team_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    """What all floors have together: what is left out, networks, the route, the day."""
    document, unit = plan.document, plan.frame.unit
    for line in left_out_lines(document, unit):
        yield LEFT_OUT, line
    yield "Registration", registration_words(document)
    if document.get("route") is not None:
        yield "Route", route_words(document["route"], unit)
    if document.get("field_time") is not None:
        yield "Field time", time_words(document["field_time"], document.get("route"))


def _basis_figures(plan: PlanSource) -> Iterator[tuple[str, str]]:
    """What the plan was made with: measures, scanner, coordinates, scene."""
    document, unit = plan.document, plan.frame.unit
    scanner, settings, scene, required = (document[key] for key in ("scanner", "settings", "scene", "requirements"))
    yield "Overlap", overlap_defined(required["overlap_measure"], required["overlap_of"])
    mode = f"mode {scanner['mode']}; " if scanner["mode"] else ""
    yield "Scanner", f"{scanner_words(document, unit)}; {mode}{beams_words(document)}"
    yield "Coordinates", plan.frame.crs_line + _accuracy(plan)
    if plan.frame.place:
        yield "Location", f"{plan.frame.place}, roughly: as in the {scene['format'].upper()} file"
    yield "Scene", f"{scene['file']} ({scene['format'].upper()}), SHA-256 {scene['sha256'][:16]}…"
    made = document.get("versions", {}).get("tlsplan")
    largest = f"{area(unit, document['coverage']['max_patch_area_m2']):.3g} {area_unit(unit)}"
    basis = f"{settings['n_patches']:,} patches of at most {largest}, {settings['n_candidates']:,} candidates"
    yield "Computed", basis + (f"; tlsplan {made}" if made else "")


def _accuracy(plan: PlanSource) -> str:
    scale, residuals = plan.frame.horizontal_scale, plan.frame.residuals_m
    words = "" if abs(scale - 1.0) < 1e-7 else f"; grid scale factor {scale:.6f}"
    if not residuals:
        return words
    unit = plan.frame.unit
    largest = unit.text(max(residuals), 3) if unit.is_feet else f"{1000 * max(residuals):.1f} mm"
    return f"{words}; {len(residuals)} control points, largest residual {largest}"
