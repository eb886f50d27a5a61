"""The whole flow on one page: from a scene and what is required of the survey to the plan.

Input a `Scene` (local frame, metres) and `PlanSettings`, output a `Plan`: the same one, to the byte, whenever scene,
settings and engine are the same, apart from its timings.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.candidates.grid import find_candidates
from planner_core.errors import RequirementError
from planner_core.method_options import with_options
from planner_core.metrics.coverage import floor_of_patch, take_rows, times_seen
from planner_core.model import BoolArray, Candidates, Plan, PlanSettings, Scene, Station, Survey
from planner_core.paper import find_pool, paper_settings, repair, select_by_genes, shortfall
from planner_core.progress import Progress, silent
from planner_core.results import Stopwatch, describe_plan
from planner_core.scan.engine import ScanEngine, device_of, open_engine
from planner_core.select.bound import lower_bound
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem, floor_targets
from planner_core.select.proven import SelectionSettings
from planner_core.select.proven import select as select_proven
from planner_core.select.walking_order import walking_order
from planner_core.survey import make_survey, planned_floors, scope_of, visible_from

__all__ = ["make_plan", "make_survey", "plan_survey"]


def make_plan(
    scene: Scene,
    settings: PlanSettings,
    *,
    engine: str = "auto",
    device: str | None = None,
    progress: Progress = silent,
) -> Plan:
    """Plan the stations of a survey: few of them, for the required coverage on each planned floor and overall.

    Parameters
    ----------
    engine, device
        See `planner_core.scan.engine.open_engine`.

    Raises
    ------
    RequirementError
        Settings that make no sense, unknown floors, no spot to stand on.
    DeviceError, SceneError
        See `open_engine`.
    """
    # 1. What there is: floors, patches, the beams of one scan.
    survey = make_survey(scene, settings, progress=progress)
    # 2. Something to scan with.
    caster = open_engine(scene, survey.patches, engine=engine, device=device)
    return plan_survey(survey, settings, caster, progress=progress)


def plan_survey(survey: Survey, settings: PlanSettings, caster: ScanEngine, *, progress: Progress = silent) -> Plan:
    """Do the rest of `make_plan`, for callers that scan with the same engine afterwards."""
    clock = Stopwatch()
    paper = paper_settings(settings) if settings.method == "paper" else None
    if settings.method == "proven":
        selection_settings(settings)  # refuses what makes no sense before any work
    floors = planned_floors(survey.floors, settings.requirements.floors)
    # 3. Where a tripod can stand.
    with clock.stage("candidates"):
        if paper is None:
            candidates = find_candidates(survey, settings, caster, floors=floors, progress=progress)
        else:
            candidates = find_pool(survey, settings, paper, caster, floors=floors, progress=progress)
        bare = _bare_floors(survey, candidates, floors)
    # 4. What each spot sees. Seen by any of them: achievable.
    with clock.stage("scan"):
        visibility = visible_from(survey, settings, caster, candidates.position_m, progress=progress)
        achievable = times_seen(visibility) > 0
        _check_something_is_seen(achievable, survey, settings, int(candidates.floor.size))
    # 5. Few spots that see enough, and how few are possible.
    with clock.stage("select"):
        of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
        scope = scope_of(of_patch, floors, len(survey.floors))
        targets = floor_targets(of_patch, floors, scope, settings.requirements.coverage)
        problem = cover_problem(visibility, survey.patches.area_m2, targets)
        fewest, why_stopped = None, ""
        if settings.method == "greedy":
            chosen = np.array(select_greedy(problem, progress=progress).chosen, dtype=np.int64)
        elif paper is None:
            found = select_proven(problem, selection_settings(settings), device=device_of(caster), progress=progress)
            chosen, fewest = np.array(found.chosen, dtype=np.int64), found.lower_bound
            why_stopped = found.why_stopped
        else:
            chosen = select_by_genes(problem, paper, caster, progress=progress)
            chosen, unrepaired = repair(settings, paper, candidates, chosen, progress=progress)
            bare = (*bare, *shortfall(problem, chosen), *unrepaired)
    with clock.stage("bound"):
        if fewest is None:
            fewest = lower_bound(problem, n_stations=chosen.size, progress=progress)
    # 6. In which order to walk them, and what they are worth.
    with clock.stage("figures"):
        walk = np.array(walking_order(candidates.position_m[chosen], candidates.floor[chosen]), dtype=np.int64)
        plan = describe_plan(
            survey,
            settings,
            caster,
            stations=_stations(survey, candidates, [int(c) for c in chosen[walk]]),
            visibility=take_rows(visibility, chosen[walk]),
            order_of_choice=tuple(int(i) for i in np.argsort(walk)),
            achievable=achievable,
            lower_bound=fewest,
            n_candidates=int(candidates.floor.size),
            warnings=(*survey.warnings, *caster.warnings, *bare),  # the engine's last: scanning may add to them
        )
    return replace(plan, timings_s=clock.seconds, why_stopped=why_stopped)


def selection_settings(settings: PlanSettings) -> SelectionSettings:
    """Settings of method `proven`: defaults with the plan's seed and options.

    Raises
    ------
    RequirementError
        An option that does not exist or makes no sense.
    """
    return with_options(SelectionSettings(seed=settings.seed), settings.method_options)


def _stations(survey: Survey, candidates: Candidates, rows: list[int]) -> tuple[Station, ...]:
    return tuple(
        Station(
            id=f"S{number:03d}",
            floor=survey.floors[int(candidates.floor[row])].id,
            order=number,
            position_m=candidates.position_m[row].copy(),
            instrument_height_m=float(candidates.instrument_height_m[row]),
        )
        for number, row in enumerate(rows, start=1)
    )


def _check_something_is_seen(achievable: BoolArray, survey: Survey, settings: PlanSettings, n_candidates: int) -> None:
    """Refuse a scanner that sees nothing from anywhere: without stations every requirement would be met."""
    if not achievable.any():
        low_m, high_m = survey.template.range_min_m, survey.template.range_max_m
        raise RequirementError(
            f"scanner {settings.scanner.name}: nothing to be seen from any of {n_candidates} admissible positions, "
            f"expected surfaces between {low_m:g} and {high_m:g} m; check its ranges (metres) and field of view"
        )


def _bare_floors(survey: Survey, candidates: Candidates, floors: tuple[int, ...]) -> tuple[str, ...]:
    """Warnings about planned floors without candidates; where no floor has any, there is nothing to plan."""
    bare = [survey.floors[i].name for i in floors if not (candidates.floor == i).any()]
    if not bare:
        return ()
    reasons = ", ".join(f"{reason}: {n}" for reason, n in sorted(candidates.rejected.items(), key=lambda r: -r[1]))
    if len(bare) == len(floors):
        raise RequirementError(
            f"candidates: none of {candidates.n_tried} grid points is a spot to stand on ({reasons}), expected at "
            "least one; use a finer grid step or less clearance"
        )
    return tuple(
        f"floor {name!r} has no spot to stand on, what is seen of it is seen from other floors (refused: {reasons}); "
        "use a finer grid step or less clearance"
        for name in bare
    )
