"""Drawings stage: the border of the area that triangles cover together in plan, overlaps and all. Any frame, metres.

Triangles (K, 3, 2) -> border edges by numbered ends. With all triangles counter-clockwise, the number w of triangles
over a point changes by the net number of sides that one crosses, and the border is where w changes from or to 0:

          w = 1  |  w = 2          a side belongs to the border if w is 0 on one side of it only; w to its left is the
     ------------+-----------      sum of what a ray crosses that starts at its middle and leaves at a right angle
          w = 0  |  w = 1
"""

from __future__ import annotations

import numpy as np

from planner_core.export.polylines import SAME_POINT_M, cross, nodes, split_at
from planner_core.model import FloatArray, Int64Array

#: Pairs looked at in one go: bounds memory to some 100 MB.
_PAIRS_AT_ONCE = 1_000_000
#: Rays go this way: hardly any side of a building is parallel to it.
_RAY_RAD = 0.739
#: Cells that sides are looked up by: as many times as long as a middling side, and most of them in a row.
_CELL_SIDES = 2.0
_MOST_CELLS = 4096


def union_border(corners_m: FloatArray, without_m: FloatArray | None = None) -> tuple[Int64Array, FloatArray]:
    """Find the border of the area that triangles (K, 3, 2) of any winding cover together.

    Parameters
    ----------
    without_m
        (L, 3, 2) triangles whose area is taken away; None: nothing is.

    Returns
    -------
    edges : (E, 2) int64 into places, the area to the left of each; at every place as many begin as end.
    places_m : (N, 2) float64.
    """
    taken_m = np.zeros((0, 3, 2)) if without_m is None else without_m
    node, places_m = nodes(np.concatenate([corners_m, taken_m]).reshape(-1, 2))
    turns = node.reshape(-1, 3)
    a, b, c = (places_m[turns[:, corner]] for corner in range(3))
    clockwise = cross(b - a, c - a) < 0
    turns[clockwise] = turns[clockwise][:, ::-1]
    # Two numbers are counted: of the triangles, and of those taken away.
    one = np.repeat(np.array([[1, 0], [0, 1]]), [len(corners_m), len(taken_m)], axis=0)
    sides = np.concatenate([turns[:, [0, 1]], turns[:, [1, 2]], turns[:, [2, 0]]])
    edges, weight = _net(sides, np.tile(one, (3, 1)))
    # Sides of neighbours may share a part only, and those of overlapping triangles cross: cut them at both.
    places_m, cuts = _with_crossings(edges, places_m)
    pieces, of = split_at(edges, cuts, places_m)
    edges, weight = _net(pieces, weight[of])
    left = _covering_left(edges, weight, places_m)
    right = left - weight
    inside_left, inside_right = ((w[:, 0] > 0) & (w[:, 1] <= 0) for w in (left, right))
    border = np.concatenate([edges[inside_left & ~inside_right], edges[inside_right & ~inside_left][:, ::-1]])
    return border, places_m


def _net(edges: Int64Array, weight: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Distinct edges (K, 2), and what is left of their weights (K, 2) when opposites cancel; without those of none."""
    forward = edges[:, :1] < edges[:, 1:]
    distinct, of = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.zeros((len(distinct), 2), dtype=np.int64)
    np.add.at(balance, of.reshape(-1), np.where(forward, weight, -weight))
    kept = balance.any(axis=1) & (distinct[:, 0] != distinct[:, 1])
    return distinct[kept], balance[kept]


def _with_crossings(edges: Int64Array, places_m: FloatArray) -> tuple[FloatArray, Int64Array]:
    """Places and, behind them, where edges cross inside of both; and the numbers of all where edges may be cut."""
    from scipy.spatial import KDTree

    a_m, b_m = places_m[edges[:, 0]], places_m[edges[:, 1]]
    i, j = _near_pairs(a_m, b_m)
    crossings_m = _crossing_points(a_m[i], b_m[i], a_m[j], b_m[j])
    # Crossings at a corner are that corner; several at one place are one.
    away_m, nearest = KDTree(places_m).query(crossings_m, distance_upper_bound=SAME_POINT_M)
    at_corner = np.isfinite(away_m)
    _, new_m = nodes(crossings_m[~at_corner])
    cuts = np.concatenate([edges.reshape(-1), nearest[at_corner], len(places_m) + np.arange(len(new_m))])
    return np.concatenate([places_m, new_m]), np.unique(cuts)


def _near_pairs(a_m: FloatArray, b_m: FloatArray) -> tuple[Int64Array, Int64Array]:
    """Pairs i < j of segments ab (N, 2 each) that pass the same cell of a grid: all that cross are among them."""
    if not len(a_m):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    length_m = np.hypot(*(b_m - a_m).T)
    low_m = np.minimum(a_m, b_m).min(axis=0)
    size_m = float((np.maximum(a_m, b_m).max(axis=0) - low_m).max())
    cell_m = max(_CELL_SIDES * float(np.median(length_m)), size_m / _MOST_CELLS, SAME_POINT_M)
    # Long segments are entered piece by piece, each with the up to four cells of its box.
    n_pieces = np.floor(length_m / cell_m).astype(np.int64) + 1  # shorter than a cell, each
    segment, piece = _counted(n_pieces)
    share = np.stack([piece, piece + 1], axis=1) / n_pieces[segment, None]
    along_m = a_m[segment, None] + share[:, :, None] * (b_m - a_m)[segment, None] - low_m
    cells = np.floor(along_m / cell_m).astype(np.int64)
    x, y = np.meshgrid([0, 1], [0, 1])
    cell = np.stack([cells[:, x.ravel(), 0], cells[:, y.ravel(), 1]], axis=2).reshape(-1, 2)
    entries = np.unique(np.column_stack([cell, np.repeat(segment, 4)]), axis=0)
    _, start, count = np.unique(entries[:, :2], axis=0, return_index=True, return_counts=True)
    # Each entry with those behind it in its cell.
    behind = np.repeat(start + count, count) - np.arange(len(entries)) - 1
    first, step = _counted(behind)
    pairs = np.unique(np.column_stack([entries[first, 2], entries[first + 1 + step, 2]]), axis=0)
    return pairs[:, 0], pairs[:, 1]


def _counted(counts: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Rows 0, 1 ... each as often as it counts, and which time it is: [2, 0, 1] -> [0, 0, 2], [0, 1, 0]."""
    row = np.repeat(np.arange(len(counts), dtype=np.int64), counts)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)


def _crossing_points(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(M, 2) where segments ab and cd (N, 2 each) cross, each inside the other."""
    turn = cross(b - a, d - c)
    parallel = turn == 0
    turn = np.where(parallel, 1.0, turn)
    s, t = cross(c - a, d - c) / turn, cross(c - a, b - a) / turn
    inside = ~parallel & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    points: FloatArray = a[inside] + s[inside, None] * (b - a)[inside]
    return points


def _covering_left(edges: Int64Array, weight: Int64Array, places_m: FloatArray) -> Int64Array:
    """(E, 2) numbers of triangles over the left side of each edge, next to its middle."""
    if not len(edges):
        return np.zeros((0, 2), dtype=np.int64)
    cos, sin = np.cos(_RAY_RAD), np.sin(_RAY_RAD)
    turned_m = (places_m - places_m[edges[0, 0]]) @ np.array([[cos, -sin], [sin, cos]])
    a, b = turned_m[edges[:, 0]], turned_m[edges[:, 1]]
    middle = (a + b) / 2
    # Edges in the order of the strips across the rays that they pass; a ray asks those of its strip alone.
    low, high = np.minimum(a, b)[:, 1], np.maximum(a, b)[:, 1]
    strip_m = max(float(np.median(high - low)) / 4, float(high.max() - low.min()) / _MOST_CELLS, SAME_POINT_M)
    first = np.floor((low - low.min()) / strip_m).astype(np.int64)
    edge, step = _counted(np.floor((high - low.min()) / strip_m).astype(np.int64) - first + 1)
    strip = first[edge] + step
    order = np.argsort(strip, kind="stable")
    edge, strip = edge[order], strip[order]
    asked = np.floor((middle[:, 1] - low.min()) / strip_m).astype(np.int64)
    start = np.searchsorted(strip, asked, side="left")
    count = np.searchsorted(strip, asked, side="right") - start
    ahead = np.zeros((len(edges), 2), dtype=np.int64)
    for rows in np.split(np.arange(len(edges)), np.flatnonzero(np.diff(np.cumsum(count) // _PAIRS_AT_ONCE)) + 1):
        owner, step = _counted(count[rows])
        ray, met = rows[owner], edge[start[rows][owner] + step]
        y = middle[ray, 1]
        passes = (b[met, 1] > y).astype(np.int64) - (a[met, 1] > y)
        rise = np.where(passes == 0, 1.0, b[met, 1] - a[met, 1])
        x = a[met, 0] + (y - a[met, 1]) / rise * (b[met, 0] - a[met, 0])
        counts = passes * ((x > middle[ray, 0]) & (met != ray))
        np.add.at(ahead, ray, counts[:, None] * weight[met])
    # A ray leaves its edge to the left where that one falls away from it; else the edge's own weight is left of it.
    leaves_left = b[:, 1] < a[:, 1]
    return np.asarray(np.where(leaves_left[:, None], ahead, ahead + weight))
