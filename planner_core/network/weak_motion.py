"""Weak motion: the small motion that a link's common surface holds least; it in words of a survey.

Input a link's normal matrix (6, 6), see `planner_core.network.links`; output a `WeakMotion`: the eigenvector (t, r) of
the smallest eigenvalue, a shift t of the common surface's centroid and a turn r / L about it. Whichever is larger is
its kind. Axes are those of the scene frame, z is the vertical.

`WeakMotion`s -> text. People think in shifts, tilts and the heading, along or about a line of the map.
The viewer has the same words.
"""

from __future__ import annotations

import math

import numpy as np

from planner_core.model import FloatArray, WeakMotion

#: Lines steeper than this have no direction in plan, those flatter are level: as in the viewer.
_STEEP_DEG, _LEVEL_DEG = 80.0, 10.5
_LINES = ("N–S", "NE–SW", "E–W", "NW–SE")
#: Eigenvalues this close to the smallest, of a matrix whose trace is 2 at most, are equal but for rounding.
_SAME_EIGENVALUE = 1e-9
#: A direction within this of an axis is that axis: surveyors do not turn a screw by less.
_NEAR_AXIS_COS = float(np.cos(np.radians(10.0)))


def motion_words(motion: WeakMotion | None, *, north_rad: float | None = 0.0, of_north: str = "") -> str:
    """Say which motion it is, as `tilt about NW–SE`; empty where none is known.

    Parameters
    ----------
    north_rad
        Where north is in the plan of the scene, clockwise from its +y. None: nothing is called north, and lines are
        named by the axes of the scene.
    of_north
        Added where sides of the compass are named: what north is.
    """
    if motion is None:
        return ""
    turns = motion.kind == "turn"
    x, y, z = motion.direction
    rise_deg = math.degrees(math.atan2(abs(z), math.hypot(x, y)))
    if rise_deg >= _STEEP_DEG:
        return "turn (heading)" if turns else "shift up–down"
    if rise_deg > _LEVEL_DEG:
        return "turn about a slope" if turns else "shift on a slope"
    bearing_deg = math.degrees(math.atan2(x, y))
    if north_rad is None:
        return f"{'tilt about' if turns else 'shift along'} {_by_axes(bearing_deg)}"
    line = _LINES[math.floor((bearing_deg - math.degrees(north_rad)) / 45.0 + 0.5) % 4]
    return f"{'tilt about' if turns else 'shift'} {line}{of_north}"


def weak_motion(matrix: FloatArray) -> WeakMotion | None:
    """Find the motion that a normal matrix (6, 6) holds least; None where nothing is common.

    Where several motions are held alike, as on a single wall, it is a shift before a turn, along x before y before z.
    """
    if not np.trace(matrix) > 0:
        return None
    value, vector = np.linalg.eigh(matrix)
    least = vector[:, value <= value[0] + _SAME_EIGENVALUE]
    shift, turn = (_strongest(least[part]) for part in (slice(0, 3), slice(3, 6)))
    if np.linalg.norm(least[:3].T @ shift) >= np.linalg.norm(least[3:].T @ turn) - _SAME_EIGENVALUE:
        return WeakMotion("shift", _rounded(shift))
    return WeakMotion("turn", _rounded(turn))


def _by_axes(bearing_deg: float) -> str:
    """Name a level line, clockwise from +y, by the axes of the scene."""
    from_y = math.floor(bearing_deg + 0.5) % 180
    if from_y in (0, 90):
        return "x" if from_y else "y"
    return f"the line {from_y}° from y to x" if from_y < 90 else f"the line {180 - from_y}° from y to -x"


def _strongest(block: FloatArray) -> FloatArray:
    """(3,) unit direction in which a space of motions (3, k) goes furthest; an axis where none goes further."""
    direction: FloatArray = np.linalg.svd(block)[0][:, 0]
    reach = np.linalg.norm(block, axis=1)
    if reach.max() >= np.linalg.norm(block.T @ direction) - _SAME_EIGENVALUE:
        direction = np.eye(3)[int(np.flatnonzero(reach >= reach.max() - _SAME_EIGENVALUE)[0])]
    return direction


def _rounded(direction: FloatArray) -> tuple[float, float, float]:
    """An axis, a level direction of whole degrees from +x towards +y in [0, 180), or components of two decimals."""
    near = np.abs(direction) >= _NEAR_AXIS_COS
    if near.any():
        x, y, z = near.astype(float)
    elif abs(direction[2]) <= np.sqrt(1.0 - _NEAR_AXIS_COS**2):
        angle = np.radians(round(float(np.degrees(np.arctan2(direction[1], direction[0])))) % 180)
        x, y, z = np.cos(angle), np.sin(angle), 0.0
    else:
        x, y, z = np.round(direction * np.sign(direction[np.abs(direction).argmax()]), 2) + 0.0
    return float(x), float(y), float(z)
