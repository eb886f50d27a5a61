"""Sheets in feet: what a PDF reader finds, against metres divided by hand; paper is in millimetres."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

import pytest
from sheet_reading import Pdf

from planner_core.export.sheets.paper import drawing_scales, scale_name, sheet_scales
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_words import area_words, cut_words, length_words, short_length_words

Sheets = Callable[..., Pdf]
FOOT_US_M = 1200 / 3937


@pytest.fixture(scope="module")
def plan_in_feet(site_plan: PlanSource) -> PlanSource:
    return replace(site_plan, frame=replace(site_plan.frame, unit=US_SURVEY_FOOT))


def test_names_of_scales_are_what_they_are_by_hand() -> None:
    for scale in (*sheet_scales(FOOT), *drawing_scales(FOOT)):
        inches, feet = re.fullmatch(r"(.+)\" = (\d+)\'(?:-0\")?", scale_name(scale, FOOT)).groups()  # type: ignore[union-attr]
        over, _, under = inches.partition("/")
        assert int(feet) * 12 / (int(over) / int(under or 1)) == scale
    assert scale_name(100, METRE) == ""
    assert sheet_scales(METRE)[0] == 50


def test_lengths_and_areas_by_hand() -> None:
    assert length_words(FOOT, 1.6129, 3) == "5' 3 1/2\""
    assert length_words(FOOT, 30.48, 0) == "100 ft"
    assert length_words(METRE, 1.6129, 3) == "1.613 m"
    assert area_words(FOOT, 9.290304) == "100 sq ft"
    assert area_words(METRE, 9.290304) == "9 m²"
    assert (short_length_words(FOOT, 0.00635), short_length_words(METRE, 0.00635)) == ("0.25 in", "6.35 mm")
    assert (cut_words(FOOT, 1.2192), cut_words(METRE, 1.2)) == ("4' 0\"", "1.2 m")


@pytest.mark.slow
def test_the_scale_bar_is_as_long_in_feet_as_it_says(plan_in_feet: PlanSource, pdf_of: Sheets) -> None:
    sheets = pdf_of(plan_in_feet)
    drawings = [page for page in range(len(sheets.texts)) if "true to scale" in sheets.texts[page]]
    assert drawings
    for page in drawings:
        scale = int(re.search(r"1:(\d+)", sheets.texts[page])[1])  # type: ignore[index]
        assert scale in sheet_scales(FOOT)
        assert scale_name(scale, FOOT) in sheets.texts[page]
        words = {mark.text: mark for mark in sheets.words(page) if mark.text}
        (name,) = (text for text in words if re.fullmatch(r"\d+ ft", text))
        feet = int(name.removesuffix(" ft"))
        distance_mm = words[name].middle[0] - words["0"].middle[0]
        assert distance_mm * scale / 304.8 == pytest.approx(feet, rel=0.02)


def test_the_grid_is_of_round_feet(plan_in_feet: PlanSource, pdf_of: Sheets) -> None:
    sheets = pdf_of(plan_in_feet)
    east_ft = plan_in_feet.stations[0].site_m[0] / FOOT_US_M
    text = " ".join(sheets.texts)
    named = [float(each.replace(" ", "")) for each in re.findall(r"E (\d \d{3} \d{3})", text)]
    assert named
    assert min(abs(value - east_ft) for value in named) < 100
    assert all(value % 5 == 0 for value in named)


def test_stations_are_listed_in_feet(plan_in_feet: PlanSource, pdf_of: Sheets) -> None:
    sheets = pdf_of(plan_in_feet)
    text = " ".join(" ".join(sheets.texts[page] for page in sheets.pages_with("H sensor, ftUS")).split())
    assert "E, ftUS" in text and "sq ft" in text
    for station in plan_in_feet.stations:
        for value in (*station.site_m, station.site_ground_m[2]):
            assert f"{value / FOOT_US_M:.3f}" in text
        inches = round(station.instrument_height_m / 0.0254 * 8) / 8
        feet, rest = divmod(inches, 12)
        assert f"{feet:.0f}' {math.floor(rest)}" in text
    assert "in US survey feet" in text


def test_no_metre_is_left_on_sheets_in_feet(plan_in_feet: PlanSource, pdf_of: Sheets) -> None:
    # Warnings are the plan's own words, in metres.
    texts = pdf_of(replace(plan_in_feet, document={**plan_in_feet.document, "warnings": []})).texts
    assert len(texts) > 5
    text = " ".join(texts)
    assert not re.findall(r"[\d.]+ m\b(?!in)|m²|\d mm\b", text)


def test_metres_stay_metres(site_plan: PlanSource, pdf_of: Sheets) -> None:
    text = " ".join(pdf_of(site_plan).texts)
    assert " ft" not in text and "sq ft" not in text
