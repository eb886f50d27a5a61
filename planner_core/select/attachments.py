"""Attachment modes of a candidate in a connected set: first of its part, or linked to a neighbour that it repeats.

Input a `CoverProblem` and a `Network`, output `AttachmentModes`. Where chosen stations are connected there is a tree
over those of each part, from any of them on: all others have a parent that they are linked to. Of the stations that see
a row, the one that is nearest to the first has a parent that does not see it. So nothing is lost when a station counts
only for the rows that its parent does not see: every row that the set sees is still counted once. Links require
overlap, so that this is much less, and the relaxation of a connected set needs more stations
(`planner_core.select.large_bound`).

A candidate has many neighbours. They are put into a few groups of such as see the same of it, and a mode leaves out
only what all of a group see: that counts more than any parent of the group would leave, and holds all the more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.compiled import compiled, share_out
from planner_core.model import Int32Array, Int64Array
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

#: Groups of neighbours of a candidate, at most.
_GROUPS = 6


@dataclass(frozen=True)
class AttachmentModes:
    """starts : (N + 1,) int64, the modes of each candidate. first_of : (W,) int64, part of which a mode makes it the
    first station, of whom each part has one; -1: it is another's neighbour. The last mode of each, with a network.

    again_starts, again : (W + 1,) int64 and (E,) int32, rows of the candidate that a mode does not count, as CSR.
    """

    starts: Int64Array
    first_of: Int64Array
    again_starts: Int64Array
    again: Int32Array

    @property
    def n_modes(self) -> int:
        """Number of modes, of all candidates."""
        return int(self.first_of.size)

    def owner(self) -> Int64Array:
        """(W,) int64: candidate of each mode."""
        return np.repeat(np.arange(self.starts.size - 1), np.diff(self.starts))


def attachment_modes(problem: CoverProblem, network: Network | None) -> AttachmentModes:
    """Modes of all candidates; without a network each has one, which counts all that it sees."""
    n = problem.n_candidates
    if network is None:
        none = np.zeros(0, dtype=np.int32)
        return AttachmentModes(np.arange(n + 1), np.full(n, -1, dtype=np.int64), np.zeros(n + 1, dtype=np.int64), none)
    link_starts = network.starts.astype(np.int64)
    found: dict[int, tuple[Any, ...]] = {}

    def group(first: int, end: int) -> None:
        found[first] = _groups(
            problem.starts, problem.row, link_starts, network.neighbour, problem.n_rows, _GROUPS, first, end
        )

    share_out(group, n)
    parts = [found[first] for first in sorted(found)]
    n_groups = np.concatenate([part[0] for part in parts])
    size, again = (np.concatenate([part[at] for part in parts]) for at in (1, 2))
    # Behind its groups: the first of its part, who repeats nothing.
    starts = np.concatenate([[0], np.cumsum(n_groups + 1)]).astype(np.int64)
    first_of = np.full(int(starts[-1]), -1, dtype=np.int64)
    first_of[starts[1:] - 1] = network.part
    sizes = np.zeros(first_of.size, dtype=np.int64)
    sizes[first_of < 0] = size
    return AttachmentModes(starts, first_of, np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64), again)


def sums_of_modes(
    problem: CoverProblem, modes: AttachmentModes, worth: NDArray[Any], again_worth: NDArray[Any]
) -> NDArray[Any]:
    """(W,): what rows are worth together, (R,), that each mode counts; `again_worth` is taken off for those it doesn't.

    Whole numbers stay whole, and wrap around as NumPy's do.
    """
    out = np.empty(modes.n_modes, dtype=worth.dtype)
    fixed = (problem.starts, problem.row, modes.starts, modes.again_starts, modes.again, worth, again_worth, out)
    share_out(lambda first, end: _sums(*fixed, first, end), problem.n_candidates)
    return out


@compiled
def _sums(
    starts: Any, row: Any, mode_starts: Any, again_starts: Any, again: Any, worth: Any, again_worth: Any, out: Any,
    first: int, end: int,
) -> None:  # fmt: skip
    for i in range(first, end):
        whole = worth[:0].sum()
        for e in range(starts[i], starts[i + 1]):
            whole += worth[row[e]]
        for mode in range(mode_starts[i], mode_starts[i + 1]):
            less = whole
            for e in range(again_starts[mode], again_starts[mode + 1]):
                less -= again_worth[again[e]]
            out[mode] = less


@compiled
def _bits_of(word: Any) -> Any:
    """Number of bits that are set."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@compiled
def _groups(
    starts: Any, row: Any, link_starts: Any, link: Any, n_rows: int, most: int, first: int, end: int
) -> Any:  # fmt: skip
    """Groups of neighbours of candidates first .. end - 1: number of each, their sizes, and the rows that all see.

    The head of the first group is the neighbour that shares least; that of the next is always the one that would take
    most from all groups before it (Gonzalez 1985). All others go where they take least from what the head shares.
    """
    place = np.full(n_rows, -1, dtype=np.int64)
    n_groups = np.zeros(end - first, dtype=np.int64)
    sizes = np.zeros((end - first) * most + 1, dtype=np.int64)
    again = np.empty(1024, dtype=np.int32)
    n_sizes, n_again = 0, 0
    for i in range(first, end):
        begin, n_own = starts[i], starts[i + 1] - starts[i]
        n_links, n_words = link_starts[i + 1] - link_starts[i], (n_own + 63) // 64
        if n_links == 0:
            continue
        for k in range(n_own):
            place[row[begin + k]] = k
        shared = np.zeros((n_links, n_words), dtype=np.uint64)
        size = np.zeros(n_links, dtype=np.int64)
        for q in range(n_links):
            other = link[link_starts[i] + q]
            for e in range(starts[other], starts[other + 1]):
                k = place[row[e]]
                if k >= 0:
                    shared[q, k >> 6] |= np.uint64(1) << np.uint64(k & 63)
                    size[q] += 1
        for k in range(n_own):
            place[row[begin + k]] = -1
        unlike = np.full(n_links, n_own + 1, dtype=np.int64)
        group = np.zeros(n_links, dtype=np.int64)
        head = np.argmin(size)
        n = 0
        while n < most and unlike[head] > 0:
            for q in range(n_links):
                both = 0
                for w in range(n_words):
                    both += _bits_of(shared[q, w] & shared[head, w])
                lost = size[head] - both
                if lost < unlike[q]:
                    unlike[q] = lost
                    group[q] = n
            unlike[head] = 0
            group[head] = n
            n += 1
            head = np.argmax(unlike)
        n_groups[i - first] = n
        for g in range(n):
            all_see = np.full(n_words, ~np.uint64(0), dtype=np.uint64)
            for q in range(n_links):
                if group[q] == g:
                    for w in range(n_words):
                        all_see[w] &= shared[q, w]
            if n_again + n_own > again.size:
                more = np.empty(2 * again.size + n_own, dtype=np.int32)
                more[:n_again] = again[:n_again]
                again = more
            before = n_again
            for k in range(n_own):
                if (all_see[k >> 6] >> np.uint64(k & 63)) & np.uint64(1) != 0:
                    again[n_again] = row[begin + k]
                    n_again += 1
            sizes[n_sizes] = n_again - before
            n_sizes += 1
    return n_groups, sizes[:n_sizes].copy(), again[:n_again].copy()
