"""Tours over a distance matrix in which blocks of stops stay together: exact for small blocks, local search for others.

Metres. A tour is a closed sequence of stops. Its blocks (storeys) come in a given order, each in one piece; what is
sought is the order inside the blocks, the ways from block to block included.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array

#: Blocks of up to so many stops are solved exactly.
MAX_EXACT = 12
#: Segments of up to so many stops are moved to another place.
_LONGEST_SEGMENT = 3
#: What saves less than this, in metres, is rounding.
_LEAST_GAIN_M = 1e-9


def tour_length_m(distance_m: FloatArray, tour: Int64Array) -> float:
    """Length of a closed tour."""
    return float(distance_m[tour, np.roll(tour, -1)].sum())


def exact_tour(distance_m: FloatArray, blocks: list[Int64Array], within: list[FloatArray]) -> Int64Array:
    """(N,) the shortest closed tour through `blocks` in their order, at most `MAX_EXACT` stops each.

    Held and Karp (1962) inside the blocks, from every first to every last stop: `within`, the `paths_through` each
    block; and a chain of these from block to block.
    """
    best_m, best = np.inf, None
    for first in range(blocks[0].size):
        # cost[e]: shortest way from `first` through all blocks so far that ends at stop e of the last of them.
        cost = within[0][-1, first]
        back = []
        for (before, block), through in zip(pairwise(blocks), within[1:], strict=True):
            arrive = cost[:, None] + distance_m[np.ix_(before, block)]
            came_from = arrive.argmin(axis=0)
            whole = arrive.min(axis=0)[:, None] + through[-1]
            entered = whole.argmin(axis=0)
            back.append((came_from, entered))
            cost = whole.min(axis=0)
        closed = cost + distance_m[blocks[-1], blocks[0][first]]
        if closed.min() < best_m - _LEAST_GAIN_M:
            best_m, best = float(closed.min()), (first, int(closed.argmin()), back)
    assert best is not None, "distances are finite"
    first, last, back = best
    pieces = []
    for block, through, (came_from, entered) in zip(blocks[:0:-1], within[:0:-1], back[::-1], strict=True):
        enter = int(entered[last])
        pieces.append(block[_path(distance_m[np.ix_(block, block)], through, enter, last)])
        last = int(came_from[enter])
    pieces.append(blocks[0][_path(distance_m[np.ix_(blocks[0], blocks[0])], within[0], first, last)])
    return np.concatenate(pieces[::-1])


def paths_through(distance_m: FloatArray) -> FloatArray:
    """(2^n, n, n): length of the shortest path from stop s through the set to stop e, inf where there is none."""
    n = distance_m.shape[0]
    length = np.full((1 << n, n, n), np.inf)
    for stop in range(n):
        length[1 << stop, stop, stop] = 0.0
    for chosen in range(1, 1 << n):
        onward = (length[chosen][:, :, None] + distance_m[None]).min(axis=1)
        for stop in range(n):
            if not chosen >> stop & 1:
                length[chosen | 1 << stop, :, stop] = onward[:, stop]
    return length


def _path(distance_m: FloatArray, through: FloatArray, first: int, last: int) -> Int64Array:
    """Stops of the shortest path from `first` through all to `last`, read back from `paths_through`."""
    chosen, path = through.shape[0] - 1, [last]
    while len(path) < distance_m.shape[0]:
        chosen ^= 1 << path[-1]
        path.append(int((through[chosen, first] + distance_m[:, path[-1]]).argmin()))
    return np.array(path[::-1], dtype=np.int64)


def improved_tour(
    distance_m: FloatArray, blocks: list[Int64Array], *, n_kicks: int, rng: np.random.Generator
) -> Int64Array:
    """(N,) a short closed tour through `blocks` in their order.

    Nearest neighbours, then 2-opt and Or-opt to a local optimum; then, `n_kicks` times, a random exchange of two
    neighbouring stretches of one block (double bridge) and the same again, kept where it is no longer.
    """
    block_of = np.repeat(np.arange(len(blocks)), [block.size for block in blocks])
    moves = _Moves(distance_m, block_of)
    tour = _descend(_nearest_neighbours(distance_m, blocks), moves)
    length_m = tour_length_m(distance_m, tour)
    large = [b for b, block in enumerate(blocks) if block.size >= 4]
    for _ in range(n_kicks if large else 0):
        kicked = _kick(tour, np.flatnonzero(block_of == large[int(rng.integers(len(large)))]), rng)
        kicked = _descend(kicked, moves)
        kicked_m = tour_length_m(distance_m, kicked)
        if kicked_m <= length_m:
            tour, length_m = kicked, kicked_m
    return tour


def _nearest_neighbours(distance_m: FloatArray, blocks: list[Int64Array]) -> Int64Array:
    tour = [int(blocks[0][0])]
    for block in blocks:
        left = [int(stop) for stop in block if int(stop) != tour[0]]
        while left:
            nearest = min(left, key=lambda stop: (distance_m[tour[-1], stop], stop))
            left.remove(nearest)
            tour.append(nearest)
    return np.array(tour, dtype=np.int64)


def _kick(tour: Int64Array, at: Int64Array, rng: np.random.Generator) -> Int64Array:
    """Exchange two neighbouring stretches inside positions `at`, which follow one another."""
    cuts = np.sort(rng.choice(at.size + 1, size=3, replace=False)) + at[0]
    a, b, c = (int(cut) for cut in cuts)
    return np.concatenate([tour[:a], tour[b:c], tour[a:b], tour[c:]])


class _Moves:
    """The best moves within each block of a tour, worked out anew only where the block or a stop beside it changed."""

    def __init__(self, distance_m: FloatArray, block_of: Int64Array) -> None:
        self._distance_m, self._n = distance_m, block_of.size
        self._first = np.flatnonzero(np.diff(block_of, prepend=-1))
        self._end = np.append(self._first[1:], block_of.size)
        n_blocks = self._first.size
        self._key: list[bytes] = [b""] * n_blocks
        #: Change in length; first and last position of the stretch to turn round.
        self._turn_m, self._turn = np.full(n_blocks, np.inf), np.zeros((n_blocks, 2), dtype=np.int64)
        #: By size of the segment, and turned round or not: change in length; its position, its new gap.
        self._kinds = [(size, turned) for size in range(1, min(_LONGEST_SEGMENT, self._n - 2) + 1) for turned in (0, 1)]
        shape = (len(self._kinds), n_blocks)
        self._move_m, self._move = np.full(shape, np.inf), np.zeros((*shape, 2), dtype=np.int64)

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self._first.size)

    def look(self, tour: Int64Array, blocks: Iterable[int]) -> None:
        """Work out the moves within some blocks; the first follows the last."""
        for block in {number % self.n_blocks for number in blocks}:
            first, end = int(self._first[block]), int(self._end[block])
            stops = tour[np.arange(first - 1, end + 1) % self._n]
            if (key := stops.tobytes()) == self._key[block]:
                continue
            self._key[block] = key
            between = self._distance_m[np.ix_(stops, stops)]
            self._turn_m[block], self._turn[block] = _best_turn(between, first, whole=end - first == self._n)
            for kind, (size, turned) in enumerate(self._kinds):
                found = _best_move(between, first, size, self._n, reverse=bool(turned))
                self._move_m[kind, block], self._move[kind, block] = found

    def best(self, tour: Int64Array) -> tuple[Int64Array, int] | None:
        """The tour after the move that shortens it most, and the block of it; None where none does."""
        block = int(self._turn_m.argmin())
        turn_m = float(self._turn_m[block])
        move_m, chosen = 0.0, (0, 0)
        for kind in range(len(self._kinds)):
            at = int(self._move_m[kind].argmin())
            if self._move_m[kind, at] < move_m:
                move_m, chosen = float(self._move_m[kind, at]), (kind, at)
        if min(turn_m, move_m) >= -_LEAST_GAIN_M:
            return None
        if turn_m <= move_m:
            i, j = self._turn[block].tolist()
            return np.concatenate([tour[:i], tour[i : j + 1][::-1], tour[j + 1 :]]), block
        (size, turned), (i, gap) = self._kinds[chosen[0]], self._move[chosen].tolist()
        segment = tour[i : i + size][:: -1 if turned else 1]
        rest = np.concatenate([tour[:i], tour[i + size :]])
        gap -= size if gap > i else 0
        return np.concatenate([rest[:gap], segment, rest[gap:]]), chosen[1]


def _descend(tour: Int64Array, moves: _Moves) -> Int64Array:
    """Apply the best move until none shortens the tour."""
    if tour.size < 3:
        return tour
    moves.look(tour, range(moves.n_blocks))
    while (moved := moves.best(tour)) is not None:
        tour, block = moved
        moves.look(tour, (block - 1, block, block + 1))
    return tour


def _best_turn(between: FloatArray, first: int, *, whole: bool) -> tuple[float, tuple[int, int]]:
    """Find a block's 2-opt move: change in length, and first and last position of the stretch to turn round.

    between : (M + 2, M + 2) distances among the stop before the block, its M stops from position `first` on, and the
    stop behind. whole : the block is the tour.
    """
    n = between.shape[0] - 2
    step = np.diagonal(between, offset=1)
    change = between[:n, 1:-1] + between[1:-1, 2:] - step[:n, None] - step[None, 1:]
    allowed = np.triu(np.ones((n, n), dtype=bool), k=1)
    if whole:
        allowed[0, n - 1] = False  # the whole tour turned round is itself
    change = np.where(allowed, change, np.inf)
    at = int(change.argmin())
    return float(change.flat[at]), (first + at // n, first + at % n)


def _best_move(
    between: FloatArray, first: int, size: int, n_tour: int, *, reverse: bool
) -> tuple[float, tuple[int, int]]:
    """Find a block's Or-opt move of so many stops: change in length, the segment's position and its new gap.

    between, first : as in `_best_turn`. Gap g lies before position g; a segment goes to gaps inside its block and at
    its ends. reverse : it is turned round.
    """
    n = between.shape[0] - 2
    if size > n:
        return np.inf, (first, first)
    step = np.diagonal(between, offset=1)
    gaps, i = np.arange(n + 1), np.arange(n - size + 1)  # within the block; place k of it is row k + 1
    last = i + size - 1
    removed = between[i, last + 2] - step[i] - step[last + 1]
    head, tail = (last, i) if reverse else (i, last)
    change = removed[:, None] + between[gaps][:, head + 1].T + between[tail + 1][:, gaps + 1] - step[gaps][None]
    change = np.where(_open_gaps(first + gaps, first + i, size, n_tour), change, np.inf)
    at = int(change.argmin())
    return float(change.flat[at]), (first + at // (n + 1), first + at % (n + 1))


def _open_gaps(gaps: Int64Array, i: Int64Array, size: int, n: int) -> BoolArray:
    """(I, n + 1) bool: gaps that do not touch the segment at i; the first and the last gap are the same."""
    start, end = i[:, None], i[:, None] + size
    touches = (gaps >= start) & (gaps <= end)
    touches |= (gaps % n == start) | (gaps % n == end % n)
    return np.asarray(~touches)
