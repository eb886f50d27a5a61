"""Missions of the house of robot_house.py: near the scene's origin, and on UTM coordinates of its own."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from planner_core.export.options import Options
from planner_core.export.robot import write_robot
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import silent

# Tests of this folder share robot_house.py; importlib's import mode puts no folder on the path.
_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import robot_house as house
finally:
    sys.path.remove(_FOLDER)


@pytest.hookimpl(tryfirst=True)  # before xdist asks for groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests of the same things on one worker, so that the house is planned once, and scenes are loaded once."""
    groups = {"test_ledges.py": None, "test_robot_scenes.py": "robot scenes"}
    for item in items:
        group = groups.get(item.path.name, "robot house")
        if item.path.parent == Path(__file__).parent and group is not None:
            item.add_marker(pytest.mark.xdist_group(group))


@pytest.fixture(scope="session")
def house_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return house.write_plan(tmp_path_factory.mktemp("robot"))


@pytest.fixture(scope="session")
def house_plan(house_folder: Path) -> PlanSource:
    return open_plan(house_folder)


@pytest.fixture(scope="session")
def far_plan(tmp_path_factory: pytest.TempPathFactory) -> PlanSource:
    """The same house, drawn at UTM coordinates."""
    return open_plan(house.write_plan(tmp_path_factory.mktemp("far"), (691000.0, 5334000.0, 500.0)))


Mission = Callable[..., tuple[Path, tuple[str, ...]]]


@pytest.fixture(scope="session")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Mission:
    """Call with a plan and options; returns the folder and the remarks, of before where it was asked for before."""
    before: dict[tuple[int, Options], tuple[Path, tuple[str, ...]]] = {}
    kept: list[PlanSource] = []  # so that no other plan gets the id of one

    def run(plan: PlanSource, *, again: bool = False, **options: object) -> tuple[Path, tuple[str, ...]]:
        key = (id(plan), Options(**options))  # type: ignore[arg-type]
        if again or key not in before:
            folder = tmp_path_factory.mktemp("mission")
            before[key] = folder, write_robot(plan, folder, key[1], silent)
            kept.append(plan)
        return before[key]

    return run
