"""The site in whole plans: rooms nobody can enter, keep-outs, places, robots, prior stations; floors jointly."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import KeepOut, Plan, PlanSettings, PriorStation, Requirements, Role, Scene, Site
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.planning.plan import make_plan
from planner_core.scene.build import scene_from_arrays

Planned = Callable[[str, PlanSettings], Plan]
#: The middles of the rooms of `closed-rooms`, and of the corridor of `doors-open`.
ROOMS = ((1.5, 2.0, 0.0), (4.65, 2.0, 0.0), (7.8, 2.0, 0.0))


def rooms_of(plan: Plan) -> set[int]:
    """Rooms of `closed-rooms` that have a station."""
    return {int(station.position_m[0] // 3.15) for station in plan.stations}


@pytest.fixture
def free(small: PlanSettings) -> PlanSettings:
    return replace(small, requirements=Requirements(coverage=0.9, network="none"))


@pytest.mark.slow
def test_rooms_without_entrance_are_told_not_planned_and_not_missed(free: PlanSettings, planned: Planned) -> None:
    plan = planned("closed-rooms", replace(free, site=Site(entrances_m=ROOMS[:1])))
    assert rooms_of(plan) == {0}
    assert sorted(int(area.inside_m[0] // 3.15) for area in plan.unreachable) == [1, 2]
    assert sum(area.area_m2 for area in plan.unreachable) == pytest.approx(24.0, rel=0.1)
    lines = [line for line in plan.warnings if "can't be reached on foot" in line]
    assert len(lines) == sum("so no station is planned there" in line for line in lines) == 2
    assert not any("that no route joins" in line for line in plan.warnings)
    assert all(result.met for result in plan.requirements)
    whole = planned("closed-rooms", replace(free, site=Site(entrances_m=ROOMS)))
    assert plan.coverage.achievable_area_m2 == pytest.approx(whole.coverage.achievable_area_m2 / 3, rel=0.2)


def test_rooms_with_an_entrance_each_are_parts_that_no_route_joins(free: PlanSettings, planned: Planned) -> None:
    plan = planned("closed-rooms", replace(free, site=Site(entrances_m=ROOMS)))
    (line,) = [line for line in plan.warnings if "that no route joins" in line]
    assert line.startswith("3 parts of the building that no route joins, such as dwellings: floor '")
    assert all(station.id in line for station in plan.stations[:3])


@pytest.mark.parametrize("role", ["scanned", "locked", "evaluated"])
def test_a_sealed_room_with_a_station_in_it_is_not_without_one(free: PlanSettings, planned: Planned, role: str) -> None:
    """Whoever planned it: a list that is evaluated, or a station that is there before planning."""
    x, y, z = ROOMS[2]
    at = (x, y, z + 1.6)
    site = Site(entrances_m=ROOMS[:1])
    if role == "evaluated":
        given = [GivenStation("Far", np.array(at), 1.6, None)]
        plan = evaluate_stations(scenes_synthetic.build("closed-rooms").scene, replace(free, site=site), given)
    else:
        prior = PriorStation("Far", at, Role(role), instrument_height_m=1.6)
        plan = planned("closed-rooms", replace(free, site=replace(site, prior=(prior,))))
    lines = [line for line in plan.warnings if "can't be reached on foot" in line]
    assert sum("though Far stands there; open a door to it" in line for line in lines) == 1
    assert sum("so no station is planned there" in line for line in lines) == 1


@pytest.mark.slow
def test_an_entrance_into_each_room_has_them_all_planned(free: PlanSettings, planned: Planned) -> None:
    plan = planned("closed-rooms", replace(free, site=Site(entrances_m=ROOMS)))
    assert rooms_of(plan) == {0, 1, 2}
    assert plan.unreachable == ()
    two = planned("closed-rooms", replace(free, site=Site(entrances_m=ROOMS[:2])))
    assert rooms_of(two) == {0, 1}


@pytest.mark.slow
def test_a_robot_too_wide_for_the_doors_stays_in_the_corridor(free: PlanSettings, planned: Planned) -> None:
    corridor = Site(entrances_m=((4.65, 0.8, 0.0),))
    person = planned("doors-open", replace(free, site=corridor))
    robot = planned("doors-open", replace(free, site=replace(corridor, carrier_radius_m=0.55)))
    assert max(station.position_m[1] for station in person.stations) > 1.75
    assert max(station.position_m[1] for station in robot.stations) < 1.75
    assert robot.unreachable


@pytest.mark.slow
def test_no_station_stands_in_a_keep_out_or_at_a_forbidden_place(free: PlanSettings, planned: Planned) -> None:
    before = planned("l-room", replace(free, refine=True))
    worst = before.stations[0].position_m
    site = Site(
        keep_out=(KeepOut(((3.2, 0.0), (5.0, 0.0), (5.0, 3.0), (3.2, 3.0))),),
        prior=(PriorStation("no", (float(worst[0]), float(worst[1]), float(worst[2])), "forbidden", radius_m=0.8),),
    )
    plan = planned("l-room", replace(free, refine=True, site=site))
    at = np.stack([station.position_m for station in plan.stations])
    assert not ((at[:, 0] > 3.2) & (at[:, 0] < 5.0) & (at[:, 1] < 3.0)).any()
    assert (np.linalg.norm(at[:, :2] - worst[:2], axis=1) > 0.8 - 1e-9).all()
    assert all(result.met for result in plan.requirements)


@pytest.mark.slow
def test_scanned_stations_count_and_are_not_visited_and_locked_ones_are(free: PlanSettings, planned: Planned) -> None:
    timed = replace(free, seconds_per_scan=60.0, set_up_s=0.0)
    before = planned("corridor-comb", timed)
    done = tuple(
        PriorStation(f"old-{n}", tuple(s.position_m.tolist()), "scanned") for n, s in enumerate(before.stations[:3])
    )
    locked = PriorStation("must", (6.0, 1.0, 1.5), "locked")
    plan = planned("corridor-comb", replace(timed, site=Site(prior=(*done, locked))))
    ids = [station.id for station in plan.stations]
    assert {"old-0", "old-1", "old-2", "must"} <= set(ids)
    assert [station.id for station in plan.stations if station.fixed] == ids[-3:]
    assert plan.field_time is not None
    assert plan.field_time.scanning_s == 60.0 * (len(ids) - 3)
    assert plan.route is not None
    visited = {ids[stop] for leg in plan.route.legs for stop in (leg.a, leg.b) if stop >= 0}
    assert visited == set(ids[:-3])
    # What was scanned is not scanned again: no more stations than before and the locked one.
    assert len(ids) <= len(before.stations) + 1
    assert all(result.met for result in plan.requirements)


def storeys_open_to_one_another() -> Scene:
    """A hall of 5 x 5 m; over a third of it a gallery, a floor of its own, 2.6 m up and open to the hall."""
    boxes = {
        "Ground": ((0, 0, -0.2), (5, 5, 0)),
        "Gallery": ((0, 0, 2.4), (1.8, 5, 2.6)),
        "Roof": ((0, 0, 5.2), (5, 5, 5.4)),
        "West": ((-0.2, 0, -0.2), (0, 5, 5.4)),
        "East": ((5, 0, -0.2), (5.2, 5, 5.4)),
        "South": ((0, -0.2, -0.2), (5, 0, 5.4)),
        "North": ((0, 5, -0.2), (5, 5.2, 5.4)),
    }
    faces = np.array(
        [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
         (1, 5, 7), (1, 7, 3)]
    )  # fmt: skip
    corners = [
        np.array([(x, y, z) for x in (a[0], b[0]) for y in (a[1], b[1]) for z in (a[2], b[2])], dtype=float)
        for a, b in boxes.values()
    ]
    triangles = np.concatenate([faces + 8 * number for number in range(len(boxes))])
    return scene_from_arrays(np.concatenate(corners), triangles)


@pytest.mark.slow
def test_floors_planned_together_need_fewer_stations_than_apart(free: PlanSettings) -> None:
    scene = storeys_open_to_one_another()
    # Looks everywhere: what one storey sees of the other is only a matter of what is in between.
    scanner = replace(
        free.scanner, elevation_rad=tuple(np.linspace(1.4, -1.4, 90).tolist()), range_max_m=30.0, range_min_m=0.1
    )
    settings = replace(free, scanner=scanner, requirements=Requirements(coverage=0.85, network="none"))
    together = make_plan(scene, settings)
    assert [floor.id for floor in together.survey.floors] == ["F0", "F1"]
    apart = [
        make_plan(scene, replace(settings, requirements=replace(settings.requirements, floors=(floor,))))
        for floor in ("F0", "F1")
    ]
    assert all(result.met for plan in (together, *apart) for result in plan.requirements)
    assert len(together.stations) < sum(len(plan.stations) for plan in apart)


def test_a_sealed_room_is_not_missed_where_the_building_opens_to_it_by_shut_doors(
    free: PlanSettings, planned: Planned
) -> None:
    site = Site(entrances_m=((4.65, 0.8, 0.0),))
    shut = planned("doors-shut", replace(free, site=replace(site, opens_doors=False)))
    assert {station.position_m[1] < 1.75 for station in shut.stations} == {True}
    assert len(shut.unreachable) == 3
    assert scenes_synthetic.build("doors-shut").truth.floor_area_m2["Room 1"] == pytest.approx(9.0)
    assert all(area.area_m2 == pytest.approx(9.0, rel=0.15) for area in shut.unreachable)
