"""KML, read back with GDAL's LIBKML, and its heights with ElementTree."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from field_plan import STATIONS, field_plan, on_site, site_frame

from planner_core.errors import CrsNeededError, ExportError, RequirementError
from planner_core.export.kml import write_kml
from planner_core.plan_folder.plan_source import PlanSource

Write = Callable[..., tuple[Path, tuple[str, ...]]]
NS = "{http://www.opengis.net/kml/2.2}"


def layer(path: Path, name: str) -> list[tuple[dict[str, Any], np.ndarray]]:
    meta, _, geometry, columns = pyogrio.raw.read(path, layer=name)
    fields = [dict(zip(meta["fields"], values, strict=True)) for values in zip(*columns, strict=True)]
    corners = [shapely.get_coordinates(shape, include_z=True) for shape in shapely.from_wkb(geometry)]
    return list(zip(fields, corners, strict=True))


def degrees(x: float, y: float) -> tuple[float, float]:
    east, north, _ = on_site(x, y, 0.0)
    longitude, latitude = pyproj.Proj("+proj=utm +zone=32 +ellps=GRS80")(east, north, inverse=True)
    return longitude, latitude


def test_every_floor_is_a_folder_with_its_stations(write: Write, site_plan: PlanSource) -> None:
    path, _ = write(write_kml, site_plan, "out.kml")
    assert pyogrio.list_layers(path)[:, 0].tolist() == ["F0 Erdgeschoß", "F1 Upper floor", "route", "links", "floors"]
    found = [*layer(path, "F0 Erdgeschoß"), *layer(path, "F1 Upper floor")]
    assert [fields["Name"] for fields, _ in found] == list(STATIONS)
    for (fields, corners), (_, x, y, z, height, _) in zip(found, STATIONS.values(), strict=True):
        assert corners[0, :2] == pytest.approx(degrees(x, y), abs=1.01e-9)
        assert corners[0, 2] == pytest.approx(z, abs=0.51e-4)  # the lowest floor is the ground
        assert float(fields["ground_height_m"]) == pytest.approx(515.0 + z, abs=0.51e-4)
        assert float(fields["instrument_height_m"]) == pytest.approx(height, abs=0.51e-4)
        assert float(fields["sensor_height_m"]) == pytest.approx(515.0 + z + height, abs=0.51e-4)


@pytest.mark.parametrize(
    ("heights", "instrument", "mode", "height", "said"),
    [
        ("relative", "ground", "relativeToGround", 2.8, "heights above the lowest floor"),
        ("relative", "sensor", "relativeToGround", 2.8 + 1.62345, "their sensors"),
        ("absolute", "ground", "absolute", 517.8, "EGM96"),
        ("absolute", "sensor", "absolute", 517.8 + 1.62345, "EGM96"),
    ],
)
def test_heights_are_of_the_kind_that_the_document_says(
    write: Write, site_plan: PlanSource, heights: str, instrument: str, mode: str, height: float, said: str
) -> None:
    path, _ = write(write_kml, site_plan, kml_heights=heights, instrument=instrument)
    root = ElementTree.parse(path).getroot()
    assert {element.text for element in root.iter(f"{NS}altitudeMode")} == {mode}
    assert said in (root.findtext(f"{NS}Document/{NS}description") or "")
    assert "EPSG:25832" in (root.findtext(f"{NS}Document/{NS}description") or "")
    (mark,) = (each for each in root.iter(f"{NS}Placemark") if each.findtext(f"{NS}name") == "S003")
    text = mark.findtext(f"{NS}Point/{NS}coordinates") or ""
    assert float(text.split(",")[2]) == pytest.approx(height, abs=0.51e-4)


def test_styles_that_are_used_are_there(write: Write, site_plan: PlanSource) -> None:
    root = ElementTree.parse(write(write_kml, site_plan)[0]).getroot()
    styles = {f"#{style.attrib['id']}" for style in root.iter(f"{NS}Style")}
    used = {element.text for element in root.iter(f"{NS}styleUrl")}
    assert used <= styles
    assert {"#station", "#scanned", "#link", "#weak", "#route"} <= used


def test_links_and_walk_join_stations(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_kml, site_plan, "out.kml")
    links = layer(path, "links")
    assert [fields["Name"] for fields, _ in links] == ["S001-S002", "S003-S004"]
    assert links[0][1][:, :2] == pytest.approx(np.array([degrees(9.0, 5.0), degrees(1.25, 2.5)]), abs=1.01e-9)
    assert "does not count" in links[1][0]["description"]
    route = layer(path, "route")
    assert [fields["Name"] for fields, _ in route] == ["S001 to S002", "S002 to S003"]
    assert route[1][1][:, 2] == pytest.approx([0.02, 2.8])
    assert "no path inside the model leads from S003 to S004" in remarks


def test_floors_are_closed_outlines_at_their_height(write: Write, site_plan: PlanSource) -> None:
    for (fields, corners), (name, z) in zip(
        layer(write(write_kml, site_plan, "out.kml")[0], "floors"),
        (("Erdgeschoß", 0.0), ("Upper floor", 2.8)),
        strict=True,
    ):
        assert fields["Name"] == name
        assert corners[0].tolist() == corners[-1].tolist()
        assert corners[:, 2] == pytest.approx(np.full(5, z))


def test_a_plan_without_a_crs_is_refused(write: Write, scene_plan: PlanSource) -> None:
    with pytest.raises(CrsNeededError, match="kml: the plan is in scene coordinates without a CRS"):
        write(write_kml, scene_plan)


def test_an_unknown_ground_point_is_refused(write: Write) -> None:
    plan = field_plan(site_frame(), {"A": ("F0", 1.0, 2.0, 3.0, math.nan, False)})
    with pytest.raises(ExportError, match="instrument height of A"):
        write(write_kml, plan)
    path, _ = write(write_kml, plan, "out.kml", instrument="sensor")
    assert layer(path, "F0 Erdgeschoß")[0][1][0, 2] == pytest.approx(3.0)


def test_an_unknown_kind_of_heights_is_refused(write: Write, site_plan: PlanSource) -> None:
    with pytest.raises(RequirementError, match="--kml-heights: got 'deep'"):
        write(write_kml, site_plan, kml_heights="deep")


def test_overlap_that_falls_short_never_reads_as_what_was_asked(write: Write, site_plan: PlanSource) -> None:
    short = replace(site_plan.links[0], overlap=0.29996)
    path, _ = write(write_kml, replace(site_plan, links=(short,)), "out.kml")
    assert layer(path, "links")[0][0]["description"] == "overlap just below 30 %, strength 0.1530, does not count"
