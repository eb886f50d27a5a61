"""Landings: level ground on the stairs that is wide enough for a tripod, so that a scan there sees both storeys.

Input a `FreeSpace` (local frame, metres), output places on the ground. Treads are level too, and too narrow.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.positions.free_space import FreeSpace, half_links

#: Ground that differs by less is level.
_LEVEL_M = 0.02
#: What is hardly higher than its floor is no landing: terrain round the house, a doorstep.
_RAISED_M = 0.3


def find_landings(space: FreeSpace, *, ring_radius_m: float, apart_m: float) -> Int64Array:
    """Nodes (K,) above their floor's ground round which it is level as far as a tripod's feet reach.

    The middle of each landing is among them; on large ones, so are places on a lattice of `apart_m`.
    """
    from scipy.ndimage import distance_transform_edt

    raised = ~space.on_ground & (space.ground_m > _floor_heights_m(space)[space.floor] + _RAISED_M)
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
