"""Pairs of rows of patches, compiled: what they have in common, and sums over it.

Rows are those of a `Visibility`, CSR, sorted. Imported where it is used, see `planner_core.compiled`. The rules are
those of `planner_core.network.pair_overlap`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner_core.compiled import compiled
from planner_core.model import FloatArray, Int32Array, Int64Array

UInt64Array = NDArray[np.uint64]

#: Patches that are summed up together: the bits of a word.
BLOCK = 64
NEAR_M = 7.5
"""Up to some such range a start moves surface by no more than points are matched over: half a degree and 0.03 m, 0.1 m;
3 degrees and 0.15 m, 0.54 m. Beyond, what surface holds counts less, by the square of its range from each station."""
_ONE = np.uint64(1)


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
def count_blocks(starts: Int64Array, patch: Int32Array, n_blocks: Int64Array) -> None:
    """Blocks of 64 patches that each row has patches of, (N,)."""
    for row in range(starts.size - 1):
        n_blocks[row] = 0
        for entry in range(starts[row], starts[row + 1]):
            is_new = entry == starts[row] or patch[entry] // BLOCK != patch[entry - 1] // BLOCK
            n_blocks[row] += is_new


@compiled
def find_blocks(starts: Int64Array, patch: Int32Array, block: Int32Array, seen: UInt64Array) -> None:
    """Rows as blocks, one behind the other: their numbers, and bit p % 64 of `seen` for each patch p of the row."""
    at = -1
    for row in range(starts.size - 1):
        for entry in range(starts[row], starts[row + 1]):
            number = patch[entry] // BLOCK
            if entry == starts[row] or block[at] != number:
                at += 1
                block[at] = number
                seen[at] = 0
            seen[at] |= _ONE << np.uint64(patch[entry] % BLOCK)


@compiled
def add_block(
    number: int, seen: np.uint64, place: Int32Array, surface: FloatArray, turn: FloatArray, total: FloatArray
) -> None:
    """Total (24,) of `pair_overlap.patch_sums` over the patches of a block, in rising order. turn : (3,), room."""
    total[:] = 0.0
    for bit in range(BLOCK):
        if (seen >> np.uint64(bit)) & _ONE:
            one = surface[place[number * BLOCK + bit]]
            area = one[6]
            turn[0] = one[1] * one[5] - one[2] * one[4]
            turn[1] = one[2] * one[3] - one[0] * one[5]
            turn[2] = one[0] * one[4] - one[1] * one[3]
            column = 0
            for i in range(3):
                for j in range(i, 3):
                    total[column] += one[3 + i] * one[3 + j] * area
                    total[14 + column] += turn[i] * turn[j] * area
                    column += 1
            for i in range(3):
                for j in range(3):
                    if column < 14:
                        total[column] += one[3 + i] * turn[j] * area
                        column += 1
                total[20 + i] += one[i] * area
            total[23] += (one[0] * one[0] + one[1] * one[1] + one[2] * one[2]) * area


@compiled
def add_sums(sums: FloatArray, one_m: FloatArray, other_m: FloatArray, total: FloatArray) -> None:
    """Add a block's sums (24,) to a pair's (30,), whose last six are a n n' again, by how near the block is to both."""
    total[:24] += sums
    area = sums[0] + sums[3] + sums[5]  # normals are unit vectors
    if area <= 0.0:
        return
    weight = 1.0
    for at_m in (one_m, other_m):
        # Sum of a |p - s|^2 = sum of a |p|^2 - 2 s . sum of a p + |s|^2 sum of a.
        along = at_m[0] * sums[20] + at_m[1] * sums[21] + at_m[2] * sums[22]
        squared_m2 = (sums[23] - 2.0 * along) / area + (at_m[0] * at_m[0] + at_m[1] * at_m[1] + at_m[2] * at_m[2])
        if squared_m2 > NEAR_M * NEAR_M:
            weight *= NEAR_M * NEAR_M / squared_m2
    for column in range(6):
        total[24 + column] += weight * sums[column]


@compiled
def add_rows_of_sums(
    starts: Int64Array, sums: FloatArray, one_m: FloatArray, other_m: FloatArray, total: FloatArray
) -> None:
    """Total (K, 30) of pairs, of the sums (B, 24) of blocks, those of pair k from starts[k]; (K, 3) their positions."""
    for pair in range(starts.size - 1):
        total[pair] = 0.0
        for at in range(starts[pair], starts[pair + 1]):
            add_sums(sums[at], one_m[pair], other_m[pair], total[pair])


@compiled
def add_over_common(
    starts: Int64Array,
    block: Int32Array,
    seen: UInt64Array,
    place: Int32Array,
    first: Int32Array,
    second: Int32Array,
    surface: FloatArray,
    position_m: FloatArray,
    total: FloatArray,
) -> None:
    """Total (K, 30) of `pair_overlap.patch_sums` over the patches that pairs of rows (K,), sorted by first, share.

    A block's patches are added up in rising order, then blocks in theirs. Positions see nearly the same from near by:
    what the first shares of a block with others is mostly all that it sees of it, or what it shared with the one
    before, and these two sums are kept. Others are made as they are added up: the sums of all patches would take more
    memory than all else about links.

    starts, block, seen : of `find_blocks`, those of row i from starts[i]. place : (P,) where in `surface`, (S, 7)
    centroid, normal and area, each patch is. position_m : (N, 3) of the rows.
    """
    n_blocks = place.size // BLOCK + 1
    mine, own_at = np.zeros(n_blocks, dtype=np.uint64), np.zeros(n_blocks, dtype=np.int64)
    turn = np.empty(3)
    most = 0
    for row in range(starts.size - 1):
        most = max(most, starts[row + 1] - starts[row])
    # Of each block of the first: what was shared, 0 for nothing yet, and its sums; all of it, and the one before.
    kept, sums = np.zeros((most, 2), dtype=np.uint64), np.empty((most, 2, 24))
    for pair in range(first.size):
        begin, end = starts[first[pair]], starts[first[pair] + 1]
        if pair == 0 or first[pair] != first[pair - 1]:
            if pair > 0:
                for at in range(starts[first[pair - 1]], starts[first[pair - 1] + 1]):
                    mine[block[at]] = 0
            for at in range(begin, end):
                mine[block[at]], own_at[block[at]] = seen[at], at - begin
            kept[: end - begin] = 0
        total[pair] = 0.0
        one_m, other_m = position_m[first[pair]], position_m[second[pair]]
        for at in range(starts[second[pair]], starts[second[pair] + 1]):
            number = block[at]
            common = mine[number] & seen[at]
            if common == 0:
                continue
            k, one = own_at[number], int(common != mine[number])
            if kept[k, one] != common:
                add_block(number, common, place, surface, turn, sums[k, one])
                kept[k, one] = common
            add_sums(sums[k, one], one_m, other_m, total[pair])


@compiled
def hold_targets(
    row: int,
    starts: Int64Array,
    patch: Int32Array,
    centroid_m: FloatArray,
    part: Int32Array,
    position_m: FloatArray,
    limits: tuple[float, float, float, float],
    found: NDArray[np.bool_],
) -> None:
    """Whether a row and each later one, found (N,), of another part have patches in common that hold three targets.

    limits : metres that positions are apart at most; that two targets are, level, and as a share of the range to their
    middle; that the third is off their line. Rules of `planner_core.network.targets.target_places`.
    """
    farthest = limits[0]
    common = np.empty(starts[row + 1] - starts[row], dtype=np.int32)
    found[: row + 1] = False
    for other in range(row + 1, part.size):
        found[other] = False
        if part[other] == part[row] or _square(position_m[row], position_m[other]) > farthest * farthest:
            continue
        n, one, two = 0, starts[row], starts[other]
        while one < starts[row + 1] and two < starts[other + 1]:
            if patch[one] == patch[two]:
                common[n] = patch[one]
                n += 1
            if patch[one] <= patch[two]:
                one += 1
            else:
                two += 1
        found[other] = n >= 3 and _hold(common[:n], centroid_m, position_m[row], position_m[other], limits)


@compiled
def _square(one: FloatArray, other: FloatArray) -> float:
    square = 0.0
    for axis in range(one.size):
        square += (one[axis] - other[axis]) ** 2
    return square


@compiled
def _farthest_of(patches: Int32Array, at_m: FloatArray, from_m: FloatArray) -> int:
    """Which of the patches is farthest from a place, level; the first of equals."""
    best, most = 0, -1.0
    for place in range(patches.size):
        away = _square(at_m[patches[place], :2], from_m[:2])
        if away > most:
            best, most = place, away
    return int(patches[best])


@compiled
def _hold(
    patches: Int32Array,
    at_m: FloatArray,
    one: FloatArray,
    other: FloatArray,
    limits: tuple[float, float, float, float],
) -> bool:
    _, apart, of_range, off_line = limits
    middle = np.zeros(3)
    for place in patches:
        middle += at_m[place]
    first = at_m[_farthest_of(patches, at_m, middle / patches.size)]
    second = at_m[_farthest_of(patches, at_m, first)]
    between = 0.5 * (first + second)
    range2 = max(_square(one, between), _square(other, between))
    if _square(first[:2], second[:2]) < max(apart * apart, of_range * of_range * range2):
        return False
    length2 = _square(first, second)
    for place in patches:
        along = 0.0
        for axis in range(3):
            along += (at_m[place, axis] - first[axis]) * (second[axis] - first[axis])
        if _square(at_m[place], first) - along * along / length2 >= off_line * off_line:
            return True
    return False
