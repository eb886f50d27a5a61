"""LandXML, read back with ElementTree, and held against what LandXML-1.2.xsd says of the elements in use."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from field_plan import LEGS, STATIONS, field_plan, on_site, site_frame

from planner_core.export.landxml import write_landxml
from planner_core.plan_folder.plan_source import PlanSource

Write = Callable[..., tuple[Path, tuple[str, ...]]]
NS = "{http://www.landxml.org/schema/LandXML-1.2}"
POINT = {"name", "desc", "code", "state", "pntRef", "featureRef", "pointGeometry", "role", "oID", "pntSurv"}
#: Element -> attributes that it must have, that it may have, and its children in their order.
SCHEMA: dict[str, tuple[set[str], set[str], list[str]]] = {
    "LandXML": (
        {"date", "time", "version"},
        {"language", "readOnly"},
        ["Units", "CoordinateSystem", "Project", "Application", "CgPoints", "PlanFeatures"],
    ),
    "Units": (set(), set(), ["Metric"]),
    "Metric": (
        {"areaUnit", "linearUnit", "volumeUnit", "temperatureUnit", "pressureUnit"},
        {"angularUnit", "directionUnit"},
        [],
    ),
    "CoordinateSystem": (
        set(),
        {"desc", "name", "epsgCode", "ogcWktCode", "verticalDatum", "verticalCoordinateSystemName"},
        [],
    ),
    "Project": ({"name"}, {"desc", "state"}, []),
    "Application": ({"name"}, {"desc", "version"}, []),
    "CgPoints": (set(), {"name", "desc", "state", "code"}, ["CgPoint", "CgPoints", "Feature"]),
    "CgPoint": (set(), POINT, []),
    "Feature": (set(), {"name", "code", "source"}, ["Property"]),
    "Property": ({"label", "value"}, set(), []),
    "PlanFeatures": (set(), {"name", "desc", "state"}, ["PlanFeature"]),
    "PlanFeature": (set(), {"name", "desc", "state"}, ["CoordGeom"]),
    "CoordGeom": (set(), {"name", "desc", "state"}, ["IrregularLine"]),
    "IrregularLine": (set(), {"length", "name", "desc"}, ["Start", "End", "PntList3D"]),
    "Start": (set(), POINT, []),
    "End": (set(), POINT, []),
    "PntList3D": (set(), set(), []),
}
VALUES = {
    "state": {"abandoned", "destroyed", "existing", "proposed"},
    "role": {
        "measured", "to stake out", "staked out", "calculated", "assistance point", "user entered point",
        "control point",
    },
    "linearUnit": {"millimeter", "centimeter", "meter", "kilometer"},
    "areaUnit": {"hectare", "squareMeter", "squareMillimeter", "squareCentimeter"},
    "volumeUnit": {"cubicMeter", "liter", "hectareMeter"},
    "temperatureUnit": {"celsius", "kelvin"},
    "pressureUnit": {"HPA", "milliBars", "mmHG", "millimeterHG"},
    "angularUnit": {"radians", "grads", "decimal degrees", "decimal dd.mm.ss"},
}  # fmt: skip


def check(element: ElementTree.Element) -> None:
    tag = element.tag.removeprefix(NS)
    assert tag in SCHEMA, element.tag
    required, allowed, children = SCHEMA[tag]
    assert required <= set(element.attrib) <= required | allowed, (tag, element.attrib)
    for name, value in element.attrib.items():
        assert value in VALUES.get(name, {value}), (tag, name, value)
    order = [children.index(child.tag.removeprefix(NS)) for child in element]
    assert order == sorted(order), tag
    for child in element:
        check(child)


def root_of(path: Path) -> ElementTree.Element:
    return ElementTree.parse(path).getroot()


def groups(root: ElementTree.Element) -> dict[str, dict[str, ElementTree.Element]]:
    return {
        group.attrib["name"]: {point.attrib["name"]: point for point in group.findall(f"{NS}CgPoint")}
        for group in root.findall(f"{NS}CgPoints")
    }


def numbers(text: str | None) -> list[float]:
    return [float(part) for part in (text or "").split()]


@pytest.mark.parametrize(
    "plan", [field_plan(), field_plan(site_frame()), field_plan(site_frame("", "")), field_plan(legs=[])],
    ids=["scene", "site", "local", "no walk"],
)  # fmt: skip
def test_elements_are_those_of_the_schema_in_its_order(write: Write, plan: PlanSource) -> None:
    root = root_of(write(write_landxml, plan)[0])
    assert root.tag == f"{NS}LandXML"
    check(root)
    for group in root.iter(f"{NS}CgPoints"):
        names = [point.attrib["name"] for point in group.findall(f"{NS}CgPoint")]
        assert len(set(names)) == len(names)
    features = {feature.attrib["name"] for feature in root.iter(f"{NS}Feature")}
    assert {point.attrib["featureRef"] for point in root.iter(f"{NS}CgPoint")} == features


def test_points_are_northing_easting_height_with_ground_and_sensor_apart(write: Write, site_plan: PlanSource) -> None:
    found = groups(root_of(write(write_landxml, site_plan)[0]))
    assert list(found) == ["F0 ground points", "F0 sensor points", "F1 ground points", "F1 sensor points"]
    for name, (floor, x, y, z, height, _) in STATIONS.items():
        east, north, ground = on_site(x, y, z)
        at = numbers(found[f"{floor} ground points"][name].text)
        np.testing.assert_allclose(at, [north, east, ground], atol=0.51e-4)
        at = numbers(found[f"{floor} sensor points"][f"{name}-sensor"].text)
        np.testing.assert_allclose(at, [north, east, ground + height], atol=1.01e-4)


def test_ground_points_are_to_be_staked_out_and_scanned_ones_exist(write: Write, site_plan: PlanSource) -> None:
    found = groups(root_of(write(write_landxml, site_plan)[0]))
    point = found["F0 ground points"]["S001"]
    assert (point.attrib["role"], point.attrib["state"], point.attrib["code"]) == ("to stake out", "proposed", "F0")
    assert found["F0 ground points"]["S002"].attrib["state"] == "existing"
    assert "role" not in found["F0 sensor points"]["S001-sensor"].attrib


def test_heights_are_told_apart_in_properties(write: Write, site_plan: PlanSource) -> None:
    root = root_of(write(write_landxml, site_plan)[0])
    (feature,) = (each for each in root.iter(f"{NS}Feature") if each.attrib["name"] == "S003 ground")
    told = {each.attrib["label"]: each.attrib["value"] for each in feature}
    assert told["ground_height_m"] == "517.8000"
    assert told["instrument_height_m"] == "1.6235"
    assert float(told["sensor_height_m"]) == pytest.approx(517.8 + 1.62345, abs=0.51e-4)


@pytest.mark.parametrize(
    ("plan", "expected"),
    [
        (
            field_plan(site_frame("EPSG:25832", "EPSG:7837")),
            {"epsgCode": "25832", "verticalCoordinateSystemName": "EPSG:7837"},
        ),
        (field_plan(site_frame('PROJCRS["a"]')), {"ogcWktCode": 'PROJCRS["a"]'}),
        (field_plan(), {"desc": "scene coordinates, no CRS", "name": "scene coordinates"}),
    ],
)  # fmt: skip
def test_the_coordinate_system_is_named(write: Write, plan: PlanSource, expected: dict[str, str]) -> None:
    system = root_of(write(write_landxml, plan)[0]).find(f"{NS}CoordinateSystem")
    assert system is not None
    assert expected.items() <= system.attrib.items()


def test_the_walk_follows_the_legs(write: Write, site_plan: PlanSource) -> None:
    path, remarks = write(write_landxml, site_plan)
    lines = list(root_of(path).iter(f"{NS}IrregularLine"))
    assert len(lines) == 2
    for line, leg in zip(lines, LEGS, strict=False):
        corners = np.array(numbers(line.findtext(f"{NS}PntList3D"))).reshape(-1, 3)
        expected = [(n, e, h) for e, n, h in (on_site(*point) for point in leg["points"])]
        np.testing.assert_allclose(corners, expected, atol=0.51e-4)
        assert numbers(line.findtext(f"{NS}Start")) == corners[0].tolist()
        assert numbers(line.findtext(f"{NS}End")) == corners[-1].tolist()
        assert float(line.attrib["length"]) == leg["length_m"]
    assert remarks == ("no path inside the model leads from S003 to S004",)


def test_stations_of_no_floor_have_a_group_of_their_own(write: Write) -> None:
    plan = field_plan(stations={"A": ("roof", 1.0, 2.0, 9.0, 1.5, False)})
    assert list(groups(root_of(write(write_landxml, plan)[0]))) == ["other ground points", "other sensor points"]


def test_no_clock_is_in_the_file(write: Write, site_plan: PlanSource) -> None:
    first, _ = write(write_landxml, site_plan, "first")
    again, _ = write(write_landxml, site_plan, "again")
    assert first.read_bytes() == again.read_bytes()
    assert re.findall(r"\b20\d\d-\d\d", first.read_text(encoding="utf-8")) == []


def test_names_with_marks_of_xml_come_back(write: Write) -> None:
    plan = field_plan(stations={'<A&"B>': ("F0", 1.0, 2.0, 0.0, 1.5, False)})
    assert list(groups(root_of(write(write_landxml, plan)[0]))["F0 ground points"]) == ['<A&"B>']


def test_a_station_of_unknown_height_has_a_sensor_only(write: Write) -> None:
    rows = {"A": ("F0", 1.0, 2.0, 3.0, math.nan, False), "B": ("F1", 1.0, 2.0, 3.0, 1.5, False)}
    path, remarks = write(write_landxml, field_plan(stations=rows))
    check(root_of(path))
    assert list(groups(root_of(path))) == ["F0 sensor points", "F1 ground points", "F1 sensor points"]
    assert numbers(groups(root_of(path))["F0 sensor points"]["A-sensor"].text) == [2.0, 1.0, 3.0]
    assert "nan" not in path.read_text(encoding="utf-8")
    assert "the instrument height of A is not known: it has a sensor only" in remarks
