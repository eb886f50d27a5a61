"""Candidates: positions on a grid over each floor at which a tripod can stand, nobody having chosen any yet.

Input a `Survey` (local frame, metres) and `PlanSettings`, output `Candidates` ordered by floor, y, x, height.

The grid is centred on the floor's bounds, so that moving or turning the building by quarters moves it along. A regular
grid passes by rooms that are hardly wider than a tripod with its clearance, and no plan sees a room without candidates.
So the grid is halved twice where it has found nothing nearby:

    +---+---+---+     o candidate of the grid
    | o | o |.o.|     . candidate of the halved grid, in the narrow room only
    +---+---+---+
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, Candidates, FloatArray, Floor, PlanSettings, Survey
from planner_core.positions.admissibility import NO_GROUND, Tally, TripodTests
from planner_core.positions.ground_surface import grid_on_ground
from planner_core.positions.rounding import as_written_m
from planner_core.progress import Progress, silent

#: The grid is halved this often where it found nothing: 0.5 m become 0.125 m, finer than anybody sets up a tripod.
N_HALVINGS = 2


def find_candidates(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    *,
    floors: tuple[int, ...],
    n_halvings: int = N_HALVINGS,
    progress: Progress = silent,
) -> Candidates:
    """Find the admissible positions of the grid on `floors` (indices into survey.floors).

    The grid is halved `n_halvings` times where nothing is found; 0 is the paper's uniform matrix (section 3.4).
    `n_tried` counts grid points over the floors' bounds times heights; `rejected` those that are no candidates, by
    reason, see `planner_core.positions.admissibility`.
    """
    tally = Tally()
    on_floor = []
    for floor in (survey.floors[index] for index in floors):
        tests = TripodTests(survey, settings, engine, floor, tally=tally, progress=progress)
        on_floor.append(_on_floor(survey, settings, floor, n_halvings, tests))
    sizes = [height.size for _, height in on_floor]
    return Candidates(
        position_m=np.ascontiguousarray(np.concatenate([np.empty((0, 3)), *(place for place, _ in on_floor)])),
        floor=np.repeat(np.array(floors, dtype=np.int32), sizes),
        instrument_height_m=np.concatenate([np.empty(0), *(height for _, height in on_floor)]),
        n_tried=tally.n_tried,
        rejected=tally.rejected,
    )


def _on_floor(
    survey: Survey, settings: PlanSettings, floor: Floor, n_halvings: int, tests: TripodTests
) -> tuple[FloatArray, FloatArray]:
    """Positions (N, 3) and instrument heights (N,) of one floor, ordered by y, x, height."""
    # Two spots on either side of a wall are at least twice the clearance apart: a candidate nearer is in the same room.
    reach_m = min(settings.grid_step_m, 2.0 * settings.clearance_m or 0.5 * settings.grid_step_m)
    heights_m = settings.heights_to_try_m
    position_m, height_m = np.empty((0, 3)), np.empty(0)
    for halving in range(n_halvings + 1):
        plan_m, ground_m, n_bare = grid_on_ground(survey, floor, settings.grid_step_m / 2**halving)
        if halving == 0:
            tests.tally.n_tried += n_bare * len(heights_m)
            tests.tally.refuse(NO_GROUND, n_bare * len(heights_m))
        far = ~is_near(plan_m, position_m[:, :2], reach_m)
        position, height = at_heights(heights_m, plan_m[far], ground_m[far], tests)
        position_m = np.concatenate([position_m, position])
        height_m = np.concatenate([height_m, height])
    order = np.lexsort((height_m, position_m[:, 0], position_m[:, 1]))
    return position_m[order], height_m[order]


def at_heights(
    heights_m: tuple[float, ...], plan_m: FloatArray, ground_m: FloatArray, tests: TripodTests
) -> tuple[FloatArray, FloatArray]:
    """Positions (K, 3) and heights (K,) at which a tripod can stand, over places (N, 2) with grounds (N,).

    Every height is tried over every place. Places and heights have as many digits as plan.json keeps.
    """
    height = np.tile(as_written_m(np.array(heights_m)), ground_m.size)
    ground = np.repeat(ground_m, len(heights_m))
    position = as_written_m(np.column_stack([np.repeat(plan_m, len(heights_m), axis=0), ground + height]))
    kept = tests.keep(position, ground)
    return position[kept], height[kept]


def is_near(plan_m: FloatArray, taken_m: FloatArray, reach_m: float) -> BoolArray:
    """(N,) bool: whether a place (N, 2) has a taken one (M, 2) within reach."""
    if not taken_m.size:
        return np.zeros(plan_m.shape[0], dtype=bool)
    distance_m, _ = cKDTree(taken_m).query(plan_m, distance_upper_bound=reach_m)
    return np.asarray(np.isfinite(distance_m), dtype=bool)
