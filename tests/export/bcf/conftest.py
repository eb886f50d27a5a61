"""A room far from the origin, planned so that much of it stays unseen, as a plan folder with a building."""

import dataclasses
import shutil
from pathlib import Path

import pytest
from made_once import MadeOnce
from shared_plans import SETTINGS

import scenes_synthetic
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning.plan import make_plan
from planner_core.scene.load import load_scene

OFFSET_M = (40_300.0, 20_200.0, 50.0)


@pytest.fixture(scope="session")
def planned_room(made_once: MadeOnce) -> Path:
    """The folder `plan` beside `room.ifc`; for reading."""
    return made_once("bcf-room", plan_room)


def plan_room(folder: Path) -> None:
    room = scenes_synthetic.build("box")
    far = dataclasses.replace(room, frame=dataclasses.replace(room.frame, offset_m=OFFSET_M))
    scene = load_scene(scenes_synthetic.write(far, folder / "room.ifc"))
    write_plan_folder(make_plan(scene, SETTINGS["box"], engine="open3d"), folder / "plan", pictures=False)


@pytest.fixture
def room_folder(planned_room: Path, tmp_path: Path) -> Path:
    """A copy of `planned_room`, which the test may change."""
    return Path(shutil.copytree(planned_room, tmp_path / "room"))
