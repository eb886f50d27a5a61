"""Plans that begin with stations of an earlier search, and what progress tells of the best set so far."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import KeepOut, Plan, PlanSettings, PriorStation, Proven, Requirements, Scene, Site
from planner_core.planning.plan import make_plan
from planner_core.progress import ProgressEvent
from planner_core.requirements.read import requirements_from
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene

#: Greedy selection is all that so little work leaves.
NO_SEARCH = Proven(work_limit=0)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    file = tmp_path_factory.mktemp("rooms") / "rooms.ply"
    return load_scene(scenes_synthetic.write(scenes_synthetic.build("two-rooms"), file))


@pytest.fixture(scope="module")
def settings() -> PlanSettings:
    return PlanSettings(
        scanner=replace(load_scanner("hdl-64e"), n_azimuths=900),
        requirements=Requirements(coverage=1.0, network="none"),
        method=Proven(),
        grid_step_m=1.0,
        instrument_heights_m=(1.3,),
        max_patch_area_m2=0.25,
        special_places=False,
        refine=False,
    )


@pytest.fixture(scope="module")
def searched(rooms: Scene, settings: PlanSettings) -> tuple[Plan, list[ProgressEvent]]:
    events: list[ProgressEvent] = []
    plan = make_plan(rooms, replace(settings, method=Proven(work_limit=1)), progress=events.append)
    return plan, events


def beginning_with(plan: Plan, settings: PlanSettings, **more: object) -> PlanSettings:
    offset_m = plan.survey.scene.offset_m
    begun = tuple(
        PriorStation(f"begun-{i}", tuple((station.position_m + offset_m).tolist()), "begun")
        for i, station in enumerate(plan.stations)
    )
    return replace(settings, site=Site(prior=begun, **more))


def test_a_search_is_no_worse_than_what_it_begins_with(
    rooms: Scene, settings: PlanSettings, searched: tuple[Plan, list[ProgressEvent]]
) -> None:
    best, _ = searched
    short = replace(settings, method=NO_SEARCH)
    greedy = make_plan(rooms, short)
    assert len(best.stations) < len(greedy.stations), "the search has to bring something for this test to say anything"
    again = make_plan(rooms, beginning_with(best, short))
    assert len(again.stations) == len(best.stations)
    assert all(not station.id.startswith("begun") for station in again.stations)
    assert not any("begun" in line for line in again.warnings)


@pytest.mark.slow
def test_nothing_keeps_the_stations_that_a_search_begins_with(
    rooms: Scene, settings: PlanSettings, searched: tuple[Plan, list[ProgressEvent]]
) -> None:
    best, _ = searched
    greedy = make_plan(rooms, replace(settings, method=NO_SEARCH))
    again = make_plan(rooms, beginning_with(greedy, replace(settings, method=Proven(work_limit=1))))
    assert len(again.stations) <= len(best.stations)


@pytest.mark.slow
def test_stations_to_begin_with_that_nobody_may_stand_at_are_left_out(
    rooms: Scene, settings: PlanSettings, searched: tuple[Plan, list[ProgressEvent]]
) -> None:
    best, _ = searched
    x, y, _ = best.stations[0].position_m + best.survey.scene.offset_m
    around = ((x - 0.9, y - 0.9), (x + 0.9, y - 0.9), (x + 0.9, y + 0.9), (x - 0.9, y + 0.9))
    short = replace(settings, method=NO_SEARCH)
    again = make_plan(rooms, beginning_with(best, short, keep_out=(KeepOut(around, name="piano"),)))
    places_m = np.array([station.position_m for station in again.stations]) + best.survey.scene.offset_m
    assert (np.abs(places_m[:, :2] - [x, y]).max(axis=1) > 0.9).all()


@pytest.mark.slow
def test_most_coverage_is_no_less_than_that_of_what_it_begins_with(rooms: Scene, settings: PlanSettings) -> None:
    two = replace(settings, objective="coverage", max_stations=2)
    best = make_plan(rooms, replace(two, method=Proven(work_limit=0.1)))
    short = replace(two, method=NO_SEARCH)
    greedy = make_plan(rooms, short)
    assert greedy.coverage.covered_area_m2 < best.coverage.covered_area_m2
    again = make_plan(rooms, beginning_with(best, short))
    assert again.coverage.covered_area_m2 >= best.coverage.covered_area_m2 - 1e-9


def test_requirements_files_name_stations_to_begin_with() -> None:
    (station,) = requirements_from({"site": {"begun": [[1.0, 2.0, 1.5]]}})[1].prior
    assert (station.role, station.position_m) == ("begun", (1.0, 2.0, 1.5))


def test_progress_tells_sets_that_shrink_bounds_below_them_and_where_they_are(
    searched: tuple[Plan, list[ProgressEvent]],
) -> None:
    plan, events = searched
    told = [event.best for event in events if event.best is not None]
    assert told
    sizes = [best.n_stations for best in told]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] == len(plan.stations)
    assert all(best.lower_bound is not None and best.lower_bound <= best.n_stations for best in told)
    assert told[-1].lower_bound <= plan.lower_bound
    assert all(len(best.chosen) == len(best.positions_m) == best.n_stations for best in told)
    # The last one told is the one that is returned: nothing was found after it.
    assert sorted(told[-1].positions_m) == sorted(tuple(station.position_m.tolist()) for station in plan.stations)
