"""Hatching: lines through areas of the plan, as spans on a family of parallel lines. Triangles, rings -> lines.

Line k of a family runs at a distance k x step from the origin, at an angle to +x, so it has its place whatever is
hatched: areas can be joined and taken off each other line by line, and neighbours meet.

      +-------+          spans of the area        ==  =====  ===
      | /  /  |          spans of what stands on it    ==
      |/  /  /|          their difference         ==  =  ==  ===
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.model.arrays import bounds_of

#: Gaps narrower than this are rounding: a hundredth of a millimetre.
_GAP_M = 1e-5


@dataclass(frozen=True)
class Family:
    """Parallel lines: `step_m` apart, `turn_rad` counter-clockwise from +x."""

    step_m: float
    turn_rad: float

    @property
    def along(self) -> FloatArray:
        """(2,) unit vector of the lines."""
        return np.array([np.cos(self.turn_rad), np.sin(self.turn_rad)])

    @property
    def across(self) -> FloatArray:
        """(2,) unit vector from line 0 to line 1."""
        return np.array([-np.sin(self.turn_rad), np.cos(self.turn_rad)])


@dataclass(frozen=True, eq=False)
class Spans:
    """Pieces of lines, sorted by line and place, none touching another. line : (N,); low, high : (N,) along it."""

    line: Int64Array
    low: FloatArray
    high: FloatArray

    def lines(self, family: Family) -> FloatArray:
        """(N, 2, 2) ends in plan."""
        ends = np.stack([self.low, self.high], axis=1)[:, :, None] * family.along
        return np.asarray(ends + (self.line * family.step_m)[:, None, None] * family.across)


def spans_of_triangles(triangles: FloatArray, family: Family) -> Spans:
    """Spans of the union of triangles (N, 3, 2)."""
    u, v = triangles @ family.along, triangles @ family.across / family.step_m
    which, line = _lines_met(*bounds_of(v))
    low, high = np.full(line.size, np.inf), np.full(line.size, -np.inf)
    for edge in range(3):
        ends = [edge, (edge + 1) % 3]
        meets, at = _crossing(u[which][:, ends], v[which][:, ends], line)
        low = np.where(meets, np.minimum(low, at), low)
        high = np.where(meets, np.maximum(high, at), high)
    met = high > low
    return _joined(line[met], low[met], high[met])


def spans_of_rings(solids: Sequence[Sequence[FloatArray]], family: Family) -> Spans:
    """Spans of the union of areas, each inside an odd number of its closed rings (N, 2)."""
    sides = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for rings in solids for ring in rings]
    if not sides:
        return Spans(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    solid = np.repeat(
        np.repeat(np.arange(len(solids)), [len(rings) for rings in solids]), [len(ends) for ends in sides]
    )
    ends = np.concatenate(sides)
    u, v = ends @ family.along, ends @ family.across / family.step_m
    which, line = _lines_met(*bounds_of(v))
    # Half-open: a line through a corner meets one of its two sides.
    meets = (v[which, 0] > line) != (v[which, 1] > line)
    which, line = which[meets], line[meets]
    _, at = _crossing(u[which], v[which], line)
    order = np.lexsort((at, line, solid[which]))
    at, line = at[order], line[order]
    return _joined(line[0::2], at[0::2], at[1::2])


def without(spans: Spans, others: Spans) -> Spans:
    """What is left of `spans` where `others` are taken off."""
    if not spans.line.size or not others.line.size:
        return spans
    # Depth counts 1 in `spans`, 2 in `others`: what is left lies where it is 1.
    line = np.concatenate([spans.line, spans.line, others.line, others.line])
    at = np.concatenate([spans.low, spans.high, others.low, others.high])
    n, m = spans.line.size, others.line.size
    change = np.repeat([1, -1, 2, -2], [n, n, m, m])
    order = np.lexsort((at, line))
    line, at, depth = line[order], at[order], np.cumsum(change[order])
    left = np.flatnonzero((depth[:-1] == 1) & (line[:-1] == line[1:]) & (at[1:] - at[:-1] > _GAP_M))
    return Spans(line[left], at[left], at[left + 1])


def _lines_met(low: FloatArray, high: FloatArray) -> tuple[Int64Array, Int64Array]:
    """Which items (N,), that reach from line `low` to `high`, meet which lines."""
    if not low.size:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    first = np.ceil(low).astype(np.int64)
    count = np.maximum(np.floor(high).astype(np.int64) - first + 1, 0)
    which = np.repeat(np.arange(low.size), count)
    return which, np.arange(which.size) - np.repeat(np.cumsum(count) - count, count) + first[which]


def _crossing(u: FloatArray, v: FloatArray, line: Int64Array) -> tuple[np.ndarray, FloatArray]:
    """Whether sides with ends u, v (N, 2) meet lines v = line (N,), and where."""
    at = line.astype(np.float64)
    rise = v[:, 1] - v[:, 0]
    low, high = bounds_of(v)
    meets = (low <= at) & (at <= high) & (rise != 0)
    share = np.divide(at - v[:, 0], rise, out=np.zeros_like(at), where=meets)
    return meets, u[:, 0] + share * (u[:, 1] - u[:, 0])


def _joined(line: Int64Array, low: FloatArray, high: FloatArray) -> Spans:
    """Sort spans, and join those of one line that touch."""
    order = np.lexsort((low, line))
    line, low, high = line[order], low[order], high[order]
    if not line.size:
        return Spans(line, low, high)
    # The farthest end so far on each line: lines are separated by a shift wider than all of them.
    width = float(high.max() - low.min()) + 1.0
    shift = (line - line[0]) * width
    reached = np.maximum.accumulate(high + shift)
    begins = np.ones(line.size, dtype=np.bool_)
    begins[1:] = low[1:] + shift[1:] > reached[:-1] + _GAP_M
    first = np.flatnonzero(begins)
    last = np.append(first[1:], line.size) - 1
    return Spans(line[first], low[first], reached[last] - shift[last])
