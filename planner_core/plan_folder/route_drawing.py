"""The walk on a floor's map: ways between stations, their direction, stairs, start and end, rooms without a way in.

Plan -> lines and words in plan metres of the local frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Floor, Plan
from planner_core.plan_folder.drawing.canvas import Canvas
from planner_core.plan_folder.drawing.hatching import Family, spans_of_rings
from planner_core.plan_folder.drawing.marks import DrawnZone, draw_route, forbidden_zone, zone_words
from planner_core.positions.local_site import index_of_floor, local_site

Mark = tuple[FloatArray, str]
"""A place (2,) in plan, and what is written there."""
#: Places of an entrance at another height are on another floor.
_SAME_FLOOR_M = 0.6


@dataclass(frozen=True)
class Run:
    """A stretch of the walk on one floor. points_m : (M, 3), local. before, after : floors it comes from and goes to.

    None: it begins or ends at a stop. leg_ends : stations that the leg leads from and to, -1 for none.
    """

    points_m: FloatArray
    before: int | None
    after: int | None
    leg_ends: tuple[int, int]

    @property
    def length_m(self) -> float:
        """Along the way."""
        return float(np.linalg.norm(np.diff(self.points_m, axis=0), axis=1).sum())


def runs_on(plan: Plan, floor_index: int) -> list[Run]:
    """Stretches of the walk that lie on a floor, in the order of the walk."""
    runs = []
    for leg in plan.route.legs if plan.route is not None else ():
        change = np.flatnonzero(np.diff(leg.floor)) + 1
        starts, ends = np.append(0, change), np.append(change, leg.floor.size)
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            if end > start and leg.floor[start] == floor_index:
                before = int(leg.floor[start - 1]) if start else None
                after = int(leg.floor[end]) if end < leg.floor.size else None
                runs.append(Run(leg.points_m[start : end + 1], before, after, (leg.a, leg.b)))
    return runs


def draw_runs(canvas: Canvas, ways: Sequence[FloatArray]) -> None:
    """Draw stretches of the walk (M, 2), millimetres."""
    draw_route(canvas, list(ways), list(ways), [])


def stairs_on(plan: Plan, floor_index: int) -> Iterator[Mark]:
    """Say where the walk goes over from and to other floors."""
    for run in runs_on(plan, floor_index):
        for floor, at, sense, stop in (
            (run.before, run.points_m[0], "from", run.leg_ends[0]),
            (run.after, run.points_m[-1], "to", run.leg_ends[1]),
        ):
            if floor is not None:
                number = f"{plan.stations[stop].order}, " if stop >= 0 else ""
                yield at[:2], f"{sense} {number}{plan.survey.floors[floor].name}"


def breaks_on(plan: Plan, floor_index: int) -> Iterator[Mark]:
    """Say where the walk goes on at stations from which no path inside the model leads to the next."""
    for leg in plan.route.legs if plan.route is not None else ():
        if leg.walkable:
            continue
        for here, other, sense in ((leg.a, leg.b, "then"), (leg.b, leg.a, "from")):
            if here >= 0 and other >= 0 and plan.stations[here].floor == plan.survey.floors[floor_index].id:
                yield plan.stations[here].position_m[:2], f"{sense} {plan.stations[other].order}, no path inside"


def ends_on(plan: Plan, floor: Floor) -> Iterator[Mark]:
    """Name start and end of the walk, and further entrances."""
    offset_m = plan.survey.scene.offset_m
    marks = [("entrance", np.asarray(place) - offset_m) for place in plan.settings.site.entrances_m]
    if plan.route is not None:
        ends = [("start", plan.route.start_m), ("end", plan.route.end_m)]
        name = "start and end" if plan.route.closed else "start"
        placed = [(name if label == "start" else label, at) for label, at in ends if at is not None]
        # An entrance at the start is the start.
        marks = [m for m in marks if all(np.hypot(*(m[1] - at)[:2]) > 1.0 for _, at in placed)] + placed
    for label, at in marks:
        if abs(at[2] - floor.elevation_m) <= _SAME_FLOOR_M:
            yield at[:2], label


def sealed_on(plan: Plan, floor_index: int) -> Iterator[Mark]:
    """Say which rooms nobody can walk into."""
    for area in plan.sealed:
        if area.floor == floor_index:
            yield area.inside_m[:2], f"not reachable, {area.area_m2:.0f} m²"


def sealed_hatch_m(plan: Plan, floor_index: int, step_m: float) -> list[FloatArray]:
    """(2, 2) lines that hatch the rooms that nobody can walk into, `step_m` apart."""
    family = Family(step_m, np.pi / 4)
    corners_m = [
        np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        for area in plan.sealed
        if area.floor == floor_index
        for (x0, y0), (x1, y1) in area.strips_m
    ]
    return list(spans_of_rings([corners_m], family).lines(family))


def zones_on(plan: Plan, floor_index: int) -> Iterator[DrawnZone]:
    """Yield keep-outs, access areas and forbidden positions of a floor, local frame."""
    floors, site, offset_m = plan.survey.floors, plan.settings.site, plan.survey.scene.offset_m[:2]
    for area in site.keep_out:
        if not area.floor or index_of_floor(floors, area.floor) == floor_index:
            outline_m = np.array([*area.outline_m, area.outline_m[0]]) - offset_m
            yield DrawnZone(outline_m, zone_words(area.name, access=area.access))
    for place in local_site(plan.survey, site).forbidden:
        if place.floor == floor_index:
            x, y = place.plan_m.tolist()
            yield forbidden_zone(x, y, place.radius_m)
