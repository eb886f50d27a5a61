"""What travels to workers: jobs with their arrays by content.

A job is pickled without its large arrays: these go by their hash, each once to a worker, whatever jobs they
are part of.
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

#: Smaller arrays stay in the pickle.
_LEAST_BYTES = 4096
#: Of zlib: about as quick as a network of 1 Gbit/s.
_LEVEL = 1


@dataclass(frozen=True)
class TaskPayload:
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
    """Makes payloads; arrays that were hashed before are not hashed again."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[str, NDArray[Any]]] = {}

    def payload(self, value: object) -> TaskPayload:
        """Return a value as a payload."""
        file = io.BytesIO()
        pickler = _Pickler(file, self._known)
        pickler.dump(value)
        body = file.getvalue()
        digest = hashlib.sha256(body)
        digest.update("".join(pickler.arrays).encode())
        return TaskPayload(digest.hexdigest(), body, pickler.arrays)


def unpacked(body: bytes, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Return the value of a payload; raises KeyError where an array is not there."""

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
    """Return the array of `squeezed`, read-only: many jobs share it."""
    array: NDArray[Any] = np.load(io.BytesIO(zlib.decompress(content)), allow_pickle=False)
    array.setflags(write=False)
    return array
