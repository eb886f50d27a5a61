"""Which axis is up: the ground that a scene offers in either reading.

A model on its side has level surfaces with headroom, too: its walls. They make narrow ground, cut up by what are floors
in truth, under high ceilings. So readings are compared by their largest ground in one piece:

    upright      |    |    |     |    one floor under all rooms, joined by doors
                ===================
    on its side  a wall is the ground: as narrow as a storey is high, parted by floors, which have no doors

Input a `Scene` (local frame, metres). Lines on one coarse lattice along all three axes meet its triangles: those along
the upward axis find ground and headroom, the others the walls between neighbouring places.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array, Scene
from planner_core.model.arrays import lengths
from planner_core.scene.array_rows import chunks
from planner_core.scene.columns import Columns, sample_scene
from planner_core.scene.level_surfaces import MAX_SLOPE_RAD, MIN_CLEAR_M

#: Lines are this far apart, so that three go through a door; further on large sites, for at most `_MOST_LINES` along
#: an axis.
_STEP_M, _MOST_LINES = 0.25, 40_000
#: Walls are searched for at this height above the ground: over kerbs and most parapets, below door heads.
_WALL_CUT_M = 1.0
#: A step of a stair, which ground in one piece may have beside what a ramp rises.
_STEP_UP_M = 0.2
#: Rooms are mostly no higher. Ground under a higher ceiling counts less, in proportion: a room on its side is as high
#: as it was long.
_USUAL_CLEAR_M = 4.0
#: Ground is inside where half of it is covered, or half of its outline stands against walls.
_HALF = 0.5
#: The other reading has this many times the ground to be believed against the file, and to be worth a warning: as the
#: product of the two ratios of `UprightGround`. Upright buildings, rooms and corridors stay below 1.1, on their side
#: nearly all are above 1.8, and flats and houses above 5.
_BELIEVED, _DOUBTED = 4.0, 1.4
#: Its ground has usual headroom, for the larger part: a hall on its side and a shaft that stands look the same.
_LEAST_USUAL = 0.66
#: Open ground with things on it, walls or furniture along this share of its outline: a plate is no wall then.
_FURNISHED = 0.1
#: What has no walls is doubted where the other reading has this many times the ground, and makes it this much flatter
#: than it is wide.
_TIMES, _FLAT = 2.0, 0.75
#: Ground smaller than this is no room to survey; and a measure for ratios where there is no ground.
_SMALLEST_ROOM_M2, _SMALLEST_M2 = 5.0, 1.0


@dataclass(frozen=True)
class UprightGround:
    """Largest ground in one piece: m2, times the share of it that its headroom makes count."""

    between_walls_m2: float
    """Pieces end at walls, and at whatever stands as they do."""
    on_one_surface_m2: float
    """Pieces end where their surface does: rooms behind shut doors stand on one slab."""
    walled_m2: float
    """As the first, but walls stand along half of its outline: walls that lie without floors have open sides."""
    usual: float
    """Share of the last that headroom makes count."""
    open_m2: float
    """Of any piece with things on it, covered and walled or not."""


@dataclass(frozen=True)
class _Lines:
    """Lines along one axis. key : (N,) float64 of the crossings, ascending by line and place along it."""

    columns: Columns
    key: FloatArray
    stride_m: float
    low_m: float


class UpAxes:
    """The scene on its lattice, to be read with any axis up."""

    def __init__(self, scene: Scene) -> None:
        self.read_as = scene.source.up_axis
        low_m, high_m = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
        self.size_m = high_m - low_m
        widest_m2 = max(float(self.size_m[axis] * self.size_m[axis - 1]) for axis in range(3))
        self.step_m = max(_STEP_M, float(np.sqrt(widest_m2 / _MOST_LINES)))
        # Off the round figures that designers align walls to.
        self.start_m = low_m + self.step_m * np.array([0.37, 0.43, 0.41])
        self.count = np.maximum(np.floor((high_m - self.start_m) / self.step_m) + 1, 1).astype(np.int64)
        self.faces_axis: BoolArray = np.empty((scene.n_triangles, 3), dtype=np.bool_)
        for some in chunks(scene.n_triangles):
            a, b, c = (scene.vertices_m[scene.triangles[some, i]] for i in range(3))
            cross = np.cross(b - a, c - a)
            length = lengths(cross)
            self.faces_axis[some] = np.abs(cross) >= np.cos(MAX_SLOPE_RAD) * length[:, None]
        self.lines = [self._lines_along(scene, axis) for axis in range(3)]

    def _lines_along(self, scene: Scene, axis: int) -> _Lines:
        across = [(axis + 1) % 3, (axis + 2) % 3]
        turned = replace(scene, vertices_m=np.ascontiguousarray(scene.vertices_m[:, [*across, axis]]))
        columns = sample_scene(
            turned,
            np.arange(scene.n_triangles, dtype=np.int32),
            low_m=self.start_m[across],
            step_m=self.step_m,
            shape=(int(self.count[across[0]]), int(self.count[across[1]])),
        )
        low_m = float(columns.z_m.min(initial=0.0))
        stride_m = float(columns.z_m.max(initial=0.0)) - low_m + 10.0
        return _Lines(columns, columns.column * stride_m + (columns.z_m - low_m), stride_m, low_m)

    def headroom_m(self) -> float:
        """Height that three quarters of the spaces over level surfaces do not exceed; 0 where there are none.

        Half of the spaces are those inside slabs where the unit makes these as high as rooms.
        """
        columns = self.lines[2].columns
        clear_m = columns.clear_height_m()
        spaces_m = clear_m[self.faces_axis[columns.triangle, 2] & (clear_m >= MIN_CLEAR_M) & np.isfinite(clear_m)]
        return float(np.quantile(spaces_m, 0.75)) if spaces_m.size else 0.0

    def ground(self, axis: int, *, is_down: bool = False) -> UprightGround:
        """Ground with `axis` (0, 1, 2) up; is_down: with its negative direction up."""
        columns = self.lines[axis].columns
        everything = np.ones(columns.z_m.size, dtype=np.bool_)
        clear_m = columns.depth_to_m(everything) if is_down else columns.clear_height_m()
        stands = self.faces_axis[columns.triangle, axis] & (clear_m >= MIN_CLEAR_M)
        n = int(stands.sum())
        if not n:
            return UprightGround(0.0, 0.0, 0.0, 0.0, 0.0)
        number = np.cumsum(stands) - 1
        height_m, clear_m = columns.z_m[stands], clear_m[stands]
        n_b = int(self.count[(axis + 1) % 3])
        place = np.stack([columns.column[stands] % n_b, columns.column[stands] // n_b], axis=1)
        cut_m = height_m + (-_WALL_CUT_M if is_down else _WALL_CUT_M)
        links, is_free = [np.zeros((2, 0), dtype=np.int64)], [np.zeros(0, dtype=np.bool_)]
        n_walls, n_edges = np.zeros(n), np.zeros(n)
        for side, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
            beside = self._beside(axis, place, height_m, side, step, stands)
            wall = self._has_wall(axis, place, cut_m, side, step)
            n_walls += wall
            n_edges += (beside < 0) & ~wall
            if step > 0:
                found = np.flatnonzero(beside >= 0)
                links.append(np.stack([found, number[beside[found]]]))
                is_free.append(~wall[found])
        pairs, free = np.concatenate(links, axis=1), np.concatenate(is_free)
        counts = np.minimum(1.0, _USUAL_CLEAR_M / clear_m)
        counts[~np.isfinite(clear_m)] = 1.0
        areas = []
        for kept in (pairs[:, free], pairs):
            piece = _pieces(n, kept)
            areas.append(
                [np.bincount(piece, w) for w in (np.ones(n), np.isfinite(clear_m) * 1.0, counts, n_walls, n_edges)]
            )
        (size, covered, weight, walls, edges), (size_2, covered_2, weight_2, walls_2, edges_2) = areas
        share = walls / np.maximum(walls + edges, 1.0)
        inside = (covered >= _HALF * size) | (share >= _HALF)
        inside_2 = (covered_2 >= _HALF * size_2) | (walls_2 >= edges_2)
        walled = int(np.argmax(weight * (share >= _HALF)))
        cell_m2 = self.step_m * self.step_m
        return UprightGround(
            between_walls_m2=float((weight * inside).max() * cell_m2),
            on_one_surface_m2=float((weight_2 * inside_2).max() * cell_m2),
            walled_m2=float(weight[walled] * (share[walled] >= _HALF) * cell_m2),
            usual=float(weight[walled] / size[walled]),
            open_m2=float((weight * (share >= _FURNISHED)).max() * cell_m2),
        )

    def _beside(
        self, axis: int, place: Int64Array, height_m: FloatArray, side: int, step: int, stands: BoolArray
    ) -> Int64Array:
        """(M,) crossing with ground at nearly the same height one line further, -1 where there is none."""
        lines = self.lines[axis]
        n_across = self.count[[(axis + 1) % 3, (axis + 2) % 3]]
        moved = place.copy()
        moved[:, side] += step
        is_there = (moved[:, side] >= 0) & (moved[:, side] < n_across[side])
        at = (moved[:, 1] * n_across[0] + moved[:, 0]) * lines.stride_m + (height_m - lines.low_m)
        reach_m = _STEP_UP_M + np.tan(MAX_SLOPE_RAD) * self.step_m
        keys, ids = lines.key[stands], np.flatnonzero(stands)
        first = np.searchsorted(keys, at - reach_m)
        is_there &= first < np.searchsorted(keys, at + reach_m, side="right")
        return np.where(is_there, ids[np.minimum(first, ids.size - 1)], -1)

    def _has_wall(self, axis: int, place: Int64Array, cut_m: FloatArray, side: int, step: int) -> BoolArray:
        """(M,) something stands between a place and the next, at the height of the cut."""
        across = [(axis + 1) % 3, (axis + 2) % 3]
        along = across[side]
        lines = self.lines[along]
        index = np.empty((place.shape[0], 3), dtype=np.int64)
        index[:, across] = place
        index[:, axis] = np.rint((cut_m - self.start_m[axis]) / self.step_m)
        is_there = (index[:, axis] >= 0) & (index[:, axis] < self.count[axis])
        line = index[:, (along + 2) % 3] * self.count[(along + 1) % 3] + index[:, (along + 1) % 3]
        here_m = line * lines.stride_m + self.start_m[along] + self.step_m * index[:, along] - lines.low_m
        low, high = here_m + min(step, 0) * self.step_m, here_m + max(step, 0) * self.step_m
        met = np.searchsorted(lines.key, low) < np.searchsorted(lines.key, high, side="right")
        wall: BoolArray = is_there & met
        return wall


def _pieces(n: int, pairs: Int64Array) -> Int64Array:
    """(n,) the least number in the connected component of each; without SciPy, which takes longer to import."""
    least = np.arange(n)
    while True:
        a, b = least[pairs]
        if (a == b).all():
            return least
        np.minimum.at(least, np.maximum(a, b), np.minimum(a, b))
        while (least[least] != least).any():
            least = least[least]


@dataclass(frozen=True)
class UpAxisDoubt:
    """The other reading is more likely. is_certain: enough to take it. read_m2, other_m2 : largest ground of each."""

    is_certain: bool
    read_m2: float
    other_m2: float


def up_axis_doubt(axes: UpAxes) -> UpAxisDoubt | None:
    """Doubt whether the axis that a scene was read with is up; None: it offers as much ground as the other.

    Y up and z up are compared: a file read as z up that is y up has y up in the scene, too; one read as y up that is z
    up has its upward axis along -y.
    """
    read, other = axes.ground(2), axes.ground(1, is_down=axes.read_as == "Y")
    ratio = other.walled_m2 / max(read.between_walls_m2, _SMALLEST_M2)
    ratio *= other.on_one_surface_m2 / max(read.on_one_surface_m2, _SMALLEST_M2)
    if ratio >= _DOUBTED and other.walled_m2 >= _SMALLEST_ROOM_M2:
        is_certain = ratio >= _BELIEVED and other.usual >= _LEAST_USUAL
        return UpAxisDoubt(is_certain, read.between_walls_m2, other.walled_m2)
    # No rooms either way: a plate with furniture, a pavilion. It lies rather than stands.
    width_m, height_m, depth_m = axes.size_m
    read_m2, other_m2 = (max(ground.open_m2, ground.between_walls_m2) for ground in (read, other))
    if other_m2 >= _TIMES * max(read_m2, _SMALLEST_ROOM_M2) and height_m < _FLAT * min(width_m, depth_m):
        return UpAxisDoubt(False, read_m2, other_m2)
    return None
