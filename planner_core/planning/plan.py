"""The whole flow on one page: from a scene and what is required of the survey to the plan.

Input a `Scene` (local frame, metres) and `PlanSettings`, output a `Plan`: the same one, to the byte, whenever scene,
settings and engine are the same, apart from its timings.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count

import numpy as np

from planner_core.coverage.percent import probability_percent, reached_percent
from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Candidates,
    Greedy,
    InstrumentHeights,
    Int64Array,
    Objective,
    Paper,
    Plan,
    PlanSettings,
    Proven,
    Role,
    Scene,
    Site,
    Station,
    Survey,
)
from planner_core.network.network_report import WAY_OUT
from planner_core.paper.pipeline import find_pool
from planner_core.planning.between_parts import with_joining_candidates
from planner_core.planning.choose import choose, choose_by_paper, choose_greedily, only_join, route_through
from planner_core.planning.first_plan import as_needed, observe_few, tell_first_plan
from planner_core.planning.independent_check import with_independent_check
from planner_core.planning.join_offer import join_offer
from planner_core.planning.open_survey import open_survey
from planner_core.planning.pool import Choice, Pool, make_pool, with_target_links
from planner_core.planning.results import Stopwatch, Surroundings, describe_plan
from planner_core.planning.set_up import SET_UP_LOSS
from planner_core.positions.admissibility import Tripods, refusals_in_words
from planner_core.positions.allowed_positions import KINDS, AllowedPositions, find_positions, places_as_they_are
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import LocalSite, local_site
from planner_core.progress import Progress, silent
from planner_core.requirements.explain import explain
from planner_core.requirements.goals import Goals, goals_of
from planner_core.requirements.scope import with_scope
from planner_core.route.route import in_visiting_order
from planner_core.select.check import check_coverage
from planner_core.select.proven import INTERRUPTED

__all__ = ["make_plan", "make_survey", "plan_survey"]


def make_plan(
    scene: Scene,
    settings: PlanSettings,
    *,
    engine: str = "auto",
    device: str | None = None,
    verify_points: int | None = 0,
    progress: Progress = silent,
) -> Plan:
    """Plan the stations of a survey: few of them, that meet what is required and register as one network.

    Parameters
    ----------
    engine, device
        See `planner_core.engine.open_engine.open_engine`.
    verify_points
        See `planner_core.planning.independent_check.with_independent_check`.

    Raises
    ------
    RequirementError
        Unknown floors, no valid tripod position, nothing that meets the requirements.
    DeviceError, SceneError
        See `open_engine`.
    """
    # 1. What there is: floors, patches, the beams of one scan.
    # 2. Something to scan with.
    survey, scan_engine = open_survey(scene, settings, engine=engine, device=device, progress=progress)
    plan = plan_survey(survey, settings, scan_engine, progress=progress)
    return with_independent_check(plan, scan_engine, n_points=verify_points, progress=progress)


def plan_survey(
    survey: Survey, settings: PlanSettings, scan_engine: ScanEngine, *, progress: Progress = silent
) -> Plan:
    """Do the rest of `make_plan`, for callers that scan with the same engine afterwards.

    survey : made with settings of the same scanner, scan mode and floors to plan.
    """
    clock = Stopwatch()
    method = settings.seeded_method
    with clock.stage("scope"):
        space = free_space(survey, progress=progress)
        survey = with_scope(survey, settings.requirements, scan_engine, space=space, progress=progress)
        goals = goals_of(survey, settings.requirements)
    # 3. Where a tripod can stand, and be carried to.
    with clock.stage("candidates"):
        tripods = Tripods(survey, settings, scan_engine)
        site = local_site(survey, settings.site)
        if isinstance(method, Paper):
            starts = find_pool(tripods, method, seed=settings.seed, progress=progress)
            places = places_as_they_are(tripods, site, starts, space=space, progress=progress)
        else:
            places = find_positions(tripods, site, space=space, progress=progress)
        remarks = _bare_floors(survey, goals, places, settings.heights)
    with clock.stage("first plan"):
        known = None if isinstance(method, Paper) else observe_few(survey, goals, scan_engine, places, progress)
        worth_a_look = None
        if known is not None and isinstance(method, Proven) and settings.objective != Objective.COVERAGE:
            worth_a_look = tell_first_plan(survey, goals, scan_engine, places, known, method, progress)
        places, known, thinned = as_needed(places, known, worth_a_look)
    # 4. What each spot sees, what of that meets the requirements, and which two could be registered with each other.
    with clock.stage("scan"):
        pool = make_pool(
            survey,
            goals,
            scan_engine,
            places.candidates,
            given=places.rows_of(Role.SCANNED, Role.LOCKED),
            kept=places.rows_of(Role.KEPT),
            scanned=places.rows_of(Role.SCANNED),
            linked=isinstance(method, Proven),
            known=known,
            progress=progress,
        )
        _check_something_is_seen(pool)
        if isinstance(method, Proven):
            pool = with_joining_candidates(pool, places, scan_engine, progress=progress)
            pool = with_target_links(pool, scan_engine)
    # 5. Few spots that see enough, and how few are possible.
    with clock.stage("select"):
        if isinstance(method, Proven):
            choice = choose(pool, places, settings, method, scan_engine, progress=progress)
        elif isinstance(method, Greedy):
            choice = choose_greedily(pool, progress=progress)
        else:
            choice = choose_by_paper(pool, method, scan_engine, progress=progress)
        if not isinstance(method, Paper) and settings.objective != Objective.COVERAGE:
            check_coverage(choice.pool.rows.met, pool.demand.area_m2, pool.constraints, choice.chosen)
    # 6. In which order to walk them, and what they are worth.
    with clock.stage("figures"):
        remarks = (*remarks, *thinned, *places.warnings, *goals.remarks)
        plan = _described(settings, scan_engine, places, choice, remarks, progress)
    # 7. Where no door indoors joins them: what stations outdoors would do.
    if WAY_OUT in plan.warnings and choice.why_stopped != INTERRUPTED:
        with clock.stage("way out"):
            offer = join_offer(plan, scan_engine.name, progress=progress)
        plan = replace(plan, warnings=tuple(offer if line == WAY_OUT else line for line in plan.warnings))
    return replace(plan, timings_s=clock.seconds)


def _described(
    settings: PlanSettings,
    scan_engine: ScanEngine,
    places: AllowedPositions,
    choice: Choice,
    remarks: tuple[str, ...],
    progress: Progress,
) -> Plan:
    """Put the stations in the order of the walk, and work out their figures."""
    pool = choice.pool
    route, scanned = route_through(pool, choice.chosen, places, seed=settings.seed, progress=progress)
    rows, scanned = np.array(choice.chosen, dtype=np.int64)[route.order], scanned[route.order]
    names, joining = _names(places, rows, settings.site), only_join(choice)
    # The engine's warnings after scanning, which may add to them.
    warnings = (*pool.survey.warnings, *scan_engine.warnings, *remarks)
    plan = describe_plan(
        pool.survey,
        settings,
        scan_engine,
        stations=_stations(pool.survey, pool.take(rows), names, scanned),
        demand=pool.demand,
        rows=pool.rows.take(rows),
        surroundings=Surroundings(pool.candidates.position_m, pool.rows, places.reach),
        order_of_choice=tuple(int(i) for i in np.argsort(route.order)),
        route=in_visiting_order(route),
        n_scans=int((~scanned).sum()),
        lower_bound=choice.lower_bound,
        only_join=frozenset(name for row, name in zip(rows.tolist(), names, strict=True) if row in joining),
        warnings=(
            *warnings,
            *explain(pool.survey, pool.demand),
            *choice.warnings,
            *_on_flights(places, rows, names),
            *_outdoors(pool.survey, pool.take(rows), names),
            *_beside_the_survey(places.site, pool.take(rows), names),
            *_not_held(settings, choice, rows, names),
        ),
        progress=progress,
    )
    plan = _with_coverage_as_set_up(plan, choice)
    return replace(
        plan,
        why_stopped=choice.why_stopped,
        objective_value=choice.value,
        objective_bound=choice.bound,
        n_greedy=choice.n_greedy,
        n_bounded=choice.n_bounded,
    )


def _with_coverage_as_set_up(plan: Plan, choice: Choice) -> Plan:
    """Add to each requirement how much of it set-ups cover, and a line about those that may fall below it then."""
    if choice.covered_as_set_up is None:
        return plan
    covered = choice.covered_as_set_up.tolist()
    results = tuple(replace(each, as_set_up=share) for each, share in zip(plan.requirements, covered, strict=True))
    low = [
        f"{each.name!r} down to {reached_percent(share, each.required)} %, {100 * each.required:g} % required"
        for each, share in zip(results, covered, strict=True)
        if each.met and share < each.required - SET_UP_LOSS
    ]
    if not low:
        return replace(plan, requirements=results)
    line = (
        f"coverage may fall below what is required where stations are set up {plan.settings.set_up_tolerance_m:g} m "
        f"beside their marks: {', '.join(low)}; set up more exactly, or plan with a higher --coverage"
    )
    return replace(plan, requirements=results, warnings=(*plan.warnings, line))


def _names(places: AllowedPositions, rows: Int64Array, site: Site) -> list[str]:
    """Ids of stations: those that have one keep it, the others are numbered as they are visited.

    Nor is a number given again that a station of an earlier plan had: it would be taken for that one.
    """
    given = {each.row: each.place.station.id for each in places.prior if each.place.station.role != Role.BEGUN}
    taken = {station.id for station in site.prior if station.role not in (Role.BEGUN, Role.FORBIDDEN)}
    free = (name for name in (f"S{number:03d}" for number in count(1)) if name not in taken)
    return [given[int(row)] if int(row) in given else next(free) for row in rows]


def _on_flights(places: AllowedPositions, rows: Int64Array, names: list[str]) -> Iterator[str]:
    """A line about stations on flights of stairs: setting up there takes a tripod with legs of three lengths."""
    on_grid = rows < places.kind.size  # places around stations, found later, are on no flight
    is_flight = on_grid & (places.kind[np.where(on_grid, rows, 0)] == KINDS.index("flight"))
    stairs = sorted(name for name, one in zip(names, is_flight.tolist(), strict=True) if one)
    if stairs:
        one = len(stairs) == 1
        yield (
            f"{'station' if one else 'stations'} {', '.join(stairs)} {'stands' if one else 'stand'} on a flight of "
            "stairs, each leg of the tripod on a tread of its own, to register storeys with each other"
        )


def _outdoors(survey: Survey, at: Candidates, names: list[str]) -> Iterator[str]:
    """A line about stations of the interior that stand outdoors."""
    if survey.scope is None or not survey.scope.outdoors_m:
        return
    ground_m = at.position_m - np.column_stack([np.zeros((len(names), 2)), at.instrument_height_m])
    is_inside = survey.scope.surveys(ground_m).tolist()
    out = sorted(name for name, inside in zip(names, is_inside, strict=True) if not inside)
    if out:
        yield (
            f"{'station' if len(out) == 1 else 'stations'} {', '.join(out)} {'stands' if len(out) == 1 else 'stand'} "
            "outdoors, to register through exterior doors what no interior door joins; keep these doors open"
        )
    else:
        yield "no station stands outdoors (--join outside): none there joins more"


def _beside_the_survey(site: LocalSite, at: Candidates, names: list[str]) -> Iterator[str]:
    """A line about stations that stand where nothing is surveyed, for those around them to register."""
    if site.scope is None or site.scope.outdoors_m:
        return
    ground_m = at.position_m - np.column_stack([np.zeros((len(names), 2)), at.instrument_height_m])
    is_in = site.scope.admits(ground_m).tolist()
    prior = {station.id for station in site.prior}
    out = sorted(name for name, inside in zip(names, is_in, strict=True) if not inside and name not in prior)
    if out:
        one = len(out) == 1
        yield (
            f"{'station' if one else 'stations'} {', '.join(out)} {'stands' if one else 'stand'} out of scope, on the "
            "way between parts of the survey, which do not register with each other without"
        )


def _not_held(settings: PlanSettings, choice: Choice, rows: Int64Array, names: list[str]) -> Iterator[str]:
    """A line about links without which stations are in more groups, and which do not hold as these are set up."""
    if choice.fragile is None or not choice.fragile.first.size:
        return
    name = dict(zip(rows.tolist(), names, strict=True))
    limits = settings.requirements.link_limits
    links = []
    for one, other, overlap, strength, probability in zip(
        *(each.tolist() for each in vars(choice.fragile).values()), strict=True
    ):
        registers = (
            f"probability {probability_percent(probability, limits.probability)} %, " if limits.probability else ""
        )
        overlaps = f"{registers}{reached_percent(overlap, limits.overlap)} % overlap, strength {strength:.3f}"
        links.append(f"{' to '.join(sorted((name[one], name[other])))} (down to {overlaps})")
    yield (
        f"the network falls apart where stations are set up {settings.set_up_tolerance_m:g} m beside their marks: "
        f"{'link' if len(links) == 1 else 'links'} {', '.join(links)}; set these up to the centimetre, add a station "
        "between them, or register with targets"
    )


def _stations(survey: Survey, at: Candidates, names: list[str], scanned: BoolArray) -> tuple[Station, ...]:
    return tuple(
        Station(
            id=name,
            floor=survey.floors[int(at.floor[row])].id,
            order=row + 1,
            position_m=at.position_m[row].copy(),
            instrument_height_m=float(at.instrument_height_m[row]),
            fixed=fixed,
        )
        for row, (name, fixed) in enumerate(zip(names, scanned.tolist(), strict=True))
    )


def _check_something_is_seen(pool: Pool) -> None:
    """Refuse a scanner that sees nothing from anywhere: without stations every requirement would be met."""
    if not pool.rows.seen.n_entries:
        low_m, high_m = pool.survey.template.range_min_m, pool.survey.template.range_max_m
        raise RequirementError(
            f"scanner {pool.survey.scanner.name}: no surface seen from any of {pool.n_candidates} valid tripod "
            f"positions, expected surfaces between {low_m:g} and {high_m:g} m; check its ranges (metres) and field of "
            "view"
        )


def _bare_floors(survey: Survey, goals: Goals, places: AllowedPositions, heights: InstrumentHeights) -> tuple[str, ...]:
    """Warnings about planned floors without candidates; where no floor has any, there is nothing to plan."""
    candidates = places.candidates
    required = survey.floor_of_triangle[survey.patches.triangle_of_patch[goals.patches]]
    bare = [i for i in survey.planned if not (candidates.floor == i).any() and (required == i).any()]
    if not candidates.floor.size:
        causes = refusals_in_words(candidates.rejected, [survey.floors[i] for i in survey.planned], heights)
        raise RequirementError(
            f"candidates: none of {candidates.n_tried} positions tried is valid for a tripod, expected at least one "
            f"{causes}"
        )
    return tuple(
        f"floor {survey.floors[i].name!r} has no valid tripod position, it is seen from other floors only "
        f"{refusals_in_words(places.refused_on(i), [survey.floors[i]], heights)}"
        for i in bare
    )
