"""Route and unreachable rooms in plan.json. Plan -> dicts, scene frame, metres."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.model import FloatArray, Leg, Plan, SealedArea

#: Places on the ground to the millimetre: no more is meant.
_MM = 3


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


def sealed_document(plan: Plan) -> list[dict[str, Any]]:
    """Return key `sealed`."""
    return [_sealed(plan, area) for area in plan.sealed]


def _leg(plan: Plan, leg: Leg, ids: list[str]) -> dict[str, Any]:
    return {
        "from": ids[leg.a] if leg.a >= 0 else None,
        "to": ids[leg.b] if leg.b >= 0 else None,
        "length_m": round(leg.length_m, _MM) if leg.walkable else None,
        "floors": [plan.survey.floors[floor].id for floor in leg.floors],
        "points": [_place(plan, point) for point in leg.points_m],
    }


def _sealed(plan: Plan, area: SealedArea) -> dict[str, Any]:
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
