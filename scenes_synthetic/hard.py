"""Buildings that are hard to survey: glass and mirrors, thin walls, doors, voids through storeys, a tunnel, a facade.

Copies of a scene that are hard to load are in `copies`. The seed is unused: nothing is left to chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from scenes_synthetic.building import Opening, door, flat_roof, parapet, railing, slab, stairs, wall, window
from scenes_synthetic.furniture import table
from scenes_synthetic.model import Hole, Level, Part, PiercedBox, Room, SyntheticScene, assemble
from scenes_synthetic.solids import Point, place, prism

_GROUND = Level("Ground floor", 0.0)
_WALL_M = _SLAB_M = 0.2
_HEIGHT_M = 2.7
_RISE_M, _CLEAR_M = 2.8, 2.55
"""From floor to floor, and from floor to ceiling, where there are several storeys."""
_GOING_M, _N_RISERS = 0.26, 15
_FLIGHT_M = (_N_RISERS - 1) * _GOING_M


def glass_and_mirror(*, seed: int = 0) -> SyntheticScene:
    """A room of 8 x 5 m with a glass wall across it, open at one end, and a mirror on its north wall.

    Glass and mirror are parts with a material: a scanner sees through the one, and by the other sees the room again
    where it is not. Files carry the material; `Truth.returns_nothing` names the parts.
    """
    del seed
    width, depth = 8.0, 5.0
    glass = _box("Glass wall", "IfcPlate", (4.0, 0.0, 0.0), (4.02, 3.6, _HEIGHT_M), material="glass")
    mirror = _box("Mirror", "IfcPlate", (1.0, 4.98, 0.5), (3.0, 4.99, 2.1), material="mirror")
    bench = Part("Bench", "IfcFurniture", 0, place(table(1.8, 0.5), (6.0, 2.0, 0.0)), room="Room")
    parts = [*_slabs(width, depth), *_shell(width, depth), glass, mirror, bench]
    found = _one_room("glass-and-mirror", parts, width, depth)
    return replace(found, truth=replace(found.truth, returns_nothing=("Glass wall", "Mirror")))


def thin_walls(*, seed: int = 0) -> SyntheticScene:
    """Three rooms of 3 x 4 m behind one another, parted by 10 mm of board and by 1 mm of sheet: 2 stations.

    Needed: the west face of the first partition is seen from west of it only, the east face of the second from east of
    it only. Enough, but for a tenth of a square metre on the partitions' edges: a station half a metre before either
    outer doorway sees its convex room and, through the doorway, the far half of the middle room and the far partition.
    """
    del seed
    width, depth = 9.011, 4.0
    first, second = (3.0, 3.01), (6.01, 6.011)
    partitions = [
        wall(name, 0, (low, 0.0, 0.0), (high, depth, _HEIGHT_M), [Opening(f"Doorway {name}", 1.5, 1.0, 2.1)])
        for name, (low, high) in (("Board", first), ("Sheet", second))
    ]
    spans = {"Room west": (0.0, first[0]), "Room middle": (first[1], second[0]), "Room east": (second[1], width)}
    rooms = [_rectangle(name, low, 0.0, high, depth) for name, (low, high) in spans.items()]
    parts = [*_slabs(width, depth), *_shell(width, depth), *partitions]
    stations = tuple((x, 2.0, 1.0) for x in (2.5, 6.511))
    found = _assemble("thin-walls", rooms, parts, width, depth)
    return replace(found, truth=replace(found.truth, n_stations=2, stations_m=stations))


def doors_open(*, seed: int = 0) -> SyntheticScene:
    """Three rooms of 3 x 3 m along a corridor; their doors stand open at right angles."""
    del seed
    return _doors("doors-open", 90.0)


def doors_shut(*, seed: int = 0) -> SyntheticScene:
    """The same with shut doors: no more than the gaps round the leaves, a centimetre, lets a beam through."""
    del seed
    return _doors("doors-shut", 0.0)


def _doors(name: str, open_deg: float) -> SyntheticScene:
    side, between, corridor, n_rooms = 3.0, 0.15, 1.6, 3
    width, inner = n_rooms * side + (n_rooms - 1) * between, round(corridor + between, 6)
    depth = inner + side
    starts = [round(i * (side + between), 6) for i in range(n_rooms)]
    openings = [Opening(f"Doorway {i}", round(start + 1.0, 6), 0.9, 2.1) for i, start in enumerate(starts, start=1)]
    long_wall = wall("Wall corridor", 0, (0.0, corridor, 0.0), (width, inner, _HEIGHT_M), openings)
    partitions = [
        wall(f"Partition {i}", 0, (round(start - between, 6), inner, 0.0), (start, depth, _HEIGHT_M))
        for i, start in enumerate(starts[1:], start=1)
    ]
    leaves = [
        door(f"Door {i}", 0, hole, towards="+y", hinge="right", open_deg=open_deg)
        for i, hole in enumerate(_holes(long_wall), start=1)
    ]
    rooms = [_rectangle(f"Room {i}", x, inner, round(x + side, 6), depth) for i, x in enumerate(starts, start=1)]
    rooms.append(_rectangle("Corridor", 0.0, 0.0, width, corridor))
    parts = [*_slabs(width, depth), *_shell(width, depth), long_wall, *partitions, *leaves]
    return _assemble(name, rooms, parts, width, depth)


def stairwell(*, seed: int = 0, n_storeys: int = 3) -> SyntheticScene:
    """A stairwell of 2.4 x 6 m: a flight from each storey to the next, all above one another."""
    del seed
    width, depth, foot_y = 2.4, 6.0, 1.2
    levels = [Level(f"Storey {i}", round(i * _RISE_M, 6)) for i in range(n_storeys)]
    parts = [*_storey_slabs(levels, width, depth, _stair_hole(1.2, foot_y, 1.2)), *_storey_walls(levels, width, depth)]
    for index, level in enumerate(levels[:-1]):
        above = levels[index + 1].elevation_m
        parts.append(_flight(f"Flight {index}", index, (1.22, foot_y, level.elevation_m), 1.16))
        end_y = foot_y + _FLIGHT_M
        parts.append(railing(f"Railing {index}", index + 1, (1.15, foot_y + 0.6, above), (1.15, end_y, above)))
    return _storeyed("stairwell", levels, parts, width, depth)


def double_height_hall(*, seed: int = 0) -> SyntheticScene:
    """A hall of 10 x 12 m, two storeys high, with a gallery along its north side and a flight up to it."""
    del seed
    width, depth, edge = 10.0, 12.0, 8.0
    levels = [_GROUND, Level("Gallery", _RISE_M)]
    top = _RISE_M + _CLEAR_M
    tall = [Opening(f"Window {i}", 1.0 + 2.2 * i, 1.2, 3.4, 0.9) for i in range(4)]
    parts = [
        slab("Ground slab", 0, (-_WALL_M, -_WALL_M, -_SLAB_M), (width + _WALL_M, depth + _WALL_M, 0.0), lowest=True),
        slab("Gallery slab", 1, (0.0, edge, _CLEAR_M), (width, depth, _RISE_M), lowest=False),
        *_shell(width, depth, height_m=top, windows=tall),
        flat_roof("Roof", 1, (-_WALL_M, -_WALL_M, top), (width + _WALL_M, depth + _WALL_M, top + _SLAB_M)),
        _flight("Flight", 0, (0.2, edge - _FLIGHT_M, 0.0), 1.2),
        railing("Railing", 1, (1.6, edge + 0.05, _RISE_M), (width - 0.05, edge + 0.05, _RISE_M)),
        *(_column(f"Column {i}", 0, (x, edge + 0.3), 0.0, _CLEAR_M) for i, x in enumerate((3.0, 7.0), start=1)),
    ]
    parts += [window(hole.name, 0, hole) for part in parts for hole in _holes(part)]
    rooms = [
        Room("Hall", 0, _corners(0.0, 0.0, width, edge), 0.0, top),
        Room("Gallery", 1, _corners(0.0, edge, width, depth), _RISE_M, _CLEAR_M),
    ]
    extents = [(-_WALL_M, -_WALL_M, -_SLAB_M), (width + _WALL_M, depth + _WALL_M, top + _SLAB_M)]
    found = assemble("double-height-hall", levels=levels, rooms=rooms, parts=parts, extents_m=extents)
    # Where hall and gallery meet there is no wall.
    open_m2 = {"Hall": width * top, "Gallery": width * _CLEAR_M}
    walls = {name: area - open_m2[name] for name, area in found.truth.wall_area_m2.items()}
    return replace(found, truth=replace(found.truth, wall_area_m2=walls))


def atrium(*, seed: int = 0, n_storeys: int = 3) -> SyntheticScene:
    """Galleries on three storeys round a void of 6 x 6 m, open to one another across it."""
    del seed
    side, low, high = 16.0, 5.0, 11.0
    levels = [Level(f"Storey {i}", round(i * _RISE_M, 6)) for i in range(n_storeys)]
    parts = [*_storey_slabs(levels, side, side, (low, low, high, high)), *_storey_walls(levels, side, side)]
    for index, level in enumerate(levels):
        z = level.elevation_m
        for corner, at in enumerate(((low, low), (high, low), (high, high), (low, high)), start=1):
            away = tuple(v - 0.4 if v == low else v + 0.4 for v in at)
            parts.append(_column(f"Column {index}.{corner}", index, (away[0], away[1]), z, z + _CLEAR_M))
        if index:
            parts += _railings_round(index, z, low - 0.1, high + 0.1)
    return _storeyed("atrium", levels, parts, side, side)


def tunnel(*, seed: int = 0, length_m: float = 80.0) -> SyntheticScene:
    """A tunnel of 6 m width under a smooth vault: scans can slide along it, as nothing but its ends fixes them.

    Every surface but the two portals is parallel to x, so shifting a scan along x leaves its points on the surface.
    """
    del seed
    radius, thick, n_sides = 3.0, 0.4, 16
    angles = [math.pi * k / n_sides for k in range(n_sides + 1)]
    outer = [(round((radius + thick) * math.cos(a), 6), round((radius + thick) * math.sin(a), 6)) for a in angles]
    inner = [(round(radius * math.cos(a), 6), round(radius * math.sin(a), 6)) for a in angles]
    vault = prism([*outer, *reversed(inner)], axis="x", low_m=0.0, high_m=length_m)
    reach = radius + thick
    parts = [
        slab("Floor", 0, (0.0, -reach, -_SLAB_M), (length_m, reach, 0.0), lowest=True),
        Part("Vault", "IfcWall", 0, vault),
        wall("Portal west", 0, (-_WALL_M, -reach, -_SLAB_M), (0.0, reach, reach)),
        wall("Portal east", 0, (length_m, -reach, -_SLAB_M), (length_m + _WALL_M, reach, reach)),
    ]
    room = Room("Tunnel", 0, _corners(0.0, -radius, length_m, radius), 0.0, radius)
    extents = [(-_WALL_M, -reach, -_SLAB_M), (length_m + _WALL_M, reach, reach)]
    found = assemble("tunnel", levels=[_GROUND], rooms=[room], parts=parts, extents_m=extents)
    # The vault's section is half a polygon of 2 n sides, not the room's rectangle.
    chord, triangle = 2 * math.sin(math.pi / n_sides / 2), math.sin(math.pi / n_sides) / 2
    area = n_sides * (chord * radius * length_m + 2 * triangle * radius**2)
    return replace(found, truth=replace(found.truth, wall_area_m2={"Tunnel": area}, slides_along=(1.0, 0.0, 0.0)))


def facade(*, seed: int = 0) -> SyntheticScene:
    """The front of a house of 12 x 6 m with windows and a shut door, and the ground before it, outdoors."""
    del seed
    width, deep, top = 12.0, 4.0, 6.0
    row = [Opening(f"Window {'lower' if sill < 3 else 'upper'} {i}", x, 1.3, 1.5, sill)
           for sill in (0.9, 3.8) for i, x in enumerate((1.0, 3.4, 7.4, 9.7), start=1)]  # fmt: skip
    entrance = Opening("Entrance", 5.4, 1.2, 2.3)
    front = wall("Facade", 0, (0.0, 0.0, 0.0), (width, 0.3, top), [*row, entrance])
    parts = [
        slab("Ground", 0, (-6.0, -12.0, -_SLAB_M), (width + 6.0, deep, 0.0), lowest=True),
        front,
        wall("Wall west", 0, (0.0, 0.3, 0.0), (0.3, deep, top)),
        wall("Wall east", 0, (width - 0.3, 0.3, 0.0), (width, deep, top)),
        wall("Wall north", 0, (0.3, deep - 0.3, 0.0), (width - 0.3, deep, top)),
        flat_roof("Roof", 0, (-0.3, -0.3, top), (width + 0.3, deep, top + 0.25)),
        parapet("Parapet", 0, (-0.3, -0.3, top + 0.25), (width + 0.3, deep, top + 0.6), 0.2),
        Part("Garden wall", "IfcWall", 0, (recipe := PiercedBox((-6.0, -8.0, 0.0), (-5.8, deep, 1.8))).solid(), recipe),
    ]
    for hole in _holes(front):
        if hole.name == "Entrance":
            parts.append(door("Entrance door", 0, hole, towards="-y", hinge="left", open_deg=0.0))
        else:
            parts.append(window(hole.name, 0, hole))
    extents = [(-6.0, -12.0, -_SLAB_M), (width + 6.0, deep, top + 0.6)]
    return assemble("facade", levels=[_GROUND], rooms=[], parts=parts, extents_m=extents)


# -------------------------------------------------------------------------------------------------- pieces
def _box(name: str, kind: str, low_m: Point, high_m: Point, *, material: str = "") -> Part:
    recipe = PiercedBox(low_m, high_m)
    return Part(name, kind, 0, recipe.solid(), recipe, material=material)


def _column(name: str, storey: int, at_m: tuple[float, float], low_m: float, high_m: float) -> Part:
    (x, y), half = at_m, 0.15
    recipe = PiercedBox((x - half, y - half, low_m), (x + half, y + half, round(high_m, 6)))
    return Part(name, "IfcColumn", storey, recipe.solid(), recipe)


def _flight(name: str, storey: int, foot_m: Point, width_m: float) -> Part:
    return stairs(name, storey, foot_m=foot_m, width_m=width_m, rise_m=_RISE_M, n_risers=_N_RISERS, going_m=_GOING_M)


def _holes(part: Part) -> tuple[Hole, ...]:
    return part.pierced_box.holes if part.pierced_box is not None else ()


def _corners(x0: float, y0: float, x1: float, y1: float) -> tuple[tuple[float, float], ...]:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _rectangle(name: str, x0: float, y0: float, x1: float, y1: float) -> Room:
    return Room(name, 0, _corners(x0, y0, x1, y1), 0.0, _HEIGHT_M)


def _slabs(width_m: float, depth_m: float) -> list[Part]:
    out = _WALL_M
    high_x, high_y = width_m + out, depth_m + out
    return [
        slab("Floor", 0, (-out, -out, -_SLAB_M), (high_x, high_y, 0.0), lowest=True),
        slab("Ceiling", 0, (-out, -out, _HEIGHT_M), (high_x, high_y, _HEIGHT_M + _SLAB_M), lowest=False),
    ]


def _shell(
    width_m: float,
    depth_m: float,
    *,
    height_m: float = _HEIGHT_M,
    foot_m: float = 0.0,
    storey: int = 0,
    suffix: str = "",
    windows: Sequence[Opening] = (),
) -> list[Part]:
    """Four walls outside the rectangle (0, 0) to (width, depth); `windows` are in the south one."""
    out, low, top = _WALL_M, foot_m, round(foot_m + height_m, 6)
    return [
        wall(f"Wall south{suffix}", storey, (-out, -out, low), (width_m + out, 0.0, top), windows),
        wall(f"Wall north{suffix}", storey, (-out, depth_m, low), (width_m + out, depth_m + out, top)),
        wall(f"Wall west{suffix}", storey, (-out, 0.0, low), (0.0, depth_m, top)),
        wall(f"Wall east{suffix}", storey, (width_m, 0.0, low), (width_m + out, depth_m, top)),
    ]


def _storey_walls(levels: Sequence[Level], width_m: float, depth_m: float) -> list[Part]:
    """Four walls a storey, from its floor to its ceiling."""
    return [
        part
        for index, level in enumerate(levels)
        for part in _shell(
            width_m, depth_m, height_m=_CLEAR_M, foot_m=level.elevation_m, storey=index, suffix=f" {index}"
        )
    ]


def _stair_hole(x_m: float, foot_y_m: float, width_m: float) -> tuple[float, float, float, float]:
    """Opening above a flight: it begins where the head would touch, and ends where the flight does."""
    return x_m, round(foot_y_m + 2 * _GOING_M, 6), round(x_m + width_m, 6), round(foot_y_m + _FLIGHT_M, 6)


def _storey_slabs(
    levels: Sequence[Level], width_m: float, depth_m: float, hole: tuple[float, float, float, float]
) -> list[Part]:
    """A slab under each storey, all but the lowest with a hole (x0, y0, x1, y1), and a roof."""
    out, (x0, y0, x1, y1) = _WALL_M, hole
    parts = []
    for index, level in enumerate(levels):
        high, low = level.elevation_m, round(level.elevation_m - (_RISE_M - _CLEAR_M), 6)
        holes = [Hole(f"Void {index}", (x0, y0, low), (x1, y1, high))] if index else []
        box = ((-out, -out, low), (width_m + out, depth_m + out, high))
        parts.append(slab(f"Slab {index}", index, *box, holes, lowest=not index))
    low, high = (round(levels[-1].elevation_m + z, 6) for z in (_CLEAR_M, _RISE_M))
    parts.append(flat_roof("Roof", len(levels) - 1, (-out, -out, low), (width_m + out, depth_m + out, high)))
    return parts


def _railings_round(storey: int, z_m: float, low_m: float, high_m: float) -> list[Part]:
    """Four railings along the sides of a square, short of its corners."""
    ends = (low_m + 0.15, high_m - 0.15)
    lines = [
        *(((ends[0], y, z_m), (ends[1], y, z_m)) for y in (low_m, high_m)),
        *(((x, ends[0], z_m), (x, ends[1], z_m)) for x in (low_m, high_m)),
    ]
    return [railing(f"Railing {storey}.{i}", storey, *line) for i, line in enumerate(lines, start=1)]


def _storeyed(
    name: str, levels: Sequence[Level], parts: Sequence[Part], width_m: float, depth_m: float
) -> SyntheticScene:
    """One room a storey, the full width and depth."""
    rooms = [
        Room(level.name, index, _corners(0.0, 0.0, width_m, depth_m), level.elevation_m, _CLEAR_M)
        for index, level in enumerate(levels)
    ]
    top = round(levels[-1].elevation_m + _RISE_M, 6)
    extents = [(-_WALL_M, -_WALL_M, -(_RISE_M - _CLEAR_M)), (width_m + _WALL_M, depth_m + _WALL_M, top)]
    return assemble(name, levels=levels, rooms=rooms, parts=parts, extents_m=extents)


def _one_room(name: str, parts: Sequence[Part], width_m: float, depth_m: float) -> SyntheticScene:
    return _assemble(name, [_rectangle("Room", 0.0, 0.0, width_m, depth_m)], parts, width_m, depth_m)


def _assemble(
    name: str, rooms: Sequence[Room], parts: Sequence[Part], width_m: float, depth_m: float
) -> SyntheticScene:
    extents = [(-_WALL_M, -_WALL_M, -_SLAB_M), (width_m + _WALL_M, depth_m + _WALL_M, _HEIGHT_M + _SLAB_M)]
    return assemble(name, levels=[_GROUND], rooms=rooms, parts=parts, extents_m=extents)
