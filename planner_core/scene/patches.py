"""Patches, the unit of coverage: addresses of the parts of triangles bisected at their longest edge.

Input a `Scene` (local frame, metres), output `Patches`; patch = first_patch[triangle] + code. The rule, which host,
kernel and viewer share to the last bit, is `docs/method/patches.md`.

            c                 depth 1: code 0 = (a, m, c), code 1 = (m, b, c)
           /|\\                depth 2: code 2 x parent + child, and so on
          / | \\
         /  |  \\
        a---m---b     ab is the longest edge, m its middle

References
----------
López et al. 2023, section 3.1 (longest-edge bisection up to an area). They trace the parts; we trace the triangles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner_core.errors import RequirementError
from planner_core.model import Float32Array, FloatArray, Int32Array, Patches, Scene
from planner_core.model.arrays import area_normals, dots, lengths
from planner_core.scene.array_rows import chunks

#: Patch numbers are int32 everywhere (kernels, files).
MAX_PATCHES = 2**31 - 1


def make_patches(scene: Scene, *, max_area_m2: float) -> Patches:
    """Number the patches of every triangle of `scene`.

    Parameters
    ----------
    max_area_m2
        No patch is larger than this; every triangle gets the fewest halvings that achieve it.

    Raises
    ------
    RequirementError
        The area is not a positive number, or so small that patch numbers do not fit in 32 bits.
    """
    if not (np.isfinite(max_area_m2) and max_area_m2 > 0):
        raise RequirementError(
            f"max_area_m2: got {max_area_m2}, expected a positive area in square metres; give e.g. 0.04"
        )
    area_m2 = triangle_areas(scene)
    with np.errstate(divide="ignore"):
        depth = np.maximum(0, np.ceil(np.log2(area_m2 / max_area_m2)))
    n_patches = float(np.exp2(depth).sum())
    if n_patches > MAX_PATCHES:
        raise RequirementError(
            f"max_area_m2: {max_area_m2} would make {n_patches:.3g} patches, expected at most {MAX_PATCHES}; "
            f"use at least {area_m2.sum() / MAX_PATCHES * 2:.2g} square metres"
        )
    first_patch = np.zeros(depth.size + 1, dtype=np.int32)
    first_patch[1:] = np.cumsum(np.exp2(depth).astype(np.int32), dtype=np.int32)
    return Patches(
        max_area_m2=float(max_area_m2),
        depth=depth.astype(np.uint8),
        first_patch=first_patch,
        triangle_area_m2=area_m2,
    )


def triangle_areas(scene: Scene) -> FloatArray:
    """(T,) float64, areas of the scene's triangles, m2."""
    area_m2 = np.empty(scene.n_triangles)
    for some in chunks(scene.n_triangles):
        corners = scene.vertices_m[scene.triangles[some]]
        cross = area_normals(corners)
        area_m2[some] = 0.5 * lengths(cross)
    return area_m2


def squared_edges(corners_m: FloatArray) -> Float32Array:
    """Squared edge lengths (N, 3) float32, edges 01, 12, 20, of triangles (N, 3, 3) float64 in metres.

    Of the corners as float32, which is all that the exported stage holds: the viewer has to break ties as we do.
    """
    exported_m = corners_m.astype(np.float32).astype(np.float64)
    edge_m = np.roll(exported_m, -1, axis=1) - exported_m
    # Summed in a fixed order: x*x + y*y + z*z in float64, so that every host rounds to the same float32.
    squared = edge_m[..., 0] * edge_m[..., 0] + edge_m[..., 1] * edge_m[..., 1] + edge_m[..., 2] * edge_m[..., 2]
    return np.ascontiguousarray(squared, dtype=np.float32)


def patch_code(barycentric: ArrayLike, squared_edges: ArrayLike, depth: ArrayLike) -> Int32Array:
    """Path down the bisection tree of N points, as a number of `depth` bits.

    Parameters
    ----------
    barycentric : (N, 3) float
        Weights of the triangle's vertices 0, 1, 2.
    squared_edges : (N, 3) float
        Squared lengths of the edges 01, 12, 20 of each point's triangle, see `squared_edges`.
    depth : (N,) int
        Depth of each point's triangle.

    Returns
    -------
    (N,) int32. Points a little outside their triangle get the code of a patch at its rim.

    Notes
    -----
    Runs in float32 in the order of operations of `docs/method/patches.md`. NumPy does not contract a * b + c.
    """
    weights = np.asarray(barycentric, dtype=np.float32)
    l0, l1, l2 = (np.ascontiguousarray(weights[:, k]) for k in range(3))
    edges = np.asarray(squared_edges, dtype=np.float32)
    q01, q12, q20 = (np.ascontiguousarray(edges[:, k]) for k in range(3))
    steps = np.asarray(depth, dtype=np.int32)
    code = np.zeros(steps.size, dtype=np.int32)
    live = np.arange(steps.size)
    for level in range(int(steps.max(initial=0))):
        keep = steps[live] > level
        if not keep.all():
            live = live[keep]
            l0, l1, l2, q01, q12, q20 = (x[keep] for x in (l0, l1, l2, q01, q12, q20))
        (la, lb, lc), (qab, qbc, qca), _ = _name_longest_first((l0, l1, l2), (q01, q12, q20))
        first = la >= lb
        l0 = np.where(first, la - lb, np.float32(2) * la)
        l1 = np.where(first, np.float32(2) * lb, lb - la)
        l2 = lc
        q01, q12, q20 = _child_edges(qab, qbc, qca, first)
        code[live] = 2 * code[live] + ~first
    return code


def patch_of_points(scene: Scene, patches: Patches, *, points_m: FloatArray, triangle: Int32Array) -> Int32Array:
    """Patch (N,) int32 of points (N, 3), local frame, on the triangles (N,); -1 where `triangle` is -1.

    `planner_core.engine.hit_rows.patch_of_pixels` is its twin for millions of points, to the last bit.
    """
    hit = np.flatnonzero(triangle >= 0)
    on = triangle[hit]
    corners, of = used_corners(scene, on)
    weights = barycentric_of_points(corners, points_m[hit], of[on])
    patch = np.full(triangle.shape, -1, dtype=np.int32)
    patch[hit] = patches.first_patch[on] + patch_code(weights, squared_edges(corners)[of[on]], patches.depth[on])
    return patch


def used_corners(scene: Scene, triangle: Int32Array) -> tuple[FloatArray, Int32Array]:
    """Corners (K, 3, 3) of the triangles that are among (N,), in order, and which of them each triangle (T,) is."""
    used = np.zeros(scene.n_triangles, dtype=np.bool_)
    used[triangle] = True
    return scene.vertices_m[scene.triangles[used]], np.cumsum(used, dtype=np.int32) - 1


def barycentric_of_points(corners_m: FloatArray, points_m: FloatArray, of: Int32Array) -> FloatArray:
    """Weights (N, 3) of the vertices at points (N, 3), along the normal; NaN: no area.

    of : (N,) which of the triangles (K, 3, 3) each point is on.
    """
    slope1, slope2 = barycentric_slopes(corners_m)
    l1, l2 = np.zeros((2, len(points_m)))
    for axis in range(3):
        at = points_m[:, axis] - corners_m[:, 0, axis][of]
        l1 += at * slope1[:, axis][of]
        l2 += at * slope2[:, axis][of]
    return np.stack([1.0 - l1 - l2, l1, l2], axis=1)


def barycentric_slopes(corners_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(K, 3) each, per metre: how the weights of the vertices 1 and 2 of triangles (K, 3, 3) grow along the axes."""
    edge1, edge2 = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    normal = np.cross(edge1, edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = (1.0 / dots(normal, normal))[:, None]
        return np.cross(edge2, normal) * scale, np.cross(normal, edge1) * scale


def patch_triangles(scene: Scene, patches: Patches) -> FloatArray:
    """Geometry (P, 3, 3) float64, local frame, metres, of all patches in patch order: for pictures and tests.

    A patch keeps the winding of its triangle. This is 72 bytes a patch: planning itself never needs it.
    """
    corners = scene.vertices_m[scene.triangles]
    edges = squared_edges(corners)
    left = patches.depth.astype(np.int32)
    while (left > 0).any():
        corners, edges, left = _bisect(corners, edges, left)
    return np.ascontiguousarray(corners)


def _bisect(corners: FloatArray, edges: Float32Array, left: Int32Array) -> tuple[FloatArray, Float32Array, Int32Array]:
    """Replace each triangle with halvings `left` by its two children, in place of it; leave the others."""
    split = left > 0
    q, v = edges[split], corners[split]
    (a, b, c), (qab, qbc, qca), _ = _name_longest_first((v[:, 0], v[:, 1], v[:, 2]), (q[:, 0], q[:, 1], q[:, 2]))
    middle = 0.5 * (a + b)
    source = np.repeat(np.arange(left.size), 1 + split)
    child = np.flatnonzero(split[source])  # two by two
    corners, edges, left = corners[source], edges[source], (left - split)[source]
    for each, ends, is_first in ((child[0::2], (a, middle, c), True), (child[1::2], (middle, b, c), False)):
        corners[each] = np.stack(ends, axis=1)
        edges[each] = np.stack(_child_edges(qab, qbc, qca, np.array(is_first)), axis=1)
    return corners, edges, left


_Three = tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]


def _name_longest_first(at_vertex: _Three, q: _Three) -> tuple[_Three, _Three, NDArray[np.bool_]]:
    """Steps 1 and 2 of the rule: rotate so that edge (a, b) is the longest; a tie goes to 01, then 12, then 20."""
    q01, q12, q20 = q
    is01 = (q01 >= q12) & (q01 >= q20)
    is12 = ~is01 & (q12 >= q20)
    x0, x1, x2 = at_vertex
    return _rotate(x0, x1, x2, is01, is12), _rotate(q01, q12, q20, is01, is12), is01


def _rotate(
    x0: NDArray[np.floating],
    x1: NDArray[np.floating],
    x2: NDArray[np.floating],
    is01: NDArray[np.bool_],
    is12: NDArray[np.bool_],
) -> _Three:
    if x0.ndim > 1:
        is01, is12 = is01[:, None], is12[:, None]
    return (
        np.where(is01, x0, np.where(is12, x1, x2)),
        np.where(is01, x1, np.where(is12, x2, x0)),
        np.where(is01, x2, np.where(is12, x0, x1)),
    )


def _child_edges(
    qab: NDArray[np.floating], qbc: NDArray[np.floating], qca: NDArray[np.floating], first: NDArray[np.bool_]
) -> _Three:
    """Steps 3 and 4 of the rule: squared edges 01, 12, 20 of child 0 where `first`, else of child 1."""
    f = np.float32
    qcm = (f(2) * qca + f(2) * qbc - qab) / f(4)
    return qab / f(4), np.where(first, qcm, qbc), np.where(first, qca, qcm)
