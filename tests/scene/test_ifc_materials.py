"""What IFC says of glass and mirrors: styles of items, materials of products, layers, parts of shapes and types."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner_core.model import Optics, Scene
from planner_core.scene.load import load_scene

RETURNS, PASSES, STOPS = Optics.RETURNS, Optics.PASSES, Optics.STOPS
CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=np.float64)
SIDES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
"""Six quadrilaterals of the cube."""


class Windows:
    """A model of windows 5 m apart, each of a frame and two panes."""

    def __init__(self, ifc_writer: Any, schema: str = "IFC4") -> None:
        self.writer = ifc_writer(schema, "MILLI")
        self.model = self.writer.model
        self.storey = self.writer.storeys({"Ground": 0.0}, (0, 0, 0))["Ground"]
        self.n_windows = 0

    def add(self, *, as_triangles: bool = False, mapped: bool = False) -> tuple[Any, list[Any]]:
        """A window, and its three items: frame, pane, pane."""
        sizes = ((1, 0.25, 2), (0.5, 0.125, 1), (0.375, 0.0625, 1.5))
        items = [self._triangles(size) if as_triangles else self.writer.block(size) for size in sizes]
        kind = "Tessellation" if as_triangles else "SweptSolid"
        body = self.writer.body(items[0], kind)
        body.Items = items
        if mapped:
            origin = self.writer.axes((0, 0, 0))
            source = self.model.create_entity("IfcRepresentationMap", MappingOrigin=origin, MappedRepresentation=body)
            target = self.model.create_entity(
                "IfcCartesianTransformationOperator3D", LocalOrigin=self.writer.point(0, 0, 0)
            )
            item = self.model.create_entity("IfcMappedItem", MappingSource=source, MappingTarget=target)
            body = self.writer.body(item, "MappedRepresentation")
        shape = self.model.create_entity("IfcProductDefinitionShape", Representations=[body])
        placement = self.writer.placement((5 * self.n_windows, 0, 0), above=self.storey)
        window = self.writer.root("IfcWindow", f"W{self.n_windows}", ObjectPlacement=placement, Representation=shape)
        self.writer.contain(self.storey, window)
        self.n_windows += 1
        return window, items

    def _triangles(self, size: tuple[float, ...]) -> Any:
        corners = (CUBE * np.array(size) * self.writer.per_metre).tolist()
        points = self.model.create_entity("IfcCartesianPointList3D", corners)
        faces = [[a + 1, b + 1, c + 1] for s in SIDES for a, b, c in ((s[0], s[1], s[2]), (s[0], s[2], s[3]))]
        return self.model.create_entity("IfcTriangulatedFaceSet", Coordinates=points, Closed=True, CoordIndex=faces)

    def style(self, name: str, transparency: float | None = None, method: str = "NOTDEFINED") -> Any:
        colour = self.model.create_entity("IfcColourRgb", None, 0.5, 0.5, 0.5)
        rendering = self.model.create_entity(
            "IfcSurfaceStyleRendering", SurfaceColour=colour, Transparency=transparency, ReflectanceMethod=method
        )
        return self.model.create_entity("IfcSurfaceStyle", Name=name, Side="BOTH", Styles=[rendering])

    def paint(self, item: Any, style: Any) -> None:
        if self.model.schema == "IFC2X3":
            style = self.model.create_entity("IfcPresentationStyleAssignment", [style])
        self.model.create_entity("IfcStyledItem", Item=item, Styles=[style])

    def material(self, name: str, **attributes: Any) -> Any:
        return self.model.create_entity("IfcMaterial", Name=name, **attributes)

    def draw(self, material: Any, style: Any) -> None:
        """Give a material a style of its own."""
        item = self.model.create_entity("IfcStyledItem", Styles=[style])
        drawn = self.model.create_entity("IfcStyledRepresentation", ContextOfItems=self.writer.context, Items=[item])
        self.model.create_entity(
            "IfcMaterialDefinitionRepresentation", Representations=[drawn], RepresentedMaterial=material
        )

    def assign(self, material: Any, *things: Any) -> None:
        self.writer.relate("IfcRelAssociatesMaterial", RelatedObjects=list(things), RelatingMaterial=material)

    def layers(self, *materials: Any) -> Any:
        thick = [self.model.create_entity("IfcMaterialLayer", m, 4.0) for m in materials]
        return self.model.create_entity("IfcMaterialLayerSet", MaterialLayers=thick)

    def profiles(self, *materials: Any) -> Any:
        named = [self.model.create_entity("IfcMaterialProfile", Material=m) for m in materials]
        return self.model.create_entity("IfcMaterialProfileSet", MaterialProfiles=named)

    def constituents(self, **materials: Any) -> Any:
        named = [
            self.model.create_entity("IfcMaterialConstituent", Name=name, Material=m) for name, m in materials.items()
        ]
        return self.model.create_entity("IfcMaterialConstituentSet", MaterialConstituents=named)

    def aspect(self, name: str, items: list[Any], holder: Any) -> None:
        body = self.writer.body(items[0], "SweptSolid")
        body.Items = items
        self.model.create_entity(
            "IfcShapeAspect", ShapeRepresentations=[body], Name=name, PartOfProductDefinitionShape=holder
        )

    def load(self, folder: Path) -> list[list[int]]:
        """By window: what its frame does, its larger and its smaller pane; each does one thing on all its faces."""
        path = folder / "a.ifc"
        self.model.write(str(path))
        scene = load_scene(path)
        assert scene.report.warnings == ()
        told = np.zeros(scene.n_triangles, np.uint8) if scene.optics_of_triangle is None else scene.optics_of_triangle
        return [self._of_items(scene, told, element) for element in range(self.n_windows)]

    def _of_items(self, scene: Scene, told: np.ndarray, element: int) -> list[int]:
        owned = scene.element_of_triangle == element
        triangles = scene.triangles[owned]
        assert len(triangles) == 36
        corners = scene.vertices_m[triangles]
        # The items come one after another; how far each reaches in x tells which it is.
        reach = [corners[i : i + 12, :, 0].max() - 5 * element for i in (0, 12, 24)]
        assert reach == [1, 0.5, 0.375]
        return [np.unique(told[owned][i : i + 12]).item() for i in (0, 12, 24)]


@pytest.fixture(params=["swept", "triangles", "mapped"])
def how(request: pytest.FixtureRequest) -> dict[str, bool]:
    return {"as_triangles": request.param == "triangles", "mapped": request.param == "mapped"}


def test_ifc_styles_part_the_panes_of_a_window_from_its_frame(
    how: dict[str, bool], ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    _, (frame, large, small) = windows.add(**how)
    windows.paint(frame, windows.style("Kiefer", 0.0))
    windows.paint(large, windows.style("Glas"))
    windows.paint(small, windows.style("Surface 3", 0.9))
    assert windows.load(tmp_path) == [[RETURNS, PASSES, PASSES]]


def test_ifc2x3_styles_do_the_same(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer, "IFC2X3")
    _, (frame, large, small) = windows.add()
    windows.paint(frame, windows.style("Frosted glass", 0.9))
    windows.paint(large, windows.style("Surface 1", 0.9))
    windows.paint(small, windows.style("Surface 2", 0.1, "MIRROR"))
    assert windows.load(tmp_path) == [[RETURNS, PASSES, STOPS]]


@pytest.mark.parametrize(
    ("transparency", "method", "told"),
    [
        (0.5, "NOTDEFINED", PASSES), (0.4, "NOTDEFINED", RETURNS), (None, "NOTDEFINED", RETURNS),
        (None, "GLASS", PASSES), (0.0, "MIRROR", STOPS), (0.9, "METAL", PASSES),
    ],
)  # fmt: skip
def test_ifc_style_without_a_word_is_told_by_method_and_transparency(
    transparency: float | None, method: str, told: Optics, ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    _, (_, large, _) = windows.add()
    windows.paint(large, windows.style("Surface", transparency, method))
    assert windows.load(tmp_path) == [[RETURNS, told, RETURNS]]


def test_ifc_style_comes_before_the_material_of_the_product(
    how: dict[str, bool], ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    window, (frame, large, _) = windows.add(**how)
    windows.assign(windows.material("Glas"), window)
    windows.paint(frame, windows.style("Holz", 0.0))
    windows.paint(large, windows.style("Surface"))  # says nothing
    assert windows.load(tmp_path) == [[RETURNS, PASSES, PASSES]]


@pytest.mark.parametrize(
    ("name", "category", "style", "told"),
    [
        ("Verglasung", None, None, PASSES), ("M1", "glass", None, PASSES), ("Spiegel", "glass", None, STOPS),
        ("M1", "wood", None, RETURNS), ("M1", None, ("Surface", 0.8), PASSES), ("M1", None, ("Surface", 0.1), RETURNS),
        ("Glas", None, ("Surface", 0.0), PASSES),  # the material's own name decides before the figures it is drawn with
        ("Milchglas", None, ("Glass", 0.9), RETURNS),
    ],
)  # fmt: skip
def test_ifc_material_without_styles_of_items_tells_what_the_product_does(
    name: str, category: str | None, style: tuple[str, float] | None, told: Optics, ifc_writer: Any, tmp_path: Path
) -> None:
    windows = Windows(ifc_writer)
    material = windows.material(name, Category=category)
    if style is not None:
        windows.draw(material, windows.style(*style))
    windows.assign(material, windows.add()[0])
    windows.add()  # has none
    assert windows.load(tmp_path) == [[told] * 3, [RETURNS] * 3]


def test_ifc_layers_and_lists_pass_where_all_of_them_are_glass(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    glass, wood, air = (windows.material(name) for name in ("Glass", "Wood", "Air gap"))
    sets = [
        windows.layers(glass, air, glass),
        windows.layers(glass, None, glass),
        windows.layers(glass, wood),
        windows.model.create_entity("IfcMaterialLayerSetUsage", windows.layers(glass), "AXIS2", "POSITIVE", 0.0),
        windows.model.create_entity("IfcMaterialList", [glass, glass]),
        windows.model.create_entity("IfcMaterialList", [wood, glass]),
        windows.profiles(glass),
        windows.constituents(lining=glass, glazing=glass),
        windows.constituents(lining=wood, glazing=glass),
        windows.layers(air),
    ]  # fmt: skip
    for told in sets:
        windows.assign(told, windows.add()[0])
    passes = [1, 1, 0, 1, 1, 0, 1, 1, 0, 0]
    assert windows.load(tmp_path) == [[told] * 3 for told in passes]


@pytest.mark.parametrize("mapped", [False, True])
def test_ifc_shape_aspects_part_the_constituents_of_a_window(mapped: bool, ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    window, (frame, large, small) = windows.add(mapped=mapped)
    holder = window.Representation
    if mapped:
        (holder,) = windows.model.by_type("IfcRepresentationMap")
    windows.aspect("Lining", [frame], holder)
    windows.aspect("Glazing", [large], holder)
    windows.aspect("Film", [small], holder)
    wood, glass, mirror = (windows.material(name) for name in ("Wood", "Glass", "Mirror"))
    windows.assign(windows.constituents(Lining=wood, Glazing=glass, Film=mirror), window)
    assert windows.load(tmp_path) == [[RETURNS, PASSES, STOPS]]
    windows.paint(large, windows.style("Milk glass"))  # a style comes before a constituent
    assert windows.load(tmp_path) == [[RETURNS, RETURNS, STOPS]]


def test_ifc_material_of_the_type_holds_where_the_product_has_none(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    first, second = windows.add()[0], windows.add()[0]
    window_type = windows.writer.root("IfcWindowType", "T", PredefinedType="WINDOW", PartitioningType="SINGLE_PANEL")
    windows.writer.relate("IfcRelDefinesByType", RelatedObjects=[first, second], RelatingType=window_type)
    windows.assign(windows.material("Glass"), window_type)
    windows.assign(windows.material("Wood"), second)
    assert windows.load(tmp_path) == [[PASSES] * 3, [RETURNS] * 3]


def test_ifc_materials_that_are_damaged_leave_the_shapes_and_a_warning(ifc_writer: Any, tmp_path: Path) -> None:
    windows = Windows(ifc_writer)
    material = windows.material("Glass")
    windows.draw(material, windows.style("Glass", 0.9))
    windows.assign(material, windows.add()[0])
    path = tmp_path / "a.ifc"
    windows.model.write(str(path))
    text = path.read_text()
    path.write_text(re.sub(r"(IFCSTYLEDREPRESENTATION\(#\d+,\$,\$,\()#\d+", r"\1#1", text))  # items that are no items
    scene = load_scene(path)
    assert scene.n_triangles == 36 and scene.optics_of_triangle is None
    (warning,) = scene.report.warnings
    assert warning.startswith(
        "a.ifc: its materials can't be read, so all surfaces return beams: its contents do not follow IFC4"
    )
