"""The order in which stations are visited: floor by floor from below, along a short path in plan.

Straight lines, local frame, metres: nearest neighbour, then 2-opt on the open path. Walls are not looked at; walking
routes through the free space are another stage.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray, Int32Array


def walking_order(position_m: FloatArray, floor: Int32Array) -> list[int]:
    """Order of stations (N, 3) on floors (N,).

    The lowest floor starts at the station with the least x (then y, then z), every other one at the station nearest in
    plan to the last of the floor below.
    """
    order: list[int] = []
    for level in np.unique(floor):
        members = np.flatnonzero(floor == level)
        plan = position_m[members, :2]
        if order:
            start = int(np.argmin(((plan - position_m[order[-1], :2]) ** 2).sum(axis=1)))
        else:
            start = int(np.lexsort((position_m[members, 2], plan[:, 1], plan[:, 0]))[0])
        path = _shorten(plan, _nearest_neighbours(plan, start))
        order.extend(int(members[i]) for i in path)
    return order


def _nearest_neighbours(plan_m: FloatArray, start: int) -> list[int]:
    left = np.ones(plan_m.shape[0], dtype=bool)
    path = [start]
    left[start] = False
    while left.any():
        distance = ((plan_m - plan_m[path[-1]]) ** 2).sum(axis=1)
        nearest = int(np.argmin(np.where(left, distance, np.inf)))
        path.append(nearest)
        left[nearest] = False
    return path


def _shorten(plan_m: FloatArray, path: list[int]) -> list[int]:
    """2-opt: turn round stretches of the path while that shortens it by more than a millimetre. The start stays."""
    distance = np.sqrt(((plan_m[:, None] - plan_m[None]) ** 2).sum(axis=2))
    n = len(path)
    better = True
    while better:
        better = False
        for i in range(n - 2):
            for j in range(i + 2, n):
                a, b, c = path[i], path[i + 1], path[j]
                saved = distance[a, b] - distance[a, c]
                if j + 1 < n:
                    saved += distance[c, path[j + 1]] - distance[b, path[j + 1]]
                if saved > 1e-3:
                    path[i + 1 : j + 1] = path[i + 1 : j + 1][::-1]
                    better = True
    return path
