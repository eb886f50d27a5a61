"""Small buildings with known geometry, and writers that put them into every format that `load_scene` reads."""

from __future__ import annotations

import struct
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BOX_TRIANGLES = np.array(
    [
        [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
        [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
    ]
)  # fmt: skip
"""Twelve triangles of a box, counter-clockwise from outside; corners 0-3 below, 4-7 above, counter-clockwise."""


def box_corners(low, high):
    (a, b, c), (d, e, f) = low, high
    return np.array(
        [[a, b, c], [d, b, c], [d, e, c], [a, e, c], [a, b, f], [d, b, f], [d, e, f], [a, e, f]], dtype=np.float64
    )


@dataclass(frozen=True)
class House:
    """Boxes by name; metres, z up. All coordinates are multiples of 1/8, which float32 holds exactly."""

    boxes: dict[str, np.ndarray]

    @property
    def vertices(self) -> np.ndarray:
        return np.concatenate(list(self.boxes.values()))

    @property
    def triangles(self) -> np.ndarray:
        return np.concatenate([BOX_TRIANGLES + 8 * i for i in range(len(self.boxes))])

    @property
    def element(self) -> np.ndarray:
        return np.repeat(np.arange(len(self.boxes)), 12)


@pytest.fixture(scope="session")
def house() -> House:
    return House(
        {
            "Slab": box_corners((0, 0, -0.25), (8, 6, 0)),
            "Wall": box_corners((0, 0, 0), (8, 0.25, 2.75)),
            "Pier": box_corners((3, 2, 0), (3.5, 2.5, 2.75)),
            "Roof": box_corners((0, 0, 2.75), (8, 6, 3)),
        }
    )


def _triangle_set(vertices, triangles) -> np.ndarray:
    """(T, 9): triangles as a sorted list of sorted corners, rounded to 1e-6: equal for equal surfaces."""
    corners = np.round(np.asarray(vertices)[np.asarray(triangles)], 6) + 0.0
    rows = [np.array(sorted(map(tuple, triangle))).ravel() for triangle in corners]
    return np.array(sorted(map(tuple, rows)))


@pytest.fixture(scope="session")
def triangle_set() -> Callable[..., np.ndarray]:
    return _triangle_set


def _volumes(scene) -> np.ndarray:
    """(E,) signed volume of each element: positive where triangles run counter-clockwise seen from outside."""
    a, b, c = (scene.vertices_m[scene.triangles[:, i]] for i in range(3))
    six = (np.cross(a, b) * c).sum(axis=1)
    return np.bincount(scene.element_of_triangle, weights=six, minlength=len(scene.elements)) / 6


@pytest.fixture(scope="session")
def volumes() -> Callable[..., np.ndarray]:
    return _volumes


# ------------------------------------------------------------------------------------------ mesh formats
def obj_text(house: House) -> str:
    lines = []
    first = 1
    for name, corners in house.boxes.items():
        lines.append(f"o {name}")
        lines += ["v {!r} {!r} {!r}".format(*map(float, p)) for p in corners]
        lines += ["f {} {} {}".format(*(t + first)) for t in BOX_TRIANGLES]
        first += 8
    return "\n".join(lines) + "\n"


def stl_bytes(house: House) -> bytes:
    corners = house.vertices[house.triangles].astype("<f4")
    records = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    records["v"] = corners
    return b"house".ljust(80, b"\0") + struct.pack("<I", len(corners)) + records.tobytes()


def stl_text(house: House) -> str:
    lines = []
    for name, corners in house.boxes.items():
        lines.append(f"solid {name}")
        for triangle in corners[BOX_TRIANGLES]:
            lines.append("facet normal 0 0 0\n outer loop")
            lines += ["  vertex {!r} {!r} {!r}".format(*map(float, p)) for p in triangle]
            lines.append(" endloop\nendfacet")
        lines.append(f"endsolid {name}")
    return "\n".join(lines) + "\n"


def ply_bytes(house: House, order: str = "<") -> bytes:
    names = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}
    head = (
        f"ply\nformat {names[order]} 1.0\ncomment made for a test\nelement vertex {len(house.vertices)}\n"
        "property double x\nproperty double y\nproperty double z\nproperty uchar red\n"
        f"element face {len(house.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if not order:
        rows = ["{!r} {!r} {!r} 7".format(*map(float, p)) for p in house.vertices]
        rows += ["3 {} {} {}".format(*t) for t in house.triangles]
        return (head + "\n".join(rows) + "\n").encode()
    points = b"".join(struct.pack(order + "dddB", *p, 7) for p in house.vertices)
    faces = b"".join(struct.pack(order + "Biii", 3, *t) for t in house.triangles)
    return head.encode() + points + faces


def write_glb(house: House, path: Path) -> None:
    """Y up as glTF is, one node a box."""
    import trimesh

    scene = trimesh.Scene()
    for name, p in house.boxes.items():
        turned = np.stack([p[:, 0], p[:, 2], -p[:, 1]], axis=1)
        mesh = trimesh.Trimesh(turned, BOX_TRIANGLES, process=False)
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    scene.export(path)


def write_usd(house: House, path: Path) -> None:
    """Y up and in centimetres; the first box is an instanced reference to another layer, the others are meshes."""
    from pxr import Gf, Usd, UsdGeom

    def define(stage, prim_path, p):
        mesh = UsdGeom.Mesh.Define(stage, prim_path)
        mesh.CreatePointsAttr([Gf.Vec3f(100 * x, 100 * z, -100 * y) for x, y, z in p.tolist()])
        mesh.CreateFaceVertexCountsAttr([3] * 12)
        mesh.CreateFaceVertexIndicesAttr(BOX_TRIANGLES.ravel().tolist())

    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    library_path = path.with_name("library.usdc")
    library = Usd.Stage.CreateNew(str(library_path))
    library.SetDefaultPrim(UsdGeom.Xform.Define(library, "/Part").GetPrim())
    for i, (name, p) in enumerate(house.boxes.items()):
        if i:
            define(stage, f"/House/{name}", p)
            continue
        define(library, "/Part/mesh", p - [1, 2, 3])
        holder = UsdGeom.Xform.Define(stage, f"/House/{name}")
        holder.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(100, 300, -200))
        holder.GetPrim().GetReferences().AddReference(f"./{library_path.name}")
        holder.GetPrim().SetInstanceable(True)
    library.Save()
    stage.Save()


# --------------------------------------------------------------------------------------------------- IFC
class IfcWriter:
    """A model in the making. Lengths go in as metres and are written in the project's unit."""

    def __init__(self, schema: str, prefix: str | None):
        import ifcopenshell

        self.model = ifcopenshell.file(schema=schema)
        self.per_metre = {"MILLI": 1000.0, None: 1.0, "CENTI": 100.0}[prefix]
        unit = self.model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Prefix=prefix, Name="METRE")
        units = self.model.create_entity("IfcUnitAssignment", Units=[unit])
        self.context = self.model.create_entity(
            "IfcGeometricRepresentationContext",
            ContextType="Model",
            CoordinateSpaceDimension=3,
            Precision=1e-5 * self.per_metre,
            WorldCoordinateSystem=self.axes((0, 0, 0)),
        )
        self.project = self.root("IfcProject", "Test", RepresentationContexts=[self.context], UnitsInContext=units)

    def root(self, ifc_class: str, name: str, **attributes: Any) -> Any:
        import ifcopenshell.guid

        number = len(self.model.by_type("IfcRoot"))
        guid = ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_OID, f"{number} {name}").hex)
        return self.model.create_entity(ifc_class, GlobalId=guid, Name=name, **attributes)

    def point(self, *xyz: float) -> Any:
        return self.model.create_entity("IfcCartesianPoint", Coordinates=[float(v * self.per_metre) for v in xyz])

    def direction(self, *xyz: float) -> Any:
        return self.model.create_entity("IfcDirection", DirectionRatios=[float(v) for v in xyz])

    def axes(self, origin, x=(1, 0, 0)) -> Any:
        return self.model.create_entity(
            "IfcAxis2Placement3D",
            Location=self.point(*origin),
            Axis=self.direction(0, 0, 1),
            RefDirection=self.direction(*x),
        )

    def placement(self, origin=(0, 0, 0), *, above: Any = None, x=(1, 0, 0)) -> Any:
        return self.model.create_entity(
            "IfcLocalPlacement",
            PlacementRelTo=above.ObjectPlacement if above is not None else None,
            RelativePlacement=self.axes(origin, x),
        )

    def block(self, size) -> Any:
        """An extruded rectangle from the origin to `size`."""
        width, depth, height = size
        centre = self.model.create_entity("IfcAxis2Placement2D", Location=self.point(width / 2, depth / 2))
        profile = self.model.create_entity(
            "IfcRectangleProfileDef",
            ProfileType="AREA",
            Position=centre,
            XDim=width * self.per_metre,
            YDim=depth * self.per_metre,
        )
        return self.model.create_entity(
            "IfcExtrudedAreaSolid",
            SweptArea=profile,
            Position=self.axes((0, 0, 0)),
            ExtrudedDirection=self.direction(0, 0, 1),
            Depth=height * self.per_metre,
        )

    def brep(self, corners, triangles) -> Any:
        points = [self.point(*p) for p in corners.tolist()]
        faces = []
        for triangle in triangles.tolist():
            loop = self.model.create_entity("IfcPolyLoop", Polygon=[points[i] for i in triangle])
            bound = self.model.create_entity("IfcFaceOuterBound", Bound=loop, Orientation=True)
            faces.append(self.model.create_entity("IfcFace", Bounds=[bound]))
        shell = self.model.create_entity("IfcClosedShell", CfsFaces=faces)
        return self.model.create_entity("IfcFacetedBrep", Outer=shell)

    def shape(self, item: Any, kind: str = "SweptSolid") -> Any:
        body = self.body(item, kind)
        return self.model.create_entity("IfcProductDefinitionShape", Representations=[body])

    def body(self, item: Any, kind: str) -> Any:
        return self.model.create_entity(
            "IfcShapeRepresentation",
            ContextOfItems=self.context,
            RepresentationIdentifier="Body",
            RepresentationType=kind,
            Items=[item],
        )

    def relate(self, ifc_class: str, **attributes: Any) -> None:
        self.root(ifc_class, ifc_class, **attributes)

    def storeys(self, levels: dict[str, float], origin) -> dict[str, Any]:
        """Site at `origin`, a building, and storeys at the given heights (metres) above it."""
        site = self.root("IfcSite", "Site", ObjectPlacement=self.placement(origin))
        building = self.root("IfcBuilding", "Building", ObjectPlacement=self.placement(above=site))
        found = {
            name: self.root(
                "IfcBuildingStorey",
                name,
                ObjectPlacement=self.placement((0, 0, z), above=building),
                Elevation=z * self.per_metre,
            )
            for name, z in levels.items()
        }
        self.relate("IfcRelAggregates", RelatingObject=self.project, RelatedObjects=[site])
        self.relate("IfcRelAggregates", RelatingObject=site, RelatedObjects=[building])
        self.relate("IfcRelAggregates", RelatingObject=building, RelatedObjects=list(found.values()))
        return found

    def contain(self, storey: Any, *products: Any) -> None:
        self.relate("IfcRelContainedInSpatialStructure", RelatingStructure=storey, RelatedElements=list(products))


def write_ifc_house(house: House, path: Path, *, schema: str) -> None:
    """The boxes of the house as triangulated breps in millimetres."""
    writer = IfcWriter(schema, "MILLI")
    ground = writer.storeys({"Ground": 0.0}, (0, 0, 0))["Ground"]
    products = [
        writer.root(
            "IfcBuildingElementProxy",
            name,
            ObjectPlacement=writer.placement(above=ground),
            Representation=writer.shape(writer.brep(corners, BOX_TRIANGLES), "Brep"),
        )
        for name, corners in house.boxes.items()
    ]
    writer.contain(ground, *products)
    writer.model.write(str(path))


def write_ifc_building(
    path: Path, *, schema: str = "IFC4", prefix: str | None = "MILLI", origin=(0.0, 0.0, 0.0)
) -> None:
    """Two storeys (0 and 3 m) with all that a loader meets: see the calls below."""
    writer = IfcWriter(schema, prefix)
    ground, upper = writer.storeys({"Upper": 3.0, "Ground": 0.0}, origin).values()
    ground, upper = upper, ground  # the file names the upper one first

    def product(ifc_class, name, size, at, storey, item=None, kind="SweptSolid", x=(1, 0, 0)):
        return writer.root(
            ifc_class,
            name,
            ObjectPlacement=writer.placement(at, above=storey, x=x),
            Representation=writer.shape(item or writer.block(size), kind),
        )

    slabs = [product("IfcSlab", f"Slab {s.Name}", (8, 6, 0.25), (0, 0, -0.25), s) for s in (ground, upper)]
    wall = product("IfcWall", "Wall", (8, 0.25, 2.5), (0, 0, 0), ground)
    opening = product("IfcOpeningElement", "Hole", (1, 0.5, 2), (2, -0.125, 0), ground)
    door = product("IfcDoor", "Door", (1, 0.0625, 2), (2, 0.125, 0), ground)
    writer.relate("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=opening)
    writer.relate("IfcRelFillsElement", RelatingOpeningElement=opening, RelatedBuildingElement=door)
    space = product("IfcSpace", "Room", (7, 5, 2.5), (0.5, 0.5, 0), ground)
    writer.relate("IfcRelAggregates", RelatingObject=ground, RelatedObjects=[space])
    cupboard = writer.model.create_entity(
        "IfcRepresentationMap",
        MappingOrigin=writer.axes((0, 0, 0)),
        MappedRepresentation=writer.body(writer.block((1, 0.5, 2)), "SweptSolid"),
    )
    furniture = [
        product(
            "IfcFurnishingElement", name, None, at, storey, _mapped(writer, cupboard, sign), "MappedRepresentation", x
        )
        for name, at, storey, sign, x in (
            ("Cupboard A", (1, 3, 0), ground, 1, (1, 0, 0)),
            ("Cupboard B", (5, 3, 0), ground, 1, (0, 1, 0)),  # turned
            ("Cupboard C", (7, 3, 0), upper, -1, (1, 0, 0)),  # mirrored
        )
    ]
    stair = writer.root("IfcStair", "Stair", ObjectPlacement=writer.placement(above=ground))
    flight = product("IfcStairFlight", "Flight", (1, 3, 0.5), (6, 2, 0), ground)
    writer.relate("IfcRelAggregates", RelatingObject=stair, RelatedObjects=[flight])
    hollow = writer.root("IfcWall", "No shape", ObjectPlacement=writer.placement(above=ground))
    writer.contain(ground, slabs[0], wall, furniture[0], furniture[1], stair, hollow)
    writer.contain(upper, slabs[1], furniture[2])
    writer.model.write(str(path))


def _mapped(writer: IfcWriter, source: Any, x_sign: float) -> Any:
    """An instance of a mapped shape; `x_sign` -1 mirrors it."""
    target = writer.model.create_entity(
        "IfcCartesianTransformationOperator3D",
        Axis1=writer.direction(x_sign, 0, 0),
        Axis2=writer.direction(0, 1, 0),
        Axis3=writer.direction(0, 0, 1),
        LocalOrigin=writer.point(0, 0, 0),
        Scale=1.0,
    )
    return writer.model.create_entity("IfcMappedItem", MappingSource=source, MappingTarget=target)


# ---------------------------------------------------------------------------------------------- fixtures
@pytest.fixture(scope="session")
def write_house(house) -> Callable[[Path, str], Path]:
    """Writes the house into a folder in one of `HOUSE_FILES`' ways; returns the file."""
    writers: dict[str, Callable[[Path], Any]] = {
        "house.obj": lambda path: path.write_text(obj_text(house)),
        "binary.stl": lambda path: path.write_bytes(stl_bytes(house)),
        "text.stl": lambda path: path.write_text(stl_text(house)),
        "little.ply": lambda path: path.write_bytes(ply_bytes(house, "<")),
        "big.ply": lambda path: path.write_bytes(ply_bytes(house, ">")),
        "text.ply": lambda path: path.write_bytes(ply_bytes(house, "")),
        "house.glb": lambda path: write_glb(house, path),
        "house.usda": lambda path: write_usd(house, path),
        "house.usdc": lambda path: write_usd(house, path),
        "two.ifc": lambda path: write_ifc_house(house, path, schema="IFC2X3"),
        "four.ifc": lambda path: write_ifc_house(house, path, schema="IFC4"),
    }

    def write(folder: Path, name: str) -> Path:
        path = folder / name
        writers[name](path)
        return path

    return write


@pytest.fixture
def read_apart() -> None:
    """Native readers run in child processes, as they do in use."""


@pytest.fixture(autouse=True)
def in_this_process_unless_apart(request: pytest.FixtureRequest) -> None:
    """Native readers run in this process unless a test uses `read_apart`: a child costs more than most tests."""
    if "read_apart" not in request.fixturenames:
        request.getfixturevalue("in_this_process")


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Native readers run in this process, where a test can change them: by the test's own patches, undone in order."""
    monkeypatch.setattr("planner_core.child_process.run_isolated", _run_here)


@contextmanager
def native_readers_here() -> Iterator[None]:
    """Run native readers in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("planner_core.child_process.run_isolated", _run_here)
        yield


def _run_here(function: str, arguments: dict[str, Any], **_: Any) -> Any:
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)(**arguments)


@pytest.fixture(scope="session")
def write_building() -> Callable[..., None]:
    return write_ifc_building


@pytest.fixture(scope="session")
def ifc_writer() -> type[IfcWriter]:
    return IfcWriter


@pytest.fixture(scope="session")
def real_ifc() -> Callable[[str], Path]:
    """A real building from the shared folder; the test is skipped where it is absent."""

    def find(name: str) -> Path:
        path = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "ifc" / name
        if not path.exists():
            pytest.skip(f"{name} is not in ../shared/data/ifc")
        return path

    return find


@pytest.fixture(scope="session")
def corpus_file() -> Callable[[str], Path]:
    """A real file from the shared folder; the test is skipped where it is absent."""

    def find(name: str) -> Path:
        path = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "corpus" / name
        if not path.exists():
            pytest.skip(f"{name} is not in ../shared/data/corpus")
        return path

    return find
