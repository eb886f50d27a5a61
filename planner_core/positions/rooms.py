"""Rooms and doorways of one floor, read off its free space: where it is roomiest, and where it narrows between rooms.

Input a `FreeSpace` (local frame, metres), output places on the ground. No names are needed, so any format will do.

The distance to what is not walkable rises to the middle of a room and falls to its doors. Every cell is handed
up to the highest around it: those that arrive at one summit make a basin, and two basins meet in a pass. A pass that
is nearly as wide as the narrower of its rooms is no doorway: both are one room.

    summit o-----------pass-----o summit      a section from room to room, height: distance to walls
          / \\          /  \\   / \\
         /   \\________/    \\_/   \\

The middle of doorways is found to the millimetre (`centre_in_doorways`): places from free space are true to a cell, and
a door leaves few. From a place in a doorway, rays to all sides find the shortest chord from jamb to jamb; along the
passage the chord stays as short for the wall's thickness. The middle of both is the doorway's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray, Int32Array, Int64Array
from planner_core.positions.free_space import FreeSpace, number_among

#: A pass that has at least this share of its narrower room's distance joins both to one room.
_SAME_ROOM_SHARE = 0.85
#: Passes wider than twice this are no doorways.
_DOORWAY_M = 1.0
#: Passes of two rooms nearer than this are one doorway.
_APART_M = 0.6
#: Ground this near to the floor's is walked as part of it: thresholds, coverings.
_THRESHOLD_M = 0.3
#: Cells of the box around walkable ones, for each of these, up to which the whole box is held.
_MOST_PER_CELL = 16
#: The first four of eight directions; the others are their opposites. (dy, dx).
_HALF = ((0, 1), (1, 1), (1, 0), (1, -1))
_AROUND = (*_HALF, *((-dy, -dx) for dy, dx in _HALF))
#: Chords examined: directions of half a turn.
_N_CHORDS = 36
#: Where chords are searched for first: at the place, and round it, since it may lie before the door.
_STARTS_M = np.array(
    [
        (0, 0, 0),
        *((r * np.cos(a), r * np.sin(a), 0) for r in (0.08, 0.16, 0.24, 0.32) for a in np.arange(8) * np.pi / 4),
    ]
)
#: Rays from jamb to jamb are cast at these heights over the ground; the nearest of what they meet counts.
_HEIGHTS_M = (0.3, 1.0, 1.6)
#: Half a chord at most; wider is no doorway.
_REACH_M = 1.5
#: The passage is followed this far to either side, in steps.
_ALONG_M = np.arange(-12, 13) * 0.05
#: The chord may widen by this much inside one doorway: a reveal, a casing.
_SAME_WIDTH_M = 0.06
#: Off the axes, so that no ray lies in the plane of a wall.
_OFF_AXIS_RAD = 0.0071
_ANGLES = _OFF_AXIS_RAD + np.arange(_N_CHORDS) * (np.pi / _N_CHORDS)
_DIRECTIONS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
#: The height at which jambs are searched for first, and how near to them no search starts.
_LOOK_M, _WALL_M = 1.0, 0.05


@dataclass(frozen=True)
class Rooms:
    """centre, doorway : (K,) int64, nodes of the free space: in the middle of rooms, and where two of them meet.

    node, room : (C,) int64, nodes of the floor, one a cell, and the number of the room that each is in.
    """

    centre: Int64Array
    doorway: Int64Array
    node: Int64Array
    room: Int64Array


def find_rooms(space: FreeSpace, floor: int) -> Rooms:
    """Find rooms and doorways of `floor`, in order of cells, those too narrow for the carrier left out."""
    node = _nodes_of_floor(space, floor)
    if not node.size:
        none = np.empty(0, np.int64)
        return Rooms(none, none, none, none)
    cells = _Cells(space.column[node], space.grid.nx)
    away = _distance_cells(cells)
    basin = _basins(away, cells)
    sides, height, at = _borders(away, basin, cells)
    room = _merged(_summits(away, basin), sides, height)
    least, most = (width / space.grid.cell_m for width in (space.carrier.radius_m, _DOORWAY_M))
    between = (room[sides[:, 0]] != room[sides[:, 1]]) & (height >= least) & (height <= most)
    spots = _spaced(at[between], height[between], cells, _APART_M / space.grid.cell_m)
    centre = node[_centres(away, room[basin], cells, least)]
    return Rooms(
        centre=centre[space.on_ground[centre]],
        doorway=node[spots],
        node=node,
        room=np.unique(room[basin], return_inverse=True)[1].reshape(-1),
    )


@dataclass(frozen=True)
class _Cells:
    """Walkable cells, (C,) int64 and sorted, of a grid of nx columns; the rest of it takes no memory."""

    column: Int64Array
    nx: int

    def place(self, cell: Int64Array) -> Int64Array:
        """(K, 2) row and column in the grid of cells (K,) by number."""
        return np.column_stack([self.column[cell] // self.nx, self.column[cell] % self.nx])

    @cached_property
    def beside(self) -> Int32Array:
        """(8, C) int32 number of the cell next to each, by `_AROUND`; -1 where it is not walkable."""
        out = np.full((2 * len(_HALF), self.column.size), -1, dtype=np.int32)
        for k, (dy, dx) in enumerate(_HALF):
            across = self.column % self.nx + dx
            inside = np.flatnonzero((across >= 0) & (across < self.nx))
            there, at = number_among(self.column, self.column[inside] + dy * self.nx + dx)
            out[k, inside[there]] = at
            out[k + len(_HALF), at] = inside[there]
        return out


def centre_in_doorways(engine: ScanEngine, ground_m: FloatArray) -> FloatArray:
    """Move places on the ground (K, 3) in plan to the middle of the doorways that they are in.

    A place between whose sides nothing is found stays. Heights are left as they are.
    """
    n_places = ground_m.shape[0]
    if not n_places:
        return ground_m
    start_m = _between_jambs(engine, ground_m)
    width, ahead, behind = _all_chords(engine, start_m, _HEIGHTS_M)
    best = np.arange(n_places), width.argmin(axis=1)
    bounded = np.isfinite(width[best])
    across = _DIRECTIONS[best[1]]
    middle = _in_middle(start_m, across, ahead[best], behind[best])
    passage = np.column_stack([-across[:, 1], across[:, 0]])
    along = np.repeat(middle, _ALONG_M.size, axis=0)
    along[:, :2] += np.repeat(passage, _ALONG_M.size, axis=0) * np.tile(_ALONG_M, n_places)[:, None]
    ahead, behind = _chords(engine, along, np.repeat(across, _ALONG_M.size, axis=0), _HEIGHTS_M)
    shift_m = _middle_of_run((ahead + behind).reshape(n_places, _ALONG_M.size))
    middle[:, :2] += passage * shift_m[:, None]
    ahead, behind = _chords(engine, middle, across, _HEIGHTS_M)
    middle = _in_middle(middle, across, ahead, behind)
    return np.where(bounded[:, None], middle, ground_m)


def _nodes_of_floor(space: FreeSpace, floor: int) -> Int64Array:
    """(C,) int64, the lowest node of each cell on the floor's ground or a threshold."""
    here = space.floor == floor
    if not (here & space.on_ground).any():
        return np.empty(0, np.int64)
    ground_m = float(np.median(space.ground_m[here & space.on_ground]))
    node = np.flatnonzero(here & (space.on_ground | (np.abs(space.ground_m - ground_m) <= _THRESHOLD_M)))
    _, first = np.unique(space.column[node], return_index=True)
    return node[first]


def _distance_cells(cells: _Cells) -> FloatArray:
    """(C,) distance from each cell to the nearest that is not walkable, in cells; what is outside is none."""
    place = cells.place(np.arange(cells.column.size))
    low = place.min(axis=0) - 1
    shape = place.max(axis=0) - low + 2
    if shape.prod() > _MOST_PER_CELL * cells.column.size:
        return _distance_in_tree(place, cells)
    walkable = np.zeros(shape, dtype=np.bool_)
    walkable[tuple((place - low).T)] = True
    return np.asarray(distance_transform_edt(walkable)[tuple((place - low).T)], dtype=np.float64)


def _distance_in_tree(place: Int64Array, cells: _Cells) -> FloatArray:
    """Compute the same for cells at places (C, 2) in a grid that is nearly empty, in memory by their number alone.

    From the nearest, a step towards the cell is walkable: it is one of those that touch walkable ones.
    """
    bare = [place[cells.beside[k] < 0] + np.array(step) for k, step in enumerate(_AROUND)]
    width = cells.nx + 2  # what touches the grid's edge lies outside it
    rim = np.unique(np.concatenate(bare) @ np.array([width, 1]) + 1)
    tree = cKDTree(np.column_stack([rim // width, rim % width - 1]))
    return np.asarray(tree.query(place)[0], dtype=np.float64)


def _basins(away: FloatArray, cells: _Cells) -> Int64Array:
    """(C,) int64: basin of each cell. Of equal heights the later cell counts as higher."""
    rank = np.empty(away.size, dtype=np.int64)
    rank[np.argsort(away, kind="stable")] = np.arange(away.size)
    best, to = rank.copy(), np.arange(away.size)
    for other in cells.beside:
        higher = (other >= 0) & (rank[other] > best)
        best[higher], to[higher] = rank[other[higher]], other[higher]
    while True:
        further = to[to]
        if np.array_equal(further, to):
            break
        to = further
    return np.unique(to, return_inverse=True)[1].reshape(-1)


def _summits(away: FloatArray, basin: Int64Array) -> FloatArray:
    """(B,) height of each basin's summit."""
    summit = np.zeros(int(basin.max()) + 1)
    np.maximum.at(summit, basin, away)
    return summit


def _borders(away: FloatArray, basin: Int64Array, cells: _Cells) -> tuple[Int64Array, FloatArray, Int64Array]:
    """Pairs of cells where basins touch: both basins (K, 2), the lower one's height (K,) and number (K,)."""
    ends = []
    for other in cells.beside[: len(_HALF)]:
        apart = np.flatnonzero((other >= 0) & (basin[other] != basin))
        ends.append(np.column_stack([apart, other[apart]]))
    pairs = np.concatenate(ends)
    level = away[pairs]
    lower = pairs[np.arange(pairs.shape[0]), level.argmin(axis=1)]
    return basin[pairs], level.min(axis=1), lower


def _merged(summit: FloatArray, sides: Int64Array, height: FloatArray) -> Int64Array:
    """(B,) int64: room of each basin. The highest pass of every two that touch is examined, from the highest down."""
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


def _spaced(at: Int64Array, height: FloatArray, cells: _Cells, apart: float) -> Int64Array:
    """Cells of the highest passes, in order: none within `apart` of another, or in the same opening by its height."""
    place = cells.place(at).astype(np.float64)
    tree, left = cKDTree(place), np.ones(at.size, dtype=bool)
    kept: list[int] = []
    for one in np.lexsort((at, -height)).tolist():
        if left[one]:
            kept.append(int(at[one]))
            reach = max(apart, float(height[one]))
            near = np.array(tree.query_ball_point(place[one], reach + 1e-6))
            left[near[np.hypot(*(place[near] - place[one]).T) <= reach]] = False
    return np.array(sorted(kept), dtype=np.int64)


def _centres(away: FloatArray, room: Int64Array, cells: _Cells, least: float) -> Int64Array:
    """Cell of each room's middle: of all as far from walls as its summit, half a cell aside, the one amidst them."""
    _, number = np.unique(room, return_inverse=True)
    number = number.reshape(-1)
    top = np.zeros(int(number.max()) + 1)
    np.maximum.at(top, number, away)
    ridge = np.flatnonzero((away >= top[number] - 0.5) & (top[number] >= least))
    place = cells.place(ridge).astype(np.float64)
    count = np.maximum(np.bincount(number[ridge], minlength=top.size), 1)
    mean = np.column_stack([np.bincount(number[ridge], weights=place[:, k], minlength=top.size) for k in (0, 1)])
    off = ((place - (mean / count[:, None])[number[ridge]]) ** 2).sum(axis=1)
    order = np.lexsort((ridge, np.round(off, 6), number[ridge]))
    _, first = np.unique(number[ridge][order], return_index=True)
    return np.sort(ridge[order[first]])


def _between_jambs(engine: ScanEngine, ground_m: FloatArray) -> FloatArray:
    """(K, 3) the place near each of places (K, 3), and seen from it, that has the shortest chord."""
    n_places, n_starts = ground_m.shape[0], _STARTS_M.shape[0]
    starts = (ground_m[:, None] + _STARTS_M).reshape(-1, 3)
    width, _, _ = _all_chords(engine, starts, (_LOOK_M,))
    length_m = np.linalg.norm(_STARTS_M[1:], axis=1)
    way = np.tile(_STARTS_M[1:] / length_m[:, None], (n_places, 1))
    origins = np.repeat(ground_m + np.array([0.0, 0.0, _LOOK_M]), n_starts - 1, axis=0)
    hits = engine.cast_rays(origins, way, range_max_m=float(length_m.max()))
    hidden = np.zeros((n_places, n_starts), dtype=bool)
    hidden[:, 1:] = hits.range_m.reshape(n_places, -1) <= length_m + _WALL_M
    # Centimetres: of chords about as short, the one from nearest the place counts, whatever its last bits.
    shortest = np.where(hidden, np.inf, np.round(width.min(axis=1), 2).reshape(n_places, n_starts))
    return np.asarray(starts.reshape(n_places, n_starts, 3)[np.arange(n_places), shortest.argmin(axis=1)])


def _all_chords(
    engine: ScanEngine, ground_m: FloatArray, heights_m: tuple[float, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(K, D) lengths of chords in all directions through places (K, 3), and what of them lies ahead and behind."""
    n_places = ground_m.shape[0]
    ahead, behind = _chords(
        engine, np.repeat(ground_m, _N_CHORDS, axis=0), np.tile(_DIRECTIONS, (n_places, 1)), heights_m
    )
    ahead, behind = ahead.reshape(n_places, _N_CHORDS), behind.reshape(n_places, _N_CHORDS)
    return ahead + behind, ahead, behind


def _chords(
    engine: ScanEngine, ground_m: FloatArray, across: FloatArray, heights_m: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """(K,) free lengths ahead and behind of places (K, 3) along unit vectors (K, 2); inf beyond reach."""
    n_places, n_heights = ground_m.shape[0], len(heights_m)
    origins = np.repeat(ground_m, n_heights, axis=0)
    origins[:, 2] += np.tile(np.array(heights_m), n_places)
    direction = np.repeat(np.column_stack([across, np.zeros(n_places)]), n_heights, axis=0)
    lengths = []
    for way in (direction, -direction):
        hits = engine.cast_rays(origins, way, range_max_m=_REACH_M)
        range_m = np.where(np.isfinite(hits.range_m), hits.range_m, np.inf).astype(np.float64)
        lengths.append(range_m.reshape(n_places, n_heights).min(axis=1))
    return lengths[0], lengths[1]


def _in_middle(ground_m: FloatArray, across: FloatArray, ahead_m: FloatArray, behind_m: FloatArray) -> FloatArray:
    """Places (K, 3) moved to the middle of their chords; those whose chord has no end stay."""
    out = ground_m.copy()
    ends = np.isfinite(ahead_m) & np.isfinite(behind_m)
    out[ends, :2] += across[ends] * (0.5 * (ahead_m[ends] - behind_m[ends]))[:, None]
    return out


def _middle_of_run(width_m: FloatArray) -> FloatArray:
    """(K,) shift along the passage to the middle of the run of chords (K, M) about as short as that at its centre."""
    here = _ALONG_M.size // 2
    shift_m = np.zeros(width_m.shape[0])
    for place, widths in enumerate(width_m):
        short = widths <= widths[here] + _SAME_WIDTH_M
        if not short[here]:
            continue
        low = here - int(np.argmin(np.append(short[here::-1], False))) + 1
        high = here + int(np.argmin(np.append(short[here:], False))) - 1
        shift_m[place] = 0.5 * (_ALONG_M[low] + _ALONG_M[high])
    return shift_m
