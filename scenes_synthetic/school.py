r"""The paper's `school`: 44 x 32 m, 24 m high, 500 thousand triangles (Lopez et al. 2023, Fig. 10b).

Five storeys alike, x to the east, y to the north; the middle is open from the ground to the lantern on the roof.

    +----------+----------+----------+----------+
    | Class N1 | Class N2 | Class N3 | Class N4 |
    +---/--+---+-/--------+-/--------+-/-+------+
    |Staff /        Gallery              /      |
    +------+  stair +---------------+    | Libra|
    |Boys  /   ^    |     void      |    | ry   |
    +------+   |    |               |    |      |
    |Girls /   |    +---------------+    |      |
    +---\--+---+-\--------+-\--------+-\-+------+
    | Class S1 | Class S2 | Class S3 | Class S4 |
    +----------+----------+----------+----------+
"""

from __future__ import annotations

import numpy as np

from scenes_synthetic import furnishing_desks as desks
from scenes_synthetic import furnishing_seats as seats
from scenes_synthetic import furnishing_services as services
from scenes_synthetic import furniture
from scenes_synthetic.building import Opening, parapet, slab, stairs, wall
from scenes_synthetic.model import Hole, Level, Part, PiercedBox, Room, SyntheticScene
from scenes_synthetic.storeys import (
    EAST_WALL,
    NORTH_WALL,
    SOUTH_WALL,
    WEST_WALL,
    Fitter,
    finished,
    outer_walls,
    rectangle_room,
)
from scenes_synthetic.tessellated import rounded_box

_SIZE_M = (44.0, 32.0)
_OUTER_M, _INNER_M, _SLAB_M, _RISE_M, _CLEAR_M = 0.4, 0.2, 0.4, 4.4, 4.0
_N_STOREYS = 5
_ROOF_M = 21.6
VOID_M = ((14.0, 12.2), (32.0, 19.8))
"""The opening in the middle of all upper floors: lowest and highest (x, y)."""
_CLASS_STARTS = (0.4, 11.25, 22.1, 32.95)
_CLASS_M = 10.65
_STAIR_X, _STAIR_Y, _STAIR_WIDTH_M, _N_RISERS, _GOING_M = 9.0, 11.0, 1.6, 26, 0.28
_STAIR_HOLE = ((8.9, 13.0), (10.7, 18.0))
_SANITARY, _LAMP, _HEATER = "IfcSanitaryTerminal", "IfcLightFixture", "IfcSpaceHeater"


def build(*, seed: int = 0) -> SyntheticScene:
    """Generate the school. The seed draws what rooms are used for, where chairs stand and how far doors are open."""
    rng = np.random.default_rng(seed)
    rooms = [room for storey in range(_N_STOREYS) for room in _rooms(storey)]
    fabric = [*_slabs(), *(part for storey in range(_N_STOREYS) for part in _walls(storey)), *_lantern()]
    swings = _swings(rng)
    fitter = Fitter(rooms)
    pieces = _Pieces(rng)
    for storey in range(_N_STOREYS):
        _furnish(fitter, pieces, storey, rng)
    fixed = [
        *(part for storey in range(_N_STOREYS - 1) for part in _flights(storey)),
        *(part for storey in range(1, _N_STOREYS) for part in _railings(storey)),
        *(part for storey in range(_N_STOREYS) for part in _columns(storey)),
    ]
    return finished(
        "school",
        levels=[Level(_storey_name(s), _foot(s)) for s in range(_N_STOREYS)],
        rooms=rooms,
        fabric=fabric,
        swings=swings,
        others=[*fixed, *fitter.parts],
        extents_m=[[0.0, 0.0, -_SLAB_M], [*_SIZE_M, 23.6]],
    )


def _storey_name(storey: int) -> str:
    return "Ground floor" if storey == 0 else f"Floor {storey}"


def _foot(storey: int) -> float:
    return round(storey * _RISE_M, 6)


def _class_names(storey: int) -> list[str]:
    return [f"Class {storey}{side}{i + 1}" for side in "SN" for i in range(4)]


def _rooms(storey: int) -> list[Room]:
    spans = {}
    for name in _class_names(storey):
        x = _CLASS_STARTS[int(name[-1]) - 1]
        y = 0.4 if "S" in name else 23.6
        spans[name] = ((x, y), (round(x + _CLASS_M, 6), y + 8.0))
    spans[f"Girls {storey}"] = ((0.4, 8.6), (8.0, 12.2))
    spans[f"Boys {storey}"] = ((0.4, 12.4), (8.0, 16.0))
    spans[f"Staff room {storey}"] = ((0.4, 16.2), (8.0, 23.4))
    spans[f"Gallery {storey}"] = ((8.2, 8.6), (35.8, 23.4))
    spans[f"Library {storey}" if storey else "Foyer"] = ((36.0, 8.6), (43.6, 23.4))
    return [rectangle_room(name, storey, low, high, _foot(storey), _CLEAR_M) for name, (low, high) in spans.items()]


def _slabs() -> list[Part]:
    parts = [slab("Base slab", 0, (0.0, 0.0, -_SLAB_M), (*_SIZE_M, 0.0), lowest=True)]
    for storey in range(1, _N_STOREYS):
        top = _foot(storey)
        low = round(top - _SLAB_M, 6)
        holes = [
            Hole(f"{what} {storey}", (*span[0], low), (*span[1], top))
            for what, span in (("Void", VOID_M), ("Stair opening", _STAIR_HOLE))
        ]
        parts.append(slab(f"Slab {storey}", storey, (0.0, 0.0, low), (*_SIZE_M, top), holes, lowest=False))
    top = round(_ROOF_M + _SLAB_M, 6)
    recipe = PiercedBox(
        (0.0, 0.0, _ROOF_M), (*_SIZE_M, top), (Hole("Skylight", (*VOID_M[0], _ROOF_M), (*VOID_M[1], top)),)
    )
    roof = Part("Roof", "IfcRoof", _N_STOREYS - 1, recipe.solid(), recipe, predefined_type="FLAT_ROOF")
    return [*parts, roof, parapet("Parapet", _N_STOREYS - 1, (0.0, 0.0, top), (*_SIZE_M, 22.6), 0.3)]


def _lantern() -> list[Part]:
    """Build the raised roof over the void, with windows on its long sides."""
    (x0, y0), (x1, y1) = VOID_M
    foot, top, last, t = 22.0, 23.3, _N_STOREYS - 1, 0.2
    parts = []
    for side, y in (("south", round(y0 - t, 6)), ("north", y1)):
        openings = [Opening(f"Window lantern {side} {i + 1}", x0 + 0.6 + 2.9 * i, 2.3, 0.8, 0.3) for i in range(6)]
        low, high = (x0 - t, y, foot), (x1 + t, round(y + t, 6), top)
        parts.append(wall(f"Lantern wall {side}", last, low, high, openings))
    for side, x in (("west", x0 - t), ("east", x1)):
        parts.append(wall(f"Lantern wall {side}", last, (x, y0, foot), (round(x + t, 6), y1, top)))
    recipe = PiercedBox((x0 - 0.5, y0 - 0.5, top), (x1 + 0.5, y1 + 0.5, 23.6))
    return [*parts, Part("Lantern roof", "IfcRoof", last, recipe.solid(), recipe, predefined_type="FLAT_ROOF")]


def _facade(storey: int) -> dict[str, list[Opening]]:
    """Openings of the outer walls, by side."""
    facade: dict[str, list[Opening]] = {"south": [], "north": [], "west": [], "east": []}
    for side, key in (("south", "S"), ("north", "N")):
        for i, start in enumerate(_CLASS_STARTS):
            for j in range(3):
                name = f"Window {storey}{key}{i + 1} {j + 1}"
                facade[side].append(Opening(name, round(start + 0.7 + 3.4 * j, 6), 2.4, 2.2, 0.9))
    for y, what in ((9.9, "girls"), (13.7, "boys")):
        facade["west"].append(Opening(f"Window {storey} {what}", y, 1.0, 0.8, 2.2))
    facade["west"].append(Opening(f"Window {storey} staff", 18.5, 2.4, 2.2, 0.9))
    if storey:
        facade["east"] = [Opening(f"Window {storey} library {i + 1}", 9.6 + 3.4 * i, 2.4, 2.2, 0.9) for i in range(4)]
    else:
        facade["east"] = [Opening("Door front", 15.0, 2.0, 2.4)]
        facade["east"] += [Opening(f"Window foyer {i + 1}", 10.0 + 8.6 * i, 3.2, 2.6, 0.3) for i in range(2)]
    return facade


def _walls(storey: int) -> list[Part]:
    foot, top = _foot(storey), round(_foot(storey) + _CLEAR_M, 6)
    walls = outer_walls(_storey_name(storey), storey, _SIZE_M, foot, top, _OUTER_M, _facade(storey))
    for key, y in (("S", 8.4), ("N", 23.4)):
        openings = [
            Opening(f"Door class {storey}{key}{i + 1}", round(start + shift, 6), 1.0, 2.1)
            for i, (start, shift) in enumerate(zip(_CLASS_STARTS, (9.2, 0.8, 0.8, 0.8), strict=True))
        ]
        walls.append(
            wall(f"Wall corridor {storey}{key}", storey, (0.4, y, foot), (43.6, round(y + 0.2, 6), top), openings)
        )
        low_y, high_y = (0.4, 8.4) if key == "S" else (23.6, 31.6)
        for i, start in enumerate(_CLASS_STARTS[1:]):
            x = round(start - _INNER_M, 6)
            walls.append(wall(f"Wall class {storey}{key}{i + 1}", storey, (x, low_y, foot), (start, high_y, top)))
    west = [
        Opening(f"Door girls {storey}", 10.8, 1.0, 2.1),
        Opening(f"Door boys {storey}", 14.6, 1.0, 2.1),
        Opening(f"Door staff {storey}", 21.9, 1.0, 2.1),
    ]
    east = [Opening(f"Doorway east {storey}", 14.0, 4.0, 2.8)]
    return [
        *walls,
        wall(f"Wall west zone {storey}", storey, (8.0, 8.6, foot), (8.2, 23.4, top), west),
        wall(f"Wall east zone {storey}", storey, (35.8, 8.6, foot), (36.0, 23.4, top), east),
        wall(f"Wall girls {storey}", storey, (0.4, 12.2, foot), (8.0, 12.4, top)),
        wall(f"Wall boys {storey}", storey, (0.4, 16.0, foot), (8.0, 16.2, top)),
    ]


def _swings(rng: np.random.Generator) -> dict[str, tuple[str, str, float]]:
    """Class room doors stand open by chance, most of them wide; toilets, staff room and front door are shut or ajar."""
    swings = {"Door front": ("+x", "left", 0.0)}
    for storey in range(_N_STOREYS):
        for name in _class_names(storey):
            open_deg = float(rng.integers(70, 91)) if rng.random() < 0.8 else 0.0
            towards, hinge = ("-y", "left") if "S" in name else ("+y", "right")
            swings[f"Door class {name[6:]}"] = (towards, hinge, open_deg)
        for name in ("girls", "boys", "staff"):
            swings[f"Door {name} {storey}"] = ("-x", "left", float(rng.integers(0, 80)))
    return swings


def _flights(storey: int) -> list[Part]:
    """Build the stairs to the next storey, with a hand rail on either side."""
    foot, riser = _foot(storey), _RISE_M / _N_RISERS
    at = (_STAIR_X, _STAIR_Y, foot)
    size = {"width_m": _STAIR_WIDTH_M, "rise_m": _RISE_M, "going_m": _GOING_M}
    rails = [
        services.stair_rail(
            f"Stair rail {storey} {side}",
            storey,
            (x, _STAIR_Y, foot),
            going_m=_GOING_M,
            riser_m=riser,
            n_treads=_N_RISERS - 1,
        )
        for side, x in (("west", _STAIR_X + 0.06), ("east", _STAIR_X + _STAIR_WIDTH_M - 0.06))
    ]
    return [stairs(f"Stairs {storey}", storey, foot_m=at, n_risers=_N_RISERS, **size), *rails]


def _railings(storey: int) -> list[Part]:
    """Build railings round the void and the stairs' opening in an upper floor."""
    (x0, y0), (x1, y1) = VOID_M
    (hx0, hy0), (hx1, hy1) = _STAIR_HOLE
    gap, z = 0.08, _foot(storey)
    runs = {
        "void south": ((x0, y0 - gap), (x1, y0 - gap)),
        "void north": ((x0, y1 + gap), (x1, y1 + gap)),
        "void west": ((x0 - gap, y0), (x0 - gap, y1)),
        "void east": ((x1 + gap, y0), (x1 + gap, y1)),
        "stair east": ((hx1 + gap, hy0), (hx1 + gap, hy1)),
        "stair west": ((hx0 - gap, hy0), (hx0 - gap, hy1)),
    }
    if storey == _N_STOREYS - 1:  # below, the next flight begins there
        runs["stair south"] = ((hx0, hy0 - gap), (hx1, hy0 - gap))
    return [
        services.round_railing(f"Railing {name} {storey}", storey, (*a, z), (*b, z), n_sides=4)
        for name, (a, b) in runs.items()
    ]


def _columns(storey: int) -> list[Part]:
    """Build columns round the void."""
    spots = [(x, y) for x in (14.0 - 0.6, 23.0, 32.0 + 0.6) for y in (12.2 - 0.6, 19.8 + 0.6)]
    return [
        services.column(f"Column {storey}.{i + 1}", storey, (x, y, _foot(storey)), 0.22, _CLEAR_M, n_sides=24)
        for i, (x, y) in enumerate(spots)
    ]


class _Pieces:
    """Furniture that is the same wherever it stands, made once."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.chair = seats.school_chair(n_sides=4)
        self.desk = desks.school_desk(n_sides=4)
        self.teacher = desks.school_desk(1.6, 0.75, n_sides=6)
        self.board = desks.board(4.0)
        self.cabinet = desks.cabinet(1.2, 0.45, 1.9, n_sides=4)
        self.shelf = desks.bookshelf(1.2, 0.32, 2.0, rng, n_boards=4, thick_m=(0.08, 0.11), n_spine=0)
        self.table = desks.round_table(0.6, n_sides=16)
        self.sofa = seats.armchair(1.9, n_corner=1)
        self.lamp = services.louvre_lamp(1.5, 0.3, n_blades=1)
        self.pendant = services.pendant_lamp(1.2, n_sides=8)
        self.radiator = services.panel_radiator(2.2)
        self.toilet = services.toilet(n_sides=10)
        self.washbasin = services.washbasin(n_sides=10)
        self.urinal = services.urinal(n_sides=12)
        self.mat = rounded_box((-1.0, -1.2, 0.0), (1.0, 0.0, 0.08), 0.05, n_corner=2, n_edge=2)
        self.bench = furniture.table(2.0, 0.32, 0.42)
        self.plant = desks.plant(1.7, rng, n_leaves=40, n_sides=4)


def _furnish(fitter: Fitter, pieces: _Pieces, storey: int, rng: np.random.Generator) -> None:
    for name in _class_names(storey):
        x, y = _CLASS_STARTS[int(name[-1]) - 1], 0.4 if "S" in name else 23.6
        _heat_and_light(fitter, pieces, name, x, y)
        if storey == 0 and "N" in name:
            _exercise_room(fitter, pieces, name, x, y)
        elif rng.random() < 0.85:
            _class_room(fitter, pieces, name, x, y, rng)
        else:
            _seminar_room(fitter, pieces, name, x, y, rng)
    _toilets(fitter, pieces, storey)
    _staff_room(fitter, pieces, f"Staff room {storey}")
    _east_room(fitter, pieces, storey)
    gallery = f"Gallery {storey}"
    for x in (12.0, 17.0, 22.0, 27.0, 34.0):
        for y in (10.2, 21.8):
            fitter.put(gallery, "lamp", pieces.pendant, x, y, kind=_LAMP, from_ceiling=True)
    for x in (18.0, 28.0):
        fitter.put(gallery, "sofa", pieces.sofa, x, 23.36, NORTH_WALL)
    fitter.put(gallery, "plant", pieces.plant, 35.2, 9.3)


def _heat_and_light(fitter: Fitter, pieces: _Pieces, name: str, x_m: float, y_m: float) -> None:
    south = "S" in name
    for j in range(3):
        at = (x_m + 1.9 + 3.4 * j, y_m + (0.02 if south else 7.98))
        fitter.put(name, "radiator", pieces.radiator, *at, SOUTH_WALL if south else NORTH_WALL, kind=_HEATER)
    for across in (3.2, 7.4):
        for row in (2.2, 5.8):
            fitter.put(name, "lamp", pieces.lamp, x_m + across, y_m + row, kind=_LAMP, from_ceiling=True)


def _class_room(fitter: Fitter, pieces: _Pieces, name: str, x_m: float, y_m: float, rng: np.random.Generator) -> None:
    """Three rows of three tables for two, all looking to the board in the west."""
    fitter.put(name, "board", pieces.board, x_m + 0.001, y_m + 4.0, WEST_WALL)
    fitter.put(name, "teacher's desk", pieces.teacher, x_m + 2.1, y_m + 3.2, EAST_WALL)
    fitter.put(name, "teacher's chair", pieces.chair, x_m + 0.85, y_m + 3.2, WEST_WALL)
    for row in range(3):
        for across in range(3):
            x, y = x_m + 3.5 + 1.9 * row, y_m + 2.0 + 2.0 * across
            fitter.put(name, "table", pieces.desk, x, y, WEST_WALL)
            for side in (-0.32, 0.32):
                dx, dy = rng.integers(-4, 5, size=2) / 100
                turn = EAST_WALL + float(rng.integers(-10, 11))
                fitter.put(name, "chair", pieces.chair, x + 0.97 + float(dx), y + side + float(dy), turn)
    for y in (3.2, 4.5):
        fitter.put(name, "cabinet", pieces.cabinet, x_m + _CLASS_M - 0.02, y_m + y, EAST_WALL)


def _exercise_room(fitter: Fitter, pieces: _Pieces, name: str, x_m: float, y_m: float) -> None:
    """Mats, benches along the wall, and room."""
    for i in range(3):
        fitter.put(name, "mat", pieces.mat, x_m + 3.0 + 2.4 * i, y_m + 4.6)
        fitter.put(name, "bench", pieces.bench, x_m + 3.0 + 2.4 * i, y_m + 0.4, SOUTH_WALL)


def _seminar_room(fitter: Fitter, pieces: _Pieces, name: str, x_m: float, y_m: float, rng: np.random.Generator) -> None:
    """Five round tables with four chairs each, and a shelf."""
    fitter.put(name, "board", pieces.board, x_m + 0.001, y_m + 4.0, WEST_WALL)
    for x, y in ((2.6, 3.0), (5.3, 2.4), (8.0, 3.0), (5.3, 5.4), (7.9, 5.4)):
        fitter.put(name, "round table", pieces.table, x_m + x, y_m + y)
        turns = [90.0 * i + float(rng.integers(-10, 11)) for i in range(4)]
        fitter.put_round(name, "chair", pieces.chair, (x_m + x, y_m + y), 0.98, turns)
    fitter.put(name, "shelf", pieces.shelf, x_m + _CLASS_M - 0.02, y_m + 4.0, EAST_WALL)


def _toilets(fitter: Fitter, pieces: _Pieces, storey: int) -> None:
    for room, y in ((f"Girls {storey}", 8.6), (f"Boys {storey}", 12.4)):
        n = 4 if room.startswith("Girls") else 2
        for i in range(n):
            fitter.put(room, "toilet", pieces.toilet, 1.2 + 1.0 * i, y + 3.58, NORTH_WALL, kind=_SANITARY)
            screen = furniture.block(0.03, 1.5, 1.9, foot_m=0.15)
            fitter.put(room, "screen", screen, 1.7 + 1.0 * i, y + 3.59, NORTH_WALL)
        for i in range(4 - n):
            fitter.put(room, "urinal", pieces.urinal, 3.4 + 0.8 * i, y + 3.59, NORTH_WALL, kind=_SANITARY)
        for i in range(3):
            fitter.put(room, "washbasin", pieces.washbasin, 3.0 + 0.9 * i, y + 0.01, SOUTH_WALL, kind=_SANITARY)
        fitter.put(room, "lamp", pieces.lamp, 4.0, y + 1.8, kind=_LAMP, from_ceiling=True)


def _staff_room(fitter: Fitter, pieces: _Pieces, room: str) -> None:
    for y in (17.6, 20.6):
        fitter.put(room, "desk", pieces.teacher, 2.6, y, EAST_WALL)
        fitter.put(room, "chair", pieces.chair, 1.2, y, WEST_WALL)
        fitter.put(room, "lamp", pieces.lamp, 4.2, y, kind=_LAMP, from_ceiling=True)
    fitter.put(room, "table", pieces.table, 5.6, 19.0)
    fitter.put_round(room, "chair", pieces.chair, (5.6, 19.0), 0.98, (45.0, 135.0, 225.0, 315.0))
    for i in range(3):
        fitter.put(room, "shelf", pieces.shelf, 1.4 + 1.3 * i, 23.38, NORTH_WALL)


def _east_room(fitter: Fitter, pieces: _Pieces, storey: int) -> None:
    """A foyer with sofas on the ground; libraries above it."""
    if storey == 0:
        for y in (9.0, 23.0):
            turn = SOUTH_WALL if y < 16 else NORTH_WALL
            for x in (38.2, 41.2):
                fitter.put("Foyer", "sofa", pieces.sofa, x, 8.62 if y < 16 else 23.38, turn)
            fitter.put("Foyer", "plant", pieces.plant, 43.0, y + (0.3 if y < 16 else -0.3))
        return
    room = f"Library {storey}"
    for y, turn in ((8.62, SOUTH_WALL), (11.4, NORTH_WALL), (20.6, SOUTH_WALL), (23.38, NORTH_WALL)):
        for x in (38.6, 40.9):
            fitter.put(room, "shelf", pieces.shelf, x, y, turn)
    for x in (38.2, 41.4):
        fitter.put(room, "table", pieces.table, x, 16.0)
        fitter.put_round(room, "chair", pieces.chair, (x, 16.0), 0.98, (0.0, 90.0, 180.0, 270.0))
        fitter.put(room, "lamp", pieces.pendant, x, 16.0, kind=_LAMP, from_ceiling=True)
