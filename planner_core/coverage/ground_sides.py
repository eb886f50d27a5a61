"""Ground is seen from above: of a slab that is a single plane, the room below sees the same surface as its ceiling.

A `Survey`, positions (N, 3) in the local frame, metres, and rows of what they see -> which entries count.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, Survey


class GroundSides:
    """Which side of a survey's ground positions are on."""

    def __init__(self, survey: Survey) -> None:
        scene = survey.scene
        floors = () if survey.as_in_paper else survey.floors
        ground = np.unique(np.concatenate([np.zeros(0, np.int32), *(floor.ground_triangles for floor in floors)]))
        corners_m = scene.vertices_m[scene.triangles[ground]]
        upward = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        # Windings are not trusted: up is up.
        upward *= np.where(upward[:, 2:] < 0.0, -1.0, 1.0)
        self._upward, self._level_m3 = upward, np.einsum("ti,ti->t", upward, corners_m[:, 0])
        self._number = np.full(scene.n_triangles, -1, dtype=np.int32)
        self._number[ground] = np.arange(ground.size, dtype=np.int32)
        self._triangle_of_patch = survey.patches.triangle_of_patch

    def counts(self, positions_m: FloatArray, starts: Int64Array, patch: Int32Array) -> BoolArray:
        """(M,) bool: entries of rows, `starts` (N + 1,) into `patch` (M,), but for those that see ground from below."""
        return self.are_above(positions_m, starts, self._triangle_of_patch[patch])

    def are_above(self, positions_m: FloatArray, starts: Int64Array, triangle: Int32Array) -> BoolArray:
        """(M,) bool: whether the rows' positions are above triangles (M,); of what is no ground all are."""
        found = np.ones(triangle.size, dtype=np.bool_)
        number = self._number[triangle]
        entry = np.flatnonzero(number >= 0)
        number = number[entry]
        at_m = positions_m[np.searchsorted(starts, entry, side="right") - 1]
        found[entry] = np.einsum("mi,mi->m", self._upward[number], at_m) > self._level_m3[number]
        return found
