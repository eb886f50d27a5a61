"""Triangles as both engines see them: vertices rounded to float32 once, and normals of exactly those triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import Float32Array, FloatArray, Scene


@dataclass(frozen=True)
class RoundedSurfaces:
    """Corners (T, 3, 3) float32, local frame, metres. normal (T, 3) float32, unit; zero where float32 left no area."""

    corners_m: Float32Array
    normal: Float32Array


def round_surfaces(scene: Scene) -> RoundedSurfaces:
    """Round the scene's triangles to float32. Triangles that share a vertex still share it bit by bit."""
    corners = scene.vertices_m.astype(np.float32)[scene.triangles]
    wide: FloatArray = corners.astype(np.float64)
    cross = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    length = np.sqrt((cross * cross).sum(axis=1))
    normal = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
    return RoundedSurfaces(corners_m=np.ascontiguousarray(corners), normal=normal.astype(np.float32))
