"""Swings of doors: strokes that run along a quarter of a circle, in whatever unit the drawing has."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner_core.model import FloatArray

_SWEEP_RAD = (np.deg2rad(55.0), np.deg2rad(125.0))
"""Leaves are drawn open by 60 to 120 degrees, mostly by 90."""
_OFF_SHARE = 0.02
"""Corners of a flattened arc lie off its circle by less, as a share of the radius."""
_CORNER_RAD = np.deg2rad(35.0)
"""Where a stroke turns by more, another part of it begins: leaf and arc are one polyline in some blocks."""


@dataclass(frozen=True)
class SwingArc:
    """centre, start, end : (2,) the hinge and both ends of a leaf's way. radius : its width."""

    centre: FloatArray
    start: FloatArray
    end: FloatArray
    radius: float


def swing_arcs(strokes: Iterable[FloatArray]) -> list[SwingArc]:
    """Find quarter circles in strokes (K, 2)."""
    found = []
    for stroke in strokes:
        if len(stroke) < 4:
            continue
        for part in _smooth_parts(np.asarray(stroke[:, :2])):
            arc = _arc(part)
            if arc is not None:
                found.append(arc)
    return found


def _smooth_parts(stroke: FloatArray) -> list[FloatArray]:
    step = np.diff(stroke, axis=0)
    keep = np.concatenate([[True], np.hypot(step[:, 0], step[:, 1]) > 0.0])
    points = stroke[keep]
    if len(points) < 4:
        return []
    angle = np.arctan2(*np.diff(points, axis=0).T[::-1])
    turn = np.abs((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)
    breaks = np.flatnonzero(turn > _CORNER_RAD) + 1
    starts = [0, *breaks.tolist(), len(points) - 1]
    return [points[a : b + 1] for a, b in pairwise(starts) if b - a >= 3]


def _arc(points: FloatArray) -> SwingArc | None:
    """The circle through points (K, 2), by least squares (Kasa 1976), where they run along a quarter of it."""
    middle = points.mean(axis=0)
    x, y = (points - middle).T
    matrix = np.column_stack([x, y, np.ones_like(x)])
    solution, _, rank, _ = np.linalg.lstsq(matrix, x * x + y * y, rcond=None)
    if rank < 3:
        return None
    centre = solution[:2] / 2
    square = float(solution[2] + centre @ centre)
    if square <= 0.0:
        return None
    radius = float(np.sqrt(square))
    off = np.abs(np.hypot(x - centre[0], y - centre[1]) - radius)
    if off.max() > _OFF_SHARE * radius:
        return None
    angle = np.unwrap(np.arctan2(y - centre[1], x - centre[0]))
    if not _SWEEP_RAD[0] <= abs(angle[-1] - angle[0]) <= _SWEEP_RAD[1]:
        return None
    return SwingArc(centre + middle, points[0], points[-1], radius)
