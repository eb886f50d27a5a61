"""Leaving elements out of a scene, by class or name: they hide nothing and nothing is required of them.

Input a `Scene` (local frame), output the same without their triangles. Elements keep their numbers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import BoolArray, Scene
from planner_core.scene.patterns import elements_named, known_classes


def without_elements(scene: Scene, patterns: tuple[str, ...]) -> Scene:
    """Leave out elements that any of `patterns` names; `LoadReport.left_out_m2` has the areas.

    Raises
    ------
    SceneError
        A pattern of which the scene has nothing; patterns that leave nothing of it.
    """
    gone = np.zeros(scene.n_triangles, dtype=np.bool_)
    areas_m2 = []
    corners_m = scene.vertices_m[scene.triangles]
    cross = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    area_m2 = 0.5 * np.sqrt((cross * cross).sum(axis=1))
    for pattern in patterns:
        meant = elements_named(scene.elements, pattern)
        if not meant.any():
            raise SceneError(
                f"leave out: got {pattern!r}, of which {scene.source.path.name or 'the scene'} has nothing, expected "
                f"{known_classes(scene.elements, pattern)}; name=*text* stands for names"
            )
        more = meant[scene.element_of_triangle] & ~gone
        areas_m2.append(float(area_m2[more].sum()))
        gone |= more
    if gone.all():
        raise SceneError(f"leave out: got {', '.join(patterns)}, which is all there is; leave fewer classes out")
    report = replace(scene.report, left_out_m2=tuple(areas_m2))
    return replace(with_triangles(scene, ~gone), report=report)


def with_triangles(scene: Scene, kept: BoolArray) -> Scene:
    """Keep some triangles, (T,) bool, in their order, and the vertices that they use."""
    used, number = np.unique(scene.triangles[kept], return_inverse=True)
    return replace(
        scene,
        vertices_m=np.ascontiguousarray(scene.vertices_m[used]),
        triangles=np.ascontiguousarray(number.reshape(-1, 3).astype(np.int32)),
        element_of_triangle=scene.element_of_triangle[kept],
        optics_of_triangle=None if scene.optics_of_triangle is None else scene.optics_of_triangle[kept],
    )
