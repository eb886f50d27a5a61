"""Rows of patches beyond a budget of memory: packed in a file without a name, read back in pieces.

Entries of `Visibility.patch` -> `PatchColumn` -> `Visibility`, in memory or `StoredVisibility`, with the same entries.
docs/method/scale.md, "Rows on disk".
"""

from __future__ import annotations

import mmap
import os
import tempfile
import threading
import zlib
from typing import IO, Any

import numpy as np

from planner_core.environment_variables import memory_from_env
from planner_core.errors import RequirementError
from planner_core.model.arrays import BoolArray, Int32Array, Int64Array, UInt8Array
from planner_core.model.scans import ENTRIES_A_PIECE, Visibility

#: Memory that what candidates see may take, such as `500MB`; beyond it is on disk. Unset: all is in memory.
VISIBILITY_VARIABLE = "TLSPLAN_VISIBILITY_MEMORY"
#: Of zlib: higher ones save a tenth and take several times as long.
_LEVEL = 1


def visibility_budget() -> int | None:
    """Bytes that patches of rows may take in memory; None: as many as there are. Raises as `memory_from_env`."""
    return memory_from_env(VISIBILITY_VARIABLE)


class PatchColumn:
    """Entries of rows as they come: in memory up to the budget, from there on all in a file."""

    def __init__(self, most_bytes: int | None) -> None:
        self._most = most_bytes
        self._held: list[Int32Array] = []
        self._n_bytes = 0
        self._file: _PackedFile | None = None

    def add(self, patch: Int32Array) -> None:
        """Take the next entries. Raises RequirementError where the disk does not take them."""
        self._held.append(patch)
        self._n_bytes += patch.nbytes
        if self._file is None and self._most is not None and self._n_bytes > self._most:
            self._file = _PackedFile()
        # The file has blocks of one size, so that all that is read is found without a search; a budget may be smaller.
        if self._file is not None and self._n_bytes >= 4 * ENTRIES_A_PIECE:
            self._store(all_of_it=False)

    def rows(self, starts: Int64Array, n_patches: int) -> Visibility:
        """All entries as rows, (N + 1,) starts; the column is empty afterwards. Raises as `add`."""
        if self._file is None:
            patch = np.empty(int(starts[-1]), dtype=np.int32)
            at = 0
            self._held.reverse()
            while self._held:  # the pieces go on the way, so that nothing is held twice
                piece = self._held.pop()
                patch[at : at + piece.size] = piece
                at += piece.size
            return Visibility(starts, patch, n_patches)
        self._store(all_of_it=True)
        file, self._file = self._file, None
        return StoredVisibility(starts, file, n_patches)

    def _store(self, *, all_of_it: bool) -> None:
        assert self._file is not None
        held = np.concatenate([np.empty(0, dtype=np.int32), *self._held])
        whole = held.size if all_of_it else held.size - held.size % ENTRIES_A_PIECE
        for first in range(0, whole, ENTRIES_A_PIECE):
            self._file.write(held[first : min(first + ENTRIES_A_PIECE, whole)])
        rest = held[whole:].copy()
        self._held, self._n_bytes = [rest], rest.nbytes


class StoredVisibility(Visibility):
    """Rows whose patches are in a file that goes when nobody refers to them any more, however the process ends.

    patch : all entries, for who needs them at random: unpacked once into a second such file, and mapped.
    """

    _file: _PackedFile

    def __init__(self, starts: Int64Array, file: _PackedFile, n_patches: int) -> None:
        for name, value in (("starts", starts), ("n_patches", n_patches), ("_file", file)):
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        # `patch` is a field of the base, without a value here: this is called where there is none.
        if name != "patch":
            raise AttributeError(name)
        object.__setattr__(self, "patch", self._unpacked())
        return self.__dict__["patch"]

    def __reduce__(self) -> tuple[Any, ...]:
        return Visibility, (self.starts, np.array(self.patch), self.n_patches)

    @property
    def disk_bytes(self) -> int:
        """Bytes of the packed file."""
        return self._file.n_bytes

    def entries(self, first: int, end: int) -> Int32Array:
        """Read patches of some entries; the block read last is kept."""
        return self._file.read(first, end)

    def _unpacked(self) -> Int32Array:
        n_entries = int(self.starts[-1])
        if n_entries == 0:
            return np.empty(0, dtype=np.int32)
        with _nameless() as file:
            for _, patch in self.pieces():
                _written(file, patch.tobytes())
            # Own pages where somebody writes: compiled code asks for arrays that can be written.
            mapped = mmap.mmap(file.fileno(), 4 * n_entries, access=mmap.ACCESS_COPY)
        return np.frombuffer(mapped, dtype=np.int32)


class _PackedFile:
    """Blocks of `ENTRIES_A_PIECE` entries, the last one shorter: gaps between neighbours, a byte each, by zlib.

    A gap that is none of 1 to 255, as where a row begins, is a 0 and follows in four bytes behind all of the block's.
    """

    def __init__(self) -> None:
        self._file = _nameless()
        self._reading = threading.Lock()
        self._place: list[tuple[int, int, int]] = []  # of a block: its first byte, bytes of gaps, entries
        self.n_bytes = 0
        self._last: tuple[int, Int32Array] | None = None

    def write(self, patch: Int32Array) -> None:
        gap = np.diff(patch, prepend=np.int32(0))
        far: BoolArray = (gap < 1) | (gap > 255)
        code: UInt8Array = np.where(far, 0, gap).astype(np.uint8)
        gaps, others = zlib.compress(code.tobytes(), _LEVEL), zlib.compress(gap[far].tobytes(), _LEVEL)
        self._file.seek(self.n_bytes)
        _written(self._file, gaps + others)
        self._place.append((self.n_bytes, len(gaps), patch.size))
        self.n_bytes += len(gaps) + len(others)

    def read(self, first: int, end: int) -> Int32Array:
        if first >= end:
            return np.empty(0, dtype=np.int32)
        blocks = range(first // ENTRIES_A_PIECE, (end - 1) // ENTRIES_A_PIECE + 1)
        begin = blocks[0] * ENTRIES_A_PIECE
        parts = [self._block(number) for number in blocks]
        whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
        return whole[first - begin : end - begin]

    def _block(self, number: int) -> Int32Array:
        last = self._last  # read once: another thread may put another block there meanwhile
        if last is not None and last[0] == number:
            return last[1]
        at, n_gaps, _ = self._place[number]
        end = self._place[number + 1][0] if number + 1 < len(self._place) else self.n_bytes
        with self._reading:  # threads share the file's position
            self._file.seek(at)
            packed = _read(self._file, end - at)
        gap = np.frombuffer(zlib.decompress(packed[:n_gaps]), dtype=np.uint8).astype(np.int32)
        gap[gap == 0] = np.frombuffer(zlib.decompress(packed[n_gaps:]), dtype=np.int32)
        patch: Int32Array = np.cumsum(gap, dtype=np.int32)
        patch.flags.writeable = False
        self._last = number, patch
        return patch


def _nameless() -> IO[bytes]:
    try:
        return tempfile.TemporaryFile(prefix="tlsplan-", buffering=0)
    except OSError as error:
        raise _refused(error) from error


def _read(file: IO[bytes], n_bytes: int) -> bytes:
    """Read so many bytes: without a buffer, one call may give fewer."""
    parts: list[bytes] = []
    while n_bytes > 0 and (part := file.read(n_bytes)):
        parts.append(part)
        n_bytes -= len(part)
    return b"".join(parts)


def _written(file: IO[bytes], data: bytes) -> None:
    left = memoryview(data)
    try:
        while left:
            left = left[file.write(left) :]
    except OSError as error:
        raise _refused(error) from error


def _refused(error: OSError) -> RequirementError:
    return RequirementError(
        f"what candidates see: got {os.strerror(error.errno or 0)!r} from the temporary folder "
        f"{tempfile.gettempdir()}, expected room for what is beyond {VISIBILITY_VARIABLE}; free some, name another "
        "folder in TMPDIR, or allow more memory"
    )
