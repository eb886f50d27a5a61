"""What IFC files say of where they are, read by us and by ifcopenshell.util.geolocation."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.geolocation as geolocation
import numpy as np
import pyproj
import pytest

import scenes_synthetic
from planner_core.coordinates.frame import georeference_of, site_frame
from planner_core.coordinates.request import FrameRequest
from planner_core.model import Georeference
from planner_core.scene.ifc_georeference import read_georeference
from planner_core.scene.load import LoadOptions, load_scene
from scenes_synthetic.copies import SURVEYED
from tests.scene.conftest import in_this_process  # noqa: F401 - a fixture

pytestmark = pytest.mark.usefixtures("in_this_process")
REAL = Path(__file__).parents[2].parent / "shared" / "data" / "ifc"
POINTS_M = np.random.default_rng(3).uniform(-50, 50, (20, 3))


def model_of(schema: str, prefix: str | None = "MILLI") -> tuple[Any, Any]:
    """A model with units, a site and a context, and the context."""
    model = ifcopenshell.file(schema=schema)
    project = model.create_entity("IfcProject", GlobalId=ifcopenshell.guid.new(), Name="P")
    unit = model.create_entity("IfcSIUnit", None, "LENGTHUNIT", prefix, "METRE")
    project.UnitsInContext = model.create_entity("IfcUnitAssignment", [unit])
    model.create_entity("IfcSite", GlobalId=ifcopenshell.guid.new(), Name="S")
    context = model.create_entity(
        "IfcGeometricRepresentationContext",
        ContextType="Model",
        CoordinateSpaceDimension=3,
        WorldCoordinateSystem=placement(model, (0.0, 0.0, 0.0)),
    )
    project.RepresentationContexts = [context]
    return model, context


def placement(model: Any, at: tuple[float, float, float], x_axis: tuple[float, float, float] | None = None) -> Any:
    axis = None if x_axis is None else model.create_entity("IfcDirection", (0.0, 0.0, 1.0))
    x = None if x_axis is None else model.create_entity("IfcDirection", x_axis)
    return model.create_entity("IfcAxis2Placement3D", model.create_entity("IfcCartesianPoint", at), axis, x)


def metre(model: Any) -> Any:
    return model.create_entity("IfcSIUnit", None, "LENGTHUNIT", None, "METRE")


def add_conversion(model: Any, context: Any, kind: str = "IfcMapConversion", *, unit: Any = None, **told: Any) -> Any:
    crs = model.create_entity("IfcProjectedCRS", Name="EPSG:25832", MapUnit=unit)
    return model.create_entity(kind, SourceCRS=context, TargetCRS=crs, **told)


def ours(model: Any, unit_m: float) -> Georeference:
    found = read_georeference("test.ifc", model, unit_m)
    assert found is not None
    return found


def assert_as_ifcopenshell(model: Any, unit_m: float, map_m: float = 1.0) -> Georeference:
    """Our matrix, metres to metres, moves points as ifcopenshell moves them in the file's units."""
    found = ours(model, unit_m)
    assert found.to_map is not None
    moved = POINTS_M @ np.array(found.to_map)[:3, :3].T + np.array(found.to_map)[:3, 3]
    theirs = np.array([geolocation.auto_xyz2enh(model, *(point / unit_m)) for point in POINTS_M]) * map_m
    assert np.abs(moved - theirs).max() < 1e-6
    return found


def property_set(model: Any, name: str, values: dict[str, float | str]) -> Any:
    single = [
        model.create_entity(
            "IfcPropertySingleValue",
            Name=key,
            NominalValue=model.create_entity("IfcLabel" if isinstance(value, str) else "IfcReal", value),
        )
        for key, value in values.items()
    ]
    return model.create_entity("IfcPropertySet", GlobalId=ifcopenshell.guid.new(), Name=name, HasProperties=single)


# --------------------------------------------------------------------------------------- map conversions
TOLD = {"Eastings": 458_870.25, "Northings": 5_438_260.5, "OrthogonalHeight": 110.125}
TURNED = {"XAxisAbscissa": math.cos(2.1), "XAxisOrdinate": math.sin(2.1)}


@pytest.mark.parametrize("schema", ["IFC4", "IFC4X3"])
def test_a_conversion_from_millimetres_is_as_ifcopenshell_reads_it(schema: str) -> None:
    model, context = model_of(schema)
    add_conversion(model, context, unit=metre(model), Scale=0.001, **TOLD, **TURNED)
    found = assert_as_ifcopenshell(model, 0.001)
    assert (found.operation, found.crs_name, found.map_unit, found.warnings) == (
        "IfcMapConversion", "EPSG:25832", "metre", (),
    )  # fmt: skip


def test_a_conversion_without_turn_and_scale_is_a_shift() -> None:
    model, context = model_of("IFC4", None)
    add_conversion(model, context, **TOLD)
    found = assert_as_ifcopenshell(model, 1.0)
    assert np.array(found.to_map)[:3, :3].tolist() == np.eye(3).tolist()
    assert found.warnings == ()


def test_axes_of_any_length_only_turn() -> None:
    model, context = model_of("IFC4", None)
    add_conversion(model, context, XAxisAbscissa=3.0, XAxisOrdinate=-4.0, **TOLD)
    found = assert_as_ifcopenshell(model, 1.0)
    assert np.linalg.det(np.array(found.to_map)[:3, :3]) == pytest.approx(1.0)


def test_a_grid_scale_scales_heights_too_and_that_is_told() -> None:
    model, context = model_of("IFC4", None)
    add_conversion(model, context, Scale=0.9996, **TOLD, **TURNED)
    (warning,) = assert_as_ifcopenshell(model, 1.0).warnings
    assert "-400.0 ppm" in warning


def test_factors_of_a_scaled_conversion_are_of_their_axes() -> None:
    model, context = model_of("IFC4X3")
    told = {**TOLD, **TURNED, "Scale": 0.001, "FactorX": 0.9996, "FactorY": 0.9996, "FactorZ": 1.0}
    add_conversion(model, context, "IfcMapConversionScaled", unit=metre(model), **told)
    found = assert_as_ifcopenshell(model, 0.001)
    assert (found.operation, found.warnings) == ("IfcMapConversionScaled", ())


def test_a_rigid_operation_shifts() -> None:
    model, context = model_of("IFC4X3", None)
    add_conversion(
        model, context, "IfcRigidOperation", FirstCoordinate=model.create_entity("IfcLengthMeasure", 1000.0),
        SecondCoordinate=model.create_entity("IfcLengthMeasure", 2000.0), Height=30.0,
    )  # fmt: skip
    found = assert_as_ifcopenshell(model, 1.0)
    assert np.array(found.to_map)[:3, 3].tolist() == [1000, 2000, 30]


def test_a_rigid_operation_of_angles_is_not_used_and_that_is_told() -> None:
    model, context = model_of("IFC4X3", None)
    add_conversion(
        model, context, "IfcRigidOperation", FirstCoordinate=model.create_entity("IfcPlaneAngleMeasure", 49.0),
        SecondCoordinate=model.create_entity("IfcPlaneAngleMeasure", 8.0),
    )  # fmt: skip
    found = ours(model, 1.0)
    assert found.to_map is None
    assert "no easting and northing" in found.warnings[0]


def test_a_world_coordinate_system_off_the_origin_is_as_ifcopenshell_reads_it() -> None:
    model, context = model_of("IFC4")
    context.WorldCoordinateSystem = placement(model, (5000.0, -7000.0, 300.0), (0.6, 0.8, 0.0))
    add_conversion(model, context, unit=metre(model), Scale=0.001, **TOLD, **TURNED)
    assert_as_ifcopenshell(model, 0.001)


def test_property_sets_of_ifc2x3_are_read() -> None:
    model, _ = model_of("IFC2X3")
    project = model.by_type("IfcProject")[0]
    for name, values in (
        ("ePSet_MapConversion", {**TOLD, **TURNED, "Scale": 0.001}),
        ("ePset_ProjectedCRS", {"Name": "EPSG:25832", "VerticalDatum": "DHHN2016", "MapUnit": "METRE"}),
    ):
        model.create_entity(
            "IfcRelDefinesByProperties",
            GlobalId=ifcopenshell.guid.new(),
            RelatedObjects=[project],
            RelatingPropertyDefinition=property_set(model, name, values),
        )
    found = assert_as_ifcopenshell(model, 0.001)
    for pset in model.by_type("IfcPropertySet"):
        pset.Name = pset.Name.replace("ePSet", "ePset")  # files spell it both ways, ifcopenshell reads one
    assert ours(model, 0.001) == found
    assert (found.operation, found.crs_name, found.vertical_datum, found.warnings) == (
        "ePset_MapConversion", "EPSG:25832", "DHHN2016", (),
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------- units
def linear_scale(found: Georeference) -> float:
    return float(np.linalg.det(np.array(found.to_map)[:3, :3]) ** (1 / 3))


def test_a_left_out_step_from_millimetres_to_metres_is_made_and_told() -> None:
    model, context = model_of("IFC4")
    add_conversion(model, context, unit=metre(model), Scale=1.0, **TOLD)
    found = ours(model, 0.001)
    assert linear_scale(found) == 1.0
    assert np.array(found.to_map)[:3, 3].tolist() == list(TOLD.values())
    assert "the unit conversion is taken to be missing" in found.warnings[0]


def test_a_left_out_map_unit_is_metres_where_the_scale_says_so() -> None:
    model, context = model_of("IFC4")
    add_conversion(model, context, Scale=0.001, **TOLD)
    found = ours(model, 0.001)
    assert linear_scale(found) == pytest.approx(1.0)
    assert np.array(found.to_map)[:3, 3].tolist() == list(TOLD.values())
    assert "no map unit" in found.warnings[0]


def test_without_map_unit_and_scale_the_map_is_in_the_project_s_unit() -> None:
    model, context = model_of("IFC4")
    add_conversion(model, context, **{key: value * 1000 for key, value in TOLD.items()})
    found = assert_as_ifcopenshell(model, 0.001, map_m=0.001)
    assert np.array(found.to_map)[:3, 3] == pytest.approx(list(TOLD.values()), abs=1e-9)
    assert found.warnings == ()


def test_a_scale_that_no_unit_explains_is_told() -> None:
    model, context = model_of("IFC4", None)
    add_conversion(model, context, unit=metre(model), Scale=7.0, **TOLD)
    assert "wrong units" in ours(model, 1.0).warnings[-2] + ours(model, 1.0).warnings[-1]


@pytest.mark.parametrize("told", [{"Scale": -0.001}, {"Scale": 0.001, "FactorZ": 0.0}])
def test_numbers_that_make_no_sense_are_not_used(told: dict[str, float]) -> None:
    model, context = model_of("IFC4X3")
    factors = {"FactorX": 1.0, "FactorY": 1.0, "FactorZ": 1.0, **told}
    add_conversion(model, context, "IfcMapConversionScaled", unit=metre(model), **TOLD, **factors)
    found = ours(model, 0.001)
    assert found.to_map is None
    assert "no usable numbers" in found.warnings[0]


# -------------------------------------------------------------------------------------------------- site
def test_latitudes_are_read_as_ifcopenshell_reads_them() -> None:
    model, context = model_of("IFC4")
    site = model.by_type("IfcSite")[0]
    site.RefLatitude, site.RefLongitude, site.RefElevation = (41, 52, 27, 840000), (-87, -38, -21, -839999), 180_000.0
    site.ObjectPlacement = model.create_entity("IfcLocalPlacement", None, placement(model, (1000.0, 2000.0, 0.0)))
    context.TrueNorth = model.create_entity("IfcDirection", (-1.0, 2.0))
    found = ours(model, 0.001)
    assert found.site_latitude_deg == pytest.approx(geolocation.dms2dd(41, 52, 27, 840000))
    assert found.site_longitude_deg == pytest.approx(geolocation.dms2dd(-87, -38, -21, -839999))
    assert (found.site_elevation_m, found.site_position_m) == (180.0, (1.0, 2.0, 0.0))
    assert found.true_north == pytest.approx((-1 / math.sqrt(5), 2 / math.sqrt(5)))
    # ifcopenshell gives the angle from +y, counter-clockwise.
    angle = math.radians(geolocation.get_true_north(model))
    assert (-math.sin(angle), math.cos(angle)) == pytest.approx(found.true_north)
    assert (found.operation, found.to_map) == ("", None)


def test_a_place_just_south_of_the_equator_is_south_of_it() -> None:
    model, _ = model_of("IFC4")
    site = model.by_type("IfcSite")[0]
    site.RefLatitude, site.RefLongitude = (0, -30, 0), (0, 0, -36)
    found = ours(model, 0.001)
    assert (found.site_latitude_deg, found.site_longitude_deg) == (-0.5, pytest.approx(-0.01))


@pytest.mark.parametrize("latitude", [None, (0, 0, 0)])
def test_a_site_that_says_nothing_of_its_place_has_none(latitude: tuple[int, ...] | None) -> None:
    model, _ = model_of("IFC4")
    site = model.by_type("IfcSite")[0]
    site.RefLatitude = site.RefLongitude = latitude
    assert read_georeference("test.ifc", model, 0.001) is None


def test_a_latitude_that_is_nowhere_is_told() -> None:
    model, _ = model_of("IFC4")
    site = model.by_type("IfcSite")[0]
    site.RefLatitude, site.RefLongitude = (149, 0, 0), (8, 0, 0)
    found = ours(model, 0.001)
    assert found.site_latitude_deg is None
    assert "not on Earth" in found.warnings[0]


# -------------------------------------------------------------------------------------------- whole files
@pytest.fixture(scope="module")
def surveyed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ifc") / "box.ifc"
    return scenes_synthetic.write(scenes_synthetic.on_map(scenes_synthetic.build("box")), path)


def test_the_surveyed_scene_says_one_place_three_times(surveyed: Path) -> None:
    scene = load_scene(surveyed)
    model = ifcopenshell.open(str(surveyed))
    document = {"scene": {"georeference": None}, "floors": [], "stations": []}
    frame = site_frame(_with(document, scene.georeference))
    theirs = np.array([geolocation.auto_xyz2enh(model, *(point * 1000.0)) for point in POINTS_M])
    assert np.abs(frame.to_site(POINTS_M) - theirs).max() < 1e-6
    assert frame.crs == "EPSG:25832"
    assert frame.to_site(np.zeros(3)).tolist() == [SURVEYED.east_m, SURVEYED.north_m, SURVEYED.height_m]
    assert math.degrees(frame.grid_north_rad) == pytest.approx(-geolocation.get_grid_north(model))
    assert frame.true_north_rad == pytest.approx(-math.radians(geolocation.get_true_north(model)))


def _with(document: dict[str, Any], told: Georeference | None) -> dict[str, Any]:
    """As plan.json has it."""
    from planner_core.documents import to_document

    written = json.loads(json.dumps(None if told is None else to_document(told)))
    return {**document, "scene": {"georeference": written}}


def test_a_georeference_is_read_back_from_plan_json_as_it_was(surveyed: Path) -> None:
    told = load_scene(surveyed).georeference
    assert told is not None
    assert georeference_of(_with({}, told)) == told
    assert georeference_of(_with({}, None)) is None


def test_a_scene_keeps_it_when_doors_are_opened(tmp_path: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.on_map(scenes_synthetic.build("two-rooms")), tmp_path / "two.ifc")
    shut, opened = (load_scene(path, options=LoadOptions(doors=doors)) for doors in ("shut", "open"))
    assert shut.georeference == opened.georeference
    assert shut.georeference is not None


def test_a_unit_told_by_the_user_keeps_places_on_the_map(surveyed: Path) -> None:
    plain = load_scene(surveyed)
    larger = load_scene(surveyed, options=LoadOptions(metres_per_unit=0.01))
    assert plain.georeference is not None
    assert larger.georeference is not None
    corner = plain.vertices_m[5] + plain.offset_m
    same = larger.vertices_m[5] + larger.offset_m
    assert same == pytest.approx(corner * 10)
    on_map = np.array(plain.georeference.to_map) @ [*corner, 1.0]
    assert np.array(larger.georeference.to_map) @ [*same, 1.0] == pytest.approx(on_map)


def test_a_scene_turned_over_by_the_user_has_none(surveyed: Path) -> None:
    assert load_scene(surveyed, options=LoadOptions(up_axis="Y")).georeference is None


def test_other_formats_say_nothing(tmp_path: Path) -> None:
    path = scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "box.obj")
    assert load_scene(path).georeference is None


@pytest.mark.parametrize(
    ("name", "latitude", "longitude", "north", "crs"),
    [
        ("fzk-haus", 49.100435, 8.436539, (0.7660444, 0.6427876), "EPSG:25832"),
        ("duplex", 41.8744, -87.6394, None, "EPSG:26916"),
    ],
)
def test_real_files_say_where_their_site_is(
    name: str, latitude: float, longitude: float, north: tuple[float, float] | None, crs: str
) -> None:
    path = REAL / f"{name}.ifc"
    if not path.is_file():
        pytest.skip(f"{name}.ifc is not beside this checkout")
    found = read_georeference(path.name, ifcopenshell.open(str(path)), 1.0)
    assert found is not None
    assert (found.site_latitude_deg, found.site_longitude_deg) == pytest.approx((latitude, longitude), abs=1e-6)
    assert found.true_north == (pytest.approx(north) if north else None)
    assert found.to_map is None

    document = _with({"floors": [], "stations": []}, found)
    assert site_frame(document).is_scene
    placed = site_frame(document, FrameRequest(crs=crs, by_site_placement=True))
    degrees = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    at = placed.to_site(np.array(found.site_position_m))
    assert degrees.transform(*at[:2]) == pytest.approx((longitude, latitude), abs=1e-6)
    # A step to true north, on the ellipsoid, is a step along the file's true north in the scene.
    away = degrees.transform(*placed.to_site(np.array([*(100.0 * np.array(north or (0.0, 1.0))), 0.0]))[:2])
    azimuth, _, _ = pyproj.Geod(ellps="GRS80").inv(longitude, latitude, *away)
    assert azimuth == pytest.approx(0.0, abs=0.01)


def named_unit(model: Any, name: str, unit_m: float) -> Any:
    """A conversion-based unit of a name and a length that need not agree."""
    factor = model.create_entity("IfcMeasureWithUnit", model.create_entity("IfcLengthMeasure", unit_m), metre(model))
    dimensions = model.create_entity("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
    return model.create_entity("IfcConversionBasedUnit", dimensions, "LENGTHUNIT", name, factor)


@pytest.mark.parametrize(
    ("name", "unit_m", "scale", "map_m"),
    [
        ("METER", 0.3048, None, 1.0),
        ("METRE", 0.3048, 1.0 / 0.3048, 0.3048),
        ("Foot", 1.0, 1.0, 1.0),
        ("METER", 0.001, 1.0, 1.0),
        ("US survey foot", 1.0, 1.0, 1.0),
    ],
)
def test_a_map_unit_whose_name_and_factor_differ_is_read_as_its_scale_fits(
    name: str, unit_m: float, scale: float | None, map_m: float
) -> None:
    model, context = model_of("IFC4", None)
    told = {"Eastings": 458_870.0, "Northings": 5_438_260.0, "OrthogonalHeight": 110.0, "Scale": scale}
    add_conversion(model, context, unit=named_unit(model, name, unit_m), **told)
    found = ours(model, 1.0)
    assert found.to_map is not None
    np.testing.assert_allclose(np.array(found.to_map)[:2, 3], np.array([458_870.0, 5_438_260.0]) * map_m)
    (line,) = found.warnings
    assert f"named {name.upper()} and is {unit_m:g} m long" in line and f"{map_m:g} m is taken" in line


def test_a_map_unit_whose_name_and_factor_both_miss_the_scale_is_not_used() -> None:
    model, context = model_of("IFC4", None)
    add_conversion(model, context, unit=named_unit(model, "METER", 0.3048), Eastings=1.0, Northings=2.0, Scale=7.0)
    found = ours(model, 1.0)
    assert found.to_map is None
    assert "is not used; correct the unit" in found.warnings[0]


@pytest.mark.parametrize(("name", "unit_m"), [("FOOT", 0.3048), ("FOOT", 1200 / 3937), ("METRE", 1.0), ("rod", 5.0292)])
def test_a_map_unit_whose_name_and_factor_agree_raises_no_doubt(name: str, unit_m: float) -> None:
    model, context = model_of("IFC4", None)
    unit = named_unit(model, name, unit_m)
    add_conversion(model, context, unit=unit, Eastings=1.0, Northings=2.0, Scale=1.0 / unit_m)
    assert not ours(model, 1.0).warnings
