"""A pack of all formats for a plan without a CRS: what needs one is left out; asked for by name, it is refused."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from field_plan import field_plan, site_frame

from planner_core.errors import CrsNeededError
from planner_core.export import formats
from planner_core.export.formats import FORMATS
from planner_core.export.write import export_pack
from planner_core.plan_folder.plan_source import PlanSource

NAMES = ("csv", "gsi16", "landxml", "geojson", "kml")


@pytest.fixture(autouse=True)
def few_formats(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "_FORMATS", tuple(FORMATS[name] for name in NAMES))


def in_folder(plan: PlanSource, folder: Path) -> PlanSource:
    (folder / "plan.json").write_text("{}")
    return replace(plan, folder=folder)


def held(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_pack_goes_without_what_needs_a_crs(tmp_path: Path) -> None:
    written = export_pack(["all"], in_folder(field_plan(), tmp_path), tmp_path / "pack")
    assert held(tmp_path / "pack") == {"stations.csv", "stations-16.gsi", "stations.xml", "pack.json"}
    assert sum("left out" in remark and "without a CRS" in remark for remark in written.remarks) == 2
    record = json.loads((tmp_path / "pack" / "pack.json").read_text(encoding="utf-8"))
    assert set(record["formats"]) == {"csv", "gsi16", "landxml"}


def test_a_pack_with_a_crs_has_them(tmp_path: Path) -> None:
    export_pack(["all"], in_folder(field_plan(site_frame()), tmp_path), tmp_path / "pack")
    assert {"stations.geojson", "stations.kml"} <= held(tmp_path / "pack")


def test_what_is_asked_for_by_name_is_not_left_out(tmp_path: Path) -> None:
    with pytest.raises(CrsNeededError, match="kml"):
        export_pack(["csv", "kml"], in_folder(field_plan(), tmp_path), tmp_path / "pack")
    assert not (tmp_path / "pack").exists()
