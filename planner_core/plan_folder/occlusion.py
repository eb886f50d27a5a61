"""Ambient occlusion: corners, and what stands close to something, are darker than open surfaces. Depths -> brightness.

One over the depth of a plane is linear across a picture in perspective. So on an open surface a place is as near as two
places opposite each other beside it are on average. In a corner, or beside something, it lies deeper than that.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import Float32Array

RINGS = ((0.06, 4), (0.15, 6), (0.3, 8), (0.5, 12))
"""Radius in metres, and lines through a place along which others are compared with it: the wider, the more."""

WIDEST_PIXELS = 60.0
"""In pictures from nearer all rings are smaller: so few lines would leave streaks."""

FULL, GONE = 0.8, 2.0
"""How much deeper than its neighbours, in radii, a place is in a corner; and where it is another place, far behind."""

DARKEST = 0.55
"""Brightness where everything occludes. A corner of two walls has about half of that darkening: colours of coverage
have to stay what they are."""

_ROWS_AT_ONCE = 64
"""So that all arrays of a step fit the processor's cache."""


def brightness(depth_m: Float32Array, pixels_at_1_m: float) -> Float32Array:
    """(H, W) from `DARKEST` to 1 of depths (H, W) along the looking direction, inf where nothing is.

    pixels_at_1_m : length of a metre at a depth of one.
    """
    there = np.isfinite(depth_m)
    if not there.any():
        return np.ones_like(depth_m)
    pixels_a_metre = pixels_at_1_m / float(np.median(depth_m[there]))
    share = min(1.0, WIDEST_PIXELS / (RINGS[-1][0] * pixels_a_metre))
    pixels = share * pixels_a_metre
    pairs = [
        (*np.rint(radius_m * pixels * np.array([np.cos(turn), np.sin(turn)])).astype(int), share * radius_m, n_lines)
        for number, (radius_m, n_lines) in enumerate(RINGS)
        for turn in np.pi * (np.arange(n_lines) + 0.5 * number) / n_lines
    ]
    near = np.float32(1.0) / depth_m
    squared = np.where(there, depth_m, np.float32(0.0)) ** 2
    margin = int(np.ceil(RINGS[-1][0] * pixels)) + 1
    around = np.pad(near, margin)
    darkness = np.zeros_like(near)
    for first in range(0, len(near), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        here, dark = near[rows], darkness[rows]
        height, width = here.shape
        for right, down, radius_m, n_lines in pairs:
            deeper = (
                around[first + margin + down :, margin + right :][:height, :width]
                + (around[first + margin - down :, margin - right :][:height, :width])
            )
            deeper *= np.float32(0.5)
            deeper -= here
            deeper *= squared[rows]
            deeper *= np.float32(1.0 / radius_m)
            corner = np.minimum(deeper * np.float32(1 / FULL), (GONE - deeper) * np.float32(1 / (GONE - FULL)))
            dark += np.clip(corner, 0.0, 1.0, out=corner) * np.float32(1.0 / n_lines)
    return np.asarray(1 - darkness * ((1 - DARKEST) / len(RINGS)), dtype=np.float32)
