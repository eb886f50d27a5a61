"""Figures of a draft: the same as a plan's, in the same form, so far as moving stations changes them.

Input a `Survey`, settings, requirements, and looks of the draft's stations; output a `Plan` without what takes long
or does not depend on where stations stand: no route, no reasons, no bound.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner_core.coverage.coverage import (
    coverage_of,
    covered_and_own_area_m2,
    unseen_elements,
)
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Link, NetworkKind, Plan, PlanSettings, Registration, Station, Survey
from planner_core.network.links import with_scanned
from planner_core.network.network_report import registration_report
from planner_core.planning.live.draft import Draft, DraftStation
from planner_core.planning.live.tally import CoverageAreas
from planner_core.requirements.compliance import coverage_curve, losses_of, part_results, rows_of_quality, times_met
from planner_core.requirements.demand import Demand
from planner_core.requirements.observe_candidates import SeenPatches


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


def links_as_scanned(settings: PlanSettings, draft: Draft, links: Sequence[Link]) -> tuple[Link, ...]:
    """Mark links of scanned stations that count as these are set up."""
    required, scanned = settings.requirements, settings.site.scanned | draft.scanned
    return with_scanned(links, scanned, required.link_limits)


def registration_of(settings: PlanSettings, links: Sequence[Link], stations: Sequence[DraftStation]) -> Registration:
    """Say how stations hang together, by the plan's own requirements."""
    requirements = settings.requirements
    return registration_report(
        links,
        [station.id for station in stations],
        [station.floor for station in stations],
        limits=requirements.link_limits,
        loops=requirements.network == NetworkKind.REDUNDANT,
    )
