"""Selection on a real floor: fewer stations than greedy selection, proven, and checked down to patches."""

from dataclasses import replace

import pytest
from oracles import floor_constraints
from stages import find_candidates, visible_from

from planner_core.coverage.coverage import floor_of_patch, planned_floors, scope_of
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import PlanSettings, Proven
from planner_core.scanner.load_scanner import load_scanner
from planner_core.select.check import check_coverage
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import cover_problem
from planner_core.select.proven import select


@pytest.mark.slow
def test_upper_floor_of_duplex_is_planned_with_fewer_stations_than_greedy_takes_and_proven(real_scene):
    scene = replace(real_scene("duplex"), optics_of_triangle=None)
    scanner = replace(load_scanner("hdl-64e"), range_max_m=5.0)
    settings = PlanSettings(scanner=scanner, instrument_heights_m=(1.5,), grid_step_m=0.6)
    survey = make_survey(scene, settings)
    floors = planned_floors(survey.floors, ("Level 2",))
    engine = open_engine(scene, survey.patches)
    candidates = find_candidates(survey, settings, engine, floors=floors)
    visibility = visible_from(survey, settings, engine, candidates.position_m)
    of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
    constraints = floor_constraints(of_patch, floors, scope_of(of_patch, floors, len(survey.floors)), 0.95)
    problem = cover_problem(visibility, survey.patches.area_m2, constraints)
    result = select(problem, Proven(work_limit=5.0))
    check_coverage(visibility, survey.patches.area_m2, constraints, result.chosen)
    assert result.proven
    assert len(result.chosen) < len(select_greedy(problem).chosen) == result.n_greedy
