"""The walk on one floor, out of plan.json: ways, where stairs lead to, what can't be walked, start and end.

Plan coordinates, scene frame, metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from planner_core.export.sheets.building import Building
from planner_core.export.sheets.figures import area_words
from planner_core.model import BoolArray, FloatArray
from planner_core.plan_folder.drawing.marks import DrawnZone, forbidden_zone, zone_words
from planner_core.plan_folder.plan_source import FieldFloor, PlanSource

#: Ground this much below a floor's is still that floor's: steps, ramps, rounding.
_BELOW_M = 0.3
#: An upper floor's ground is searched where the walk is not this much below it: nobody walks under it there.
_CLIMB_M = 1.0
#: A forbidden position this much below a floor is on it.
_ON_GROUND_M = 0.3
#: How exactly: a fifth of a millimetre on paper at 1:50.
_STEP_M = 0.01


@dataclass(frozen=True, eq=False)
class FloorSegment:
    """A stretch of the walk on one floor. points_m : (M, 2). heights_m : (M,). Scene frame.

    arrives, leaves : what to say where it goes over from or to another floor.
    """

    points_m: FloatArray
    heights_m: FloatArray
    arrives: str = ""
    leaves: str = ""

    def parted_at(self, height_m: float) -> tuple[list[FloatArray], list[FloatArray]]:
        """Lines (K, 2) of what of it is up to a height, and of what is above."""
        points_m = np.column_stack([self.points_m, self.heights_m])
        corners_m = [points_m[0]]
        for a_m, b_m in pairwise(points_m):
            if (a_m[2] > height_m) != (b_m[2] > height_m):
                corners_m.append(a_m + (height_m - a_m[2]) / (b_m[2] - a_m[2]) * (b_m - a_m))
            corners_m.append(b_m)
        is_above = [bool(a_m[2] + b_m[2] > 2 * height_m) for a_m, b_m in pairwise(corners_m)]
        parts: tuple[list[FloatArray], list[FloatArray]] = ([], [])
        for above, group in groupby(range(len(is_above)), key=is_above.__getitem__):
            pieces = list(group)
            parts[above].append(np.array(corners_m[pieces[0] : pieces[-1] + 2])[:, :2])
        return parts


@dataclass(frozen=True, eq=False)
class Mark:
    """A place (2,) with a word."""

    at_m: FloatArray
    words: str


def ways_on(plan: PlanSource, floor: FieldFloor, building: Building | None = None) -> list[FloorSegment]:
    """Stretches of the walk on a floor, in the order of the walk.

    building : gives where the upper floor's ground begins; without it a way changes floors at one of its corners.
    """
    route = plan.document.get("route")
    number = {each.id: index for index, each in enumerate(plan.floors)}
    floor_of = {station.id: number[station.floor_id] for station in plan.stations if station.floor_id in number}
    ways: list[FloorSegment] = []
    for leg in [] if route is None else route["legs"]:
        points_m = np.array(leg["points"], dtype=np.float64).reshape(-1, 3)
        if len(points_m) < 2:
            continue
        floors = _floor_of_pieces(plan, points_m, leg["floors"]).tolist()
        # Stairs that end at a station are of the floor below, though the station is not.
        chain = [floor_of.get(leg["from"], floors[0]), *floors, floor_of.get(leg["to"], floors[-1])]
        stretches = _stretches(plan, points_m, chain, building)
        for place, (here, part_m) in enumerate(stretches):
            if here == number[floor.id] and len(part_m) > 1:
                before = stretches[place - 1][0] if place else here
                after = stretches[place + 1][0] if place + 1 < len(stretches) else here
                arrives = _stairs(plan, "from", leg["from"], before) if before != here else ""
                leaves = _stairs(plan, "to", leg["to"], after) if after != here else ""
                ways.append(FloorSegment(part_m[:, :2], part_m[:, 2], arrives, leaves))
    return ways


def _stretches(
    plan: PlanSource, points_m: FloatArray, chain: list[int], building: Building | None
) -> list[tuple[int, FloatArray]]:
    """Cut a leg (M, 3) into stretches of one floor each, (K, 3); K is 1 where one has no length.

    chain : floors of where it starts, of its M - 1 pieces, and of where it ends.
    """
    along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1)))
    corners = [corner for corner in range(len(points_m)) if chain[corner] != chain[corner + 1]]
    cuts_m, last_m = [0.0], 0.0
    for place, corner in enumerate(corners):
        until_m = float(along_m[corners[place + 1]] if place + 1 < len(corners) else along_m[-1])
        found_m = _crossing_m(plan, points_m, along_m, (last_m, until_m), (chain[corner], chain[corner + 1]), building)
        cuts_m.append(float(along_m[corner]) if found_m is None else found_m)
        last_m = max(cuts_m[-1], float(along_m[corner]))
    cuts_m.append(float(along_m[-1]))
    floors = [chain[0], *(chain[corner + 1] for corner in corners)]
    return [
        (floor, _part(points_m, along_m, start_m, end_m))
        for floor, start_m, end_m in zip(floors, cuts_m[:-1], cuts_m[1:], strict=True)
    ]


def _part(points_m: FloatArray, along_m: FloatArray, start_m: float, end_m: float) -> FloatArray:
    """(K, 3) corners of what of a line (M, 3) is between two places along it."""
    inside_m = along_m[(along_m > start_m) & (along_m < end_m)]
    return _at(points_m, along_m, np.unique(np.concatenate([[start_m], inside_m, [end_m]])))


def _at(points_m: FloatArray, along_m: FloatArray, at_m: FloatArray) -> FloatArray:
    """(K, D) places on a line (M, D) so far along it."""
    return np.stack([np.interp(at_m, along_m, axis_m) for axis_m in points_m.T], axis=1)


def _crossing_m(
    plan: PlanSource,
    points_m: FloatArray,
    along_m: FloatArray,
    within_m: tuple[float, float],
    floors: tuple[int, int],
    building: Building | None,
) -> float | None:
    """Find how far along a leg the upper of two floors begins, or ends; None where its ground is not met.

    The leg is straight between its corners and stairs are not: its heights alone are half a metre of way off.
    """
    if building is None:
        return None
    lower, upper = sorted(floors, key=lambda index: plan.floors[index].elevation_m)
    top_m = plan.floors[upper].elevation_m
    least_m = top_m - min(_CLIMB_M, 0.5 * (top_m - plan.floors[lower].elevation_m))
    at_m = np.linspace(*within_m, max(2, math.ceil((within_m[1] - within_m[0]) / _STEP_M) + 1))
    places_m = _at(points_m, along_m, at_m)
    high = places_m[:, 2] > least_m
    high[high] = _is_over(building, upper, places_m[high, :2])
    met = np.flatnonzero(high)
    if not met.size:
        return None
    return float(at_m[met[0] if floors[1] == upper else met[-1]])


def _is_over(building: Building, floor: int, places_m: FloatArray) -> BoolArray:
    """(N,) bool: places (N, 2), scene frame, over the ground of a floor."""
    over = np.zeros(len(places_m), dtype=np.bool_)
    if not len(places_m):
        return over
    scene = building.scene
    corners_m = scene.vertices_m[scene.triangles[building.ground_of_triangle == floor], :2] + scene.offset_m[:2]
    low_m, high_m = places_m.min(axis=0), places_m.max(axis=0)
    near = (corners_m.max(axis=1) >= low_m) & (corners_m.min(axis=1) <= high_m)
    for corner_m in corners_m[near.all(axis=1)]:
        side = np.stack([_side(corner_m[i], corner_m[(i + 1) % 3], places_m) for i in range(3)])
        over |= (side >= 0).all(axis=0) | (side <= 0).all(axis=0)
    return over


def _side(a_m: FloatArray, b_m: FloatArray, places_m: FloatArray) -> FloatArray:
    """(N,) positive where a place is to the left of the line from a to b."""
    (dx, dy), off = b_m - a_m, places_m - a_m
    return np.asarray(dx * off[:, 1] - dy * off[:, 0])


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
    """Say where the walk goes on from stations that no path inside leads from."""
    route = plan.document.get("route")
    at = {station.id: station for station in plan.stations}
    marks = []
    for leg in [] if route is None else route["legs"]:
        if leg["points"]:
            continue
        for here, other, sense in ((leg["from"], leg["to"], "then"), (leg["to"], leg["from"], "from")):
            if here in at and other in at and at[here].floor_id == floor.id:
                words = f"{sense} {at[other].number}, no path inside"
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
        Mark(
            np.array(area["inside"][:2], dtype=np.float64),
            f"not reachable, {area_words(plan.frame.unit, float(area['area_m2']))}",
        )
        for area in plan.document.get("sealed", ())
        if area["floor"] == floor.id
    ]


def zones_on(plan: PlanSource, floor: FieldFloor) -> list[DrawnZone]:
    """Return keep-outs, access areas and forbidden positions of a floor, scene frame."""
    site = plan.document.get("site", {})
    names = ("", floor.id.casefold(), floor.name.casefold())
    zones = [
        DrawnZone(
            np.array([*area["outline"], area["outline"][0]]), zone_words(area["name"], access=bool(area["access"]))
        )
        for area in site.get("keep_out", ())
        if area["floor"].casefold() in names
    ]
    for place in site.get("settled", ()):
        x, y, height_m = place["position"]
        # Without a floor it is of the highest one below it, as in planning.
        below = [each for each in plan.floors if each.elevation_m <= height_m + _ON_GROUND_M] or plan.floors[:1]
        here = place["floor"].casefold() in names[1:] if place["floor"] else below[-1].id == floor.id
        if place["role"] == "forbidden" and here:
            zones.append(forbidden_zone(x, y, place["radius_m"]))
    return zones


def _is_on(plan: PlanSource, floor: FieldFloor, height_m: float) -> bool:
    """Whether ground of that height is nearest to this floor's."""
    nearest = min(plan.floors, key=lambda each: abs(each.elevation_m - height_m))
    return nearest.id == floor.id
