"""The route through a building, and the time it takes."""

import dataclasses

import numpy as np
import pytest

from planner_core.coverage.survey import make_survey
from planner_core.errors import RequirementError
from planner_core.model import FieldTime, Objective, PlanSettings, Route, Site
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import ANYWHERE, Ends, ends_of
from planner_core.positions.reach import Reach, reachability
from planner_core.positions.walking import Walking
from planner_core.route import route as route_module
from planner_core.route.route import (
    ends_on_ground,
    field_time,
    in_visiting_order,
    pieces_by_floor,
    plan_route,
    route_warnings,
)
from planner_core.route.unreachable import unreachable_areas
from planner_core.scanner.load_scanner import load_scanner
from scenes_synthetic import build

SCANNER = load_scanner("hdl-64e")


def reach_in(name: str) -> Reach:
    survey = make_survey(build(name).scene, PlanSettings(scanner=SCANNER, max_patch_area_m2=1.0))
    return reachability(survey, free_space(survey))


def walk(reach: Reach, foot_m: np.ndarray, floor: np.ndarray, ends: Ends = ANYWHERE) -> Route:
    """Route of sensors 1.6 m above their feet."""
    sensor_m = foot_m + np.array([0.0, 0.0, 1.6])
    return plan_route(reach, sensor_m, np.full(len(foot_m), 1.6), floor.astype(np.int32), ends=ends)


@pytest.mark.slow
def test_rooms_along_a_corridor_are_visited_in_a_row_from_the_entrance() -> None:
    """Rooms of 3 m, 0.15 m apart, their doorways to the corridor on the south; the entrance is at its west end."""
    x = np.array([1.5, 4.65, 7.8, 10.95])
    stations = np.column_stack([x, np.full(4, 4.0), np.zeros(4)])[[2, 0, 3, 1]]
    route = walk(reach_in("corridor-comb"), stations, np.zeros(4), Ends(np.array([0.5, 0.8, 0.0])))
    assert route.order.tolist() == [1, 3, 0, 2]
    assert route.exact
    assert route.n_unwalkable == 0
    assert [(leg.a, leg.b) for leg in route.legs] == [(-1, 1), (1, 3), (3, 0), (0, 2)]
    assert np.hypot(*(route.legs[0].points_m[0] - [0.5, 0.8, 0.0])[:2]) <= 0.05, "the start lies in its cell"
    for leg, at in zip(route.legs, stations[route.order], strict=True):
        assert leg.points_m[-1] == pytest.approx(at, abs=1e-9)
        assert leg.floors == (0,)
    assert route.length_m == pytest.approx(sum(leg.length_m for leg in route.legs))
    straight = np.linalg.norm(np.diff(stations[route.order], axis=0), axis=1).sum()
    assert route.length_m > straight + 3 * 3.0, "the way leads out of each room and into the next"


@pytest.mark.slow
def test_storeys_are_walked_from_below_and_a_closed_walk_leads_back() -> None:
    places = np.array([[0.6, 1.0, 5.6], [0.6, 1.0, 0.0], [0.6, 5.5, 2.8], [0.6, 5.5, 0.0], [0.6, 5.5, 5.6]])
    floor = np.array([2, 0, 1, 0, 2])
    reach = reach_in("stairwell")
    start = np.array([1.8, 0.6, 0.0])
    route = walk(reach, places, floor, Ends(start))
    assert floor[route.order].tolist() == [0, 0, 1, 2, 2]
    back = walk(reach, places, floor, Ends(start, closed=True))
    assert len(back.legs) == 6
    assert (back.legs[0].a, back.legs[-1].b) == (-1, -1)
    assert np.array_equal(back.legs[-1].points_m[-1], back.legs[0].points_m[0])
    assert back.length_m > route.length_m + 10.0
    there = walk(reach, places, floor, Ends(start, places[1]))
    assert np.hypot(*(there.legs[-1].points_m[-1] - places[1])[:2]) <= 0.05
    assert len(there.legs) == 6


def test_a_leg_up_the_stairs_tells_the_floors_it_passes_and_keeps_its_way() -> None:
    reach = reach_in("stairwell")
    from_m, to_m = np.array([0.6, 5.5, 0.0]), np.array([0.6, 5.5, 5.6])
    route = walk(reach, np.stack([to_m, from_m]), np.array([2, 0]), Ends(np.array([1.8, 0.6, 0.0])))
    leg = route.legs[-1]
    assert leg.floors == (0, 1, 2)
    assert leg.floor.size == len(leg.points_m) - 1
    taut = Walking(reach).path(leg.points_m[0], leg.points_m[-1])
    length_m = np.linalg.norm(np.diff(leg.points_m, axis=0), axis=1).sum()
    assert length_m == pytest.approx(taut.length_m, abs=1e-9)
    assert leg.length_m == pytest.approx(taut.length_m, abs=1e-9)
    for corner in taut.points_m:
        assert np.linalg.norm(leg.points_m - corner, axis=1).min() < 1e-9, corner
    low_m = leg.points_m[:-1, 2][leg.floor == 2]
    assert low_m.min() > 5.0, "the flight up to the highest floor is of the one below"


def test_pieces_over_no_ground_are_of_the_floor_before() -> None:
    reach = reach_in("convex-room")
    inside = reach.regions[0].inside_m
    outside = np.array([inside[0] + 500.0, inside[1], inside[2]])
    corners, floor = pieces_by_floor(reach.space, np.stack([inside, outside, inside]))
    assert corners.shape == (3, 3)
    assert floor.tolist() == [0, 0]


def test_stations_in_unreachable_rooms_are_left_out_of_the_walk_and_named() -> None:
    reach = reach_in("closed-rooms")
    places = np.array([[1.5, 1.0, 0.0], [4.5, 1.0, 40.0], [1.5, 3.0, 0.0], [900.0, 1.0, 0.0]])
    route = walk(reach, places, np.zeros(4), Ends(np.array([0.0, 0.0, 70.0])))
    assert route.left_out == (1, 3)
    assert sorted(route.order[:2].tolist()) == [0, 2]
    assert route.order[2:].tolist() == [1, 3]
    assert route.length_m == pytest.approx(2.0)
    assert len(route.legs) == 1
    lines = route_warnings(route, ["P1", "P2", "P3", "P4"])
    assert len(lines) == 2
    assert "the start at (0.00, 0.00, 70.00)" in lines[0]
    assert "P2, P4" in lines[1]


def test_an_unknown_instrument_height_and_no_stations_raise_nothing() -> None:
    reach = reach_in("convex-room")
    unknown = plan_route(reach, reach.regions[0].inside_m[None] + 1.6, np.array([np.nan]), np.zeros(1, np.int32))
    assert unknown.left_out == (0,)
    nothing = walk(reach, np.empty((0, 3)), np.zeros(0), Ends(reach.regions[0].inside_m, closed=True))
    assert (nothing.order.size, nothing.legs, nothing.length_m) == (0, (), 0.0)


@pytest.mark.slow
def test_stations_that_are_scanned_already_are_not_walked_to() -> None:
    reach = reach_in("corridor-comb")
    x = np.array([7.8, 1.5, 10.95, 4.65])
    sensor_m = np.column_stack([x, np.full(4, 4.0), np.full(4, 1.6)])
    height_m, floor = np.full(4, 1.6), np.zeros(4, dtype=np.int32)
    scanned = np.array([False, False, True, False])
    route = plan_route(reach, sensor_m, height_m, floor, scanned=scanned)
    others = plan_route(reach, sensor_m[~scanned], height_m[~scanned], floor[~scanned])
    assert route.order.tolist() == [*np.flatnonzero(~scanned)[others.order].tolist(), 2]
    assert route.length_m == others.length_m
    assert (route.left_out, route_warnings(route, list("abcd"))) == ((), ())
    order = np.array([1, 2, 0, 3])
    given = plan_route(
        reach, sensor_m, height_m, floor, ends=Ends(np.array([0.5, 0.8, 0.0])), scanned=scanned, order=order
    )
    assert given.order.tolist() == order.tolist()
    assert [(leg.a, leg.b) for leg in given.legs] == [(-1, 1), (1, 0), (0, 3)]
    assert given.length_m > route.length_m and not given.exact


def test_rooms_with_doors_of_their_own_are_walked_one_after_the_other() -> None:
    reach = reach_in("closed-rooms")
    places = np.array([[1.5, 1.0, 0.0], [4.5, 1.0, 0.0], [1.5, 3.0, 0.0]])
    route = walk(reach, places, np.zeros(3))
    assert route.left_out == ()
    assert route.n_unwalkable == 1
    assert route.length_m == pytest.approx(2.0)
    assert sorted(leg.walkable for leg in route.legs) == [False, True]
    (line,) = route_warnings(route, ["A", "B", "C"])
    assert "to B" in line or "from B" in line


def test_a_route_in_visiting_order_has_its_stations_numbered_by_it() -> None:
    reach = reach_in("corridor-comb")
    x = np.array([7.8, 1.5, 10.95, 4.65])
    stations = np.column_stack([x, np.full(4, 4.0), np.array([0.0, 0.0, 0.0, 9.0])])
    route = walk(reach, stations, np.zeros(4), Ends(np.array([0.5, 0.8, 0.0])))
    sorted_route = in_visiting_order(route)
    again = walk(reach, stations[route.order], np.zeros(4), Ends(np.array([0.5, 0.8, 0.0])))
    assert sorted_route.order.tolist() == again.order.tolist() == [0, 1, 2, 3]
    assert [(leg.a, leg.b) for leg in sorted_route.legs] == [(leg.a, leg.b) for leg in again.legs]
    assert sorted_route.left_out == again.left_out == (3,)


def test_the_walk_begins_at_the_start_else_at_the_first_entrance() -> None:
    offset_m = np.array([100.0, 0.0, 10.0])
    site = Site(entrances_m=((101.0, 2.0, 10.0), (109.0, 2.0, 10.0)), returns=True)
    ends = ends_of(site, offset_m)
    assert ends.start_m is not None
    assert (ends.start_m.tolist(), ends.end_m, ends.closed) == ([1.0, 2.0, 0.0], None, True)
    started = ends_of(dataclasses.replace(site, start_m=(103.0, 2.0, 10.0)), offset_m)
    assert started.start_m is not None
    assert started.start_m.tolist() == [3.0, 2.0, 0.0]
    assert ends_of(Site(), offset_m) == ANYWHERE
    with pytest.raises(RequirementError, match="end of the route"):
        dataclasses.replace(site, end_m=(103.0, 2.0, 10.0))


def test_ends_are_moved_to_ground_within_a_metre_or_left_out() -> None:
    reach = reach_in("convex-room")
    node = np.flatnonzero(reach.reached_node)
    ground_m = reach.space.position_m(node)
    west = ground_m[np.argmin(ground_m[:, 0])]
    found, notes = ends_on_ground(reach, Ends(west - [0.7, 0.0, 0.0], west - [1.2, 0.0, 0.0]))
    assert found.start_m is not None
    assert found.start_m == pytest.approx(west)
    assert found.end_m is None
    assert len(notes) == 1
    assert "the end at" in notes[0]


def test_unreachable_areas_are_the_rooms_nobody_can_walk_into() -> None:
    """Three rooms without doors; from the first, the others are unreachable: what a person can stand on of them."""
    survey = make_survey(build("closed-rooms").scene, PlanSettings(scanner=SCANNER, max_patch_area_m2=1.0))
    reach = reachability(survey, free_space(survey), np.array([[1.5, 1.0, 0.0]]))
    areas = unreachable_areas(reach)
    assert len(areas) == len(reach.unreachable) > 0
    for area, region in zip(areas, reach.unreachable, strict=True):
        sizes = np.diff(area.strips_m, axis=1)[:, 0]
        assert (sizes > 0).all()
        assert sizes.prod(axis=1).sum() == pytest.approx(area.area_m2) == pytest.approx(region.area_m2)
        inside = ((area.strips_m[:, 0] <= region.inside_m[:2]) & (area.strips_m[:, 1] >= region.inside_m[:2])).all(1)
        assert inside.sum() == 1
        away = ((area.strips_m[:, 0] <= [1.5, 1.0]) & (area.strips_m[:, 1] >= [1.5, 1.0])).all(axis=1)
        assert not away.any()


def test_field_time_is_the_sum_of_its_parts() -> None:
    scanner = dataclasses.replace(SCANNER, seconds_per_scan=90.0)
    settings = PlanSettings(scanner=scanner, set_up_s=45.0, walking_m_per_s=0.75)
    found = field_time(settings.crew, n_scans=12, walk_m=150.0)
    assert found == FieldTime(1080.0, 540.0, 200.0)
    assert found.total_s == 1820.0
    told = dataclasses.replace(settings, seconds_per_scan=10.0)
    assert field_time(told.crew, n_scans=12, walk_m=0.0).scanning_s == 120.0


def test_time_of_scanning_is_unknown_where_nobody_tells_how_long_a_scan_takes() -> None:
    silent = dataclasses.replace(SCANNER, seconds_per_scan=None)
    settings = PlanSettings(scanner=silent)
    found = field_time(settings.crew, n_scans=3, walk_m=10.0)
    assert (found.scanning_s, found.set_up_s, found.walking_s, found.total_s) == (None, 180.0, 10.0, None)
    with pytest.raises(RequirementError, match="seconds per scan: got none"):
        dataclasses.replace(settings, objective=Objective.TIME)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"walking_m_per_s": 0.0}, "walking speed"),
        ({"set_up_s": -1.0}, "set-up seconds"),
        ({"seconds_per_scan": float("nan")}, "seconds per scan"),
    ],
)
def test_figures_that_are_no_times_or_speeds_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(RequirementError, match=message):
        dataclasses.replace(PlanSettings(scanner=SCANNER), **change)


def test_many_stops_are_ordered_part_by_part_with_start_and_end_in_their_places(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three unreachable rooms of 3 x 4 m with three stations each."""
    x = np.array([0.6, 1.5, 2.4, 3.75, 4.65, 5.55, 6.9, 7.8, 8.7])
    stations = np.column_stack([x, np.full(9, 2.0), np.zeros(9)])[[4, 0, 8, 2, 6, 1, 3, 7, 5]]
    survey = make_survey(build("closed-rooms").scene, PlanSettings(scanner=SCANNER, max_patch_area_m2=1.0))
    reach = reachability(survey, free_space(survey), stations[:3])
    ends = Ends(np.array([8.8, 2.0, 0.0]), np.array([0.5, 2.0, 0.0]))
    at_once = walk(reach, stations, np.zeros(9), ends)
    monkeypatch.setattr(route_module, "_MOST_STOPS", 8)
    by_parts = walk(reach, stations, np.zeros(9), ends)
    assert stations[by_parts.order, 0].tolist() == [8.7, 7.8, 6.9, 3.75, 4.65, 5.55, 2.4, 1.5, 0.6] or (
        stations[by_parts.order, 0].tolist() == [8.7, 7.8, 6.9, 5.55, 4.65, 3.75, 2.4, 1.5, 0.6]
    )
    assert by_parts.length_m == pytest.approx(at_once.length_m)
    assert by_parts.n_unwalkable == 2
    assert by_parts.exact
