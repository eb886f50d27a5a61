"""Faults that programs write into sound IFC files, each with what has to become of it; a silent difference is a fault.

    python -m tests.fuzz.fuzz_ifc_patterns [--minutes 1] [--seed 1] [--first 0] [--count N] [--patterns no units,...]

A small building is written, or with `--real` a real one of ../shared/data taken, and one pattern applied to its parsed
model: elements in a wrong storey, rooms shifted, items mirrored, placements missing, georeferenced twice. Oracle:
floors, rooms, surfaces and place are those of the sound file, or a warning or a refusal of one line names the pattern.
Minutes are of processor time. Number i of a seed is always the same: `--first i --count 1 --keep FOLDER` makes it again
and keeps its files. Exit code 1 where there are faults.
"""

from __future__ import annotations

import argparse
import random
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np
from ifcopenshell.util.element import copy_deep
from ifcopenshell.util.placement import get_local_placement
from ifcopenshell.util.unit import get_project_unit, get_unit_scale

from planner_core.coordinates.frame import site_frame
from planner_core.errors import PlannerError
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_json import _georeference
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from tests.fuzz.fuzz_scenes import _LARGEST_REAL_BYTES, FAULTS, REAL, Result, campaign_parser, is_odd
from tests.scene.conftest import IfcWriter, native_readers_here

_HEIGHT_M, _AREA_SHARE = 0.02, 0.02
"""Floors differ where they do by more: files round heights to centimetres."""
_EAST_M, _NORTH_M, _HIGH_M = 691_000.0, 5_334_000.0, 515.0
"""A place in EPSG:25832."""


@dataclass(frozen=True)
class Facts:
    """What a plan begins with.

    floors : height (m), ground (m2). rooms, surfaces : box (m) of each room, area (m2) and volume (m3) of each element,
    by GlobalId. corner_m : lowest of the scene. place : easting and northing of that corner; None: not georeferenced.
    """

    floors: tuple[tuple[float, float], ...]
    rooms: dict[str, tuple[float, ...]]
    surfaces: dict[str, tuple[float, float]]
    corner_m: FloatArray
    place: tuple[float, ...] | None
    warnings: tuple[str, ...]

    def moved_to(self, corner_m: FloatArray) -> Facts:
        """Return the same of a building whose lowest corner is elsewhere."""
        x, y, z = (corner_m - self.corner_m).tolist()
        rooms = {key: tuple(np.add(box, (x, y, z, x, y, z)).tolist()) for key, box in self.rooms.items()}
        return replace(self, floors=tuple((high + z, area) for high, area in self.floors), rooms=rooms)

    def differences(self, sound: Facts) -> list[str]:
        """Name what differs from the sound file."""
        found = []
        if len(self.floors) != len(sound.floors) or any(
            abs(high - its_high) > _HEIGHT_M or abs(area - its_area) > _AREA_SHARE * its_area
            for (high, area), (its_high, its_area) in zip(self.floors, sound.floors, strict=True)
        ):
            found.append(f"floors {self.floors} for {sound.floors}")
        for name, mine, its in (
            ("rooms", self.rooms, sound.rooms),
            ("surfaces", self.surfaces, sound.surfaces),
            ("place", {"": self.place or ()}, {"": sound.place or ()}),
        ):
            off = [key for key in its if key not in mine or not _are_close(mine[key], its[key])]
            if off:
                found.append(f"{name} ({len(off)} of {len(its)}, {mine.get(off[0])} for {its[off[0]]})")
        return found


def _are_close(mine: tuple[float, ...], its: tuple[float, ...]) -> bool:
    return len(mine) == len(its) and bool(np.allclose(mine, its, rtol=1e-6, atol=_HEIGHT_M))


def facts_of(path: Path) -> Facts:
    """Load a file, and find its floors."""
    scene = load_scene(path)
    report = find_floors(scene)
    origin_m = scene.vertices_m.min(axis=0)
    a, b, c = (scene.vertices_m[scene.triangles[:, k]] - origin_m for k in range(3))
    cross = np.cross(b - a, c - a)
    count = len(scene.elements)
    area_m2 = np.bincount(scene.element_of_triangle, np.sqrt((cross**2).sum(axis=1)) / 2, count)
    volume_m3 = np.bincount(scene.element_of_triangle, (a * cross).sum(axis=1) / 6, count)
    frame = site_frame(
        {
            "scene": {"georeference": _georeference(scene)},
            "floors": [
                {
                    "elevation_m": floor.elevation_m + scene.offset_m[2],
                    "bounds": (floor.bounds_m + scene.offset_m[:2]).tolist(),
                }
                for floor in report.floors
            ],
            "stations": [],
        }
    )
    corner_m = origin_m + scene.offset_m
    is_placed = scene.georeference is not None and scene.georeference.to_map is not None
    return Facts(
        tuple((float(floor.elevation_m + scene.offset_m[2]), float(floor.ground_area_m2)) for floor in report.floors),
        {room.source_id: tuple((room.box_m + scene.offset_m).ravel().tolist()) for room in scene.rooms},
        {
            element.source_id: (float(area), float(volume))
            for element, area, volume in zip(scene.elements, area_m2, volume_m3, strict=True)
            if area > 0
        },
        corner_m,
        tuple(frame.to_site(corner_m[None, :])[0, :2].tolist()) if is_placed else None,
        (*scene.report.warnings, *report.warnings, *frame.warnings),
    )


# ------------------------------------------------------------------------------------------------ files
def write_house(path: Path, rng: random.Random) -> None:
    """Write storeys of two rooms each, with a door between them and a cupboard, in one of the units and schemas."""
    prefix = rng.choice(("MILLI", "MILLI", None, "CENTI"))
    schema = rng.choice(("IFC4", "IFC4", "IFC2X3"))
    writer = IfcWriter(schema, prefix)
    width, depth, high = rng.uniform(8, 14), rng.uniform(6, 10), rng.uniform(2.8, 3.6)
    levels = {f"Level {i}": i * high for i in range(rng.choice((1, 2, 2, 3)))}
    origin = rng.choice(((0.0, 0.0, 0.0), (40.0, -25.0, 3.0)))
    for storey in writer.storeys(levels, origin).values():
        is_top = storey.Name == list(levels)[-1]

        def product(ifc_class: str, name: str, size: Any, at: Any, above: Any = storey) -> Any:
            placement = writer.placement(at, above=above)
            return writer.root(
                ifc_class, name, ObjectPlacement=placement, Representation=writer.shape(writer.block(size))
            )

        clear = high - 0.2
        walls = {
            "South": ((width, 0.3, clear), (0, 0, 0)),
            "North": ((width, 0.3, clear), (0, depth - 0.3, 0)),
            "West": ((0.3, depth - 0.6, clear), (0, 0.3, 0)),
            "East": ((0.3, depth - 0.6, clear), (width - 0.3, 0.3, 0)),
            "Partition": ((0.2, depth - 0.6, clear), (width / 2, 0.3, 0)),
        }
        made = [product("IfcWall", name, size, at) for name, (size, at) in walls.items()]
        opening = product("IfcOpeningElement", "Hole", (0.4, 1.0, 2.1), (width / 2 - 0.1, 2.0, 0))
        door = product("IfcDoor", "Door", (0.1, 1.0, 2.1), (width / 2 + 0.05, 2.0, 0))
        writer.relate("IfcRelVoidsElement", RelatingBuildingElement=made[-1], RelatedOpeningElement=opening)
        writer.relate("IfcRelFillsElement", RelatingOpeningElement=opening, RelatedBuildingElement=door)
        made.append(product("IfcSlab", "Floor slab", (width, depth, 0.2), (0, 0, -0.2)))
        if is_top:
            made.append(product("IfcSlab", "Roof slab", (width, depth, 0.2), (0, 0, clear)))
        made.append(product("IfcFurnishingElement", "Cupboard", (1.2, 0.6, 1.8), (1.0, 0.4, 0)))
        half = width / 2 - 0.3
        spaces = [
            product(
                "IfcSpace", f"{storey.Name} {side}", (half - 0.2 * (side == "right"), depth - 0.6, clear), (x, 0.3, 0)
            )
            for side, x in (("left", 0.3), ("right", width / 2 + 0.2))
        ]
        writer.relate("IfcRelAggregates", RelatingObject=storey, RelatedObjects=spaces)
        writer.contain(storey, door, *made)
    if schema == "IFC4" and rng.random() < 0.7:
        _georeference_model(writer.model, writer.context)
    writer.model.write(str(path))


def _georeference_model(model: Any, context: Any) -> None:
    metre = model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    crs = model.create_entity("IfcProjectedCRS", Name="EPSG:25832", MapUnit=metre)
    model.create_entity(
        "IfcMapConversion",
        SourceCRS=context,
        TargetCRS=crs,
        Eastings=_EAST_M,
        Northings=_NORTH_M,
        OrthogonalHeight=_HIGH_M,
        Scale=_unit_m(model),
    )


def real_files() -> list[Path]:
    """Small real buildings, sound or not, of ../shared/data."""
    return sorted(path for path in REAL.rglob("*.ifc") if path.stat().st_size < _LARGEST_REAL_BYTES)


# ------------------------------------------------------------------------------------------------ models
def _unit_m(model: Any) -> float:
    return float(get_unit_scale(get_project_unit(model, "LENGTHUNIT")))


def _storeys(model: Any) -> list[Any]:
    return sorted(model.by_type("IfcBuildingStorey"), key=lambda storey: float(_matrix(storey)[2, 3]))


def _matrix(entity: Any) -> Any:
    return np.eye(4) if entity.ObjectPlacement is None else get_local_placement(entity.ObjectPlacement)


def _shaped(model: Any, ifc_class: str = "IfcElement") -> list[Any]:
    """Elements, or others, with a shape, in the order of the file; openings are none."""
    found = [e for e in model.by_type(ifc_class) if e.Representation and e.ObjectPlacement]
    return sorted((e for e in found if not e.is_a("IfcFeatureElement")), key=lambda e: int(e.id()))


def _placement_at(model: Any, matrix: Any) -> Any:
    """An IfcLocalPlacement of its own, relative to nothing."""

    def direction(values: Any) -> Any:
        return model.create_entity("IfcDirection", DirectionRatios=[float(v) for v in values])

    at = model.create_entity("IfcCartesianPoint", Coordinates=[float(v) for v in matrix[:3, 3]])
    axes = model.create_entity(
        "IfcAxis2Placement3D", Location=at, Axis=direction(matrix[:3, 2]), RefDirection=direction(matrix[:3, 0])
    )
    return model.create_entity("IfcLocalPlacement", RelativePlacement=axes)


def _move(model: Any, entity: Any, shift_m: Any) -> None:
    """Move an entity and what is placed relative to it."""
    if entity.ObjectPlacement is None:
        entity.ObjectPlacement = _placement_at(model, np.eye(4))
    placement = entity.ObjectPlacement
    matrix = _matrix(entity)
    matrix[:3, 3] += np.array(shift_m) / _unit_m(model)
    moved = _placement_at(model, matrix)
    placement.PlacementRelTo = None
    placement.RelativePlacement = moved.RelativePlacement


# ------------------------------------------------------------------------------------------------ patterns
Change = Callable[[Any, random.Random], bool]
"""Applies a pattern to a model; False: there is nothing in it that the pattern could strike."""


@dataclass(frozen=True)
class Pattern:
    """warned : words of a warning or a refusal that names the pattern; empty: nothing may differ."""

    change: Change
    warned: str = ""
    changes_surfaces: bool = False
    moves: bool = False
    """The whole building lies elsewhere."""


PATTERNS: dict[str, Pattern] = {}


def _pattern(name: str, warned: str = "", **more: bool) -> Callable[[Change], Change]:
    def register(change: Change) -> Change:
        PATTERNS[name] = Pattern(change, warned, **more)
        return change

    return register


def _contained_in(model: Any, rng: random.Random, where: Any) -> bool:
    """Contain some of a storey's elements, or all, in something else; None: nowhere."""
    relations = [r for r in model.by_type("IfcRelContainedInSpatialStructure") if r.RelatingStructure != where]
    if not relations:
        return False
    relation = rng.choice(relations)
    elements = list(relation.RelatedElements)
    moved = elements if rng.random() < 0.5 else rng.sample(elements, rng.randrange(1, len(elements) + 1))
    left = [element for element in elements if element not in moved]
    if where is not None:
        guid = ifcopenshell.guid.compress(f"{rng.getrandbits(128):032x}")
        model.create_entity(
            "IfcRelContainedInSpatialStructure", GlobalId=guid, RelatedElements=moved, RelatingStructure=where
        )
    if left:
        relation.RelatedElements = left
    else:
        model.remove(relation)
    return True


@_pattern("wrong storey", "no floor slab")
def wrong_storey(model: Any, rng: random.Random) -> bool:
    """Elements contained in another storey than the one that they stand on."""
    storeys = _storeys(model)
    return len(storeys) > 1 and _contained_in(model, rng, rng.choice(storeys))


@_pattern("no storey", "no floor slab")
def no_storey(model: Any, rng: random.Random) -> bool:
    """Elements contained in the building, or nowhere."""
    buildings = model.by_type("IfcBuilding")
    return _contained_in(model, rng, rng.choice([None, *buildings]))


@_pattern("rooms a storey off", r"rooms \(IfcSpace\) lie")
def rooms_a_storey_off(model: Any, rng: random.Random) -> bool:
    """All rooms a storey's height too high or too low, as where a height is added twice."""
    spaces = _shaped(model, "IfcSpace")
    shift_m = rng.choice((-1, 1)) * rng.uniform(2.8, 3.6)
    for space in spaces:
        _move(model, space, (0, 0, shift_m))
    return bool(spaces)


@_pattern("rooms aside", r"rooms \(IfcSpace\) reach")
def rooms_aside(model: Any, rng: random.Random) -> bool:
    """All rooms shifted in plan, as where an origin of the site is left out."""
    spaces = _shaped(model, "IfcSpace")
    shift_m = (rng.choice((-1, 1)) * rng.uniform(3, 60), rng.choice((-1, 1)) * rng.uniform(3, 60), 0)
    for space in spaces:
        _move(model, space, shift_m)
    return bool(spaces)


@_pattern("mirrored item")
def mirrored_item(model: Any, rng: random.Random) -> bool:
    """Blocks as mapped items that mirror them about their own middle."""
    return _mapped_blocks(model, rng, lambda size: rng.choice(_mirrors(model, size)))


def _mirrors(model: Any, size: tuple[float, float, float]) -> list[Any]:
    """Operators that mirror a block onto itself."""
    x, y, z = size

    def direction(*values: float) -> Any:
        return model.create_entity("IfcDirection", DirectionRatios=[float(v) for v in values])

    def operator(kind: str, origin: tuple[float, float, float], signs: tuple[int, int, int], **scales: float) -> Any:
        return model.create_entity(
            f"IfcCartesianTransformationOperator3D{kind}",
            Axis1=direction(signs[0], 0, 0),
            Axis2=direction(0, signs[1], 0),
            LocalOrigin=model.create_entity("IfcCartesianPoint", Coordinates=[float(v) for v in origin]),
            Axis3=direction(0, 0, signs[2]),
            **scales,
        )

    return [
        operator("", (x, 0, 0), (-1, 1, 1), Scale=1.0),
        operator("", (0, y, 0), (1, -1, 1)),
        operator("nonUniform", (x, 0, 0), (-1, 1, 1), Scale=1.0, Scale2=1.0, Scale3=1.0),
        operator("nonUniform", (x, 0, 0), (1, 1, 1), Scale=-1.0, Scale2=1.0, Scale3=1.0),
        operator("nonUniform", (0, y, 0), (1, 1, 1), Scale=1.0, Scale2=-1.0, Scale3=1.0),
        operator("nonUniform", (0, 0, z), (1, 1, 1), Scale=1.0, Scale2=1.0, Scale3=-1.0),
        operator("", (x, y, z), (1, 1, 1), Scale=-1.0),
    ]


def _mapped_blocks(model: Any, rng: random.Random, target_of: Callable[[tuple[float, float, float]], Any]) -> bool:
    blocks = [(e, body) for e in _shaped(model) if (body := _block_body(e)) is not None]
    if not blocks:
        return False
    for _, body in rng.sample(blocks, rng.randrange(1, len(blocks) + 1)):
        (solid,) = body.Items
        size = (solid.SweptArea.XDim, solid.SweptArea.YDim, solid.Depth)
        axes = model.create_entity(
            "IfcAxis2Placement3D", Location=model.create_entity("IfcCartesianPoint", Coordinates=[0.0, 0.0, 0.0])
        )
        inner = model.create_entity("IfcShapeRepresentation", body.ContextOfItems, "Body", "SweptSolid", [solid])
        source = model.create_entity("IfcRepresentationMap", MappingOrigin=axes, MappedRepresentation=inner)
        body.Items = [model.create_entity("IfcMappedItem", MappingSource=source, MappingTarget=target_of(size))]
        body.RepresentationType = "MappedRepresentation"
    return True


def _block_body(element: Any) -> Any:
    """The representation of an element that is an upright block from its origin; None: it is another shape."""
    bodies = element.Representation.Representations
    if len(bodies) != 1 or len(bodies[0].Items) != 1 or not bodies[0].Items[0].is_a("IfcExtrudedAreaSolid"):
        return None
    solid = bodies[0].Items[0]
    profile = solid.SweptArea
    if not profile.is_a("IfcRectangleProfileDef") or tuple(solid.ExtrudedDirection.DirectionRatios) != (0, 0, 1):
        return None
    centre = tuple(profile.Position.Location.Coordinates)
    is_at_origin = solid.Position is None or not np.any(solid.Position.Location.Coordinates)
    is_straight = profile.Position.RefDirection is None
    is_block = is_at_origin and is_straight and np.allclose(centre, (profile.XDim / 2, profile.YDim / 2))
    return bodies[0] if is_block else None


@_pattern("axes left out")
def axes_left_out(model: Any, rng: random.Random) -> bool:
    """Axes that are the default ones, left out in one of the two or both."""
    upright = [
        axes
        for axes in model.by_type("IfcAxis2Placement3D")
        if (axes.Axis is None or tuple(axes.Axis.DirectionRatios) == (0, 0, 1))
        and (axes.RefDirection is None or tuple(axes.RefDirection.DirectionRatios) == (1, 0, 0))
    ]
    for axes in upright:
        kept = rng.choice(("Axis", "RefDirection", ""))
        for name in {"Axis", "RefDirection"} - {kept}:
            setattr(axes, name, None)
    return bool(upright)


@_pattern("no axis placement", "lacks|gives no surface|no usable shape")
def no_axis_placement(model: Any, rng: random.Random) -> bool:
    """IFCLOCALPLACEMENT($,$), or one of a placement without location."""
    placements = sorted(model.by_type("IfcLocalPlacement"), key=lambda p: int(p.id()))
    placement = rng.choice(placements)
    if rng.random() < 0.5:
        placement.RelativePlacement = None
    else:
        placement.RelativePlacement.Location = None
    return True


@_pattern("placed in the world")
def placed_in_the_world(model: Any, rng: random.Random) -> bool:
    """Placements without PlacementRelTo that lead to the same place."""
    entities = _shaped(model, "IfcProduct") + _storeys(model)
    for entity in rng.sample(entities, rng.randrange(1, len(entities) + 1)):
        _move(model, entity, (0, 0, 0))
    return True


@_pattern("placement above lost", "is placed at|placed at one height|has no floor slab|no floor found")
def placement_above_lost(model: Any, rng: random.Random) -> bool:
    """A storey that is placed relative to nothing, so that all of it falls to the ground."""
    above = [s for s in _storeys(model) if s.ObjectPlacement and s.ObjectPlacement.PlacementRelTo is not None]
    if len(above) < 2:
        return False  # of a building of one storey, all lies as before
    entity = rng.choice(above)
    matrix = _matrix(entity)
    if not entity.Elevation or abs(entity.Elevation - matrix[2, 3]) > _HEIGHT_M / _unit_m(model):
        return False  # nothing in the file contradicts it
    _move(model, entity, (0, 0, -matrix[2, 3] * _unit_m(model)))
    return True


@_pattern("storey without placement")
def storey_without_placement(model: Any, rng: random.Random) -> bool:
    """Storeys with an elevation, and elements that are placed without them."""
    storeys = [storey for storey in _storeys(model) if storey.Elevation is not None]
    for storey in rng.sample(storeys, rng.randrange(1, len(storeys) + 1)) if storeys else ():
        storey.ObjectPlacement = None
    return bool(storeys)


@_pattern("product without placement", r"no placement \(ObjectPlacement\)")
def product_without_placement(model: Any, rng: random.Random) -> bool:
    """Shapes that nothing places."""
    products = [p for p in _shaped(model) if not np.allclose(_matrix(p), np.eye(4))]
    if not products:
        return False
    for product in rng.sample(products, rng.randrange(1, len(products) + 1)):
        product.ObjectPlacement = None
    return True


@_pattern("georeferenced twice", "georeferenced twice", moves=True)
def georeferenced_twice(model: Any, rng: random.Random) -> bool:
    """A site at its place on the map, in a file that has a map conversion besides."""
    conversions = [] if model.schema == "IFC2X3" else model.by_type("IfcMapConversion")
    if not conversions:
        return False
    shift_m = (conversions[0].Eastings, conversions[0].Northings, rng.choice((0.0, conversions[0].OrthogonalHeight)))
    for site in model.by_type("IfcSite"):
        _move(model, site, shift_m)
    return True


@_pattern("map unit of a foot", "map unit is named")
def map_unit_of_a_foot(model: Any, rng: random.Random) -> bool:
    """A map unit called METER with the factor of a foot."""
    systems = [] if model.schema == "IFC2X3" else [s for s in model.by_type("IfcProjectedCRS") if s.MapUnit]
    for system in systems:
        size = model.create_entity(
            "IfcMeasureWithUnit",
            ValueComponent=model.create_entity("IfcLengthMeasure", 0.3048),
            UnitComponent=system.MapUnit,
        )
        length = model.create_entity("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
        system.MapUnit = model.create_entity("IfcConversionBasedUnit", length, "LENGTHUNIT", "METER", size)
    return bool(systems)


@_pattern("no units", "names no length unit|--units")
def no_units(model: Any, rng: random.Random) -> bool:
    """The project's units lost, or its unit of length among them."""
    (project,) = model.by_type("IfcProject")
    if rng.random() < 0.5:
        project.UnitsInContext = None
        return True
    others = [unit for unit in project.UnitsInContext.Units if getattr(unit, "UnitType", "") != "LENGTHUNIT"]
    others.append(model.create_entity("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"))
    project.UnitsInContext.Units = others
    return True


@_pattern("two units of length", "units of length")
def two_units_of_length(model: Any, rng: random.Random) -> bool:
    """A second unit of length in the project's assignment, before or after the first."""
    (project,) = model.by_type("IfcProject")
    units = list(project.UnitsInContext.Units)
    prefix = rng.choice(("MILLI", "CENTI", None))
    second = model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Prefix=prefix, Name="METRE")
    project.UnitsInContext.Units = [second, *units] if rng.random() < 0.5 else [*units, second]
    return True


@_pattern("slabs lost", "no floor slab|no floor found|is left out", changes_surfaces=True)
def slabs_lost(model: Any, rng: random.Random) -> bool:
    """The slabs of a storey, as where they are in another file."""
    relations = [
        (relation, slabs)
        for relation in model.by_type("IfcRelContainedInSpatialStructure")
        if (slabs := [e for e in relation.RelatedElements if e.is_a("IfcSlab")])
    ]
    if not relations:
        return False
    for slab in rng.choice(relations)[1]:
        slab.Representation = None
    return True


@_pattern("storey between", "is left out|no floor slab")
def storey_between(model: Any, rng: random.Random) -> bool:
    """A storey at half height that has nothing, or the walls of the one below."""
    storeys = _storeys(model)
    if not storeys:
        return False
    below = rng.choice(storeys)
    matrix = _matrix(below)
    unit_m = _unit_m(model)
    matrix[2, 3] += 1.4 / unit_m
    elevation = None if below.Elevation is None else below.Elevation + 1.4 / unit_m
    between = model.create_entity(
        "IfcBuildingStorey",
        GlobalId=ifcopenshell.guid.compress(f"{rng.getrandbits(128):032x}"),
        Name="Between",
        ObjectPlacement=_placement_at(model, matrix),
        Elevation=elevation,
    )
    for relation in below.Decomposes:
        relation.RelatedObjects = [*relation.RelatedObjects, between]
    if rng.random() < 0.5:
        for relation in below.ContainsElements:
            relation.RelatingStructure = between
    return True


@_pattern("elevations in another unit", "Elevation|above its elevation")
def elevations_in_another_unit(model: Any, rng: random.Random) -> bool:
    """Elevation attributes in metres where lengths are in millimetres, above sea level, or all zero."""
    factor, shift_m = rng.choice(((0.001, 0.0), (1000.0, 0.0), (1.0, 515.0), (0.0, 0.0)))
    for storey in _storeys(model):
        if storey.Elevation is not None:
            storey.Elevation = storey.Elevation * factor + shift_m / _unit_m(model)
    return True


@_pattern("storeys at one height", "placed at one height")
def storeys_at_one_height(model: Any, rng: random.Random) -> bool:
    """Storeys all placed at their building, and elements by themselves."""
    storeys = _storeys(model)
    if any(storey.Elevation is None or storey.ObjectPlacement is None for storey in storeys):
        return False
    for product in [*_shaped(model, "IfcProduct"), *model.by_type("IfcOpeningElement")]:
        if product.ObjectPlacement is not None:
            _move(model, product, (0, 0, 0))
    for storey in storeys:
        _move(model, storey, (0, 0, (_matrix(storeys[0])[2, 3] - _matrix(storey)[2, 3]) * _unit_m(model)))
    return bool(storeys)


@_pattern("elements twice")
def elements_twice(model: Any, rng: random.Random) -> bool:
    """Elements that a program wrote twice, in the same place."""
    elements = [e for e in _shaped(model) if not e.HasOpenings]
    for element in rng.sample(elements, rng.randrange(0, len(elements) + 1)):
        twin = copy_deep(model, element)
        twin.GlobalId = ifcopenshell.guid.compress(f"{rng.getrandbits(128):032x}")
        for relation in element.ContainedInStructure:
            relation.RelatedElements = [*relation.RelatedElements, twin]
    return bool(elements)


@_pattern("slab as a sheet", changes_surfaces=True)
def slab_as_a_sheet(model: Any, rng: random.Random) -> bool:
    """A floor slab as an open shell of its top side, facing up or down."""
    slabs = [(e, body) for e in _shaped(model, "IfcSlab") if (body := _block_body(e)) is not None and "Floor" in e.Name]
    for _, body in slabs:
        (solid,) = body.Items
        x, y, z = solid.SweptArea.XDim, solid.SweptArea.YDim, solid.Depth
        corners = [(0.0, 0.0, z), (x, 0.0, z), (x, y, z), (0.0, y, z)]
        points = [model.create_entity("IfcCartesianPoint", Coordinates=corner) for corner in corners]
        loop = model.create_entity("IfcPolyLoop", Polygon=rng.choice((points, points[::-1])))
        face = model.create_entity("IfcFace", Bounds=[model.create_entity("IfcFaceOuterBound", loop, True)])
        shell = model.create_entity("IfcOpenShell", CfsFaces=[face])
        body.Items = [model.create_entity("IfcShellBasedSurfaceModel", SbsmBoundary=[shell])]
        body.RepresentationType = "SurfaceModel"
    return bool(slabs)


# ------------------------------------------------------------------------------------------------ campaign
def tried(pattern: Pattern, sound: Facts, path: Path) -> Result:
    """What becomes of a file with a pattern, held against the sound one."""
    try:
        found = facts_of(path)
    except PlannerError as error:
        message = str(error)
        if is_odd(message):
            return Result("internal error", f"odd message {message!r}")
        is_named = bool(pattern.warned) and re.search(pattern.warned, message) is not None
        return Result("refused" if is_named else "refused by other words", message)
    except Exception as error:  # noqa: BLE001 (they are what is looked for)
        return Result("internal error", f"{type(error).__name__}: {error}")
    if pattern.changes_surfaces:
        sound = replace(sound, surfaces={})
    if pattern.moves:
        sound = sound.moved_to(found.corner_m)
    differences = found.differences(sound)
    if not differences:
        return Result("as sound", "")
    new = [line for line in found.warnings if line not in sound.warnings]
    if pattern.warned and any(re.search(pattern.warned, line) for line in new):
        return Result("warned", "; ".join(differences))
    return Result("silent", f"{'; '.join(differences)}; warnings: {new}")


def campaign(arguments: argparse.Namespace, folder: Path) -> tuple[Counter[tuple[str, str]], list[str]]:
    """Counts by pattern and outcome, and a line on each fault."""
    counts: Counter[tuple[str, str]] = Counter()
    faults: list[str] = []
    names = arguments.patterns.split(",") if arguments.patterns else list(PATTERNS)
    real = {path: facts for path in (real_files() if arguments.real else []) if (facts := _sound(path)) is not None}
    folder = Path(arguments.keep) if arguments.keep else folder
    end_s = time.process_time() + 60.0 * arguments.minutes
    for number in range(arguments.first, arguments.first + arguments.count):
        if time.process_time() > end_s:
            break
        rng = random.Random(f"{arguments.seed} {number}")
        name = names[number % len(names)]
        base = rng.choice(list(real)) if real and rng.random() < 0.5 else folder / "sound.ifc"
        if base not in real:
            write_house(base, rng)
        model, path = ifcopenshell.open(base), folder / "changed.ifc"
        if not PATTERNS[name].change(model, rng):
            counts[name, "not applied"] += 1
            continue
        model.write(str(path))
        sound = real[base] if base in real else facts_of(base)
        result = tried(PATTERNS[name], sound, path)
        counts[name, result.outcome] += 1
        if arguments.verbose or result.outcome in (*FAULTS, "silent", "refused by other words"):
            line = f"seed {arguments.seed} number {number} ({name}, {base.name}): {result.outcome}: {result.detail}"
            print(line, flush=True)
            if result.outcome in (*FAULTS, "silent", "refused by other words"):
                faults.append(line)
    return counts, faults


def _sound(path: Path) -> Facts | None:
    """Facts of a real file; None where it is refused."""
    try:
        return facts_of(path)
    except PlannerError:
        return None


def main(words: list[str] | None = None) -> int:
    """Run a campaign, and print what came of it."""
    parser = campaign_parser(__doc__, minutes=1.0)
    parser.add_argument("--patterns", default="")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    arguments = parser.parse_args(words)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, native_readers_here():
        counts, faults = campaign(arguments, Path(folder))
    for name in sorted({pattern for pattern, _ in counts}):
        of_pattern = {outcome: n for (of, outcome), n in sorted(counts.items()) if of == name}
        print(f"{name:26s} {sum(of_pattern.values()):5d}  {of_pattern}")
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
