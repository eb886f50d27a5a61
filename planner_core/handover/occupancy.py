"""Occupancy grids for robots: one a floor, as the PNG and YAML pair that ROS's map_server and its followers read.

Input a `Survey` and its `Reach` (local frame, metres), output an `OccupancyMap`, and its two files. Free is every cell
that can be stepped on, however near to walls: robots keep the distance of their own body. Occupied is what stands
between step and head height above the floor, hollows that nobody gets into (walls are hollow in models), and every edge
of free ground, a drop like a wall. The rest is unknown.

    pixel 254 free, 0 occupied, 205 unknown; row 0 of the picture is the highest y, and `origin` the lower left corner

Source of the convention: the ROS wiki's page of map_server, "Map format"; thresholds as its map_saver writes them, by
which nav2 tells 205 from free too (ros-navigation/navigation2 pull request 5278).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.ground.footprints import footprints
from planner_core.ground.free_space import FreeSpace, components
from planner_core.ground.reach import Reach
from planner_core.ground.spread import NEIGHBOURS
from planner_core.model import BoolArray, FloatArray, Survey, UInt8Array

FREE, OCCUPIED, UNKNOWN = 254, 0, 205
#: An occupancy of (255 - 205) / 255 = 0.19608 is between the two: unknown.
OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
_PNG_LEVEL = 9


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """One floor. cells : (ny, nx) uint8 of `FREE`, `OCCUPIED`, `UNKNOWN`, row 0 the lowest y. Local frame, metres.

    low_m : (2,) float64, the lower left corner of the lower left cell.
    """

    floor: int
    cells: UInt8Array
    low_m: FloatArray
    cell_m: float

    def at(self, plan_m: FloatArray) -> UInt8Array:
        """(N,) uint8: cells under places (N, 2); unknown outside."""
        index = np.floor((np.asarray(plan_m) - self.low_m) / self.cell_m).astype(np.int64)
        ny, nx = self.cells.shape
        inside = ((index >= 0) & (index < [nx, ny])).all(axis=1)
        out = np.full(index.shape[0], UNKNOWN, dtype=np.uint8)
        out[inside] = self.cells[index[inside, 1], index[inside, 0]]
        return out


def occupancy_maps(survey: Survey, reach: Reach, floors: tuple[int, ...]) -> tuple[OccupancyMap, ...]:
    """Lay the free space of floors (indices) out as maps on one grid."""
    standing = _standing(survey, reach.space, floors)
    entered = _entered(reach)
    return tuple(_map_of(reach.space, entered, floor, solid) for floor, solid in zip(floors, standing, strict=True))


def _entered(reach: Reach) -> BoolArray:
    """(N,) bool: nodes that are joined to one where the mover can stand, but for those inside solids and cupboards."""
    space, sealed = reach.space, {id(region) for region in reach.sealed}
    is_room = np.array([*(region.reached or id(region) in sealed for region in reach.regions), False])
    label = components(space.links, np.ones(space.n_nodes, dtype=bool))
    stands = np.zeros(int(label.max(initial=-1)) + 1, dtype=bool)
    stands[label[is_room[reach.region]]] = True
    return stands[label]


def _map_of(space: FreeSpace, entered: BoolArray, floor: int, solid: BoolArray) -> OccupancyMap:
    on_floor = space.floor == floor
    here = on_floor & entered
    cells = np.full(solid.size, UNKNOWN, dtype=np.uint8)
    cells[solid | _edges(space, here)] = OCCUPIED
    cells[space.column[on_floor & ~entered]] = OCCUPIED
    cells[_ground_beyond(space, here)] = UNKNOWN
    cells[space.column[here]] = FREE
    grid = space.grid
    return OccupancyMap(floor, cells.reshape(grid.ny, grid.nx), grid.low_m, grid.cell_m)


def _edges(space: FreeSpace, here: BoolArray) -> BoolArray:
    """(C,) bool: columns next to nodes `here` that no step leads to."""
    out = np.zeros(space.grid.nx * space.grid.ny, dtype=bool)
    cell = space.cells()
    for direction, (dx, dy) in enumerate(NEIGHBOURS.tolist()):
        node = np.flatnonzero(here & (space.links[:, direction] < 0))
        x, y = cell[node, 0] + dx, cell[node, 1] + dy
        inside = (x >= 0) & (x < space.grid.nx) & (y >= 0) & (y < space.grid.ny)
        out[(y * space.grid.nx + x)[inside]] = True
    return out


def _ground_beyond(space: FreeSpace, here: BoolArray) -> BoolArray:
    """(C,) bool: columns of another floor's ground that one steps onto from this one: a stair goes on there."""
    out = np.zeros(space.grid.nx * space.grid.ny, dtype=bool)
    to = space.links[here]
    to = to[to >= 0]
    out[space.column[to[~here[to]]]] = True
    return out


def _standing(survey: Survey, space: FreeSpace, floors: tuple[int, ...]) -> list[BoolArray]:
    """Return for each floor (C,) bool: columns with a surface between step and head height above its ground."""
    scene, mover = survey.scene, space.mover
    corners_m = scene.vertices_m[scene.triangles]
    if mover.opens_doors:
        is_door = np.array([element.kind == "IfcDoor" for element in scene.elements], dtype=bool)
        corners_m = corners_m[~is_door[scene.element_of_triangle]]
    out = [np.zeros(space.grid.nx * space.grid.ny, dtype=bool) for _ in floors]
    for piece in footprints(corners_m, space.grid):
        for floor, solid in zip(floors, out, strict=True):
            ground_m = survey.floors[floor].elevation_m
            stands = (piece.high_m > ground_m + mover.step_m) & (piece.low_m < ground_m + mover.height_m)
            solid[piece.column[stands]] = True
    return out


def map_yaml(occupancy: OccupancyMap, image: str, said: str) -> str:
    """Return the YAML beside `image`; `said` is one line about the floor, as a comment."""
    x, y = (float(value) for value in occupancy.low_m)
    return (
        f"# {said}\n"
        f"image: {image}\n"
        "mode: trinary\n"
        f"resolution: {occupancy.cell_m:.6g}\n"
        f"origin: [{x:.6f}, {y:.6f}, 0.0]\n"
        "negate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESHOLD}\n"
        f"free_thresh: {FREE_THRESHOLD}\n"
    )


def write_map(occupancy: OccupancyMap, folder: Path, name: str, said: str) -> None:
    """Write `name`.png and `name`.yaml into a folder."""
    (folder / f"{name}.png").write_bytes(grey_png(occupancy.cells[::-1]))
    (folder / f"{name}.yaml").write_text(map_yaml(occupancy, f"{name}.png", said), encoding="utf-8")


def grey_png(picture: UInt8Array) -> bytes:
    """Return a picture (ny, nx), row 0 on top, as a PNG of 8 bits of grey; no clock, no names in it."""
    ny, nx = picture.shape
    rows = np.zeros((ny, nx + 1), dtype=np.uint8)  # each row opens with its filter: none
    rows[:, 1:] = picture
    header = struct.pack(">IIBBBBB", nx, ny, 8, 0, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), _PNG_LEVEL)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunks(parts))


def _chunks(parts: tuple[tuple[bytes, bytes], ...]) -> Iterator[bytes]:
    for kind, content in parts:
        yield struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
