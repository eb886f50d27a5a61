"""GeoJSON, read back with GDAL and held against PROJ and the rules of RFC 7946."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import pyproj
import pytest
import shapely
from field_plan import STATIONS, field_plan, on_site, site_frame

from planner_core.errors import CrsNeededError, ExportError, RequirementError
from planner_core.export.geojson import write_geojson
from planner_core.model import SiteFrame
from planner_core.plan_folder.plan_source import PlanSource

Write = Callable[..., tuple[Path, tuple[str, ...]]]


def rows(path: Path) -> tuple[dict[str, Any], list[tuple[dict[str, Any], Any]]]:
    """What GDAL says of the file, and of each feature its fields and its geometry."""
    meta, _, geometry, columns = pyogrio.raw.read(path)
    fields = [dict(zip(meta["fields"], values, strict=True)) for values in zip(*columns, strict=True)]
    return meta, list(zip(fields, shapely.from_wkb(geometry), strict=True))


def of_kind(path: Path, kind: str) -> list[tuple[dict[str, Any], Any]]:
    return [row for row in rows(path)[1] if row[0]["kind"] == kind]


def degrees(x: float, y: float, z: float) -> tuple[float, float]:
    """Longitude, latitude by the inverse of the projection alone: ETRS89 is WGS84 but for a metre that nobody knows."""
    east, north, _ = on_site(x, y, z)
    longitude, latitude = pyproj.Proj("+proj=utm +zone=32 +ellps=GRS80")(east, north, inverse=True)
    return longitude, latitude


def test_stations_are_where_proj_puts_them(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_geojson, site_plan, "out.geojson")
    stations = of_kind(path, "station")
    assert [fields["id"] for fields, _ in stations] == list(STATIONS)
    for (fields, point), (floor, x, y, z, height, fixed) in zip(stations, STATIONS.values(), strict=True):
        assert shapely.get_coordinates(point)[0] == pytest.approx(degrees(x, y, z), abs=1.01e-9)
        assert not point.has_z
        assert fields["floor"] == floor
        assert bool(fields["scanned_before"]) == fixed
        assert fields["ground_height_m"] == pytest.approx(515.0 + z, abs=0.51e-4)
        assert fields["instrument_height_m"] == pytest.approx(height, abs=0.51e-4)
        assert fields["sensor_height_m"] == pytest.approx(515.0 + z + height, abs=0.51e-4)
    assert rows(path)[0]["crs"] == "EPSG:4326"
    assert any("longitude and latitude by" in remark for remark in remarks)


def test_the_text_is_geojson_of_rfc_7946(write: Write, site_plan: PlanSource) -> None:
    path, _ = write(write_geojson, site_plan)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["type"] == "FeatureCollection"
    assert "crs" not in document
    assert "vertical datum not given" in document["heights"]
    ids = [feature["id"] for feature in document["features"]]
    assert len(set(ids)) == len(ids)
    for feature in document["features"]:
        assert feature["type"] == "Feature"
        assert set(feature) == {"type", "id", "properties", "geometry"}
    for feature in (each for each in document["features"] if each["properties"]["kind"] == "floor"):
        ((ring,),) = [feature["geometry"]["coordinates"]]
        assert ring[0] == ring[-1]
        assert shapely.LinearRing(ring).is_ccw


def test_links_join_their_stations(write: Write, site_plan: PlanSource) -> None:
    links = of_kind(write(write_geojson, site_plan, "out.geojson")[0], "link")
    (fields, line), (weak, _) = links
    assert (fields["from"], fields["to"], bool(fields["counts"]), bool(weak["counts"])) == ("S001", "S002", True, False)
    assert fields["overlap"] == pytest.approx(0.5649)
    assert weak["strength"] is None or math.isnan(weak["strength"])
    ends = [degrees(*STATIONS[name][1:4]) for name in ("S001", "S002")]
    np.testing.assert_allclose(shapely.get_coordinates(line), ends, atol=1.01e-9)


def test_the_walk_has_a_line_for_each_leg_that_can_be_walked(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_geojson, site_plan, "out.geojson")
    route = of_kind(path, "route")
    assert [fields["id"] for fields, _ in route] == ["S001 to S002", "S002 to S003"]
    assert shapely.get_coordinates(route[0][1])[1] == pytest.approx(degrees(5.0, 4.0, 0.0), abs=1.01e-9)
    assert "no path inside the model leads from S003 to S004" in remarks


def test_site_coordinates_are_named_so_that_gdal_knows_them(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_geojson, site_plan, "out.geojson", geojson_crs="local")
    meta, _ = rows(path)
    assert meta["crs"] == "EPSG:25832"
    for (_, point), (_, x, y, z, _, _) in zip(of_kind(path, "station"), STATIONS.values(), strict=True):
        assert shapely.get_coordinates(point, include_z=True)[0] == pytest.approx(on_site(x, y, z), abs=0.51e-4)
    assert any("RFC 7946" in remark for remark in remarks)


def test_scene_coordinates_are_written_only_when_asked_for(write: Write, scene_plan: PlanSource) -> None:
    with pytest.raises(CrsNeededError, match=r"scene coordinates without a CRS.*--crs.*--geojson-crs local"):
        write(write_geojson, scene_plan)
    path, remarks = write(write_geojson, scene_plan, geojson_crs="local")
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["crs"] is None
    assert document["coordinates"] == "scene coordinates, no CRS"
    assert document["features"][-4]["geometry"]["coordinates"] == [9.0, 5.0, 0.0]
    assert any("no CRS" in remark for remark in remarks)


def test_a_station_of_unknown_height_lies_under_its_sensor(write: Write) -> None:
    plan = field_plan(site_frame(), {"A": ("F0", 1.0, 2.0, 3.0, math.nan, False)})
    ((fields, point),) = of_kind(write(write_geojson, plan, "out.geojson")[0], "station")
    assert shapely.get_coordinates(point)[0] == pytest.approx(degrees(1.0, 2.0, 3.0), abs=1.01e-9)
    assert fields["ground_height_m"] is None or math.isnan(fields["ground_height_m"])
    assert fields["sensor_height_m"] == pytest.approx(518.0)


def test_a_crs_that_does_not_do_is_refused_in_one_line(write: Write) -> None:
    far = np.eye(4)
    far[:3, 3] = (1e12, -1e12, 0.0)
    unknown = site_frame("EPSG:999999")
    nowhere = SiteFrame(matrix=far, crs="EPSG:25832", name="UTM", source="given epsg")
    for frame, said in ((unknown, "PROJ can't read the CRS"), (nowhere, "far outside the site's CRS")):
        with pytest.raises(ExportError, match=said) as caught:
            write(write_geojson, field_plan(frame))
        assert "\n" not in str(caught.value)


def test_an_unknown_kind_of_coordinates_is_refused(write: Write, scene_plan: PlanSource) -> None:
    with pytest.raises(RequirementError, match="--geojson-crs: got 'mars'"):
        write(write_geojson, scene_plan, geojson_crs="mars")


def test_one_floor_holds_its_own_only(write: Write, site_plan: PlanSource) -> None:
    path, _ = write(write_geojson, site_plan, "out.geojson", floors=("F1",))
    assert [fields["id"] for fields, _ in of_kind(path, "station")] == ["S003", "S004"]
    assert [fields["id"] for fields, _ in of_kind(path, "link")] == ["S003-S004"]
    assert [fields["id"] for fields, _ in of_kind(path, "floor")] == ["F1"]


def test_overlap_that_falls_short_never_reads_as_what_was_asked(write: Write, site_plan: PlanSource) -> None:
    short = replace(site_plan.links[0], overlap=0.29996)
    ((fields, _),) = of_kind(write(write_geojson, replace(site_plan, links=(short,)), "out.geojson")[0], "link")
    assert (fields["overlap"], bool(fields["counts"])) == (0.29996, False)
