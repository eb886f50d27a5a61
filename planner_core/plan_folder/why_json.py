"""Key `why` of plan.json: reasons of stations and of the unseen. Plan -> dicts; positions in the scene frame.

Surface inside solids is no news to anybody and makes half of most models: only its area is given, as are slivers'.
"""

from __future__ import annotations

import math
from typing import Any

from planner_core.model import REASONS, BestPosition, Scene, StationReason, UnseenPiece, UnseenSurface, Why
from planner_core.model.unseen import IN_SOLIDS
from planner_core.plan_folder.plan_model.results import StepSection

#: Surfaces of less are not listed.
MIN_LISTED_M2 = 0.01


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
        "stations": [_station(reason, scene) for reason in why.stations],
        "curve": [StepSection.to_document(step) for step in why.curve],
        "area_by_reason_m2": {reason: _number(area) for reason, area in areas.items()},
        "unlisted_area_m2": {reason: _number(area) for reason, area in unlisted.items()},
        "unseen_surfaces": [_surface(surface, scene) for surface in listed],
    }


def _station(reason: StationReason, scene: Scene) -> dict[str, Any]:
    return {
        "station": reason.station,
        "own_area_m2": _number(reason.own_area_m2),
        "own_parts": [
            {
                "element": part.element,
                "name": scene.label(part.element),
                "room": _room(part.room, scene),
                "area_m2": _number(part.area_m2),
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
        "area_m2": _number(surface.area_m2),
        "n_pieces": surface.n_pieces,
        "pieces": [_piece(piece, scene) for piece in surface.pieces],
        "best_spot": None if surface.best_position is None else _spot(surface.best_position, scene),
    }


def _piece(piece: UnseenPiece, scene: Scene) -> dict[str, Any]:
    low, high = piece.box_m + scene.offset_m
    return {
        "area_m2": _number(piece.area_m2),
        "centroid": [_number(value) for value in piece.centroid_m + scene.offset_m],
        "box": [[_number(value) for value in corner] for corner in (low, high)],
        "patch": piece.patch,
    }


def _spot(spot: BestPosition, scene: Scene) -> dict[str, Any]:
    return {
        "position": [_number(value) for value in spot.position_m + scene.offset_m],
        "sees_m2": _number(spot.sees_m2),
        "adds_m2": _number(spot.adds_m2),
    }


def _room(room: int, scene: Scene) -> dict[str, Any] | None:
    return None if room < 0 else {"name": scene.rooms[room].title, "source_id": scene.rooms[room].source_id}


def _number(value: float, digits: int = 6) -> float | None:
    """Round to micrometres; NaN and inf: None. As in `plan_json`."""
    return round(float(value), digits) + 0.0 if math.isfinite(value) else None
