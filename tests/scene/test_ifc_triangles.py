"""IFC face sets take a short cut to triangles: it changes no surface, and what is odd does not take it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.root
import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import Scene
from planner_core.scene import ifc
from planner_core.scene.load import load_scene
from scenes_synthetic import furniture
from scenes_synthetic.building import Opening, slab, wall
from scenes_synthetic.model import Level, Part, assemble
from scenes_synthetic.solids import place

TABLE, SINK = "Table", "Kitchen counter"
WALLS = ("Floor", "Wall")


@pytest.fixture(scope="module")
def room_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor, a wall with a doorway, and two pieces of furniture, turned and placed."""
    parts = [
        slab("Floor", 0, (0.0, 0.0, -0.2), (4.0, 3.0, 0.0), lowest=True),
        wall("Wall", 0, (0.0, 3.0, 0.0), (4.0, 3.2, 2.7), [Opening("Doorway", 2.5, 1.0, 2.1)]),
        Part(TABLE, "IfcFurniture", 0, place(furniture.table(1.2, 0.8), (1.0, 1.0, 0.0))),
        Part(SINK, "IfcFurniture", 0, place(furniture.kitchen_counter(2.4), (2.0, 2.0, 0.0), turn_deg=33.0)),
    ]
    room = assemble(
        "furnished", levels=[Level("Ground", 0.0)], rooms=[], parts=parts, extents_m=[(0, 0, -0.2), (4, 3.2, 2.7)]
    )
    return scenes_synthetic.write(room, tmp_path_factory.mktemp("ifc") / "room.ifc")


@pytest.fixture
def kernels(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[str]]:
    """Names of the products that each of IfcOpenShell's kernels was asked for."""
    asked: dict[str, list[str]] = {}
    original = ifc.shapes_by

    def recorded(kernel: str, path: Path, model: Any, entities: list[Any], *rest: Any) -> Any:
        asked.setdefault(kernel, []).extend(str(entity.Name) for entity in entities)
        return original(kernel, path, model, entities, *rest)

    monkeypatch.setattr(ifc, "shapes_by", recorded)
    return asked


def areas_m2(scene: Scene) -> dict[str, float]:
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    sums = np.bincount(scene.element_of_triangle, weights=area, minlength=len(scene.elements))
    return dict(zip((element.name for element in scene.elements), sums.tolist(), strict=True))


def altered(path: Path, target: Path, name: str, change: Callable[[Any, Any], None]) -> Path:
    """Write a copy of a file in which one product was changed."""
    model = ifcopenshell.open(str(path))
    (product,) = (p for p in model.by_type("IfcElement") if p.Name == name)
    change(model, product)
    model.write(str(target))
    return target


def face_set(model: Any, points: list[list[float]], corners: list[list[int]], **more: Any) -> Any:
    listed = model.create_entity("IfcCartesianPointList3D", points)
    return model.create_entity("IfcTriangulatedFaceSet", Coordinates=listed, CoordIndex=corners, **more)


SQUARE = [[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0], [1000.0, 1000.0, 0.0], [0.0, 1000.0, 0.0]]


def test_short_cut_gives_the_same_surface_as_solids_do(
    room_path: Path,
    kernels: dict[str, list[str]],
    triangle_set: Callable[..., np.ndarray],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    short = load_scene(room_path)
    assert kernels == {"cgal-simple": [TABLE, SINK], "opencascade": list(WALLS)}
    monkeypatch.setattr(ifc, "_is_triangles", lambda product: False)
    kernels.clear()
    long = load_scene(room_path)
    assert kernels["cgal-simple"] == []
    assert [e.name for e in short.elements] == [e.name for e in long.elements]
    np.testing.assert_allclose(
        triangle_set(short.vertices_m, short.triangles), triangle_set(long.vertices_m, long.triangles), atol=2e-6
    )


def test_faces_look_outwards_after_the_short_cut(room_path: Path, volumes: Callable[[Scene], np.ndarray]) -> None:
    assert (volumes(load_scene(room_path)) > 0).all()


def test_openings_of_triangulated_products_are_cut_out(
    room_path: Path, kernels: dict[str, list[str]], tmp_path: Path
) -> None:
    def pierced(model: Any, table: Any) -> None:
        opening = ifcopenshell.api.root.create_entity(model, ifc_class="IfcOpeningElement", name="Hole")
        (body,) = (c for c in model.by_type("IfcGeometricRepresentationSubContext"))
        middle = model.create_entity("IfcAxis2Placement2D", model.create_entity("IfcCartesianPoint", [600.0, 400.0]))
        profile = model.create_entity("IfcRectangleProfileDef", "AREA", None, middle, 200.0, 100.0)
        foot = model.create_entity("IfcAxis2Placement3D", model.create_entity("IfcCartesianPoint", [0.0, 0.0, -50.0]))
        up = model.create_entity("IfcDirection", [0.0, 0.0, 1.0])
        solid = model.create_entity("IfcExtrudedAreaSolid", profile, foot, up, 2000.0)
        shape = model.create_entity("IfcShapeRepresentation", body, "Body", "SweptSolid", [solid])
        ifcopenshell.api.geometry.assign_representation(model, product=opening, representation=shape)
        opening.ObjectPlacement = table.ObjectPlacement
        ifcopenshell.api.feature.add_feature(model, feature=opening, element=table)

    before = areas_m2(load_scene(room_path))[TABLE]
    kernels.clear()
    after = areas_m2(load_scene(altered(room_path, tmp_path / "holed.ifc", TABLE, pierced)))[TABLE]
    assert TABLE in kernels["opencascade"]
    assert TABLE not in kernels["cgal-simple"]
    # The hole of 0.2 x 0.1 m goes through the top, which is 0.04 m thick: two faces less, four reveals more.
    assert after - before == pytest.approx(0.6 * 0.04 - 2 * 0.02, abs=1e-6)


def test_parts_of_a_whole_with_openings_do_not_take_the_short_cut(
    room_path: Path, kernels: dict[str, list[str]], tmp_path: Path
) -> None:
    def assembled(model: Any, table: Any) -> None:
        whole = ifcopenshell.api.root.create_entity(model, ifc_class="IfcElementAssembly", name="Set")
        opening = ifcopenshell.api.root.create_entity(model, ifc_class="IfcOpeningElement", name="Hole")
        ifcopenshell.api.feature.add_feature(model, feature=opening, element=whole)
        ifcopenshell.api.aggregate.assign_object(model, products=[table], relating_object=whole)

    load_scene(altered(room_path, tmp_path / "assembled.ifc", TABLE, assembled))
    assert kernels["cgal-simple"] == [SINK]
    assert TABLE in kernels["opencascade"]


@pytest.mark.parametrize(
    ("corners", "area_m2"),
    [
        ([[1, 2, 3], [1, 3, 4]], 1.0),
        ([[1, 2, 3], [1, 1, 3], [1, 3, 4]], 1.0),
        ([[1, 2, 3], [4, 3, 1]], 1.0),
        ([[1, 2, 3], [1, 2, 3], [1, 3, 4]], 1.0),
    ],
)
def test_faces_that_repeat_turn_or_collapse_leave_the_surface_that_is_there(
    room_path: Path, tmp_path: Path, corners: list[list[int]], area_m2: float
) -> None:
    def replaced(model: Any, table: Any) -> None:
        table.Representation.Representations[0].Items = [face_set(model, SQUARE, corners)]

    path = altered(room_path, tmp_path / "odd.ifc", TABLE, replaced)
    assert areas_m2(load_scene(path))[TABLE] == pytest.approx(area_m2)


def test_face_set_that_names_missing_vertices_is_told_by_name(room_path: Path, tmp_path: Path) -> None:
    def replaced(model: Any, table: Any) -> None:
        table.Representation.Representations[0].Items = [face_set(model, SQUARE, [[1, 2, 3], [1, 3, 9]])]

    scene = load_scene(altered(room_path, tmp_path / "missing.ifc", TABLE, replaced))
    assert TABLE not in areas_m2(scene)
    assert any(TABLE in warning for warning in scene.report.warnings)


def test_mapped_face_sets_are_placed_once_an_instance(
    room_path: Path, kernels: dict[str, list[str]], tmp_path: Path
) -> None:
    def mapped(model: Any, table: Any) -> None:
        shape = table.Representation.Representations[0]
        zero = model.create_entity("IfcCartesianPoint", [0.0, 0.0, 0.0])
        inner = model.create_entity(
            "IfcShapeRepresentation", shape.ContextOfItems, "Body", "Tessellation",
            [face_set(model, SQUARE, [[1, 2, 3], [1, 3, 4]])],
        )  # fmt: skip
        source = model.create_entity("IfcRepresentationMap", model.create_entity("IfcAxis2Placement3D", zero), inner)
        places = [model.create_entity("IfcCartesianPoint", [0.0, 0.0, z]) for z in (0.0, 500.0)]
        ways = [model.create_entity("IfcCartesianTransformationOperator3D", None, None, at, 1.0) for at in places]
        shape.Items = [model.create_entity("IfcMappedItem", source, way) for way in ways]
        shape.RepresentationType = "MappedRepresentation"

    scene = load_scene(altered(room_path, tmp_path / "mapped.ifc", TABLE, mapped))
    assert TABLE in kernels["cgal-simple"]
    assert areas_m2(scene)[TABLE] == pytest.approx(2.0)
