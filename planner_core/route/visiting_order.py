"""Visiting order of stations over walking distances: a storey at a time, from a start, to an end or back.

Metres. The order of storeys is sought too: for small plans among all orders, for others the one with the shortest ways
from storey to storey.

A tour is a closed sequence of stops over a distance matrix. Its blocks (storeys) come in a given order, each in one
piece; what is sought is the order inside the blocks, the ways from block to block included: exact for small blocks, by
local search for others.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array

#: All orders of so many storeys are tried; of more, they are taken as they lie, part by part, from below or above.
MAX_STOREYS = 6
N_KICKS = 60
#: Blocks of up to so many stops are solved exactly.
_MAX_EXACT = 12
#: Segments of up to so many stops are moved to another place.
_LONGEST_SEGMENT = 3
#: What saves less than this, in metres, is rounding.
_LEAST_GAIN_M = 1e-9


@dataclass(frozen=True)
class VisitingOrder:
    """Stops in the order of the walk.

    order : (N,) int64, each stop once. length_m : of the walk, legs that can't be walked not counted; a closed walk's
    way back included. n_unwalkable : legs between stops that no way joins. exact : no shorter order exists.
    """

    order: Int64Array
    length_m: float
    n_unwalkable: int
    exact: bool


def visiting_order(
    distance_m: FloatArray,
    floor: Int32Array,
    *,
    start: int | None = None,
    end: int | None = None,
    closed: bool = False,
    seed: int = 0,
    n_kicks: int = N_KICKS,
    max_exact: int = _MAX_EXACT,
) -> VisitingOrder:
    """Order stops so that the walk is short, all stops of a floor one after another.

    Parts that no way joins, such as the flats of a house, are visited one after the other, each floor by floor.

    Parameters
    ----------
    distance_m
        (N, N) float64, symmetric, inf where there is no way: `planner_core.positions.walking.Walking`.
    floor
        (N,) int32, floor of each stop.
    start, end
        Stops (indices) that come first and last, whatever their floor: an entrance, or a station.
    closed
        The walk ends where it starts; so it does where `start` and `end` are the same stop.
    seed, n_kicks
        Of the search where a floor has more than `max_exact` stops: more kicks, shorter walks.
    max_exact
        Floors of up to so many stops, 12 at most, are ordered exactly.

    Raises
    ------
    RequirementError
        A matrix that is not square or symmetric, or an end and a closed walk at once.
    """
    distance_m = np.asarray(distance_m, dtype=np.float64)
    _check(distance_m, floor, start, end, closed=closed)
    closed = closed or (start is not None and start == end)
    n = floor.size
    if n == 0:
        return VisitingOrder(np.empty(0, np.int64), 0.0, 0, True)
    padded = _padded(distance_m)
    ends = {stop for stop in (start, end) if stop is not None}
    inner = np.array([stop for stop in range(n) if stop not in ends], dtype=np.int64)
    storeys = _storeys(distance_m, floor, inner)
    head = [] if start is None else [np.array([start])]
    tail = [] if end is None or closed else [np.array([end])]
    # An open walk is a tour over one more stop, no way from anywhere.
    seam = [] if closed else [np.array([n])]
    small = max((storey.size for storey in storeys), default=0) <= max_exact and len(storeys) <= MAX_STOREYS
    if small:
        tours = _exact_tours(padded, [*seam, *head], storeys, tail)
    else:
        order = _storey_order(padded, storeys, head, tail, closed=closed)
        rng = np.random.default_rng(seed)
        blocks = [*seam, *head, *(storeys[k] for k in order), *tail]
        tours = [improved_tour(padded, blocks, n_kicks=n_kicks, rng=rng)]
    lengths = [tour_length_m(padded, tour) for tour in tours]
    tour = tours[int(np.argmin(np.round(lengths, 9)))]
    tour = tour[tour != n]
    legs = distance_m[tour[:-1], tour[1:]]
    if closed and n > 1:
        legs = np.append(legs, distance_m[tour[-1], tour[0]])
    walked = np.isfinite(legs)
    return VisitingOrder(tour, float(legs[walked].sum()), int((~walked).sum()), small)


def tour_length_m(distance_m: FloatArray, tour: Int64Array) -> float:
    """Length of a closed tour."""
    return float(distance_m[tour, np.roll(tour, -1)].sum())


def exact_tour(distance_m: FloatArray, blocks: list[Int64Array], within: list[FloatArray]) -> Int64Array:
    """(N,) the shortest closed tour through `blocks` in their order, at most `_MAX_EXACT` stops each.

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


def _check(distance_m: FloatArray, floor: Int32Array, start: int | None, end: int | None, *, closed: bool) -> None:
    n = floor.size
    if distance_m.shape != (n, n):
        raise RequirementError(
            f"distances: got an array of shape {distance_m.shape}, expected ({n}, {n}), a row and a column a stop"
        )
    if np.isnan(distance_m).any() or (distance_m < 0).any() or not np.array_equal(distance_m, distance_m.T):
        raise RequirementError("distances: got negative, undefined or one-way ones, expected a symmetric matrix")
    for name, stop in (("start", start), ("end", end)):
        if stop is not None and not 0 <= stop < n:
            raise RequirementError(f"{name}: got stop {stop}, expected an index from 0 to {n - 1}")
    if closed and end is not None and end != start:
        raise RequirementError("end: got one for a closed route, expected none; leave it out, or leave `closed` out")


def _storeys(distance_m: FloatArray, floor: Int32Array, inner: Int64Array) -> list[Int64Array]:
    """Stops `inner` by floor, those of each part that is connected for itself, from below: parts by their lowest."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, part = connected_components(coo_array(np.isfinite(distance_m)), directed=False)
    lowest = np.full(part.size, np.iinfo(np.int32).max, dtype=np.int32)
    np.minimum.at(lowest, part[inner], floor[inner])
    keys = np.column_stack([lowest[part[inner]], part[inner], floor[inner]])
    return [inner[(keys == key).all(axis=1)] for key in np.unique(keys, axis=0)]


def _padded(distance_m: FloatArray) -> FloatArray:
    """(N + 1, N + 1): unwalkable legs longer than any walk, and a stop at no distance from all."""
    n = distance_m.shape[0]
    finite = np.isfinite(distance_m)
    out = np.zeros((n + 1, n + 1))
    out[:n, :n] = np.where(finite, distance_m, 1.0 + (n + 1) * float(distance_m[finite].max(initial=0.0)))
    return out


def _exact_tours(
    distance_m: FloatArray, head: list[Int64Array], storeys: list[Int64Array], tail: list[Int64Array]
) -> list[Int64Array]:
    """Find the shortest tour of every order of storeys, as they lie from below first."""
    through = {id(block): paths_through(distance_m[np.ix_(block, block)]) for block in (*head, *storeys, *tail)}
    tours = []
    for order in permutations(storeys):
        blocks = [*head, *order, *tail]
        tours.append(exact_tour(distance_m, blocks, [through[id(block)] for block in blocks]))
    return tours


def _storey_order(
    distance_m: FloatArray, storeys: list[Int64Array], head: list[Int64Array], tail: list[Int64Array], *, closed: bool
) -> tuple[int, ...]:
    """Order of storeys with the least sum of shortest ways between them, from the start and to the end."""
    n = len(storeys)
    upward = tuple(range(n))
    orders = list(permutations(upward)) if n <= MAX_STOREYS else [upward, upward[::-1]]

    def gaps_m(order: tuple[int, ...]) -> float:
        chain = [*head, *(storeys[k] for k in order), *tail]
        if closed:
            chain.append(chain[0])
        return round(sum(float(distance_m[np.ix_(a, b)].min()) for a, b in pairwise(chain)), 9)

    return min(orders, key=gaps_m)  # the first of equals


def _path(distance_m: FloatArray, through: FloatArray, first: int, last: int) -> Int64Array:
    """Stops of the shortest path from `first` through all to `last`, read back from `paths_through`."""
    chosen, path = through.shape[0] - 1, [last]
    while len(path) < distance_m.shape[0]:
        chosen ^= 1 << path[-1]
        path.append(int((through[chosen, first] + distance_m[:, path[-1]]).argmin()))
    return np.array(path[::-1], dtype=np.int64)


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
