"""Tours over a distance matrix in which blocks of stops stay together: exact for small blocks, local search for others.

Metres. A tour is a closed sequence of stops. Its blocks (storeys) come in a given order, each in one piece; what is
sought is the order inside the blocks, the ways from block to block included.
"""

from __future__ import annotations

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
    tour = _descend(distance_m, _nearest_neighbours(distance_m, blocks), block_of)
    length_m = tour_length_m(distance_m, tour)
    large = [b for b, block in enumerate(blocks) if block.size >= 4]
    for _ in range(n_kicks if large else 0):
        kicked = _kick(tour, np.flatnonzero(block_of == large[int(rng.integers(len(large)))]), rng)
        kicked = _descend(distance_m, kicked, block_of)
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


def _descend(distance_m: FloatArray, tour: Int64Array, block_of: Int64Array) -> Int64Array:
    """Apply the best move until none shortens the tour."""
    if tour.size < 3:
        return tour
    while True:
        between = distance_m[np.ix_(tour, tour)]
        step = between[np.arange(tour.size), (np.arange(tour.size) + 1) % tour.size]
        turned = _best_turn(between, step, block_of)
        moved = _best_move(between, step, block_of)
        if min(turned[0], moved[0]) >= -_LEAST_GAIN_M:
            return tour
        if turned[0] <= moved[0]:
            _, i, j = turned
            tour = np.concatenate([tour[:i], tour[i : j + 1][::-1], tour[j + 1 :]])
        else:
            _, i, size, gap, reverse = moved
            segment = tour[i : i + size][:: -1 if reverse else 1]
            rest = np.concatenate([tour[:i], tour[i + size :]])
            gap -= size if gap > i else 0
            tour = np.concatenate([rest[:gap], segment, rest[gap:]])


def _best_turn(between: FloatArray, step: FloatArray, block_of: Int64Array) -> tuple[float, int, int]:
    """Find the 2-opt move: change in length, and first and last position of the stretch to turn round.

    between : (N, N) distances by position in the tour. step : (N,) from each position to the next.
    """
    n = step.size
    change = np.roll(between, 1, axis=0) + np.roll(between, -1, axis=1) - np.roll(step, 1)[:, None] - step[None]
    allowed = np.triu(block_of[:, None] == block_of[None], k=1)
    allowed[0, n - 1] = False  # the whole tour turned round is itself
    change = np.where(allowed, change, np.inf)
    at = int(change.argmin())
    return float(change.flat[at]), at // n, at % n


def _best_move(between: FloatArray, step: FloatArray, block_of: Int64Array) -> tuple[float, int, int, int, bool]:
    """Find the Or-opt move: change in length, the segment's position and size, its new gap, whether it is turned round.

    Gap g lies before position g; a segment goes to gaps inside its block and at its ends.
    """
    n = step.size
    best = (0.0, 0, 0, 0, False)
    gaps = np.arange(n + 1)
    before, after = (gaps - 1) % n, gaps % n
    first_of = np.searchsorted(block_of, block_of, side="left")
    end_of = np.searchsorted(block_of, block_of, side="right")
    for size in range(1, min(_LONGEST_SEGMENT, n - 2) + 1):
        i = np.arange(n - size + 1)
        last, next_, previous = i + size - 1, (i + size) % n, (i - 1) % n
        removed = between[previous, next_] - step[previous] - step[last]
        allowed = _open_gaps(gaps, i, size, n) & (gaps >= first_of[i][:, None]) & (gaps <= end_of[i][:, None])
        allowed &= (block_of[i] == block_of[last])[:, None]
        for reverse in (False, True):
            head, tail = (last, i) if reverse else (i, last)
            change = removed[:, None] + between[before][:, head].T + between[tail][:, after] - step[before][None]
            change = np.where(allowed, change, np.inf)
            at = int(change.argmin())
            if change.flat[at] < best[0]:
                best = (float(change.flat[at]), int(i[at // (n + 1)]), size, at % (n + 1), reverse)
    return best


def _open_gaps(gaps: Int64Array, i: Int64Array, size: int, n: int) -> BoolArray:
    """(I, n + 1) bool: gaps that do not touch the segment at i; the first and the last gap are the same."""
    start, end = i[:, None], i[:, None] + size
    touches = (gaps >= start) & (gaps <= end)
    touches |= (gaps % n == start) | (gaps % n == end % n)
    return np.asarray(~touches)
