"""Storeys and rooms of an IFC file: names and elevations, which storey a thing is in, and IfcSpaces as closed shapes.

Input: IfcOpenShell's entities. Output: entries of the file, in its own unit, then `Storey` in metres, and the index of
a product's storey, and `Room`s in metres, the file's own frame, which no beam meets. The caller guards what reads
entities against files whose contents do not follow their schema.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array, Room, Storey

_ELEVATION_TOLERANCE_M = 0.01
"""Placement and attribute of a storey may differ by this before we say so: files round elevations to millimetres."""
_WAYS_UP = (
    ("ContainedInStructure", "RelatingStructure"),
    ("Decomposes", "RelatingObject"),
    ("Nests", "RelatingObject"),
    ("FillsVoids", "RelatingOpeningElement"),
    ("VoidsElements", "RelatingBuildingElement"),
    ("ProjectsElements", "RelatingElement"),
)
"""Inverse attribute, and the attribute of the relation that names the whole, in the order in which they are read."""
#: A shape that is thinner than this, to any side, is a plan symbol or damage, no room.
MIN_SIDE_M = 0.2
_NAMED = 3


@dataclass(frozen=True)
class StoreyEntry:
    """A storey as the file has it; heights in the file's unit."""

    id: int
    name: str
    source_id: str
    placed: float
    """NaN where nothing places it."""
    elevation: float
    """NaN where the file has none."""
    building: float
    """Height at which its building is placed."""


def storey_entries(entities: list[Any]) -> list[StoreyEntry]:
    """Storeys by file id, of the model's IfcBuildingStorey."""
    return [
        StoreyEntry(
            id=int(entity.id()),
            name=str(entity.Name or entity.LongName or f"storey {i}"),
            source_id=str(entity.GlobalId),
            placed=math.nan if entity.ObjectPlacement is None else _placement_z(entity),
            elevation=math.nan if entity.Elevation is None else float(entity.Elevation),
            building=_placement_z(_parent_building(entity)),
        )
        for i, entity in enumerate(sorted(entities, key=lambda s: int(s.id())))
    ]


def storeys_of(path: Path, entries: list[StoreyEntry], unit_m: float) -> tuple[tuple[Storey, ...], tuple[str, ...]]:
    """Storeys in the order of `entries`, elevations in metres, and warnings."""
    placed_m = np.array([s.placed for s in entries], dtype=np.float64) * unit_m
    stated_m = np.array([s.elevation for s in entries], dtype=np.float64) * unit_m
    base_m = np.array([s.building for s in entries], dtype=np.float64) * unit_m
    # Elevation counts from the building's placement.
    placed_m = np.where(np.isnan(placed_m), np.nan_to_num(stated_m) + base_m, placed_m)
    elevation_m, warnings = _choose_elevations(path, [s.name for s in entries], placed_m, stated_m, base_m)
    storeys = tuple(
        Storey(s.name, s.source_id, height_m) for s, height_m in zip(entries, elevation_m.tolist(), strict=True)
    )
    return storeys, warnings


def storey_of(product: Any, storey_of_id: dict[int, int]) -> int:
    """Index of the storey a product is in: walk up from parts to wholes, fillings to hosts, spaces to storeys."""
    seen: set[int] = set()
    entity = product
    while entity is not None and entity.id() not in seen:
        if entity.id() in storey_of_id:
            return storey_of_id[entity.id()]
        seen.add(entity.id())
        entity = _parent(entity)
    return -1


def rooms_of(
    spaces: list[tuple[Any, int]], shapes: Iterator[tuple[int, FloatArray, Int64Array]]
) -> tuple[tuple[Room, ...], list[str]]:
    """Rooms in the order of `spaces`, and the titles of those without a usable shape.

    Parameters
    ----------
    spaces
        IfcSpace and index of its storey.
    shapes
        Space id, vertices (V, 3) in metres, triangles (T, 3); several of one space are joined.
    """
    by_id: dict[int, list[tuple[FloatArray, Int64Array]]] = {}
    for space_id, vertices, triangles in shapes:
        by_id.setdefault(space_id, []).append((vertices, triangles))
    rooms, without = [], []
    for space, storey in spaces:
        parts = sorted(by_id.get(int(space.id()), []), key=lambda part: (part[0].tobytes(), part[1].tobytes()))
        room = _room(space, storey, parts)
        if np.isfinite(room.vertices_m).all() and (room.box_m[1] - room.box_m[0] >= MIN_SIDE_M).all():
            rooms.append(room)
        else:
            without.append(room.title)
    return tuple(rooms), without


def without_shape(name: str, titles: list[str]) -> tuple[str, ...]:
    """A line for the user about rooms that were left out."""
    if not titles:
        return ()
    more = f" and {len(titles) - _NAMED} more" if len(titles) > _NAMED else ""
    noun = "room has" if len(titles) == 1 else "rooms have"
    return (f"{name}: {len(titles)} {noun} no usable shape and can't be named in results: "
            f"{', '.join(titles[:_NAMED])}{more}.",)  # fmt: skip


def _choose_elevations(
    path: Path, names: list[str], placed_m: FloatArray, stated_m: FloatArray, base_m: FloatArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """Elevations from the placements, where the geometry is; from the attribute where placements say nothing.

    The attribute counts from the building's reference, so it may differ from the placement by the building's
    own height.
    """
    several = placed_m.size > 1 and np.isfinite(stated_m).all()
    if several and np.ptp(placed_m) < _ELEVATION_TOLERANCE_M < np.ptp(stated_m):
        warning = f"{path.name}: all its storeys are placed at one height, so their Elevation attributes are used."
        return stated_m + base_m, (warning,)
    off_m = np.abs(placed_m - stated_m)
    off_building_m = np.abs(placed_m - base_m - stated_m)
    warnings = [
        f"{path.name}: storey {names[i]} is placed at {placed_m[i]:.3f} m and its Elevation is "
        f"{stated_m[i]:.3f} m: "
        "the placement is used."
        for i in np.flatnonzero((off_m > _ELEVATION_TOLERANCE_M) & (off_building_m > _ELEVATION_TOLERANCE_M))
    ]
    return placed_m, tuple(warnings)


def _placement_z(entity: Any) -> float:
    """Height of an entity's placement, in the file's unit."""
    from ifcopenshell.util.placement import get_local_placement

    if entity is None or entity.ObjectPlacement is None:
        return 0.0
    return float(get_local_placement(entity.ObjectPlacement)[2, 3])


def _parent_building(storey: Any) -> Any:
    """The IfcBuilding above a storey; None where there is none."""
    parent, seen = _parent(storey), {storey.id()}
    while parent is not None and not parent.is_a("IfcBuilding"):
        if parent.id() in seen:  # the file has it inside itself
            return None
        seen.add(parent.id())
        parent = _parent(parent)
    return parent


def _parent(entity: Any) -> Any:
    for inverse, whole in _WAYS_UP:
        for relation in getattr(entity, inverse, None) or ():
            return getattr(relation, whole)
    return None


def _room(space: Any, storey: int, parts: list[tuple[FloatArray, Int64Array]]) -> Room:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return Room(
        name=str(space.Name or ""),
        long_name=str(space.LongName or ""),
        source_id=str(space.GlobalId),
        storey=storey,
        vertices_m=np.concatenate([np.zeros((0, 3)), *(vertices for vertices, _ in parts)]),
        triangles=np.concatenate(
            [
                np.zeros((0, 3), dtype=np.int32),
                *(part + start for (_, part), start in zip(parts, first, strict=False)),
            ]
        ).astype(np.int32),
    )
