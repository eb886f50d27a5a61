"""The route through a plan: stations in the order of the walk, and the way from each to the next.

Input a `Reach` and stations (local frame, metres), output a `Route`.

Ways are cut where one floor goes over into another (`pieces_by_floor`). Field time is what a crew needs for a plan, in
seconds: scanning and walking follow from the plan, set-up from experience: levelling, targets, moving the case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from planner_core.model import BoolArray, Crew, FieldTime, FloatArray, Int32Array, Int64Array, Leg, Route
from planner_core.positions.free_space import FreeSpace
from planner_core.positions.local_site import ANYWHERE, Ends
from planner_core.positions.reach import ARM_M, Reach, stand_nodes
from planner_core.positions.walking import Walking
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.route.visiting_order import N_KICKS, visiting_order

#: A start or an end is moved to where one can stand, this far at most in plan and in height: a door's threshold, say.
_END_M = 1.0
_END_HEIGHT_M = 0.6
#: Of more stops each part that ways join is ordered by itself, as if the walk ended there: distances of all from all,
#: most of them infinite, would take gigabytes.
_MOST_STOPS = 2048
#: So many are named in a note; the rest is counted.
_MAX_NAMED = 6
#: A straight walk may run this far above or below the ground: over the nosings of a flight of stairs.
_OFF_GROUND_M = 0.5


def plan_route(
    reach: Reach,
    position_m: FloatArray,
    instrument_height_m: FloatArray,
    floor: Int32Array,
    *,
    ends: Ends = ANYWHERE,
    scanned: BoolArray | None = None,
    order: Int64Array | None = None,
    seed: int = 0,
    n_kicks: int = N_KICKS,
    progress: Progress = silent,
) -> Route:
    """Find a short walk through stations, a storey at a time.

    Parameters
    ----------
    position_m, instrument_height_m, floor
        (N, 3), (N,) and (N,) of the sensors, as in `Candidates`; NaN for a height that is not known.
    ends
        A place that is not on ground that the crew reaches is left out, with a note.
    scanned
        (N,) bool, stations whose scans exist: nobody walks there, and nobody misses them in the walk.
    order
        (N,) int64, all stations in the order in which they are visited, which `Route.order` then is; None: a short one
        is found.

    Notes
    -----
    Stations to which no way leads are not in the walk: given ones may stand in a wall or on a roof. They are last in
    `Route.order`, with those that are `scanned`, and named in `Route.left_out`.
    """
    foot_m = np.asarray(position_m, dtype=np.float64).reshape(-1, 3).copy()
    foot_m[:, 2] -= instrument_height_m
    to_visit = np.flatnonzero(~scanned) if scanned is not None else np.arange(foot_m.shape[0])
    on = to_visit[np.isfinite(foot_m[to_visit]).all(axis=1)]
    on = on[stand_nodes(reach, foot_m[on]) >= 0]
    not_walked = np.setdiff1d(np.arange(foot_m.shape[0]), on)
    ends, notes = ends_on_ground(reach, ends)
    places = [place for place in (ends.start_m, ends.end_m) if place is not None]
    stops_m = np.concatenate([foot_m[on], *(place[None] for place in places)])
    # Ends are of no floor: they come first and last, whatever is around them.
    stop_floor = np.append(floor[on], np.full(len(places), -1)).astype(np.int32)
    start = on.size if ends.start_m is not None else None
    end = on.size + len(places) - 1 if ends.end_m is not None else None
    walking = Walking(reach)
    if stops_m.shape[0] <= _MOST_STOPS:
        parts = [np.arange(stops_m.shape[0])]
    else:
        parts = _parts_in_order(walking.parts(stops_m), stop_floor, start, end)
    ordered, exact = [np.empty(0, dtype=np.int64)], order is None
    if order is not None:
        in_order = np.argsort(np.argsort(order)[on])
        ordered = [np.array([stop for stop in (start, *in_order.tolist(), end) if stop is not None], dtype=np.int64)]
    for stops in parts if order is None else ():
        of_part = visiting_order(
            walking.distances_m(stops_m[stops], progress=progress),
            stop_floor[stops],
            start=_among(stops, start),
            end=_among(stops, end),
            closed=ends.closed and len(parts) == 1,
            seed=seed,
            n_kicks=n_kicks,
        )
        ordered.append(stops[of_part.order])
        exact &= of_part.exact
    found = np.concatenate(ordered)
    walk = np.append(found, found[:1]) if ends.closed and stops_m.shape[0] > 1 else found
    station = np.append(on, np.full(len(places), -1))
    legs = []
    for number, (a, b) in enumerate(pairwise(walk.tolist()), start=1):
        legs.append(_leg(walking, reach, stops_m[a], stops_m[b], int(station[a]), int(station[b])))
        progress(ProgressEvent("route", number, walk.size - 1))
    return Route(
        order=np.concatenate([on[found[found < on.size]], not_walked]).astype(np.int64) if order is None else order,
        legs=tuple(legs),
        length_m=float(sum(leg.length_m for leg in legs if leg.walkable)),
        n_unwalkable=sum(not leg.walkable for leg in legs),
        exact=exact,
        closed=ends.closed,
        start_m=ends.start_m,
        end_m=ends.end_m,
        left_out=tuple(np.setdiff1d(to_visit, on).tolist()),
        notes=notes,
    )


def in_visiting_order(route: Route) -> Route:
    """Return the route of the same stations listed in `route.order`: the first of them is the first to be visited."""
    rank = np.argsort(route.order, kind="stable").tolist()

    def new(station: int) -> int:
        return rank[station] if station >= 0 else -1

    return replace(
        route,
        order=np.arange(route.order.size, dtype=np.int64),
        legs=tuple(replace(leg, a=new(leg.a), b=new(leg.b)) for leg in route.legs),
        left_out=tuple(sorted(new(station) for station in route.left_out)),
    )


def route_warnings(route: Route, ids: Sequence[str]) -> tuple[str, ...]:
    """One line for each thing about the walk that a user should know. ids : of the stations."""
    lines = list(route.notes)
    if route.left_out:
        lines.append(
            f"route: no ground that the crew reaches within {ARM_M:g} m of {_named([ids[i] for i in route.left_out])}, "
            "left out of the route; check these positions, or give entrances"
        )
    broken = [leg for leg in route.legs if not leg.walkable]
    if broken:
        names = [f"{_stop(leg.a, ids, 'start')} to {_stop(leg.b, ids, 'end')}" for leg in broken]
        lines.append(
            f"route: no path inside the model leads from {_named(names)}, length and time of the route leave it out; "
            "check doors and stairs of the model"
        )
    return tuple(lines)


def ends_on_ground(reach: Reach, ends: Ends) -> tuple[Ends, tuple[str, ...]]:
    """Move start and end to where one can stand; leave them out, with a note (a line each), where that is too far."""
    found: list[FloatArray | None] = []
    notes = []
    node = np.flatnonzero(reach.reached_node)
    ground_m = reach.space.position_m(node)
    for name, place in (("start", ends.start_m), ("end", ends.end_m)):
        away = np.full(node.size, np.inf) if place is None else np.hypot(*(ground_m[:, :2] - place[:2]).T)
        if place is not None:
            away[np.abs(ground_m[:, 2] - place[2]) > _END_HEIGHT_M] = np.inf
        nearest = int(np.argmin(away)) if away.size else -1
        if nearest >= 0 and away[nearest] <= _END_M:
            found.append(ground_m[nearest])
            continue
        found.append(None)
        if place is not None:
            at = ", ".join(f"{value:.2f}" for value in place)
            notes.append(
                f"route: the {name} at ({at}), local frame, is not within {_END_M:g} m of ground that the crew "
                "reaches, left out; move it onto a floor"
            )
    return Ends(found[0], found[1], ends.closed), tuple(notes)


def pieces_by_floor(space: FreeSpace, points_m: FloatArray) -> tuple[FloatArray, Int32Array]:
    """Corners (K, 3), floors (K - 1,) of a way with corners (M, 3), M >= 2; one more corner for each change of floor.

    A place over no ground is of the floor before it.
    """
    corners = [points_m[0]]
    floors: list[int] = []
    for a, b in pairwise(points_m):
        n = max(1, int(np.ceil(np.hypot(*(b - a)[:2]) / space.grid.cell_m)))
        middle = a + (b - a) * ((np.arange(n) + 0.5) / n)[:, None]
        floor = _filled(_floor_under(space, middle), floors[-1] if floors else -1)
        change = np.flatnonzero(np.diff(floor)) + 1
        corners += [a + (b - a) * (k / n) for k in change.tolist()] + [b]
        floors += floor[np.append(0, change)].tolist()
    return np.array(corners), np.array(floors, dtype=np.int32)


def _floor_under(space: FreeSpace, place_m: FloatArray) -> Int32Array:
    """(N,) int32 floor of the ground nearest in height to places (N, 3); -1 where there is none within 0.5 m."""
    node = nodes_under(space, place_m)
    out = np.full(node.size, -1, dtype=np.int32)
    out[node >= 0] = space.floor[node[node >= 0]]
    return out


def nodes_under(space: FreeSpace, place_m: FloatArray) -> Int64Array:
    """(N,) int64 node nearest in height below or above places (N, 3); -1 where there is none within 0.5 m."""
    cell = space.grid.index_of(place_m[:, :2])
    inside = ((cell >= 0) & (cell < [space.grid.nx, space.grid.ny])).all(axis=1)
    column = np.where(inside, cell[:, 1] * space.grid.nx + cell[:, 0], -1)
    first, end = np.searchsorted(space.column, [column, column + 1])
    out = np.full(place_m.shape[0], -1, dtype=np.int64)
    best = np.full(place_m.shape[0], _OFF_GROUND_M)
    for layer in range(int((end - first).max(initial=0))):
        there = np.flatnonzero(first + layer < end)
        node = first[there] + layer
        off = np.abs(space.ground_m[node] - place_m[there, 2])
        nearer = off < best[there]
        out[there[nearer]], best[there[nearer]] = node[nearer], off[nearer]
    return out


def field_time(crew: Crew, *, n_scans: int, walk_m: float) -> FieldTime:
    """Time for `n_scans` stations that are still to be scanned and a walk of `walk_m`.

    Where nobody knows how long a scan takes, the time of scanning is not known either.
    """
    scanning_s = None if crew.scan_s is None else n_scans * crew.scan_s
    return FieldTime(scanning_s, n_scans * crew.set_up_s, walk_m / crew.walking_m_per_s)


def _parts_in_order(parts: list[Int64Array], floor: Int32Array, start: int | None, end: int | None) -> list[Int64Array]:
    """Parts of a large site, the lowest first, but for those of the start and of the end."""

    def place(stops: Int64Array) -> tuple[bool, bool, int]:
        at_end, at_start = end in stops, start in stops
        return not at_start, at_end and not at_start, int(floor[stops].min())

    return sorted(parts, key=place)


def _among(stops: Int64Array, stop: int | None) -> int | None:
    at = [] if stop is None else np.flatnonzero(stops == stop).tolist()
    return at[0] if at else None


def _stop(station: int, ids: Sequence[str], end: str) -> str:
    return ids[station] if station >= 0 else f"the {end}"


def _named(names: list[str]) -> str:
    more = f" and {len(names) - _MAX_NAMED} more" if len(names) > _MAX_NAMED else ""
    return ", ".join(names[:_MAX_NAMED]) + more


def _leg(walking: Walking, reach: Reach, from_m: FloatArray, to_m: FloatArray, a: int, b: int) -> Leg:
    path = walking.path(from_m, to_m)
    if path.points_m.shape[0] < 2:
        return Leg(a, b, path.points_m, np.empty(0, dtype=np.int32), path.length_m)
    points_m, floor = pieces_by_floor(reach.space, path.points_m)
    return Leg(a, b, points_m, floor, path.length_m)


def _filled(floor: Int32Array, before: int) -> Int32Array:
    """Put the last known floor where it is not known; the first known one where none was before."""
    known = np.flatnonzero(floor >= 0)
    if before < 0:
        before = int(floor[known[0]]) if known.size else 0
    last = np.maximum.accumulate(np.where(floor >= 0, np.arange(floor.size), -1))
    return np.where(last >= 0, floor[np.maximum(last, 0)], before).astype(np.int32)
