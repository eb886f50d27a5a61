"""Models: a scanner on its tripod, small, as a closed mesh for BIM and USD. Instrument height -> triangles.

Frame: origin at the sensor, z up, metres. About as large as the real thing, so that a clash with a table is one.

          ___
         |_o_|     head around the sensor o
         / | \\
        /  |  \\    three legs down to the ground, at z = -instrument height
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.model import FloatArray, Int32Array, Station

HEAD_RADIUS_M = 0.1
HEAD_HEIGHT_M = 0.3
#: Feet of a tripod at eye level are this far from its middle; of a low one nearer.
_FOOT_RADIUS_M = 0.45
_FOOT_SHARE = 0.35
_LEG_M = 0.03
_N_SIDES = 12


def foot_m(station: Station) -> FloatArray:
    """(3,) float64, local: the ground below the sensor; the sensor itself where its height is unknown (NaN)."""
    position_m = station.position_m.astype(np.float64).copy()
    position_m[2] -= np.nan_to_num(station.instrument_height_m)
    return position_m


def tripod(height_m: float) -> tuple[FloatArray, Int32Array]:
    """Build a scanner `height_m` above its ground; of an unknown height, NaN, and of hardly any the head alone.

    Returns
    -------
    vertices_m : (V, 3) float64 about the sensor. triangles : (T, 3) int32, counter-clockwise seen from outside; closed
    parts that do not touch.
    """
    half_m = HEAD_HEIGHT_M / 2
    turn = np.arange(_N_SIDES) * (2 * math.pi / _N_SIDES)
    ring = HEAD_RADIUS_M * np.column_stack([np.cos(turn), np.sin(turn)])
    parts = [_prism(ring, ring, -half_m, half_m)]
    if height_m > HEAD_HEIGHT_M:
        foot_m = min(_FOOT_RADIUS_M, _FOOT_SHARE * height_m)
        square = _LEG_M / 2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], dtype=np.float64)
        for third in range(3):
            away = np.array([math.cos(2 * math.pi * third / 3), math.sin(2 * math.pi * third / 3)])
            top = square + (HEAD_RADIUS_M - _LEG_M) * away
            parts.append(_prism(square + foot_m * away, top, -height_m, -half_m - 0.001))
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    return (
        np.round(np.concatenate([vertices for vertices, _ in parts]), 6),
        np.concatenate([triangles + at for (_, triangles), at in zip(parts, first.tolist(), strict=True)]),
    )


def _prism(low: FloatArray, high: FloatArray, low_m: float, high_m: float) -> tuple[FloatArray, Int32Array]:
    """Join two convex rings (N, 2), counter-clockwise, at heights low_m < high_m."""
    n = len(low)
    vertices = np.column_stack([np.concatenate([low, high]), np.repeat([low_m, high_m], n)])
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.concatenate([np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])])
    fan = np.column_stack([np.zeros(n - 2, dtype=np.int64), np.arange(1, n - 1), np.arange(2, n)])
    return vertices, np.concatenate([sides, fan[:, ::-1], fan + n]).astype(np.int32)
