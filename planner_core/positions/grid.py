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
from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Candidates, FloatArray, Floor, Int64Array, PlanSettings, Survey
from planner_core.positions.admissibility import is_mostly_covered, reject
from planner_core.positions.rounding import as_written_m
from planner_core.progress import Progress, silent
from planner_core.scene.columns import sample_columns

#: The grid is halved this often where it found nothing: 0.5 m become 0.125 m, finer than anybody sets up a tripod.
N_HALVINGS = 2
#: The reason of positions that have no ground of their floor below them.
NO_GROUND = "no ground of this floor below"
#: Two grounds of one column closer than this are one: a covering on its slab, the upper one counts.
_SAME_GROUND_M = 0.1


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
    on_floor = [
        _on_floor(survey, settings, engine, survey.floors[index], n_halvings, tally, progress) for index in floors
    ]
    sizes = [height.size for _, height in on_floor]
    return Candidates(
        position_m=np.ascontiguousarray(np.concatenate([np.empty((0, 3)), *(place for place, _ in on_floor)])),
        floor=np.repeat(np.array(floors, dtype=np.int32), sizes),
        instrument_height_m=np.concatenate([np.empty(0), *(height for _, height in on_floor)]),
        n_tried=tally.n_tried,
        rejected=tally.rejected,
    )


def lies_mostly_indoors(survey: Survey, settings: PlanSettings, engine: ScanEngine, floor: Floor) -> bool:
    """Whether most of the floor's ground has something overhead, see `admissibility.is_mostly_covered`."""
    plan_m, ground_m, _ = _grid_on_ground(survey, floor, settings.grid_step_m)
    return is_mostly_covered(survey, engine, plan_m, ground_m)


class Tally:
    """How many grid points were tried, and why some were refused."""

    def __init__(self) -> None:
        self.n_tried = 0
        self.rejected: dict[str, int] = {}

    def refuse(self, reason: str, number: int) -> None:
        """Count positions refused for `reason`."""
        if number:
            self.rejected[reason] = self.rejected.get(reason, 0) + number


def _on_floor(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    floor: Floor,
    n_halvings: int,
    tally: Tally,
    progress: Progress,
) -> tuple[FloatArray, FloatArray]:
    """Positions (N, 3) and instrument heights (N,) of one floor, ordered by y, x, height."""
    # Two spots on either side of a wall are at least twice the clearance apart: a candidate nearer is in the same room.
    reach_m = min(settings.grid_step_m, 2.0 * settings.clearance_m or 0.5 * settings.grid_step_m)
    n_heights = instrument_heights_m(settings).size
    position_m, height_m = np.empty((0, 3)), np.empty(0)
    for halving in range(n_halvings + 1):
        plan_m, ground_m, n_bare = _grid_on_ground(survey, floor, settings.grid_step_m / 2**halving)
        far = ~is_near(plan_m, position_m[:, :2], reach_m)
        plan_m, ground_m = plan_m[far], ground_m[far]
        if halving == 0:
            tally.n_tried += n_bare * n_heights
            tally.refuse(NO_GROUND, n_bare * n_heights)
            mostly_covered = is_mostly_covered(survey, engine, plan_m, ground_m)
        position, height = admitted(
            survey, floor, settings, engine, plan_m, ground_m, tally, mostly_covered=mostly_covered, progress=progress
        )
        position_m = np.concatenate([position_m, position])
        height_m = np.concatenate([height_m, height])
    order = np.lexsort((height_m, position_m[:, 0], position_m[:, 1]))
    return position_m[order], height_m[order]


def admitted(
    survey: Survey,
    floor: Floor,
    settings: PlanSettings,
    engine: ScanEngine,
    plan_m: FloatArray,
    ground_m: FloatArray,
    tally: Tally,
    *,
    mostly_covered: bool,
    progress: Progress = silent,
) -> tuple[FloatArray, FloatArray]:
    """Positions (K, 3) and heights (K,) at which a tripod can stand, over places (N, 2) with grounds (N,) of `floor`.

    Every height of the settings is tried over every place, and told to `tally`. Places and heights have as many digits
    as plan.json keeps.
    """
    heights_m = as_written_m(instrument_heights_m(settings))
    height = np.tile(heights_m, ground_m.size)
    ground = np.repeat(ground_m, heights_m.size)
    position = as_written_m(np.column_stack([np.repeat(plan_m, heights_m.size, axis=0), ground + height]))
    tally.n_tried += height.size
    kept, reasons = reject(
        survey, floor, settings, engine, position, ground, mostly_covered=mostly_covered, progress=progress
    )
    for reason, number in reasons.items():
        tally.refuse(reason, number)
    return position[kept], height[kept]


def is_near(plan_m: FloatArray, taken_m: FloatArray, reach_m: float) -> BoolArray:
    """(N,) bool: whether a place (N, 2) has a taken one (M, 2) within reach."""
    if not taken_m.size:
        return np.zeros(plan_m.shape[0], dtype=bool)
    distance_m, _ = cKDTree(taken_m).query(plan_m, distance_upper_bound=reach_m)
    return np.asarray(np.isfinite(distance_m), dtype=bool)


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
