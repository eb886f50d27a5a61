"""Names of stations in the stage and on disk: fit for both, whatever the ids are."""

import dataclasses

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from planner_core.model import Station
from planner_core.plan_folder.tripod import foot_m
from planner_core.plan_folder.usd_names import station_prim_names

CONFUSABLE = ["A", "a", "A_1", "a_1", "A_", "1", "_1", "Ä"]
STATION = Station("S001", "F0", 1, np.array([1.0, 2.0, 4.5]), 1.5)


def named(ids: list[str]) -> list[Station]:
    return [dataclasses.replace(STATION, id=text) for text in ids]


@given(
    ids=st.lists(
        st.one_of(st.text(max_size=60), st.sampled_from(["A", "a", "A_1", "a_1", "A_", "1", "_1", "Ä"])), max_size=9
    )
)
def test_station_names_are_identifiers_and_unique_in_any_case(ids: list[str]) -> None:
    names = station_prim_names(named(ids))
    assert len({name.lower() for name in names}) == len(ids)
    assert [name for name in names if not (name.isidentifier() and name.isascii() and len(name) < 80)] == []


def test_station_names_are_the_ids_where_these_are_fit() -> None:
    assert station_prim_names(named(["S001", "S002", "corner_b"])) == ("S001", "S002", "corner_b")


def test_foot_is_below_the_sensor_and_the_sensor_where_the_height_is_unknown() -> None:
    assert foot_m(STATION).tolist() == [1.0, 2.0, 3.0]
    assert foot_m(dataclasses.replace(STATION, instrument_height_m=float("nan"))).tolist() == [1.0, 2.0, 4.5]
