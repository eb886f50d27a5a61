"""Rooms without a ceiling in the model, as where a scan did not reach it: open ground beside a level that was found.

    ceiling ________                          |       |      walls, cut 1.5 m above each piece's ground
            |      |    no ceiling    |       |       |
            |      |__________________|       |_______|____  garden: walls along a part of its outline alone
    ========|======| 0.17 m higher            terrace

Local frame, metres, on the grid of plumb lines. A courtyard has walls and no ceiling, too: whether it is indoors is the
scope's to decide, which has a line about it (docs/method/scope.md).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.scene.between_walls import MARGIN, between_walls, cut_around_lines, lines_of
from planner_core.scene.inside import ROOM_WIDTH_M
from planner_core.scene.level_surfaces import MIN_AREA_M2, MIN_LEVEL_DISTANCE_M, SAME_HEIGHT_M, WALL_CUT_M, LevelSurvey

#: Walls stand along an outline that is within this of them.
_ALONG_M = 0.3
#: A piece is a room where walls, or what is higher than it, stand along so much of its outline: doors and a
#: window without glass take less than a fifth. Along two sides of four, as in a house's corner, it lies outdoors.
_CLOSED, _OUTDOORS = 0.8, 0.6
#: Furniture, and the ground around a pit, close a piece as walls do; parapets, which do not, are narrower than this.
_STEP_UP_M = 0.5
#: Furniture in a scan has no floor below it. No bed and no table has so much area, or so much of a storey.
_FURNITURE_M2, _FURNITURE_SHARE = 4.0, 0.15
#: A floor below furniture is this far below its top at least; the underside of a slab is nearer.
_UNDER_TABLE_M = 0.3


def roofless_rooms(
    survey: LevelSurvey, surface: Int64Array, main_m: float, ground: BoolArray
) -> tuple[BoolArray, list[str]]:
    """Find the open ground that is of a level's storey.

    Parameters
    ----------
    surface
        (N,) int64 number of the walkable surface that each crossing of open, level ground is on; -1: none that counts.
    main_m
        Height of the level.
    ground
        (N,) bool, the level's crossings.

    Returns
    -------
    (N,) bool crossings that belong to the level, and where ground is that may: `12 m2 about (3.0, 4.5), 0.30 m above`.
    """
    columns, cell_m2 = survey.columns, survey.cell_m2
    near = (surface >= 0) & (np.abs(columns.z_m - main_m) < MIN_LEVEL_DISTANCE_M)
    number, count = np.unique(surface[near], return_counts=True)
    order = np.argsort(-count, kind="stable")
    large_m2 = max(_FURNITURE_M2, _FURNITURE_SHARE * float(ground.sum()) * cell_m2)
    walls_at: dict[int, BoolArray] = {}
    found, unsure, heights_m = np.zeros_like(near), list[str](), [main_m]
    for each in number[order[count[order] * cell_m2 >= MIN_AREA_M2]].tolist():
        whole = near & (surface == each)
        height_m = float(np.median(columns.z_m[whole]))
        if _stands_on(survey, whole, heights_m):
            continue
        step = round(height_m / SAME_HEIGHT_M)
        if step not in walls_at:
            _, segments = survey.cut_of(~survey.level & ~survey.stray, step * SAME_HEIGHT_M + WALL_CUT_M)
            walls_at[step] = cut_around_lines(survey, segments)
        walls = walls_at[step]
        # A room and the garden that its open door leads to are one surface.
        inside = lines_of(between_walls(walls, survey.step_m)).ravel()[columns.column]
        for part, enclosed in ((whole & inside, True), (whole & ~inside, False)):
            area_m2 = float(part.sum()) * cell_m2
            if area_m2 < MIN_AREA_M2 or not _is_wide(survey, part):
                continue
            closed = _closed_share(survey, part, walls, height_m)
            if closed >= _CLOSED or (enclosed and area_m2 >= large_m2):
                found |= part
                heights_m.append(height_m)
            elif area_m2 >= _FURNITURE_M2 and (enclosed or closed >= _OUTDOORS):
                unsure.append(_place(survey, part, height_m - main_m))
    return found, unsure


def _plan(survey: LevelSurvey, crossings: BoolArray) -> BoolArray:
    """(ny, nx) bool: plumb lines with one of these crossings."""
    columns = survey.columns
    seen = np.zeros((columns.y_m.size, columns.x_m.size), dtype=np.bool_)
    seen.ravel()[columns.column[crossings]] = True
    return seen


def _stands_on(survey: LevelSurvey, part: BoolArray, heights_m: list[float]) -> bool:
    """Tell whether ground at one of some heights goes on below most of `part`: a table, not a split level."""
    columns = survey.columns
    floor = survey.level[columns.triangle] & (survey.clear_m >= _UNDER_TABLE_M)
    lowest_m = float(columns.z_m[part].min())
    floor &= np.any([np.abs(columns.z_m - height_m) <= SAME_HEIGHT_M for height_m in heights_m], axis=0)
    below = _plan(survey, floor & (columns.z_m < lowest_m))
    return bool(below.ravel()[columns.column[part]].mean() > 0.5)


def _is_wide(survey: LevelSurvey, part: BoolArray) -> bool:
    """Tell whether `part` is as wide as a room somewhere: tops of walls, worktops and shelves are not."""
    width = max(1, round(ROOM_WIDTH_M / survey.step_m))
    return bool(ndimage.binary_opening(_plan(survey, part), np.ones((width, width))).any())


def _closed_share(survey: LevelSurvey, part: BoolArray, walls: BoolArray, height_m: float) -> float:
    """Share of the outline of `part` along which `walls`, with the margin, or anything higher than it, stand."""
    plan = ndimage.binary_fill_holes(np.pad(_plan(survey, part), MARGIN))  # what stands around it, not in it
    outline = ndimage.binary_dilation(plan) & ~plan
    reach = max(1, round(_ALONG_M / survey.step_m))
    width = max(1, round(_STEP_UP_M / survey.step_m))
    higher = _plan(survey, survey.columns.z_m > height_m + SAME_HEIGHT_M)
    higher = ndimage.binary_opening(higher, np.ones((width, width)))
    closed = ndimage.binary_dilation(walls, iterations=reach) | np.pad(higher, MARGIN, mode="edge")
    return float(closed[outline].mean()) if outline.any() else 1.0


def _place(survey: LevelSurvey, part: BoolArray, above_m: float) -> str:
    """Area, place in scene coordinates, and height above the level, in words."""
    columns = survey.columns
    cell = np.unique(columns.column[part])
    plan_m = np.column_stack([columns.x_m[cell % columns.x_m.size], columns.y_m[cell // columns.x_m.size]])
    middle_m: FloatArray = plan_m[((plan_m - plan_m.mean(axis=0)) ** 2).sum(axis=1).argmin()]
    x, y = middle_m + survey.scene.offset_m[:2]
    side = "above" if above_m >= 0 else "below"
    return f"{cell.size * survey.cell_m2:.0f} m2 about ({x:.1f}, {y:.1f}), {abs(above_m):.2f} m {side} it"
