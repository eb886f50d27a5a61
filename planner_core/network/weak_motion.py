"""What people are told of a link: its overlap, and the motion that it holds least, in words of a survey.

Fractions and the words of `planner_core.network.weak_axis` -> text. The words name axes of the scene, for programs;
people think in shifts, tilts and the heading, along or about a line of the map. The viewer says the same.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import ROUND_DOWN, Decimal

#: Lines steeper than this have no direction in plan, those flatter are level: as in the viewer.
_STEEP_DEG, _LEVEL_DEG = 80.0, 10.5
_LINES = ("N–S", "NE–SW", "E–W", "NW–SE")
_DEGREES = re.compile(r"(\d+) degrees from x to y")
_COMPONENTS = re.compile(r"\((-?[\d.]+), (-?[\d.]+), (-?[\d.]+)\)")
_AXIS = re.compile(r"(?:along|about) ([xy])\b")


@dataclass(frozen=True)
class WeakMotion:
    """A motion. words : such as `tilt about NW–SE`. by_compass : they name sides of the compass: say where north is."""

    words: str
    by_compass: bool = False


def overlap_percent(overlap: float) -> str:
    """Return a fraction in percent with one decimal, rounded down: what is just short must not read as enough."""
    return f"{100 * _rounded_down(overlap, 3):.1f}"


def overlap_share(overlap: float, decimals: int) -> float:
    """Return a fraction as a fraction of so many decimals, rounded down as well: for files that keep numbers short."""
    return float(_rounded_down(overlap, decimals))


def _rounded_down(overlap: float, decimals: int) -> Decimal:
    """Exact: of the shortest decimal that is this float, as 0.289 * 1000 is not 289."""
    return Decimal(repr(float(overlap))).quantize(Decimal(1).scaleb(-decimals), rounding=ROUND_DOWN)


def weak_motion(weak_axis: str, *, north_rad: float | None = 0.0) -> WeakMotion:
    """Say which motion it is; words that name no direction are returned as they are.

    Parameters
    ----------
    weak_axis
        Of a link: `tilts about 134 degrees from x to y`.
    north_rad
        Where north is in the plan of the scene, clockwise from its +y. None: nothing is called north, and lines are
        told by the axes of the scene.
    """
    axis = _direction(weak_axis)
    if axis is None:
        return WeakMotion(weak_axis)
    turns = weak_axis.startswith(("turns", "tilts"))
    x, y, z = axis
    rise_deg = math.degrees(math.atan2(abs(z), math.hypot(x, y)))
    if rise_deg >= _STEEP_DEG:
        return WeakMotion("turn (heading)" if turns else "shift up–down")
    if rise_deg > _LEVEL_DEG:
        return WeakMotion("turn about a slope" if turns else "shift on a slope")
    kind = "tilt about" if turns else "shift"
    bearing_deg = math.degrees(math.atan2(x, y))
    if north_rad is None:
        return WeakMotion(f"{kind if turns else 'shift along'} {_by_axes(bearing_deg)}")
    line = _LINES[math.floor((bearing_deg - math.degrees(north_rad)) / 45.0 + 0.5) % 4]
    return WeakMotion(f"{kind} {line}", by_compass=True)


def _direction(weak_axis: str) -> tuple[float, float, float] | None:
    """Direction of the motion in scene axes; None where the words name none."""
    if "vertical" in weak_axis:
        return 0.0, 0.0, 1.0
    if found := _DEGREES.search(weak_axis):
        angle_rad = math.radians(float(found[1]))
        return math.cos(angle_rad), math.sin(angle_rad), 0.0
    if found := _COMPONENTS.search(weak_axis):
        return float(found[1]), float(found[2]), float(found[3])
    if found := _AXIS.search(weak_axis):
        return (1.0, 0.0, 0.0) if found[1] == "x" else (0.0, 1.0, 0.0)
    return None


def _by_axes(bearing_deg: float) -> str:
    """Name a level line, clockwise from +y, by the axes of the scene."""
    from_y = math.floor(bearing_deg + 0.5) % 180
    if from_y in (0, 90):
        return "x" if from_y else "y"
    return f"the line {from_y}° from y to x" if from_y < 90 else f"the line {180 - from_y}° from y to -x"
