"""The comparison of a plan with what was scanned as a document, of which `tlsplan compare` prints JSON or words.

Input an `AsScanned` and, where further stations were planned, a `Rescan`; places in scene and site coordinates, metres.
"""

from __future__ import annotations

import math
from typing import Any

from planner_core.as_scanned.comparison import (
    AS_PLANNED_M,
    FATES,
    AsScanned,
    Rescan,
    RescanGain,
    counted_links,
    is_network_met,
    is_network_met_as_required,
    is_part_met,
    registration_of,
)
from planner_core.coverage.percent import reached_share
from planner_core.model import Coverage, FloatArray, Link, LinkLimits, Plan, SiteFrame, Station
from planner_core.planning.live.figures import LeftSurface
from planner_core.planning.live.live_plan import DraftFigures, LivePlan

SCHEMA = "tlsplan-as-scanned/1"


def as_scanned_document(
    live: LivePlan, frame: SiteFrame, coordinates: str, found: AsScanned, rescan: Rescan | None
) -> dict[str, Any]:
    """Return the document; coordinates : which the list came in. Areas in m2, overlap and coverage as fractions."""
    planned, actual = found.planned.plan, found.actual.plan
    limits = planned.settings.requirements.link_limits
    return {
        "schema": SCHEMA,
        "met": found.met,
        "list_coordinates": coordinates,
        "site_coordinates": frame.in_metres().crs_line,
        "as_planned_within_m": AS_PLANNED_M,
        "counts": {fate: len(found.of_fate(fate)) for fate in FATES},
        "stations": [
            {
                "id": each.id,
                "listed_as": each.listed_as or None,
                "fate": each.fate,
                "matched_by": each.matched_by or None,
                "floor": each.floor,
                **_places(frame, each.position_m),
                "moved_m": _numbers(each.moved_m),
                "lost_area_m2": _rounded(each.lost_m2),
            }
            for each in found.stations
        ],
        **_figures(live, found.planned, found.actual),
        "network": {
            "asked": planned.settings.requirements.network,
            "planned_parts": len(registration_of(planned).networks),
            "actual_parts": len(registration_of(actual).networks),
            "met": is_network_met(planned, actual),
            "planned_is_met": is_network_met_as_required(planned),
            "asked_is_met": is_network_met_as_required(actual),
            "networks": [list(each.stations) for each in registration_of(actual).networks],
            "planned_links": len(counted_links(planned)),
            "actual_links": len(counted_links(actual)),
            "min_overlap": limits.overlap,
            "min_probability": limits.probability,
            "links_as_set_up": [_link(link, limits) for link in actual.links if link.as_set_up],
            "lost_links": [_link(link, limits) for link in found.lost_links],
            "new_links": [_link(link, limits) for link in found.new_links],
        },
        "lost_surfaces": [_surface(live, each) for each in found.lost],
        "warnings": list(found.warnings),
        "scan_again": None if rescan is None else _rescan(live, frame, found, rescan),
    }


def _figures(live: LivePlan, was: DraftFigures, now: DraftFigures) -> dict[str, Any]:
    names = {floor.id: floor.name for floor in live.survey.floors}
    floors = zip(live.survey.floors, was.plan.coverage_by_floor, now.plan.coverage_by_floor, strict=True)
    return {
        "coverage": {
            "asked": live.settings.requirements.coverage,
            **_coverages(was.plan.coverage, now.plan.coverage),
            "floors": [
                {"floor": floor.id, "name": names[floor.id], **_coverages(before, after)}
                for floor, before, after in floors
            ],
        },
        "requirements": [
            {
                "name": before.name,
                "asked": before.required,
                "planned": _rounded(before.fraction_of_achievable, 6),
                "actual": _rounded(after.fraction_of_achievable, 6),
                "met": is_part_met(before, after),
                "planned_is_met": before.met,
                "asked_is_met": after.met,
            }
            for before, after in zip(was.plan.requirements, now.plan.requirements, strict=True)
        ],
    }


def _coverages(was: Coverage, now: Coverage) -> dict[str, Any]:
    return {
        "planned": _rounded(was.fraction_of_achievable, 6),
        "actual": _rounded(now.fraction_of_achievable, 6),
        "achievable_area_m2": _rounded(was.achievable_area_m2),
        "planned_area_m2": _rounded(was.covered_area_m2),
        "actual_area_m2": _rounded(now.covered_area_m2),
    }


def _surface(live: LivePlan, surface: LeftSurface) -> dict[str, Any]:
    element = live.survey.scene.elements[surface.element]
    offset_m = live.survey.scene.offset_m
    return {
        "element": live.survey.scene.label(surface.element),
        "kind": element.kind,
        "source_id": element.source_id,
        "room": live.survey.scene.rooms[surface.room].name if surface.room >= 0 else None,
        "floor": surface.floor,
        "area_m2": _rounded(surface.area_m2),
        "pieces": surface.n_pieces,
        "places": [_numbers(piece.centroid_m + offset_m) for piece in surface.pieces],
    }


def _rescan(live: LivePlan, frame: SiteFrame, found: AsScanned, rescan: Rescan) -> dict[str, Any]:
    planned, after = found.planned.plan, rescan.figures.plan
    known = {station.id for station in planned.stations}
    offset_m = live.survey.scene.offset_m
    return {
        "met": rescan.met,
        "fewest_is_proven": _is_proven(rescan.plan),
        "stations": [
            {**_further(each, each.id in known, frame, each.position_m + offset_m), **_purpose(purpose)}
            for each, purpose in zip(rescan.further, rescan.purposes, strict=True)
        ],
        "coverage": _rounded(after.coverage.fraction_of_achievable, 6),
        "network_parts": len(registration_of(after).networks),
        "network": {"met": is_network_met(planned, after), "asked_is_met": is_network_met_as_required(after)},
        "requirements": [
            {
                "name": now.name,
                "actual": _rounded(now.fraction_of_achievable, 6),
                "met": is_part_met(was, now),
                "asked_is_met": now.met,
            }
            for was, now in zip(planned.requirements, after.requirements, strict=True)
        ],
    }


def _purpose(purpose: RescanGain) -> dict[str, Any]:
    return {
        "for_what_was_lost": purpose.for_lost,
        "adds": [{"floor": floor, "area_m2": _rounded(area_m2)} for floor, area_m2 in purpose.gains_m2],
        "joins": [list(part) for part in purpose.joins],
    }


def _is_proven(plan: Plan) -> bool:
    return plan.lower_bound >= len(plan.stations)


def _further(station: Station, is_planned: bool, frame: SiteFrame, scene_m: FloatArray) -> dict[str, Any]:
    height = station.instrument_height_m
    return {
        "id": station.id,
        "floor": station.floor,
        "is_planned": is_planned,
        **_places(frame, scene_m),
        "instrument_height_m": None if math.isnan(height) else _rounded(height),
        "own_area_m2": _rounded(station.own_area_m2),
    }


def _places(frame: SiteFrame, scene_m: FloatArray) -> dict[str, Any]:
    site = {} if frame.is_scene else {"site_position": _numbers(frame.to_site(scene_m))}
    return {"position": _numbers(scene_m), **site}


def _link(link: Link, limits: LinkLimits) -> dict[str, Any]:
    known = not math.isnan(link.probability)
    return {
        "a": link.a,
        "b": link.b,
        "overlap": reached_share(link.overlap, limits.overlap, 6),
        "strength": None if math.isnan(link.strength) else _rounded(link.strength, 6),
        "probability": reached_share(link.probability, limits.probability, 6) if known else None,
    }


def _numbers(values: FloatArray) -> list[float]:
    return [_rounded(value) for value in values.tolist()]


def _rounded(value: float, digits: int = 4) -> float:
    return round(float(value), digits) + 0.0
