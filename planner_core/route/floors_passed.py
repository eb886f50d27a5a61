"""Which floors a way on foot passes: its pieces between corners, cut where one floor goes over into another.

Input a `FreeSpace` and corners (local frame, metres), output corners and the floor of every piece between two of them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from planner_core.model import FloatArray, Int32Array, Int64Array
from planner_core.positions.free_space import FreeSpace

#: A straight walk may run this far above or below the ground: over the nosings of a flight of stairs.
_OFF_GROUND_M = 0.5


def pieces_by_floor(space: FreeSpace, points_m: FloatArray) -> tuple[FloatArray, Int32Array]:
    """Corners (K, 3), floors (K - 1,) of a way with corners (M, 3), M >= 2; one more corner for each change of floor.

    A place over no ground is of the floor before it.
    """
    corners = [points_m[0]]
    floors: list[int] = []
    for a, b in pairwise(points_m):
        n = max(1, int(np.ceil(np.hypot(*(b - a)[:2]) / space.grid.cell_m)))
        middle = a + (b - a) * ((np.arange(n) + 0.5) / n)[:, None]
        floor = _filled(floor_under(space, middle), floors[-1] if floors else -1)
        change = np.flatnonzero(np.diff(floor)) + 1
        corners += [a + (b - a) * (k / n) for k in change.tolist()] + [b]
        floors += floor[np.append(0, change)].tolist()
    return np.array(corners), np.array(floors, dtype=np.int32)


def floor_under(space: FreeSpace, place_m: FloatArray) -> Int32Array:
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


def _filled(floor: Int32Array, before: int) -> Int32Array:
    """Put the last known floor where it is not known; the first known one where none was before."""
    known = np.flatnonzero(floor >= 0)
    if before < 0:
        before = int(floor[known[0]]) if known.size else 0
    last = np.maximum.accumulate(np.where(floor >= 0, np.arange(floor.size), -1))
    return np.where(last >= 0, floor[np.maximum(last, 0)], before).astype(np.int32)
