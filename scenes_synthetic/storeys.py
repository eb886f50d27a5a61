"""Storeys of larger buildings: outer walls, doors and windows for all openings, furniture put into rooms by name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from scenes_synthetic.building import Opening, door, wall, window
from scenes_synthetic.model import Hole, Level, Part, Room, SyntheticScene, assemble
from scenes_synthetic.solids import Solid, place

NORTH_WALL, EAST_WALL, SOUTH_WALL, WEST_WALL = 0.0, 270.0, 180.0, 90.0
"""Turn of an item whose back is at that wall of its room."""


def rectangle_room(
    name: str, storey: int, low_m: Sequence[float], high_m: Sequence[float], floor_m: float, height_m: float
) -> Room:
    """A room between two corners (x, y)."""
    (x0, y0), (x1, y1) = low_m, high_m
    return Room(name, storey, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)), floor_m, height_m)


def outer_walls(
    prefix: str,
    storey: int,
    size_m: tuple[float, float],
    foot_m: float,
    top_m: float,
    thickness_m: float,
    openings: Mapping[str, Sequence[Opening]],
) -> list[Part]:
    """Four walls inside the rectangle (0, 0) to `size_m`; openings by side: south, north, west, east."""
    (width, depth), t = size_m, thickness_m
    inner_x, inner_y = round(width - t, 6), round(depth - t, 6)
    corners = {
        "south": ((0.0, 0.0), (width, t)),
        "north": ((0.0, inner_y), (width, depth)),
        "west": ((0.0, t), (t, inner_y)),
        "east": ((inner_x, t), (width, inner_y)),
    }
    return [
        wall(f"{prefix} wall {side}", storey, (*low, foot_m), (*high, top_m), openings.get(side, ()))
        for side, (low, high) in corners.items()
    ]


def holes_of(parts: Sequence[Part]) -> list[tuple[int, Hole]]:
    """Openings of all walls, with the storey of their wall."""
    return [
        (part.storey, hole)
        for part in parts
        if part.kind == "IfcWall" and part.pierced_box is not None
        for hole in part.pierced_box.holes
    ]


def windows(parts: Sequence[Part]) -> list[Part]:
    """Build a window for each opening whose name begins with `Window`."""
    return [window(hole.name, storey, hole) for storey, hole in holes_of(parts) if hole.name.startswith("Window")]


def doors(parts: Sequence[Part], swings: Mapping[str, tuple[str, str, float]]) -> list[Part]:
    """Build a door for each opening whose name begins with `Door ` (a `Doorway` stays empty).

    swings : by opening, side to which it swings, hinge, and degrees it stands open.
    """
    found = [(storey, hole) for storey, hole in holes_of(parts) if hole.name.startswith("Door ")]
    return [
        door(
            hole.name,
            storey,
            hole,
            towards=swings[hole.name][0],
            hinge=swings[hole.name][1],
            open_deg=swings[hole.name][2],
        )
        for storey, hole in found
    ]


def finished(
    name: str,
    *,
    levels: Sequence[Level],
    rooms: Sequence[Room],
    fabric: Sequence[Part],
    swings: Mapping[str, tuple[str, str, float]],
    others: Iterable[Part],
    extents_m: Sequence[Sequence[float]],
) -> SyntheticScene:
    """Put windows and doors into the openings of the fabric, and all parts together. `swings` as `doors` takes them."""
    parts = [*fabric, *windows(fabric), *doors(fabric, swings), *others]
    return assemble(name, levels=levels, rooms=rooms, parts=parts, extents_m=extents_m)


def grid_spots(room: Room, every_m: float) -> list[tuple[int, int, float, float]]:
    """Column, row and place (x, y) of spots about `every_m` apart, evenly over a rectangular room: for lamps."""
    (x0, y0), _, (x1, y1), _ = room.outline_m
    n_x, n_y = max(1, round((x1 - x0) / every_m)), max(1, round((y1 - y0) / every_m))
    return [
        (i, j, x0 + (i + 0.5) * (x1 - x0) / n_x, y0 + (j + 0.5) * (y1 - y0) / n_y)
        for i in range(n_x)
        for j in range(n_y)
    ]


class Fitter:
    """Collects furniture and fittings, each placed in a room and named after it and its number there."""

    def __init__(self, rooms: Sequence[Room]) -> None:
        self.parts: list[Part] = []
        self._rooms = {room.name: room for room in rooms}
        self._count: Counter[str] = Counter()

    def put(
        self,
        room: str,
        what: str,
        solid: Solid,
        x_m: float,
        y_m: float,
        turn_deg: float = 0.0,
        *,
        kind: str = "IfcFurniture",
        lift_m: float = 0.0,
        from_ceiling: bool = False,
    ) -> None:
        """Stand an item with its origin at (x, y), `lift_m` over the floor, or hang it from the ceiling."""
        where = self._rooms[room]
        height = where.floor_m + (where.height_m if from_ceiling else 0.0) + lift_m
        self._count[f"{room} {what}"] += 1
        name = f"{room} {what} {self._count[f'{room} {what}']}"
        placed = place(solid, (x_m, y_m, round(height, 6)), turn_deg=turn_deg)
        self.parts.append(Part(name, kind, where.storey, placed, room=room))

    def put_round(
        self,
        room: str,
        what: str,
        solid: Solid,
        middle_m: tuple[float, float],
        reach_m: float,
        turns_deg: Iterable[float],
    ) -> None:
        """Stand one item a turn round a table's middle, its back `reach_m` away from it and its front towards it."""
        x, y = middle_m
        for turn in turns_deg:
            s, c = float(np.sin(np.deg2rad(turn))), float(np.cos(np.deg2rad(turn)))
            self.put(room, what, solid, x - reach_m * s, y + reach_m * c, turn)
