"""Which station is which: by name, then the nearest pair first."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.as_scanned.matching import check_heights, doubts, matched
from planner_core.errors import RequirementError, StationListError
from planner_core.model import SiteFrame
from planner_core.plan_folder.plan_source import FieldStation
from planner_core.plan_folder.stations_csv import GivenStation


def planned(name: str, x: float, y: float = 0.0, height_m: float = 1.5) -> FieldStation:
    return FieldStation(name, 1, "F0", "Ground", 1, np.array([x, y, 1.5]), height_m, SiteFrame(), False, 1.0, 1.0)


def listed(name: str, x: float, y: float = 0.0, z: float = 1.5) -> GivenStation:
    return GivenStation(name, np.array([x, y, z]), None, None)


def pairs(*found: object) -> list[tuple[str, str]]:
    return [
        (match.planned.id if match.planned else "", match.actual.id if match.actual else "")  # type: ignore[attr-defined]
        for match in found
    ]


def test_names_come_before_places() -> None:
    found = matched([planned("S1", 0.0), planned("S2", 1.0)], [listed("S2", 0.0), listed("s1", 1.0)])
    assert pairs(*found) == [("S1", "s1"), ("S2", "S2")]
    assert {match.by for match in found} == {"name"}


def test_by_place_names_do_not_count() -> None:
    found = matched([planned("S1", 0.0), planned("S2", 1.0)], [listed("S2", 0.0), listed("S1", 1.0)], by="place")
    assert pairs(*found) == [("S1", "S2"), ("S2", "S1")]


def test_further_than_the_distance_nothing_is_matched_by_place() -> None:
    found = matched([planned("S1", 0.0)], [listed("A", 2.01)])
    assert pairs(*found) == [("S1", ""), ("", "A")]
    assert pairs(*matched([planned("S1", 0.0)], [listed("A", 2.0)])) == [("S1", "A")]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), min_size=1, max_size=4, unique=True), st.data())
def test_matching_by_place_does_not_depend_on_the_order_of_the_list(
    places: list[tuple[int, int]], data: st.DataObject
) -> None:
    stations = [planned(f"S{k}", float(x) + 0.013 * k) for k, (x, _) in enumerate(places)]
    there = [listed(f"L{k}", x + y / 37.0) for k, (x, y) in enumerate(places)]
    order = data.draw(st.sampled_from(list(permutations(range(len(there))))))
    found = {match for match in pairs(*matched(stations, there)) if match[0]}
    again = {match for match in pairs(*matched(stations, [there[k] for k in order])) if match[0]}
    assert found == again


def test_every_station_is_in_one_match_only() -> None:
    stations = [planned(f"S{k}", 0.5 * k) for k in range(5)]
    there = [listed(f"L{k}", 0.4 * k + 0.1) for k in range(6)]
    found = pairs(*matched(stations, there))
    assert sorted(a for a, _ in found if a) == [each.id for each in stations]
    assert sorted(b for _, b in found if b) == [each.id for each in there]


def test_a_planned_ground_that_is_not_known_is_not_matched_by_place() -> None:
    on_ground = GivenStation("A", np.array([0.0, 0.0, 0.0]), None, None, is_ground=True)
    assert pairs(*matched([planned("S1", 0.0, height_m=math.nan)], [on_ground])) == [("S1", ""), ("", "A")]
    assert pairs(*matched([planned("S1", 0.0)], [on_ground])) == [("S1", "A")]


@pytest.mark.parametrize("n_turned", [1, 4])
def test_exchanged_names_are_matched_by_place_and_told_in_one_line(n_turned: int) -> None:
    stations = [planned(f"S{k}", 9.0 * k) for k in range(6)]
    crew = [listed(f"S{(k + n_turned) % 6}", 9.0 * k + 0.02 * k) for k in range(6)]
    found = matched(stations, crew)
    assert pairs(*found) == [(f"S{k}", f"S{(k + n_turned) % 6}") for k in range(6)]
    assert all(match.exchanged and match.by == "place" for match in found)
    (line,) = doubts(found)
    assert line.startswith(
        "all 6 planned positions were scanned, only names differ: 6 are listed under names of other stations"
    )
    assert f"(S0 as S{n_turned}, S1 as S{1 + n_turned}, " in line
    assert "and 3 more" in line
    assert not doubts(matched(stations, crew, by="place"))  # as it was asked for


def test_two_exchanged_names_leave_the_others_alone() -> None:
    stations = [planned(f"S{k}", 9.0 * k) for k in range(4)]
    crew = [listed("S0", 0.2), listed("S2", 9.1), listed("S1", 18.1), listed("S3", 27.0)]
    found = matched(stations, crew)
    assert pairs(*found) == [("S0", "S0"), ("S1", "S2"), ("S2", "S1"), ("S3", "S3")]
    assert [match.exchanged for match in found] == [False, True, True, False]


def test_a_crew_that_numbers_on_after_a_station_left_out_misses_that_one_only() -> None:
    stations = [planned(f"S{k}", 9.0 * k, 2.0 * k * k) for k in range(5)]
    at = [each.position_m for each in stations]
    crew = [listed("S0", *at[0][:2]), listed("S1", *at[2][:2]), listed("S2", *at[3][:2]), listed("S3", *at[4][:2])]
    found = matched(stations, crew)
    assert pairs(*found) == [("S0", "S0"), ("S1", ""), ("S2", "S1"), ("S3", "S2"), ("S4", "S3")]
    (line,) = doubts(found)
    assert line.startswith("3 positions are listed under names of other stations (S2 as S1, S3 as S2, S4 as S3)")


def test_a_station_that_moved_to_where_another_stands_keeps_its_name() -> None:
    stations = [planned("S1", 0.0), planned("S2", 9.0), planned("S3", 30.0)]
    found = matched(stations, [listed("S1", 8.0), listed("S2", 9.1), listed("S3", 30.0)])
    assert pairs(*found) == [("S1", "S1"), ("S2", "S2"), ("S3", "S3")]
    (line,) = doubts(found)
    assert "S1: is 8.0 m from its planned position, and 1.00 m from S2; if" in line
    assert "--match place" in line


def test_one_of_many_moved_stations_that_meets_anothers_place_keeps_its_name() -> None:
    stations = [planned(f"S{k}", 9.0 * k) for k in range(4)]
    crew = [listed("S0", 9.5), *(listed(f"S{k}", 9.0 * k, 4.0 + k * k) for k in (1, 2, 3))]
    found = matched(stations, crew)
    assert pairs(*found) == [(f"S{k}", f"S{k}") for k in range(4)]
    assert not any(match.exchanged for match in found)


def test_a_row_of_stations_shifted_to_the_next_ones_places_keeps_its_names() -> None:
    stations = [planned(f"S{k}", 5.0 * k) for k in range(6)]
    found = matched(stations, [listed(each.id, float(each.position_m[0]) + 5.0) for each in stations])
    assert not any(match.exchanged for match in found)
    (line,) = doubts(found)
    assert "all stations are off by the same x +5.00, y +0.00, z +0.00 m: check the list's origin" in line
    assert "--heights" not in line


def test_a_list_that_is_shifted_as_a_whole_is_doubted() -> None:
    stations = [planned(f"S{k}", 3.0 * k) for k in range(4)]
    shifted = [listed(each.id, float(each.position_m[0]), 0.0, 0.0) for each in stations]
    (line,) = doubts(matched(stations, shifted))
    assert "by the same x +0.00, y +0.00, z -1.50 m" in line
    assert "--heights ground" in line
    assert not doubts(matched(stations, [listed(each.id, float(each.position_m[0])) for each in stations]))


def test_a_shift_of_a_list_in_site_coordinates_is_told_in_these() -> None:
    cos, sin = math.cos(0.4), math.sin(0.4)
    matrix = np.array([[cos, -sin, 0.0, 4e5], [sin, cos, 0.0, 5e6], [0.0, 0.0, 1.0, 110.0], [0.0, 0.0, 0.0, 1.0]])
    frame = SiteFrame(matrix, source="given epsg")
    stations = [planned(f"S{k}", 7.0 * k, 2.0 * k * k) for k in range(4)]
    to_east_north = matrix[:3, :3].T @ np.array([5.0, 3.0, 0.0])
    crew = [GivenStation(each.id, each.position_m + to_east_north, None, None) for each in stations]
    (line,) = doubts(matched(stations, crew), 2.0, frame)
    assert "by the same E +5.00, N +3.00, H +0.00 m" in line
    (line,) = doubts(matched(stations, crew))
    assert f"by the same x {5 * cos + 3 * sin:+.2f}, y {3 * cos - 5 * sin:+.2f}, z +0.00 m" in line


def test_another_word_and_no_distance_are_refused() -> None:
    with pytest.raises(RequirementError, match="--match"):
        matched([planned("S1", 0.0)], [], by="number")
    with pytest.raises(RequirementError, match="--within"):
        matched([planned("S1", 0.0)], [], within_m=math.nan)


def test_ground_points_listed_as_sensors_are_refused() -> None:
    stations = [planned(f"S{k}", 3.0 * k, height_m=1.3 + 0.1 * k) for k in range(5)]
    at_ground = [listed(each.id, each.ground_m[0] + 0.3, 0.0, each.ground_m[2] + 0.02) for each in stations]
    with pytest.raises(StationListError, match=r"heights of 5 of 5 stations.*give --heights ground"):
        check_heights(stations, at_ground)
    nearly_all = [*at_ground[:4], listed("S4", 12.0)]
    with pytest.raises(StationListError, match="4 of 5"):
        check_heights(stations, nearly_all)
    others = [listed(f"scan {k}", *each.position_m.tolist()) for k, each in enumerate(at_ground)]
    with pytest.raises(StationListError, match="5 of 5"):
        check_heights(stations, others)
    with pytest.raises(StationListError, match="5 of 5"):
        check_heights(stations, at_ground, by="place")


def test_sensors_and_points_told_to_be_on_the_ground_are_not_refused() -> None:
    stations = [planned(f"S{k}", 3.0 * k) for k in range(5)]
    check_heights(stations, [listed(each.id, each.position_m[0]) for each in stations])
    check_heights(stations, [listed(each.id, each.position_m[0], 0.0, 1.2) for each in stations])
    on_ground = [GivenStation(each.id, each.ground_m, None, None, is_ground=True) for each in stations]
    check_heights(stations, on_ground)
    some = [listed("S0", 0.0, 0.0, 0.0), *(listed(each.id, each.position_m[0]) for each in stations[1:])]
    check_heights(stations, some)
    check_heights([planned("S0", 0.0, height_m=math.nan)], [listed("S0", 0.0, 0.0, 0.0)])
    check_heights([planned("S0", 0.0, height_m=0.0)], [listed("S0", 0.0)])
    check_heights(stations, [])


def test_sensors_too_high_to_be_matched_to_grounds_are_not_refused_for_one_that_lies_there() -> None:
    stations = [planned(f"S{k}", 5.0 * k, height_m=2.5) for k in range(5)]
    there = [listed("A", 0.0, 0.0, -1.0), *(listed(f"L{k}", 5.0 * k) for k in range(1, 5))]
    check_heights(stations, there)
