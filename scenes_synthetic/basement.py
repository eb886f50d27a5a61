"""The paper's `basement`: 20 x 21 m and 4 m high with its slabs, 130 thousand triangles (Lopez et al. 2023, Fig. 10a).

Plan, x to the east, y to the north, metres. All doors of small rooms are shut; the shaft has none.

    +-----------+------+-----+---+-----------+
    |   Plant   |Stair |Arch.|   | Shaft     |
    |           |  ^   |     | C +-----------+
    +----/ -----+--/---+-----+ o | Shower    |
    |                        | r +-----------+
    |      o        o        | r | Stores    |
    |        Hall              i | 1, 2, 3   |
    |      o        o          d +-----------+
    |                        | o | Electrical|
    |      o        o        | r +-----------+
    |                        |   | Boiler    |
    +------------------------+---+-----------+
"""

from __future__ import annotations

import numpy as np

from scenes_synthetic import furnishing_desks as desks
from scenes_synthetic import furnishing_seats as seats
from scenes_synthetic import furnishing_services as services
from scenes_synthetic import furniture
from scenes_synthetic.building import Opening, slab, stairs, wall
from scenes_synthetic.model import Hole, Level, Part, Room, SyntheticScene
from scenes_synthetic.solids import Point
from scenes_synthetic.storeys import (
    EAST_WALL,
    NORTH_WALL,
    SOUTH_WALL,
    WEST_WALL,
    Fitter,
    finished,
    grid_spots,
    outer_walls,
    rectangle_room,
)

_SIZE_M = (20.0, 21.0)
_OUTER_M, _INNER_M, _CLEAR_M, _SLAB_M = 0.3, 0.15, 3.4, 0.3
_LEVEL = Level("Basement", 0.0)
_EAST_ROOMS = (
    # name, from y, to y, door's start
    ("Boiler room", 0.3, 5.5, 2.6),
    ("Electrical room", 5.65, 8.5, 6.6),
    ("Store 1", 8.65, 11.0, 9.3),
    ("Store 2", 11.15, 13.5, 11.8),
    ("Store 3", 13.65, 16.0, 14.3),
    ("Shower", 16.15, 18.3, 16.8),
    ("Shaft", 18.45, 20.7, None),
)
ENCLOSED = ("Boiler room", "Electrical room", "Store 1", "Store 2", "Store 3", "Shower", "Shaft", "Archive")
"""Rooms whose doors are shut, or that have none: nothing is seen from outside but through gaps of a centimetre."""
_LAMP, _PIPE_SIDES = "IfcLightFixture", 14


def build(*, seed: int = 0) -> SyntheticScene:
    """Generate the basement. The seed moves what people move: binders, cartons, bicycles, two doors."""
    rng = np.random.default_rng(seed)
    fabric = _fabric()
    swings = {f"Door {name}": ("-x", "left", 0.0) for name, _, _, start in _EAST_ROOMS if start is not None}
    swings["Door Archive"] = ("+x", "left", 0.0)
    swings["Door Plant room"] = ("+y", "right", float(rng.integers(70, 91)))
    swings["Door Stair"] = ("+y", "left", float(rng.integers(70, 91)))
    fitter = Fitter(_rooms())
    _furnish_hall(fitter, rng)
    _furnish_plant(fitter)
    _furnish_small_rooms(fitter, rng)
    _hang_lamps(fitter)
    return finished(
        "basement",
        levels=[_LEVEL],
        rooms=_rooms(),
        fabric=fabric,
        swings=swings,
        others=[*_columns(), *_ducts(), *_pipes(), *fitter.parts],
        extents_m=[[0.0, 0.0, -_SLAB_M], [*_SIZE_M, _CLEAR_M + _SLAB_M]],
    )


def _rooms() -> list[Room]:
    spans = {
        "Hall": ((0.3, 0.3), (12.0, 14.0)),
        "Corridor": ((12.15, 0.3), (14.0, 20.7)),
        "Plant room": ((0.3, 14.15), (6.0, 20.7)),
        "Stair": ((6.15, 14.15), (9.0, 20.7)),
        "Archive": ((9.15, 14.15), (12.0, 20.7)),
        **{name: ((14.15, low), (19.7, high)) for name, low, high, _ in _EAST_ROOMS},
    }
    return [rectangle_room(name, 0, low, high, 0.0, _CLEAR_M) for name, (low, high) in spans.items()]


def _fabric() -> list[Part]:
    top, width, depth = _CLEAR_M, *_SIZE_M
    east_doors = [Opening(f"Door {name}", start, 0.9, 2.1) for name, _, _, start in _EAST_ROOMS if start is not None]
    west_doors = [Opening("Doorway Hall", 6.0, 2.4, 2.5), Opening("Door Archive", 17.0, 0.9, 2.1)]
    north_doors = [Opening("Door Plant room", 2.2, 1.2, 2.1), Opening("Door Stair", 7.7, 1.0, 2.1)]
    hole = Hole("Stair opening", (6.2, 16.4, top), (7.5, 20.0, round(top + _SLAB_M, 6)))
    return [
        slab("Base slab", 0, (0.0, 0.0, -_SLAB_M), (width, depth, 0.0), lowest=True),
        slab("Ceiling", 0, (0.0, 0.0, top), (width, depth, round(top + _SLAB_M, 6)), [hole], lowest=False),
        *outer_walls("Basement", 0, _SIZE_M, 0.0, top, _OUTER_M, {}),
        wall("Wall corridor west", 0, (12.0, 0.3, 0.0), (12.15, 20.7, top), west_doors),
        wall("Wall corridor east", 0, (14.0, 0.3, 0.0), (14.15, 20.7, top), east_doors),
        wall("Wall hall north", 0, (0.3, 14.0, 0.0), (12.0, 14.15, top), north_doors),
        wall("Wall stair west", 0, (6.0, 14.15, 0.0), (6.15, 20.7, top)),
        wall("Wall stair east", 0, (9.0, 14.15, 0.0), (9.15, 20.7, top)),
        *(
            wall(f"Wall north of {name}", 0, (14.15, high, 0.0), (19.7, round(high + _INNER_M, 6), top))
            for name, _, high, _ in _EAST_ROOMS[:-1]
        ),
        stairs("Stairs", 0, foot_m=(6.25, 15.2, 0.0), width_m=1.2, rise_m=3.7, n_risers=21, going_m=0.24),
        # It ends where the flight leaves the storey.
        services.stair_rail("Stair rail", 0, (7.38, 15.2, 0.0), going_m=0.24, riser_m=3.7 / 21, n_treads=15),
    ]


def _columns() -> list[Part]:
    spots = [(x, y) for x in (4.2, 8.2) for y in (3.6, 7.2, 10.8)]
    return [
        services.column(f"Column {i + 1}", 0, (x, y, 0.0), 0.25, _CLEAR_M, n_sides=48) for i, (x, y) in enumerate(spots)
    ]


def _ducts() -> list[Part]:
    runs: list[tuple[list[Point], float, float]] = [
        ([(2.0, 18.5, 1.75), (2.0, 18.5, 3.0), (2.0, 1.5, 3.0), (10.9, 1.5, 3.0), (10.9, 12.0, 3.0)], 0.6, 0.35),
        ([(4.5, 18.5, 1.75), (4.5, 18.5, 2.95), (4.5, 13.0, 2.95), (13.1, 13.0, 2.95), (13.1, 2.0, 2.95)], 0.45, 0.3),
        ([(13.1, 19.0, 2.95), (13.1, 14.2, 2.95)], 0.45, 0.3),
    ]
    return [services.duct(f"Duct {i + 1}", 0, path, w, h, n_bend=10) for i, (path, w, h) in enumerate(runs)]


def _pipes() -> list[Part]:
    """Build two heating pipes from each boiler under the ceiling, water pipes, and risers in the shaft."""
    parts = []
    for i, y in enumerate((1.28, 1.52, 2.88, 3.12)):
        z, x = 2.6, round(12.4 + 0.16 * i, 6)
        path = [(18.3, y, 1.2), (17.5, y, 1.2), (17.5, y, z), (x, y, z), (x, round(19.0 - 0.3 * i, 6), z)]
        parts.append(services.pipe_run(f"Heating pipe {i + 1}", 0, path, 0.05, n_sides=_PIPE_SIDES))
    for i in range(5):
        x, z = round(0.55 + 0.18 * i, 6), 2.55
        path = [(x, 19.8, 0.1), (x, 19.8, z), (x, 0.7 + 0.18 * i, z), (11.6, 0.7 + 0.18 * i, z)]
        parts.append(services.pipe_run(f"Water pipe {i + 1}", 0, path, 0.035 + 0.006 * i, n_sides=_PIPE_SIDES))
    for i in range(8):
        x, y = 15.0 + 0.5 * (i % 4), 19.2 + 0.7 * (i // 4)
        path = [(x, y, 0.0), (x, y, _CLEAR_M)]
        parts.append(services.pipe_run(f"Riser {i + 1}", 0, path, 0.06, n_sides=_PIPE_SIDES))
    return parts


def _furnish_hall(fitter: Fitter, rng: np.random.Generator) -> None:
    bicycle = services.bicycle()
    for i in range(9):
        turn = 90.0 + float(rng.integers(-6, 7))
        fitter.put("Hall", "bicycle", bicycle, 2.3 + 0.75 * i + float(rng.integers(-5, 6)) / 100, 12.6, turn)
    barrel = services.barrel()
    for i in range(9):
        fitter.put("Hall", "barrel", barrel, 0.95 + 0.68 * (i % 3), 3.4 + 0.68 * (i // 3))
    for i in range(4):
        _stocked_rack(fitter, "Hall", (4.6 + 1.75 * i, 0.32), 1.7, 0.6, rng)
    for i in range(3):
        fitter.put("Hall", "cabinet", desks.cabinet(1.2, 0.5, 1.9), 0.32, 6.6 + 1.4 * i, WEST_WALL)
    fitter.put("Hall", "work bench", desks.office_desk(2.0, 0.8), 11.98, 10.6, EAST_WALL)
    fitter.put("Hall", "stool", seats.stool(), 10.7, 10.6, EAST_WALL)


def _stocked_rack(
    fitter: Fitter, room: str, at_m: tuple[float, float], width_m: float, depth_m: float, rng: np.random.Generator
) -> None:
    """A case with three boards and cartons on every level, its back to a wall in the south."""
    fitter.put(room, "rack", furniture.shelf(width_m, depth_m, 2.2, n_boards=3), *at_m, SOUTH_WALL)
    for level in range(4):
        load = services.cartons(width_m - 0.2, depth_m - 0.1, rng, n=round(3 * width_m))
        x, y = at_m
        fitter.put(room, "cartons", load, x, y + 0.06, SOUTH_WALL, lift_m=0.0301 + 0.5425 * level)


def _furnish_plant(fitter: Fitter) -> None:
    appliance = "IfcUnitaryEquipment"
    for x in (2.0, 4.5):
        fitter.put("Plant room", "air handler", furniture.block(1.6, 1.4, 1.75), x, 19.2, kind=appliance)
    fitter.put("Plant room", "tank", services.boiler(0.45, 1.7), 1.0, 15.2, kind="IfcTank")
    for i in range(2):
        fitter.put("Plant room", "pump", services.pump(), 5.9, 15.4 + 1.0 * i, EAST_WALL, kind="IfcPump")
    room = "Boiler room"
    for i in range(2):
        tank = services.boiler(0.55, 2.0, n_sides=64)
        fitter.put(room, "boiler", tank, 18.8, 1.4 + 1.6 * i, EAST_WALL, kind="IfcBoiler")
    for i in range(3):
        fitter.put(room, "pump", services.pump(n_sides=24), 15.4 + 1.0 * i, 5.48, NORTH_WALL, kind="IfcPump")


def _furnish_small_rooms(fitter: Fitter, rng: np.random.Generator) -> None:
    for i in range(4):
        fitter.put("Electrical room", "panel", desks.cabinet(0.8, 0.5, 2.1, n_doors=1), 15.6 + 0.85 * i, 8.48)
    for store in ("Store 1", "Store 2", "Store 3"):
        low = next(y for name, y, _, _ in _EAST_ROOMS if name == store)
        for i in range(3):
            _stocked_rack(fitter, store, (15.5 + 1.3 * i, low + 0.02), 1.2, 0.4, rng)
        fitter.put(store, "cartons", services.cartons(1.6, 0.6, rng), 19.68, low + 1.5, EAST_WALL)
    sanitary = "IfcSanitaryTerminal"
    fitter.put("Shower", "toilet", services.toilet(), 19.0, 18.28, NORTH_WALL, kind=sanitary)
    for i in range(2):
        fitter.put("Shower", "washbasin", services.washbasin(), 16.6 + 0.8 * i, 18.28, NORTH_WALL, kind=sanitary)
    for i in range(5):
        for x, wall_turn in ((9.17, WEST_WALL), (11.98, EAST_WALL)):
            rack = desks.bookshelf(1.1, 0.35, 2.2, rng, n_boards=5, thick_m=(0.065, 0.085))
            if not (wall_turn == EAST_WALL and i == 2):  # the door
                fitter.put("Archive", "shelf", rack, x, 14.9 + 1.2 * i, wall_turn)


def _hang_lamps(fitter: Fitter) -> None:
    lamp = services.louvre_lamp(1.5, 0.25, n_blades=6)
    for room in _rooms():
        if room.name in ("Shaft", "Stair"):
            continue
        turn = 90.0 if room.name in ("Corridor", "Archive") else 0.0  # along the narrow ones
        for _, _, x, y in grid_spots(room, 4.0):
            fitter.put(room.name, "lamp", lamp, x, y, turn, kind=_LAMP, from_ceiling=True)
