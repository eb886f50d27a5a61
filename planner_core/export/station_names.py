"""Names of stations in the stage and on disk: their ids where these are fit for both."""

from __future__ import annotations

from collections.abc import Sequence

from planner_core.export.usd_names import prim_name
from planner_core.model import Station


def station_prim_names(stations: Sequence[Station]) -> tuple[str, ...]:
    """Prim and file names, unique also where letters' case does not count; `S001` stays `S001`."""
    names: list[str] = []
    used: set[str] = set()
    for index, station in enumerate(stations):
        name = prim_name(station.id) or "Station"
        if name != station.id or name.lower() in used:
            name = f"{name}_{index}"
        while name.lower() in used:
            name = f"{name}_"
        used.add(name.lower())
        names.append(name)
    return tuple(names)
