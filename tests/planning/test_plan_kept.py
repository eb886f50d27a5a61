"""Plans of results that are kept: the same to the byte, and what nothing has changed about is not done again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import scenes_synthetic
from planner_core import kept
from planner_core.engine.patch_mode import PatchMode
from planner_core.model import PlanSettings, PointLimits, PriorStation, Requirements, Role, Site
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document
from planner_core.planning.plan import make_plan
from planner_core.scanner.load_scanner import load_scanner


@pytest.fixture
def planned(small: PlanSettings, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[str, int]]:
    """Plan a room with some settings changed: plan.json without what two runs differ in, and how often it was looked
    from a position.
    """
    scene, n_looks, see = scenes_synthetic.build("box").scene, [0], PatchMode.see

    def counted(self: Any, template: Any, positions_m: Any, **options: Any) -> Any:
        n_looks[0] += len(positions_m)
        return see(self, template, positions_m, **options)

    monkeypatch.setattr(PatchMode, "see", counted)

    def made(**changed: Any) -> tuple[str, int]:
        n_looks[0] = 0
        # Other stations are looked around from anew, candidates are not.
        tolerance_m = 0.0 if changed else small.set_up_tolerance_m
        settings = replace(small, scanner=load_scanner("rtc360"), scan_mode="patches", **changed)
        settings = replace(settings, set_up_tolerance_m=tolerance_m)
        document = plan_document(make_plan(scene, settings, verify_points=200))
        return json.dumps({key: value for key, value in document.items() if key not in DROPPABLE_KEYS}), n_looks[0]

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
    planned: Callable[..., tuple[str, int]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    without, n_all = planned(**CHANGES[change])
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path))
    monkeypatch.setenv("TLSPLAN_CACHE_SIZE", "100MB")
    monkeypatch.setattr(kept, "_LONGEST_S", float("inf"))  # however slow the disk is
    _, n_first = planned()
    document, n_looks = planned(**CHANGES[change])
    assert document == without
    assert n_first > 0
    assert n_all > 10
    assert n_looks == (1 if change == "a locked station" else 0)
