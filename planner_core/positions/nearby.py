"""Places off the grid: near stations that were chosen, at other heights too, where a tripod can stand as well.

Input the `Tripods` of a survey (local frame, metres) and positions, output `Candidates` in the order of the positions
they are near, rounded to 0.1 mm before anything is computed of them: they are the same places once they have gone
through a file.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import Candidates, FloatArray, Int64Array
from planner_core.positions.admissibility import RefusalTally, Tripods
from planner_core.positions.grid import candidates_of
from planner_core.positions.rounding import SET_UP_DIGITS, as_written_m
from planner_core.progress import Progress, silent

#: Directions in plan, evenly around.
N_DIRECTIONS = 8


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
