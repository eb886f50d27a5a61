"""IFC files in feet and inches: units by their conversion factor, exactly as the file has it; State Plane by pyproj."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import numpy as np
import pyproj
import pytest

from planner_core.coordinates.crs import map_crs
from planner_core.coordinates.frame import site_frame
from planner_core.documents import to_document
from planner_core.model import FOOT, US_SURVEY_FOOT
from planner_core.scene.load import LoadOptions, load_scene

EAST, NORTH, HEIGHT = 987_654.25, 211_234.5, 33.0


def write_ifc(path: Path, unit_name: str, factor: float, crs: str) -> Path:
    """A slab of 40 x 30 x 1 units with its lower corner in the origin, and a map conversion in its unit."""
    model = ifcopenshell.file(schema="IFC4")
    new = model.create_entity
    metre = new("IfcSIUnit", None, "LENGTHUNIT", None, "METRE")
    length = new(
        "IfcConversionBasedUnit", new("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0), "LENGTHUNIT", unit_name,
        new("IfcMeasureWithUnit", new("IfcLengthMeasure", factor), metre),
    )  # fmt: skip
    radian = new("IfcSIUnit", None, "PLANEANGLEUNIT", None, "RADIAN")
    point = new("IfcCartesianPoint", (0.0, 0.0, 0.0))
    origin = new("IfcAxis2Placement3D", point)
    context = new("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, origin)
    guid = ifcopenshell.guid.new
    project = new(
        "IfcProject", guid(), Name="feet", RepresentationContexts=[context],
        UnitsInContext=new("IfcUnitAssignment", [length, radian]),
    )  # fmt: skip
    system = new("IfcProjectedCRS", Name=crs, MapUnit=length)
    new(
        "IfcMapConversion", SourceCRS=context, TargetCRS=system, Eastings=EAST, Northings=NORTH,
        OrthogonalHeight=HEIGHT,
    )  # fmt: skip
    middle = new("IfcAxis2Placement2D", new("IfcCartesianPoint", (20.0, 15.0)))
    profile = new("IfcRectangleProfileDef", "AREA", None, middle, 40.0, 30.0)
    solid = new("IfcExtrudedAreaSolid", profile, origin, new("IfcDirection", (0.0, 0.0, 1.0)), 1.0)
    body = new("IfcShapeRepresentation", context, "Body", "SweptSolid", [solid])
    placement = new("IfcLocalPlacement", None, origin)
    slab = new(
        "IfcSlab", guid(), Name="slab", ObjectPlacement=placement,
        Representation=new("IfcProductDefinitionShape", None, None, [body]),
    )  # fmt: skip
    storey = new("IfcBuildingStorey", guid(), Name="Level 1", ObjectPlacement=placement, Elevation=1.0)
    new("IfcRelAggregates", guid(), RelatingObject=project, RelatedObjects=[storey])
    new("IfcRelContainedInSpatialStructure", guid(), RelatedElements=[slab], RelatingStructure=storey)
    model.write(str(path))
    return path


@pytest.mark.parametrize(
    ("unit_name", "factor", "told", "crs"),
    [
        ("FOOT", 0.3048, "foot", "EPSG:2222"),
        ("US SURVEY FOOT", 0.304800609601219, "us survey foot", "EPSG:2263"),
        ("US SURVEY FOOT", 0.3048006096, "us survey foot", "EPSG:2263"),  # as many programs round it
    ],
)
def test_an_ifc_file_in_feet_is_metres_by_its_own_factor(
    tmp_path: Path, unit_name: str, factor: float, told: str, crs: str
) -> None:
    scene = load_scene(write_ifc(tmp_path / "feet.ifc", unit_name, factor, crs))
    assert (scene.source.unit_name, scene.source.metres_per_unit) == (told, factor)
    size_m = np.ptp(scene.vertices_m, axis=0)
    np.testing.assert_allclose(size_m, np.array([40.0, 30.0, 1.0]) * factor, rtol=0, atol=1e-9)
    georeference = scene.georeference
    assert georeference is not None and georeference.to_map is not None
    np.testing.assert_allclose(
        np.array(georeference.to_map)[:3, 3], np.array([EAST, NORTH, HEIGHT]) * factor, rtol=1e-14
    )
    assert georeference.warnings == ()


def test_a_state_plane_building_lies_where_pyproj_puts_its_feet(tmp_path: Path) -> None:
    scene = load_scene(write_ifc(tmp_path / "feet.ifc", "US SURVEY FOOT", 0.304800609601219, "EPSG:2263"))
    row = to_document(scene.georeference)
    frame = site_frame(
        {
            "scene": {"georeference": row, "metres_per_unit": scene.source.metres_per_unit},
            "floors": [],
            "stations": [{"position": [0.0, 0.0, 0.0]}],
        }
    )
    assert frame.unit is US_SURVEY_FOOT
    assert frame.warnings == ()
    corner_m = np.array([40.0, 30.0, 1.0]) * 1200 / 3937
    np.testing.assert_allclose(
        frame.in_unit(frame.to_site(corner_m)), [EAST + 40, NORTH + 30, HEIGHT + 1], rtol=0, atol=1e-5
    )
    expected = pyproj.Transformer.from_crs("EPSG:2263", "EPSG:4326", always_xy=True).transform(EAST + 40, NORTH + 30)
    found = map_crs(frame.crs)[0].degrees(frame.to_site(corner_m)[None, :2])[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("unit", "name"), [(US_SURVEY_FOOT, "US survey foot"), (FOOT, "foot")])
def test_formats_without_units_are_read_in_either_foot(tmp_path: Path, unit: object, name: str) -> None:
    path = tmp_path / "floor.obj"
    path.write_text("v 0 0 0\nv 3937 0 0\nv 3937 3937 0\nv 0 3937 0\nf 1 2 3 4\n")
    scene = load_scene(path, options=LoadOptions(metres_per_unit=unit.metres, up_axis="Z"))  # type: ignore[attr-defined]
    assert scene.source.unit_name == name
    expected_m = 1200.0 if unit is US_SURVEY_FOOT else 1199.9976
    assert np.ptp(scene.vertices_m[:, 0]) == pytest.approx(expected_m, abs=1e-9)
