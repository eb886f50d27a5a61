"""A planned house that knows where on earth it is, opened once."""

from __future__ import annotations

from pathlib import Path

import pytest
from shared_plans import SharedPlan

from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep these tests on one worker: another one would open the plan again."""
    folder = Path(__file__).parent
    for item in items:
        if folder in item.path.parents:
            item.add_marker(pytest.mark.xdist_group("as scanned"))


@pytest.fixture(scope="session")
def house_plan(house_on_map: SharedPlan) -> Path:
    """The plan folder, beside its scene file; not to be written into."""
    return house_on_map.folder


@pytest.fixture(scope="session")
def source(house_plan: Path) -> PlanSource:
    found = open_plan(house_plan)
    assert not found.frame.is_scene
    return found


@pytest.fixture(scope="session")
def live(house_plan: Path) -> LivePlan:
    return open_live(house_plan, with_ground=False)
