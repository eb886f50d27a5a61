"""What all pictures and files of a station share: its name in the stage and on disk, and the spot below it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import FloatArray, Station
from planner_core.plan_folder.usd_names import prim_name


def station_prim_names(stations: Sequence[Station]) -> tuple[str, ...]:
    """Prim and file names, unique also where letters' case does not count; `S001` stays `S001`."""
    return prim_names_of_ids([station.id for station in stations])


def prim_names_of_ids(ids: Sequence[str]) -> tuple[str, ...]:
    """`station_prim_names` of stations with these ids."""
    names: list[str] = []
    used: set[str] = set()
    for index, station_id in enumerate(ids):
        name = prim_name(station_id) or "Station"
        if name != station_id or name.lower() in used:
            name = f"{name}_{index}"
        while name.lower() in used:
            name = f"{name}_"
        used.add(name.lower())
        names.append(name)
    return tuple(names)


def foot_m(station: Station) -> FloatArray:
    """(3,) float64, local: the ground below the sensor; the sensor itself where its height is unknown (NaN)."""
    position_m = station.position_m.astype(np.float64).copy()
    position_m[2] -= np.nan_to_num(station.instrument_height_m)
    return position_m
