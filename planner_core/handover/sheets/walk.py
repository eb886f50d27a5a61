"""The walk on one floor, out of plan.json: ways, where stairs lead to, what can't be walked, start and end.

Plan coordinates, scene frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.handover.source import FieldFloor, PlanSource
from planner_core.model import FloatArray

#: Ground this much below a floor's is still that floor's: steps, ramps, rounding.
_BELOW_M = 0.3


@dataclass(frozen=True, eq=False)
class Way:
    """A stretch of the walk on one floor. points_m : (M, 2). arrives, leaves : what to say where it meets stairs."""

    points_m: FloatArray
    arrives: str = ""
    leaves: str = ""


@dataclass(frozen=True, eq=False)
class Mark:
    """A place (2,) with a word."""

    at_m: FloatArray
    words: str


def ways_on(plan: PlanSource, floor: FieldFloor) -> list[Way]:
    """Stretches of the walk on a floor, in the order of the walk."""
    route = plan.document.get("route")
    number = {each.id: index for index, each in enumerate(plan.floors)}
    floor_of = {station.id: number[station.floor_id] for station in plan.stations if station.floor_id in number}
    ways: list[Way] = []
    for leg in [] if route is None else route["legs"]:
        points_m = np.array(leg["points"], dtype=np.float64).reshape(-1, 3)
        floors = _floor_of_pieces(plan, points_m, leg["floors"])
        changes = np.flatnonzero(np.diff(floors)) + 1
        for first, end in zip([0, *changes.tolist()], [*changes.tolist(), len(floors)], strict=True):
            here = number[floor.id]
            if end > first and floors[first] == here:
                # Stairs that end at a station are of the floor below, though the station is not.
                before = int(floors[first - 1]) if first else floor_of.get(leg["from"], here)
                after = int(floors[end]) if end < len(floors) else floor_of.get(leg["to"], here)
                arrives = _stairs(plan, "from", leg["from"], before) if before != here else ""
                leaves = _stairs(plan, "to", leg["to"], after) if after != here else ""
                ways.append(Way(points_m[first : end + 1, :2], arrives, leaves))
    return ways


def _floor_of_pieces(plan: PlanSource, points_m: FloatArray, passed: list[str]) -> Any:
    """(M - 1,) floor on which each piece of a leg lies: of those that it passes, the highest not above its lower end.

    Stairs are of the floor below.
    """
    index = {floor.id: number for number, floor in enumerate(plan.floors)}
    there = sorted({index[name] for name in passed if name in index}, key=lambda i: plan.floors[i].elevation_m)
    if not there or len(points_m) < 2:
        return np.full(max(len(points_m) - 1, 0), there[0] if there else 0)
    grounds_m = np.array([plan.floors[i].elevation_m for i in there]) - _BELOW_M
    lower_m = np.minimum(points_m[:-1, 2], points_m[1:, 2])
    return np.array(there)[np.clip(np.searchsorted(grounds_m, lower_m, side="right") - 1, 0, None)]


def _stairs(plan: PlanSource, sense: str, station: str | None, floor: int) -> str:
    number = next((f"{each.number}, " for each in plan.stations if each.id == station), "")
    return f"{sense} {number}{plan.floors[floor].name}"


def breaks_on(plan: PlanSource, floor: FieldFloor) -> list[Mark]:
    """Say where the walk goes on from stations that no way inside leads from."""
    route = plan.document.get("route")
    at = {station.id: station for station in plan.stations}
    marks = []
    for leg in [] if route is None else route["legs"]:
        if leg["points"]:
            continue
        for here, other, sense in ((leg["from"], leg["to"], "then"), (leg["to"], leg["from"], "from")):
            if here in at and other in at and at[here].floor_id == floor.id:
                words = f"{sense} {at[other].number}, no way inside"
                marks.append(Mark(at[here].position_m[:2], words))
    return marks


def ends_on(plan: PlanSource, floor: FieldFloor) -> list[Mark]:
    """Return where the walk begins and ends, where these are places of their own."""
    route = plan.document.get("route")
    if route is None:
        return []
    marks = []
    for key, words in (("start", "start and end" if route["returns"] else "start"), ("end", "end")):
        place = route[key]
        if place is not None and (key == "start" or not route["returns"]) and _is_on(plan, floor, float(place[2])):
            marks.append(Mark(np.array(place[:2], dtype=np.float64), words))
    return marks


def sealed_on(plan: PlanSource, floor: FieldFloor) -> list[Mark]:
    """Return rooms of a floor that nobody can walk into."""
    return [
        Mark(np.array(area["inside"][:2], dtype=np.float64), f"no way in, {float(area['area_m2']):.0f} m²")
        for area in plan.document.get("sealed", ())
        if area["floor"] == floor.id
    ]


def _is_on(plan: PlanSource, floor: FieldFloor, height_m: float) -> bool:
    """Whether ground of that height is nearest to this floor's."""
    nearest = min(plan.floors, key=lambda each: abs(each.elevation_m - height_m))
    return nearest.id == floor.id
