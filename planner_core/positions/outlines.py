"""Polygons in plan: what lies over one, its area, whether it crosses itself. Corners (K, 2) in metres, any frame."""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray

LEAST_AREA_M2 = 1e-4
"""An outline that encloses less is a slip: a square centimetre."""
MOST_CORNERS = 10_000


def checked_outline(corners: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Return corners of an outline, the first not again as the last, as GIS programs write it.

    Raises
    ------
    RequirementError
        Fewer than three or too many corners, one that is there twice, sides that cross, or no area.
    """
    if len(corners) > 1 and corners[0] == corners[-1]:
        corners = corners[:-1]
    if not 3 <= len(corners) <= MOST_CORNERS:
        raise RequirementError(
            f"got an outline of {len(corners)} corners, expected 3 to {MOST_CORNERS}; give them as [[x, y], ...]"
        )
    seen: dict[tuple[float, float], int] = {}
    for number, corner in enumerate(corners, start=1):
        if corner in seen:
            raise RequirementError(
                f"got corner {number} where corner {seen[corner]} is, expected corners that all differ; take one out"
            )
        seen[corner] = number
    outline_m = np.array(corners)
    if crossing := crossing_sides(outline_m):
        raise RequirementError(
            f"got an outline that crosses itself, its sides {crossing[0] + 1} and {crossing[1] + 1}, expected one that "
            "does not; give its corners in order"
        )
    if area_of_outline_m2(outline_m) < LEAST_AREA_M2:
        raise RequirementError(
            "got an outline without area, expected one around some area; give its corners in order, in metres"
        )
    return corners


def over_polygon(points_m: FloatArray, corners_m: FloatArray) -> BoolArray:
    """(N,) bool, whether points (N, 2) lie inside the polygon, by crossings of a ray along x.

    A point on an edge lies inside of one of two polygons that share the edge, and only of one.
    """
    inside = np.zeros(len(points_m), dtype=np.bool_)
    x, y = points_m[:, 0], points_m[:, 1]
    for (ax, ay), (bx, by) in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        if ay == by:
            continue
        (lx, ly), (hx, hy) = ((ax, ay), (bx, by)) if ay < by else ((bx, by), (ax, ay))
        crosses = (y >= ly) & (y < hy)
        inside ^= crosses & (x < lx + (y - ly) * ((hx - lx) / (hy - ly)))
    return inside


def crossing_sides(corners_m: FloatArray) -> tuple[int, int] | None:
    """Numbers, from 0, of the first two sides that cross, each inside the other; None where none do."""
    start, end = corners_m, np.roll(corners_m, -1, axis=0)
    for number in range(len(corners_m) - 2):
        later = slice(number + 2, len(corners_m))
        a, b, c, d = start[number], end[number], start[later], end[later]
        # Strictly on different sides of each other: neighbours, which share a corner, are not.
        crosses = (_turn(a, b, c) * _turn(a, b, d) < 0) & (_turn(c, d, a) * _turn(c, d, b) < 0)
        if crosses.any():
            return number, number + 2 + int(np.argmax(crosses))
    return None


def area_of_outline_m2(corners_m: FloatArray) -> float:
    """Area of a polygon (K, 2) that does not cross itself, whichever way its corners go around."""
    # About the first corner: far from the origin, products of coordinates have no digits left for the area.
    x, y = (corners_m - corners_m[0]).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Twice the area of triangles a, b, c, positive where they turn left."""
    left: FloatArray = (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
    right: FloatArray = (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
    return left - right
