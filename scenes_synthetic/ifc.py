"""Synthetic scenes as IFC4, in millimetres: storeys, spaces, walls and slabs with openings, doors, windows, furniture.

Walls and slabs are extruded rectangles with their openings subtracted, as design tools write them; everything else is a
triangulated face set in the product's own placement. Ids are hashes of names and the header has no time: same scene,
same bytes.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.material
import ifcopenshell.api.project
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.unit
import ifcopenshell.guid
import numpy as np

from scenes_synthetic.model import Hole, MapPlacement, Part, PiercedBox, Room, SyntheticScene
from scenes_synthetic.solids import Point, Solid

_MM = 1000.0
_THROUGH_MM = 20.0
"""How far an opening reaches beyond the faces that it pierces: boolean subtraction wants no coplanar faces."""
_SETS = (
    ("IfcRelContainedInSpatialStructure", "RelatedElements"),
    ("IfcRelAggregates", "RelatedObjects"),
    ("IfcUnitAssignment", "Units"),
    ("IfcRelAssociatesMaterial", "RelatedObjects"),
)
_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_OID, "tlsplan scenes_synthetic")


def write_ifc(synthetic: SyntheticScene, path: Path) -> None:
    """Write the scene to `path` as IFC4."""
    model = ifcopenshell.api.project.create_file(version="IFC4")
    body, storeys = _frame(model, synthetic)
    for index, storey in enumerate(storeys):
        for room in synthetic.rooms:
            if room.storey == index:
                _add_space(model, body, storey, room)
        _add_parts(model, body, storey, [part for part in synthetic.parts if part.storey == index])
    _add_materials(model, synthetic)
    if any(synthetic.frame.offset_m):
        # All else is placed relative to the site.
        (site,) = model.by_type("IfcSite")
        site.ObjectPlacement.RelativePlacement.Location.Coordinates = [_mm(v) for v in synthetic.frame.offset_m]
    if synthetic.frame.on_map is not None:
        _add_map(model, synthetic.frame.on_map)
    _fix_header_and_ids(model, synthetic.name)
    model.write(str(path))


def _frame(model: Any, synthetic: SyntheticScene) -> tuple[Any, list[Any]]:
    """Add project, units, context, site, building and storeys; return the body context and the storeys."""
    root, aggregate = ifcopenshell.api.root, ifcopenshell.api.aggregate
    project = root.create_entity(model, ifc_class="IfcProject", name=f"Synthetic {synthetic.name}")
    length = ifcopenshell.api.unit.add_si_unit(model, unit_type="LENGTHUNIT", prefix="MILLI")
    area = ifcopenshell.api.unit.add_si_unit(model, unit_type="AREAUNIT")
    volume = ifcopenshell.api.unit.add_si_unit(model, unit_type="VOLUMEUNIT")
    angle = ifcopenshell.api.unit.add_si_unit(model, unit_type="PLANEANGLEUNIT")
    ifcopenshell.api.unit.assign_unit(model, units=[length, area, volume, angle])
    context = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context
    )
    site = root.create_entity(model, ifc_class="IfcSite", name="Site")
    building = root.create_entity(model, ifc_class="IfcBuilding", name=synthetic.name)
    aggregate.assign_object(model, products=[site], relating_object=project)
    aggregate.assign_object(model, products=[building], relating_object=site)
    storeys = []
    for name, elevation_m in synthetic.truth.storeys:
        storey = root.create_entity(model, ifc_class="IfcBuildingStorey", name=name)
        storey.Elevation = elevation_m * _MM
        aggregate.assign_object(model, products=[storey], relating_object=building)
        storeys.append(storey)
    for product in (site, building):
        _place(model, product, (0.0, 0.0, 0.0))
    for storey, (_, elevation_m) in zip(storeys, synthetic.truth.storeys, strict=True):
        _place(model, storey, (0.0, 0.0, elevation_m))
    return body, storeys


def _add_parts(model: Any, body: Any, storey: Any, parts: list[Part]) -> None:
    """Add a storey's parts with their openings and fillings."""
    openings: dict[str, Any] = {}
    products = []
    for part in parts:
        product = ifcopenshell.api.root.create_entity(model, ifc_class=part.kind, name=part.name)
        if part.predefined_type:
            product.PredefinedType = part.predefined_type
        products.append(product)
        # One at a time and before it is placed: a list of products with placements is re-placed in no fixed order.
        ifcopenshell.api.spatial.assign_container(model, products=[product], relating_structure=storey)
        if part.pierced_box is None:
            low = part.solid.bounds_m[0]
            _place(model, product, (float(low[0]), float(low[1]), float(low[2])))
            _represent(model, body, product, "Tessellation", _face_set(model, part.solid, low))
        else:
            _add_box(model, body, product, part.pierced_box.low_m, part.pierced_box.high_m)
            for hole in part.pierced_box.holes:
                openings[hole.name] = _add_opening(model, body, product, part.pierced_box, hole)
        if part.kind in ("IfcDoor", "IfcWindow"):
            low, high = part.solid.bounds_m
            product.OverallHeight = round(float(high[2] - low[2]) * _MM, 3)
    for part, product in zip(parts, products, strict=True):
        if part.fills:
            ifcopenshell.api.feature.add_filling(model, opening=openings[part.fills], element=product)


def _add_opening(model: Any, body: Any, product: Any, recipe: PiercedBox, hole: Hole) -> Any:
    opening = ifcopenshell.api.root.create_entity(model, ifc_class="IfcOpeningElement", name=f"{hole.name} opening")
    opening.PredefinedType = "OPENING"
    reach = _THROUGH_MM / _MM
    low = [h - reach if h == b else h for h, b in zip(hole.low_m, recipe.low_m, strict=True)]
    high = [h + reach if h == b else h for h, b in zip(hole.high_m, recipe.high_m, strict=True)]
    _add_box(model, body, opening, (low[0], low[1], low[2]), (high[0], high[1], high[2]))
    ifcopenshell.api.feature.add_feature(model, feature=opening, element=product)
    return opening


def _add_space(model: Any, body: Any, storey: Any, room: Room) -> None:
    space = ifcopenshell.api.root.create_entity(model, ifc_class="IfcSpace", name=room.name)
    space.PredefinedType = "INTERNAL"
    ifcopenshell.api.aggregate.assign_object(model, products=[space], relating_object=storey)
    _place(model, space, (0.0, 0.0, room.floor_m))
    outline, *islands = (_closed_line(model, ring) for ring in (room.outline_m, *room.islands_m))
    if islands:
        profile = model.create_entity("IfcArbitraryProfileDefWithVoids", "AREA", None, outline, islands)
    else:
        profile = model.create_entity("IfcArbitraryClosedProfileDef", "AREA", None, outline)
    _represent(model, body, space, "SweptSolid", _extrude(model, profile, room.height_m))


def _closed_line(model: Any, ring_m: Sequence[tuple[float, float]]) -> Any:
    points = [model.create_entity("IfcCartesianPoint", [_mm(x), _mm(y)]) for x, y in (*ring_m, ring_m[0])]
    return model.create_entity("IfcPolyline", points)


def _add_box(model: Any, body: Any, product: Any, low_m: Point, high_m: Point) -> None:
    """Represent a product as a rectangle extruded upwards, placed at its lowest corner."""
    size_x, size_y, size_z = (high - low for low, high in zip(low_m, high_m, strict=True))
    middle = model.create_entity("IfcCartesianPoint", [_mm(size_x / 2), _mm(size_y / 2)])
    position = model.create_entity("IfcAxis2Placement2D", middle)
    profile = model.create_entity("IfcRectangleProfileDef", "AREA", None, position, _mm(size_x), _mm(size_y))
    _place(model, product, low_m)
    _represent(model, body, product, "SweptSolid", _extrude(model, profile, size_z))


def _extrude(model: Any, profile: Any, height_m: float) -> Any:
    origin = model.create_entity("IfcAxis2Placement3D", model.create_entity("IfcCartesianPoint", [0.0, 0.0, 0.0]))
    up = model.create_entity("IfcDirection", [0.0, 0.0, 1.0])
    return model.create_entity("IfcExtrudedAreaSolid", profile, origin, up, _mm(height_m))


def _face_set(model: Any, solid: Solid, low_m: np.ndarray[Any, Any]) -> Any:
    millimetres = np.round((solid.vertices_m - low_m) * _MM, 3).tolist()
    points = model.create_entity("IfcCartesianPointList3D", millimetres)
    corners = (solid.triangles + 1).tolist()
    return model.create_entity("IfcTriangulatedFaceSet", Coordinates=points, Closed=True, CoordIndex=corners)


def _add_materials(model: Any, synthetic: SyntheticScene) -> None:
    """Associate the parts that have a material with an IfcMaterial of that name and category."""
    for name in sorted({part.material for part in synthetic.parts if part.material}):
        material = ifcopenshell.api.material.add_material(model, name=name, category=name)
        wanted = {part.name for part in synthetic.parts if part.material == name}
        products = [product for product in model.by_type("IfcElement") if product.Name in wanted]
        ifcopenshell.api.material.assign_material(model, products=products, material=material)


def _represent(model: Any, body: Any, product: Any, kind: str, item: Any) -> None:
    shape = model.create_entity("IfcShapeRepresentation", body, "Body", kind, [item])
    ifcopenshell.api.geometry.assign_representation(model, product=product, representation=shape)


def _place(model: Any, product: Any, at_m: Point) -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = at_m
    ifcopenshell.api.geometry.edit_object_placement(model, product=product, matrix=matrix)


def _add_map(model: Any, placement: MapPlacement) -> None:
    """Say where on earth the model is: map conversion to metres, projected system, true north, and the site's place."""
    context = next(c for c in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False))
    metre = model.create_entity("IfcSIUnit", None, "LENGTHUNIT", None, "METRE")
    system = model.create_entity(
        "IfcProjectedCRS",
        Name=placement.crs,
        Description=placement.crs_description,
        GeodeticDatum=placement.geodetic_datum,
        VerticalDatum=placement.vertical_datum,
        MapProjection=placement.projection,
        MapZone=placement.zone,
        MapUnit=metre,
    )
    model.create_entity(
        "IfcMapConversion",
        SourceCRS=context,
        TargetCRS=system,
        Eastings=placement.east_m,
        Northings=placement.north_m,
        OrthogonalHeight=placement.height_m,
        XAxisAbscissa=math.cos(placement.rotation_rad),
        XAxisOrdinate=math.sin(placement.rotation_rad),
        Scale=1 / _MM,
    )
    # Seen in the plan of the scene, grid north is clockwise from +y by the rotation.
    north_rad = placement.rotation_rad - placement.convergence_rad
    context.TrueNorth = model.create_entity("IfcDirection", [math.sin(north_rad), math.cos(north_rad)])
    (site,) = model.by_type("IfcSite")
    site.RefLatitude, site.RefLongitude = placement.latitude, placement.longitude
    site.RefElevation = _mm(placement.height_m)


def _mm(length_m: float) -> float:
    return round(length_m * _MM, 3)


def _fix_header_and_ids(model: Any, name: str) -> None:
    """Give every rooted entity an id from its class, name and place among its namesakes, and the header no time."""
    seen: dict[str, int] = {}
    for entity in sorted(model.by_type("IfcRoot"), key=lambda e: e.id()):
        key = f"{name}/{entity.is_a()}/{entity.Name or ''}"
        seen[key] = seen.get(key, 0) + 1
        entity.GlobalId = ifcopenshell.guid.compress(uuid.uuid5(_NAMESPACE, f"{key}/{seen[key]}").hex)
    # ifcopenshell.api keeps IFC's SETs as Python sets of objects, whose order changes from run to run.
    for ifc_class, attribute in _SETS:
        for entity in model.by_type(ifc_class):
            setattr(entity, attribute, sorted(getattr(entity, attribute), key=lambda e: e.id()))
    header = model.header.file_name
    header.name = f"{name}.ifc"
    header.time_stamp = "2000-01-01T00:00:00"
