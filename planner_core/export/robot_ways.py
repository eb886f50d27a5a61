"""A robot's ways: the legs of the walk, cut where one map goes over into another, and kept on the free cells of maps.

Legs in the scene frame, ways in the local one, metres. People who carry a scanner may step along a drop; where a leg
of theirs does, or meets cells that are not free, a robot gets a way of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from planner_core.export.chosen import RouteLeg
from planner_core.export.occupancy import FREE, MapSheets, OccupancyMap, beside
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.positions.free_space import FreeSpace, spread
from planner_core.positions.reach import Reach
from planner_core.positions.walking import Walking
from planner_core.route.route import nodes_under

#: A way whose cells keep this many cells off others stays off them with all of its line.
_LINE_CELLS = 1.5
#: For room alone no way is taken that is longer than another by this factor.
_DETOUR = 1.5


@dataclass(frozen=True, eq=False)
class WayPiece:
    """Part of a way on one map and one floor. sheet : of the map. floor : index. points_m : (M, 3) float64, local."""

    sheet: int
    floor: int
    points_m: FloatArray


@dataclass(frozen=True, eq=False)
class RobotWay:
    """A leg as a robot goes it. points_m : (M, 3) float64, local. as_planned : it is the plan's own."""

    from_id: str
    to_id: str
    points_m: FloatArray
    length_m: float
    pieces: tuple[WayPiece, ...]
    as_planned: bool

    @property
    def title(self) -> str:
        """`S001 to S002`."""
        return f"{self.from_id or 'start'} to {self.to_id or 'end'}"


@dataclass(frozen=True, eq=False)
class MappedGround:
    """What ways are laid on: the maps, one a sheet, and which node is on which."""

    reach: Reach
    sheets: MapSheets
    maps: tuple[OccupancyMap, ...]

    @property
    def space(self) -> FreeSpace:
        """The free space of all maps."""
        return self.reach.space

    def cell_of(self, node: Int64Array) -> Int32Array:
        """(N,) pixel of each of nodes (N,) on its own map; -1 for no node, or one that no map shows."""
        out = np.full(node.size, -1, dtype=np.int32)
        sheet = np.where(node >= 0, self.sheets.of_node[node], -1)
        for number, each in enumerate(self.maps):
            here = sheet == number
            out[here] = each.cells.reshape(-1)[self.space.column[node[here]]]
        return out


def robot_ways(
    ground: MappedGround, legs: tuple[RouteLeg, ...], offset_m: FloatArray
) -> tuple[tuple[RobotWay, ...], tuple[str, ...]]:
    """Cut legs that can be walked to ways on the maps, and lay those anew that leave the free cells; and remarks.

    Those that pass a drop nearer than the carrier's radius are laid anew where there is room.
    """
    ways, anew, lost = [], [], []
    off_m = _off_others_m(ground)
    rounds: tuple[Walking, ...] | None = None
    for leg in legs:
        points_m = leg.points_m - offset_m
        pieces, node = pieces_by_map(ground, points_m)
        is_free = bool((ground.cell_of(node) == FREE).all())
        planned = RobotWay(leg.from_id, leg.to_id, points_m, leg.length_m, pieces, as_planned=True)
        way: RobotWay | None = planned
        if not is_free or off_m[node].min() < _off_m(ground.space) - _LINE_CELLS * ground.space.grid.cell_m:
            rounds = _walkings(ground, off_m) if rounds is None else rounds
            way = _laid_anew(ground, rounds[:1] if is_free else rounds, planned, is_free=is_free)
        if way is None:
            lost.append(leg.title)
            continue
        ways.append(way)
        if not way.as_planned:
            anew.append(leg.title)
    remarks = []
    if anew:
        remarks.append(f"the path from {', '.join(anew)} crosses occupied cells or a drop: rerouted around them")
    if lost:
        remarks.append(f"no path on free cells of the maps leads from {', '.join(lost)}: left out of the paths")
    return tuple(ways), tuple(remarks)


def pieces_by_map(ground: MappedGround, points_m: FloatArray) -> tuple[tuple[WayPiece, ...], Int64Array]:
    """Cut corners (M, 3), local frame, M >= 2, exactly where the map changes; and nodes (K,) below it, cell by cell.

    -1 : there is no ground. A place over no ground that a map shows is of the piece before it; no pieces, none is.
    """
    corners_m, is_corner = _crossings(ground.space, points_m)
    node = nodes_under(ground.space, 0.5 * (corners_m[1:] + corners_m[:-1]))
    shown = (node >= 0) & (ground.sheets.of_node[node] >= 0)
    known = np.flatnonzero(shown)
    if not known.size:
        return (), node
    last = np.maximum.accumulate(np.where(shown, np.arange(node.size), known[0]))
    sheet, floor = ground.sheets.of_node[node[last]], ground.space.floor[node[last]]
    changes = np.flatnonzero((np.diff(sheet) != 0) | (np.diff(floor) != 0)) + 1
    pieces = []
    for start, end in zip([0, *changes.tolist()], [*changes.tolist(), node.size], strict=True):
        kept = is_corner[start : end + 1].copy()
        kept[[0, -1]] = True
        pieces.append(WayPiece(int(sheet[start]), int(floor[start]), corners_m[start : end + 1][kept]))
    return tuple(pieces), node


def _crossings(space: FreeSpace, points_m: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Corners (K, 3) of a way and, between them, all places where it passes from cell to cell; which are corners."""
    low_m, cell_m = space.grid.low_m, space.grid.cell_m
    out, is_corner = [points_m[:1]], [True]
    for a, b in pairwise(points_m):
        lines = []
        for axis in (0, 1):
            from_, to = (float(p[axis] - low_m[axis]) / cell_m for p in (a, b))
            at = np.arange(np.floor(min(from_, to)) + 1, np.ceil(max(from_, to)))
            lines.append((at - from_) / (to - from_ if to != from_ else 1.0))
        share = np.unique(np.concatenate(lines))
        share = share[(share > 1e-9) & (share < 1 - 1e-9) & (np.diff(share, prepend=-1.0) > 1e-9)]
        out += [a + (b - a) * share[:, None], b[None]]
        is_corner += [False] * share.size + [True]
    return np.concatenate(out), np.array(is_corner)


def _laid_anew(
    ground: MappedGround, rounds: tuple[Walking, ...], planned: RobotWay, *, is_free: bool
) -> RobotWay | None:
    """Return the roomiest way on free cells between a planned one's ends that is no great detour.

    That is the planned one itself where it `is_free` and no other serves. Where no way ends there, it is one that ends
    beside, at arm's length; else None.
    """
    to_ends: list[RobotWay] = []
    beside: list[RobotWay] = []
    for walking in rounds:
        path = walking.path(planned.points_m[0], planned.points_m[-1])
        if path.points_m.shape[0] < 2:
            continue
        pieces, node = pieces_by_map(ground, path.points_m)
        if not (ground.cell_of(node) == FREE).all():
            continue
        way = replace(planned, points_m=path.points_m, length_m=path.length_m, pieces=pieces, as_planned=False)
        off_m = np.abs(path.points_m[[0, -1], :2] - planned.points_m[[0, -1], :2]).max()
        (to_ends if off_m <= ground.space.grid.cell_m else beside).append(way)
    found = [*to_ends, planned] if is_free else to_ends or beside[-1:]
    least_m = min((way.length_m for way in found), default=0.0)
    return next((way for way in found if way.length_m <= _DETOUR * least_m), None)


def _off_m(space: FreeSpace) -> float:
    """Metres that ways keep off edges where there is room: the body's radius."""
    return max(space.carrier.radius_m, _LINE_CELLS * space.grid.cell_m)


def _walkings(ground: MappedGround, off_m: FloatArray) -> tuple[Walking, ...]:
    """Walking off edges: by the radius of the carrier, and as near as a line can pass without touching other cells."""
    out = []
    for keep_m in dict.fromkeys((_off_m(ground.space), _LINE_CELLS * ground.space.grid.cell_m)):
        region = np.where(off_m >= keep_m - 1e-9, ground.reach.region, -1).astype(np.int32)
        out.append(Walking(replace(ground.reach, region=region)))
    return tuple(out)


def _off_others_m(ground: MappedGround) -> FloatArray:
    """(N,) float64: from a node along the ground to the nearest cell that is not free or that no step leads to.

    inf where that is well further than ways keep off.
    """
    space = ground.space
    cell = space.cells()
    node = np.arange(space.n_nodes)
    source = np.full(space.n_nodes, -1, dtype=np.int64)
    place = []
    n_places = 0
    for direction in (1, 3, 5, 7, 0, 2, 4, 6):  # the nearer ones, along the axes, last: they stay
        bare, column = beside(space, np.flatnonzero(space.links[:, direction] < 0), direction)
        source[bare] = n_places + np.arange(bare.size)
        place.append(np.column_stack([column % space.grid.nx, column // space.grid.nx]))
        n_places += bare.size
    taken = np.flatnonzero(ground.cell_of(node) != FREE)
    source[taken] = n_places + np.arange(taken.size)
    place.append(cell[taken])
    at = np.concatenate(place).astype(np.float64)
    distance, _ = spread(space.links, cell, source, at, reach_cells=_off_m(space) / space.grid.cell_m + 1.0)
    return distance * space.grid.cell_m
