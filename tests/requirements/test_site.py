"""Sites from mappings and station lists: what is read, and how what is wrong is named."""

from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import RequirementError
from planner_core.model import KeepOut, PriorStation, Role, Site
from planner_core.requirements.read import requirements_from
from planner_core.requirements.site import check_ids, prior_from

FULL = """
entrances: [[1, 2, 0], [3.5, 2.0, 0.0]]
keep_out:
  - {name: lab, floor: F0, outline: [[0, 0], [4, 0], [4, 3]]}
  - [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
access: [{outline: [[0, 0], [9, 0], [9, 9]], floor: Level 2}]
fixed: [{id: S001, position: [3.0, 2.0, 1.6], height: 1.6, floor: F0}]
locked: [[5, 5, 1.5]]
kept: [{position: [6, 5, 1.5]}]
forbidden: [{position: [5.0, 1.0, 1.6], radius: 1.0}, [7, 7, 1.5]]
robot: {radius: 0.3, step: 0.03, height: 0.6, opens_doors: false}
start: [1, 2, 0]
returns: true
"""


def test_a_full_site_is_read_key_by_key() -> None:
    assert requirements_from({"site": yaml.safe_load(FULL)})[1] == Site(
        entrances_m=((1.0, 2.0, 0.0), (3.5, 2.0, 0.0)),
        keep_out=(
            KeepOut(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0)), floor="F0", name="lab"),
            KeepOut(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), name="site.keep_out[1]"),
            KeepOut(((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)), floor="Level 2", access=True, name="site.access[0]"),
        ),
        prior=(
            PriorStation("S001", (3.0, 2.0, 1.6), "scanned", floor="F0", instrument_height_m=1.6),
            PriorStation("locked-1", (5.0, 5.0, 1.5), "locked"),
            PriorStation("kept-1", (6.0, 5.0, 1.5), "kept"),
            PriorStation("forbidden-1", (5.0, 1.0, 1.6), "forbidden", radius_m=1.0),
            PriorStation("forbidden-2", (7.0, 7.0, 1.5), "forbidden"),
        ),
        carrier_radius_m=0.3,
        step_m=0.03,
        carrier_height_m=0.6,
        opens_doors=False,
        start_m=(1.0, 2.0, 0.0),
        returns=True,
    )


def test_a_walk_that_returns_has_no_other_end() -> None:
    assert requirements_from({"site": {"end": [8, 2, 0], "returns": False}})[1].end_m == (8.0, 2.0, 0.0)
    with pytest.raises(RequirementError, match=r"end of the route: got .*8\.0.* for a route that returns"):
        requirements_from({"site": {"end": [8, 2, 0], "returns": True}})


def test_a_floor_may_be_named_by_zero() -> None:
    site = requirements_from({"site": {"keep_out": [{"floor": 0, "name": 0, "outline": [[0, 0], [1, 0], [1, 1]]}]}})[1]
    assert (site.keep_out[0].floor, site.keep_out[0].name) == ("0", "0")
    assert requirements_from({"site": {"kept": [{"floor": 0, "id": 0, "position": [0, 0, 1]}]}})[1].prior == (
        PriorStation("0", (0.0, 0.0, 1.0), "kept", floor="0"),
    )


def test_null_and_empty_names_are_as_if_left_out() -> None:
    for nothing in (None, "", " "):
        named = {"floor": nothing, "name": nothing, "outline": [[0, 0], [1, 0], [1, 1]]}
        assert requirements_from({"site": {"access": [named]}})[1].keep_out == (
            KeepOut(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), access=True, name="site.access[0]"),
        )
        told = {"id": nothing, "floor": nothing, "position": [0, 0, 1]}
        assert requirements_from({"site": {"fixed": [told, told]}})[1].prior == (
            PriorStation("fixed-1", (0.0, 0.0, 1.0), "scanned"),
            PriorStation("fixed-2", (0.0, 0.0, 1.0), "scanned"),
        )


def test_an_empty_site_is_the_default_site() -> None:
    assert requirements_from({"site": {}})[1] == Site()
    assert requirements_from({"site": {"robot": None, "keep_out": None, "start": None}})[1] == Site()


@pytest.mark.parametrize(
    ("mapping", "named"),
    [
        ({"keepout": []}, "site: got the unknown entry 'keepout', expected a known one; did you mean keep_out?"),
        ({"banana": []}, "got the unknown entry 'banana', expected a known one; known are entrances, keep_out"),
        ([1, 2], "site: got \\[1, 2\\], expected keys with values"),
        ({"entrances": [1, 2, 0]}, r"site.entrances\[0\]: got 1, expected 3 numbers: x, y, z in metres, scene frame"),
        ({"entrances": [[1, 2]]}, r"site.entrances\[0\]: got \[1, 2\], expected 3 numbers"),
        ({"entrances": "1,2,3"}, "site.entrances: got '1,2,3', expected a list"),
        ({"entrances": [[1, 2, float("nan")]]}, "expected 3 finite numbers"),
        ({"entrances": [[1, True, 2]]}, "expected 3 finite numbers"),
        ({"keep_out": [[[0, 0], [1, 1]]]}, r"site.keep_out\[0\]: got an outline of 2 corners, expected"),
        (
            {"keep_out": [[[0, 0], [1, 1], [1, 0], [0, 1]]]},
            "an outline that crosses itself, its sides 1 and 3, expected",
        ),
        ({"keep_out": [[[0, 0], [1, 0], [1, 1], [1, 0]]]}, r"keep_out\[0\]: got corner 4 where corner 2 is, expected"),
        ({"keep_out": [[[0, 0], [1, 0], [1, 1], [0, 0], [0, 0]]]}, "got corner 4 where corner 1 is"),
        ({"access": [[[0, 0], [0.1, 0.3], [0.2, 0.6]]]}, r"site.access\[0\]: got an outline without area, expected"),
        ({"access": [[[5e6, 5e6], [5e6 + 1, 5e6], [5e6 + 2, 5e6]]]}, "got an outline without area"),
        ({"access": [[[i, i * i] for i in range(10_001)]]}, "got an outline of 10001 corners, expected 3 to 10000"),
        ({"keep_out": [{"name": "a"}]}, r"site.keep_out\[0\]: got no outline"),
        ({"keep_out": [{"outline": [[0, 0], [1], [1, 1]]}]}, r"site.keep_out\[0\].outline\[1\]: got \[1\], expected 2"),
        ({"fixed": [{"id": "A"}]}, r"site.fixed\[0\]: got no position"),
        ({"fixed": [{"position": [0, 0, 1], "radius": 1}]}, "got the unknown entry 'radius'"),
        ({"fixed": [{"position": [0, 0, 1], "height": -1}]}, r"site.fixed\[0\].height: got -1, expected a number"),
        ({"fixed": "stations.csv"}, "site.fixed: got 'stations.csv', expected a list"),
        ({"forbidden": [{"position": [0, 0, 1], "radius": "1 m"}]}, r"forbidden\[0\].radius: got '1 m'"),
        (
            {"fixed": [{"id": "A", "position": [0, 0, 1]}], "locked": [{"id": "A", "position": [1, 0, 1]}]},
            "got the id 'A' twice",
        ),
        ({"robot": {"radius": "big"}}, "site.robot.radius: got 'big', expected a number of metres"),
        ({"robot": {"with": 1}}, "site.robot: got the unknown entry 'with'"),
        ({"robot": [0.3]}, "site.robot: got \\[0.3\\], expected keys with values"),
        ({"returns": "yes"}, "site.returns: got 'yes', expected true or false"),
        ({"start": [1, 2]}, "site.start: got"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(mapping: Any, named: str) -> None:
    with pytest.raises(RequirementError, match=named.replace("?", "[?]")) as error:
        requirements_from({"site": mapping})
    assert "\n" not in str(error.value)


@settings(max_examples=25)
@given(st.recursive(st.none() | st.booleans() | st.floats() | st.text(max_size=3), lambda c: st.lists(c, max_size=4)))
def test_any_value_of_any_key_is_read_or_refused_by_name(value: Any) -> None:
    for key in ("entrances", "keep_out", "fixed", "forbidden", "robot", "start", "returns"):
        try:
            site = requirements_from({"site": {key: value}})[1]
        except RequirementError as error:
            assert str(error).startswith(f"requirements: site.{key}")
        else:
            assert isinstance(site, Site)


def test_stations_of_a_list_get_their_role_floor_and_height() -> None:
    given_stations = [("A", np.array([1.0, 2.0, 3.0]), "F1", 1.5), ("B", (4, 5, 6), None, None)]
    assert prior_from(given_stations, "locked") == (
        PriorStation("A", (1.0, 2.0, 3.0), "locked", floor="F1", instrument_height_m=1.5),
        PriorStation("B", (4.0, 5.0, 6.0), "locked"),
    )
    assert prior_from(given_stations, "forbidden", radius_m=2.0)[1].radius_m == 2.0
    for role in Role:
        assert {station.role for station in prior_from(given_stations, role)} == {role}


@pytest.mark.parametrize(
    ("stations", "role", "named"),
    [
        ([("A", (0, 0, 1), None, None)], "fixed", "role: got 'fixed', expected one of scanned, locked"),
        ([("A", (0, 0), None, None)], "locked", "locked station A: got"),
        ([("A", (0, 0, 1), None, float("inf"))], "locked", "locked station A: got inf, expected a number of metres"),
        ([("A", (0, 0, 1), None, None)] * 2, "kept", "got the id 'A' twice"),
    ],
)
def test_lists_that_make_no_sense_are_refused(stations: list[Any], role: str, named: str) -> None:
    with pytest.raises(RequirementError, match=named):
        prior_from(stations, role)


def test_places_that_are_forbidden_need_no_id_of_their_own() -> None:
    forbidden = prior_from([("A", (0, 0, 1), None, None)] * 2, "forbidden")
    assert len(forbidden) == 2
    check_ids((*forbidden, *prior_from([("A", (0, 0, 1), None, None)], "locked")))
