"""What plan.json says of the walk, of field time and of sealed rooms. Plan -> dicts, scene frame, metres, seconds."""

from __future__ import annotations

from typing import Any

from planner_core.model import FieldTime, FloatArray, Leg, Plan, SealedArea

#: Places on the ground to the millimetre, seconds to the tenth: no more is meant.
_MM = 3
_TENTH = 1


def route_document(plan: Plan) -> dict[str, Any] | None:
    """Return key `route`: None where no walk was looked for."""
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


def field_time_document(time: FieldTime | None) -> dict[str, Any] | None:
    """Return key `field_time`: None where no walk was looked for."""
    if time is None:
        return None
    parts = {"scanning_s": time.scanning_s, "set_up_s": time.set_up_s, "walking_s": time.walking_s}
    parts["total_s"] = time.total_s
    return {name: None if seconds is None else round(seconds, _TENTH) for name, seconds in parts.items()}


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
    }


def _place(plan: Plan, local_m: FloatArray | None) -> list[float] | None:
    if local_m is None:
        return None
    return [round(float(value), _MM) + 0.0 for value in local_m + plan.survey.scene.offset_m]
