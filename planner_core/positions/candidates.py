"""Candidates: positions at which a tripod can stand, on a grid over each floor or near given ones.

Input the `Tripods` of a survey (local frame, metres), output `Candidates` ordered by floor, y, x, height.

The grid is centred on the floor's bounds, so that moving or turning the building by quarters moves it along. A regular
grid passes by rooms that are hardly wider than a tripod with its clearance, and no plan sees a room without candidates.
So the grid is halved twice where it has found nothing nearby:

    +---+---+---+     o candidate of the grid
    | o | o |.o.|     . candidate of the halved grid, in the narrow room only
    +---+---+---+

Off the grid there are candidates near given ones, at other heights too (`places_nearby`), in the order of those.
Positions are rounded to 0.1 mm, heights to the digits of plan.json, before anything is computed of them: so plans read
back are the same plans. The local frame is whole metres off the scene frame: a place has as many digits in the one as
in the other.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from planner_core.model import BoolArray, Candidates, FloatArray, Int64Array
from planner_core.positions.admissibility import NO_GROUND, RefusalTally, Tripods
from planner_core.positions.ground_surface import grid_on_ground
from planner_core.progress import Progress, silent

#: The grid is halved this often where it found nothing: 0.5 m become 0.125 m, finer than anybody sets up a tripod.
N_HALVINGS = 2
#: Low parts of a room, below eaves and galleries, reach less far from where a tripod has its usual height.
_LOW_ROOM_M = 3.0
#: Directions in plan, evenly around.
N_DIRECTIONS = 8
#: Digits of metres that plan.json keeps of places and heights: micrometres.
WRITTEN_DIGITS = 6
#: Digits of places that are chosen freely, off the grid: nobody sets up a tripod to less than 0.1 mm, and
#: stations.csv has no more either.
SET_UP_DIGITS = 4


def find_candidates(tripods: Tripods, *, n_halvings: int = N_HALVINGS, progress: Progress = silent) -> Candidates:
    """Find the admissible positions of the grid on the planned floors.

    The grid is halved `n_halvings` times where nothing is found; 0 is the paper's uniform matrix (section 3.4).
    `n_tried` counts grid points over the floors' bounds times heights; `rejected` those that are no candidates, by
    reason, see `planner_core.positions.admissibility`.
    """
    tally = RefusalTally()
    on_floor = [(index, *_on_floor(tripods, index, n_halvings, tally, progress)) for index in tripods.survey.planned]
    return candidates_of(on_floor, tally)


def candidates_of(on_floor: list[tuple[int, FloatArray, FloatArray]], tally: RefusalTally) -> Candidates:
    """Join positions (N, 3) and instrument heights (N,) of floors, by index."""
    return Candidates(
        position_m=np.ascontiguousarray(np.concatenate([np.empty((0, 3)), *(place for _, place, _ in on_floor)])),
        floor=np.concatenate([np.empty(0, np.int32), *(np.full(len(z), i, np.int32) for i, _, z in on_floor)]),
        instrument_height_m=np.concatenate([np.empty(0), *(height for _, _, height in on_floor)]),
        n_tried=tally.n_tried,
        rejected=tally.rejected,
    )


def at_heights(
    heights_m: tuple[float, ...], plan_m: FloatArray, ground_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions (K, 3), grounds and heights (K,): every height over every place (N, 2) with its ground (N,).

    Places and heights have as many digits as plan.json keeps.
    """
    height = np.tile(as_written_m(np.array(heights_m)), ground_m.size)
    ground = np.repeat(ground_m, len(heights_m))
    position = as_written_m(np.column_stack([np.repeat(plan_m, len(heights_m), axis=0), ground + height]))
    return position, ground, height


def is_near(place_m: FloatArray, taken_m: FloatArray, reach_m: float) -> BoolArray:
    """(N,) bool: whether a place (N, D) has a taken one (M, D) within reach."""
    if not taken_m.size:
        return np.zeros(place_m.shape[0], dtype=bool)
    distance_m, _ = cKDTree(taken_m).query(place_m, distance_upper_bound=reach_m)
    return np.asarray(np.isfinite(distance_m), dtype=bool)


def places_nearby(
    tripods: Tripods,
    near: Candidates,
    *,
    radii_m: tuple[float, ...],
    rises_m: tuple[float, ...],
    progress: Progress = silent,
) -> Candidates:
    """Find admissible positions around each of `near`, on its floor.

    Parameters
    ----------
    radii_m
        Of the circles of eight positions around each, at its height above the ground.
    rises_m
        Above (or, below zero, below) each position itself; heights that the tripod does not have are left out.
        Where the heights are fixed, none is tried.
    """
    shift_m = _shifts_m(radii_m, () if tripods.heights.fixed_m else rises_m)
    tally = RefusalTally()
    on_floor, source = [], [np.empty(0, np.int64)]
    for index in sorted({int(f) for f in near.floor}):
        who = np.flatnonzero(near.floor == index)
        place_m, ground_m, height_m, of = _around(tripods, index, near, who, shift_m)
        kept = tripods.tests(index).keep(place_m, ground_m, tally, progress)
        on_floor.append((index, place_m[kept], height_m[kept]))
        source.append(of[kept])
    return candidates_of(on_floor, tally).take(np.argsort(np.concatenate(source), kind="stable"))


def as_written_m(value_m: FloatArray, digits: int = WRITTEN_DIGITS) -> FloatArray:
    """Round metres of any shape; what is rounded stays as it is, bit by bit."""
    rounded: FloatArray = np.round(value_m, digits) + 0.0  # + 0.0 turns -0.0 into 0.0
    return rounded


def local_of_written_m(scene_m: Iterable[float], offset_m: FloatArray) -> FloatArray:
    """(3,) float64, local frame: a place (3,) of the scene frame, as a plan or a review has it.

    Far from the origin a sum with the offset loses its last bits; rounding brings back those that were written.
    """
    return as_written_m(np.array(list(scene_m), dtype=np.float64) - offset_m)


def _on_floor(
    tripods: Tripods, index: int, n_halvings: int, tally: RefusalTally, progress: Progress
) -> tuple[FloatArray, FloatArray]:
    """Positions (N, 3) and instrument heights (N,) of one floor, ordered by y, x, height."""
    step_m, heights_m, tests = tripods.grid_step_m, tripods.heights.to_try_m, tripods.tests(index)
    # Two spots on either side of a wall are at least twice the clearance apart: a candidate nearer is in the same room.
    reach_m = min(step_m, 2.0 * tripods.clearance_m or 0.5 * step_m)
    position_m, height_m = np.empty((0, 3)), np.empty(0)
    for halving in range(n_halvings + 1):
        plan_m, ground_m, n_bare = grid_on_ground(tripods.survey, tripods.survey.floors[index], step_m / 2**halving)
        if halving == 0:
            tally.n_tried += n_bare * len(heights_m)
            tally.refuse(NO_GROUND, n_bare * len(heights_m))
        far = ~is_near(plan_m, position_m[:, :2], reach_m)
        position, ground, height = at_heights(heights_m, plan_m[far], ground_m[far])
        kept = tests.keep(position, ground, tally, progress)
        position_m = np.concatenate([position_m, position[kept]])
        height_m = np.concatenate([height_m, height[kept]])
    lowered_m, lowered_height_m = _lowered(tripods, index, position_m, tally)
    position_m, height_m = np.concatenate([position_m, lowered_m]), np.concatenate([height_m, lowered_height_m])
    order = np.lexsort((height_m, position_m[:, 0], position_m[:, 1]))
    return position_m[order], height_m[order]


def _lowered(tripods: Tripods, index: int, usual_m: FloatArray, tally: RefusalTally) -> tuple[FloatArray, FloatArray]:
    """Positions (N, 3) and heights (N,) of a lowered tripod, in rooms of the floor too low for the usual height.

    usual_m : (M, 3) positions at the usual height. Below eaves and beams beside them the tripod stays as it is.
    """
    heights, tests = tripods.heights, tripods.tests(index)
    if not heights.lowered_m:
        return np.empty((0, 3)), np.empty(0)
    plan_m, ground_m, _ = grid_on_ground(tripods.survey, tripods.survey.floors[index], tripods.grid_step_m)
    low = tests.lacks_headroom(np.column_stack([plan_m, ground_m + heights.fixed_m[0]]))
    # All heights that fit: the lower the sensor, the more of a low ceiling it sees at enough incidence.
    position, ground, height_m = at_heights(heights.lowered_m, plan_m[low], ground_m[low])
    kept = tests.keep(position, ground, tally)
    position_m, height_m = position[kept], height_m[kept]
    needed = _apart_from(usual_m, position_m, 1.5 * tripods.grid_step_m)
    return position_m[needed], height_m[needed]


def _apart_from(usual_m: FloatArray, position_m: FloatArray, near_m: float) -> BoolArray:
    """(N,) bool: positions (N, 3) that no chain of others, each within `near_m` in plan, joins to usual ones (M, 3).

    So far from all of these that they are a room's width away, they count, too: through a doorway, rooms are joined.
    """
    if not position_m.size or not usual_m.size:
        return np.ones(len(position_m), dtype=bool)
    plan_m = np.concatenate([usual_m, position_m])[:, :2]
    pairs = cKDTree(plan_m).query_pairs(near_m, output_type="ndarray")
    graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(plan_m),) * 2)
    _, room = connected_components(graph, directed=False)
    with_usual = np.isin(room[len(usual_m) :], room[: len(usual_m)])
    return ~with_usual | ~is_near(position_m[:, :2], usual_m[:, :2], _LOW_ROOM_M)


def _shifts_m(radii_m: tuple[float, ...], rises_m: tuple[float, ...]) -> FloatArray:
    """(K, 3) from a station to the places around it."""
    # Turned from circle to circle, so that together they look in more directions.
    around = [
        radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(N_DIRECTIONS)])
        for number, radius in enumerate(radii_m)
        for angle in [2.0 * np.pi / N_DIRECTIONS * (np.arange(N_DIRECTIONS) + 0.5 * (number % 2))]
    ]
    return np.concatenate([*around, np.array([[0.0, 0.0, rise] for rise in rises_m]).reshape(-1, 3)])


def _around(
    tripods: Tripods, index: int, near: Candidates, who: Int64Array, shift_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, Int64Array]:
    """Positions (N, 3), grounds and instrument heights (N,), and which of `near` each is around (N,)."""
    place_m = as_written_m((near.position_m[who][:, None, :] + shift_m).reshape(-1, 3), SET_UP_DIGITS)
    height_m = as_written_m((near.instrument_height_m[who][:, None] + shift_m[:, 2]).reshape(-1), SET_UP_DIGITS)
    of = np.repeat(who, shift_m.shape[0])
    heights = tripods.heights
    if not heights.fixed_m:  # what the user fixed counts, whatever the scanner's range
        fits = (height_m >= heights.low_m - 1e-9) & (height_m <= heights.high_m + 1e-9)
        place_m, height_m, of = place_m[fits], height_m[fits], of[fits]
    ground_m = tripods.ground(index).below(place_m)
    place_m = np.column_stack([place_m[:, :2], as_written_m(ground_m + height_m, SET_UP_DIGITS)])
    return place_m, ground_m, height_m, of
