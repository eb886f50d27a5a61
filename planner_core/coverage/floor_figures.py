"""What plausibility measures of floors: headroom, which lie over each other, what walls enclose around their ground.

Input a scene with its floors, each with ground triangles; measured on plumb lines every 0.4 m. Local frame, metres.
docs/method/plausibility.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from planner_core.model import FloatArray, Floor, Int32Array, Int64Array, Scene
from planner_core.scene.between_walls import GAP_M, between_walls, cut_cells
from planner_core.scene.columns import sample_scene
from planner_core.scene.ground_planes import SITE_KINDS
from planner_core.scene.level_surfaces import MIN_CLEAR_M, WALL_CUT_M, cut_of_scene

#: Ground, rooms and stations are distinguished at one place of each square of this side: the narrowest rooms have
#: several.
SQUARE_M = 0.4
#: Floors lie over each other where they share this part of the smaller one's ground.
_OVER_SHARE = 0.1
#: Ground of other floors accounts for what is enclosed at a floor's height if it lies below this, above the floor.
_BESIDE_M = 2.0
#: Cells that the walls' cut is drawn in; larger where there would be more.
_CELL_M, _MAX_CELLS = 0.2, 1_000_000
#: Walls around a ledge or dock are nearer; what is further off is another building, or a stray face.
_AROUND_M = 100.0
#: A storey that was not found lies over such a part of a floor's ground; chimneys and turrets do not.
_PART = 1 / 3


@dataclass(frozen=True)
class GroundPlaces:
    """Places on the ground of floors with room to stand, one a floor of each square.

    ground_m, headroom_m, top_m : (K,) height, free height above, inf under open sky, and height of the highest surface
    above. floor : (K,) int32. square : (K,) int64, equal for places over each other. plan_m : (K, 2).
    """

    plan_m: FloatArray
    ground_m: FloatArray
    headroom_m: FloatArray
    top_m: FloatArray
    floor: Int32Array
    square: Int64Array
    square_m2: float


class FloorFigures:
    """What the checks measure of floors. planned : indices into `floors` of those that are doubted."""

    def __init__(self, scene: Scene, floors: Sequence[Floor], planned: Sequence[int]) -> None:
        self.scene, self.floors, self.planned = scene, floors, planned

    @cached_property
    def ground(self) -> GroundPlaces:
        """Places on the ground of all floors."""
        scene = self.scene
        low_m, high_m = scene.vertices_m[:, :2].min(axis=0), scene.vertices_m[:, :2].max(axis=0)
        step_m = max(SQUARE_M, math.sqrt(float(np.prod(high_m - low_m)) / _MAX_CELLS))
        n_x, n_y = (np.floor((high_m - low_m) / step_m).astype(np.int64) + 1).tolist()
        every = np.arange(scene.n_triangles, dtype=np.int32)
        low_m = low_m + step_m * np.array([0.37, 0.43])  # off the round figures that designers align walls to
        columns = sample_scene(scene, every, low_m=low_m, step_m=step_m, shape=(n_x, n_y))
        floor_of = np.full(scene.n_triangles, -1, dtype=np.int32)
        for index, floor in enumerate(self.floors):
            floor_of[floor.ground_triangles] = index
        floor_at, clear_m = floor_of[columns.triangle], columns.clear_height_m()
        row = np.flatnonzero((floor_at >= 0) & (clear_m >= MIN_CLEAR_M))
        _, first = np.unique(np.stack([columns.column[row], floor_at[row]]), axis=1, return_index=True)
        row = row[first]
        column = columns.column[row]
        last = np.searchsorted(columns.column, column, side="right") - 1  # crossings ascend
        return GroundPlaces(
            plan_m=np.column_stack([columns.x_m[column % n_x], columns.y_m[column // n_x]]),
            ground_m=columns.z_m[row],
            headroom_m=clear_m[row],
            top_m=columns.z_m[last],
            floor=floor_at[row],
            square=column,
            square_m2=step_m * step_m,
        )

    def room_height_m(self, index: int) -> float:
        """Median height of rooms on a floor, where something is overhead; NaN where nothing is."""
        here_m = self.ground.headroom_m[self.ground.floor == index]
        here_m = here_m[np.isfinite(here_m)]
        return float(np.median(here_m)) if here_m.size else math.nan

    def height_to_top_m(self, index: int) -> float:
        """Height of the building above a floor's ground, which it has over a part of the ground at least.

        Plumb lines through the ground count, where something is overhead: neither a tower beside nor a chimney does.
        """
        at = self.ground
        here = (at.floor == index) & np.isfinite(at.headroom_m)
        return float(np.quantile((at.top_m - at.ground_m)[here], 1.0 - _PART)) if here.any() else 0.0

    def next_above(self, index: int) -> tuple[int, float] | None:
        """The next floor over a part of this one, and how much higher its ground is there; None: none is over it.

        Ground of one floor has several heights where wings lie half a storey apart.
        """
        at = self.ground
        own = np.flatnonzero(at.floor == index)
        for other in range(len(self.floors)):
            if self.floors[other].elevation_m <= self.floors[index].elevation_m:
                continue
            over = np.flatnonzero(at.floor == other)
            shared, low, high = np.intersect1d(at.square[own], at.square[over], return_indices=True)
            n_least = min(np.unique(at.square[own]).size, np.unique(at.square[over]).size)
            if shared.size and shared.size >= _OVER_SHARE * n_least:
                return other, float(np.median(at.ground_m[over[high]] - at.ground_m[own[low]]))
        return None

    def beside_m2(self, index: int) -> float:
        """Ground of other floors under what is open at a floor's height: the hall below a gallery, the other wing."""
        at, height_m = self.ground, self.floors[index].elevation_m
        over = (at.ground_m < height_m + _BESIDE_M) & (at.ground_m + at.headroom_m > height_m + WALL_CUT_M)
        return float(np.count_nonzero((at.floor != index) & over)) * at.square_m2

    def enclosed_m2(self, index: int) -> float:
        """Area between the walls around a floor's ground at the height of a cut; terrain is no wall."""
        scene, floor = self.scene, self.floors[index]
        own_m = self.ground.plan_m[self.ground.floor == index]
        site = np.array([element.kind in SITE_KINDS for element in scene.elements], dtype=np.bool_)
        around_m = floor.bounds_m + np.array([[-_AROUND_M], [_AROUND_M]])
        cut = ~site[scene.element_of_triangle]
        _, segments_m = cut_of_scene(scene, cut, floor.elevation_m + WALL_CUT_M, around_m)
        if not len(own_m) or not len(segments_m):
            return 0.0
        ends_m = segments_m.reshape(-1, 2)
        low_m, high_m = ends_m.min(axis=0) - GAP_M, ends_m.max(axis=0) + GAP_M
        cell_m = max(_CELL_M, math.sqrt(float(np.prod(high_m - low_m)) / _MAX_CELLS))
        n_x, n_y = (np.floor((high_m - low_m) / cell_m).astype(np.int64) + 1).tolist()
        inside = between_walls(cut_cells(segments_m, low_m, cell_m, (n_y, n_x)), cell_m)
        label, _ = ndimage.label(inside)
        ix, iy = np.rint((own_m - low_m) / cell_m).astype(np.int64).T
        on_grid = (ix >= 0) & (ix < n_x) & (iy >= 0) & (iy < n_y)
        around = np.unique(label[iy[on_grid], ix[on_grid]])
        return float(np.isin(label, around[around > 0]).sum()) * cell_m * cell_m
