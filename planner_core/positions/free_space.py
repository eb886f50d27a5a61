"""Free space: where the ground of a building can be walked, and how much room there is.

Input a `Survey` (local frame, metres) and a `Carrier`, output a `FreeSpace`. The plan is cut into cells; where there is
ground to stand on with headroom, a cell has a node, and as many as there are storeys. Nodes of neighbouring cells are
linked where the step between them can be climbed: so stairs join floors without being distinguished from them.

        o-o-o-o-o      nodes of the upper storey, linked down the flight
               o-o
                 o-o   a table ends the links: its top is no step
    o-o-o-o|x|o-o-o-o

Distances follow the links (`spread`): each node hands its nearest source on to its neighbours, so that none is reached
across a wall or another storey. On a flat floor the result is that of the exact distance transform, to rounding of the
ties; see tests/positions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from planner_core.compiled import compiled
from planner_core.errors import RequirementError
from planner_core.kept import hash_of_survey, kept
from planner_core.model import BoolArray, FloatArray, Floor, Int32Array, Int64Array, Survey
from planner_core.model.arrays import area_normals, lengths
from planner_core.positions.local_site import PERSON, Carrier, WalkingZone, blocked_by_zones, needed_height_m
from planner_core.positions.solids import Grid, Solids, find_solids
from planner_core.progress import Progress, ProgressEvent, silent

CELL_M = 0.05
#: On sites of more cells in plan, cells grow by `_grown_m`.
MAX_CELLS = 2_000_000
#: Cells that all triangles cover in plan, storeys over each other, on such sites; bounds memory while cells may grow.
_MAX_COVERED = 32_000_000
#: Cells never grow beyond this, or a wider carrier's radius: neighbouring cells still hold neighbouring treads of
#: stairs, and a doorway is passed from two cells of width on, 0.5 m, or 2.24 where it lies askew.
LARGEST_CELL_M = 0.25
#: But for this: columns and heights share one float64, true to 0.1 mm for so many; at 0.25 m they make 250 km2.
_MAX_COLUMNS = 4_000_000_000
#: Nodes taken in one go.
_CHUNK = 1_000_000
#: Clearance is measured as far as this, or two radii of the carrier.
CLEARANCE_CAP_M = 1.0
#: Heights as stated include their limit: a riser of 0.2 m is a step of 0.2 m.
_SLACK_M = 1e-3
#: A landing this little below a floor is of that floor.
_BELOW_FLOOR_M = 0.3
_MARGIN_M = 1.0
#: Steps to the eight neighbours: even numbers along the axes, odd ones diagonal, counter-clockwise from +x.
NEIGHBOURS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], dtype=np.int64)


@dataclass(frozen=True)
class FloorMap:
    """One floor's free space as pictures, row iy, column ix of the grid; the lowest node where cells have several.

    Stairs are in it as far as a plan of the floor shows them: up to head height.

    ground_m, headroom_m, clearance_m : (ny, nx) float64, NaN where there is no node. can_stand : (ny, nx) bool.
    """

    ground_m: FloatArray
    headroom_m: FloatArray
    clearance_m: FloatArray
    can_stand: BoolArray


@dataclass(frozen=True)
class FreeSpace:
    """Nodes of walkable ground, sorted by column and height. Local frame.

    column : (N,) int64 into `grid`. ground_m : (N,) float64, height of the ground. headroom_m : (N,) float64 to what
    is above, inf under open sky. clearance_m : (N,) float64, from the cell's centre to the centre of the nearest cell
    with an obstacle between step and head height, as far as the carrier could walk towards it; at most
    `clearance_cap_m`, which also stands for none. It is true to 0.71 cells.
    floor : (N,) int32 into the survey's floors, on stairs that below. on_ground : (N,) bool, ground of that floor.
    links : (N, 8) int32, neighbours by `planner_core.positions.free_space.NEIGHBOURS`; -1 none.
    can_stand : (N,) bool, with clearance for the carrier, and not kept out by a zone.
    """

    carrier: Carrier
    grid: Grid
    n_floors: int
    column: Int64Array
    ground_m: FloatArray
    headroom_m: FloatArray
    clearance_m: FloatArray
    clearance_cap_m: float
    floor: Int32Array
    on_ground: BoolArray
    links: Int32Array
    can_stand: BoolArray

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self.column.size)

    @property
    def cell_m2(self) -> float:
        """Area of a cell."""
        return self.grid.cell_m * self.grid.cell_m

    def cells(self) -> Int64Array:
        """(N, 2) plan cell (ix, iy) of every node."""
        return np.column_stack([self.column % self.grid.nx, self.column // self.grid.nx])

    def position_m(self, node: Int64Array | slice = slice(None)) -> FloatArray:
        """(K, 3) float64, local: places of nodes on the ground, their cells' centres."""
        return np.column_stack([self.grid.centre_m(self.column[node]), self.ground_m[node]])

    def node_below(self, place_m: FloatArray) -> int:
        """Find the highest node of the cell that a place (3,) is over, not above it; -1 where there is none."""
        ix, iy = self.grid.index_of(place_m[None, :2])[0].tolist()
        if not (0 <= ix < self.grid.nx and 0 <= iy < self.grid.ny):
            return -1
        column = iy * self.grid.nx + ix
        first, end = np.searchsorted(self.column, [column, column + 1]).tolist()
        under = int(np.count_nonzero(self.ground_m[first:end] <= place_m[2] + _SLACK_M))
        return first + under - 1 if under else -1

    def floor_map(self, floor: int, *, every: int = 1) -> FloorMap:
        """Lay the nodes of one floor out as pictures; of each `every` x `every` cells the one in the middle."""
        here = self.floor == floor
        ground_m = float(np.median(self.ground_m[here & self.on_ground])) if (here & self.on_ground).any() else np.inf
        node = np.flatnonzero(here & (self.on_ground | (self.ground_m < ground_m + self.carrier.height_m)))
        _, lowest = np.unique(self.column[node], return_index=True)
        node, first = node[lowest], every // 2
        iy, ix = self.column[node] // self.grid.nx, self.column[node] % self.grid.nx
        shown = (iy % every == first) & (ix % every == first)
        node, at = node[shown], (iy[shown] // every, ix[shown] // every)
        shape = (len(range(first, self.grid.ny, every)), len(range(first, self.grid.nx, every)))
        pictures = []
        for values in (self.ground_m, self.headroom_m, self.clearance_m):
            picture = np.full(shape, np.nan)
            picture[at] = values[node]
            pictures.append(picture)
        can_stand = np.zeros(shape, dtype=bool)
        can_stand[at] = self.can_stand[node]
        return FloorMap(pictures[0], pictures[1], pictures[2], can_stand)


def free_space(
    survey: Survey,
    carrier: Carrier = PERSON,
    *,
    zones: tuple[WalkingZone, ...] = (),
    cell_m: float = CELL_M,
    known: FreeSpace | None = None,
    progress: Progress = silent,
) -> FreeSpace:
    """Find where `carrier` can walk, on all floors and the stairs between them.

    Surfaces that no ground of a floor is linked to (table tops, roofs) have no nodes. `cell_m` grows on sites of more
    than `MAX_CELLS` cells, to `LARGEST_CELL_M` or the carrier's radius; `FreeSpace.grid` has it. `known` is a space of
    this survey without zones, of whichever carrier.

    Raises
    ------
    RequirementError
        A cell size that is no length, a zone on a floor that is not there, or no floors at all.
    """
    _check(survey, zones, cell_m)
    if known is not None and known.carrier == carrier:
        excluded = blocked_by_zones(zones, known.grid.centre_m(known.column), known.floor)
        return replace(known, can_stand=known.can_stand & ~excluded)
    without = ("patches", "template", "scanner", "scan_mode", "reflectivity", "scope")
    return kept(
        "free-space",
        [hash_of_survey(survey, without=without), carrier, list(zones), cell_m],
        lambda: _found(survey, carrier, zones, cell_m, progress),
        classes=(FreeSpace, Carrier, Grid),
        progress=progress,
        done=ProgressEvent("free space", 3, 3),
    )


def _found(
    survey: Survey, carrier: Carrier, zones: tuple[WalkingZone, ...], cell_m: float, progress: Progress
) -> FreeSpace:
    """See `free_space`."""
    progress(ProgressEvent("free space", 0, 3, "solids"))
    corners_m, level, ground_floor = _obstacles(survey, carrier)
    grid = _grid_over(survey.floors, corners_m, cell_m, carrier.radius_m)
    solids = find_solids(corners_m, level, ground_floor, grid, step_m=carrier.step_m)
    progress(ProgressEvent("free space", 1, 3, "links"))
    node, links = _walkable(carrier, solids, grid)
    progress(ProgressEvent("free space", 2, 3, "clearance"))
    cap_m = max(CLEARANCE_CAP_M, 2.0 * carrier.radius_m)
    column, ground_m = solids.column[node], solids.top_m[node]
    head_m = ground_m + needed_height_m(carrier, solids.ground_floor[node]) - _SLACK_M
    body_m = (ground_m + carrier.step_m + _SLACK_M, head_m)
    clearance_m = _clearance_m(solids, grid, column, body_m, links, cap_m)
    floor = _floor_of(survey.floors, solids.ground_floor[node], ground_m)
    excluded = blocked_by_zones(zones, grid.centre_m(column), floor)
    progress(ProgressEvent("free space", 3, 3))
    return FreeSpace(
        carrier=carrier,
        grid=grid,
        n_floors=len(survey.floors),
        column=column,
        ground_m=ground_m,
        headroom_m=solids.headroom_m()[node],
        clearance_m=clearance_m,
        clearance_cap_m=cap_m,
        floor=floor,
        on_ground=solids.ground_floor[node] >= 0,
        links=links,
        can_stand=(clearance_m >= carrier.radius_m) & ~excluded,
    )


def components(links: Int32Array, among: BoolArray, *, within: Int64Array | None = None) -> Int32Array:
    """(N,) int32: number of the connected component, by the least node in it; -1 for nodes that are not `among`.

    within : (N,) numbers; only links between nodes of the same number count.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    # Rows of 32 bit numbers: this graph takes more memory than all else in free space.
    count, parts = [np.zeros(1, np.int32)], [np.empty(0, np.int32)]
    for start in range(0, among.size, _CHUNK):
        to = links[start : start + _CHUNK, :4]
        kept = (to >= 0) & among[start : start + _CHUNK, None] & among[to]
        if within is not None:
            kept &= within[start : start + _CHUNK, None] == within[to]
        count.append(kept.sum(axis=1, dtype=np.int32))
        parts.append(to[kept])
    to = np.concatenate(parts)
    ends = np.cumsum(np.concatenate(count), dtype=np.int32)
    graph = csr_array((np.ones(to.size), to, ends), shape=(among.size, among.size))
    _, label = connected_components(graph, directed=False)
    out = np.full(among.size, -1, dtype=np.int32)
    _, first, number = np.unique(label[among], return_index=True, return_inverse=True)
    rank = np.empty(first.size, dtype=np.int32)
    rank[np.argsort(first)] = np.arange(first.size, dtype=np.int32)
    out[among] = rank[number]
    return out


def half_links(
    links: Int32Array, among: BoolArray, *, between: Int64Array | None = None
) -> tuple[Int64Array, Int64Array]:
    """Both ends of all links between nodes `among`, each link once.

    between : (N,) numbers; only links between nodes of different numbers.
    """
    parts = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    for start in range(0, among.size, _CHUNK):
        node, direction = np.nonzero((links[start : start + _CHUNK, :4] >= 0) & among[start : start + _CHUNK, None])
        node += start
        to = links[node, direction].astype(np.int64)
        kept = among[to]
        if between is not None:
            kept &= between[node] != between[to]
        parts.append((node[kept], to[kept]))
    node, to = (np.concatenate(ends) for ends in zip(*parts, strict=True))
    return node, to


def number_among(sorted_: Int64Array, value: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Which of values (K,) are among sorted ones (B,), as indices, and their places there."""
    at = np.searchsorted(sorted_, value)
    there = np.flatnonzero(at < sorted_.size)
    there = there[sorted_[at[there]] == value[there]]
    return there, at[there]


def spread(
    links: Int32Array, cell: Int64Array, source: Int64Array, place: FloatArray, *, reach_cells: float
) -> tuple[FloatArray, Int64Array]:
    """Find the nearest source of every node within reach.

    Parameters
    ----------
    links
        (N, 8) int32, each node's neighbour by `NEIGHBOURS`; -1 none.
    cell
        (N, 2) int64, plan cells of the nodes.
    source
        (N,) int64, the number of a source that each node starts with; -1 none.
    place
        (M, 2) float64, plan places of the sources, in cells.
    reach_cells
        Sources further than this are not searched for.

    Returns
    -------
    (N,) float64 distance in cells, inf where there is none within reach; (N,) int64 source, -1 where none.
    """
    at = cell.astype(np.float64)
    owner = source.copy()
    best = np.full(owner.size, np.inf)
    seeded = np.flatnonzero(owner >= 0)
    best[seeded] = ((at[seeded] - place[owner[seeded]]) ** 2).sum(axis=1)
    limit = reach_cells * reach_cells + 1e-9
    # Among nodes that are their own nearest source none has anything to offer: the rim of these is where it begins.
    done = np.append(best == 0.0, True)  # the last entry is for no neighbour, -1
    front = seeded[~(done[seeded] & done[links[seeded]].all(axis=1))]
    _hand_on(links, at, place, front, owner, best, limit)
    return np.sqrt(best), owner


def _check(survey: Survey, zones: tuple[WalkingZone, ...], cell_m: float) -> None:
    if not (math.isfinite(cell_m) and cell_m > 0):
        raise RequirementError(f"cell_m: got {cell_m:g}, expected more than 0 metres; e.g. {CELL_M:g}")
    if not survey.floors:
        raise RequirementError(
            "free space: got no floors, expected at least one; check the model's units and up axis, "
            "see `tlsplan floors`"
        )
    for zone in zones:
        if not 0 <= zone.floor < len(survey.floors):
            raise RequirementError(
                f"zone's floor: got {zone.floor}, expected an index from 0 to {len(survey.floors) - 1}; "
                "`tlsplan floors` lists the floors"
            )


def _grid_over(floors: tuple[Floor, ...], corners_m: FloatArray, cell_m: float, radius_m: float) -> Grid:
    low = np.min([floor.bounds_m[0] for floor in floors], axis=0) - _MARGIN_M
    high = np.max([floor.bounds_m[1] for floor in floors], axis=0) + _MARGIN_M
    area_m2 = float(np.prod(high - low))
    if math.sqrt(area_m2 / MAX_CELLS) > cell_m:
        grown_m = _grown_m(_covered_m2(corners_m, low, high), radius_m)
        cell_m = max(cell_m, grown_m, math.sqrt(area_m2 / _MAX_COLUMNS))
    # Off the round figures that designers align walls to: a face on a line of the grid would fill cells on both sides.
    low = low - cell_m * np.array([0.37, 0.43])
    n = np.ceil((high - low) / cell_m).astype(int)
    return Grid(low_m=low, cell_m=cell_m, nx=int(n[0]), ny=int(n[1]))


def _grown_m(covered_m2: float, radius_m: float) -> float:
    """Side of the cells of a large site, all of whose triangles cover so much in plan.

    The least whole fraction of the carrier's radius, or `LARGEST_CELL_M`, that `_MAX_COVERED` allows. Clearances of
    cells are whole numbers of them where walls lie along the grid: with other sizes, a doorway has to be wider than
    the body by up to two cells; see docs/method/free-space.md.
    """
    largest_m = max(radius_m, LARGEST_CELL_M)
    parts = max(1, int(largest_m * math.sqrt(_MAX_COVERED / max(covered_m2, 1.0))))
    fraction_m = largest_m / parts
    return fraction_m if parts * fraction_m >= radius_m else math.nextafter(fraction_m, math.inf)


def _covered_m2(corners_m: FloatArray, low_m: FloatArray, high_m: FloatArray) -> float:
    """Area in plan of triangles (K, 3, 3), each at most its bounds inside a rectangle."""
    along, aside = corners_m[:, 1, :2] - corners_m[:, 0, :2], corners_m[:, 2, :2] - corners_m[:, 0, :2]
    area_m2 = 0.5 * np.abs(along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0])
    plan_m = np.clip(corners_m[:, :, :2], low_m, high_m)
    return float(np.minimum(area_m2, np.ptp(plan_m, axis=1).prod(axis=1)).sum())


def _obstacles(survey: Survey, carrier: Carrier) -> tuple[FloatArray, BoolArray, Int32Array]:
    """Triangles (K, 3, 3) that a body meets, whether they are level, and the floor whose ground they are, or -1."""
    scene, floors = survey.scene, survey.floors
    corners_m = scene.vertices_m[scene.triangles]
    ground_floor = np.full(scene.n_triangles, -1, dtype=np.int32)
    for index, floor in enumerate(floors):
        ground_floor[floor.ground_triangles] = index
    if carrier.opens_doors:
        is_door = np.array([element.kind == "IfcDoor" for element in scene.elements], dtype=bool)
        stays = ~is_door[scene.element_of_triangle] | (ground_floor >= 0)
        corners_m, ground_floor = corners_m[stays], ground_floor[stays]
    cross = area_normals(corners_m)
    length = lengths(cross)
    level = (length > 0) & (np.abs(cross[:, 2]) >= np.cos(carrier.max_slope_rad) * length - 1e-12)
    return corners_m, level, ground_floor.astype(np.int32)


def _walkable(carrier: Carrier, solids: Solids, grid: Grid) -> tuple[Int64Array, Int32Array]:
    """Solids that are nodes, (N,), and their links (N, 8)."""
    headroom_m = solids.headroom_m()
    open_above = solids.can_stand & (headroom_m >= needed_height_m(carrier, solids.ground_floor) - _SLACK_M)
    node = np.flatnonzero(open_above)
    links = _links(solids, node, grid, carrier.step_m)
    kept = _joined_to(links, solids.ground_floor[node] >= 0)
    renumbered = np.full(node.size + 1, -1, dtype=np.int32)
    renumbered[:-1][kept] = np.arange(int(kept.sum()), dtype=np.int32)
    return node[kept], renumbered[links[kept]]


def _links(solids: Solids, node: Int64Array, grid: Grid, step_m: float) -> Int32Array:
    """Give each node its eight neighbours (N, 8): at most one step up or down; -1 where there is none."""
    column, z_m = solids.column[node], solids.top_m[node]
    links = np.full((node.size, 8), -1, dtype=np.int32)
    if not node.size:
        return links
    low_m = float(z_m.min())
    stride_m = float(z_m.max()) - low_m + 2.0 * step_m + 3.0
    key = column * stride_m + (z_m - low_m)
    reach_m = step_m + _SLACK_M
    for start in range(0, node.size, _CHUNK):
        some = slice(start, start + _CHUNK)
        ix, iy = column[some] % grid.nx, column[some] // grid.nx
        for direction, (dx, dy) in enumerate(NEIGHBOURS.tolist()):
            inside = (ix + dx >= 0) & (ix + dx < grid.nx) & (iy + dy >= 0) & (iy + dy < grid.ny)
            other = key[some] + (dy * grid.nx + dx) * stride_m
            at = np.searchsorted(key, other - reach_m)
            found = inside & (at < key.size)
            found[found] = key[at[found]] <= (other + reach_m)[found]
            links[some, direction][found] = at[found]
    return links


def _joined_to(links: Int32Array, some: BoolArray) -> BoolArray:
    """(N,) bool: nodes that links join to one of `some`."""
    label = components(links, np.ones(some.size, dtype=bool))
    joined = np.zeros(int(label.max(initial=-1)) + 1, dtype=bool)
    joined[label[some]] = True
    return joined[label]


def _clearance_m(
    solids: Solids,
    grid: Grid,
    column: Int64Array,
    body_m: tuple[FloatArray, FloatArray],
    links: Int32Array,
    cap_m: float,
) -> FloatArray:
    """(N,) distance from nodes (N,) to obstacles along the surface. body_m : the body's lowest and highest points."""
    low_m, high_m = body_m
    cell = np.column_stack([column % grid.nx, column // grid.nx])
    source = np.full(column.size, -1, dtype=np.int64)
    obstacle: Int64Array = np.empty(0, np.int64)
    for direction in (1, 3, 5, 7, 0, 2, 4, 6):  # the nearer ones, along the axes, last: they stay
        dx, dy = NEIGHBOURS[direction].tolist()
        bare = np.flatnonzero(links[:, direction] < 0)
        x, y = cell[bare, 0] + dx, cell[bare, 1] + dy
        inside = (x >= 0) & (x < grid.nx) & (y >= 0) & (y < grid.ny)
        bare, beside = bare[inside], (y * grid.nx + x)[inside]
        at = solids.first_above(beside, low_m[bare])
        stands = at >= 0
        stands[stands] = solids.bottom_m[at[stands]] < high_m[bare[stands]]
        source[bare[stands]] = obstacle.size + np.arange(int(stands.sum()))
        obstacle = np.concatenate([obstacle, beside[stands]])
    place = np.column_stack([obstacle % grid.nx, obstacle // grid.nx]).astype(np.float64)
    distance, _ = spread(links, cell, source, place, reach_cells=cap_m / grid.cell_m)
    return np.minimum(distance * grid.cell_m, cap_m)


def _floor_of(floors: tuple[Floor, ...], ground_floor: Int32Array, ground_m: FloatArray) -> Int32Array:
    """(N,) floor of each node: whose ground it is; on stairs, the highest that is not above it."""
    order = np.argsort([floor.elevation_m for floor in floors], kind="stable")
    elevation = np.array([floors[i].elevation_m for i in order])
    below = np.maximum(np.searchsorted(elevation - _BELOW_FLOOR_M, ground_m, side="right") - 1, 0)
    return np.where(ground_floor >= 0, ground_floor, order[below]).astype(np.int32)


@compiled
def _hand_on(
    links: Int32Array,
    at: FloatArray,
    place: FloatArray,
    front: Int64Array,
    owner: Int64Array,
    best: FloatArray,
    limit: float,
) -> None:
    """Hand the nearest sources of nodes `front` on to their neighbours, until none of them is nearer."""
    is_next = np.zeros(owner.size, dtype=np.bool_)
    while front.size:
        for direction in range(links.shape[1]):
            offers = owner[front]
            for nth in range(front.size):
                to, offered = links[front[nth], direction], offers[nth]
                if to < 0:
                    continue
                x, y = at[to, 0] - place[offered, 0], at[to, 1] - place[offered, 1]
                distance = x * x + y * y
                # Of equally near sources the one with the least number stays, whatever the order of visits.
                nearer = distance < best[to] or (distance == best[to] and offered < owner[to])
                if nearer and distance <= limit:
                    best[to], owner[to] = distance, offered
                    is_next[to] = True
        front = np.flatnonzero(is_next)
        is_next[front] = False
