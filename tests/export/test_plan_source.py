"""What formats are written from: read from a plan folder, in both coordinates."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CoordinatesError, ExportError, PlanFolderError
from planner_core.export.sheets.building import building_of
from planner_core.plan_folder.plan_source import open_plan
from planner_core.progress import ProgressEvent


def test_stations_come_in_walking_order_with_their_floors(written_plan: Callable[..., Path]) -> None:
    plan = open_plan(written_plan())
    assert [(s.id, s.number, s.order, s.floor_id, s.floor_name) for s in plan.stations] == [
        ("S001", 1, 1, "F0", "Ground floor"),
        ("S002", 2, 2, "F1", "Upper floor"),
        ("S003", 3, 3, "F1", "Upper floor"),
    ]
    assert [station.id for station in plan.stations_of("F1")] == ["S002", "S003"]
    assert [(floor.name, floor.elevation_m) for floor in plan.floors] == [("Ground floor", 0.0), ("Upper floor", 2.8)]
    assert plan.title == "house.ifc"


@pytest.mark.parametrize(
    ("names", "numbers"),
    [(("S003", "S001", "S002"), [3, 1, 2]), (("hall", "S001", "S002"), [1, 2, 3]), (("S01", "S001", "S2"), [1, 2, 3])],
)
def test_stations_come_in_the_order_of_the_walk_and_have_the_numbers_of_their_names(
    written_plan: Callable[..., Path], names: tuple[str, ...], numbers: list[int]
) -> None:
    rows = json.loads((written_plan() / "plan.json").read_text())["stations"]
    walked = [{**row, "id": name, "order": order} for row, name, order in zip(rows, names, (2, 9, 10), strict=True)]
    plan = open_plan(written_plan(stations=walked[::-1]))
    assert [station.id for station in plan.stations] == list(names)
    assert [(station.number, station.order) for station in plan.stations] == list(zip(numbers, (1, 2, 3), strict=True))


def test_ground_point_height_and_sensor_are_told_apart(written_plan: Callable[..., Path]) -> None:
    first, second, third = open_plan(written_plan()).stations
    assert first.position_m.tolist() == [5.0, 4.0, 1.6]
    assert first.ground_m.tolist() == [5.0, 4.0, 0.0]
    assert second.ground_m == pytest.approx([2.0, 3.0, 2.8])
    assert math.isnan(third.instrument_height_m)
    assert third.position_m.tolist() == [7.0, 3.0, 4.5]
    assert math.isnan(third.ground_m[2])
    assert (first.fixed, third.fixed) == (False, True)


def test_site_positions_are_those_of_the_frame(written_plan: Callable[..., Path]) -> None:
    request = FrameRequest(origin_m=(100.0, 200.0, 30.0), rotation_rad=math.pi / 2)
    first = open_plan(written_plan(), frame=request).stations[0]
    assert first.site_m == pytest.approx([96.0, 205.0, 31.6])
    assert first.site_ground_m == pytest.approx([96.0, 205.0, 30.0])
    assert first.position_m.tolist() == [5.0, 4.0, 1.6]


def test_links_say_whether_they_count(written_plan: Callable[..., Path]) -> None:
    plan = open_plan(written_plan())
    links = plan.links
    assert [(link.a, link.b, plan.counts(link)) for link in links] == [
        ("S001", "S002", False),
        ("S002", "S003", True),
        ("S001", "S003", False),
        ("S001", "S003", True),
    ]
    assert math.isnan(links[3].strength)


def test_the_file_itself_names_its_folder(written_plan: Callable[..., Path]) -> None:
    folder = written_plan()
    assert open_plan(folder / "plan.json").folder == folder


@pytest.mark.parametrize(
    "instead",
    [
        {"stations": [{"id": "S001"}]},
        {"floors": None},
        {"registration": {}},
        {"scene": {}},
        {"scene": None},
        {"coverage": None},
        {"coverage": {"floors": [3]}},
    ],
)
def test_a_plan_that_nobody_wrote_is_refused_in_one_line(
    written_plan: Callable[..., Path], instead: dict[str, object]
) -> None:
    with pytest.raises(PlanFolderError, match=r"plan\.json.*plan again") as caught:
        open_plan(written_plan(**instead))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("position", [math.nan, 4.0, 1.6], r"stations\[1\]\.position\[0\]: got nan"),
        ("position", [5.0, 4.0, -math.inf], r"stations\[1\]\.position\[2\]: got -inf"),
        ("position", [5.0, None, 1.6], r"stations\[1\]\.position\[1\]: got None"),
        ("position", [5.0, 1e300, 1.6], r"stations\[1\]\.position\[1\]: got 1e\+300"),
        ("instrument_height_m", math.nan, r"stations\[1\]\.instrument_height_m: got nan"),
    ],
)
def test_a_station_that_is_nowhere_is_refused_by_its_place(
    written_plan: Callable[..., Path], key: str, value: object, told: str
) -> None:
    rows = json.loads((written_plan() / "plan.json").read_text())["stations"]
    rows[1][key] = value
    with pytest.raises(PlanFolderError, match=rf"plan\.json: {told}, expected .*; plan again$") as caught:
        open_plan(written_plan(stations=rows))
    assert "\n" not in str(caught.value)


NUMBERS = {
    ("floors", 1, "elevation_m"): "floors[1].elevation_m",
    ("floors", 0, "bounds", 1, 0): "floors[0].bounds[1][0]",
    ("stations", 2, "own_area_m2"): "stations[2].own_area_m2",
    ("stations", 0, "covered_area_m2"): "stations[0].covered_area_m2",
    ("registration", "threshold"): "registration.threshold",
    ("registration", "min_strength"): "registration.min_strength",
    ("registration", "links", 1, "overlap"): "registration.links[1].overlap",
    ("registration", "links", 1, "strength"): "registration.links[1].strength",
    ("coverage", "total_area_m2"): "coverage.total_area_m2",
    ("coverage", "fraction_of_total"): "coverage.fraction_of_total",
    ("coverage", "floors", 0, "covered_area_m2"): "coverage.floors[0].covered_area_m2",
}
FIGURES = {
    "achievable_area_m2": 8.0, "total_area_m2": 10.0, "covered_area_m2": 6.0, "fraction_of_achievable": 0.75,
    "fraction_of_total": 0.6,
}  # fmt: skip


def with_value(folder: Path, place: tuple[str | int, ...], value: object) -> Path:
    """Write one value into the plan.json of a folder, which gets figures of coverage besides."""
    file = folder / "plan.json"
    document = json.loads(file.read_text())
    document["coverage"] = {**FIGURES, "max_patch_area_m2": 0.04, "floors": [{"floor": "F0", **FIGURES}]}
    inner = document
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    file.write_text(json.dumps(document))
    return folder


NO_NUMBERS = (math.nan, 1e300, -5e12, math.inf, -math.inf, "3", True, [1.0], {}, 10**400)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        *((place, value) for place in NUMBERS for value in NO_NUMBERS[:3]),
        *((("floors", 1, "elevation_m"), value) for value in NO_NUMBERS[3:]),
    ],
    ids=lambda value: str(value)[:24],
)
def test_what_is_no_number_there_is_refused_by_its_place(
    written_plan: Callable[..., Path], place: tuple[str | int, ...], value: object
) -> None:
    folder = with_value(written_plan(), place, value)
    with pytest.raises(PlanFolderError) as caught:
        open_plan(folder)
    said = str(caught.value)
    assert said.startswith(f"{folder}/plan.json: {NUMBERS[place]}: got ")
    assert said.endswith("; plan again")
    assert "\n" not in said
    assert len(said) < len(str(folder)) + 250


@pytest.mark.parametrize(
    ("place", "value", "told"),
    [
        (("floors", 0, "id"), 5, "floors[0].id: got 5, expected text"),
        (("floors", 0, "id"), "", "floors[0].id: got '', expected text of one character or more"),
        (("floors", 1, "id"), "F0", "floors: got the id 'F0' of [1] a second time, expected one of its own"),
        (("floors", 0, "name"), None, "floors[0].name: got None, expected text"),
        (("floors", 0, "bounds"), [[0.0, 0.0]], "floors[0].bounds: got [[0.0, 0.0]], expected a longer list"),
        (("floors", 0, "bounds"), [[9.0, 0.0], [1.0, 8.0]], "expected the lower corner first"),
        (("stations", 0, "id"), ["S"], "stations[0].id: got ['S'], expected text"),
        (("stations", 0, "id"), "S001", "stations: got the id 'S001' of [1] a second time, expected one of its own"),
        (("stations", 0, "floor"), 0, "stations[0].floor: got 0, expected text"),
        (("stations", 0, "order"), 1.5, "stations[0].order: got 1.5, expected a whole number"),
        (("stations", 0, "order"), True, "stations[0].order: got True, expected a whole number"),
        (("stations", 0, "position"), "here", "stations[0].position: got 'here', expected a list"),
        (("stations", 0, "fixed"), "no", "stations[0].fixed: got 'no', expected true or false"),
        (("registration", "links", 0, "a"), 1, "registration.links[0].a: got 1, expected text"),
        (("registration", "links", 0, "overlap"), 1.5, "registration.links[0].overlap: got 1.5, expected at most 1"),
        (
            ("registration", "links", 0, "overlap"),
            None,
            "registration.links[0].overlap: got None, expected a finite number",
        ),
        (("registration", "links"), {}, "registration.links: got {}, expected a list"),
        (("scene", "file"), 7, "scene.file: got 7, expected text"),
    ],
)
def test_what_is_of_another_type_is_refused_by_its_place(
    written_plan: Callable[..., Path], place: tuple[str | int, ...], value: object, told: str
) -> None:
    with pytest.raises(PlanFolderError) as caught:
        open_plan(with_value(written_plan(), place, value))
    assert told in str(caught.value)


def test_what_may_be_unknown_is_no_error(written_plan: Callable[..., Path]) -> None:
    plan = open_plan(with_value(written_plan(), ("registration", "links", 0, "strength"), None))
    assert math.isnan(plan.links[0].strength)
    whole = with_value(written_plan(), ("floors", 0, "elevation_m"), 3)
    assert open_plan(whole).floors[0].elevation_m == 3.0


@pytest.mark.parametrize("key", ["scene", "floors", "stations", "registration"])
def test_what_is_missing_is_told_with_the_whole_path(
    written_plan: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    file = written_plan() / "plan.json"
    document = json.loads(file.read_text())
    del document[key]
    file.write_text(json.dumps(document))
    monkeypatch.chdir(file.parent)
    for path in (Path(), Path("plan.json")):
        with pytest.raises(PlanFolderError) as caught:
            open_plan(path)
        assert str(caught.value) == f"{file}: got no {key}, expected all that is needed; plan again"


def test_coordinates_that_can_not_be_had_are_refused(written_plan: Callable[..., Path]) -> None:
    with pytest.raises(CoordinatesError):
        open_plan(written_plan(), frame=FrameRequest(crs="EPSG:4326"))


@pytest.mark.slow
def test_a_planned_scene_brings_its_own_coordinates(box_folder: Path) -> None:
    plan = open_plan(box_folder / "plan")
    assert (plan.frame.source, plan.frame.crs, plan.frame.vertical_crs) == (
        "ifc map conversion", "EPSG:25832", "EPSG:7837",
    )  # fmt: skip
    assert plan.stations
    for station in plan.stations:
        assert np.abs(plan.frame.to_scene(station.site_m) - station.position_m).max() < 1e-6


@pytest.mark.slow
def test_a_plan_of_an_earlier_version_is_in_scene_coordinates(box_folder: Path) -> None:
    file = box_folder / "plan" / "plan.json"
    document = json.loads(file.read_text())
    del document["scene"]["georeference"]
    file.write_text(json.dumps(document))
    assert open_plan(box_folder / "plan").frame.is_scene


@pytest.mark.slow
def test_the_scene_is_loaded_once_and_as_it_was_planned_on(box_folder: Path) -> None:
    plan = open_plan(box_folder / "plan")
    assert plan.has_scene()
    events: list[ProgressEvent] = []
    scene = plan.scene(progress=events.append)
    assert events
    assert plan.scene() is scene
    assert plan.survey() is plan.survey()
    assert plan.survey().patches.n_patches == plan.document["settings"]["n_patches"]
    assert building_of(plan) is building_of(plan)
    other = replace(plan, title="other")
    assert building_of(other) is not building_of(plan), "a changed plan takes nothing along"


@pytest.mark.slow
def test_a_missing_scene_is_told_with_its_name_and_the_option(box_folder: Path) -> None:
    (box_folder / "box.ifc").rename(box_folder / "moved.ifc")
    plan = open_plan(box_folder / "plan")
    assert not plan.has_scene()
    with pytest.raises(ExportError, match=r"box\.ifc.*--scene"):
        plan.scene()
    told = open_plan(box_folder / "plan", scene=box_folder / "moved.ifc")
    assert told.has_scene()
    assert told.scene().n_triangles > 0


def test_a_scene_that_has_changed_is_refused(box_folder: Path) -> None:
    with (box_folder / "box.ifc").open("a") as file:
        file.write("\n")
    with pytest.raises(ExportError, match="has changed"):
        open_plan(box_folder / "plan").scene()


def test_no_plan_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanFolderError, match="no such file"):
        open_plan(tmp_path)
    shutil.rmtree(tmp_path)
    with pytest.raises(PlanFolderError, match="no such file"):
        open_plan(tmp_path)
