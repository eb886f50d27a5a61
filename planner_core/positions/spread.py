"""Spreading over a walkable surface: the nearest of given cells, from cell to linked cell and never across a wall.

Plan coordinates in cells. A plan of one floor would do with an exact distance transform; storeys lie over each other
and stairs join them, so distances here follow the surface's links, each node handing its nearest cell on to its
neighbours. On a flat floor the result is that of the exact transform, to rounding of the ties; see tests/positions.
"""

from __future__ import annotations

import numpy as np

from planner_core.compiled import compiled
from planner_core.model import FloatArray, Int32Array, Int64Array

#: Steps to the eight neighbours: even numbers along the axes, odd ones diagonal, counter-clockwise from +x.
NEIGHBOURS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], dtype=np.int64)


def spread(
    links: Int32Array, cell: Int64Array, source: Int64Array, place: FloatArray, *, reach_cells: float
) -> tuple[FloatArray, Int64Array]:
    """Find the nearest source of every node within reach.

    Parameters
    ----------
    links
        (N, 8) int32, each node's neighbour by `NEIGHBOURS`; -1 none.
    cell
        (N, 2) int64, plan cells of the nodes.
    source
        (N,) int64, the number of a source that each node starts with; -1 none.
    place
        (M, 2) float64, plan places of the sources, in cells.
    reach_cells
        Sources further than this are not searched for.

    Returns
    -------
    (N,) float64 distance in cells, inf where there is none within reach; (N,) int64 source, -1 where none.
    """
    at = cell.astype(np.float64)
    owner = source.copy()
    best = np.full(owner.size, np.inf)
    seeded = np.flatnonzero(owner >= 0)
    best[seeded] = ((at[seeded] - place[owner[seeded]]) ** 2).sum(axis=1)
    limit = reach_cells * reach_cells + 1e-9
    # Among nodes that are their own nearest source none has anything to offer: the rim of these is where it begins.
    done = np.append(best == 0.0, True)  # the last entry is for no neighbour, -1
    front = seeded[~(done[seeded] & done[links[seeded]].all(axis=1))]
    _hand_on(links, at, place, front, owner, best, limit)
    return np.sqrt(best), owner


@compiled
def _hand_on(
    links: Int32Array,
    at: FloatArray,
    place: FloatArray,
    front: Int64Array,
    owner: Int64Array,
    best: FloatArray,
    limit: float,
) -> None:
    """Hand the nearest sources of nodes `front` on to their neighbours, until none of them is nearer."""
    is_next = np.zeros(owner.size, dtype=np.bool_)
    while front.size:
        for direction in range(links.shape[1]):
            offers = owner[front]
            for nth in range(front.size):
                to, offered = links[front[nth], direction], offers[nth]
                if to < 0:
                    continue
                x, y = at[to, 0] - place[offered, 0], at[to, 1] - place[offered, 1]
                distance = x * x + y * y
                # Of equally near sources the one with the least number stays, whatever the order of visits.
                nearer = distance < best[to] or (distance == best[to] and offered < owner[to])
                if nearer and distance <= limit:
                    best[to], owner[to] = distance, offered
                    is_next[to] = True
        front = np.flatnonzero(is_next)
        is_next[front] = False
