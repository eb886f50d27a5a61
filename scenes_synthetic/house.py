"""The demo: a furnished two-storey house of 10 x 8 m with a flat roof.

Plan, x to the east, y to the north, metres; the front door is in the south wall.

    ground floor                              upper floor
    +-----------------+--------------+        +---------+--------+--------------+
    |     Kitchen            .       |        | Bedroom |        |  Bedroom     |
    |                        .       |        |   west  |        |  north-east  |
    +-------/ ---+----+      Living  |        |         | Corri- /              |
    |  Hall      |stair|     room    |        |         / dor    +--------------+
    |            | ^  |              |        +---------+ | v | |  Bedroom     |
    +------+     | |  |              |        |  Bath   / |   | |  south-east  |
    |  WC  /          /              |        |         |        /              |
    +------+---door---+--------------+        +---------+--------+--------------+
"""

from __future__ import annotations

import numpy as np

from scenes_synthetic import furniture as f
from scenes_synthetic.building import (
    Opening,
    door,
    flat_roof,
    parapet,
    railing,
    slab,
    stairs,
    wall,
    window,
)
from scenes_synthetic.model import Hole, Level, Part, Room, SyntheticScene, assemble
from scenes_synthetic.solids import Solid, place

_GROUND, _UPPER = 0, 1
_LEVELS = (Level("Ground floor", 0.0), Level("Upper floor", 2.8))
_CLEAR_M = 2.55
_DOOR_M, _DOOR_HEIGHT_M = 0.9, 2.1

_ROOMS = (
    Room(
        "Hall", _GROUND, ((2.2, 0.3), (5.08, 0.3), (5.08, 5.28), (0.3, 5.28), (0.3, 2.32), (2.2, 2.32)), 0.0, _CLEAR_M
    ),
    Room("WC", _GROUND, ((0.3, 0.3), (2.08, 0.3), (2.08, 2.2), (0.3, 2.2)), 0.0, _CLEAR_M),
    Room("Kitchen", _GROUND, ((0.3, 5.4), (5.08, 5.4), (5.08, 7.7), (0.3, 7.7)), 0.0, _CLEAR_M),
    Room("Living room", _GROUND, ((5.2, 0.3), (9.7, 0.3), (9.7, 7.7), (5.2, 7.7)), 0.0, _CLEAR_M),
    Room("Corridor", _UPPER, ((2.9, 0.3), (5.08, 0.3), (5.08, 7.7), (2.9, 7.7)), 2.8, _CLEAR_M),
    Room("Bath", _UPPER, ((0.3, 0.3), (2.78, 0.3), (2.78, 3.3), (0.3, 3.3)), 2.8, _CLEAR_M),
    Room("Bedroom west", _UPPER, ((0.3, 3.42), (2.78, 3.42), (2.78, 7.7), (0.3, 7.7)), 2.8, _CLEAR_M),
    Room("Bedroom south-east", _UPPER, ((5.2, 0.3), (9.7, 0.3), (9.7, 3.94), (5.2, 3.94)), 2.8, _CLEAR_M),
    Room("Bedroom north-east", _UPPER, ((5.2, 4.06), (9.7, 4.06), (9.7, 7.7), (5.2, 7.7)), 2.8, _CLEAR_M),
)

_STAIR_HOLE = Hole("Stair opening", (4.08, 2.12, 2.55), (5.08, 5.24, 2.8))


def build(*, seed: int = 0) -> SyntheticScene:
    """Generate the house. The seed moves what people move: chairs, and how far doors stand open."""
    rng = np.random.default_rng(seed)
    fabric = [*_slabs(), *_ground_walls(), *_upper_walls(), *_stairs()]
    holes = {hole.name: hole for part in fabric if part.pierced_box for hole in part.pierced_box.holes}
    parts = [*fabric, *_doors(holes, rng), *_windows(holes), *_ground_furniture(rng), *_upper_furniture(rng)]
    extents = [[-0.3, -0.3, -0.25], [10.3, 8.3, 5.9]]
    return assemble("house", levels=_LEVELS, rooms=_ROOMS, parts=parts, extents_m=extents)


def _slabs() -> list[Part]:
    return [
        slab("Ground slab", _GROUND, (0.0, 0.0, -0.25), (10.0, 8.0, 0.0), lowest=True),
        slab("Upper slab", _UPPER, (0.0, 0.0, 2.55), (10.0, 8.0, 2.8), [_STAIR_HOLE], lowest=False),
        flat_roof("Roof", _UPPER, (-0.3, -0.3, 5.35), (10.3, 8.3, 5.6)),
        parapet("Parapet", _UPPER, (-0.3, -0.3, 5.6), (10.3, 8.3, 5.9), 0.15),
    ]


def _door(name: str, start_m: float, width_m: float = _DOOR_M) -> Opening:
    return Opening(name, start_m, width_m, _DOOR_HEIGHT_M)


def _window(name: str, start_m: float, width_m: float, *, sill_m: float = 0.9) -> Opening:
    return Opening(name, start_m, width_m, round(2.2 - sill_m, 6), sill_m)


def _ground_walls() -> list[Part]:
    top = _CLEAR_M
    hall_door = _door("Front door", 2.9, 1.0)
    south = [
        _window("Window WC", 0.9, 0.6, sill_m=1.4),
        hall_door,
        _window("Window living south", 6.35, 2.2, sill_m=0.3),
    ]
    north = [_window("Window kitchen", 1.6, 1.8, sill_m=1.1), _window("Window living north", 6.6, 1.7)]
    east = [_window("Window living east", 2.9, 2.4, sill_m=0.1)]
    west = [_window("Window hall", 3.4, 0.9), _window("Window kitchen west", 6.1, 0.9, sill_m=1.1)]
    spine = [_door("Door living room", 0.5), Opening("Doorway kitchen", 5.9, 1.4, _DOOR_HEIGHT_M)]
    return [
        wall("Wall ground south", _GROUND, (0.0, 0.0, 0.0), (10.0, 0.3, top), south),
        wall("Wall ground north", _GROUND, (0.0, 7.7, 0.0), (10.0, 8.0, top), north),
        wall("Wall ground west", _GROUND, (0.0, 0.3, 0.0), (0.3, 7.7, top), west),
        wall("Wall ground east", _GROUND, (9.7, 0.3, 0.0), (10.0, 7.7, top), east),
        wall("Wall ground spine", _GROUND, (5.08, 0.3, 0.0), (5.2, 7.7, top), spine),
        wall("Wall kitchen", _GROUND, (0.3, 5.28, 0.0), (5.08, 5.4, top), [_door("Door kitchen", 2.6)]),
        wall("Wall WC east", _GROUND, (2.08, 0.3, 0.0), (2.2, 2.32, top), [_door("Door WC", 0.95, 0.8)]),
        wall("Wall WC north", _GROUND, (0.3, 2.2, 0.0), (2.08, 2.32, top)),
    ]


def _upper_walls() -> list[Part]:
    foot, top = 2.8, 5.35
    south = [
        _window("Window bath", 1.1, 0.9, sill_m=1.2),
        _window("Window corridor south", 3.5, 0.9),
        _window("Window bedroom south-east", 6.5, 1.9),
    ]
    north = [
        _window("Window bedroom west", 0.9, 1.3),
        _window("Window corridor north", 3.4, 1.2),
        _window("Window bedroom north-east", 6.5, 1.9),
    ]
    east = [_window("Window south-east side", 1.6, 1.1), _window("Window north-east side", 5.3, 1.1)]
    spine = [_door("Door bedroom south-east", 0.9), _door("Door bedroom north-east", 5.7)]
    west_spine = [_door("Door bath", 2.2, 0.8), _door("Door bedroom west", 4.2)]
    return [
        wall("Wall upper south", _UPPER, (0.0, 0.0, foot), (10.0, 0.3, top), south),
        wall("Wall upper north", _UPPER, (0.0, 7.7, foot), (10.0, 8.0, top), north),
        wall("Wall upper west", _UPPER, (0.0, 0.3, foot), (0.3, 7.7, top), [_window("Window west side", 5.0, 0.9)]),
        wall("Wall upper east", _UPPER, (9.7, 0.3, foot), (10.0, 7.7, top), east),
        wall("Wall upper spine", _UPPER, (5.08, 0.3, foot), (5.2, 7.7, top), spine),
        wall("Wall upper west spine", _UPPER, (2.78, 0.3, foot), (2.9, 7.7, top), west_spine),
        wall("Wall bath north", _UPPER, (0.3, 3.3, foot), (2.78, 3.42, top)),
        wall("Wall between bedrooms", _UPPER, (5.2, 3.94, foot), (9.7, 4.06, top)),
    ]


def _stairs() -> list[Part]:
    return [
        stairs("Stairs", _GROUND, foot_m=(4.1, 1.6, 0.0), width_m=0.96, rise_m=2.8, n_risers=15, going_m=0.26),
        railing("Railing side", _UPPER, (4.04, 2.15, 2.8), (4.04, 5.2, 2.8)),
        railing("Railing end", _UPPER, (4.1, 2.08, 2.8), (5.04, 2.08, 2.8)),
    ]


def _doors(holes: dict[str, Hole], rng: np.random.Generator) -> list[Part]:
    swings = (
        # opening, storey, swings towards, hinge
        ("Door living room", _GROUND, "+x", "left"),
        ("Door kitchen", _GROUND, "+y", "right"),
        ("Door WC", _GROUND, "+x", "left"),
        ("Door bath", _UPPER, "-x", "right"),
        ("Door bedroom west", _UPPER, "-x", "right"),
        ("Door bedroom south-east", _UPPER, "+x", "right"),
        ("Door bedroom north-east", _UPPER, "+x", "left"),
    )
    parts = [door("Front door", _GROUND, holes["Front door"], towards="+y", hinge="right", open_deg=0.0)]
    for name, storey, towards, hinge in swings:
        open_deg = float(rng.integers(75, 91))
        parts.append(door(name, storey, holes[name], towards=towards, hinge=hinge, open_deg=open_deg))
    return parts


def _windows(holes: dict[str, Hole]) -> list[Part]:
    upper = _LEVELS[_UPPER].elevation_m
    return [
        window(name, _UPPER if hole.low_m[2] > upper else _GROUND, hole)
        for name, hole in holes.items()
        if name.startswith("Window")
    ]


def _furniture(
    room: str, name: str, solid: Solid, x_m: float, y_m: float, turn_deg: float = 0.0, kind: str = ""
) -> Part:
    """Stand an item on its room's floor, its back's middle at (x, y)."""
    place_of = next(r for r in _ROOMS if r.name == room)
    placed = place(solid, (x_m, y_m, place_of.floor_m), turn_deg=turn_deg)
    return Part(f"{room} {name}", kind or "IfcFurniture", place_of.storey, placed, room=room)


def _loose_chair(room: str, name: str, x_m: float, y_m: float, turn_deg: float, rng: np.random.Generator) -> Part:
    """A chair that nobody has put back exactly."""
    turn = turn_deg + float(rng.integers(-8, 9))
    dx, dy = rng.integers(-3, 4, size=2) / 100
    return _furniture(room, name, f.chair(), x_m + float(dx), y_m + float(dy), turn)


_NORTH_WALL, _EAST_WALL, _SOUTH_WALL, _WEST_WALL = 0.0, 270.0, 180.0, 90.0
"""Turn of an item whose back is at that wall of its room."""


def _ground_furniture(rng: np.random.Generator) -> list[Part]:
    sanitary = "IfcSanitaryTerminal"
    items = [
        _furniture("Hall", "wardrobe", f.cupboard(1.2, 0.6, 2.1), 0.32, 4.6, _WEST_WALL),
        _furniture("Hall", "bench", f.table(1.1, 0.38, 0.45), 1.2, 2.34, _SOUTH_WALL),
        _furniture("WC", "toilet", f.toilet(), 0.32, 1.7, _WEST_WALL, sanitary),
        _furniture("WC", "washbasin", f.washbasin(), 0.32, 0.8, _WEST_WALL, sanitary),
        _furniture("Kitchen", "counter", f.kitchen_counter(3.6), 2.15, 7.68, _NORTH_WALL),
        _furniture(
            "Kitchen", "refrigerator", f.block(0.62, 0.64, 1.85), 4.3, 7.68, _NORTH_WALL, "IfcElectricAppliance"
        ),
        _furniture("Kitchen", "wall cupboard left", f.wall_cupboard(1.1), 0.9, 7.68, _NORTH_WALL),
        _furniture("Kitchen", "wall cupboard right", f.wall_cupboard(0.5), 3.7, 7.68, _NORTH_WALL),
        _furniture("Kitchen", "side table", f.table(0.9, 0.5), 1.1, 5.42, _SOUTH_WALL),
        _furniture("Living room", "sofa", f.sofa(2.2), 7.45, 2.95, _NORTH_WALL),
        _furniture("Living room", "armchair", f.sofa(0.95, 0.85), 9.2, 1.3, _EAST_WALL),
        _furniture("Living room", "coffee table", f.table(1.1, 0.6, 0.42), 7.4, 1.55),
        _furniture("Living room", "television board", f.cupboard(1.8, 0.4, 0.45), 7.45, 0.32, _SOUTH_WALL),
        _furniture("Living room", "bookshelf", f.shelf(1.6, 0.32, 2.0, n_boards=4), 5.22, 4.6, _WEST_WALL),
        _furniture("Living room", "sideboard", f.cupboard(1.5, 0.42, 0.8), 9.68, 6.6, _EAST_WALL),
        _furniture("Living room", "dining table", f.table(2.2, 0.95), 7.5, 6.15),
    ]
    for i, x in enumerate((6.8, 7.5, 8.2)):
        items.append(_loose_chair("Living room", f"chair {i + 1}", x, 6.66, 0.0, rng))
        items.append(_loose_chair("Living room", f"chair {i + 4}", x, 4.67, 180.0, rng))
    return items


def _upper_furniture(rng: np.random.Generator) -> list[Part]:
    sanitary = "IfcSanitaryTerminal"
    south_east, north_east, west = "Bedroom south-east", "Bedroom north-east", "Bedroom west"
    return [
        _furniture("Corridor", "desk", f.desk(1.3), 3.99, 7.68, _NORTH_WALL),
        _loose_chair("Corridor", "chair", 3.82, 6.6, 180.0, rng),
        _furniture("Corridor", "bookshelf", f.shelf(0.9, 0.28, 1.2, n_boards=2), 2.92, 1.2, _WEST_WALL),
        _furniture("Bath", "bathtub", f.bathtub(), 1.2, 0.32, _SOUTH_WALL, sanitary),
        _furniture("Bath", "toilet", f.toilet(), 0.32, 2.6, _WEST_WALL, sanitary),
        _furniture("Bath", "washbasin", f.washbasin(0.7), 1.3, 3.28, _NORTH_WALL, sanitary),
        _furniture(west, "bed", f.bed(0.9), 0.85, 7.68, _NORTH_WALL),
        _furniture(west, "desk", f.desk(1.2), 0.32, 4.3, _WEST_WALL),
        _loose_chair(west, "chair", 1.25, 4.12, 270.0, rng),
        _furniture(west, "shelf", f.shelf(0.8, 0.35, 1.8, n_boards=4), 2.34, 7.68, _NORTH_WALL),
        _furniture(south_east, "bed", f.bed(1.6), 9.68, 1.2, _EAST_WALL),
        _furniture(south_east, "bedside table", f.cupboard(0.4, 0.36, 0.5), 9.68, 2.45, _EAST_WALL),
        _furniture(south_east, "wardrobe", f.cupboard(2.2, 0.6, 2.2), 7.4, 3.92, _NORTH_WALL),
        _furniture(north_east, "bed", f.bed(1.4), 9.68, 6.75, _EAST_WALL),
        _furniture(north_east, "desk", f.desk(1.3), 7.2, 4.08, _SOUTH_WALL),
        _loose_chair(north_east, "chair", 7.37, 5.2, 0.0, rng),
        _furniture(north_east, "wardrobe", f.cupboard(1.2, 0.6, 2.0), 9.05, 4.08, _SOUTH_WALL),
        _furniture(north_east, "shelf", f.shelf(1.0, 0.35, 1.6, n_boards=3), 5.9, 7.68, _NORTH_WALL),
    ]
