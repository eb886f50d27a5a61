"""The field file: all that it needs is in it, it names what it was made of, and no text of a plan breaks out of it."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.coordinates.request import FrameRequest
from planner_core.export.field_file import SCHEMA, write_field_file
from planner_core.export.options import Options
from planner_core.plan_folder.plan_source import open_plan
from planner_core.progress import silent
from planner_core.review.changes import AddStation, MoveStation, RemoveStation
from planner_core.review.store import ReviewStore


def written(folder: Path, path: Path, frame: FrameRequest | None = None) -> tuple[str, dict[str, Any], tuple[str, ...]]:
    remarks = write_field_file(open_plan(folder, frame=frame), path, Options(), silent)
    text = path.read_text(encoding="utf-8")
    data = re.search(r'<script id="plan" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert data is not None
    return text, json.loads(data[1]), remarks


def test_stations_are_those_of_the_review_and_the_file_knows_its_revision(box_folder: Path, tmp_path: Path) -> None:
    folder = box_folder / "plan"
    plan = json.loads((folder / "plan.json").read_text())
    station, floor = plan["stations"][0], plan["floors"][0]["id"]
    x, y, z = station["position"]
    store = ReviewStore(folder)
    store.commit(0, [AddStation((x + 0.5, y, z), floor), MoveStation(station["id"], (x + 0.1, y, z))], "Ada")
    _, document, remarks = written(folder, tmp_path / "field.html")
    sha256 = hashlib.sha256((folder / "plan.json").read_bytes()).hexdigest()
    assert (document["schema"], document["plan_sha256"], document["revision"]) == (SCHEMA, sha256, 1)
    told = {each["id"]: each for each in document["stations"]}
    assert told[station["id"]]["position"] == pytest.approx([x + 0.1, y, z], abs=1e-4)
    planned = [each["id"] for each in plan["stations"]]
    added = next(name for name in told if name not in planned)
    assert list(told) == [planned[0], added, *planned[1:]]
    assert [each["number"] for each in document["stations"]] == [int(name.lstrip("S0")) for name in told]
    assert len(remarks) == 1 and "walls" in remarks[0]  # this folder has no stage
    store.commit(1, [RemoveStation(station["id"])], "Ada")
    assert station["id"] not in {each["id"] for each in written(folder, tmp_path / "b.html")[1]["stations"]}


@pytest.mark.parametrize(
    ("crs", "unit", "name"),
    [("EPSG:25832", None, "EPSG:25832 ETRS89 / UTM zone 32N"), ("EPSG:2263", "ftUS", "EPSG:2263")],
)
def test_the_page_has_the_way_to_site_coordinates(
    box_folder: Path, tmp_path: Path, crs: str, unit: str | None, name: str
) -> None:
    origin = (458_870.0, 5_438_260.0, 110.0) if unit is None else (300_000.0, 60_000.0, 10.0)
    frame = FrameRequest(crs=crs, origin_m=origin, rotation_rad=0.3)
    _, document, _ = written(box_folder / "plan", tmp_path / "field.html", frame)
    source = open_plan(box_folder / "plan", frame=frame)
    site = document["site"]
    assert site["name"] == source.frame.crs_line and site["name"].startswith(name)
    assert site["unit"] == source.frame.unit.symbol
    planned = {each.id: each for each in source.stations}
    for station in document["stations"]:
        place = np.array(site["from_scene"]) @ [*station["position"], 1.0] / site["metres_per_unit"]
        expected = source.frame.in_unit(planned[station["id"]].site_m)
        np.testing.assert_allclose(place, expected, atol=2e-4)


def test_without_a_crs_the_page_has_scene_coordinates(box_folder: Path, tmp_path: Path) -> None:
    frame = FrameRequest(scene_coordinates=True)
    assert written(box_folder / "plan", tmp_path / "field.html", frame)[1]["site"] is None


def test_the_page_has_the_groups_of_stations_that_register(box_folder: Path, tmp_path: Path) -> None:
    file = box_folder / "plan" / "plan.json"
    plan = json.loads(file.read_text())
    networks = [list(network["stations"]) for network in plan["registration"]["networks"]]
    assert written(box_folder / "plan", tmp_path / "field.html")[1]["groups"] == networks
    assert sorted(name for ids in networks for name in ids) == sorted(each["id"] for each in plan["stations"])


def test_the_page_has_the_targets_of_pairs_that_register_by_these(box_folder: Path, tmp_path: Path) -> None:
    file = box_folder / "plan" / "plan.json"
    plan = json.loads(file.read_text())
    assert written(box_folder / "plan", tmp_path / "a.html")[1]["targets"] == []
    link = {
        "a": "S001",
        "b": "S002",
        "overlap": 0.01,
        "strength": 0.0,
        "targets": [[1, 2, 1.234], [5, 2, 1], [3, 2, 2]],
    }
    plan["registration"]["links"] = [link]
    file.write_text(json.dumps(plan))
    [targets] = written(box_folder / "plan", tmp_path / "b.html")[1]["targets"]
    assert targets == {"stations": ["S001", "S002"], "places": [[1, 2, 1.23], [5, 2, 1], [3, 2, 2]]}


def test_the_page_loads_nothing_and_runs_its_own_script_alone(box_folder: Path, tmp_path: Path) -> None:
    text, document, _ = written(box_folder / "plan", tmp_path / "field.html")
    script = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(script) == 1
    digest = base64.b64encode(hashlib.sha256(script[0].encode()).digest()).decode()
    assert "default-src 'none'" in text and f"script-src 'sha256-{digest}'" in text
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text)
    assert document["floors"] and document["stations"]


def test_a_name_that_ends_a_script_stays_a_name(box_folder: Path, tmp_path: Path) -> None:
    file = box_folder / "plan" / "plan.json"
    plan = json.loads(file.read_text())
    plan["floors"][0]["name"] = "</script><script>alert(1)</script>"
    file.write_text(json.dumps(plan))
    text, document, _ = written(box_folder / "plan", tmp_path / "field.html")
    assert document["floors"][0]["name"] == "</script><script>alert(1)</script>"
    assert "<script>alert" not in text
