"""Rooms that nobody can walk into, as areas that a map can show. Reach -> SealedArea, local frame, metres."""

from __future__ import annotations

import numpy as np

from planner_core.model import SealedArea
from planner_core.positions.reach import Reach


def sealed_areas(reach: Reach) -> tuple[SealedArea, ...]:
    """Ground of the sealed regions of `reach`, floor by floor, in strips of cells along x."""
    space = reach.space
    out = []
    sealed = {id(region) for region in reach.sealed}
    by_region = np.argsort(reach.near_region, kind="stable") if sealed else np.empty(0, np.int64)
    ends = np.searchsorted(reach.near_region[by_region], np.arange(len(reach.regions) + 1))
    for index, region in enumerate(reach.regions):
        if id(region) not in sealed:
            continue
        node = by_region[ends[index] : ends[index + 1]]
        for floor in np.unique(space.floor[node]).tolist():
            column = np.unique(space.column[node[space.floor[node] == floor]])
            # A strip ends where the next cell is not the one beside it; rows do not touch: their ends are free cells.
            breaks = np.flatnonzero((np.diff(column) != 1) | (column[1:] % space.grid.nx == 0)) + 1
            first, last = column[np.append(0, breaks)], column[np.append(breaks, column.size) - 1]
            half_m = 0.5 * space.grid.cell_m
            strips = np.stack([space.grid.centre_m(first) - half_m, space.grid.centre_m(last) + half_m], axis=1)
            area_m2 = column.size * space.cell_m2
            out.append(SealedArea(floor=floor, area_m2=area_m2, inside_m=region.inside_m, strips_m=strips))
    return tuple(out)
