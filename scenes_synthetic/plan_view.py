"""Visible areas in rooms that are a plan extruded by a height, computed from the plan alone: truth for scans.

Walls reach from floor to ceiling, so a station sees a point of wall, floor or ceiling exactly where the straight line
between both in the plan is free. The plan's part is done in rational numbers, without rounding: between two
neighbouring directions to corners, one edge alone is the nearest. Range cuts what is left by a circle, in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cmp_to_key

from scenes_synthetic.solids import Point

Exact = tuple[Fraction, Fraction]
Flat = tuple[float, float]


@dataclass(frozen=True)
class Edge:
    """A wall in the plan: metres, the part that it belongs to; which side is the room's does not matter."""

    part: str
    start: Exact
    end: Exact


@dataclass(frozen=True)
class Sight:
    """A stretch of an edge that a spot sees; with the spot, it spans a triangle of visible floor."""

    edge: Edge
    start: Exact
    end: Exact


def exact(corner_m: Flat) -> Exact:
    """Return a corner as the decimals that were written, not as their nearest binary fractions."""
    return Fraction(repr(float(corner_m[0]))), Fraction(repr(float(corner_m[1])))


def edges_of(outline_m: Sequence[Flat], parts: Sequence[str]) -> list[Edge]:
    """Edges of an outline; edge k, of `parts[k]`, goes from corner k to the next."""
    corners = [exact(corner) for corner in outline_m]
    return [Edge(p, a, b) for p, a, b in zip(parts, corners, [*corners[1:], corners[0]], strict=True)]


def sights(edges: Sequence[Edge], spot: Exact) -> list[Sight]:
    """Return what a spot strictly inside the edges sees, counter-clockwise. Exact; edges must close the room."""
    directions = {_minus(corner, spot) for edge in edges for corner in (edge.start, edge.end)}
    turned = sorted(directions, key=cmp_to_key(_by_angle))
    # Corners in one direction count once.
    rays = [d for d, before in zip(turned, [turned[-1], *turned[:-1]], strict=True) if _by_angle(d, before) != 0]
    found = []
    for ray, following in zip(rays, [*rays[1:], rays[0]], strict=True):
        between = (ray[0] + following[0], ray[1] + following[1])
        _, edge = min(((t, e) for e in edges if (t := _hit(e, spot, between)) is not None), key=lambda hit: hit[0])
        found.append(Sight(edge, _on_line(edge, spot, ray), _on_line(edge, spot, following)))
    return found


def floor_area(seen: Sequence[Sight], spot: Exact) -> Fraction:
    """Area of the plan that a spot sees, exactly, in square metres."""
    return sum((_cross(_minus(s.start, spot), _minus(s.end, spot)) for s in seen), Fraction(0)) / 2


def visible_areas_m2(
    edges: Sequence[Edge], station_m: Point, height_m: float, *, range_m: float = math.inf
) -> dict[str, float]:
    """Areas by part that a scanner at `station_m` sees in a room with its floor at 0 and its ceiling at `height_m`.

    The slabs are called `Floor` and `Ceiling`. Parts of which nothing is seen are left out.
    """
    x, y, z = station_m
    spot = exact((x, y))
    seen = sights(edges, spot)
    areas: dict[str, float] = {}
    for name, distance in (("Floor", z), ("Ceiling", height_m - z)):
        areas[name] = (
            float(floor_area(seen, spot)) if math.isinf(range_m) else _slab_area(seen, spot, distance, range_m)
        )
    for sight in seen:
        area = _wall_area(sight, spot, z, height_m, range_m)
        areas[sight.edge.part] = areas.get(sight.edge.part, 0.0) + area
    return {name: area for name, area in areas.items() if area > 0.0}


def _slab_area(seen: Sequence[Sight], spot: Exact, distance_m: float, range_m: float) -> float:
    """Visible floor within the circle in which the sphere of the range cuts it."""
    if math.isinf(range_m):
        return float(floor_area(seen, spot))
    if distance_m >= range_m:
        return 0.0
    radius = math.sqrt(range_m**2 - distance_m**2)
    return sum(in_circle(_flat(_minus(s.start, spot)), _flat(_minus(s.end, spot)), radius) for s in seen)


def _wall_area(sight: Sight, spot: Exact, z_m: float, height_m: float, range_m: float) -> float:
    """Visible part of a wall: a rectangle, cut by the circle in which the sphere of the range cuts its plane."""
    start, end = _flat(_minus(sight.start, spot)), _flat(_minus(sight.end, spot))
    length = math.dist(start, end)
    if math.isinf(range_m) or length == 0.0:
        return length * height_m
    along = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    left = start[0] * along[0] + start[1] * along[1]
    distance = abs(start[0] * along[1] - start[1] * along[0])
    if distance >= range_m:
        return 0.0
    radius = math.sqrt(range_m**2 - distance**2)
    right, low, high = left + length, -z_m, height_m - z_m
    corners = [(left, low), (right, low), (right, high), (left, high)]
    return sum(in_circle(a, b, radius) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))


def in_circle(a: Flat, b: Flat, radius: float) -> float:
    """Signed area that the triangle (0, a, b) and the circle of `radius` about 0 have in common.

    Summed over the edges of any polygon, it is the polygon's area inside the circle.
    """
    run = (b[0] - a[0], b[1] - a[1])
    square, half = run[0] ** 2 + run[1] ** 2, a[0] * run[0] + a[1] * run[1]
    inside = half**2 - square * (a[0] ** 2 + a[1] ** 2 - radius**2)
    if square == 0.0 or inside <= 0.0:
        return _sector(a, b, radius)
    enter = max(0.0, (-half - math.sqrt(inside)) / square)
    leave = min(1.0, (-half + math.sqrt(inside)) / square)
    if enter >= leave:
        return _sector(a, b, radius)
    p = (a[0] + enter * run[0], a[1] + enter * run[1])
    q = (a[0] + leave * run[0], a[1] + leave * run[1])
    before = _sector(a, p, radius) if enter > 0.0 else 0.0
    after = _sector(q, b, radius) if leave < 1.0 else 0.0
    return before + (p[0] * q[1] - p[1] * q[0]) / 2 + after


def _sector(a: Flat, b: Flat, radius: float) -> float:
    return radius**2 / 2 * math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def _hit(edge: Edge, spot: Exact, direction: Exact) -> Fraction | None:
    """How far along `direction`, in its lengths, a ray from `spot` meets the edge; None where it does not."""
    run, away = _minus(edge.end, edge.start), _minus(edge.start, spot)
    across = _cross(direction, run)
    if across == 0:
        return None
    t, share = _cross(away, run) / across, _cross(away, direction) / across
    return t if t > 0 and 0 <= share <= 1 else None


def _on_line(edge: Edge, spot: Exact, direction: Exact) -> Exact:
    """Where the ray meets the edge's line, which it does: it bounds a sector in which the edge is nearest."""
    run, away = _minus(edge.end, edge.start), _minus(edge.start, spot)
    t = _cross(away, run) / _cross(direction, run)
    return spot[0] + t * direction[0], spot[1] + t * direction[1]


def _by_angle(a: Exact, b: Exact) -> int:
    """Order of directions from +x, counter-clockwise; 0 where they are the same."""
    half_a, half_b = (int(d[1] < 0 or (d[1] == 0 and d[0] < 0)) for d in (a, b))
    if half_a != half_b:
        return half_a - half_b
    turn = _cross(a, b)
    return (turn < 0) - (turn > 0)


def _minus(a: Exact, b: Exact) -> Exact:
    return a[0] - b[0], a[1] - b[1]


def _cross(a: Exact, b: Exact) -> Fraction:
    return a[0] * b[1] - a[1] * b[0]


def _flat(a: Exact) -> Flat:
    return float(a[0]), float(a[1])
