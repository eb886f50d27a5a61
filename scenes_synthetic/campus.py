"""`campus`: any number of buildings to any number of triangles, written to disk one building at a time.

Offices, schools and basements (as pavilions) stand on a square grid of plots; a park in the south makes up what is
missing. No more than one building is in memory at once.

`write_pavilions` writes a campus of bare ones instead, all alike: for as much floor area as there is patience for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner_core.errors import RequirementError
from planner_core.progress import Progress, ProgressEvent, silent
from scenes_synthetic import basement, office, school
from scenes_synthetic.building import Opening, slab, wall
from scenes_synthetic.model import Part, SyntheticScene
from scenes_synthetic.solids import Point, Solid, box, join, place
from scenes_synthetic.storeys import outer_walls
from scenes_synthetic.stream import stream_file
from scenes_synthetic.tessellated import copies, ellipsoid, lathe

FEWEST_TRIANGLES, MOST_TRIANGLES = 150_000, 1_000_000_000
"""One pavilion and some trees; and as much as 32 bit indices of vertices hold."""
_KINDS: tuple[tuple[Callable[..., SyntheticScene], int], ...] = (
    # builder, triangles that no seed comes to
    (office.build, 2_750_000),
    (school.build, 520_000),
    (basement.build, 133_000),
)
_PLOT_M = 62.0
_TREE_EVERY_M = 7.0
_GROUND_M = 0.5
_PARK, _LANDSCAPE = "Park", "IfcGeographicElement"
PAVILION_M2 = 100.0
"""Floor area of a bare pavilion: four rooms of 5 x 5 m."""
_ROOM_M, _CLEAR_M, _OUTER_M, _INNER_M, _SLAB_M = 5.0, 2.8, 0.3, 0.2, 0.2
#: From one bare pavilion to the next: a passage of 1.2 m is left between them.
_PAVILION_EVERY_M = 12.0
_DOORWAY_M = 0.9


@dataclass(frozen=True)
class Building:
    """A building of the campus: its name, lowest corner and triangles, the elevation of its storeys and its floor area.

    storeys_m : elevation of each storey's floor above the campus's ground, lowest first.
    floor_area_m2 : of all its rooms.
    """

    name: str
    at_m: Point
    n_triangles: int
    storeys_m: tuple[float, ...]
    floor_area_m2: float


@dataclass(frozen=True)
class Campus:
    """What was written: the buildings, all triangles (park and ground too), and the extents (2, 3) of everything."""

    buildings: tuple[Building, ...]
    n_trees: int
    n_triangles: int
    extents_m: tuple[Point, Point]


def write_campus(path: Path | str, *, n_triangles: int, seed: int = 0, progress: Progress = silent) -> Campus:
    """Write a campus to a `.ply`, `.obj`, `.glb` or `.usdz` file; memory does not grow with its triangles.

    n_triangles : between `FEWEST_TRIANGLES` and `MOST_TRIANGLES`; the file has at most 11 less.

    Raises RequirementError for another number, another kind of file, or more than the format can hold.
    """
    maker = _Maker(n_triangles, seed)

    def parts_of_campus() -> Iterator[tuple[str, Part]]:
        for group, part in maker.parts():
            yield group, part
            progress(ProgressEvent("writing", maker.n_made, n_triangles, group))

    stream_file(path, parts_of_campus(), "campus", n_triangles=n_triangles)
    progress(ProgressEvent("writing", n_triangles, n_triangles))
    return maker.campus()


def write_pavilions(path: Path | str, *, n_pavilions: int) -> float:
    """Write bare pavilions of one storey on a square of plots, no ground between them; return their floor area, m2.

    Raises RequirementError for none of them, and as `write_campus` for the file.
    """
    if n_pavilions < 1:
        raise RequirementError(f"pavilions: got {n_pavilions}, expected 1 or more.")
    pavilion, per_row = _pavilion(), math.isqrt(n_pavilions - 1) + 1

    def rows() -> Iterator[tuple[str, Part]]:
        for start in range(0, n_pavilions, per_row):
            column = np.arange(min(per_row, n_pavilions - start))
            at = np.column_stack([column, np.full(column.size, start // per_row), np.zeros(column.size)])
            yield (
                "Pavilions",
                Part(f"Row {start // per_row + 1}", "IfcWall", 0, copies(pavilion, _PAVILION_EVERY_M * at)),
            )

    stream_file(path, rows(), "campus", n_triangles=n_pavilions * len(pavilion.triangles))
    return n_pavilions * PAVILION_M2


def campus_parts(n_triangles: int, *, seed: int = 0) -> Iterator[Part]:
    """Yield the parts of a campus; they lie in it where `write_campus` puts them, and have the names of their building.

    Raises RequirementError for a number outside `FEWEST_TRIANGLES` to `MOST_TRIANGLES`.
    """
    return (part for _, part in _Maker(n_triangles, seed).parts())


class _Maker:
    """Yields the parts of a campus, by building, and keeps account of them."""

    def __init__(self, n_triangles: int, seed: int) -> None:
        if not FEWEST_TRIANGLES <= n_triangles <= MOST_TRIANGLES:
            raise RequirementError(
                f"campus: got {n_triangles} triangles, expected {FEWEST_TRIANGLES} to {MOST_TRIANGLES}; "
                "ask for a number between them."
            )
        self.n_made = 0
        self._wanted = n_triangles
        self._rng = np.random.default_rng(seed)
        self._buildings: list[Building] = []
        self._n_trees = 0
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def parts(self) -> Iterator[tuple[str, Part]]:
        """(building, part), the park last."""
        while (fits := self._next_kind()) is not None:
            yield from self._building(fits)
        for name, solid in self._park():
            yield _PARK, self._count(Part(name, _LANDSCAPE, 0, solid))

    def campus(self) -> Campus:
        """What was made."""
        low, high = self._low.tolist(), self._high.tolist()
        extents = ((low[0], low[1], low[2]), (high[0], high[1], high[2]))
        return Campus(tuple(self._buildings), self._n_trees, self.n_made, extents)

    def _left(self) -> int:
        return self._wanted - self.n_made - 12  # of the ground

    def _next_kind(self) -> Callable[..., SyntheticScene] | None:
        """The next in turn, or a smaller one where that is too large for what is left."""
        first = len(self._buildings) % len(_KINDS)
        return next((build for build, most in (*_KINDS[first:], *_KINDS) if most <= self._left()), None)

    def _count(self, part: Part) -> Part:
        low, high = part.solid.bounds_m
        self._low, self._high = np.minimum(self._low, low), np.maximum(self._high, high)
        self.n_made += len(part.solid.triangles)
        return part

    def _building(self, build: Callable[..., SyntheticScene]) -> Iterator[tuple[str, Part]]:
        number = len(self._buildings)
        synthetic = build(seed=int(self._rng.integers(2**31)))
        column, row = _plot(number)
        foot_m = -float(synthetic.truth.extents_m[0, 2])  # its base slab stands on the ground
        at = (column * _PLOT_M, row * _PLOT_M, foot_m)
        name = f"{synthetic.name} {number + 1}"
        storeys = tuple(round(foot_m + elevation, 6) for _, elevation in synthetic.truth.storeys)
        area = sum(synthetic.truth.floor_area_m2.values())
        self._buildings.append(Building(name, (at[0], at[1], 0.0), synthetic.scene.n_triangles, storeys, area))
        for part in synthetic.parts:
            yield name, self._count(replace(part, solid=place(part.solid, at), pierced_box=None))

    def _park(self) -> Iterator[tuple[str, Solid]]:
        """Trees for what is left, stone blocks for what is less than a tree, and the ground under everything."""
        tree = _tree()
        self._n_trees, rest = divmod(self._left(), len(tree.triangles))
        width = max(float(self._high[0]), _TREE_EVERY_M * math.sqrt(self._n_trees))
        per_row = int(width / _TREE_EVERY_M)
        for start in range(0, self._n_trees, per_row):
            n = min(per_row, self._n_trees - start)
            shift = self._rng.uniform(-1.5, 1.5, size=(n, 2))
            x = (np.arange(n) + 0.5) * _TREE_EVERY_M + shift[:, 0]
            y = -_TREE_EVERY_M * (2 + start // per_row) + shift[:, 1]
            size = self._rng.uniform(0.7, 1.3, size=n)
            at = np.column_stack([x, y, np.zeros(n)])
            yield f"Trees {start // per_row + 1}", copies(tree, at, np.repeat(size[:, None], 3, axis=1))
        n_blocks = rest // 12
        if n_blocks:
            block = box((0.0, -4.0, 0.0), (0.4, -3.6, 0.45))
            spots = np.column_stack([1.5 * np.arange(n_blocks), np.zeros(n_blocks), np.zeros(n_blocks)])
            yield "Blocks", copies(block, spots)
        low, high = self._low - 5.0, self._high + 5.0
        yield "Ground", box((float(low[0]), float(low[1]), -_GROUND_M), (float(high[0]), float(high[1]), 0.0))


def _plot(number: int) -> tuple[int, int]:
    """Column and row of a plot: shells round the first one, so that any number of them makes about a square."""
    shell = math.isqrt(number)
    step = number - shell**2
    return (shell, step) if step < shell else (2 * shell - step, shell)


def _pavilion() -> Solid:
    """Four rooms about a cross of walls, each with a doorway to both beside it; floor, ceiling and no windows."""
    size = round(2 * (_ROOM_M + _OUTER_M) + _INNER_M, 6)
    low, high, inner = _OUTER_M, round(size - _OUTER_M, 6), (_OUTER_M + _ROOM_M, _OUTER_M + _ROOM_M + _INNER_M)
    starts = [round(first + 0.5 * (_ROOM_M - _DOORWAY_M), 6) for first in (low, inner[1])]
    west, east = ([Opening(f"Doorway {start:g}", start, _DOORWAY_M, 2.2)] for start in starts)
    parts = [
        slab("Base slab", 0, (0.0, 0.0, -_SLAB_M), (size, size, 0.0), lowest=True),
        slab("Ceiling", 0, (0.0, 0.0, _CLEAR_M), (size, size, _CLEAR_M + _SLAB_M), lowest=False),
        *outer_walls("Pavilion", 0, (size, size), 0.0, _CLEAR_M, _OUTER_M, {}),
        wall("Wall across", 0, (low, inner[0], 0.0), (high, inner[1], _CLEAR_M), [*west, *east]),
        wall("Wall south", 0, (inner[0], low, 0.0), (inner[1], inner[0], _CLEAR_M), west),
        wall("Wall north", 0, (inner[0], inner[1], 0.0), (inner[1], high, _CLEAR_M), east),
    ]
    return join([part.solid for part in parts])


def _tree() -> Solid:
    """A trunk that widens to the ground, and a crown of five round masses; about 6 m high."""
    trunk = lathe([(0.0, 0.0), (0.3, 0.0), (0.2, 0.3), (0.15, 1.5), (0.1, 3.5), (0.0, 3.6)], n_sides=12)
    spots = (
        (0.0, 0.0, 4.7, 1.5),
        (0.9, 0.2, 3.9, 1.1),
        (-0.8, 0.5, 4.0, 1.1),
        (-0.2, -0.9, 4.1, 1.1),
        (0.2, 0.9, 4.3, 1.0),
    )
    crown = [ellipsoid((x, y, z), (r, r, 0.85 * r), n_sides=14, n_rings=8) for x, y, z, r in spots]
    return join([trunk, *crown])
