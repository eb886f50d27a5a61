"""Occupancy grids for robots: one a floor, as the PNG and YAML pair that ROS's map_server and its followers read.

Input a `Survey` and its `Reach` (local frame, metres), output an `OccupancyMap` a sheet, and its two files. Free is
every cell that can be stepped on, however near to walls: robots keep the distance of their own body. Occupied is what
stands between step and head height above the floor, hollows that nobody gets into (walls are hollow in models), and
every edge of free ground, a drop like a wall: of two free neighbours a step leads from each to the other. The rest is
unknown.

    pixel 254 free, 0 occupied, 205 unknown; row 0 of the picture is the highest y, and `origin` the lower left corner

Source of the convention: the ROS wiki's page of map_server, "Map format"; thresholds as its map_saver writes them, by
which nav2 distinguishes 205 from free too (ros-navigation/navigation2 pull request 5278).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.model import BoolArray, FloatArray, Floor, Int32Array, Int64Array, Survey, UInt8Array
from planner_core.positions.free_space import NEIGHBOURS, FreeSpace, components, number_among
from planner_core.positions.reach import Reach
from planner_core.positions.solids import footprints

# ---------------------------------------------------------------------------------------------------------- map sheets
# Map sheets: which picture shows which ground, so that no cell of one stands for two heights.
# Input a `FreeSpace`, output for each node the number of a sheet. Every floor has a sheet. Where a flight climbs over
# ground of its own floor, the part above is cut off along a riser and drawn in the well of the floor above, as in
# architects' plans; what has no room there, such as a gallery on the top floor, has a sheet of its own.
#     sheet F1          o-o-o  o-o-o-o
#                    o-o            the upper part of the flight, cut where one walks below it
#     sheet F0    o-o
#               o-o  |  o-o-o-o-o

#: Treads are level to this.
_LEVEL_M = 0.01


@dataclass(frozen=True, eq=False)
class MapSheets:
    """floor : of each sheet, index into the survey's. over : it shows what lies over other ground of its floor only.

    of_node : (N,) int32, the sheet that shows a node of the free space; -1 for nodes that no sheet shows.
    """

    floor: tuple[int, ...]
    over: tuple[bool, ...]
    of_node: Int32Array

    def name(self, sheet: int, floors: tuple[Floor, ...]) -> str:
        """`F0`; of what lies over it `F0-over`, and over that `F0-over-2`."""
        before = sum(self.over[k] and self.floor[k] == self.floor[sheet] for k in range(sheet))
        more = "" if not self.over[sheet] else "-over" if not before else f"-over-{before + 1}"
        return floors[self.floor[sheet]].id + more


def map_sheets(space: FreeSpace, floors: tuple[Floor, ...], shown: BoolArray) -> MapSheets:
    """Give every node that is `shown` (N,) bool a sheet on which its cell has no other node."""
    layer = np.zeros(space.n_nodes, dtype=np.int64)
    for floor in range(len(floors)):
        here = shown & (space.floor == floor)
        while (lifted := _lifted(space, here)).any():
            layer[lifted] += 1
            here = lifted
    of_node = np.where(shown, space.floor, -1).astype(np.int32)
    floor_of, over = list(range(len(floors))), [False] * len(floors)
    for floor in range(len(floors)):
        for number in range(1, int(layer[space.floor == floor].max(initial=0)) + 1):
            nodes = np.flatnonzero((space.floor == floor) & (layer == number))
            sheet = _well_above(space, floors, of_node, floor, nodes) if number == 1 else None
            if sheet is None:
                sheet = len(floor_of)
                floor_of.append(floor)
                over.append(True)
            of_node[nodes] = sheet
    return MapSheets(tuple(floor_of), tuple(over), of_node)


def _lifted(space: FreeSpace, here: BoolArray) -> BoolArray:
    """(N,) bool: of nodes `here`, those that share a cell with one that stays, and the flights from there on.

    The floor's own ground stays, else the lowest.
    """
    node = np.flatnonzero(here)
    order = node[np.lexsort((node, ~space.on_ground[node], space.column[node]))]
    leaves = np.zeros(order.size, dtype=bool)
    leaves[1:] = space.column[order][1:] == space.column[order][:-1]
    first = np.maximum.accumulate(np.where(leaves, 0, np.arange(order.size)))
    leaving, staying = order[leaves], order[first][leaves]
    out = np.zeros(space.n_nodes, dtype=bool)
    out[leaving] = True
    flight = components(space.links, here & ~space.on_ground)
    n_flights = int(flight.max(initial=-1)) + 1
    for up in (1.0, -1.0):
        height_m = up * space.ground_m
        cut_m = np.full(n_flights + 1, np.inf)  # the last one is for -1, what is no flight
        some = leaving[(height_m[leaving] > height_m[staying]) & (flight[leaving] >= 0)]
        np.minimum.at(cut_m, flight[some], height_m[some])
        out |= height_m >= cut_m[flight] - _LEVEL_M
    return out


def _well_above(
    space: FreeSpace, floors: tuple[Floor, ...], of_node: Int32Array, floor: int, nodes: Int64Array
) -> int | None:
    """Return the floor above where nodes (K,), over ground of `floor`, meet no ground; None where they would."""
    elevation_m = np.array([each.elevation_m for each in floors])
    higher = np.flatnonzero(elevation_m > elevation_m[floor])
    if not higher.size or float(space.ground_m[nodes].min()) <= elevation_m[floor]:
        return None
    above = int(higher[np.argmin(elevation_m[higher])])
    taken = space.column[of_node == above]
    return None if np.isin(space.column[nodes], taken).any() else above


# ----------------------------------------------------------------------------------------------------------- occupancy
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
#: An occupancy of (255 - 205) / 255 = 0.19608 is between the two: unknown.
OCCUPIED_THRESHOLD, FREE_THRESHOLD = 0.65, 0.196
_PNG_LEVEL = 9


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """One sheet. cells : (ny, nx) uint8 of `FREE`, `OCCUPIED`, `UNKNOWN`, row 0 the lowest y. Local frame, metres.

    name : of its files. low_m : (2,) float64, the lower left corner of the lower left cell. over : it shows only what
    lies over other ground of its floor.
    """

    name: str
    floor: int
    over: bool
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


def occupancy_maps(survey: Survey, space: FreeSpace, sheets: MapSheets) -> tuple[OccupancyMap, ...]:
    """Lay the free space out as maps, one a sheet, all on one grid."""
    standing = _standing(survey, space)
    nothing = np.zeros_like(standing[0])
    maps = []
    for sheet, (floor, over) in enumerate(zip(sheets.floor, sheets.over, strict=True)):
        solid = nothing if over else standing[floor] | _hollow(space, sheets, floor)
        cells = _cells_of(space, sheets.of_node == sheet, solid).reshape(space.grid.ny, space.grid.nx)
        name = sheets.name(sheet, survey.floors)
        maps.append(OccupancyMap(name, floor, over, cells, space.grid.low_m, space.grid.cell_m))
    return tuple(maps)


def entered(reach: Reach) -> BoolArray:
    """(N,) bool: nodes joined to one where the carrier can stand, but for those inside solids and cupboards."""
    space, unreachable = reach.space, {id(region) for region in reach.unreachable}
    is_room = np.array([*(region.reached or id(region) in unreachable for region in reach.regions), False])
    label = components(space.links, np.ones(space.n_nodes, dtype=bool))
    stands = np.zeros(int(label.max(initial=-1)) + 1, dtype=bool)
    stands[label[is_room[reach.region]]] = True
    return stands[label]


def _hollow(space: FreeSpace, sheets: MapSheets, floor: int) -> BoolArray:
    """(C,) bool: columns with ground of a floor that nobody gets to."""
    out = np.zeros(space.grid.nx * space.grid.ny, dtype=bool)
    out[space.column[(space.floor == floor) & (sheets.of_node < 0)]] = True
    return out


def _cells_of(space: FreeSpace, here: BoolArray, solid: BoolArray) -> UInt8Array:
    """(C,) uint8 of the sheet of nodes `here`; `solid` is what stands there."""
    cells = np.full(solid.size, UNKNOWN, dtype=np.uint8)
    cells[solid] = OCCUPIED
    cells[_ground_beyond(space, here)] = UNKNOWN
    cells[_edges(space, here)] = OCCUPIED
    cells[space.column[here]] = FREE
    cells[space.column[_below_ledges(space, here)]] = OCCUPIED
    return cells


def beside(space: FreeSpace, node: Int64Array, direction: int) -> tuple[Int64Array, Int64Array]:
    """Return those of nodes (K,) whose neighbour, by `NEIGHBOURS`, is on the grid, and its column."""
    grid = space.grid
    dx, dy = NEIGHBOURS[direction].tolist()
    x, y = space.column[node] % grid.nx + dx, space.column[node] // grid.nx + dy
    inside = (x >= 0) & (x < grid.nx) & (y >= 0) & (y < grid.ny)
    return node[inside], (y * grid.nx + x)[inside]


def _edges(space: FreeSpace, here: BoolArray) -> BoolArray:
    """(C,) bool: columns next to nodes `here` that no step leads to."""
    out = np.zeros(space.grid.nx * space.grid.ny, dtype=bool)
    for direction in range(NEIGHBOURS.shape[0]):
        _, column = beside(space, np.flatnonzero(here & (space.links[:, direction] < 0)), direction)
        out[column] = True
    return out


def _below_ledges(space: FreeSpace, here: BoolArray) -> Int64Array:
    """(K,) nodes `here` beside a higher one of them to which no step leads.

    That is the floor beside a flight, a podium or a landing, and what lies before the underside of stairs. The lower
    one is taken: nobody's body has its middle there, while a flight keeps its full width.
    """
    nodes = np.flatnonzero(here)
    lower = []
    for direction in range(NEIGHBOURS.shape[0]):
        node, column = beside(space, nodes, direction)
        some, at = number_among(space.column[nodes], column)
        node, other = node[some], nodes[at]
        apart = space.links[node, direction] != other
        lower.append(node[apart & (space.ground_m[node] < space.ground_m[other])])
    return np.concatenate(lower)


def _ground_beyond(space: FreeSpace, here: BoolArray) -> BoolArray:
    """(C,) bool: columns of another sheet's ground that one steps onto from this one: a stair goes on there."""
    out = np.zeros(space.grid.nx * space.grid.ny, dtype=bool)
    to = space.links[here]
    to = to[to >= 0]
    out[space.column[to[~here[to]]]] = True
    return out


def _standing(survey: Survey, space: FreeSpace) -> list[BoolArray]:
    """Return for each floor (C,) bool: columns with a surface between step and head height above its ground."""
    scene, carrier = survey.scene, space.carrier
    corners_m = scene.vertices_m[scene.triangles]
    if carrier.opens_doors:
        is_door = np.array([element.kind == "IfcDoor" for element in scene.elements], dtype=bool)
        corners_m = corners_m[~is_door[scene.element_of_triangle]]
    out = [np.zeros(space.grid.nx * space.grid.ny, dtype=bool) for _ in survey.floors]
    for piece in footprints(corners_m, space.grid):
        for floor, solid in zip(survey.floors, out, strict=True):
            ground_m = floor.elevation_m
            stands = (piece.high_m > ground_m + carrier.step_m) & (piece.low_m < ground_m + carrier.height_m)
            solid[piece.column[stands]] = True
    return out


def map_yaml(occupancy: OccupancyMap, image: str, remark: str) -> str:
    """Return the YAML beside `image`; `remark` is one line about the floor, as a comment."""
    x, y = (float(value) for value in occupancy.low_m)
    return (
        f"# {remark}\n"
        f"image: {image}\n"
        "mode: trinary\n"
        f"resolution: {occupancy.cell_m:.6g}\n"
        f"origin: [{x:.6f}, {y:.6f}, 0.0]\n"
        "negate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESHOLD}\n"
        f"free_thresh: {FREE_THRESHOLD}\n"
    )


def write_map(occupancy: OccupancyMap, folder: Path, remark: str) -> None:
    """Write the map's PNG and YAML, of its name, into a folder."""
    (folder / f"{occupancy.name}.png").write_bytes(grey_png(occupancy.cells[::-1]))
    (folder / f"{occupancy.name}.yaml").write_text(
        map_yaml(occupancy, f"{occupancy.name}.png", remark), encoding="utf-8"
    )


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
