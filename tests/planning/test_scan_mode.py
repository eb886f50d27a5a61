"""The scan mode, from the setting to what is written: beams or patches, and what `auto` takes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stages import visible_from
from tlsplan import summary

import scenes_synthetic
from planner_core.coverage.observations import observations_in_batches
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import AUTO_PATCHES_BEAMS, mode_that_counts_parts, scan_mode_of
from planner_core.model import Greedy, PlanSettings, Requirements, Scanner, Scene, VisibilityMode
from planner_core.plan_folder.plan_json import plan_document
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_survey
from planner_core.planning.plan import plan_survey
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template
from planner_core.scene.load import load_scene

SCHEMA = Path(__file__).resolve().parents[2] / "docs" / "formats" / "plan.schema.json"


def dome(step_deg: float) -> Scanner:
    """A scanner of every direction but a cone below."""
    return Scanner(
        name="dome",
        title="Dome",
        source="this test",
        range_min_m=0.5,
        range_max_m=30.0,
        n_azimuths=round(360 / step_deg),
        elevation_rad=tuple(np.deg2rad(np.arange(90, -60 - 1e-9, -step_deg))),
        instrument_height_min_m=1.5,
        instrument_height_max_m=1.5,
    )


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = tmp_path_factory.mktemp("rooms") / "two-rooms.ply"
    scenes_synthetic.write(scenes_synthetic.build("two-rooms"), path)
    return load_scene(path)


def settings_of(step_deg: float, mode: str) -> PlanSettings:
    return PlanSettings(
        scanner=dome(step_deg),
        requirements=Requirements(coverage=0.9),
        grid_step_m=1.0,
        scan_mode=mode,
        method=Greedy(),
    )


def test_auto_takes_patches_for_very_many_beams_alone() -> None:
    few, many = dome(1.0), dome(0.1)
    assert few.n_beams < AUTO_PATCHES_BEAMS < many.n_beams
    assert scan_mode_of("auto", make_template(few)) == "beams"
    assert scan_mode_of("auto", make_template(many)) == "patches"
    for asked in ("beams", "patches"):
        assert scan_mode_of(asked, make_template(few)) == scan_mode_of(asked, make_template(many)) == asked
    # One row has no step to compute a density by.
    fan = replace(make_template(few), azimuth_rad=np.linspace(0, 6, AUTO_PATCHES_BEAMS), elevation_rad=np.zeros(1))
    assert scan_mode_of("auto", fan) == "beams"


def test_parts_are_counted_for_all_scanners_of_rows_and_columns_unless_told() -> None:
    robot = load_scanner("hdl-64e")
    assert robot.n_beams < AUTO_PATCHES_BEAMS
    assert mode_that_counts_parts(VisibilityMode.AUTO, robot) == "patches"
    assert (
        mode_that_counts_parts(VisibilityMode.AUTO, replace(robot, elevation_rad=(0.0,), azimuth_offset_rad=()))
        == "auto"
    )
    for asked in (VisibilityMode.BEAMS, VisibilityMode.PATCHES):
        assert mode_that_counts_parts(asked, robot) == asked


@pytest.mark.slow
def test_plans_by_patches_and_by_beams_take_about_as_many_stations_and_say_which_they_are(
    scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = settings_of(0.5, "patches")
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches)
    plans = {}
    for mode in ("patches", "beams"):
        plans[mode] = plan_survey(replace(survey, scan_mode=mode), settings, engine)
        document = json.loads(json.dumps(plan_document(plans[mode])))
        assert document["settings"]["scan_mode"] == mode
        assert mode in json.loads(SCHEMA.read_text())["$defs"]["PlannedParameters"]["properties"]["scan_mode"]["enum"]
        summary.show(document)
        said = capsys.readouterr().out
        assert ("patches sampled instead of" in said) == (mode == "patches")
        assert "216,720 beams per scan" in said
    by_patches, by_beams = plans["patches"], plans["beams"]
    assert abs(len(by_patches.stations) - len(by_beams.stations)) <= 1
    # Beams count every patch whole that they meet.
    told = by_patches.coverage.achievable_area_m2 / by_beams.coverage.achievable_area_m2
    assert 0.85 < told < 1.0
    assert by_patches.coverage.fraction_of_achievable >= 0.9


@pytest.mark.slow
def test_a_given_list_is_worth_less_by_parts_of_patches_than_by_beams(scene: Scene) -> None:
    settings = settings_of(0.5, "patches")
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches)
    middle = (survey.floors[0].bounds_m.mean(axis=0), survey.floors[0].elevation_m + 1.5)
    given = [GivenStation("A", np.array([*middle[0], middle[1]]) + scene.offset_m, None, None)]
    worth = {
        mode: evaluate_survey(replace(survey, scan_mode=mode), settings, given, engine)
        for mode in VisibilityMode
        if mode != "auto"
    }
    a, b = (worth[mode].coverage for mode in ("patches", "beams"))
    # Beams count every patch whole that they meet.
    assert 0.85 * b.covered_area_m2 < a.covered_area_m2 < b.covered_area_m2
    assert a.fraction_of_achievable == pytest.approx(b.fraction_of_achievable, abs=0.03)
    at = worth["patches"].stations[0].position_m[None]
    counting = worth["patches"].survey
    own = visible_from(counting, settings, engine, at)
    assert own.patch.size > 0
    assert counting.patches.countable_share is not None
    (seen,) = observations_in_batches(counting, engine, at)
    assert counting.patches.area_m2[seen.patch].sum() == pytest.approx(worth["patches"].stations[0].covered_area_m2)
