"""Scenes of boxes whose floors are known by construction."""

import numpy as np

from planner_core.model import Element, Scene, Storey
from planner_core.scene.build import scene_from_arrays


def box(low, high):
    """Closed box as (8, 3) vertices and (12, 3) triangles."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return np.array(low) + corners * (np.array(high, float) - np.array(low)), np.array(triangles)


def scene_of(parts, storeys=()) -> Scene:
    """Scene of parts (name, kind, storey, low, high); a kind may end in a predefined type: `IfcCovering.CEILING`."""
    vertices, triangles, element, elements = [], [], [], []
    for number, (name, kind, storey, low, high) in enumerate(parts):
        v, t = box(low, high)
        triangles.append(t + 8 * number)
        vertices.append(v)
        element.extend([number] * len(t))
        kind, _, predefined = kind.partition(".")
        elements.append(Element(name, kind, name, storey if storeys else -1, predefined_type=predefined))
    return scene_from_arrays(
        np.concatenate(vertices),
        np.concatenate(triangles),
        element_of_triangle=np.array(element),
        elements=elements,
        storeys=[Storey(name, name, z) for name, z in storeys],
    )


def four_walls(size_x, size_y, z0, z1, storey):
    """Walls of 0.2 m around the rectangle from the origin."""
    t = 0.2
    spans = [((0, 0), (size_x, t)), ((0, size_y - t), (size_x, size_y)), ((0, t), (t, size_y - t))]
    spans.append(((size_x - t, t), (size_x, size_y - t)))
    return [(f"wall {z0} {i}", "IfcWall", storey, (*a, z0), (*b, z1)) for i, (a, b) in enumerate(spans)]
