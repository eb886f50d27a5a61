"""Starting positions at random: spread over each floor and the scanner's heights, a tripod can stand at each.

Input the `Tripods` of a survey (local frame, metres), output `Candidates` in the order they were drawn. The regular
sampling is `find_candidates` in `planner_core.positions.candidates` with `n_halvings=0`.

References
----------
López et al. 2023, section 3.4: a random uniform distribution, to explore fewer positions than the full matrix.
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Candidates, FloatArray, InstrumentHeights
from planner_core.positions.admissibility import RefusalTally, Tripods
from planner_core.positions.candidates import candidates_of
from planner_core.positions.ground_surface import GroundSurface
from planner_core.progress import Progress, silent

#: Positions drawn at a time. Part of what a seed means only in the tally; the positions found do not depend on it.
_BLOCK = 512
#: Draws for each position wanted, before a floor is given up: on one with less than a hundredth of its bounds free.
MAX_DRAWS_EACH = 200


def sample_at_random(tripods: Tripods, *, n_each: int, seed: int, progress: Progress = silent) -> Candidates:
    """Draw admissible positions on each planned floor until there are `n_each`.

    Places are uniform over the floor's bounds; heights over the scanner's range, or among the fixed heights.
    Asking for more, or for other floors too, gives the same positions first. A floor with hardly any free ground gives
    fewer, see `MAX_DRAWS_EACH`.

    Raises
    ------
    RequirementError
        A negative seed or `n_each`.
    """
    if n_each < 0 or seed < 0:
        raise RequirementError(f"random starts: got n_each {n_each}, seed {seed}, expected 0 or more; e.g. 100 and 0")
    tally = RefusalTally()
    floors = tripods.survey.planned
    return candidates_of(
        [(index, *_on_floor(tripods, index, n_each, seed, tally, progress)) for index in floors], tally
    )


def _on_floor(
    tripods: Tripods, index: int, n_wanted: int, seed: int, tally: RefusalTally, progress: Progress
) -> tuple[FloatArray, FloatArray]:
    """Positions (N, 3) and instrument heights (N,) of one floor."""
    floor, surface = tripods.survey.floors[index], tripods.ground(index)
    stream = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(index,))))
    position_m, height_m = np.empty((0, 3)), np.empty(0)
    left = MAX_DRAWS_EACH * n_wanted
    while height_m.size < n_wanted and left > 0:
        u = stream.random((min(_BLOCK, left), 4))
        left -= u.shape[0]
        plan = floor.bounds_m[0] + u[:, :2] * (floor.bounds_m[1] - floor.bounds_m[0])
        ground = _some_ground(surface, plan, u[:, 2])
        height = _heights_m(tripods.heights, u[:, 3])
        position = np.column_stack([plan, ground + height])
        kept = tripods.tests(index).keep(position, ground, tally, progress)
        position_m = np.concatenate([position_m, position[kept]])
        height_m = np.concatenate([height_m, height[kept]])
    tally.refuse("more than required", max(0, height_m.size - n_wanted))
    return position_m[:n_wanted], height_m[:n_wanted]


def _some_ground(surface: GroundSurface, plan_m: FloatArray, u: FloatArray) -> FloatArray:
    """Height of ground at places (N, 2), NaN where there is none; one or another of several, by u (N,) in [0, 1)."""
    probe_m = surface.low_m + u * (surface.high_m - surface.low_m)
    ground_m = surface.below(np.column_stack([plan_m, probe_m]))
    top_m = surface.below(np.column_stack([plan_m, np.full(u.size, surface.high_m)]))
    return np.where(np.isnan(ground_m), top_m, ground_m)


def _heights_m(heights: InstrumentHeights, u: FloatArray) -> FloatArray:
    """Heights of uniform numbers (N,) in [0, 1)."""
    if heights.fixed_m:
        return np.array(heights.fixed_m)[np.floor(u * len(heights.fixed_m)).astype(np.int64)]
    return heights.low_m + u * (heights.high_m - heights.low_m)
