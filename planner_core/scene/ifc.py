"""IFC (2X3, 4, 4X3) -> `RawScene`: the surfaces of all physical products, with names, classes, GlobalIds and storeys.

Geometry comes from IfcOpenShell: openings are cut out of their hosts, mapped (instanced) geometry is placed once an
instance. Spaces, openings, grids, annotations and other things that no beam can meet are left out.

IfcOpenShell gives each shape in its own frame, with a float64 placement in metres. We place the vertices ourselves, in
float64: far site placements lose nothing, and equal local vertices stay equal bit by bit.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import MissingPackageError, SceneError
from planner_core.model import Element, FloatArray, Georeference, Int64Array, LoadReport, Room, UInt8Array
from planner_core.progress import Progress, ProgressEvent
from planner_core.scene.ifc_georeference import told_georeference
from planner_core.scene.ifc_materials import IfcOptics, told_optics
from planner_core.scene.ifc_spaces import rooms_of, without_shape
from planner_core.scene.ifc_storeys import storey_of, storeys_of, told_storeys
from planner_core.scene.ifc_text import lost_ends, read_text, with_ascii_names
from planner_core.scene.raw import Parts, RawScene, placed, turned_over
from planner_core.scene.wording import grouped

_NOT_PHYSICAL = (
    "IfcFeatureElementSubtraction",  # openings, recesses
    "IfcVirtualElement",
    "IfcAnnotation",
    "IfcGrid",
    "IfcPositioningElement",
    "IfcPort",
    "IfcStructuralActivity",
    "IfcStructuralItem",
    "IfcSpace",
    "IfcSpatialZone",
    "IfcExternalSpatialElement",
)
"""Classes (with their subclasses) that have a shape and no surface. A schema may lack some of them."""

_NO_BEAM_NO_CUT = tuple(name for name in _NOT_PHYSICAL if name not in ("IfcFeatureElementSubtraction", "IfcSpace"))
"""Classes whose shapes are never made: openings are cut out, and rooms are named."""

_CLOSED_SHARE = 1e-6
"""Share of its area by which the faces of a closed shape may fail to add up: OpenCASCADE rounds corners to 1e-7."""

_SOLID_KERNEL, _FACES_KERNEL = "opencascade", "cgal-simple"
"""IfcOpenShell's kernels. The first makes a topological face of every triangle, at twenty times the cost of the second;
the second refuses polygons that touch themselves and subtracts no openings."""


@dataclass(frozen=True)
class _Shapes:
    """Triangulated products, in the order of their file ids. vertices : (V, 3) metres; owner : (T,) into products."""

    vertices: FloatArray
    triangles: Int64Array
    owner: Int64Array
    face: Int64Array
    optics: UInt8Array | None
    products: list[_ToldProduct]


@dataclass(frozen=True)
class _Shape:
    """One of a product's shapes. vertices : (V, 3) metres. optics : (T,), None where all faces return."""

    vertices: FloatArray
    triangles: Int64Array
    optics: UInt8Array | None

    @property
    def key(self) -> tuple[bytes, bytes, bytes]:
        """What shapes are ordered by."""
        return self.vertices.tobytes(), self.triangles.tobytes(), b"" if self.optics is None else self.optics.tobytes()


def read_ifc(path: Path, *, progress: Progress) -> RawScene:
    """Read an IFC file.

    Raises
    ------
    SceneError
        Not an IFC file, cut off, of an unknown schema, or without geometry.
    MissingPackageError
        IfcOpenShell is not installed.
    """
    model, text, code_page = _opened(path)
    lost_warnings = _lost_ends(path, model, text)
    with _contents_asked(path, model):
        unit_m, unit_name = _length_unit(model)
        storeys_told = told_storeys(_of_class(model, "IfcBuildingStorey"))
        told_products = _told_products(model, {told.id: i for i, told in enumerate(storeys_told)})
        n_elements = len(_of_class(model, "IfcElement"))
    optics, optics_warnings = _optics(path, model)
    shapes, shape_warnings = _triangulate_products(path, model, told_products, n_elements, optics, progress)
    storeys, storey_warnings = storeys_of(path, storeys_told, unit_m)
    rooms, room_warnings = _rooms(path, model, {told.id: i for i, told in enumerate(storeys_told)})
    georeference, map_warnings = _georeference(path, model, unit_m)
    warnings = (
        *lost_warnings,
        *_code_page(path, code_page),
        *_no_unit(path, unit_name),
        *optics_warnings,
        *shape_warnings,
        *storey_warnings,
        *room_warnings,
        *map_warnings,
    )
    return RawScene(
        vertices=shapes.vertices,
        triangles=shapes.triangles,
        element_of_triangle=shapes.owner,
        face_of_triangle=shapes.face,
        optics_of_triangle=shapes.optics,
        elements=tuple(product.element for product in shapes.products),
        storeys=storeys,
        unit_name=unit_name or "metre",
        metres_per_unit=unit_m,
        vertex_unit_m=1.0,
        up_axis="Z",
        schema=str(model.schema_identifier),
        report=LoadReport(n_faces_read=0, warnings=warnings),
        rooms=rooms,
        georeference=georeference,
    )


# ------------------------------------------------------------------------------------------------- file
def open_model(path: Path) -> Any:
    """IfcOpenShell's model of an IFC file, packed or not, with its names readable.

    Raises
    ------
    SceneError
        Not an IFC file, cut off, or of an unknown schema.
    MissingPackageError
        IfcOpenShell is not installed.
    """
    return _opened(path)[0]


def _opened(path: Path) -> tuple[Any, bytes, str]:
    """The model, the file's own text, and a phrase that is the code page of its names where that is not ASCII."""
    text, is_unpacked = read_text(path)
    ascii_text, code_page = with_ascii_names(text)
    return _open(path, ascii_text if code_page or is_unpacked else None), text, code_page


def _open(path: Path, text: bytes | None) -> Any:
    """IfcOpenShell's model of a file; of `text`, where that is made of the file's."""
    try:
        import ifcopenshell
    except ImportError as error:
        raise MissingPackageError(
            f"{path.name}: reading IFC needs the package ifcopenshell, which is missing; run pip install ifcopenshell."
        ) from error
    try:
        with TemporaryDirectory() as folder:
            source = path
            if text is not None:
                source = Path(folder, "model.ifc")
                source.write_bytes(text)
            model = ifcopenshell.open(source, ".ifc")
    except (ifcopenshell.Error, ifcopenshell.SchemaError, OSError, RuntimeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(
            f"{path.name}: IfcOpenShell can't read it ({reason}), expected IFC2X3, IFC4 or IFC4X3; export it again."
        ) from error
    # Some programs write * (derived) for an empty name, at which IfcOpenShell's geometry gives up the product.
    for product in _of_class(model, "IfcProduct"):
        if product.Name is None:
            product.Name = None
    return model


def _lost_ends(path: Path, model: Any, text: bytes) -> tuple[str, ...]:
    """A line about references to what is not there; refused where a shape needs it, which would end the process."""
    no_shape = {entity.id() for name in _NO_BEAM_NO_CUT for entity in _of_class(model, name)}
    products = {int(product.id()) for product in _of_class(model, "IfcProduct")} - no_shape
    needed, others = lost_ends(text, products)
    if needed:
        raise SceneError(f"{path.name}: {needed[0]}, which is not in the file; it is damaged, copy or export it again.")
    if not others:
        return ()
    several = f"{grouped(len(others))} references lead" if len(others) > 1 else "a reference leads"
    return (f"{path.name}: {several} to what is not in the file ({others[0]}), of which no shape is made: ignored.",)


@contextmanager
def _contents_asked(path: Path, model: Any) -> Iterator[None]:
    """Around code that does nothing but ask IfcOpenShell: its ways to fail become faults of the file.

    Entities of wrong types in a file have the wrong attributes, and IfcOpenShell then raises whatever happens. What we
    do with the answers stays outside, so that our own bugs are not taken for faults of the file.
    """
    try:
        yield
    except (RuntimeError, AttributeError, TypeError, ValueError, IndexError, KeyError, AssertionError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(
            f"{path.name}: its contents do not follow {model.schema_identifier} ({reason}); "
            "check it with an IFC validator and export it again."
        ) from error


# --------------------------------------------------------------------------------------- what the file says
@dataclass(frozen=True)
class _ToldProduct:
    """A product with a representation and a surface."""

    id: int
    entity: Any
    element: Element
    title: str
    has_body: bool
    """It has a representation that is meant to be solid or surface (not an axis or a footprint)."""
    is_triangles: bool
    """It has nothing but triangulated face sets, and no opening is to be cut out."""


def _length_unit(model: Any) -> tuple[float, str]:
    """Metres per unit, and its name; 1 and empty where the file names none."""
    from ifcopenshell.util import unit as units

    unit = units.get_project_unit(model, "LENGTHUNIT")
    if unit is None:
        return 1.0, ""
    return float(units.calculate_unit_scale(model)), str(units.get_full_unit_name(unit)).lower()


def _no_unit(path: Path, unit_name: str) -> tuple[str, ...]:
    """A line for the user where the file names no unit."""
    if unit_name:
        return ()
    return (f"{path.name} names no length unit: metres are assumed; pass --units if that is wrong.",)


def _code_page(path: Path, title: str) -> tuple[str, ...]:
    """A line about names that are not written as IFC wants them, where that had to be guessed."""
    if title in ("", "UTF-8"):
        return ()
    return (f"{path.name}: its names are not in IFC's own encoding and are taken for {title}: check them.",)


def _told_products(model: Any, storey_of_id: dict[int, int]) -> list[_ToldProduct]:
    """Physical products by file id."""
    ignored = {entity.id() for name in _NOT_PHYSICAL for entity in _of_class(model, name)}
    products = (p for p in _of_class(model, "IfcProduct") if p.id() not in ignored and p.Representation is not None)
    return [
        _ToldProduct(
            id=int(product.id()),
            entity=product,
            element=_element(product, storey_of_id),
            title=f"{product.is_a()} {product.Name or product.GlobalId}",
            has_body=_has_body(product),
            is_triangles=_is_triangles(product),
        )
        for product in sorted((p for p in products if not _is_void_proxy(p)), key=lambda p: int(p.id()))
    ]


def _of_class(model: Any, name: str) -> list[Any]:
    try:
        return list(model.by_type(name))
    except RuntimeError:  # the schema has no such class
        return []


def _is_void_proxy(product: Any) -> bool:
    """A proxy that only reserves room for an opening."""
    return str(getattr(product, "PredefinedType", None)) == "PROVISIONFORVOID"


def _optics(path: Path, model: Any) -> tuple[IfcOptics | None, tuple[str, ...]]:
    """What the file says of its materials; a warning instead where they are damaged, as no shape needs them."""
    try:
        with _contents_asked(path, model):
            return told_optics(model), ()
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return None, (f"{path.name}: its materials can't be read, so all surfaces return beams: {reason}",)


def _georeference(path: Path, model: Any, unit_m: float) -> tuple[Georeference | None, tuple[str, ...]]:
    """Where the file says that it is on earth; a warning instead where that is damaged, as no surface needs it."""
    try:
        with _contents_asked(path, model):
            told = told_georeference(path.name, model, unit_m)
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return None, (f"{path.name}: its georeferencing can't be read: {reason}",)
    return told, () if told is None else told.warnings


def _rooms(path: Path, model: Any, storey_of_id: dict[int, int]) -> tuple[tuple[Room, ...], tuple[str, ...]]:
    """Rooms (IfcSpace) by file id; a warning instead where they are damaged, as no surface needs them."""
    try:
        with _contents_asked(path, model):
            spaces = sorted(_of_class(model, "IfcSpace"), key=lambda space: int(space.id()))
            told = [(space, storey_of(space, storey_of_id)) for space in spaces if space.Representation is not None]
        shapes = _shapes_by(_SOLID_KERNEL, path, model, [space for space, _ in told], None)
        rooms, without = rooms_of(told, ((number, shape.vertices, shape.triangles) for number, shape in shapes))
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return (), (f"{path.name}: its rooms can't be read, so results don't name rooms: {reason}",)
    return rooms, without_shape(path.name, without)


# --------------------------------------------------------------------------------------------- geometry
def _triangulate_products(
    path: Path,
    model: Any,
    products: list[_ToldProduct],
    n_elements: int,
    optics: IfcOptics | None,
    progress: Progress,
) -> tuple[_Shapes, tuple[str, ...]]:
    by_id: dict[int, list[_Shape]] = {p.id: [] for p in products}
    if products:
        for n_done, (product_id, shape) in enumerate(_shapes(path, model, products, optics), 1):
            by_id[product_id].append(shape)
            progress(ProgressEvent("load", min(n_done, len(products)), len(products), "shapes"))
    shaped = [p for p in products if any(len(shape.triangles) for shape in by_id[p.id])]
    if not shaped:
        raise SceneError(
            f"{path.name}: none of its {grouped(n_elements)} elements has a surface, "
            "expected at least one; export the model with its 3D geometry."
        )
    without = [p for p in products if not any(len(shape.triangles) for shape in by_id[p.id]) and p.has_body]
    return _joined(shaped, by_id), _without_shape(path, without)


def _shapes(
    path: Path, model: Any, products: list[_ToldProduct], optics: IfcOptics | None
) -> Iterator[tuple[int, _Shape]]:
    """Product id and shape; in the order in which threads finish."""
    made = set()
    for shape in _shapes_by(_FACES_KERNEL, path, model, [p.entity for p in products if p.is_triangles], optics):
        made.add(shape[0])
        yield shape
    yield from _shapes_by(_SOLID_KERNEL, path, model, [p.entity for p in products if p.id not in made], optics)


def _shapes_by(
    kernel: str, path: Path, model: Any, entities: list[Any], optics: IfcOptics | None
) -> Iterator[tuple[int, _Shape]]:
    """`_shapes` of IfcProducts by one of IfcOpenShell's kernels."""
    if not entities:  # IfcOpenShell takes an empty list for all there are
        return
    from ifcopenshell import geom

    settings = geom.settings()
    settings.set("no-normals", True)
    settings.set("apply-default-materials", False)
    with _contents_asked(path, model):
        # Threads of the second kernel spend their time waiting for each other.
        n_threads = 1 if kernel == _FACES_KERNEL else os.cpu_count() or 1
        iterator = geom.iterator(settings, model, n_threads, include=entities, geometry_library=kernel)
        more = iterator.initialize()
    while more:
        with _contents_asked(path, model):
            shape = iterator.get()
        vertices = np.frombuffer(shape.geometry.verts_buffer, dtype=np.float64).reshape(-1, 3)
        triangles = np.frombuffer(shape.geometry.faces_buffer, dtype=np.int32).reshape(-1, 3).astype(np.int64)
        matrix = np.frombuffer(shape.transformation_buffer, dtype=np.float64).reshape(4, 4).T  # columns first
        items = np.frombuffer(shape.geometry.item_ids_buffer, dtype=np.int32)
        of_faces = None if optics is None else optics.of_faces(int(shape.id), shape.geometry)
        yield int(shape.id), _Shape(placed(vertices, matrix), _outside_out(vertices, triangles, items), of_faces)
        with _contents_asked(path, model):
            more = iterator.next()


def _outside_out(vertices: FloatArray, triangles: Int64Array, items: NDArray[np.int32]) -> Int64Array:
    """(T, 3) `triangles`, those of closed items that are inside out turned over.

    IfcOpenShell 0.9 keeps the winding of a shape that an instance mirrors. An item counts as closed when its faces'
    area vectors add up to nothing; it is inside out when its volume is negative.
    """
    if len(triangles) == 0 or len(items) != len(triangles):
        return triangles
    corners = vertices[triangles] - vertices[triangles[0, 0]]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    item = np.unique(items, return_inverse=True)[1]
    area = np.bincount(item, weights=np.sqrt((normal * normal).sum(axis=1)))
    left_over = np.stack([np.bincount(item, weights=normal[:, axis]) for axis in range(3)], axis=1)
    is_closed = np.abs(left_over).max(axis=1) <= _CLOSED_SHARE * area
    is_inside_out = is_closed & (np.bincount(item, weights=(np.cross(a, b) * c).sum(axis=1)) < 0)
    return np.where(is_inside_out[item][:, None], turned_over(triangles), triangles)


def _joined(products: list[_ToldProduct], by_id: dict[int, list[_Shape]]) -> _Shapes:
    """One mesh; a product with several shapes has them in the order of their bytes, not of the threads."""
    parts = Parts()
    for number, product in enumerate(products):
        n_faces = 0
        for shape in sorted(by_id[product.id], key=lambda s: s.key):
            face = np.arange(n_faces, n_faces + len(shape.triangles), dtype=np.int64)
            parts.add(number, shape.vertices, shape.triangles, face, shape.optics)
            n_faces += len(face)
    return _Shapes(*parts.joined(), parts.joined_optics(), products)


def _has_body(product: Any) -> bool:
    shapes = product.Representation.Representations
    return any((shape.RepresentationIdentifier or "Body") in ("Body", "Facetation", "Tessellation") for shape in shapes)


def _is_triangles(product: Any) -> bool:
    wholes, seen = [product], set()
    while wholes:  # openings of a whole go through its parts
        entity = wholes.pop()
        if getattr(entity, "HasOpenings", None):
            return False
        seen.add(entity.id())
        above = (relation.RelatingObject for relation in getattr(entity, "Decomposes", None) or ())
        wholes += [whole for whole in above if whole is not None and whole.id() not in seen]
    return all(
        item.is_a() == "IfcTriangulatedFaceSet"
        for shape in product.Representation.Representations
        for item in _unmapped_items(shape)
    )


def _unmapped_items(shape: Any) -> Iterator[Any]:
    for item in shape.Items:
        if item.is_a("IfcMappedItem"):
            yield from _unmapped_items(item.MappingSource.MappedRepresentation)
        else:
            yield item


def _without_shape(path: Path, products: list[_ToldProduct]) -> tuple[str, ...]:
    """A line for the user about products whose geometry could not be made."""
    if not products:
        return ()
    names = ", ".join(p.title for p in products[:3])
    more = f" and {grouped(len(products) - 3)} more" if len(products) > 3 else ""
    noun = "product has" if len(products) == 1 else "products have"
    return (f"{path.name}: {grouped(len(products))} {noun} a body that gives no surface: {names}{more}.",)


def _element(product: Any, storey_of_id: dict[int, int]) -> Element:
    name = product.Name or f"{product.is_a()} #{product.id()}"
    storey = storey_of(product, storey_of_id)
    kind, source_id = str(product.is_a()), str(product.GlobalId)
    return Element(
        str(name), kind, source_id, storey, _is_external(product), _predefined_type(product), parents=_parents(product)
    )


def _parents(product: Any) -> tuple[str, ...]:
    """Classes above the product's own, as its schema has them, the nearest first."""
    schema, _, kind = str(product.is_a(True)).rpartition(".")
    return _classes_above(schema, kind)


@cache
def _classes_above(schema: str, kind: str) -> tuple[str, ...]:
    import ifcopenshell

    declared = ifcopenshell.schema_by_name(schema).declaration_by_name(kind).as_entity()
    above = []
    while (declared := declared.supertype()) is not None:
        above.append(str(declared.name()))
    return tuple(above)


def _predefined_type(product: Any) -> str:
    """What a covering or slab is, by itself or by its type object; of other products nobody asks."""
    if not (product.is_a("IfcCovering") or product.is_a("IfcSlab")):
        return ""
    from ifcopenshell.util.element import get_predefined_type

    said = get_predefined_type(product)
    return "" if said in (None, "NOTDEFINED") else str(said).upper()


def _is_external(product: Any) -> bool | None:
    """Whether a door leads outdoors, where the file says."""
    if not product.is_a("IfcDoor"):
        return None
    from ifcopenshell.util.element import get_pset

    said = get_pset(product, "Pset_DoorCommon", "IsExternal")
    return said if isinstance(said, bool) else None
