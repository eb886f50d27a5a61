"""The grid of a drawing: crosses where round coordinates meet, and their names all around at the frame.

Frame of the site, Tile -> lines and words. Drawings are upright in the scene, so that the site's lines may run across
them: each is named at both ends, on whichever side it leaves the drawing, so that a ruler can be laid along it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.export.sheets.paper import Tile
from planner_core.model import FloatArray, SiteFrame
from planner_core.plan_folder.drawing.canvas import PAPER, QUIET, Box, Canvas, Pen
from planner_core.plan_folder.drawing.fonts import width_mm

#: Lines are at least this far apart on paper.
_APART_MM = 38.0
_CROSS = Pen(0.1, (0.45, 0.46, 0.48))
_CROSS_MM = 1.3
_TICK = Pen(0.25)
_TICK_MM = 2.0
_SIZE_PT = 5.2
#: From a tick to its name, and from the frame to the name's foot.
_ASIDE_MM, _OFF_MM = 0.7, 0.9
_HEIGHT_MM = 1.9
#: Between names, and from a corner of the drawing.
_GAP_MM = 1.2


@dataclass(frozen=True, eq=False)
class _Line:
    """A line of the grid. through, ahead : (2,) a place on paper, and the unit vector along it."""

    name: str
    through: FloatArray
    ahead: FloatArray


@dataclass(frozen=True, eq=False)
class _End:
    """Where a line leaves the drawing. side : `left`, `right`, `bottom`, `top`. inward : (2,) unit vector along it."""

    name: str
    side: str
    at: FloatArray
    inward: FloatArray

    @property
    def is_level(self) -> bool:
        """Whether its side runs from left to right."""
        return self.side in ("bottom", "top")


def draw_grid(
    canvas: Canvas, frame: SiteFrame, tile: Tile, elevation_m: float, *, taken: Sequence[Box] = ()
) -> tuple[Box, ...]:
    """Draw crosses, ticks and names. taken : where no name may be. Returns where names are."""
    box = tile.sheet.drawing
    easting, northing = _lines(frame, tile, elevation_m)
    with canvas.clip(box):
        canvas.lines(
            [
                np.stack([spot - _CROSS_MM * line.ahead, spot + _CROSS_MM * line.ahead])
                for one in easting
                for other in northing
                for spot in (_meeting(one, other),)
                if _is_in(box, spot)
                for line in (one, other)
            ],
            _CROSS,
        )
    ends = [end for line in (*easting, *northing) for end in _ends(line, box)]
    # Names of lines that run upright to a side first: where there is no room for all, they say most. Those of one slope
    # keep their order, whatever a processor makes of the last digits.
    ends.sort(key=lambda end: -round(abs(float(end.inward[1 if end.is_level else 0])), 6))
    canvas.lines([np.stack([end.at, end.at + _TICK_MM * end.inward]) for end in ends], _TICK)
    ticks = [_tick_box(end) for end in ends]
    names: list[Box] = []
    for place, end in enumerate(ends):
        others = (*taken, *names, *ticks[:place], *ticks[place + 1 :])
        room = next((room for room in _rooms(end, box) if not _meets_any(room, others)), None)
        if room is not None:
            names.append(room)
            _write(canvas, end, room)
    return tuple(names)


def _lines(frame: SiteFrame, tile: Tile, elevation_m: float) -> tuple[list[_Line], list[_Line]]:
    """Lines of one easting, and of one northing, that may be on the drawing."""
    unit = frame.unit
    step = next(step for step in (1, 2, 5, 10, 20, 50, 100) if step * tile.mm_per_m * unit.metres >= _APART_MM)
    (x0, y0), (x1, y1) = tile.window_m
    corners = frame.to_site(np.array([(x, y, elevation_m) for x in (x0, x1) for y in (y0, y1)]))
    middle = corners.mean(axis=0)
    names = ("x", "y") if frame.is_scene else ("E", "N")
    found: tuple[list[_Line], list[_Line]] = ([], [])
    for axis in (0, 1):
        low, high = unit.of(float(corners[:, axis].min())), unit.of(float(corners[:, axis].max()))
        for value in np.arange(math.ceil(low / step), math.floor(high / step) + 1) * float(step):
            ends = np.stack([middle, middle])
            ends[:, axis] = value * unit.metres
            ends[1, 1 - axis] += 100.0
            start, end = tile.on_paper(frame.to_scene(ends)[:, :2])
            words = f"{names[axis]} {value:,.0f}".replace(",", " ")
            found[axis].append(_Line(words, start, (end - start) / np.hypot(*(end - start))))
    return found


def _meeting(one: _Line, other: _Line) -> FloatArray:
    """(2,) where two lines meet."""
    along, _ = np.linalg.solve(np.stack([one.ahead, -other.ahead], axis=1), other.through - one.through)
    return np.asarray(one.through + along * one.ahead)


def _is_in(box: Box, spot: FloatArray) -> bool:
    return bool(box.left <= spot[0] <= box.right and box.bottom <= spot[1] <= box.top)


def _ends(line: _Line, box: Box) -> Iterator[_End]:
    """Where a line leaves a box: twice, or never."""
    sides = (("left", 0, box.left), ("right", 0, box.right), ("bottom", 1, box.bottom), ("top", 1, box.top))
    for side, axis, edge in sides:
        if abs(line.ahead[axis]) < 1e-9:
            continue
        at = line.through + (edge - line.through[axis]) / line.ahead[axis] * line.ahead
        low, high = ((box.bottom, box.top), (box.left, box.right))[axis]
        if low <= at[1 - axis] <= high:
            is_inward = (line.ahead[axis] > 0) == (side in ("left", "bottom"))
            yield _End(line.name, side, at, line.ahead if is_inward else -line.ahead)


def _rooms(end: _End, box: Box) -> Iterator[Box]:
    """Where the name of a line has room: along the side, clear of the tick, after it or before it."""
    long = width_mm(end.name, _SIZE_PT)
    axis = 0 if end.is_level else 1
    at, lean = float(end.at[axis]), _TICK_MM * float(end.inward[axis])
    low, high = (box.left, box.right) if end.is_level else (box.bottom, box.top)
    for start in (at + _ASIDE_MM + max(0.0, lean), at - _ASIDE_MM + min(0.0, lean) - long):
        if start < low + _GAP_MM or start + long > high - _GAP_MM:
            continue
        if end.is_level:
            foot = box.bottom + _OFF_MM if end.side == "bottom" else box.top - _OFF_MM - _HEIGHT_MM
            yield Box(start, foot, long, _HEIGHT_MM)
        else:
            left = box.left + _OFF_MM if end.side == "left" else box.right - _OFF_MM - _HEIGHT_MM
            yield Box(left, start, _HEIGHT_MM, long)


def _tick_box(end: _End) -> Box:
    """Where no name of another line may be: nobody could tell whose it is."""
    tip = end.at + _TICK_MM * end.inward
    low, high = np.minimum(end.at, tip), np.maximum(end.at, tip)
    return Box(float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1])).inset(-_GAP_MM / 2)


def _meets_any(room: Box, others: Sequence[Box]) -> bool:
    around = room.inset(-_GAP_MM / 2)
    return any(_meet(around, other) for other in others)


def _meet(one: Box, other: Box) -> bool:
    level = one.left < other.right and other.left < one.right
    return level and one.bottom < other.top and other.bottom < one.top


def _write(canvas: Canvas, end: _End, room: Box) -> None:
    """Write a name upright to be read from below, or from the right."""
    ring = [(room.left, room.bottom), (room.right, room.bottom), (room.right, room.top), (room.left, room.top)]
    canvas.area([np.array(ring)], PAPER)
    at, turn_rad = ((room.left, room.bottom), 0.0) if end.is_level else ((room.right, room.bottom), math.pi / 2)
    canvas.text(at, end.name, _SIZE_PT, colour=QUIET, turn_rad=turn_rad)
