"""Rows of patches, one a position: kept while they stream in, joined band by band.

Rows are `PatchReturns` with as much in them as `Content` requires. Local frame, metres; docs/method/returns.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BeamTemplate, FloatArray, Int64Array, PatchReturns, ReturnMoments, Visibility
from planner_core.progress import Progress, silent

#: Bytes of one block of a column: above what C libraries keep for themselves when it is given back.
_BLOCK_BYTES = 64 * 2**20
_FIRST_BLOCK_BYTES = 2**20


class Content(Enum):
    """How much of the returns on a patch is kept."""

    PATCHES = 0
    COUNTS = 1
    MOMENTS = 2


Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class ReturnRows:
    """Rows of S positions. length : (S,) int64. arrays : columns by name, `patch` first, an entry a patch of a row.

    Rows follow each other; patches are sorted and unique inside each.
    """

    length: Int64Array
    arrays: Arrays


def no_rows(n_positions: int) -> ReturnRows:
    """Rows of positions that see nothing, because there are no beams."""
    return ReturnRows(length=np.zeros(n_positions, dtype=np.int64), arrays={})


_MOMENT_NAMES = tuple(field.name for field in fields(ReturnMoments))
#: How entries of one patch from two bands of a template become one; all other columns are added.
_LEAST, _GREATEST = "least_range_m", "greatest_cos_incidence"


def join_bands(upper: ReturnRows, lower: ReturnRows) -> ReturnRows:
    """Rows of the same positions whose returns are those of both.

    Sums are added in float64: exactly, where every term is a whole multiple of one power of two, see
    docs/method/returns.md.
    """
    n_positions = upper.length.size
    index = np.arange(n_positions, dtype=np.int64)
    position = np.concatenate([np.repeat(index, upper.length), np.repeat(index, lower.length)])
    patch = np.concatenate([upper.arrays["patch"], lower.arrays["patch"]])
    order = np.lexsort((patch, position))
    position, patch = position[order], patch[order]
    new = np.ones(patch.size, dtype=np.bool_)
    new[1:] = (position[1:] != position[:-1]) | (patch[1:] != patch[:-1])
    first = np.flatnonzero(new)
    joined: dict[str, NDArray[Any]] = {"patch": patch[first]}
    for name, above in upper.arrays.items():
        if name == "patch":
            continue
        both = np.concatenate([above, lower.arrays[name]])[order]
        merge = {_LEAST: np.minimum, _GREATEST: np.maximum}.get(name, np.add)
        joined[name] = merge.reduceat(both, first, axis=0, dtype=both.dtype) if first.size else both
    return ReturnRows(length=np.bincount(position[first], minlength=n_positions).astype(np.int64), arrays=joined)


def follow_on(batches: Sequence[ReturnRows]) -> ReturnRows:
    """Rows of the positions of all batches, one after the other; at least one batch."""
    if len(batches) == 1:
        return batches[0]
    arrays = {name: np.concatenate([rows.arrays[name] for rows in batches]) for name in batches[0].arrays}
    return ReturnRows(length=np.concatenate([rows.length for rows in batches]), arrays=arrays)


class RowStore:
    """Rows as they come, and at the end in one array a column.

    A column is kept in blocks that go back to the system one by one while the array is filled: the peak is the result
    and one block, not twice the result.
    """

    def __init__(self, n_patches: int) -> None:
        self._n_patches = n_patches
        self._lengths: list[Int64Array] = []
        self._columns: dict[str, _Column] = {}

    def append(self, rows: ReturnRows) -> None:
        """Copy the rows of the next positions."""
        self._lengths.append(rows.length)
        for name, array in rows.arrays.items():
            if name not in self._columns:
                self._columns[name] = _Column(array)
            self._columns[name].append(array)

    def visibility(self) -> Visibility:
        """Take everything out as a `Visibility`: the store is empty afterwards."""
        return Visibility(starts=self._starts(), patch=self._take("patch", np.int32), n_patches=self._n_patches)

    def patch_returns(self, content: Content) -> PatchReturns:
        """Take everything out as `PatchReturns`: the store is empty afterwards."""
        moments = None
        if content is Content.MOMENTS:
            # Of no rows, too: float32 or float64, (0,) or (0, 3).
            empty = empty_moments(0)
            taken = {name: self._take(name, empty[name].dtype, empty[name].shape[1:]) for name in _MOMENT_NAMES}
            moments = ReturnMoments(**taken)
        return PatchReturns(
            starts=self._starts(),
            patch=self._take("patch", np.int32),
            n_returns=self._take("n_returns", np.int32),
            moments=moments,
            n_patches=self._n_patches,
        )

    def _starts(self) -> Int64Array:
        lengths = np.concatenate([np.zeros(1, dtype=np.int64), *self._lengths])
        return np.cumsum(lengths, dtype=np.int64)

    def _take(self, name: str, dtype: Any, tail: tuple[int, ...] = ()) -> NDArray[Any]:
        column = self._columns.pop(name, None)
        return np.empty((0, *tail), dtype=dtype) if column is None else column.take()


class RowCollector(ABC):
    """What engines have in common that collect rows while positions stream through."""

    def visible_patches(
        self, template: BeamTemplate, positions_m: FloatArray, *, progress: Progress = silent
    ) -> Visibility:
        """See `ScanEngine.visible_patches`."""
        return self._collect(template, positions_m, Content.PATCHES, progress).visibility()

    def patch_returns(
        self, template: BeamTemplate, positions_m: FloatArray, *, moments: bool = False, progress: Progress = silent
    ) -> PatchReturns:
        """See `ScanEngine.patch_returns`."""
        content = Content.MOMENTS if moments else Content.COUNTS
        return self._collect(template, positions_m, content, progress).patch_returns(content)

    @abstractmethod
    def _collect(
        self, template: BeamTemplate, positions_m: FloatArray, content: Content, progress: Progress
    ) -> RowStore:
        """Look from all positions, and keep so much of what they see."""


class _Column:
    """Blocks of one column; all but the last are full."""

    def __init__(self, like: NDArray[Any]) -> None:
        self._dtype, self._tail = like.dtype, like.shape[1:]
        self._item_bytes = like.dtype.itemsize * int(np.prod(self._tail, dtype=np.int64))
        self._blocks: deque[NDArray[Any]] = deque()
        self._left = 0  # free entries of the last block

    def append(self, array: NDArray[Any]) -> None:
        done = 0
        while done < len(array):
            if self._left == 0:
                n_bytes = min(_BLOCK_BYTES, _FIRST_BLOCK_BYTES << len(self._blocks))
                self._left = max(1, n_bytes // self._item_bytes)
                self._blocks.append(np.empty((self._left, *self._tail), dtype=self._dtype))
            block = self._blocks[-1]
            at = len(block) - self._left
            count = min(self._left, len(array) - done)
            block[at : at + count] = array[done : done + count]
            self._left -= count
            done += count

    def take(self) -> NDArray[Any]:
        total = sum(len(block) for block in self._blocks) - self._left
        out = np.empty((total, *self._tail), dtype=self._dtype)
        at = 0
        while self._blocks:
            block = self._blocks.popleft()
            count = min(len(block), total - at)
            out[at : at + count] = block[:count]
            at += count
        return out


def empty_moments(n_entries: int) -> dict[str, NDArray[Any]]:
    """Uninitialised columns of `ReturnMoments`."""
    shapes: dict[str, Any] = {"point_sum_m": (n_entries, 3), "weighted_point_sum_m": (n_entries, 3)}
    return {
        name: np.empty(shapes.get(name, n_entries), dtype=np.float32 if name in (_LEAST, _GREATEST) else np.float64)
        for name in _MOMENT_NAMES
    }
