"""Pairs of rows of patches, compiled: what they have in common, and sums over it.

Rows are those of a `Visibility`, CSR, sorted. Imported where it is used, see `planner_core.compiled`. The rules are
those of `planner_core.network.pair_overlap`.
"""

from __future__ import annotations

import numpy as np

from planner_core.compiled import compiled
from planner_core.model import FloatArray, Int32Array, Int64Array, UInt8Array


@compiled
def add_rows(starts: Int64Array, patch: Int32Array, value: FloatArray, first: int, end: int, total: FloatArray) -> None:
    """Total (N,) of value (P,) over the patches of rows first .. end - 1, each in its order."""
    for row in range(first, end):
        found = 0.0
        for entry in range(starts[row], starts[row + 1]):
            found += value[patch[entry]]
        total[row] = found


@compiled
def find_seers(
    starts: Int64Array, patch: Int32Array, ends: Int64Array, seer: Int32Array, after: Int32Array | Int64Array
) -> None:
    """Rows that hold each patch, in rising order: seer (M,), those of patch p before ends[p].

    ends : (P,) where each patch's begin; then where they end. after : (M,) for each entry of the rows, where in `seer`
    the rows after its own begin.
    """
    for row in range(starts.size - 1):
        for entry in range(starts[row], starts[row + 1]):
            at = ends[patch[entry]]
            seer[at] = row
            ends[patch[entry]] = at + 1
            after[entry] = at + 1


@compiled
def add_common(
    starts: Int64Array,
    patch: Int32Array,
    ends: Int64Array,
    seer: Int32Array,
    after: Int32Array | Int64Array,
    value: FloatArray,
    rows: tuple[int, int],
    n_others: Int64Array,
    other: Int32Array,
    common: FloatArray,
) -> None:
    """Later rows that have any patch in common with each of rows[0] .. rows[1] - 1, and the sum of value (P,) over it.

    Written one behind the other, row by row: n_others (rows,), other and common (at most rows x N).
    """
    found = np.zeros(starts.size - 1)
    at = 0
    for row in range(rows[0], rows[1]):
        for entry in range(starts[row], starts[row + 1]):
            each = value[patch[entry]]
            for k in range(after[entry], ends[patch[entry]]):
                found[seer[k]] += each
        before = at
        for one in range(row + 1, found.size):
            if found[one] > 0.0:
                other[at] = one
                common[at] = found[one]
                found[one] = 0.0
                at += 1
        n_others[row - rows[0]] = at - before


@compiled
def add_over_common(
    starts: Int64Array,
    patch: Int32Array,
    place: Int32Array,
    first: Int32Array,
    second: Int32Array,
    surface: FloatArray,
    is_mine: UInt8Array,
    total: FloatArray,
) -> None:
    """Total (K, 24) of `pair_overlap.patch_sums` over the patches that pairs of rows (K,), sorted by first, share.

    The patches are taken in rising order. place : (P,) where in `surface` each is, (S, 7): centroid, normal, area. Sums
    are made as they are added up: those of all patches would take more memory than all else about links. is_mine : (P,)
    zeros, and zeros again in the end.
    """
    turn = np.empty(3)
    both = np.empty(patch.size and np.max(np.diff(starts)) + 1, dtype=np.int32)
    for pair in range(first.size):
        if pair == 0 or first[pair] != first[pair - 1]:
            if pair > 0:
                for entry in range(starts[first[pair - 1]], starts[first[pair - 1] + 1]):
                    is_mine[patch[entry]] = 0
            for entry in range(starts[first[pair]], starts[first[pair] + 1]):
                is_mine[patch[entry]] = 1
        n_both = 0
        for entry in range(starts[second[pair]], starts[second[pair] + 1]):
            both[n_both] = patch[entry]
            n_both += is_mine[patch[entry]]
        mine = total[pair]
        mine[:] = 0.0
        for k in range(n_both):
            one = surface[place[both[k]]]
            area = one[6]
            turn[0] = one[1] * one[5] - one[2] * one[4]
            turn[1] = one[2] * one[3] - one[0] * one[5]
            turn[2] = one[0] * one[4] - one[1] * one[3]
            column = 0
            for i in range(3):
                for j in range(i, 3):
                    mine[column] += one[3 + i] * one[3 + j] * area
                    mine[14 + column] += turn[i] * turn[j] * area
                    column += 1
            for i in range(3):
                for j in range(3):
                    if column < 14:
                        mine[column] += one[3 + i] * turn[j] * area
                        column += 1
                mine[20 + i] += one[i] * area
            mine[23] += (one[0] * one[0] + one[1] * one[1] + one[2] * one[2]) * area
    if first.size > 0:
        for entry in range(starts[first[-1]], starts[first[-1] + 1]):
            is_mine[patch[entry]] = 0
