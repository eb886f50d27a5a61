"""Drawings of floors: walls, unseen surface, the walk, stations however many."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner_core.errors import PlanFolderError
from planner_core.export.sheets import floor_view
from planner_core.export.sheets.building import Building, read_building
from planner_core.export.sheets.floor_view import view_floor
from planner_core.model import FOOT
from planner_core.plan_folder.drawing.marks import rise_words
from planner_core.plan_folder.floor_marks import zones_on
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.scene.patches import patch_triangles


@pytest.mark.parametrize(("floor", "height_m"), [(0, 3.1), (1, 2.4), (2, 4.0), (3, 4.0)])
def test_surface_belongs_to_a_floor_up_to_the_next_one_or_four_metres(floor: int, height_m: float) -> None:
    floors = [SimpleNamespace(elevation_m=z) for z in (10.0, 13.1, 15.5, 19.6)]
    plan: Any = SimpleNamespace(floors=floors)
    assert floor_view._storey_m(plan, plan.floors[floor]) == pytest.approx(height_m)


def test_walls_are_dark_where_they_stand_and_rooms_are_not(site_sheets: Any, site_plan: PlanSource) -> None:
    page = site_sheets.drawing("Level 1")
    to_paper = site_sheets.to_paper(page, site_plan, "F0")
    pixels = site_sheets.pixels(page, dpi=200).mean(axis=2)

    def shade(x: float, y: float) -> float:
        """Median of a square of 1.5 mm."""
        column, row = np.rint(to_paper(x + 40_300, y + 20_200) / 25.4 * 200).astype(int)
        part = pixels[pixels.shape[0] - row - 6 : pixels.shape[0] - row + 6, column - 6 : column + 6]
        return float(np.median(part))

    for x, y in ((-0.1, 2.0), (10.1, 2.0), (6.0, -0.1), (6.0, 5.1), (4.1, 1.0), (4.1, 4.0)):
        assert 0.25 < shade(x, y) < 0.6, (x, y)
    for x, y in ((2.0, 4.2), (4.1, 2.8), (8.0, 3.0), (1.5, 1.5), (-0.5, 2.0)):
        assert shade(x, y) > 0.9, (x, y)


def test_rooms_have_their_names_on_their_floor_and_damaged_lists_of_them_are_refused(
    site_plan: PlanSource, sheet_folder: Path, tmp_path: Path
) -> None:
    copy = shutil.copytree(sheet_folder, tmp_path / "copy")
    layers = copy / "viewer" / "layers.json"
    first, second = site_plan.floors[0].id, site_plan.floors[-1].id
    rooms = [("Kitchen", first, [1.0, 2.0, 0.0]), ("", first, [3.0, 2.0, 0.0]), ("Bath\n2", second, [4.0, 1.0, 3.0])]
    listed = [{"name": name, "floor": floor, "label": label} for name, floor, label in rooms]
    layers.write_text(json.dumps({**json.loads(layers.read_text()), "rooms": {"list": listed}}))
    plan = open_plan(copy)
    x, y, _ = plan.document["scene"]["offset"]
    marks = [[(mark.words, *mark.at_m) for mark in view_floor(plan, floor, None).rooms] for floor in plan.floors]
    assert marks[0] == [("Kitchen", 1.0 + x, 2.0 + y)]
    assert marks[-1] == [("Bath 2", 4.0 + x, 1.0 + y)]
    layers.write_text('{"rooms": {"list": [{"name": "Hall"}]}}')
    with pytest.raises(PlanFolderError, match=r"layers\.json: got no list of rooms.*plan again"):
        open_plan(copy)
    layers.unlink()
    assert open_plan(copy).rooms == ()


def test_floor_is_hatched_where_no_station_sees_it(site_sheets: Any, site_plan: PlanSource, sheet_folder: Path) -> None:
    building = read_building(sheet_folder)
    assert isinstance(building, Building)
    page = site_sheets.drawing("Level 1")
    to_paper = site_sheets.to_paper(page, site_plan, "F0")
    pixels = site_sheets.pixels(page, dpi=200)
    red = (pixels[..., 0] > 0.6) & (pixels[..., 1] < 0.6) & (pixels[..., 2] < 0.6)
    ground = building.ground_of_triangle[building.patches.triangle_of_patch] == 0
    middles_m = patch_triangles(building.scene, building.patches)[:, :, :2].mean(axis=1) + building.scene.offset_m[:2]

    def reddened(which: np.ndarray) -> float:
        """Mean share of red, 3 mm around the middles of patches of the ground."""
        spots = np.rint(np.array([to_paper(*at) for at in middles_m[ground & which]]) / 25.4 * 200).astype(int)
        return float(np.mean([red[red.shape[0] - y - 12 : red.shape[0] - y + 12, x - 12 : x + 12] for x, y in spots]))

    missed, seen = reddened(building.achievable & (building.times_seen == 0)), reddened(building.times_seen > 0)
    assert missed > 0.08
    assert seen < missed / 4


def test_walls_are_marked_where_no_station_sees_them(site_plan: PlanSource, sheet_folder: Path) -> None:
    building = read_building(sheet_folder)
    assert isinstance(building, Building)
    walls = view_floor(site_plan, site_plan.floors[0], building).surface.walls  # type: ignore[union-attr]
    assert len(walls)
    corners = patch_triangles(building.scene, building.patches)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upright = np.abs(normal[:, 2]) < 0.1 * np.linalg.norm(normal, axis=1)
    middle = corners.mean(axis=1) + building.scene.offset_m
    missed = middle[upright & building.achievable & (building.times_seen == 0) & (middle[:, 2] < 52.8)][:, :2]
    for ends in walls:
        # Of a strip's 25 cm, half at least is of patches that no station sees.
        assert np.linalg.norm(missed - ends.mean(axis=0), axis=1).min() < 0.35


def test_walk_goes_up_the_stairs_on_both_floors(site_sheets: Any) -> None:
    assert "to 5, Level 2" in site_sheets.texts[site_sheets.drawing("Level 1")]
    assert "from 4, Level 1" in site_sheets.texts[site_sheets.drawing("Level 2")]


def test_walk_goes_over_to_the_upper_floor_where_its_ground_begins(site_plan: PlanSource) -> None:
    building = read_building(site_plan.folder)
    assert isinstance(building, Building)
    below, above = (view_floor(site_plan, floor, building).ways for floor in site_plan.floors)
    (up,), (on,) = ([way for way in ways if way.leaves or way.arrives] for ways in (below, above))
    assert (up.leaves, on.arrives) == ("to 5, Level 2", "from 4, Level 1")
    # The fourteenth step is as high as the floor above; 13 treads lead to it.
    edge_x = 40_300.0 + 8.2 - 13 * 2.7 / 14
    assert abs(float(up.points_m[-1, 0]) - edge_x) < 0.0101
    np.testing.assert_array_equal(up.points_m[-1], on.points_m[0])
    leg = next(leg for leg in site_plan.document["route"]["legs"] if leg["from"] == "S004")
    np.testing.assert_array_equal(up.points_m[0], leg["points"][0][:2])
    np.testing.assert_array_equal(on.points_m[-1], leg["points"][-1][:2])


@pytest.mark.slow
def test_walk_down_leaves_the_upper_floor_where_it_came_up(
    site_plan: PlanSource, edited: Callable[..., PlanSource]
) -> None:
    def turn_back(document: dict[str, Any]) -> None:
        document["route"]["legs"] = [
            {**leg, "from": leg["to"], "to": leg["from"], "points": leg["points"][::-1], "floors": leg["floors"][::-1]}
            for leg in document["route"]["legs"][::-1]
        ]

    building = read_building(site_plan.folder)
    assert isinstance(building, Building)
    turned = edited(turn_back)
    for floor in site_plan.floors:
        ahead = view_floor(site_plan, floor, building).ways
        back = view_floor(turned, floor, building).ways[::-1]
        assert len(ahead) == len(back)
        for one, other in zip(ahead, back, strict=True):
            np.testing.assert_allclose(one.points_m, other.points_m[::-1], atol=0.0201)
            assert (one.arrives.removeprefix("from"), one.leaves.removeprefix("to")) == (
                other.leaves.removeprefix("to"), other.arrives.removeprefix("from")
            )  # fmt: skip


def test_walk_without_a_building_goes_over_at_a_corner(site_plan: PlanSource) -> None:
    (up,) = [way for way in view_floor(site_plan, site_plan.floors[0], None).ways if way.leaves]
    leg = next(leg for leg in site_plan.document["route"]["legs"] if leg["from"] == "S004")
    assert up.points_m[-1].tolist() in [point[:2] for point in leg["points"]]


def test_flight_that_ends_over_a_wall_leaves_it_solid(site_plan: PlanSource, edited: Callable[..., PlanSource]) -> None:
    def over_the_wall(document: dict[str, Any]) -> None:
        leg = next(leg for leg in document["route"]["legs"] if leg["from"] == "S004")
        leg["points"].insert(-2, [40_306.0, 20_205.1, 52.4])

    building = read_building(site_plan.folder)
    assert isinstance(building, Building)
    before, then = (view_floor(plan, plan.floors[0], building) for plan in (site_plan, edited(over_the_wall)))
    assert len(before.solids) == len(then.solids)


def test_walk_is_dashed_above_the_cut(site_plan: PlanSource) -> None:
    building = read_building(site_plan.folder)
    assert isinstance(building, Building)
    view = view_floor(site_plan, site_plan.floors[0], building)
    (up,) = [way for way in view.ways if way.leaves]
    (low,), (high,) = up.parted_at(view.floor.elevation_m + view.cut_m)
    np.testing.assert_allclose(low[-1], high[0])
    np.testing.assert_array_equal(np.concatenate([low[:-1], high[1:]]), up.points_m)
    # From (8.107, 50.2) to (5.954, 52.496) the leg is straight.
    assert float(high[0, 0]) == pytest.approx(40_308.107 - (1.2 - 0.2) / 2.296 * 2.153, abs=1e-3)
    assert [len(parts) for parts in view.ways[0].parted_at(view.floor.elevation_m + view.cut_m)] == [1, 0]


def test_walls_cut_lower_than_wanted_are_told(
    site_plan: PlanSource, site_sheets: Any, pdf_of: Callable[..., Any]
) -> None:
    told = [remark for remark in pdf_of(site_plan, cut_m=2.0).remarks if "cut lower" in remark]
    assert told == ["walls are cut lower than at 2 m, half-way to the floor above: 'Level 1' at 1.4 m"]
    assert not [remark for remark in site_sheets.remarks if "cut lower" in remark]


@pytest.mark.slow
def test_floors_that_are_not_asked_for_are_left_out(site_plan: PlanSource, pdf_of: Callable[..., Any]) -> None:
    sheets = pdf_of(site_plan, floors=("Level 2",))
    assert len(sheets.pages_with("true to scale")) == 1
    assert not [page for page in sheets.pages_with("Stations of Level 1") if page > 0]


def test_floor_that_nobody_asked_for_has_no_sheet_unless_told(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def leave_out(document: dict[str, Any]) -> None:
        document["requirements"]["floors"] = ["level 1"]
        gone = {each["id"] for each in document["stations"] if each["floor"] != "F0"}
        document["stations"] = [each for each in document["stations"] if each["id"] not in gone]
        links = document["registration"]["links"]
        document["registration"]["links"] = [each for each in links if not gone & {each["a"], each["b"]}]
        document["route"] = document["why"] = None

    plan = edited(leave_out)
    assert len(pdf_of(plan).pages_with("true to scale")) == 1
    sheets = pdf_of(plan, floors=("F1",))
    page = sheets.drawing("Level 2")
    assert "this floor is not planned" in sheets.texts[page]
    assert "seen:" not in sheets.texts[page]
    pixels = sheets.pixels(page)[: -int(45 / 25.4 * 100)]  # without the legend
    assert not ((pixels[..., 0] > 0.7) & (pixels[..., 1] < 0.4)).any()


@pytest.mark.slow
def test_zones_are_drawn_on_the_sheets_of_their_floors_and_named(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any], scene_plan: PlanSource
) -> None:
    """By id, by name, on all floors; circles of forbidden positions on the floor below them."""
    east, north, up = scene_plan.stations_of("F0")[0].ground_m.tolist()

    def zone(name: str, floor: str, *, access: bool = False) -> dict[str, Any]:
        return {"name": name, "floor": floor, "access": access, "outline": [[east, north], [east + 1, north],
                                                                            [east, north + 1]]}  # fmt: skip

    def edit(document: dict[str, Any]) -> None:
        document["site"]["keep_out"] = [
            zone("plant room", "f0"), zone("flat 2", "Level 2"), zone("site.keep_out[2]", ""),
            zone("corridor", "F1", access=True),
        ]  # fmt: skip
        place = {"id": "X", "role": "forbidden", "position": [east, north, up + 2.79], "floor": "",
                 "instrument_height_m": None, "radius_m": 0.7}  # fmt: skip
        document["site"]["settled"] = [place]

    plan = edited(edit)
    lower, upper = ({zone.words for zone in zones_on(plan, floor)} for floor in plan.floors)
    assert lower == {"keep-out: plant room", "keep-out"}
    assert upper == {"keep-out: flat 2", "keep-out", "access area: corridor", "no station"}
    (circle,) = [zone for zone in zones_on(plan, plan.floors[1]) if zone.words == "no station"]
    np.testing.assert_allclose(np.linalg.norm(circle.outline - (east, north), axis=1), 0.7)
    texts = pdf_of(plan).texts
    (sheet,) = [text for text in texts if "keep-out: plant room" in text]
    assert "keep-out or access area" in sheet, "the legend"
    assert not any("keep-out" in text for text in pdf_of(scene_plan).texts)


def test_scanned_station_is_told_from_those_to_do(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def settle(document: dict[str, Any]) -> None:
        rest = {"position": [0.0, 0.0, 0.0], "floor": "", "instrument_height_m": None, "radius_m": None}
        document["site"]["settled"] = [
            {"id": "S002", "role": "scanned", **rest},
            {"id": "S001", "role": "locked", **rest},
        ]

    sheets = pdf_of(edited(settle))
    assert len(re.findall(r"^scanned before", "\n".join(sheets.texts), re.MULTILINE)) == 1
    page = sheets.drawing("Level 1")
    assert "station that was scanned before" in sheets.texts[page]
    pixels = sheets.pixels(page, dpi=200).mean(axis=2)
    shades = [
        np.median(pixels[pixels.shape[0] - y - 16 : pixels.shape[0] - y + 16, x - 16 : x + 16])
        for x, y in np.rint(sheets.spots(page)[:2] / 25.4 * 200).astype(int)
    ]
    assert shades[0] < 0.3 and shades[1] > 0.8


@pytest.mark.slow
def test_legs_without_a_path_and_links_to_other_floors_name_the_other_station(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def join(document: dict[str, Any]) -> None:
        leg = next(leg for leg in document["route"]["legs"] if leg["from"] == "S002")
        leg.update(points=[], floors=[], length_m=None)
        link = {**document["registration"]["links"][0], "a": "S001", "b": "S006", "overlap": 0.9, "strength": 0.5}
        document["registration"]["links"].append(link)

    sheets = pdf_of(edited(join))
    words = "\n".join(sheets.texts)
    assert "then 3, no path inside" in words and "from 2, no path inside" in words
    assert "↕ 6" in sheets.texts[sheets.drawing("Level 1")]
    assert "↕ 1" in sheets.texts[sheets.drawing("Level 2")]


@pytest.mark.slow
def test_hundred_and_fifty_stations_are_all_there_and_apart(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def crowd(document: dict[str, Any]) -> None:
        first = document["stations"][0]
        document["stations"] = [
            {**first, "id": f"T{n:03d}", "order": n + 1,
             "position": [40_300.3 + 0.6 * (n % 16), 20_200.3 + 0.45 * (n // 16), 51.4]}
            for n in range(150)
        ]  # fmt: skip
        document["route"] = document["why"] = None
        document["registration"].update(links=[], gaps=[], networks=[], connected=False)

    sheets = pdf_of(edited(crowd), paper="A3")
    tables = "\n".join(sheets.texts[page] for page in sheets.pages_with("H sensor, m"))
    assert sorted(re.findall(r"^T\d{3}$", tables, re.MULTILINE)) == [f"T{n:03d}" for n in range(150)]
    assert len(sheets.pages_with("Stations of Level 1 (continued)")) >= 2
    page = sheets.drawing("Level 1")
    numbers = [mark.text for mark in sheets.words(page)]
    assert all(str(n) in numbers for n in range(1, 151))
    discs = np.array([mark.middle for mark in sheets.discs(page, least_mm=5.0, most_mm=6.0)])
    assert len(discs) == 150
    apart = np.linalg.norm(discs[:, None] - discs[None], axis=2) + 1e9 * np.eye(150)
    assert apart.min() > 4.5


@pytest.mark.slow
def test_plan_without_stations_has_sheets(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def empty(document: dict[str, Any]) -> None:
        document.update(stations=[], route=None, why=None, coverage_curve=[])
        document["registration"].update(links=[], gaps=[], networks=[])

    sheets = pdf_of(edited(empty))
    assert "0 stations" in sheets.texts[sheets.drawing("Level 1")]


@pytest.mark.parametrize(("rise_m", "words"), [(2.8, "ground +2.80 m"), (-1.4, "ground -1.40 m"), (0.3, None)])
def test_station_on_another_level_has_its_height_at_the_marker_and_in_the_list(
    scene_plan: PlanSource, html_of: Callable[..., str], rise_m: float, words: str | None
) -> None:
    up = np.array([0.0, 0.0, rise_m])
    first, *others = scene_plan.stations
    moved = replace(first, position_m=first.position_m + up)
    page = html_of(replace(scene_plan, stations=(moved, *others)))
    assert page.count("ground +") + page.count("ground -") == (0 if words is None else 2)
    read = unescape(page).replace("\xa0", " ")
    assert words is None or (f">{words}" in page and f"{words} from its floor's" in read)


def test_rise_of_the_ground_is_in_the_unit_of_the_sheets() -> None:
    assert rise_words(2.8, FOOT) == "ground +9.19 ft"
    assert rise_words(float("nan")) == ""
