"""A sound building in IFC, and the facts that a plan begins with, which the campaign of patterns compares."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner_core.coordinates.frame import site_frame
from planner_core.model import FloatArray
from planner_core.plan_folder.plan_json import _georeference
from planner_core.scene.floors import find_floors
from planner_core.scene.load import load_scene
from tests.scene.conftest import IfcWriter

HEIGHT_M, _AREA_SHARE = 0.02, 0.02
"""Floors differ where they do by more: files round heights to centimetres."""
_PLACE_M = {"Eastings": 691_000.0, "Northings": 5_334_000.0, "OrthogonalHeight": 515.0}
"""In EPSG:25832."""


@dataclass(frozen=True)
class Facts:
    """What a plan begins with.

    floors : height (m), ground (m2). rooms, surfaces : box (m) of each room, area (m2) and volume (m3) of each element,
    by GlobalId. corner_m : lowest of the scene. place : easting and northing of that corner; empty: not georeferenced.
    """

    floors: tuple[tuple[float, float], ...]
    rooms: dict[str, tuple[float, ...]]
    surfaces: dict[str, tuple[float, ...]]
    corner_m: FloatArray
    place: tuple[float, ...]
    warnings: tuple[str, ...]

    def moved_to(self, corner_m: FloatArray) -> Facts:
        """Return the same of a building whose lowest corner is elsewhere."""
        by_m = corner_m - self.corner_m
        rooms = {key: tuple(np.add(box, np.tile(by_m, 2)).tolist()) for key, box in self.rooms.items()}
        return replace(self, floors=tuple((high + by_m[2], area) for high, area in self.floors), rooms=rooms)

    def differences(self, sound: Facts) -> list[str]:
        """Name what differs from the sound file."""
        found = []
        if len(self.floors) != len(sound.floors) or any(
            abs(high - its_high) > HEIGHT_M or abs(area - its_area) > _AREA_SHARE * its_area
            for (high, area), (its_high, its_area) in zip(self.floors, sound.floors, strict=True)
        ):
            found.append(f"floors {self.floors} for {sound.floors}")
        for name, mine, its in (
            ("rooms", self.rooms, sound.rooms),
            ("surfaces", self.surfaces, sound.surfaces),
            ("place", {"": self.place}, {"": sound.place}),
        ):
            off = [key for key in its if not _are_close(mine.get(key, ()), its[key])]
            if off:
                found.append(f"{name} ({len(off)} of {len(its)}, {mine.get(off[0])} for {its[off[0]]})")
        return found


def _are_close(mine: tuple[float, ...], its: tuple[float, ...]) -> bool:
    return len(mine) == len(its) and bool(np.allclose(mine, its, rtol=1e-6, atol=HEIGHT_M))


def facts_of(path: Path) -> Facts:
    """Load a file, and find its floors."""
    scene = load_scene(path)
    report = find_floors(scene)
    origin_m = scene.vertices_m.min(axis=0)
    a, b, c = (scene.vertices_m[scene.triangles[:, k]] - origin_m for k in range(3))
    cross = np.cross(b - a, c - a)
    area_m2, volume_m3 = (
        np.bincount(scene.element_of_triangle, of_face, len(scene.elements))
        for of_face in (np.linalg.norm(cross, axis=1) / 2, (a * cross).sum(axis=1) / 6)
    )
    floors = [
        {
            "elevation_m": floor.elevation_m + scene.offset_m[2],
            "bounds": (floor.bounds_m + scene.offset_m[:2]).tolist(),
        }
        for floor in report.floors
    ]
    frame = site_frame({"scene": {"georeference": _georeference(scene)}, "floors": floors, "stations": []})
    corner_m = origin_m + scene.offset_m
    is_placed = scene.georeference is not None and scene.georeference.to_map is not None
    return Facts(
        tuple((float(floor.elevation_m + scene.offset_m[2]), float(floor.ground_area_m2)) for floor in report.floors),
        {room.source_id: tuple((room.box_m + scene.offset_m).ravel().tolist()) for room in scene.rooms},
        {
            element.source_id: both
            for element, both in zip(
                scene.elements, zip(area_m2.tolist(), volume_m3.tolist(), strict=True), strict=True
            )
            if both[0] > 0
        },
        corner_m,
        tuple(frame.to_site(corner_m[None, :])[0, :2].tolist()) if is_placed else (),
        (*scene.report.warnings, *report.warnings, *frame.warnings),
    )


def write_house(path: Path, rng: random.Random) -> None:
    """Write storeys of two rooms each, with a door between them and a cupboard, in one of the units and schemas."""
    prefix = rng.choice(("MILLI", "MILLI", None, "CENTI"))
    schema = rng.choice(("IFC4", "IFC4", "IFC2X3"))
    writer = IfcWriter(schema, prefix)
    width, depth, high = rng.uniform(8, 14), rng.uniform(6, 10), rng.uniform(2.8, 3.6)
    levels = {f"Level {i}": i * high for i in range(rng.choice((1, 2, 2, 3)))}
    origin = rng.choice(((0.0, 0.0, 0.0), (40.0, -25.0, 3.0)))
    for storey in writer.storeys(levels, origin).values():
        clear, half = high - 0.2, width / 2 - 0.3
        inner = depth - 0.6
        made = {
            name: writer.root(
                f"Ifc{kind}",
                f"{storey.Name} {name}",
                ObjectPlacement=writer.placement(at, above=storey),
                Representation=writer.shape(writer.block(size)),
            )
            for kind, name, size, at in (
                ("Wall", "South", (width, 0.3, clear), (0, 0, 0)),
                ("Wall", "North", (width, 0.3, clear), (0, depth - 0.3, 0)),
                ("Wall", "West", (0.3, inner, clear), (0, 0.3, 0)),
                ("Wall", "East", (0.3, inner, clear), (width - 0.3, 0.3, 0)),
                ("Wall", "Partition", (0.2, inner, clear), (width / 2, 0.3, 0)),
                ("OpeningElement", "Hole", (0.4, 1.0, 2.1), (width / 2 - 0.1, 2.0, 0)),
                ("Door", "Door", (0.1, 1.0, 2.1), (width / 2 + 0.05, 2.0, 0)),
                ("Slab", "Floor", (width, depth, 0.2), (0, 0, -0.2)),
                ("Slab", "Roof", (width, depth, 0.2), (0, 0, clear)),
                ("FurnishingElement", "Cupboard", (1.2, 0.6, 1.8), (1.0, 0.4, 0)),
                ("Space", "left", (half, inner, clear), (0.3, 0.3, 0)),
                ("Space", "right", (half - 0.2, inner, clear), (width / 2 + 0.2, 0.3, 0)),
            )
            if name != "Roof" or storey.Name == list(levels)[-1]
        }
        hole, rooms = made.pop("Hole"), [made.pop("left"), made.pop("right")]
        writer.relate("IfcRelVoidsElement", RelatingBuildingElement=made["Partition"], RelatedOpeningElement=hole)
        writer.relate("IfcRelFillsElement", RelatingOpeningElement=hole, RelatedBuildingElement=made["Door"])
        writer.relate("IfcRelAggregates", RelatingObject=storey, RelatedObjects=rooms)
        writer.contain(storey, *made.values())
    if schema == "IFC4" and rng.random() < 0.7:
        metre = writer.model.create_entity("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
        writer.model.create_entity(
            "IfcMapConversion",
            SourceCRS=writer.context,
            TargetCRS=writer.model.create_entity("IfcProjectedCRS", Name="EPSG:25832", MapUnit=metre),
            **_PLACE_M,
            Scale=1 / writer.per_metre,
        )
    writer.model.write(str(path))
