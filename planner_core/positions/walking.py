"""Walking: how far it is on foot between places of the free space, and along which way.

Local frame, metres. Cells of free space are gathered in blocks, and blocks are joined to those around and a knight's
move away where one can walk straight between them. In open space a way over such a graph is at most 2.8 % longer than
the straight line; places that see each other along the ground are joined straight, so that error is for ways round
corners only. Lengths follow slopes and stairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.positions.free_space import FreeSpace, half_links
from planner_core.positions.reach import Reach
from planner_core.positions.spread import NEIGHBOURS
from planner_core.progress import Progress, ProgressEvent, silent

#: Size of a block; narrower than what a body passes through.
BLOCK_M = 0.2
#: A straight walk may leave the line between its ends by this much in height: it breaks at the foot of stairs.
_OFF_LINE_M = 0.3
#: Sources of one go; bounds memory.
_SOURCES = 32
#: Corners of a way looked ahead to while it is pulled taut; it is pulled again until that changes nothing.
_AHEAD = 40
#: Directions by (dx + 1, dy + 1), -1 for no move.
_DIRECTION = np.full((3, 3), -1, dtype=np.int64)
_DIRECTION[NEIGHBOURS[:, 0] + 1, NEIGHBOURS[:, 1] + 1] = np.arange(8)


@dataclass(frozen=True)
class WalkingPath:
    """A way on the ground. points_m : (M, 3) float64, local, its corners. Empty and inf where there is none."""

    points_m: FloatArray
    length_m: float


class Walking:
    """The walking graph of what is reached: for many questions about one building."""

    def __init__(self, reach: Reach) -> None:
        self._space, self._footing = reach.space, reach.footing
        self._walkable = reach.reached_node
        self._cells = self._space.cells()
        block, self._spot = _blocks(self._space, self._walkable)
        self._block = block
        self._edges = _block_edges(self._space, self._walkable, block, self._spot)

    def distances_m(self, ground_m: FloatArray, *, progress: Progress = silent) -> FloatArray:
        """(K, K) float64: walking distances between places on the ground (K, 3), inf where one leads to no other.

        Symmetric, with a zero diagonal, and no detour is shorter than the direct way. A place where the mover has no
        room is set up from the nearest spot within arm's length, and the walk ends there: `positions.reach.Footing`.
        """
        from scipy.sparse.csgraph import dijkstra

        node, place = self._stands(ground_m)
        there = np.flatnonzero(node >= 0)
        graph = self._graph(node[there], place[there])
        n_blocks = self._spot.size
        out = np.full((node.size, node.size), np.inf)
        for start in range(0, there.size, _SOURCES):
            some = np.arange(start, min(start + _SOURCES, there.size))
            length = dijkstra(graph, directed=False, indices=n_blocks + some)
            out[there[some][:, None], there] = length[:, n_blocks:]
            progress(ProgressEvent("walking", int(some[-1]) + 1, int(there.size)))
        out = np.minimum(out, out.T)  # sums of the same lengths from either end differ in the last places
        np.fill_diagonal(out, np.where(node >= 0, 0.0, np.inf))
        return np.asarray(out)

    def from_each(self, ground_m: FloatArray) -> WalkingFrom:
        """Distances from single ones of many places (K, 3) to all of them."""
        return WalkingFrom(self, *self._stands(ground_m))

    def path(self, from_m: FloatArray, to_m: FloatArray) -> WalkingPath:
        """Shortest way between two places on the ground, (3,) each, pulled taut round the corners."""
        from scipy.sparse.csgraph import dijkstra

        none = WalkingPath(np.empty((0, 3)), float("inf"))
        node, place = self._stands(np.stack([from_m, to_m]))
        if (node < 0).any():
            return none
        n_blocks = self._spot.size
        length, before = dijkstra(self._graph(node, place), directed=False, indices=n_blocks, return_predecessors=True)
        if not np.isfinite(length[n_blocks + 1]):
            return none
        chain = [n_blocks + 1]
        while chain[-1] != n_blocks:
            chain.append(int(before[chain[-1]]))
        way = np.concatenate([self._spot, node])[chain[::-1]]
        points = self._space.position_m(self._pulled(self._edges.with_bends(way, self._block)))
        points[0], points[-1] = place
        return WalkingPath(points, float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum()))

    def _stands(self, ground_m: FloatArray) -> tuple[Int64Array, FloatArray]:
        """Node (K,) and place (K, 3) where one stands for each of places (K, 3)."""
        ground_m = np.asarray(ground_m, dtype=np.float64).reshape(-1, 3)
        node = self._footing.nodes(ground_m)
        at = self._space.position_m(np.maximum(node, 0)) if self._space.n_nodes else ground_m
        own = (np.abs(ground_m - at)[:, :2] <= 0.5 * self._space.grid.cell_m + 1e-9).all(axis=1)
        place = at.copy()
        place[own, :2] = ground_m[own, :2]
        return node, place

    def _graph(self, node: Int64Array, place: FloatArray, *, with_pairs: bool = True) -> Any:
        """Sparse lengths over the blocks and, after them, places (K, 3) at nodes (K,).

        with_pairs : places that see each other are linked straight.
        """
        from scipy.sparse import csr_array

        n_blocks, number = self._spot.size, np.arange(node.size)
        spots = self._space.position_m(self._spot)
        own = self._block[node]
        # To the place's own block, to those around that it sees, and to other places that it sees.
        near, around = self._edges.around(own)
        sees = self.sees(node[near], self._spot[around])
        a, b = np.triu_indices(node.size if with_pairs else 0, k=1)
        straight = self.sees(node[a], node[b])
        a, b = a[straight], b[straight]
        rows = [self._edges.a, n_blocks + number, n_blocks + near[sees], n_blocks + a]
        columns = [self._edges.b, own, around[sees], n_blocks + b]
        lengths = [
            self._edges.length_m,
            _length_m(place, spots[own]),
            _length_m(place[near[sees]], spots[around[sees]]),
            _length_m(place[a], place[b]),
        ]
        size = n_blocks + node.size
        # A length of zero would be no link at all.
        data = np.maximum(np.concatenate(lengths), 1e-9)
        return csr_array((data, (np.concatenate(rows), np.concatenate(columns))), shape=(size, size))

    def sees(self, node: Int64Array, other: Int64Array) -> BoolArray:
        """(M,) bool: whether one walks straight from nodes (M,) to others (M,), close to the line between them."""
        return walks_straight(self._space, self._cells, self._walkable, node, other)

    def _pulled(self, way: Int64Array) -> Int64Array:
        """Leave out nodes of a way between such as see each other, furthest first, until no more can be left out."""
        while True:
            kept, at = [int(way[0])], 0
            while at < way.size - 1:
                ahead = np.arange(at + 1, min(at + 1 + _AHEAD, way.size))
                seen = ahead[self.sees(np.full(ahead.size, way[at]), way[ahead])]
                at = int(seen[-1]) if seen.size else at + 1
                kept.append(int(way[at]))
            if len(kept) == way.size:
                return way
            way = np.array(kept, dtype=np.int64)


class WalkingFrom:
    """Walking distances among many places, a row at a time: where few of the rows are ever asked for.

    Places lie at nodes (K,), -1 for none, and (K, 3), local frame.
    """

    def __init__(self, walking: Walking, node: Int64Array, place_m: FloatArray) -> None:
        self._walking, self._node, self._place = walking, node, place_m
        self._there = np.flatnonzero(node >= 0)
        self._graph = walking._graph(node[self._there], place_m[self._there], with_pairs=False)
        self._n_blocks = self._graph.shape[0] - self._there.size

    def row(self, place: int) -> FloatArray:
        """(K,) metres from one place to all; inf where there is no way, or no ground."""
        from scipy.sparse.csgraph import dijkstra

        out = np.full(self._node.size, np.inf)
        at = int(np.searchsorted(self._there, place))
        if self._node[place] < 0:
            return out
        length = dijkstra(self._graph, directed=False, indices=self._n_blocks + at)[self._n_blocks :]
        seen = self._walking.sees(np.full(self._there.size, self._node[place]), self._node[self._there])
        straight = _length_m(self._place[[place]], self._place[self._there])
        out[self._there] = np.where(seen, np.minimum(length, straight), length)
        out[place] = 0.0
        return out


@dataclass(frozen=True)
class _Edges:
    """Links of blocks, each once. a, b : (E,) int64 blocks. length_m : (E,) float64.

    bend : (E, 2) int64, the nodes on either side of the border by which one walks where that is not straight; else -1.
    """

    n_blocks: int
    a: Int64Array
    b: Int64Array
    length_m: FloatArray
    bend: Int64Array

    def around(self, block: Int64Array) -> tuple[Int64Array, Int64Array]:
        """Pairs of an index into `block` (K,) and a block linked to it."""
        from scipy.sparse import csr_array

        shape = (self.n_blocks, self.n_blocks)
        ends = (np.concatenate([self.a, self.b]), np.concatenate([self.b, self.a]))
        links = csr_array((np.ones(ends[0].size, dtype=np.int8), ends), shape=shape)[block]
        row, column = links.nonzero()
        return row.astype(np.int64), column.astype(np.int64)

    def with_bends(self, way: Int64Array, block: Int64Array) -> Int64Array:
        """Put the nodes in by which a way of nodes crosses the borders of its blocks."""
        bent = np.flatnonzero((self.bend[:, 0] >= 0) & np.isin(self.a, block[way]) & np.isin(self.b, block[way]))
        bends = {(int(self.a[e]), int(self.b[e])): self.bend[e].tolist() for e in bent}
        out = [int(way[0])]
        for node in way[1:].tolist():
            a, b = int(block[out[-1]]), int(block[node])
            out += bends.get((a, b), bends.get((b, a), [])[::-1])
            out.append(node)
        return np.array(out, dtype=np.int64)


def walks_straight(
    space: FreeSpace, cells: Int64Array, walkable: BoolArray, node: Int64Array, other: Int64Array
) -> BoolArray:
    """(M,) bool: whether the cells on the line from nodes (M,) to others (M,) are linked and walkable.

    The line is 8-connected: no cell of it is further than half a cell from the straight line.
    """
    start, move = cells[node], cells[other] - cells[node]
    n_steps = np.abs(move).max(axis=1, initial=0)
    rise_m = space.ground_m[other] - space.ground_m[node]
    at = node.copy()
    passes = walkable[node] & walkable[other]
    before = start.copy()
    for step in range(1, int(n_steps.max(initial=0)) + 1):
        live = np.flatnonzero(passes & (step <= n_steps))
        if not live.size:
            break
        n = n_steps[live, None]
        now = start[live] + (2 * step * move[live] + n) // (2 * n)
        turn = now - before[live] + 1
        before[live] = now
        to = space.links[at[live], _DIRECTION[turn[:, 0], turn[:, 1]]].astype(np.int64)
        line_m = space.ground_m[node[live]] + rise_m[live] * (step / n_steps[live])
        good = (to >= 0) & walkable[to] & (np.abs(space.ground_m[to] - line_m) <= _OFF_LINE_M)
        at[live] = np.where(good, to, -1)
        passes[live] = good
    return np.asarray(passes & (at == other))


def _blocks(space: FreeSpace, walkable: BoolArray) -> tuple[Int64Array, Int64Array]:
    """Block (N,) of every walkable node, -1 for the others, and the node (B,) in the middle of each block.

    A block is what hangs together of the nodes in a square: two rooms that meet in one, or two storeys, are not mixed.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    cells = space.cells()
    per_side = max(1, round(BLOCK_M / space.grid.cell_m))
    square = (cells[:, 1] // per_side) * space.grid.nx + cells[:, 0] // per_side
    a, b = half_links(space.links, walkable)
    same = square[a] == square[b]
    inside = coo_array((np.ones(int(same.sum()), np.int8), (a[same], b[same])), shape=(walkable.size,) * 2)
    _, label = connected_components(inside, directed=False)
    node = np.flatnonzero(walkable)
    _, number = np.unique(label[node], return_inverse=True)
    block = np.full(walkable.size, -1, dtype=np.int64)
    block[node] = number
    count = np.maximum(np.bincount(number), 1)
    middle = np.column_stack([np.bincount(number, weights=cells[node, k]) / count for k in (0, 1)])
    off = np.round(((cells[node] - middle[number]) ** 2).sum(axis=1), 9)
    order = np.lexsort((node, off, number))
    _, first = np.unique(number[order], return_index=True)
    return block, node[order[first]]


def _block_edges(space: FreeSpace, walkable: BoolArray, block: Int64Array, spot: Int64Array) -> _Edges:
    a, b, length_m, bend = _neighbours(space, walkable, block, spot)
    cells = space.cells()
    straight = walks_straight(space, cells, walkable, spot[a], spot[b])
    place = space.position_m(spot)
    length_m = np.where(straight, _length_m(place[a], place[b]), length_m)
    bend[straight] = -1
    c, d = _knights_moves(space, a, b, spot)
    straight = walks_straight(space, cells, walkable, spot[c], spot[d])
    c, d = c[straight], d[straight]
    return _Edges(
        n_blocks=spot.size,
        a=np.concatenate([a, c]),
        b=np.concatenate([b, d]),
        length_m=np.concatenate([length_m, _length_m(place[c], place[d])]),
        bend=np.concatenate([bend, np.full((c.size, 2), -1, dtype=np.int64)]),
    )


def _neighbours(
    space: FreeSpace, walkable: BoolArray, block: Int64Array, spot: Int64Array
) -> tuple[Int64Array, Int64Array, FloatArray, Int64Array]:
    """Blocks with linked nodes: both ends, a < b, and the shortest way over a border: its length, its two nodes."""
    near, far = half_links(space.links, walkable)
    over = block[near] != block[far]
    near, far = near[over], far[over]
    turned = block[near] > block[far]
    near, far = np.where(turned, far, near), np.where(turned, near, far)
    a, b = block[near], block[far]
    at = space.position_m()
    length = _length_m(at[spot[a]], at[near]) + _length_m(at[near], at[far]) + _length_m(at[far], at[spot[b]])
    order = np.lexsort((far, near, length, b, a))
    key = a[order] * np.int64(spot.size) + b[order]
    _, first = np.unique(key, return_index=True)
    best = order[first]
    return a[best], b[best], length[best], np.column_stack([near[best], far[best]])


def _knights_moves(space: FreeSpace, a: Int64Array, b: Int64Array, spot: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Pairs of blocks, first < second, a knight's move apart with a common neighbour."""
    from scipy.sparse import csr_array

    per_side = max(1, round(BLOCK_M / space.grid.cell_m))
    square = space.cells()[spot] // per_side
    ends = (np.concatenate([a, b]), np.concatenate([b, a]))
    links = csr_array((np.ones(ends[0].size, dtype=np.int32), ends), shape=(spot.size, spot.size))
    c, d = (links @ links).nonzero()
    apart = np.sort(np.abs(square[c] - square[d]), axis=1)
    chosen = (c < d) & (apart[:, 0] == 1) & (apart[:, 1] == 2)
    order = np.lexsort((d[chosen], c[chosen]))
    return c[chosen][order].astype(np.int64), d[chosen][order].astype(np.int64)


def _length_m(a_m: FloatArray, b_m: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(((a_m - b_m) ** 2).sum(axis=1)))
