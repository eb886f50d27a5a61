"""Faults that programs write into sound IFC files, each with what has to become of it; a silent difference is a fault.

    python -m tests.fuzz.fuzz_ifc_patterns [--minutes 1] [--seed 1] [--first 0] [--count N] [--patterns no units,...]

One pattern is applied to the parsed model of a small building, or with `--real` of a real one of ../shared/data.
Oracle: floors, rooms, surfaces and place are those of the sound file, or a warning or refusal of one line names the
pattern. Minutes are of processor time. Number i of a seed is always the same: `--first i --count 1 --keep FOLDER` makes
it again and keeps its files. Exit code 1 where there are faults.
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
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np
from ifcopenshell.util.element import copy_deep
from ifcopenshell.util.placement import get_local_placement
from ifcopenshell.util.unit import get_project_unit, get_unit_scale

from planner_core.errors import PlannerError
from tests.fuzz.fuzz_scenes import _LARGEST_REAL_BYTES, FAULTS, REAL, Result, campaign_parser, is_odd
from tests.fuzz.ifc_facts import HEIGHT_M, Facts, facts_of, write_house
from tests.scene.conftest import native_readers_here


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


def _of_ifc4(model: Any, name: str) -> list[Any]:
    """Entities of a class that IFC2X3 lacks."""
    return [] if model.schema == "IFC2X3" else list(model.by_type(name))


def _guid(rng: random.Random) -> str:
    return str(ifcopenshell.guid.compress(f"{rng.getrandbits(128):032x}"))


def _some(rng: random.Random, entities: list[Any]) -> list[Any]:
    """At least one of them, if there are any."""
    return rng.sample(entities, rng.randrange(1, len(entities) + 1)) if entities else []


def _point(model: Any, values: Any) -> Any:
    return model.create_entity("IfcCartesianPoint", Coordinates=[float(v) for v in values])


def _direction(model: Any, values: Any) -> Any:
    return model.create_entity("IfcDirection", DirectionRatios=[float(v) for v in values])


def _placement_at(model: Any, matrix: Any) -> Any:
    """An IfcLocalPlacement of its own, relative to nothing."""
    axes = model.create_entity(
        "IfcAxis2Placement3D",
        Location=_point(model, matrix[:3, 3]),
        Axis=_direction(model, matrix[:3, 2]),
        RefDirection=_direction(model, matrix[:3, 0]),
    )
    return model.create_entity("IfcLocalPlacement", RelativePlacement=axes)


def _move(model: Any, entity: Any, shift_m: Any) -> None:
    """Move an entity and what is placed relative to it."""
    matrix = _matrix(entity)
    matrix[:3, 3] += np.array(shift_m) / _unit_m(model)
    moved = _placement_at(model, matrix)
    if entity.ObjectPlacement is None:
        entity.ObjectPlacement = moved
    entity.ObjectPlacement.PlacementRelTo = None
    entity.ObjectPlacement.RelativePlacement = moved.RelativePlacement


# ------------------------------------------------------------------------------------------------ patterns
Change = Callable[[Any, random.Random], bool]
"""Applies a pattern to a model; False: there is nothing in it that the pattern could strike."""


@dataclass(frozen=True)
class Pattern:
    """warned : words that name it in a warning or refusal; empty: nothing may differ. moves : the whole building."""

    change: Change
    warned: str
    changes_surfaces: bool
    moves: bool


PATTERNS: dict[str, Pattern] = {}


def _pattern(warned: str = "", *, changes_surfaces: bool = False, moves: bool = False) -> Callable[[Change], Change]:
    """Register a change by its name, in words."""

    def register(change: Change) -> Change:
        PATTERNS[change.__name__.replace("_", " ")] = Pattern(change, warned, changes_surfaces, moves)
        return change

    return register


def _contained_in(model: Any, rng: random.Random, where: Any) -> bool:
    """Contain some of a storey's elements, or all, in something else; None: nowhere."""
    relations = [r for r in model.by_type("IfcRelContainedInSpatialStructure") if r.RelatingStructure != where]
    if not relations:
        return False
    relation = rng.choice(relations)
    elements = list(relation.RelatedElements)
    moved = rng.choice((elements, _some(rng, elements)))
    if where is not None:
        model.create_entity(relation.is_a(), GlobalId=_guid(rng), RelatedElements=moved, RelatingStructure=where)
    if len(moved) == len(elements):
        model.remove(relation)
    else:
        relation.RelatedElements = [element for element in elements if element not in moved]
    return True


@_pattern("no floor slab")
def wrong_storey(model: Any, rng: random.Random) -> bool:
    """Elements contained in another storey than the one that they stand on."""
    storeys = _storeys(model)
    return len(storeys) > 1 and _contained_in(model, rng, rng.choice(storeys))


@_pattern()
def no_storey(model: Any, rng: random.Random) -> bool:
    """Elements contained in the building, or nowhere."""
    return _contained_in(model, rng, rng.choice([None, *model.by_type("IfcBuilding")]))


def _moved_rooms(model: Any, *shift_m: float) -> bool:
    for space in (spaces := _shaped(model, "IfcSpace")):
        _move(model, space, shift_m)
    return bool(spaces)


@_pattern(r"rooms \(IfcSpace\) lie")
def rooms_a_storey_off(model: Any, rng: random.Random) -> bool:
    """All rooms a storey's height too high or too low, as where a height is added twice."""
    return _moved_rooms(model, 0, 0, rng.choice((-1, 1)) * rng.uniform(2.8, 3.6))


@_pattern(r"rooms \(IfcSpace\) reach")
def rooms_aside(model: Any, rng: random.Random) -> bool:
    """All rooms shifted in plan, as where an origin of the site is left out."""
    return _moved_rooms(model, *(rng.choice((-1, 1)) * rng.uniform(3, 60) for _ in range(2)), 0)


@_pattern()
def mirrored_item(model: Any, rng: random.Random) -> bool:
    """Blocks as mapped items that mirror them about their own middle."""
    for body in _some(rng, blocks := _block_bodies(_shaped(model))):
        (solid,) = body.Items
        axes = model.create_entity("IfcAxis2Placement3D", Location=_point(model, (0, 0, 0)))
        inner = model.create_entity("IfcShapeRepresentation", body.ContextOfItems, "Body", "SweptSolid", [solid])
        source = model.create_entity("IfcRepresentationMap", MappingOrigin=axes, MappedRepresentation=inner)
        target = _mirror(model, rng, solid.SweptArea.XDim, solid.SweptArea.YDim, solid.Depth)
        body.Items = [model.create_entity("IfcMappedItem", source, target)]
        body.RepresentationType = "MappedRepresentation"
    return bool(blocks)


def _mirror(model: Any, rng: random.Random, x: float, y: float, z: float) -> Any:
    """An operator that mirrors a block onto itself: by its axes, or by its scales."""
    forms = [
        ((x, 0, 0), (-1, 1, 1), (1,)),
        ((0, y, 0), (1, -1, 1), ()),
        ((x, 0, 0), (-1, 1, 1), (1, 1, 1)),
        ((x, 0, 0), (1, 1, 1), (-1, 1, 1)),
        ((0, y, 0), (1, 1, 1), (1, -1, 1)),
        ((0, 0, z), (1, 1, 1), (1, 1, -1)),
        ((x, y, z), (1, 1, 1), (-1,)),
    ]
    origin, signs, scales = rng.choice(forms)
    return model.create_entity(
        f"IfcCartesianTransformationOperator3D{'nonUniform' if len(scales) == 3 else ''}",
        Axis1=_direction(model, (signs[0], 0, 0)),
        Axis2=_direction(model, (0, signs[1], 0)),
        LocalOrigin=_point(model, origin),
        Axis3=_direction(model, (0, 0, signs[2])),
        **{name: float(scale) for name, scale in zip(("Scale", "Scale2", "Scale3"), scales, strict=False)},
    )


def _block_bodies(elements: list[Any]) -> list[Any]:
    """The representations of elements that are upright blocks from their origins."""
    bodies = [body for element in elements for body in element.Representation.Representations if len(body.Items) == 1]
    return [body for body in bodies if _is_block(body.Items[0])]


def _is_block(solid: Any) -> bool:
    profile = solid.SweptArea if solid.is_a("IfcExtrudedAreaSolid") else None
    return (
        profile is not None
        and profile.is_a("IfcRectangleProfileDef")
        and tuple(solid.ExtrudedDirection.DirectionRatios) == (0, 0, 1)
        and (solid.Position is None or not np.any(solid.Position.Location.Coordinates))
        and profile.Position.RefDirection is None
        and np.allclose(profile.Position.Location.Coordinates, (profile.XDim / 2, profile.YDim / 2))
    )


@_pattern()
def axes_left_out(model: Any, rng: random.Random) -> bool:
    """Axes that are the default ones, left out in one of the two or both."""
    defaults = {"Axis": (0, 0, 1), "RefDirection": (1, 0, 0)}
    upright = [
        axes
        for axes in model.by_type("IfcAxis2Placement3D")
        if all(getattr(axes, name) and getattr(axes, name).DirectionRatios == as_is for name, as_is in defaults.items())
    ]
    for axes in upright:
        for name in rng.sample(list(defaults), rng.choice((1, 2))):
            setattr(axes, name, None)
    return bool(upright)


@_pattern("lacks|gives no surface|no usable shape")
def no_axis_placement(model: Any, rng: random.Random) -> bool:
    """IFCLOCALPLACEMENT($,$), or one of a placement without location."""
    placement = rng.choice(sorted(model.by_type("IfcLocalPlacement"), key=lambda p: int(p.id())))
    setattr(*rng.choice(((placement, "RelativePlacement"), (placement.RelativePlacement, "Location"))), None)
    return True


@_pattern()
def placed_in_the_world(model: Any, rng: random.Random) -> bool:
    """Placements without PlacementRelTo that lead to the same place."""
    for entity in _some(rng, _shaped(model, "IfcProduct") + _storeys(model)):
        _move(model, entity, (0, 0, 0))
    return True


@_pattern("is placed at|placed at one height|has no floor slab|no floor found")
def placement_above_lost(model: Any, rng: random.Random) -> bool:
    """A storey that is placed relative to nothing, so that all of it falls to the ground."""
    above = [s for s in _storeys(model) if s.ObjectPlacement and s.ObjectPlacement.PlacementRelTo is not None]
    if len(above) < 2:
        return False  # of a building of one storey, all lies as before
    entity = rng.choice(above)
    matrix = _matrix(entity)
    if not entity.Elevation or abs(entity.Elevation - matrix[2, 3]) > HEIGHT_M / _unit_m(model):
        return False  # nothing in the file contradicts it
    _move(model, entity, (0, 0, -matrix[2, 3] * _unit_m(model)))
    return True


@_pattern()
def storey_without_placement(model: Any, rng: random.Random) -> bool:
    """Storeys with an elevation, and elements that are placed without them."""
    for storey in _some(rng, storeys := [storey for storey in _storeys(model) if storey.Elevation is not None]):
        storey.ObjectPlacement = None
    return bool(storeys)


@_pattern(r"no placement \(ObjectPlacement\)")
def product_without_placement(model: Any, rng: random.Random) -> bool:
    """Shapes that nothing places, rooms and openings among them."""
    products = [*_shaped(model), *_shaped(model, "IfcSpace"), *model.by_type("IfcOpeningElement")]
    for product in _some(rng, displaced := [p for p in products if not np.allclose(_matrix(p), np.eye(4))]):
        product.ObjectPlacement = None
    return bool(displaced)


@_pattern("georeferenced twice", moves=True)
def georeferenced_twice(model: Any, rng: random.Random) -> bool:
    """A site at its place on the map, in a file that has a map conversion besides."""
    for conversion in (conversions := _of_ifc4(model, "IfcMapConversion")[:1]):
        high_m = rng.choice((0.0, conversion.OrthogonalHeight))
        for site in model.by_type("IfcSite"):
            _move(model, site, (conversion.Eastings, conversion.Northings, high_m))
    return bool(conversions)


@_pattern("map unit is named")
def map_unit_of_a_foot(model: Any, rng: random.Random) -> bool:
    """A map unit called METER with the factor of a foot."""
    for system in (systems := [system for system in _of_ifc4(model, "IfcProjectedCRS") if system.MapUnit]):
        size = model.create_entity(
            "IfcMeasureWithUnit", model.create_entity("IfcLengthMeasure", 0.3048), system.MapUnit
        )
        length = model.create_entity("IfcDimensionalExponents", 1, 0, 0, 0, 0, 0, 0)
        system.MapUnit = model.create_entity("IfcConversionBasedUnit", length, "LENGTHUNIT", "METER", size)
    return bool(systems)


@_pattern("names no length unit|--units")
def no_units(model: Any, rng: random.Random) -> bool:
    """The project's units lost, or its unit of length among them."""
    (project,) = model.by_type("IfcProject")
    others = [unit for unit in project.UnitsInContext.Units if getattr(unit, "UnitType", "") != "LENGTHUNIT"]
    project.UnitsInContext.Units = [*others, model.create_entity("IfcSIUnit", None, "PLANEANGLEUNIT", None, "RADIAN")]
    if rng.random() < 0.5:
        project.UnitsInContext = None
    return True


@_pattern("units of length")
def two_units_of_length(model: Any, rng: random.Random) -> bool:
    """A second unit of length in the project's assignment, before or after the first."""
    assignment = model.by_type("IfcProject")[0].UnitsInContext
    second = model.create_entity("IfcSIUnit", None, "LENGTHUNIT", rng.choice(("MILLI", "CENTI", None)), "METRE")
    assignment.Units = rng.choice(([second, *assignment.Units], [*assignment.Units, second]))
    return True


@_pattern("no floor slab|no floor found|is left out", changes_surfaces=True)
def slabs_lost(model: Any, rng: random.Random) -> bool:
    """The slabs of a storey, or some of them, as where they are in another file."""
    relations = model.by_type("IfcRelContainedInSpatialStructure")
    of_each = [slabs for r in relations if (slabs := [e for e in r.RelatedElements if e.is_a("IfcSlab")])]
    slabs = rng.choice(of_each) if of_each else []
    for slab in rng.choice((slabs, _some(rng, slabs))):
        slab.Representation = None
    return bool(slabs)


@_pattern("is left out|no floor slab")
def storey_between(model: Any, rng: random.Random) -> bool:
    """A storey at half height that has nothing, or the walls of the one below."""
    storeys = _storeys(model)
    if not storeys:
        return False
    below = rng.choice(storeys)
    matrix, up = _matrix(below), 1.4 / _unit_m(model)
    matrix[2, 3] += up
    between = model.create_entity(
        "IfcBuildingStorey",
        GlobalId=_guid(rng),
        Name="Between",
        ObjectPlacement=_placement_at(model, matrix),
        Elevation=None if below.Elevation is None else below.Elevation + up,
    )
    for relation in below.Decomposes:
        relation.RelatedObjects = [*relation.RelatedObjects, between]
    for relation in below.ContainsElements if rng.random() < 0.5 else ():
        relation.RelatingStructure = between
    return True


@_pattern("Elevation|above its elevation")
def elevations_in_another_unit(model: Any, rng: random.Random) -> bool:
    """Elevation attributes in metres where lengths are in millimetres, above sea level, or all zero."""
    factor, shift_m = rng.choice(((0.001, 0.0), (1000.0, 0.0), (1.0, 515.0), (0.0, 0.0)))
    for storey in (with_elevation := [storey for storey in _storeys(model) if storey.Elevation is not None]):
        storey.Elevation = storey.Elevation * factor + shift_m / _unit_m(model)
    return bool(with_elevation)


@_pattern("placed at one height")
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


@_pattern()
def elements_twice(model: Any, rng: random.Random) -> bool:
    """Elements that a program wrote twice, in the same place."""
    for element in _some(rng, elements := [e for e in _shaped(model) if not e.HasOpenings]):
        twin = copy_deep(model, element)
        twin.GlobalId = _guid(rng)
        for relation in element.ContainedInStructure:
            relation.RelatedElements = [*relation.RelatedElements, twin]
    return bool(elements)


@_pattern(changes_surfaces=True)
def slab_as_a_sheet(model: Any, rng: random.Random) -> bool:
    """A floor slab as an open shell of its top side, facing up or down."""
    floors = [e for e in _shaped(model, "IfcSlab") if "Floor" in (e.Name or "")]
    for body in (bodies := _block_bodies(floors)):
        (solid,) = body.Items
        x, y, z = solid.SweptArea.XDim, solid.SweptArea.YDim, solid.Depth
        points = [_point(model, corner) for corner in ((0, 0, z), (x, 0, z), (x, y, z), (0, y, z))]
        loop = model.create_entity("IfcPolyLoop", Polygon=rng.choice((points, points[::-1])))
        face = model.create_entity("IfcFace", Bounds=[model.create_entity("IfcFaceOuterBound", loop, True)])
        shell = model.create_entity("IfcOpenShell", CfsFaces=[face])
        body.Items = [model.create_entity("IfcShellBasedSurfaceModel", SbsmBoundary=[shell])]
        body.RepresentationType = "SurfaceModel"
    return bool(bodies)


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
    real = _sound_real() if arguments.real else {}
    end_s = time.process_time() + 60.0 * arguments.minutes
    for number in range(arguments.first, arguments.first + arguments.count):
        if time.process_time() > end_s:
            break
        rng, name = random.Random(f"{arguments.seed} {number}"), names[number % len(names)]
        base = rng.choice(list(real)) if real and rng.random() < 0.5 else folder / "sound.ifc"
        if base not in real:
            write_house(base, rng)
        model, path = ifcopenshell.open(base), folder / "changed.ifc"
        if not PATTERNS[name].change(model, rng):
            counts[name, "not applied"] += 1
            continue
        model.write(str(path))
        result = tried(PATTERNS[name], real.get(base) or facts_of(base), path)
        counts[name, result.outcome] += 1
        is_fault = result.outcome in (*FAULTS, "silent", "refused by other words")
        line = f"seed {arguments.seed} number {number} ({name}, {base.name}): {result.outcome}: {result.detail}"
        if arguments.verbose or is_fault:
            print(line, flush=True)
        faults += [line] if is_fault else []
    return counts, faults


def _sound_real() -> dict[Path, Facts]:
    """Facts of small real buildings of ../shared/data, but for those that are refused."""
    found = {}
    for path in sorted(path for path in REAL.rglob("*.ifc") if path.stat().st_size < _LARGEST_REAL_BYTES):
        with suppress(PlannerError):
            found[path] = facts_of(path)
    return found


def main(words: list[str] | None = None) -> int:
    """Run a campaign, and print what came of it."""
    parser = campaign_parser(__doc__, minutes=1.0)
    parser.add_argument("--patterns", default="")
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    arguments = parser.parse_args(words)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, native_readers_here():
        counts, faults = campaign(arguments, Path(arguments.keep or folder))
    for name in sorted({pattern for pattern, _ in counts}):
        of_pattern = {outcome: n for (of, outcome), n in sorted(counts.items()) if of == name}
        print(f"{name:26s} {sum(of_pattern.values()):5d}  {of_pattern}")
    print(f"{len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
