"""Route, unreachable rooms and reasons in plan.json. Plan -> dicts, scene frame, metres.

Surface inside solids is no news to anybody and makes half of most models: only its area is given, as are slivers'.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner_core.model import (
    REASONS,
    BestPosition,
    FloatArray,
    Leg,
    Plan,
    Scene,
    StationReason,
    UnreachableArea,
    UnseenPiece,
    UnseenSurface,
    Why,
)
from planner_core.model.unseen import IN_SOLIDS
from planner_core.plan_folder.plan_model.results import StepSection

#: Places on the ground to the millimetre: no more is meant.
_MM = 3
#: Surfaces of less are not listed.
MIN_LISTED_M2 = 0.01


def rounded(value: float, digits: int = 6) -> float | None:
    """Round to `digits` (micrometres for lengths), so that a file shows no more than is meant; NaN and inf: None."""
    if not math.isfinite(value):
        return None
    return round(float(value), digits) + 0.0  # + 0.0 turns -0.0 into 0.0


def route_document(plan: Plan) -> dict[str, Any] | None:
    """Return key `route`: None where no route was computed."""
    route = plan.route
    if route is None:
        return None
    ids = [station.id for station in plan.stations]
    return {
        "length_m": round(route.length_m, _MM),
        "n_unwalkable": route.n_unwalkable,
        "returns": route.closed,
        "exact": route.exact,
        "start": _place(plan, route.start_m),
        "end": _place(plan, route.end_m),
        "order": [ids[station] for station in route.order.tolist()],
        "left_out": [ids[station] for station in route.left_out],
        "legs": [_leg(plan, leg, ids) for leg in route.legs],
    }


def unreachable_document(plan: Plan) -> list[dict[str, Any]]:
    """Return key `sealed`."""
    return [_unreachable(plan, area) for area in plan.unreachable]


def _leg(plan: Plan, leg: Leg, ids: list[str]) -> dict[str, Any]:
    return {
        "from": ids[leg.a] if leg.a >= 0 else None,
        "to": ids[leg.b] if leg.b >= 0 else None,
        "length_m": round(leg.length_m, _MM) if leg.walkable else None,
        "floors": [plan.survey.floors[floor].id for floor in leg.floors],
        "points": [_place(plan, point) for point in leg.points_m],
    }


def _unreachable(plan: Plan, area: UnreachableArea) -> dict[str, Any]:
    return {
        "floor": plan.survey.floors[area.floor].id,
        "area_m2": round(area.area_m2, _MM),
        "inside": _place(plan, area.inside_m),
        "rectangles": _rectangles(area.strips_m + plan.survey.scene.offset_m[:2]),
    }


def _rectangles(strips_m: FloatArray) -> list[list[list[float]]]:
    """Join strips (K, 2, 2) that are as wide as the one below them and touch it: a room of right angles is a few."""
    rows = [[[float(value) + 0.0 for value in corner] for corner in strip] for strip in np.round(strips_m, _MM)]
    joined: list[list[list[float]]] = []
    above: dict[tuple[float, float, float], list[list[float]]] = {}
    for low, high in sorted(rows, key=lambda row: (row[0][1], row[0][0])):
        below = above.pop((low[0], high[0], low[1]), None)
        if below is None:
            below = [low, high]
            joined.append(below)
        else:
            below[1] = high
        above[low[0], high[0], high[1]] = below
    return joined


def _place(plan: Plan, local_m: FloatArray | None) -> list[float] | None:
    if local_m is None:
        return None
    return [round(float(value), _MM) + 0.0 for value in local_m + plan.survey.scene.offset_m]


def why_document(why: Why, scene: Scene) -> dict[str, Any]:
    """Key `why` of plan.json, as plain dicts and lists.

    `unlisted_area_m2` is the area of what `unseen_surfaces` leaves out, by reason, so that sums can be checked.
    """
    areas = dict(zip(REASONS, why.area_by_reason_m2, strict=True))
    unlisted = dict.fromkeys(REASONS[1:], 0.0)
    listed = []
    for surface in why.unseen:
        if surface.area_m2 >= MIN_LISTED_M2 and surface.reason != REASONS[IN_SOLIDS]:
            listed.append(surface)
        else:
            unlisted[surface.reason] += surface.area_m2
    return {
        "stations": [_station_reason(reason, scene) for reason in why.stations],
        "curve": [StepSection.of(step) for step in why.curve],
        "area_by_reason_m2": {reason: rounded(area) for reason, area in areas.items()},
        "unlisted_area_m2": {reason: rounded(area) for reason, area in unlisted.items()},
        "unseen_surfaces": [_surface(surface, scene) for surface in listed],
    }


def _station_reason(reason: StationReason, scene: Scene) -> dict[str, Any]:
    return {
        "station": reason.station,
        "own_area_m2": rounded(reason.own_area_m2),
        "own_parts": [
            {
                "element": part.element,
                "name": scene.label(part.element),
                "room": _room(part.room, scene),
                "area_m2": rounded(part.area_m2),
            }
            for part in reason.own_parts
        ],
        "linked": list(reason.linked),
    }


def _surface(surface: UnseenSurface, scene: Scene) -> dict[str, Any]:
    element = scene.elements[surface.element]
    return {
        "element": surface.element,
        "name": scene.label(surface.element),
        "kind": element.kind,
        "source_id": element.source_id,
        "room": _room(surface.room, scene),
        "floor": surface.floor,
        "reason": surface.reason,
        "area_m2": rounded(surface.area_m2),
        "n_pieces": surface.n_pieces,
        "pieces": [_piece(piece, scene) for piece in surface.pieces],
        "best_spot": None if surface.best_position is None else _spot(surface.best_position, scene),
    }


def _piece(piece: UnseenPiece, scene: Scene) -> dict[str, Any]:
    low, high = piece.box_m + scene.offset_m
    return {
        "area_m2": rounded(piece.area_m2),
        "centroid": [rounded(value) for value in piece.centroid_m + scene.offset_m],
        "box": [[rounded(value) for value in corner] for corner in (low, high)],
        "patch": piece.patch,
    }


def _spot(spot: BestPosition, scene: Scene) -> dict[str, Any]:
    return {
        "position": [rounded(value) for value in spot.position_m + scene.offset_m],
        "sees_m2": rounded(spot.sees_m2),
        "adds_m2": rounded(spot.adds_m2),
    }


def _room(room: int, scene: Scene) -> dict[str, Any] | None:
    return None if room < 0 else {"name": scene.rooms[room].title, "source_id": scene.rooms[room].source_id}
