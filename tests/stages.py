"""Stages of planning for tests: from a survey, settings and an engine; what a plan resolves once is resolved here.

A survey made for other settings, or by hand, looks around, and plans the floors, as these say.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from planner_core.coverage import survey as surveys
from planner_core.engine.patch_mode import scan_mode_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    Candidates,
    FloatArray,
    Floor,
    Int64Array,
    Paper,
    PlanSettings,
    Proven,
    Survey,
    Visibility,
)
from planner_core.planning import pool as pools
from planner_core.positions import allowed_positions, candidates
from planner_core.positions.admissibility import Tripods, TripodTests
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.positions.local_site import local_site
from planner_core.requirements import demand as demands
from planner_core.requirements.demand import Demand
from planner_core.requirements.goals import Goals
from planner_core.requirements.goals import goals_of as goals_of_requirements
from planner_core.requirements.observe_candidates import CandidateObservations, SeenPatches, observe_candidates

_Floors = tuple[int, ...] | None


def surveyed_as(survey: Survey, settings: PlanSettings, floors: _Floors = None) -> Survey:
    """The survey as `make_survey` would make it with these settings; floors : indices, None: as required."""
    wanted = settings.requirements.floors
    return replace(
        survey,
        scanner=settings.scanner,
        scan_mode=scan_mode_of(settings.scan_mode, survey.template),
        planned=surveys.planned_floors(survey.floors, wanted) if floors is None else floors,
        reflectivity=settings.requirements.reflectivity,
        as_in_paper=survey.as_in_paper or isinstance(settings.method, Paper),
    )


def tripods_of(survey: Survey, settings: PlanSettings, engine: ScanEngine, floors: _Floors = None) -> Tripods:
    return Tripods(surveyed_as(survey, settings, floors), settings, engine)


def find_candidates(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, *, floors: _Floors = None, **options: Any
) -> Candidates:
    return candidates.find_candidates(tripods_of(survey, settings, engine, floors), **options)


def find_positions(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, *, floors: _Floors = None, **options: Any
) -> AllowedPositions:
    tripods, site = tripods_of(survey, settings, engine, floors), local_site(survey, settings.site)
    return allowed_positions.find_positions(tripods, site, **options)


def goals_of(survey: Survey, settings: PlanSettings) -> Goals:
    return goals_of_requirements(surveyed_as(survey, settings), settings.requirements)


def visible_from(survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray) -> Visibility:
    return surveys.visible_from(surveyed_as(survey, settings), engine, positions_m)


def observed_from(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray
) -> CandidateObservations:
    return observe_candidates(surveyed_as(survey, settings), engine, positions_m, goals_of(survey, settings))


def demand_of(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, **options: Any
) -> Demand:
    goals = goals_of(survey, settings)
    return demands.demand_of(surveyed_as(survey, settings), goals, engine, positions_m, **options)


def rows_from(
    survey: Survey, settings: PlanSettings, engine: ScanEngine, positions_m: FloatArray, demand: Demand
) -> SeenPatches:
    return demands.rows_from(surveyed_as(survey, settings), engine, positions_m, demand)


def make_pool(
    survey: Survey,
    settings: PlanSettings,
    engine: ScanEngine,
    candidates: Candidates,
    *,
    given: Int64Array,
    kept: Int64Array,
) -> pools.Pool:
    goals, linked = goals_of(survey, settings), isinstance(settings.method, Proven)
    made = surveyed_as(survey, settings)
    return pools.make_pool(made, goals, engine, candidates, given=given, kept=kept, linked=linked)


def tripod_tests(survey: Survey, settings: PlanSettings, engine: ScanEngine, floor: Floor) -> TripodTests:
    return TripodTests(tripods_of(survey, settings, engine), floor)
