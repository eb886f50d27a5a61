"""Method `proven` in the whole flow: never more stations than greedy, a bound that says so, options checked first."""

from dataclasses import replace

import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import Greedy, PlanSettings, Proven, Requirements
from planner_core.model.options import method_of
from planner_core.plan_folder.plan_json import plan_document
from planner_core.planning.plan import plan_survey
from planner_core.scanner.load_scanner import load_scanner

SETTINGS = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=360),
    requirements=Requirements(coverage=0.9, network="none"),
    grid_step_m=1.0,
    instrument_heights_m=(1.0, 1.5),
    max_patch_area_m2=0.1,
    method=Greedy(),
)
PROVEN = replace(SETTINGS, method=Proven(work_limit=2), refine=False)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["two-rooms", pytest.param("corridor-comb", marks=pytest.mark.campaign)])
def test_proven_plans_need_no_more_stations_than_greedy_ones_and_say_how_few_can_do(scene: str) -> None:
    survey = make_survey(scenes_synthetic.build(scene).scene, SETTINGS)
    engine = open_engine(survey.scene, survey.patches)
    greedy, proven = (plan_survey(survey, settings, engine) for settings in (SETTINGS, PROVEN))
    assert len(proven.stations) <= len(greedy.stations)
    assert 0 < greedy.lower_bound <= len(proven.stations)
    assert 0 < proven.lower_bound <= len(proven.stations)
    assert proven.coverage.meets(0.9)
    optimality = plan_document(proven)["optimality"]
    assert optimality["proven"] == (proven.lower_bound == len(proven.stations))
    assert optimality["why_stopped"] == proven.why_stopped in ("proven", "work limit")
    assert plan_document(greedy)["optimality"]["why_stopped"] == ""


def test_options_of_the_proven_method_are_checked_as_they_are_read() -> None:
    with pytest.raises(RequirementError, match="work limit: got -1"):
        method_of("proven", [("work_limit", "-1")])


def test_the_search_has_the_plans_seed_unless_it_has_one_of_its_own() -> None:
    seeded = replace(PROVEN, seed=5)
    assert seeded.seeded_method == Proven(work_limit=2, seed=5)
    assert replace(seeded, method=Proven(seed=0)).seeded_method == Proven(seed=0)
