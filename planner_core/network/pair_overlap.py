"""Pairs of positions: how much surface they have in common, and the normal matrix of it, for very many pairs.

Input `Visibility`, patch areas (m^2) and, for matrices, centroids and normals (local frame); output pairs with their
overlap, and (K, 6, 6) float64 matrices. What they mean: `planner_core.network.links`.

Overlaps of all pairs are sums over the rows that hold each patch, in blocks of rows. Normal matrices are only made for
the pairs that are given: 24 sums over the common patches, each taken about the origin, from which those about the
common surface's own centroid follow, and six more of surface near both positions.

A pair's figures are the same to the last bit whatever other positions there are and however they are numbered: areas
are whole ticks, whose sums are exact, and the others run through the common patches in rising order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, OverlapMeasure, Visibility
from planner_core.model.arrays import dots

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: Overlaps are counted in these: sums of up to 131 000 m^2 are exact in float64, in whatever order they are taken.
AREA_TICK_M2 = 2.0**-36

#: Rows at a time: 10 000 positions make blocks of at most 30 MB.
ROWS_A_BLOCK = 256

#: Of them, those that one thread takes at a time.
_ROWS_A_PART = 32

#: Pairs whose sums one thread takes at a time.
_PAIRS_A_CHUNK = 4096
#: Entries that are counted at a time.
_NUMBERS_A_PIECE = 2**22

#: Common surfaces smaller across than this have no rotations to speak of: 1 micrometre, squared.
_LEAST_LENGTH2_M2 = 1e-12

_UPPER = tuple((row, column) for row in range(3) for column in range(row, 3))
#: The ninth, (2, 2), follows: n . (p x n) is zero.
_CROSS = tuple((row, column) for row in range(3) for column in range(3))[:8]
N_SUMS = 24
"""Of a patch, see `patch_sums`. Of a pair there are six more, see `compiled_pairs.add_sums`."""
_OF_PAIR = N_SUMS + 6


@dataclass(frozen=True)
class SharedSurface:
    """Geometry of patches: centroid_m (P, 3) float64, local frame; normal (P, 3) float64, unit."""

    centroid_m: FloatArray
    normal: FloatArray


@dataclass(frozen=True)
class Pairs:
    """Pairs of positions, first < second, by first, then second. Both (K,) int32.

    overlap : (K,) float64, by the measure required. share : (K,), by the smaller share.
    """

    first: Int32Array
    second: Int32Array
    overlap: FloatArray
    share: FloatArray

    def take(self, which: BoolArray) -> Pairs:
        """Those of `which`, (K,)."""
        return Pairs(self.first[which], self.second[which], self.overlap[which], self.share[which])


@dataclass(frozen=True)
class HeldPairs:
    """What pairs' common surfaces hold, (K,) each. strength : as of a link.

    hold_m2 : smallest eigenvalue of sum a w n n' over it; w is 1 of surface near both stations, and falls with
    the square of its range from each.
    """

    strength: FloatArray
    hold_m2: FloatArray


_NO_PAIRS = Pairs(np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int32), np.empty(0), np.empty(0))


def overlapping_pairs(
    visibility: Visibility,
    patch_area_m2: FloatArray,
    *,
    min_overlap: float,
    measure: OverlapMeasure = OverlapMeasure.SMALLER_SHARE,
    rows_a_block: int = ROWS_A_BLOCK,
) -> Iterator[Pairs]:
    """All pairs that overlap, by at least `min_overlap`, for `rows_a_block` first positions after the other.

    Yields as often as there are blocks. Pairs that have nothing in common are left out even where `min_overlap` is 0.
    """
    overlaps, n = (
        PairOverlaps(visibility, patch_area_m2, min_overlap=min_overlap, measure=measure),
        visibility.starts.size - 1,
    )
    for begin in range(0, n, rows_a_block):
        yield overlaps.of_rows(begin, min(begin + rows_a_block, n))


class PairOverlaps:
    """Pairs of rows of a `Visibility` that overlap by at least `min_overlap`.

    seen : patches that anybody sees, (S,) int64, and (P,) int32, the place among them of each that is.
    """

    def __init__(
        self, visibility: Visibility, patch_area_m2: FloatArray, *, min_overlap: float, measure: OverlapMeasure
    ) -> None:
        from planner_core.network.compiled_pairs import find_seers

        self._starts, self._min_overlap, self._measure = visibility.starts, min_overlap, measure
        self._patch = visibility.patch
        self._ticks, self._whole = area_ticks(patch_area_m2), seen_ticks(visibility, patch_area_m2)
        n_seers = _counts(self._patch, visibility.n_patches)
        self.seen = _seen(n_seers > 0)
        self._ends, self._seer = np.cumsum(n_seers) - n_seers, np.empty_like(self._patch)
        # 32 bits where they do: next to the patches themselves this is most of what links take.
        n = self._patch.size
        self._after: Int32Array | Int64Array = np.empty(n, np.int32) if n < 2**31 else np.empty(n, np.int64)
        find_seers(visibility.starts, self._patch, self._ends, self._seer, self._after)

    def of_rows(self, begin: int, end: int) -> Pairs:
        """Those whose first row is one of begin .. end - 1."""
        from planner_core.compiled import in_threads
        from planner_core.network.compiled_pairs import add_common

        n = self._starts.size - 1
        parts = range(begin, end, _ROWS_A_PART)
        found: list[Pairs] = [_NO_PAIRS] * len(parts)

        def work(number: int) -> None:
            rows = (parts[number], min(parts[number] + _ROWS_A_PART, end))
            n_others = np.empty(rows[1] - rows[0], dtype=np.int64)
            second = np.empty(n_others.size * n, dtype=np.int32)
            common = np.empty(n_others.size * n)
            seers = (self._starts, self._patch, self._ends, self._seer, self._after)
            add_common(*seers, self._ticks, rows, n_others, second, common)
            first = np.repeat(np.arange(*rows, dtype=np.int32), n_others)
            second, common = second[: first.size], common[: first.size]
            whole = self._whole[first], self._whole[second]
            overlap = share = overlap_by(OverlapMeasure.SMALLER_SHARE, common, *whole)
            if self._measure != OverlapMeasure.SMALLER_SHARE:
                overlap = overlap_by(self._measure, common, *whole)
            found[number] = Pairs(first, second, overlap, share).take(overlap >= self._min_overlap)

        in_threads(work, len(parts))
        return joined_pairs(found)


def joined_pairs(some: Sequence[Pairs]) -> Pairs:
    """All of them, one behind the other."""
    return Pairs(
        np.concatenate([_NO_PAIRS.first, *(pairs.first for pairs in some)]),
        np.concatenate([_NO_PAIRS.second, *(pairs.second for pairs in some)]),
        np.concatenate([_NO_PAIRS.overlap, *(pairs.overlap for pairs in some)]),
        np.concatenate([_NO_PAIRS.share, *(pairs.share for pairs in some)]),
    )


def overlap_by(measure: OverlapMeasure, common: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """(K,) overlap of pairs, from whole ticks, (K,), that both see, the first sees and the second sees.

    What both see is more than nothing. Whole ticks leave one rounding, that of the division: the smaller share is never
    less than Jaccard's index, not even in the last bit.
    """
    larger = np.maximum(first, second)
    if measure == OverlapMeasure.JACCARD:
        larger = larger + (np.minimum(first, second) - common)
    share: FloatArray = common / larger
    return share


def area_ticks(patch_area_m2: FloatArray) -> FloatArray:
    """(P,) float64, areas in whole ticks."""
    ticks: FloatArray = np.rint(np.asarray(patch_area_m2, dtype=np.float64) / AREA_TICK_M2)
    return ticks


def seen_ticks(visibility: Visibility, patch_area_m2: FloatArray) -> FloatArray:
    """(N,) float64, ticks that each position sees."""
    from planner_core.compiled import share_out
    from planner_core.network.compiled_pairs import add_rows

    ticks, total = area_ticks(patch_area_m2), np.empty(visibility.n_positions)
    share_out(lambda first, end: add_rows(visibility.starts, visibility.patch, ticks, first, end, total), total.size)
    return total


class PairSums:
    """Sums over the surface that pairs of rows of a `Visibility` have in common.

    position_m : (N, 3) where the rows look from, local. seen : as of `PairOverlaps`; found where it is not given.
    """

    def __init__(
        self,
        visibility: Visibility,
        patch_area_m2: FloatArray,
        surface: SharedSurface,
        position_m: FloatArray,
        *,
        seen: tuple[Int64Array, Int32Array] | None = None,
    ) -> None:
        from planner_core.network.compiled_pairs import count_blocks, find_blocks

        rows = visibility.starts, visibility.patch
        at, place = _seen(_counts(visibility.patch, visibility.n_patches) > 0) if seen is None else seen
        starts = np.zeros(visibility.starts.size, dtype=np.int64)
        count_blocks(*rows, starts[1:])
        np.cumsum(starts, out=starts)
        block, words = np.empty(starts[-1], dtype=np.int32), np.empty(starts[-1], dtype=np.uint64)
        find_blocks(*rows, block, words)
        self._rows = starts, block, words, place
        self._surface = np.column_stack([surface.centroid_m[at], surface.normal[at], patch_area_m2[at]])
        self._position_m = np.ascontiguousarray(position_m, dtype=np.float64)

    def of(self, first: Int32Array, second: Int32Array) -> FloatArray:
        """(K, 30) sums for pairs (K,) in any order, see `patch_sums`; zero where nothing is common."""
        found = np.empty((first.size, _OF_PAIR))

        def keep(pairs: Int64Array, sums: FloatArray) -> None:
            found[pairs] = sums

        self._each(first, second, keep)
        return found

    def held(self, first: Int32Array, second: Int32Array) -> HeldPairs:
        """What pairs (K,), in any order, hold."""
        held = HeldPairs(*np.empty((2, first.size)))

        def keep(pairs: Int64Array, sums: FloatArray) -> None:
            of = held_by(sums, matrices_of(sums))
            for all_of_them, some in zip(vars(held).values(), vars(of).values(), strict=True):
                all_of_them[pairs] = some

        self._each(first, second, keep)
        return held

    def _each(self, first: Int32Array, second: Int32Array, keep: Callable[[Int64Array, FloatArray], None]) -> None:
        """Have `keep` take the sums (k, 30) of some pairs, (k,) places among all, after the other, in threads."""
        from planner_core.compiled import in_threads
        from planner_core.network.compiled_pairs import add_over_common

        order = np.argsort(first, kind="stable")

        def work(number: int) -> None:
            pairs = order[number * _PAIRS_A_CHUNK : (number + 1) * _PAIRS_A_CHUNK]
            sums = np.empty((pairs.size, _OF_PAIR))
            add_over_common(*self._rows, first[pairs], second[pairs], self._surface, self._position_m, sums)
            keep(pairs, sums)

        in_threads(work, -(-first.size // _PAIRS_A_CHUNK))


def common_sums(common: Sequence[Int32Array], sums: FloatArray, one_m: FloatArray, other_m: FloatArray) -> FloatArray:
    """(K, 30) of K pairs' surfaces, each its patches in rising order, as `PairSums` has them to the last bit.

    sums : (P, 24), of each patch, see `patch_sums`. one_m, other_m : (K, 3) where they are seen from, local.
    """
    from planner_core.network.compiled_pairs import BLOCK, add_rows_of_sums

    row = np.repeat(np.arange(len(common)), [patch.size for patch in common])
    patch = np.concatenate([np.zeros(0, dtype=np.int32), *common])
    begins = np.flatnonzero((np.diff(row, prepend=-1) != 0) | (np.diff(patch // BLOCK, prepend=-1) != 0))
    of_block = _csr(np.ones(patch.size), patch, np.append(begins, patch.size), (begins.size, sums.shape[0])) @ sums
    starts = np.searchsorted(row[begins], np.arange(len(common) + 1))
    of_pair = np.empty((len(common), _OF_PAIR))
    add_rows_of_sums(starts, np.asarray(of_block), one_m, other_m, of_pair)
    return of_pair


def strengths_of(matrix: FloatArray) -> FloatArray:
    """(K,) strengths in [0, 1] of normal matrices (K, 6, 6): three times the smallest eigenvalue."""
    return np.clip(3.0 * np.linalg.eigvalsh(matrix)[:, 0], 0.0, 1.0) if matrix.shape[0] else np.empty(0)


def held_by(sums: FloatArray, matrix: FloatArray) -> HeldPairs:
    """What pairs hold, of their sums (K, 30) and their matrices."""
    if sums.shape[0] == 0:
        return HeldPairs(*np.empty((2, 0)))
    hold_m2 = np.linalg.eigvalsh(_squares_of_normals(sums[:, N_SUMS:]))[:, 0]
    return HeldPairs(strengths_of(matrix), np.maximum(hold_m2, 0.0))


def _squares_of_normals(sums: FloatArray) -> FloatArray:
    """(K, 3, 3) sum of a n n' of (K, 6 and more) sums."""
    nn = np.empty((sums.shape[0], 3, 3))
    for at, (i, j) in enumerate(_UPPER):
        nn[:, i, j] = nn[:, j, i] = sums[:, at]
    return nn


def _seen(is_seen: BoolArray) -> tuple[Int64Array, Int32Array]:
    """Patches that anybody sees, and of each, (P,), its place among them."""
    return np.flatnonzero(is_seen), np.cumsum(is_seen, dtype=np.int32) - 1


def _counts(number: Int32Array, n: int) -> Int64Array:
    """(n,) int64, how often each of 0 .. n - 1 is there; in pieces, since NumPy makes 64-bit numbers of them."""
    counts = np.zeros(n, dtype=np.int64)
    for begin in range(0, number.size, _NUMBERS_A_PIECE):
        counts += np.bincount(number[begin : begin + _NUMBERS_A_PIECE], minlength=n)
    return counts


def _csr(value: FloatArray, column: Any, starts: Any, shape: tuple[int, int]) -> csr_array:
    from scipy.sparse import csr_array

    # 32 bits wherever they do: they are half of what is read.
    index = np.int32 if value.size < 2**31 else np.int64
    return csr_array((value, column.astype(index, copy=False), starts.astype(index, copy=False)), shape=shape)


def patch_sums(area_m2: FloatArray, centroid_m: FloatArray, normal: FloatArray) -> FloatArray:
    """(P, 24), of each patch: a n n' (6), a n (p x n)' (8), a (p x n)(p x n)' (6), a p (3), a |p|^2 (1)."""
    # Column by column into place: it takes much memory, and would take it three times.
    turn, sums = np.cross(centroid_m, normal), np.empty((area_m2.size, N_SUMS))
    factors = [*((normal, normal, at) for at in _UPPER), *((normal, turn, at) for at in _CROSS)]
    factors += [(turn, turn, at) for at in _UPPER]
    for column, (one, other, (i, j)) in enumerate(factors):
        np.multiply(one[:, i], other[:, j], out=sums[:, column])
    sums[:, 20:23] = centroid_m
    sums[:, 23] = dots(centroid_m, centroid_m)
    sums *= area_m2[:, None]
    return sums


def matrices_of(sums: FloatArray) -> FloatArray:
    """(k, 6, 6) normal matrices about the centroids, scaled by area and length, from sums, (k, 24 and more).

    With K v = c x v: (p - c) x n = p x n - K n, so that the blocks are shifted by products with K alone.
    """
    nn, (nr, rr) = _squares_of_normals(sums), np.empty((2, sums.shape[0], 3, 3))
    for at, (i, j) in enumerate(_UPPER):
        rr[:, i, j] = rr[:, j, i] = sums[:, 14 + at]
    for at, (i, j) in enumerate(_CROSS):
        nr[:, i, j] = sums[:, 6 + at]
    nr[:, 2, 2] = -nr[:, 0, 0] - nr[:, 1, 1]
    area_m2 = np.trace(nn, axis1=1, axis2=2)  # normals are unit vectors
    scale = np.divide(1.0, area_m2, out=np.zeros_like(area_m2), where=area_m2 > 0)[:, None]
    centre_m = sums[:, 20:23] * scale
    length2_m2 = sums[:, 23:24] * scale - (centre_m * centre_m).sum(axis=1, keepdims=True)
    shift = np.zeros_like(nn)
    shift[:, 0, 1], shift[:, 0, 2], shift[:, 1, 2] = -centre_m[:, 2], centre_m[:, 1], -centre_m[:, 0]
    shift -= shift.transpose(0, 2, 1)
    # einsum, not matrix products: the order of its sums does not depend on the number of cores.
    moved = np.einsum("kij,klj->kil", nn, shift)
    turned = np.einsum("kij,kjl->kil", shift, nr)
    rr += np.einsum("kij,kjl->kil", shift, moved) - turned - turned.transpose(0, 2, 1)
    nr -= moved
    extended = length2_m2 > _LEAST_LENGTH2_M2
    per_length = np.sqrt(np.divide(1.0, length2_m2, out=np.zeros_like(length2_m2), where=extended))
    matrix = np.zeros((sums.shape[0], 6, 6))
    each = (scale * extended)[:, :, None]
    per_length = per_length[:, :, None]
    matrix[:, :3, :3] = nn * each
    matrix[:, :3, 3:] = nr * (each * per_length)
    matrix[:, 3:, :3] = matrix[:, :3, 3:].transpose(0, 2, 1)
    matrix[:, 3:, 3:] = rr * (each * per_length * per_length)
    return matrix
