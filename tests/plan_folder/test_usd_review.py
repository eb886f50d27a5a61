"""A whole plan folder with a review in it: its stage is valid, and shows what reviewers changed."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import pytest
from pxr import Usd, UsdGeom, UsdValidation

from planner_core.model import ForbiddenPlace, Plan, Zone
from planner_core.model.site import GroundPick
from planner_core.review import changes as c
from planner_core.review.commit import Committed
from planner_core.review.store import ReviewStore


def files_of_plan(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "review.usda"
    }


@pytest.fixture
def reviewed(plan: Plan, plan_folder: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "plan"
    shutil.copytree(plan_folder, folder)
    x, y, z = plan.survey.scene.offset_m
    outline = ((x + 1.0, y + 1.0), (x + 3.0, y + 1.0), (x + 3.0, y + 3.0))
    outcome = ReviewStore(folder).commit(
        0,
        [
            c.MoveStation("S001", (x + 2.5, y + 2.25, z + 1.5)),
            c.RemoveStation("S002"),
            c.AddStation((x + 6.5, y + 1.0, z + 4.3), "F1", 1.5),
            c.AddZone(Zone("", "priority", outline, "F0", "hall", 0.98)),
            c.Forbid(ForbiddenPlace("", (x + 1.0, y + 1.0, z))),
            c.PickGround(GroundPick((x + 1.0, y + 1.0, z + 2.8), floor="F1")),
            c.AddComment("Look", "S001", (x + 2.5, y + 2.25, z + 1.5)),
            c.SetVerdict("S003", "accepted"),
            c.Sign("go"),
        ],
        "Ana",
    )
    assert isinstance(outcome, Committed)
    return folder


def test_a_reviewed_plan_has_no_validation_errors(reviewed: Path) -> None:
    stage = Usd.Stage.Open(str(reviewed / "plan.usda"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [f"{error.GetName()}: {error.GetMessage()}" for error in errors] == []
    assert list(stage.GetCompositionErrors()) == []


def test_a_reviewed_plan_shows_stations_where_reviewers_put_them(reviewed: Path) -> None:
    stage = Usd.Stage.Open(str(reviewed / "plan.usda"))
    shown = {}
    for prim in stage.GetPrimAtPath("/Plan/Stations").GetChildren():  # active ones
        matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        shown[prim.GetName()] = tuple(round(value, 6) for value in matrix.ExtractTranslation())
    assert shown == {"S001": (2.5, 2.25, 1.5), "S003": (3.0, 1.5, 4.4), "S004": (6.5, 1.0, 4.3)}
    hidden = ("/Plan/Stations/S001/Cloud", "/Plan/Links/Link_0", "/Plan/Routes/F0")
    assert [stage.GetPrimAtPath(path).IsActive() for path in hidden] == [False] * 3
    assert stage.GetPrimAtPath("/Plan/Stations/S003/Cloud").IsActive()


def test_a_review_changes_no_other_file_of_the_plan(reviewed: Path, plan_folder: Path) -> None:
    assert files_of_plan(reviewed) == files_of_plan(plan_folder)
