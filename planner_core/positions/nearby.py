"""Places off the grid: near stations that were chosen, at other heights too, where a tripod can stand as well.

Input a `Survey` (local frame, metres) and positions, output `Candidates` in the order of the positions they are near,
rounded to 0.1 mm before anything is asked of them: they are the same places once they have gone through a file.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Candidates, FloatArray, Int64Array, PlanSettings, Survey
from planner_core.positions.admissibility import Tally, TripodTests
from planner_core.positions.ground_surface import GroundSurface
from planner_core.positions.rounding import SET_UP_DIGITS, as_written_m
from planner_core.progress import Progress, silent

#: Directions in plan, evenly around.
N_DIRECTIONS = 8


def places_nearby(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
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
        Where the settings fix the heights, none is tried.
    """
    shift_m = _shifts_m(radii_m, () if settings.fixed_heights_m else rises_m)
    tally = Tally()
    position_m, floor, height_m, source = (
        [np.empty((0, 3))],
        [np.empty(0, np.int32)],
        [np.empty(0)],
        [np.empty(0, np.int64)],
    )
    for index in sorted({int(f) for f in near.floor}):
        who = np.flatnonzero(near.floor == index)
        tests = TripodTests(survey, settings, engine, survey.floors[index], tally=tally, progress=progress)
        surface = GroundSurface(survey, survey.floors[index])
        found_m, heights_m, of = _on_floor(settings, near, who, shift_m, surface, tests)
        position_m.append(found_m)
        height_m.append(heights_m)
        floor.append(np.full(of.size, index, dtype=np.int32))
        source.append(of)
    order = np.argsort(np.concatenate(source), kind="stable")
    return Candidates(
        position_m=np.ascontiguousarray(np.concatenate(position_m)[order]),
        floor=np.concatenate(floor)[order],
        instrument_height_m=np.concatenate(height_m)[order],
        n_tried=tally.n_tried,
        rejected=tally.rejected,
    )


def _shifts_m(radii_m: tuple[float, ...], rises_m: tuple[float, ...]) -> FloatArray:
    """(K, 3) from a station to the places around it."""
    # Turned from circle to circle, so that together they look in more directions.
    around = [
        radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(N_DIRECTIONS)])
        for number, radius in enumerate(radii_m)
        for angle in [2.0 * np.pi / N_DIRECTIONS * (np.arange(N_DIRECTIONS) + 0.5 * (number % 2))]
    ]
    return np.concatenate([*around, np.array([[0.0, 0.0, rise] for rise in rises_m]).reshape(-1, 3)])


def _on_floor(
    settings: PlanSettings,
    near: Candidates,
    who: Int64Array,
    shift_m: FloatArray,
    surface: GroundSurface,
    tests: TripodTests,
) -> tuple[FloatArray, FloatArray, Int64Array]:
    """Positions (N, 3), instrument heights (N,) and which of `near` each is around (N,)."""
    place_m = as_written_m((near.position_m[who][:, None, :] + shift_m).reshape(-1, 3), SET_UP_DIGITS)
    height_m = as_written_m((near.instrument_height_m[who][:, None] + shift_m[:, 2]).reshape(-1), SET_UP_DIGITS)
    of = np.repeat(who, shift_m.shape[0])
    low_m, high_m = settings.scanner.instrument_height_min_m, settings.scanner.instrument_height_max_m
    fits = (height_m >= low_m - 1e-9) & (height_m <= high_m + 1e-9)
    if settings.fixed_heights_m:
        fits[:] = True  # what the user fixed counts, whatever the scanner's range
    place_m, height_m, of = place_m[fits], height_m[fits], of[fits]
    ground_m = surface.below(place_m)
    place_m = np.column_stack([place_m[:, :2], as_written_m(ground_m + height_m, SET_UP_DIGITS)])
    kept = tests.keep(place_m, ground_m)
    return place_m[kept], height_m[kept], of[kept]
