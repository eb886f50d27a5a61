"""How stations meet the requirements: a `PartResult` per goal, and the figures of all that is planned.

A `Demand` and the stations' rows (`Demand.rows.take`, or `rows_from` for places off the grid) -> figures.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.coverage.coverage import times_seen
from planner_core.coverage.percent import reached_percent
from planner_core.model import Int32Array, Loss, OverlapOf, PartResult, Visibility
from planner_core.requirements.demand import Demand
from planner_core.requirements.observe_candidates import SeenPatches
from planner_core.requirements.wording import area_in_words, limits_in_words


def times_met(demand: Demand, rows: SeenPatches) -> Int32Array:
    """(Q, P) int32, stations that meet each quality on each patch; quality 0 is required of all."""
    return times_seen(rows.met).reshape(len(demand.goals.qualities), demand.n_patches)


def part_results(demand: Demand, rows: SeenPatches) -> tuple[PartResult, ...]:
    """One result a goal, in the order of `Goals.each`; what is not achievable does not count as covered."""
    area_m2 = demand.area_m2[: demand.n_patches]
    met = times_met(demand, rows)
    results = []
    for goal in demand.goals.each:
        achievable = demand.achievable(goal)
        covered = achievable & (met[demand.goals.quality_of(goal)] >= goal.seen_from)
        results.append(
            PartResult(
                name=goal.name,
                required=goal.coverage,
                achievable_area_m2=float(area_m2[achievable].sum()),
                covered_area_m2=float(area_m2[covered].sum()),
                total_area_m2=float(area_m2[goal.patches].sum()),
                seen_from=goal.seen_from,
                limits=goal.limits,
            )
        )
    return tuple(results)


def losses_of(demand: Demand, rows: SeenPatches) -> tuple[tuple[Loss, ...], ...]:
    """For each row, a loss per goal in the order of `Goals.each`: what only it, or it among too few, meets."""
    area_m2, met = demand.area_m2[: demand.n_patches], times_met(demand, rows)
    of_quality = [rows_of_quality(demand, rows, quality) for quality in range(len(demand.goals.qualities))]
    losses: list[list[Loss]] = [[] for _ in range(rows.seen.n_positions)]
    for goal, result in zip(demand.goals.each, part_results(demand, rows), strict=True):
        quality = demand.goals.quality_of(goal)
        needed = demand.achievable(goal) & (met[quality] == goal.seen_from)
        for row, of_station in enumerate(losses):
            patch = of_quality[quality].row(row)
            patch = patch[needed[patch]]
            lost_m2 = float(area_m2[patch].sum())
            without = replace(result, covered_area_m2=max(result.covered_area_m2 - lost_m2, 0.0))
            of_station.append(Loss(goal.name, patch, lost_m2, without.fraction_of_achievable, without.met))
    return tuple(tuple(of_station) for of_station in losses)


def missed_in_words(results: tuple[PartResult, ...]) -> tuple[str, ...]:
    """One line for each requirement that is not met."""
    lines = []
    for result in results:
        if not result.met:
            words = limits_in_words(result.limits, result.seen_from)
            lines.append(
                f"{result.name!r} is covered to {reached_percent(result.fraction_of_achievable, result.required)} % of "
                f"the {area_in_words(result.achievable_area_m2)} scannable{' with ' + words if words else ''}, "
                f"{100 * result.required:g} % required"
            )
    return tuple(lines)


def rows_of_quality(demand: Demand, rows: SeenPatches, quality: int = 0) -> Visibility:
    """Patches on which each position meets one quality: what it covers of all that is planned, by default."""
    if len(demand.goals.qualities) == 1:
        return rows.met
    low, high = quality * demand.n_patches, (quality + 1) * demand.n_patches
    kept = (rows.met.patch >= low) & (rows.met.patch < high)
    starts = np.concatenate([[0], np.cumsum(kept)])[rows.met.starts]
    return Visibility(starts.astype(np.int64), rows.met.patch[kept] - np.int32(low), demand.n_patches)


def rows_of_overlap(demand: Demand, rows: SeenPatches, of: OverlapOf) -> Visibility:
    """Patches of each position that overlap is counted on."""
    return rows.seen if of == OverlapOf.ALL_SEEN else rows_of_quality(demand, rows)


def coverage_curve(demand: Demand, rows: SeenPatches) -> tuple[float, ...]:
    """Covered fraction of what is achievable of all that is planned, after the first row, the first two, and so on."""
    goal = demand.goals.overall
    area_m2 = demand.area_m2[: demand.n_patches]
    counted = demand.achievable(goal)
    total = float(area_m2[counted].sum())
    visibility = rows_of_quality(demand, rows)
    times = np.zeros(demand.n_patches, dtype=np.int32)
    covered_by = np.zeros(demand.n_patches, dtype=np.int64)  # the number of the row that covers a patch
    for number in range(1, visibility.n_positions + 1):
        row = visibility.row(number - 1)
        times[row] += 1
        covered_by[row[times[row] == goal.seen_from]] = number
    covered_m2 = np.cumsum(np.bincount(covered_by, weights=area_m2 * counted, minlength=visibility.n_positions + 1)[1:])
    return tuple(float(m2) / total if total > 0 else 1.0 for m2 in covered_m2.tolist())
