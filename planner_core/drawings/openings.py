"""Openings of a floor plan: gaps in the walls and symbols over them -> doors, windows and open passages.

            cap                 cap
    ========|                   |========      a cap is the end of a wall; ahead of it lies the gap, up to the next
     wall   |<------ gap ------>|  wall        wall; the symbols that are drawn in the gap decide what it is
    ========|                   |========

Where outlines run on under a door or a window, the symbol's width is cut out of the wall. Plan coordinates, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
import shapely

from planner_core.drawings.arcs import SwingArc
from planner_core.drawings.walls import GRID_M, THICKEST_M, THINNEST_M, edges_of, polygons_of
from planner_core.model import FloatArray
from planner_core.model.arrays import dots


class OpeningKind(StrEnum):
    """What fills an opening."""

    DOOR = "door"
    WINDOW = "window"
    PASSAGE = "passage"
    """Nothing, as far as the drawing shows."""


@dataclass(frozen=True)
class SymbolLines:
    """What is drawn for one door or window.

    lines : shapely geometry of its strokes. swings : of a door's leaves.
    """

    kind: OpeningKind
    lines: Any
    name: str = ""
    swings: tuple[SwingArc, ...] = ()
    is_loose: bool = False
    """It may be something else: it counts in the middle of a gap, from end to end, and cuts no wall."""

    @property
    def leaves(self) -> list[Any]:
        """Shapely lines, along some of which leaves lie when they are shut."""
        return [shapely.LineString([arc.centre, end]) for arc in self.swings for end in (arc.start, arc.end)]

    @property
    def reach(self) -> Any:
        """Shapely geometry of its strokes and of its leaf, open and shut."""
        return shapely.union_all([self.lines, *self.leaves])


@dataclass(frozen=True)
class Opening:
    """An opening between two ends of walls.

    corners_m : (4, 2) float64, counter-clockwise, from the corner of one jamb along the opening: 0-1 and 2-3 lie in the
    wall's faces, 1-2 and 3-0 are the jambs.
    """

    kind: OpeningKind
    corners_m: FloatArray
    name: str = ""
    is_doubtful: bool = False
    """No symbol shows what it is."""

    @property
    def area(self) -> Any:
        """Shapely polygon."""
        return shapely.Polygon(self.corners_m)

    @property
    def width_m(self) -> float:
        """Between the jambs."""
        return float(np.hypot(*(self.corners_m[1] - self.corners_m[0])))

    @property
    def thickness_m(self) -> float:
        """Of the wall."""
        return float(np.hypot(*(self.corners_m[2] - self.corners_m[1])))


NARROWEST_M = 0.4
_WIDEST_M = {OpeningKind.DOOR: 6.0, OpeningKind.WINDOW: 15.0, OpeningKind.PASSAGE: 1.6}
"""Garages have the widest doors; a passage without any symbol is no wider than a double door."""
_REACH_M = 0.05
"""Frames and sills stand out of the wall by so much."""
_LEAST_DRAWN_M = 0.05
_LEAST_SPAN_SHARE = 0.7
"""Of the width of a gap that the lines in it span: a door at one end of a room's open side does not fill that."""
_DENT_M = 0.015
"""Ends of walls are straight to this, as traced ones have dents where other lines meet them."""
_SAME_SHARE = 0.3
_HINGE_M, _FRAME_M, _SHUT = 0.15, 0.3, 0.8
"""Hinges are so near to the gap, and leaves so much wider; cosine of the angle that a drawn arc may lack to the wall,
where lines cross it."""
_ON_WALL_SHARE = 0.5
_STEPS = 5


def openings_of(
    walls: Any, symbols: Sequence[SymbolLines], *, thickest_m: float = THICKEST_M
) -> tuple[list[Opening], Any]:
    """Find the openings in an area of walls that are no thicker.

    Returns
    -------
    The openings, from the lowest corner; and the walls without those that symbols cut out.
    """
    tree = shapely.STRtree([symbol.reach for symbol in symbols])
    found = [opening for corners in _gaps(walls, thickest_m) for opening in _filled(corners, symbols, tree)]
    in_gaps = {int(row) for opening in found if not opening.is_doubtful for row in _symbols_in(opening.area, tree)}
    alone = [each for row, each in enumerate(symbols) if row not in in_gaps and not each.is_loose]
    walls, cut = _cut_by_symbols(walls, alone, thickest_m)
    between = [o for each in alone if (o := _between_walls(walls, each, thickest_m)) is not None]
    return _once_each([*found, *cut, *between]), walls


def is_in_opening(symbol: SymbolLines, openings: Sequence[Opening]) -> bool:
    """Whether a symbol reaches into an opening."""
    return any(shapely.intersects(symbol.reach, _around(opening.area)) for opening in openings)


def _around(area: Any) -> Any:
    return shapely.buffer(area, _REACH_M, join_style="mitre")


def _symbols_in(area: Any, tree: Any) -> list[int]:
    """Numbers of the symbols that reach into an area."""
    return sorted(tree.query(_around(area), predicate="intersects").tolist())


def _gaps(walls: Any, thickest_m: float) -> list[FloatArray]:
    """Rectangles (4, 2) from the end of each wall to what is ahead of it, nearest first."""
    caps = _caps(walls, thickest_m)
    if not len(caps):
        return []
    reach_m = max(_WIDEST_M.values())
    along = caps[:, 1] - caps[:, 0]
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    boundary = shapely.STRtree(shapely.linestrings(edges_of(walls)))
    share = (np.arange(_STEPS) + 0.5) / _STEPS
    gaps = []
    for cap, away in zip(caps, outward, strict=True):
        foot = cap[0] + share[:, None] * (cap[1] - cap[0]) + _DENT_M * away
        rays = shapely.linestrings(np.stack([foot, foot + reach_m * away], axis=1))
        depth = np.full(_STEPS, np.inf)
        for row, edge in zip(*boundary.query(rays, predicate="intersects"), strict=True):
            hit = shapely.intersection(rays[row], boundary.geometries[edge])
            depth[row] = min(depth[row], float(shapely.distance(shapely.Point(foot[row]), hit)))
        middle = float(np.median(depth))
        if not np.isfinite(middle) or (np.abs(depth - middle) > 0.1).sum() > _STEPS // 2:
            continue
        width = middle + _DENT_M
        if width >= NARROWEST_M:
            gaps.append(np.stack([cap[1], cap[1] + width * away, cap[0] + width * away, cap[0]]))
    return sorted(gaps, key=lambda gap: (round(float(np.hypot(*(gap[1] - gap[0]))), 4), *gap[0].tolist()))


def _caps(walls: Any, thickest_m: float) -> FloatArray:
    """(C, 2, 2) edges that are ends of walls: as long as walls are thick, with square outer corners."""
    caps = []
    for polygon in shapely.get_parts(walls):
        oriented = shapely.orient_polygons(shapely.simplify(polygon, _DENT_M))
        for ring in (oriented.exterior, *oriented.interiors):
            corners = shapely.get_coordinates(ring)[:-1]
            after, before = np.roll(corners, -1, axis=0), np.roll(corners, 1, axis=0)
            last, step, following = corners - before, after - corners, np.roll(corners, -2, axis=0) - after
            length = np.hypot(step[:, 0], step[:, 1])
            turns = [
                np.degrees(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], dots(a, b)))
                for a, b in ((last, step), (step, following))
            ]
            is_cap = (length >= THINNEST_M) & (length <= thickest_m) & (turns[0] > 45.0) & (turns[1] > 45.0)
            caps += [np.stack([corners[row], after[row]]) for row in np.flatnonzero(is_cap)]
    return np.array(caps).reshape(-1, 2, 2)


def _filled(corners: FloatArray, symbols: Sequence[SymbolLines], tree: Any) -> list[Opening]:
    """What fills a gap, by the symbols drawn in it: doors by their swings, and in the rest what lines show."""
    gap = Opening(OpeningKind.PASSAGE, corners, is_doubtful=True)
    near = [symbols[row] for row in _symbols_in(gap.area, tree)]
    leaves = _leaf_spans(gap, near)
    if not leaves:
        opening = _by_lines(gap, near)
        return [] if opening is None else [opening]
    width_m = gap.width_m
    if width_m - sum(high - low for low, high, _ in leaves) < NARROWEST_M:
        return [replace(gap, kind=OpeningKind.DOOR, name=leaves[0][2], is_doubtful=False)]
    found = []
    begin = 0.0
    for low, high, name in [*leaves, (width_m, width_m, "")]:
        if low - begin >= NARROWEST_M:
            rest = _by_lines(_part(gap, begin, low), near)
            if rest is None or rest.kind == OpeningKind.PASSAGE:  # a leaf that stands open beside a room's open side
                opening = _by_lines(gap, near)
                return [] if opening is None else [opening]
            found.append(rest)
        if high > low:
            found.append(replace(_part(gap, low, high), kind=OpeningKind.DOOR, name=name, is_doubtful=False))
        begin = high
    return found


def _part(gap: Opening, low_m: float, high_m: float) -> Opening:
    """A gap from one distance along it to another."""
    a, b, c, d = gap.corners_m
    low, high = low_m / gap.width_m, high_m / gap.width_m
    return replace(
        gap, corners_m=np.stack([a + low * (b - a), a + high * (b - a), d + high * (c - d), d + low * (c - d)])
    )


def _leaf_spans(gap: Opening, symbols: Sequence[SymbolLines]) -> list[tuple[float, float, str]]:
    """From where to where along a gap leaves hinged in it swing, in order and apart; and the names of their doors."""
    foot, width_m = gap.corners_m[0], gap.width_m
    along = (gap.corners_m[1] - foot) / width_m
    spans = []
    for symbol in symbols:
        for arc in symbol.swings:
            if shapely.distance(gap.area, shapely.Point(arc.centre)) > _HINGE_M:
                continue
            hinge_m = float((arc.centre - foot) @ along)
            for sign in (-1.0, 1.0):
                ends = np.stack([arc.start - arc.centre, arc.end - arc.centre]) @ (sign * along)
                low, high = sorted((hinge_m, hinge_m + sign * arc.radius))
                if ends.max() >= _SHUT * arc.radius and low > -_FRAME_M and high < width_m + _FRAME_M:
                    spans.append((max(low, 0.0), min(high, width_m), symbol.name))
    apart: list[tuple[float, float, str]] = []
    for low, high, name in sorted(spans):
        begin = max(low, apart[-1][1]) if apart else low
        if high - begin >= NARROWEST_M:
            apart.append((begin, high, name))
    return apart


def _by_lines(gap: Opening, symbols: Sequence[SymbolLines]) -> Opening | None:
    """What fills a gap by the lines drawn in it; None where it is as wide as no such opening."""
    width_m = gap.width_m
    area = _around(gap.area)
    along = (gap.corners_m[1] - gap.corners_m[0]) / width_m
    drawn: dict[OpeningKind, float] = {}
    names: dict[OpeningKind, str] = {}
    covered: dict[OpeningKind, list[FloatArray]] = {}
    certain: set[OpeningKind] = set()
    for symbol in symbols:
        inside = shapely.intersection(symbol.reach, area)
        if inside.length < _LEAST_DRAWN_M:
            continue
        apart = shapely.get_coordinates(inside) - gap.corners_m[0]
        at, aside = apart @ along, apart @ ((gap.corners_m[3] - gap.corners_m[0]) / gap.thickness_m)
        off_m = abs(float(np.median(aside)) - 0.5 * gap.thickness_m)
        if symbol.is_loose and (np.ptp(at) < _LEAST_SPAN_SHARE * width_m or off_m > 0.25 * gap.thickness_m):
            continue
        drawn[symbol.kind] = drawn.get(symbol.kind, 0.0) + inside.length
        names.setdefault(symbol.kind, symbol.name)
        certain |= set() if symbol.is_loose else {symbol.kind}
        covered.setdefault(symbol.kind, []).append(at)
    for kind in sorted(drawn, key=lambda kind: (kind not in certain, -drawn[kind])):
        spans = np.ptp(np.concatenate(covered[kind])) >= _LEAST_SPAN_SHARE * width_m
        if width_m <= _WIDEST_M[kind] and spans:
            return replace(gap, kind=kind, name=names[kind], is_doubtful=False)
    return gap if width_m <= _WIDEST_M[OpeningKind.PASSAGE] else None


def _once_each(openings: list[Opening]) -> list[Opening]:
    """Leave out those that lie over an earlier one: both ends of walls face the same gap."""
    order = sorted(range(len(openings)), key=lambda row: (openings[row].is_doubtful, row))
    kept: list[int] = []
    areas = [opening.area for opening in openings]
    for row in order:
        over = (shapely.intersection(areas[row], areas[other]).area for other in kept)
        if all(each < _SAME_SHARE * areas[row].area for each in over):
            kept.append(row)
    return sorted(
        (openings[row] for row in kept), key=lambda opening: tuple(np.round(opening.corners_m.min(axis=0), 3).tolist())
    )


def _cut_by_symbols(walls: Any, symbols: Sequence[SymbolLines], thickest_m: float) -> tuple[Any, list[Opening]]:
    """Cut doors and windows out of walls whose outlines run on under them."""
    openings = []
    for symbol in symbols:
        over = (_corners_in_wall(walls, lines, thickest_m) for lines in symbol.leaves or (symbol.lines,))
        found = [Opening(symbol.kind, corners, symbol.name) for corners in over if corners is not None]
        opening = next((o for o in found if NARROWEST_M <= o.width_m <= _WIDEST_M[symbol.kind]), None)
        if opening is None:
            continue
        openings.append(opening)
        walls = polygons_of(
            shapely.difference(walls, shapely.buffer(opening.area, GRID_M, join_style="mitre"), grid_size=GRID_M)
        )
    return walls, openings


def _between_walls(walls: Any, symbol: SymbolLines, thickest_m: float) -> Opening | None:
    """A window whose lines fill a gap between the sides of walls, so that no end of a wall faces it."""
    box = shapely.oriented_envelope(symbol.lines)
    if symbol.kind != OpeningKind.WINDOW or box.geom_type != "Polygon":
        return None
    corners = shapely.get_coordinates(shapely.orient_polygons(box))[:4]
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners)[:2].T)
    if sides[0] < sides[1]:
        corners = np.roll(corners, -1, axis=0)
    opening = Opening(symbol.kind, corners, symbol.name)
    fits = NARROWEST_M <= opening.width_m <= _WIDEST_M[symbol.kind] and opening.thickness_m <= thickest_m
    jambs = [shapely.LineString(corners[[1, 2]]), shapely.LineString(corners[[3, 0]])]
    touches = all(shapely.distance(walls, jamb) <= _REACH_M for jamb in jambs)
    is_free = shapely.intersection(walls, box).area < _SAME_SHARE * box.area
    return opening if fits and touches and is_free else None


def _corners_in_wall(walls: Any, lines: Any, thickest_m: float) -> FloatArray | None:
    """The part of a wall (4, 2) that lines lie over; None where they lie over none."""
    box = shapely.oriented_envelope(lines)
    if box.geom_type != "Polygon":
        box = shapely.buffer(box, THINNEST_M / 2, cap_style="flat")
    if box.geom_type != "Polygon" or shapely.intersection(box, walls).area < _ON_WALL_SHARE * box.area:
        return None
    corners = shapely.get_coordinates(box)[:4]
    sides = np.stack([corners[1] - corners[0], corners[2] - corners[1]])
    long = int(np.argmax(np.hypot(sides[:, 0], sides[:, 1])))
    along = sides[long] / np.hypot(*sides[long])
    across = np.array([-along[1], along[0]])
    middle = corners.mean(axis=0)
    half = float(np.hypot(*sides[long])) / 2
    line = shapely.LineString([middle - thickest_m * across, middle + thickest_m * across])
    parts = [part for part in shapely.get_parts(shapely.intersection(line, walls)) if part.geom_type == "LineString"]
    if not parts:
        return None
    through = min(parts, key=lambda part: (part.distance(shapely.Point(middle)), -part.length))
    reach = np.sort((shapely.get_coordinates(through) - middle) @ across)
    if not THINNEST_M <= reach[1] - reach[0] <= thickest_m:
        return None
    rows = [(-half, reach[0]), (half, reach[0]), (half, reach[1]), (-half, reach[1])]
    return np.array([middle + s * along + n * across for s, n in rows])
