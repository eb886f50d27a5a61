"""Connected pieces: patches of one group that share an edge, or a part of one, are one piece.

Longest-edge bisection leaves hanging corners: where large patches meet small ones, an edge of one is several edges of
the others. So each edge is taken as a stretch of a line, and stretches of one line that overlap join their patches:

      a-----------b          one stretch      0 ......... 1
     / \\         / \\
    +---a--m----b---+        two stretches    0 ... 1/2, 1/2 ... 1

The lines are the mesh's edges, and, inside a triangle, those through corners of patches. Both have exact addresses: the
corners' barycentric coordinates are dyadic numbers. No distance is measured, and no tolerance is needed.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.patch_samples import patch_corner_weights
from planner_core.model import FloatArray, Int32Array, Int64Array, Patches, Scene
from planner_core.scene.array_rows import groups_of_equal_rows
from planner_core.scene.patches import squared_edges


def connected_pieces(scene: Scene, patches: Patches, patch: Int32Array, group: Int64Array) -> Int64Array:
    """(N,) int64 number of the piece that each of patches (N,) is in; pieces hold patches of one group (N,) only.

    Pieces are numbered by their first patch, from 0.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    line, low, high = _stretches(scene, patches, patch)
    owner = np.tile(np.arange(patch.size), 3)
    _, number = groups_of_equal_rows(np.column_stack([group[owner], line]))
    order = np.lexsort((owner, -high, low, number))
    number, low, high, owner = number[order], low[order], high[order], owner[order]
    # The farthest end so far on each line: lines are set two apart, stretches lie in 0 .. 1.
    reach = np.maximum.accumulate(2.0 * number + high)
    joins = np.flatnonzero(2.0 * number[1:] + low[1:] < reach[:-1]) + 1
    pairs = (np.ones(joins.size, dtype=np.int8), (owner[joins - 1], owner[joins]))
    _, piece = connected_components(coo_array(pairs, shape=(patch.size, patch.size)), directed=False)
    _, first, numbered = np.unique(piece, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first, kind="stable"), kind="stable")
    return np.asarray(rank[numbered.ravel()], dtype=np.int64)


def _stretches(scene: Scene, patches: Patches, patch: Int32Array) -> tuple[Int64Array, FloatArray, FloatArray]:
    """The edges of patches (N,): line (3 N, 5), where on it they begin and end, (3 N,); all first edges come first."""
    triangle = (np.searchsorted(patches.first_patch, patch, side="right") - 1).astype(np.int64)
    depth = patches.depth[triangle]
    edges = squared_edges(scene.vertices_m[scene.triangles[triangle]])
    weights = patch_corner_weights(edges, depth, (patch - patches.first_patch[triangle]).astype(np.int32))
    unit = np.exp2(depth.astype(np.float64))  # a bisection halves weights at most: these make them whole numbers
    whole = np.rint(weights * unit[:, None, None]).astype(np.int64)
    lines, lows, highs = [], [], []
    for k in range(3):
        a, b = whole[:, k], whole[:, (k + 1) % 3]
        line, along_a, along_b = _inner_line(triangle, a, b)
        _on_mesh_edges(scene, triangle, a, b, unit.astype(np.int64), line, along_a, along_b)
        lines.append(line)
        lows.append(np.minimum(along_a, along_b) / unit)
        highs.append(np.maximum(along_a, along_b) / unit)
    return np.concatenate(lines), np.concatenate(lows), np.concatenate(highs)


def _inner_line(triangle: Int64Array, a: Int64Array, b: Int64Array) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Address (N, 5) of the lines through points (N, 2) of triangles, and where both points lie along them."""
    step = b - a
    step //= np.gcd(step[:, 0], step[:, 1])[:, None]
    backwards = (step[:, 0] < 0) | ((step[:, 0] == 0) & (step[:, 1] < 0))
    step[backwards] *= -1
    offset = step[:, 0] * a[:, 1] - step[:, 1] * a[:, 0]
    none = np.full(triangle.size, -1, dtype=np.int64)
    level = step[:, 0] == 0
    along = (np.where(level, a[:, 1], a[:, 0]), np.where(level, b[:, 1], b[:, 0]))
    return np.column_stack([triangle, none, step, offset]), *along


def _on_mesh_edges(
    scene: Scene,
    triangle: Int64Array,
    a: Int64Array,
    b: Int64Array,
    unit: Int64Array,
    line: Int64Array,
    along_a: Int64Array,
    along_b: Int64Array,
) -> None:
    """Give stretches on the border of a triangle the address of the mesh's edge, counted from its lower vertex."""
    first, second = (np.column_stack([unit - at[:, 0] - at[:, 1], at]) for at in (a, b))
    for opposite in range(3):
        on = np.flatnonzero((first[:, opposite] == 0) & (second[:, opposite] == 0))
        start, end = (opposite + 1) % 3, (opposite + 2) % 3
        ends = scene.triangles[triangle[on]][:, [start, end]].astype(np.int64)
        from_start = ends[:, 0] < ends[:, 1]
        zero = np.zeros(on.size, dtype=np.int64)
        line[on] = np.column_stack([ends.min(axis=1), ends.max(axis=1), zero, zero, zero])
        corner = np.where(from_start, end, start)  # its weight grows away from the lower vertex
        along_a[on], along_b[on] = first[on, corner], second[on, corner]
