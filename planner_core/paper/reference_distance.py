"""Reference distance (d_opt, m^2) of patches: mean squared distance of evenly scattered points, the vertices included.

Input patches, points a square metre; output (P,) float64. It depends on a patch by three inner products and its number
of points alone, so that nothing is sampled patch by patch. docs/method/reference-distance.md.

Points of a triangle with corners (3, 3) in metres, any frame; points (n, 3) in the same:

             p3        Eq. 7:  p = (1 - sqrt u) p1 + sqrt u (1 - v) p2 + v sqrt u p3
            / .\\               u: how far from p1, v: where between p2 and p3
           / .  \\              sqrt: as many points a square metre near p1 as elsewhere
         p1------p2

References
----------
López et al. 2023, Eq. 6 (mean distance), Eq. 7 (point of a triangle from u and v), section 3.3.3, Fig. 4 (six kinds of
sets).
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int32Array, Patches, Scene
from planner_core.model.arrays import dots
from planner_core.scene.patches import patch_triangles

#: Points a square metre that a reference is made of: one every 2 cm each way. A patch of the default 0.04 m^2 gets 100,
#: where the distance is 5 to 12 % above that of infinitely many, by shape: docs/method/reference-distance.md.
REFERENCE_POINTS_PER_M2 = 2500.0
#: More points than this a patch change the distance by some 1e-5 of itself.
MAX_REFERENCE_POINTS = 2**20
#: Patches whose corners the host holds at once: some 100 MB.
_PATCHES_AT_ONCE = 2**19
#: Of u and of v, as the paper has them.
HALTON_BASES = (2, 3)
#: Side of the part of the triangle that `SampleKind.PART` keeps to, as a share of the whole side.
PART_SIDE = 0.4


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
    products = np.stack([dots(e, e), dots(e, f), dots(f, f)], axis=1)
    distances: FloatArray = dots(products, factors)
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


class SampleKind(Enum):
    """The kinds of point sets of Fig. 4, in its order from left to right and from top to bottom."""

    GRID = "grid"
    """Points of an even triangular lattice, rim included."""
    RANDOM_UV = "random-uv"
    """u and v at random and put to use without the root: crowded at p1."""
    RANDOM = "random"
    """u and v at random, Eq. 7."""
    HALTON = "halton"
    """u and v of the Halton sequence, Eq. 7: the reference of F2."""
    PART = "part"
    """As `RANDOM`, in a small triangle at p1 only."""
    THREE = "three"
    """Three points, halfway between the centroid and each vertex."""


def radical_inverse(n: int, base: int) -> FloatArray:
    """(n,) float64 in (0, 1): the digits of 1 .. n in `base`, mirrored at the point."""
    left = np.arange(1, n + 1, dtype=np.int64)
    inverse = np.zeros(n, dtype=np.float64)
    weight = 1.0 / base
    while left.any():
        inverse += weight * (left % base)
        left //= base
        weight /= base
    return inverse


def halton_weights(n: int) -> FloatArray:
    """(n, 2) float64: weights of p2 and p3 by Eq. 7 at the first n points of the Halton sequence, from its number 1 on.

    Number 0 is (0, 0), which is the vertex p1.
    """
    return triangle_weights(np.stack([radical_inverse(n, base) for base in HALTON_BASES], axis=1))


def triangle_weights(uv: FloatArray) -> FloatArray:
    """(n, 2) weights of p2 and p3 of the points that Eq. 7 maps (n, 2) u and v in [0, 1] to."""
    root = np.sqrt(uv[:, 0])
    return np.stack([root * (1.0 - uv[:, 1]), root * uv[:, 1]], axis=1)


def sample_triangle(corners_m: FloatArray, n: int, kind: SampleKind, *, seed: int = 0) -> FloatArray:
    """Points (m, 3) of one of the kinds in a triangle with corners (3, 3), without its vertices unless on the lattice.

    Parameters
    ----------
    n
        How many, at least 1. `GRID` takes the least full lattice of at least n points, `THREE` is three points.
    seed
        Of the kinds at random.

    Raises
    ------
    RequirementError
        n is less than 1.
    """
    if n < 1:
        raise RequirementError(f"n: got {n} points, expected at least 1; a triangle without points has no distance")
    weights = _weights_of(n, kind, np.random.default_rng(seed))
    corners = np.asarray(corners_m, dtype=np.float64)
    points: FloatArray = corners[0] + weights[:, :1] * (corners[1] - corners[0])
    points += weights[:, 1:] * (corners[2] - corners[0])
    return points


def mean_squared_distance_m2(points_m: FloatArray) -> float:
    """Mean over points (n, 3) of the sum of squared distances to the others / (n - 1): Eq. 6 as printed.

    0 for a single point. Notes: sum_i sum_j |p_i - p_j|^2 = 2 n sum |p|^2 - 2 |sum p|^2, about the centroid.
    """
    n = len(points_m)
    from_centroid = points_m - points_m.mean(axis=0)
    return float(2.0 * (from_centroid**2).sum() / max(n - 1, 1))


def mean_distance_m(points_m: FloatArray) -> float:
    """Mean Euclidean distance of points (n, 3) to the others; 0 for a single point. O(n^2) in time, O(n) in memory."""
    n = len(points_m)
    total = sum(float(np.sqrt(((points_m - point) ** 2).sum(axis=1)).sum()) for point in points_m)
    return total / max(n * (n - 1), 1)


def _weights_of(n: int, kind: SampleKind, rng: np.random.Generator) -> FloatArray:
    """(m, 2) weights of p2 and p3."""
    if kind is SampleKind.GRID:
        side = next(s for s in range(2, n + 2) if s * (s + 1) // 2 >= n)
        rows, columns = np.triu_indices(side)
        lattice: FloatArray = np.stack([rows, side - 1 - columns], axis=1) / (side - 1)
        return lattice
    if kind is SampleKind.THREE:
        return np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 4.0]]) / 6.0
    if kind is SampleKind.HALTON:
        return halton_weights(n)
    uv = rng.random((n, 2))
    if kind is SampleKind.RANDOM_UV:
        return np.stack([uv[:, 0] * (1.0 - uv[:, 1]), uv[:, 0] * uv[:, 1]], axis=1)
    return triangle_weights(uv) * (PART_SIDE if kind is SampleKind.PART else 1.0)
