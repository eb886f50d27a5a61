"""The whole flow on one page: from a scene and what is required of the survey to the plan.

Input a `Scene` (local frame, metres) and `PlanSettings`, output a `Plan`: the same one, to the byte, whenever scene,
settings and engine are the same, apart from its timings.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import numpy as np

from planner_core.coverage.survey import make_survey, planned_floors
from planner_core.engine.scan_engine import ScanEngine, open_engine
from planner_core.errors import RequirementError
from planner_core.model import (
    BoolArray,
    Candidates,
    Greedy,
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
from planner_core.paper.pipeline import find_pool, paper_settings
from planner_core.planning.choose import choose, choose_by_paper, choose_greedily
from planner_core.planning.first_plan import as_memory_holds, looked_from_few, tell_first_plan
from planner_core.planning.judge import with_judgement
from planner_core.planning.pool import Choice, Pool, make_pool
from planner_core.planning.results import Stopwatch, Surroundings, describe_plan
from planner_core.positions.allowed_positions import AllowedPositions, find_positions, places_as_they_are
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.progress import Progress, silent
from planner_core.requirements.explain import explain
from planner_core.requirements.goals import nothing_to_spare, required_of
from planner_core.requirements.scope import with_scope
from planner_core.route.route import ends_of, in_visiting_order, plan_route
from planner_core.select.check import check_coverage

__all__ = ["make_plan", "make_survey", "plan_survey"]


def make_plan(
    scene: Scene,
    settings: PlanSettings,
    *,
    engine: str = "auto",
    device: str | None = None,
    judge_points: int | None = 0,
    progress: Progress = silent,
) -> Plan:
    """Plan the stations of a survey: few of them, that meet what is required and register as one network.

    Parameters
    ----------
    engine, device
        See `planner_core.engine.scan_engine.open_engine`.
    judge_points
        See `planner_core.planning.judge.with_judgement`.

    Raises
    ------
    RequirementError
        Unknown floors, no valid tripod position, nothing that meets what is asked.
    DeviceError, SceneError
        See `open_engine`.
    """
    # 1. What there is: floors, patches, the beams of one scan.
    survey = make_survey(scene, settings, progress=progress)
    # 2. Something to scan with.
    scan_engine = open_engine(scene, survey.patches, engine=engine, device=device)
    plan = plan_survey(survey, settings, scan_engine, progress=progress)
    return with_judgement(plan, scan_engine, n_points=judge_points, progress=progress)


def plan_survey(
    survey: Survey, settings: PlanSettings, scan_engine: ScanEngine, *, progress: Progress = silent
) -> Plan:
    """Do the rest of `make_plan`, for callers that scan with the same engine afterwards."""
    clock = Stopwatch()
    floors = planned_floors(survey.floors, settings.requirements.floors)
    with clock.stage("scope"):
        space = free_space(survey, progress=progress)
        survey = with_scope(survey, settings, scan_engine, space=space, progress=progress)
    # 3. Where a tripod can stand, and be carried to.
    with clock.stage("candidates"):
        places = _places(survey, settings, scan_engine, floors, space, progress)
        bare = _bare_floors(survey, settings, places.candidates, floors)
    with clock.stage("first plan"):
        known = looked_from_few(survey, settings, scan_engine, places, progress)
        if known is not None:
            tell_first_plan(survey, settings, scan_engine, places, known, progress)
        places, known, thinned = as_memory_holds(places, known)
    # 4. What each spot sees, what of that meets what is asked, and which two could be registered with each other.
    with clock.stage("scan"):
        given = places.rows_of(Role.SCANNED, Role.LOCKED)
        kept = places.rows_of(Role.KEPT)
        pool = make_pool(
            survey, settings, scan_engine, places.candidates, given=given, kept=kept, known=known, progress=progress
        )
        _check_something_is_seen(pool, survey, settings)
        survey = pool.demand.surveyed(survey)
    # 5. Few spots that see enough, and how few are possible.
    with clock.stage("select"):
        choice = _choose(pool, places, survey, settings, scan_engine, progress)
        if not isinstance(settings.method, Paper) and settings.objective != Objective.COVERAGE:
            check_coverage(choice.pool.rows.met, pool.demand.area_m2, pool.constraints, choice.chosen)
    # 6. In which order to walk them, and what they are worth.
    with clock.stage("figures"):
        plan = _described(
            survey,
            settings,
            scan_engine,
            places,
            choice,
            (*bare, *thinned, *places.warnings, *nothing_to_spare(survey, settings)),
            progress,
        )
    return replace(plan, timings_s=clock.seconds)


def _places(
    survey: Survey,
    settings: PlanSettings,
    scan_engine: ScanEngine,
    floors: tuple[int, ...],
    space: FreeSpace,
    progress: Progress,
) -> AllowedPositions:
    if not isinstance(settings.method, Paper):
        return find_positions(survey, settings, scan_engine, floors=floors, space=space, progress=progress)
    pool = find_pool(survey, settings, paper_settings(settings), scan_engine, floors=floors, progress=progress)
    return places_as_they_are(survey, settings, pool, space=space, progress=progress)


def _choose(
    pool: Pool,
    places: AllowedPositions,
    survey: Survey,
    settings: PlanSettings,
    scan_engine: ScanEngine,
    progress: Progress,
) -> Choice:
    if isinstance(settings.method, Proven):
        return choose(pool, places, survey, settings, scan_engine, progress=progress)
    if isinstance(settings.method, Greedy):
        return choose_greedily(pool, progress=progress)
    return choose_by_paper(pool, settings, scan_engine, progress=progress)


def _described(
    survey: Survey,
    settings: PlanSettings,
    scan_engine: ScanEngine,
    places: AllowedPositions,
    choice: Choice,
    warnings: tuple[str, ...],
    progress: Progress,
) -> Plan:
    """Put the stations in the order of the walk, and work out their figures."""
    pool = choice.pool
    rows = np.array(choice.chosen, dtype=np.int64)
    scanned = np.isin(rows, places.rows_of(Role.SCANNED))
    at = pool.take(rows)
    route = plan_route(
        places.reach,
        at.position_m,
        at.instrument_height_m,
        at.floor,
        ends=ends_of(settings.site, survey.scene.offset_m),
        scanned=scanned,
        seed=settings.seed,
        progress=progress,
    )
    rows, scanned = rows[route.order], scanned[route.order]
    plan = describe_plan(
        survey,
        settings,
        scan_engine,
        stations=_stations(survey, pool.take(rows), _names(places, rows, settings.site), scanned),
        demand=pool.demand,
        rows=pool.rows.take(rows),
        surroundings=Surroundings(pool.candidates.position_m, pool.rows, places.reach),
        order_of_choice=tuple(int(i) for i in np.argsort(route.order)),
        route=in_visiting_order(route),
        n_scans=int((~scanned).sum()),
        lower_bound=choice.lower_bound,
        # The engine's after scanning, which may add to them.
        warnings=(*survey.warnings, *scan_engine.warnings, *warnings, *explain(survey, pool.demand), *choice.warnings),
        progress=progress,
    )
    return replace(
        plan,
        why_stopped=choice.why_stopped,
        objective_value=choice.value,
        objective_bound=choice.bound,
        n_greedy=choice.n_greedy,
        n_bounded=choice.n_bounded,
    )


def _names(places: AllowedPositions, rows: Int64Array, site: Site) -> list[str]:
    """Ids of stations: those that have one keep it, the others are numbered as they are visited.

    Nor is a number given again that a station of an earlier plan had: it would be taken for that one.
    """
    told = {each.row: each.place.station.id for each in places.prior if each.place.station.role != Role.BEGUN}
    taken = {station.id for station in site.prior if station.role not in (Role.BEGUN, Role.FORBIDDEN)}
    free = (name for name in (f"S{number:03d}" for number in count(1)) if name not in taken)
    return [told[int(row)] if int(row) in told else next(free) for row in rows]


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


def _check_something_is_seen(pool: Pool, survey: Survey, settings: PlanSettings) -> None:
    """Refuse a scanner that sees nothing from anywhere: without stations every requirement would be met."""
    if not pool.rows.seen.patch.size:
        low_m, high_m = survey.template.range_min_m, survey.template.range_max_m
        raise RequirementError(
            f"scanner {settings.scanner.name}: no surface seen from any of {pool.n_candidates} valid tripod "
            f"positions, expected surfaces between {low_m:g} and {high_m:g} m; check its ranges (metres) and field of "
            "view"
        )


def _bare_floors(
    survey: Survey, settings: PlanSettings, candidates: Candidates, floors: tuple[int, ...]
) -> tuple[str, ...]:
    """Warnings about planned floors without candidates; where no floor has any, there is nothing to plan."""
    required = survey.floor_of_triangle[survey.patches.triangle_of_patch[required_of(survey, settings)]]
    bare = [survey.floors[i].name for i in floors if not (candidates.floor == i).any() and (required == i).any()]
    if not bare and candidates.floor.size:
        return ()
    reasons = ", ".join(f"{reason}: {n}" for reason, n in sorted(candidates.rejected.items(), key=lambda r: -r[1]))
    if not candidates.floor.size:
        raise RequirementError(
            f"candidates: none of {candidates.n_tried} grid points is a valid tripod position ({reasons}), expected at "
            "least one; use a finer grid step or less clearance"
        )
    return tuple(
        f"floor {name!r} has no valid tripod position, it is seen from other floors only (refused: {reasons}); "
        "use a finer grid step or less clearance"
        for name in bare
    )
