"""The cover as readers of others find it: figures of the plan or of some floors, sheets by number, coordinates."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pypdf
import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.export.sheets.cover import cover_figures, north_line
from planner_core.model import SiteFrame
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.plan_folder.plan_words import time_words, warnings_of

ORIGIN_M = (691_000.0, 5_334_000.0, 512.0)


@pytest.mark.slow
def test_cover_tells_the_scale_of_the_grid(sheet_folder: Path, pdf_of: Callable[..., Any]) -> None:
    frame = FrameRequest(crs="EPSG:25832", origin_m=ORIGIN_M, scale=0.9996)
    words = " ".join(pdf_of(open_plan(sheet_folder, frame=frame)).texts[0].split())
    assert "grid scale factor 0.999600" in words


@pytest.mark.slow
def test_sheets_are_numbered_through_name_the_crs_and_stand_on_the_cover(site_sheets: Any) -> None:
    for place, words in enumerate(site_sheets.texts, start=1):
        assert f"{place} / {site_sheets.n_pages}" in words
        assert "EPSG:25832" in words
    for place, words in ((1, "Cover"), (2, "Level 1, 1:50"), (3, "Stations of Level 1"), (4, "Level 2, 1:50")):
        assert f"{place}   {words}" in site_sheets.texts[0]


@pytest.mark.slow
def test_picture_that_is_none_is_left_out(sheet_folder: Path, tmp_path: Path, pdf_of: Callable[..., Any]) -> None:
    (tmp_path / "bare" / "report").mkdir(parents=True)
    (tmp_path / "bare" / "plan.json").write_bytes((sheet_folder / "plan.json").read_bytes())
    (tmp_path / "bare" / "report" / "overview.png").write_bytes(b"no picture")
    assert "Coverage" in pdf_of(open_plan(tmp_path / "bare")).texts[0]


@pytest.mark.parametrize(
    ("walking_s", "told"), [(12.0, "less than 1 min"), (0.0, "0 min"), (29.9, "less"), (44.3, "1 min")]
)
def test_short_walks_are_no_walks_of_nothing(walking_s: float, told: str) -> None:
    words = time_words({"scanning_s": 120.0, "set_up_s": 360.0, "walking_s": walking_s, "total_s": None})
    assert words.startswith(f"2 min scanning, 6 min setting up, {told}")


@pytest.mark.slow
def test_what_does_not_register_is_the_first_warning_of_the_cover(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    apart = "stations S001, S002 on floor 'Level 1' do not register with the others: no link reaches 5 % overlap"
    others = [f"storey 'Roof {k}' is left out" for k in range(6)]

    def edit(document: dict[str, Any]) -> None:
        document["warnings"] = [*others, apart]

    plan = edited(edit)
    assert warnings_of(plan) == [apart, *plan.frame.warnings, *others]
    _, _, words = pdf_of(plan).texts[0].partition("Warnings")
    assert " ".join(words.split()).startswith("• stations S001, S002 on floor 'Level 1' do not register")


# ---------------------------------------------------------------------------------------------- some floors
@pytest.mark.slow
def test_cover_of_one_floor_says_so_and_has_its_figures(site_plan: PlanSource, pdf_of: Callable[..., Any]) -> None:
    sheets = pdf_of(site_plan, floors=("Level 2",))
    cover = " ".join(sheets.texts[0].split())
    assert "Only Level 2: 1 of 2 floors" in cover
    (floor,) = [each for each in site_plan.document["coverage"]["floors"] if each["floor"] == "F1"]
    share, area_m2 = 100 * floor["fraction_of_achievable"], floor["achievable_area_m2"]
    assert f"{share:.1f} % of {area_m2:.0f} m²; required: " in cover
    whole = site_plan.document["coverage"]
    assert f"{100 * whole['fraction_of_achievable']:.1f} % of {whole['achievable_area_m2']:.0f} m²" not in cover
    assert "2 here; whole plan: 6" in cover
    title = pypdf.PdfReader(sheets.path).metadata.title  # type: ignore[union-attr]
    assert title == "Scan plan of house.obj: Level 2"


@pytest.mark.slow
def test_what_is_of_all_floors_says_so_where_the_sheets_are_not(
    site_plan: PlanSource, site_sheets: Any, pdf_of: Callable[..., Any]
) -> None:
    figures = dict(cover_figures(site_plan, [site_plan.floors[0]]))
    for name in ("Registration", "Route", "Field time"):
        assert figures[name].startswith("whole plan: "), name
    words = "\n".join(pdf_of(site_plan, floors=("F0",)).texts)
    for title in ("Required and reached", "Registration of scans", "Scan quality"):
        assert f"{title}: whole plan" in words
    assert "whole plan" not in "\n".join(site_sheets.texts)


@pytest.mark.slow
def test_tables_of_one_floor_leave_out_others(site_plan: PlanSource, pdf_of: Callable[..., Any]) -> None:
    lines = "\n".join(pdf_of(site_plan, floors=("F1",)).texts).splitlines()
    assert "F1" in lines and "S005" in lines
    assert not {"S001", "S002", "S003", "S004"} & set(lines)
    place = lines.index("Largest unseen surfaces")
    assert "F0" not in lines[place:]


def test_several_floors_have_a_figure_each(site_plan: PlanSource) -> None:
    figures = dict(cover_figures(site_plan, site_plan.floors))
    floors = site_plan.document["coverage"]["floors"]
    for name, floor in zip(("Level 1", "Level 2"), floors, strict=True):
        assert f"{name} {100 * floor['fraction_of_achievable']:.1f} % of" in figures["Coverage"]


@pytest.mark.slow
def test_all_floors_by_name_are_the_whole_plan(site_plan: PlanSource, pdf_of: Callable[..., Any]) -> None:
    cover = pdf_of(site_plan, floors=("F0", "F1")).texts[0]
    assert "Only" not in cover and "whole plan" not in cover


def test_page_of_one_floor_says_so(site_plan: PlanSource, html_of: Callable[..., str]) -> None:
    assert "<b>Only Level 1: 1 of 2 floors</b>" in html_of(site_plan, floors=("F0",))


@pytest.mark.slow
def test_sheets_of_one_title_are_one_line_of_the_index(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def lengthen(document: dict[str, Any]) -> None:
        row = document["requirements"]["results"][0]
        document["requirements"]["results"] = [{**row, "name": f"part {n}"} for n in range(60)]

    sheets = pdf_of(edited(lengthen), paper="A4")
    pages = [place for place, words in enumerate(sheets.texts, start=1) if "house.obj · Figures" in words]
    assert len(pages) > 1
    assert f"{pages[0]}–{pages[-1]}   Figures" in sheets.texts[0]
    assert f"{pages[-1] + 1}   Scan quality" in sheets.texts[0]


# ---------------------------------------------------------------------------------------------------- north
@pytest.mark.parametrize(
    ("frame", "told"),
    [
        (SiteFrame(), "not known; drawings are aligned with x and y of the scene"),
        (SiteFrame(true_north_rad=0.0), "true north as in the OBJ file, up on the sheet; coordinates are not"),
        (
            SiteFrame(true_north_rad=math.radians(-30)),
            "true north as in the OBJ file, 30.0° counter-clockwise from up",
        ),
        (SiteFrame(source="control points"), "arrow N on the drawings: axis N of the site's coordinates, up on the"),
    ],
)
def test_cover_says_which_north_and_where_it_comes_from(scene_plan: PlanSource, frame: SiteFrame, told: str) -> None:
    assert north_line(replace(scene_plan, frame=frame)).startswith(told)


def test_cover_says_where_the_scene_file_puts_the_site(scene_plan: PlanSource) -> None:
    assert "Location" not in dict(cover_figures(scene_plan))
    placed = replace(scene_plan, frame=SiteFrame(place="49.10043 N, 8.43654 E"))
    assert dict(cover_figures(placed))["Location"] == "49.10043 N, 8.43654 E, roughly: as in the OBJ file"


def test_cover_says_grid_north_where_there_is_a_grid(site_sheets: Any) -> None:
    words = " ".join(site_sheets.texts[0].split())
    assert f"arrow N on the drawings: grid north, {math.degrees(0.35):.1f}° clockwise from up" in words


def test_links_are_counted_by_the_overlap_that_the_plan_names(scene_plan: PlanSource) -> None:
    assert re.search(
        r"\d links of at least 99 % probability of registering \(manual\) and 20 % overlap; 3 unconnected groups, "
        "of 2, 2, 2 stations; weakest: ",
        dict(cover_figures(scene_plan))["Registration"],
    )
    asked = scene_plan.document["requirements"] | {"overlap_measure": "jaccard", "overlap_of": "seen-as-required"}
    named = replace(scene_plan, document={**scene_plan.document, "requirements": asked})
    assert dict(cover_figures(named))["Registration"].find(" % Jaccard overlap of what is seen as required; ") > 0


def test_cover_names_rooms_that_nobody_enters_in_red(scene_plan: PlanSource) -> None:
    assert "Left out" not in dict(cover_figures(scene_plan))
    document = {**scene_plan.document, "sealed": [{"area_m2": 20.2}, {"area_m2": 19.8}]}
    words = dict(cover_figures(replace(scene_plan, document=document)))["Left out"]
    assert words == "Not planned: 40 m² of floor that can't be reached on foot, in 2 areas"
