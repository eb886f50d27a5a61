"""Demand: all that is asked, as one problem of covering patches. What positions see, by every quality that is asked.

A `Survey`, settings, an open engine, positions -> `Demand`: a copy of the patches for each distinct `PointLimits`, a
quality, stacked. Patch p of quality q is number q P + p; a position's row has it where the position meets q on p by
itself.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from planner_core.coverage.coverage import stacked_rows, take_rows, times_seen
from planner_core.coverage.levels import Observations, observations_meeting
from planner_core.coverage.survey import visible_from
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    PlanSettings,
    PointLimits,
    Survey,
    Visibility,
)
from planner_core.progress import Progress, silent
from planner_core.requirements.goals import OVERALL, Goal, goals_of
from planner_core.requirements.observations import observations_in_batches
from planner_core.requirements.wording import area_in_words, figure_in_words, limits_in_words, name_of
from planner_core.select.problem import Constraint

#: Numbers of stacked patches are int32.
_MOST_STACKED = 2**31 - 1
#: A target has a byte for each.
_MOST_TARGET_BYTES = 2**32


@dataclass(frozen=True)
class Rows:
    """What positions see. seen : patches seen at all, for overlap. met : patches by quality, stacked, for coverage."""

    seen: Visibility
    met: Visibility

    def take(self, rows: list[int] | Int64Array) -> Rows:
        """Rows of some positions, in the order given."""
        seen = take_rows(self.seen, rows)
        return Rows(seen, seen if self.met is self.seen else take_rows(self.met, rows))


@dataclass(frozen=True)
class Demand:
    """All that is asked, and how far positions can meet it.

    qualities : what is asked of all comes first. targets : one a goal, over the stacked patches. area_m2 : (Q P,).
    times_met : (Q, P) int32, positions that meet each quality. needed : for each quality, by the name of each limit,
    (P,) float32: the least figure at positions that meet all its other limits; inf where they have none that is known,
    NaN where there are no such positions.
    """

    n_patches: int
    goals: tuple[Goal, ...]
    qualities: tuple[PointLimits, ...]
    rows: Rows
    constraints: tuple[Constraint, ...]
    area_m2: FloatArray
    times_met: Int32Array
    needed: tuple[dict[str, Float32Array], ...]

    def achievable(self, goal: Goal) -> BoolArray:
        """(P,) bool, patches of the goal that as many positions as it asks for can meet."""
        enough: BoolArray = self.times_met[self.qualities.index(goal.asked)] >= goal.seen_from
        return goal.patches & enough

    @property
    def overall(self) -> Goal:
        """The goal of all that is planned."""
        return next(goal for goal in self.goals if goal.name == OVERALL and not goal.stated)


@dataclass(frozen=True)
class Known:
    """Positions that were looked around from before. row : (K,) int64 distinct, among all. demand : of these alone."""

    row: Int64Array
    demand: Demand


def demand_of(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    positions_m: FloatArray,
    *,
    known: Known | None = None,
    progress: Progress = silent,
) -> Demand:
    """Look from each of positions (N, 3), local frame, and say which patches meet what is asked.

    Without any limit, rows are those of `visible_from`, areas the patches' own, and constraints one per floor and one
    over all. `known` positions, of the same survey and settings, are not looked around from again.

    Raises
    ------
    RequirementError
        What is asked can't be had from any position, see `check_possible`; else as `goals_of`, `observations_from`.
    DeviceError
        The device fails.
    """
    goals = goals_of(survey, settings)
    qualities = qualities_of(goals)
    n_patches = survey.patches.n_patches
    _check_size(len(goals), len(qualities), n_patches)
    needed = tuple(
        {name: np.full(n_patches, np.nan, dtype=np.float32) for name in limits_of(asked)} for asked in qualities
    )
    looks = _Looks.over(goals, qualities, needed)
    if known is None:
        rows = _look(survey, settings, engine, positions_m, looks, progress)
    else:
        new = np.setdiff1d(np.arange(positions_m.shape[0]), known.row)
        found = _look(survey, settings, engine, positions_m[new], looks, progress)
        rows = _merged(known.demand.rows, found, np.argsort(np.concatenate([known.row, new])))
        for least, before in zip(needed, known.demand.needed, strict=True):
            for limit, figures in least.items():
                np.fmin(figures, before[limit], out=figures)
    times_met = times_seen(rows.met).reshape(len(qualities), n_patches)
    demand = Demand(
        n_patches=n_patches,
        goals=goals,
        qualities=qualities,
        rows=rows,
        constraints=tuple(_constraint(goal, qualities) for goal in goals),
        area_m2=np.tile(survey.patches.area_m2, len(qualities)),
        times_met=times_met,
        needed=needed,
    )
    check_possible(demand)
    return demand


def rows_from(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    positions_m: FloatArray,
    demand: Demand,
    *,
    progress: Progress = silent,
) -> Rows:
    """What further positions (N, 3) see, by the qualities of `demand`: for places that are not among its own."""
    return _look(survey, settings, engine, positions_m, _Looks.over(demand.goals, demand.qualities), progress)


def _check_size(n_goals: int, n_qualities: int, n_patches: int) -> None:
    """Refuse more stacked patches than have a number, or targets over them that memory would not hold."""
    n_stacked = n_qualities * n_patches
    if n_stacked > _MOST_STACKED or n_goals * n_stacked > _MOST_TARGET_BYTES:
        raise RequirementError(
            f"requirements: got {n_goals} with {n_qualities} different sets of limits on {n_patches} patches, expected "
            "fewer, which memory holds; use the same limits for several requirements, or take larger patches"
        )


def qualities_of(goals: tuple[Goal, ...]) -> tuple[PointLimits, ...]:
    """Distinct limits of the goals: those asked of all first, the others as they come."""
    overall = next(goal for goal in goals if goal.name == OVERALL and not goal.stated)
    return tuple(dict.fromkeys((overall.asked, *(goal.asked for goal in goals))))


def check_possible(demand: Demand) -> None:
    """Refuse what is asked of all, or of a part, where too few positions can meet it on any surface.

    A floor that was not named is none of these: it may be nothing but a roof, of which a corner is seen from afar.

    Raises
    ------
    RequirementError
        Naming the requirement and the limit to ease.
    """
    seen = times_seen(demand.rows.seen) > 0
    overall = demand.overall
    # Where nothing is seen at all, something other than requirements is wrong.
    if (overall.patches & seen).any() and not demand.achievable(overall).any():
        raise RequirementError(_impossible(demand, overall, seen))
    for goal in demand.goals:
        if goal.stated and not demand.achievable(goal).any():
            raise RequirementError(_impossible(demand, goal, seen))


def _impossible(demand: Demand, goal: Goal, seen: BoolArray) -> str:
    seen = seen & goal.patches
    n_positions = demand.rows.seen.n_positions
    area_m2 = demand.area_m2[: demand.n_patches]
    limits = limits_in_words(goal.asked, goal.seen_from)
    of = area_in_words(float(area_m2[goal.patches].sum()))
    what = f"requirement {goal.name!r}: got nothing of its {of}{' with ' + limits if limits else ''}"
    if not seen.any():
        return f"{what}, as none of it is seen from any of {n_positions} positions; check where stations may stand"
    met = demand.times_met[demand.qualities.index(goal.asked)]
    if (goal.patches & (met > 0)).any():
        most = int(met[goal.patches].max())
        return f"{what} from more than {most} of {n_positions} positions, expected some; require {most} stations"
    blame = blamed(demand, goal, seen)
    remedy = "ease several limits at once" if blame is None else f"ease its {_ease(demand, goal, seen, blame)}"
    return f"{what} from any of {n_positions} positions, expected some; {remedy}"


def _ease(demand: Demand, goal: Goal, seen: BoolArray, limit: str) -> str:
    figures = demand.needed[demand.qualities.index(goal.asked)][limit][seen]
    known = figures[np.isfinite(figures)]
    name = name_of(limit)
    return name if known.size == 0 else f"{name}, the best is {figure_in_words(limit, float(known.min()))}"


def blamed(demand: Demand, goal: Goal, patches: BoolArray) -> str | None:
    """Name of the limit of `goal` without which the most area of `patches`, (P,) bool, would meet the rest; or None."""
    area_m2 = demand.area_m2[: demand.n_patches]
    needed = demand.needed[demand.qualities.index(goal.asked)]
    admits = {limit: float(area_m2[patches & ~np.isnan(least)].sum()) for limit, least in needed.items()}
    best = max(admits, key=lambda limit: admits[limit], default=None)
    return best if best is not None and admits[best] > 0 else None


def _constraint(goal: Goal, qualities: tuple[PointLimits, ...]) -> Constraint:
    if len(qualities) == 1:
        return Constraint(goal.patches, goal.coverage, goal.seen_from)
    part = np.zeros((len(qualities), goal.patches.size), dtype=np.bool_)
    part[qualities.index(goal.asked)] = goal.patches
    return Constraint(part.reshape(-1), goal.coverage, goal.seen_from)


@dataclass(frozen=True)
class _Looks:
    """What to keep of observations. counted : for each quality, (P,) bool, patches that a goal asks it of; None: all.

    needed : as in `Demand`, filled while looking; empty: not wanted.
    """

    qualities: tuple[PointLimits, ...]
    counted: tuple[BoolArray | None, ...]
    needed: tuple[dict[str, Float32Array], ...] = ()

    @classmethod
    def over(
        cls,
        goals: tuple[Goal, ...],
        qualities: tuple[PointLimits, ...],
        needed: tuple[dict[str, Float32Array], ...] = (),
    ) -> _Looks:
        """Keep all of what is asked of all, and of other qualities what their goals count."""
        counted: list[BoolArray | None] = [None]
        for asked in qualities[1:]:
            counted.append(np.any([goal.patches for goal in goals if goal.asked == asked], axis=0))
        return cls(qualities, tuple(counted), needed)

    @property
    def plain(self) -> bool:
        """Whether seeing a patch is all that is asked."""
        return self.qualities == (PointLimits(),)


def limits_of(asked: PointLimits) -> tuple[str, ...]:
    """Names of the limits that are asked."""
    return tuple(field.name for field in fields(asked) if getattr(asked, field.name) is not None)


def _look(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    positions_m: FloatArray,
    looks: _Looks,
    progress: Progress,
) -> Rows:
    n_patches, n_qualities = survey.patches.n_patches, len(looks.qualities)
    if looks.plain:
        seen = visible_from(survey, settings, engine, positions_m, progress=progress)
        return Rows(seen, seen)
    seen_sizes: list[Int64Array] = []
    met_sizes: list[Int64Array] = []
    seen_patch: list[Int32Array] = []
    met_patch: list[Int32Array] = []
    for observations in observations_in_batches(survey, settings, engine, positions_m, progress=progress):
        seen_sizes.append(np.diff(observations.starts))
        seen_patch.append(observations.patch)
        sizes, patch = _stacked(observations, looks)
        met_sizes.append(sizes)
        met_patch.append(patch)
        for asked, least in zip(looks.qualities, looks.needed, strict=False):
            _note_needed(observations, asked, least)
    return Rows(
        Visibility(_starts(seen_sizes), _joined(seen_patch), n_patches),
        Visibility(_starts(met_sizes), _joined(met_patch), n_patches * n_qualities),
    )


def _merged(first: Rows, second: Rows, order: Int64Array) -> Rows:
    """Rows of both, one behind the other, in `order`."""
    seen = take_rows(stacked_rows(first.seen, second.seen), order)
    same = first.met is first.seen and second.met is second.seen
    return Rows(seen, seen if same else take_rows(stacked_rows(first.met, second.met), order))


def _stacked(observations: Observations, looks: _Looks) -> tuple[Int64Array, Int32Array]:
    """Sizes (S,) of stacked rows, and their patches."""
    n_rows = observations.starts.size - 1
    row_of_sight = np.repeat(np.arange(n_rows), np.diff(observations.starts))
    rows, patches = [], []
    for quality, (asked, counted) in enumerate(zip(looks.qualities, looks.counted, strict=True)):
        kept = observations_meeting(observations, asked)
        if counted is not None:
            kept &= counted[observations.patch]
        rows.append(row_of_sight[kept])
        patches.append(observations.patch[kept] + np.int32(quality * observations.n_patches))
    row = np.concatenate(rows)
    # Stable: qualities stay in their order within a row, and so do the patches of each.
    order = np.argsort(row, kind="stable")
    return np.bincount(row, minlength=n_rows).astype(np.int64), np.concatenate(patches)[order].astype(np.int32)


def _note_needed(observations: Observations, asked: PointLimits, least: dict[str, Float32Array]) -> None:
    """Lower `least`, (P,) by limit, to the figures of observations that meet all other limits."""
    for limit, figures in least.items():
        rest = observations_meeting(observations, replace(asked, **{limit: None}))
        found = getattr(observations, limit)[rest]
        np.fmin.at(figures, observations.patch[rest], np.where(np.isnan(found), np.float32(np.inf), found))


def _joined(blocks: list[Int32Array]) -> Int32Array:
    """All blocks in their order. The list is emptied on the way, so that what is joined is not held twice."""
    out = np.empty(sum(block.size for block in blocks), dtype=np.int32)
    at = 0
    blocks.reverse()
    while blocks:
        block = blocks.pop()
        out[at : at + block.size] = block
        at += block.size
    return out


def _starts(sizes: list[Int64Array]) -> Int64Array:
    """Starts (N + 1,) of rows whose sizes come in pieces."""
    return np.cumsum(np.concatenate([np.zeros(1, dtype=np.int64), *sizes]), dtype=np.int64)
