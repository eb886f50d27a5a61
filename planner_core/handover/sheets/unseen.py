"""What a floor's drawing shows of unseen surface: hatching of its ground, strips along its walls. Patches -> lines.

Plan coordinates, local frame, metres. Hatch lines keep their distance on paper, so they are made for a scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.handover.sheets.building import Building
from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.scene.patches import patch_triangles

#: Surface this upright is a wall: 72 degrees and more.
_UPRIGHT = 0.3
#: Length of wall that is judged at once, and how much of it has to be missed to be marked.
_STRIP_M = 0.25
_LEAST_SHARE = 0.5
_LEAST_AREA_M2 = 0.08
#: Faces of one wall, drawn as one line: directions within 2 degrees, planes within 4 cm.
_DIRECTIONS = 90
_PLANE_M = 0.04


@dataclass(frozen=True, eq=False)
class UnseenGround:
    """Ground of one floor, as triangles (N, 3, 2): what the plan leaves out, and what no spot sees.

    missed : some allowed spot sees it, no station does. out_of_reach : no allowed spot sees it.
    """

    missed: FloatArray
    out_of_reach: FloatArray


class UnseenSurface:
    """The unseen surface of a building; made once, asked floor by floor."""

    def __init__(self, building: Building) -> None:
        self._building = building
        unseen = building.times_seen == 0
        self._corners_m = patch_triangles(building.scene, building.patches)
        self._unseen: BoolArray = unseen
        self._ground = building.ground_of_triangle[building.patches.triangle_of_patch]

    def ground(self, floor: int) -> UnseenGround:
        """Of the floor of that number."""
        here = (self._ground == floor) & self._unseen
        achievable = self._building.achievable
        plan_m = self._corners_m[:, :, :2]
        return UnseenGround(missed=plan_m[here & achievable], out_of_reach=plan_m[here & ~achievable])

    def walls(self, low_m: float, high_m: float, window_m: FloatArray) -> FloatArray:
        """(K, 2, 2) strips of wall, ends in plan, of which at least half could be seen and is not.

        low_m, high_m : heights, local, that the middles of patches lie between. window_m : (2, 2) in plan.
        """
        corners_m = self._corners_m
        middle_m = corners_m.mean(axis=1)
        near = ((middle_m[:, :2] >= window_m[0]) & (middle_m[:, :2] <= window_m[1])).all(axis=1)
        near &= self._building.achievable & (middle_m[:, 2] >= low_m) & (middle_m[:, 2] < high_m)
        corners_m, middle_m, unseen = corners_m[near], middle_m[near], self._unseen[near]
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        twice_m2 = np.linalg.norm(normal, axis=1)
        upright = np.abs(normal[:, 2]) < _UPRIGHT * twice_m2
        return _strips(middle_m[upright, :2], normal[upright, :2], 0.5 * twice_m2[upright], unseen[upright])


def _strips(middle_m: FloatArray, normal: FloatArray, area_m2: FloatArray, unseen: BoolArray) -> FloatArray:
    """Strips of walls that are missed, of upright patches with these middles and normals in plan (N, 2)."""
    angle = np.mod(np.arctan2(normal[:, 1], normal[:, 0]), np.pi)
    direction = np.mod(np.rint(angle * _DIRECTIONS / np.pi), _DIRECTIONS).astype(np.int64)
    turn = direction * np.pi / _DIRECTIONS
    across, along = np.stack([np.cos(turn), np.sin(turn)], 1), np.stack([-np.sin(turn), np.cos(turn)], 1)
    plane = np.rint((middle_m * across).sum(axis=1) / _PLANE_M).astype(np.int64)
    cell = np.floor((middle_m * along).sum(axis=1) / _STRIP_M).astype(np.int64)
    keys, strip = np.unique(np.stack([direction, plane, cell], axis=1), axis=0, return_inverse=True)
    n = len(keys)
    all_m2 = np.bincount(strip.ravel(), weights=area_m2, minlength=n)
    missed_m2 = np.bincount(strip.ravel(), weights=np.where(unseen, area_m2, 0.0), minlength=n)
    marked = (missed_m2 >= _LEAST_SHARE * all_m2) & (missed_m2 >= _LEAST_AREA_M2)
    return _runs(keys[marked])


def _runs(keys: Int64Array) -> FloatArray:
    """(K, 2, 2) ends of the runs of neighbouring strips (direction, plane, cell), which are sorted."""
    if not len(keys):
        return np.zeros((0, 2, 2))
    begins = np.ones(len(keys), dtype=np.bool_)
    begins[1:] = (np.diff(keys[:, :2], axis=0) != 0).any(axis=1) | (np.diff(keys[:, 2]) != 1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(keys)) - 1
    turn = keys[first, 0] * np.pi / _DIRECTIONS
    across, along = np.stack([np.cos(turn), np.sin(turn)], 1), np.stack([-np.sin(turn), np.cos(turn)], 1)
    foot = across * (keys[first, 1] * _PLANE_M)[:, None]
    start = foot + along * (keys[first, 2] * _STRIP_M)[:, None]
    end = foot + along * ((keys[last, 2] + 1) * _STRIP_M)[:, None]
    return np.stack([start, end], axis=1)


def hatch(triangles: FloatArray, *, step_m: float, turn_rad: float) -> FloatArray:
    """(K, 2, 2) lines that hatch the union of triangles (N, 3, 2), `step_m` apart, at an angle to +x.

    Lines have the same places whatever is hatched, so that neighbouring areas meet in them.
    """
    if not len(triangles):
        return np.zeros((0, 2, 2))
    along = np.array([np.cos(turn_rad), np.sin(turn_rad)])
    across = np.array([-along[1], along[0]])
    u, v = triangles @ along, triangles @ across / step_m
    first = np.ceil(v.min(axis=1)).astype(np.int64)
    count = np.maximum(np.floor(v.max(axis=1)).astype(np.int64) - first + 1, 0)
    which = np.repeat(np.arange(len(triangles)), count)
    line = np.arange(which.size) - np.repeat(np.cumsum(count) - count, count) + first[which]
    low, high = _crossing(u[which], v[which], line.astype(np.float64))
    order = np.lexsort((low, line))
    line, low, high = line[order], low[order], high[order]
    start, end, at = _merged(line, low, high)
    ends = np.stack([start, end], axis=1)
    return np.asarray(ends[:, :, None] * along + (at * step_m)[:, None, None] * across)


def _crossing(u: FloatArray, v: FloatArray, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where lines v = at (N,) enter and leave triangles with corners u, v (N, 3)."""
    low, high = np.full(at.size, np.inf), np.full(at.size, -np.inf)
    for edge in range(3):
        v0, v1, u0, u1 = v[:, edge], v[:, (edge + 1) % 3], u[:, edge], u[:, (edge + 1) % 3]
        meets = (np.minimum(v0, v1) <= at) & (at <= np.maximum(v0, v1)) & (v0 != v1)
        share = np.divide(at - v0, v1 - v0, out=np.zeros_like(at), where=meets)
        crossing = u0 + share * (u1 - u0)
        low = np.where(meets, np.minimum(low, crossing), low)
        high = np.where(meets, np.maximum(high, crossing), high)
    return low, high


def _merged(line: Int64Array, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Join pieces of the same line that touch, sorted by line and beginning: starts, ends, lines."""
    starts: list[float] = []
    ends: list[float] = []
    lines: list[int] = []
    for at, start, end in zip(line.tolist(), low.tolist(), high.tolist(), strict=True):
        if start > end:  # a line through a corner only, by rounding
            continue
        if lines and lines[-1] == at and start <= ends[-1] + 1e-6:
            ends[-1] = max(ends[-1], end)
        else:
            starts.append(start)
            ends.append(end)
            lines.append(at)
    return np.array(starts), np.array(ends), np.array(lines, dtype=np.float64)
