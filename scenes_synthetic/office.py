"""The paper's `office`: 16 x 49 m, 8 m high, 2.7 million triangles (Lopez et al. 2023, Fig. 10c).

Two storeys alike, x to the east, y to the north, densely furnished. From the south:

    open office, 48 places | toilets, stairs, kitchen | six offices on a corridor | open office, 36 places
"""

from __future__ import annotations

import numpy as np

from scenes_synthetic import furnishing_desks as desks
from scenes_synthetic import furnishing_seats as seats
from scenes_synthetic import furnishing_services as services
from scenes_synthetic import furniture
from scenes_synthetic.building import Opening, flat_roof, parapet, slab, stairs, wall
from scenes_synthetic.model import Hole, Level, Part, Room, SyntheticScene
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

_SIZE_M = (16.0, 49.0)
_OUTER_M, _SLAB_M, _RISE_M, _CLEAR_M = 0.3, 0.3, 3.6, 3.2
_N_STOREYS = 2
_CELL_STARTS = (24.15, 28.15, 32.15)
_STAIR_HOLE = ((6.55, 18.6), (7.85, 22.7))
_ISLANDS_X = (3.3, 12.7)
_ROWS_Y = {"south": (2.4, 5.8, 9.2, 12.6), "north": (38.9, 42.3, 45.7)}
_PLACE_M = 1.65
_SANITARY, _LAMP, _HEATER = "IfcSanitaryTerminal", "IfcLightFixture", "IfcSpaceHeater"
_OUTLET, _SPRINKLER = "IfcAirTerminal", "IfcFireSuppressionTerminal"


def build(*, seed: int = 0) -> SyntheticScene:
    """Generate the office. The seed turns chairs, fills shelves and chooses who has a plant, a lamp or a mug."""
    rng = np.random.default_rng(seed)
    rooms = [room for storey in range(_N_STOREYS) for room in _rooms(storey)]
    fabric = [*_slabs(), *(part for storey in range(_N_STOREYS) for part in _walls(storey))]
    swings = _swings(rng)
    fitter = Fitter(rooms)
    pieces = _Pieces(rng)
    for storey in range(_N_STOREYS):
        _open_offices(fitter, pieces, storey, rng)
        _cells(fitter, pieces, storey, rng)
        _core(fitter, pieces, storey)
        _ceilings(fitter, pieces, [room for room in rooms if room.storey == storey])
    runs = [part for storey in range(_N_STOREYS) for part in _runs(storey)]
    return finished(
        "office",
        levels=[Level("Ground floor", 0.0), Level("Upper floor", _RISE_M)],
        rooms=rooms,
        fabric=fabric,
        swings=swings,
        others=[*_stairs(), *runs, *fitter.parts],
        extents_m=[[0.0, 0.0, -_SLAB_M], [*_SIZE_M, 7.7]],
    )


def _foot(storey: int) -> float:
    return round(storey * _RISE_M, 6)


def _rooms(storey: int) -> list[Room]:
    spans = {
        "Open office south": ((0.3, 0.3), (15.7, 16.0)),
        "Women": ((0.3, 16.15), (6.35, 20.0)),
        "Men": ((0.3, 20.15), (6.35, 24.0)),
        "Landing": ((6.5, 16.15), (9.5, 24.0)),
        "Kitchen": ((9.65, 16.15), (15.7, 24.0)),
        "Corridor": ((7.1, 24.15), (8.9, 36.0)),
        **{f"Office W{i + 1}": ((0.3, y), (6.95, round(y + 3.85, 6))) for i, y in enumerate(_CELL_STARTS)},
        **{f"Office E{i + 1}": ((9.05, y), (15.7, round(y + 3.85, 6))) for i, y in enumerate(_CELL_STARTS)},
        "Open office north": ((0.3, 36.15), (15.7, 48.7)),
    }
    return [
        rectangle_room(f"{name} {storey}", storey, low, high, _foot(storey), _CLEAR_M)
        for name, (low, high) in spans.items()
    ]


def _slabs() -> list[Part]:
    width, depth = _SIZE_M
    hole = Hole("Stair opening", (*_STAIR_HOLE[0], _CLEAR_M), (*_STAIR_HOLE[1], _RISE_M))
    return [
        slab("Base slab", 0, (0.0, 0.0, -_SLAB_M), (width, depth, 0.0), lowest=True),
        slab("Upper slab", 1, (0.0, 0.0, _CLEAR_M), (width, depth, _RISE_M), [hole], lowest=False),
        flat_roof("Roof", 1, (0.0, 0.0, 6.8), (width, depth, 7.1)),
        parapet("Parapet", 1, (0.0, 0.0, 7.1), (width, depth, 7.7), 0.25),
    ]


def _facade(storey: int) -> dict[str, list[Opening]]:
    long_side = (0.9, 3.9, 6.9, 9.9, 12.9, 24.95, 28.95, 32.95, 37.0, 40.0, 43.0, 46.0)
    sides: dict[str, list[Opening]] = {}
    for side in ("west", "east"):
        sides[side] = [Opening(f"Window {storey} {side} {i + 1}", y, 2.2, 1.7, 0.9) for i, y in enumerate(long_side)]
    for y, what in ((17.6, "women"), (21.6, "men")):
        sides["west"].append(Opening(f"Window {storey} {what}", y, 1.0, 0.7, 1.9))
    sides["east"].append(Opening(f"Window {storey} kitchen", 18.6, 3.2, 1.4, 1.2))
    short_side = (0.9, 4.1, 9.7, 12.9)
    for side in ("south", "north"):
        sides[side] = [Opening(f"Window {storey} {side} {i + 1}", x, 2.2, 1.7, 0.9) for i, x in enumerate(short_side)]
    if storey == 0:
        sides["south"].append(Opening("Door front", 7.0, 2.0, 2.4))
    return sides


def _walls(storey: int) -> list[Part]:
    foot, top = _foot(storey), round(_foot(storey) + _CLEAR_M, 6)

    def inner(name: str, low: tuple[float, float], high: tuple[float, float], *openings: Opening) -> Part:
        return wall(f"Wall {name} {storey}", storey, (*low, foot), (*high, top), openings)

    def cell_doors(side: str) -> list[Opening]:
        return [
            Opening(f"Door {side}{i + 1} {storey}", round(y + 0.4, 6), 0.9, 2.1) for i, y in enumerate(_CELL_STARTS)
        ]

    toilet_doors = [Opening(f"Door women {storey}", 16.3, 0.9, 2.1), Opening(f"Door men {storey}", 22.9, 0.9, 2.1)]
    partitions = [
        inner(f"between offices {side}{i + 1}", (x0, round(y - 0.15, 6)), (x1, y))
        for side, x0, x1 in (("W", 0.3, 6.95), ("E", 9.05, 15.7))
        for i, y in enumerate(_CELL_STARTS[1:])
    ]
    return [
        *outer_walls(("Ground floor", "Upper floor")[storey], storey, _SIZE_M, foot, top, _OUTER_M, _facade(storey)),
        inner("core south", (0.3, 16.0), (15.7, 16.15), Opening(f"Doorway south {storey}", 7.9, 1.4, 2.4)),
        inner("core north", (0.3, 24.0), (15.7, 24.15), Opening(f"Doorway middle {storey}", 7.6, 1.2, 2.4)),
        inner("offices north", (0.3, 36.0), (15.7, 36.15), Opening(f"Doorway north {storey}", 7.4, 1.2, 2.4)),
        inner("toilets east", (6.35, 16.15), (6.5, 24.0), *toilet_doors),
        inner("between toilets", (0.3, 20.0), (6.35, 20.15)),
        inner("kitchen west", (9.5, 16.15), (9.65, 24.0), Opening(f"Doorway kitchen {storey}", 20.5, 1.6, 2.3)),
        inner("corridor west", (6.95, 24.15), (7.1, 36.0), *cell_doors("W")),
        inner("corridor east", (8.9, 24.15), (9.05, 36.0), *cell_doors("E")),
        *partitions,
    ]


def _swings(rng: np.random.Generator) -> dict[str, tuple[str, str, float]]:
    swings = {"Door front": ("+y", "left", 0.0)}
    for storey in range(_N_STOREYS):
        swings[f"Door women {storey}"] = swings[f"Door men {storey}"] = ("-x", "left", 0.0)
        for i in range(3):
            swings[f"Door W{i + 1} {storey}"] = ("-x", "left", float(rng.integers(60, 91)))
            swings[f"Door E{i + 1} {storey}"] = ("+x", "right", float(rng.integers(60, 91)))
    return swings


def _stairs() -> list[Part]:
    (x0, y0), (x1, y1) = _STAIR_HOLE
    return [
        stairs("Stairs", 0, foot_m=(6.6, 17.3, 0.0), width_m=1.2, rise_m=_RISE_M, n_risers=21, going_m=0.27),
        services.stair_rail(
            "Stair rail", 0, (7.74, 17.3, 0.0), going_m=0.27, riser_m=_RISE_M / 21, n_treads=20, n_sides=10
        ),
        services.round_railing("Railing side", 1, (x1 + 0.06, y0, _RISE_M), (x1 + 0.06, y1, _RISE_M), n_sides=10),
        services.round_railing("Railing end", 1, (x0, y0 - 0.06, _RISE_M), (x1, y0 - 0.06, _RISE_M), n_sides=10),
    ]


def _runs(storey: int) -> list[Part]:
    """Build ducts along both open offices and sprinkler pipes over all of it, below the ceiling."""
    z = round(_foot(storey) + 2.85, 6)
    parts = []
    for end, low, high in (("south", 1.2, 15.8), ("north", 36.4, 47.8)):
        path = [(6.6, low, z), (6.6, high, z)] if end == "south" else [(6.6, high, z), (6.6, low, z)]
        parts.append(services.duct(f"Duct {end} {storey}", storey, path, 0.5, 0.3))
        for i, x in enumerate((2.0, 9.4, 14.0)):
            feed = [(x, low, z + 0.1), (x, high, z + 0.1)]
            parts.append(services.pipe_run(f"Sprinkler pipe {end} {i + 1} {storey}", storey, feed, 0.03))
    spots = [(x, y) for x in (6.1, 9.9) for y in (4.1, 7.5, 10.9, 40.6, 44.0)]
    for i, (x, y) in enumerate(spots):
        parts.append(services.column(f"Column {i + 1} {storey}", storey, (x, y, _foot(storey)), 0.2, _CLEAR_M))
    return parts


class _Pieces:
    """Furniture that is the same wherever it stands, made once."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.chair = seats.swivel_chair(n_sides=10)
        self.visitor = seats.turned_chair(n_sides=10)
        self.desk = desks.office_desk(n_sides=10)
        self.computers = [desks.computer(n_screens=n) for n in (1, 2)]
        self.pedestal = desks.pedestal(n_sides=6)
        self.lamp = desks.desk_lamp()
        self.mug = desks.mug(n_sides=16)
        self.bin = desks.waste_bin()
        self.shelves = [desks.bookshelf(1.0, 0.35, 2.0, rng, n_boards=4) for _ in range(6)]
        self.cabinet = desks.cabinet(1.2, 0.45, 1.1)
        self.table = desks.round_table(0.6, n_sides=48)
        self.sofa = seats.armchair(2.0)
        self.armchair = seats.armchair()
        self.plants = [desks.plant(1.6, rng) for _ in range(4)]
        self.radiator = services.radiator(1.6)
        self.louvre = services.louvre_lamp(n_blades=9)
        self.grille = services.grille()
        self.sprinkler = services.sprinkler()
        self.pendant = services.pendant_lamp()
        self.toilet, self.washbasin, self.urinal = services.toilet(), services.washbasin(), services.urinal()
        self.stool = seats.stool()


def _work_place(
    fitter: Fitter, pieces: _Pieces, room: str, x_m: float, y_m: float, rng: np.random.Generator, *, north: bool
) -> None:
    """A desk whose back's middle is at (x, y), with all that belongs to it; `north`: one who sits there looks north."""
    turn, sign = (NORTH_WALL, 1.0) if north else (SOUTH_WALL, -1.0)
    fitter.put(room, "desk", pieces.desk, x_m, y_m, turn)
    fitter.put(room, "pedestal", pieces.pedestal, x_m + sign * 0.32, y_m - sign * 0.12, turn)
    screens = pieces.computers[int(rng.random() < 0.75)]
    fitter.put(room, "computer", screens, x_m, y_m - sign * 0.04, turn, lift_m=0.7401)
    away = 1.22 + float(rng.integers(0, 16)) / 100
    seat_turn = turn + 180.0 + float(rng.integers(-35, 36))
    fitter.put(room, "swivel chair", pieces.chair, x_m - sign * 0.3, y_m - sign * away, seat_turn % 360.0)
    if rng.random() < 0.6:
        fitter.put(room, "desk lamp", pieces.lamp, x_m - sign * 0.68, y_m - sign * 0.05, turn, lift_m=0.7401)
    if rng.random() < 0.7:
        at = (x_m + sign * 0.55, y_m - sign * (0.55 + float(rng.integers(0, 10)) / 100))
        fitter.put(room, "mug", pieces.mug, *at, float(rng.integers(0, 360)), lift_m=0.7401)
    if rng.random() < 0.5:
        fitter.put(room, "bin", pieces.bin, x_m - sign * 0.55, y_m - sign * 0.15, turn)


def _open_offices(fitter: Fitter, pieces: _Pieces, storey: int, rng: np.random.Generator) -> None:
    for end, rows in _ROWS_Y.items():
        room = f"Open office {end} {storey}"
        for y in rows:
            for middle in _ISLANDS_X:
                for i in (-1, 0, 1):
                    x = middle + _PLACE_M * i
                    _work_place(fitter, pieces, room, x, y - 0.015, rng, north=True)
                    _work_place(fitter, pieces, room, x, y + 0.015, rng, north=False)
            for side, turn in ((0.32, WEST_WALL), (15.68, EAST_WALL)):
                fitter.put(room, "radiator", pieces.radiator, side, y, turn, kind=_HEATER)
        _storage(fitter, pieces, room, end, rng)


def _storage(fitter: Fitter, pieces: _Pieces, room: str, end: str, rng: np.random.Generator) -> None:
    """Shelves along the inner wall, a lounge in the middle aisle, plants."""
    back, turn = (15.98, NORTH_WALL) if end == "south" else (36.17, SOUTH_WALL)
    for i in range(5):
        for start in (0.9, 10.4):
            shelf = pieces.shelves[int(rng.integers(len(pieces.shelves)))]
            fitter.put(room, "shelf", shelf, start + 1.05 * i, back, turn)
    middle = 7.4 if end == "south" else 42.0
    fitter.put(room, "sofa", pieces.sofa, 6.6, middle, WEST_WALL)
    fitter.put(room, "table", pieces.table, 8.2, middle)
    for i, dy in enumerate((-0.9, 0.9)):
        fitter.put(room, "armchair", pieces.armchair, 9.55, middle + dy, EAST_WALL)
        plant = pieces.plants[int(rng.integers(len(pieces.plants)))]
        fitter.put(room, "plant", plant, 6.9, middle + 2.1 * (2 * i - 1))
    for y in (middle - 4.4, middle + 4.4):
        fitter.put(room, "cabinet", pieces.cabinet, 6.35, y, WEST_WALL)
        fitter.put(room, "cabinet", pieces.cabinet, 9.65, y, EAST_WALL)


def _cells(fitter: Fitter, pieces: _Pieces, storey: int, rng: np.random.Generator) -> None:
    for side in "WE":
        for i, y in enumerate(_CELL_STARTS):
            room = f"Office {side}{i + 1} {storey}"
            desk_x, shelf_x, guest_x = (2.2, 5.6, 4.9) if side == "W" else (13.8, 10.4, 11.1)
            _work_place(fitter, pieces, room, desk_x, y + 1.95, rng, north=True)
            _work_place(fitter, pieces, room, desk_x, y + 1.98, rng, north=False)
            shelf = pieces.shelves[int(rng.integers(len(pieces.shelves)))]
            fitter.put(room, "shelf", shelf, shelf_x, y + 3.83, NORTH_WALL)
            fitter.put(room, "table", pieces.table, guest_x, y + 2.3)
            turns = [turn + float(rng.integers(-15, 16)) for turn in (55.0, 235.0)]
            fitter.put_round(room, "chair", pieces.visitor, (guest_x, y + 2.3), 0.9, turns)
            wall_x, turn = (0.32, WEST_WALL) if side == "W" else (15.68, EAST_WALL)
            fitter.put(room, "radiator", pieces.radiator, wall_x, y + 1.9, turn, kind=_HEATER)
            plant = pieces.plants[int(rng.integers(len(pieces.plants)))]
            fitter.put(room, "plant", plant, 0.75 if side == "W" else 15.25, y + 3.4)


def _core(fitter: Fitter, pieces: _Pieces, storey: int) -> None:
    for what, y in (("Women", 16.15), ("Men", 20.15)):
        room = f"{what} {storey}"
        n = 4 if what == "Women" else 2
        for i in range(n):
            fitter.put(room, "toilet", pieces.toilet, 0.9 + 1.0 * i, y + 3.83, NORTH_WALL, kind=_SANITARY)
            fitter.put(room, "screen", furniture.block(0.03, 1.5, 1.9, foot_m=0.15), 1.4 + i, y + 3.84, NORTH_WALL)
        for i in range(4 - n):
            fitter.put(room, "urinal", pieces.urinal, 3.1 + 0.8 * i, y + 3.84, NORTH_WALL, kind=_SANITARY)
        for i in range(3):
            fitter.put(room, "washbasin", pieces.washbasin, 1.2 + 0.9 * i, y + 0.01, SOUTH_WALL, kind=_SANITARY)
    room = f"Kitchen {storey}"
    fitter.put(room, "counter", furniture.kitchen_counter(3.6), 12.2, 23.98, NORTH_WALL)
    fitter.put(room, "refrigerator", furniture.block(0.7, 0.65, 1.9), 14.5, 23.98, kind="IfcElectricAppliance")
    for i in range(8):
        fitter.put(room, "mug", pieces.mug, 12.0 + 0.12 * i, 23.7, 40.0 * i, lift_m=0.9101)
    for x, y in ((11.6, 18.0), (14.0, 18.0), (12.8, 20.9)):
        fitter.put(room, "table", pieces.table, x, y)
        fitter.put_round(room, "chair", pieces.visitor, (x, y), 0.95, (45.0, 135.0, 225.0, 315.0))
        fitter.put(room, "pendant lamp", pieces.pendant, x, y, kind=_LAMP, from_ceiling=True)


def _ceilings(fitter: Fitter, pieces: _Pieces, rooms: list[Room]) -> None:
    """Lamps, air outlets and sprinklers on a grid of about three metres."""
    for room in rooms:
        plain = "Landing" not in room.name and "Kitchen" not in room.name
        for i, j, x, y in grid_spots(room, 3.0):
            if plain:
                fitter.put(room.name, "lamp", pieces.louvre, x, y, kind=_LAMP, from_ceiling=True)
            if plain and (i + j) % 2 == 0:
                fitter.put(room.name, "air outlet", pieces.grille, x, y + 0.75, kind=_OUTLET, from_ceiling=True)
            fitter.put(room.name, "sprinkler", pieces.sprinkler, x, y - 0.6, kind=_SPRINKLER, from_ceiling=True)
