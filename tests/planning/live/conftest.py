"""Plan folders of small scenes, written once and opened once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import open_engine
from planner_core.model import PartRequirement, Plan, PlanSettings, PointLimits, Proven, Requirements
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.viewer_files import patches_bytes
from planner_core.plan_folder.viewer_layers import layer_files
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.planning.plan import plan_survey
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

SMALL = PlanSettings(
    scanner=replace(load_scanner("hdl-64e"), n_azimuths=720),
    requirements=Requirements(coverage=0.8),
    grid_step_m=1.0,
    instrument_heights_m=(1.5,),
    max_patch_area_m2=0.2,
    method=Proven(work_limit=0.1),
    refine=True,
)
#: Limits of all, a class with limits of its own, and a part that two stations must see.
ASKING = replace(
    SMALL,
    refine=False,
    requirements=Requirements(
        coverage=0.7,
        asked=PointLimits(range_m=9.0, incidence_rad=1.3),
        parts=(
            PartRequirement("walls", 0.5, PointLimits(spacing_m=0.05), classes=("IfcWall*",)),
            PartRequirement("twice", 0.3, seen_from=2, heights_m=(0.0, 2.0)),
        ),
    ),
)


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep these tests on one worker: another one would make the same plans again."""
    folder = Path(__file__).parent
    for item in items:
        if folder in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("live"))


@cache
def made(folder: Path, scene: str, settings: PlanSettings) -> tuple[Path, Plan]:
    """Plan a synthetic scene and write what live editing reads of a plan folder: scans and pictures take long."""
    file = folder / f"{scene}.ifc"
    if not file.exists():
        scenes_synthetic.write(scenes_synthetic.build(scene), file)
    loaded = load_scene(file)
    survey = make_survey(loaded, settings)
    engine = open_engine(loaded, survey.patches)
    plan = plan_survey(survey, settings, engine)
    out = folder / f"{scene}-{len(list(folder.iterdir()))}"
    for name, content in (
        ("plan.json", plan_text(plan).encode()),
        ("viewer/patches.u8", patches_bytes(plan.times_seen, plan.achievable)),
        *layer_files(plan, engine),
    ):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(content)
    return out, plan


@pytest.fixture(scope="session")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="session")
def planned(scratch: Path) -> Callable[[str, PlanSettings], tuple[Path, Plan]]:
    """Folder and plan of a scene by name; a plan asked for again is not made again."""
    return lambda scene, settings: made(scratch, scene, settings)


@pytest.fixture(scope="session")
def house_folder(planned: Callable[[str, PlanSettings], tuple[Path, Plan]]) -> Path:
    return planned("house", SMALL)[0]


@pytest.fixture(scope="session")
def house(house_folder: Path) -> LivePlan:
    return open_live(house_folder)


@pytest.fixture(scope="session")
def small() -> PlanSettings:
    return SMALL


@pytest.fixture(scope="session")
def asking() -> PlanSettings:
    return ASKING


@pytest.fixture(scope="session")
def asking_folder(planned: Callable[[str, PlanSettings], tuple[Path, Plan]]) -> Path:
    return planned("house", ASKING)[0]


@pytest.fixture(scope="session")
def asking_house(asking_folder: Path) -> LivePlan:
    return open_live(asking_folder)


@pytest.fixture(scope="session")
def far_folder(planned: Callable[[str, PlanSettings], tuple[Path, Plan]]) -> Path:
    """The house half a thousand kilometres from the origin."""
    return planned("georeferenced", SMALL)[0]


@pytest.fixture(scope="session")
def far_house(far_folder: Path) -> LivePlan:
    return open_live(far_folder)
