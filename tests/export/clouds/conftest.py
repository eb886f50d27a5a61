"""A plan of a room, in site coordinates and in those of the scene; see cloud_room.py."""

import sys
from pathlib import Path

import pytest
from made_once import MadeOnce

from planner_core.plan_folder.plan_source import PlanSource, open_plan

# Tests of this folder share cloud_room.py; importlib's import mode puts no folder on the path.
_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    from cloud_room import FRAME, write_plan
finally:
    sys.path.remove(_FOLDER)


@pytest.fixture(scope="session")
def plan_folder(made_once: MadeOnce) -> Path:
    return made_once("clouds", write_plan) / "plan"


@pytest.fixture(scope="session")
def source(plan_folder: Path) -> PlanSource:
    """In site coordinates."""
    return open_plan(plan_folder, frame=FRAME)


@pytest.fixture(scope="session")
def scene_source(plan_folder: Path) -> PlanSource:
    """In scene coordinates."""
    return open_plan(plan_folder)
