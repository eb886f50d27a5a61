"""Names in the USD stage: of stations, there and on disk, and where every element that has triangles stands.

Files, where there are several, then storeys by elevation, at most 400 siblings a parent (browsers' readers recurse over
siblings), names that USD accepts and that stay unique whatever the source called its elements.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import Int32Array, Scene, Station

MAX_SIBLINGS = 400
"""Thousands of siblings overflowed the stack of the browser's crate reader; 400 did not."""

MAX_NAME_LENGTH = 48
"""Long enough to recognise an IFC element by; revit writes names of 100 characters and more."""

BUILDING_PATH = "/Plan/Building"


@dataclass(frozen=True)
class MeshPlace:
    """An element's mesh in the stage. triangles : (K,) int32, sorted scene triangle ids."""

    element: int
    path: str
    triangles: Int32Array


def prim_name(text: str) -> str:
    """`text` as a USD identifier of ASCII letters, digits and `_`; may be empty. Not unique: add a suffix."""
    cleaned = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:MAX_NAME_LENGTH].rstrip("_")
    return f"_{cleaned}" if cleaned[:1].isdigit() else cleaned


def station_prim_names(stations: Sequence[Station]) -> tuple[str, ...]:
    """Prim and file names, unique also where letters' case does not count; `S001` stays `S001`."""
    return prim_names_of_ids([station.id for station in stations])


def prim_names_of_ids(ids: Sequence[str]) -> tuple[str, ...]:
    """`station_prim_names` of stations with these ids."""
    names: list[str] = []
    used: set[str] = set()
    for index, station_id in enumerate(ids):
        name = prim_name(station_id) or "Station"
        if name != station_id or name.lower() in used:
            name = f"{name}_{index}"
        while name.lower() in used:
            name = f"{name}_"
        used.add(name.lower())
        names.append(name)
    return tuple(names)


def storey_prim_name(storey: int) -> str:
    """Name of a storey's prim; -1 is `Storey_none`."""
    return f"Storey_{storey}" if storey >= 0 else "Storey_none"


def file_path(scene: Scene, number: int) -> str:
    """Path of the prim that holds a file's elements; the building itself where the scene is one file."""
    if not scene.further_sources:
        return BUILDING_PATH
    return f"{BUILDING_PATH}/File_{number}_{prim_name(scene.sources[number].path.name)}".rstrip("_")


def mesh_places(scene: Scene) -> tuple[MeshPlace, ...]:
    """Give every element that has triangles its prim, ordered by file, storey (none last) and element."""
    order = np.argsort(scene.element_of_triangle, kind="stable").astype(np.int32)
    starts = np.searchsorted(scene.element_of_triangle[order], np.arange(len(scene.elements) + 1))
    used = [index for index in range(len(scene.elements)) if starts[index + 1] > starts[index]]
    by_storey: dict[tuple[int, int], list[int]] = {}
    for index in used:
        by_storey.setdefault((scene.elements[index].file, scene.elements[index].storey), []).append(index)
    places = []
    for number, storey in sorted(by_storey, key=lambda key: (key[0], key[1] < 0, key[1])):
        for rank, index in enumerate(by_storey[number, storey]):
            element = scene.elements[index]
            name = f"{prim_name(element.name) or prim_name(element.kind) or 'Element'}_{index}"
            group = f"Group_{rank // MAX_SIBLINGS:03d}"
            path = f"{file_path(scene, number)}/{storey_prim_name(storey)}/{group}/{name}"
            places.append(MeshPlace(index, path, order[starts[index] : starts[index + 1]]))
    return tuple(places)
