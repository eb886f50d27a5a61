"""Where targets register two stations that have too little surface in common.

Input what both stations see, its centroids and normals, and the sensors (local frame, metres); output three places.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner_core.model import BoolArray, FloatArray
from planner_core.network.pair_overlap import SharedSurface

#: A target is measured well from as far as this, at this angle to the plumb of its face (60 degrees), and hangs on
#: walls, where a person reaches: from below the lower sensor to above the upper one, which may be a floor above.
FARTHEST_M, _LEAST_COSINE, _UPRIGHT, _REACH_M = 20.0, 0.5, 0.2, (-1.2, 0.8)
#: Three targets hold a scan if they are as far apart as this, and as far off one line as that.
_LEAST_APART_M, _LEAST_OFF_LINE_M = 1.5, 0.75


def target_places(
    common: BoolArray,
    surface: SharedSurface,
    sensors_m: FloatArray,
    in_plain_view: Callable[[FloatArray, FloatArray], BoolArray],
) -> FloatArray:
    """Choose places for three targets on upright surface that two stations see, far from each other and from one line.

    Parameters
    ----------
    common
        (P,) patches that both see and that targets may hang on.
    sensors_m
        (2, 3).
    in_plain_view
        Of a sensor (3,) and places (N, 3): (N,) whether nothing is in between. Of a patch that is seen, the middle may
        be hidden.

    Returns
    -------
    (3, 3) centroids of patches; (0, 3) where no three would hold.
    """
    at_m, normal = surface.centroid_m[common], surface.normal[common]
    low_m, high_m = sensors_m[:, 2].min(), sensors_m[:, 2].max()
    usable = np.abs(normal[:, 2]) <= _UPRIGHT
    usable &= (at_m[:, 2] >= low_m + _REACH_M[0]) & (at_m[:, 2] <= high_m + _REACH_M[1])
    for sensor_m in sensors_m:
        away_m = at_m - sensor_m
        range_m = np.linalg.norm(away_m, axis=1)
        usable &= range_m <= FARTHEST_M
        usable &= np.abs(np.einsum("ij,ij->i", away_m, normal)) >= _LEAST_COSINE * range_m
    for sensor_m in sensors_m:
        usable[usable] = in_plain_view(sensor_m, at_m[usable])
    places_m = at_m[usable]
    if places_m.shape[0] < 3:
        return np.empty((0, 3))
    first = places_m[_farthest(np.linalg.norm(places_m - places_m.mean(axis=0), axis=1))]
    from_first_m = places_m - first
    second = places_m[_farthest(np.linalg.norm(from_first_m, axis=1))]
    apart_m = float(np.linalg.norm(second - first))
    if apart_m < _LEAST_APART_M:
        return np.empty((0, 3))
    off_line_m = np.linalg.norm(np.cross(from_first_m, (second - first) / apart_m), axis=1)
    third = _farthest(off_line_m)
    if off_line_m[third] < _LEAST_OFF_LINE_M:
        return np.empty((0, 3))
    return np.stack([first, second, places_m[third]])


def _farthest(distance_m: FloatArray) -> int:
    """The first of those that are as far as any, to a micrometre: the same on every machine."""
    return int(np.flatnonzero(distance_m >= distance_m.max() - 1e-6)[0])
