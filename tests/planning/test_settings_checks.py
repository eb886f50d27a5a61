"""Settings and requirements check themselves when they are made: what makes no sense is refused in one line."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from planner_core.errors import RequirementError
from planner_core.model import (
    NetworkKind,
    Objective,
    Paper,
    PartRequirement,
    PlanSettings,
    PointLimits,
    PriorStation,
    Proven,
    Requirements,
    Role,
    VisibilityMode,
)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"grid_step_m": 0.0}, "grid_step_m: got 0, expected more than 0"),
        ({"max_patch_area_m2": float("nan")}, "max_patch_area_m2: got nan, expected more than 0"),
        ({"clearance_m": -0.1}, "clearance_m: got -0.1, expected 0 or more"),
        ({"n_ground_ring_rays": 0}, "n_ground_ring_rays: got 0, expected at least 1"),
        (
            {"instrument_heights_m": (1.5, 160.0)},
            "instrument height: got 160 m, expected more than 0 and at most 100 m",
        ),
        ({"scan_mode": "rays"}, "scan_mode: got 'rays', expected one of auto, beams, patches"),
        ({"method": "best"}, "method: got 'best', expected one of Greedy(), Proven(), Paper()"),
    ],
)
def test_figures_and_words_of_a_plan_are_checked(small: PlanSettings, change: dict[str, Any], message: str) -> None:
    with pytest.raises(RequirementError) as refused:
        replace(small, **change)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_noise_is_limited_for_scanners_alone_that_tell_theirs(small: PlanSettings) -> None:
    silent = replace(small, scanner=replace(small.scanner, range_noise=()))
    walls = PartRequirement("walls", classes=("IfcWall*",), limits=PointLimits(noise_m=0.002))
    for asked in (Requirements(limits=PointLimits(noise_m=0.002)), Requirements(parts=(walls,))):
        with pytest.raises(RequirementError, match=r"noise: got a limit with scanner .*, expected one with a table"):
            replace(silent, requirements=asked)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Requirements(coverage=0.0), "coverage: got 0, expected a fraction above 0 and at most 1"),
        (lambda: Requirements(coverage=95.0), "coverage: got 95, expected"),
        (lambda: Requirements(overlap=float("nan")), "overlap: got nan, expected a fraction from 0 to 1"),
        (lambda: Requirements(network="star"), "network: got 'star', expected one of"),
        (
            lambda: Requirements(overlap_measure="dice"),
            "overlap_measure: got 'dice', expected one of smaller-share, jac",
        ),
        (lambda: Requirements(overlap_of="all"), "overlap_of: got 'all', expected one of all-seen, seen-as-required"),
        (lambda: PriorStation("A", (0, 0, 1), "fixed"), "role: got 'fixed', expected one of scanned, locked, kept"),
    ],
)
def test_requirements_and_settled_stations_are_checked(make: Callable[[], object], message: str) -> None:
    with pytest.raises(RequirementError) as refused:
        make()
    assert message in str(refused.value)


def test_words_become_members_and_what_is_not_said_is_as_on_the_command_line(small: PlanSettings) -> None:
    told = replace(small, objective="time", seconds_per_scan=60.0, scan_mode="beams")
    assert told.objective is Objective.TIME
    assert told.scan_mode is VisibilityMode.BEAMS
    assert PriorStation("A", (0, 0, 1), "kept").role is Role.KEPT
    assert Requirements(network="redundant").network is NetworkKind.REDUNDANT
    earlier = [Requirements(network=word).network for word in ("joined", "loops")]
    assert earlier == [NetworkKind.CONNECTED, NetworkKind.REDUNDANT]
    assert PlanSettings(small.scanner).method == Proven()


@pytest.mark.parametrize("measured", [{"overlap_measure": "jaccard"}, {"overlap_of": "seen-as-required"}])
def test_method_paper_measures_by_circles_alone(small: PlanSettings, measured: dict[str, str]) -> None:
    with pytest.raises(
        RequirementError, match=r"overlap: got the measure .* with method paper, .* by circles"
    ) as refused:
        replace(small, method=Paper(), requirements=Requirements(**measured))  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)
    assert replace(small, method=Paper()).requirements.overlap_measure == "smaller-share"
