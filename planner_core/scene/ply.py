"""PLY, ASCII and binary of either byte order -> `RawScene`. One element; polygons are split; no unit, no axes.

A reader of our own because the installed library (trimesh 5) has one wording for every damage ("unexpected length"),
fans polygons that have notches, and does not check the vertex numbers of faces. Source: G. Turk, The PLY Polygon File
Format, 1994.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import SceneError, grouped
from planner_core.model import Element, FloatArray, Int64Array
from planner_core.scene.raw import RawScene, exact, triangulate, what_it_looks_like

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
    "int64": "i8",
    "uint64": "u8",
}
_MOST_ROWS = 2**31
"""No row and no list has more: a file with more is damaged. Vertex numbers have to fit int32 in any case."""
_MOST_PROPERTIES = 1000
"""Of a header: programs write some dozens, scans with all their bands some hundreds."""
_BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_FACE_LISTS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True)
class _Property:
    name: str
    type: str
    count_type: str = ""
    """Type of the length in front of a list; empty: a single value."""


@dataclass(frozen=True)
class _Block:
    """An element of the header: a table with a row each, rows ragged where a property is a list."""

    name: str
    n_rows: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True)
class _Column:
    """Values of a property; rows of a list have `n_values` each."""

    values: NDArray[np.generic]
    n_values: Int64Array


class _CutOffError(Exception):
    """The body ends before the table does; `row` is the first row that is not complete."""

    def __init__(self, row: int):
        self.row = row


def read_ply(path: Path, *, skip_bad_faces: bool) -> RawScene:
    """Read a PLY file.

    Raises
    ------
    SceneError
        Not a PLY file, cut off, without faces, or a face that names a missing vertex.
    """
    contents = path.read_bytes()
    order, blocks, body_start = _header(path, contents)
    columns = _body(path, contents[body_start:], order, blocks)
    vertices = _vertices(path, columns)
    n_corners, corners = _corners(path, columns)
    faces = triangulate(vertices, n_corners, corners, name=path.name, skip_bad_faces=skip_bad_faces)
    return RawScene(
        vertices=vertices,
        triangles=faces.triangles,
        element_of_triangle=np.zeros(faces.polygon.size, dtype=np.int64),
        face_of_triangle=faces.polygon,
        elements=(Element(path.stem, "Mesh", "0"),),
        report=faces.report(),
    )


# ----------------------------------------------------------------------------------------------- header
def _header(path: Path, contents: bytes) -> tuple[str, list[_Block], int]:
    """Byte order (empty: ASCII), tables, and where the body begins."""
    if contents[:4] not in (b"ply\n", b"ply\r"):
        raise SceneError(
            f"{path.name}: not a PLY file: {what_it_looks_like(contents[:64])}, expected ply in its first line; "
            "export the model as PLY again."
        )
    end = contents.find(b"end_header")
    newline = contents.find(b"\n", end)
    if end < 0 or newline < 0:
        raise SceneError(f"{path.name}: its header has no end_header: it is cut off; export it again.")
    n_properties = contents.count(b"property", 0, end)
    if n_properties > _MOST_PROPERTIES:
        raise SceneError(
            f"{path.name}: its header has {grouped(n_properties)} properties, expected {grouped(_MOST_PROPERTIES)} at "
            "most; export it again with positions and faces only."
        )
    order: str | None = None
    blocks: list[_Block] = []
    for number, line in enumerate(contents[:end].decode("ascii", "replace").splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _BYTE_ORDERS[words[1]]
            elif words[:1] == ["element"]:
                blocks.append(_Block(words[1], _row_count(words[2]), ()))
            elif words[:1] == ["property"]:
                last = blocks.pop()
                blocks.append(_Block(last.name, last.n_rows, (*last.properties, _property(words[1:]))))
        except (KeyError, IndexError, ValueError):
            raise SceneError(
                f"{path.name}, line {number}: {line[:60]!r} can't be read, expected a format, an element or a "
                "property of PLY 1.0; export it again."
            ) from None
    if order is None:
        raise SceneError(f"{path.name}: its header names no format, expected ascii or binary; export it again.")
    return order, blocks, newline + 1


def _row_count(word: str) -> int:
    count = int(word)
    if not 0 <= count <= _MOST_ROWS:
        raise ValueError(word)
    return count


def _property(words: list[str]) -> _Property:
    if words[0] == "list":
        if _TYPES[words[1]][0] == "f":
            raise ValueError(words[1])
        return _Property(words[3], _TYPES[words[2]], _TYPES[words[1]])
    return _Property(words[1], _TYPES[words[0]])


# ------------------------------------------------------------------------------------------------- body
def _body(path: Path, body: bytes, order: str, blocks: list[_Block]) -> dict[str, dict[str, _Column]]:
    """Columns of every table, by table and property."""
    is_text = order == ""
    words = iter(body.split()) if is_text else iter(())
    at = 0
    tables: dict[str, dict[str, _Column]] = {}
    for block in blocks:
        try:
            if is_text:
                tables[block.name] = _text_table(words, block)
            else:
                tables[block.name], at = _binary_table(body, at, block, order)
        except _CutOffError as cut:
            raise SceneError(
                f"{path.name}: it declares {grouped(block.n_rows)} rows of {block.name} and ends in row "
                f"{grouped(cut.row)}: it is cut off; export it again."
            ) from None
        except ValueError as error:
            raise SceneError(
                f"{path.name}: {error} among the rows of {block.name}, expected numbers; "
                "it is damaged, export it again."
            ) from None
    return tables


def _row_dtype(block: _Block, order: str, lengths: list[int]) -> np.dtype[np.void]:
    """The dtype of a row whose lists have the given lengths."""
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    length = iter(lengths)
    for prop in block.properties:
        if prop.count_type:
            fields.append((f"{prop.name} count", order + prop.count_type, ()))
            fields.append((prop.name, order + prop.type, (next(length),)))
        else:
            fields.append((prop.name, order + prop.type, ()))
    return np.dtype(fields)


def _binary_table(body: bytes, at: int, block: _Block, order: str) -> tuple[dict[str, _Column], int]:
    """Columns of a binary table that begins at byte `at`, and where it ends.

    All rows are read at once when their lists are as long as those of the first row, row by row otherwise.
    """
    if block.n_rows == 0 or not block.properties:
        return {}, at
    dtype = _row_dtype(block, order, _list_lengths(body, at, block, order, row=0))
    end = at + dtype.itemsize * block.n_rows
    lists = [p for p in block.properties if p.count_type]
    if end > len(body) and not lists:
        raise _CutOffError((len(body) - at) // dtype.itemsize)
    if end <= len(body):
        rows = np.frombuffer(body, dtype=dtype, count=block.n_rows, offset=at)
        if all((rows[f"{p.name} count"] == dtype[p.name].shape[0]).all() for p in lists):
            return _uniform_columns(rows, block), end
    return _ragged_rows(body, at, block, order)


def _uniform_columns(rows: NDArray[np.void], block: _Block) -> dict[str, _Column]:
    columns = {}
    for prop in block.properties:
        values = rows[prop.name]
        n_values = values.shape[1] if prop.count_type else 1
        columns[prop.name] = _Column(values.reshape(-1), np.full(rows.size, n_values, dtype=np.int64))
    return columns


def _list_lengths(body: bytes, at: int, block: _Block, order: str, row: int) -> list[int]:
    """Lengths of the lists of the one row that begins at byte `at`."""
    lengths = []
    for prop in block.properties:
        if prop.count_type:
            count_dtype = np.dtype(order + prop.count_type)
            if at + count_dtype.itemsize > len(body):
                raise _CutOffError(row)
            length = _list_length(int(np.frombuffer(body, dtype=count_dtype, count=1, offset=at)[0]))
            lengths.append(length)
            at += count_dtype.itemsize + length * np.dtype(prop.type).itemsize
        else:
            at += np.dtype(prop.type).itemsize
        if at > len(body):
            raise _CutOffError(row)
    return lengths


def _ragged_rows(body: bytes, at: int, block: _Block, order: str) -> tuple[dict[str, _Column], int]:
    parts: dict[str, list[NDArray[np.generic]]] = {p.name: [] for p in block.properties}
    dtypes: dict[tuple[int, ...], np.dtype[np.void]] = {}
    for row in range(block.n_rows):
        lengths = _list_lengths(body, at, block, order, row)
        dtype = dtypes.setdefault(tuple(lengths), _row_dtype(block, order, lengths))
        record = np.frombuffer(body, dtype=dtype, count=1, offset=at)
        for prop in block.properties:
            parts[prop.name].append(record[prop.name].reshape(-1))
        at += dtype.itemsize
    return {name: _joined(values) for name, values in parts.items()}, at


def _text_table(words: Iterator[bytes], block: _Block) -> dict[str, _Column]:
    """Columns of an ASCII table; takes its words from `words`."""
    if not block.properties:
        return {}
    if not any(p.count_type for p in block.properties):
        n_words = block.n_rows * len(block.properties)
        flat = np.array([float(w) for w in itertools.islice(words, n_words)], dtype=np.float64)
        if flat.size < n_words:
            raise _CutOffError(flat.size // len(block.properties))
        ones = np.ones(block.n_rows, dtype=np.int64)
        table = flat.reshape(block.n_rows, len(block.properties))
        return {p.name: _Column(table[:, i], ones) for i, p in enumerate(block.properties)}
    parts: dict[str, list[NDArray[np.generic]]] = {p.name: [] for p in block.properties}
    for row in range(block.n_rows):
        for prop in block.properties:
            length = _next_count(words, row) if prop.count_type else 1
            taken = list(itertools.islice(words, length))
            if len(taken) < length:
                raise _CutOffError(row)
            parts[prop.name].append(_parsed(taken, prop.type))
    return {name: _joined(values) for name, values in parts.items()}


def _next_count(words: Iterator[bytes], row: int) -> int:
    word = next(words, None)
    if word is None:
        raise _CutOffError(row)
    return _list_length(int(word))


def _list_length(length: int) -> int:
    if not 0 <= length <= _MOST_ROWS:
        raise ValueError(f"a list of length {length}")
    return length


def _parsed(words: list[bytes], type_name: str) -> NDArray[np.generic]:
    """Values of words; the type's width does not matter here, files get it wrong and mean no harm."""
    if type_name[0] == "f":
        return np.array([float(word) for word in words], dtype=np.float64)
    numbers = [int(word) for word in words]
    worst = max(numbers, key=abs, default=0)
    if abs(worst) >= 2**63:
        raise ValueError(f"the number {str(worst)[:40]}")
    return np.array(numbers, dtype=np.int64)


def _joined(rows: list[NDArray[np.generic]]) -> _Column:
    lengths = np.fromiter(map(len, rows), dtype=np.int64, count=len(rows))
    return _Column(np.concatenate(rows) if rows else np.zeros(0), lengths)


# ------------------------------------------------------------------------------------------------- mesh
def _vertices(path: Path, columns: dict[str, dict[str, _Column]]) -> FloatArray:
    table = columns.get("vertex", {})
    if not all(axis in table for axis in "xyz"):
        raise SceneError(
            f"{path.name}: its vertices have the properties {', '.join(table) or 'none'}, expected x, y and z; "
            "export it again."
        )
    ragged = next((axis for axis in "xyz" if (table[axis].n_values != 1).any()), None)
    if ragged is not None:
        raise SceneError(
            f"{path.name}: {ragged} of its vertices is a list, expected one number per vertex; export it again."
        )
    return np.stack([exact(table[axis].values) for axis in "xyz"], axis=1)


def _corners(path: Path, columns: dict[str, dict[str, _Column]]) -> tuple[Int64Array, Int64Array]:
    """Corners a face, and their vertex numbers. None where the file is a point cloud."""
    table = columns.get("face", {})
    for name in _FACE_LISTS:
        if name in table:
            values = table[name].values
            if values.dtype.kind == "f":
                _check_are_whole(path, exact(values))
            return table[name].n_values, values.astype(np.int64)
    return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)


def _check_are_whole(path: Path, values: FloatArray) -> None:
    """Vertex numbers that are written as floats have to be whole, and below where floats stop being so."""
    odd = ~(np.abs(values) <= 2.0**53) | (values != np.floor(values))
    if odd.any():
        raise SceneError(
            f"{path.name}: {grouped(int(odd.sum()))} vertex numbers of its faces are not whole numbers, such as "
            f"{values[odd][0]:g}; it is damaged, export it again."
        )
