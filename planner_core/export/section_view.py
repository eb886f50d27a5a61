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

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Float32Array, FloatArray, Floor, Int32Array, Plan, Survey
from planner_core.scan.engine import ScanEngine
from planner_core.scene.patches import patch_of_points

CUT_HEIGHT_M = 1.2
"""Above the ground: through doors and windows, above tables. What architects cut floor plans at."""

BELOW_GROUND_M = 0.5
"""Steps and lower parts down to here are shown; farther down it is another floor's picture."""

_BEAMS_AT_ONCE = 400_000
"""Bounds memory to some 100 MB."""


@dataclass(frozen=True)
class Camera:
    """Parallel projection. right, up, forward : (3,) unit vectors, local; forward looks down (forward[2] < 0)."""

    right: FloatArray
    up: FloatArray
    forward: FloatArray

    def project(self, points_m: FloatArray) -> FloatArray:
        """(N, 2) metres on the view plane of points (N, 3)."""
        return np.stack([points_m @ self.right, points_m @ self.up], axis=1)

    def on_plane(self, u_m: FloatArray, v_m: FloatArray, z_m: float) -> FloatArray:
        """(N, 3) points of the plane z = z_m that the camera shows at (u, v), each (N,)."""
        points: FloatArray = u_m[:, None] * self.right + v_m[:, None] * self.up
        points += self.forward * ((z_m - points[:, 2]) / self.forward[2])[:, None]
        return points


@dataclass(frozen=True)
class SectionView:
    """What every pixel shows; row 0 is the top.

    window_m : (2, 2) [[u_min, v_min], [u_max, v_max]] on the camera's plane.
    triangle, patch : (H, W) int32, -1 where there is nothing.
    depth_m : (H, W) float32 along the beam from the cutting plane, NaN there.
    facing : (H, W) float32 in [0, 1], cosine between the surface's normal and the direction to the eye, NaN there.
    """

    camera: Camera
    window_m: FloatArray
    pixel_m: float
    cut_m: float
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
    above = [other.elevation_m for other in plan.survey.floors if other.elevation_m > floor.elevation_m + 0.5]
    return min([floor.elevation_m + CUT_HEIGHT_M, *(0.5 * (floor.elevation_m + z) for z in above)])


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
    pixel_m = float(window_m[1, 0] - window_m[0, 0]) / width
    height = max(1, round(float(window_m[1, 1] - window_m[0, 1]) / pixel_m))
    n_pixels = width * height
    reach_m = (cut_m - ground_m + BELOW_GROUND_M) / -float(camera.forward[2])
    parts = []
    for start in range(0, n_pixels, _BEAMS_AT_ONCE):
        row, column = np.divmod(np.arange(start, min(start + _BEAMS_AT_ONCE, n_pixels)), width)
        u = window_m[0, 0] + (column + 0.5) * pixel_m
        v = window_m[1, 1] - (row + 0.5) * pixel_m
        parts.append(_look(survey, engine, camera, camera.on_plane(u, v, cut_m), reach_m))
    triangle, patch, depth_m, facing = (
        np.concatenate(part).reshape(height, width) for part in zip(*parts, strict=True)
    )
    return SectionView(camera, window_m, pixel_m, cut_m, triangle, patch, depth_m, facing)


def _look(
    survey: Survey, engine: ScanEngine, camera: Camera, origins: FloatArray, reach_m: float
) -> tuple[Int32Array, Int32Array, Float32Array, Float32Array]:
    """Triangle, patch, depth and facing of the beams that start at `origins` (N, 3)."""
    hits = engine.cast_rays(origins, np.broadcast_to(camera.forward, origins.shape), range_max_m=reach_m)
    points_m = origins + camera.forward * np.where(hits.triangle >= 0, hits.range_m, 0)[:, None].astype(np.float64)
    patch = patch_of_points(survey.scene, survey.patches, points_m=points_m, triangle=hits.triangle)
    return hits.triangle, patch, hits.range_m, _facing(survey, camera, hits.triangle)


def _facing(survey: Survey, camera: Camera, triangle: Int32Array) -> Float32Array:
    used, index = np.unique(triangle, return_inverse=True)
    corners = survey.scene.vertices_m[survey.scene.triangles[np.maximum(used, 0)]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    cosine = np.abs(normal @ camera.forward) / length
    return np.where(triangle >= 0, cosine[index.ravel()], np.nan).astype(np.float32)


def inside_solid(survey: Survey, view: SectionView, ground_triangles: Int32Array) -> BoolArray:
    """(H, W) bool: pixels whose beam starts inside a solid: the cut walls.

    Decided element by element by the even-odd rule on the lines in which it crosses the cutting plane, so that neither
    winding nor coincident faces matter. Ground that the element shows from above is no solid: a room modelled as one
    closed surface is a room.
    """
    height, width = view.triangle.shape
    row, column = np.divmod(np.arange(height * width), width)
    u = view.window_m[0, 0] + (column + 0.5) * view.pixel_m
    v = view.window_m[1, 1] - (row + 0.5) * view.pixel_m
    starts_m = view.camera.on_plane(u, v, view.cut_m)
    low_m, step_m = starts_m[:, :2].min(axis=0), view.pixel_m
    shape = np.ceil((starts_m[:, :2].max(axis=0) - low_m) / step_m).astype(int) + 1
    solid_element = _even_odd_fill(survey, view.cut_m, low_m, step_m, (int(shape[1]), int(shape[0])))
    cell = np.rint((starts_m[:, :2] - low_m) / step_m).astype(int)
    element = solid_element[cell[:, 1], cell[:, 0]].reshape(height, width)
    below = survey.scene.element_of_triangle[np.maximum(view.triangle, 0)]
    own_ground = np.isin(view.triangle, ground_triangles) & (below == element)
    solid: BoolArray = (element >= 0) & ~own_ground
    return solid


def _even_odd_fill(
    survey: Survey, cut_m: float, low_m: FloatArray, step_m: float, shape: tuple[int, int]
) -> Int32Array:
    """(rows, columns) int32: an element whose section contains the cell's centre; -1 where none does.

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
    filled = np.full(shape, -1, dtype=np.int32)
    for k in enters:
        from_column = max(int(np.ceil(at[k])), 0)
        filled[row[k], from_column : max(int(np.ceil(at[k + 1])), from_column)] = element[k]
    return filled


def section_lines(survey: Survey, cut_m: float) -> FloatArray:
    """(K, 2, 3) float64: the lines in which triangles cross the plane z = cut_m, local frame."""
    return _section(survey, cut_m)[0]


def _section(survey: Survey, cut_m: float) -> tuple[FloatArray, Int32Array]:
    """Section lines (K, 2, 3) and the element of each (K,)."""
    corners = survey.scene.vertices_m[survey.scene.triangles]
    above = corners[:, :, 2] > cut_m
    cut = above.any(axis=1) & ~above.all(axis=1)
    corners, element = corners[cut], survey.scene.element_of_triangle[cut]
    ends = np.full((len(corners), 3, 3), np.nan)
    for edge in range(3):
        a, b = corners[:, edge], corners[:, (edge + 1) % 3]
        crosses = (a[:, 2] > cut_m) != (b[:, 2] > cut_m)
        share = (cut_m - a[crosses, 2]) / (b[crosses, 2] - a[crosses, 2])
        ends[crosses, edge] = a[crosses] + share[:, None] * (b[crosses] - a[crosses])
    # Exactly two of the three edges cross; the stable sort brings these two to the front.
    order = np.argsort(np.isnan(ends[:, :, 0]), axis=1, kind="stable")[:, :2]
    return np.take_along_axis(ends, order[:, :, None], axis=1), element
