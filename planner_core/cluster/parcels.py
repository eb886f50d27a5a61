"""What travels between this process and workers: questions with their arrays by content, and answers in short.

A question is pickled without its large arrays: these go by their hash, each once to a worker, whatever questions they
are part of. An answer holds compressed rows, and of figures per patch those alone that are set.
"""

from __future__ import annotations

import hashlib
import io
import pickle
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.model import Float32Array, Visibility
from planner_core.requirements.look_around import Looked, Parts, Rows

#: Smaller arrays stay in the pickle.
_LEAST_BYTES = 4096
#: Of zlib: about as quick as a network of 1 Gbit/s.
_LEVEL = 1


@dataclass(frozen=True)
class Parcel:
    """A value to send: `body` without the arrays of `arrays`, which go by their hashes. digest : of all of it."""

    digest: str
    body: bytes
    arrays: Mapping[str, NDArray[Any]]


class _Pickler(pickle.Pickler):
    """Leaves large arrays out, by their contents."""

    def __init__(self, file: io.BytesIO, known: dict[int, tuple[str, NDArray[Any]]]) -> None:
        super().__init__(file, protocol=5)
        self.arrays: dict[str, NDArray[Any]] = {}
        self._known = known

    def persistent_id(self, value: Any) -> Any:
        if type(value) is not np.ndarray or value.nbytes < _LEAST_BYTES or value.dtype.hasobject:
            return None
        if id(value) not in self._known:
            digest = hashlib.sha256(f"{value.dtype.str}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
            self._known[id(value)] = digest.hexdigest(), value  # kept, so that no other gets its number
        name, _ = self._known[id(value)]
        self.arrays[name] = value
        return name


class Packer:
    """Makes parcels; arrays that were hashed before are not hashed again."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[str, NDArray[Any]]] = {}

    def parcel(self, value: object) -> Parcel:
        """Return a value as a parcel."""
        file = io.BytesIO()
        pickler = _Pickler(file, self._known)
        pickler.dump(value)
        body = file.getvalue()
        digest = hashlib.sha256(body)
        digest.update("".join(pickler.arrays).encode())
        return Parcel(digest.hexdigest(), body, pickler.arrays)


def unpacked(body: bytes, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Return the value of a parcel; raises KeyError where an array is not there."""

    class Unpickler(pickle.Unpickler):
        def persistent_load(self, name: Any) -> Any:
            return arrays[name]

    return Unpickler(io.BytesIO(body)).load()


def squeezed(array: NDArray[Any]) -> bytes:
    """Return an array as bytes to send."""
    file = io.BytesIO()
    np.save(file, array, allow_pickle=False)
    return zlib.compress(file.getvalue(), _LEVEL)


def unsqueezed(content: bytes) -> NDArray[Any]:
    """Return the array of `squeezed`, read-only: many questions share it."""
    array: NDArray[Any] = np.load(io.BytesIO(zlib.decompress(content)), allow_pickle=False)
    array.setflags(write=False)
    return array


# ------------------------------------------------------------------------------------------------ answers
def pack_looked(looked: Looked) -> bytes:
    """Return what positions see, in short: the same bytes for the same look."""
    plain = looked.rows.met is looked.rows.seen
    told: list[Any] = [plain, _rows(looked.rows.seen), None if plain else _rows(looked.rows.met)]
    parts = looked.parts
    if parts is not None:
        once = parts.any_met is parts.any_seen
        told.append([parts.seen, None if plain else parts.met, _set(parts.any_seen, parts.any_seen != 0),
                     None if once else _set(parts.any_met, parts.any_met != 0)])  # fmt: skip
    else:
        told.append(None)
    told.append([{name: _set(values, ~np.isnan(values)) for name, values in each.items()} for each in looked.needed])
    return zlib.compress(pickle.dumps(told, protocol=5), _LEVEL)


def unpack_looked(content: bytes, n_patches: int, n_stacked: int) -> Looked:
    """Return the look of `pack_looked`. n_stacked : patches by quality."""
    plain, seen_rows, met_rows, parts_told, needed_told = pickle.loads(zlib.decompress(content))
    seen = _visibility(seen_rows, n_patches)
    met = seen if plain else _visibility(met_rows, n_stacked)
    parts = None
    if parts_told is not None:
        share, met_share, any_seen, any_met = parts_told
        seen_samples = _filled(any_seen, np.zeros(n_patches, dtype=np.uint32))
        met_samples = seen_samples if any_met is None else _filled(any_met, np.zeros(n_patches, dtype=np.uint32))
        parts = Parts(share, share if plain else met_share, seen_samples, met_samples)
    needed: tuple[dict[str, Float32Array], ...] = tuple(
        {name: _filled(values, np.full(n_patches, np.nan, dtype=np.float32)) for name, values in each.items()}
        for each in needed_told
    )
    return Looked(Rows(seen, met), parts, needed)


def _rows(rows: Visibility) -> tuple[NDArray[Any], NDArray[Any]]:
    """Sizes, and steps from patch to patch, which compress better than patches."""
    return np.diff(rows.starts).astype(np.int32), np.diff(rows.patch, prepend=np.int32(0)).astype(np.int32)


def _visibility(told: tuple[NDArray[Any], NDArray[Any]], n_patches: int) -> Visibility:
    sizes, steps = told
    starts = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64)
    return Visibility(starts, np.cumsum(steps, dtype=np.int32), n_patches)


def _set(values: NDArray[Any], is_set: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    at = np.flatnonzero(is_set).astype(np.int32)
    return np.diff(at, prepend=np.int32(0)).astype(np.int32), values[at]


def _filled(told: tuple[NDArray[Any], NDArray[Any]], values: NDArray[Any]) -> NDArray[Any]:
    steps, found = told
    values[np.cumsum(steps, dtype=np.int32)] = found
    return values
