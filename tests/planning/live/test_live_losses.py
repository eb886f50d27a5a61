"""What requirements would lose with a station: what the plan's own evaluation says when the station is left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import observations_from
from stages import goals_of

from planner_core.coverage.observations import with_noise
from planner_core.engine.open_engine import open_engine
from planner_core.model import PartRequirement, Plan, PlanSettings, PointLimits, Requirements
from planner_core.plan_folder.plan_json import plan_document
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live

Planned = Callable[[str, PlanSettings], tuple[Path, Plan]]
#: Within 9 m, dull surfaces the noisier: of what sends back 0.1 to 1.
NOISE = tuple((range_m, rho, 0.002 + 0.0005 * range_m - 0.001 * rho) for rho in (0.1, 1.0) for range_m in (0.3, 9.0))


@pytest.fixture(scope="module")
def noisy(asking: PlanSettings) -> PlanSettings:
    """Spacing asked of all, noise of walls, and two stations for what is low; the plan takes whatever it needs."""
    return replace(
        asking,
        scanner=replace(asking.scanner, range_noise=NOISE),
        max_patch_area_m2=0.1,
        requirements=Requirements(
            coverage=0.6,
            limits=PointLimits(spacing_m=0.06),
            parts=(
                PartRequirement("quiet walls", 0.4, PointLimits(noise_m=0.003), classes=("IfcWall*",)),
                PartRequirement("twice", 0.3, seen_from=2, heights_m=(0.0, 2.0)),
            ),
        ),
    )


@pytest.fixture(scope="module")
def noisy_rooms(planned: Planned, noisy: PlanSettings) -> LivePlan:
    return open_live(planned("two-rooms", noisy)[0])


@pytest.fixture(params=["house", "asking_house", pytest.param("noisy_rooms", marks=pytest.mark.slow)])
def live(request: pytest.FixtureRequest) -> LivePlan:
    found: LivePlan = request.getfixturevalue(request.param)
    return found


@pytest.mark.slow
def test_losses_are_what_the_plan_evaluated_without_the_station_lacks(live: LivePlan) -> None:
    whole = live.figures(live.draft).plan
    n_broken = 0
    for station, losses in zip(whole.stations, whole.losses, strict=True):
        rest = live.figures(live.draft.without(station.id)).plan
        for loss, now, then in zip(losses, whole.requirements, rest.requirements, strict=True):
            assert loss.requirement == now.name == then.name
            assert loss.area_m2 == pytest.approx(now.covered_area_m2 - then.covered_area_m2, abs=1e-6)
            assert loss.fraction_of_achievable == pytest.approx(then.fraction_of_achievable, abs=1e-9)
            assert loss.met == then.met
            n_broken += now.met and not then.met
    assert n_broken > 0, "no requirement hangs on one station: the test says little"


@pytest.mark.slow
def test_losses_are_those_of_a_list_evaluated_from_scratch(planned: Planned, asking: PlanSettings) -> None:
    _, plan = planned("two-rooms", asking)
    scene = plan.survey.scene
    given = [
        GivenStation(one.id, one.position_m + scene.offset_m, one.instrument_height_m, one.floor)
        for one in plan.stations
    ]
    whole, rest = (evaluate_stations(scene, asking, stations) for stations in (given, given[1:]))
    n_lost = 0
    for loss, now, then in zip(whole.losses[0], whole.requirements, rest.requirements, strict=True):
        if now.seen_from > 1:
            continue  # listed stations count beside the candidates that they are, and make more achievable
        n_lost += loss.area_m2 > 0.1
        assert loss.area_m2 == pytest.approx(now.covered_area_m2 - then.covered_area_m2, abs=1e-6)
        assert loss.fraction_of_achievable == pytest.approx(then.fraction_of_achievable, abs=1e-9)
        assert loss.met == then.met
    assert n_lost > 1


@pytest.mark.slow
def test_patches_are_lost_that_others_see_too_coarsely_or_too_noisily(
    planned: Planned, noisy: PlanSettings, noisy_rooms: LivePlan
) -> None:
    _, plan = planned("two-rooms", noisy)
    survey, n_patches = plan.survey, plan.survey.patches.n_patches
    assert plan.times_met is not None
    at_m = np.stack([station.position_m for station in plan.stations])
    observations = observations_from(survey, noisy, open_engine(survey.scene, survey.patches), at_m)
    observations = with_noise(observations, noisy.scanner, reflectivity=noisy.requirements.reflectivity)
    assert observations.noise_m is not None
    row = np.repeat(np.arange(at_m.shape[0]), np.diff(observations.starts))
    n_seen = np.bincount(observations.patch, minlength=n_patches)
    n_badly = {"overall": 0, "quiet walls": 0}
    for index, goal in enumerate(goals_of(survey, noisy).each):
        meets = np.ones(row.size, dtype=bool)
        if goal.limits.spacing_m is not None:
            meets &= observations.spacing_m <= goal.limits.spacing_m
        if goal.limits.noise_m is not None:
            meets &= observations.noise_m <= goal.limits.noise_m
        n_met = np.bincount(observations.patch[meets], minlength=n_patches)
        counted = goal.patches & (plan.times_met[plan.qualities.index(goal.limits)] >= goal.seen_from)
        for number, losses in enumerate(plan.losses):
            mine = observations.patch[meets & (row == number)]
            expected = mine[counted[mine] & (n_met[mine] == goal.seen_from)]
            np.testing.assert_array_equal(losses[index].patch, np.sort(expected))
            if goal.name in n_badly:
                n_badly[goal.name] += int((n_seen[expected] > 1).sum())
    assert min(n_badly.values()) > 100
    for found, expected_losses in zip(noisy_rooms.figures(noisy_rooms.draft).plan.losses, plan.losses, strict=True):
        for loss, expected_loss in zip(found, expected_losses, strict=True):
            np.testing.assert_array_equal(loss.patch, expected_loss.patch)


@pytest.mark.slow
def test_documents_name_what_is_lost_by_requirement_and_count_surface_once(live: LivePlan) -> None:
    plan = live.figures(live.draft).plan
    area_m2 = plan.survey.patches.area_m2
    for row, losses in zip(plan_document(plan)["stations"], plan.losses, strict=True):
        lost = np.zeros(area_m2.size, dtype=bool)
        for loss in losses:
            lost[loss.patch] = True
        assert row["lost_area_m2"] == pytest.approx(area_m2[lost].sum(), abs=1e-6)
        told = {one["requirement"]: one for one in row["losses"]}
        assert set(told) == {loss.requirement for loss in losses if loss.area_m2 > 0}
        for loss in losses:
            if loss.requirement in told:
                assert told[loss.requirement]["area_m2"] == pytest.approx(loss.area_m2, abs=1e-6)
                assert told[loss.requirement]["met"] == loss.met


def lost_of(content: bytes, n_goals: int) -> list[Any]:
    """Read the file as docs/formats/stage.md has it."""
    numbers = np.frombuffer(content, dtype="<u4")
    ends = n_goals + np.cumsum(numbers[:n_goals])
    assert ends[-1] == numbers.size
    return np.split(numbers[n_goals:], ends[:-1] - n_goals)


@pytest.mark.slow
def test_files_of_a_plan_and_of_its_draft_hold_the_lost_patches(asking_folder: Path, asking_house: LivePlan) -> None:
    plan = asking_house.figures(asking_house.draft).plan
    for station, losses in zip(plan.stations, plan.losses, strict=True):
        content = (asking_folder / "viewer" / "lost" / f"{station.id}.u32").read_bytes()
        assert asking_house.lost(asking_house.draft, station.id) == content
        for found, loss in zip(lost_of(content, len(losses)), losses, strict=True):
            np.testing.assert_array_equal(found, loss.patch)


def test_what_a_station_is_needed_for_grows_when_another_goes(asking_house: LivePlan) -> None:
    plan = asking_house.figures(asking_house.draft).plan
    overall = [loss.requirement for loss in plan.losses[0]].index("overall")
    first, second = next(
        (a.id, b.id) for a, b in zip(plan.stations, plan.stations[1:], strict=False) if a.floor == b.floor
    )
    before = set(lost_of(asking_house.lost(asking_house.draft, first), len(plan.requirements))[overall].tolist())
    rest = asking_house.draft.without(second)
    after = set(lost_of(asking_house.lost(rest, first), len(plan.requirements))[overall].tolist())
    assert before < after
