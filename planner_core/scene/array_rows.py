"""Rows of large arrays: which of a table are equal, by sorting keys instead of columns, and many a chunk at a time.

Input (V, 3) float64, (T, 3) small integers or (N, K) any; output the number of the first equal row for each, or groups.
Vertices are welded by it. In chunks, what is made on the way does not grow with the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BoolArray, FloatArray, Int64Array

_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
#: Triangles at once: their corners are 19 MB in float64, and fit into most processors' caches.
_CHUNK = 2**18


def first_of_equal_rows(rows: FloatArray) -> Int64Array:
    """(V,) int64: for each row of (V, 3) float64 the number of the first row with the same bits.

    Rows are sorted by a 64-bit mix of their bits, which is several times as fast as sorting by three columns; equal
    keys are then compared in full. Where two different rows share a key (odds of about V^2 / 2^65), columns are sorted.
    """
    columns = [np.ascontiguousarray(rows[:, axis]).view(np.uint64) for axis in range(3)]
    key = np.zeros(rows.shape[0], dtype=np.uint64)
    for column, mix in zip(columns, _MIX, strict=True):
        key = (key ^ column) * mix
        key ^= key >> np.uint64(29)
    order = np.argsort(key)
    differs = _differs_from_next([column[order] for column in columns])
    if (differs & (key[order[1:]] == key[order[:-1]])).any():
        order = np.lexsort(columns)
        differs = _differs_from_next([column[order] for column in columns])
    return _first_in_groups(order, differs)


def first_of_equal_triples(triples: Int64Array) -> Int64Array:
    """(T,) int64: for each row of (T, 3) small integers the number of the first equal row."""
    n_values = int(triples.max(initial=0)) + 1
    key = triples[:, 0] * n_values + triples[:, 1]  # below 2^62: vertex numbers fit int32
    order = np.lexsort((triples[:, 2], key))
    return _first_in_groups(order, _differs_from_next([key[order], triples[order, 2]]))


def groups_of_equal_rows(rows: Int64Array) -> tuple[Int64Array, Int64Array]:
    """(G,) the first of each group of equal rows (N, K), groups by their columns, and (N,) the group of each row.

    As `np.unique(rows, axis=0, return_index=True, return_inverse=True)`, in a fraction of the time: that compares rows
    byte by byte.
    """
    order = np.lexsort(rows.T[::-1])
    new = np.append(True, _differs_from_next([column[order] for column in rows.T]))[: order.size]
    group = np.empty(order.size, dtype=np.int64)
    group[order] = np.cumsum(new) - 1
    return order[new], group


def chunks(count: int) -> Iterator[slice]:
    """Slices of 0 .. count - 1, one after the other; none of nothing."""
    return (slice(first, min(first + _CHUNK, count)) for first in range(0, count, _CHUNK))


def _differs_from_next(columns: Sequence[NDArray[np.generic]]) -> BoolArray:
    """(N - 1,) bool: row i and row i + 1 of a table, given by its columns, are not equal."""
    differs = np.zeros(max(columns[0].size - 1, 0), dtype=bool)
    for column in columns:
        differs |= column[1:] != column[:-1]
    return differs


def _first_in_groups(order: Int64Array, new_group: BoolArray) -> Int64Array:
    """Smallest number in each run of `order`; runs begin where `new_group` (one shorter) is true."""
    if order.size == 0:
        return order
    starts = np.flatnonzero(np.concatenate([[True], new_group]))
    smallest = np.minimum.reduceat(order, starts)
    first = np.empty(order.size, dtype=np.int64)
    first[order] = np.repeat(smallest, np.diff(np.append(starts, order.size)))
    return first
