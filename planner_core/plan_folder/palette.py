"""The colours of coverage, one meaning a colour in the USD stage, on the maps and in the report.

Seen is blue to green, unseen is warm, not achievable is grey, what need not be covered is nearly white: distinguished
by people with any common colour blindness, and in grey print by lightness. Colours are sRGB in [0, 1]; USD wants them
linear, see `linear_from_srgb`.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, Float32Array, FloatArray, Int32Array, Plan


def _rgb(hex_code: str) -> tuple[float, float, float]:
    red, green, blue = (int(hex_code[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return (red, green, blue)


NOT_ACHIEVABLE = _rgb("C4C6C9")
NOT_REQUIRED = _rgb("EAE7E1")
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

PATCH_COLOURS_SRGB: FloatArray = np.array([NOT_ACHIEVABLE, UNSEEN, SEEN_ONCE, SEEN_TWICE, SEEN_OFTEN, NOT_REQUIRED])
"""Index 0: not achievable, 1: achievable and unseen, 2 to 4: seen by one, two, three or more stations, 5: not
required."""

FACE_COLOURS_SRGB: FloatArray = np.array(
    [NOT_ACHIEVABLE]
    + [_rgb(code) for code in ("E8743B", "EFA063", "F0CB9B", "D3E0DC", "A3D0D2", "62B0C4", "2E86AB", "1F6F9C")]
    + [NOT_REQUIRED]
)
"""Index 0: nothing achievable, 1: nothing seen, 2 to 7: up to 1/6, 2/6 ... 6/6 (short of all), 8: all seen, 9: nothing
required."""

_ALL_SEEN = 8


def patch_colour_index(times_seen: Int32Array, achievable: BoolArray, required: BoolArray | None = None) -> Int32Array:
    """Index into `PATCH_COLOURS_SRGB` of every patch, from how many stations see it and whether any candidate can.

    times_seen : (N,) int32. achievable : (N,) bool. required : (N,) bool, False where it need not be covered, seen or
    not; None: all. Returns (N,) int32.
    """
    index = np.where(achievable, np.clip(times_seen, 0, 3) + 1, 0)
    if required is not None:
        index[~required] = len(PATCH_COLOURS_SRGB) - 1
    return index.astype(np.int32)


def colours_of_patches(plan: Plan, which: BoolArray | Int32Array) -> FloatArray:
    """(N, 3) sRGB of some patches of a plan: a mask (P,), or their numbers (N,)."""
    required = None if plan.required is None else plan.required[which]
    return PATCH_COLOURS_SRGB[patch_colour_index(plan.times_seen[which], plan.achievable[which], required)]


def face_colour_index(coverage: Float32Array, required: BoolArray | None = None) -> Int32Array:
    """Index into `FACE_COLOURS_SRGB` of every face, from its seen share.

    coverage : (T,) float32 in [0, 1], or -1 where nothing of the face is achievable. required : (T,) bool, False where
    nothing of it need be covered; None: all. Returns (T,) int32.
    """
    partial = 1 + np.ceil(np.clip(coverage, 0, 1) * (_ALL_SEEN - 2)).astype(np.int32)
    index = np.where(coverage >= 1, _ALL_SEEN, partial)
    index = np.where(coverage < 0, 0, index)
    if required is not None:
        index[~required] = _ALL_SEEN + 1
    return index.astype(np.int32)


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
