"""Swings of doors: strokes that run along a quarter of a circle, in whatever unit the drawing has."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner_core.model import FloatArray

_SWEEP_RAD = (np.deg2rad(55.0), np.deg2rad(125.0))
"""Leaves are drawn open by 60 to 120 degrees, mostly by 90."""
_KINK_SHARE = 0.35
_LEAST_PIECE_RAD = np.deg2rad(20.0)
_NEAR_SHARE, _MOST_PIECES = 0.1, 2000
"""Pieces of one arc have centres and radii that differ by a smaller share of the radius."""
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
    """Find quarter circles in strokes (K, 2); those that texts or lines cut into pieces, too."""
    parts = [part for stroke in strokes if len(stroke) >= 4 for part in _smooth_parts(np.asarray(stroke[:, :2]))]
    circles = [(circle, part) for part in parts if (circle := _circle(part)) is not None]
    found = [arc for circle, part in circles if (arc := _arc(circle, part)) is not None]
    pieces = [(circle, part) for circle, part in circles if circle.sweep < _SWEEP_RAD[0]]
    return [*found, *_joined(pieces[:_MOST_PIECES])]


def _without_kinks(points: FloatArray) -> FloatArray:
    """Points (K, 2) without steps that are short beside both neighbours, as traced lines have them."""
    while len(points) > 4:
        length = np.hypot(*np.diff(points, axis=0).T)
        is_kink = length[1:-1] < _KINK_SHARE * np.minimum(length[:-2], length[2:])
        if not is_kink.any():
            break
        row = int(np.flatnonzero(is_kink)[0]) + 1
        points = np.concatenate(
            [points[:row], 0.5 * (points[row : row + 1] + points[row + 1 : row + 2]), points[row + 2 :]]
        )
    return points


def _joined(pieces: list[tuple[_Circle, FloatArray]]) -> list[SwingArc]:
    """Arcs of pieces that are of one circle."""
    found = []
    left = list(pieces)
    while left:
        circle, part = left.pop(0)
        same = [
            other
            for other in left
            if np.hypot(*(other[0].centre - circle.centre)) < _NEAR_SHARE * circle.radius
            and abs(other[0].radius - circle.radius) < _NEAR_SHARE * circle.radius
        ]
        points = np.concatenate([part, *(points for _, points in same)])
        whole = _circle(points) if same else None
        if whole is None:
            continue
        arc = _arc(whole, points)
        if arc is not None:
            found.append(arc)
            left = [other for other in left if not any(other is each for each in same)]
    return found


def _smooth_parts(stroke: FloatArray) -> list[FloatArray]:
    step = np.diff(stroke, axis=0)
    keep = np.concatenate([[True], np.hypot(step[:, 0], step[:, 1]) > 0.0])
    points = _without_kinks(stroke[keep])
    if len(points) < 4:
        return []
    angle = np.arctan2(*np.diff(points, axis=0).T[::-1])
    turn = np.abs((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)
    breaks = np.flatnonzero(turn > _CORNER_RAD) + 1
    starts = [0, *breaks.tolist(), len(points) - 1]
    return [points[a : b + 1] for a, b in pairwise(starts) if b - a >= 3]


@dataclass(frozen=True)
class _Circle:
    """centre : (2,). sweep : angle between the outermost points, at begin_rad and end_rad."""

    centre: FloatArray
    radius: float
    begin_rad: float
    end_rad: float

    @property
    def sweep(self) -> float:
        return self.end_rad - self.begin_rad


def _circle(points: FloatArray) -> _Circle | None:
    """The circle through points (K, 2), by least squares (Kasa 1976); None where they are on none."""
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
    angle = np.sort(np.arctan2(y - centre[1], x - centre[0]))
    gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
    widest = int(np.argmax(gaps))  # what the arc leaves free
    begin = float(np.roll(angle, -widest - 1)[0])
    sweep = float(2 * np.pi - gaps[widest])
    return _Circle(centre + middle, radius, begin, begin + sweep) if sweep >= _LEAST_PIECE_RAD else None


def _arc(circle: _Circle, points: FloatArray) -> SwingArc | None:
    """A circle's arc as a swing, where it is about a quarter; its ends are the outermost of points (K, 2)."""
    if not _SWEEP_RAD[0] <= circle.sweep <= _SWEEP_RAD[1]:
        return None
    ends = [
        circle.centre + circle.radius * np.array([np.cos(angle), np.sin(angle)])
        for angle in (circle.begin_rad, circle.end_rad)
    ]
    start, end = (points[np.hypot(*(points - each).T).argmin()] for each in ends)
    return SwingArc(circle.centre, start, end, circle.radius)
