"""Where patches are, and in whose room: what reasons are found from and named by. Local frame, metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.engine.patch_samples import places_of
from planner_core.model import FloatArray, Int32Array, Int64Array, Survey
from planner_core.scene.rooms import room_of_surfaces


@dataclass(frozen=True)
class Surfaces:
    """Patches (N,) int32 and what they are parts of.

    triangle, element, room, floor : (N,) int64; room and floor are -1 for none. corners_m : (N, 3, 3). centroid_m,
    normal : (N, 3), normals unit, as the faces wind. area_m2 : (N,).
    """

    patch: Int32Array
    triangle: Int64Array
    element: Int64Array
    room: Int64Array
    floor: Int64Array
    corners_m: FloatArray
    centroid_m: FloatArray
    normal: FloatArray
    area_m2: FloatArray

    def take(self, rows: Int64Array) -> Surfaces:
        """Some of them, in the order given."""
        return Surfaces(**{name: values[rows] for name, values in vars(self).items()})


def surfaces_of(survey: Survey, patch: Int32Array) -> Surfaces:
    """Describe patches (N,)."""
    scene, patches = survey.scene, survey.patches
    triangle = (np.searchsorted(patches.first_patch, patch, side="right") - 1).astype(np.int64)
    places = places_of(scene, patches, patch)
    centroid_m = places.corners_m.mean(axis=1)
    normal = places.normal.copy()
    normal[(normal == 0).all(axis=1)] = (0.0, 0.0, 1.0)  # slivers that float32 makes lines of: any direction will do
    return Surfaces(
        patch=patch,
        triangle=triangle,
        element=scene.element_of_triangle[triangle].astype(np.int64),
        room=room_of_surfaces(scene, centroid_m, normal).astype(np.int64),
        floor=survey.floor_of_triangle[triangle].astype(np.int64),
        corners_m=places.corners_m,
        centroid_m=centroid_m,
        normal=normal,
        area_m2=patches.area_m2[patch],
    )
