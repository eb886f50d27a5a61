"""Figures of a draft: the same as a plan's, in the same form, so far as moving stations changes them.

Input a `Survey`, settings, requirements, and looks of the draft's stations; output a `Plan` without what takes long
or does not depend on where stations stand: no route, no reasons, no bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.coverage.coverage import (
    coverage_of,
    covered_and_own_area_m2,
    times_seen,
    unseen_elements,
)
from planner_core.coverage.patch_reasons import Surfaces, surfaces_of
from planner_core.coverage.pieces import connected_pieces
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Int32Array,
    Int64Array,
    Link,
    NetworkKind,
    Plan,
    PlanSettings,
    Registration,
    Station,
    Survey,
    UInt8Array,
    UnseenPiece,
)
from planner_core.network.links import surface_of_patches, with_scanned
from planner_core.network.network_report import registration_report
from planner_core.network.shut_doors import with_doors
from planner_core.network.targets import joined_by_targets
from planner_core.plan_folder.viewer_layers import MAX_TIMES_SEEN, NOT_ACHIEVABLE, Layer
from planner_core.planning.live.draft import Draft, DraftStation
from planner_core.planning.live.tally import CoverageAreas
from planner_core.requirements.compliance import (
    coverage_curve,
    losses_of,
    part_results,
    rows_of_overlap,
    rows_of_quality,
    times_met,
)
from planner_core.requirements.demand import Demand
from planner_core.requirements.observe_candidates import SeenPatches

# -------------------------------------------------------------------------------------------------------------- layers
# Layers: one figure a patch, in whole steps: what the browser paints. The form of a plan folder's own layers.
# Input figures in metres or degrees, inf where there is none; output uint16 steps, 65535 for none, and for
# `times_seen` uint8 as in viewer/patches.u8. The layers and their steps are those of
# `planner_core.plan_folder.viewer_layers`.

TIMES_SEEN = "times_seen"


def times_seen_bytes(n_met: Int32Array, achievable: BoolArray) -> UInt8Array:
    """(N,) uint8: how many stations see a patch, at most 254; 255 where no candidate can."""
    return np.where(achievable, np.minimum(n_met, MAX_TIMES_SEEN), NOT_ACHIEVABLE).astype(np.uint8)


def layer_named(name: str, layers: Mapping[str, Layer]) -> Layer | None:
    """Return the layer of that id; None for `times_seen`, which has no figures.

    Raises
    ------
    RequirementError
        The plan has no such layer; those that it has are named.
    """
    if name == TIMES_SEEN:
        return None
    if name not in layers:
        raise RequirementError(f"layer: got {name!r}, expected one of {', '.join((TIMES_SEEN, *layers))}")
    return layers[name]


# -------------------------------------------------------------------------------------------------------------- unseen
# What a draft leaves uncovered that candidates could see, largest first, with the pieces it lies in.
# Input a `Survey` and patches (local frame, metres); output `LeftSurface`s. Why the rest is not seen from anywhere
# does not depend on the stations: the plan's own reasons stay true for it.

#: Surfaces of less are not listed, as in plan.json.
MIN_LISTED_M2 = 0.01
#: Elements that are examined, the largest areas first; and pieces listed of a surface.
N_ELEMENTS, N_PIECES = 50, 5
#: No further element is examined once there are so many patches, of some 25 microseconds each.
_ENOUGH_PATCHES = 20_000


@dataclass(frozen=True)
class LeftSurface:
    """Surface of one element, in one room, that counts for one floor. Fields as in `UnseenSurface`."""

    element: int
    room: int
    floor: str
    area_m2: float
    n_pieces: int
    pieces: tuple[UnseenPiece, ...]


def left_surfaces(survey: Survey, left: BoolArray) -> tuple[LeftSurface, ...]:
    """List surfaces of patches that are `left`, (P,) bool: of the `N_ELEMENTS` elements of which most is left."""
    part = surfaces_of(survey, _of_largest(survey, np.flatnonzero(left).astype(np.int32)))
    key = np.column_stack([part.element, part.room, part.floor])
    groups, which = np.unique(key, axis=0, return_inverse=True)
    group = which.ravel().astype(np.int64)
    area_m2 = np.bincount(group, weights=part.area_m2, minlength=len(groups))
    piece = connected_pieces(survey.scene, survey.patches, part.patch, group)
    order = np.argsort(group, kind="stable")
    ends = np.cumsum(np.bincount(group, minlength=len(groups)))
    return tuple(
        _surface(survey, part, groups[number], piece, order[ends[number - 1] if number else 0 : ends[number]])
        for number in np.argsort(-area_m2, kind="stable").tolist()
        if area_m2[number] >= MIN_LISTED_M2
    )


def _of_largest(survey: Survey, patch: Int32Array) -> Int32Array:
    """Patches (K,) of the elements and floors of which most area is among patches (N,); `_ENOUGH_PATCHES` or few more.

    With few stations nearly all of a building is left, and nobody reads a list of all of it.
    """
    triangle = np.searchsorted(survey.patches.first_patch, patch, side="right") - 1
    n_floors = len(survey.floors) + 1  # floor -1 is number 0
    key = (
        survey.scene.element_of_triangle[triangle].astype(np.int64) * n_floors + survey.floor_of_triangle[triangle] + 1
    )
    n_keys = len(survey.scene.elements) * n_floors
    area_m2 = np.bincount(key, weights=survey.patches.area_m2[patch], minlength=n_keys)
    largest = np.argsort(-area_m2, kind="stable")[:N_ELEMENTS]
    before = np.cumsum(np.bincount(key, minlength=n_keys)[largest])
    n_examined = 1 + int(np.searchsorted(before, _ENOUGH_PATCHES))
    kept = np.zeros(n_keys, dtype=np.bool_)
    kept[largest[:n_examined]] = True
    of_largest: Int32Array = patch[kept[key]]
    return of_largest


def _surface(survey: Survey, part: Surfaces, group: Int64Array, piece: Int64Array, rows: Int64Array) -> LeftSurface:
    names, of_row = np.unique(piece[rows], return_inverse=True)
    size_m2 = np.bincount(of_row.ravel(), weights=part.area_m2[rows], minlength=names.size)
    largest = np.argsort(-size_m2, kind="stable")[:N_PIECES]
    element, room, floor = group.tolist()
    return LeftSurface(
        element=element,
        room=room,
        floor=survey.floors[floor].id if floor >= 0 else "",
        area_m2=float(part.area_m2[rows].sum()),
        n_pieces=int(names.size),
        pieces=tuple(_piece(part.take(rows[of_row.ravel() == number])) for number in largest.tolist()),
    )


def _piece(part: Surfaces) -> UnseenPiece:
    corners_m = part.corners_m.reshape(-1, 3)
    centroid_m = (part.area_m2[:, None] * part.centroid_m).sum(axis=0) / part.area_m2.sum()
    nearest = int(((part.centroid_m - centroid_m) ** 2).sum(axis=1).argmin())
    return UnseenPiece(
        area_m2=float(part.area_m2.sum()),
        n_patches=int(part.patch.size),
        centroid_m=centroid_m,
        box_m=np.stack([corners_m.min(axis=0), corners_m.max(axis=0)]),
        patch=int(part.patch[nearest]),
    )


# ------------------------------------------------------------------------------------------------------------- figures
def plan_of(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    demand: Demand,
    parts: CoverageAreas,
    draft: Draft,
    rows: SeenPatches,
    links: tuple[Link, ...],
) -> Plan:
    """Compute what `planning.results.describe_plan` does of stations that see `rows`, without reasons and route.

    Stations are visited, and counted for the curve, in the draft's order.
    """
    area_m2, requirements, stations = survey.patches.area_m2, settings.requirements, draft.stations
    n_met = times_met(demand, rows)[0]
    seen = n_met >= requirements.seen_from
    achievable = demand.times_met[0] >= requirements.seen_from
    covered, own = covered_and_own_area_m2(
        rows_of_quality(demand, rows), area_m2, scope=parts.overall.counted, seen_from=requirements.seen_from
    )
    links = links_as_scanned(settings, draft, links)
    if requirements.doors_change:
        counted = rows_of_overlap(demand, rows, requirements.overlap_of)
        at_m = np.array([each.at_m for each in stations]).reshape(-1, 3)
        links = with_doors(links, survey, requirements, counted, [each.id for each in stations], at_m)
    links = links_by_targets(survey, settings, engine, demand, rows, stations, links)
    registration = registration_of(settings, links, stations)
    return Plan(
        survey=survey,
        settings=settings,
        stations=tuple(
            Station(
                id=each.id,
                floor=each.floor,
                order=order,
                position_m=each.at_m,
                instrument_height_m=math.nan if each.instrument_height_m is None else each.instrument_height_m,
                fixed=each.fixed,
                covered_area_m2=float(covered[order - 1]),
                own_area_m2=float(own[order - 1]),
            )
            for order, each in enumerate(stations, start=1)
        ),
        times_seen=n_met,
        achievable=achievable,
        required=parts.overall.patches,
        coverage=coverage_of(area_m2, achievable, seen, parts.overall.patches),
        coverage_by_floor=tuple(coverage_of(area_m2, achievable, seen, part.patches) for part in parts.floors),
        coverage_curve=coverage_curve(demand, rows),
        links=links,
        connected=registration.connected,
        unseen=unseen_elements(survey, achievable & parts.overall.patches, seen, area_m2),
        lower_bound=0,
        n_candidates=0,
        engine=f"{engine.name}: {engine.device}",
        requirements=part_results(demand, rows),
        losses=losses_of(demand, rows),
        registration=registration,
    )


def links_by_targets(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    demand: Demand,
    rows: SeenPatches,
    stations: Sequence[DraftStation],
    links: tuple[Link, ...],
) -> tuple[Link, ...]:
    """Have targets join stations that see `rows`, where the plan's own requirements allow it."""
    requirements = settings.requirements
    if not (requirements.asks_links and requirements.joins_by_targets(survey.scene.source.doors)):
        return links
    counted = rows_of_overlap(demand, rows, requirements.overlap_of)
    surface = surface_of_patches(survey.scene, survey.patches, times_seen(counted) > 0)
    at_m = np.array([each.at_m for each in stations]).reshape(-1, 3)
    ids = tuple(each.id for each in stations)
    return joined_by_targets(links, survey, requirements, counted, surface, ids, at_m, engine)


def links_as_scanned(settings: PlanSettings, draft: Draft, links: Sequence[Link]) -> tuple[Link, ...]:
    """Mark links of scanned stations that count as these are set up."""
    required, scanned = settings.requirements, settings.site.scanned | draft.scanned
    return with_scanned(links, scanned, required.link_limits)


def registration_of(settings: PlanSettings, links: Sequence[Link], stations: Sequence[DraftStation]) -> Registration:
    """Say how stations are connected, by the plan's own requirements."""
    requirements = settings.requirements
    return registration_report(
        links,
        [station.id for station in stations],
        [station.floor for station in stations],
        limits=requirements.link_limits,
        loops=requirements.network == NetworkKind.REDUNDANT,
    )
