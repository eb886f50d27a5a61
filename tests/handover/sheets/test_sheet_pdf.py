"""The PDF as readers of others find it: coordinates, scale, walls, page numbers, names that are none."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import HandoverError, RequirementError
from planner_core.handover.formats import hand_over
from planner_core.handover.options import Options
from planner_core.handover.sheets.building import Building, read_building
from planner_core.handover.sheets.floor_view import view_floor
from planner_core.handover.sheets.pdf import write_pdf
from planner_core.handover.source import PlanSource, open_plan
from planner_core.model import SiteFrame
from planner_core.progress import silent
from planner_core.scene.patches import patch_triangles

ORIGIN_M, ROTATION_RAD = (691_000.0, 5_334_000.0, 512.0), 0.35
PAPERS_MM = {"A4": {210, 297}, "A3": {297, 420}}


def _stations(plan: PlanSource, floor: str) -> list[dict[str, Any]]:
    return [each for each in plan.document["stations"] if each["floor"] == floor]


def _positions(plan: PlanSource, floor: str) -> np.ndarray:
    return np.array([each["position"][:2] for each in _stations(plan, floor)])


def _drawing(sheets: Any, floor_name: str) -> int:
    """Page of a floor's drawing."""
    (page,) = _drawings(sheets, floor_name)
    return page


def _drawings(sheets: Any, floor_name: str) -> list[int]:
    named = re.compile(rf"^{floor_name}$", re.MULTILINE)
    return [page for page in sheets.pages_with("true to scale") if named.search(sheets.texts[page])]


def _scale(sheets: Any, page: int) -> int:
    return int(re.search(r"^1:(\d+)$", sheets.texts[page], re.MULTILINE)[1])  # type: ignore[index]


def _to_paper(sheets: Any, page: int, plan: PlanSource, floor: str) -> Callable[[float, float], np.ndarray]:
    """From scene metres to millimetres on a page, by the marks of its stations: upright, to one scale."""
    spots, at_m = sheets.spots(page), _positions(plan, floor)
    mm_per_m = 1000.0 / _scale(sheets, page)
    shift = (spots - mm_per_m * at_m).mean(axis=0)
    return lambda x, y: mm_per_m * np.array([x, y]) + shift


# -------------------------------------------------------------------------------------------------- tables
def test_every_station_is_in_the_tables_once_and_in_walking_order(site_sheets: Any, site_plan: PlanSource) -> None:
    words = "\n".join(site_sheets.texts[page] for page in site_sheets.pages_with("Stations of ")[1:])
    assert re.findall(r"^S\d{3}$", words, re.MULTILINE) == [each["id"] for each in site_plan.document["stations"]]


def test_coordinates_are_those_of_plan_json_on_site(site_sheets: Any, site_plan: PlanSource) -> None:
    cos, sin = math.cos(ROTATION_RAD), math.sin(ROTATION_RAD)
    words = "\n".join(site_sheets.texts)
    for station in site_plan.document["stations"]:
        x, y, z = station["position"]
        height = station["instrument_height_m"]
        expected = [
            ORIGIN_M[0] + cos * x - sin * y, ORIGIN_M[1] + sin * x + cos * y, ORIGIN_M[2] + z - height, height,
            ORIGIN_M[2] + z,
        ]  # fmt: skip
        found = re.search(rf"^{station['id']}\n" + r"([\d.]+)\n" * 5, words, re.MULTILINE)
        assert found is not None, station["id"]
        np.testing.assert_allclose([float(value) for value in found.groups()], expected, atol=0.00051)


def test_links_of_a_station_are_named_by_number(site_sheets: Any, site_plan: PlanSource) -> None:
    first = site_plan.document["registration"]["links"]
    overlap = next(link["overlap"] for link in first if {link["a"], link["b"]} == {"S005", "S006"})
    (page,) = [page for page in site_sheets.pages_with("Links: to number") if "S005" in site_sheets.texts[page]]
    assert f"6 ({100 * overlap:.0f})" in site_sheets.texts[page]


def test_unknown_instrument_height_is_said(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def forget(document: dict[str, Any]) -> None:
        document["stations"][0]["instrument_height_m"] = None

    words = "\n".join(pdf_of(edited(forget)).texts)
    assert words.count("not known\n") >= 2


# --------------------------------------------------------------------------------------------------- scale
@pytest.mark.parametrize("paper", ["A4", "A3"])
@pytest.mark.parametrize(("floor", "name"), [("F0", "Level 1"), ("F1", "Level 2")])
def test_distances_on_paper_times_scale_are_metres(
    site_plan: PlanSource, pdf_of: Callable[..., Any], paper: str, floor: str, name: str
) -> None:
    sheets = pdf_of(site_plan, paper=paper)
    page = _drawing(sheets, name)
    spots, at_m = sheets.spots(page), _positions(site_plan, floor)
    assert len(spots) == len(at_m) >= 2
    on_paper = np.linalg.norm(spots[:, None] - spots[None], axis=2) * _scale(sheets, page) / 1000
    in_plan = np.linalg.norm(at_m[:, None] - at_m[None], axis=2)
    np.testing.assert_allclose(on_paper, in_plan, atol=0.01 * _scale(sheets, page) / 1000)
    assert set(sheets.size_mm(page)) == PAPERS_MM[paper]


def test_scale_bar_is_as_long_as_it_says(site_sheets: Any) -> None:
    page = _drawing(site_sheets, "Level 1")
    words = {mark.text: mark for mark in site_sheets.words(page)}
    length_m = float(re.fullmatch(r"([\d.]+) m", next(t for t in words if re.fullmatch(r"[\d.]+ m", t)))[1])  # type: ignore[index]
    distance_mm = words[f"{length_m:g} m"].middle[0] - words["0"].middle[0]
    assert abs(distance_mm * _scale(site_sheets, page) / 1000 - length_m) < 0.02


def test_larger_paper_takes_a_larger_scale_where_it_fits(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def widen(document: dict[str, Any]) -> None:
        document["floors"][0]["bounds"][1][0] += 6.0

    plan = edited(widen)
    scales = [_scale(sheets := pdf_of(plan, paper=paper), _drawing(sheets, "Level 1")) for paper in ("A4", "A3")]
    assert scales == [75, 50]


def test_tall_floor_stands_upright(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def lengthen(document: dict[str, Any]) -> None:
        document["floors"][0]["bounds"][1][1] += 12.0

    sheets = pdf_of(edited(lengthen), paper="A4")
    assert sheets.size_mm(_drawing(sheets, "Level 1")) == (210, 297)
    assert sheets.size_mm(_drawing(sheets, "Level 2")) == (297, 210)


# ------------------------------------------------------------------------------------------------- drawing
def test_walls_are_dark_where_they_stand_and_rooms_are_not(site_sheets: Any, site_plan: PlanSource) -> None:
    page = _drawing(site_sheets, "Level 1")
    to_paper = _to_paper(site_sheets, page, site_plan, "F0")
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


def test_floor_is_hatched_where_no_station_sees_it(site_sheets: Any, site_plan: PlanSource, sheet_folder: Path) -> None:
    building = read_building(sheet_folder)
    assert isinstance(building, Building)
    page = _drawing(site_sheets, "Level 1")
    to_paper = _to_paper(site_sheets, page, site_plan, "F0")
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
    assert "to 5, Level 2" in site_sheets.texts[_drawing(site_sheets, "Level 1")]
    assert "from 4, Level 1" in site_sheets.texts[_drawing(site_sheets, "Level 2")]


def test_north_is_the_sites(site_sheets: Any) -> None:
    page = _drawing(site_sheets, "Level 1")
    letter = next(mark for mark in site_sheets.words(page) if mark.text == "N")
    # The scene's +x points 0.35 rad north of east: north is as much to the right of the scene's +y.
    halves = [
        mark for mark in site_sheets.paths(page) if 8 < mark.top - mark.bottom < 16 and mark.right - mark.left < 9
    ]
    arrow = [mark for mark in halves if np.hypot(*(mark.middle - letter.middle)) < 14]
    assert arrow
    middle = np.mean([((m.left + m.right) / 2, (m.bottom + m.top) / 2) for m in arrow], axis=0)
    away = letter.middle - middle
    assert abs(math.atan2(away[0], away[1]) - ROTATION_RAD) < 0.2


def test_grid_is_named_where_its_lines_meet_the_frame(site_sheets: Any, site_plan: PlanSource) -> None:
    page = _drawing(site_sheets, "Level 1")
    to_paper = _to_paper(site_sheets, page, site_plan, "F0")
    named = [mark for mark in site_sheets.words(page) if re.fullmatch(r"E [\d ]+", mark.text)]
    assert len(named) >= 2
    cos, sin = math.cos(ROTATION_RAD), math.sin(ROTATION_RAD)
    for mark in named:
        easting = float(mark.text[2:].replace(" ", ""))
        foot_mm = 8.0 + 35.0
        # The point of the scene where that easting meets the foot of the drawing.
        y = (foot_mm - to_paper(0.0, 0.0)[1]) / (1000.0 / _scale(site_sheets, page))
        x = (easting - ORIGIN_M[0] + sin * y) / cos
        assert abs(mark.left - 0.7 - to_paper(x, y)[0]) < 0.4, mark


def test_sheets_in_scene_coordinates_say_so_and_claim_no_north(
    scene_plan: PlanSource, pdf_of: Callable[..., Any]
) -> None:
    sheets = pdf_of(scene_plan, paper="A4")
    assert all("scene coordinates, no CRS" in words for words in sheets.texts)
    marks = [mark.text for mark in sheets.words(_drawing(sheets, "Level 1"))]
    assert "N" not in marks and {"x", "y"} <= set(marks)


@pytest.mark.parametrize("north_rad", [0.3, math.radians(50), -2.5])
def test_axes_in_scene_coordinates_are_those_of_the_listed_coordinates(
    scene_plan: PlanSource, pdf_of: Callable[..., Any], north_rad: float
) -> None:
    sheets = pdf_of(replace(scene_plan, frame=SiteFrame(true_north_rad=north_rad)), paper="A4")
    page = _drawing(sheets, "Level 1")
    to_paper, words = _to_paper(sheets, page, scene_plan, "F0"), sheets.words(page)
    x, y, north = (next(mark for mark in words if mark.text == name) for name in ("x", "y", "N"))
    # x ends to the right of where y starts, y above of where x starts: 12.8 mm from one corner, along the paper.
    np.testing.assert_allclose((x.middle - y.middle) / 12.8, (1.0, -1.0), atol=0.08)
    named = [mark for mark in words if re.fullmatch(r"[xy] [\d ]+", mark.text)]
    assert {mark.text[0] for mark in named} == {"x", "y"}
    for mark in named:
        value = float(mark.text[2:].replace(" ", ""))
        if mark.text[0] == "x":
            assert abs(mark.left - 0.7 - to_paper(value, 0.0)[0]) < 0.4, mark
        else:
            assert abs(mark.bottom - 0.7 - to_paper(0.0, value)[1]) < 0.4, mark
    turned = [mark for mark in sheets.paths(page) if np.hypot(*(mark.middle - north.middle)) < 8]
    arrow = [mark for mark in turned if 5 < math.hypot(mark.right - mark.left, mark.top - mark.bottom) < 8.5]
    away = north.middle - np.mean([mark.middle for mark in arrow], axis=0)
    assert abs(math.remainder(math.atan2(away[0], away[1]) - north_rad, math.tau)) < 0.2


def test_walls_cut_lower_than_wanted_are_told(
    site_plan: PlanSource, site_sheets: Any, pdf_of: Callable[..., Any]
) -> None:
    told = [remark for remark in pdf_of(site_plan, cut_m=2.0).remarks if "cut lower" in remark]
    assert told == ["walls are cut lower than at 2 m, half-way to the floor above: 'Level 1' at 1.4 m"]
    assert not [remark for remark in site_sheets.remarks if "cut lower" in remark]


def test_figures_of_charts_have_units(site_sheets: Any) -> None:
    words = " ".join(" ".join(site_sheets.texts).split())
    for unit in (" m", "°", " mm"):
        assert re.search(rf"half of it at most [\d.]+{unit}, 95 % at most [\d.]+{unit};", words), unit
    assert "asked: 4 m" in words and "asked: 75°" in words and "asked: 500 mm" in words


def test_cover_tells_the_scale_of_the_grid(sheet_folder: Path, pdf_of: Callable[..., Any]) -> None:
    frame = FrameRequest(crs="EPSG:25832", origin_m=ORIGIN_M, scale=0.9996)
    words = " ".join(pdf_of(open_plan(sheet_folder, frame=frame)).texts[0].split())
    assert "1 m of the building is 0.999600 m on the grid" in words


def test_sheets_name_the_crs_on_every_page(site_sheets: Any) -> None:
    assert all("EPSG:25832" in words for words in site_sheets.texts)


# --------------------------------------------------------------------------------------------------- pages
def test_sheets_are_numbered_through(site_sheets: Any) -> None:
    n = site_sheets.n_pages
    for place, words in enumerate(site_sheets.texts, start=1):
        assert f"{place} / {n}" in words


def test_cover_lists_every_sheet(site_sheets: Any) -> None:
    for place, words in ((1, "Cover"), (2, "Level 1, 1:50"), (3, "Stations of Level 1"), (4, "Level 2, 1:50")):
        assert f"{place}   {words}" in site_sheets.texts[0]


def test_floors_that_are_not_asked_for_are_left_out(site_plan: PlanSource, pdf_of: Callable[..., Any]) -> None:
    sheets = pdf_of(site_plan, floors=("Level 2",))
    assert len(sheets.pages_with("true to scale")) == 1
    assert not [page for page in sheets.pages_with("Stations of Level 1") if page > 0]


def test_floor_that_nobody_asked_for_has_no_sheet_unless_told(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def leave_out(document: dict[str, Any]) -> None:
        document["requirements"]["floors"] = ["level 1"]
        document["stations"] = [each for each in document["stations"] if each["floor"] == "F0"]
        document["route"] = document["why"] = None

    plan = edited(leave_out)
    assert len(pdf_of(plan).pages_with("true to scale")) == 1
    sheets = pdf_of(plan, floors=("F1",))
    page = _drawing(sheets, "Level 2")
    assert "this floor is not planned" in sheets.texts[page]
    assert "seen:" not in sheets.texts[page]
    pixels = sheets.pixels(page)[: -int(45 / 25.4 * 100)]  # without the legend
    assert not ((pixels[..., 0] > 0.7) & (pixels[..., 1] < 0.4)).any()


def test_station_of_no_floor_has_a_table_of_its_own(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def lose(document: dict[str, Any]) -> None:
        document["stations"][2]["floor"] = ""

    words = "\n".join(pdf_of(edited(lose)).texts)
    assert "Stations of no floor" in words
    assert len(re.findall(r"^S003$", words, re.MULTILINE)) == 1


def test_scanned_station_is_told_from_those_to_do(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def settle(document: dict[str, Any]) -> None:
        document["site"]["settled"] = [{"id": "S002", "role": "scanned"}, {"id": "S001", "role": "locked"}]

    sheets = pdf_of(edited(settle))
    assert len(re.findall(r"^scanned before", "\n".join(sheets.texts), re.MULTILINE)) == 1
    page = _drawing(sheets, "Level 1")
    assert "station that was scanned before" in sheets.texts[page]
    pixels = sheets.pixels(page, dpi=200).mean(axis=2)
    shades = [
        np.median(pixels[pixels.shape[0] - y - 16 : pixels.shape[0] - y + 16, x - 16 : x + 16])
        for x, y in np.rint(sheets.spots(page)[:2] / 25.4 * 200).astype(int)
    ]
    assert shades[0] < 0.3 and shades[1] > 0.8


def test_way_that_is_none_says_where_the_walk_goes_on(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def cut(document: dict[str, Any]) -> None:
        leg = next(leg for leg in document["route"]["legs"] if leg["from"] == "S002")
        leg.update(points=[], floors=[], length_m=None)

    words = "\n".join(pdf_of(edited(cut)).texts)
    assert "then 3, no way inside" in words and "from 2, no way inside" in words


def test_links_to_other_floors_are_named_beside_the_station(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def join(document: dict[str, Any]) -> None:
        link = {**document["registration"]["links"][0], "a": "S001", "b": "S006", "overlap": 0.9, "strength": 0.5}
        document["registration"]["links"].append(link)

    sheets = pdf_of(edited(join))
    assert "↕ 6" in sheets.texts[_drawing(sheets, "Level 1")]
    assert "↕ 1" in sheets.texts[_drawing(sheets, "Level 2")]


def test_picture_that_is_none_is_left_out(sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]) -> None:
    (tmp_path / "bare" / "report").mkdir(parents=True)
    (tmp_path / "bare" / "plan.json").write_bytes((sheet_folder / "plan.json").read_bytes())
    (tmp_path / "bare" / "report" / "overview.png").write_bytes(b"no picture")
    assert "Coverage" in pdf_of(open_plan(tmp_path / "bare")).texts[0]


def test_same_plan_gives_the_same_bytes(site_plan: PlanSource, site_sheets: Any, tmp_path: Path) -> None:
    write_pdf(site_plan, tmp_path / "again.pdf", Options(paper="A4"), silent)
    assert (tmp_path / "again.pdf").read_bytes() == site_sheets.path.read_bytes()


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
    page = _drawing(sheets, "Level 1")
    numbers = [mark.text for mark in sheets.words(page)]
    assert all(str(n) in numbers for n in range(1, 151))
    discs = np.array([mark.middle for mark in sheets.discs(page, least_mm=5.0, most_mm=6.0)])
    assert len(discs) == 150
    apart = np.linalg.norm(discs[:, None] - discs[None], axis=2) + 1e9 * np.eye(150)
    assert apart.min() > 4.5


def test_floor_that_fits_on_no_sheet_is_laid_out_on_several(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def spread(document: dict[str, Any]) -> None:
        document["floors"][0]["bounds"] = [[40_300.0, 20_200.0], [40_620.0, 20_260.0]]
        for n, station in enumerate(document["stations"][:4]):
            station["position"] = [40_305.0 + 103.0 * n, 20_210.0 + 12 * n, 51.4]
        document["route"] = None

    plan = edited(spread)
    sheets = pdf_of(plan, paper="A4")
    pages = _drawings(sheets, "Level 1")
    assert len(pages) >= 3
    assert all(_scale(sheets, page) == 500 for page in pages)
    assert f"goes on at sheet {pages[1] + 1}" in sheets.texts[pages[0]]
    assert f"goes on at sheet {pages[0] + 1}" in sheets.texts[pages[1]]
    assert sum(len(sheets.spots(page)) for page in pages) >= 4
    drawn = {mark.text for page in pages for mark in sheets.words(page)}
    assert {"1", "2", "3", "4"} <= drawn


# ---------------------------------------------------------------------------------------- what is not there
def test_plan_folder_without_stage_has_sheets_without_walls(
    sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]
) -> None:
    (tmp_path / "bare").mkdir()
    (tmp_path / "bare" / "plan.json").write_bytes((sheet_folder / "plan.json").read_bytes())
    sheets = pdf_of(open_plan(tmp_path / "bare"))
    assert any("stage.usdc" in remark for remark in sheets.remarks)
    assert "walls and unseen surface are not drawn" in " ".join("\n".join(sheets.texts).split())
    assert len(sheets.spots(_drawing(sheets, "Level 1"))) == 4
    assert not sheets.pages_with("Point spacing")


@pytest.mark.parametrize("content", [b"no usd", b"#usda 1.0\n", b'#usda 1.0\ndef Xform "Plan" {}\n'])
def test_stage_that_is_none_is_refused(
    sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any], content: bytes
) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/patches.u8"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    (tmp_path / "bare" / "viewer" / "stage.usdc").write_bytes(content)
    with pytest.raises(HandoverError, match=r"stage\.usdc: .*expected .*plan again"):
        pdf_of(open_plan(tmp_path / "bare"))


def test_patches_of_another_plan_are_told(sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/stage.usdc"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    (tmp_path / "bare" / "viewer" / "patches.u8").write_bytes(b"\1\2\3")
    sheets = pdf_of(open_plan(tmp_path / "bare"))
    assert any("has 3 patches" in remark for remark in sheets.remarks)


def test_layers_that_are_not_there_are_told(sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]) -> None:
    (tmp_path / "bare" / "viewer").mkdir(parents=True)
    for name in ("plan.json", "viewer/patches.u8", "viewer/stage.usdc", "viewer/layers.json"):
        (tmp_path / "bare" / name).write_bytes((sheet_folder / name).read_bytes())
    with pytest.raises(HandoverError, match=r"layers\.json: its layers can't be read \(FileNotFoundError"):
        pdf_of(open_plan(tmp_path / "bare"))


def test_plan_json_that_lacks_something_is_named(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def forget(document: dict[str, Any]) -> None:
        del document["requirements"]["results"]

    with pytest.raises(HandoverError, match=r"plan\.json: has no 'results', expected"):
        pdf_of(edited(forget))


def test_plan_without_stations_has_sheets(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def empty(document: dict[str, Any]) -> None:
        document.update(stations=[], route=None, why=None, coverage_curve=[])
        document["registration"].update(links=[], gaps=[], networks=[])

    sheets = pdf_of(edited(empty))
    assert "0 stations" in sheets.texts[_drawing(sheets, "Level 1")]


def test_names_that_are_none_are_printed_or_told(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def rename(document: dict[str, Any]) -> None:
        document["floors"][0]["name"] = "Erdgeschoß <&> Ωμέγα\x07\u202e"
        document["floors"][1]["name"] = "二階" + 80 * " lang"
        document["stations"][0]["id"] = "a)(\\b\ud800"

    sheets = pdf_of(edited(rename))
    words = "\n".join(sheets.texts)
    assert "Erdgeschoß <&> Ωμέγα\ufffd\ufffd" in words
    assert "a)(\\b\ufffd" in words
    assert any("二階" in remark and "font" in remark for remark in sheets.remarks)


def test_element_name_that_is_markup_is_printed_as_it_is(site_sheets: Any) -> None:
    assert "wall <b>&amp; Küche Ψ" in "\n".join(site_sheets.texts)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"paper": "A7"}, "paper: got 'A7', expected one of A4, A3"),
        ({"floors": ("F9",)}, "floor: got 'F9', expected one of F0 (Level 1)"),
        ({"cut_m": -1.0}, "cut: got -1 m, expected a height above the floor"),
        ({"cut_m": math.nan}, "cut: got nan m, expected a height above the floor"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    site_plan: PlanSource, pdf_of: Callable[..., Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(RequirementError, match=re.escape(message)):
        pdf_of(site_plan, **options)


@pytest.mark.parametrize("name", ["pdf", "html"])
def test_sheets_are_handed_over_by_name(sheet_folder: Path, tmp_path: Path, name: str) -> None:
    written = hand_over(name, sheet_folder, tmp_path / f"sheets.{name}", Options(paper="A4"))
    assert written.n_files == 1 and written.n_bytes > 10_000
