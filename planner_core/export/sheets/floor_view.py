"""All that the drawing of one floor shows, gathered from the plan folder. PlanSource, Building -> FloorView.

Plan coordinates, scene frame, metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.export.floor_outlines import solid_rings
from planner_core.export.section import SectionLine, floor_section, lines_below
from planner_core.export.sheets.building import Building
from planner_core.export.sheets.unseen import FloorVisibility, unseen_surface
from planner_core.model import BoolArray, FloatArray, Floor, Scene
from planner_core.plan_folder.drawing.marks import DrawnZone
from planner_core.plan_folder.floor_marks import (
    FloorSegment,
    Mark,
    breaks_on,
    ends_on,
    floor_links,
    rooms_on,
    targets_on,
    unreachable_on,
    ways_on,
    zones_on,
)
from planner_core.plan_folder.plan_model.results import FloorSection
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.plan_folder.plan_words import planned_floors
from planner_core.plan_folder.section_view import CUT_HEIGHT_M
from planner_core.positions.outlines import over_polygon

#: Beyond the ground's bounds: outer walls, a way around the house.
_AROUND_M = 2.0
_MARGIN_M = 0.4
#: What is drawn as cut through, black: all else is lines.
_SOLID = ("wall", "column", "slab", "other")
#: Surface of a floor is searched up to here, where no floor above ends it before.
_STOREY_M = 4.0
_LEAST_STOREY_M = 1.5
#: What is cut at this height stands on the ground: walls below windows, cupboards, not carpets.
_STANDING_M = 0.15


@dataclass(frozen=True, eq=False)
class FloorView:
    """A floor to be drawn; everything in plan, scene frame, metres.

    window_m : (2, 2) what the drawing has to hold. solids : rings of each solid that is cut. cuts, fittings, below :
    (N, 2) lines: of cut solids, of doors, windows and furniture in the cut, of what is below it; closed ones repeat
    their first point. links : by class, (K, 2, 2) ends. elsewhere : numbers of stations of other floors that a station
    links to.
    """

    floor: FloorSection
    window_m: FloatArray
    stations: tuple[FieldStation, ...]
    ways: tuple[FloorSegment, ...]
    ends: tuple[Mark, ...]
    breaks: tuple[Mark, ...]
    targets: tuple[Mark, ...]
    unreachable: tuple[Mark, ...]
    links: tuple[FloatArray, ...]
    """Ends by class."""
    elsewhere: dict[str, tuple[int, ...]]
    scanned: frozenset[str]
    """Ids of stations that were scanned before."""
    solids: tuple[tuple[FloatArray, ...], ...] = ()
    cuts: tuple[FloatArray, ...] = ()
    fittings: tuple[FloatArray, ...] = ()
    below: tuple[FloatArray, ...] = ()
    surface: FloorVisibility | None = None
    standing: tuple[tuple[FloatArray, ...], ...] = ()
    """Rings of what stands on the ground: there is no floor to be seen."""
    cut_m: float = CUT_HEIGHT_M
    """Above the ground."""
    zones: tuple[DrawnZone, ...] = ()
    """Keep-outs and forbidden positions."""
    rooms: tuple[Mark, ...] = ()
    """Their names."""


def view_floor(
    plan: PlanSource, floor: FloorSection, building: Building | None, *, cut_m: float = CUT_HEIGHT_M
) -> FloorView:
    """Gather what the drawing of a floor shows; without a building no walls and no surface."""
    stations = plan.stations_of(floor.id)
    ways, ends, unreachable = (
        tuple(ways_on(plan, floor, None if building is None else building.ground_m)),
        tuple(ends_on(plan, floor)),
        tuple(unreachable_on(plan, floor)),
    )
    ends_of_links, elsewhere = floor_links(plan, floor)
    places = [station.position_m[None, :2] for station in stations] + [way.points_m for way in ways]
    places += [mark.at_m[None] for mark in (*ends, *unreachable)]
    view = FloorView(
        floor=floor,
        window_m=_around([np.array(floor.bounds), *places]),
        stations=stations,
        ways=ways,
        ends=ends,
        breaks=tuple(breaks_on(plan, floor)),
        targets=tuple(targets_on(plan, floor)),
        unreachable=unreachable,
        links=ends_of_links,
        elsewhere=elsewhere,
        scanned=plan.scanned_before & {station.id for station in stations},
        zones=tuple(zones_on(plan, floor)),
        rooms=tuple(rooms_on(plan, floor)),
    )
    if building is None:
        return view
    view = replace(view, cut_m=_cut_m(plan, floor, cut_m))
    return _with_building(plan, view, building, _trodden_m(view))


def _trodden_m(view: FloorView) -> FloatArray:
    """(N, 2) where somebody stands or walks below the cut: flights end over walls of the storey that they leave."""
    low = [part for way in view.ways for part in way.parted_at(view.floor.elevation_m + view.cut_m)[0]]
    stations = [station.position_m[None, :2] for station in view.stations]
    return np.concatenate(
        [np.zeros((0, 2)), *stations, *low, *(mark.at_m[None] for mark in (*view.ends, *view.unreachable))]
    )


def _around(places: Sequence[FloatArray]) -> FloatArray:
    """(2, 2) box of points (N, 2), with a margin."""
    points = np.concatenate(places)
    return np.stack([points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M])


def _with_building(plan: PlanSource, view: FloorView, building: Building, trodden_m: FloatArray) -> FloorView:
    """Add walls and surface; nobody stands inside a wall: what holds a place of the walk is no solid."""
    scene, floor = building.scene, view.floor
    number = next(index for index, each in enumerate(plan.floors) if each.id == floor.id)
    cut_m = view.cut_m
    local = building.local_floor(plan, floor)
    limits_m = np.array(floor.bounds) + np.array([[-_AROUND_M], [_AROUND_M]])
    limits_m = np.stack([np.minimum(limits_m[0], view.window_m[0]), np.maximum(limits_m[1], view.window_m[1])])
    section = [line for line in floor_section(scene, local, cut_m) if _touches(line, limits_m)]
    below = [line for line in lines_below(scene, local, cut_m) if _touches(line, limits_m)]
    solid = [line for line in section if line.kind in _SOLID]
    offset_m = scene.offset_m[:2]
    seen_m = [np.clip(line.points_m, *limits_m) for line in section if line.kind in _SOLID]
    height_m = local.elevation_m + np.array([0.0, _storey_m(plan, floor)])
    surface = unseen_surface(building, number, height_m=height_m, window_m=limits_m - offset_m)
    if floor.id not in planned_floors(plan.document):
        surface = FloorVisibility(*(np.zeros((0, *shape)) for shape in ((3, 2), (3, 2), (3, 2), (2, 2))))
    standing = [line for line in floor_section(scene, local, _STANDING_M) if _touches(line, limits_m)]
    return replace(
        view,
        window_m=_around([view.window_m + np.array([[_MARGIN_M], [-_MARGIN_M]]), *seen_m]),
        solids=tuple(_solids(scene, local, solid, cut_m, trodden_m)),
        cuts=tuple(_drawn(solid)),
        fittings=tuple(_drawn(line for line in section if line.kind not in _SOLID)),
        # Parapets, and walls below windows, end below the cut and have no top of their own where they are planes.
        below=tuple(_drawn([*below, *(line for line in standing if line.kind in _SOLID)])),
        surface=surface.moved(offset_m),
        standing=tuple(_solids(scene, local, standing, _STANDING_M, trodden_m)),
    )


def _cut_m(plan: PlanSource, floor: FloorSection, wanted_m: float) -> float:
    """Above the ground: the height wanted, or half-way to the floor above where that is lower."""
    above = [each.elevation_m for each in plan.floors if each.elevation_m > floor.elevation_m + 0.5]
    return min([wanted_m, *(0.5 * (z - floor.elevation_m) for z in above)])


def _storey_m(plan: PlanSource, floor: FloorSection) -> float:
    """Height up to which surface belongs to a floor."""
    above = [each.elevation_m - floor.elevation_m for each in plan.floors]
    return min([_STOREY_M, *(height for height in above if height >= _LEAST_STOREY_M)])


def _touches(line: SectionLine, limits_m: FloatArray) -> bool:
    low_m, high_m = line.points_m.min(axis=0), line.points_m.max(axis=0)
    return bool((high_m >= limits_m[0]).all() and (low_m <= limits_m[1]).all())


def _drawn(lines: Iterable[SectionLine]) -> list[FloatArray]:
    return [np.concatenate([line.points_m, line.points_m[:1]]) if line.closed else line.points_m for line in lines]


def _solids(
    scene: Scene, floor: Floor, lines: list[SectionLine], cut_m: float, trodden_m: FloatArray
) -> Iterable[tuple[FloatArray, ...]]:
    """Rings of each element that is cut, but for those that people stand in."""
    for rings in solid_rings(scene, floor, lines, cut_m=cut_m):
        if not _inside(rings, trodden_m).any():
            yield rings


def _inside(rings: Sequence[FloatArray], points_m: FloatArray) -> BoolArray:
    """(N,) bool: points (N, 2) inside an odd number of rings."""
    inside = np.zeros(len(points_m), dtype=np.bool_)
    for ring in rings:
        inside ^= over_polygon(points_m, ring)
    return inside
