"""A room far from the origin, planned so that much of it stays unseen, as a plan folder with a building."""

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest
from made_once import MadeOnce

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import open_engine
from planner_core.model import Greedy, PlanSettings, Requirements, Scanner
from planner_core.plan_folder.face_results import face_results
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.usd_stage import write_stage
from planner_core.plan_folder.viewer_files import patches_bytes
from planner_core.plan_folder.viewer_layers import layer_files
from planner_core.planning.plan import plan_survey
from planner_core.scene.load import LoadOptions, load_scene

SCANNER = Scanner(
    name="test", title="Test scanner", source="made up", range_min_m=0.3, range_max_m=20.0, n_azimuths=90,
    elevation_rad=tuple(np.deg2rad(np.linspace(45, -60, 30))), instrument_height_min_m=1.5, instrument_height_max_m=1.5,
)  # fmt: skip
OFFSET_M = (40_300.0, 20_200.0, 50.0)


@pytest.fixture(scope="session")
def planned_room(made_once: MadeOnce) -> Path:
    """The folder `plan` beside `room.ifc`; for reading."""
    return made_once("bcf-room", plan_room)


def plan_room(folder: Path) -> None:
    room = scenes_synthetic.build("box")
    far = dataclasses.replace(room, frame=dataclasses.replace(room.frame, offset_m=OFFSET_M))
    scene = load_scene(scenes_synthetic.write(far, folder / "room.ifc"), options=LoadOptions(doors="shut"))
    settings = PlanSettings(
        scanner=SCANNER, requirements=Requirements(coverage=0.5), grid_step_m=1.0, refine=False, method=Greedy()
    )
    survey = make_survey(scene, settings)
    engine = open_engine(scene, survey.patches, engine="open3d")
    plan = plan_survey(survey, settings, engine)
    target = folder / "plan"
    write_stage(plan, face_results(plan, np.full(plan.survey.patches.n_patches, np.inf)), target)
    files = dict(layer_files(plan, engine))
    files["viewer/patches.u8"] = patches_bytes(plan.times_seen, plan.achievable)
    files["plan.json"] = plan_text(plan, target).encode()
    for name, content in files.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_bytes(content)


@pytest.fixture
def room_folder(planned_room: Path, tmp_path: Path) -> Path:
    """A copy of `planned_room` to do as one likes with."""
    return Path(shutil.copytree(planned_room, tmp_path / "room"))
