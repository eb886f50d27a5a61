"""Rows of patches, one a position: kept while they stream in, joined band by band.

Rows are `PatchReturns` with as much in them as `Content` requires. Local frame, metres; docs/method/returns.md.

On an OpenCL device, tiles write lists or records, and the device joins them by position: kernels/patch_rows.cl. What
the host gets is as long as the result.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, Program
from planner_core.engine.tiles import TiledTemplate
from planner_core.model import (
    BeamTemplate,
    Float32Array,
    FloatArray,
    Int32Array,
    Int64Array,
    PatchReturns,
    ReturnMoments,
    Visibility,
)
from planner_core.progress import Progress, silent

#: Bytes of one block of a column: above what C libraries keep for themselves when it is given back.
_BLOCK_BYTES = 64 * 2**20
_FIRST_BLOCK_BYTES = 2**20
Arrays = Mapping[str, NDArray[Any]]
_MOMENT_NAMES = tuple(field.name for field in fields(ReturnMoments))
#: How entries of one patch from two bands of a template become one; all other columns are added.
_LEAST, _GREATEST = "least_range_m", "greatest_cos_incidence"
#: Device memory for what the tiles of a batch leave behind; results do not depend on it.
BATCH_BYTES = 256 * 2**20
#: Work-items that join rows. More than there are cores costs little: each reads its position's lists.
_JOINERS = {"cpu": 8}
_DEFAULT_JOINERS = 1024
_N_SUMS = 10
#: The kernels' sums are of whole multiples of this, see kernels/patch_returns.cl.
_UNIT_BITS = 20


class Content(Enum):
    """How much of the returns on a patch is kept."""

    PATCHES = 0
    COUNTS = 1
    MOMENTS = 2


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


#: Bytes that a record takes, array by array.
_RECORD_BYTES: dict[Content, dict[str, int]] = {
    Content.PATCHES: {"list": 4},
    Content.COUNTS: {"list": 4, "n_returns": 4},
    Content.MOMENTS: {"list": 4, "n_returns": 4, "power": 4, "sums": 8 * _N_SUMS, "extremes": 8},
}


class PatchRows:
    """Fills rows batch by batch; a context manager, which gives its device memory back."""

    def __init__(
        self, device: Device, scene: Mapping[str, Buffer], *, n_patches: int, content: Content, batch_bytes: int
    ) -> None:
        self._on, self._scene, self._content, self._batch_bytes = device, scene, content, batch_bytes
        self._n_words = -(-n_patches // 32)
        self._buffers: dict[str, Buffer] = {}
        # What kernels write and `in_metres` reads at once: used again, since new memory costs more than filling it.
        self._whole = _whole_sums(0)

    def __enter__(self) -> PatchRows:
        return self

    def __exit__(self, *_: object) -> None:
        self._release()

    def n_batch(self, tiles: TiledTemplate) -> int:
        """Positions that fit into a batch; at least one."""
        return max(1, self._batch_bytes // sum(self._sizes(tiles, 1).values()))

    def rows(self, tiles: TiledTemplate, positions_m: Float32Array) -> ReturnRows:
        """Rows of positions (S, 3), S at most `n_batch`."""
        n_positions = len(positions_m)
        if n_positions == 0 or tiles.n_tiles == 0:
            return ReturnRows(np.zeros(n_positions, dtype=np.int64), self._host_arrays(0))
        self._fit(tiles, n_positions)
        joiners = _JOINERS.get(self._on.kind, _DEFAULT_JOINERS)
        n_slices = min(self._n_words, -(-joiners // n_positions))
        n_set = np.empty((n_positions, n_slices), dtype=np.int32)
        with ExitStack() as held:
            at = self._upload(held, "positions", positions_m)
            with self._on.outputs("numbers of seen patches", {"n_set": n_set}) as out:
                self._trace(tiles, at, n_positions)
                self._join().run(
                    "mark_rows",
                    (n_slices, n_positions),
                    self._buffers["list"],
                    self._buffers["n_listed"],
                    np.int32(tiles.n_tiles),
                    np.int32(self._n_words),
                    self._buffers["bits"],
                    out["n_set"],
                )
            ends = np.cumsum(n_set, dtype=np.int64).reshape(n_set.shape)
            start = self._upload(held, "starts", (ends - n_set).astype(np.int32))
            set_here = self._upload(held, "counts", n_set)
            arrays = self._host_arrays(int(ends[-1, -1]))
            if arrays["patch"].size:
                self._write(tiles, (n_slices, n_positions), start, set_here, arrays)
        return ReturnRows(
            n_set.sum(axis=1, dtype=np.int64), arrays if self._content is not Content.MOMENTS else in_metres(arrays)
        )

    def _trace(self, tiles: TiledTemplate, at: Buffer, n_positions: int) -> None:
        """Queue the scans: tiles leave their lists or records behind."""
        arguments = (*self._scene.values(), *tiles.beam_arguments, at, self._buffers["list"], self._buffers["n_listed"])
        size = (tiles.n_tiles, n_positions)
        if self._content is Content.PATCHES:
            tiles.program("see_patches.cl").run("list_patches", size, *arguments)
            return
        moments = self._content is Content.MOMENTS
        tiles.program("patch_returns.cl", MOMENTS=int(moments)).run(
            "sum_returns", size, *arguments, *(self._buffers[name] for name in self._record_names()[1:])
        )

    def _write(
        self, tiles: TiledTemplate, size: tuple[int, int], start: Buffer, n_set: Buffer, arrays: dict[str, NDArray[Any]]
    ) -> None:
        """Fill the arrays with the rows, in order of positions."""
        join, words = self._join(), np.int32(self._n_words)
        bits, before = self._buffers["bits"], self._buffers["before"]
        with self._on.outputs("rows of patches", arrays) as out:
            join.run("write_rows", size, bits, words, start, out["patch"], before)
            if self._content is Content.PATCHES:
                return
            join.run(
                "add_moments" if self._content is Content.MOMENTS else "add_counts",
                size,
                self._buffers["list"],
                self._buffers["n_listed"],
                np.int32(tiles.n_tiles),
                words,
                bits,
                before,
                start,
                n_set,
                *(self._buffers[name] for name in self._record_names()[1:]),
                *(out[name] for name in list(arrays)[1:]),
            )

    def _join(self) -> Program:
        return self._on.program("patch_rows.cl", {})

    def _record_names(self) -> tuple[str, ...]:
        return tuple(_RECORD_BYTES[self._content])

    def _host_arrays(self, n_entries: int) -> dict[str, NDArray[Any]]:
        """Columns as the kernels write them."""
        arrays: dict[str, NDArray[Any]] = {"patch": np.empty(n_entries, dtype=np.int32)}
        if self._content is not Content.PATCHES:
            arrays["n_returns"] = np.empty(n_entries, dtype=np.int32)
        if self._content is Content.MOMENTS:
            if self._whole["power"].size < n_entries:
                self._whole = _whole_sums(n_entries + n_entries // 4)
            arrays |= {name: array[:n_entries] for name, array in self._whole.items()}
        return arrays

    def _sizes(self, tiles: TiledTemplate, n_positions: int) -> dict[str, int]:
        """Bytes of every buffer of a batch."""
        n_tiles = tiles.n_tiles * n_positions
        per_tile = tiles.shape[0] * tiles.shape[1]
        return {
            **{name: n_tiles * per_tile * n_bytes for name, n_bytes in _RECORD_BYTES[self._content].items()},
            "n_listed": 4 * n_tiles,
            "bits": 4 * self._n_words * n_positions,
            "before": 4 * self._n_words * n_positions,
        }

    def _fit(self, tiles: TiledTemplate, n_positions: int) -> None:
        """Have buffers large enough: those of the last batch, mostly."""
        wanted = self._sizes(tiles, n_positions)
        if self._buffers and all(self._buffers[name].n_bytes >= size for name, size in wanted.items()):
            return
        self._release()
        self._on.reserve("batch of scans", wanted)
        for name, size in wanted.items():
            self._buffers[name] = self._on.allocate(f"batch of scans: {name}", size)

    def _upload(self, held: ExitStack, name: str, array: NDArray[Any]) -> Buffer:
        buffer = self._on.upload(name, {name: array})[name]
        held.callback(buffer.release)
        return buffer

    def _release(self) -> None:
        for buffer in self._buffers.values():
            buffer.release()
        self._buffers = {}


def in_metres(arrays: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of `PatchReturns` with moments: whole numbers times a power of two, exact in float64."""
    power: Int32Array = arrays.pop("power")
    sums, extremes = arrays.pop("sums"), arrays.pop("extremes")
    one = np.ones(power.size)
    metre, metre2 = np.ldexp(one, power - _UNIT_BITS), np.ldexp(one, 2 * power - _UNIT_BITS)
    out = empty_moments(power.size)
    np.multiply(sums[:, 0:3], metre[:, None], out=out["point_sum_m"])
    np.multiply(sums[:, 3], metre2, out=out["square_sum_m2"])
    np.multiply(sums[:, 4], 2.0**-_UNIT_BITS, out=out["weight_sum"])
    np.multiply(sums[:, 5:8], metre[:, None], out=out["weighted_point_sum_m"])
    np.multiply(sums[:, 8], metre2, out=out["weighted_square_sum_m2"])
    np.multiply(sums[:, 9], 2.0**-_UNIT_BITS, out=out["range_sum_m"])
    out["least_range_m"][:], out["greatest_cos_incidence"][:] = extremes[:, 0], extremes[:, 1]
    return {**arrays, **out}


def _whole_sums(n_entries: int) -> dict[str, NDArray[Any]]:
    """Columns of moments as whole numbers, see kernels/patch_returns.cl; uninitialised."""
    return {
        "power": np.empty(n_entries, dtype=np.int32),
        "sums": np.empty((n_entries, _N_SUMS), dtype=np.int64),
        "extremes": np.empty((n_entries, 2), dtype=np.float32),
    }
