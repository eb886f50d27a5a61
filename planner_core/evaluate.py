"""What a GIVEN station list is worth: the same figures as for a plan of our own, for stations somebody else chose.

Input a `Scene` (local frame), `PlanSettings` and stations (SCENE frame, metres), output a `Plan`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner_core.candidates.admissibility import reject
from planner_core.candidates.grid import lies_mostly_indoors
from planner_core.errors import StationListError
from planner_core.export.stations_csv import GivenStation
from planner_core.ground.places import find_places
from planner_core.ground.reach import Reach
from planner_core.model import FloatArray, Plan, PlanSettings, Route, Scene, Station, Survey, Visibility
from planner_core.progress import Progress, silent
from planner_core.requirements.demand import demand_of
from planner_core.requirements.figures import missed_in_words
from planner_core.results import Stopwatch, Surroundings, describe_plan
from planner_core.route.field_time import check_field_settings
from planner_core.route.route import ends_of, plan_route
from planner_core.scan.engine import ScanEngine, open_engine
from planner_core.select.bound import lower_bound
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem
from planner_core.survey import make_survey, planned_floors


def evaluate_stations(
    scene: Scene,
    settings: PlanSettings,
    stations: Sequence[GivenStation],
    *,
    engine: str = "auto",
    device: str | None = None,
    progress: Progress = silent,
) -> Plan:
    """Compute coverage, overlap and the rest for `stations`, in their order.

    Achievable is what the grid's candidates or the stations see. A station where no tripod can stand, or over no
    floor, is evaluated all the same, with a warning; so is a list that misses the required coverage.

    Raises
    ------
    StationListError
        No stations, or two with the same id.
    RequirementError, DeviceError, SceneError
        As for `planner_core.plan.make_plan`.
    """
    survey = make_survey(scene, settings, progress=progress)
    caster = open_engine(scene, survey.patches, engine=engine, device=device)
    return evaluate_survey(survey, settings, stations, caster, progress=progress)


def evaluate_survey(
    survey: Survey,
    settings: PlanSettings,
    stations: Sequence[GivenStation],
    caster: ScanEngine,
    *,
    progress: Progress = silent,
) -> Plan:
    """Do the rest of `evaluate_stations`, for callers that scan with the same engine afterwards."""
    _check_list(stations)
    check_field_settings(settings)
    clock = Stopwatch()
    floors = planned_floors(survey.floors, settings.requirements.floors)
    with clock.stage("candidates"):
        places = find_places(survey, settings, caster, floors=floors, progress=progress)
        placed = [place_station(survey, settings, caster, given, n) for n, given in enumerate(stations, start=1)]
    listed = [station for station, _ in placed]
    with clock.stage("scan"):
        at = np.stack([station.position_m for station in listed])
        demand = demand_of(
            survey, settings, caster, np.concatenate([places.candidates.position_m, at]), progress=progress
        )
        n_candidates = int(places.candidates.floor.size)
        of_candidates = demand.rows.take(list(range(n_candidates)))
        rows = demand.rows.take(list(range(n_candidates, n_candidates + len(listed))))
    with clock.stage("bound"):
        problem = cover_problem(demand.rows.met, demand.area_m2, demand.targets)
        # A greedy plan only guides the search for the bound.
        guide = len(select_greedy(problem, progress=progress).chosen)
        fewest = lower_bound(problem, n_stations=guide, progress=progress)
    with clock.stage("figures"):
        plan = describe_plan(
            survey,
            settings,
            caster,
            stations=tuple(listed),
            demand=demand,
            rows=rows,
            surroundings=Surroundings(places.candidates.position_m, of_candidates, places.reach),
            order_of_choice=tuple(range(len(listed))),
            route=_route(survey, settings, places.reach, listed, progress),
            n_scans=len(listed),
            lower_bound=fewest,
            warnings=(
                *survey.warnings,
                *caster.warnings,
                *places.warnings,
                *(line for _, lines in placed for line in lines),
                *_blind_stations(listed, rows.seen, survey),
            ),
            progress=progress,
        )
    return replace(plan, timings_s=clock.seconds, warnings=(*plan.warnings, *missed_in_words(plan.requirements)))


def _route(survey: Survey, settings: PlanSettings, reach: Reach, stations: list[Station], progress: Progress) -> Route:
    """Find the shortest walk through the stations, whatever their order in the list."""
    index = {floor.id: number for number, floor in enumerate(survey.floors)}
    return plan_route(
        reach,
        np.stack([station.position_m for station in stations]),
        np.array([station.instrument_height_m for station in stations]),
        np.array([index[station.floor] for station in stations], dtype=np.int32),
        ends=ends_of(settings.site, survey.scene.offset_m),
        seed=settings.seed,
        progress=progress,
    )


def place_station(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, given: GivenStation, order: int
) -> tuple[Station, tuple[str, ...]]:
    """Bring a given station to the local frame, find its floor and height, and say what is wrong with its place."""
    position = np.asarray(given.position_m, dtype=np.float64) - survey.scene.offset_m
    index, lines = _floor_of(survey, given, position)
    floor = survey.floors[index]
    ground_m = _ground_below(survey, engine, index, position)
    height_m = float(position[2] - ground_m)
    if given.instrument_height_m is not None:
        if abs(given.instrument_height_m - height_m) > 0.05:
            lines.append(
                f"station {given.id}: instrument height {given.instrument_height_m:.3f} m is given, but the sensor is "
                f"{height_m:.3f} m above the ground of {floor.name!r}"
            )
        height_m = float(given.instrument_height_m)
    indoors = lies_mostly_indoors(survey, settings, engine, floor)
    _, reasons = reject(survey, floor, settings, engine, position[None], np.array([ground_m]), mostly_covered=indoors)
    lines.extend(f"station {given.id}: no spot for a tripod on {floor.name!r} ({reason})" for reason in reasons)
    station = Station(
        id=given.id, floor=floor.id, order=order, position_m=position, instrument_height_m=height_m, fixed=True
    )
    return station, tuple(lines)


def _check_list(stations: Sequence[GivenStation]) -> None:
    if not stations:
        raise StationListError("stations: the list is empty, expected at least one; check the file")
    ids = [station.id for station in stations]
    twice = sorted({name for name in ids if ids.count(name) > 1})
    if twice:
        raise StationListError(
            f"stations: the id {twice[0]!r} is there {ids.count(twice[0])} times, expected once; rename all but one"
        )


def _floor_of(survey: Survey, given: GivenStation, position_m: FloatArray) -> tuple[int, list[str]]:
    """Index of the floor a station stands on: the one it names, else the highest one below it."""
    names = [{floor.id.casefold(), floor.name.casefold()} for floor in survey.floors]
    lines = []
    if given.floor:
        for index, known in enumerate(names):
            if given.floor.casefold() in known:
                return index, []
        there = ", ".join(f"{floor.id} ({floor.name})" for floor in survey.floors)
        lines.append(f"station {given.id}: there is no floor {given.floor!r} (there are {there}); taken by its height")
    below = [i for i, floor in enumerate(survey.floors) if floor.elevation_m <= position_m[2]]
    index = below[-1] if below else 0
    low, high = survey.floors[index].bounds_m
    if not below or (position_m[:2] < low).any() or (position_m[:2] > high).any():
        lines.append(f"station {given.id}: stands over no floor; counted for {survey.floors[index].name!r}")
    return index, lines


def _ground_below(survey: Survey, engine: ScanEngine, index: int, position_m: FloatArray) -> float:
    """Height of the floor's ground straight below a position; the floor's elevation where there is none."""
    floor = survey.floors[index]
    down = np.array([[0.0, 0.0, -1.0]])
    hits = engine.cast_rays(
        position_m[None], down, range_max_m=max(1.0, float(position_m[2] - floor.elevation_m) + 3.0)
    )
    if hits.triangle[0] >= 0 and np.isin(hits.triangle[0], floor.ground_triangles):
        return float(position_m[2] - np.float64(hits.range_m[0]))
    return floor.elevation_m


def _blind_stations(stations: list[Station], rows: Visibility, survey: Survey) -> tuple[str, ...]:
    """Warnings about stations that see nothing: in a wall, or with everything out of the scanner's range."""
    limits = f"{survey.template.range_min_m:g} and {survey.template.range_max_m:g} m"
    return tuple(
        f"station {station.id} sees nothing between {limits}; check its place and the scanner's ranges (metres)"
        for index, station in enumerate(stations)
        if rows.row(index).size == 0
    )
