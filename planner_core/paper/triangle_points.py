"""Points in a triangle and the mean distance between them: the sets of the paper's Fig. 4 and 7, Eq. 6 and 7.

Corners (3, 3) in metres, any frame; points (n, 3) in the same. docs/method/reference-distance.md.

             p3        Eq. 7:  p = (1 - sqrt u) p1 + sqrt u (1 - v) p2 + v sqrt u p3
            / .\\               u: how far from p1, v: where between p2 and p3
           / .  \\              sqrt: as many points a square metre near p1 as elsewhere
         p1------p2

References
----------
López et al. 2023, Eq. 6 (mean distance), Eq. 7 (point of a triangle from u and v), Fig. 4 (six kinds of sets).
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray

#: Of u and of v, as the paper has them.
HALTON_BASES = (2, 3)
#: Side of the part of the triangle that `SampleKind.PART` keeps to, as a share of the whole side.
PART_SIDE = 0.4


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
