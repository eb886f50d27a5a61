"""Closed solids with curved faces: lathes, sweeps and rounded boxes, as triangles of a chosen fineness.

Metres, z up, right-handed, normals outwards. All are one skin over rings of points, closed by a fan at either end:
a solid of n rings of s points has 2 n s triangles, and the caller chooses both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from planner_core.model import FloatArray
from scenes_synthetic.solids import Point, Solid

_DECIMALS = 6


def skin(rings_m: FloatArray, ends_m: tuple[ArrayLike, ArrayLike] | None) -> Solid:
    """Close a stack of rings into a solid.

    rings_m : (R, N, 3), each ring counter-clockwise seen against the direction in which the stack grows.
    ends_m : the points where the fans below the first and above the last ring meet; None joins the last ring to the
        first, as a torus does.
    """
    n_rings, n, _ = rings_m.shape
    j = np.arange(n)
    following = np.roll(j, -1)
    lower = np.arange(n_rings if ends_m is None else n_rings - 1)[:, None] * n
    upper = (lower + n) % (n_rings * n)
    a, b, c, d = lower + j, lower + following, upper + following, upper + j
    triangles = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    vertices = rings_m.reshape(-1, 3)
    if ends_m is not None:
        low, high = n_rings * n, n_rings * n + 1
        last = (n_rings - 1) * n
        triangles.append(np.stack([np.full(n, low), following, j], -1))
        triangles.append(np.stack([np.full(n, high), last + j, last + following], -1))
        vertices = np.vstack([vertices, np.asarray(ends_m, dtype=np.float64)])
    return Solid(np.round(vertices, _DECIMALS) + 0.0, np.concatenate(triangles).astype(np.int32))


def lathe(
    profile_m: Sequence[tuple[float, float]],
    *,
    n_sides: int,
    at_m: Point = (0.0, 0.0, 0.0),
    stretch: tuple[float, float] = (1.0, 1.0),
) -> Solid:
    """Turn a profile of (radius, height) about the vertical through `at_m`.

    profile_m : material on the left of its direction. It begins and ends on the axis (radius 0), as a vase does: up
        outside, over the rim, down inside; or it never touches the axis and is a closed loop, as a tyre is.
    stretch : factors for x and y, for oval things.
    """
    profile = np.asarray(profile_m, dtype=np.float64)
    on_axis = profile[:, 0] == 0.0
    inner = profile[~on_axis]
    if on_axis.any() and not (on_axis[0] and on_axis[-1] and on_axis.sum() == 2):
        raise ValueError(f"profile meets the axis at points {np.flatnonzero(on_axis)}, expected the first and the last")
    angle = np.arange(n_sides) * 2 * np.pi / n_sides
    rings = np.empty((len(inner), n_sides, 3))
    rings[:, :, 0] = inner[:, :1] * np.cos(angle) * stretch[0]
    rings[:, :, 1] = inner[:, :1] * np.sin(angle) * stretch[1]
    rings[:, :, 2] = inner[:, 1:]
    centre = np.asarray(at_m)
    if not on_axis.any():
        return skin(rings + centre, None)
    up = np.array([0.0, 0.0, 1.0])
    return skin(rings + centre, (centre + profile[0, 1] * up, centre + profile[-1, 1] * up))


def cylinder(at_m: Point, radius_m: float, height_m: float, *, n_sides: int) -> Solid:
    """Build an upright prism of `n_sides` on the circle about `at_m`, the middle of its foot."""
    return lathe([(0.0, 0.0), (radius_m, 0.0), (radius_m, height_m), (0.0, height_m)], n_sides=n_sides, at_m=at_m)


def ellipsoid(at_m: Point, radii_m: Point, *, n_sides: int, n_rings: int) -> Solid:
    """Build an ellipsoid about its middle `at_m`."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, n_rings + 2)
    inside = [(float(np.cos(t)), float(radii_m[2] * np.sin(t))) for t in angle[1:-1]]
    profile = [(0.0, -radii_m[2]), *inside, (0.0, radii_m[2])]
    return lathe(profile, n_sides=n_sides, at_m=at_m, stretch=(radii_m[0], radii_m[1]))


def circle(radius_m: float, n_sides: int) -> FloatArray:
    """(n_sides, 2) corners of a regular polygon, counter-clockwise: the outline of a pipe."""
    angle = (np.arange(n_sides) + 0.5) * 2 * np.pi / n_sides
    corners: FloatArray = radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return corners


def rectangle(width_m: float, height_m: float) -> FloatArray:
    """(4, 2) corners about the origin, counter-clockwise: the outline of a duct or a bent sheet."""
    x, y = width_m / 2, height_m / 2
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]], dtype=np.float64)


def rounded_rectangle(width_m: float, depth_m: float, radius_m: float, *, n_corner: int) -> FloatArray:
    """(4 (n_corner + 1), 2) points about the origin, counter-clockwise, `n_corner` chords a corner."""
    turn = np.linspace(0.0, np.pi / 2, n_corner + 1)
    points = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angle = turn + quarter * np.pi / 2
        middle = np.array([sx * (width_m / 2 - radius_m), sy * (depth_m / 2 - radius_m)])
        points.append(middle + radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(points)


def sweep(path_m: ArrayLike, outline_m: FloatArray) -> Solid:
    """Draw a closed outline along a path, square to it; it does not twist.

    path_m : (M, 3). outline_m : (N, 2) star-shaped about the origin, counter-clockwise, looking back along the path:
        first coordinate to the path's left, second up (towards +y where the path starts straight up or down).
    """
    path = np.asarray(path_m, dtype=np.float64)
    steps = np.diff(path, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    tangent = np.vstack([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0]) if abs(tangent[0, 2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    rings = np.empty((len(path), len(outline_m), 3))
    for i, (point, along) in enumerate(zip(path, tangent, strict=True)):
        left = np.cross(up, along)
        left /= np.linalg.norm(left)
        up = np.cross(along, left)  # carried on from ring to ring, so that a path may turn any way
        rings[i] = point + outline_m[:, :1] * left + outline_m[:, 1:] * up
    return skin(rings, (path[0], path[-1]))


def bent(path_m: Sequence[Point], radius_m: float, *, n_bend: int) -> FloatArray:
    """(M, 3) path with its corners rounded to arcs of `n_bend` chords; the ends stay."""
    corners = np.asarray(path_m, dtype=np.float64)
    points = [corners[:1]]
    for before, corner, after in zip(corners[:-2], corners[1:-1], corners[2:], strict=True):
        to_start = (before - corner) / np.linalg.norm(before - corner)
        to_end = (after - corner) / np.linalg.norm(after - corner)
        half = np.arccos(np.clip(to_start @ to_end, -1.0, 1.0)) / 2
        cut = radius_m / np.tan(half)
        middle = corner + (to_start + to_end) / np.linalg.norm(to_start + to_end) * radius_m / np.sin(half)
        first, last = corner + cut * to_start - middle, corner + cut * to_end - middle
        total = np.pi - 2 * half
        share = np.linspace(0.0, 1.0, n_bend + 1)[:, None]
        points.append(middle + (np.sin((1 - share) * total) * first + np.sin(share * total) * last) / np.sin(total))
    return np.concatenate([*points, corners[-1:]])


def pipe(path_m: ArrayLike, radius_m: float, *, n_sides: int) -> Solid:
    """Build a solid bar of round section along a path (M, 3): legs, rails, pipes."""
    return sweep(path_m, circle(radius_m, n_sides))


def rounded_box(low_m: Point, high_m: Point, radius_m: float, *, n_corner: int = 2, n_edge: int = 2) -> Solid:
    """Build a box between two corners whose upright edges are round, and the upper and lower ones softer.

    radius_m : of the upright edges; the others have seven tenths of it.
    """
    low, high = np.asarray(low_m), np.asarray(high_m)
    width, depth, height = high - low
    edge = min(0.7 * radius_m, 0.45 * height)
    turn = np.linspace(0.0, np.pi / 2, n_edge + 1)
    inset = edge * (1 - np.sin(turn))
    rise = edge * (1 - np.cos(turn))
    insets, heights = np.concatenate([inset, inset[::-1]]), np.concatenate([rise, (height - rise)[::-1]])
    rings = []
    for d, z in zip(insets, heights, strict=True):
        flat = rounded_rectangle(width - 2 * d, depth - 2 * d, radius_m - d, n_corner=n_corner)
        rings.append(np.column_stack([flat, np.full(len(flat), z)]))
    foot = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    head = foot + np.array([0.0, 0.0, height])
    return skin(np.stack(rings) + foot, (foot, head))


def copies(solid: Solid, at_m: ArrayLike, scale: ArrayLike = 1.0) -> Solid:
    """Join many copies of one solid: books, balusters, keys, fins.

    at_m : (B, 3) where each copy's origin goes. scale : factors that broadcast to (B, 3). Copies share no edge.
    """
    at = np.asarray(at_m, dtype=np.float64)
    factor = np.broadcast_to(np.asarray(scale, dtype=np.float64), at.shape)
    vertices = solid.vertices_m * factor[:, None, :] + at[:, None, :]
    starts = np.arange(len(at))[:, None, None] * len(solid.vertices_m)
    triangles = (solid.triangles + starts).reshape(-1, 3).astype(np.int32)
    return Solid(np.round(vertices.reshape(-1, 3), _DECIMALS) + 0.0, triangles)
