"""IFC (2X3, 4, 4X3) -> `RawScene`: the surfaces of all physical products, with names, classes, GlobalIds and storeys.

Geometry comes from IfcOpenShell: openings are cut out of their hosts, mapped (instanced) geometry is placed once an
instance. Spaces, openings, grids, annotations and other things that no beam can meet are left out.

IfcOpenShell crashes on some damaged files: what is known of those is searched for first (`ifc_faults`), and
`planner_core.scene.isolated_readers` calls this reader in a child process.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from planner_core import child_process
from planner_core.errors import MissingPackageError, SceneError, grouped, is_text, reason_of
from planner_core.model import Element, FloatArray, Georeference, Int64Array, LoadReport, Room, UInt8Array
from planner_core.progress import Progress, ProgressEvent
from planner_core.scene.ifc_faults import check_ids, check_openings, check_places, check_references, unplaced
from planner_core.scene.ifc_georeference import read_georeference
from planner_core.scene.ifc_materials import IfcOptics, optics_in
from planner_core.scene.ifc_shapes import FACES_KERNEL, SHAPES, SOLID_KERNEL, Shape, entities_read, shapes_by
from planner_core.scene.ifc_storeys import rooms_of, storey_entries, storey_of, storeys_of, without_shape
from planner_core.scene.ifc_text import (
    lost_ends,
    read_text,
    syntax_fault,
    with_ascii_names,
    with_doubled_backslashes,
    without_strings,
)
from planner_core.scene.ifc_units import assume_unit, check_spread, length_unit, no_unit
from planner_core.scene.raw import MeshParts, RawScene

_OPENINGS = "IfcFeatureElementSubtraction"  # and recesses
_NOT_PHYSICAL = (
    _OPENINGS,
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

_NO_BEAM_NO_CUT = tuple(name for name in _NOT_PHYSICAL if name not in (_OPENINGS, "IfcSpace"))
"""Classes whose shapes are never made: openings are cut out, and rooms are named."""


_NAMED_KINDS = 3


@dataclass(frozen=True)
class _Shapes:
    """Triangulated products, in the order of their file ids. vertices : (V, 3) metres; owner : (T,) into products."""

    vertices: FloatArray
    triangles: Int64Array
    owner: Int64Array
    face: Int64Array
    optics: UInt8Array | None
    products: list[_ProductEntry]


def read_ifc(
    path: Path, *, progress: Progress, left_out: Collection[int] = (), user_unit_m: float | None = None
) -> RawScene:
    """Read an IFC file, but for the elements and rooms that are left out, by number.

    user_unit_m : of the user, for a file that names no unit.

    Raises
    ------
    SceneError
        Not an IFC file, cut off, of an unknown schema, or without geometry.
    MissingPackageError
        IfcOpenShell is not installed.
    """
    model, text, code_page = _opened(path)
    lost_warnings = _checked(path, model, text)
    with entities_read(path, model):
        unit_m, unit_name = length_unit(path, model, user_unit_m)
        entries = storey_entries(_of_class(model, "IfcBuildingStorey"))
        products = _product_entries(model, {storey.id: i for i, storey in enumerate(entries)}, left_out)
        n_elements = len(_of_class(model, "IfcElement"))
        if not unit_name:
            if user_unit_m is None:
                check_spread(path, [product.entity for product in products])
            assume_unit(model, unit_m)
    optics, optics_warnings = _optics(path, model)
    shapes, shape_warnings = _triangulate_products(path, model, products, n_elements, optics, progress)
    storeys, storey_warnings = storeys_of(path, entries, unit_m)
    with entities_read(path, model):
        unseen = [e for name in (_OPENINGS, "IfcSpace") for e in _of_class(model, name) if e.id() not in left_out]
        placed = [*(p.entity for p in shapes.products), *(e for e in unseen if e.Representation is not None)]
        placement_warnings = unplaced(path, placed)
    rooms, room_warnings = _rooms(path, model, {storey.id: i for i, storey in enumerate(entries)}, left_out)
    georeference, map_warnings = _georeference(path, model, unit_m)
    warnings = (
        *lost_warnings,
        *_code_page(path, code_page),
        *optics_warnings,
        *shape_warnings,
        *placement_warnings,
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
        assumed_unit=no_unit(path, unit_name),
        up_axis="Z",
        schema=str(model.schema_identifier),
        report=LoadReport(n_faces_read=0, warnings=warnings),
        rooms=rooms,
        georeference=georeference,
    )


def make_one_by_one(path: str, made: tuple[int, ...]) -> None:
    """Make the shapes of `read_ifc` but those `made`, by number: `child_process.at` names the one on which it ends."""
    file = Path(path)
    model, *_ = _opened(file)
    done = set(made)
    with entities_read(file, model):
        products = _product_entries(model, {}, done)
        assume_unit(model, 1.0)
        triangles = {p.id for p in products if p.is_triangles}
        entities = [p.entity for p in products]
        entities += [s for s in _of_class(model, "IfcSpace") if s.id() not in done and s.Representation is not None]
    for n_done, entity in enumerate(entities, 1):
        number = int(entity.id())
        child_process.at(f"#{number} {entity.is_a()} {entity.Name!r} {entity.GlobalId}")
        _make_one(file, model, entity, is_triangles=number in triangles)
        child_process.log(number)
        child_process.progress_of_child(ProgressEvent("load", n_done, len(entities), "shapes one by one"))


def _make_one(path: Path, model: Any, entity: Any, *, is_triangles: bool) -> None:
    """Make the shapes of one product, and forget them, as `_shapes` makes them."""
    for kernel in (FACES_KERNEL, SOLID_KERNEL) if is_triangles else (SOLID_KERNEL,):
        with suppress(SceneError):
            if any(True for _ in shapes_by(kernel, path, model, [entity], None)):
                return


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


def try_model(path: str) -> None:
    """Open an IFC file, ask for what objects and places it has, and write it: as who puts stations into it will."""
    from ifcopenshell.util.placement import get_local_placement

    file = Path(path)
    model = open_model(file)
    with entities_read(file, model), TemporaryDirectory() as folder:
        for entity in _of_class(model, "IfcRoot"):
            child_process.at(f"#{entity.id()} {entity.is_a()}")
            _ = entity.GlobalId
            if entity.is_a("IfcSpatialStructureElement"):
                get_local_placement(entity.ObjectPlacement)
        child_process.at("the file as a whole")
        model.write(Path(folder, "model.ifc"), format=".ifc")


def _opened(path: Path) -> tuple[Any, bytes, str]:
    """The model, the file's own text, and a phrase that is the code page of its names where that is not ASCII."""
    child_process.at("its text")
    text, is_unpacked = read_text(path)
    ascii_text, code_page = with_ascii_names(text)
    as_it_is = not (code_page or is_unpacked) and is_text(str(path))
    return _open(path, None if as_it_is else ascii_text), text, code_page


def _open(path: Path, text: bytes | None) -> Any:
    """IfcOpenShell's model of a file; of `text`, where that is made of the file's."""
    try:
        import ifcopenshell
    except ImportError as error:
        raise MissingPackageError(
            f"{path.name}: reading IFC needs the package ifcopenshell, which is missing; run pip install ifcopenshell."
        ) from error
    child_process.at("the file as a whole")
    try:
        with TemporaryDirectory() as folder:
            source = path
            if text is not None:
                source = Path(folder, "model.ifc")
                source.write_bytes(text)
            model = ifcopenshell.open(source, ".ifc")
    except (ifcopenshell.Error, ifcopenshell.SchemaError, OSError, RuntimeError) as error:
        whole = path.read_bytes() if text is None else text
        if fault := syntax_fault(whole):
            raise SceneError(f"{path.name}, {fault}; correct it, or export the file again.") from error
        if (mended := with_doubled_backslashes(whole)) != whole:
            return _open(path, mended)
        reason = reason_of(error).removesuffix(", check logs")
        raise SceneError(
            f"{path.name}: IfcOpenShell can't read it ({reason}), expected IFC2X3, IFC4 or IFC4X3; export it again."
        ) from error
    # Some programs write * (derived) for an empty name, at which IfcOpenShell's geometry gives up the product.
    for product in _of_class(model, "IfcProduct"):
        if product.Name is None:
            product.Name = None
    return model


def _checked(path: Path, model: Any, text: bytes) -> tuple[str, ...]:
    """Refuse what would end the process; a line about references to what is not there where no shape needs that."""
    no_shape = {entity.id() for name in _NO_BEAM_NO_CUT for entity in _of_class(model, name)}
    products = {int(product.id()) for product in _of_class(model, "IfcProduct")} - no_shape
    bare = without_strings(text)
    shaped = {int(p.id()) for p in _of_class(model, "IfcProduct") if p.id() in products and _has_shape(p)}
    with entities_read(path, model):
        check_openings(path, _of_class(model, "IfcRelVoidsElement"))
    check_ids(path, bare, shaped - {int(opening.id()) for opening in _of_class(model, _OPENINGS)})
    check_places(path, bare)
    check_references(path, bare, shaped)
    needed, others = lost_ends(bare, products)
    if needed:
        raise SceneError(f"{path.name}: {needed[0]}, which is not in the file; it is damaged, copy or export it again.")
    if not others:
        return ()
    several = f"{grouped(len(others))} references lead" if len(others) > 1 else "a reference leads"
    return (f"{path.name}: {several} to what is not in the file ({others[0]}), of which no shape is made: ignored.",)


# ------------------------------------------------------------------------------------- contents of the file
@dataclass(frozen=True)
class _ProductEntry:
    """A product with a representation and a surface."""

    id: int
    entity: Any
    element: Element
    title: str
    has_body: bool
    """It has a representation that is meant to be solid or surface (not an axis or a footprint)."""
    is_triangles: bool
    """It has nothing but triangulated face sets, and no opening is to be cut out."""


def _code_page(path: Path, title: str) -> tuple[str, ...]:
    """A line about names that are not written as IFC wants them, where that had to be guessed."""
    if title in ("", "UTF-8"):
        return ()
    return (f"{path.name}: its names are not in IFC's own encoding and are taken for {title}: check them.",)


def _product_entries(model: Any, storey_of_id: dict[int, int], left_out: Collection[int]) -> list[_ProductEntry]:
    """Physical products by file id, but for those that are left out."""
    ignored = {entity.id() for name in _NOT_PHYSICAL for entity in _of_class(model, name)}.union(left_out)
    products = (p for p in _of_class(model, "IfcProduct") if p.id() not in ignored and p.Representation is not None)
    return [
        _product_entry(p, storey_of_id) for p in sorted(products, key=lambda p: int(p.id())) if not _is_void_proxy(p)
    ]


def _product_entry(product: Any, storey_of_id: dict[int, int]) -> _ProductEntry:
    child_process.at(f"#{product.id()} {product.is_a()}")
    return _ProductEntry(
        id=int(product.id()),
        entity=product,
        element=_element(product, storey_of_id),
        title=f"{product.is_a()} {product.Name or product.GlobalId}",
        has_body=_has_body(product),
        is_triangles=_is_triangles(product),
    )


def _has_shape(product: Any) -> bool:
    try:
        return product.Representation is not None
    except RuntimeError:  # what stands there is nothing that IfcOpenShell knows
        return True


def _of_class(model: Any, name: str) -> list[Any]:
    try:
        return list(model.by_type(name))
    except RuntimeError:  # the schema has no such class
        return []


def _is_void_proxy(product: Any) -> bool:
    """A proxy that only reserves room for an opening."""
    return str(getattr(product, "PredefinedType", None)) == "PROVISIONFORVOID"


def _optics(path: Path, model: Any) -> tuple[IfcOptics | None, tuple[str, ...]]:
    """The file's materials; a warning instead where they are damaged, as no shape needs them."""
    try:
        with entities_read(path, model):
            return optics_in(model), ()
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return None, (f"{path.name}: its materials can't be read, so all surfaces return beams: {reason}",)


def _georeference(path: Path, model: Any, unit_m: float) -> tuple[Georeference | None, tuple[str, ...]]:
    """The file's georeference; a warning instead where it is damaged, as no surface needs it."""
    try:
        with entities_read(path, model):
            georeference = read_georeference(path.name, model, unit_m)
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return None, (f"{path.name}: its georeferencing can't be read: {reason}",)
    return georeference, () if georeference is None else georeference.warnings


def _rooms(
    path: Path, model: Any, storey_of_id: dict[int, int], left_out: Collection[int]
) -> tuple[tuple[Room, ...], tuple[str, ...]]:
    """Rooms (IfcSpace) by file id; a warning instead where they are damaged, as no surface needs them."""
    try:
        with entities_read(path, model):
            spaces = [space for space in _of_class(model, "IfcSpace") if space.id() not in left_out]
            spaces.sort(key=lambda space: int(space.id()))
            placed = [(space, storey_of(space, storey_of_id)) for space in spaces if space.Representation is not None]
        child_process.at(SHAPES)
        shapes = shapes_by(SOLID_KERNEL, path, model, [space for space, _ in placed], None)
        rooms, without = rooms_of(placed, ((number, shape.vertices, shape.triangles) for number, shape in shapes))
    except SceneError as error:
        reason = str(error).removeprefix(f"{path.name}: ")
        return (), (f"{path.name}: its rooms can't be read, so results don't name rooms: {reason}",)
    return rooms, without_shape(path.name, without)


# --------------------------------------------------------------------------------------------- geometry
def _triangulate_products(
    path: Path,
    model: Any,
    products: list[_ProductEntry],
    n_elements: int,
    optics: IfcOptics | None,
    progress: Progress,
) -> tuple[_Shapes, tuple[str, ...]]:
    by_id: dict[int, list[Shape]] = {p.id: [] for p in products}
    if products:
        child_process.at(SHAPES)
        for n_done, (product_id, shape) in enumerate(_shapes(path, model, products, optics), 1):
            by_id[product_id].append(shape)
            progress(ProgressEvent("load", min(n_done, len(products)), len(products), "shapes"))
    shaped = [p for p in products if any(len(shape.triangles) for shape in by_id[p.id])]
    if not shaped:
        has = f"none of its {grouped(n_elements)} elements has a surface" if n_elements else _without_elements(model)
        raise SceneError(f"{path.name}: {has}, expected at least one; export the model with its 3D geometry.")
    without = [p for p in products if not any(len(shape.triangles) for shape in by_id[p.id]) and p.has_body]
    return _joined(shaped, by_id), _without_shape(path, without)


def _without_elements(model: Any) -> str:
    """What a file holds that has no building element: rooms alone, say, or the project's structure."""
    found = Counter(str(product.is_a()) for product in _of_class(model, "IfcProduct"))
    named = ", ".join(f"{grouped(count)} {kind}" for kind, count in found.most_common(_NAMED_KINDS))
    return f"it holds {named or 'no IfcProduct'} and no element with a surface (IfcWall, IfcSlab ...)"


def _shapes(
    path: Path, model: Any, products: list[_ProductEntry], optics: IfcOptics | None
) -> Iterator[tuple[int, Shape]]:
    """Product id and shape; in the order in which threads finish."""
    made = set()
    for shape in shapes_by(FACES_KERNEL, path, model, [p.entity for p in products if p.is_triangles], optics):
        made.add(shape[0])
        yield shape
    yield from shapes_by(SOLID_KERNEL, path, model, [p.entity for p in products if p.id not in made], optics)


def _joined(products: list[_ProductEntry], by_id: dict[int, list[Shape]]) -> _Shapes:
    """One mesh; a product with several shapes has them in the order of their bytes, not of the threads."""
    parts = MeshParts()
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


def _without_shape(path: Path, products: list[_ProductEntry]) -> tuple[str, ...]:
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

    kind = get_predefined_type(product)
    return "" if kind in (None, "NOTDEFINED") else str(kind).upper()


def _is_external(product: Any) -> bool | None:
    """Whether a door leads outdoors, where the file states it."""
    if not product.is_a("IfcDoor"):
        return None
    from ifcopenshell.util.element import get_pset

    is_external = get_pset(product, "Pset_DoorCommon", "IsExternal")
    return is_external if isinstance(is_external, bool) else None
