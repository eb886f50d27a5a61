"""Rooms that nobody can walk into, as areas that a map can show, and in words. Reach -> UnreachableArea, local frame.

Lengths are metres. Parts of a building that can be entered, but not from one another, are in words only.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import FloatArray, Int32Array, Station, Survey, UnreachableArea
from planner_core.positions.free_space import FreeSpace
from planner_core.positions.reach import Reach, Region, leaf_that_shuts

_MAX_LINES = 5
_MAX_NAMED = 3
#: A station's ground is the walkable ground within this: what lies lower is another level's.
_SAME_GROUND_M = 0.3


def unreachable_areas(reach: Reach) -> tuple[UnreachableArea, ...]:
    """Ground of the unreachable regions of `reach`, floor by floor, in strips of cells along x."""
    space = reach.space
    out = []
    unreachable = {id(region) for region in reach.unreachable}
    by_region = np.argsort(reach.near_region, kind="stable") if unreachable else np.empty(0, np.int64)
    ends = np.searchsorted(reach.near_region[by_region], np.arange(len(reach.regions) + 1))
    for index, region in enumerate(reach.regions):
        if id(region) not in unreachable:
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
            out.append(UnreachableArea(floor=floor, area_m2=area_m2, inside_m=region.inside_m, strips_m=strips))
    return tuple(out)


def reach_warnings(survey: Survey, reach: Reach, stations: Sequence[Station]) -> tuple[str, ...]:
    """Lines on the largest rooms that nobody can walk into, and on parts of the building that no route joins.

    stations : of the plan, which may have been given where nobody walks.
    """
    at = _regions_of(reach, stations)
    names: dict[int, list[str]] = {}
    for station, region in zip(stations, at.tolist(), strict=True):
        names.setdefault(region, []).append(station.id)
    number = {id(region): index for index, region in enumerate(reach.regions)}
    lines = []
    for region in reach.unreachable[:_MAX_LINES]:
        there = names.get(number[id(region)])
        then = "so no station is planned there"
        if there:
            then = f"though {_named(there)} {'stands' if len(there) == 1 else 'stand'} there"
        remedy = _remedy(survey, reach, region, has_stations=bool(there))
        lines.append(f"{_where(survey, region)} can't be reached on foot, {then}; {remedy}")
    left = reach.unreachable[_MAX_LINES:]
    if left:
        area_m2 = sum(region.area_m2 for region in left)
        there = [name for region in left for name in names.get(number[id(region)], ())]
        then = f", with stations {_named(there)} in them" if there else ""
        lines.append(f"{len(left)} more areas of {area_m2:.1f} m2 in all can't be reached on foot{then}")
    return (*lines, *_apart(survey, [(reach.regions[k], names[k]) for k in sorted(names) if k >= 0]))


def _remedy(survey: Survey, reach: Reach, region: Region, *, has_stations: bool) -> str:
    leaf = leaf_that_shuts(survey.scene, reach, region)
    if leaf is None:
        entrance = "give an entrance into it if there is one"
        return f"open a door to it, or {entrance}" if has_stations else entrance
    x, y, _ = leaf.middle_m + survey.scene.offset_m
    name = survey.scene.elements[leaf.element].name
    leave_out = f"leave it out (--leave-out 'name={name}'), " if leaf.is_whole else ""
    return (
        f"a door leaf of {leaf.width_m:.2f} x {leaf.height_m:.2f} m at ({x:.2f}, {y:.2f}), in {name!r}, shuts it: "
        f"export the model with open doors, {leave_out}or give an entrance on both sides (--entrance)"
    )


def _apart(survey: Survey, parts: Sequence[tuple[Region, list[str]]]) -> tuple[str, ...]:
    """A line where stations stand in parts that can all be entered, and not from one another, such as two dwellings."""
    entered = [(region, names) for region, names in parts if region.reached]
    if len(entered) < 2:
        return ()
    words = [f"{_where(survey, region)} with {_named(names)}" for region, names in entered[:_MAX_LINES]]
    more = f"; and {len(entered) - _MAX_LINES} more" if len(entered) > _MAX_LINES else ""
    return (
        f"{len(entered)} parts of the building that no route joins, such as dwellings: {'; '.join(words)}{more}; enter "
        f"each by itself, or check doors and stairs of the model{_without_roof(survey, [r for r, _ in entered])}",
    )


def _without_roof(survey: Survey, entered: Sequence[Region]) -> str:
    """How to leave the topmost floor out where no part of it has ground on another floor: it may be a roof."""
    top = max(survey.planned, key=lambda index: survey.floors[index].elevation_m)
    others = [index for index in survey.planned if index != top]
    on_top = [np.flatnonzero(region.area_by_floor_m2).tolist() for region in entered if region.area_by_floor_m2[top]]
    if not others or not on_top or any(floors != [top] for floors in on_top):
        return ""
    rest = " ".join(f"--floor {survey.floors[index].id}" for index in others)
    return f"; if nobody can enter {survey.floors[top].name!r}, such as a roof, plan without it ({rest})"


def _where(survey: Survey, region: Region) -> str:
    x, y, z = region.inside_m + survey.scene.offset_m
    return f"floor {survey.floors[region.floor].name!r}: {region.area_m2:.1f} m2 about ({x:.2f}, {y:.2f}, {z:.2f})"


def _named(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MAX_NAMED} more" if len(names) > _MAX_NAMED else ""
    return f"{', '.join(names[:_MAX_NAMED])}{more}"


def _regions_of(reach: Reach, stations: Sequence[Station]) -> Int32Array:
    """(S,) region over whose ground each station stands; -1 where it stands over none."""
    out = np.full(len(stations), -1, dtype=np.int32)
    for row, station in enumerate(stations):
        node = _node_below(reach.space, station.position_m, station.instrument_height_m)
        out[row] = reach.near_region[node] if node >= 0 else -1
    return out


def _node_below(space: FreeSpace, sensor_m: FloatArray, height_m: float) -> int:
    """Node of the ground below a sensor; -1 where there is none, or the ground is not at its instrument height."""
    if not np.isfinite(height_m):
        return space.node_below(sensor_m)
    ground_m = sensor_m[2] - height_m
    node = space.node_below(np.array([sensor_m[0], sensor_m[1], ground_m + _SAME_GROUND_M]))
    return node if node >= 0 and abs(space.ground_m[node] - ground_m) <= _SAME_GROUND_M else -1
