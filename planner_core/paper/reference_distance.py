"""Reference distance (d_opt, m^2) of patches: mean squared distance of evenly scattered points, the vertices included.

Input patches, points a square metre; output (P,) float64. It depends on a patch by three inner products and its number
of points alone, so that nothing is sampled patch by patch. docs/method/reference-distance.md.

References
----------
López et al. 2023, Eq. 6 and 7, section 3.3.3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int32Array, Patches, Scene
from planner_core.paper.triangle_points import halton_weights
from planner_core.scene.patches import patch_triangles

#: Points a square metre that a reference is made of: one every 2 cm each way. A patch of the default 0.04 m^2 gets 100,
#: where the distance is 5 to 12 % above that of infinitely many, by shape: docs/method/reference-distance.md.
REFERENCE_POINTS_PER_M2 = 2500.0
#: More points than this a patch change the distance by some 1e-5 of itself.
MAX_REFERENCE_POINTS = 2**20
#: Patches whose corners the host holds at once: some 100 MB.
_PATCHES_AT_ONCE = 2**19


def reference_points(area_m2: FloatArray, *, points_per_m2: float) -> Int32Array:
    """(N,) number of points that patches of areas (N,) get: in proportion, rounded up, at least 1.

    Raises
    ------
    RequirementError
        `points_per_m2` is not positive and finite.
    """
    if not (np.isfinite(points_per_m2) and points_per_m2 > 0):
        raise RequirementError(
            f"points_per_m2: got {points_per_m2}, expected a positive number of points; "
            f"leave it out for {REFERENCE_POINTS_PER_M2:g}"
        )
    # The areas of halved triangles carry rounding: 100.00000000000001 points are 100.
    wanted = np.ceil(area_m2 * points_per_m2 * (1.0 - 1e-12))
    return np.clip(wanted, 1, MAX_REFERENCE_POINTS).astype(np.int32)


def spread_table(n_most: int) -> FloatArray:
    """(n_most + 1, 3) float64: factors of |e|^2, e . f, |f|^2 in the distance by number of Halton points.

    With e and f the edges from the first vertex to the second and third. Row k is for k points and the three vertices.

    Notes
    -----
    A point is s e + t f from the first vertex. With n = k + 3 points, S sums over them, Eq. 6 comes to

        d_opt = 2 [ (n S(ss) - S(s)^2) |e|^2 + 2 (n S(st) - S(s) S(t)) e . f + (n S(tt) - S(t)^2) |f|^2 ] / (n (n - 1))
    """
    weights = np.concatenate([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], halton_weights(n_most)])
    s, t = weights[:, 0], weights[:, 1]
    sums = np.cumsum(np.stack([s, t, s * s, s * t, t * t], axis=1), axis=0)[2:]
    n = np.arange(3, n_most + 4, dtype=np.float64)[:, None]
    pairs = n * sums[:, 2:] - np.stack([sums[:, 0] ** 2, sums[:, 0] * sums[:, 1], sums[:, 1] ** 2], axis=1)
    factors: FloatArray = pairs * np.array([2.0, 4.0, 2.0]) / (n * (n - 1.0))
    return factors


def reference_distances_m2(corners_m: FloatArray, factors: FloatArray) -> FloatArray:
    """(N,) reference distances of triangles (N, 3, 3), metres, with their rows (N, 3) of `spread_table`."""
    e, f = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    products = np.stack([(e * e).sum(axis=1), (e * f).sum(axis=1), (f * f).sum(axis=1)], axis=1)
    distances: FloatArray = (products * factors).sum(axis=1)
    return distances


def reference_distances_of_patches_m2(scene: Scene, patches: Patches, *, points_per_m2: float) -> FloatArray:
    """(P,) float64, reference distances of all patches, on the host; of vertices rounded to float32, as engines hold.

    Raises
    ------
    RequirementError
        `points_per_m2` is not positive and finite.
    """
    n_points, table = table_of_triangles(patches, points_per_m2=points_per_m2)
    rounded = scene.vertices_m.astype(np.float32).astype(np.float64)
    distances = np.empty(patches.n_patches, dtype=np.float64)
    first_patch, first = patches.first_patch, 0
    while first < scene.n_triangles:
        # Whole triangles; one alone may have more patches than that.
        end = int(np.searchsorted(first_patch, first_patch[first] + _PATCHES_AT_ONCE, side="right")) - 1
        end = min(max(end, first + 1), scene.n_triangles)
        part = replace(scene, vertices_m=rounded, triangles=scene.triangles[first:end])
        corners = patch_triangles(part, replace(patches, depth=patches.depth[first:end]))
        factors = np.repeat(table[n_points[first:end]], np.diff(first_patch[first : end + 1]), axis=0)
        distances[first_patch[first] : first_patch[end]] = reference_distances_m2(corners, factors)
        first = end
    return distances


def table_of_triangles(patches: Patches, *, points_per_m2: float) -> tuple[Int32Array, FloatArray]:
    """(T,) number of points of each triangle's patches, which are all of one area, and the `spread_table` up to it."""
    area_m2 = patches.triangle_area_m2 / np.exp2(patches.depth.astype(np.float64))
    n_points = reference_points(area_m2, points_per_m2=points_per_m2)
    return n_points, spread_table(int(n_points.max(initial=1)))
