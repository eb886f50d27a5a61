"""What engines trace: the surfaces that meet a beam. Scene, Patches -> Traced; glass is left out, mirrors end a beam.

Local frame, metres. docs/method/materials.md defines what is simulated of glass and mirrors, and what is not.
Vertices are rounded to float32 once, and normals are of exactly those triangles: `RoundedSurfaces`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.model import BoolArray, Float32Array, FloatArray, Int32Array, Optics, Patches, Scene
from planner_core.model.arrays import area_normals, lengths


@dataclass(frozen=True)
class Traced:
    """The part of a scene that beams meet, with triangle numbers of its own.

    scene : the triangles that return or stop beams, in their order; all vertices. patches : theirs; `first_patch` is of
    no use there, take `first_patch` (T',) int32 instead: numbers of the WHOLE scene's patches, -1 for a surface that
    gives no return. triangle : (T',) int32, numbers in the whole scene; None where nothing was left out.
    """

    scene: Scene
    patches: Patches
    first_patch: Int32Array
    triangle: Int32Array | None

    @property
    def returns(self) -> BoolArray:
        """(T',) which traced triangles give returns."""
        return np.asarray(self.first_patch >= 0)

    def in_whole_scene(self, triangle: Int32Array) -> Int32Array:
        """Numbers of traced triangles as numbers of the whole scene; -1 stays."""
        if self.triangle is None:
            return triangle
        return np.append(self.triangle, np.int32(-1))[triangle]

    def of_traced(self, by_patch: BoolArray, patches: Patches) -> BoolArray:
        """Values of all `patches` (P,) of the whole scene, for those of traced triangles alone."""
        if self.triangle is None:
            return by_patch
        is_traced = np.zeros(patches.depth.size, dtype=np.bool_)
        is_traced[self.triangle] = True
        return by_patch[np.repeat(is_traced, np.diff(patches.first_patch))]


def traced_surfaces(scene: Scene, patches: Patches) -> Traced:
    """Leave out what lets beams pass, and mark what swallows them."""
    first_patch = patches.first_patch[:-1]
    optics = scene.optics_of_triangle
    if optics is None or not optics.any():
        return Traced(scene, patches, first_patch, None)
    first_patch = np.where(optics == Optics.STOPS, np.int32(-1), first_patch)
    meets = np.flatnonzero(optics != Optics.PASSES).astype(np.int32)
    if meets.size == scene.n_triangles:
        return Traced(scene, patches, first_patch, None)
    part = replace(
        scene,
        triangles=scene.triangles[meets],
        element_of_triangle=scene.element_of_triangle[meets],
        optics_of_triangle=optics[meets],
    )
    count = np.int32(1) << patches.depth[meets].astype(np.int32)
    part_patches = Patches(
        max_area_m2=patches.max_area_m2,
        depth=patches.depth[meets],
        first_patch=np.concatenate([[0], np.cumsum(count)]).astype(np.int32),
        triangle_area_m2=patches.triangle_area_m2[meets],
    )
    return Traced(part, part_patches, first_patch[meets], meets)


@dataclass(frozen=True)
class RoundedSurfaces:
    """Corners (T, 3, 3) float32, local frame, metres. normal (T, 3) float32, unit; zero where float32 left no area."""

    corners_m: Float32Array
    normal: Float32Array


def round_surfaces(scene: Scene) -> RoundedSurfaces:
    """Round the scene's triangles to float32. Triangles that share a vertex still share it bit by bit."""
    corners = scene.vertices_m.astype(np.float32)[scene.triangles]
    wide: FloatArray = corners.astype(np.float64)
    cross = area_normals(wide)
    length = lengths(cross)
    normal = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
    return RoundedSurfaces(corners_m=np.ascontiguousarray(corners), normal=normal.astype(np.float32))
