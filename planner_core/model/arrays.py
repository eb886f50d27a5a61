"""Array types of the model, and bounds, normals and lengths of many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]
Int64Array = NDArray[np.int64]
UInt8Array = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]


def bounds_of(corners: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the lowest and highest of corners (N, K, ...), (N, ...) each, of every coordinate by itself.

    For few corners: NumPy takes five times as long for the least of threes.
    """
    low = high = corners[:, 0]
    for other in range(1, corners.shape[1]):
        low, high = np.minimum(low, corners[:, other]), np.maximum(high, corners[:, other])
    return low, high


def area_normals(corners_m: NDArray[Any]) -> NDArray[Any]:
    """Return normals (N, 3) of triangles (N, 3, 3), each as long as twice its area, in the type of the corners."""
    return np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])


def dots(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Return the scalar products of rows of a and b, (N, 2) or (N, 3); NumPy takes twice as long to sum threes."""
    total: NDArray[Any] = a[:, 0] * b[:, 0]
    for other in range(1, a.shape[1]):
        total += a[:, other] * b[:, other]
    return total


def lengths(a: NDArray[Any]) -> NDArray[Any]:
    """Return the lengths of rows (N, 2) or (N, 3)."""
    length: NDArray[Any] = np.sqrt(dots(a, a))
    return length
