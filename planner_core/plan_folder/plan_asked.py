"""What plan.json says of what was asked, of the site, and of how the stations register: plain dicts and lists.

Positions are in the scene frame, metres; angles in radians, as everywhere in plan.json.
"""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from planner_core.model import Asked, Link, PartRequirement, PartResult, Plan, Registration, Role, Site
from planner_core.network.weak_motion import words_by_axes


def requirements_document(plan: Plan) -> dict[str, Any]:
    """Return all that was asked, and in `results` what became of it."""
    asked = plan.settings.requirements
    return {
        "coverage": exact(asked.coverage),
        "overlap": exact(asked.overlap),
        "floors": list(asked.floors),
        "asked": asked_document(asked.asked),
        "seen_from": asked.seen_from,
        "reflectivity": exact(asked.reflectivity),
        "network": asked.network,
        "min_strength": exact(asked.min_strength),
        "parts": [_part(part) for part in asked.parts],
        "results": [_result(result) for result in plan.requirements],
    }


def site_document(site: Site) -> dict[str, Any]:
    """Return where the crew may go, and what was settled beforehand."""
    return {
        "entrances": [_exact_all(place) for place in site.entrances_m],
        "keep_out": [
            {
                "name": area.name,
                "floor": area.floor,
                "access": area.access,
                "outline": [_exact_all(corner) for corner in area.outline_m],
            }
            for area in site.keep_out
        ],
        "settled": [
            {
                "id": station.id,
                "role": station.role,
                "position": _exact_all(station.position_m),
                "floor": station.floor,
                "instrument_height_m": exact(station.instrument_height_m),
                "radius_m": exact(station.radius_m) if station.role == Role.FORBIDDEN else None,
            }
            for station in site.settled
        ],
        "mover_radius_m": exact(site.mover_radius_m),
        "step_m": exact(site.step_m),
        "mover_height_m": exact(site.mover_height_m),
        "opens_doors": site.opens_doors,
        "start": None if site.start_m is None else _exact_all(site.start_m),
        "end": None if site.end_m is None else _exact_all(site.end_m),
        "returns": site.returns,
        "ground_picks": [
            {"point": _exact_all(pick.point_m), "is_ground": pick.is_ground, "floor": pick.floor}
            for pick in site.ground_picks
        ],
    }


def registration_document(plan: Plan) -> dict[str, Any]:
    """Return the links, and the networks that they make."""
    asked = plan.settings.requirements
    return {
        "threshold": exact(asked.overlap),
        "min_strength": exact(asked.min_strength),
        "connected": plan.connected,
        "links": [link_document(link) for link in plan.links],
        **({} if plan.registration is None else _networks(plan.registration)),
    }


def asked_document(asked: Asked) -> dict[str, float | None]:
    """Return limits by name; null: none."""
    return {field.name: exact(getattr(asked, field.name)) for field in fields(asked)}


def link_document(link: Link) -> dict[str, Any]:
    """Return one link."""
    motion = link.weak_motion
    return {
        "a": link.a,
        "b": link.b,
        "overlap": _number(link.overlap, 9),
        "strength": _number(link.strength, 9),
        "weak_axis": words_by_axes(motion),
        "weak_motion": None
        if motion is None
        else {"kind": motion.kind, "direction": [_number(part) for part in motion.direction]},
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


def _part(part: PartRequirement) -> dict[str, Any]:
    return {
        "name": part.name,
        "coverage": exact(part.coverage),
        "asked": asked_document(part.asked),
        "seen_from": part.seen_from,
        "floors": list(part.floors),
        "classes": list(part.classes),
        "zone": [_exact_all(corner) for corner in part.zone],
        "heights": None if part.heights_m is None else _exact_all(part.heights_m),
    }


def _result(result: PartResult) -> dict[str, Any]:
    return {
        "name": result.name,
        "required": exact(result.required),
        "seen_from": result.seen_from,
        "asked": asked_document(result.asked),
        "achievable_area_m2": _number(result.achievable_area_m2),
        "covered_area_m2": _number(result.covered_area_m2),
        "total_area_m2": _number(result.total_area_m2),
        "fraction_of_achievable": _number(result.fraction_of_achievable, 9),
        "met": result.met,
    }


def exact(value: float | None) -> float | None:
    """A number with all its digits: what was asked has to be read back as it was, or another plan comes of it."""
    return None if value is None or not math.isfinite(value) else float(value) + 0.0  # + 0.0 turns -0.0 into 0.0


def _exact_all(values: tuple[float, ...]) -> list[float | None]:
    return [exact(value) for value in values]


def _number(value: float | None, digits: int = 6) -> float | None:
    if value is None or not math.isfinite(value):
        return None
    return round(float(value), digits) + 0.0  # + 0.0 turns -0.0 into 0.0
