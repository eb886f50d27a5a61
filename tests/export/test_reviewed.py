"""Exports as reviewed: stations where reviewers put them, and nothing told that no longer holds."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from small_pictures import draw_blank

from planner_core.errors import ExportError
from planner_core.export import reviewed
from planner_core.export.reviewed import OFFERED, edited_stations, export_reviewed
from planner_core.export.write import export_plan
from planner_core.model import Entrance
from planner_core.model.review import ForbiddenPlace, Zone
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.review.changes import (
    AddComment,
    AddEntrance,
    AddStation,
    AddZone,
    Change,
    Forbid,
    LockStation,
    MoveStation,
    RemoveStation,
    SetVerdict,
)
from planner_core.review.store import ReviewStore

from .conftest import by_hand


def change(folder: Path, *changes: Change) -> None:
    store = ReviewStore(folder)
    store.commit(store.current().revision, changes, "Kim")


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


def exported(folder: Path, name: str = "csv") -> tuple[list[dict[str, str]], tuple[str, ...]]:
    target = folder.parent / f"out-{len(list(folder.parent.iterdir()))}.csv"
    remarks = export_reviewed(name, folder, target)
    return rows_of(target), remarks


def test_stations_of_the_list_are_those_of_the_review(box_folder: Path) -> None:
    folder = box_folder / "plan"
    planned = read_plan_json(folder)["stations"]
    (x, y, z), first = planned[0]["position"], planned[0]["id"]
    before, _ = exported(folder)
    change(folder, AddComment("fine"), SetVerdict(first, "accepted"))
    unchanged, remarks = exported(folder)
    assert unchanged == before
    assert not [line for line in remarks if "reviewed" in line]
    added = AddStation((x + 0.5, y + 0.5, z), planned[0]["floor"], 1.5, station="N1")
    change(folder, MoveStation(first, (x + 0.25, y, z)), added)
    after, remarks = exported(folder)
    assert [row["name"] for row in after] == [first, "N1", *(row["name"] for row in before[1:])]
    east = {row["name"]: float(row["easting_m"]) for row in after}
    north = {row["name"]: float(row["northing_m"]) for row in after}
    was = {row["name"]: (float(row["easting_m"]), float(row["northing_m"])) for row in before}
    moved_m = ((east[first] - was[first][0]) ** 2 + (north[first] - was[first][1]) ** 2) ** 0.5
    assert moved_m == pytest.approx(0.25, abs=1e-3)  # the map is turned and scaled, hardly
    assert [row["order"] for row in after] == [str(n) for n in range(1, len(after) + 1)]
    [said] = [line for line in remarks if "as reviewed" in line]
    assert first in said and "N1" in said
    change(folder, RemoveStation("N1"))
    assert "N1" not in {row["name"] for row in exported(folder)[0]}


def test_all_that_is_handed_over_has_the_same_stations_in_the_same_order_by_the_same_numbers(
    written_plan: Callable[..., Path], tmp_path: Path
) -> None:
    import ifcopenshell
    from ifcopenshell.util.element import get_psets

    planned = by_hand()["stations"]
    folder = written_plan(stations=[{**each, "instrument_height_m": 1.5} for each in planned])
    change(folder, AddStation((2.5, 3.0, 4.3), "F1", 1.5), RemoveStation("S001"))
    rows, _ = exported(folder)
    assert [(row["name"], row["order"]) for row in rows] == [("S002", "1"), ("S004", "2"), ("S003", "3")]
    export_plan("field", folder, tmp_path / "field.html")
    field = re.search(
        r'<script id="plan" type="application/json">(.*?)</script>', (tmp_path / "field.html").read_text()
    )
    assert field is not None
    # S003 is scanned already.
    stations = json.loads(field[1])["stations"]
    assert [(each["id"], each["number"]) for each in stations] == [("S002", 2), ("S004", 4)]
    export_reviewed("ifc", folder, tmp_path / "stations.ifc")
    model = ifcopenshell.open(str(tmp_path / "stations.ifc"))
    marks = model.by_type("IfcBuildingElementProxy")
    found = {next(iter(get_psets(mark).values()))["Id"]: (mark.Description, mark.Tag) for mark in marks}
    assert found == {f"S00{n}": (f"Station {order} on the route", str(n)) for order, n in ((1, 2), (2, 4), (3, 3))}


def test_links_and_areas_of_edited_stations_are_left_out_of_ifc(box_folder: Path, tmp_path: Path) -> None:
    import ifcopenshell
    from ifcopenshell.util.element import get_psets

    folder = box_folder / "plan"
    (station, *_) = read_plan_json(folder)["stations"]
    x, y, z = station["position"]
    change(folder, MoveStation(station["id"], (x + 0.25, y, z)))
    export_reviewed("ifc", folder, tmp_path / "stations.ifc")
    model = ifcopenshell.open(str(tmp_path / "stations.ifc"))
    figures = next(iter(get_psets(by_name(model, station["id"])).values()))
    assert "OwnArea" not in figures and "CoveredArea" not in figures and "LinkedTo" not in figures
    assert figures["Id"] == station["id"]


def by_name(model: object, name: str) -> object:
    return next(each for each in model.by_type("IfcBuildingElementProxy") if name in (each.Name or ""))  # type: ignore[attr-defined]


def test_sheets_of_edited_stations_need_the_scene_and_say_so(box_folder: Path, tmp_path: Path) -> None:
    folder = tmp_path / "alone" / "plan"
    shutil.copytree(box_folder / "plan", folder)
    (station, *_) = read_plan_json(folder)["stations"]
    x, y, z = station["position"]
    change(folder, MoveStation(station["id"], (x + 0.25, y, z)))
    with pytest.raises(
        ExportError,
        match=r"pdf: figures of edited stations, and routes from other entrances, are computed from.*box\.ifc",
    ):
        export_reviewed("pdf", folder, tmp_path / "sheets.pdf")
    assert not (tmp_path / "sheets.pdf").exists()


def test_a_review_without_stations_is_refused(box_folder: Path, tmp_path: Path) -> None:
    folder = box_folder / "plan"
    change(folder, *(RemoveStation(row["id"]) for row in read_plan_json(folder)["stations"]))
    with pytest.raises(ExportError, match="took all stations out"):
        export_reviewed("csv", folder, tmp_path / "stations.csv")


@pytest.mark.slow
def test_sheets_of_edited_stations_tell_figures_of_those(
    box_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw_blank(monkeypatch)
    folder = box_folder / "plan"
    planned = read_plan_json(folder)
    (station, *_) = planned["stations"]
    x, y, z = station["position"]
    change(folder, AddStation((x + 0.5, y + 0.5, z), station["floor"], 1.5, station="N1"))
    export_reviewed("html", folder, tmp_path / "reviewed.html")
    page = (tmp_path / "reviewed.html").read_text(encoding="utf-8")
    assert "N1" in page
    export_plan("html", folder, tmp_path / "planned.html")
    assert "N1" not in (tmp_path / "planned.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("is_edited", [False, True], ids=["as planned", "edited"])
def test_sheets_have_the_keep_outs_and_forbidden_places_of_reviewers(
    box_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_edited: bool
) -> None:
    draw_blank(monkeypatch)
    folder = box_folder / "plan"
    (station, *_) = read_plan_json(folder)["stations"]
    x, y, z = station["position"]
    outline = ((x - 1, y - 1), (x + 1, y - 1), (x + 1, y + 1), (x - 1, y + 1))  # around the station
    asked = Zone("", "priority", outline, name="Priority", coverage=0.9)
    change(folder, *(AddZone(zone) for zone in (Zone("", "keep_out", outline, name="Machine"), asked)))
    change(folder, Forbid(ForbiddenPlace("", (x, y, z), 0.4, station["floor"])))
    if is_edited:
        change(folder, AddStation((x + 0.5, y + 0.5, z), station["floor"], 1.5, station="N1"))
    export_reviewed("html", folder, tmp_path / "reviewed.html")
    page = (tmp_path / "reviewed.html").read_text(encoding="utf-8")
    assert page.count(">keep-out: Machine<") == page.count(">no station<") == 1
    assert "Priority" not in page
    export_plan("html", folder, tmp_path / "planned.html")
    assert "Machine" not in (tmp_path / "planned.html").read_text(encoding="utf-8")


def test_what_changes_no_station_leaves_figures_as_they_are(box_folder: Path) -> None:
    folder = box_folder / "plan"
    store = ReviewStore(folder)
    (first, *_) = store.plan().stations
    change(folder, LockStation(first.id), AddComment("look here", target=first.id))
    assert edited_stations(store.plan(), store.current()) == ()


def test_all_that_is_offered_is_a_file() -> None:
    from planner_core.export.formats import FORMATS

    assert not [name for name in OFFERED if FORMATS[name].is_folder]


@pytest.mark.slow
def test_sheets_of_a_plan_that_is_entered_elsewhere_have_the_route_from_there(
    box_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = box_folder / "plan"
    planned = read_plan_json(folder)
    station = planned["stations"][-1]
    x, y, z = station["position"]
    ground = (x, y, z - station["instrument_height_m"])
    change(folder, AddEntrance(Entrance("", ground, station["floor"])))
    told = []

    def look(name: str, of: object, *more: object, **options: object) -> object:
        told.append(read_plan_json(of) if isinstance(of, Path) else None)
        return export_plan("csv", of, *more, **options)  # type: ignore[arg-type]

    draw_blank(monkeypatch)
    monkeypatch.setattr(reviewed, "export_plan", look)
    export_reviewed("csv", folder, tmp_path / "stations.csv")
    export_reviewed("html", folder, tmp_path / "reviewed.html")
    places, figures = told
    assert places is None, "a list of stations needs no scene for it"
    assert planned["route"]["start"] is None
    assert figures["route"]["start"] == pytest.approx(ground, abs=0.5)
    assert figures["stations"][0]["id"] is not None
    assert figures["route"]["legs"][0]["to"] == station["id"]
