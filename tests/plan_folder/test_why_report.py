"""Reasons in the report, in plan.json and in unseen_surfaces.csv, against the plan they tell of."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from html import unescape
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from planner_core.coverage.why import explain
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import REASONS, PartResult, Plan, PointLimits, Room, Survey
from planner_core.plan_folder.carry_over import foreign_entries
from planner_core.plan_folder.plan_json import plan_document, plan_text
from planner_core.plan_folder.plan_source import source_of
from planner_core.plan_folder.plan_tables import REASON_TEXTS
from planner_core.plan_folder.report import report_files, report_page, write_coverage_curve
from planner_core.plan_folder.unseen_csv import unseen_surfaces_csv

SCHEMA_FILE = Path(__file__).parents[2] / "docs" / "formats" / "plan.schema.json"
_BOX = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
_FACES = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], dtype=np.int32)


@pytest.fixture(scope="module")
def told(plan: Plan, survey: Survey, engine: ScanEngine) -> Plan:
    """The plan of three stations, with rooms, two candidates more, and the reasons of what they miss."""
    rooms = tuple(
        Room(name, title, f"room-{name}", 0, low + _BOX * np.array([3.9, 4.0, 2.6]), _FACES)
        for name, title, low in (("1", "Küche & Bad", [0.0, 0, 0]), ("2", "<Flur>", [4.1, 0, 0]))
    )
    with_rooms = dataclasses.replace(survey, scene=dataclasses.replace(survey.scene, rooms=rooms))
    stations_m = np.array([station.position_m for station in plan.stations])
    candidates_m = np.concatenate([stations_m, [[1.0, 3.5, 1.5], [7.5, 0.5, 4.4]]])
    ids = [station.id for station in plan.stations]
    why = explain(
        with_rooms,
        plan.settings.requirements,
        engine,
        candidates_m=candidates_m,
        seen_by_candidates=engine.visible_patches(survey.template, candidates_m),
        station_ids=ids,
        seen_by_stations=engine.visible_patches(survey.template, stations_m),
        scope=np.ones(survey.patches.n_patches, dtype=bool),
        links=plan.links,
    )
    asked = PartResult("Wände < 2 m", 0.9, 10.0, 8.996, 20.0, 2, PointLimits(range_m=4.0, incidence_rad=1.0))
    met = PartResult("overall", 0.9, 10.0, 9.0, 20.0)
    return dataclasses.replace(plan, survey=with_rooms, why=why, requirements=(asked, met))


@pytest.mark.slow
def test_plan_json_with_reasons_follows_its_schema_and_adds_up(told: Plan) -> None:
    document = plan_document(told)
    jsonschema.validate(document, json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))
    why = document["why"]
    for reason in REASONS[1:]:
        listed = sum(s["area_m2"] for s in why["unseen_surfaces"] if s["reason"] == reason)
        expected = why["area_by_reason_m2"][reason]
        assert listed + why["unlisted_area_m2"][reason] == pytest.approx(expected, abs=1e-3), reason
    total_m2 = told.survey.patches.area_m2.sum()
    assert sum(why["area_by_reason_m2"].values()) == pytest.approx(total_m2, abs=1e-4)


def test_plan_json_has_every_place_in_the_scene_frame(told: Plan) -> None:
    why, offset_m = plan_document(told)["why"], told.survey.scene.offset_m
    assert offset_m.min() > 50
    places = [piece["centroid"] for s in why["unseen_surfaces"] for piece in s["pieces"]]
    places += [s["best_spot"]["position"] for s in why["unseen_surfaces"] if s["best_spot"]]
    local_m = np.array(places) - offset_m
    assert (local_m > -1).all()
    assert (local_m < 22).all()
    assert any(s["best_spot"] for s in why["unseen_surfaces"])


def test_csv_lists_every_unseen_surface(told: Plan) -> None:
    rows = list(csv.DictReader(io.StringIO(unseen_surfaces_csv(told, told.why))))
    assert len(rows) == len(told.why.unseen)
    total_m2 = sum(float(row["area_m2"]) for row in rows)
    assert total_m2 == pytest.approx(sum(told.why.area_by_reason_m2[1:]), abs=1e-4 * len(rows))
    assert {row["reason"] for row in rows} <= set(REASONS[1:])
    assert "Küche & Bad" in {row["room"].removeprefix("1 ") for row in rows}
    assert all((row["best_x_m"] != "") == (row["reason"] == "not worth a station") for row in rows)


def test_page_says_what_is_met_who_is_needed_and_why_surface_is_missed(told: Plan) -> None:
    markup = report_page(told)
    assert "Wände &lt; 2\xa0m" in markup
    assert "1 Küche &amp; Bad" in markup.replace("\xa0", " ")
    assert "<Flur>" not in markup
    page = unescape(markup).replace("\xa0", " ")
    assert "at most range 4 m, incidence 57.3°, from 2 stations" in page
    assert page.count("NOT met") == 1
    assert ">just below 90<" in page  # 89.96 %
    for station in told.why.stations:
        largest = told.survey.scene.elements[station.own_parts[0].element].name
        assert largest in page.replace("<wbr>", "")
    for reason, area_m2 in zip(REASONS[1:], told.why.area_by_reason_m2[1:], strict=True):
        assert (REASON_TEXTS[reason] in page) == (area_m2 > 0), reason


def test_every_reason_has_words_for_people() -> None:
    assert tuple(REASON_TEXTS) == REASONS[1:]


def test_plan_without_reasons_has_neither_their_file_nor_their_columns(plan: Plan) -> None:
    assert "unseen_surfaces.csv" not in report_files(plan)
    assert plan_document(plan)["why"] is None
    assert "Unique surface" not in report_page(plan)


def test_files_of_the_report_are_the_plans_own(told: Plan, tmp_path: Path) -> None:
    (tmp_path / "report").mkdir()
    (tmp_path / "plan.json").write_text(plan_text(told), encoding="utf-8")
    for name in report_files(told):
        (tmp_path / "report" / name).touch()
    assert "unseen_surfaces.csv" in report_files(told)
    assert foreign_entries(tmp_path) == ()


@pytest.mark.slow
def test_curve_is_drawn_with_and_without_reasons(plan: Plan, told: Plan, tmp_path: Path) -> None:
    write_coverage_curve(source_of(plan), tmp_path / "chosen.png")
    write_coverage_curve(source_of(told), tmp_path / "steepest.png")
    write_coverage_curve(source_of(told), tmp_path / "again.png")
    steepest = (tmp_path / "steepest.png").read_bytes()
    assert steepest == (tmp_path / "again.png").read_bytes()
    assert steepest != (tmp_path / "chosen.png").read_bytes()
