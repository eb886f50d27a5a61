"""Other objectives than fewest stations: most coverage with so many, least time in the field; and what contradicts."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any, cast

import numpy as np
import pytest
from stages import find_positions
from tlsplan import inputs
from tlsplan.options import MethodOptions, PriorStations

from planner_core.engine.open_engine import open_engine
from planner_core.errors import RequirementError
from planner_core.model import Greedy, Paper, Plan, PlanSettings, PriorStation, Proven, Requirements, Site

Planned = Callable[[str, PlanSettings], Plan]


@pytest.fixture
def most(small: PlanSettings) -> PlanSettings:
    asked = Requirements(coverage=0.9, network="none")
    return replace(small, requirements=asked, objective="coverage", max_stations=2)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["l-room", pytest.param("two-rooms", marks=pytest.mark.slow), "closed-rooms"])
def test_most_coverage_is_that_of_the_best_of_all_sets_of_candidates(
    scene: str, most: PlanSettings, planned: Planned
) -> None:
    plan = planned(scene, most)
    survey = plan.survey
    engine = open_engine(survey.scene, survey.patches)
    at = find_positions(survey, most, engine, floors=(0,)).candidates.position_m
    rows = engine.visible_patches(survey.template, at)
    seen = np.zeros((at.shape[0], survey.patches.n_patches), dtype=bool)
    for candidate in range(at.shape[0]):
        seen[candidate, rows.row(candidate)] = True
    area_m2 = survey.patches.area_m2
    pairs = combinations(range(at.shape[0]), 2)
    best_m2 = max(float(area_m2[seen[a] | seen[b]].sum()) for a, b in pairs)
    best = best_m2 / float(area_m2[seen.any(axis=0)].sum())
    assert plan.objective_value == pytest.approx(best, abs=1e-6)
    assert plan.coverage.fraction_of_achievable == pytest.approx(best, abs=1e-6)
    assert plan.objective_bound is not None
    assert plan.objective_bound >= best - 1e-6
    assert len(plan.stations) <= 2


@pytest.mark.slow
def test_coverage_grows_with_the_stations_allowed_and_never_passes_its_bound(
    most: PlanSettings, planned: Planned
) -> None:
    plans = [planned("corridor-comb", replace(most, max_stations=n)) for n in (1, 4)]
    values = [plan.objective_value or 0.0 for plan in plans]
    bounds = [plan.objective_bound or 0.0 for plan in plans]
    assert values == sorted(values)
    assert values[0] < values[-1] <= 1.0
    assert all(value <= bound <= 1.0 + 1e-9 for value, bound in zip(values, bounds, strict=True))
    assert [len(plan.stations) <= n for plan, n in zip(plans, (1, 4), strict=True)] == [True] * 2
    for plan, value in zip(plans, values, strict=True):
        assert plan.coverage.fraction_of_achievable == pytest.approx(value, abs=1e-6)


@pytest.mark.slow
def test_the_plan_of_most_coverage_is_one_network_too(small: PlanSettings, planned: Planned) -> None:
    # From 1.7 m this scanner sees no floor in the middle of a room: nothing tells the height there.
    settings = replace(small, objective="coverage", max_stations=4, instrument_heights_m=(1.3, 1.7))
    plan = planned("two-rooms", settings)
    assert plan.registration is not None
    assert [len(network.stations) for network in plan.registration.networks] == [len(plan.stations)]


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["doors-open", pytest.param("corridor-comb", marks=pytest.mark.campaign)])
def test_the_plan_of_least_time_takes_no_longer_than_that_of_fewest_stations(
    scene: str, small: PlanSettings, planned: Planned
) -> None:
    timed = replace(small, seconds_per_scan=60.0, set_up_s=30.0)
    fewest, quickest = planned(scene, timed), planned(scene, replace(timed, objective="time"))
    assert all(result.met for result in quickest.requirements)
    assert [r.name for r in quickest.requirements] == [r.name for r in fewest.requirements]
    assert fewest.field_time is not None
    assert quickest.field_time is not None
    assert fewest.field_time.total_s is not None
    assert quickest.field_time.total_s is not None
    assert quickest.field_time.total_s <= fewest.field_time.total_s + 1e-6
    assert quickest.objective_value is not None
    assert quickest.objective_bound is not None
    assert quickest.objective_value == pytest.approx(quickest.field_time.total_s)
    assert 0.0 < quickest.objective_bound <= quickest.objective_value


KEPT = Site(prior=(PriorStation("S001", (1.0, 1.0, 1.5), "kept"),))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"objective": "cheapest"}, ("cheapest", "fewest, coverage, time")),
        ({"objective": "coverage"}, ("coverage", "no stations as its limit")),
        ({"max_stations": 3}, ("fewest", "3 stations as its limit")),
        ({"objective": "coverage", "max_stations": 0}, ("max_stations", "got 0")),
        ({"max_stations": 0}, ("fewest", "0 stations as its limit")),
        ({"objective": "time", "method": Greedy()}, ("time", "greedy")),
        ({"objective": "time"}, ("seconds per scan", "none")),
        ({"objective": "time", "seconds_per_scan": 60.0, "site": KEPT}, ("kept", "time")),
        ({"objective": "coverage", "max_stations": 3, "site": KEPT}, ("kept", "coverage")),
        ({"method": Greedy(), "site": KEPT}, ("kept", "greedy")),
        ({"method": Paper(), "site": KEPT}, ("scanned, locked or kept", "paper")),
    ],
)
def test_settings_that_contradict_each_other_are_refused_in_one_line(
    changes: dict[str, object], words: tuple[str, ...], small: PlanSettings
) -> None:
    unknown = replace(small, scanner=replace(small.scanner, seconds_per_scan=None))
    with pytest.raises(RequirementError) as refusal:
        replace(unknown, **changes)  # type: ignore[arg-type]
    assert "\n" not in str(refusal.value)
    assert all(word in str(refusal.value) for word in words)


@pytest.fixture
def listed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], object]:
    """Write a list of one station S001 at x."""
    folder = tmp_path_factory.mktemp("lists")

    def write(x: str) -> object:
        path = folder / f"at-{x}.csv"
        path.write_text(f"id,x_m,y_m,z_m\nS001,{x},1.0,1.5\n")
        return path

    return write


def test_a_kept_station_of_the_id_of_a_distant_scanned_one_is_refused(small: PlanSettings, listed: object) -> None:
    near, moved, far = (listed(x) for x in ("1.0", "1.5", "5.0"))  # type: ignore[operator]
    with pytest.raises(RequirementError, match=r"S001.*4\.0 m away.*rename"):
        inputs.with_prior(small, PriorStations(scanned=near, kept=far))
    prior = inputs.with_prior(small, PriorStations(scanned=moved, kept=near)).site.prior
    assert [(station.id, station.role) for station in prior] == [("S001", "scanned")]
    with pytest.raises(RequirementError, match="S001"):
        inputs.with_prior(small, PriorStations(scanned=near, locked=far))


def test_options_of_one_method_are_refused_with_another(small: PlanSettings) -> None:
    for options, words in (
        (MethodOptions(method="greedy", search="sa"), "--search"),
        (MethodOptions(method="paper", time_limit_s=3.0), "--time-limit"),
        (MethodOptions(method="greedy", effort="quick"), "--effort"),
        (MethodOptions(max_stations=3), "--max-stations"),
        (MethodOptions(objective="coverage"), "--objective coverage: .*add e.g. --max-stations 10"),
        (MethodOptions(method="greedy", assignments=("work_limit=1",)), "--set"),
        (MethodOptions(assignments=("work_limit",)), "NAME=VALUE"),
        (MethodOptions(assignments=("work_limits=1",)), "work_limit"),
    ):
        with pytest.raises(RequirementError, match=words) as refusal:
            inputs.with_method(small, options)
        assert "\n" not in str(refusal.value)


def test_effort_says_how_long_to_go_on_and_set_goes_before_it(small: PlanSettings) -> None:
    def made(**options: Any) -> PlanSettings:
        return inputs.with_method(small, MethodOptions(**options))

    works = [cast(Proven, made(effort=effort).method).work_limit for effort in ("quick", "normal", "proof")]
    assert works == sorted(works) and works[1] == Proven().work_limit > 10 * works[0]
    assert made(effort="normal").refine and not made(effort="quick").refine
    assert not cast(Proven, made(effort="quick").method).prove
    assert cast(Proven, made(effort="quick", assignments=("work_limit=7",)).method).work_limit == 7.0
