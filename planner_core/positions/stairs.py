"""Places on the stairs, so that a scan there sees both storeys: landings, and flights wide enough for a tripod.

Input a `FreeSpace` (local frame, metres), output places on the ground. Ramps count as landings. Treads are level, too,
and too narrow for feet on one of them: on a flight the legs stand on several.
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.positions.admissibility import TREADS
from planner_core.positions.candidates import is_near
from planner_core.positions.free_space import FreeSpace, components, half_links, spread

#: Ground that differs by less is level.
_LEVEL_M = 0.02
#: What is hardly higher than its floor is no landing: terrain round the house, a doorstep.
_RAISED_M = 0.3
#: No flight is wider; steps of terrain are. A flight has four risers or more above the first treads.
_WIDEST_M, _LEAST_RISE_M = 4.0, 0.6
#: Two legs stand across a flight, the third up or down.
_HALF_STANCE_M = TREADS.ring_radius_m * math.sin(math.pi / 3.0)
#: Lower steps between cells are none of a flight: rounded edges, slopes.
_LEAST_RISER_M = 0.08
#: What is level and larger than this is no tread.
_TREAD_M2 = 4.0


def find_flights(space: FreeSpace, landing: Int64Array, *, apart_m: float) -> Int64Array:
    """Nodes (K,) in the middle of flights of stairs as wide as tripods stand there (`TREADS`).

    They are at least `apart_m` from one another and from nodes on a `landing`, (L,).
    """
    rising = _is_raised(space)
    level = _level_parts(space, rising)
    rising &= np.bincount(level[rising], minlength=space.n_nodes)[level] * space.cell_m2 <= _TREAD_M2
    node, cell_m = np.flatnonzero(rising), space.grid.cell_m
    if not node.size:
        return node
    # The rim of a flight is where nothing goes on at its height: a wall, a well, the edge of the treads beside.
    rim = np.where((space.links < 0).any(axis=1), np.arange(space.n_nodes), -1)
    cells = space.cells()
    reach_cells = 0.5 * _WIDEST_M / cell_m + 1.0
    to_rim, _ = spread(space.links, cells, rim, cells.astype(np.float64), reach_cells=reach_cells)
    room_m = (np.minimum(to_rim[node], reach_cells) + 0.5) * cell_m
    flight = components(space.links, rising)[node]
    widest_m, top_m = np.zeros((2, int(flight.max()) + 1))
    foot_m = np.full(top_m.size, np.inf)
    top_m -= np.inf
    np.maximum.at(widest_m, flight, 2.0 * room_m)
    np.maximum.at(top_m, flight, space.ground_m[node])
    np.minimum.at(foot_m, flight, space.ground_m[node])
    is_flight = (widest_m <= _WIDEST_M) & (top_m - foot_m >= _LEAST_RISE_M)
    wide = is_flight[flight] & (room_m >= _HALF_STANCE_M) & _is_amidst_tread(space, node)
    node = node[wide][np.lexsort((node[wide], -np.round(room_m[wide], 6)))]  # the roomiest first
    place_m, taken_m = space.position_m(node), space.position_m(landing)
    left = ~is_near(place_m, taken_m, apart_m)
    chosen = []
    while left.any():
        each = int(np.argmax(left))
        chosen.append(each)
        left &= np.linalg.norm(place_m - place_m[each], axis=1) >= apart_m
    return np.sort(node[chosen])


def find_landings(space: FreeSpace, *, ring_radius_m: float, apart_m: float) -> Int64Array:
    """Nodes (K,) above their floor's ground round which it is level as far as a tripod's feet reach.

    The middle of each landing is among them; on large ones, so are places on a lattice of `apart_m`.
    """
    from scipy.ndimage import distance_transform_edt

    raised = _is_raised(space)
    label = _level_parts(space, raised)
    cells = space.cells()
    off_ground = np.flatnonzero(raised)
    part, size = np.unique(label[off_ground], return_counts=True)
    # Distances are to the centres of cells without any level ground; it ends half a cell to one and a half before.
    reach = ring_radius_m / space.grid.cell_m + 1.0
    wide = part[size >= np.pi * reach * reach - 2.0 * np.pi * reach]
    order = off_ground[np.argsort(label[off_ground], kind="stable")]
    starts = np.searchsorted(label[order], wide, side="left")
    ends = np.searchsorted(label[order], wide, side="right")
    found = [np.empty(0, np.int64)]
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        node = order[start:end]
        low = cells[node].min(axis=0)
        place = cells[node] - low + 1
        mask = np.zeros(place.max(axis=0) + 2, dtype=bool)
        mask[place[:, 0], place[:, 1]] = True
        room = np.asarray(distance_transform_edt(mask), dtype=np.float64)[place[:, 0], place[:, 1]]
        found.append(_chosen(node, cells[node], room, reach, max(1, round(apart_m / space.grid.cell_m))))
    return np.sort(np.concatenate(found))


def _is_amidst_tread(space: FreeSpace, node: Int64Array) -> BoolArray:
    """(K,) bool: nodes (K,) with no riser in the cells around."""
    around = space.links[node]
    off_m = np.abs(space.ground_m[around] - space.ground_m[node][:, None])
    return np.asarray((np.where(around >= 0, off_m, 0.0) <= _LEAST_RISER_M).all(axis=1))


def _is_raised(space: FreeSpace) -> BoolArray:
    """(N,) bool: nodes above the ground of their floor."""
    return np.asarray(~space.on_ground & (space.ground_m > _floor_heights_m(space)[space.floor] + _RAISED_M))


def _floor_heights_m(space: FreeSpace) -> FloatArray:
    """(F,) median height of each floor's ground, inf where there is none to walk."""
    out = np.full(space.n_floors, np.inf)
    for floor in range(space.n_floors):
        ground_m = space.ground_m[space.on_ground & (space.floor == floor)]
        if ground_m.size:
            out[floor] = np.median(ground_m)
    return out


def _level_parts(space: FreeSpace, among: BoolArray) -> Int64Array:
    """(N,) int64: nodes `among` that level links join share a number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    a, b = half_links(space.links, among)
    level = np.abs(space.ground_m[a] - space.ground_m[b]) <= _LEVEL_M
    a, b = a[level], b[level]
    graph = coo_array((np.ones(a.size, dtype=np.int8), (a, b)), shape=(space.n_nodes,) * 2)
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _chosen(node: Int64Array, cell: Int64Array, room: FloatArray, reach: float, step: int) -> Int64Array:
    """Of one level part's nodes: the roomiest amidst its equals, and those on a lattice, all with room for the feet."""
    fits = room >= reach
    if not fits.any():
        return np.empty(0, np.int64)
    ridge = np.flatnonzero(room >= room.max() - 0.5)
    off = ((cell[ridge] - cell[ridge].mean(axis=0)) ** 2).sum(axis=1)
    middle = ridge[np.lexsort((node[ridge], np.round(off, 6)))[0]]
    on_lattice = fits & ((cell - cell[middle]) % step == 0).all(axis=1)
    chosen: Int64Array = node[on_lattice]
    return chosen
