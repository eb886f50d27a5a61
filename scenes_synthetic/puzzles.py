"""Art-gallery puzzles: rooms extruded from a plan, with the proven fewest stations and exact visible areas as truth.

Every wall of a plan is a part of its own, from floor to ceiling; wall k starts at corner k. "Fewest" is for a scanner
that looks everywhere and, where no range is named, far enough, and for all surfaces inside. Proofs use two facts:

- In a plan without columns, a convex part of the room is seen whole from any spot in it.
- Spots on the floor (`Truth.witnesses_m`), no two of which can be seen from one place, need a station each.

The seed is unused: nothing is left to chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenes_synthetic.model import KnownView, Level, Part, Room, SyntheticScene, assemble
from scenes_synthetic.plan_view import Edge, Flat, edges_of, visible_areas_m2
from scenes_synthetic.solids import prism

_LEVEL = Level("Ground floor", 0.0)
_WALL_M = 0.2
_SLAB_M = 0.2
_HEIGHT_M = 2.7
_STAND_M = 1.5
"""Height of the stations; it matters only where the range does."""


def convex_room(*, seed: int = 0) -> SyntheticScene:
    """A room of six uneven sides: 1 station.

    Proof: it is convex, so any spot sees all of it.
    """
    del seed
    outline = ((0.0, 1.0), (3.5, 0.0), (7.0, 1.5), (8.0, 4.5), (4.0, 6.5), (1.0, 5.0))
    return _puzzle("convex-room", outline, stations=[(3.5, 3.0)], witnesses=[(3.5, 3.0)], seen_from=[(2.0, 2.5)])


def l_by_range(*, seed: int = 0) -> SyntheticScene:
    """An L with legs of 10 x 3 m: 1 station that reaches 9 m, 2 stations that reach 7 m.

    Proof for 9 m: from (1.5, 1.5), where the legs cross, both legs are seen, each being convex; the farthest corner is
    less than (8.5^2 + 1.5^2 + 1.5^2)^1/2 = 8.77 m away. For 7 m: the corners (10, 0) and (0, 10) are 14.1 m apart, so
    no station reaches both; one in the middle of each leg is less than (5^2 + 1.5^2 + 1.5^2)^1/2 = 5.5 m from all of
    that leg.
    """
    del seed
    outline = ((0.0, 0.0), (10.0, 0.0), (10.0, 3.0), (3.0, 3.0), (3.0, 10.0), (0.0, 10.0))
    views = [(1.5, 1.5), (6.5, 1.25)]
    found = _puzzle("l-by-range", outline, stations=views[:1], witnesses=[(9.0, 1.0)], seen_from=views, range_m=7.0)
    return _with_ranges(found, ((7.0, 2), (9.0, 1)))


def t_corridor(*, seed: int = 0) -> SyntheticScene:
    """Corridors of 2 m that meet in a T with arms of 8 m: 1 station, or 3 that reach 6 m.

    Proof: the crossing belongs to the bar and to the stem, which are convex, so a spot in it sees both. For 6 m: the
    ends (-9, 0), (9, 0) and (0, -9) are at least 9 * 2^1/2 = 12.7 m apart, so each needs a station; from (4, 0) it is
    less than (5^2 + 1^2 + 1.5^2)^1/2 = 5.4 m to all of its arm and of the crossing, and likewise from the other two.
    """
    del seed
    outline = ((-1.0, -9.0), (1.0, -9.0), (1.0, -1.0), (9.0, -1.0), (9.0, 1.0), (-9.0, 1.0), (-9.0, -1.0), (-1.0, -1.0))
    views = [(0.0, 0.0), (4.0, 0.25)]
    found = _puzzle("t-corridor", outline, stations=views[:1], witnesses=[(8.0, 0.0)], seen_from=views, range_m=6.0)
    return _with_ranges(found, ((6.0, 3),))


def plus_corridor(*, seed: int = 0) -> SyntheticScene:
    """Corridors of 2 m that cross, with arms of 8 m: 1 station, or 4 that reach 6 m.

    Proof: as for the T; the four ends (9, 0), (0, 9), (-9, 0) and (0, -9) are at least 12.7 m apart.
    """
    del seed
    arm = ((1.0, 1.0), (1.0, 9.0), (-1.0, 9.0))
    turns = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    outline = [(c * x - s * y, s * x + c * y) for c, s in turns for x, y in arm]
    views = [(0.0, 0.0), (4.0, 0.25)]
    found = _puzzle("plus-corridor", outline, stations=views[:1], witnesses=[(8.0, 0.0)], seen_from=views, range_m=6.0)
    return _with_ranges(found, ((6.0, 4),))


def comb_gallery(*, seed: int = 0, n_teeth: int = 4) -> SyntheticScene:
    """A hall of 2 m depth with teeth of 1.5 x 3 m, 3.5 m from one to the next: a station for each tooth.

    Enough: from before the middle of a tooth's mouth every line into the tooth passes the mouth, so all of the tooth is
    seen, and the hall is convex. Needed: the middle of a tooth's end is seen from a cone that has widened, at the far
    side of the hall 5 m away, to 5/3 of the mouth, 2.5 m. Cones 3.5 m apart do not meet, so a station sees one at most.
    """
    del seed
    width, depth, pitch, hall = 1.5, 3.0, 3.5, 2.0
    length = n_teeth * pitch
    middles = [(i + 0.5) * pitch for i in range(n_teeth)]
    outline = [(0.0, 0.0), (length, 0.0), (length, hall)]
    for middle in reversed(middles):
        low, high = middle - width / 2, middle + width / 2
        outline += [(high, hall), (high, hall + depth), (low, hall + depth), (low, hall)]
    outline.append((0.0, hall))
    stations = [(middle, 1.0) for middle in middles]
    ends = [(middle, hall + depth - 0.01) for middle in middles]
    return _puzzle("comb-gallery", outline, stations=stations, witnesses=ends, seen_from=[*stations[:1], (3.0, 0.75)])


def spiral(*, seed: int = 0) -> SyntheticScene:
    """A corridor of 1.6 m that winds inwards in six legs: 3 stations.

    Enough: a leg with its corners is convex, so a station in a corner sees both legs that meet there; the first, third
    and fifth corner serve all six. Needed: the outer end, the middle of the third leg and the inner end are seen from
    their own leg and a sliver of its neighbours beyond the corners. Those regions do not meet, as the second leg and
    the fourth and fifth are far longer than the slivers, at most 0.7 m beyond a corner.
    """
    del seed
    path = ((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0), (0.0, 2.1), (9.9, 2.1), (9.9, 7.9))
    half = 0.8
    outline = [*_beside(path, -half), *reversed(_beside(path, half))]
    stations = [path[1], path[3], path[5]]
    witnesses = [(0.2, 0.0), (6.0, 10.0), (9.9, 7.7)]
    return _puzzle("spiral", outline, stations=stations, witnesses=witnesses, seen_from=[path[3], (11.5, 4.0)])


def column_hall(*, seed: int = 0) -> SyntheticScene:
    """A hall of 12 x 7 m cut by three wide columns: 2 stations.

    Needed: a column's west face is seen from west of it only, its east face from east of it only, so one station never
    sees both. Enough: the two spots of `Truth.stations_m`, whose sights, computed in rational numbers, leave
    nothing out.
    """
    del seed
    outline = ((0.0, 0.0), (12.0, 0.0), (12.0, 7.0), (0.0, 7.0))
    columns = [_square(3.0, 3.5, 1.0), _square(6.0, 3.5, 1.0), _square(9.0, 3.5, 1.0)]
    stations = [(2.25, 0.75), (9.75, 6.25)]
    return _puzzle(
        "column-hall", outline, columns=columns, stations=stations, witnesses=[], seen_from=[*stations, (4.5, 2.0)]
    )


def _puzzle(
    name: str,
    outline: Sequence[Flat],
    *,
    columns: Sequence[Sequence[Flat]] = (),
    stations: Sequence[Flat],
    witnesses: Sequence[Flat],
    seen_from: Sequence[Flat],
    range_m: float | None = None,
) -> SyntheticScene:
    """Build the room, and compute what each spot of `seen_from` sees, without limit and within a range."""
    walls = [f"Wall {k}" for k in range(len(outline))]
    edges = edges_of(outline, walls)
    parts = [*_slabs(outline), *_walls(outline, walls)]
    for number, column in enumerate(columns, start=1):
        part = f"Column {number}"
        edges += edges_of(column, [part] * len(column))
        parts.append(Part(part, "IfcColumn", 0, prism(column, axis="z", low_m=0.0, high_m=_HEIGHT_M)))
    low, high = _outer_bounds(outline)
    reaches = (math.inf,) if range_m is None else (math.inf, range_m)
    found = assemble(
        name,
        levels=[_LEVEL],
        rooms=[Room("Room", 0, tuple(outline), 0.0, _HEIGHT_M)],
        parts=parts,
        extents_m=[(*low, -_SLAB_M), (*high, _HEIGHT_M + _SLAB_M)],
        n_stations=len(stations),
    )
    truth = replace(
        found.truth,
        stations_m=tuple((x, y, _STAND_M) for x, y in stations),
        witnesses_m=tuple((x, y, 0.0) for x, y in witnesses),
        views=tuple(_view(edges, spot, reach) for spot in seen_from for reach in reaches),
    )
    return replace(found, truth=truth)


def _view(edges: Sequence[Edge], spot: Flat, range_m: float) -> KnownView:
    station = (spot[0], spot[1], _STAND_M)
    return KnownView(station, visible_areas_m2(edges, station, _HEIGHT_M, range_m=range_m), range_m)


def _with_ranges(found: SyntheticScene, n_stations_at_range: tuple[tuple[float, int], ...]) -> SyntheticScene:
    return replace(found, truth=replace(found.truth, n_stations_at_range=n_stations_at_range))


def _slabs(outline: Sequence[Flat]) -> list[Part]:
    """Floor and ceiling in the outline of the walls: nobody can stand beside the room."""
    outer = _mitred(outline)
    floor = prism(outer, axis="z", low_m=-_SLAB_M, high_m=0.0)
    ceiling = prism(outer, axis="z", low_m=_HEIGHT_M, high_m=_HEIGHT_M + _SLAB_M)
    return [
        Part("Floor", "IfcSlab", 0, floor, predefined_type="BASESLAB"),
        Part("Ceiling", "IfcSlab", 0, ceiling, predefined_type="FLOOR"),
    ]


def _walls(outline: Sequence[Flat], names: Sequence[str]) -> list[Part]:
    """Walls outside a counter-clockwise outline, mitred at its corners."""
    outer = _mitred(outline)
    parts = []
    for k, name in enumerate(names):
        following = (k + 1) % len(outline)
        corners = [outline[k], outer[k], outer[following], outline[following]]
        parts.append(Part(name, "IfcWall", 0, prism(corners, axis="z", low_m=0.0, high_m=_HEIGHT_M)))
    return parts


def _outer_bounds(outline: Sequence[Flat]) -> tuple[Flat, Flat]:
    outer = np.asarray(_mitred(outline))
    (x0, y0), (x1, y1) = outer.min(axis=0).tolist(), outer.max(axis=0).tolist()
    return (x0, y0), (x1, y1)


def _mitred(outline: Sequence[Flat]) -> list[Flat]:
    """Corners of the outline moved outwards by a wall's thickness."""
    return _beside([outline[-1], *outline, outline[0]], -_WALL_M)[1:-1]


def _beside(path: Sequence[Flat], left_m: float) -> list[Flat]:
    """Return a path that runs beside another, `left_m` to its left, with sharp corners; its ends are cut square."""
    corners = np.asarray(path)
    run = np.diff(corners, axis=0)
    normal = np.stack([-run[:, 1], run[:, 0]], axis=1) / np.linalg.norm(run, axis=1, keepdims=True)
    before, after = np.vstack([normal[:1], normal]), np.vstack([normal, normal[-1:]])
    shift = (before + after) / (1.0 + (before * after).sum(axis=1, keepdims=True))
    return [(x, y) for x, y in np.round(corners + left_m * shift, 6).tolist()]


def _square(x_m: float, y_m: float, side_m: float) -> list[Flat]:
    half = side_m / 2
    return [(x_m - half, y_m - half), (x_m + half, y_m - half), (x_m + half, y_m + half), (x_m - half, y_m + half)]
