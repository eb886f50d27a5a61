"""Bare rooms of known truth: one convex room, an L, rooms with a doorway, unreachable ones, rooms along a corridor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scenes_synthetic.building import Opening, slab, wall
from scenes_synthetic.furniture import table
from scenes_synthetic.model import KnownView, Level, Part, Room, SyntheticScene, assemble
from scenes_synthetic.solids import box as box_solid
from scenes_synthetic.solids import place

_LEVEL = Level("Ground floor", 0.0)
_WALL_M = 0.2
_SLAB_M = 0.2
_HEIGHT_M = 2.7


def box(*, seed: int = 0) -> SyntheticScene:
    """One room of 6 x 4 x 2.7 m: every spot in it sees all of it. Nothing is left to chance, so the seed is unused."""
    del seed
    width, depth = 6.0, 4.0
    room = _rectangle("Room", 0.0, 0.0, width, depth)
    parts = [*_floor_and_ceiling(width, depth), *_shell(width, depth)]
    return _assemble("box", [room], parts, (width, depth), n_stations=1)


def l_room(*, seed: int = 0) -> SyntheticScene:
    """An L of 7 x 6 m less a corner of 4 x 3 m. Where both legs meet, one spot sees all. The seed is unused."""
    del seed
    width, depth, leg_x, leg_y = 7.0, 6.0, 3.0, 3.0
    outline = ((0.0, 0.0), (width, 0.0), (width, leg_y), (leg_x, leg_y), (leg_x, depth), (0.0, depth))
    # The corner outside the L is filled: a solid block, as a shaft or a neighbour's room would be.
    corner = wall("Corner block", 0, (leg_x, leg_y, 0.0), (width, depth, _HEIGHT_M))
    parts = [*_floor_and_ceiling(width, depth), *_shell(width, depth), corner]
    room = Room("Room", 0, outline, 0.0, _HEIGHT_M)
    return _assemble("l-room", [room], parts, (width, depth), n_stations=1)


def two_rooms(*, seed: int = 0) -> SyntheticScene:
    """Two rooms of 4 x 4 m with an open doorway: a side of the wall between them for each. The seed is unused."""
    del seed
    side, between = 4.0, 0.15
    width = 2 * side + between
    doorway = Opening("Doorway", 1.5, 1.0, 2.1)
    partition = wall("Partition", 0, (side, 0.0, 0.0), (side + between, side, _HEIGHT_M), [doorway])
    parts = [*_floor_and_ceiling(width, side), *_shell(width, side), partition]
    rooms = [_rectangle("Room west", 0.0, 0.0, side, side), _rectangle("Room east", side + between, 0.0, width, side)]
    return _assemble("two-rooms", rooms, parts, (width, side), n_stations=2)


def closed_rooms(*, seed: int = 0, n_rooms: int = 3) -> SyntheticScene:
    """Rooms of 3 x 4 m in a row with nothing between them but walls: a station each. The seed is unused."""
    del seed
    side, depth, between = 3.0, 4.0, 0.15
    width = round(n_rooms * side + (n_rooms - 1) * between, 6)
    starts = [round(i * (side + between), 6) for i in range(n_rooms)]
    partitions = [
        wall(f"Partition {i}", 0, (round(start - between, 6), 0.0, 0.0), (start, depth, _HEIGHT_M))
        for i, start in enumerate(starts)
        if i > 0
    ]
    rooms = [_rectangle(f"Room {i + 1}", start, 0.0, round(start + side, 6), depth) for i, start in enumerate(starts)]
    parts = [*_floor_and_ceiling(width, depth), *_shell(width, depth), *partitions]
    found = _assemble("closed-rooms", rooms, parts, (width, depth), n_stations=n_rooms)
    ends = ["Wall west", *(f"Partition {i}" for i in range(1, n_rooms)), "Wall east"]
    views = []
    for i, start in enumerate(starts):
        # All of its own room, which is convex, and nothing else.
        seen = dict.fromkeys(("Floor", "Ceiling"), side * depth) | dict.fromkeys(
            ("Wall south", "Wall north"), side * _HEIGHT_M
        )
        seen |= dict.fromkeys(ends[i : i + 2], depth * _HEIGHT_M)
        views.append(KnownView((round(start + side / 2, 6), depth / 2, 1.5), seen))
    stations = tuple(view.station_m for view in views)
    return replace(found, truth=replace(found.truth, stations_m=stations, views=tuple(views)))


def corridor_comb(*, seed: int = 0, n_rooms: int = 4) -> SyntheticScene:
    """A corridor with rooms of 3 x 4 m along one side, each with an open doorway to it. The seed is unused.

    The wall with the doorways shows each room and the corridor a face that is seen from there only, so all need a
    station; the one in a room, opposite its doorway, sees the doorway's reveals too.
    """
    del seed
    side, depth, between, corridor = 3.0, 4.0, 0.15, 1.6
    width = round(n_rooms * side + (n_rooms - 1) * between, 6)
    inner = round(corridor + between, 6)
    total = round(inner + depth, 6)
    starts = [round(i * (side + between), 6) for i in range(n_rooms)]
    doorways = [Opening(f"Doorway {i + 1}", round(start + 1.0, 6), 1.0, 2.1) for i, start in enumerate(starts)]
    partitions = [
        wall(f"Partition {i}", 0, (round(start - between, 6), inner, 0.0), (start, total, _HEIGHT_M))
        for i, start in enumerate(starts)
        if i > 0
    ]
    long_wall = wall("Wall corridor", 0, (0.0, corridor, 0.0), (width, inner, _HEIGHT_M), doorways)
    rooms = [
        _rectangle("Corridor", 0.0, 0.0, width, corridor),
        *(_rectangle(f"Room {i + 1}", s, inner, round(s + side, 6), total) for i, s in enumerate(starts)),
    ]
    parts = [*_floor_and_ceiling(width, total), *_shell(width, total), long_wall, *partitions]
    return _assemble("corridor-comb", rooms, parts, (width, total), n_stations=n_rooms + 1)


def floor_plate() -> SyntheticScene:
    """One floor of 50 x 30 m: a hall with columns and desks, and six rooms each south and north of it.

    As large as an office's floor, with the desks that hide parts of it, and no more triangles than that needs. How many
    stations it takes nobody knows, so it is none of the scenes of `scenes_synthetic.names`.
    """
    width, depth, side, between, row = 50.0, 30.0, 8.2, 0.16, (7.85, 8.0)
    starts = [round(i * (side + between), 6) for i in range(6)]
    rooms, parts = [_rectangle("Hall", 0.0, row[1], width, depth - row[1])], []
    for name, low, high in (("south", 0.0, row[0]), ("north", depth - row[0], depth)):
        y0, y1 = row if name == "south" else (depth - row[1], depth - row[0])
        doorways = [Opening(f"Doorway {name} {i + 1}", round(s + 1.0, 6), 1.0, 2.1) for i, s in enumerate(starts)]
        parts.append(wall(f"Wall of rooms {name}", 0, (0.0, y0, 0.0), (width, y1, _HEIGHT_M), doorways))
        for i, start in enumerate(starts):
            rooms.append(_rectangle(f"Room {name} {i + 1}", start, low, round(start + side, 6), high))
            if i > 0:
                left = (round(start - between, 6), low, 0.0)
                parts.append(wall(f"Partition {name} {i}", 0, left, (start, high, _HEIGHT_M)))
            parts += _desks(f"{name} {i + 1}", (start + 2.0, low + 2.0), (2, 2), rooms[-1].name)
    for i in range(8):
        x = round(4.0 + 6.0 * i, 6)
        column = box_solid((x, 14.75, 0.0), (round(x + 0.5, 6), 15.25, _HEIGHT_M))
        parts.append(Part(f"Column {i + 1}", "IfcColumn", 0, column))
    parts += _desks("hall", (2.0, 10.5), (12, 3), "Hall")
    return _assemble("floor-plate", rooms, [*_floor_and_ceiling(width, depth), *_shell(width, depth), *parts],
                     (width, depth), n_stations=None)  # fmt: skip


def _desks(name: str, at_m: tuple[float, float], n: tuple[int, int], room: str) -> list[Part]:
    """Rows of desks, 4 m apart along x and 3.5 m along y, the first with its back at `at_m`."""
    return [
        Part(
            f"Desk {name} {i}.{j}", "IfcFurniture", 0,
            place(table(1.6, 0.8), (round(at_m[0] + 4.0 * i, 6), round(at_m[1] + 3.5 * j, 6), 0.0)), room=room,
        )
        for i in range(n[0])
        for j in range(n[1])
    ]  # fmt: skip


def _rectangle(name: str, x0_m: float, y0_m: float, x1_m: float, y1_m: float) -> Room:
    return Room(name, 0, ((x0_m, y0_m), (x1_m, y0_m), (x1_m, y1_m), (x0_m, y1_m)), 0.0, _HEIGHT_M)


def _floor_and_ceiling(width_m: float, depth_m: float) -> list[Part]:
    out = _WALL_M
    high_x, high_y = width_m + out, depth_m + out
    return [
        slab("Floor", 0, (-out, -out, -_SLAB_M), (high_x, high_y, 0.0), lowest=True),
        slab("Ceiling", 0, (-out, -out, _HEIGHT_M), (high_x, high_y, _HEIGHT_M + _SLAB_M), lowest=False),
    ]


def _shell(width_m: float, depth_m: float) -> list[Part]:
    """Four walls outside the rectangle (0, 0) to (width, depth)."""
    out, top = _WALL_M, _HEIGHT_M
    return [
        wall("Wall south", 0, (-out, -out, 0.0), (width_m + out, 0.0, top)),
        wall("Wall north", 0, (-out, depth_m, 0.0), (width_m + out, depth_m + out, top)),
        wall("Wall west", 0, (-out, 0.0, 0.0), (0.0, depth_m, top)),
        wall("Wall east", 0, (width_m, 0.0, 0.0), (width_m + out, depth_m, top)),
    ]


def _assemble(
    name: str, rooms: Sequence[Room], parts: Sequence[Part], inside_m: tuple[float, float], *, n_stations: int | None
) -> SyntheticScene:
    extents = [
        [-_WALL_M, -_WALL_M, -_SLAB_M],
        [inside_m[0] + _WALL_M, inside_m[1] + _WALL_M, _HEIGHT_M + _SLAB_M],
    ]
    return assemble(name, levels=[_LEVEL], rooms=rooms, parts=parts, extents_m=extents, n_stations=n_stations)
