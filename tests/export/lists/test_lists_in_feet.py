"""Station lists in feet: figures worked out by hand from 0.3048 m and 1200/3937 m, and read back by other programs."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pyogrio
import pyproj
import pytest
from field_plan import ANGLE_RAD, STATIONS, field_plan
from geocompy.gsi import gsiformat

from planner_core.coordinates.frame import matrix_of
from planner_core.errors import ExportError, RequirementError
from planner_core.export.csv_profiles import write_csv
from planner_core.export.formats import FORMATS
from planner_core.export.geojson import write_geojson
from planner_core.export.gsi import write_gsi8, write_gsi16
from planner_core.export.kml import write_kml
from planner_core.export.landxml import write_landxml
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, SiteFrame
from planner_core.plan_folder.plan_source import PlanSource

Write = Callable[..., tuple[Path, tuple[str, ...]]]
#: A State Plane place, US survey feet, and the metres of one.
EAST, NORTH, HEIGHT = 2_000_000.0, 211_234.5, 33.25
FOOT_US_M = 1200 / 3937
NS = "{http://www.landxml.org/schema/LandXML-1.2}"


def state_plane(**instead: object) -> SiteFrame:
    frame = SiteFrame(
        matrix=matrix_of((EAST * FOOT_US_M, NORTH * FOOT_US_M, HEIGHT * FOOT_US_M), ANGLE_RAD, 1.0),
        crs="EPSG:2263", vertical_crs="EPSG:6360", vertical_name="NAVD88 height (ftUS)", name="EPSG:2263 Long Island",
        source="given epsg", unit=US_SURVEY_FOOT, crs_unit=US_SURVEY_FOOT, vertical_unit=US_SURVEY_FOOT,
    )  # fmt: skip
    return replace(frame, **instead)


@pytest.fixture
def plan() -> PlanSource:
    return field_plan(state_plane())


def in_feet(name: str, foot_m: float = FOOT_US_M) -> tuple[float, float, float, float]:
    """E, N, H of the ground point, and instrument height, of a station; with none of the library's code."""
    _, x, y, z, height, _ = STATIONS[name]
    cos, sin = math.cos(ANGLE_RAD), math.sin(ANGLE_RAD)
    metres = (
        EAST * FOOT_US_M + cos * x - sin * y,
        NORTH * FOOT_US_M + sin * x + cos * y,
        HEIGHT * FOOT_US_M + z,
        height,
    )
    return tuple(value / foot_m for value in metres)  # type: ignore[return-value]


def test_a_csv_in_feet_says_which_foot_in_its_header_and_in_every_line(write: Write, plan: PlanSource) -> None:
    path, _ = write(write_csv, plan, columns="generic")
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    for row, name in zip(rows, STATIONS, strict=True):
        east, north, ground, height = in_feet(name)
        told = [float(row[key]) for key in ("easting_ftUS", "northing_ftUS", "ground_z_ftUS", "instrument_height_ftUS")]
        assert told == pytest.approx([east, north, ground, height], abs=5.1e-5)
        assert float(row["sensor_z_ftUS"]) == pytest.approx(ground + height, abs=5.1e-5)
        assert row["crs"] == "EPSG:2263 Long Island in US survey feet; heights NAVD88 height (ftUS)"
    assert rows[0]["description"] == "S001 Erdgeschoß h 4.92 ft"  # 1.5 m


def test_the_two_feet_are_4_ft_apart_at_two_million(write: Write, plan: PlanSource) -> None:
    """2 000 000 ft at 2 ppm: 4 ft, or 1.2 m."""
    international = field_plan(state_plane(unit=FOOT))
    of_survey, _ = write(write_csv, plan, "survey.csv", columns="PENZ")
    path, remarks = write(write_csv, international, "international.csv", columns="PENZ")
    first = [float(each.read_text().split(",")[1]) for each in (of_survey, path)]
    assert first[1] - first[0] == pytest.approx(4.00, abs=0.01)
    assert first[1] == pytest.approx(in_feet("S001", 0.3048)[0], abs=5.1e-5)
    assert any("EPSG:2263 Long Island, in feet; heights NAVD88 height (ftUS), in feet" in line for line in remarks)


def test_what_is_subtracted_is_in_the_unit_of_the_list(write: Write, plan: PlanSource) -> None:
    path, remarks = write(write_csv, plan, columns="PENZ", subtract=(2_000_000.0, 200_000.0, 0.0))
    east, north, ground, _ = in_feet("S001")
    told = [float(cell) for cell in path.read_text().splitlines()[0].split(",")[1:]]
    assert told == pytest.approx([east - 2_000_000.0, north - 200_000.0, ground], abs=5.1e-5)
    assert "2000000.0000 ftUS is subtracted from eastings" in " ".join(remarks)


@pytest.mark.parametrize(("writer", "subtract", "digit_ft"), [(write_gsi8, EAST, 1e-3), (write_gsi16, 0.0, 1e-4)])
def test_geocompy_reads_feet_of_a_gsi_file(
    write: Write, plan: PlanSource, writer: Callable[..., tuple[str, ...]], subtract: float, digit_ft: float
) -> None:
    path, _ = write(writer, plan, subtract=(subtract, subtract / 10, 0.0))
    head, *blocks = [gsiformat.GsiBlock.parse(line) for line in path.read_text().rstrip("\r\n").split("\n")]
    words = [str(word.value) for word in head]
    assert words[:4] == ["GROUND", "EPSG", "2263", "FTUS"]
    assert len(words) <= 8
    for block, name in zip(blocks, STATIONS, strict=True):
        east, north, ground, height = in_feet(name)
        told = {word.wi: word.value for word in block}
        for index, feet in ((81, east - subtract), (82, north - subtract / 10), (83, ground), (88, height)):
            # geocompy hands on metres, by the international foot: the format does not say which foot it is.
            assert told[index] / 0.3048 == pytest.approx(feet, abs=0.501 * digit_ft)


def test_a_resolution_of_metres_is_refused_for_feet(write: Write, plan: PlanSource) -> None:
    with pytest.raises(RequirementError, match=r"got 'mm' for coordinates in US survey feet, expected 0\.001ft or"):
        write(write_gsi8, plan, gsi_unit="mm")
    with pytest.raises(ExportError, match=r"the easting of S001 of 2000017\.\d+ ft has 10 digits to the 0\.001ft"):
        write(write_gsi8, plan)


@pytest.mark.parametrize(
    ("unit", "name", "foot_m"), [(US_SURVEY_FOOT, "USSurveyFoot", FOOT_US_M), (FOOT, "foot", 0.3048)]
)
def test_landxml_says_which_foot_its_points_are_in(write: Write, unit: object, name: str, foot_m: float) -> None:
    path, _ = write(write_landxml, field_plan(state_plane(unit=unit, crs_unit=unit)))
    root = ElementTree.parse(path).getroot()
    (units,) = root.find(f"{NS}Units") or ()
    assert (units.tag, units.get("linearUnit")) == (f"{NS}Imperial", name)
    # Enumerations of LandXML-1.2.xsd: impArea, impVolume, impTemperature, impPressure.
    assert (units.get("areaUnit"), units.get("volumeUnit")) == ("squareFoot", "cubicFeet")
    assert (units.get("temperatureUnit"), units.get("pressureUnit")) == ("fahrenheit", "inchHG")
    point = next(each for each in root.iter(f"{NS}CgPoint") if each.get("name") == "S001")
    east, north, ground, height = in_feet("S001", foot_m)
    assert [float(part) for part in (point.text or "").split()] == pytest.approx([north, east, ground], abs=5.1e-5)
    told = {each.get("label"): each.get("value") for each in root.iter(f"{NS}Property")}
    assert f"instrument_height_{'ftUS' if unit is US_SURVEY_FOOT else 'ft'}" in told
    first = next(each for each in root.iter(f"{NS}Property") if str(each.get("label")).startswith("instrument_height"))
    assert float(str(first.get("value"))) == pytest.approx(height, abs=5.1e-5)


def test_a_code_of_another_unit_is_not_given_to_programs(write: Write) -> None:
    path, _ = write(write_landxml, field_plan(state_plane(unit=METRE)))
    system = ElementTree.parse(path).getroot().find(f"{NS}CoordinateSystem")
    assert system is not None
    assert (system.get("epsgCode"), system.get("desc", "").partition(";")[0]) == (
        None,
        "EPSG:2263 Long Island, in metres",
    )
    local, _ = write(write_geojson, field_plan(state_plane(unit=METRE)), "metres.geojson", geojson_crs="local")
    assert json.loads(local.read_text())["crs"] is None


def test_gdal_finds_longitude_and_latitude_where_pyproj_does(write: Write, plan: PlanSource) -> None:
    to_earth = pyproj.Transformer.from_crs("EPSG:2263", "EPSG:4326", always_xy=True)
    expected = to_earth.transform(*in_feet("S001")[:2])
    for writer, name in ((write_geojson, "out.geojson"), (write_kml, "out.kml")):
        path, _ = write(writer, plan, name)
        for layer, _ in pyogrio.list_layers(path):
            frame = pyogrio.raw.read(path, layer=layer, columns=[])
            assert frame is not None
        text = path.read_text(encoding="utf-8")
        assert f"{expected[0]:.7f}"[:-1] in text, name
        assert f"{expected[1]:.7f}"[:-1] in text, name


def test_geojson_of_the_system_is_in_its_feet(write: Write, plan: PlanSource) -> None:
    path, _ = write(write_geojson, plan, "out.geojson", geojson_crs="local")
    document = json.loads(path.read_text())
    (point,) = [each for each in document["features"] if each["id"] == "station S001"]
    assert point["geometry"]["coordinates"] == pytest.approx(in_feet("S001")[:3], abs=5.1e-5)
    assert document["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::2263"
    assert point["properties"]["instrument_height_m"] == 1.5
    meta = pyogrio.read_info(path)
    assert pyproj.CRS.from_user_input(meta["crs"]) == pyproj.CRS("EPSG:2263")


def test_kml_keeps_its_metres_and_tells_heights_in_feet(write: Write, plan: PlanSource) -> None:
    path, _ = write(write_kml, plan, "out.kml")
    text = path.read_text(encoding="utf-8")
    assert 'name="instrument_height_ftUS"' in text
    at = ElementTree.parse(path).getroot().iter("{http://www.opengis.net/kml/2.2}coordinates")
    heights = {float(each.text.split(",")[2].split(" ")[0]) for each in at if each.text}
    assert 2.8 in heights  # the upper floor above the lower one, metres


def test_formats_say_whether_they_can_be_in_feet() -> None:
    metric = {name for name, each in FORMATS.items() if not each.feet}
    assert {"e57", "las", "robot", "usd-stations"} <= metric
    assert not {"csv", "gsi16", "landxml", "dxf", "pdf", "html", "ifc", "geojson", "kml"} & metric
