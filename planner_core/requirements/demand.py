"""Demand: all requirements as one problem of covering patches. What positions see, by every quality required.

A `Survey`, its `Goals`, an open engine, positions -> `Demand`: a copy of the patches for each distinct `PointLimits`, a
quality, stacked. Patch p of quality q is number q P + p; a position's row has it where the position meets q on p by
itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.coverage.coverage import times_seen
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    Survey,
    UInt8Array,
)
from planner_core.progress import Progress, silent
from planner_core.requirements.goals import Goal, Goals
from planner_core.requirements.observe_candidates import CandidateObservations, SeenPatches, merged, observe_candidates
from planner_core.requirements.wording import area_in_words, figure_in_words, limits_in_words, name_of
from planner_core.select.problem import Constraint


@dataclass(frozen=True)
class Demand:
    """All requirements, and how far positions can meet it.

    constraints : one a goal, over the stacked patches. area_m2 : (Q P,). times_met : (Q, P) int32, positions that meet
    each quality. needed : for each quality, by the name of each limit, (P,) float32: the least figure at positions that
    meet all its other limits; inf where they have none that is known, NaN where there are no such positions.
    countable_share : (P,) uint8, see `Patches`.
    """

    n_patches: int
    goals: Goals
    rows: SeenPatches
    constraints: tuple[Constraint, ...]
    area_m2: FloatArray
    times_met: Int32Array
    needed: tuple[dict[str, Float32Array], ...]
    countable_share: UInt8Array | None = None

    def with_counted_patches(self, survey: Survey) -> Survey:
        """The survey, with patches that count as far as positions see them."""
        return replace(survey, patches=replace(survey.patches, countable_share=self.countable_share))

    def achievable(self, goal: Goal) -> BoolArray:
        """(P,) bool, patches of the goal that as many positions as it asks for can meet."""
        enough: BoolArray = self.times_met[self.goals.quality_of(goal)] >= goal.seen_from
        return goal.patches & enough


@dataclass(frozen=True)
class KnownObservations:
    """Observations made before. row : (K,) int64, distinct, their positions among all."""

    row: Int64Array
    observations: CandidateObservations


def demand_of(
    survey: Survey,
    goals: Goals,
    engine: ScanEngine,
    positions_m: FloatArray,
    *,
    known: KnownObservations | None = None,
    progress: Progress = silent,
) -> Demand:
    """Observe from each of positions (N, 3), local frame, and return which patches meet the requirements.

    Without any limit, constraints are one per floor and one over all. `known` positions, of the same survey and
    goals, are not observed from again.

    Raises
    ------
    RequirementError
        No position can meet a requirement, see `check_possible`; else as `observations_in_batches`.
    DeviceError
        The device fails.
    """
    if known is None:
        observed = observe_candidates(survey, engine, positions_m, goals, progress=progress)
    else:
        observed, new = known.observations, np.setdiff1d(np.arange(positions_m.shape[0]), known.row)
        if new.size or (np.diff(known.row) < 0).any():  # all of them, but in another order
            found = observe_candidates(survey, engine, positions_m[new], goals, progress=progress)
            observed = merged(observed, found, np.argsort(np.concatenate([known.row, new])))
    countable_share = survey.patches.countable_share
    if countable_share is None:
        countable_share = observed.countable_share(survey, engine, positions_m)
    rows = observed.rows_of(countable_share)
    n_patches, n_qualities = survey.patches.n_patches, len(goals.qualities)
    demand = Demand(
        n_patches=n_patches,
        goals=goals,
        rows=rows,
        constraints=tuple(_constraint(goals, goal) for goal in goals.each),
        area_m2=np.tile(replace(survey.patches, countable_share=countable_share).area_m2, n_qualities),
        times_met=times_seen(rows.met).reshape(n_qualities, n_patches),
        needed=observed.needed,
        countable_share=countable_share,
    )
    check_possible(demand)
    return demand


def rows_from(
    survey: Survey, engine: ScanEngine, positions_m: FloatArray, demand: Demand, *, progress: Progress = silent
) -> SeenPatches:
    """What further positions (N, 3) see, by the qualities of `demand`: for places that are not among its own."""
    observed = observe_candidates(survey, engine, positions_m, demand.goals, notes_needed=False, progress=progress)
    return observed.rows_of(demand.countable_share)


def check_possible(demand: Demand) -> None:
    """Refuse a requirement of all, or of a part, that too few positions can meet on any surface.

    A floor that was not named is none of these: it may be nothing but a roof, of which a corner is seen from afar.

    Raises
    ------
    RequirementError
        Naming the requirement and the limit to ease.
    """
    seen = times_seen(demand.rows.seen) > 0
    overall = demand.goals.overall
    # Where nothing is seen at all, something other than requirements is wrong.
    if (overall.patches & seen).any() and not demand.achievable(overall).any():
        raise RequirementError(_impossible(demand, overall, seen))
    for goal in demand.goals.each:
        if goal.stated and not demand.achievable(goal).any():
            raise RequirementError(_impossible(demand, goal, seen))


def _impossible(demand: Demand, goal: Goal, seen: BoolArray) -> str:
    seen = seen & goal.patches
    n_positions = demand.rows.seen.n_positions
    area_m2 = demand.area_m2[: demand.n_patches]
    limits = limits_in_words(goal.limits, goal.seen_from)
    of = area_in_words(float(area_m2[goal.patches].sum()))
    what = f"requirement {goal.name!r}: got nothing of its {of}{' with ' + limits if limits else ''}"
    if not seen.any():
        return f"{what}, as none of it is seen from any of {n_positions} positions; check where stations may stand"
    met = demand.times_met[demand.goals.quality_of(goal)]
    if (goal.patches & (met > 0)).any():
        most = int(met[goal.patches].max())
        return f"{what} from more than {most} of {n_positions} positions, expected some; require {most} stations"
    blame = blamed(demand, goal, seen)
    remedy = "ease several limits at once" if blame is None else f"ease its {_ease(demand, goal, seen, blame)}"
    return f"{what} from any of {n_positions} positions, expected some; {remedy}"


def _ease(demand: Demand, goal: Goal, seen: BoolArray, limit: str) -> str:
    figures = demand.needed[demand.goals.quality_of(goal)][limit][seen]
    known = figures[np.isfinite(figures)]
    name = name_of(limit)
    return name if known.size == 0 else f"{name}, the best is {figure_in_words(limit, float(known.min()))}"


def blamed(demand: Demand, goal: Goal, patches: BoolArray) -> str | None:
    """Name of the limit of `goal` without which the most area of `patches`, (P,) bool, would meet the rest; or None."""
    area_m2 = demand.area_m2[: demand.n_patches]
    needed = demand.needed[demand.goals.quality_of(goal)]
    admits = {limit: float(area_m2[patches & ~np.isnan(least)].sum()) for limit, least in needed.items()}
    best = max(admits, key=lambda limit: admits[limit], default=None)
    return best if best is not None and admits[best] > 0 else None


def _constraint(goals: Goals, goal: Goal) -> Constraint:
    if len(goals.qualities) == 1:
        return Constraint(goal.patches, goal.coverage, goal.seen_from)
    part = np.zeros((len(goals.qualities), goal.patches.size), dtype=np.bool_)
    part[goals.quality_of(goal)] = goal.patches
    return Constraint(part.reshape(-1), goal.coverage, goal.seen_from)
