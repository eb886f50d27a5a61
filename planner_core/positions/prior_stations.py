"""Prior stations: where one that is given stands in the survey, and what is odd about its place.

Input a `PriorStation` (scene frame), output a `PriorPosition` (local frame). It stands where it stands: nothing here
moves or refuses it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, PriorStation, Survey
from planner_core.positions.admissibility import Tripods
from planner_core.positions.free_space import FreeSpace
from planner_core.positions.local_site import floors_in_words, index_of_floor
from planner_core.positions.rounding import local_of_written_m

#: Heights that differ by less are the same: stations are staked out to centimetres.
_SAME_HEIGHT_M = 0.05


@dataclass(frozen=True)
class PriorPosition:
    """position_m : (3,) float64, local, the sensor's origin. floor : index. remarks : one line each, for the user."""

    station: PriorStation
    position_m: FloatArray
    floor: int
    instrument_height_m: float
    remarks: tuple[str, ...]


def place_prior(tripods: Tripods, station: PriorStation, space: FreeSpace) -> PriorPosition:
    """Bring a station to the local frame, and find its floor and height, on stairs and landings of `space`, too."""
    survey = tripods.survey
    position_m = local_of_written_m(station.position_m, survey.scene.offset_m)
    index, remarks = _floor_of(survey, station, position_m)
    floor = survey.floors[index]
    below_m = tripods.ground(index).below(position_m[None])[0]
    ground_m = floor.elevation_m if np.isnan(below_m) else float(below_m)
    landing_m = _landing_below(space, position_m)
    on_stairs = landing_m is not None and landing_m > ground_m
    if landing_m is not None and on_stairs:
        ground_m = float(tripods.climbed_ground_m(np.array([[*position_m[:2], landing_m]]))[0])
    height_m = float(position_m[2] - ground_m)
    given_m = station.instrument_height_m
    if given_m is not None:
        if abs(given_m - height_m) > _SAME_HEIGHT_M:
            remarks.append(
                f"station {station.id}: instrument height {given_m:.3f} m is given, but the sensor is "
                f"{height_m:.3f} m above the ground of {floor.name!r}"
            )
        height_m = float(given_m)
    _, reasons = tripods.reject(index, position_m[None], np.array([ground_m]), np.array([not on_stairs]))
    remarks += [f"station {station.id}: no valid tripod position on {floor.name!r} ({reason})" for reason in reasons]
    return PriorPosition(station, position_m, index, height_m, tuple(remarks))


def _floor_of(survey: Survey, station: PriorStation, position_m: FloatArray) -> tuple[int, list[str]]:
    """Index of the floor a station stands on: the one it names, else the highest one below it; and remarks."""
    remarks = []
    if station.floor:
        named = index_of_floor(survey.floors, station.floor)
        if named is not None:
            return named, []
        there = floors_in_words(survey.floors)
        remarks.append(
            f"station {station.id}: there is no floor {station.floor!r} (there are {there}); taken by its height"
        )
    below = [i for i, floor in enumerate(survey.floors) if floor.elevation_m <= position_m[2]]
    index = below[-1] if below else 0
    low, high = survey.floors[index].bounds_m
    if not below or (position_m[:2] < low).any() or (position_m[:2] > high).any():
        remarks.append(f"station {station.id}: stands over no floor; counted for {survey.floors[index].name!r}")
    return index, remarks


def _landing_below(space: FreeSpace, position_m: FloatArray) -> float | None:
    """Height of the highest walkable ground straight below that is no floor's; None where there is none."""
    node = space.node_below(position_m)
    return None if node < 0 or space.on_ground[node] else float(space.ground_m[node])
