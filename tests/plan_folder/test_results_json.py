"""The walk, field time and unreachable rooms in plan.json: against the schema, and against the plan."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from planner_core.model import FieldTime, Plan, UnreachableArea
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.results_json import unreachable_document
from planner_core.positions.free_space import free_space
from planner_core.positions.local_site import Ends
from planner_core.positions.reach import reachability
from planner_core.route.route import plan_route

SCHEMA_FILE = Path(__file__).parents[2] / "docs" / "formats" / "plan.schema.json"


def walked(plan: Plan, ends: Ends) -> Plan:
    """The hand-made plan with its walk: two rooms joined by a doorway, and an upper floor that no stairs lead to."""
    stations = plan.stations
    floor_ids = [floor.id for floor in plan.survey.floors]
    route = plan_route(
        reachability(plan.survey, free_space(plan.survey)),
        np.array([station.position_m for station in stations]),
        np.array([station.instrument_height_m for station in stations]),
        np.array([floor_ids.index(station.floor) for station in stations], dtype=np.int32),
        ends=ends,
    )
    unreachable = UnreachableArea(1, 6.25, np.array([1.0, 1.0, 2.8]), np.array([[[0.0, 0.0], [2.5, 2.5]]]))
    return dataclasses.replace(plan, route=route, field_time=FieldTime(None, 180.0, 4.26), unreachable=(unreachable,))


@pytest.fixture(scope="module")
def document(plan: Plan) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(plan_text(walked(plan, Ends(np.array([0.6, 2.0, 0.0])))))
    return found


@pytest.mark.slow
def test_walk_field_time_and_sealed_rooms_match_the_schema(document: dict[str, Any]) -> None:
    schema = json.loads(SCHEMA_FILE.read_text())
    for key in ("route", "field_time", "sealed"):
        jsonschema.validate(document[key], {**schema["properties"][key], "$defs": schema["$defs"]})
    assert set(document["route"]) == set(schema["$defs"]["RouteSection"]["properties"])
    assert set(document["route"]["legs"][0]) == set(schema["$defs"]["LegSection"]["properties"])
    with pytest.raises(jsonschema.ValidationError):
        route = {**schema["$defs"]["RouteSection"], "$defs": schema["$defs"]}
        jsonschema.validate({**document["route"], "start": [1.0, 2.0]}, route)


def test_legs_name_their_stations_and_lead_from_one_to_the_next(plan: Plan, document: dict[str, Any]) -> None:
    route = document["route"]
    assert [(leg["from"], leg["to"]) for leg in route["legs"]] == [(None, "S001"), ("S001", "S002"), ("S002", "S003")]
    assert route["order"] == ["S001", "S002", "S003"]
    assert [leg["floors"] for leg in route["legs"]] == [["F0"], ["F0"], []]
    assert route["legs"][2]["length_m"] is None
    assert route["n_unwalkable"] == 1
    for leg in route["legs"][:2]:
        length_m = np.linalg.norm(np.diff(leg["points"], axis=0), axis=1).sum()
        assert leg["length_m"] == pytest.approx(length_m, abs=2e-3)
    assert route["length_m"] == pytest.approx(sum(leg["length_m"] for leg in route["legs"][:2]), abs=2e-3)


def test_places_of_the_walk_are_in_the_scene_frame(plan: Plan, document: dict[str, Any]) -> None:
    offset_m = plan.survey.scene.offset_m
    first = document["route"]["legs"][0]["points"]
    assert first[-1] == pytest.approx([2.0 + offset_m[0], 2.0 + offset_m[1], offset_m[2]], abs=1e-3)
    assert document["route"]["start"] == first[0]
    assert document["route"]["end"] is None
    inside = [1.0 + offset_m[0], 1.0 + offset_m[1], 2.8 + offset_m[2]]
    low, high = offset_m[:2], offset_m[:2] + 2.5
    told = {"floor": "F1", "area_m2": 6.25, "inside": pytest.approx(inside)}
    assert document["sealed"] == [{**told, "rectangles": [[pytest.approx(low), pytest.approx(high)]]}]


def test_strips_of_a_sealed_room_are_told_as_few_rectangles_of_the_same_ground(plan: Plan) -> None:
    offset_m = plan.survey.scene.offset_m[:2]
    ell = [((0.0, 0.05 * row), (2.0 if row < 20 else 0.5, 0.05 * (row + 1))) for row in range(40)]
    beside = [((3.0, 0.05 * row), (3.5, 0.05 * (row + 1))) for row in range(10)]
    strips_m = np.array([*ell, *beside])
    unreachable = UnreachableArea(1, 1.0, np.array([1.0, 1.0, 2.8]), strips_m)
    told = (
        np.array(unreachable_document(dataclasses.replace(plan, unreachable=(unreachable,)))[0]["rectangles"])
        - offset_m
    )
    assert sorted(told.tolist()) == pytest.approx(
        np.array(sorted([[[0, 0], [2, 1]], [[0, 1], [0.5, 2]], [[3, 0], [3.5, 0.5]]])), abs=2e-3
    )


def test_unknown_time_of_scanning_is_null_and_so_is_the_total(document: dict[str, Any]) -> None:
    assert document["field_time"] == {"scanning_s": None, "set_up_s": 180.0, "walking_s": 4.3, "total_s": None}
