"""What the surfaces of an IFC model do to beams: by the styles of their representation items, else by materials.

Scene stage. IfcOpenShell names for each face the style that it is drawn with and the representation item that it is of.
A style with optics decides; it may be the item's own or that of the product's material, which IfcOpenShell
passes down. Else the constituent decides that a shape aspect ties to the item, else the material of the product or of
its type: of a material that has several parts (layers, constituents, profiles, a list), what all of them say.
Source: buildingSMART, IFC4 ADD2 TC1, IfcMaterialResource and IfcPresentationAppearanceResource.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.model import Optics, UInt8Array
from planner_core.scene.materials import optics_of_material

_UNSPECIFIED = 255
_PARTS_OF_SET = ("MaterialLayers", "MaterialConstituents", "MaterialProfiles", "Materials")
"""Attributes that hold the parts of a layer set, a constituent set, a profile set, a list."""
_SET_OF_USAGE = ("ForLayerSet", "ForProfileSet")
_GAS = ("air", "luft", "lucht", "aria", "aire", "argon", "krypton", "gas", "vacuum")
"""First words of layers between panes: they have no surface."""


@dataclass(frozen=True)
class _Material:
    """Optics and styles of a product's material. optics: None where it gives none."""

    optics: Optics | None
    styles: frozenset[int]
    """File ids of the styles that it is drawn with: of them, the material's own name decides first."""


@dataclass(frozen=True)
class IfcOptics:
    """Optics of a model's surfaces, by file ids; empty where all of them return.

    of_style : of IfcSurfaceStyle, those that say something. of_product : of products with a material.
    of_item : of representation items that a shape aspect ties to a constituent.
    """

    of_style: dict[int, Optics] = field(default_factory=dict)
    of_product: dict[int, _Material] = field(default_factory=dict)
    of_item: dict[int, Optics] = field(default_factory=dict)

    def of_faces(self, product: int, geometry: Any) -> UInt8Array | None:
        """(T,) `Optics` of the triangles of a shape of IfcOpenShell; None where all return."""
        material = self.of_product.get(product, _NO_MATERIAL)
        style_of_face = np.frombuffer(geometry.material_ids_buffer, dtype=np.int32)
        styles = [int(style.instance_id()) for style in geometry.materials]
        of_style = [_UNSPECIFIED if s in material.styles else int(self.of_style.get(s, _UNSPECIFIED)) for s in styles]
        optics = np.array([*of_style, _UNSPECIFIED], dtype=np.uint8)[style_of_face]  # -1, no style, takes the last
        if self.of_item and (optics == _UNSPECIFIED).any():
            optics = np.where(optics == _UNSPECIFIED, self._of_items(geometry), optics)
        optics[optics == _UNSPECIFIED] = material.optics or Optics.RETURNS
        return optics if optics.any() else None

    def _of_items(self, geometry: Any) -> UInt8Array:
        item_of_face: NDArray[np.int32] = np.frombuffer(geometry.item_ids_buffer, dtype=np.int32)
        items, place = np.unique(item_of_face, return_inverse=True)
        return np.array([self.of_item.get(item, _UNSPECIFIED) for item in items.tolist()], dtype=np.uint8)[place]


_NO_MATERIAL = _Material(None, frozenset())


def optics_in(model: Any) -> IfcOptics | None:
    """Read the optics of styles and materials of a model of IfcOpenShell; None where everything returns.

    Raises whatever IfcOpenShell does where the file does not follow its schema.
    """
    of_style = {
        int(style.id()): optics
        for style in model.by_type("IfcSurfaceStyle")
        if (optics := _of_style(style)) is not None
    }
    materials = {int(material.id()): _of_material(material, of_style) for material in model.by_type("IfcMaterial")}
    if not any(_changes_faces(optics, of_style) for optics in materials.values()):
        materials = {}  # products need not be read
    if not materials and not any(of_style.values()):
        return None
    of_product, of_item = _of_products(model, materials) if materials else ({}, {})
    return IfcOptics(of_style, of_product, of_item)


# --------------------------------------------------------------------------------------------------- styles
def _of_style(style: Any) -> Optics | None:
    names, transparency = _names_and_transparency(style)
    return optics_of_material(names, transparency=transparency)


def _names_and_transparency(style: Any) -> tuple[list[str], float | None]:
    """Names, the reflectance method (`GLASS`, `MIRROR` ...) last, and transparency of an IfcSurfaceStyle."""
    names, transparency = [str(style.Name or "")], None
    for part in style.Styles or ():
        if part.is_a("IfcSurfaceStyleShading"):
            given = getattr(part, "Transparency", None)  # IFC2X3 has it in the subclass only
            transparency = transparency if given is None else float(given)
            names.append(str(getattr(part, "ReflectanceMethod", None) or ""))
    return names, transparency


# ------------------------------------------------------------------------------------------------ materials
def _of_material(material: Any, of_style: dict[int, Optics]) -> _Material:
    """A plain IfcMaterial: its name and category, else the styles that it is drawn with."""
    ids = frozenset(int(style.id()) for style in _styles_of(material))
    by_name = optics_of_material([str(material.Name or ""), str(getattr(material, "Category", None) or "")])
    by_style = [of_style[i] for i in sorted(ids) if i in of_style]
    return _Material(_what_all_say(by_style) if by_name is None else by_name, ids)


def _changes_faces(material: _Material, of_style: dict[int, Optics]) -> bool:
    """Whether faces do something else than return, or than their styles give, because of a material."""
    optics = material.optics
    return bool(optics) or (optics is not None and any(of_style.get(style) for style in material.styles))


def _styles_of(material: Any) -> Iterable[Any]:
    for definition in material.HasRepresentation or ():
        for representation in definition.Representations or ():
            for item in representation.Items or ():
                yield from _surface_styles(item.Styles or ())


def _surface_styles(styles: Iterable[Any]) -> Iterable[Any]:
    """Surface styles among `styles`, also those that IFC2X3 wraps in an IfcPresentationStyleAssignment."""
    for style in styles:
        if style.is_a("IfcSurfaceStyle"):
            yield style
        elif style.is_a("IfcPresentationStyleAssignment"):
            yield from _surface_styles(style.Styles or ())


def _what_all_say(optics: Sequence[Optics | None]) -> Optics | None:
    """One answer that all give; where they differ, the surface is of several things and returns."""
    if not optics:
        return None
    return optics[0] if all(one is optics[0] for one in optics) else Optics.RETURNS


def _of_products(model: Any, materials: dict[int, _Material]) -> tuple[dict[int, _Material], dict[int, Optics]]:
    """By product and by representation item; a product's own material comes before that of its type."""
    of_product: dict[int, _Material] = {}
    of_item: dict[int, Optics] = {}
    for relation in model.by_type("IfcRelAssociatesMaterial"):
        of_set = _of_set(relation.RelatingMaterial, materials)
        parts = _of_named_parts(relation.RelatingMaterial, materials)
        for thing in relation.RelatedObjects or ():
            of_product[int(thing.id())] = of_set
            if any(parts.values()):
                of_item.update(_of_aspects(thing, parts))
    for relation in model.by_type("IfcRelDefinesByType"):
        of_type = of_product.get(int(relation.RelatingType.id()))
        if of_type is not None:
            for product in relation.RelatedObjects or ():
                of_product.setdefault(int(product.id()), of_type)
    return of_product, of_item


def _of_set(material: Any, materials: dict[int, _Material]) -> _Material:
    """A material of any kind, or a part of a set: a plain one, or what all parts say."""
    if material is None:
        return _NO_MATERIAL
    parts = [part for part in _parts_of(material) if not _is_gas(part)]
    found = [materials.get(int(part.id()), _NO_MATERIAL) for part in parts]
    return _Material(_what_all_say([one.optics for one in found]), frozenset().union(*(one.styles for one in found)))


def _parts_of(material: Any) -> list[Any]:
    """The plain materials that one of any kind consists of."""
    for usage in _SET_OF_USAGE:
        if getattr(material, usage, None) is not None:
            return _parts_of(getattr(material, usage))
    if material.is_a("IfcMaterial"):
        return [material]
    for attribute in _PARTS_OF_SET:
        if getattr(material, attribute, None):
            return [plain for part in getattr(material, attribute) for plain in _parts_of(part)]
    part = getattr(material, "Material", None)  # of one layer, constituent or profile
    return [part] if part is not None else []


def _is_gas(material: Any) -> bool:
    return str(material.Name or "").casefold().split(" ")[0] in _GAS


def _of_named_parts(material: Any, materials: dict[int, _Material]) -> dict[str, Optics]:
    """By name, the constituents of a set that say something."""
    constituents = getattr(material, "MaterialConstituents", None) or ()
    of_constituent = {str(c.Name): _of_set(c, materials).optics for c in constituents if c.Name}
    return {name: optics for name, optics in of_constituent.items() if optics is not None}


def _of_aspects(thing: Any, parts: dict[str, Optics]) -> dict[int, Optics]:
    """By file id, the representation items of a product or type that its shape aspects tie to named parts."""
    shape = getattr(thing, "Representation", None)
    holders = [*((shape,) if shape is not None else ()), *(getattr(thing, "RepresentationMaps", None) or ())]
    holders += [item.MappingSource for holder in holders[:1] for item in _mapped_items(holder)]
    return {
        int(item.id()): parts[str(aspect.Name)]
        for holder in holders
        for aspect in getattr(holder, "HasShapeAspects", None) or ()
        if str(aspect.Name) in parts
        for representation in aspect.ShapeRepresentations
        for item in representation.Items
    }


def _mapped_items(shape: Any) -> list[Any]:
    representations = getattr(shape, "Representations", None) or ()
    return [item for r in representations for item in r.Items or () if item.is_a("IfcMappedItem")]
