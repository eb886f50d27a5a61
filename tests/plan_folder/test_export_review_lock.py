"""A reviewer commits while the plan is being replaced: the commit waits, and is made on the plan that is there then."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Plan
from planner_core.plan_folder import folder as folder_module
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.review import changes as c
from planner_core.review.commit import Committed, Conflict
from planner_core.review.store import ReviewStore


def test_a_review_that_is_committed_while_its_plan_is_replaced_is_not_lost(
    plan: Plan, engine: ScanEngine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write_little(writer: object) -> None:  # the pictures of two whole plans take half a minute
        staging = writer._folder
        (staging / "plan.json").write_text(plan_text(plan))
        (staging / "review.usda").write_text(empty_review())

    monkeypatch.setattr(folder_module._Writer, "write", write_little)
    folder = tmp_path / "plan"
    write_plan_folder(plan, folder, engine=engine)
    outcomes: list[Committed | Conflict] = []

    def commit() -> None:
        outcomes.append(ReviewStore(folder).commit(0, [c.AddComment("do not lose me")], "Ana"))

    thread = threading.Thread(target=commit)
    carry_over = folder_module.carry_over

    def carry_over_slowly(old: Path, new: Path) -> object:
        thread.start()
        thread.join(0.3)  # long enough for a commit that does not wait
        return carry_over(old, new)

    monkeypatch.setattr(folder_module, "carry_over", carry_over_slowly)
    monkeypatch.setattr(folder_module, "_check_review", lambda _: None)  # it looked before the commit, say
    write_plan_folder(plan, folder, engine=engine, overwrite=True)
    thread.join(240)
    assert isinstance(outcomes[0], Committed)
    assert {comment.text for comment in ReviewStore(folder).current().comments.values()} == {"do not lose me"}
