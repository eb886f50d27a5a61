"""Walking: how far it is on foot between places of the free space, and along which way.

Local frame, metres. Cells of free space are gathered in blocks, and blocks are joined to those around and a knight's
move away where one can walk straight between them. In open space a way over such a graph is at most 2.8 % longer than
the straight line; places that see each other along the ground are joined straight, so that error is for ways round
corners only. Lengths follow slopes and stairs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner_core.compiled import compiled
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.positions.free_space import NEIGHBOURS, FreeSpace, components, half_links, number_among
from planner_core.positions.reach import Reach
from planner_core.progress import Progress, ProgressEvent, silent

#: Size of a block, narrower than what a body passes through; where that is no two cells, a block has two along a side:
#: blocks of one such cell would be four times as many, and lengths no truer, see docs/method/free-space.md.
BLOCK_M, _LEAST_PER_SIDE = 0.2, 2
#: A straight walk may leave the line between its ends by this much in height: it breaks at the foot of stairs.
_OFF_LINE_M = 0.3
#: Sources of one go; bounds memory.
_SOURCES = 32
#: Blocks whose neighbours' neighbours are examined in one go; bounds memory.
_ROWS = 200_000
#: Links over borders of blocks, of which the shortest are taken in one go; bounds memory.
_PAIRS = 1_000_000
#: A way is first searched for up to so many times the straight line's length, and so much more.
_FIRST_DETOUR, _FIRST_MORE_M = 1.2, 1.0
#: Blocks are found in stripes along x, of this width.
_STRIPE_M = 5.0
#: Rounding of sums of lengths.
_SLACK_M = 1e-6
#: Corners of a way examined ahead while it is pulled taut; it is pulled again until that changes nothing.
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
        self._spot_m = self._space.position_m(self._spot)
        stripe = np.floor(self._spot_m[:, 1] / _STRIPE_M)
        order = np.lexsort((self._spot_m[:, 0], stripe))
        self._stripes = order, stripe[order], self._spot_m[order, 0]

    def distances_m(self, ground_m: FloatArray, *, progress: Progress = silent) -> FloatArray:
        """(K, K) float64: walking distances between places on the ground (K, 3), inf where one leads to no other.

        Symmetric, with a zero diagonal, and no detour is shorter than the direct way. A place where the carrier has no
        room is set up from the nearest spot within arm's length, and the walk ends there: `positions.reach.Footing`.
        """
        node, place = self._stands(ground_m)
        out = np.full((node.size, node.size), np.inf)
        n_done, n_there = 0, int(np.count_nonzero(node >= 0))
        for stops in self._by_part(node):
            for some, length_m in self._rows(node[stops], place[stops]):
                out[stops[some][:, None], stops] = length_m
                n_done += some.size
                progress(ProgressEvent("walking", n_done, n_there))
        out = np.minimum(out, out.T)  # sums of the same lengths from either end differ in the last places
        np.fill_diagonal(out, np.where(node >= 0, 0.0, np.inf))
        return np.asarray(out)

    def parts(self, ground_m: FloatArray) -> list[Int64Array]:
        """Places on the ground (K, 3), by number, of each part that ways join; parts by their first place."""
        return self._by_part(self._stands(ground_m)[0])

    def _by_part(self, node: Int64Array) -> list[Int64Array]:
        there = np.flatnonzero(node >= 0)
        _, first, part = np.unique(self._edges.part[self._block[node[there]]], return_index=True, return_inverse=True)
        order = np.argsort(first[part], kind="stable")
        return np.split(there[order], np.cumsum(np.bincount(part)[np.argsort(first)]))[:-1]

    def _rows(self, node: Int64Array, place: FloatArray) -> Iterator[tuple[Int64Array, FloatArray]]:
        """Some of the places (K, 3) of one part at a time, and their distances (M, K) to all of them."""
        from scipy.sparse.csgraph import dijkstra

        blocks = self._edges.blocks_of(int(self._block[node[0]]))
        graph = self._graph(node, place, blocks=blocks)
        for start in range(0, node.size, _SOURCES):
            some = np.arange(start, min(start + _SOURCES, node.size))
            length = dijkstra(graph, directed=False, indices=blocks.size + some)
            yield some, length[:, blocks.size :]

    def from_each(self, ground_m: FloatArray) -> WalkingFrom:
        """Distances from single ones of many places (K, 3) to all of them."""
        return WalkingFrom(self, *self._stands(ground_m))

    def path(self, from_m: FloatArray, to_m: FloatArray) -> WalkingPath:
        """Shortest way between two places on the ground, (3,) each, pulled taut round the corners."""
        node, place = self._stands(np.stack([from_m, to_m]))
        if (node < 0).any() or not self.joined(node[0], node[1]):
            return WalkingPath(np.empty((0, 3)), float("inf"))
        # No way of some length leaves the ellipsoid about its ends with that sum of distances: the blocks in it do,
        # and where they hold no way that short, those of a larger one.
        most_m = _FIRST_DETOUR * float(_length_m(place[:1], place[1:])[0]) + _FIRST_MORE_M
        while True:
            length_m, way = self._shortest(node, place, self._within(place, most_m))
            if length_m <= most_m:
                break
            most_m = length_m if np.isfinite(length_m) else 2.0 * most_m
        points = self._space.position_m(self._pulled(self._edges.with_bends(way, self._block)))
        points[0], points[-1] = place
        return WalkingPath(points, float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum()))

    def joined(self, node: int, other: int) -> bool:
        """Whether a way leads from one walkable node to another."""
        part = self._edges.part
        return bool(part[self._block[node]] == part[self._block[other]])

    def _within(self, place: FloatArray, most_m: float) -> Int64Array:
        """Blocks whose distances to both places, (2, 3), add up to so much at most, in their order."""
        order, stripe, x_m = self._stripes
        low_m, high_m = (place[:, :2].mean(axis=0) + side * (0.5 * most_m + _SLACK_M) for side in (-1.0, 1.0))
        runs = [np.empty(0, dtype=np.int64)]
        # However far a way may go, there are no blocks beyond the outermost stripes.
        stripes = np.clip(np.floor([low_m[1] / _STRIPE_M, high_m[1] / _STRIPE_M]), *stripe[[0, -1]])
        for number in range(int(stripes[0]), int(stripes[1]) + 1):
            first, end = np.searchsorted(stripe, [number, number + 1])
            low, high = np.searchsorted(x_m[first:end], [low_m[0], high_m[0]])
            runs.append(order[first + low : first + high])
        near = np.concatenate(runs)
        away_m = _length_m(self._spot_m[near], place[:1]) + _length_m(self._spot_m[near], place[1:])
        return np.sort(near[away_m <= most_m + _SLACK_M])

    def _shortest(self, node: Int64Array, place: FloatArray, blocks: Int64Array) -> tuple[float, Int64Array]:
        """Length of the shortest way over some blocks between two places, (2, 3) at nodes (2,), and its nodes."""
        from scipy.sparse.csgraph import dijkstra

        n = blocks.size
        graph = self._graph(node, place, blocks=blocks)
        length, before = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
        if not np.isfinite(length[n + 1]):
            return float("inf"), np.empty(0, dtype=np.int64)
        chain = [n + 1]
        while chain[-1] != n:
            chain.append(int(before[chain[-1]]))
        return float(length[n + 1]), np.concatenate([self._spot[blocks], node])[chain[::-1]]

    def _stands(self, ground_m: FloatArray) -> tuple[Int64Array, FloatArray]:
        """Node (K,) and place (K, 3) where one stands for each of places (K, 3)."""
        ground_m = np.asarray(ground_m, dtype=np.float64).reshape(-1, 3)
        node = self._footing.nodes(ground_m)
        at = self._space.position_m(np.maximum(node, 0)) if self._space.n_nodes else ground_m
        own = (np.abs(ground_m - at)[:, :2] <= 0.5 * self._space.grid.cell_m + 1e-9).all(axis=1)
        place = at.copy()
        place[own, :2] = ground_m[own, :2]
        return node, place

    def _graph(
        self, node: Int64Array, place: FloatArray, *, with_pairs: bool = True, blocks: Int64Array | None = None
    ) -> Any:
        """Sparse lengths over the blocks, or sorted ones (B,) of them, and, after them, places (K, 3) at nodes (K,).

        with_pairs : places that see each other are linked straight.
        """
        from scipy.sparse import csr_array

        n_blocks, number = self._spot.size if blocks is None else blocks.size, np.arange(node.size)
        own = self._block[node]
        # To the place's own block, to those around that it sees, and to other places that it sees.
        near, around = self._edges.around(own)
        sees = self.sees(node[near], self._spot[around])
        near, around = near[sees], around[sees]
        spots = self._spot_m
        to_own, to_around = _length_m(place, spots[own]), _length_m(place[near], spots[around])
        a, b = np.triu_indices(node.size if with_pairs else 0, k=1)
        straight = self.sees(node[a], node[b])
        a, b = a[straight], b[straight]
        if blocks is None:
            edge_a, edge_b, edge_m = self._edges.a, self._edges.b, self._edges.length_m
        else:
            edge_a, edge_b, edge_m = self._edges.among(blocks)
            here, at = number_among(blocks, own)
            number, own, to_own = number[here], at, to_own[here]
            here, at = number_among(blocks, around)
            near, around, to_around = near[here], at, to_around[here]
        rows = [edge_a, n_blocks + number, n_blocks + near, n_blocks + a]
        columns = [edge_b, own, around, n_blocks + b]
        lengths = [edge_m, to_own, to_around, _length_m(place[a], place[b])]
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
    """Walking distances among many places, a row at a time: where few of the rows are ever needed.

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
        row, column = self._links[block].nonzero()
        return row.astype(np.int64), column.astype(np.int64)

    def among(self, blocks: Int64Array) -> tuple[Int64Array, Int64Array, FloatArray]:
        """Links of sorted blocks (B,) with one another: ends by their place among these, and lengths."""
        of_them = self._edge_number[blocks].tocoo()
        edge = of_them.data.astype(np.int64) - 1
        here, b = number_among(blocks, self.b[edge])
        return of_them.coords[0].astype(np.int64)[here], b, self.length_m[edge[here]]

    @cached_property
    def part(self) -> Int64Array:
        """(B,) which blocks are connected."""
        from scipy.sparse.csgraph import connected_components

        return np.asarray(connected_components(self._links, directed=False)[1], dtype=np.int64)

    @cached_property
    def _by_part(self) -> tuple[Int64Array, Int64Array]:
        return np.argsort(self.part, kind="stable"), np.cumsum(np.append(0, np.bincount(self.part)))

    def blocks_of(self, block: int) -> Int64Array:
        """Blocks that are connected with one, sorted."""
        order, starts = self._by_part
        return order[starts[self.part[block]] : starts[self.part[block] + 1]]

    @cached_property
    def _links(self) -> Any:
        from scipy.sparse import csr_array

        ends = (np.concatenate([self.a, self.b]), np.concatenate([self.b, self.a]))
        return csr_array((np.ones(ends[0].size, dtype=np.int8), ends), shape=(self.n_blocks, self.n_blocks))

    @cached_property
    def _edge_number(self) -> Any:
        """Numbers of the links, from 1, by their first block."""
        from scipy.sparse import csr_array

        order = np.argsort(self.a, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(self.a, minlength=self.n_blocks))])
        return csr_array((order + 1, self.b[order], starts), shape=(self.n_blocks, self.n_blocks))

    @cached_property
    def _bent(self) -> tuple[Int64Array, Int64Array]:
        """Links that bend, sorted by their ends: (M,) of both ends, (M,) the link."""
        bent = np.flatnonzero(self.bend[:, 0] >= 0)
        ends = self.a[bent] * self.n_blocks + self.b[bent]
        order = np.argsort(ends, kind="stable")
        return ends[order], bent[order]

    def with_bends(self, way: Int64Array, block: Int64Array) -> Int64Array:
        """Put the nodes in by which a way of nodes crosses the borders of its blocks."""
        ends, link = self._bent
        a, b = block[way[:-1]], block[way[1:]]
        is_bent, at = number_among(ends, np.minimum(a, b) * self.n_blocks + np.maximum(a, b))
        bends = dict(zip(is_bent.tolist(), self.bend[link[at]].tolist(), strict=True))
        out = [int(way[0])]
        for step, node in enumerate(way[1:].tolist()):
            out += bends.get(step, [])[:: 1 if a[step] < b[step] else -1]
            out.append(node)
        return np.array(out, dtype=np.int64)


def walks_straight(
    space: FreeSpace, cells: Int64Array, walkable: BoolArray, node: Int64Array, other: Int64Array
) -> BoolArray:
    """(M,) bool: whether the cells on the line from nodes (M,) to others (M,) are linked and walkable.

    The line is 8-connected: no cell of it is further than half a cell from the straight line.
    """
    passes = np.zeros(node.size, dtype=np.bool_)
    _walk_straight(space.links, space.ground_m, cells, walkable, _DIRECTION, node, other, passes)
    return passes


@compiled
def _walk_straight(
    links: Int32Array,
    ground_m: FloatArray,
    cells: Int64Array,
    walkable: BoolArray,
    direction: Int64Array,
    node: Int64Array,
    other: Int64Array,
    passes: BoolArray,
) -> None:
    for index in range(node.size):
        at, end = node[index], other[index]
        if not (walkable[at] and walkable[end]):
            continue
        start_x, start_y = cells[at, 0], cells[at, 1]
        move_x, move_y = cells[end, 0] - start_x, cells[end, 1] - start_y
        start_m, rise_m = ground_m[at], ground_m[end] - ground_m[at]
        n = max(abs(move_x), abs(move_y))
        x, y = start_x, start_y
        for step in range(1, n + 1):
            now_x = start_x + (2 * step * move_x + n) // (2 * n)
            now_y = start_y + (2 * step * move_y + n) // (2 * n)
            at = links[at, direction[now_x - x + 1, now_y - y + 1]]
            if at < 0 or not walkable[at] or abs(ground_m[at] - (start_m + rise_m * (step / n))) > _OFF_LINE_M:
                break
            x, y = now_x, now_y
        else:
            passes[index] = at == end


def _blocks(space: FreeSpace, walkable: BoolArray) -> tuple[Int64Array, Int64Array]:
    """Block (N,) of every walkable node, -1 for the others, and the node (B,) in the middle of each block.

    A block is what is connected of the nodes in a square: two rooms that meet in one, or two storeys, are not mixed.
    """
    cells = space.cells()
    per_side = _cells_per_side(space)
    square = (cells[:, 1] // per_side) * space.grid.nx + cells[:, 0] // per_side
    block = components(space.links, walkable, within=square).astype(np.int64)
    node = np.flatnonzero(walkable)
    number = block[node]
    count = np.maximum(np.bincount(number), 1)
    middle = np.column_stack([np.bincount(number, weights=cells[node, k]) / count for k in (0, 1)])
    off = np.round(((cells[node] - middle[number]) ** 2).sum(axis=1), 9)
    order = np.lexsort((node, off, number))
    _, first = np.unique(number[order], return_index=True)
    return block, node[order[first]]


def _cells_per_side(space: FreeSpace) -> int:
    """Of a block."""
    return max(_LEAST_PER_SIDE, round(BLOCK_M / space.grid.cell_m))


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
    near, far = half_links(space.links, walkable, between=block)
    bend = [np.empty((0, 2), dtype=np.int64)]
    for start in range(0, near.size, _PAIRS):
        some = slice(start, start + _PAIRS)
        bend.append(_shortest_over(space, block, spot, near[some], far[some])[3])
    return _shortest_over(space, block, spot, *np.concatenate(bend).T)


def _shortest_over(
    space: FreeSpace, block: Int64Array, spot: Int64Array, near: Int64Array, far: Int64Array
) -> tuple[Int64Array, Int64Array, FloatArray, Int64Array]:
    """As `_neighbours`, of linked nodes (K,) and (K,) on either side of borders."""
    turned = block[near] > block[far]
    near, far = np.where(turned, far, near), np.where(turned, near, far)
    a, b = block[near], block[far]
    near_m, far_m = space.position_m(near), space.position_m(far)
    length = _length_m(space.position_m(spot[a]), near_m) + _length_m(near_m, far_m)
    length = length + _length_m(far_m, space.position_m(spot[b]))
    order = np.lexsort((far, near, length, b, a))
    key = a[order] * np.int64(spot.size) + b[order]
    _, first = np.unique(key, return_index=True)
    best = order[first]
    return a[best], b[best], length[best], np.column_stack([near[best], far[best]])


def _knights_moves(space: FreeSpace, a: Int64Array, b: Int64Array, spot: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Pairs of blocks, first < second, a knight's move apart with a common neighbour."""
    from scipy.sparse import csr_array

    square = space.cells()[spot] // _cells_per_side(space)
    ends = (np.concatenate([a, b]), np.concatenate([b, a]))
    links = csr_array((np.ones(ends[0].size, dtype=np.int32), ends), shape=(spot.size, spot.size))
    found = [np.empty((0, 2), dtype=np.int64)]
    for start in range(0, spot.size, _ROWS):
        c, d = (links[start : start + _ROWS] @ links).nonzero()
        c = c + start
        apart = np.sort(np.abs(square[c] - square[d]), axis=1)
        chosen = (c < d) & (apart[:, 0] == 1) & (apart[:, 1] == 2)
        order = np.lexsort((d[chosen], c[chosen]))
        found.append(np.column_stack([c[chosen][order], d[chosen][order]]).astype(np.int64))
    both = np.concatenate(found)
    return both[:, 0], both[:, 1]


def _length_m(a_m: FloatArray, b_m: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(((a_m - b_m) ** 2).sum(axis=1)))
