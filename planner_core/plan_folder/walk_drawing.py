"""The walk on a floor's map: ways between stations, their direction, stairs, start and end, rooms without a way in.

Plan -> marks on matplotlib axes in plan metres of the local frame. A walk reads in black and white: lines have a pale
edge, directions are arrow heads, rooms without a way in are hatched.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Floor, Plan
from planner_core.plan_folder import palette

#: Runs shorter than this on paper have no arrow head: between near stations the numbers tell.
_LEAST_ARROW_PX = 55.0
_ARROW_PX = 11.0
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


def draw_walk(axes: Any, plan: Plan, floor_index: int, *, pixel_m: float) -> None:
    """Draw the stretches of the walk on a floor, arrow heads on long ones, and where stairs lead to."""
    for run in runs_on(plan, floor_index):
        plan_m = run.points_m[:, :2]
        draw_way(axes, plan_m)
        if run.length_m >= _LEAST_ARROW_PX * pixel_m:
            axes.fill(
                *_arrow_head(plan_m, _ARROW_PX * pixel_m).T, facecolor=palette.ROUTE, edgecolor="white", zorder=3.2
            )
        stairs = ((run.before, plan_m[0], "from", run.leg_ends[0]), (run.after, plan_m[-1], "to", run.leg_ends[1]))
        for floor, at, sense, stop in stairs:
            if floor is not None:
                _label(axes, at, f"{sense} {_number(plan, stop)}{plan.survey.floors[floor].name}", marker="D")
    _draw_breaks(axes, plan, floor_index)


def draw_way(axes: Any, corners: FloatArray) -> None:
    """Draw a line with corners (M, 2) and a pale edge."""
    axes.plot(*corners.T, color="white", linewidth=4.6, alpha=0.85, zorder=3, solid_joinstyle="round")
    axes.plot(*corners.T, color=palette.ROUTE, linewidth=2.0, zorder=3.1, solid_joinstyle="round")


def _draw_breaks(axes: Any, plan: Plan, floor_index: int) -> None:
    """Say where the walk goes on at stations from which no way inside the model leads to the next."""
    for leg in plan.route.legs if plan.route is not None else ():
        if leg.walkable:
            continue
        for here, other, sense in ((leg.a, leg.b, "then"), (leg.b, leg.a, "from")):
            if here >= 0 and other >= 0 and plan.stations[here].floor == plan.survey.floors[floor_index].id:
                text = f"{sense} {plan.stations[other].order}, no way inside"
                _label(axes, plan.stations[here].position_m[:2], text, marker="", offset=(15, -15))


def _number(plan: Plan, station: int) -> str:
    return f"{plan.stations[station].order}, " if station >= 0 else ""


def draw_ends(axes: Any, plan: Plan, floor: Floor) -> None:
    """Draw start and end of the walk, and further entrances."""
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
            _label(axes, at[:2], label, marker="^")


def draw_sealed(axes: Any, plan: Plan, floor_index: int) -> None:
    """Hatch rooms that nobody can walk into, and say so in them."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    for area in plan.sealed:
        if area.floor != floor_index:
            continue
        (x0, y0), (x1, y1) = area.strips_m[:, 0].T, area.strips_m[:, 1].T
        corners = np.stack([np.stack(c, axis=1) for c in ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))], axis=1)
        codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], len(corners))
        path = Path(corners.reshape(-1, 2), codes)
        hatched = PathPatch(path, facecolor="none", edgecolor=palette.INK, hatch="////", linewidth=0, zorder=2.5)
        axes.add_patch(hatched)
        _label(axes, area.inside_m[:2], f"no way in, {area.area_m2:.0f} m²", marker="", offset=(0, 0))


def _arrow_head(plan_m: FloatArray, size_m: float) -> FloatArray:
    """(3, 2) triangle half-way along a way (M, 2), pointing ahead."""
    step = np.linalg.norm(np.diff(plan_m, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(step))
    piece = int(np.searchsorted(along[1:-1], along[-1] / 2, side="right"))
    ahead = (plan_m[piece + 1] - plan_m[piece]) / max(float(step[piece]), 1e-12)
    at = plan_m[piece] + ahead * (along[-1] / 2 - along[piece])
    across = np.array([-ahead[1], ahead[0]])
    return np.array(
        [at + size_m * ahead, at - size_m * (0.4 * ahead - 0.6 * across), at - size_m * (0.4 * ahead + 0.6 * across)]
    )


def _label(axes: Any, at: FloatArray, text: str, *, marker: str, offset: tuple[int, int] = (13, 9)) -> None:
    """Write beside a place, or on it, with a mark if there is one. offset : in points, clear of a station there."""
    box = {"facecolor": "white", "edgecolor": palette.ROUTE, "linewidth": 0.8, "alpha": 0.9, "pad": 2.0}
    if marker:
        axes.plot(*at, marker=marker, markersize=9, color=palette.ROUTE, markeredgecolor="white", zorder=4.5)
    side = "left" if offset != (0, 0) else "center"
    axes.annotate(
        text, at, xytext=offset, textcoords="offset points", ha=side, va="center", fontsize=10.5, color=palette.INK,
        bbox=box, zorder=4.6,
    )  # fmt: skip
