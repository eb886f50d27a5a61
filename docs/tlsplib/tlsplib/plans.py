"""Instances made from plans: rooms, offices along a corridor, halls with pillars, from seeds; and from outlines.

A plan is walls in whole centimetres; surfaces, stations, sight and links follow from it by whole numbers alone. Chance
is `random.Random(seed).random()`, whose numbers Python promises for good.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from planner_core.model import BoolArray, Int64Array

from .instance import Instance, Need
from .sight import Surfaces, seen_from

Wall = tuple[int, int, int, int]
Box = tuple[int, int, int, int]
DOOR_CM, RASTER_CM = 90, 25


@dataclass(frozen=True)
class Plan:
    """walls : the outline and what stands in it. zones : rooms as boxes, where there are any; for their own shares."""

    walls: tuple[Wall, ...]
    zones: tuple[Box, ...] = ()


@dataclass(frozen=True)
class Survey:
    """How a plan is scanned, and what is required. Lengths in cm, shares in per cent.

    grid : distance of stations. patch : side of a surface. whole, floor, wall, zone, twice : shares of what can be
    seen, at all or of floors, walls, each zone, and by two stations; 0: not required. overlap : of two linked stations,
    the share of what the one of them sees that sees less; 0: no links.
    """

    grid: int
    most: int
    patch: int = 100
    height: int = 270
    stand: int = 170
    clear: int = 40
    least: int = 60
    whole: int = 95
    floor: int = 0
    wall: int = 0
    zone: int = 0
    twice: int = 0
    overlap: int = 0


# ---------------------------------------------------------------------------------------------------- plans
def rooms(seed: int, *, width: int, depth: int, largest_m2: int) -> Plan:
    """Rooms by cutting a rectangle in two again and again; each cut has a door, some have two."""
    rng = random.Random(seed)
    walls: list[Wall] = list(_frame(0, 0, width, depth))
    doors: list[Wall] = []
    zones: list[Box] = []
    left: list[Box] = [(0, 0, width, depth)]
    while left:
        box = left.pop()
        x0, y0, x1, y1 = box
        if (x1 - x0) * (y1 - y0) <= largest_m2 * 10_000 * (0.6 + 0.8 * rng.random()):
            zones.append(box)
            continue
        upright = x1 - x0 >= y1 - y0
        low, high = (x0, x1) if upright else (y0, y1)
        spots = [v for v in range(low + 200, high - 199, RASTER_CM) if not _at_door(doors, v, box, upright=upright)]
        if not spots:
            zones.append(box)
            continue
        at = spots[int(rng.random() * len(spots))]
        begin, end = (y0, y1) if upright else (x0, x1)
        n_doors = 2 if end - begin > 600 and rng.random() < 0.3 else 1
        walls += _with_doors(at, begin, end, n_doors, rng, doors, upright=upright)
        left += [(x0, y0, at, y1), (at, y0, x1, y1)] if upright else [(x0, y0, x1, at), (x0, at, x1, y1)]
    return Plan(tuple(walls), tuple(zones))


def offices(seed: int, *, length: int, corridor: int, depth: int) -> Plan:
    """Offices of different widths on both sides of a corridor, each with a door to it; some to the next one, too."""
    rng = random.Random(seed)
    top = 2 * depth + corridor
    walls: list[Wall] = list(_frame(0, 0, length, top))
    zones: list[Box] = [(0, depth, length, depth + corridor)]
    for low, high, edge in ((0, depth, depth), (depth + corridor, top, depth + corridor)):
        x = 0
        while x < length:
            wide = 300 + RASTER_CM * int(rng.random() * 13)
            end = length if length - x - wide < 300 else x + wide
            walls += _with_doors(edge, x, end, 1, rng, [], upright=False)
            if end < length:
                through = int(rng.random() < 0.25)
                walls += _with_doors(end, low, high, through, rng, [], upright=True)
            zones.append((x, low, end, high))
            x = end
    return Plan(tuple(walls), tuple(zones))


def hall(seed: int, *, width: int, depth: int, n_pillars: int, n_shelves: int) -> Plan:
    """A hall with square pillars and free-standing shelves, all as high as it is."""
    rng = random.Random(seed)
    walls: list[Wall] = list(_frame(0, 0, width, depth))
    for _ in range(n_pillars):
        side = 40 + 20 * int(rng.random() * 3)
        x, y = (100 + RASTER_CM * int(rng.random() * ((size - 300) // RASTER_CM)) for size in (width, depth))
        walls += _frame(x, y, x + side, y + side)
    for _ in range(n_shelves):
        long = 200 + RASTER_CM * int(rng.random() * 9)
        x, y = (100 + RASTER_CM * int(rng.random() * ((size - 600) // RASTER_CM)) for size in (width, depth))
        walls.append((x, y, x + long, y) if rng.random() < 0.5 else (x, y, x, y + long))
    return Plan(tuple(walls))


PLANS: dict[str, Callable[..., Plan]] = {"rooms": rooms, "offices": offices, "hall": hall}


def _frame(x0: int, y0: int, x1: int, y1: int) -> list[Wall]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def _with_doors(
    at: int, begin: int, end: int, n: int, rng: random.Random, doors: list[Wall], *, upright: bool
) -> list[Wall]:
    """Pieces of a wall from begin to end that leave n doors open; these are noted."""
    free = (end - begin - 2 * 30) // max(n, 1)
    pieces, from_ = [], begin
    for k in range(n):
        first = begin + 30 + k * free + RASTER_CM * int(rng.random() * max((free - DOOR_CM) // RASTER_CM, 1))
        pieces.append((from_, first))
        doors.append((at, first, at, first + DOOR_CM) if upright else (first, at, first + DOOR_CM, at))
        from_ = first + DOOR_CM
    pieces.append((from_, end))
    return [(at, a, at, b) if upright else (a, at, b, at) for a, b in pieces if a < b]


def _at_door(doors: Sequence[Wall], at: int, box: Box, *, upright: bool) -> bool:
    """Whether a cut of the box at `at` would end in a door."""
    x0, y0, x1, y1 = box
    for a, b, c, d in doors:
        if upright and b == d and b in (y0, y1) and a - 20 <= at <= c + 20:
            return True
        if not upright and a == c and a in (x0, x1) and b - 20 <= at <= d + 20:
            return True
    return False


# ------------------------------------------------------------------------------------------------ instances
def instance_of(name: str, kind: str, about: dict[str, Any], plan: Plan, survey: Survey) -> Instance:
    """Stations on a grid, surfaces of floor, ceiling and walls, and what is required of them."""
    walls = np.array(plan.walls, dtype=np.int64)
    stations = _stations(walls, survey)
    surfaces = _surfaces(walls, survey)
    sees = seen_from(stations, surfaces, walls, least_cm=survey.least, most_cm=survey.most)
    zone = _zones(surfaces, walls, plan.zones)
    links = linked(sees, surfaces.ticks, percent=survey.overlap) if survey.overlap else None
    facts = {**about, "range_cm": survey.most, "survey": asdict(survey), "walls_cm": [list(w) for w in plan.walls]}
    surveyed = Surveyed(stations, sees, surfaces.ticks, surfaces.wall >= 0, zone, links)
    return assembled(name, kind, facts, surveyed, survey)


@dataclass(frozen=True)
class Surveyed:
    """What was seen, before anything is merged: stations (N, 3) in cm, sees (N, P), ticks (P,), links (N, N) or None.

    of_wall : (P,) whether walls or, else, floors and ceilings. zone : (P,) int64, -1: none.
    """

    stations_cm: Int64Array
    sees: BoolArray
    ticks: Int64Array
    of_wall: BoolArray
    zone: Int64Array
    links: BoolArray | None


def assembled(name: str, kind: str, about: dict[str, Any], surveyed: Surveyed, survey: Survey) -> Instance:
    """Merge what the same stations see for the same constraints, and say what is required.

    Where links matter, of stations only those of the largest connected component are taken.
    """
    stations, sees, ticks, links = surveyed.stations_cm, surveyed.sees, surveyed.ticks, surveyed.links
    of_wall, zone = surveyed.of_wall, surveyed.zone
    if links is not None:
        keep = _largest_component(links)
        stations, sees, links = stations[keep], sees[keep], links[np.ix_(keep, keep)]
    else:
        useful = sees.any(axis=1)
        stations, sees = stations[useful], sees[useful]
    n_seers = sees.sum(axis=0)
    seen = n_seers > 0
    parts = [("whole", seen, survey.whole, 1), ("floors", seen & ~of_wall, survey.floor, 1)]
    parts += [("walls", seen & of_wall, survey.wall, 1), ("twice", n_seers > 1, survey.twice, 2)]
    parts += [(f"zone {z}", seen & (zone == z), survey.zone, 1) for z in range(int(zone.max(initial=-1)) + 1)]
    required = [(title, part, share, m) for title, part, share, m in parts if share and part.any()]
    merged, row_ticks, first = _merged(sees, ticks, [part for _, part, _, _ in required])
    needs = []
    for title, part, share, m in required:
        whole = int(ticks[part].sum())
        needs.append(Need(title, part[first], -(-whole * share // 100), m))
    return Instance(name, kind, about, stations, row_ticks, merged, tuple(needs), links)


def linked(sees: BoolArray, ticks: Int64Array, *, percent: int) -> BoolArray:
    """(N, N): stations that share so much of what the one of them sees that sees less."""
    from scipy.sparse import csr_array

    seen = csr_array(sees).astype(np.int64)  # whole numbers have no fast dense product
    own = seen @ ticks
    shared = (seen.multiply(ticks) @ seen.T).toarray()
    links: BoolArray = (100 * shared >= percent * np.minimum(own[:, None], own)) & (shared > 0)
    np.fill_diagonal(links, val=False)
    return links


def _largest_component(links: BoolArray) -> Int64Array:
    """Members of the largest component; of equals the one with the first member."""
    left, best = np.ones(len(links), dtype=bool), np.zeros(0, dtype=np.int64)
    while left.any():
        reached = np.zeros(len(links), dtype=bool)
        reached[np.argmax(left)] = True
        while (new := links[reached].any(axis=0) & ~reached).any():
            reached |= new
        left &= ~reached
        if reached.sum() > best.size:
            best = np.flatnonzero(reached)
    return best


def _merged(sees: BoolArray, ticks: Int64Array, parts: list[BoolArray]) -> tuple[BoolArray, Int64Array, Int64Array]:
    """Rows seen by the same stations and counted by the same constraints: as one, in the order of their first."""
    counted = np.array(parts).any(axis=0)
    key = np.concatenate([sees, np.array(parts)])
    rows: dict[bytes, int] = {}
    first: list[int] = []
    total: list[int] = []
    for p in np.flatnonzero(counted & sees.any(axis=0)).tolist():
        row = rows.setdefault(np.packbits(key[:, p]).tobytes(), len(first))
        if row == len(first):
            first.append(p)
            total.append(0)
        total[row] += int(ticks[p])
    at = np.array(first, dtype=np.int64)
    return sees[:, at], np.array(total, dtype=np.int64), at


def _inside(walls: Int64Array, points: Int64Array) -> BoolArray:
    """Whether points (K, 2) lie inside the closed rings of walls: an odd number of them is crossed to the right.

    Walls that stand free count twice, once for each side, so not at all; see `_rings`.
    """
    x, y = points[:, :1], points[:, 1:]
    x0, y0, x1, y1 = (walls[:, k][None] for k in range(4))
    across = (y0 > y) != (y1 > y)
    turn = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)
    crossed = across & ((turn > 0) == (y1 > y0))
    inside: BoolArray = crossed.sum(axis=1) % 2 == 1
    return inside


def _rings(walls: Int64Array) -> Int64Array:
    """Walls of closed rings: those at both of whose ends, again and again, another one ends."""
    left = walls
    while True:
        ends = [tuple(p) for wall in left.tolist() for p in (wall[:2], wall[2:])]
        count = {p: ends.count(p) for p in set(ends)}
        keep = [count[tuple(w[:2])] > 1 and count[tuple(w[2:])] > 1 for w in left.tolist()]
        if all(keep):
            return left
        left = left[np.array(keep)]


def _grid(walls: Int64Array, step: int) -> Int64Array:
    """(K, 2): middles of the squares of a grid over the walls that lie inside."""
    low, high = walls.reshape(-1, 2).min(axis=0), walls.reshape(-1, 2).max(axis=0)
    x, y = (np.arange(a + step // 2, b, step) for a, b in zip(low.tolist(), high.tolist(), strict=True))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2).astype(np.int64)
    return points[_inside(_rings(walls), points)]


def _stations(walls: Int64Array, survey: Survey) -> Int64Array:
    """(N, 3): places of the grid that keep clear of all walls."""
    at = _grid(walls, survey.grid)
    run = walls[:, 2:] - walls[:, :2]
    square = (run**2).sum(axis=1)
    to = at[:, None] - walls[None, :, :2]
    along = (to * run).sum(axis=2)
    beside = (along >= 0) & (along <= square)
    over = run[None, :, 0] * to[:, :, 1] - run[None, :, 1] * to[:, :, 0]
    near = beside & (over**2 < survey.clear**2 * square)
    for end in (walls[:, :2], walls[:, 2:]):
        near |= ((at[:, None] - end[None]) ** 2).sum(axis=2) < survey.clear**2
    free = at[~near.any(axis=1)]
    return np.concatenate([free, np.full((len(free), 1), survey.stand, dtype=np.int64)], axis=1)


def _surfaces(walls: Int64Array, survey: Survey) -> Surfaces:
    """Squares of floor and ceiling, and pieces of both sides of all walls in two bands of height."""
    middle = _grid(walls, survey.patch)
    flat = [np.concatenate([2 * middle, np.full((len(middle), 1), 2 * z)], axis=1) for z in (0, survey.height)]
    twice, ticks = [np.concatenate(flat)], [np.full(2 * len(middle), survey.patch**2, dtype=np.int64)]
    wall, side = [np.full(2 * len(middle), -1)], [np.zeros(2 * len(middle), dtype=np.int64)]
    bands = ((0, survey.height // 2), (survey.height // 2, survey.height))
    for number, (x0, y0, x1, y1) in enumerate(walls.tolist()):
        long = math.isqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
        n = max(1, -(-long // survey.patch))
        for k in range(n):
            ends = [(x0 + (x1 - x0) * s // n, y0 + (y1 - y0) * s // n) for s in (k, k + 1)]
            for low, high in bands:
                place = (ends[0][0] + ends[1][0], ends[0][1] + ends[1][1], low + high)
                area = (long * (k + 1) // n - long * k // n) * (high - low)
                if area:
                    twice.append(np.array([place, place], dtype=np.int64))
                    ticks.append(np.array([area, area], dtype=np.int64))
                    wall.append(np.array([number, number]))
                    side.append(np.array([1, -1], dtype=np.int64))
    return Surfaces(
        np.concatenate(twice).astype(np.int64),
        np.concatenate(ticks),
        np.concatenate(wall).astype(np.int64),
        np.concatenate(side),
    )


def _zones(surfaces: Surfaces, walls: Int64Array, zones: Sequence[Box]) -> Int64Array:
    """(P,) the zone that a surface faces, -1: none. Of a wall's middle that is a centimetre to its side."""
    run = walls[:, 2:] - walls[:, :2]
    normal = np.stack([-np.sign(run[:, 1]), np.sign(run[:, 0])], axis=1)
    at = surfaces.twice_cm[:, :2].copy()
    of_wall = surfaces.wall >= 0
    at[of_wall] += 2 * normal[surfaces.wall[of_wall]] * surfaces.side[of_wall, None]
    zone = np.full(len(at), -1, dtype=np.int64)
    for number, (x0, y0, x1, y1) in enumerate(zones):
        zone[(at > (2 * x0, 2 * y0)).all(axis=1) & (at < (2 * x1, 2 * y1)).all(axis=1)] = number
    return zone
