"""How coverage lies on the device: rows as bits in tiles of words, for all candidates side by side, and their weights.

Input `CoverRows`, output `Tiles`; kernels/genetic_cover.cl reads them. Rows that the same targets count form a class; a
tile holds rows of one class alone, so that a target's sum is that of whole tiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner_core.genetic.problem import CoverRows
from planner_core.model import Int32Array, Int64Array

#: Weights are added up in 32 bits, 256 of them: those that need more bits are split.
PART_BITS = 24


@dataclass(frozen=True)
class Tiles:
    """Bits, weights and classes, tile by tile; the row at place i of a tile is bit i // W of word i % W.

    bits : (n_tiles, N, W) uint32. weights : (n_tiles, parts, 32, W) uint32. class_of : (n_tiles,) int32.
    counts : (K, n_classes) uint8, 1 where a target counts a class.
    """

    bits: NDArray[np.uint32]
    weights: NDArray[np.uint32]
    class_of: Int32Array
    counts: NDArray[np.uint8]

    @property
    def n_tiles(self) -> int:
        """Number of tiles, at least 1."""
        return int(self.bits.shape[0])

    @property
    def n_parts(self) -> int:
        """1 or 2: 24-bit parts of a weight."""
        return int(self.weights.shape[1])


def lay_out(problem: CoverRows, *, words: int) -> Tiles:
    """Arrange rows in tiles of `words` words of 32 rows each; places that no row fills weigh nothing."""
    n_candidates = problem.starts.size - 1
    class_of_row, counts = _classes(problem)
    place, class_of = _places(class_of_row, n_classes=counts.shape[1], tile_rows=32 * words)
    n_tiles = class_of.size
    bits = np.zeros((n_tiles, n_candidates, words), dtype=np.uint32)
    candidate = np.repeat(np.arange(n_candidates), np.diff(problem.starts))
    at = place[problem.row]
    inside = at % (32 * words)
    np.bitwise_or.at(
        bits, (at // (32 * words), candidate, inside % words), np.uint32(1) << (inside // words).astype(np.uint32)
    )
    ticks = np.zeros(n_tiles * 32 * words, dtype=np.int64)
    ticks[place] = problem.ticks
    by_tile = ticks.reshape(n_tiles, 1, 32, words)
    parts = [by_tile & (2**PART_BITS - 1)]
    if (by_tile >> PART_BITS).any():
        parts.append(by_tile >> PART_BITS)
    return Tiles(bits, np.concatenate(parts, axis=1).astype(np.uint32), class_of, counts)


def _classes(problem: CoverRows) -> tuple[Int64Array, NDArray[np.uint8]]:
    """Class of every row, and (K, n_classes) which targets count it."""
    n_rows = problem.ticks.size
    if n_rows == 0 or problem.counts_for.shape[0] == 0:
        return np.zeros(n_rows, dtype=np.int64), np.zeros((problem.counts_for.shape[0], 1), dtype=np.uint8)
    kinds, class_of_row = np.unique(problem.counts_for, axis=1, return_inverse=True)
    return class_of_row.reshape(-1).astype(np.int64), kinds.astype(np.uint8)


def _places(class_of_row: Int64Array, *, n_classes: int, tile_rows: int) -> tuple[Int64Array, Int32Array]:
    """Place of every row, classes one after the other from a new tile on each; and the class of every tile."""
    size = np.bincount(class_of_row, minlength=n_classes)
    n_tiles = np.maximum(-(-size // tile_rows), 1)
    first_tile = np.cumsum(n_tiles) - n_tiles
    order = np.argsort(class_of_row, kind="stable")
    sorted_class = class_of_row[order]
    rank = np.arange(class_of_row.size) - (np.cumsum(size) - size)[sorted_class]
    place = np.empty(class_of_row.size, dtype=np.int64)
    place[order] = first_tile[sorted_class] * tile_rows + rank
    return place, np.repeat(np.arange(n_classes, dtype=np.int32), n_tiles)
