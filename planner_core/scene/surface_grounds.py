"""Floors of a scene that names no storeys: heights with much level, head-high area.

Local frame, metres.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray
from planner_core.scene.columns import Columns
from planner_core.scene.level_surfaces import (
    MIN_AREA_M2,
    MIN_LEVEL_DISTANCE_M,
    SAME_HEIGHT_M,
    Ground,
    LevelSurvey,
    ground_of,
    main_height_m,
    mostly,
)

#: A surface of a scene without storeys is a level's ground if it has this share of the largest one. Desks in an office
#: take about a tenth of the floor.
_MIN_AREA_SHARE = 0.15


def grounds_of_surfaces(survey: LevelSurvey, warnings: list[str]) -> list[Ground]:
    """Levels of a scene that names no storeys: heights with much level, head-high area, largest first."""
    columns = survey.columns
    clear = survey.level[columns.triangle] & (survey.clear_m >= MIN_LEVEL_DISTANCE_M)
    levels = _levels(survey, clear & np.isfinite(survey.clear_m))
    # Storeys without a roof in the model: open ground between walls, further than a storey from what was found.
    for main_m, samples in _levels(survey, clear & ~np.isfinite(survey.clear_m)):
        bounds = survey.bounds_of(np.unique(columns.triangle[samples]))
        apart = all(abs(main_m - other) >= MIN_LEVEL_DISTANCE_M for other, _ in levels)
        if apart and survey.walls_around(bounds, main_m):
            levels.append((main_m, samples))
    if not levels:
        levels = _levels(survey, clear)[:1]
        if levels:
            warnings.append("nothing is covered and no walls stand on the ground; the largest level surface is planned")
    grounds = []
    for number, (main_m, samples) in enumerate(sorted(levels, key=lambda level: level[0])):
        near = clear & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
        triangles = mostly(survey, samples | near, survey.level)
        shown = np.isin(columns.triangle, triangles)  # what is under furniture and walls is ground as well
        used = (samples | near) & shown
        grounds.append(ground_of(survey, f"Level {number + 1}", "surface", triangles, shown, used))
    return grounds


def _levels(survey: LevelSurvey, clear: BoolArray) -> list[tuple[float, BoolArray]]:
    """(height, crossings) of levels among `clear` ones, largest first; split-level parts are joined to theirs."""
    columns, left = survey.columns, clear.copy()
    levels: list[tuple[float, BoolArray]] = []
    smallest = MIN_AREA_M2 / survey.cell_m2
    while left.sum() >= smallest:
        main_m = main_height_m(columns.z_m[left])
        part = left & (np.abs(columns.z_m - main_m) <= SAME_HEIGHT_M)
        left &= ~part
        if levels:
            smallest = max(smallest, _MIN_AREA_SHARE * levels[0][1].sum())
        if part.sum() < smallest:
            break
        near = [i for i, (height, _) in enumerate(levels) if abs(height - main_m) < MIN_LEVEL_DISTANCE_M]
        if not near:
            levels.append((main_m, part))
        elif not _stands_on(columns, part, levels[near[0]][1]):
            levels[near[0]] = (levels[near[0]][0], levels[near[0]][1] | part)
    return levels


def _stands_on(columns: Columns, part: BoolArray, ground: BoolArray) -> bool:
    """Tell whether most of `part` has the ground's triangles in the same columns: furniture, not a split level."""
    same = np.isin(columns.triangle, np.unique(columns.triangle[ground]))
    has = np.zeros(columns.x_m.size * columns.y_m.size, dtype=bool)
    has[columns.column[same]] = True
    return bool(has[columns.column[part]].mean() > 0.5)
