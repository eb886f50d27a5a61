"""Rooms and doorways of one floor, read off its free space: where it is roomiest, and where it narrows between rooms.

Input a `FreeSpace` (local frame, metres), output places on the ground. No names are needed, so any format will do.

The distance to what is not walkable rises to the middle of a room and falls to its doors. Every cell is handed
up to the highest around it: those that arrive at one summit make a basin, and two basins meet in a pass. A pass that
is nearly as wide as the narrower of its rooms is no doorway: both are one room.

    summit o-----------pass-----o summit      a section from room to room, height: distance to walls
          / \\          /  \\   / \\
         /   \\________/    \\_/   \\
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.positions.free_space import FreeSpace

#: A pass that has at least this share of its narrower room's distance joins both to one room.
_SAME_ROOM_SHARE = 0.85
#: Passes wider than twice this are no doorways.
_DOORWAY_M = 1.0
#: Passes of two rooms nearer than this are one doorway.
_APART_M = 0.6
#: Ground this near to the floor's is walked as part of it: thresholds, coverings.
_THRESHOLD_M = 0.3
#: The first four of eight directions; the others are their opposites. (dy, dx).
_HALF = ((0, 1), (1, 1), (1, 0), (1, -1))


@dataclass(frozen=True)
class Rooms:
    """centre, doorway : (K,) int64, nodes of the free space: in the middle of rooms, and where two of them meet."""

    centre: Int64Array
    doorway: Int64Array


def find_rooms(space: FreeSpace, floor: int) -> Rooms:
    """Find rooms and doorways of `floor`, in order of cells, those too narrow for the mover left out."""
    node_of_cell = _cells_of_floor(space, floor)
    walkable = node_of_cell >= 0
    if not walkable.any():
        return Rooms(np.empty(0, np.int64), np.empty(0, np.int64))
    away = _distance_cells(walkable)
    cell = np.flatnonzero(walkable)
    basin = _basins(away, cell, walkable.shape)
    sides, height, at = _borders(away, basin, cell, walkable.shape)
    room = _merged(_summits(away, basin, cell), sides, height)
    least, most = (width / space.grid.cell_m for width in (space.mover.radius_m, _DOORWAY_M))
    between = (room[sides[:, 0]] != room[sides[:, 1]]) & (height >= least) & (height <= most)
    spots = _spaced(at[between], height[between], walkable.shape[1], _APART_M / space.grid.cell_m)
    centre = node_of_cell.flat[_centres(away, room[basin[cell]], cell, walkable.shape[1], least)]
    return Rooms(centre=centre[space.on_ground[centre]], doorway=node_of_cell.flat[spots])


def _cells_of_floor(space: FreeSpace, floor: int) -> Int64Array:
    """(ny, nx) int64, the lowest node of each cell on the floor's ground or a threshold, -1 where there is none."""
    out = np.full((space.grid.ny, space.grid.nx), -1, dtype=np.int64)
    here = space.floor == floor
    if not (here & space.on_ground).any():
        return out
    ground_m = float(np.median(space.ground_m[here & space.on_ground]))
    node = np.flatnonzero(here & (space.on_ground | (np.abs(space.ground_m - ground_m) <= _THRESHOLD_M)))
    _, first = np.unique(space.column[node], return_index=True)
    out.flat[space.column[node[first]]] = node[first]
    return out


def _distance_cells(walkable: BoolArray) -> FloatArray:
    """(ny, nx) distance from each cell to the nearest that is not walkable, in cells; what is outside is none."""
    from scipy.ndimage import distance_transform_edt

    return np.asarray(distance_transform_edt(np.pad(walkable, 1)), dtype=np.float64)[1:-1, 1:-1]


def _basins(away: FloatArray, cell: Int64Array, shape: tuple[int, int]) -> Int64Array:
    """(ny * nx,) int64: basin of each walkable cell, -1 elsewhere. Of equal heights the later cell counts as higher."""
    rank = np.full(away.size, -1, dtype=np.int64)
    rank[cell[np.argsort(away.flat[cell], kind="stable")]] = np.arange(cell.size)
    rank = np.pad(rank.reshape(shape), 1, constant_values=-1)
    number = np.pad(np.arange(away.size).reshape(shape), 1, constant_values=-1)
    best, up = rank[1:-1, 1:-1].copy(), number[1:-1, 1:-1].copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            window = (slice(1 + dy, 1 + dy + shape[0]), slice(1 + dx, 1 + dx + shape[1]))
            higher = rank[window] > best
            best[higher], up[higher] = rank[window][higher], number[window][higher]
    to = up.reshape(-1)
    while True:
        further = to[to]
        if np.array_equal(further, to):
            break
        to = further
    out = np.full(away.size, -1, dtype=np.int64)
    out[cell] = np.unique(to[cell], return_inverse=True)[1].reshape(-1)
    return out


def _summits(away: FloatArray, basin: Int64Array, cell: Int64Array) -> FloatArray:
    """(B,) height of each basin's summit."""
    summit = np.zeros(int(basin.max()) + 1)
    np.maximum.at(summit, basin[cell], away.flat[cell])
    return summit


def _borders(
    away: FloatArray, basin: Int64Array, cell: Int64Array, shape: tuple[int, int]
) -> tuple[Int64Array, FloatArray, Int64Array]:
    """Pairs of cells where basins touch: both basins (K, 2), the lower one's height (K,) and cell (K,)."""
    row, column = cell // shape[1], cell % shape[1]
    ends = []
    for dy, dx in _HALF:
        inside = (row + dy < shape[0]) & (column + dx >= 0) & (column + dx < shape[1])
        other = cell[inside] + dy * shape[1] + dx
        apart = (basin[other] >= 0) & (basin[other] != basin[cell[inside]])
        ends.append(np.column_stack([cell[inside][apart], other[apart]]))
    pairs = np.concatenate(ends)
    level = away.flat[pairs]
    lower = pairs[np.arange(pairs.shape[0]), level.argmin(axis=1)]
    return basin[pairs], level.min(axis=1), lower


def _merged(summit: FloatArray, sides: Int64Array, height: FloatArray) -> Int64Array:
    """(B,) int64: room of each basin. The highest pass of every two that touch is looked at, from the highest down."""
    a, b = sides.min(axis=1, initial=summit.size), sides.max(axis=1, initial=-1)
    order = np.lexsort((-height, b, a))
    _, first = np.unique(np.column_stack([a, b])[order], axis=0, return_index=True)
    best = order[first]
    a, b, height = a[best], b[best], height[best]
    room = np.arange(summit.size)
    top = summit.copy()

    def root(basin: int) -> int:
        while room[basin] != basin:
            room[basin] = room[room[basin]]
            basin = int(room[basin])
        return basin

    for k in np.lexsort((b, a, -height)).tolist():
        one, two = root(int(a[k])), root(int(b[k]))
        if one != two and height[k] >= _SAME_ROOM_SHARE * min(top[one], top[two]):
            low, high = min(one, two), max(one, two)
            room[high] = low
            top[low] = max(top[low], top[high])
    return np.array([root(basin) for basin in range(summit.size)], dtype=np.int64)


def _spaced(at: Int64Array, height: FloatArray, n_columns: int, apart: float) -> Int64Array:
    """Cells of the highest passes, in order: none within `apart` of another, or in the same opening by its height."""
    place = np.column_stack([at // n_columns, at % n_columns]).astype(np.float64)
    left = np.lexsort((at, -height))
    kept: list[int] = []
    while left.size:
        one = left[0]
        kept.append(int(at[one]))
        off = np.hypot(*(place[left] - place[one]).T)
        left = left[off > max(apart, float(height[one]))]
    return np.array(sorted(kept), dtype=np.int64)


def _centres(away: FloatArray, room: Int64Array, cell: Int64Array, n_columns: int, least: float) -> Int64Array:
    """Cell of each room's middle: of all as far from walls as its summit, half a cell aside, the one amidst them."""
    _, number = np.unique(room, return_inverse=True)
    number = number.reshape(-1)
    height = away.flat[cell]
    top = np.zeros(int(number.max()) + 1)
    np.maximum.at(top, number, height)
    ridge = np.flatnonzero((height >= top[number] - 0.5) & (top[number] >= least))
    place = np.column_stack([cell[ridge] // n_columns, cell[ridge] % n_columns]).astype(np.float64)
    count = np.maximum(np.bincount(number[ridge], minlength=top.size), 1)
    mean = np.column_stack([np.bincount(number[ridge], weights=place[:, k], minlength=top.size) for k in (0, 1)])
    off = ((place - (mean / count[:, None])[number[ridge]]) ** 2).sum(axis=1)
    order = np.lexsort((cell[ridge], np.round(off, 6), number[ridge]))
    _, first = np.unique(number[ridge][order], return_index=True)
    return np.sort(cell[ridge][order[first]])
