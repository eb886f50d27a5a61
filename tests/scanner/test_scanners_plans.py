"""Plans with the survey scanners, in patch mode: `auto` takes it for them, and their blind cones show on the floor."""

import math
from dataclasses import replace

import numpy as np
import pytest
from slow_cases import all_slow_but
from stages import visible_from

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Greedy, PlanSettings, Requirements, Scene
from planner_core.planning.plan import plan_survey
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

SURVEY_SCANNERS = ("rtc360", "blk360-g2", "p50", "vz-400i", "imager-5016")
HEIGHT_M = 1.5


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = tmp_path_factory.mktemp("rooms") / "box.obj"
    scenes_synthetic.write(scenes_synthetic.build("box"), path)
    return load_scene(path)


def settings_of(name: str, *, patch_m2: float = 0.1) -> PlanSettings:
    return PlanSettings(
        scanner=load_scanner(name),
        requirements=Requirements(coverage=0.9),
        grid_step_m=1.5,
        instrument_heights_m=(HEIGHT_M,),
        max_patch_area_m2=patch_m2,
        method=Greedy(),
    )


@pytest.mark.parametrize("name", all_slow_but(["rtc360"], SURVEY_SCANNERS))
def test_a_survey_scanner_plans_a_room_in_its_default_mode(name: str, scene: Scene) -> None:
    settings = settings_of(name)
    survey = make_survey(scene, settings)
    assert survey.scan_mode == "patches"
    plan = plan_survey(survey, settings, open_engine(scene, survey.patches))
    assert plan.stations
    assert plan.coverage.meets(0.9)


@pytest.mark.parametrize(("name", "below_deg"), [("rtc360", 60.0), ("blk360-g2", 45.0), ("imager-5016", 70.0)])
def test_the_floor_is_blind_below_the_lowest_beam(name: str, below_deg: float, scene: Scene) -> None:
    """A disc of radius height / tan(lowest beam): what one without a blind cone sees of the floor, and this not."""
    patch_m2 = 0.005
    settings = settings_of(name, patch_m2=patch_m2)
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches)
    floor = survey.floors[0]
    middle = np.append(floor.bounds_m.mean(axis=0), floor.elevation_m + HEIGHT_M)[None]
    all_round = replace(survey.template, elevation_rad=np.deg2rad(np.linspace(90.0, -90.0, 5001)))
    cone = visible_from(survey, settings, engine, middle).row(0)
    sphere = visible_from(replace(survey, template=all_round), settings, engine, middle).row(0)
    blind = np.setdiff1d(sphere, cone)
    assert np.isin(survey.patches.triangle_of_patch[blind], floor.ground_triangles).all()
    radius_m = HEIGHT_M / math.tan(math.radians(below_deg))
    rim_m2 = 2 * math.pi * radius_m * math.sqrt(patch_m2)  # patches that the rim cuts may count either way
    assert survey.patches.area_m2[blind].sum() == pytest.approx(math.pi * radius_m**2, abs=rim_m2)
