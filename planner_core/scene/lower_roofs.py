"""Roofs of lower wings: what lies in the open at the height of a storey, over rooms, and no way leads to.

    storey's rooms |            | roof of a lower wing: beyond a wall with a sill, rooms below   -> no ground
    ===============|============|==============
                   | 0.7 m cut: a wall stands here, a doorway doesn't
    ===============:========      balcony, terrace: a door, or a window down to the floor, leads there  -> ground

Local frame, metres, on the grid of plumb lines. Doors, windows and panes are no obstacles: whether they open is not
modelled. So what only a curtain wall cuts off stays.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray
from planner_core.scene.between_walls import MARGIN, cut_around_lines, lines_of
from planner_core.scene.level_surfaces import (
    MIN_AREA_M2,
    MIN_CLEAR_M,
    MIN_LEVEL_DISTANCE_M,
    WALL_CUT_M,
    LevelSurvey,
)

#: Walls are searched for at this height above the floor: below sills and guards, which codes want at 0.8 m and more,
#: and above thresholds.
_SILL_M = 0.7
#: Ground goes on across gaps of this width: a facade that the model leaves out, between a floor and its balcony.
_GAP_M = 0.5
#: Covered ground is a room's where all open ground is farther away: eaves and canopies reach out less.
_EAVES_M = 1.5
#: A part is in the open, over rooms, or walled in where half of it, or of its outline, is.
_HALF = 0.5
#: Walls stand along an outline that is within this of them.
_ALONG_M = 0.3
#: Plumb lines farther apart than this miss doorways.
_WIDEST_STEP_M = 0.3


def lower_roofs(survey: LevelSurvey, ground: BoolArray, main_m: float, walls: BoolArray) -> BoolArray:
    """Tell which of a storey's ground is the roof of something lower.

    Parameters
    ----------
    ground
        (N,) bool, the storey's crossings with head-high space, one surface: none is far from `main_m`.
    main_m
        Height of the storey's ground.
    walls
        (E,) bool, elements that nobody walks through: walls, not doors, windows or panes.

    Returns
    -------
    (N,) bool, those of `ground`. None where nothing of it is in a room, or plumb lines are too far apart.
    """
    from scipy.ndimage import binary_dilation, distance_transform_edt, grey_dilation, label

    columns, step_m = survey.columns, survey.step_m
    none = np.zeros_like(ground)
    is_open = _plan(survey, ground & ~np.isfinite(survey.clear_m))
    if step_m > _WIDEST_STEP_M or not is_open.any():
        return none
    stands = ~survey.level & ~survey.stray
    sills = _cut(survey, stands & walls[survey.scene.element_of_triangle], main_m + _SILL_M)
    bare = _plan(survey, ground) & ~sills
    n_grow = max(1, round(0.5 * _GAP_M / step_m))
    part, n_parts = label(binary_dilation(bare, iterations=n_grow, mask=~sills))
    room = bare & ~is_open & (step_m * distance_transform_edt(~is_open) > _EAVES_M)
    below = survey.level[columns.triangle] & (survey.clear_m >= MIN_CLEAR_M)
    over_rooms = _plan(survey, below & (columns.z_m < main_m - MIN_LEVEL_DISTANCE_M))
    high = _cut(survey, stands, main_m + WALL_CUT_M)
    along = binary_dilation(high, iterations=max(1, round(_ALONG_M / step_m)))
    outline = np.where(part == 0, grey_dilation(part, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]]), 0)

    def share(cells: BoolArray, of: BoolArray, whose: BoolArray = part) -> FloatArray:
        """(n_parts + 1,) share of each part's cells `of` that are `cells`."""
        count = [np.bincount(whose[each], minlength=n_parts + 1) for each in (cells & of, of)]
        found: FloatArray = count[0] / np.maximum(count[1], 1)
        return found

    rooms_m2 = np.bincount(part[room], minlength=n_parts + 1) * survey.cell_m2
    is_floor = rooms_m2 >= MIN_AREA_M2
    if not is_floor.any():
        return none
    is_roof = ~is_floor & (share(is_open, bare) >= _HALF) & (share(over_rooms, bare) >= _HALF)
    is_roof &= share(along, outline > 0, outline) < _HALF
    roof = lines_of(is_roof[part])
    found = ground & roof.ravel()[columns.column]
    # What is under the walls that stand on a roof goes with the rest of its triangle.
    n_all, n_found = (np.bincount(columns.triangle[each], minlength=survey.level.size) for each in (ground, found))
    taken: BoolArray = found | (ground & (n_found > _HALF * n_all)[columns.triangle])
    return taken


def _plan(survey: LevelSurvey, crossings: BoolArray) -> BoolArray:
    """(ny, nx) bool, with the margin: plumb lines with one of these crossings."""
    columns = survey.columns
    seen = np.zeros(columns.x_m.size * columns.y_m.size, dtype=np.bool_)
    seen[columns.column[crossings]] = True
    return np.pad(seen.reshape(columns.y_m.size, columns.x_m.size), MARGIN)


def _cut(survey: LevelSurvey, triangles: BoolArray, z_m: float) -> BoolArray:
    """(ny, nx) bool, with the margin: cells that the cut of triangles (T,) bool at the height z_m runs through."""
    return cut_around_lines(survey, survey.cut_of(triangles, z_m)[1])
