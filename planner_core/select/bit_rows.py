"""How coverage lies on the device: rows as bits in tiles of words, for all candidates side by side, and their weights.

Input `CoverProblem`, output `Tiles`; kernels/genetic_cover.cl reads them. Rows that the same targets count are a class;
a tile holds rows of one class alone, so that a target's sum is that of whole tiles. A row that weighs more than
`PART_BITS` hold is in one tile with its low bits and in another one with those above.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BoolArray, Int32Array, Int64Array
from planner_core.select.problem import CoverProblem

#: Weights are added up in 32 bits, 32 at a time.
PART_BITS = 27


@dataclass(frozen=True)
class Tiles:
    """Bits, weights and classes, tile by tile; the row at place i of a tile is bit i // W of word i % W.

    bits : (n_tiles, N, W) uint32. weights : (n_tiles, 32, W) uint32, in units of 2^shift ticks. shift : (n_tiles,)
    int32. near : (n_tiles, ceil(N / 32)) uint32, candidates that see anything of the tile, bit by bit. class_of :
    (n_tiles,) int32. counts : (K, n_classes) uint8, 1 where a target counts a class.
    """

    bits: NDArray[np.uint32]
    weights: NDArray[np.uint32]
    shift: Int32Array
    near: NDArray[np.uint32]
    class_of: Int32Array
    counts: NDArray[np.uint8]

    @property
    def n_tiles(self) -> int:
        """Number of tiles, at least 1."""
        return int(self.bits.shape[0])


def lay_out(problem: CoverProblem, *, words: int) -> Tiles:
    """Arrange rows in tiles of `words` words of 32 rows each; places that no row fills weigh nothing."""
    class_of_row, counts = classes_of(problem)
    part_of, row_of = _parts(problem.ticks)
    # Kinds: a class and a part of the weight. Tiles of one kind follow each other.
    kind = part_of * counts.shape[1] + class_of_row[row_of]
    place, kind_of_tile = _places(kind, tile_rows=32 * words)
    bits = _bits(problem, row_of, place, n_tiles=kind_of_tile.size, words=words)
    weights = np.zeros(kind_of_tile.size * 32 * words, dtype=np.uint32)
    weights[place] = problem.ticks[row_of] >> (PART_BITS * part_of) & (2**PART_BITS - 1)
    return Tiles(
        bits=bits,
        weights=weights.reshape(-1, 32, words),
        shift=(PART_BITS * (kind_of_tile // counts.shape[1])).astype(np.int32),
        near=pack(np.any(bits, axis=2)),
        class_of=(kind_of_tile % counts.shape[1]).astype(np.int32),
        counts=counts,
    )


def pack(genes: BoolArray) -> NDArray[np.uint32]:
    """(n, N) bool as (n, ceil(N / 32)) words: bit g % 32 of word g / 32 is g."""
    n_words = -(-genes.shape[1] // 32)
    padded = np.zeros((len(genes), 32 * n_words), dtype=bool)
    padded[:, : genes.shape[1]] = genes
    return np.packbits(padded, axis=1, bitorder="little").view("<u4").astype(np.uint32)


def classes_of(problem: CoverProblem) -> tuple[Int64Array, NDArray[np.uint8]]:
    """(R,) class of every row, 0, 1, ... each of which has rows, and (K, n_classes) which targets count it."""
    n_constraints, n_rows = problem.counts_for.shape
    class_of_row, first = np.zeros(n_rows, dtype=np.int64), np.zeros(min(n_rows, 1), dtype=np.int64)
    # Renumbered at every target: bits of an integer run out.
    for counted in problem.counts_for:
        _, first, class_of_row = np.unique(class_of_row * 2 + counted, return_index=True, return_inverse=True)
    if n_rows == 0:
        return class_of_row, np.zeros((n_constraints, 1), dtype=np.uint8)
    return class_of_row.astype(np.int64), problem.counts_for[:, first].astype(np.uint8)


def _parts(ticks: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Parts of weights that are not zero, and the rows that they belong to; every row has its part 0."""
    rows = [np.arange(ticks.size)]
    while (more := np.flatnonzero(ticks >> (PART_BITS * len(rows)))).size:
        rows.append(more)
    return np.repeat(np.arange(len(rows)), [row.size for row in rows]), np.concatenate(rows)


def _places(kind: Int64Array, *, tile_rows: int) -> tuple[Int64Array, Int64Array]:
    """Place of every entry, kinds one after the other from a new tile on each; and the kind of every tile."""
    kinds, index, size = np.unique(kind, return_inverse=True, return_counts=True)
    n_tiles = -(-size // tile_rows)
    first_tile = np.cumsum(n_tiles) - n_tiles
    order = np.argsort(index, kind="stable")
    of_sorted = index[order]
    place = np.empty(kind.size, dtype=np.int64)
    place[order] = first_tile[of_sorted] * tile_rows + np.arange(kind.size) - (np.cumsum(size) - size)[of_sorted]
    kind_of_tile: Int64Array = np.repeat(kinds, n_tiles)
    return place, kind_of_tile if kind_of_tile.size else np.zeros(1, dtype=np.int64)


def _bits(
    problem: CoverProblem, row_of: Int64Array, place: Int64Array, *, n_tiles: int, words: int
) -> NDArray[np.uint32]:
    """(n_tiles, N, words): what every candidate sees of every tile."""
    n_candidates = problem.starts.size - 1
    candidate_of = np.repeat(np.arange(n_candidates), np.diff(problem.starts))
    # Entry e is one of row_of[e]; entries of one row are as many as its weight has parts.
    by_row = np.argsort(row_of, kind="stable")
    n_parts = np.bincount(row_of, minlength=problem.ticks.size)
    first = np.cumsum(n_parts) - n_parts
    bits = np.zeros(n_tiles * n_candidates * words, dtype=np.uint32)
    for part in range(int(n_parts.max(initial=0))):
        has = n_parts[problem.row] > part
        at = place[by_row[first[problem.row[has]] + part]]
        tile, inside = np.divmod(at, 32 * words)
        bit, word = np.divmod(inside, words)
        where = (tile * n_candidates + candidate_of[has]) * words + word
        # Bits of a word are all different: their sum is their union, and float64 holds it exactly.
        bits += np.bincount(where, weights=np.ldexp(1.0, bit), minlength=bits.size).astype(np.uint32)
    return bits.reshape(n_tiles, n_candidates, words)
