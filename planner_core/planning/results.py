"""What a set of stations is worth: the figures of a `Plan`, whoever chose the stations.

Input a `Survey`, the stations, what they see and what was required; output a `Plan`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from planner_core.coverage.coverage import (
    coverage_by_floor,
    coverage_of,
    covered_and_own_area_m2,
    floor_of_patch,
    times_seen,
    unseen_elements,
)
from planner_core.coverage.patch_rooms import rooms_of_patches
from planner_core.coverage.plausibility import implausible
from planner_core.coverage.why import explain
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    Doors,
    FloatArray,
    Link,
    NetworkKind,
    Plan,
    PlanSettings,
    Registration,
    Requirements,
    Route,
    Scope,
    Station,
    Survey,
    Visibility,
)
from planner_core.network.links import least_listed_overlap, overlap_links, surface_of_patches, with_scanned
from planner_core.network.network_report import registration_report, registration_warnings, targets_warning
from planner_core.network.shut_doors import unknown_doors, with_doors
from planner_core.network.targets import joined_by_targets, with_target_places
from planner_core.positions.reach import Reach
from planner_core.progress import Progress, silent
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
from planner_core.route.route import field_time, route_warnings
from planner_core.route.unreachable import reach_warnings, unreachable_areas
from planner_core.scene.doors import exterior_doors

#: A byte each; nobody asks for so many stations.
_MOST_TIMES_MET = 255


@dataclass
class Stopwatch:
    """Wall-clock seconds by stage, for the record."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block."""
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Surroundings:
    """Where the stations were chosen from: what the figures of a plan are measured by.

    candidate_m : (N, 3) float64, local, places that stations may stand at; rows : what they see. reach : where the crew
    can walk.
    """

    candidate_m: FloatArray
    rows: SeenPatches
    reach: Reach


def describe_plan(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    *,
    stations: tuple[Station, ...],
    demand: Demand,
    rows: SeenPatches,
    surroundings: Surroundings,
    order_of_choice: tuple[int, ...],
    route: Route,
    n_scans: int,
    lower_bound: int,
    only_join: frozenset[str] = frozenset(),
    warnings: tuple[str, ...],
    progress: Progress = silent,
) -> Plan:
    """Compute the figures of `stations`.

    Parameters
    ----------
    demand, rows
        What is required, and what each station sees, in their order.
    order_of_choice
        Indices into stations, for the coverage curve.
    route
        Through the stations, in their order. n_scans : that are still to be made.
    only_join
        Ids of stations that coverage does not need, where that is known.

    Notes
    -----
    The overall figures are about all in scope; where only some floors are planned, about the patches of those.
    Covered is what meets the limits required of all, from as many stations as required.
    """
    area_m2 = survey.patches.area_m2
    requirements, scope = demand.goals.requirements, demand.goals.overall.patches
    of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
    floor = np.where(demand.goals.patches, of_patch, -1).astype(np.int32)
    n_met = times_met(demand, rows)[0]
    seen = n_met >= requirements.seen_from
    achievable = demand.times_met[0] >= requirements.seen_from
    of_stations = rows_of_quality(demand, rows)
    covered, own = covered_and_own_area_m2(
        of_stations, area_m2, scope=scope & achievable, seen_from=requirements.seen_from
    )
    stations = tuple(
        replace(station, covered_area_m2=float(covered[i]), own_area_m2=float(own[i]))
        for i, station in enumerate(stations)
    )
    ids = tuple(station.id for station in stations)
    counted = rows_of_overlap(demand, rows, requirements.overlap_of)
    links, registration = _registered(survey, requirements, stations, counted, settings.site.scanned, only_join, engine)
    unreachable = unreachable_areas(surroundings.reach)
    plan = Plan(
        survey=survey,
        settings=settings,
        stations=stations,
        times_seen=n_met,
        achievable=achievable,
        required=scope,
        coverage=coverage_of(area_m2, achievable, seen, scope),
        coverage_by_floor=coverage_by_floor(area_m2, achievable, seen, floor, len(survey.floors)),
        coverage_curve=coverage_curve(demand, rows.take(list(order_of_choice))),
        links=links,
        connected=registration.connected,
        unseen=unseen_elements(survey, achievable & scope, seen, area_m2),
        lower_bound=lower_bound,
        n_candidates=int(surroundings.candidate_m.shape[0]),
        engine=f"{engine.name}: {engine.device}",
        requirements=part_results(demand, rows),
        losses=losses_of(demand, rows),
        qualities=demand.goals.qualities,
        times_met=np.minimum(demand.times_met, _MOST_TIMES_MET).astype(np.uint8),
        registration=registration,
        route=route,
        field_time=field_time(settings.crew, n_scans=n_scans, walk_m=route.length_m),
        unreachable=unreachable,
        why=explain(
            survey,
            requirements,
            engine,
            candidates_m=surroundings.candidate_m,
            seen_by_candidates=rows_of_quality(demand, surroundings.rows),
            station_ids=ids,
            seen_by_stations=of_stations,
            scope=scope,
            achievable=achievable | seen,  # from off the grid, stations see what no candidate could
            scannable=achievable,
            links=links,
            unreachable=unreachable,
            progress=progress,
        ),
        rooms=rooms_of_patches(survey, surroundings.reach.space, scope),
        candidates_m=surroundings.candidate_m,
        warnings=(
            *warnings,
            *reach_warnings(survey, surroundings.reach, stations),
            *_registration_warnings(survey, requirements, registration),
            *targets_warning(links),
            *route_warnings(route, ids),
        ),
    )
    return replace(plan, warnings=(*plan.warnings, *implausible(plan, surroundings.reach)))


def _registered(
    survey: Survey,
    requirements: Requirements,
    stations: tuple[Station, ...],
    counted: Visibility,
    scanned: frozenset[str],
    only_join: frozenset[str],
    engine: ScanEngine,
) -> tuple[tuple[Link, ...], Registration]:
    """Links of stations, rows of `counted`, and how these are connected."""
    ids = tuple(station.id for station in stations)
    surface = surface_of_patches(survey.scene, survey.patches, times_seen(counted) > 0)
    position_m = np.array([station.position_m for station in stations]).reshape(-1, 3)
    found = overlap_links(
        counted,
        survey.patches.area_m2,
        ids,
        surface,
        position_m,
        min_overlap=least_listed_overlap(requirements.overlap),
        measure=requirements.overlap_measure,
        pre_alignment=requirements.start_of(survey.scanner),
    )
    links = with_scanned(found, scanned, requirements.link_limits)
    if requirements.asks_links:
        links = with_doors(links, survey, requirements, counted, ids, position_m)
        if requirements.joins_by_targets(survey.scene.source.doors):
            links = joined_by_targets(links, survey, requirements, counted, surface, ids, position_m, engine)
    registration = registration_report(
        links,
        ids,
        tuple(station.floor for station in stations),
        limits=requirements.link_limits,
        loops=requirements.network == NetworkKind.REDUNDANT,
        only_join=only_join,
    )
    return links, with_target_places(registration, survey, counted, surface, ids, position_m, engine)


def _registration_warnings(survey: Survey, requirements: Requirements, registration: Registration) -> tuple[str, ...]:
    if not requirements.asks_links:
        return ()
    names = {floor.id: floor.name for floor in survey.floors}
    start = requirements.start_of(survey.scanner)
    is_inside = survey.scope is not None and survey.scope.kind == Scope.INTERIOR
    is_apart = not registration.connected and is_inside and survey.scene.source.doors != Doors.OUTSIDE
    lines = registration_warnings(
        registration,
        names,
        offset_m=survey.scene.offset_m,
        pre_alignment=start,
        has_way_out=is_apart and bool(exterior_doors(survey.scene)),
    )
    return (*lines, *unknown_doors(survey.scene)) if requirements.doors_change else lines
