"""Weak axis: the small motion that a link's common surface holds least, in words a surveyor can act on.

Input a link's normal matrix (6, 6), see `planner_core.network.overlap`; output words such as `slides along x`.

The motion is the eigenvector (t, r) of the smallest eigenvalue: a shift t of the common surface's centroid and a turn
r / L about it. Whichever is larger gives it its name. Axes are those of the scene frame, z is the vertical.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray

#: Eigenvalues this close to the smallest, of a matrix whose trace is 2 at most, are equal but for rounding.
_SAME_EIGENVALUE = 1e-9

#: A direction within this of an axis bears its name: surveyors do not turn a screw by less.
_NEAR_AXIS_COS = float(np.cos(np.radians(10.0)))


def weak_axis(matrix: FloatArray) -> str:
    """Name the motion that a normal matrix (6, 6) holds least; empty where nothing is common.

    Where several motions are held alike, as on a single wall, it is a shift before a turn, along x before y before z.
    """
    if not np.trace(matrix) > 0:
        return ""
    value, vector = np.linalg.eigh(matrix)
    least = vector[:, value <= value[0] + _SAME_EIGENVALUE]
    shift, turn = (_strongest(least[part]) for part in (slice(0, 3), slice(3, 6)))
    if np.linalg.norm(least[:3].T @ shift) >= np.linalg.norm(least[3:].T @ turn) - _SAME_EIGENVALUE:
        return f"slides {_along(shift)}"
    if abs(turn[2]) >= _NEAR_AXIS_COS:
        return "turns about the vertical"
    return f"tilts about {_named(turn)}"


def _strongest(block: FloatArray) -> FloatArray:
    """(3,) unit direction in which a space of motions (3, k) goes furthest; an axis where none goes further."""
    direction: FloatArray = np.linalg.svd(block)[0][:, 0]
    reach = np.linalg.norm(block, axis=1)
    if reach.max() >= np.linalg.norm(block.T @ direction) - _SAME_EIGENVALUE:
        direction = np.eye(3)[int(np.flatnonzero(reach >= reach.max() - _SAME_EIGENVALUE)[0])]
    return direction


def _along(direction: FloatArray) -> str:
    return "along the vertical" if abs(direction[2]) >= _NEAR_AXIS_COS else f"along {_named(direction)}"


def _named(direction: FloatArray) -> str:
    """An axis, a direction in plan by its angle from +x towards +y in [0, 180), or its three components."""
    for axis, name in enumerate("xyz"):
        if abs(direction[axis]) >= _NEAR_AXIS_COS:
            return name
    if abs(direction[2]) <= np.sqrt(1.0 - _NEAR_AXIS_COS**2):
        return f"{round(float(np.degrees(np.arctan2(direction[1], direction[0])))) % 180} degrees from x to y"
    x, y, z = np.round(direction * np.sign(direction[np.abs(direction).argmax()]), 2) + 0.0
    return f"({x:.2f}, {y:.2f}, {z:.2f})"
