"""The bulk of a scene: where nearly all of its surface lies, whatever single faces lie elsewhere.

Models carry strays: a symbol left at the origin of a national grid, a tree copied to the wrong place. A box around
everything would then be kilometres long and its centre would lie in empty land. Here faces are weighed instead.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray

STRAY_DISTANCE_M = 20_000.0
"""Faces further than this from the bulk are strays: no site that is scanned from tripods is as large. It is far below
the 100 km that the scan engine takes, and far above any part of a site that somebody could miss."""

BULK_SHARE = 0.95
"""Share of the weight that is the bulk. What lies far from it has less than a twentieth of the surface."""

NEAR_M = 50.0
"""What lies this near to the bulk is always near: a building's neighbours, its antennas, its cellars."""

_LARGEST_WEIGHT_M2 = 100.0
"""A face weighs as its area, up to this: no single terrain face or stray sliver outweighs a building."""


def face_weights(corners_m: FloatArray) -> FloatArray:
    """(T,) float64, how much each triangle (T, 3, 3) counts for telling where the bulk is; not all of them 0.

    Faces longer than `STRAY_DISTANCE_M` have a corner astray and count nothing, unless most faces are so long (which
    is a wrong unit).
    """
    cross = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    weight: FloatArray = np.minimum(0.5 * np.sqrt((cross * cross).sum(axis=1)), _LARGEST_WEIGHT_M2)
    too_long = np.ptp(corners_m, axis=1).max(axis=1) > STRAY_DISTANCE_M
    if too_long.mean() < 0.5:
        weight = np.where(too_long, 0.0, weight)
    return weight if weight.any() else np.ones(weight.size)


def weighted_quantile(values: FloatArray, weight: FloatArray, share: float) -> float:
    """Smallest of `values` (N,) such that it and the smaller ones have `share` of the weight."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order])
    at = int(np.searchsorted(below, share * below[-1]))
    return float(values[order[min(at, values.size - 1)]])


def bulk_centre_m(corners_m: FloatArray, weight: FloatArray) -> FloatArray:
    """(3,) float64: weighted median of the triangles' centroids, axis by axis."""
    centroid = corners_m.mean(axis=1)
    return np.array([weighted_quantile(centroid[:, axis], weight, 0.5) for axis in range(3)])


def is_astray(corners_m: FloatArray, weight: FloatArray) -> BoolArray:
    """(T,) bool: a corner lies further than `STRAY_DISTANCE_M`, and than the bulk is large, outside the bulk.

    The bulk is a cube around `bulk_centre_m` that holds `BULK_SHARE` of the weight.
    """
    distance = np.abs(corners_m - bulk_centre_m(corners_m, weight)).max(axis=(1, 2))
    bulk_m = weighted_quantile(distance, weight, BULK_SHARE)
    astray: BoolArray = distance > bulk_m + max(STRAY_DISTANCE_M, bulk_m)
    return astray


def fence_m(corners_m: FloatArray) -> FloatArray:
    """(2, 3) float64: lowest and highest place of the bulk and what is near it.

    That is the box of the middle 98 % of the centroids' weight on each axis, widened on either side by its own length
    and at least by `NEAR_M`.
    """
    weight = face_weights(corners_m)
    centroid = corners_m.mean(axis=1)
    quantiles = [[weighted_quantile(centroid[:, axis], weight, share) for axis in range(3)] for share in (0.01, 0.99)]
    low, high = np.array(quantiles)
    margin = np.maximum(high - low, NEAR_M)
    return np.stack([low - margin, high + margin])


def is_outside(corners_m: FloatArray, fence: FloatArray) -> BoolArray:
    """(T,) bool: no part of the triangle's box (T, 3, 3) is inside the fence (2, 3)."""
    outside: BoolArray = ((corners_m.max(axis=1) < fence[0]) | (corners_m.min(axis=1) > fence[1])).any(axis=1)
    return outside


def named_few(names: list[str]) -> str:
    """Up to three different names for a warning, in their order, and how many more there are."""
    different = list(dict.fromkeys(names))
    more = f" and {len(different) - 3} more" if len(different) > 3 else ""
    return ", ".join(repr(name) for name in different[:3]) + more
