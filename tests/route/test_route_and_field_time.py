"""The route through a building, and the time it takes."""

import dataclasses

import numpy as np
import pytest

from planner_core.errors import RequirementError
from planner_core.ground.free_space import free_space
from planner_core.ground.reach import Reach, reachability
from planner_core.model import PlanSettings
from planner_core.route.field_time import field_time
from planner_core.route.route import find_route
from planner_core.scan.scanners import load_scanner
from planner_core.survey import make_survey
from scenes_synthetic import build

SCANNER = load_scanner("hdl-64e")


def reach_in(name: str) -> Reach:
    survey = make_survey(build(name).scene, PlanSettings(scanner=SCANNER, max_patch_area_m2=1.0))
    return reachability(survey, free_space(survey))


def test_rooms_along_a_corridor_are_visited_in_a_row_from_the_entrance() -> None:
    """Rooms of 3 m, 0.15 m apart, their doorways to the corridor on the south; the entrance is at its west end."""
    x = np.array([1.5, 4.65, 7.8, 10.95])
    stations = np.column_stack([x, np.full(4, 4.0), np.zeros(4)])[[2, 0, 3, 1]]
    route = find_route(reach_in("corridor-comb"), stations, np.zeros(4, np.int32), start_m=np.array([0.5, 0.8, 0.0]))
    assert route.order.tolist() == [1, 3, 0, 2]
    assert route.exact
    assert route.n_unwalkable == 0
    assert len(route.legs) == 4
    assert np.array_equal(route.legs[0].points_m[0], [0.5, 0.8, 0.0])
    for leg, at in zip(route.legs, stations[route.order], strict=True):
        assert np.array_equal(leg.points_m[-1], at)
    assert route.length_m == pytest.approx(sum(leg.length_m for leg in route.legs))
    straight = np.linalg.norm(np.diff(stations[route.order], axis=0), axis=1).sum()
    assert route.length_m > straight + 3 * 3.0, "the way leads out of each room and into the next"


def test_storeys_are_walked_from_below_and_a_closed_walk_leads_back() -> None:
    places = np.array([[0.6, 1.0, 5.6], [0.6, 1.0, 0.0], [0.6, 5.5, 2.8], [0.6, 5.5, 0.0], [0.6, 5.5, 5.6]])
    floor = np.array([2, 0, 1, 0, 2], dtype=np.int32)
    reach = reach_in("stairwell")
    start = np.array([1.8, 0.6, 0.0])
    route = find_route(reach, places, floor, start_m=start)
    assert floor[route.order].tolist() == [0, 0, 1, 2, 2]
    back = find_route(reach, places, floor, start_m=start, closed=True)
    assert len(back.legs) == 6
    assert np.array_equal(back.legs[-1].points_m[-1], start)
    assert back.length_m > route.length_m + 10.0
    there = find_route(reach, places, floor, start_m=start, end_m=places[1])
    assert np.array_equal(there.legs[-1].points_m[-1], places[1])
    assert len(there.legs) == 6


def test_stations_in_sealed_rooms_are_visited_with_legs_that_cant_be_walked() -> None:
    places = np.array([[1.5, 1.0, 0.0], [4.5, 1.0, 0.0], [1.5, 3.0, 0.0]])
    route = find_route(reach_in("closed-rooms"), places, np.zeros(3, np.int32))
    assert route.n_unwalkable == 1
    assert route.length_m == pytest.approx(2.0)
    assert sorted(leg.points_m.shape[0] == 0 for leg in route.legs) == [False, True]


def test_field_time_is_the_sum_of_its_parts() -> None:
    scanner = dataclasses.replace(SCANNER, seconds_per_scan=90.0)
    found = field_time(scanner, n_scans=12, walk_m=150.0, set_up_s=45.0, walking_m_per_s=0.75)
    assert (found.scanning_s, found.set_up_s, found.walking_s) == (1080.0, 540.0, 200.0)
    assert found.total_s == 1820.0
    assert field_time(scanner, n_scans=12, walk_m=0.0, seconds_per_scan=10.0).scanning_s == 120.0


def test_field_time_needs_to_know_how_long_a_scan_takes() -> None:
    silent = dataclasses.replace(SCANNER, seconds_per_scan=None)
    with pytest.raises(RequirementError, match="seconds per scan: got none"):
        field_time(silent, n_scans=1, walk_m=1.0)
    with pytest.raises(RequirementError, match="walking speed"):
        field_time(silent, n_scans=1, walk_m=1.0, seconds_per_scan=1.0, walking_m_per_s=0.0)
    with pytest.raises(RequirementError, match="walk: got inf"):
        field_time(silent, n_scans=1, walk_m=float("inf"), seconds_per_scan=1.0)
