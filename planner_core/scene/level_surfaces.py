"""The level surfaces of a scene, and what is above them: what floors are found from.

Local frame, metres. Windings are not trusted: what is a top side follows from plumb lines
(`planner_core.scene.columns`), by the clear height above.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Scene
from planner_core.model.arrays import area_normals, bounds_of, lengths
from planner_core.scene.array_rows import chunks
from planner_core.scene.columns import Columns, sample_scene
from planner_core.scene.extent import fence_m, is_outside, named_few

#: Ramps up to 10 degrees are ground; the steepest that building codes let people walk on is about 7.
MAX_SLOPE_RAD = np.deg2rad(10.0)
#: Clear height from which a surface may be the ground of a level. Crawl spaces and plenums are lower, lofts are not.
MIN_CLEAR_M = 1.5
#: Two levels are at least this far apart; nearer heights are parts of one level (split level), or furniture.
MIN_LEVEL_DISTANCE_M = 1.8
#: Walls are searched for at this height above the ground: over parapets and railings, below door heads.
WALL_CUT_M = 1.5
#: Plumb lines are this far apart; further on large sites, so that their number stays below `_MAX_COLUMNS`.
_STEP_M = 0.1
_MAX_COLUMNS = 400_000
#: Scenes higher than this have strays above or below: no building is.
_HIGHEST_M = 1000.0
#: Heights within this of each other are one surface of a level (uneven scans, thresholds, screeds).
SAME_HEIGHT_M = 0.15
MIN_AREA_M2 = 1.0
#: Both sides of a plate thinner than this may seem to have clear space above.
_THIN_M = 0.05


@dataclass(frozen=True)
class Ground:
    """A level before it has a number: `triangles`, and the plane at `elevation_m` in the pieces `plane_m`."""

    name: str
    origin: str
    elevation_m: float
    triangles: Int32Array
    area_m2: float
    bounds_m: FloatArray
    plane_m: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(R, 2, 2) rectangles in plan, see `planner_core.scene.ground_planes`."""


class LevelSurvey:
    """The scene with its plumb lines and what follows from them."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        n_triangles = scene.n_triangles
        self.area_m2: FloatArray = np.empty(n_triangles)
        self.level: BoolArray = np.empty(n_triangles, dtype=np.bool_)
        fence = _fence(scene)
        self.stray: BoolArray = np.empty(n_triangles, dtype=np.bool_)
        """(T,) Far outside the bulk: no floor is searched for there."""
        for some in chunks(n_triangles):
            corners_m = self.corners_of(some)
            cross = area_normals(corners_m)
            length = lengths(cross)
            self.area_m2[some] = 0.5 * length
            self.level[some] = np.abs(cross[:, 2]) >= np.cos(MAX_SLOPE_RAD) * length
            self.stray[some] = is_outside(corners_m, fence)
        self.columns, self.step_m = _plumb_lines(scene, np.flatnonzero(~self.stray).astype(np.int32), fence)
        self.clear_m = self.columns.clear_height_m()
        self.storey_of_element = np.array([e.storey for e in scene.elements], dtype=np.int64)

    @cached_property
    def spans_m(self) -> FloatArray:
        """(2, E) lowest and highest point of each element; inf and -inf where it has no faces."""
        low, high = (np.full(len(self.scene.elements), sign * np.inf) for sign in (1, -1))
        for some in chunks(self.scene.n_triangles):
            z_m = self.scene.vertices_m[:, 2][self.scene.triangles[some]]
            element = self.scene.element_of_triangle[some]
            lowest_m, highest_m = bounds_of(z_m)
            np.minimum.at(low, element, lowest_m)
            np.maximum.at(high, element, highest_m)
        return np.stack([low, high])

    @property
    def cell_m2(self) -> float:
        """Area that one plumb line stands for."""
        return self.step_m * self.step_m

    def corners_of(self, triangles: Int32Array | slice) -> FloatArray:
        """(K, 3, 3) corners of some triangles, made anew: of all of them they are most of what planning holds."""
        corners_m: FloatArray = self.scene.vertices_m[self.scene.triangles[triangles]]
        return corners_m

    def middles_of(self, triangles: Int32Array) -> FloatArray:
        """(K, 3) centroids of some triangles."""
        middle_m = np.empty((triangles.size, 3))
        for some in chunks(triangles.size):
            middle_m[some] = self.corners_of(triangles[some]).mean(axis=1)
        return middle_m

    def cut_of(self, triangles: BoolArray, z_m: float, bounds_m: FloatArray | None = None) -> tuple[float, FloatArray]:
        """`cut_length` of some triangles (T,)."""
        return cut_of_scene(self.scene, triangles, z_m, bounds_m)

    def walls_around(self, bounds_m: FloatArray, ground_m: float) -> bool:
        """Tell whether walls stand on ground: at `WALL_CUT_M` they are half as long as its bounds' perimeter."""
        length, _ = self.cut_of(~self.level & ~self.stray, ground_m + WALL_CUT_M, bounds_m)
        return length >= float((bounds_m[1] - bounds_m[0]).sum())

    def bounds_of(self, triangles: Int32Array) -> FloatArray:
        """(2, 2) bounds in plan."""
        plan = self.corners_of(triangles)[:, :, :2].reshape(-1, 2)
        return np.stack([plan.min(axis=0), plan.max(axis=0)])


def _fence(scene: Scene) -> FloatArray:
    """(2, 3) box to find floors in, infinite unless that would pull the plumb lines apart or is very tall."""
    everywhere = np.array([[np.inf] * 3, [-np.inf] * 3])
    for some in chunks(scene.n_triangles):
        _widen(everywhere, scene.vertices_m[scene.triangles[some]].reshape(-1, 3))
    size = everywhere[1] - everywhere[0]
    if size[0] * size[1] <= _MAX_COLUMNS * _STEP_M * _STEP_M and size[2] <= _HIGHEST_M:
        return everywhere
    fence = fence_m(scene.vertices_m[scene.triangles])
    return np.stack([np.maximum(fence[0], everywhere[0]), np.minimum(fence[1], everywhere[1])])


def strays_named(survey: LevelSurvey) -> list[str]:
    """A line about faces that are not searched, for the user; none where there are none."""
    if not survey.stray.any():
        return []
    names = [survey.scene.elements[i].name for i in survey.scene.element_of_triangle[survey.stray].tolist()]
    return [
        f"faces that lie far from the rest are not searched for floors: {int(survey.stray.sum())} of {named_few(names)}"
    ]


def _plumb_lines(scene: Scene, ids: Int32Array, fence: FloatArray) -> tuple[Columns, float]:
    bounds, of_all = (np.array([[np.inf] * 2, [-np.inf] * 2]) for _ in range(2))
    for some in chunks(ids.size):
        corners_m = scene.vertices_m[scene.triangles[ids[some]]]
        lowest_m, highest_m = bounds_of(corners_m)
        within = ((lowest_m >= fence[0]) & (highest_m <= fence[1])).all(axis=1)  # none reaches far out
        _widen(bounds, corners_m[within][:, :, :2].reshape(-1, 2))
        _widen(of_all, corners_m[:, :, :2].reshape(-1, 2))
    plan = bounds if np.isfinite(bounds).all() else of_all
    low, high = np.maximum(plan.min(axis=0), fence[0, :2]), np.minimum(plan.max(axis=0), fence[1, :2])
    step = max(_STEP_M, float(np.sqrt(np.prod(high - low) / _MAX_COLUMNS)))
    # Off the round figures that designers align walls to: a line along a wall's face is ambiguous.
    start = low + step * np.array([0.37, 0.43])
    shape = np.maximum(np.floor((high - start) / step) + 1, 1).astype(int)
    return sample_scene(scene, ids, low_m=start, step_m=step, shape=(int(shape[0]), int(shape[1]))), step


def _widen(bounds: FloatArray, points: FloatArray) -> None:
    """Let bounds (2, K) reach round points (N, K) as well."""
    np.minimum(bounds[0], points.min(axis=0, initial=np.inf), out=bounds[0])
    np.maximum(bounds[1], points.max(axis=0, initial=-np.inf), out=bounds[1])


def cut_of_scene(
    scene: Scene, triangles: BoolArray, z_m: float, bounds_m: FloatArray | None = None
) -> tuple[float, FloatArray]:
    """`cut_length` of some of a scene's triangles (T,), a chunk at a time."""
    z, ids = scene.vertices_m[:, 2], np.flatnonzero(triangles).astype(np.int32)
    cut = [np.empty(0, dtype=np.int32)]
    for some in chunks(ids.size):
        lowest_m, highest_m = bounds_of(z[scene.triangles[ids[some]]] - z_m)
        cut.append(ids[some][(lowest_m < 0) & (highest_m >= 0)])
    return cut_length(scene.vertices_m[scene.triangles[np.concatenate(cut)]], z_m, bounds_m)


def cut_length(corners_m: FloatArray, z_m: float, bounds_m: FloatArray | None = None) -> tuple[float, FloatArray]:
    """Length of the cut of triangles (K, 3, 3) with the plane z = z_m, and the segments' ends (M, 2, 2).

    bounds_m : only segments whose middle lies inside, with half a metre of margin.
    """
    height = corners_m[:, :, 2] - z_m
    lowest, highest = bounds_of(height)
    crossing = (lowest < 0) & (highest >= 0)
    corners, height = corners_m[crossing], height[crossing]
    # Turn each triangle so that its first corner is alone on its side of the plane; edges 0-1 and 0-2 are cut.
    below = height < 0
    alone = np.where(below.sum(axis=1) == 1, np.argmax(below, axis=1), np.argmax(~below, axis=1))
    rows = np.arange(alone.size)
    ends = []
    for other in (1, 2):
        b = (alone + other) % 3
        h0, h1 = height[rows, alone], height[rows, b]
        t = (h0 / (h0 - h1))[:, None]
        ends.append(corners[rows, alone, :2] * (1 - t) + corners[rows, b, :2] * t)
    segments = np.stack(ends, axis=1) if rows.size else np.empty((0, 2, 2))
    if bounds_m is not None:
        middle = segments.mean(axis=1)
        segments = segments[((middle >= bounds_m[0] - 0.5) & (middle <= bounds_m[1] + 0.5)).all(axis=1)]
    return float(np.sqrt(((segments[:, 1] - segments[:, 0]) ** 2).sum(axis=1)).sum()), segments


def once_a_surface(columns: Columns, samples: BoolArray) -> FloatArray:
    """Heights of `samples`, of both sides of a thin plate (coverings) only the upper one."""
    column, z_m = columns.column[samples], columns.z_m[samples]
    lower_side = (column[1:] == column[:-1]) & (z_m[1:] - z_m[:-1] <= _THIN_M)
    shown: FloatArray = z_m[np.append(~lower_side, True)]
    return shown


def main_height_m(z_m: FloatArray, *, lowest_share: float = 1.0) -> float:
    """Height around which most of the crossings lie; the lowest one that has this share of the most."""
    bin_m = SAME_HEIGHT_M / 3
    index = np.floor((z_m - z_m.min()) / bin_m).astype(np.int64)
    # Only bins that hold something, and those around them: heights may lie anywhere.
    filled, count = np.unique(index, return_counts=True)
    before = np.concatenate([[0], np.cumsum(count)])
    middle = np.unique(filled[:, None] + np.arange(-2, 3))
    middle = middle[(middle >= 0) & (middle <= filled[-1])]
    first, end = np.searchsorted(filled, middle - 2), np.searchsorted(filled, middle + 2, side="right")
    window = before[end] - before[first]
    start = int(np.argmax(window >= lowest_share * window.max()))
    stop = int(np.searchsorted(middle, middle[start] + 4, side="right"))  # the best of the same surface
    best = middle[start + int(np.argmax(window[start:stop]))]
    return float(np.median(z_m[np.abs(index - best) <= 2]))


def mostly(survey: LevelSurvey, samples: BoolArray, eligible: BoolArray) -> Int32Array:
    """Level, eligible triangles with a twentieth of their crossings in `samples`, and small ones in their plane.

    A twentieth, since most of a floor may be under furniture; triangles too small for a plumb line of their own go
    with a crossing of the nearest line at the same height.
    """
    columns, n_triangles = survey.columns, survey.scene.n_triangles
    n_all = np.bincount(columns.triangle, minlength=n_triangles)
    n_in = np.bincount(columns.triangle[samples], minlength=n_triangles)
    chosen = survey.level & eligible & (n_in > 0) & (n_in >= 0.05 * n_all)
    small = np.flatnonzero(survey.level & eligible & (n_all == 0) & ~survey.stray)
    if small.size:
        centre = survey.middles_of(small.astype(np.int32))
        grid = np.array([columns.x_m[0], columns.y_m[0]])
        index = np.rint((centre[:, :2] - grid) / survey.step_m).astype(np.int64)
        index = np.clip(index, 0, [columns.x_m.size - 1, columns.y_m.size - 1])
        # Compared in steps of 5 cm and the two beside them.
        wanted = (index[:, 1] * columns.x_m.size + index[:, 0], np.floor(centre[:, 2] / 0.05))
        have = _keys(columns.column[samples], np.floor(columns.z_m[samples] / 0.05))
        chosen[small] = np.logical_or.reduce([np.isin(_keys(wanted[0], wanted[1] + d), have) for d in (-1, 0, 1)])
    return np.flatnonzero(chosen).astype(np.int32)


def _keys(column: Int64Array, height: FloatArray) -> Int64Array:
    return column * (1 << 22) + height.astype(np.int64)


def ground_of(
    survey: LevelSurvey, name: str, origin: str, triangles: Int32Array, shown: BoolArray, clear: BoolArray
) -> Ground:
    """Ground of `triangles`. `shown`: crossings that no other ground covers; `clear`: those with space above."""
    columns = survey.columns
    n_all = np.bincount(columns.triangle, minlength=survey.scene.n_triangles)[triangles]
    n_shown = np.bincount(columns.triangle[shown], minlength=survey.scene.n_triangles)[triangles]
    share = np.where(n_all > 0, n_shown / np.maximum(n_all, 1), 1.0)
    overlap = np.unique(columns.column[shown]).size / max(int(shown.sum()), 1)
    return Ground(
        name=name,
        origin=origin,
        elevation_m=float(np.median(columns.z_m[clear])),
        triangles=triangles,
        area_m2=float((survey.area_m2[triangles] * share).sum() * overlap),
        bounds_m=survey.bounds_of(triangles),
    )
