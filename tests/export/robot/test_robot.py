"""Missions: waypoints and ways on the house of robot_house.py, read back with json, PyYAML, Pillow and GDAL."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
import yaml
from PIL import Image
from robot_house import HEIGHT_M, KEEP_OUT, STATIONS

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import ExportError
from planner_core.plan_folder.plan_source import PlanSource, open_plan

Mission = Callable[..., tuple[Path, tuple[str, ...]]]
UTM = FrameRequest(crs="EPSG:25832", origin_m=(691234.5, 5334567.25, 515.0), rotation_rad=math.radians(30.0))


def document_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "mission.json").read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def pixel_at(folder: Path, floor: str, places: Any) -> Any:
    told = yaml.safe_load((folder / "maps" / f"{floor}.yaml").read_text(encoding="utf-8"))
    pixels = np.asarray(Image.open(folder / "maps" / told["image"]))
    index = np.floor((np.asarray(places)[:, :2] - told["origin"][:2]) / told["resolution"]).astype(int)
    return pixels[pixels.shape[0] - 1 - index[:, 1], index[:, 0]]


def along(points: Any, step_m: float = 0.01) -> Any:
    corners = np.asarray(points)
    parts = [
        a + (b - a) * np.linspace(0, 1, max(2, math.ceil(np.linalg.norm(b - a) / step_m)))[:, None]
        for a, b in pairwise(corners)
    ]
    return np.concatenate(parts)


@pytest.mark.slow
def test_waypoints_are_the_stations_of_the_walk_on_free_ground(house_plan: PlanSource, mission: Mission) -> None:
    folder, _ = mission(house_plan)
    waypoints = document_of(folder)["waypoints"]
    assert [point["id"] for point in waypoints] == ["S1", "S2", "S3", "S4"]
    for point in waypoints:
        x, y, z = STATIONS[point["id"]]
        assert point["position_m"] == pytest.approx([x, y, z], abs=1e-4)
        assert point["sensor_m"] == pytest.approx([x, y, z + HEIGHT_M], abs=1e-4)
        assert (point["scan_s"], point["set_up_s"], point["wait_s"]) == (90.0, 45.0, 135.0)
        assert pixel_at(folder, point["floor"], [point["position_m"]]) == [254]


def test_clearance_is_the_way_to_the_nearest_box(house_plan: PlanSource, mission: Mission) -> None:
    # S1 is 0.6 m from a wall; S2 1.0 m from walls and table, which is the cap; the others have more room.
    expected = {"S1": 0.6, "S2": 1.0, "S3": 1.0, "S4": 1.0}
    told = {point["id"]: point["clearance_m"] for point in document_of(mission(house_plan)[0])["waypoints"]}
    assert told == pytest.approx(expected, abs=0.071)  # cells of 5 cm


@pytest.mark.slow
def test_a_robot_on_wheels_has_no_stairs(house_plan: PlanSource, mission: Mission) -> None:
    site = {**house_plan.document["site"], "step_m": 0.03, "mover_radius_m": 0.2, "mover_height_m": 0.6}
    folder, remarks = mission(replace(house_plan, document={**house_plan.document, "site": site}))
    assert pixel_at(folder, "F0", [[7.8, 4.5], [6.5, 4.5]]).tolist() == [0, 0]
    assert pixel_at(folder, "F0", [[9.0, 4.5]]) == [254]
    assert not any("climb steps" in remark for remark in remarks)


def test_ways_stay_on_free_ground_of_their_floor(house_plan: PlanSource, mission: Mission) -> None:
    folder, _ = mission(house_plan)
    paths = document_of(folder)["paths"]
    assert [(path["from"], path["to"]) for path in paths] == [("S1", "S2"), ("S2", "S3"), ("S3", "S4")]
    for path in paths:
        for piece in path["pieces"]:
            assert piece["map"] == piece["floor"]
            # Its ends are on the borders of cells where the map changes.
            met = set(pixel_at(folder, piece["map"], along(piece["points_m"])[1:-1]).tolist())
            assert met == {254}, (path["from"], piece["map"])
        assert path["as_planned"]


def test_ways_join_up_and_are_as_long_as_said(house_plan: PlanSource, mission: Mission) -> None:
    for path in document_of(mission(house_plan)[0])["paths"]:
        points = [np.asarray(piece["points_m"]) for piece in path["pieces"]]
        for before, after in pairwise(points):
            assert before[-1].tolist() == after[0].tolist()
        for name, at in ((path["from"], points[0][0]), (path["to"], points[-1][-1])):
            assert at[:2] == pytest.approx(STATIONS[name][:2], abs=0.05)
        length = sum(np.linalg.norm(np.diff(part, axis=0), axis=1).sum() for part in points)
        assert length == pytest.approx(path["length_m"], rel=0.02)


def test_the_flight_changes_the_floor_once(house_plan: PlanSource, mission: Mission) -> None:
    pieces = document_of(mission(house_plan)[0])["paths"][2]["pieces"]
    assert [piece["floor"] for piece in pieces] == ["F0", "F1"]
    x, y, z = pieces[1]["points_m"][0]
    assert x == pytest.approx(8.2 - 12 * 2.7 / 14, abs=0.06)  # the last two steps are the upper floor's
    assert 4.0 < y < 5.0
    assert 2.3 < z < 2.7


def test_headings_are_those_of_arrival_and_of_departure_first(house_plan: PlanSource, mission: Mission) -> None:
    document = document_of(mission(house_plan)[0])
    first, *others = document["waypoints"]
    start = np.asarray(document["paths"][0]["pieces"][0]["points_m"])
    assert first["heading_of"] == "departure"
    assert first["heading_rad"] == pytest.approx(math.atan2(*(start[1] - start[0])[[1, 0]]), abs=1e-3)
    for point, path in zip(others, document["paths"], strict=True):
        corners = np.asarray(path["pieces"][-1]["points_m"])
        assert point["heading_of"] == "arrival"
        assert point["heading_rad"] == pytest.approx(math.atan2(*(corners[-1] - corners[-2])[[1, 0]]), abs=1e-3)


def test_json_and_yaml_say_the_same(house_plan: PlanSource, mission: Mission) -> None:
    folder, _ = mission(house_plan)
    assert yaml.safe_load((folder / "mission.yaml").read_text(encoding="utf-8")) == document_of(folder)


def test_what_is_not_visited_says_why(house_plan: PlanSource, mission: Mission) -> None:
    folder, remarks = mission(house_plan)
    assert document_of(folder)["not_visited"] == [{"id": "S5", "reason": "no way leads there"}]
    assert "S5 not on the route: no waypoints" in remarks
    assert any("climb steps of up to 0.25 m" in remark for remark in remarks)


def moved(plan: PlanSource, places: dict[str, tuple[float, float, float]]) -> PlanSource:
    """The plan with stations elsewhere, and a walk from each straight to the next."""
    ground = {**{name: STATIONS[name] for name in ("S1", "S2", "S3", "S4")}, **places}
    stations = tuple(
        replace(each, position_m=np.add(ground[each.id], [0, 0, HEIGHT_M]))
        for each in plan.stations
        if each.id in ground
    )
    legs = [
        {
            "from": a,
            "to": b,
            "points": [ground[a], ground[b]],
            "length_m": math.dist(ground[a], ground[b]),
            "floors": [],
        }
        for a, b in pairwise(ground)
    ]
    return replace(
        plan,
        stations=stations,
        document={**plan.document, "route": {**plan.document["route"], "legs": legs, "left_out": []}},
    )


def test_a_station_in_an_edges_cell_stays_and_is_told(house_plan: PlanSource, mission: Mission) -> None:
    # Right beside the flight's flank, which is at y 4, and on the table.
    folder, remarks = mission(moved(house_plan, {"S3": (7.6, 3.96, 0.0), "S1": (1.5, 1.5, 0.75)}))
    document = document_of(folder)
    points = {point["id"]: point for point in document["waypoints"]}
    assert points["S3"]["position_m"] == [7.6, 3.96, 0.0]
    assert {name: point["cell"] for name, point in points.items()} == {
        "S1": "occupied", "S2": "free", "S3": "occupied", "S4": "free"
    }  # fmt: skip
    assert points["S1"]["clearance_m"] is None
    assert points["S3"]["clearance_m"] is not None
    (told,) = (remark for remark in remarks if "on an occupied cell" in remark)
    assert told.startswith("S1, S3 on an occupied cell of the map, where something stands or the ground ends")
    assert not any("not above walkable ground" in remark for remark in remarks)
    assert pixel_at(folder, "F0", [points["S3"]["position_m"], points["S1"]["position_m"]]).tolist() == [0, 0]
    # The way ends beside it, where a robot can stand.
    (path,) = (path for path in document["paths"] if path["to"] == "S3")
    assert not path["as_planned"]
    end = path["pieces"][-1]["points_m"][-1]
    assert 0.05 < math.dist(end, points["S3"]["position_m"]) < 0.6


@pytest.mark.slow
def test_ways_through_what_stands_are_laid_around_it(house_plan: PlanSource, mission: Mission) -> None:
    folder, remarks = mission(moved(house_plan, {"S3": (6.0, 0.6, 0.0)}))
    document = document_of(folder)
    # Straight from S1 to S2 is the table, from S2 to S3 the wall; from S3 to S4 there is no straight line at all.
    assert [(path["to"], path["as_planned"]) for path in document["paths"]] == [
        ("S2", False), ("S3", False), ("S4", False)
    ]  # fmt: skip
    assert (
        "the path from S1 to S2, S2 to S3, S3 to S4 crosses occupied cells or a drop: rerouted around them" in remarks
    )
    for path in document["paths"]:
        for piece in path["pieces"]:
            assert set(pixel_at(folder, piece["map"], along(piece["points_m"])[1:-1]).tolist()) == {254}
    (through,) = (path for path in document["paths"] if path["to"] == "S3")
    crossed = [x for a in [along(through["pieces"][0]["points_m"])] for x, y, _ in a if 2.0 < y < 3.0]
    assert min(crossed) < 4.0
    assert max(crossed) > 4.2  # the gap in the wall
    length = sum(math.dist(*ends) for ends in pairwise(through["pieces"][0]["points_m"]))
    assert through["length_m"] == pytest.approx(length, abs=2e-3)


def test_keep_outs_are_told_and_kept_to(house_plan: PlanSource, mission: Mission) -> None:
    document = document_of(mission(house_plan)[0])
    (zone,) = document["keep_out"]
    assert zone["floor"] == "F0"
    assert zone["outline"] == [list(corner) for corner in KEEP_OUT]
    area = shapely.Polygon(zone["outline"])
    lines = [shapely.LineString(piece["points_m"]) for path in document["paths"] for piece in path["pieces"]]
    assert not any(area.intersects(line) for line in lines)


@pytest.mark.slow
def test_a_far_scene_is_told_near_its_map_and_led_back(far_plan: PlanSource, mission: Mission) -> None:
    folder, _ = mission(far_plan)
    document = document_of(folder)
    offset = np.array(document["frame"]["scene_offset_m"])
    assert np.abs(offset).max() > 1e6
    for point in document["waypoints"]:
        assert np.abs(point["position_m"][:2]).max() < 20.0
        expected = np.add(STATIONS[point["id"]], [691000.0, 5334000.0, 500.0])
        assert np.array(point["position_m"]) + offset == pytest.approx(expected, abs=1e-4)
        on_site = np.array(document["site"]["map_to_site"]) @ [*point["position_m"], 1.0]
        assert on_site[:3] == pytest.approx(point["site_ground_m"], abs=2e-4)
        assert pixel_at(folder, point["floor"], [point["position_m"]]) == [254]
    for path in document["paths"]:
        for name, at in (
            (path["from"], path["pieces"][0]["points_m"][0]),
            (path["to"], path["pieces"][-1]["points_m"][-1]),
        ):
            assert np.add(at, offset)[:2] == pytest.approx(
                np.add(STATIONS[name], [691000.0, 5334000.0, 0])[:2], abs=0.05
            )
    corners = np.array(document["keep_out"][0]["outline"]) + offset[:2]
    assert corners == pytest.approx(np.add(KEEP_OUT, [691000.0, 5334000.0]), abs=1e-3)


def test_geojson_is_where_proj_puts_it(house_folder: Path, mission: Mission) -> None:
    folder, remarks = mission(open_plan(house_folder, frame=UTM))
    meta, _, shapes, columns = pyogrio.raw.read(folder / "mission.geojson")
    assert meta["crs"] == "EPSG:4326"
    fields = [dict(zip(meta["fields"], values, strict=True)) for values in zip(*columns, strict=True)]
    project = pyproj.Proj("+proj=utm +zone=32 +ellps=GRS80")
    points = {
        row["id"]: shape
        for row, shape in zip(fields, shapely.from_wkb(shapes), strict=True)
        if row["kind"] == "waypoint"
    }
    assert list(points) == ["S1", "S2", "S3", "S4"]
    for name, shape in points.items():
        x, y, _ = STATIONS[name]
        east = 691234.5 + math.cos(math.radians(30)) * x - math.sin(math.radians(30)) * y
        north = 5334567.25 + math.sin(math.radians(30)) * x + math.cos(math.radians(30)) * y
        assert shapely.get_coordinates(shape)[0] == pytest.approx(project(east, north, inverse=True), abs=1.01e-9)
    assert sum(row["kind"] == "path" for row in fields) == 4
    assert any("longitude and latitude by" in remark for remark in remarks)
    assert document_of(folder)["site"]["crs"] == "EPSG:25832"


def test_without_a_crs_no_file_that_every_reader_takes_for_degrees_is_written(
    house_plan: PlanSource, mission: Mission
) -> None:
    folder, remarks = mission(house_plan)
    assert sorted(path.name for path in folder.iterdir()) == ["maps", "mission.json", "mission.yaml"]
    (told,) = [remark for remark in remarks if "mission.geojson" in remark]
    assert "left out" in told and "give --crs and --origin" in told
    assert document_of(folder)["waypoints"][0]["position_m"] == pytest.approx(STATIONS["S1"])


def test_one_floor_has_its_map_and_waypoints_only(house_plan: PlanSource, mission: Mission) -> None:
    folder, _ = mission(house_plan, floors=("F1",))
    assert sorted(path.name for path in (folder / "maps").iterdir()) == ["F1.png", "F1.yaml"]
    document = document_of(folder)
    assert [(entry["map"], entry["floor"]) for entry in document["maps"]] == [("F1", "F1")]
    assert [point["id"] for point in document["waypoints"]] == ["S4"]
    assert [path["to"] for path in document["paths"]] == ["S4"]
    assert [piece["map"] for piece in document["paths"][0]["pieces"]] == [None, "F1"]


@pytest.mark.slow
def test_the_same_plan_gives_the_same_bytes(house_plan: PlanSource, mission: Mission) -> None:
    folders = [mission(house_plan)[0], mission(house_plan, again=True)[0]]
    first, again = ({path.relative_to(folder): path.read_bytes() for path in folder.rglob("*.*")} for folder in folders)
    assert first == again
    assert len(first) == 6


def test_a_plan_without_a_walk_has_waypoints_without_headings(house_plan: PlanSource, mission: Mission) -> None:
    plan = replace(house_plan, document={**house_plan.document, "route": None})
    folder, remarks = mission(plan)
    document = document_of(folder)
    assert document["paths"] == []
    assert {(point["heading_rad"], point["heading_of"]) for point in document["waypoints"]} == {(None, None)}
    assert "the plan has no route, so none is written" in remarks
    assert "S5 not above walkable ground: a robot can't get there" in remarks
    (roof,) = (point for point in document["waypoints"] if point["id"] == "S5")
    assert roof["clearance_m"] is None


def test_scanned_stations_off_the_walk_are_not_visited(house_plan: PlanSource, mission: Mission) -> None:
    route = {**house_plan.document["route"], "legs": house_plan.document["route"]["legs"][:2], "left_out": ["S5"]}
    scanned = {"id": "S4", "role": "scanned", "floor": "F1", "instrument_height_m": HEIGHT_M, "radius_m": None}
    prior = [{**scanned, "position": [2.0, 4.0, 4.2]}]
    site = {**house_plan.document["site"], "settled": prior}
    plan = replace(house_plan, document={**house_plan.document, "route": route, "site": site})
    document = document_of(mission(plan)[0])
    assert document["not_visited"][0] == {"id": "S4", "reason": "scanned before"}


def test_a_station_of_unknown_height_is_not_visited(house_plan: PlanSource, mission: Mission) -> None:
    stations = tuple(
        replace(each, instrument_height_m=math.nan) if each.id == "S2" else each for each in house_plan.stations
    )
    document = document_of(mission(replace(house_plan, stations=stations))[0])
    assert [point["id"] for point in document["waypoints"]] == ["S1", "S3", "S4"]
    assert {"id": "S2", "reason": "its instrument height is not known"} in document["not_visited"]


@pytest.mark.slow
def test_a_walk_that_returns_comes_back_to_the_first_stop(house_plan: PlanSource, mission: Mission) -> None:
    legs = house_plan.document["route"]["legs"]
    home = {**legs[0], "from": "S2", "to": "S1", "points": legs[0]["points"][::-1]}
    route = {**house_plan.document["route"], "legs": [legs[0], home], "left_out": []}
    plan = replace(house_plan, document={**house_plan.document, "route": route})
    first, second = document_of(mission(plan)[0])["waypoints"][:2]
    assert (first["id"], first["heading_of"]) == ("S1", "departure")
    assert (second["id"], second["heading_of"]) == ("S2", "arrival")


def test_a_missing_scene_is_told_with_its_name(house_folder: Path, tmp_path: Path, mission: Mission) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "plan.json").write_bytes((house_folder / "plan.json").read_bytes())
    with pytest.raises(ExportError, match=r"house\.obj.*--scene"):
        mission(open_plan(alone))
