"""What walls enclose: cells of a grid in plan that the cut of walls runs through, and those between them.

    _____________
    |     |     |     cells whose middles are the points `low_m + step_m * (ix, iy)`; arrays are (ny, nx)
    |           |     door: bridged
    |_____|_   _|     opening up to `GAP_M`: bridged

Local frame, metres.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from planner_core.model import BoolArray, FloatArray
from planner_core.model.arrays import lengths
from planner_core.scene.level_surfaces import LevelSurvey

#: Cells around the grid of plumb lines, so that what ends with the scene has an outline and walls.
MARGIN = 4
#: Openings up to this in the walls, such as doors, are bridged in looking for what they enclose.
GAP_M = 1.2


def cut_cells(segments_m: FloatArray, low_m: FloatArray, step_m: float, shape: tuple[int, int]) -> BoolArray:
    """(ny, nx) bool, `shape`: cells that segments (M, 2, 2) in plan run through, where they are on the grid."""
    along = segments_m[:, 1] - segments_m[:, 0]
    n_points = np.ceil(2.0 * lengths(along) / step_m).astype(np.int64) + 1
    row = np.repeat(np.arange(n_points.size), n_points)
    within = np.arange(row.size) - np.repeat(np.cumsum(n_points) - n_points, n_points)
    at_m = segments_m[row, 0] + along[row] * (within / np.maximum(n_points[row] - 1, 1))[:, None]
    cell = np.rint((at_m - low_m) / step_m).astype(np.int64)
    cell = cell[((cell >= 0) & (cell < [shape[1], shape[0]])).all(axis=1)]
    cut = np.zeros(shape, dtype=np.bool_)
    cut[cell[:, 1], cell[:, 0]] = True
    return cut


def closed_walls(cut: BoolArray, step_m: float) -> BoolArray:
    """(ny, nx) bool: the walls' cells `cut`, with openings up to `GAP_M` bridged; cells beyond the grid are open."""
    reach = max(1, round(0.5 * GAP_M / step_m))
    closed: BoolArray = ndimage.binary_closing(np.pad(cut, reach), np.ones((2 * reach + 1, 2 * reach + 1)))
    return closed[reach:-reach, reach:-reach]


def between_walls(cut: BoolArray, step_m: float) -> BoolArray:
    """(ny, nx) bool: the walls' cells `cut` and those that they enclose, with openings up to `GAP_M` bridged."""
    filled: BoolArray = ndimage.binary_fill_holes(closed_walls(cut, step_m))
    return filled


def cut_around_lines(survey: LevelSurvey, segments_m: FloatArray) -> BoolArray:
    """(ny, nx) bool, cells of the plumb lines of `survey` and `MARGIN` more on each side: where segments run."""
    columns, step_m = survey.columns, survey.step_m
    low_m = np.array([columns.x_m[0], columns.y_m[0]]) - MARGIN * step_m
    return cut_cells(segments_m, low_m, step_m, (columns.y_m.size + 2 * MARGIN, columns.x_m.size + 2 * MARGIN))


def lines_of(cells: BoolArray) -> BoolArray:
    """Take the margin off."""
    return cells[MARGIN:-MARGIN, MARGIN:-MARGIN]
