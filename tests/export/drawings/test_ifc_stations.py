import hashlib
import math
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.geolocation
import ifcopenshell.util.placement
import ifcopenshell.validate
import numpy as np
import pytest
import trimesh

from planner_core import child_process
from planner_core.errors import ExportError, SceneError
from planner_core.export.ifc_stations import OBJECT_TYPE, PSET, write_ifc, write_ifc_model
from planner_core.export.options import Options
from planner_core.model import SiteFrame
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.tripod import tripod
from planner_core.progress import silent
from planner_core.scene import isolated_readers
from planner_core.scene.ifc import try_model
from planner_core.scene.load import load_scene
from tests.scene import broken_ifc

in_child = child_process.run_isolated
DUPLEX = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "ifc" / "duplex.ifc"


@pytest.fixture(scope="module")
def alone(house_in_munich: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ifc") / "stations.ifc"
    assert write_ifc(house_in_munich, path, Options(), silent) == ()
    return path


@pytest.fixture(scope="module")
def within(house_in_munich: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ifc") / "house-with-stations.ifc"
    assert write_ifc_model(house_in_munich, path, Options(), silent) == ()
    return path


@pytest.fixture(autouse=True)
def _tried_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Starting a child and importing IfcOpenShell in it takes longer than writing a model; `within` has had one."""

    def run_isolated(function: str, arguments: Any, **options: Any) -> Any:
        if function == "planner_core.scene.ifc:try_model":
            return try_model(**arguments)
        return in_child(function, arguments, **options)  # the first test of a run makes the plan

    monkeypatch.setattr(child_process, "run_isolated", run_isolated)


@pytest.mark.parametrize("name", ["alone", "within"])
def test_file_is_valid_by_its_schema(name, request):
    assert _faults(request.getfixturevalue(name)) == []


@pytest.mark.slow
def test_file_of_two_stations_keeps_the_express_rules(house_in_munich, tmp_path):
    plan = replace(house_in_munich, stations=house_in_munich.stations[:2])  # rules take a second a station
    write_ifc(plan, tmp_path / "two.ifc", Options(), silent)
    assert _faults(tmp_path / "two.ifc", express_rules=True) == []


@pytest.mark.parametrize("name", ["alone", "within"])
def test_geometry_engine_finds_sensors_and_their_ground(name, request, house):
    found = _shapes(ifcopenshell.open(str(request.getfixturevalue(name))))
    assert sorted(found) == sorted(station.id for station in house.stations)
    for station in house.stations:
        origin_m, corners_m = found[station.id]
        assert np.abs(origin_m - station.position_m).max() < 5.1e-5
        assert corners_m[:, 2].min() == pytest.approx(station.ground_m[2], abs=2e-4)
        assert np.abs(corners_m[:, :2].mean(axis=0) - station.position_m[:2]).max() < 0.1


def test_only_stations_with_scans_are_told_as_scanned_before(evaluated_house, tmp_path):
    write_ifc(evaluated_house, tmp_path / "given.ifc", Options(), silent)
    model = ifcopenshell.open(str(tmp_path / "given.ifc"))  # held: its entities die with it
    told = {each.Name: ifcopenshell.util.element.get_psets(each)[PSET]["State"] for each in _proxies(model)}
    first, *others = evaluated_house.stations
    assert told == {first.id: "scanned before", **{station.id: "planned" for station in others}}


@pytest.mark.parametrize("name", ["alone", "within"])
def test_stations_are_in_the_storeys_of_their_floors_with_their_figures(name, request, house_in_munich):
    model = ifcopenshell.open(str(request.getfixturevalue(name)))
    for station in house_in_munich.stations:
        (proxy,) = [each for each in _proxies(model) if each.Name == station.id]
        assert ifcopenshell.util.element.get_container(proxy).Name == station.floor_name
        told = ifcopenshell.util.element.get_psets(proxy)[PSET]
        expected = [*station.site_m[:2], station.site_ground_m[2], station.instrument_height_m, station.site_m[2]]
        names = ("Easting", "Northing", "GroundHeight", "InstrumentHeight", "SensorHeight")
        assert [told[each] for each in names] == pytest.approx(expected, abs=5.1e-5)
        assert (told["Id"], told["Number"], told["State"]) == (station.id, station.number, "planned")
        assert told["CoordinateSystem"].startswith("EPSG:25832 ETRS89 / UTM zone 32N")
        linked = {link.b if link.a == station.id else link.a for link in house_in_munich.links
                  if house_in_munich.counts(link) and station.id in (link.a, link.b)}  # fmt: skip
        assert {part.split(" ")[0] for part in told["LinkedTo"].split(", ")} == (linked or {"none"})


def test_lengths_of_the_property_set_are_metres_in_files_of_millimetres(within):
    model = ifcopenshell.open(str(within))
    assert model.by_type("IfcProject")[0].UnitsInContext.Units[0].Prefix == "MILLI"
    lengths = [each for each in model.by_type("IfcPropertySingleValue") if each.Name == "Easting"]
    assert lengths
    assert {(each.Unit.Name, each.Unit.Prefix) for each in lengths} == {("METRE", None)}


def test_map_conversion_leads_from_placements_to_site_coordinates(alone, house_in_munich):
    model = ifcopenshell.open(str(alone))
    (system,) = model.by_type("IfcProjectedCRS")
    assert (system.Name, system.VerticalDatum) == ("EPSG:25832", "EPSG:7837")
    for station in house_in_munich.stations:
        (proxy,) = [each for each in _proxies(model) if each.Name == station.id]
        local = ifcopenshell.util.placement.get_local_placement(proxy.ObjectPlacement)[:3, 3]
        assert ifcopenshell.util.geolocation.auto_xyz2enh(model, *local) == pytest.approx(station.site_m, abs=1e-4)


@pytest.mark.slow
def test_our_own_reader_finds_the_frame_again(alone, house_in_munich):
    told = load_scene(alone).georeference
    assert told is not None
    assert np.allclose(told.to_map, house_in_munich.frame.matrix, rtol=0, atol=1e-9)


def test_scaled_grid_is_told_in_the_file_and_heights_in_a_remark(house, tmp_path):
    scale = 0.9996
    matrix = np.diag([scale, scale, 1.0, 1.0])
    matrix[:3, 3] = (500_000.0, 5_000_000.0, 100.0)
    plan = replace(house, frame=SiteFrame(matrix=matrix, crs="EPSG:25832", name="EPSG:25832", source="given epsg"))
    (remark,) = write_ifc(plan, tmp_path / "scaled.ifc", Options(), silent)
    assert "scales heights, too, by 0.999600" in remark
    (conversion,) = ifcopenshell.open(str(tmp_path / "scaled.ifc")).by_type("IfcMapConversion")
    assert conversion.Scale == pytest.approx(scale)
    tilted = matrix.copy()
    tilted[0, 2] = 0.01
    plan = replace(house, frame=SiteFrame(matrix=tilted, name="tilted", source="control points"))
    (remark,) = write_ifc(plan, tmp_path / "tilted.ifc", Options(), silent)
    assert "no tilted or skewed grid" in remark
    assert not ifcopenshell.open(str(tmp_path / "tilted.ifc")).by_type("IfcMapConversion")


def test_scene_coordinates_claim_no_place_on_earth(house, tmp_path):
    write_ifc(house, tmp_path / "scene.ifc", Options(), silent)
    model = ifcopenshell.open(str(tmp_path / "scene.ifc"))
    assert not model.by_type("IfcMapConversion")
    told = ifcopenshell.util.element.get_psets(_proxies(model)[0])[PSET]
    assert told["CoordinateSystem"] == "scene coordinates, no CRS"


def test_copy_keeps_all_that_was_in_the_file(within, house_file):
    before, after = ifcopenshell.open(str(house_file)), ifcopenshell.open(str(within))
    kept = {each.GlobalId for each in before.by_type("IfcRoot")}
    assert kept < {each.GlobalId for each in after.by_type("IfcRoot")}
    for entity in before:
        assert str(after.by_id(entity.id())) == str(entity)
    assert after.schema == before.schema


def test_same_plan_gives_the_same_bytes(within, house_in_munich, tmp_path):
    write_ifc_model(house_in_munich, tmp_path / "again.ifc", Options(), silent)
    assert (tmp_path / "again.ifc").read_bytes() == within.read_bytes()


def test_station_keeps_its_id_when_it_moves(house, alone, tmp_path):
    moved = tuple(replace(each, position_m=each.position_m + 0.1) for each in house.stations)
    write_ifc(replace(house, stations=moved), tmp_path / "moved.ifc", Options(), silent)
    ids = [
        {proxy.Name: proxy.GlobalId for proxy in _proxies(ifcopenshell.open(str(path)))}
        for path in (alone, tmp_path / "moved.ifc")
    ]
    assert ids[0] == ids[1]
    assert len(set(ids[0].values())) == len(house.stations)


@pytest.mark.slow
def test_copy_of_a_copy_has_no_id_twice(house, within, tmp_path):
    again = replace(_planned_on(house, within, 0.001), title=house.title)
    write_ifc_model(again, tmp_path / "again.ifc", Options(), silent)
    assert _faults(tmp_path / "again.ifc") == []
    assert len(_proxies(ifcopenshell.open(str(tmp_path / "again.ifc")))) == 2 * len(house.stations)


def test_one_floor_alone_has_one_storey(house, tmp_path):
    write_ifc(house, tmp_path / "one.ifc", Options(floors=("F1",)), silent)
    model = ifcopenshell.open(str(tmp_path / "one.ifc"))
    assert [storey.Name for storey in model.by_type("IfcBuildingStorey")] == ["Upper floor"]
    assert {proxy.Name for proxy in _proxies(model)} == {station.id for station in house.stations_of("F1")}


def test_station_of_unknown_height_has_no_tripod_and_no_ground(house, tmp_path):
    first, *rest = house.stations
    first = replace(first, instrument_height_m=math.nan)
    write_ifc(replace(house, stations=(first, *rest)), tmp_path / "unknown.ifc", Options(), silent)
    model = ifcopenshell.open(str(tmp_path / "unknown.ifc"))
    (proxy,) = [each for each in _proxies(model) if each.Name == first.id]
    told = ifcopenshell.util.element.get_psets(proxy)[PSET]
    assert "GroundHeight" not in told
    assert "InstrumentHeight" not in told
    assert told["SensorHeight"] == pytest.approx(first.position_m[2])
    corners_m = _shapes(model)[first.id][1]
    assert corners_m[:, 2].min() == pytest.approx(first.position_m[2] - 0.15, abs=1e-4)


def test_scene_that_is_no_ifc_file_is_refused(house, tmp_path):
    document = {**house.document, "scene": {**house.document["scene"], "format": "obj"}}
    with pytest.raises(ExportError, match=r"house\.ifc: is obj, expected an IFC file .* use format ifc"):
        write_ifc_model(replace(house, document=document), tmp_path / "no.ifc", Options(), silent)


@pytest.mark.slow
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4X3", pytest.param("IFC4", marks=pytest.mark.slow)])
def test_file_in_millimetres_with_turned_storeys_takes_stations_where_they_are(schema, house, tmp_path):
    path = tmp_path / "old.ifc"
    _write_old_file(path, [floor.elevation_m for floor in house.floors], schema)
    plan = _planned_on(house, path, metres_per_unit=0.001)
    assert write_ifc_model(plan, tmp_path / "with.ifc", Options(), silent) == ()
    model = ifcopenshell.open(str(tmp_path / "with.ifc"))
    assert model.schema == schema
    assert _faults(tmp_path / "with.ifc") == []
    found = _shapes(model)
    for station in house.stations:
        assert np.abs(found[station.id][0] - station.position_m).max() < 5.1e-5
        (proxy,) = [each for each in _proxies(model) if each.Name == station.id]
        # The storeys have other names: the nearest in height is taken.
        expected = f"Level {station.floor_id[1:]}"
        assert ifcopenshell.util.element.get_container(proxy).Name == expected


def test_stations_without_a_storey_near_are_in_the_building_and_it_is_said(house, tmp_path):
    path = tmp_path / "low.ifc"
    _write_old_file(path, [0.0, 30.0])
    remarks = write_ifc_model(_planned_on(house, path, 0.001), tmp_path / "with.ifc", Options(), silent)
    assert remarks == ("old.ifc has no storey for floor Upper floor: its stations are in the building",)
    model = ifcopenshell.open(str(tmp_path / "with.ifc"))
    upper = {station.id for station in house.stations_of("F1")}
    containers = {proxy.Name: ifcopenshell.util.element.get_container(proxy).is_a() for proxy in _proxies(model)}
    assert {name for name, kind in containers.items() if kind == "IfcBuilding"} == upper


def test_stations_of_a_building_of_several_files_are_in_the_first_and_it_is_said(house, tmp_path):
    heights_m = [floor.elevation_m for floor in house.floors]
    for name, schema in (("first.ifc", "IFC2X3"), ("second.ifc", "IFC4")):
        _write_old_file(tmp_path / name, heights_m, schema)
    plan = _planned_on(house, tmp_path / "first.ifc", metres_per_unit=0.001)
    second = _planned_on(house, tmp_path / "second.ifc", metres_per_unit=0.001)
    scene = {**plan.document["scene"], "other_files": [second.document["scene"]]}
    source = {"path": "first.ifc", "other_paths": ["second.ifc"]}
    both = (tmp_path / "first.ifc", tmp_path / "second.ifc")
    plan = replace(plan, document={**plan.document, "scene": scene, "source": source}, given_scene=both)
    remarks = write_ifc_model(plan, tmp_path / "with.ifc", Options(), silent)
    assert remarks == ("first.ifc, the first of 2 files, is what the stations are written into",)
    model = ifcopenshell.open(str(tmp_path / "with.ifc"))
    assert model.schema == "IFC2X3"
    assert {proxy.Name for proxy in _proxies(model)} == {station.id for station in house.stations}


def test_copy_of_a_packed_file_in_an_old_code_page_keeps_its_names(house, tmp_path):
    """IfcOpenShell alone can't parse it: the second byte of the name's first character is a backslash."""
    _write_old_file(tmp_path / "old.ifc", [0.0, 3.0])
    text = (tmp_path / "old.ifc").read_bytes().replace(b"'Level 0'", b"'%s'" % "表 1階".encode("cp932"))
    with zipfile.ZipFile(tmp_path / "old.ifczip", "w") as archive:
        archive.writestr("old.ifc", text)
    plan = _planned_on(house, tmp_path / "old.ifczip", metres_per_unit=0.001)
    write_ifc_model(plan, tmp_path / "with.ifc", Options(), silent)
    storeys = ifcopenshell.open(str(tmp_path / "with.ifc")).by_type("IfcBuildingStorey")
    assert [storey.Name for storey in storeys] == ["表 1階", "Level 1"]


@pytest.mark.slow
def test_real_ifc2x3_building_takes_stations(house, tmp_path):
    if not DUPLEX.is_file():
        pytest.skip(f"{DUPLEX.name} is not beside the repository, at ../shared/data/ifc")
    plan = _planned_on(house, DUPLEX, metres_per_unit=1.0)
    write_ifc_model(plan, tmp_path / "with.ifc", Options(), silent)
    model = ifcopenshell.open(str(tmp_path / "with.ifc"))
    found = _shapes(model)
    assert len(found) == len(house.stations)
    assert all(np.abs(found[each.id][0] - each.position_m).max() < 5.1e-5 for each in house.stations)


# --------------------------------------------------------------------------------------------------- tripod
@pytest.mark.parametrize("height_m", [0.2, 0.5, 1.3, 2.4, math.nan])
def test_tripod_is_made_of_closed_parts_from_the_ground_to_above_the_sensor(height_m):
    vertices, triangles = tripod(height_m)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    parts = mesh.split(only_watertight=False, engine="scipy")
    assert len(parts) == (4 if height_m > 0.3 else 1)
    assert all(part.volume > 0 for part in parts)
    lowest = -height_m if height_m > 0.3 else -0.15
    assert vertices[:, 2].min() == pytest.approx(lowest)
    assert vertices[:, 2].max() == pytest.approx(0.15)
    assert np.hypot(*vertices[:, :2].T).max() <= 0.5


# -------------------------------------------------------------------------------------------------- helpers
def _proxies(model) -> list:
    return [each for each in model.by_type("IfcBuildingElementProxy") if each.ObjectType == OBJECT_TYPE]


def _faults(path: Path, *, express_rules: bool = False) -> list:
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(str(path), logger, express_rules=express_rules)
    return logger.statements


def _shapes(model) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Origin and corners in metres, world coordinates, of each station, as the geometry engine sees them."""
    found = {}
    iterator = ifcopenshell.geom.iterator(ifcopenshell.geom.settings(), model, include=_proxies(model))
    assert iterator.initialize()
    while True:
        shape = iterator.get()
        matrix = np.array(shape.transformation.matrix).reshape(4, 4).T
        corners = np.array(shape.geometry.verts).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        found[shape.name] = (matrix[:3, 3], corners)
        if not iterator.next():
            return found


def _planned_on(plan: PlanSource, path: Path, metres_per_unit: float) -> PlanSource:
    """The plan as if it had been made on another file."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    scene = {**plan.document["scene"], "file": path.name, "sha256": digest, "metres_per_unit": metres_per_unit}
    return replace(plan, document={**plan.document, "scene": scene}, given_scene=path, title="old.ifc")


def _write_old_file(path: Path, elevations_m: list[float], schema: str = "IFC2X3") -> None:
    """IFC in millimetres: a building that stands turned by 30 degrees on its site, with storeys and nothing else."""
    model = ifcopenshell.file(schema=schema)
    create = model.create_entity
    person = create(
        "IfcPersonAndOrganization", create("IfcPerson", FamilyName="a"), create("IfcOrganization", Name="b")
    )
    program = create("IfcApplication", person.TheOrganization, "1", "c", "c")
    owner = create("IfcOwnerHistory", person, program, ChangeAction="ADDED", CreationDate=0)
    number = iter(range(100))

    def rooted(kind, **told):
        return create(kind, GlobalId=ifcopenshell.guid.compress(f"{next(number):032x}"), OwnerHistory=owner, **told)

    def placed(parent, z, towards=None):
        point = create("IfcCartesianPoint", [1000.0, 2000.0, z])
        axes = [create("IfcDirection", [0.0, 0.0, 1.0]), create("IfcDirection", towards)] if towards else [None, None]
        return create("IfcLocalPlacement", parent, create("IfcAxis2Placement3D", point, *axes))

    length = create("IfcSIUnit", None, "LENGTHUNIT", "MILLI", "METRE")
    origin = create("IfcAxis2Placement3D", create("IfcCartesianPoint", [0.0, 0.0, 0.0]))
    context = create("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, origin)
    units = create("IfcUnitAssignment", [length])
    project = rooted("IfcProject", Name="p", RepresentationContexts=[context], UnitsInContext=units)
    turned = [math.cos(math.pi / 6), math.sin(math.pi / 6), 0.0]
    building = rooted("IfcBuilding", Name="b", ObjectPlacement=placed(None, 0.0, turned), CompositionType="ELEMENT")
    storeys = [
        rooted("IfcBuildingStorey", Name=f"Level {n}", CompositionType="ELEMENT",
               ObjectPlacement=placed(building.ObjectPlacement, 1000 * elevation_m))
        for n, elevation_m in enumerate(elevations_m)
    ]  # fmt: skip
    rooted("IfcRelAggregates", RelatingObject=project, RelatedObjects=[building])
    rooted("IfcRelAggregates", RelatingObject=building, RelatedObjects=storeys)
    model.write(str(path))


def test_probability_that_falls_short_never_reads_as_what_was_asked(house_in_munich, tmp_path):
    first = next(link for link in house_in_munich.links if house_in_munich.counts(link))
    plan = replace(house_in_munich, links=(replace(first, probability=0.98996, as_set_up=True),))
    write_ifc(plan, tmp_path / "short.ifc", Options(), silent)
    model = ifcopenshell.open(str(tmp_path / "short.ifc"))  # held: its entities die with it
    told = {each.Name: ifcopenshell.util.element.get_psets(each)[PSET]["LinkedTo"] for each in _proxies(model)}
    assert {text for text in told.values() if text != "none"} == {
        f"{first.a} just below 99 %",
        f"{first.b} just below 99 %",
    }


def test_model_that_crashes_ifcopenshell_is_refused(house_in_munich, tmp_path, monkeypatch):
    """As some damaged files do while they are opened: the child process dies, this one says so."""

    def run_isolated(function: str, arguments: Any, **options: Any) -> Any:
        crash = {"stmt": "import faulthandler; faulthandler._sigsegv()", "number": 1}
        return in_child("timeit:timeit", crash, **options)

    monkeypatch.setattr(child_process, "run_isolated", run_isolated)
    with pytest.raises(ExportError, match=r"IfcOpenShell crashed \(segmentation fault\), expected a file that it can"):
        write_ifc_model(house_in_munich, tmp_path / "x.ifc", Options(), silent)
    assert not (tmp_path / "x.ifc").exists()


@pytest.mark.parametrize("entity", ["IfcBuildingStorey", "IfcBuilding"])
def test_model_whose_storeys_are_placed_by_something_else_is_refused(house_in_munich, tmp_path, entity):
    """What IfcOpenShell raises at it is a fault of the file."""
    path = house_in_munich.scene_paths()[0]
    text = path.read_text()
    number = broken_ifc.instance(text, entity)
    broken = broken_ifc.changed(text, number, 5, broken_ifc.instance(text, "IfcCartesianPoint"))
    (tmp_path / path.name).write_text(broken)
    with pytest.raises(SceneError, match=r"its contents do not follow IFC"):
        isolated_readers.open_tried(tmp_path / path.name)
