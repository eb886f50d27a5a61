"""IFC: what is read, what is left out, where elements belong, and that far sites lose nothing."""

from __future__ import annotations

import numpy as np
import pytest

from planner_core.errors import SceneError
from planner_core.model import UpAxis
from planner_core.scene.load import LoadOptions, load_scene
from tests.scene.conftest import native_readers_here

SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3")
FAR_M = (500_000.0, 5_400_000.0, 431.0)


@pytest.fixture(scope="module", params=SCHEMAS)
def building(request, tmp_path_factory, write_building):
    path = tmp_path_factory.mktemp("ifc") / "building.ifc"
    write_building(path, schema=request.param)
    with native_readers_here():
        return load_scene(path)


def corners_of(scene, name):
    index = [e.name for e in scene.elements].index(name)
    return scene.vertices_m[scene.triangles[scene.element_of_triangle == index]].reshape(-1, 3)


def test_physical_products_are_read_and_no_others(building):
    assert sorted((e.kind, e.name) for e in building.elements) == [
        ("IfcDoor", "Door"),
        ("IfcFurnishingElement", "Cupboard A"),
        ("IfcFurnishingElement", "Cupboard B"),
        ("IfcFurnishingElement", "Cupboard C"),
        ("IfcSlab", "Slab Ground"),
        ("IfcSlab", "Slab Upper"),
        ("IfcStairFlight", "Flight"),
        ("IfcWall", "Wall"),
    ]


def test_storeys_come_lowest_first_with_elevations_in_metres(building):
    assert [(s.name, s.elevation_m) for s in building.storeys] == [
        ("Ground", pytest.approx(0.0)),
        ("Upper", pytest.approx(3.0)),
    ]
    assert len({s.source_id for s in building.storeys}) == 2


def test_element_is_on_the_storey_of_what_it_belongs_to(building):
    """The door fills an opening of the wall, the flight is part of a stair."""
    on = {e.name: building.storeys[e.storey].name for e in building.elements}
    upper = {"Slab Upper", "Cupboard C"}
    assert on == {e.name: "Upper" if e.name in upper else "Ground" for e in building.elements}


def test_elements_keep_their_global_ids_and_the_order_of_the_file(building):
    assert all(len(e.source_id) == 22 for e in building.elements)
    assert len({e.source_id for e in building.elements}) == len(building.elements)
    assert [e.name for e in building.elements][:4] == ["Slab Ground", "Slab Upper", "Wall", "Door"]
    assert (np.diff(building.element_of_triangle) >= 0).all()


def test_opening_is_cut_out_of_its_wall(building, volumes):
    volume = dict(zip([e.name for e in building.elements], volumes(building), strict=True))
    assert volume["Wall"] == pytest.approx(8 * 0.25 * 2.5 - 1 * 0.25 * 2, abs=1e-9)
    assert volume["Door"] == pytest.approx(0.125, abs=1e-9)


def test_mapped_shape_is_placed_once_an_instance(building, volumes):
    volume = dict(zip([e.name for e in building.elements], volumes(building), strict=True))
    for name, low, high in (
        ("Cupboard A", (1, 3, 0), (2, 3.5, 2)),
        ("Cupboard B", (4.5, 3, 0), (5, 4, 2)),  # turned by 90 degrees
        ("Cupboard C", (6, 3, 3), (7, 3.5, 5)),  # mirrored in x, upper storey
    ):
        corners = corners_of(building, name)
        np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [low, high], atol=1e-9, err_msg=name)
        assert volume[name] == pytest.approx(1.0, abs=1e-9)  # positive: outside stays outside, mirrored or not


@pytest.mark.parametrize("prefix", ["CENTI", None])
def test_project_unit_does_not_change_the_building(tmp_path, write_building, triangle_set, prefix):
    write_building(tmp_path / "a.ifc", prefix="MILLI")
    write_building(tmp_path / "b.ifc", prefix=prefix)
    millimetres, other = load_scene(tmp_path / "a.ifc"), load_scene(tmp_path / "b.ifc")
    np.testing.assert_allclose(
        triangle_set(other.vertices_m, other.triangles),
        triangle_set(millimetres.vertices_m, millimetres.triangles),
        atol=1e-6,
    )
    assert [s.elevation_m for s in other.storeys] == pytest.approx([s.elevation_m for s in millimetres.storeys])


def test_georeferenced_site_is_moved_and_loses_less_than_a_micrometre(tmp_path, write_building, triangle_set):
    write_building(tmp_path / "near.ifc")
    write_building(tmp_path / "far.ifc", origin=FAR_M)
    near, far = load_scene(tmp_path / "near.ifc"), load_scene(tmp_path / "far.ifc")
    assert far.offset_m.tolist() == [500_004.0, 5_400_003.0, 0.0]
    assert near.offset_m.tolist() == [0.0, 0.0, 0.0]
    back = far.vertices_m + (far.offset_m - FAR_M)
    assert back.shape == near.vertices_m.shape
    np.testing.assert_allclose(
        triangle_set(back, far.triangles), triangle_set(near.vertices_m, near.triangles), atol=2e-6
    )
    assert [s.elevation_m for s in far.storeys] == pytest.approx([431.0, 434.0])
    assert np.abs(far.vertices_m[:, :2]).max() < 10
    assert any("far from its origin" in w for w in far.report.warnings)


def test_storeys_placed_at_one_height_take_their_elevation_attributes(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    low, high = writer.storeys({"Low": 0.0, "High": 0.0}, (0, 0, 0)).values()
    high.Elevation = 2800.0
    add_box(writer, low)
    writer.model.write(str(tmp_path / "flat.ifc"))
    scene = load_scene(tmp_path / "flat.ifc")
    assert [(s.name, s.elevation_m) for s in scene.storeys] == [("Low", 0.0), ("High", pytest.approx(2.8))]
    assert any("Elevation attributes are used" in w for w in scene.report.warnings)


def test_storey_whose_elevation_contradicts_its_placement_keeps_the_placement(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    low, high = writer.storeys({"Low": 0.0, "High": 3.0}, (0, 0, 0)).values()
    high.Elevation = 3.0  # metres in a file of millimetres
    add_box(writer, low)
    writer.model.write(str(tmp_path / "wrong.ifc"))
    scene = load_scene(tmp_path / "wrong.ifc")
    assert scene.storeys[1].elevation_m == pytest.approx(3.0)
    assert [w for w in scene.report.warnings if "High" in w and "placement is used" in w]


def test_storeys_above_a_raised_site_are_not_warned_about(tmp_path, write_building):
    write_building(tmp_path / "hill.ifc", origin=(0.0, 0.0, 200.0))
    scene = load_scene(tmp_path / "hill.ifc")
    assert [s.elevation_m for s in scene.storeys] == pytest.approx([200.0, 203.0])
    assert scene.report.warnings == ()


def test_body_without_a_surface_is_named(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    storey = writer.storeys({"Low": 0.0}, (0, 0, 0))["Low"]
    add_box(writer, storey)
    flat = writer.block((1, 1, 1))
    flat.Depth = 0.0
    wall = writer.root(
        "IfcWall", "Crushed", ObjectPlacement=writer.placement(above=storey), Representation=writer.shape(flat)
    )
    writer.contain(storey, wall)
    writer.model.write(str(tmp_path / "crushed.ifc"))
    scene = load_scene(tmp_path / "crushed.ifc")
    assert [e.name for e in scene.elements] == ["Box"]
    assert scene.report.warnings == ("crushed.ifc: 1 product has a body that gives no surface: IfcWall Crushed.",)


def test_file_without_a_length_unit_is_metres_and_says_so(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", None)
    add_box(writer, writer.storeys({"Low": 0.0}, (0, 0, 0))["Low"])
    writer.project.UnitsInContext = None
    writer.model.write(str(tmp_path / "unitless.ifc"))
    scene = load_scene(tmp_path / "unitless.ifc")
    np.testing.assert_allclose(np.ptp(scene.vertices_m, axis=0), (2, 2, 2))
    assert any("metres are assumed; pass --units" in w for w in scene.report.warnings)
    told = load_scene(tmp_path / "unitless.ifc", options=LoadOptions(metres_per_unit=0.0254))
    np.testing.assert_allclose(np.ptp(told.vertices_m, axis=0), (2 * 0.0254,) * 3)
    assert not [w for w in told.report.warnings if "assumed" in w or "--units" in w]


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_project_without_units_is_metres_in_every_schema(tmp_path, ifc_writer, schema):
    writer = ifc_writer(schema, None)
    add_box(writer, writer.storeys({"Low": 0.0}, (0, 0, 0))["Low"])
    writer.project.UnitsInContext = None
    writer.model.write(str(tmp_path / "unitless.ifc"))
    scene = load_scene(tmp_path / "unitless.ifc")
    np.testing.assert_allclose(np.ptp(scene.vertices_m, axis=0), (2, 2, 2))
    assert any("names no length unit" in w for w in scene.report.warnings)


@pytest.mark.parametrize(("prefix", "is_first"), [(None, True), (None, False), ("CENTI", False)])
def test_units_of_two_lengths_are_refused(tmp_path, ifc_writer, prefix, is_first):
    writer = ifc_writer("IFC4", "MILLI")
    add_box(writer, writer.storeys({"Low": 0.0}, (0, 0, 0))["Low"])
    own = list(writer.project.UnitsInContext.Units)
    second = [writer.model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Prefix=prefix, Name="METRE")]
    writer.project.UnitsInContext.Units = second + own if is_first else own + second
    writer.model.write(str(tmp_path / "two.ifc"))
    with pytest.raises(SceneError, match=r"2 units of length, #\d+ \(\w+\) and #\d+ \(\w+\), expected one"):
        load_scene(tmp_path / "two.ifc")


def test_unit_of_length_that_stands_there_twice_counts_once(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    add_box(writer, writer.storeys({"Low": 0.0, "High": 3.0}, (0, 0, 0))["High"])
    twin = writer.model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE")
    writer.project.UnitsInContext.Units = [*writer.project.UnitsInContext.Units, twin]
    writer.model.write(str(tmp_path / "twice.ifc"))
    scene = load_scene(tmp_path / "twice.ifc")
    np.testing.assert_allclose(scene.vertices_m[:, 2].min(), scene.storeys[1].elevation_m)
    assert scene.storeys[1].elevation_m == pytest.approx(3.0)


def test_storey_without_placement_takes_its_elevation_above_the_building(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    low, high = writer.storeys({"Low": 0.0, "High": 3.0}, (0, 0, 100.0)).values()
    add_box(writer, low)
    high.ObjectPlacement = None
    writer.model.write(str(tmp_path / "unplaced.ifc"))
    scene = load_scene(tmp_path / "unplaced.ifc")
    assert [s.elevation_m for s in scene.storeys] == pytest.approx([100.0, 103.0])
    assert scene.report.warnings == ()


def test_product_without_placement_is_named_where_others_have_one(tmp_path, ifc_writer):
    writer = ifc_writer("IFC4", "MILLI")
    storey = writer.storeys({"High": 3.0}, (0, 0, 0))["High"]
    add_box(writer, storey)
    wall = writer.root("IfcWall", "Fallen", Representation=writer.shape(writer.block((1, 1, 1))))
    writer.contain(storey, wall)
    writer.model.write(str(tmp_path / "fallen.ifc"))
    (line,) = load_scene(tmp_path / "fallen.ifc").report.warnings
    assert "1 product has no placement" in line and "IfcWall Fallen" in line
    for product in writer.model.by_type("IfcElement"):
        product.ObjectPlacement = None
    writer.model.write(str(tmp_path / "world.ifc"))
    assert load_scene(tmp_path / "world.ifc").report.warnings == ()


def test_usd_stage_without_metrics_says_what_is_assumed_where_nobody_told_it(tmp_path):
    path = tmp_path / "bare.usda"
    path.write_text(
        """#usda 1.0
def Mesh "hall" {
int[] faceVertexCounts = [3]
int[] faceVertexIndices = [0, 1, 2]
point3f[] points = [(0, 0, 0), (900, 0, 0), (0, 0, 900)]
}
"""
    )
    assert [w.split(", is assumed")[1] for w in load_scene(path).report.warnings if "is assumed" in w] == [
        "; pass --units if that is wrong.",
        "; pass --up z if that is wrong.",
    ]
    told = load_scene(path, options=LoadOptions(metres_per_unit=0.0254, up_axis=UpAxis.Z))
    assert not [w for w in told.report.warnings if "assumed" in w]


def add_box(writer, storey):
    box = writer.root(
        "IfcBuildingElementProxy",
        "Box",
        ObjectPlacement=writer.placement(above=storey),
        Representation=writer.shape(writer.block((2, 2, 2))),
    )
    writer.contain(storey, box)


# ----------------------------------------------------------------------------------------- real buildings
@pytest.mark.slow
def test_duplex_has_its_storeys_elements_and_size(real_scene):
    scene = real_scene("duplex")
    assert scene.source.schema == "IFC2X3"
    assert [(s.name, round(s.elevation_m, 3)) for s in scene.storeys] == [
        ("T/FDN", -1.25),
        ("Level 1", 0.0),
        ("Level 2", 3.1),
        ("Roof", 6.0),
    ]
    kinds = [e.kind for e in scene.elements]
    assert kinds.count("IfcWallStandardCase") == 56
    assert kinds.count("IfcWindow") == 24
    assert kinds.count("IfcDoor") == 14
    assert kinds.count("IfcSlab") == 21
    assert not {"IfcSpace", "IfcOpeningElement"} & set(kinds)
    assert all(e.storey >= 0 for e in scene.elements)
    np.testing.assert_allclose(np.ptp(scene.vertices_m, axis=0), (9.3, 26.6, 8.2), atol=0.1)
    assert scene.report.warnings == ()


@pytest.mark.slow
def test_fzk_haus_has_its_storeys_elements_and_size(real_scene):
    scene = real_scene("fzk-haus")
    assert scene.source.schema == "IFC4"
    assert [(s.name, round(s.elevation_m, 3)) for s in scene.storeys] == [("Erdgeschoss", 0.0), ("Dachgeschoss", 2.7)]
    kinds = [e.kind for e in scene.elements]
    assert kinds.count("IfcWallStandardCase") == 13
    assert kinds.count("IfcWindow") == 11
    assert kinds.count("IfcDoor") == 5
    assert [e.name for e in scene.elements if e.storey < 0] == [e.name for e in scene.elements if e.kind == "IfcSite"]
    assert scene.vertices_m[:, 2].max() == pytest.approx(6.32, abs=0.01)


@pytest.mark.slow
def test_real_building_is_the_same_bytes_on_any_number_of_threads(real_ifc, monkeypatch):
    path = real_ifc("duplex.ifc")
    scenes = []
    for n_threads in (1, 4):
        monkeypatch.setattr("os.cpu_count", lambda n=n_threads: n)
        scenes.append(load_scene(path))
    assert scenes[0].vertices_m.tobytes() == scenes[1].vertices_m.tobytes()
    assert scenes[0].triangles.tobytes() == scenes[1].triangles.tobytes()
    assert scenes[0].elements == scenes[1].elements
