"""The unseen surface of one floor: its ground, and strips along its walls. Building, floor -> triangles, lines.

Plan coordinates, local frame, metres. Only what is near the floor is divided into patches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.export.section import kind_of
from planner_core.export.sheets.building import Building
from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.model.arrays import area_normals, bounds_of, dots
from planner_core.scene.inside import crossings
from planner_core.scene.patches import patch_triangles

#: Surface this upright is a wall: 72 degrees and more. As level as the other, ground.
_UPRIGHT, _LEVEL = 0.3, 0.9
#: Layers of one floor: coverings above the ground, slabs below it.
_ABOVE_M, _BELOW_M = 0.12, 0.35
#: Level surfaces this near above each other are one.
_SAME_M = 0.001
#: What stands upright and is no wall.
_THINGS = ("furniture", "stair", "railing")
#: Length of wall that is judged at once, and how much of it has to be missed to be marked.
_STRIP_M = 0.25
_LEAST_SHARE = 0.5
_LEAST_AREA_M2 = 0.08
#: Faces of one wall, drawn as one line: directions within 2 degrees, planes within 4 cm.
_DIRECTIONS = 90
_PLANE_M = 0.04


@dataclass(frozen=True, eq=False)
class FloorVisibility:
    """Of one floor. seen, missed, out_of_reach : level surface at the height of the ground, as triangles (N, 3, 2).

    Of level surfaces that lie on each other (a covering on its slab, the slab's underside) the topmost counts.
    A place may still be in several of them, where one lies on a part of the other: the first of the three is seen.
    missed : some allowed position sees it, no station does. out_of_reach : no allowed position sees it.
    walls : (K, 2, 2) ends of strips of wall of which at least half could be seen and is not.
    Nothing of it but `seen` is surface that need not be covered.
    """

    seen: FloatArray
    missed: FloatArray
    out_of_reach: FloatArray
    walls: FloatArray

    def moved(self, by_m: FloatArray) -> FloorVisibility:
        """The same, shifted by (2,) in plan."""
        parts = (self.seen + by_m, self.missed + by_m, self.out_of_reach + by_m, self.walls + by_m)
        return FloorVisibility(*parts)


def unseen_surface(building: Building, floor: int, *, height_m: FloatArray, window_m: FloatArray) -> FloorVisibility:
    """Find the unseen surface of the floor of that number.

    Parameters
    ----------
    height_m
        (2,) of the floor's ground and of its top, local.
    window_m
        (2, 2) in plan, local: what lies outside is left out.
    """
    low_m, high_m = height_m.tolist()
    corners_m, patch, ground, of_wall = _patches_near(building, low_m - _BELOW_M, high_m, window_m, floor)
    normal = area_normals(corners_m)
    twice_m2 = np.linalg.norm(normal, axis=1)
    middle_m = corners_m.mean(axis=1)
    seen, achievable, required = (of[patch] for of in (building.times_seen > 0, building.achievable, building.required))
    level = np.abs(normal[:, 2]) > _LEVEL * twice_m2
    level &= (middle_m[:, 2] > low_m - _BELOW_M) & (middle_m[:, 2] < low_m + _ABOVE_M)
    level[level] = ~_lies_under(middle_m[level], corners_m[level])
    plan_m = corners_m[:, :, :2]
    upright = achievable & required & (np.abs(normal[:, 2]) < _UPRIGHT * twice_m2)
    upright &= (middle_m[:, 2] >= low_m) & (middle_m[:, 2] < high_m) & of_wall
    return FloorVisibility(
        seen=plan_m[(level | ground) & seen],
        missed=plan_m[(level | ground) & achievable & required & ~seen],
        out_of_reach=plan_m[ground & ~achievable & required],
        walls=_strips(middle_m[upright, :2], normal[upright, :2], 0.5 * twice_m2[upright], ~seen[upright]),
    )


def _patches_near(
    building: Building, low_m: float, high_m: float, window_m: FloatArray, floor: int
) -> tuple[FloatArray, Int64Array, BoolArray, BoolArray]:
    """Patches of triangles near a floor: corners (N, 3, 3), numbers, whether they are its ground, and of no thing."""
    scene, patches = building.scene, building.patches
    corners_m = scene.vertices_m[scene.triangles]
    lowest_m, highest_m = bounds_of(corners_m)
    near = (highest_m[:, 2] >= low_m) & (lowest_m[:, 2] <= high_m)
    near &= ((highest_m[:, :2] >= window_m[0]) & (lowest_m[:, :2] <= window_m[1])).all(axis=1)
    ground = building.ground_of_triangle == floor
    triangle = np.flatnonzero(near | ground)
    part = replace(scene, triangles=scene.triangles[triangle])
    count = np.diff(patches.first_patch)[triangle].astype(np.int64)
    first = np.append(0, np.cumsum(count))
    some = replace(patches, depth=patches.depth[triangle], first_patch=first.astype(np.int32))
    number = np.arange(first[-1]) + np.repeat(patches.first_patch[triangle] - first[:-1], count)
    thing = np.array([kind_of(element) in _THINGS for element in scene.elements], dtype=np.bool_)
    of_wall = ~thing[scene.element_of_triangle[triangle]]
    return patch_triangles(part, some), number, np.repeat(ground[triangle], count), np.repeat(of_wall, count)


def _lies_under(middle_m: FloatArray, corners_m: FloatArray) -> BoolArray:
    """(N,) whether another of these level patches, (N, 3, 3), lies above the middle of each."""
    under = np.zeros(len(middle_m), dtype=np.bool_)
    for met in crossings(middle_m, corners_m):
        under[met.point[met.z_m > middle_m[met.point, 2] + _SAME_M]] = True
    return under


def _strips(middle_m: FloatArray, normal: FloatArray, area_m2: FloatArray, missed: BoolArray) -> FloatArray:
    """Strips of walls that are missed, of upright patches with these middles and normals in plan (N, 2)."""
    angle = np.mod(np.arctan2(normal[:, 1], normal[:, 0]), np.pi)
    direction = np.mod(np.rint(angle * _DIRECTIONS / np.pi), _DIRECTIONS).astype(np.int64)
    along, across = _axes(direction)
    plane = np.rint(dots(middle_m, across) / _PLANE_M).astype(np.int64)
    cell = np.floor(dots(middle_m, along) / _STRIP_M).astype(np.int64)
    keys, strip = np.unique(np.stack([direction, plane, cell], axis=1), axis=0, return_inverse=True)
    n = len(keys)
    all_m2 = np.bincount(strip.ravel(), weights=area_m2, minlength=n)
    missed_m2 = np.bincount(strip.ravel(), weights=np.where(missed, area_m2, 0.0), minlength=n)
    return _runs(keys[(missed_m2 >= _LEAST_SHARE * all_m2) & (missed_m2 >= _LEAST_AREA_M2)])


def _axes(direction: Int64Array) -> tuple[FloatArray, FloatArray]:
    """(N, 2) unit vectors along walls of these directions, and across them."""
    turn = direction * np.pi / _DIRECTIONS
    return np.stack([-np.sin(turn), np.cos(turn)], axis=1), np.stack([np.cos(turn), np.sin(turn)], axis=1)


def _runs(keys: Int64Array) -> FloatArray:
    """(K, 2, 2) ends of the runs of neighbouring strips (direction, plane, cell), which are sorted."""
    if not len(keys):
        return np.zeros((0, 2, 2))
    begins = np.ones(len(keys), dtype=np.bool_)
    begins[1:] = (np.diff(keys[:, :2], axis=0) != 0).any(axis=1) | (np.diff(keys[:, 2]) != 1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(keys)) - 1
    along, across = _axes(keys[first, 0])
    foot = across * (keys[first, 1] * _PLANE_M)[:, None]
    start = foot + along * (keys[first, 2] * _STRIP_M)[:, None]
    end = foot + along * ((keys[last, 2] + 1) * _STRIP_M)[:, None]
    return np.stack([start, end], axis=1)
