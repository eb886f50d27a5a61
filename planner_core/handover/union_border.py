"""Drawings stage: the border of the area that triangles cover together in plan, overlaps and all. Any frame, metres.

Triangles (K, 3, 2) -> border edges by numbered ends. With all triangles counter-clockwise, the number w of triangles
over a point changes by the net number of sides that one crosses, and the border is where w changes from or to 0:

          w = 1  |  w = 2          a side belongs to the border if w is 0 on one side of it only; w to its left is the
     ------------+-----------      sum of what a ray crosses that starts at its middle and leaves at a right angle
          w = 0  |  w = 1
"""

from __future__ import annotations

import numpy as np

from planner_core.handover.polylines import SAME_POINT_M, cross, nodes, split_at
from planner_core.model import FloatArray, Int64Array

#: Pairs looked at in one go: bounds memory to some 100 MB.
_PAIRS_AT_ONCE = 1_000_000


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

    found = []
    a_m, b_m = places_m[edges[:, 0]], places_m[edges[:, 1]]
    low_m, high_m = np.minimum(a_m, b_m), np.maximum(a_m, b_m)
    at_once = max(1, _PAIRS_AT_ONCE // max(1, len(edges)))
    for first in range(0, len(edges), at_once):
        one = slice(first, first + at_once)
        meet = (low_m[one, None] <= high_m[None]).all(axis=2) & (low_m[None] <= high_m[one, None]).all(axis=2)
        i, j = np.nonzero(meet)
        i += first
        i, j = i[i < j], j[i < j]
        found.append(_crossing_points(a_m[i], b_m[i], a_m[j], b_m[j]))
    crossings_m = np.concatenate(found) if found else np.zeros((0, 2))
    # Crossings at a corner are that corner; several at one place are one.
    away_m, nearest = KDTree(places_m).query(crossings_m, distance_upper_bound=SAME_POINT_M)
    at_corner = np.isfinite(away_m)
    _, new_m = nodes(crossings_m[~at_corner])
    cuts = np.concatenate([edges.reshape(-1), nearest[at_corner], len(places_m) + np.arange(len(new_m))])
    return np.concatenate([places_m, new_m]), np.unique(cuts)


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
    a_m, b_m = places_m[edges[:, 0]], places_m[edges[:, 1]]
    covering = np.zeros((len(edges), 2), dtype=np.int64)
    at_once = max(1, _PAIRS_AT_ONCE // max(1, len(edges)))
    for first in range(0, len(edges), at_once):
        one = slice(first, first + at_once)
        along = (b_m - a_m)[one, None]
        middle_m = ((a_m + b_m) / 2)[one, None]
        from_a, from_b = a_m[None] - middle_m, b_m[None] - middle_m
        u_a, u_b = (from_a * along).sum(axis=2), (from_b * along).sum(axis=2)
        v_a, v_b = cross(along, from_a), cross(along, from_b)
        passes = (u_a > 0).astype(np.int64) - (u_b > 0)
        share = u_a / np.where(passes == 0, 1.0, u_a - u_b)
        ahead = v_a + share * (v_b - v_a) > 0
        # The edge itself starts the ray: what is to the left of it lies ahead of it.
        rows = np.arange(*one.indices(len(edges)))
        ahead[rows - first, rows] = False
        covering[one] = (passes * ahead) @ weight
    return covering
