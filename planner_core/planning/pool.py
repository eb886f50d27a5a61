"""The pool: all that stations are chosen from, with what each candidate sees and whom it can be registered with.

Input candidates (local frame, metres), a `Survey` and `Goals`, output a `Pool`; a pool grows by places off the grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner_core.coverage.coverage import stacked_rows, times_seen
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    Candidates,
    FloatArray,
    Int32Array,
    Int64Array,
    NetworkKind,
    Survey,
)
from planner_core.network.candidate_links import (
    CandidateLinks,
    candidate_links,
    held_in_both_states,
    network_of,
    parts_of,
    with_targets,
)
from planner_core.network.links import surface_of_patches
from planner_core.network.shut_doors import with_all_doors_shut
from planner_core.network.targets import target_pairs
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.compliance import rows_of_overlap
from planner_core.requirements.demand import Demand, KnownObservations, demand_of
from planner_core.requirements.goals import Goals
from planner_core.requirements.observe_candidates import SeenPatches, stacked
from planner_core.select.network import Network
from planner_core.select.problem import Constraint, CoverProblem, cover_problem

#: Share of what a part of the network sees that parts so many times as large have to see for it to be left aside.
_SEEN_ELSEWHERE = 0.9
_MUCH_LARGER = 10
_NO_ROWS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Pool:
    """survey : with patches that count as far as they are seen. candidates, rows : N candidates and what they see.
    demand : what is required; its own rows are of the first pool.

    constraints : those of the demand, of what the FIRST pool can achieve: places that come later change no requirement.
    links : between the candidates; None where no network is required. given, kept : rows of stations that are in every
    plan, and of those of an earlier plan. loops : the network has to survive the failure of a link. excluded : (N,)
    bool, candidates that are not to be chosen, see `_dispensable_components`. scanned : rows of `given` whose scans
    exist. by_targets : among the links are some that targets make.
    """

    survey: Survey
    candidates: Candidates
    demand: Demand
    rows: SeenPatches
    constraints: tuple[Constraint, ...]
    links: CandidateLinks | None
    given: tuple[int, ...]
    kept: tuple[int, ...]
    loops: bool
    excluded: BoolArray
    scanned: tuple[int, ...] = ()
    by_targets: bool = False

    @cached_property
    def problem(self) -> CoverProblem:
        """The problem of selection. Excluded candidates see nothing in it; what there is to be seen stays the same."""
        whole = cover_problem(self.rows.met, self.demand.area_m2, self.constraints)
        return _without_candidates(whole, self.excluded) if self.excluded.any() else whole

    def problem_of_patches(self) -> CoverProblem:
        """The same problem with one unit of area for every patch: the method paper counts polygons."""
        whole = cover_problem(self.rows.met, np.ones_like(self.demand.area_m2), self.constraints)
        return _without_candidates(whole, self.excluded) if self.excluded.any() else whole

    @cached_property
    def network(self) -> Network | None:
        """Whom the candidates can be registered with, where that matters."""
        return None if self.links is None else network_of(self.links, loops=self.loops)

    def with_links(self, links: CandidateLinks) -> Pool:
        """The same with other links. The problem is one of rows alone: it is not merged anew."""
        other = replace(self, links=links)
        vars(other)["problem"] = self.problem
        return other

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return int(self.candidates.floor.size)

    @property
    def n_free(self) -> int:
        """Number of candidates that are not excluded."""
        return self.n_candidates - int(self.excluded.sum())

    def take(self, rows: Int64Array) -> Candidates:
        """Some of the candidates, in the order given."""
        return self.candidates.take(rows)

    def placing(self, progress: Progress, *, bounds: bool = True) -> Progress:
        """Return progress that reports positions of the best stations so far; `bounds`: with their lower bound."""

        def placed(event: ProgressEvent) -> None:
            if event.best is not None and event.best.chosen:
                where = self.candidates.position_m[list(event.best.chosen)]
                best = replace(event.best, positions_m=tuple((x, y, z) for x, y, z in where.tolist()))
                event = replace(event, best=best if bounds else replace(best, lower_bound=None))
            progress(event)

        return placed


@dataclass(frozen=True)
class FragileLinks:
    """Links (K,) between rows `first` < `second` of a pool that fall below what is required.

    overlap, strength, probability : (K,) float64, the least of each as set up; NaN where no probability is required.
    """

    first: Int32Array
    second: Int32Array
    overlap: FloatArray
    strength: FloatArray
    probability: FloatArray

    @staticmethod
    def none() -> FragileLinks:
        """None at all."""
        return FragileLinks(np.empty(0, np.int32), np.empty(0, np.int32), *np.empty((3, 0)))

    def take(self, which: BoolArray) -> FragileLinks:
        """Those of `which`, (K,)."""
        return FragileLinks(*(each[which] for each in vars(self).values()))


@dataclass(frozen=True)
class Choice:
    """chosen : rows of `pool.candidates`, in the order of choice. lower_bound : stations that any plan on them needs.

    value, bound : of the objective where that is not the number of stations: seconds, or the fraction of achievable
    area that is covered and the most that so many stations can cover. n_greedy : stations that greedy selection takes.
    n_bounded : candidates that the bound holds for: those that were not excluded when it was proven.
    fragile : links without which there are more groups, and which do not hold as stations are set up.
    covered_as_set_up : (K,) of each constraint, see `set_up.coverage_as_set_up`; None: not computed.
    """

    pool: Pool
    chosen: tuple[int, ...]
    lower_bound: int
    why_stopped: str = ""
    value: float | None = None
    bound: float | None = None
    n_greedy: int | None = None
    n_bounded: int | None = None
    warnings: tuple[str, ...] = ()
    fragile: FragileLinks | None = None
    covered_as_set_up: FloatArray | None = None


def make_pool(
    survey: Survey,
    goals: Goals,
    engine: ScanEngine,
    candidates: Candidates,
    *,
    given: Int64Array,
    kept: Int64Array,
    scanned: Int64Array = _NO_ROWS,
    linked: bool,
    known: KnownObservations | None = None,
    progress: Progress = silent,
) -> Pool:
    """Look around from all candidates but the `known` ones, and find whom each can be registered with, if `linked`.

    Raises
    ------
    RequirementError, DeviceError
        See `planner_core.requirements.demand.demand_of`.
    """
    demand = demand_of(survey, goals, engine, candidates.position_m, known=known, progress=progress)
    survey = demand.with_counted_patches(survey)
    n_met = times_seen(demand.rows.met)
    constraints = tuple(replace(t, part=t.part & (n_met >= t.seen_from)) for t in demand.constraints)
    links = None
    if linked:
        links = _links(survey, demand, candidates.position_m, demand.rows, scanned.tolist(), progress)
    pool = Pool(
        survey=survey,
        candidates=candidates,
        demand=demand,
        rows=demand.rows,
        constraints=constraints,
        links=links,
        given=tuple(given.tolist()),
        kept=tuple(kept.tolist()),
        loops=goals.requirements.network == NetworkKind.REDUNDANT,
        excluded=np.zeros(candidates.floor.size, dtype=bool),
        scanned=tuple(scanned.tolist()),
    )
    return without_dispensable(pool)


def without_dispensable(pool: Pool) -> Pool:
    """Exclude the candidates of parts of the network that a plan can do without."""
    if pool.links is None:
        return pool
    whole = replace(pool, excluded=np.zeros(pool.n_candidates, dtype=bool))
    held = np.unique(pool.links.part[[*pool.given, *pool.kept]])
    return replace(pool, excluded=_dispensable_components(whole.problem, pool.links.part, held))


def _dispensable_components(problem: CoverProblem, part: Int32Array, held: Int32Array) -> BoolArray:
    """(N,) bool: candidates of parts of the network, (N,), that a plan can do without: the fewer parts, the better.

    The smallest parts go first, as long as much larger ones see nearly all that they see, and the others meet every
    target; those of `held` stay. So a lone high candidate goes. A room behind a shut door does not, nor does anybody
    where hardly any two can be registered.
    """
    owner_part = np.repeat(part, np.diff(problem.starts))
    size = np.bincount(part)
    n_seen = np.bincount(problem.row, minlength=problem.n_rows)
    gone = np.zeros(size.size, dtype=bool)
    seen_by_larger: dict[int, BoolArray] = {}
    for number in np.argsort(size, kind="stable").tolist():
        least = _MUCH_LARGER * int(size[number])
        if number in held or least > int(size.max()):
            continue
        if least not in seen_by_larger:
            seen_by_larger[least] = np.zeros(problem.n_rows, dtype=bool)
            seen_by_larger[least][problem.row[size[owner_part] >= least]] = True
        looks = np.bincount(problem.row[owner_part == number], minlength=problem.n_rows)
        elsewhere = int(problem.ticks[(looks > 0) & seen_by_larger[least]].sum())
        if elsewhere < _SEEN_ELSEWHERE * int(problem.ticks[looks > 0].sum()):
            continue
        less = n_seen - looks
        if (problem.ticks_of(less) >= problem.required).all():
            n_seen, gone[number] = less, True
    return gone[part]


def _without_candidates(problem: CoverProblem, which: BoolArray) -> CoverProblem:
    """Let some candidates, (N,) bool, see nothing: they keep their numbers and are in no set."""
    size = np.diff(problem.starts)
    return replace(
        problem,
        starts=np.concatenate([[0], np.cumsum(np.where(which, 0, size))]).astype(np.int64),
        row=problem.row[np.repeat(~which, size)],
    )


def extended(
    pool: Pool,
    more: Candidates,
    observed: SeenPatches,
    engine: ScanEngine,
    *,
    joins: bool = False,
    progress: Progress = silent,
) -> Pool:
    """Add candidates, and what they see, behind those of the pool; no requirement changes.

    joins : they may join parts of the network; else what hung together as far as it could still does so.
    """
    rows = stacked(pool.rows, observed)
    del observed  # links take memory enough
    position_m = np.concatenate([pool.candidates.position_m, more.position_m])
    links = None
    if pool.links is not None:
        found = _links(pool.survey, pool.demand, position_m, rows, pool.scanned, progress)
        if found is not None and pool.by_targets:
            found = _and_targets(found, pool, engine, position_m, rows)
        links = found if found is None or joins else _within_parts(found, pool.links.part, pool.excluded)
    return replace(
        pool,
        candidates=_both(pool.candidates, more),
        rows=rows,
        links=links,
        excluded=_excluded_later(pool, links, n=pool.n_candidates + int(more.floor.size)),
    )


def narrowed(pool: Pool, rows: Int64Array) -> Pool:
    """Keep only some candidates, (K,) sorted rows with all given ones among them; links are those that are left."""
    place = np.full(pool.n_candidates, -1, dtype=np.int64)
    place[rows] = np.arange(rows.size)
    return replace(
        pool,
        candidates=pool.take(rows),
        rows=pool.rows.take(rows),
        links=None if pool.links is None else links_among(pool.links, rows, place),
        given=tuple(place[list(pool.given)].tolist()),
        kept=tuple(int(p) for p in place[list(pool.kept)] if p >= 0),
        excluded=pool.excluded[rows],
        scanned=tuple(place[list(pool.scanned)].tolist()),
    )


def _links(
    survey: Survey,
    demand: Demand,
    position_m: FloatArray,
    rows: SeenPatches,
    scanned: Sequence[int],
    progress: Progress,
) -> CandidateLinks | None:
    requirements = demand.goals.requirements
    if not requirements.asks_links:
        return None
    counted = rows_of_overlap(demand, rows, requirements.overlap_of)
    surface = surface_of_patches(survey.scene, survey.patches, times_seen(counted) > 0)
    if requirements.doors_change:
        n = counted.n_positions
        counted = stacked_rows(counted, with_all_doors_shut(survey, counted, position_m))
        position_m, scanned = np.tile(position_m, (2, 1)), [*scanned, *(n + row for row in scanned)]
    found = candidate_links(
        counted,
        survey.patches.area_m2,
        surface,
        position_m,
        limits=requirements.link_limits,
        pre_alignment=requirements.start_of(survey.scanner),
        measure=requirements.overlap_measure,
        scanned=scanned,
        progress=progress,
    )
    return held_in_both_states(found) if requirements.doors_change else found


def with_target_links(pool: Pool, engine: ScanEngine) -> Pool:
    """Link by targets, where the requirements allow it, what stays apart without."""
    links, requirements = pool.links, pool.demand.goals.requirements
    if links is None or not requirements.joins_by_targets(pool.survey.scene.source.doors):
        return pool
    if np.unique(links.part[~pool.excluded]).size < 2:
        return pool
    links = _and_targets(links, pool, engine, pool.candidates.position_m, pool.rows)
    return without_dispensable(replace(pool, links=links, by_targets=True))


def _and_targets(
    links: CandidateLinks, pool: Pool, engine: ScanEngine, position_m: FloatArray, rows: SeenPatches
) -> CandidateLinks:
    survey, requirements = pool.survey, pool.demand.goals.requirements
    counted = rows_of_overlap(pool.demand, rows, requirements.overlap_of)
    if requirements.doors_change:
        counted = with_all_doors_shut(survey, counted, position_m)
    surface = surface_of_patches(survey.scene, survey.patches, times_seen(counted) > 0)
    return with_targets(links, target_pairs(counted, surface, survey, engine, position_m, links.part))


def _excluded_later(pool: Pool, links: CandidateLinks | None, *, n: int) -> BoolArray:
    """(n,) bool: of later candidates, those that are of no part that plans are made in."""
    excluded = np.zeros(n, dtype=bool)
    excluded[: pool.n_candidates] = pool.excluded
    if links is not None:
        excluded |= ~np.isin(links.part, np.unique(links.part[: pool.n_candidates][~pool.excluded]))
    return excluded


def _within_parts(links: CandidateLinks, part: Int32Array, excluded: BoolArray) -> CandidateLinks:
    """Keep the parts of the first candidates, (M,), apart: what hung together as far as it could still does so.

    Later candidates are of the first part that they are linked to by a candidate that is not excluded, (M,) bool.
    """
    n = links.n_candidates
    owner = np.repeat(np.arange(n), np.diff(links.starts))
    of_part = np.concatenate([part, np.full(n - part.size, n, dtype=np.int64)])
    to_old = (owner >= part.size) & (links.neighbour < part.size)
    to_old[to_old] = ~excluded[links.neighbour[to_old]]
    np.minimum.at(of_part, owner[to_old], part[links.neighbour[to_old]])
    lone = of_part == n
    of_part[lone] = int(part.max(initial=-1)) + 1 + np.arange(int(lone.sum()))
    return kept_links(links, of_part[owner] == of_part[links.neighbour], owner, of_part.astype(np.int32))


def links_among(links: CandidateLinks, rows: Int64Array, place: Int64Array) -> CandidateLinks:
    """Keep the links between some candidates, (K,) sorted rows; place : (N,) their new numbers, -1 for the others."""
    owner = np.repeat(np.arange(links.n_candidates), np.diff(links.starts))
    keep = (place[owner] >= 0) & (place[links.neighbour] >= 0)
    left = replace(links, neighbour=place[links.neighbour].astype(np.int32))
    left = kept_links(left, keep, place[owner], links.part[rows])
    return replace(left, part=parts_of(left.starts, left.neighbour))


def kept_links(links: CandidateLinks, keep: BoolArray, owner: Int64Array, part: Int32Array) -> CandidateLinks:
    """Keep links (L,), of owners (L,); as many candidates as `part` has."""
    size = np.bincount(owner[keep], minlength=part.size)
    return replace(
        links,
        starts=np.concatenate([[0], np.cumsum(size)]).astype(np.int64),
        neighbour=links.neighbour[keep],
        overlap=links.overlap[keep],
        strength=links.strength[keep],
        part=part,
    )


def _both(first: Candidates, second: Candidates) -> Candidates:
    return replace(
        first,
        position_m=np.concatenate([first.position_m, second.position_m]),
        floor=np.concatenate([first.floor, second.floor]),
        instrument_height_m=np.concatenate([first.instrument_height_m, second.instrument_height_m]),
    )
