"""Figures of a draft: those of plan.json for the plan as it is, those of an evaluation for any other stations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from planner_core.export.plan_json import plan_document
from planner_core.live.live_plan import LivePlan
from planner_core.live.opening import open_live
from planner_core.model import Plan, PlanSettings

Planned = Callable[[str, PlanSettings], tuple[Path, Plan]]


def close(found: Any, expected: Any, *, where: str = "") -> None:
    """Assert that two documents are the same but for rounding of figures."""
    assert type(found) is type(expected) or isinstance(found, int | float), where
    if isinstance(expected, dict):
        assert list(found) == list(expected), where
        for key, value in expected.items():
            close(found[key], value, where=f"{where}/{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for index, value in enumerate(expected):
            close(found[index], value, where=f"{where}/{index}")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, abs=2e-6), where
    else:
        assert found == expected, where


def assert_figures_are_of(live: LivePlan, document: dict[str, Any]) -> None:
    figures = live.figures(live.draft)
    found = plan_document(figures.plan)
    for key in ("coverage", "stations", "registration", "unseen"):
        close(found[key], document[key], where=key)
    close(found["requirements"]["results"], document["requirements"]["results"], where="results")
    assert [step.station for step in figures.curve] == [step["station"] for step in document["why"]["curve"]]
    close(
        [step.covered_area_m2 for step in figures.curve],
        [step["covered_area_m2"] for step in document["why"]["curve"]],
        where="curve",
    )


@pytest.mark.parametrize("scene", ["house", "georeferenced"])
def test_figures_of_the_unchanged_plan_are_those_of_plan_json(
    scene: str, planned: Planned, small: PlanSettings
) -> None:
    folder, _ = planned(scene, small)
    live = open_live(folder)
    assert len(live.draft.stations) > 3
    assert_figures_are_of(live, live.document)
