"""Plans of results that are kept: the same to the byte, and what nothing has changed about is not done again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenes_synthetic
from planner_core import kept
from planner_core.engine.patch_mode import PatchMode
from planner_core.model import PlanSettings, PointLimits, PriorStation, Requirements, Role, Site
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner

Planned = Callable[..., tuple[str, set[bytes]]]


@pytest.fixture
def planned(small: PlanSettings, monkeypatch: pytest.MonkeyPatch) -> Planned:
    """Plan a room with some settings changed: plan.json without what two runs differ in, and positions looked from."""
    scene, see = scenes_synthetic.build("box").scene, PatchMode.see
    looks: set[bytes] = set()

    def noted(self: Any, template: Any, positions_m: Any, **options: Any) -> Any:
        looks.update(position_m.tobytes() for position_m in np.asarray(positions_m))
        return see(self, template, positions_m, **options)

    monkeypatch.setattr(PatchMode, "see", noted)

    def made(**changed: Any) -> tuple[str, set[bytes]]:
        looks.clear()
        settings = replace(small, scanner=load_scanner("rtc360"), scan_mode="patches", **changed)
        document = plan_document(make_plan(scene, settings, verify_points=200))
        return json.dumps({key: value for key, value in document.items() if key not in DROPPABLE_KEYS}), set(looks)

    return made


CHANGES: dict[str, dict[str, Any]] = {
    "nothing": {},
    "less coverage": {"requirements": Requirements(coverage=0.6)},
    "less range": {"requirements": Requirements(coverage=0.9, limits=PointLimits(range_m=4.0))},
    "a locked station": {"site": Site(prior=(PriorStation("L1", (1.2, 1.1, 1.5), Role.LOCKED),))},
}


@pytest.mark.parametrize(
    "change",
    ["less coverage", *(pytest.param(each, marks=pytest.mark.slow) for each in CHANGES if each != "less coverage")],
)
def test_a_plan_from_what_is_kept_is_the_same_as_without(
    planned: Planned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    without, all_looks = planned(**CHANGES[change])
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path))
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", "100MB")
    monkeypatch.setattr(kept, "_LONGEST_S", float("inf"))  # however slow the disk is
    _, first_looks = planned()
    document, looks = planned(**CHANGES[change])
    assert document == without
    # Candidates stay where they are; around other stations it is looked for the first time.
    assert len(all_looks & first_looks) > 10
    assert looks == all_looks - first_looks
