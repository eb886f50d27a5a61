"""How things look on drawings: pens distinguished by colour, and without colour by width and dashes."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import METRE, FloatArray, LengthUnit, Link, LinkLimits
from planner_core.plan_folder.drawing.canvas import INK, PAPER, QUIET, Box, Canvas, Colour, Pen
from planner_core.plan_folder.drawing.fonts import width_mm

WALL_FILL: Colour = (0.40, 0.42, 0.44)
STATION_FILL: Colour = (0.05, 0.14, 0.20)
MISSED: Colour = (0.80, 0.16, 0.03)

CUT = Pen(0.25)
FITTING = Pen(0.16, (0.15, 0.15, 0.15))
BELOW = Pen(0.11, (0.55, 0.56, 0.58))
MISSED_GROUND = Pen(0.24, MISSED)
OUT_OF_REACH = Pen(0.12, (0.50, 0.51, 0.53))
MISSED_WALL = Pen(1.1, MISSED, (1.3, 0.7))
MISSED_WALL_RIM = Pen(1.7, PAPER)
KEEP_OUT = Pen(0.45, (0.62, 0.08, 0.12), (2.6, 0.7, 0.5, 0.7))
ROUTE = Pen(0.5, (0.30, 0.12, 0.42), round=True)
ROUTE_ABOVE = Pen(0.5, ROUTE.colour, (1.7, 0.8))
"""Where it climbs higher than the walls are cut: the stairs are not drawn there."""
ROUTE_RIM = Pen(1.2, PAPER, round=True)
LEADER = Pen(0.25)
WEAK, COUNTS, STRONG, BY_TARGETS = range(4)
STRONG_TIMES = 4.0
"""A link this many times as strong as required is drawn as strong."""
#: Links of less than this share of the required overlap, or less probable, are not drawn: they would hide the others.
_LEAST_SHARE, _LEAST_PROBABILITY = 0.5, 0.5
#: By class of link.
LINKS = (
    Pen(0.28, (0.42, 0.43, 0.45), (0.6, 1.1)),
    Pen(0.42, (0.76, 0.42, 0.0), (3.4, 1.3)),
    Pen(0.95, (0.0, 0.52, 0.5)),
    Pen(0.6, (0.16, 0.33, 0.72), (3.0, 0.9, 0.6, 0.9)),
)
LINK_RIM_MM = 0.5
LINK_ASIDE_MM = 0.9
"""Links run this far beside the line between their stations, which the walk may take."""
#: (distance on paper in millimetres, angle in degrees) of hatching.
HATCH_MISSED = (1.3, 45.0)
HATCH_OUT_OF_REACH = (2.4, -45.0)
DISC_MM = 2.6
DOT_MM = 0.7
ARROW_MM = 2.3
_DISC_HIDES_M = 1.0
"""A disc of this radius in the building hides a corridor of two metres."""


def arrow_head(way: FloatArray, length: float) -> FloatArray:
    """(3, 2) triangle half-way along a line (M, 2), pointing ahead."""
    step = np.linalg.norm(np.diff(way, axis=0), axis=1)
    along = np.append(0.0, np.cumsum(step))
    piece = int(np.searchsorted(along[1:-1], along[-1] / 2, side="right"))
    ahead = (way[piece + 1] - way[piece]) / max(float(step[piece]), 1e-12)
    at = way[piece] + ahead * (along[-1] / 2 - along[piece])
    across = np.array([-ahead[1], ahead[0]])
    base, aside = at - 0.4 * length * ahead, 0.38 * length * across
    return np.array([at + 0.6 * length * ahead, base - aside, base + aside])


def draw_route(canvas: Canvas, ways: list[FloatArray], low: list[FloatArray], high: list[FloatArray]) -> None:
    """Draw ways (M, 2) in millimetres, with arrow heads where there is room for them.

    low, high : parts of them up to the height of the cut, and above.
    """
    canvas.lines(ways, ROUTE_RIM)
    canvas.lines(low, ROUTE)
    canvas.lines(high, ROUTE_ABOVE)
    for way in ways:
        if float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) > 4 * DISC_MM + ARROW_MM:
            head = arrow_head(way, ARROW_MM)
            canvas.lines([head], Pen(0.5, PAPER), closed=True)
            canvas.area([head], ROUTE.colour)


def link_class(link: Link, limits: LinkLimits) -> int | None:
    """Class of a link; None: not worth drawing. A strength that is NaN is neither weak nor strong."""
    if link.targets_m:
        return BY_TARGETS
    if link.counts(limits):
        return STRONG if link.strength >= STRONG_TIMES * limits.strength else COUNTS
    near = link.overlap >= _LEAST_SHARE * limits.overlap and not link.probability < _LEAST_PROBABILITY
    return WEAK if near else None


def draw_links(canvas: Canvas, ends: Sequence[FloatArray]) -> None:
    """Draw links with ends (K, 2, 2) in millimetres, by class, the best on top."""
    for kind, (of_class, pen) in enumerate(zip(ends, LINKS, strict=True)):
        lines = list(_aside(of_class))
        if kind > WEAK:
            canvas.lines(lines, Pen(pen.width_mm + LINK_RIM_MM, PAPER))
        canvas.lines(lines, pen)


def _aside(ends: FloatArray) -> FloatArray:
    """Lines (K, 2, 2) in millimetres, moved to their right."""
    way = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    return np.asarray(ends + LINK_ASIDE_MM * (np.stack([way[:, 1], -way[:, 0]], axis=1) / length[:, None])[:, None])


def draw_station(canvas: Canvas, spot: FloatArray, disc: FloatArray, number: int, *, scanned: bool) -> None:
    """Draw a dot where a station is, and its number in a disc there, or beside it with a line to the spot.

    scanned : before; nothing is to be done there, and the disc is hollow.
    """
    if float(np.hypot(*(disc - spot))) > 0.3 * DISC_MM:
        canvas.lines([np.stack([spot, disc])], LEADER)
    canvas.disc((float(spot[0]), float(spot[1])), DOT_MM, INK, Pen(0.2, PAPER))
    at = (float(disc[0]), float(disc[1]))
    fill, letters = (PAPER, STATION_FILL) if scanned else (STATION_FILL, PAPER)
    canvas.disc(at, DISC_MM, fill, Pen(0.35, letters))
    size_pt = 7.6 if number < 100 else 6.0
    canvas.text((at[0], at[1] - 0.128 * size_pt), str(number), size_pt, colour=letters, bold=True, align="middle")


#: Where words go beside a place, the best first, in distances to it.
_ASIDE = (
    *((1, 0), (1, 1), (1, -1), (-1, 0), (-1, 1), (-1, -1), (0, 1), (0, -1)),
    *((1.8, 1.8), (-1.8, 1.8), (1.8, -1.8), (-1.8, -1.8), (0, 2.2), (0, -2.2)),
)
#: How many lines above its place the name of a room may be.
_ROWS_OFF = (0.0, 1.2, -1.2, 2.4, -2.4, 3.6, -3.6)
#: The same above and below first.
_ABOVE = (*((dy, dx) for dx, dy in _ASIDE[:8]), *_ASIDE[12:], *_ASIDE[8:12])


@dataclass
class Labels:
    """Words beside places, where they cover neither each other nor what was there before."""

    canvas: Canvas
    within: Box
    taken: list[Box]

    def put(self, at: FloatArray, words: str, *, size_pt: float = 6.2, apart: float = 2.9, above: bool = False) -> None:
        """Write in a white box beside `at` (2,), or where the least is covered. above : or below, if there is room."""
        width, height = width_mm(words, size_pt) + 1.2, 0.42 * size_pt + 0.4
        x, y = float(at[0]), float(at[1])
        if not (self.within.left <= x <= self.within.right and self.within.bottom <= y <= self.within.top):
            return
        places = [
            Box(x + dx * apart + (dx - 1) / 2 * width, y + dy * apart + (dy - 1) / 2 * height, width, height)
            for dx, dy in (_ABOVE if above else _ASIDE)
        ]
        box = min(places, key=self._covered)
        self.taken.append(box)
        self.canvas.area([corners(box)], PAPER)
        self.canvas.lines([corners(box)], Pen(0.12), closed=True)
        self.canvas.text((box.left + 0.6, box.bottom + 0.11 * size_pt), words, size_pt)

    def put_where_free(self, at: FloatArray, words: str, *, size_pt: float = 5.6) -> None:
        """Write without a border across `at` (2,), or above or below it; not at all where something is covered."""
        width, height = width_mm(words, size_pt) + 0.8, 0.42 * size_pt + 0.2
        x, y = float(at[0]), float(at[1])
        places = [Box(x - width / 2, y + (rows - 0.5) * height, width, height) for rows in _ROWS_OFF]
        box = next((box for box in places if self._covered(box) == 0.0), None)
        if box is None:
            return
        self.taken.append(box)
        self.canvas.area([corners(box)], PAPER)
        self.canvas.text((x, box.bottom + 0.1 * size_pt), words, size_pt, colour=QUIET, align="middle")

    def _covered(self, box: Box) -> float:
        """Area that a box covers of others, and far more for what sticks out of the drawing."""
        out = max(0.0, self.within.left - box.left, box.right - self.within.right)
        out += max(0.0, self.within.bottom - box.bottom, box.top - self.within.top)
        return 100 * out + sum(_common(box, other) for other in self.taken)


def draw_stations(
    labels: Labels,
    spots: FloatArray,
    numbers: Sequence[int],
    words: Sequence[str] = (),
    *,
    scanned: Sequence[bool] = (),
    mm_per_m: float = math.inf,
) -> None:
    """Draw numbered discs at spots (N, 2), moved apart where they would overlap, and words beside them.

    words, scanned : of each; empty: none. mm_per_m : of the drawing. Where discs would hide corridors, spots are dots
    with the number beside them.
    """
    if not len(spots):
        return
    if mm_per_m * _DISC_HIDES_M < DISC_MM:
        _draw_dots(labels, spots, numbers, words, scanned)
        return
    discs = spread_apart(spots, 2.1 * DISC_MM)
    for place, (spot, disc, number) in enumerate(zip(spots, discs, numbers, strict=True)):
        draw_station(labels.canvas, spot, disc, number, scanned=bool(scanned) and scanned[place])
        labels.taken.append(Box(float(disc[0]) - DISC_MM, float(disc[1]) - DISC_MM, 2 * DISC_MM, 2 * DISC_MM))
    for disc, note in zip(discs, words, strict=False):
        if note:
            labels.put(disc, note, size_pt=5.6)


def _draw_dots(
    labels: Labels, spots: FloatArray, numbers: Sequence[int], words: Sequence[str], scanned: Sequence[bool]
) -> None:
    """Draw stations as dots with their numbers beside them, across the longer side of what they spread over."""
    for place, (x, y) in enumerate(spots.tolist()):
        fill, rim = (PAPER, INK) if scanned and scanned[place] else (INK, PAPER)
        labels.canvas.disc((x, y), DOT_MM, fill, Pen(0.2, rim))
        labels.taken.append(Box(x - DOT_MM, y - DOT_MM, 2 * DOT_MM, 2 * DOT_MM))
    wide = bool(np.ptp(spots[:, 0]) >= np.ptp(spots[:, 1]))
    for place, (spot, number) in enumerate(zip(spots, numbers, strict=True)):
        note = f"{number}  {words[place]}" if words and words[place] else str(number)
        labels.put(spot, note, size_pt=5.6, above=wide)


#: What marks are, in words: many, and few where there is little room.
MARK_WORDS = {
    "station": ("station and its number", "station"),
    "scanned": ("station that was scanned before", "scanned before"),
    "route": ("route from station to station", "route"),
    "strong": ("strong link: {times:g} times the strength required", "strong link"),
    "counts": ("registration link: {link}", "registration link"),
    "weak": ("pair too weak to register", "pair too weak"),
    "by targets": ("pair that three targets register", "three targets"),
    "keep-out": ("keep-out or access area", "keep-out"),
    "missed ground": ("floor that the plan leaves unseen", "floor left unseen"),
    "out of reach": ("floor that no position sees", "floor not visible"),
    "missed wall": ("wall that the plan leaves unseen", "wall left unseen"),
    "wall": ("cut {cut} above the floor", "cut at {cut}"),
    "below": ("objects below the cut", "below the cut"),
}


def linked_words(numbers: Sequence[int]) -> str:
    """Name the stations of other floors that one links to."""
    more = f" +{len(numbers) - 3}" if len(numbers) > 3 else ""
    return "↕ " + ", ".join(str(number) for number in numbers[:3]) + more if numbers else ""


RISE_SHOWN_M = 0.5
"""Ground that differs so much from its floor's is another level, or part of a slope: heights belong to the marker."""


def rise_words(rise_m: float, unit: LengthUnit = METRE) -> str:
    """Name how far the ground of a station lies above its floor's, where that is another level; else nothing."""
    if not abs(rise_m) >= RISE_SHOWN_M:
        return ""
    return f"ground {unit.of(rise_m):+.2f} {unit.symbol}"


_PLACE_IN_FILE = re.compile(r"^site\.\w+\[\d+\]$")


@dataclass(frozen=True, eq=False)
class DrawnZone:
    """Where no station may stand, or, of an access area, the only place where one may. outline : (K, 2), closed."""

    outline: FloatArray
    words: str


def zone_words(name: str, *, access: bool = False) -> str:
    """Name a keep-out or an access area, but for names that are its place in the requirements file."""
    what = "access area" if access else "keep-out"
    return what if not name or _PLACE_IN_FILE.search(name) else f"{what}: {name}"


def forbidden_zone(x: float, y: float, radius: float) -> DrawnZone:
    """Return the circle around a forbidden position."""
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    return DrawnZone(np.array([x, y]) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1), "no station")


def draw_zones(canvas: Canvas, outlines: Sequence[FloatArray]) -> None:
    """Draw the borders of zones, on paper: a light line under the dashes keeps them apart from walls."""
    canvas.lines(list(outlines), Pen(3 * KEEP_OUT.width_mm, PAPER))
    canvas.lines(list(outlines), KEEP_OUT)


def draw_scale_bar(
    canvas: Canvas, mm_per_m: float, middle: float, bottom: float, *, longest_mm: float, unit: LengthUnit = METRE
) -> None:
    """Draw the scale bar in light and dark pieces; of either foot in feet, which on paper are the same."""
    mm_per_unit = mm_per_m * unit.metres
    length = nice_length_m(longest_mm / mm_per_unit)
    n_pieces = 5 if f"{length:g}"[0] in "15" else 4
    piece_mm = length / n_pieces * mm_per_unit
    left = middle - n_pieces * piece_mm / 2
    for piece in range(n_pieces):
        bar = corners(Box(left + piece * piece_mm, bottom, piece_mm, 1.6))
        canvas.area([bar], INK if piece % 2 == 0 else PAPER)
        canvas.lines([bar], Pen(0.15), closed=True)
    canvas.text((left, bottom + 2.3), "0", 6.2, align="middle")
    canvas.text(
        (left + n_pieces * piece_mm, bottom + 2.3), f"{length:g} {'ft' if unit.is_feet else 'm'}", 6.2, align="middle"
    )


def draw_axes(canvas: Canvas, middle: tuple[float, float]) -> None:
    """Draw the axes of the scene, which are those of the paper."""
    start = np.array(middle) - 4.5
    for way, name in ((np.array([1.0, 0.0]), "x"), (np.array([0.0, 1.0]), "y")):
        canvas.lines([np.stack([start, start + 9 * way])], Pen(0.35))
        base, aside = start + 8.6 * way, 0.9 * np.array([-way[1], way[0]])
        canvas.area([np.array([start + 11 * way, base + aside, base - aside])], INK)
        draw_letter(canvas, start + 12.8 * way, name)


def draw_letter(canvas: Canvas, at: FloatArray, letter: str) -> None:
    """Write the letter of an arrow, its middle at a place (2,)."""
    canvas.text((float(at[0]), float(at[1]) - 1.2), letter, 8.0, bold=True, align="middle")


def corners(box: Box) -> FloatArray:
    """(4, 2) of a box."""
    return np.array([(box.left, box.bottom), (box.right, box.bottom), (box.right, box.top), (box.left, box.top)])


def _common(a: Box, b: Box) -> float:
    return max(0.0, min(a.right, b.right) - max(a.left, b.left)) * max(0.0, min(a.top, b.top) - max(a.bottom, b.bottom))


def nice_length_m(longest_m: float) -> float:
    """Longest of 1, 2, 5 times a power of ten that is at most `longest_m`."""
    power = 10.0 ** np.floor(np.log10(longest_m))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= longest_m * (1 + 1e-9)))


def spread_apart(spots: FloatArray, distance: float) -> FloatArray:
    """Move points (N, 2) as little as a few rounds of pushing need until no two are nearer than `distance`.

    Two points at one spot are pushed apart along x, the first of them to the left.
    """
    placed = spots.astype(np.float64).copy()
    for _ in range(200):
        gaps = np.linalg.norm(placed[:, None] - placed[None], axis=2)
        close = np.argwhere(np.triu(gaps < distance * 0.999, k=1))
        if not close.size:
            break
        for i, j in close:
            gap = placed[j] - placed[i]  # as it is by now: an earlier pair may have moved one of the two
            length = float(np.hypot(*gap))
            way = gap / length if length > 1e-9 * distance else np.array([1.0, 0.0])
            push = 0.5 * max(distance - length, 0.0) * way
            placed[i] -= push
            placed[j] += push
    return placed
