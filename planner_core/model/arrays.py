"""Array types of the model, and normals of triangles."""

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


def area_normals(corners_m: NDArray[Any]) -> NDArray[Any]:
    """Return normals (N, 3) of triangles (N, 3, 3), each as long as twice its area, in the type of the corners."""
    return np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
