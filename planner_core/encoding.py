"""Values as JSON and plain arrays: what child processes answer, and what is kept between commands.

A value is made of dataclasses, tuples (lists become such), arrays of numbers, and what JSON has. Reading one makes
nothing but these, of the classes that the reader names: a file that somebody has tampered with can't make a process do
anything.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray


def encoded(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """`value` as JSON; its arrays are gathered in `arrays`, in the order in which `read_value` meets them."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"array": value.dtype.str, "shape": value.shape}
    if is_dataclass(value):
        return {
            "class": type(value).__name__,
            "fields": [encoded(getattr(value, f.name), arrays) for f in fields(value)],
        }
    if isinstance(value, tuple | list):
        return [encoded(each, arrays) for each in value]
    return value


def parts_of_value(text: bytes, arrays: Sequence[NDArray[Any]]) -> Iterable[memoryview]:
    """Give the bytes of a value in their order: the length of its JSON (uint64), that JSON, the arrays."""
    yield memoryview(struct.pack("<Q", len(text)) + text)
    for each in arrays:
        yield np.ascontiguousarray(each).reshape(-1).view(np.uint8).data


def read_tree(file: IO[bytes]) -> Any:
    """Read the JSON of a value. Raises ValueError where it is none, struct.error where the file ends before."""
    (n_bytes,) = struct.unpack("<Q", file.read(8))
    return json.loads(file.read(n_bytes))


def read_value(tree: Any, file: IO[bytes], classes: Iterable[type]) -> Any:
    """Give the value of a `tree`, whose arrays are next in the file. Raises ValueError where these are cut off."""
    by_name = {kind.__name__: kind for kind in classes}

    def decoded(value: Any) -> Any:
        if isinstance(value, list):
            return tuple(decoded(each) for each in value)
        if not isinstance(value, dict):
            return value
        if "array" in value:
            return _read_array(file, value["array"], value["shape"])
        return by_name[value["class"]](*(decoded(each) for each in value["fields"]))

    return decoded(tree)


def _read_array(file: IO[bytes], kind: str, shape: Sequence[int]) -> NDArray[Any]:
    dtype = np.dtype(kind)
    if dtype.kind not in "biuf":
        raise ValueError(f"an array of {kind}")
    values = np.empty(tuple(shape), dtype)
    rest = values.reshape(-1).view(np.uint8).data
    while len(rest):
        n = file.readinto(rest)  # type: ignore[attr-defined]
        if not n:
            raise ValueError("a value is cut off")
        rest = rest[n:]
    return values
