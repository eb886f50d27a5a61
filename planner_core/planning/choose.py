"""Choosing stations from a pool by method and objective, and saying how good the choice is.

Input a `Pool` and settings, output a `Choice`. CONTROL FLOW, `choose`:

    paper     genetic selection, then overlap repair                                       planner_core.paper.pipeline
    greedy    lazy greedy selection, and a bound by prices                           select.greedy, select.quick_bound
    proven    fewest: selection with proof, then places off the grid                       select.proven, refine
              time: the same, then a shorter walk                                          route.least_time
              coverage: most of it with so many stations                                   select.most_coverage
              re-planning: stations of the earlier plan first, then as before              select.proven, select.polish
    going on:    the search begins with stations that are `begun`                select.proven, select.most_coverage

An interrupt ends `proven` once it has a plan, and that plan is the choice. A limit of time is for all steps together.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BoolArray, Crew, FloatArray, Objective, Paper, PlanSettings, Proven, Role, Route
from planner_core.paper.overlap_repair import OVERLAP_OF_CIRCLES
from planner_core.paper.pipeline import repair, select_by_genes, shortfall
from planner_core.planning.pool import Choice, FragileLinks, Pool
from planner_core.planning.refine import WORK_SHARE, refine
from planner_core.planning.set_up import (
    SET_UP_LOSS,
    SeenAsSetUp,
    coverage_as_set_up,
    decisive,
    fragile_links,
    without_fragile,
)
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.positions.walking import Walking
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.route.least_time import LeastTimeSettings, WalkingDistances, least_time
from planner_core.route.route import ends_on_ground, plan_route
from planner_core.select.greedy import drop_redundant, select_greedy
from planner_core.select.large import select_by_size
from planner_core.select.most_coverage import most_coverage
from planner_core.select.polish import polish
from planner_core.select.proven import INTERRUPTED, PROVEN, ProvenSelection
from planner_core.select.quick_bound import lower_bound
from planner_core.select.search import WORK_DONE

#: `Choice.why_stopped` of a plan that takes more stations than it had to, for the sake of an earlier one.
KEPT = "earlier stations kept"
#: The same, for the sake of links that hold as stations are set up.
HELD = "links hold as set up"
#: A plan is chosen anew so often at most, until its network holds as it is set up: twice in the duplex.
_ROUNDS = 6
#: Work of each of these rounds, as a share of the limit and at least: twenty times as much found no fewer stations.
_ROUND_SHARE, _ROUND_WORK = 0.05, 3.0
#: What becomes of an interrupt, for whoever made it.
_HEARD = "interrupted: keeping the best plan so far; interrupt again to discard it"


def choose_greedily(pool: Pool, *, progress: Progress = silent) -> Choice:
    """Take one station after the other, each the one that adds most; given ones first."""
    chosen = tuple(select_greedy(pool.problem, given=pool.given, progress=progress).chosen)
    fewest = lower_bound(pool.problem, n_stations=len(chosen), progress=progress)
    return Choice(pool, chosen, fewest, n_greedy=len(chosen), n_bounded=pool.n_free)


def choose_by_paper(pool: Pool, paper: Paper, engine: ScanEngine, *, progress: Progress = silent) -> Choice:
    """Choose as the method paper does: select by genes, then add stations until their circles overlap as required."""
    problem = pool.problem if paper.count == "area" else pool.problem_of_patches()
    chosen = select_by_genes(problem, paper, engine, progress=progress)
    fewest = lower_bound(pool.problem, n_stations=chosen.size, progress=progress)
    overlap = pool.demand.goals.requirements.overlap or OVERLAP_OF_CIRCLES
    chosen, unrepaired = repair(paper, overlap, pool.candidates, chosen, progress=progress)
    return Choice(
        pool,
        tuple(chosen.tolist()),
        fewest,
        n_bounded=pool.n_candidates,
        warnings=(*shortfall(pool.problem, chosen), *unrepaired),
    )


def choose(
    pool: Pool,
    places: AllowedPositions,
    settings: PlanSettings,
    method: Proven,
    engine: ScanEngine,
    *,
    progress: Progress = silent,
) -> Choice:
    """Choose by `method` for the objective of the settings."""
    budget = _Budget(method, time.monotonic())
    begun = (*pool.given, *(int(row) for row in places.rows_of(Role.BEGUN)))
    tolerance_m = settings.set_up_tolerance_m
    if settings.max_stations is not None:
        choice = _most_covered(pool, settings.max_stations, budget, progress, begun=begun)
        return _as_set_up(choice, places, tolerance_m, engine, progress)
    choice = _fewest(pool, budget, progress, begun=begun)
    try:  # from here on there is a plan, whoever interrupts what
        on_grid = choice
        is_refined = not pool.kept and settings.refine and _goes_on(choice, budget)
        if pool.kept:
            choice, with_all = _replanned(choice, budget, progress)
        elif is_refined:
            choice = _refined(choice, places, engine, budget, progress)
        may_change = not (pool.kept or pool.loops)  # a redundant network outlasts the failure of any link
        changes = budget if may_change else None
        choice = _as_set_up(choice, places, tolerance_m, engine, progress, budget=changes)
        if pool.kept and _stations_that_hold(choice) > (False, len(choice.chosen)):
            # What is not needed on the marks may be what makes the network hold beside them.
            with_all = _as_set_up(with_all, places, tolerance_m, engine, progress)
            choice = min(choice, with_all, key=_stations_that_hold)
        if is_refined and len(choice.chosen) > len(on_grid.chosen):
            # What holds of the grid alone may take fewer than what holds off it.
            held = _as_set_up(on_grid, places, tolerance_m, engine, progress, budget=changes)
            choice = min(choice, held, key=_stations_that_hold)
        if settings.objective == Objective.TIME:
            choice = _quickest(choice, places, settings.crew, settings.seed, budget, progress)
            choice = _as_set_up(choice, places, tolerance_m, engine, progress)
    except KeyboardInterrupt:
        _settle(progress, "select", INTERRUPTED)
        choice = replace(choice, why_stopped=INTERRUPTED)
    return choice


@dataclass(frozen=True)
class _Budget:
    """How long to search, in all, from `began_s` of the clock on."""

    whole: Proven
    began_s: float

    @property
    def left(self) -> Proven:
        """As much time as is left; work is allowed anew to each step, so that it does not hang on the clock."""
        if self.whole.time_limit_s is None:
            return self.whole
        passed_s = time.monotonic() - self.began_s
        return replace(self.whole, time_limit_s=max(0.0, self.whole.time_limit_s - passed_s))


def _goes_on(choice: Choice, budget: _Budget) -> bool:
    return choice.why_stopped != INTERRUPTED and budget.left.time_limit_s != 0.0


def _settle(progress: Progress, stage: str, why_stopped: str) -> None:
    """Tell that interrupts until now have had what they were for."""
    note = _HEARD if why_stopped == INTERRUPTED else ""
    progress(ProgressEvent(stage, 0, 0, note, settles_interrupts=True))


# ------------------------------------------------------------------------------------------ fewest stations
def _fewest(pool: Pool, budget: _Budget, progress: Progress, *, begun: tuple[int, ...]) -> Choice:
    meets = len(begun) > len(pool.given) and bool((pool.problem.covered(list(begun)) >= pool.problem.required).all())
    found = _select(pool, budget.left, progress, start=begun if meets else None)
    fewest, why_stopped, n_stations = found.lower_bound, found.why_stopped, len(found.chosen)
    if not budget.whole.prove and why_stopped == WORK_DONE:
        fewest = max(fewest, lower_bound(pool.problem, n_stations=n_stations, given=pool.given, progress=progress))
        why_stopped = PROVEN if fewest >= n_stations else WORK_DONE
    return Choice(
        pool,
        found.chosen,
        fewest,
        why_stopped,
        n_greedy=found.n_greedy,
        n_bounded=pool.n_free,
    )


def _select(
    pool: Pool,
    selection: Proven,
    progress: Progress,
    *,
    given: tuple[int, ...] | None = None,
    start: tuple[int, ...] | None = None,
    enough: int = 0,
) -> ProvenSelection:
    found = select_by_size(
        pool.problem,
        selection,
        network=pool.network,
        given=pool.given if given is None else given,
        start=start,
        enough=enough,
        # With other given stations, the bound is one of plans that have these.
        progress=pool.placing(progress, bounds=given is None),
    )
    _settle(progress, "select", found.why_stopped)
    return found


def _replanned(choice: Choice, budget: _Budget, progress: Progress) -> tuple[Choice, Choice]:
    """Keep the earlier plan's stations, add the fewest that are missing, drop those that are not needed any more; and
    the same without dropping any.

    Of the plan from scratch only its bound and its number of stations are reported.
    """
    pool = choice.pool
    stays = tuple(dict.fromkeys((*pool.given, *pool.kept)))
    # Somebody who has interrupted once waits for the least that makes a plan.
    left = replace(budget.left, work_limit=0.0) if choice.why_stopped == INTERRUPTED else budget.left
    filled = _select(pool, left, progress, given=stays)
    needed = drop_redundant(pool.problem, list(filled.chosen), given=pool.given, network=pool.network)
    chosen = polish(pool.problem, needed, network=pool.network, given=pool.given, keep=pool.kept)
    why_stopped = INTERRUPTED if filled.why_stopped == INTERRUPTED else choice.why_stopped
    return _instead(choice, chosen, why_stopped), _instead(choice, filled.chosen, why_stopped)


def _instead(choice: Choice, chosen: tuple[int, ...], why_stopped: str) -> Choice:
    """Stations chosen for the sake of earlier ones in place of those from scratch."""
    lines = []
    if len(choice.chosen) < len(chosen):
        lines.append(
            f"planning again with stations of the earlier plan takes {len(chosen)} stations; from scratch, "
            f"{len(choice.chosen)}"
        )
    if why_stopped == PROVEN and len(chosen) > choice.lower_bound:
        why_stopped = KEPT
    return replace(choice, chosen=chosen, why_stopped=why_stopped, warnings=(*choice.warnings, *lines))


def _refined(
    choice: Choice, places: AllowedPositions, engine: ScanEngine, budget: _Budget, progress: Progress
) -> Choice:
    work = replace(budget.left, work_limit=WORK_SHARE * budget.whole.work_limit, prove=False)
    better = refine(choice.pool, choice.chosen, places, engine, work, progress=progress)
    _settle(progress, "refine", INTERRUPTED if better.interrupted else "")
    why_stopped = INTERRUPTED if better.interrupted else choice.why_stopped
    if len(better.chosen) == len(choice.chosen):
        # As many: the bound that was proven is that of the first candidates.
        return replace(choice, pool=better.pool, chosen=better.chosen, why_stopped=why_stopped)
    # Somebody who has interrupted waits for a bound that needs no search.
    left = replace(budget.left, work_limit=0.0) if better.interrupted else budget.left
    again = _select(better.pool, left, progress, start=better.chosen)
    chosen = again.chosen
    if len(chosen) < len(better.chosen):
        chosen = polish(better.pool.problem, chosen, network=better.pool.network, given=better.pool.given)
    return replace(
        choice,
        pool=better.pool,
        chosen=chosen if len(chosen) < len(better.chosen) else better.chosen,
        lower_bound=again.lower_bound,
        why_stopped=INTERRUPTED if better.interrupted else again.why_stopped,
        n_bounded=better.pool.n_free,
    )


@dataclass(frozen=True)
class _SetUp:
    """A choice as its stations are set up. pool : without links that do not hold. fragile : those of its network.

    falls_apart : more groups than on the marks.
    """

    pool: Pool
    chosen: tuple[int, ...]
    fragile: FragileLinks | None
    falls_apart: bool


def _as_set_up(
    choice: Choice,
    places: AllowedPositions,
    tolerance_m: float,
    engine: ScanEngine,
    progress: Progress,
    *,
    budget: _Budget | None = None,
) -> Choice:
    """Choose stations whose network holds wherever within the tolerance each is set up; without a budget, only check.

    Links that do not hold are left out, and stations chosen from what is left; in the next round so are those of these.
    Where that comes to no end the first choice stays. The bound is that of all links: it holds for fewer, too. Where
    coverage does not hold, stations are exchanged for what covers more; none is added.
    """
    if not tolerance_m or not choice.chosen:
        return choice
    seen, why_stopped = SeenAsSetUp(tolerance_m), choice.why_stopped

    def set_up(pool: Pool, chosen: tuple[int, ...]) -> _SetUp:
        return _set_up(pool, chosen, engine, tolerance_m, seen, progress)

    def covered(found: _SetUp) -> tuple[FloatArray, float]:
        """See `coverage_as_set_up`; and what that lacks of what is required but `SET_UP_LOSS`, a sum of fractions."""
        share = coverage_as_set_up(found.pool, found.chosen, engine, tolerance_m, seen=seen, progress=progress)
        required = np.array([constraint.fraction for constraint in found.pool.demand.constraints])
        return share, float(np.maximum(0.0, required - SET_UP_LOSS - share).sum())

    first = found = set_up(choice.pool, choice.chosen)
    for _ in range(1, _ROUNDS):
        if not found.falls_apart or budget is None or not _goes_on(choice, budget):
            break
        most = budget.whole.work_limit
        work = replace(budget.left, work_limit=min(most, max(_ROUND_WORK, _ROUND_SHARE * most)), prove=False)
        # With more links, fewer were not found in more work.
        selected = _select(found.pool, work, progress, enough=len(choice.chosen))
        if selected.why_stopped == INTERRUPTED:
            break
        chosen = polish(found.pool.problem, selected.chosen, network=found.pool.network, given=found.pool.given)
        found = set_up(found.pool, chosen)
    if found.falls_apart:
        found = replace(first, pool=choice.pool)
    covers, lacks = covered(found)
    if lacks and not found.falls_apart and budget is not None and _goes_on(choice, budget):
        chosen = polish(found.pool.problem, found.chosen, network=found.pool.network, given=found.pool.given)
        if set(chosen) != set(found.chosen):
            fuller = set_up(found.pool, chosen)
            if not fuller.falls_apart and (of_fuller := covered(fuller))[1] < lacks:
                found, covers = fuller, of_fuller[0]
    if why_stopped == PROVEN and len(found.chosen) > max(len(choice.chosen), choice.lower_bound):
        why_stopped = HELD
    return replace(
        choice,
        pool=found.pool,
        chosen=found.chosen,
        why_stopped=why_stopped,
        fragile=found.fragile,
        covered_as_set_up=covers,
    )


def _set_up(
    pool: Pool,
    chosen: tuple[int, ...],
    engine: ScanEngine,
    tolerance_m: float,
    seen: SeenAsSetUp,
    progress: Progress,
) -> _SetUp:
    """Scan chosen stations where they may stand, and find what of the network does not hold."""
    if pool.links is None or len(chosen) < 2:
        return _SetUp(pool, chosen, None, False)
    fragile = fragile_links(pool, chosen, engine, tolerance_m, seen=seen, progress=progress)
    holding = without_fragile(pool, fragile)
    assert holding.network is not None
    falls_apart = bool(holding.network.n_violations(chosen))
    return _SetUp(holding, chosen, decisive(pool, chosen, fragile), falls_apart)


def _stations_that_hold(choice: Choice) -> tuple[bool, int]:
    """Key by which of two choices is better: one that holds as set up, then the fewer stations."""
    return choice.fragile is not None and choice.fragile.first.size > 0, len(choice.chosen)


# ------------------------------------------------------------------------------------------ other objectives
def _quickest(
    choice: Choice, places: AllowedPositions, crew: Crew, seed: int, budget: _Budget, progress: Progress
) -> Choice:
    pool = choice.pool
    foot_m = pool.candidates.position_m.copy()
    foot_m[:, 2] -= pool.candidates.instrument_height_m
    ends, _ = ends_on_ground(places.reach, places.site.ends)
    stops: list[FloatArray] = [foot_m]
    start = end = None
    if ends.start_m is not None:
        start = pool.n_candidates
        stops.append(ends.start_m[None])
    if ends.end_m is not None:
        end = sum(len(stop) for stop in stops)
        stops.append(ends.end_m[None])
    assert crew.scan_s is not None  # `PlanSettings` has checked it
    station_s = crew.scan_s + crew.set_up_s
    found = least_time(
        pool.problem,
        choice.chosen,
        WalkingDistances(
            distances=Walking(places.reach).from_each(np.concatenate(stops)),
            floor=pool.candidates.floor,
            start=start,
            end=end,
            closed=ends.closed,
        ),
        LeastTimeSettings(
            per_station_s=station_s,
            walking_m_per_s=crew.walking_m_per_s,
            n_kicks=LeastTimeSettings.n_kicks if _goes_on(choice, budget) else 0,
            seed=seed,
        ),
        fewest=choice.lower_bound,
        given=pool.given,
        scanned=pool.scanned,
        network=pool.network,
        progress=progress,
    )
    _settle(progress, "least time", INTERRUPTED if found.interrupted else "")

    def field_s(chosen: tuple[int, ...]) -> tuple[int, float]:
        """Legs that can't be walked, and seconds for all else."""
        route, scanned = route_through(pool, chosen, places, seed=seed)
        n_scans = int((~scanned).sum())
        return route.n_unwalkable, n_scans * station_s + route.length_m / crew.walking_m_per_s

    # The search measures walks a little differently from the route that the crew gets, and that one counts.
    before, after = field_s(choice.chosen), field_s(found.chosen)
    chosen, (_, seconds) = (found.chosen, after) if after < before else (choice.chosen, before)
    return replace(
        choice,
        chosen=chosen,
        why_stopped=INTERRUPTED if found.interrupted else choice.why_stopped,
        value=seconds,
        # Places off the grid may beat a bound of the grid's candidates, which is then void.
        bound=found.lower_bound_s if found.lower_bound_s <= seconds else None,
    )


def only_join(choice: Choice) -> frozenset[int]:
    """Rows of chosen stations that coverage does not need, together, and the network does."""
    pool = choice.pool
    if pool.network is None:
        return frozenset()
    needed = drop_redundant(pool.problem, list(choice.chosen), given=pool.given, network=pool.network)
    return frozenset(needed).difference(drop_redundant(pool.problem, needed, given=pool.given))


def route_through(
    pool: Pool, chosen: tuple[int, ...], places: AllowedPositions, *, seed: int, progress: Progress = silent
) -> tuple[Route, BoolArray]:
    """Find the route through chosen rows, and say which of them, (K,) bool, are scanned: nobody walks there."""
    rows = np.array(chosen, dtype=np.int64)
    scanned = np.isin(rows, pool.scanned)
    at = pool.take(rows)
    route = plan_route(
        places.reach,
        at.position_m,
        at.instrument_height_m,
        at.floor,
        ends=places.site.ends,
        scanned=scanned,
        seed=seed,
        progress=progress,
    )
    return route, scanned


def _most_covered(pool: Pool, n_most: int, budget: _Budget, progress: Progress, *, begun: tuple[int, ...]) -> Choice:
    # Of the pool's problem, in which stations that nobody can be registered with see nothing, the overall requirement.
    goals = pool.demand.goals
    overall = [goals.each.index(goals.overall)]
    problem = replace(
        pool.problem,
        counts_for=pool.problem.counts_for[overall],
        required=pool.problem.required[overall],
        least=pool.problem.least[overall],
        seen_from=pool.problem.seen_from[overall],
    )
    found = most_coverage(
        problem,
        n_most,
        budget.left,
        network=pool.network,
        given=pool.given,
        start=begun if len(pool.given) < len(begun) <= n_most else None,
        progress=pool.placing(progress),
    )
    _settle(progress, "select", found.why_stopped)
    return Choice(
        pool, found.chosen, 0, why_stopped=found.why_stopped, value=found.fraction, bound=found.bound_fraction
    )
