"""Drawings of the PDF, measured: scale, scale bar, north, grid, sheets that go on at others."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner_core.model import SiteFrame
from planner_core.plan_folder.plan_source import PlanSource

ORIGIN_M, ROTATION_RAD = (691_000.0, 5_334_000.0, 512.0), 0.35
PAPERS_MM = {"A4": {210, 297}, "A3": {297, 420}}


@pytest.mark.slow
@pytest.mark.parametrize("paper", ["A4", "A3"])
def test_distances_on_paper_times_scale_are_metres(
    site_plan: PlanSource, pdf_of: Callable[..., Any], paper: str
) -> None:
    sheets = pdf_of(site_plan, paper=paper)
    for floor, name in (("F0", "Level 1"), ("F1", "Level 2")):
        page = sheets.drawing(name)
        spots, at_m = sheets.spots(page), sheets.positions_m(site_plan, floor)
        assert len(spots) == len(at_m) >= 2
        on_paper = np.linalg.norm(spots[:, None] - spots[None], axis=2) * sheets.scale(page) / 1000
        in_plan = np.linalg.norm(at_m[:, None] - at_m[None], axis=2)
        np.testing.assert_allclose(on_paper, in_plan, atol=0.01 * sheets.scale(page) / 1000)
        assert set(sheets.size_mm(page)) == PAPERS_MM[paper]


def test_scale_bar_is_as_long_as_it_says(site_sheets: Any) -> None:
    page = site_sheets.drawing("Level 1")
    words = {mark.text: mark for mark in site_sheets.words(page)}
    length_m = float(re.fullmatch(r"([\d.]+) m", next(t for t in words if re.fullmatch(r"[\d.]+ m", t)))[1])  # type: ignore[index]
    distance_mm = words[f"{length_m:g} m"].middle[0] - words["0"].middle[0]
    assert abs(distance_mm * site_sheets.scale(page) / 1000 - length_m) < 0.02


@pytest.mark.slow
def test_larger_paper_takes_a_larger_scale_where_it_fits(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def widen(document: dict[str, Any]) -> None:
        document["floors"][0]["bounds"][1][0] += 6.0

    plan = edited(widen)
    both = [pdf_of(plan, paper=paper) for paper in ("A4", "A3")]
    assert [sheets.scale(sheets.drawing("Level 1")) for sheets in both] == [75, 50]


@pytest.mark.slow
def test_tall_floor_stands_upright(edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]) -> None:
    def lengthen(document: dict[str, Any]) -> None:
        document["floors"][0]["bounds"][1][1] += 12.0

    sheets = pdf_of(edited(lengthen), paper="A4")
    assert sheets.size_mm(sheets.drawing("Level 1")) == (210, 297)
    assert sheets.size_mm(sheets.drawing("Level 2")) == (297, 210)


def test_north_is_the_sites(site_sheets: Any) -> None:
    page = site_sheets.drawing("Level 1")
    letter = next(mark for mark in site_sheets.words(page) if mark.text == "N")
    # The scene's +x points 0.35 rad north of east: north is as much to the right of the scene's +y.
    halves = [
        mark for mark in site_sheets.paths(page) if 8 < mark.top - mark.bottom < 16 and mark.right - mark.left < 9
    ]
    arrow = [mark for mark in halves if np.hypot(*(mark.middle - letter.middle)) < 14]
    assert arrow
    middle = np.mean([((m.left + m.right) / 2, (m.bottom + m.top) / 2) for m in arrow], axis=0)
    assert any(mark.text == "N: grid north" for mark in site_sheets.words(page))
    away = letter.middle - middle
    assert abs(math.atan2(away[0], away[1]) - ROTATION_RAD) < 0.2


def test_grid_is_named_where_its_lines_meet_the_frame(site_sheets: Any, site_plan: PlanSource) -> None:
    page = site_sheets.drawing("Level 1")
    to_paper = site_sheets.to_paper(page, site_plan, "F0")
    width, height = site_sheets.size_mm(page)
    low, high = np.array([8.0, 8.0 + 35.0]), np.array([width - 8.0, height - 8.0])
    named = [mark for mark in site_sheets.words(page) if re.fullmatch(r"[EN] [\d ]+", mark.text)]
    sides = []
    for mark in named:
        axis, value = "EN".index(mark.text[0]), float(mark.text[2:].replace(" ", ""))
        # Which of the four sides of the drawing the name is at: it lies within 4 mm.
        off = {"left": mark.right - low[0], "bottom": mark.top - low[1],
               "right": high[0] - mark.left, "top": high[1] - mark.bottom}  # fmt: skip
        side = min(off, key=off.__getitem__)
        assert 0 < off[side] < 4.0, mark
        sides.append((mark.text[0], side))
        # Somewhere beside the name, a tick away at most, the side has that coordinate.
        along = 0 if side in ("bottom", "top") else 1
        edge = {"left": low[0], "right": high[0], "bottom": low[1], "top": high[1]}[side]
        start, end = ((mark.left, mark.right), (mark.bottom, mark.top))[along]
        values = []
        for at in (start - 3.2, start, end, end + 3.2):
            spot = np.array([at, edge]) if along == 0 else np.array([edge, at])
            values.append(_on_site(spot, to_paper, site_sheets.scale(page))[axis])
        before, behind = sorted(values[:2]), sorted(values[2:])
        assert before[0] < value < before[1] or behind[0] < value < behind[1], mark
    # Turned by 20 degrees, eastings leave at the foot and the top and northings at the left and the right, at least.
    assert {("E", "bottom"), ("E", "top"), ("N", "left"), ("N", "right")} <= set(sides)
    assert len(set(sides)) > 4


def _on_site(spot: Any, to_paper: Callable[[float, float], Any], scale: int) -> tuple[float, float]:
    """Easting and northing of a place on paper, by hand."""
    x, y = (spot - to_paper(0.0, 0.0)) / (1000.0 / scale)
    cos, sin = math.cos(ROTATION_RAD), math.sin(ROTATION_RAD)
    return ORIGIN_M[0] + cos * x - sin * y, ORIGIN_M[1] + sin * x + cos * y


TURNS_DEG = [0.0, 89.9, -160.0, *(pytest.param(turn, marks=pytest.mark.slow) for turn in (20.0, 45.0, 117.0))]


@pytest.mark.slow
@pytest.mark.parametrize("turn_deg", TURNS_DEG)
def test_every_line_of_the_grid_is_named_and_no_names_meet(
    site_plan: PlanSource, pdf_of: Callable[..., Any], turn_deg: float
) -> None:
    turn = math.radians(turn_deg)
    matrix = np.eye(4)
    matrix[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    matrix[:3, 3] = (650_000.0, 5_310_000.0, 400.0)
    frame = replace(site_plan.frame, matrix=matrix)
    sheets = pdf_of(replace(site_plan, frame=frame))
    page = sheets.drawing("Level 1")
    named = [mark for mark in sheets.words(page) if re.fullmatch(r"[EN] [\d ]+", mark.text)]
    for index, one in enumerate(named):
        for other in named[index + 1 :]:
            assert (
                one.right <= other.left or other.right <= one.left or one.top <= other.bottom or other.top <= one.bottom
            )
    to_paper, scale = sheets.to_paper(page, site_plan, "F0"), sheets.scale(page)
    width, height = sheets.size_mm(page)
    corners = [(x, y) for x in (8.0, width - 8.0) for y in (43.0, height - 8.0)]
    scene = np.array([(np.array(corner) - to_paper(0.0, 0.0)) / (1000.0 / scale) for corner in corners])
    site = scene @ matrix[:2, :2].T + matrix[:2, 3]
    step = next(step for step in (1, 2, 5, 10) if step * 1000.0 / scale >= 38.0)
    for axis, letter in enumerate("EN"):
        values = sorted({float(mark.text[2:].replace(" ", "")) for mark in named if mark.text[0] == letter})
        lines = np.arange(np.ceil(site[:, axis].min() / step), np.floor(site[:, axis].max() / step) + 1) * step
        assert set(values) <= set(lines.tolist())
        # At both ends; those near a corner of the drawing have no room.
        assert len(values) >= len(lines) - 2
        assert sum(mark.text[0] == letter for mark in named) >= 2 * (len(lines) - 2)


@pytest.mark.slow
def test_sheets_in_scene_coordinates_say_so_and_claim_no_north(
    scene_plan: PlanSource, pdf_of: Callable[..., Any]
) -> None:
    sheets = pdf_of(scene_plan, paper="A4")
    assert all("scene coordinates, no CRS" in words for words in sheets.texts)
    marks = [mark.text for mark in sheets.words(sheets.drawing("Level 1"))]
    assert "N" not in marks and {"x", "y"} <= set(marks)
    assert "x, y of the scene; north not known" in marks


@pytest.mark.parametrize("north_rad", [0.3, -2.5])
def test_axes_in_scene_coordinates_are_those_of_the_listed_coordinates(
    scene_plan: PlanSource, pdf_of: Callable[..., Any], north_rad: float
) -> None:
    sheets = pdf_of(replace(scene_plan, frame=SiteFrame(true_north_rad=north_rad)), paper="A4")
    page = sheets.drawing("Level 1")
    to_paper, words = sheets.to_paper(page, scene_plan, "F0"), sheets.words(page)
    x, y, north = (next(mark for mark in words if mark.text == name) for name in ("x", "y", "N"))
    # x ends to the right of where y starts, y above of where x starts: 12.8 mm from one corner, along the paper.
    np.testing.assert_allclose((x.middle - y.middle) / 12.8, (1.0, -1.0), atol=0.08)
    named = [mark for mark in words if re.fullmatch(r"[xy] [\d ]+", mark.text)]
    assert {mark.text[0] for mark in named} == {"x", "y"}
    for mark in named:
        value = float(mark.text[2:].replace(" ", ""))
        # Behind its line, or before it where there is no room at the corner; all around.
        if mark.text[0] == "x":
            line = to_paper(value, 0.0)[0]
            assert min(abs(mark.left - 0.7 - line), abs(mark.right + 0.7 - line)) < 0.4, mark
        else:
            line = to_paper(0.0, value)[1]
            assert min(abs(mark.bottom - 0.7 - line), abs(mark.top + 0.7 - line)) < 0.4, mark
    assert len(named) == 2 * len({mark.text for mark in named})
    turned = [mark for mark in sheets.paths(page) if np.hypot(*(mark.middle - north.middle)) < 8 and mark.top < 43]
    arrow = [mark for mark in turned if 5 < math.hypot(mark.right - mark.left, mark.top - mark.bottom) < 8.5]
    away = north.middle - np.mean([mark.middle for mark in arrow], axis=0)
    assert abs(math.remainder(math.atan2(away[0], away[1]) - north_rad, math.tau)) < 0.2
    # Nobody takes it for the grid's: its letter bears a word that covers neither it nor the arrow, and a line says why.
    (kind,) = [mark for mark in words if mark.text == "true"]
    assert abs(kind.middle[0] - north.middle[0]) < 0.3 and 1.5 < abs(kind.middle[1] - north.middle[1]) < 3.5
    assert np.hypot(*(kind.middle - arrow[0].middle)) > np.hypot(*(north.middle - arrow[0].middle)) - 1.0
    assert any(mark.text == "true north as in the OBJ file" for mark in words)


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
    pages = sheets.drawings("Level 1")
    assert len(pages) >= 3
    assert all(sheets.scale(page) == 500 for page in pages)
    assert f"continues on sheet {pages[1] + 1}" in sheets.texts[pages[0]]
    assert f"continues on sheet {pages[0] + 1}" in sheets.texts[pages[1]]
    assert sum(len(sheets.spots(page)) for page in pages) >= 4
    drawn = {mark.text for page in pages for mark in sheets.words(page)}
    assert {"1", "2", "3", "4"} <= drawn
