"""Pictures of a floor cut open, taken by the scan engine itself: parallel beams that start on the cutting plane.

Survey, Floor, ScanEngine -> SectionView, one surface a pixel. No graphics driver is needed, and what a pixel shows is
decided by the same geometry that was planned on. Local frame, metres.

         view plane (u right, v up)
              \\   \\   \\   \\        beams along `forward`
    - - - - - -\\- -\\- -\\- -\\- -     cutting plane z = cut_m: beams start here
         |      |   \\   \\  |
         |______|____\\___\\_|       floor
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from planner_core.engine.hit_rows import patch_of_pixels
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    Float32Array,
    FloatArray,
    Floor,
    Int32Array,
    Int64Array,
    Plan,
    Scene,
    Survey,
    UInt8Array,
)
from planner_core.model.arrays import area_normals
from planner_core.scene.columns import sample_columns
from planner_core.scene.floors import ground_span_m
from planner_core.scene.inside import ROOM_WIDTH_M, encloses_room

CUT_HEIGHT_M = 1.2
"""Above the ground: through doors and windows, above tables. What architects cut floor plans at."""

BELOW_GROUND_M = 0.5
"""Steps and lower parts down to here are shown; farther down it is another floor's picture."""

_BEAMS_AT_ONCE = 100_000
"""Few enough for the processor's cache, and they bound memory."""


@dataclass(frozen=True)
class Camera:
    """Parallel projection. right, up, forward : (3,) unit vectors, local; forward looks down (forward[2] < 0)."""

    right: FloatArray
    up: FloatArray
    forward: FloatArray

    @property
    def looks_down(self) -> bool:
        """Whether this is the view of maps, see `camera_from_above`."""
        return bool(self.right[0] == 1 and self.up[1] == 1)

    def project(self, points_m: FloatArray) -> FloatArray:
        """(N, 2) metres on the view plane of points (N, 3)."""
        return np.stack([points_m @ self.right, points_m @ self.up], axis=1)

    def on_plane(self, u_m: FloatArray, v_m: FloatArray, z_m: float) -> FloatArray:
        """(..., 3) points of the plane z = z_m that the camera shows at (u, v), which broadcast to (...)."""
        right, up = (axis - self.forward * (axis[2] / self.forward[2]) for axis in (self.right, self.up))
        points_m = np.empty((*np.broadcast_shapes(u_m.shape, v_m.shape), 3))
        for axis, origin_m in enumerate(self.forward * (z_m / self.forward[2])):
            points_m[..., axis] = u_m * right[axis] + (v_m * up[axis] + origin_m)
        return points_m


@dataclass(frozen=True)
class SectionView:
    """What every pixel shows; row 0 is the top.

    window_m : (2, 2) [[u_min, v_min], [u_max, v_max]] on the camera's plane.
    triangle, patch : (H, W) int32, -1 where there is nothing.
    depth_m : (H, W) float32 along the beam from the cutting plane, NaN there.
    facing : (H, W) float32 in [0, 1], cosine between the surface's normal and the direction to the eye, NaN there.
    level : (H, W) into cuts_m, the height at which the building is cut there; split levels have several.
    """

    camera: Camera
    window_m: FloatArray
    pixel_m: float
    cuts_m: tuple[float, ...]
    level: UInt8Array
    triangle: Int32Array
    patch: Int32Array
    depth_m: Float32Array
    facing: Float32Array

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """u_min, u_max, v_min, v_max: what a plotting library wants."""
        (u_min, v_min), (u_max, v_max) = self.window_m
        return (float(u_min), float(u_max), float(v_min), float(v_max))


def camera_from_above() -> Camera:
    """Map view: x to the right, y up."""
    return Camera(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0]))


def camera_at(*, azimuth_rad: float, elevation_rad: float) -> Camera:
    """Look down by `elevation_rad` towards the azimuth `azimuth_rad` (counter-clockwise from +x)."""
    ahead = np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    right = np.array([np.sin(azimuth_rad), -np.cos(azimuth_rad), 0.0])
    forward = ahead * np.cos(elevation_rad) - np.array([0.0, 0.0, np.sin(elevation_rad)])
    return Camera(right, np.cross(right, forward), forward)


def cut_height_m(plan: Plan, floor: Floor) -> float:
    """Height of the cutting plane of `floor`, local: a little above the ground, and below the next floor's ground."""
    return cut_above_m(plan, ground_span_m(plan.survey.scene, floor)[1])


def cut_above_m(plan: Plan, ground_m: float) -> float:
    """The same over ground at a height."""
    above = [other.elevation_m for other in plan.survey.floors if other.elevation_m > ground_m + 0.5]
    return min([ground_m + CUT_HEIGHT_M, *(0.5 * (ground_m + z) for z in above)])


def view_section(
    survey: Survey,
    engine: ScanEngine,
    camera: Camera,
    *,
    ground_m: float,
    cut_m: float,
    window_m: FloatArray,
    width: int,
) -> SectionView:
    """Look at what is between the cutting plane and a little below the ground.

    Parameters
    ----------
    ground_m, cut_m
        Heights, local.
    window_m
        (2, 2) on the camera's plane, see `SectionView`.
    width
        Pixels; the height follows from the window.
    """
    pixel_m, height = _pixels(window_m, width)
    reach_m = _reach_m(camera, ground_m, cut_m)
    parts = []
    n_rows = max(1, _BEAMS_AT_ONCE // width)
    for first in range(0, height, n_rows):
        rows = range(first, min(first + n_rows, height))
        starts_m = _starts_m(camera, window_m, pixel_m, cut_m, rows, width).reshape(-1, 3)
        parts.append(_look(survey, engine, camera, starts_m, reach_m))
    triangle, patch, depth_m = (np.concatenate(part).reshape(height, width) for part in zip(*parts, strict=True))
    facing = _facing(survey, camera, triangle)
    level = np.zeros((height, width), dtype=np.uint8)
    return SectionView(camera, window_m, pixel_m, (cut_m,), level, triangle, patch, depth_m, facing)


def joined_views(views: Sequence[SectionView], ground_m: Sequence[FloatArray]) -> SectionView:
    """One view of several levels: each pixel as the level shows it whose ground is nearest to it.

    views : from above, of one window, cut once each. ground_m : triangles (K, 3, 3), local, of each.
    """
    if len(views) == 1:
        return views[0]
    away = []
    for view, corners_m in zip(views, ground_m, strict=True):
        shown = _covered_pixels(view, corners_m)
        away.append(distance_transform_edt(~shown) if shown.any() else np.full(shown.shape, np.inf))
    level = np.argmin(away, axis=0).astype(np.uint8)
    triangle, patch, depth_m, facing = (
        np.choose(level, [getattr(view, name) for view in views]) for name in ("triangle", "patch", "depth_m", "facing")
    )
    cuts_m = tuple(view.cuts_m[0] for view in views)
    return replace(views[0], cuts_m=cuts_m, level=level, triangle=triangle, patch=patch, depth_m=depth_m, facing=facing)


def _covered_pixels(view: SectionView, corners_m: FloatArray) -> BoolArray:
    """(H, W) bool: pixels of a view from above that triangles (K, 3, 3) lie under."""
    height, width = view.triangle.shape
    low_m = np.array([view.window_m[0, 0], view.window_m[1, 1] - height * view.pixel_m]) + 0.5 * view.pixel_m
    number = np.arange(len(corners_m), dtype=np.int32)
    met = sample_columns(corners_m, number, low_m=low_m, step_m=view.pixel_m, shape=(width, height))
    covered = np.zeros(width * height, dtype=np.bool_)
    covered[met.column] = True
    return covered.reshape(height, width)[::-1]


def _pixels(window_m: FloatArray, width: int) -> tuple[float, int]:
    """Side of a pixel in metres, and the height of the picture in pixels."""
    pixel_m = float(window_m[1, 0] - window_m[0, 0]) / width
    return pixel_m, max(1, round(float(window_m[1, 1] - window_m[0, 1]) / pixel_m))


def _reach_m(camera: Camera, ground_m: float, cut_m: float) -> float:
    """How far beams go: to a little below the ground."""
    return (cut_m - ground_m + BELOW_GROUND_M) / -float(camera.forward[2])


def _starts_m(
    camera: Camera, window_m: FloatArray, pixel_m: float, cut_m: float, rows: range, width: int
) -> FloatArray:
    """(R, W, 3) local: where the beams of these rows of pixels start on the cutting plane."""
    u = window_m[0, 0] + (np.arange(width) + 0.5) * pixel_m
    v = window_m[1, 1] - (np.arange(rows.start, rows.stop) + 0.5) * pixel_m
    return camera.on_plane(u[None, :], v[:, None], cut_m)


def _look(
    survey: Survey, engine: ScanEngine, camera: Camera, starts_m: FloatArray, reach_m: float
) -> tuple[Int32Array, Int32Array, Float32Array]:
    """Triangle, patch and depth of the beams that start at (N, 3)."""
    hits = engine.cast_rays(starts_m, np.broadcast_to(camera.forward, starts_m.shape), range_max_m=reach_m)
    points_m = starts_m + camera.forward * np.where(hits.triangle >= 0, hits.range_m, 0)[:, None].astype(np.float64)
    patch = patch_of_pixels(survey.scene, survey.patches, points_m=points_m, triangle=hits.triangle)
    return hits.triangle, patch, hits.range_m


def _facing(survey: Survey, camera: Camera, triangle: Int32Array) -> Float32Array:
    scene = survey.scene
    used = np.flatnonzero(marked(triangle[triangle >= 0], scene.n_triangles))
    corners = scene.vertices_m[scene.triangles[used]]
    normal = area_normals(corners)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    cosine = np.full(scene.n_triangles + 1, np.nan, dtype=np.float32)  # the last stands for no triangle, -1
    cosine[used] = np.abs(normal @ camera.forward) / length
    return cosine[triangle]


def marked(triangles: Int32Array, n_triangles: int) -> BoolArray:
    """(n_triangles + 1,) bool: which triangles are among `triangles`; False at the end, where -1 looks."""
    there = np.zeros(n_triangles + 1, dtype=np.bool_)
    there[triangles] = True
    return there


def inside_solid(survey: Survey, view: SectionView, floor: Floor) -> BoolArray:
    """(H, W) bool: pixels whose beam starts inside a solid: the cut walls.

    Decided element by element by the even-odd rule on the lines in which it crosses the cutting plane, so that neither
    winding nor coincident faces matter. What encloses a room is no solid, see `encloses_room`.
    """
    height, width = view.triangle.shape
    element = np.full(view.triangle.shape, -1, dtype=np.int32)
    for number, cut_m in enumerate(view.cuts_m):
        here = view.level == number
        if view.camera.looks_down:
            around = _elements_from_above(survey, floor, cut_m, view.window_m, view.pixel_m, (height, width))
        else:
            starts_m = _starts_m(view.camera, view.window_m, view.pixel_m, cut_m, range(height), width)
            around = _element_around(survey, floor, cut_m, starts_m, view.pixel_m)
        element[here] = around[here]
    return np.asarray(element >= 0)


def solid_cells(
    survey: Survey, *, floor: Floor, cut_m: float, window_m: FloatArray, width: int
) -> tuple[BoolArray, float]:
    """`inside_solid` of `floor` seen from above, and the side of a cell in metres; parameters as of `view_section`."""
    cell_m, height = _pixels(window_m, width)
    return np.asarray(_elements_from_above(survey, floor, cut_m, window_m, cell_m, (height, width)) >= 0), cell_m


def _elements_from_above(
    survey: Survey, floor: Floor, cut_m: float, window_m: FloatArray, cell_m: float, shape: tuple[int, int]
) -> Int32Array:
    """(H, W) int32: an element in which cells of a window are that is seen from above; -1 for none, and in rooms."""
    low_m = np.array([window_m[0, 0], window_m[1, 1] - shape[0] * cell_m]) + 0.5 * cell_m
    return np.asarray(_even_odd_fill(survey, floor, cut_m, low_m, cell_m, shape)[::-1])


def _element_around(survey: Survey, floor: Floor, cut_m: float, starts_m: FloatArray, step_m: float) -> Int32Array:
    """(H, W) int32: an element in which points (H, W, 3) of the cutting plane lie; -1 for none, and in rooms."""
    x, y = starts_m[..., 0], starts_m[..., 1]
    low_m = np.array([x.min(), y.min()])
    shape = np.ceil((np.array([x.max(), y.max()]) - low_m) / step_m).astype(int) + 1
    filled = _even_odd_fill(survey, floor, cut_m, low_m, step_m, (int(shape[1]), int(shape[0])))
    row, column = (np.rint((value - least) / step_m).astype(int) for value, least in ((y, low_m[1]), (x, low_m[0])))
    element: Int32Array = filled[row, column]
    return element


def _even_odd_fill(
    survey: Survey, floor: Floor, cut_m: float, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Int32Array:
    """(rows, columns) int32: an element whose section contains the cell's centre; -1 where none does, and in rooms.

    Cell (r, c) has its centre at low_m + step_m * (c, r).
    """
    lines, line_element = _section(survey, cut_m)
    ends = (lines[:, :, :2] - low_m) / step_m
    first = np.ceil(ends[:, :, 1].min(axis=1)).astype(np.int64)
    count = np.ceil(ends[:, :, 1].max(axis=1)).astype(np.int64) - first
    line = np.repeat(np.arange(len(ends)), count)
    row = np.arange(line.size) - np.repeat(np.cumsum(count) - count, count) + first[line]
    line, row = line[(row >= 0) & (row < shape[0])], row[(row >= 0) & (row < shape[0])]
    a, b = ends[line, 0], ends[line, 1]
    at = a[:, 0] + (row - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    order = np.lexsort((at, row, line_element[line]))
    at, row, element = at[order], row[order], line_element[line[order]]
    # Crossings of one element in one row pair up; an odd number means an open surface, which has no inside.
    key = element.astype(np.int64) * shape[0] + row
    _, start, n_in_row = np.unique(key, return_index=True, return_counts=True)
    rank = np.arange(key.size) - np.repeat(start, n_in_row)
    enters = np.flatnonzero((rank % 2 == 0) & np.repeat(n_in_row % 2 == 0, n_in_row))
    first, end = (np.clip(np.ceil(at[k]), 0, shape[1]).astype(np.int64) for k in (enters, enters + 1))
    runs = np.column_stack([row[enters], first, end])
    filled = np.full(shape, -1, dtype=np.int32)
    for of in np.split(np.arange(len(runs)), np.flatnonzero(np.diff(element[enters])) + 1):
        number, rooms = int(element[enters[of[0]]]) if of.size else -1, None
        if _may_hold_rooms(runs[of], step_m):
            rooms = _rooms_within(survey, floor, cut_m, low_m, step_m, runs[of], number)
        for r, a, b in runs[of].tolist():
            filled[r, a:b] = number if rooms is None else np.where(rooms[r, a:b], filled[r, a:b], number)
    return filled


def _may_hold_rooms(runs: Int64Array, step_m: float) -> bool:
    """Tell whether runs (K, 3) of cells, row, first and end, have the width of a room across in as many rows."""
    wide = runs[:, 2] - runs[:, 1] >= ROOM_WIDTH_M / step_m - 1
    return bool(np.unique(runs[wide, 0]).size >= ROOM_WIDTH_M / step_m - 1)


def _rooms_within(
    survey: Survey, floor: Floor, cut_m: float, low_m: FloatArray, step_m: float, runs: Int64Array, element: int
) -> BoolArray:
    """(rows, columns) bool, up to the last of the runs (K, 3) of one element: cells that are in rooms."""
    inside = np.zeros((int(runs[:, 0].max()) + 1, int(runs[:, 2].max()) + 1), dtype=np.bool_)
    for r, a, b in runs.tolist():
        inside[r, a:b] = True
    part, n_parts = label(inside)
    half = np.zeros(n_parts + 1)
    # Cells beyond the drawing's edge are not in the area, so that a room cut off by it is as wide as what is shown.
    np.maximum.at(half, part, distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1])
    is_room = np.zeros(n_parts + 1, dtype=np.bool_)
    for number in np.flatnonzero(2 * half * step_m >= ROOM_WIDTH_M).tolist():
        plan_m = low_m + step_m * np.argwhere(part == number)[:, ::-1]
        width_m = 2 * float(half[number]) * step_m
        is_room[number] = encloses_room(
            survey.scene, floor, element=element, plan_m=plan_m, width_m=width_m, cut_m=cut_m
        )
    rooms: BoolArray = is_room[part]
    return rooms


def section_lines(survey: Survey, cut_m: float) -> FloatArray:
    """(K, 2, 3) float64: the lines in which triangles cross the plane z = cut_m, local frame."""
    return _section(survey, cut_m)[0]


def view_lines_m(survey: Survey, view: SectionView) -> FloatArray:
    """(K, 2, 2) the lines in which the planes of a view cut the building, on the camera's plane."""
    found = []
    (u_min, _), (_, v_max) = view.window_m
    for number, cut_m in enumerate(view.cuts_m):
        lines_m = view.camera.project(section_lines(survey, cut_m).reshape(-1, 3)).reshape(-1, 2, 2)
        if len(view.cuts_m) > 1:
            middle = lines_m.mean(axis=1)
            column = np.clip((middle[:, 0] - u_min) / view.pixel_m, 0, view.level.shape[1] - 1).astype(np.int64)
            row = np.clip((v_max - middle[:, 1]) / view.pixel_m, 0, view.level.shape[0] - 1).astype(np.int64)
            lines_m = lines_m[view.level[row, column] == number]
        found.append(lines_m)
    return np.concatenate(found)


def _section(survey: Survey, cut_m: float) -> tuple[FloatArray, Int32Array]:
    """Section lines (K, 2, 3) and the element of each (K,)."""
    segments_m, triangle = plane_crossings(survey.scene, cut_m)
    heights_m = np.full((len(segments_m), 2, 1), cut_m)
    return np.concatenate([segments_m, heights_m], axis=2), survey.scene.element_of_triangle[triangle]


def plane_crossings(scene: Scene, z_m: float) -> tuple[FloatArray, Int64Array]:
    """Segments (K, 2, 2), local, in which triangles cross the plane z = z_m, and the triangle of each (K,).

    Ends are worked out from the lower to the upper vertex of an edge, so that its two triangles get the same bits.
    """
    above = scene.vertices_m[:, 2][scene.triangles] > z_m
    triangle = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    corners_m, above = scene.vertices_m[scene.triangles[triangle]], above[triangle]
    segments_m = np.zeros((len(triangle), 2, 2))
    found = np.zeros(len(triangle), dtype=np.int64)
    for edge in range(3):
        a, b = edge, (edge + 1) % 3
        crosses = np.flatnonzero(above[:, a] != above[:, b])
        up = above[crosses, b][:, None]
        low_m = np.where(up, corners_m[crosses, a], corners_m[crosses, b])
        high_m = np.where(up, corners_m[crosses, b], corners_m[crosses, a])
        share = (z_m - low_m[:, 2]) / (high_m[:, 2] - low_m[:, 2])
        segments_m[crosses, found[crosses]] = (low_m + share[:, None] * (high_m - low_m))[:, :2]
        found[crosses] += 1  # exactly two of the three edges cross
    return segments_m, triangle
