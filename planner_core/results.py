"""What a set of stations is worth: the figures of a `Plan`, whoever chose the stations.

Input a `Survey`, the stations and their `Visibility`; output a `Plan`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from planner_core.metrics.coverage import (
    coverage_by_floor,
    coverage_curve,
    coverage_of,
    covered_and_own_area_m2,
    floor_of_patch,
    take_rows,
    times_seen,
    unseen_elements,
)
from planner_core.model import BoolArray, Plan, PlanSettings, Station, Survey, Visibility
from planner_core.register.overlap import components, overlap_links, surface_of_patches
from planner_core.scan.engine import ScanEngine
from planner_core.survey import planned_floors, scope_of


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


def describe_plan(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    *,
    stations: tuple[Station, ...],
    visibility: Visibility,
    order_of_choice: tuple[int, ...],
    achievable: BoolArray,
    lower_bound: int,
    n_candidates: int,
    warnings: tuple[str, ...],
) -> Plan:
    """Compute the figures of `stations`.

    Parameters
    ----------
    visibility
        A row a station, in their order.
    order_of_choice
        Indices into stations, for the coverage curve.
    achievable
        (P,) bool, seen by a candidate or a station.

    Notes
    -----
    The overall figures are about the whole scene; where only some floors are planned, about the patches of those.
    """
    area_m2 = survey.patches.area_m2
    floor = floor_of_patch(survey.patches, survey.floor_of_triangle)
    planned = planned_floors(survey.floors, settings.requirements.floors)
    scope = scope_of(floor, planned, len(survey.floors))
    n_seen = times_seen(visibility)
    seen = n_seen > 0
    covered, own = covered_and_own_area_m2(visibility, area_m2)
    stations = tuple(
        replace(station, covered_area_m2=float(covered[i]), own_area_m2=float(own[i]))
        for i, station in enumerate(stations)
    )
    ids = tuple(station.id for station in stations)
    links = overlap_links(visibility, area_m2, ids, surface_of_patches(survey.scene, survey.patches, seen))
    groups = components(links, ids, threshold=settings.requirements.overlap)
    if len(groups) > 1:
        warnings = (*warnings, _not_connected(groups, settings.requirements.overlap))
    return Plan(
        survey=survey,
        settings=settings,
        stations=stations,
        times_seen=n_seen,
        achievable=achievable,
        coverage=coverage_of(area_m2, achievable, seen, scope),
        coverage_by_floor=coverage_by_floor(area_m2, achievable, seen, floor, len(survey.floors)),
        coverage_curve=coverage_curve(take_rows(visibility, order_of_choice), area_m2, achievable & scope),
        links=links,
        connected=len(groups) <= 1,
        unseen=unseen_elements(survey, achievable & scope, seen, area_m2),
        lower_bound=lower_bound,
        n_candidates=n_candidates,
        engine=f"{engine.name}: {engine.device}",
        warnings=warnings,
    )


def _not_connected(groups: list[tuple[str, ...]], threshold: float) -> str:
    largest = max(len(group) for group in groups)
    apart = [group for group in groups if len(group) < largest] or groups[1:]
    named = ", ".join("+".join(group[:4]) + ("..." if len(group) > 4 else "") for group in apart[:6])
    more = f" and {len(apart) - 6} more" if len(apart) > 6 else ""
    n_stations = sum(len(group) for group in groups)
    return (
        f"the stations do not register as one network: links of at least {100 * threshold:.0f} % overlap leave "
        f"{len(groups)} separate groups of {n_stations} stations (apart: {named}{more}); add stations between them or "
        "register with targets"
    )


def warn_about_coverage(plan: Plan) -> tuple[str, ...]:
    """One line for each planned floor, and one for all, that misses the required coverage."""
    wanted = plan.settings.requirements.coverage
    lines = []
    planned = planned_floors(plan.survey.floors, plan.settings.requirements.floors)
    parts = [(f"floor {plan.survey.floors[i].name!r}", plan.coverage_by_floor[i]) for i in planned]
    for name, coverage in [*parts, ("the whole", plan.coverage)]:
        if not coverage.meets(wanted):
            reached = coverage.fraction_of_achievable
            lines.append(
                f"{name} is covered to {100 * np.floor(reached * 1000) / 1000:.1f} % of its achievable area, "
                f"{100 * wanted:g} % are required"
            )
    return tuple(lines)
