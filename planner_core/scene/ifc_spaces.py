"""Rooms of an IFC file: its IfcSpaces, as closed shapes that no beam meets. Metres, the file's own frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Int64Array, Room

#: A shape that is thinner than this, to any side, is a plan symbol or damage, no room.
MIN_SIDE_M = 0.2
_NAMED = 3


def rooms_of(
    spaces: list[tuple[Any, int]], shapes: Iterator[tuple[int, FloatArray, Int64Array]]
) -> tuple[tuple[Room, ...], list[str]]:
    """Rooms in the order of `spaces`, and the titles of those without a usable shape.

    Parameters
    ----------
    spaces
        IfcSpace and index of its storey.
    shapes
        Space id, vertices (V, 3) in metres, triangles (T, 3); several of one space are joined.
    """
    by_id: dict[int, list[tuple[FloatArray, Int64Array]]] = {}
    for space_id, vertices, triangles in shapes:
        by_id.setdefault(space_id, []).append((vertices, triangles))
    rooms, without = [], []
    for space, storey in spaces:
        parts = sorted(by_id.get(int(space.id()), []), key=lambda part: (part[0].tobytes(), part[1].tobytes()))
        room = _room(space, storey, parts)
        if np.isfinite(room.vertices_m).all() and (room.box_m[1] - room.box_m[0] >= MIN_SIDE_M).all():
            rooms.append(room)
        else:
            without.append(room.title)
    return tuple(rooms), without


def _room(space: Any, storey: int, parts: list[tuple[FloatArray, Int64Array]]) -> Room:
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return Room(
        name=str(space.Name or ""),
        long_name=str(space.LongName or ""),
        source_id=str(space.GlobalId),
        storey=storey,
        vertices_m=np.concatenate([np.zeros((0, 3)), *(vertices for vertices, _ in parts)]),
        triangles=np.concatenate(
            [
                np.zeros((0, 3), dtype=np.int32),
                *(part + start for (_, part), start in zip(parts, first, strict=False)),
            ]
        ).astype(np.int32),
    )


def without_shape(name: str, titles: list[str]) -> tuple[str, ...]:
    """A line for the user about rooms that were left out."""
    if not titles:
        return ()
    more = f" and {len(titles) - _NAMED} more" if len(titles) > _NAMED else ""
    noun = "room has" if len(titles) == 1 else "rooms have"
    return (f"{name}: {len(titles)} {noun} no usable shape and can't be named in results: "
            f"{', '.join(titles[:_NAMED])}{more}.",)  # fmt: skip
