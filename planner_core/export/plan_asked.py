"""What plan.json says of what was asked, of the site, and of how the stations register: plain dicts and lists.

Positions are in the scene frame, metres; angles in radians, as everywhere in plan.json.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from planner_core.model import Asked, Link, PartRequirement, PartResult, Plan, Registration, Site


def requirements_document(plan: Plan) -> dict[str, Any]:
    """Return all that was asked, and in `results` what became of it."""
    asked = plan.settings.requirements
    return {
        "coverage": _number(asked.coverage),
        "overlap": _number(asked.overlap),
        "floors": list(asked.floors),
        "asked": _asked(asked.asked),
        "seen_from": asked.seen_from,
        "reflectivity": _number(asked.reflectivity),
        "network": asked.network,
        "min_strength": _number(asked.min_strength),
        "parts": [_part(part) for part in asked.parts],
        "results": [_result(result) for result in plan.requirements],
    }


def site_document(site: Site) -> dict[str, Any]:
    """Return where the crew may go, and what was settled beforehand."""
    return {
        "entrances": [_numbers(place) for place in site.entrances_m],
        "keep_out": [
            {
                "name": area.name,
                "floor": area.floor,
                "access": area.access,
                "outline": [_numbers(corner) for corner in area.outline_m],
            }
            for area in site.keep_out
        ],
        "settled": [
            {
                "id": station.id,
                "role": station.role,
                "position": _numbers(station.position_m),
                "floor": station.floor,
                "instrument_height_m": _number(station.instrument_height_m),
                "radius_m": _number(station.radius_m) if station.role == "forbidden" else None,
            }
            for station in site.settled
        ],
        "mover_radius_m": _number(site.mover_radius_m),
        "step_m": _number(site.step_m),
        "mover_height_m": _number(site.mover_height_m),
        "opens_doors": site.opens_doors,
        "start": None if site.start_m is None else _numbers(site.start_m),
        "end": None if site.end_m is None else _numbers(site.end_m),
        "returns": site.returns,
    }


def registration_document(plan: Plan) -> dict[str, Any]:
    """Return the links, and the networks that they make."""
    asked = plan.settings.requirements
    return {
        "threshold": _number(asked.overlap),
        "min_strength": _number(asked.min_strength),
        "connected": plan.connected,
        "links": [link_document(link) for link in plan.links],
        **({} if plan.registration is None else _networks(plan.registration)),
    }


def link_document(link: Link) -> dict[str, Any]:
    """Return one link."""
    return {
        "a": link.a,
        "b": link.b,
        "overlap": _number(link.overlap, 9),
        "strength": _number(link.strength, 9),
        "weak_axis": link.weak_axis,
    }


def _networks(registration: Registration) -> dict[str, Any]:
    return {
        "networks": [
            {
                "stations": list(network.stations),
                "floors": list(network.floors),
                "n_links": network.n_links,
                "bridges": [[link.a, link.b] for link in network.bridges],
                "articulations": list(network.articulations),
                "bottleneck": None if network.bottleneck is None else link_document(network.bottleneck),
                "two_connected": network.two_connected,
            }
            for network in registration.networks
        ],
        "floor_joins": [[link.a, link.b] for link in registration.floor_joins],
        "gaps": [{"networks": list(gap.networks), "best": link_document(gap.best)} for gap in registration.gaps],
    }


def _asked(asked: Asked) -> dict[str, float | None]:
    return {field.name: _number(getattr(asked, field.name), 9) for field in fields(asked)}


def _part(part: PartRequirement) -> dict[str, Any]:
    return {
        "name": part.name,
        "coverage": _number(part.coverage),
        "asked": _asked(part.asked),
        "seen_from": part.seen_from,
        "floors": list(part.floors),
        "classes": list(part.classes),
        "zone": [_numbers(corner) for corner in part.zone],
        "heights": None if part.heights_m is None else _numbers(part.heights_m),
    }


def _result(result: PartResult) -> dict[str, Any]:
    return {
        "name": result.name,
        "required": _number(result.required),
        "seen_from": result.seen_from,
        "asked": _asked(result.asked),
        "achievable_area_m2": _number(result.achievable_area_m2),
        "covered_area_m2": _number(result.covered_area_m2),
        "total_area_m2": _number(result.total_area_m2),
        "fraction_of_achievable": _number(result.fraction_of_achievable, 9),
        "met": result.met,
    }


def _numbers(values: tuple[float, ...]) -> list[float | None]:
    return [_number(value) for value in values]


def _number(value: float | None, digits: int = 6) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return round(float(value), digits) + 0.0  # + 0.0 turns -0.0 into 0.0
