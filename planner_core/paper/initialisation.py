"""Initialisation: starting positions at random, and the paper's tests of whether a scanner can stand at a position.

Input the `Tripods` of a survey (local frame, metres), output `Candidates` in the order they were drawn, spread over
each floor and the scanner's heights. The regular sampling is `find_candidates` in
`planner_core.positions.candidates` with `n_halvings=0`.

The paper's three tests of whether a scanner can stand at a position are as it prints them; its y axis is our z.
`planner_core.positions.admissibility` asks for more: headroom, eight directions at three heights, level feet, a roof;
and for less where something lies flush with the ground.

References
----------
López et al. 2023, section 3.4: a random uniform distribution, to explore fewer positions than the full matrix.
Table 2: r = 0.2 m, m = 16 rays, d = 0.4 m.
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Candidates, FloatArray, InstrumentHeights
from planner_core.positions.admissibility import RefusalTally, Tripods
from planner_core.positions.candidates import candidates_of
from planner_core.positions.ground_surface import GroundSurface
from planner_core.progress import Progress, silent

#: Positions drawn at a time. Part of what a seed means only in the tally; the positions found do not depend on it.
_BLOCK = 512
#: Draws for each position wanted, before a floor is given up: on one with less than a hundredth of its bounds free.
MAX_DRAWS_EACH = 200
_DOWN = np.array([[0.0, 0.0, -1.0]])
_SIDEWAYS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])


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


def stands_by_published_tests(tripods: Tripods, floor: int, positions_m: FloatArray) -> BoolArray:
    """(N,) bool: which of positions (N, 3) pass all three tests; none on a floor without slab, hence without polygons.

    1. The first surface straight down is ground.
    2. So it is from each of m places on a circle of radius r about the position.
    3. Nothing lies within d in the four horizontal directions of the axes.
    """
    survey, cast_rays, clearance_m = tripods.survey, tripods.engine.cast_rays, tripods.clearance_m
    is_ground = np.zeros(survey.scene.n_triangles + 1, dtype=bool)  # the last entry is the miss, -1
    is_ground[survey.floors[floor].ground_triangles] = True
    vertices_m = survey.scene.vertices_m
    reach_m = float(np.abs(vertices_m).max() + np.abs(positions_m).max(initial=0.0)) * 2.0 + 1.0
    angle = np.arange(tripods.n_ring_rays) * (2.0 * np.pi / tripods.n_ring_rays)
    ring = tripods.ring_radius_m * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(angle.size)])

    def over_ground(places_m: FloatArray) -> BoolArray:
        down = np.broadcast_to(_DOWN, places_m.shape)
        return np.asarray(is_ground[cast_rays(places_m, down, range_max_m=reach_m).triangle])

    kept = over_ground(positions_m)
    left = np.flatnonzero(kept)
    feet = (positions_m[left, None, :] + ring).reshape(-1, 3)
    kept[left] = over_ground(feet).reshape(left.size, ring.shape[0]).all(axis=1)
    left = np.flatnonzero(kept)
    if clearance_m > 0 and left.size:
        origins = np.repeat(positions_m[left], len(_SIDEWAYS), axis=0)
        hits = cast_rays(origins, np.tile(_SIDEWAYS, (left.size, 1)), range_max_m=clearance_m)
        kept[left] = np.isnan(hits.range_m).reshape(left.size, len(_SIDEWAYS)).all(axis=1)
    return kept


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
