"""IFC files that name no unit of length: refused early where metres can't be right, read in the user's otherwise."""

import numpy as np
import pytest
from slow_cases import all_slow_but

from planner_core.errors import SceneError
from planner_core.scene.load import LoadOptions, load_scene


def write(path, ifc_writer, schema, prefix, lost, levels=(0.0, 3.0), length_m=12.0, far_m=None):
    """Boxes at the corners of a building, in the prefix's unit; `lost` : how the file names none."""
    writer = ifc_writer(schema, prefix)
    for z, storey in zip(levels, writer.storeys({f"Level {z}": z for z in levels}, (0, 0, 0)).values(), strict=True):
        walls = [
            writer.root(
                "IfcWall",
                f"wall {z} {x} {y}",
                ObjectPlacement=writer.placement((x, y, 0), above=storey),
                Representation=writer.shape(writer.block((1, 0.3, 2.5))),
            )
            for x in (0.0, length_m)
            for y in (0.0, 8.0)
        ]
        writer.contain(storey, *walls)
    if far_m is not None:
        walls[-1].ObjectPlacement = writer.placement(far_m)
    (project,) = writer.model.by_type("IfcProject")
    radian = writer.model.create_entity("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN")
    match lost:
        case "assignment":
            project.UnitsInContext = None
        case "unit":
            project.UnitsInContext.Units = [radian]
        case "units":
            project.UnitsInContext.Units = None
    writer.model.write(str(path))
    return path


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize("lost", ["assignment", "unit", "units"])
def test_building_in_millimetres_without_a_unit_is_refused_before_its_shapes_are_made(
    tmp_path, ifc_writer, monkeypatch, schema, lost
):
    path = write(tmp_path / "lost.ifc", ifc_writer, schema, "MILLI", lost)
    monkeypatch.setattr("planner_core.scene.ifc.shapes_by", lambda *_: pytest.fail("a shape was made"))
    with pytest.raises(SceneError, match=r"placed over 12000 x 8000 x 3000 m, .*; pass its unit, such as --units mm"):
        load_scene(path)


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize("lost", ["assignment", "unit", "units"])
@pytest.mark.parametrize(
    ("prefix", "unit_m"), all_slow_but([("MILLI", 0.001)], [("MILLI", 0.001), ("CENTI", 0.01), (None, 1.0)])
)
def test_file_without_a_unit_is_read_in_that_of_the_user(tmp_path, ifc_writer, schema, lost, prefix, unit_m):
    sound = load_scene(write(tmp_path / "sound.ifc", ifc_writer, schema, prefix, ""))
    path = write(tmp_path / "lost.ifc", ifc_writer, schema, prefix, lost)
    scene = load_scene(path, options=LoadOptions(metres_per_unit=unit_m))
    np.testing.assert_allclose(scene.vertices_m, sound.vertices_m, atol=1e-9)
    assert [s.elevation_m for s in scene.storeys] == pytest.approx([s.elevation_m for s in sound.storeys])
    assert scene.report.warnings == ()
    assert scene.source.metres_per_unit == unit_m


def test_building_in_metres_without_a_unit_is_read_with_a_warning(tmp_path, ifc_writer):
    scene = load_scene(write(tmp_path / "lost.ifc", ifc_writer, "IFC4", None, "unit"))
    np.testing.assert_allclose(np.ptp(scene.vertices_m, axis=0), (13.0, 8.3, 5.5))
    assert any("names no length unit: metres are assumed" in line for line in scene.report.warnings)


def test_tunnel_without_a_unit_is_no_lost_one(tmp_path, ifc_writer):
    path = write(tmp_path / "tunnel.ifc", ifc_writer, "IFC4", None, "unit", length_m=4000.0)
    assert load_scene(path).n_triangles == 8 * 12


def test_element_far_out_does_not_make_a_lost_unit(tmp_path, ifc_writer):
    path = write(tmp_path / "house.ifc", ifc_writer, "IFC4", None, "unit", far_m=(9000.0, 9000.0, 9000.0))
    assert load_scene(path).n_triangles == 8 * 12
