"""Candidates: positions on a regular grid over each floor at which a tripod can stand, nobody having chosen any yet.

Input a `Survey` (local frame, metres) and `PlanSettings`, output `Candidates` ordered by floor, y, x, height.

The grid is centred on the floor's bounds, so that moving or turning the building by quarters moves it along.
"""

from __future__ import annotations

import numpy as np

from planner_core.candidates.admissibility import reject
from planner_core.errors import RequirementError
from planner_core.model import Candidates, FloatArray, Floor, Int64Array, PlanSettings, Survey
from planner_core.progress import Progress, silent
from planner_core.scan.engine import ScanEngine
from planner_core.scene.columns import sample_columns

#: Two grounds of one column closer than this are one: a covering on its slab, the upper one counts.
_SAME_GROUND_M = 0.1


def find_candidates(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, *, floors: tuple[int, ...], progress: Progress = silent
) -> Candidates:
    """Find the admissible positions of the grid on `floors` (indices into survey.floors).

    `n_tried` counts grid points over the floors' bounds times heights; `rejected` those that are no candidates, by
    reason, see `planner_core.candidates.admissibility`.
    """
    heights_m = instrument_heights_m(settings)
    positions, grounds, floor_of = [np.empty((0, 3))], [np.empty(0)], [np.empty(0, dtype=np.int32)]
    rejected: dict[str, int] = {}
    n_tried = 0
    for index in floors:
        floor = survey.floors[index]
        plan_m, ground_m, n_bare = _grid_on_ground(survey, floor, settings.grid_step_m)
        n_tried += (plan_m.shape[0] + n_bare) * heights_m.size
        _count(rejected, "no ground of this floor below", n_bare * heights_m.size)
        height = np.tile(heights_m, ground_m.size)
        ground = np.repeat(ground_m, heights_m.size)
        position = np.column_stack([np.repeat(plan_m, heights_m.size, axis=0), ground + height])
        kept, reasons = reject(survey, floor, settings, engine, position, ground, progress=progress)
        for reason, number in reasons.items():
            _count(rejected, reason, number)
        positions.append(position[kept])
        grounds.append(height[kept])
        floor_of.append(np.full(int(kept.sum()), index, dtype=np.int32))
    return Candidates(
        position_m=np.ascontiguousarray(np.concatenate(positions)),
        floor=np.concatenate(floor_of),
        instrument_height_m=np.concatenate(grounds),
        n_tried=n_tried,
        rejected=rejected,
    )


def instrument_heights_m(settings: PlanSettings) -> FloatArray:
    """(H,) float64: the heights to try, those given or the scanner's range in steps, lowest first."""
    if settings.instrument_heights_m:
        return np.array(sorted(set(settings.instrument_heights_m)), dtype=np.float64)
    low, high = settings.scanner.instrument_height_min_m, settings.scanner.instrument_height_max_m
    n_steps = int(np.floor((high - low) / settings.height_step_m + 1e-9))
    return low + settings.height_step_m * np.arange(n_steps + 1, dtype=np.float64)


def _grid_on_ground(survey: Survey, floor: Floor, step_m: float) -> tuple[FloatArray, FloatArray, int]:
    """Grid points that have ground: places (N, 2), ground heights (N,); and the number of points without any."""
    extent = floor.bounds_m[1] - floor.bounds_m[0]
    n = np.floor(extent / step_m + 1e-9).astype(np.int64) + 1
    if float(n.prod()) > 1e7:
        raise RequirementError(
            f"grid_step_m: {step_m} makes {float(n.prod()):.3g} grid points on floor {floor.name!r}, expected at most "
            "1e7; use a larger step"
        )
    low = floor.bounds_m.mean(axis=0) - 0.5 * (n - 1) * step_m
    if floor.ground_triangles.size == 0:
        index = np.arange(int(n.prod()))
        return _places(index, low, step_m, int(n[0])), np.full(index.size, floor.elevation_m), 0
    corners = survey.scene.vertices_m[survey.scene.triangles[floor.ground_triangles]]
    shape = (int(n[0]), int(n[1]))
    columns = sample_columns(corners, floor.ground_triangles, low_m=low, step_m=step_m, shape=shape)
    # The highest of crossings that lie within a covering's thickness: the last before a gap, sorted by height.
    last = np.ones(columns.z_m.size, dtype=bool)
    same = columns.column[1:] == columns.column[:-1]
    last[:-1] = ~same | (np.diff(columns.z_m) > _SAME_GROUND_M)
    column, ground_m = columns.column[last], columns.z_m[last]
    return _places(column, low, step_m, shape[0]), ground_m, int(n.prod()) - np.unique(column).size


def _places(column: Int64Array, low_m: FloatArray, step_m: float, n_x: int) -> FloatArray:
    index = np.column_stack([column % n_x, column // n_x]).astype(np.float64)
    return low_m + step_m * index


def _count(rejected: dict[str, int], reason: str, number: int) -> None:
    if number:
        rejected[reason] = rejected.get(reason, 0) + number
