"""All that a drawing shows of a storey, as lines under the recognised walls: what people compare and snap to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely

from planner_core.drawings.drawing import Drawing
from planner_core.model import FloatArray, Int64Array

MOST_POINTS = 200_000
"""Of a storey; beyond, the shortest lines are left out: hatches and letters."""
_TOLERANCE_M = 0.005


@dataclass(frozen=True)
class DrawnLines:
    """points_m : (N, 2) float64 corners of lines, plan coordinates. starts : (L + 1,) int64 into them."""

    points_m: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    starts: Int64Array = field(default_factory=lambda: np.zeros(1, dtype=np.int64))

    def in_mm(self) -> list[list[int]]:
        """Return x, y of the corners of each line in turn, millimetres: the first, then steps."""
        rounded = np.rint(1000.0 * self.points_m).astype(np.int64)
        steps = np.diff(rounded, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
        steps[self.starts[:-1]] = rounded[self.starts[:-1]]
        return [steps[a:b].reshape(-1).tolist() for a, b in zip(self.starts[:-1], self.starts[1:], strict=True)]


NO_LINES = DrawnLines()


def drawn_lines(drawing: Drawing, rows: Int64Array, unit_m: float) -> DrawnLines:
    """Return strokes of a drawing, simplified by 5 mm. rows : numbers of strokes. unit_m : metres in its unit."""
    lengths = np.diff(drawing.starts)[rows]
    if not len(rows):
        return NO_LINES
    at = np.repeat(drawing.starts[rows] - np.concatenate([[0], np.cumsum(lengths)[:-1]]), lengths)
    points = drawing.points[at + np.arange(int(lengths.sum())), :2] * unit_m
    of_line = np.repeat(np.arange(len(rows)), lengths)
    lines = shapely.simplify(shapely.linestrings(points, indices=of_line), _TOLERANCE_M)
    n_points = shapely.get_num_coordinates(lines)
    if n_points.sum() > MOST_POINTS:
        order = np.argsort(-shapely.length(lines), kind="stable")
        kept = np.sort(order[np.cumsum(n_points[order]) <= MOST_POINTS])
        lines, n_points = lines[kept], n_points[kept]
    starts = np.concatenate([[0], np.cumsum(n_points)]).astype(np.int64)
    return DrawnLines(shapely.get_coordinates(lines), starts)
