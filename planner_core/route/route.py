"""The route through a plan: stations in the order of the walk, and the way from each to the next.

Input a `Reach` and places on the ground (local frame, metres), output a `Route`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner_core.ground.reach import Reach
from planner_core.ground.walking import Walking, WalkingPath
from planner_core.model import FloatArray, Int32Array, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.route.order import N_KICKS, visiting_order


@dataclass(frozen=True)
class Route:
    """A walk through stations. order : (N,) int64, stations in the order of visits.

    legs : ways from stop to stop: to the first station from the start and from the last to the end where these were
    given, and back in a closed walk. A leg that can't be walked has no points and infinite length; it does not count
    for `length_m` but for `n_unwalkable`. exact : the order is the shortest for the distances between the stations.
    """

    order: Int64Array
    legs: tuple[WalkingPath, ...]
    length_m: float
    n_unwalkable: int
    exact: bool


def find_route(
    reach: Reach,
    ground_m: FloatArray,
    floor: Int32Array,
    *,
    start_m: FloatArray | None = None,
    end_m: FloatArray | None = None,
    closed: bool = False,
    seed: int = 0,
    n_kicks: int = N_KICKS,
    progress: Progress = silent,
) -> Route:
    """Find a short walk through stations with feet at (N, 3) on floors (N,), a storey at a time.

    start_m, end_m : (3,) places on the ground where the walk starts and ends, such as entrances. closed : it ends where
    it starts.

    Raises
    ------
    RequirementError
        An end of a closed walk, see `visiting_order`.
    """
    ground_m = np.asarray(ground_m, dtype=np.float64).reshape(-1, 3)
    n = ground_m.shape[0]
    given = [np.asarray(place, dtype=np.float64).reshape(1, 3) for place in (start_m, end_m) if place is not None]
    stops_m = np.concatenate([ground_m, *given])
    stop_floor = np.append(floor, np.full(len(given), -1)).astype(np.int32)
    start = n if start_m is not None else None
    end = n + len(given) - 1 if end_m is not None else None
    walking = Walking(reach)
    distance_m = walking.distances_m(stops_m, progress=progress)
    found = visiting_order(distance_m, stop_floor, start=start, end=end, closed=closed, seed=seed, n_kicks=n_kicks)
    walk = np.append(found.order, found.order[:1]) if closed and stops_m.shape[0] > 1 else found.order
    legs = []
    for number, (a, b) in enumerate(pairwise(walk.tolist()), start=1):
        legs.append(walking.path(stops_m[a], stops_m[b]))
        progress(ProgressEvent("route", number, walk.size - 1))
    return Route(
        order=found.order[found.order < n],
        legs=tuple(legs),
        length_m=float(sum(leg.length_m for leg in legs if np.isfinite(leg.length_m))),
        n_unwalkable=found.n_unwalkable,
        exact=found.exact,
    )
