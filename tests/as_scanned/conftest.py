"""A planned house that knows where on earth it is, opened once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import open_engine
from planner_core.model import PartRequirement, PlanSettings, Proven, Requirements
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.plan_folder.stations_csv import stations_csv
from planner_core.plan_folder.viewer_files import patches_bytes
from planner_core.plan_folder.viewer_layers import layer_files
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.planning.plan import plan_survey
from planner_core.requirements.goals import NO_COVER
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

SETTINGS = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=720),
    requirements=Requirements(
        coverage=0.8, network="none", parts=(PartRequirement(NO_COVER[0], coverage=0.0, classes=NO_COVER),)
    ),
    grid_step_m=1.0,
    instrument_heights_m=(1.5,),
    max_patch_area_m2=0.2,
    method=Proven(work_limit=0.1),
    refine=False,
)


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep these tests on one worker: another one would make the same plan again."""
    folder = Path(__file__).parent
    for item in items:
        if folder in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("as scanned"))


@pytest.fixture(scope="session")
def house_plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plan folder, as far as comparing reads it, beside its scene file; not to be written into."""
    folder = tmp_path_factory.mktemp("as_scanned")
    file = scenes_synthetic.write(scenes_synthetic.on_map(scenes_synthetic.build("house")), folder / "house.ifc")
    loaded = load_scene(file)
    survey = make_survey(loaded, SETTINGS)
    engine = open_engine(loaded, survey.patches)
    plan = plan_survey(survey, SETTINGS, engine)
    for name, content in (
        ("plan.json", plan_text(plan, folder / "plan").encode()),
        ("stations.csv", stations_csv(plan).encode()),
        ("viewer/patches.u8", patches_bytes(plan.times_seen, plan.achievable)),
        *layer_files(plan, engine),
    ):
        path = folder / "plan" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / "plan"


@pytest.fixture(scope="session")
def source(house_plan: Path) -> PlanSource:
    found = open_plan(house_plan)
    assert not found.frame.is_scene
    return found


@pytest.fixture(scope="session")
def live(house_plan: Path) -> LivePlan:
    return open_live(house_plan, with_ground=False)
