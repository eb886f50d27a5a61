"""What a GIVEN station list is worth: the same figures as for a plan of our own, for stations somebody else chose.

Input a `Scene` (local frame), `PlanSettings` and stations (SCENE frame, metres), output a `Plan`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import StationListError
from planner_core.model import Plan, PlanSettings, PriorStation, Role, Route, Scene, Station, Survey, Visibility
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.independent_check import with_independent_check
from planner_core.planning.open_survey import open_survey
from planner_core.planning.results import Stopwatch, Surroundings, describe_plan
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import AllowedPositions, find_positions, place_prior
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.positions.local_site import local_site
from planner_core.progress import Progress, silent
from planner_core.requirements.compliance import missed_in_words
from planner_core.requirements.demand import demand_of
from planner_core.requirements.explain import explain
from planner_core.requirements.goals import goals_of
from planner_core.requirements.scope import with_scope
from planner_core.route.route import plan_route
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem
from planner_core.select.quick_bound import lower_bound


def evaluate_stations(
    scene: Scene,
    settings: PlanSettings,
    stations: Sequence[GivenStation],
    *,
    engine: str = "auto",
    device: str | None = None,
    verify_points: int | None = 0,
    progress: Progress = silent,
) -> Plan:
    """Compute coverage, overlap and the rest for `stations`, in their order.

    Achievable is what the grid's candidates or the stations see. A station where no tripod can stand, or over no floor,
    is evaluated all the same, with a warning; so is a list that misses the required coverage. verify_points : see
    `planner_core.planning.independent_check.with_independent_check`.

    Raises
    ------
    StationListError
        No stations, or two with the same id.
    RequirementError, DeviceError, SceneError
        As for `planner_core.planning.plan.make_plan`.
    """
    survey, scan_engine = open_survey(scene, settings, engine=engine, device=device, progress=progress)
    plan = evaluate_survey(survey, settings, stations, scan_engine, progress=progress)
    return with_independent_check(plan, scan_engine, n_points=verify_points, progress=progress)


def evaluate_survey(
    survey: Survey,
    settings: PlanSettings,
    stations: Sequence[GivenStation],
    scan_engine: ScanEngine,
    *,
    keeps_order: bool = False,
    progress: Progress = silent,
) -> Plan:
    """Do the rest of `evaluate_stations`, for callers that scan with the same engine afterwards.

    survey : as in `planner_core.planning.plan.plan_survey`. keeps_order : the route visits the stations in the order of
    the list, instead of a shorter one.
    """
    _check_list(stations)
    clock = Stopwatch()
    with clock.stage("scope"):
        space = free_space(survey, progress=progress)
        survey = with_scope(survey, settings.requirements, scan_engine, space=space, progress=progress)
        goals = goals_of(survey, settings.requirements)
    with clock.stage("candidates"):
        tripods, site = Tripods(survey, settings, scan_engine), local_site(survey, settings.site)
        places = find_positions(tripods, site, space=space, progress=progress)
        listed, remarks = place_stations(tripods, stations, places.reach.space)
    with clock.stage("scan"):
        at = np.stack([station.position_m for station in listed])
        at_m = np.concatenate([places.candidates.position_m, at])
        demand = demand_of(survey, goals, scan_engine, at_m, progress=progress)
        survey = demand.with_counted_patches(survey)
        n_candidates = int(places.candidates.floor.size)
        of_candidates = demand.rows.take(list(range(n_candidates)))
        rows = demand.rows.take(list(range(n_candidates, n_candidates + len(listed))))
    with clock.stage("bound"):
        problem = cover_problem(demand.rows.met, demand.area_m2, demand.constraints)
        # A greedy plan only guides the search for the bound.
        guide = len(select_greedy(problem, progress=progress).chosen)
        fewest = lower_bound(problem, n_stations=guide, progress=progress)
    with clock.stage("figures"):
        plan = describe_plan(
            survey,
            settings,
            scan_engine,
            stations=listed,
            demand=demand,
            rows=rows,
            surroundings=Surroundings(places.candidates.position_m, of_candidates, places.reach),
            order_of_choice=tuple(range(len(listed))),
            route=_route(survey, places, listed, settings.seed, progress, keeps_order=keeps_order),
            n_scans=len(listed),
            lower_bound=fewest,
            warnings=(
                *survey.warnings,
                *scan_engine.warnings,
                *places.warnings,
                *goals.remarks,
                *remarks,
                *explain(survey, demand),
                *_blind_stations(listed, rows.seen, survey),
                *_out_of_scope(listed, survey),
            ),
            progress=progress,
        )
    return replace(plan, timings_s=clock.seconds, warnings=(*plan.warnings, *missed_in_words(plan.requirements)))


def _route(
    survey: Survey,
    places: AllowedPositions,
    stations: tuple[Station, ...],
    seed: int,
    progress: Progress,
    *,
    keeps_order: bool,
) -> Route:
    """Find the walk through the stations: the shortest whatever their order in the list, or in that order."""
    index = {floor.id: number for number, floor in enumerate(survey.floors)}
    return plan_route(
        places.reach,
        np.stack([station.position_m for station in stations]),
        np.array([station.instrument_height_m for station in stations]),
        np.array([index[station.floor] for station in stations], dtype=np.int32),
        ends=places.site.ends,
        order=np.arange(len(stations)) if keeps_order else None,
        seed=seed,
        progress=progress,
    )


def place_stations(
    tripods: Tripods, given: Sequence[GivenStation], space: FreeSpace
) -> tuple[tuple[Station, ...], tuple[str, ...]]:
    """Bring given stations to the local frame, find their floors and heights, and say what is wrong with their places.

    space : of the survey, for stations on stairs and landings.
    """
    placed = [place_prior(tripods, _as_prior(station), space) for station in given]
    stations = tuple(
        Station(
            id=place.station.id,
            floor=tripods.survey.floors[place.floor].id,
            order=order,
            position_m=place.position_m,
            instrument_height_m=place.instrument_height_m,
            fixed=True,
        )
        for order, place in enumerate(placed, start=1)
    )
    return stations, tuple(line for place in placed for line in place.remarks)


def _as_prior(given: GivenStation) -> PriorStation:
    x, y, z = np.asarray(given.position_m, dtype=np.float64).tolist()
    return PriorStation(given.id, (x, y, z), Role.SCANNED, given.floor or "", given.instrument_height_m)


def _check_list(stations: Sequence[GivenStation]) -> None:
    if not stations:
        raise StationListError("stations: the list is empty, expected at least one; check the file")
    ids = [station.id for station in stations]
    twice = sorted({name for name in ids if ids.count(name) > 1})
    if twice:
        raise StationListError(
            f"stations: the id {twice[0]!r} occurs {ids.count(twice[0])} times, expected once; rename all but one"
        )


def _blind_stations(stations: tuple[Station, ...], rows: Visibility, survey: Survey) -> tuple[str, ...]:
    """Warnings about stations that see nothing: in a wall, or with everything out of the scanner's range."""
    limits = f"{survey.template.range_min_m:g} and {survey.template.range_max_m:g} m"
    return tuple(
        f"station {station.id} sees nothing between {limits}; check its position and the scanner's ranges (metres)"
        for index, station in enumerate(stations)
        if rows.row(index).size == 0
    )


def _out_of_scope(stations: tuple[Station, ...], survey: Survey) -> tuple[str, ...]:
    """A line where stations stand outdoors in a survey of the interior, or the other way round."""
    if survey.scope is None:
        return ()
    height_m = np.array([[0.0, 0.0, station.instrument_height_m] for station in stations])
    admitted = survey.scope.admits(np.stack([station.position_m for station in stations]) - height_m)
    others = [station.id for station, inside in zip(stations, admitted.tolist(), strict=True) if not inside]
    if not others:
        return ()
    noun = "station stands" if len(others) == 1 else "stations stand"
    return (f"{len(others)} {noun} out of scope {survey.scope.kind}: {', '.join(others)}; --scope all counts all",)
