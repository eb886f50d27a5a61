"""Exports as reviewed: stations where reviewers put them, and nothing told that no longer holds."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from in_process import run_here
from shared_plans import SharedPlan
from small_pictures import draw_blank

from planner_core.errors import CrsNeededError, ExportError
from planner_core.export import reviewed
from planner_core.export.formats import FORMATS
from planner_core.export.options import Options
from planner_core.export.reviewed import OFFERED, edited_stations, export_reviewed, opened_as_reviewed
from planner_core.export.write import check_export, export_pack, export_plan
from planner_core.model import Entrance
from planner_core.model.review import ForbiddenPlace, Zone
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_source import PlanSource, open_plan
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
from planner_core.review.stations import reviewed_stations
from planner_core.review.store import ReviewStore


def change(folder: Path, *changes: Change) -> None:
    store = ReviewStore(folder)
    store.commit(store.current().revision, changes, "Kim")


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


def exported(folder: Path, name: str = "csv") -> tuple[list[dict[str, str]], tuple[str, ...]]:
    target = folder.parent / f"out-{len(list(folder.parent.iterdir()))}.csv"
    remarks = export_reviewed(name, folder, target)
    return rows_of(target), remarks


@pytest.mark.slow
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


#: As they are handed over: id, number, place in the walk, sensor in the scene's metres, instrument height.
HandedOver = list[tuple[str, int, int, tuple[float, float, float], float]]


def of_csv(path: Path) -> HandedOver:
    found: HandedOver = []
    for row in rows_of(path):
        ground_m = [float(row[name]) for name in ("easting_m", "northing_m", "ground_z_m")]
        height_m = float(row["instrument_height_m"])
        name, number = row["name"], int(row["name"].lstrip("S"))
        found.append((name, number, int(row["order"]), (*ground_m[:2], ground_m[2] + height_m), height_m))
    return found


def of_dxf(path: Path) -> HandedOver:
    import ezdxf

    from planner_core.export.dxf import BLOCK

    found: HandedOver = []
    marks = ezdxf.readfile(path).modelspace().query(f'INSERT[name=="{BLOCK}"]')
    for order, mark in enumerate(marks, start=1):
        told = {attrib.dxf.tag: attrib.dxf.text for attrib in mark.attribs}
        at = (float(told["E"]), float(told["N"]), float(told["H_SENSOR"]))
        found.append((told["ID"], int(told["NUMBER"]), order, at, float(told["H_INSTR"])))
    return found


def of_ifc(path: Path) -> HandedOver:
    import ifcopenshell
    from ifcopenshell.util.element import get_psets
    from ifcopenshell.util.placement import get_local_placement

    found: HandedOver = []
    model = ifcopenshell.open(str(path))  # its parts live as long as it does
    for mark in model.by_type("IfcBuildingElementProxy"):
        figures = next(iter(get_psets(mark).values()))
        height_m = figures["InstrumentHeight"]
        x, y, z = get_local_placement(mark.ObjectPlacement)[:3, 3].tolist()
        order = re.fullmatch(r"Station (\d+) on the route", mark.Description)
        assert order is not None
        found.append((figures["Id"], int(mark.Tag), int(order[1]), (x, y, z), height_m))
    return found


def of_usd(path: Path) -> HandedOver:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    offset_m = np.array(stage.GetPrimAtPath("/Plan").GetAttribute("tlsplan:offset").Get())
    found: HandedOver = []
    for prim in stage.GetPrimAtPath("/Plan/Stations").GetChildren():
        world = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        x, y, z = (np.array(world.ExtractTranslation()) + offset_m).tolist()
        order, height_m = (prim.GetAttribute(f"tlsplan:{name}").Get() for name in ("order", "instrumentHeight"))
        found.append((prim.GetName(), int(prim.GetName().lstrip("S")), order, (x, y, z), height_m))
    return found


def of_field_page(path: Path) -> HandedOver:
    page = re.search(r'<script id="plan" type="application/json">(.*?)</script>', path.read_text(encoding="utf-8"))
    assert page is not None
    return [
        (each["id"], each["number"], order, tuple(each["position"]), each["instrument_height_m"])
        for order, each in enumerate(json.loads(page[1])["stations"], start=1)
    ]


def of_sheets(path: Path) -> HandedOver:
    """Rows of the table of stations, to the millimetre."""
    import pypdf

    words = "\n".join(page.extract_text() for page in pypdf.PdfReader(path).pages)
    rows = re.findall(r"^(\d+)\n(S\d{3})\n([-\d.]+)\n([-\d.]+)\n[-\d.]+\n([-\d.]+)\n([-\d.]+)$", words, re.MULTILINE)
    return [
        (name, int(number), order, (float(x), float(y), float(z)), float(height_m))
        for order, (number, name, x, y, height_m, z) in enumerate(rows, start=1)
    ]


READERS: dict[str, Callable[[Path], HandedOver]] = {
    "csv": of_csv, "dxf": of_dxf, "ifc": of_ifc, "usd-stations": of_usd, "field": of_field_page, "pdf": of_sheets,
}  # fmt: skip


@pytest.mark.slow
def test_all_that_is_handed_over_has_the_stations_of_the_review(
    house_plan: SharedPlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One reviewed state, a station moved, one added and one taken out, in every format that crews and offices get."""
    draw_blank(monkeypatch)
    folder = tmp_path / "plan"
    shutil.copytree(house_plan.folder, folder)
    shutil.copy(house_plan.scene_file, tmp_path)
    planned = sorted(read_plan_json(folder)["stations"], key=lambda each: each["order"])
    moved, gone, near = planned[1], planned[3], planned[-2]
    (x, y, z), (u, v, w) = moved["position"], near["position"]
    added = AddStation((u + 0.25, v + 0.25, w), near["floor"], near["instrument_height_m"])
    change(folder, MoveStation(moved["id"], (x + 0.125, y, z)), added, RemoveStation(gone["id"]))
    store = ReviewStore(folder)
    reviewed_state = reviewed_stations(store.plan(), store.current())
    expected = [
        (each.id, int(each.id.lstrip("S")), order, each.position_m, each.instrument_height_m)
        for order, each in enumerate(reviewed_state, start=1)
    ]
    assert len(expected) == len(planned) and any(each.added for each in reviewed_state)
    with opened_as_reviewed(folder, tuple(READERS)) as (plan, _):
        written = export_pack(tuple(READERS), plan, tmp_path / "pack", Options(columns="generic"))
    assert written.failed == ()
    for name, read in READERS.items():
        found = sorted(read(tmp_path / "pack" / FORMATS[name].file_name), key=lambda each: each[2])
        assert [each[:3] for each in found] == [each[:3] for each in expected], name
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose([*one[3], one[4]], [*other[3], other[4]], atol=5.1e-4, err_msg=name)
    for name, options in (("reviewed", ()), ("planned", ("--as-planned",))):
        target = tmp_path / f"{name}.csv"
        command = ("export", folder, "--format", "csv", "--columns", "generic", "-o", target, *options)
        assert run_here(*command).returncode == 0
        stations = expected if name == "reviewed" else [(each["id"],) for each in planned]
        assert [row["name"] for row in rows_of(target)] == [each[0] for each in stations]


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


def test_what_can_not_be_written_is_refused_before_edited_stations_are_evaluated(
    box_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = box_folder / "plan"
    (station, *_) = read_plan_json(folder)["stations"]
    x, y, z = station["position"]
    change(folder, MoveStation(station["id"], (x + 0.25, y, z)))
    monkeypatch.setattr(reviewed, "_evaluated", lambda *_: pytest.fail("evaluated"))
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "notes.txt").write_text("mine")
    (tmp_path / "own.dxf").write_text("mine")
    for target, names, code, message in (
        ("own", "dxf,geojson", 5, "holds files that were not exported from a plan"),
        ("own.dxf", "dxf", 5, "exists, expected a free name"),
    ):
        refused = run_here("export", folder, "--format", names, "-o", tmp_path / target)
        assert (refused.returncode, message in refused.stderr) == (code, True), refused.stderr
    plan = open_plan(folder)
    plan = replace(plan, frame=replace(plan.frame, crs=""))
    with pytest.raises(CrsNeededError, match=r"geojson: .*expected a CRS for longitude and latitude; give --crs"):
        check_export(("dxf", "geojson"), plan, tmp_path / "pack", Options(), is_pack=True, overwrite=False)


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
        told.append(of.document if isinstance(of, PlanSource) and of.planned is not None else None)
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
