"""Plan folders of small scenes, written once and opened once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from shared_plans import SETTINGS, SharedPlan

import scenes_synthetic
from planner_core.model import PartRequirement, Plan, PlanSettings, PointLimits, Requirements
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.planning.plan import make_plan
from planner_core.scene.load import load_scene
from scenes_synthetic.model import FileFrame, SyntheticScene

#: Limits of all, a class with limits of its own, and a part that two stations must see; by beams.
ASKING = replace(
    SETTINGS["house"],
    refine=False,
    scan_mode="beams",
    requirements=Requirements(
        coverage=0.7,
        limits=PointLimits(range_m=9.0, incidence_rad=1.3),
        parts=(
            PartRequirement("walls", 0.5, PointLimits(spacing_m=0.05), classes=("IfcWall*",)),
            PartRequirement("twice", 0.3, seen_from=2, heights_m=(0.0, 2.0)),
        ),
    ),
)
FAR = replace(SETTINGS["house"], scanner=replace(SETTINGS["house"].scanner, n_azimuths=360), scan_mode="beams")


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep these tests on one worker: another one would make the same plans again."""
    folder = Path(__file__).parent
    for item in items:
        if folder in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("live"))


def far_rooms() -> SyntheticScene:
    """Two rooms, five thousand kilometres from the origin; `scene` is local, as it is after loading."""
    rooms, far_m = scenes_synthetic.build("two-rooms"), (500_000.0, 5_400_000.0, 0.0)
    return replace(rooms, scene=replace(rooms.scene, offset_m=np.array(far_m)), frame=FileFrame(offset_m=far_m))


@cache
def made(folder: Path, scene: str, settings: PlanSettings) -> tuple[Path, Plan]:
    file = folder / f"{scene}.ifc"
    if not file.exists():
        scenes_synthetic.write(far_rooms() if scene == "far" else scenes_synthetic.build(scene), file)
    plan = make_plan(load_scene(file), settings)
    out = folder / f"{scene}-{len(list(folder.iterdir()))}"
    write_plan_folder(plan, out, pictures=False)
    return out, plan


@pytest.fixture(scope="session")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, PlanSettings], tuple[Path, Plan]]:
    """Folder and plan of a scene by name; a plan asked for again is not made again."""
    scratch = tmp_path_factory.mktemp("live")
    return lambda scene, settings: made(scratch, scene, settings)


@pytest.fixture(scope="session")
def house(house_plan: SharedPlan) -> LivePlan:
    return open_live(house_plan.folder)


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
def far(planned: Callable[[str, PlanSettings], tuple[Path, Plan]]) -> tuple[Path, Plan]:
    return planned("far", FAR)


@pytest.fixture(scope="session")
def far_plan(far: tuple[Path, Plan]) -> LivePlan:
    return open_live(far[0])
