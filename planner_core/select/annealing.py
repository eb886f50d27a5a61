"""Annealing of station sets: sets of a fixed size, each exchanging one station after the other for a candidate.

Input a `CoverProblem` and sets of k candidates, output sets of k candidates and what each misses (ticks). A step takes
out a random station and tries up to TRIES candidates for its place. With m what the set misses in all, a candidate is
accepted where

    m' - m <= t e,   e exponentially distributed: the rule of Metropolis, exp(-(m' - m) / t), solved for m'

and the station goes back if none is. The temperature t falls with the steps. Three of four candidates are drawn from
those that see nearly what the station sees, the others from all.

m: for every constraint and each of the looks 1 .. `seen_from` that it requires, the ticks that lack so many. With a
`Network` also `penalty` for each of its `n_violations`, which are computed only where the ticks alone would let a
candidate in; of eight candidates two are then drawn from those linked to a random station, one from all.

Sets are independent of each other, one thread each. All is whole numbers, with random numbers by counter: the same sets
come out on any machine with any number of cores. Importing this module imports numba, see `planner_core.compiled`.

References
----------
Kirkpatrick, Gelatt, Vecchi 1983 (annealing) and Metropolis et al. 1953 (the rule): known results, restated here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.compiled import compiled, in_threads
from planner_core.model import Int32Array, Int64Array
from planner_core.select.annealing_problem import ACCEPTANCE_BITS, TRIES, AnnealingProblem
from planner_core.select.problem import CoverProblem

#: Steps from one turn to the next: some tenths of a second.
STEPS_PER_TURN = 20_000
UInt64Array = NDArray[np.uint64]

# numba takes a sum of uint64 and a signed number for float64: every word is a uint64, constants too.
_ONE, _HALF, _LOW = np.uint64(1), np.uint64(32), np.uint64(0xFFFFFFFF)
_MULTIPLY_0, _MULTIPLY_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
#: A number whose 64 windows of six bits all differ, and which bit a window stands for: where the only bit of a word is.
_WINDOWS = np.uint64(0x03F79D71B4CB0A89)
_BIT_OF_WINDOW = np.empty(64, dtype=np.int64)
_BIT_OF_WINDOW[[(0x03F79D71B4CB0A89 << bit & 2**64 - 1) >> 58 for bit in range(64)]] = np.arange(64)
_WINDOW_SHIFT = np.uint64(58)


class Annealer:
    """Annealing of sets of one problem."""

    def __init__(self, annealed: AnnealingProblem) -> None:
        problem, network = annealed.problem, annealed.network
        self._seed, self._penalty = np.uint64(annealed.seed), annealed.penalty
        n = problem.n_candidates
        counted = [np.flatnonzero(counts) for counts in annealed.counts]
        self._shape = (n, problem.n_rows, annealed.counts.shape[1], annealed.n_levels)
        self._fixed: tuple[Any, ...] = (
            *_rows_by_class(problem, annealed.class_of, annealed.counts.shape[1]),
            problem.ticks.astype(np.int64),
            problem.required.astype(np.int64),
            np.minimum(problem.seen_from, annealed.n_levels).astype(np.int64),
            np.cumsum([0, *(classes.size for classes in counted)]).astype(np.int64),
            np.concatenate([np.zeros(0, dtype=np.int64), *counted]).astype(np.int64),
            annealed.nearest.astype(np.int64),
            annealed.acceptance.astype(np.int64),
            annealed.temperature.astype(np.int64),
            TRIES,
            np.uint64(32 - ACCEPTANCE_BITS),
        )
        self._links: tuple[Any, ...]
        if network is None:
            none, no_words = np.zeros(0, dtype=np.int64), np.zeros((0, 0), dtype=np.uint64)
            self._links = (False, False, none, none, no_words, none, none, none, 0)
        else:
            spared_starts, spared = network.spared_links()
            self._links = (
                True,
                network.loops,
                network.starts.astype(np.int64),
                network.neighbour.astype(np.int64),
                _link_words(network.starts, network.neighbour),
                network.part.astype(np.int64),
                spared_starts.astype(np.int64),
                spared.astype(np.int64),
                network.n_parts,
            )

    def in_turns(
        self, sets: Int32Array, *, round_: int, n_steps: int, n_pinned: int
    ) -> Iterator[tuple[int, int, Int64Array]]:
        """Anneal all `n_steps`, turn by turn: yields steps done, steps of the turn, and what each set misses."""
        for first in range(0, n_steps, STEPS_PER_TURN):
            end = min(first + STEPS_PER_TURN, n_steps)
            yield (
                end,
                end - first,
                self.anneal(sets, round_=round_, steps=(first, end), n_steps=n_steps, n_pinned=n_pinned),
            )

    def anneal(
        self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int = 0
    ) -> Int64Array:
        """Go steps[0] .. steps[1] - 1 of `n_steps` with every set of (W, k), which is changed; return (W,) missing.

        The first `n_pinned` of a set, fewer than k, stay. Missing is 0 where all constraints are met and the set hangs
        together; otherwise ticks, over all looks that are required, and the penalty for each of `Network.n_violations`.
        A set that misses nothing stays as it is.
        """
        if not 0 <= n_pinned < sets.shape[1]:
            raise ValueError(
                f"pinned candidates: got {n_pinned} of {sets.shape[1]}, expected fewer than there are in a set"
            )
        missing = np.zeros(len(sets), dtype=np.int64)

        def go(number: int) -> None:
            chosen = sets[number].astype(np.int64)
            own = (round_, number, *steps, n_steps, n_pinned, chosen)
            given: list[Any] = [*self._shape, *self._fixed, *self._links, self._penalty, self._seed, *own]
            missing[number] = _anneal(*given)
            sets[number] = chosen

        in_threads(go, len(sets))
        return missing


def _rows_by_class(
    problem: CoverProblem, class_of: Int32Array, n_classes: int
) -> tuple[Int64Array, NDArray[np.uint32]]:
    """Rows that each candidate sees, those of one class together, as CSR: (N * classes + 1,) and (M,)."""
    owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))
    piece = owner * n_classes + class_of[problem.row]
    order = np.argsort(piece, kind="stable")
    starts = np.searchsorted(piece[order], np.arange(problem.n_candidates * n_classes + 1)).astype(np.int64)
    return starts, problem.row[order].astype(np.uint32)


def _link_words(starts: Int64Array, neighbour: Int32Array) -> UInt64Array:
    """(N, words) uint64: bit c % 64 of word c / 64 of row b, candidates b and c are linked."""
    n = starts.size - 1
    words = np.zeros((n, -(-n // 64)), dtype=np.uint64)
    owner = np.repeat(np.arange(n), np.diff(starts))
    np.bitwise_or.at(words, (owner, neighbour >> 6), _ONE << (neighbour & 63).astype(np.uint64))
    return words


# ----------------------------------------------------------------------------------- random numbers
@compiled
def _philox(round_: int, step: int, number: int, draw: int, seed: Any) -> Any:
    """Four numbers below 2^32, as uint64: Philox 4x32, ten rounds (Salmon et al. 2011)."""
    x0, x1, x2, x3 = np.uint64(round_), np.uint64(step), np.uint64(number), np.uint64(draw)
    k0, k1 = seed & _LOW, seed >> _HALF
    for _ in range(10):
        p0, p1 = x0 * _MULTIPLY_0, x2 * _MULTIPLY_1
        x0, x1, x2, x3 = (p1 >> _HALF) ^ x1 ^ k0, p1 & _LOW, (p0 >> _HALF) ^ x3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _WEYL_0) & _LOW, (k1 + _WEYL_1) & _LOW
    return x0, x1, x2, x3


@compiled
def _below(number: Any, n: int) -> Any:
    return np.int64((number * np.uint64(n)) >> _HALF)


# --------------------------------------------------------------------------------- links of a set
@compiled
def _lowest_bit(word: Any) -> Any:
    return _BIT_OF_WINDOW[((word & (~word + _ONE)) * _WINDOWS) >> _WINDOW_SHIFT]


@compiled
def _unlink_place(bits: Any, place: int) -> None:
    mask = ~(_ONE << np.uint64(place & 63))
    for w in range(bits.shape[1]):
        left = bits[place, w]
        while left != 0:
            bits[w * 64 + _lowest_bit(left), place >> 6] &= mask
            left &= left - _ONE
        bits[place, w] = 0


@compiled
def _link_place(bits: Any, place: int, sets: Any, n: int, link_words: Any) -> None:
    mask = _ONE << np.uint64(place & 63)
    linked = link_words[sets[place]]
    for p in range(n):
        if p == place or (linked[sets[p] >> 6] >> np.uint64(sets[p] & 63)) & _ONE == 0:
            continue
        bits[place, p >> 6] |= _ONE << np.uint64(p & 63)
        bits[p, place >> 6] |= mask


@compiled
def _violations_of(
    bits: Any, loops: bool, sets: Any, part: Any, n_in_part: Any, spared_starts: Any, spared: Any, seen: Any,
    queue: Any, parent: Any, below: Any, linked: Any,
) -> Any:  # fmt: skip
    """Components of the places; with `loops` also bridges that might be avoided, in parts of three places or more.

    Places are found breadth first. The link from a place to its parent is a bridge where no other leads out of what was
    found from the place on: `below`, and where its links lead: `linked`. The last five arguments are room to work in.
    """
    n_set, words = bits.shape
    violations, head, tail = 0, 0, 0
    seen[:] = 0
    for root in range(n_set):
        if (seen[root >> 6] >> np.uint64(root & 63)) & _ONE != 0:
            continue
        violations += 1
        seen[root >> 6] |= _ONE << np.uint64(root & 63)
        parent[root] = -1
        queue[tail] = root
        tail += 1
        while head < tail:
            p = queue[head]
            for w in range(words):
                fresh = bits[p, w] & ~seen[w]
                seen[w] |= fresh
                while fresh != 0:
                    queue[tail] = w * 64 + _lowest_bit(fresh)
                    parent[queue[tail]] = p
                    tail += 1
                    fresh &= fresh - _ONE
            head += 1
    if not loops:
        return violations
    linked[:] = bits
    below[:] = 0
    for at in range(n_set - 1, -1, -1):
        p = queue[at]
        above = parent[p]
        below[p, p >> 6] |= _ONE << np.uint64(p & 63)
        if above < 0:
            continue
        others = np.uint64(0)
        for w in range(words):
            out = linked[p, w] & ~below[p, w]
            back = bits[above, w] & below[p, w]
            if w == above >> 6:
                out &= ~(_ONE << np.uint64(above & 63))
            if w == p >> 6:
                back &= ~(_ONE << np.uint64(p & 63))
            others |= out | back
            below[above, w] |= below[p, w]
            linked[above, w] |= linked[p, w]
        if others == 0 and n_in_part[part[sets[p]]] > 2:
            avoidable = 1
            for e in range(spared_starts[sets[p]], spared_starts[sets[p] + 1]):
                if spared[e] == sets[above]:
                    avoidable = 0
            violations += avoidable
    return violations


# ----------------------------------------------------------------------------------- one set's steps
@compiled
def _missing_of(required: Any, seen_from: Any, class_starts: Any, classes: Any, covered: Any) -> Any:
    missing = 0
    for k in range(required.size):
        for look in range(seen_from[k]):
            left = required[k]
            for e in range(class_starts[k], class_starts[k + 1]):
                left -= covered[classes[e], look]
            missing += max(left, 0)
    return missing


@compiled
def _change_looks(
    by: int, candidate: int, starts: Any, row: Any, ticks: Any, count: Any, added: Any, covered: Any
) -> None:
    """Let a candidate come (1) or go (-1): how often its rows are seen, what one look more adds, what is covered."""
    n_classes, n_levels = covered.shape
    for c in range(n_classes):
        for e in range(starts[candidate * n_classes + c], starts[candidate * n_classes + c + 1]):
            r = row[e]
            before = count[r]
            after = before + by
            count[r] = after
            if min(before, after) < n_levels:
                covered[c, min(before, after)] += by * ticks[r]
                if before < n_levels:
                    added[before, r] = 0
                if after < n_levels:
                    added[after, r] = ticks[r]


@compiled
def _add_ticks(covered: Any, candidate: int, starts: Any, row: Any, added: Any) -> None:
    """Add what one look more by a candidate covers, of each class by each number of looks."""
    n_classes, n_levels = covered.shape
    for c in range(n_classes):
        first, end = starts[candidate * n_classes + c], starts[candidate * n_classes + c + 1]
        for look in range(n_levels):
            worth = 0
            for e in range(first, end):
                worth += added[look, row[e]]
                if worth < 0:
                    break  # never: without it the compiler takes instructions that gather, which are slower here
            covered[c, look] += worth


@compiled
def _anneal(
    n_candidates: int, n_rows: int, n_classes: int, n_levels: int,
    starts: Any, row: Any, ticks: Any, required: Any, seen_from: Any, class_starts: Any, classes: Any,
    nearest: Any, acceptance: Any, temperature: Any, n_tries: int, acceptance_shift: Any,
    has_network: bool, loops: bool, link_starts: Any, link: Any, link_words: Any, part: Any, spared_starts: Any,
    spared: Any, n_parts: int,
    penalty: int, seed: Any, round_: int, number: int, first_step: int, last_step: int, n_steps: int, n_pinned: int,
    sets: Any,
) -> Any:  # fmt: skip
    """Anneal one set. sets : (n_set,) int64, read and written. Returns what it misses."""
    n_set, n_near = sets.size, nearest.shape[1]
    inside = np.zeros(n_candidates, dtype=np.uint8)
    count = np.zeros(n_rows, dtype=np.int32)
    added = np.zeros((n_levels, n_rows), dtype=np.int64)
    added[0] = ticks
    covered = np.zeros((n_classes, n_levels), dtype=np.int64)
    without, then_covered = np.empty_like(covered), np.empty_like(covered)

    # 1. How often each row is seen, and how much of each class.
    for place in range(n_set):
        inside[sets[place]] = 1
        _change_looks(1, sets[place], starts, row, ticks, count, added, covered)
    least = _missing_of(required, seen_from, class_starts, classes, covered)
    n_set_of_bits = n_set if has_network else 0
    bits = np.zeros((n_set_of_bits, (n_set_of_bits + 63) >> 6), dtype=np.uint64)
    seen = np.zeros(bits.shape[1], dtype=np.uint64)
    queue, parent = np.zeros(n_set_of_bits, dtype=np.int64), np.zeros(n_set_of_bits, dtype=np.int64)
    below, linked = np.zeros_like(bits), np.zeros_like(bits)
    n_in_part = np.zeros(n_parts, dtype=np.int64)
    n_parts_used = 0
    if has_network:
        for place in range(n_set):
            _link_place(bits, place, sets, place, link_words)
            n_parts_used += n_in_part[part[sets[place]]] == 0
            n_in_part[part[sets[place]]] += 1
        violations = _violations_of(
            bits, loops, sets, part, n_in_part, spared_starts, spared, seen, queue, parent, below, linked
        )
        least += penalty * (violations - n_parts_used)

    step = first_step
    while step < last_step and least > 0:
        # 2. One station goes.
        at_ticks = temperature[step * temperature.size // n_steps]
        place = n_pinned + _below(_philox(round_, step, number, 0, seed)[0], n_set - n_pinned)
        out = sets[place]
        without[:] = covered
        _change_looks(-1, out, starts, row, ticks, count, added, without)
        if has_network:
            _unlink_place(bits, place)
            n_in_part[part[out]] -= 1
            n_parts_used -= n_in_part[part[out]] == 0
        # 3. One comes: the first that is let in.
        into = out
        for draw in range(1, n_tries + 1):
            x, y, z, w = _philox(round_, step, number, draw, seed)
            way = _below(x, 8 if has_network else 4)
            if has_network and (way == 1 or way == 2):
                origin = sets[_below(w, n_set)]
                n_links = link_starts[origin + 1] - link_starts[origin]
                if n_links == 0:
                    continue
                other = link[link_starts[origin] + _below(y, n_links)]
            elif way != 0:
                if n_near == 0:
                    continue
                other = nearest[out, _below(y, n_near)]
            else:
                other = _below(y, n_candidates)
            if inside[other] != 0:
                continue
            then_covered[:] = without
            _add_ticks(then_covered, other, starts, row, added)
            then = _missing_of(required, seen_from, class_starts, classes, then_covered)
            most = least + ((at_ticks * acceptance[z >> acceptance_shift]) >> 16)
            if then > most:
                continue
            if has_network:
                sets[place] = other
                _link_place(bits, place, sets, n_set, link_words)
                is_first = n_in_part[part[other]] == 0
                n_in_part[part[other]] += 1
                violations = _violations_of(
                    bits, loops, sets, part, n_in_part, spared_starts, spared, seen, queue, parent, below, linked
                )
                then += penalty * (violations - n_parts_used - is_first)
                if then > most:
                    _unlink_place(bits, place)
                    n_in_part[part[other]] -= 1
                    sets[place] = out
                    continue
                n_parts_used += is_first
            into = other
            least = then
            covered[:] = then_covered
            break
        # 4. Whoever it is counts.
        _change_looks(1, into, starts, row, ticks, count, added, without)
        sets[place] = into
        inside[out] = 0
        inside[into] = 1
        if has_network and into == out:
            _link_place(bits, place, sets, n_set, link_words)
            n_parts_used += n_in_part[part[out]] == 0
            n_in_part[part[out]] += 1
        step += 1
    return least
