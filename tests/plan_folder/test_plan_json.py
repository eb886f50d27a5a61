"""plan.json against its published schema, and what it says against the plan."""

import copy
import dataclasses
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from planner_core.errors import PlanFolderError, PlannerError
from planner_core.model import PartResult, Plan
from planner_core.plan_folder.plan_json import DROPPABLE_KEYS, plan_document, plan_text, read_plan_json
from planner_core.plan_folder.stations_csv import read_station_list
from planner_core.requirements.yaml_or_json import read_document

SCHEMA_FILE = Path(__file__).parents[2] / "docs" / "formats" / "plan.schema.json"


def strict(schema: Any) -> Any:
    """The schema with every object closed: readers must ignore new keys, the writer must document each."""
    if isinstance(schema, list):
        return [strict(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    closed = {key: strict(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict):
        closed["additionalProperties"] = False
    return closed


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(SCHEMA_FILE.read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(strict(schema))


@pytest.mark.slow
def test_plan_json_matches_its_schema_key_by_key(plan: Plan, validator: jsonschema.Draft202012Validator) -> None:
    assert [error.message for error in validator.iter_errors(json.loads(plan_text(plan)))] == []


@pytest.mark.slow
def test_plan_json_of_a_plan_without_stations_matches_its_schema(
    plan: Plan, validator: jsonschema.Draft202012Validator
) -> None:
    empty = dataclasses.replace(plan, stations=(), links=(), coverage_curve=(), lower_bound=0, unseen=())
    document = json.loads(plan_text(empty))
    assert [error.message for error in validator.iter_errors(document)] == []
    assert document["optimality"]["lower_bound"] is None
    assert document["optimality"]["gap"] is None


def result(covered_m2: float) -> PartResult:
    """Something of which 90 % is required."""
    return PartResult("part", 0.9, achievable_area_m2=100.0, covered_area_m2=covered_m2, total_area_m2=200.0)


FULL, SHORT = result(90.0), result(89.999)


@pytest.mark.parametrize(
    ("results", "lower_bound", "expected"),
    [
        ((FULL, FULL), 3, (3, 0.0, True)),
        ((FULL, FULL), 2, (2, 0.333333333, False)),
        ((FULL, SHORT), 3, (3, None, False)),
        ((SHORT, SHORT), 5, (5, None, False)),
        ((result(90 * (1 - 1e-12)),), 3, (3, 0.0, True)),
        ((FULL, FULL), 0, (None, None, False)),
    ],
    ids=["proven", "gap", "one misses", "fewer than the bound", "misses by rounding", "no bound"],
)
def test_optimality_compares_only_stations_that_meet_the_requirement(
    plan: Plan,
    validator: jsonschema.Draft202012Validator,
    results: tuple[PartResult, ...],
    lower_bound: int,
    expected: tuple[int | None, float | None, bool],
) -> None:
    document = plan_document(dataclasses.replace(plan, requirements=results, lower_bound=lower_bound))
    assert [error.message for error in validator.iter_errors(document)] == []
    assert tuple(document["optimality"][key] for key in ("lower_bound", "gap", "proven")) == expected
    assert [each["met"] for each in document["requirements"]["results"]] == [each.met for each in results]


def test_schema_refuses_a_station_without_position(plan: Plan, validator: jsonschema.Draft202012Validator) -> None:
    document = plan_document(plan)
    broken = copy.deepcopy(document)
    del broken["stations"][0]["position"]
    assert not validator.is_valid(broken)


def test_positions_and_elevations_are_in_the_scene_frame(plan: Plan) -> None:
    document = plan_document(plan)
    offset = plan.survey.scene.offset_m
    assert document["scene"]["offset"] == offset.tolist()
    for written, station in zip(document["stations"], plan.stations, strict=True):
        np.testing.assert_allclose(written["position"], station.position_m + offset, atol=1e-6)
    assert [floor["elevation_m"] for floor in document["floors"]] == pytest.approx([100.0, 102.8])
    assert document["floors"][0]["bounds"] == [[500000.0, 4000000.0], [500008.0, 4000004.0]]


def test_not_a_number_becomes_null(plan: Plan) -> None:
    assert [link["strength"] for link in plan_document(plan)["registration"]["links"]] == [0.2, None]


def test_plan_json_names_no_folder_of_this_machine(plan: Plan) -> None:
    assert plan_document(plan)["scene"]["file"] == "two floors.ifc"


def test_two_texts_of_one_plan_differ_only_in_droppable_keys(plan: Plan) -> None:
    other = dataclasses.replace(plan, engine="another device", timings_s={"scan": 9.0})
    one, two = json.loads(plan_text(plan)), json.loads(plan_text(other))
    assert one != two
    for key in DROPPABLE_KEYS:
        del one[key], two[key]
    assert json.dumps(one) == json.dumps(two)


def test_written_plan_reads_back(plan: Plan, plan_folder: Path) -> None:
    expected = json.loads(plan_text(plan))
    expected["registration"] |= {
        "networks": [],
        "floor_joins": [],
        "gaps": [],
        "doors_needed": [],
        "joins": [],
    }  # this plan has none worked out
    assert read_plan_json(plan_folder) == expected
    assert read_plan_json(plan_folder / "plan.json") == expected


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"schema": "tlsplan/plan/99"}', "\x00"])
def test_reading_what_is_no_plan_is_refused_with_the_file_named(tmp_path: Path, content: str) -> None:
    file = tmp_path / "plan.json"
    file.write_text(content)
    with pytest.raises(PlanFolderError) as caught:
        read_plan_json(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["house.ifc", "house.GLB", "house.obj"])
def test_a_scene_in_place_of_another_file_is_refused_as_one(tmp_path: Path, name: str) -> None:
    """Of a plan, a station list, requirements: whatever its bytes are."""
    scene = tmp_path / name
    scene.write_bytes(b"ISO-10303-21;\n\xff\x00")
    for read in (read_plan_json, read_station_list, read_document):
        with pytest.raises(PlannerError, match=rf"{name}: (is|got) a scene file, expected a ") as caught:
            read(scene)
        assert "codec" not in str(caught.value)


def test_a_file_of_another_kind_in_place_of_a_plan_is_refused_with_what_to_name(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("to do")
    with pytest.raises(PlanFolderError, match=r"notes\.txt: is not JSON .* name the plan folder$"):
        read_plan_json(tmp_path / "notes.txt")


@pytest.mark.parametrize("levels", [100, 900, 100_000])
@pytest.mark.parametrize("key", ["schema", "stations", "of another version"])
def test_lists_deep_inside_each_other_are_refused_before_they_overflow(
    plan: Plan, tmp_path: Path, levels: int, key: str
) -> None:
    deep = "[" * levels + "]" * levels
    text = json.dumps(plan_document(plan) | {key: "here"}).replace('"here"', deep)
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(PlanFolderError, match="more than 64 lists and mappings inside each other"):
        read_plan_json(tmp_path)
