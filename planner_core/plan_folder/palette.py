"""The colours of coverage, one meaning a colour in the USD stage, on the maps and in the report.

Seen is blue to green, unseen is warm, not achievable is grey: told apart by people with any common colour blindness,
and in grey print by lightness. Colours are sRGB in [0, 1]; USD wants them linear, see `linear_from_srgb`.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import Float32Array, FloatArray, Int32Array


def _rgb(hex_code: str) -> tuple[float, float, float]:
    red, green, blue = (int(hex_code[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return (red, green, blue)


NOT_ACHIEVABLE = _rgb("C4C6C9")
UNSEEN = _rgb("E8743B")
SEEN_ONCE = _rgb("9AD0DC")
SEEN_TWICE = _rgb("4FA3C4")
SEEN_OFTEN = _rgb("1F6F9C")
NEUTRAL = _rgb("D9D7D2")
INK = _rgb("1E2A32")
STATION = _rgb("12303F")
ROUTE = _rgb("7A3E9D")
LINK = _rgb("B5236B")
WALL = _rgb("39434A")

PATCH_COLOURS_SRGB: FloatArray = np.array([NOT_ACHIEVABLE, UNSEEN, SEEN_ONCE, SEEN_TWICE, SEEN_OFTEN])
"""Index 0: not achievable, 1: achievable and unseen, 2 to 4: seen by one, two, three or more stations."""

FACE_COLOURS_SRGB: FloatArray = np.array(
    [NOT_ACHIEVABLE]
    + [_rgb(code) for code in ("E8743B", "EFA063", "F0CB9B", "D3E0DC", "A3D0D2", "62B0C4", "2E86AB", "1F6F9C")]
)
"""Index 0: nothing achievable, 1: nothing seen, 2 to 7: up to 1/6, 2/6 ... 6/6 (short of all), 8: all seen."""


def patch_colour_index(times_seen: Int32Array, achievable: np.ndarray) -> Int32Array:
    """Index into `PATCH_COLOURS_SRGB` of every patch, from how many stations see it and whether any candidate can.

    times_seen : (N,) int32. achievable : (N,) bool. Returns (N,) int32.
    """
    seen = np.clip(times_seen, 0, 3)
    return np.where(achievable, seen + 1, 0).astype(np.int32)


def face_colour_index(coverage: Float32Array) -> Int32Array:
    """Index into `FACE_COLOURS_SRGB` of every face, from its seen share.

    coverage : (T,) float32 in [0, 1], or -1 where nothing of the face is achievable. Returns (T,) int32.
    """
    steps = len(FACE_COLOURS_SRGB) - 3
    partial = 1 + np.ceil(np.clip(coverage, 0, 1) * steps).astype(np.int32)
    index = np.where(coverage >= 1, len(FACE_COLOURS_SRGB) - 1, partial)
    return np.where(coverage < 0, 0, index).astype(np.int32)


def linear_from_srgb(colour: FloatArray) -> FloatArray:
    """Linear Rec. 709 colour, as USD's displayColor wants it, from sRGB (IEC 61966-2-1)."""
    return np.where(colour <= 0.04045, colour / 12.92, ((np.asarray(colour) + 0.055) / 1.055) ** 2.4)


_RANGE_STOPS_SRGB = np.array([[0.99, 0.91, 0.55], [0.47, 0.78, 0.47], [0.13, 0.57, 0.55], [0.19, 0.29, 0.49]])
"""Near is light, far is dark: readable in grey too."""

_N_RANGE_COLOURS = 64


def range_ramp_srgb() -> FloatArray:
    """(64, 3) sRGB colours from near to far."""
    at = np.linspace(0, len(_RANGE_STOPS_SRGB) - 1, _N_RANGE_COLOURS)
    stops = np.arange(len(_RANGE_STOPS_SRGB))
    return np.stack([np.interp(at, stops, channel) for channel in _RANGE_STOPS_SRGB.T], axis=1)


def range_colour_index(range_m: Float32Array, range_max_m: float) -> Int32Array:
    """Index into `range_ramp_srgb` of ranges (N,) in metres, none of them NaN."""
    scaled = range_m / range_max_m * _N_RANGE_COLOURS
    index: Int32Array = np.clip(scaled, 0, _N_RANGE_COLOURS - 1).astype(np.int32)
    return index
