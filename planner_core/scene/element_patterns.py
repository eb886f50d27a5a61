"""Elements by patterns of class or name, and a scene without some: they hide nothing and nothing is required of them.

`*` stands for any letters, none too, and `?` for any one; all else is what it is. Input a `Scene` (local frame), output
the same without the triangles of some elements, which keep their numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase

import numpy as np

from planner_core.errors import SceneError
from planner_core.model import BoolArray, Element, Scene
from planner_core.model.arrays import area_normals, lengths

#: Before a pattern that is of names alone.
_NAME = "name="
#: Most classes named in a message to a user whose own matched nothing.
_MOST_NAMED = 12


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
    cross = area_normals(corners_m)
    area_m2 = 0.5 * lengths(cross)
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


def fits(pattern: str, name: str) -> bool:
    """Whether the whole of a name matches a pattern, capitals and all."""
    return fnmatchcase(name, pattern.replace("[", "[[]"))


def elements_named(elements: Sequence[Element], pattern: str) -> BoolArray:
    """(E,) bool: elements whose class or name fits, capitals or not; without `*`, also those of classes below it.

    `IfcFurnishingElement` is IfcFurniture too, `IfcWall*` is only classes that are written so, `name=*chair*` only
    names.
    """
    wanted = pattern.casefold()
    only_names = wanted.startswith(_NAME)
    wanted = wanted.removeprefix(_NAME)

    def is_meant(element: Element) -> bool:
        if fits(wanted, element.name.casefold()):
            return True
        classes = () if only_names else (element.kind, *element.parents)
        return any(
            each.casefold() == wanted or (each == element.kind and fits(wanted, each.casefold())) for each in classes
        )

    found: dict[tuple[str, str], bool] = {}
    for element in elements:
        if (element.kind, element.name) not in found:
            found[element.kind, element.name] = is_meant(element)
    return np.array([found[element.kind, element.name] for element in elements], dtype=np.bool_)


def known_classes(elements: Sequence[Element], pattern: str) -> str:
    """Classes that a user may have meant, the nearest alone where one is near."""
    kinds = sorted({element.kind for element in elements})
    near = get_close_matches(pattern, kinds, n=1, cutoff=0.75)
    if near:
        return near[0]
    return "one of " + ", ".join(kinds[:_MOST_NAMED]) + (" ..." if len(kinds) > _MOST_NAMED else "")
