"""Tables of the PDF as readers of others find them: stations with their coordinates, links, names that are none."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planner_core.coverage.percent import reached_percent
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.plan_tables import floors_table, networks_table
from planner_core.plan_folder.plan_words import required_on

ORIGIN_M, ROTATION_RAD = (691_000.0, 5_334_000.0, 512.0), 0.35


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
    chance = next(link["probability"] for link in first if {link["a"], link["b"]} == {"S001", "S002"})
    (page,) = [page for page in site_sheets.pages_with("Links: to number") if "S001" in site_sheets.texts[page]]
    assert f"2 ({100 * min(chance, 0.999):.1f})" in site_sheets.texts[page]


@pytest.mark.slow
def test_unknown_instrument_heights_and_stations_of_no_floor_are_listed(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    def forget(document: dict[str, Any]) -> None:
        document["stations"][0]["instrument_height_m"] = None
        document["stations"][2]["floor"] = ""

    words = "\n".join(pdf_of(edited(forget)).texts)
    assert words.count("not known\n") >= 2
    assert "Stations of no floor" in words
    assert len(re.findall(r"^S003$", words, re.MULTILINE)) == 1


def test_element_name_that_is_markup_is_printed_as_it_is(site_sheets: Any) -> None:
    assert "wall <b>&amp; Küche Ψ" in "\n".join(site_sheets.texts)


def test_names_that_are_none_are_printed_or_told(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any], rename_station: Callable[..., None]
) -> None:
    def rename(document: dict[str, Any]) -> None:
        document["floors"][0]["name"] = "Erdgeschoß <&> Ωμέγα\x07\u202e"
        document["floors"][1]["name"] = "二階" + 80 * " lang"
        rename_station(document, "S001", "a)(\\b\x07")

    sheets = pdf_of(edited(rename))
    words = "\n".join(sheets.texts)
    assert "Erdgeschoß <&> Ωμέγα\\x07\\u202e" in words
    assert "a)(\\b\ufffd" in words
    assert any("二階" in remark and "font" in remark for remark in sheets.remarks)


def _with_bottleneck(document: dict[str, Any], overlap: float, weak_motion: dict[str, Any] | None) -> None:
    """One network that hangs on the link of the first two stations, and two that it would join."""
    registration = document["registration"]
    link = {"a": "S001", "b": "S002", "overlap": overlap, "strength": 0.05, "weak_motion": weak_motion}
    others = [each for each in registration["links"] if {each["a"], each["b"]} != {"S001", "S002"}]
    registration["links"] = [*others, link]
    registration["networks"] = [{**registration["networks"][0], "bottleneck": link}]
    registration["gaps"] = [{"networks": [0, 1], "best": link}]


def test_overlap_of_a_link_reads_the_same_on_every_sheet(
    edited: Callable[..., PlanSource], pdf_of: Callable[..., Any]
) -> None:
    words = "\n".join(pdf_of(edited(lambda document: _with_bottleneck(document, 0.27966046, None))).texts)
    assert len(re.findall(r"^[12] \(28\.0\)", words, re.MULTILINE)) == 2
    assert "1 to 2: 28.0 %" in words
    assert "1 to 2\n28.0\n" in words
    assert "27.9" not in words


@pytest.mark.parametrize(
    ("kind", "direction", "on_site", "in_scene"),
    [
        # The grid's north is 20 degrees to the right of +y: 136 degrees from +y are 116 from north.
        ("turn", [-0.694658, 0.71934, 0.0], "tilt about NW–SE", "tilt about the line 44° from y to -x"),
        ("shift", [0.0, 1.0, 0.0], "shift N–S", "shift along y"),
        ("shift", [0.422618, 0.906308, 0.0], "shift N–S", "shift along the line 25° from y to x"),
        ("shift", [-0.34202, 0.939693, 0.0], "shift NW–SE", "shift along the line 20° from y to -x"),
        ("turn", [0.0, 0.0, 1.0], "turn (heading)", "turn (heading)"),
    ],
)
def test_weak_motion_is_told_by_the_north_that_the_sheets_show(
    edited: Callable[..., PlanSource],
    site_plan: PlanSource,
    kind: str,
    direction: list[float],
    on_site: str,
    in_scene: str,
) -> None:
    plan = edited(lambda document: _with_bottleneck(document, 0.3, {"kind": kind, "direction": direction}))
    for frame, told in ((site_plan.frame, on_site), (plan.frame, in_scene)):
        table = networks_table(replace(plan, frame=frame))
        assert table is not None
        assert table.rows[0][3] == f"1 to 2: 30.0 %, {told}"


@pytest.mark.parametrize(
    ("share", "required", "told"),
    [
        (0.9496, 0.95, "just below 95"),
        (0.9504, 0.95, "95.0"),
        (0.95, 0.95, "95.0"),
        (0.9096, 0.95, "91.0"),
        (0.9496, 0.9, "95.0"),
    ],
)
def test_coverage_that_falls_short_never_reads_as_enough(share: float, required: float, told: str) -> None:
    assert reached_percent(share, required) == told


def test_a_floor_without_anything_scannable_has_no_percentage(edited: Callable[..., PlanSource]) -> None:
    def empty(document: dict[str, Any]) -> None:
        document["coverage"]["floors"][0] |= {"fraction_of_achievable": 1.0, "achievable_area_m2": 0.0}

    rows = floors_table(edited(empty)).rows
    assert rows[0][-2:] == ("none", "0")
    assert rows[1][-2] not in ("none", "100.0")


def test_a_floors_requirement_is_its_own_where_the_client_wrote_it_by_its_id(edited: Callable[..., PlanSource]) -> None:
    def by_id(document: dict[str, Any]) -> None:
        document["requirements"]["results"][1] |= {"name": "F1", "required": 0.85}

    plan = edited(by_id)
    asked = plan.document["requirements"]["coverage"]
    assert [required_on(plan.document, floor.id) for floor in plan.floors] == [asked, 0.85]
