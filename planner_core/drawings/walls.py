"""Walls of a floor plan: outlines and filled areas -> the area that walls cover, and its straight pieces.

    |         |            outlines are cut at their crossings; loose ends that face each other at a
    |  room   |            wall's thickness get a line between them; what lines close is a face;
    |         |            faces thinner than `thickest_m` are wall, all others are rooms or outdoors
    +---------+
    =====face=====

Plan coordinates (2,), metres. Areas are shapely polygons on a grid of `GRID_M`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from planner_core.model import FloatArray

GRID_M = 1e-4
"""Coordinates are rounded to it, so that what meets in a drawing meets here."""
THICKEST_M = 0.56
"""Walls are thinner; cupboards, at 0.6 m, are deeper."""
THINNEST_M = 0.04
SNAP_M = 0.03
"""Lines that miss each other by less were meant to meet."""
INTERRUPTED_M = 0.45
"""Lines go on behind a gap like this: dashed ones, and those that other things are drawn over."""
_PAIR_M, _SAME_WAY, _ONE_SIDED_M = 0.4, 0.9998, 1.6
"""Lines that close no face are pairs up to this distance; a wall goes on where one of its lines does and the other is
interrupted by less, as doors interrupt both."""
_LEAST_WALL_M2 = 0.004
_ROOM_M, _WIDE_SHARE = 0.95, 0.4
"""Rooms are this wide nearly everywhere."""
_PARALLEL = 0.995
"""Cosine of the angle between lines that count as parallel."""
_LEAST_BIT_M = 0.01
"""Bits of walls are wider: narrower ones are what rounding leaves."""
_LEAST_EDGE_M = 0.25
"""Edges from here on are sides of straight pieces; what only shorter ones bound stays in one piece."""
_MOST_PIECES = 20_000


def fills_area(rings_of_fill: Sequence[Sequence[FloatArray]]) -> Any:
    """The union of filled areas, each of rings (K, 2) by the even-odd rule."""
    areas = []
    for rings in rings_of_fill:
        area: Any = shapely.Polygon()
        for ring in rings:
            if len(ring) >= 4:
                filled = polygons_of(
                    shapely.make_valid(shapely.Polygon(ring))
                )  # rings that touch themselves: lines, too
                area = shapely.symmetric_difference(area, filled, grid_size=GRID_M)
        areas.append(area)
    return polygons_of(shapely.union_all(areas, grid_size=GRID_M)) if areas else shapely.MultiPolygon()


def outlined_area(lines: Sequence[FloatArray], *, thickest_m: float = THICKEST_M) -> Any:
    """The area of walls that are drawn by their outlines (K, 2), closed or not."""
    return polygons_of(shapely.union_all(thin_faces(lines, thickest_m=thickest_m), grid_size=GRID_M))


def thin_faces(lines: Sequence[FloatArray], *, thickest_m: float = THICKEST_M) -> list[Any]:
    """Faces between lines (K, 2) that are as thin as walls, and strips between lines that close none (shapely)."""
    segments = segments_of(lines)
    if not len(segments):
        return []
    noded = shapely.union_all(shapely.linestrings(segments), grid_size=GRID_M)
    ends = segments_of([shapely.get_coordinates(line) for line in shapely.get_parts(noded)])
    extra = _closing_lines(ends, thickest_m)
    if len(extra):
        noded = shapely.union_all([noded, *shapely.linestrings(extra)], grid_size=GRID_M)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    # Hairlines between nearly equal lines are no walls.
    walls = [face for face in faces if is_thin(face, thickest_m) and wide_share(face, THINNEST_M) > 0.0]
    closed = shapely.union_all(walls, grid_size=GRID_M)
    left = shapely.difference(shapely.union_all(shapely.linestrings(segments)), shapely.buffer(closed, SNAP_M))
    alone = segments_of([shapely.get_coordinates(line) for line in shapely.get_parts(left)])
    return [*walls, *_strips_between(alone, thickest_m)]


def lines_without_walls(lines: Sequence[FloatArray], walls: Any) -> Any:
    """The parts of lines (K, 2) that bound no wall of an area, nor lie in it (shapely)."""
    strings = shapely.union_all(shapely.linestrings(segments_of(lines)), grid_size=GRID_M)
    return shapely.difference(strings, shapely.buffer(walls, SNAP_M))


def _strips_between(segments: FloatArray, thickest_m: float) -> list[Any]:
    """Strips between parallel lines that no face is closed by; each line has its wall on the nearer side.

    Where one of both lines goes on, the wall does, as far as `_ONE_SIDED_M`.
    """
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(along[:, 0], along[:, 1])
    segments, along, length = (each[length >= _LEAST_EDGE_M] for each in (segments, along, length))
    if len(segments) < 2:
        return []
    tree = shapely.STRtree(shapely.linestrings(segments))
    direction = along / length[:, None]
    apart_m = thickest_m if thickest_m > THICKEST_M else _PAIR_M
    strips = []
    for row in np.argsort(-length, kind="stable").tolist():
        across = np.array([-direction[row, 1], direction[row, 0]])
        near = tree.query(tree.geometries[row], predicate="dwithin", distance=apart_m)
        near = near[(np.abs(direction[near] @ direction[row]) > _SAME_WAY) & (near != row)]
        ends = np.sort((segments[near] - segments[row, 0]) @ direction[row], axis=1).clip(0.0, length[row])
        off = ((segments[near] - segments[row, 0]) @ across).mean(axis=1)
        is_pair = (np.abs(off) >= THINNEST_M) & (ends[:, 1] - ends[:, 0] >= _LEAST_EDGE_M)
        off, ends = off[is_pair], ends[is_pair]
        if not off.size:
            continue
        thickness = off[np.argmin(np.abs(off))]
        same = np.abs(off - thickness) <= SNAP_M
        spans = ends[same][np.argsort(ends[same, 0], kind="stable")]
        begin, end = spans[0]
        merged = []
        for low, high in [*spans[1:].tolist(), (np.inf, np.inf)]:
            if low - end > _ONE_SIDED_M:
                merged.append((begin, end))
                begin = low
            end = max(end, high)
        for low, high in merged:
            # Up to its end beyond the other line's, where both turn the corner.
            low, high = 0.0 if low <= thickest_m else low, length[row] if length[row] - high <= thickest_m else high
            ring = [segments[row, 0] + s * direction[row] for s in (low, high)]
            strips.append(shapely.Polygon([*ring, ring[1] + thickness * across, ring[0] + thickness * across]))
    return strips


def is_thin(area: Any, width_m: float) -> bool:
    """Whether an area is thinner than a width on average, and at few places as wide as a room.

    Junctions are wider than the walls that meet there, and so are the shafts that some outlines enclose with them.
    """
    return mean_width_m(area) <= width_m and wide_share(area, _ROOM_M) < _WIDE_SHARE


def mean_width_m(area: Any) -> float:
    """The width of the rectangle of an area's size and outline."""
    half = 0.5 * area.length
    return float(0.5 * (half - np.sqrt(max(half * half - 4.0 * area.area, 0.0))))


def wide_share(area: Any, width_m: float) -> float:
    """The share of an area that circles of a diameter inside it cover."""
    core = shapely.buffer(area, -0.5 * width_m)
    if core.is_empty:
        return 0.0
    return float(shapely.intersection(shapely.buffer(core, 0.5 * width_m), area).area / area.area)


def polygons_of(geometry: Any) -> Any:
    """The polygons of any geometry as one MultiPolygon, without slivers."""
    parts = shapely.get_parts(shapely.get_parts(geometry)) if geometry.geom_type == "GeometryCollection" else None
    parts = shapely.get_parts(geometry) if parts is None else parts
    return shapely.MultiPolygon([p for p in parts if p.geom_type == "Polygon" and p.area > _LEAST_WALL_M2])


def segments_of(lines: Sequence[FloatArray]) -> FloatArray:
    """(M, 2, 2) straight parts of polylines (K, 2) that are longer than the grid."""
    pieces = [np.stack([line[:-1], line[1:]], axis=1) for line in lines if len(line) > 1]
    if not pieces:
        return np.empty((0, 2, 2))
    segments = np.round(np.concatenate(pieces)[..., :2] / GRID_M) * GRID_M
    along = segments[:, 1] - segments[:, 0]
    return segments[np.hypot(along[:, 0], along[:, 1]) > 2.0 * GRID_M]


def _closing_lines(segments: FloatArray, thickest_m: float) -> FloatArray:
    """(E, 2, 2) lines that close outlines: from a loose end to one that faces it, or to a line just missed."""
    points, at = np.unique(segments.reshape(-1, 2), axis=0, return_inverse=True)
    at = at.reshape(-1, 2)
    loose = np.flatnonzero(np.bincount(at.reshape(-1), minlength=len(points)) == 1)
    if not len(loose):
        return np.empty((0, 2, 2))
    of_end = {int(end): row for row, pair in enumerate(at.tolist()) for end in pair}
    rows = np.array([of_end[int(end)] for end in loose])
    inner = points[np.where(at[rows, 0] == loose, at[rows, 1], at[rows, 0])]
    here = points[loose]
    away = here - inner
    away /= np.maximum(np.hypot(away[:, 0], away[:, 1]), GRID_M)[:, None]
    tree = shapely.STRtree(shapely.linestrings(segments))
    extra: list[FloatArray] = []
    near = shapely.STRtree(shapely.points(here))
    closed = np.zeros(len(loose), dtype=bool)
    for number in range(len(loose)):
        # 1. a line that it just misses, ahead of it
        ahead = shapely.LineString([here[number] + GRID_M * away[number], here[number] + SNAP_M * away[number]])
        hits = [row for row in tree.query(ahead, predicate="intersects").tolist() if row != rows[number]]
        if hits:
            extra.append(np.stack([here[number], here[number] + SNAP_M * away[number]]))
            closed[number] = True
    for number in range(len(loose)):
        if closed[number]:
            continue
        # 2. the nearest loose end: across, of a line that runs the same way and ends there, too; or ahead, of the rest
        #    of a line that something else is drawn over
        found = near.query(shapely.Point(here[number]).buffer(1.02 * thickest_m), predicate="intersects")
        best, best_m = -1, np.inf
        for other in found.tolist():
            across = here[other] - here[number]
            gap_m = float(np.hypot(*across))
            if other == number or closed[other] or gap_m < GRID_M or gap_m >= best_m:
                continue
            is_joint = gap_m <= SNAP_M
            is_cap = away[number] @ away[other] > _PARALLEL and abs(across @ away[number]) < 0.2 * gap_m + SNAP_M
            is_rest = gap_m <= INTERRUPTED_M and away[number] @ across > _PARALLEL * gap_m
            is_rest = is_rest and away[number] @ away[other] < -_PARALLEL
            if is_joint or is_cap or is_rest:
                best, best_m = other, gap_m
        if best >= 0:
            extra.append(np.stack([here[number], here[best]]))
            closed[[number, best]] = True
    return np.array(extra).reshape(-1, 2, 2)


# --------------------------------------------------------------------------------------------- pieces
@dataclass(frozen=True)
class WallPiece:
    """A part of the walls that one element stands for. area : shapely Polygon; thickness_m : NaN where it varies."""

    area: Any
    thickness_m: float


def straight_pieces(area: Any, *, thickest_m: float = THICKEST_M) -> list[WallPiece]:
    """Divide the area of walls into straight pieces, the longest first, and what is left of curves and corners.

    The pieces cover the area and do not overlap.
    """
    pieces: list[WallPiece] = []
    for polygon in shapely.get_parts(area):
        pieces += _pieces_of(polygon, thickest_m)
    return sorted(pieces, key=lambda piece: tuple(np.round(shapely.bounds(piece.area), 3).tolist()))


def _pieces_of(polygon: Any, thickest_m: float) -> list[WallPiece]:
    left: Any = shapely.simplify(polygon, 2.0 * GRID_M)
    pieces: list[WallPiece] = []
    bits: list[Any] = []
    spent: set[tuple[float, ...]] = set()
    while not left.is_empty and len(pieces) < _MOST_PIECES:
        edges = edges_of(left)
        length = np.hypot(*(edges[:, 1] - edges[:, 0]).T)
        order = np.argsort(-length, kind="stable")
        strip = None
        for row in order.tolist():
            if length[row] < _LEAST_EDGE_M:
                break
            key = tuple(np.round(edges[row], 3).reshape(-1).tolist())
            if key in spent:
                continue
            spent.add(key)
            thickness = _thickness(left, edges[row], thickest_m)
            if THINNEST_M / 2 <= thickness <= length[row] + thickest_m:
                strip = _strip(edges[row], thickness)
                break
        if strip is None:
            break
        cut = polygons_of(shapely.intersection(left, strip, grid_size=GRID_M))
        if not cut.is_empty:
            pieces += [WallPiece(part, thickness) for part in shapely.get_parts(cut)]
            rest = shapely.difference(left, strip, grid_size=GRID_M)
            left = polygons_of(rest)
            bits += shapely.get_parts(shapely.difference(rest, left)).tolist()
    pieces += [WallPiece(part, float("nan")) for part in shapely.get_parts(polygons_of(left))]
    return _with_bits(pieces, [bit for bit in bits if bit.area > 0.0 and mean_width_m(bit) >= _LEAST_BIT_M])


def _with_bits(pieces: list[WallPiece], bits: Sequence[Any]) -> list[WallPiece]:
    """Pieces with what is too small for one of its own, such as corners of thin walls, each added to one beside it."""
    for bit in bits:
        near = shapely.STRtree([piece.area for piece in pieces]).query(bit, predicate="dwithin", distance=2.0 * GRID_M)
        around = shapely.buffer(bit, 2.0 * GRID_M)
        beside = {row: shapely.intersection(pieces[row].area, around).area for row in near.tolist()}
        for row in sorted(beside, key=lambda row: -beside[row]):
            whole = shapely.union_all([pieces[row].area, bit], grid_size=GRID_M)
            if whole.geom_type == "Polygon":
                pieces[row] = replace(pieces[row], area=whole)
                break
    return pieces


def edges_of(area: Any) -> FloatArray:
    """(E, 2, 2) edges of an area, its inside on their left."""
    edges = []
    for polygon in shapely.get_parts(area):
        oriented = shapely.orient_polygons(polygon)
        for ring in (oriented.exterior, *oriented.interiors):
            corners = shapely.get_coordinates(ring)
            edges.append(np.stack([corners[:-1], corners[1:]], axis=1))
    return np.concatenate(edges) if edges else np.empty((0, 2, 2))


def _inward(edge: FloatArray) -> FloatArray:
    along = edge[1] - edge[0]
    along = along / np.hypot(*along)
    return np.array([-along[1], along[0]])


def _strip(edge: FloatArray, thickness_m: float) -> Any:
    """The rectangle on the inside of an edge; a hair wider, so that rounding leaves no slivers."""
    inward = _inward(edge)
    low, high = -GRID_M * inward, (thickness_m + GRID_M) * inward
    return shapely.Polygon([edge[0] + low, edge[1] + low, edge[1] + high, edge[0] + high])


def _thickness(area: Any, edge: FloatArray, thickest_m: float) -> float:
    """The median distance from points of an edge through the area to its other side; junctions apart."""
    inward = _inward(edge)
    share = (np.arange(15) + 0.5) / 15
    foot = edge[0] + share[:, None] * (edge[1] - edge[0]) + 10 * GRID_M * inward
    rays = shapely.linestrings(np.stack([foot, foot + 2.0 * thickest_m * inward], axis=1))
    through = shapely.intersection(rays, area)
    depth = []
    for ray, start in zip(through, foot, strict=True):
        parts = [part for part in shapely.get_parts(ray) if part.geom_type == "LineString"]
        nearest = min(parts, key=lambda part: part.distance(shapely.Point(start)), default=None)
        if nearest is not None:
            depth.append(nearest.length + 10 * GRID_M)
    thin = [value for value in depth if value <= thickest_m]
    return float(np.median(thin)) if len(thin) * 3 >= len(depth) and thin else float("inf")
