"""Map sheets: which picture shows which ground, so that no cell of one stands for two heights.

Input a `FreeSpace`, output for each node the number of a sheet. Every floor has a sheet. Where a flight climbs over
ground of its own floor, the part above is cut off along a riser and drawn in the well of the floor above, as in
architects' plans; what has no room there, such as a gallery on the top floor, has a sheet of its own.

    sheet F1          o-o-o  o-o-o-o
                   o-o            the upper part of the flight, cut where one walks below it
    sheet F0    o-o
              o-o  |  o-o-o-o-o
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Floor, Int32Array, Int64Array
from planner_core.positions.free_space import FreeSpace, components

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
