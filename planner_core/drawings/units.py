"""The unit of a drawing, checked: doors and walls have sizes that people build, and `$INSUNITS` is often wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.drawings.arcs import SwingArc
from planner_core.errors import SceneError
from planner_core.model import FloatArray

_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""What floor plans are drawn in, by the words of --units."""
_DOOR_M, _WALL_M, _EXTENT_M = (0.5, 1.6), (0.04, 0.7), (2.0, 3000.0)
_THICKEST_OLD_WALL_M = 1.5
_LINE_A_WALL = 1.5
"""Lines side by side that are this many doors apart are walls of one line each, with rooms between them."""
_MOST_LINES = 4000
_LEAST_DOORS = 2
_SAME_ANGLE_RAD = np.deg2rad(0.5)


@dataclass(frozen=True)
class DrawnSizes:
    """Sizes of a drawing in its own unit, NaN where it shows none: a door's swing, a wall's thickness, all of it."""

    door: float
    wall: float
    extent: float

    def fits(self, unit_m: float) -> bool:
        """Whether they are a building's in a unit of this length."""
        pairs = ((self.door, _DOOR_M), (self.wall, _WALL_M), (self.extent, _EXTENT_M))
        return all(not np.isfinite(size) or low <= size * unit_m <= high for size, (low, high) in pairs)

    def other_units(self, unit_m: float) -> tuple[str, ...]:
        """Words of the units that they fit, but for one."""
        return tuple(unit for unit, m in _UNITS_M.items() if m != unit_m and self.is_telling and self.fits(m))

    def in_words(self, unit_m: float) -> str:
        """Doors and walls in metres, for messages."""
        parts = []
        if np.isfinite(self.door):
            parts.append(f"doors {self.door * unit_m:.3g} m wide")
        if np.isfinite(self.wall):
            parts.append(f"walls {self.wall * unit_m:.3g} m thick")
        return " and ".join([*parts, f"an extent of {self.extent * unit_m:.4g} m"][:2])

    @property
    def is_telling(self) -> bool:
        """Whether there is a door or a wall to judge by."""
        return bool(np.isfinite(self.door) or np.isfinite(self.wall))


def drawn_sizes(wall_segments: FloatArray, arcs: Sequence[SwingArc], points: FloatArray) -> DrawnSizes:
    """Measure a drawing. wall_segments : (M, 2, 2); points : (N, 2) of all that counts; file's unit."""
    radii = np.array([arc.radius for arc in arcs])
    door = float(np.median(radii)) if radii.size >= _LEAST_DOORS else float("nan")
    extent = float(np.ptp(points, axis=0).max()) if len(points) else float("nan")
    wall = _wall_thickness(wall_segments)
    return DrawnSizes(door, float("nan") if wall > _LINE_A_WALL * door else wall, extent)


def unit_of(name: str, sizes: DrawnSizes, *, stated_m: float | None, source: str) -> tuple[float, tuple[str, ...]]:
    """Return metres in a unit of a drawing whose user gives none, and a warning where the file does not state it.

    Raises
    ------
    SceneError
        What the file states contradicts its doors and walls, or it states none and nothing decides.
    """
    fitting = [unit for unit, length_m in _UNITS_M.items() if sizes.fits(length_m)] if sizes.is_telling else []
    if stated_m is not None:
        if not sizes.is_telling or sizes.fits(stated_m):
            return stated_m, ()
        remedy = "no other fits, so name the layer of its walls, such as --layer wall=NAME, or pass --units"
        if fitting:
            first, *others = fitting
            named = " or ".join([first, *others])
            remedy = f"pass its unit, such as --units {named}; in {first} it has {sizes.in_words(_UNITS_M[first])}"
        own = [unit for unit, length_m in _UNITS_M.items() if length_m == stated_m]
        if own and replace(sizes, wall=float("nan")).fits(stated_m) and sizes.wall * stated_m <= _THICKEST_OLD_WALL_M:
            remedy += f"; where its walls are as thick as that, --units {own[0]}"
        raise SceneError(
            f"{name}: by {source} its unit is {stated_m:g} m and it has {sizes.in_words(stated_m)}, expected doors of "
            f"0.5 to 1.6 m and walls of 0.04 to 0.7 m; {remedy}."
        )
    if len(fitting) == 1:
        unit_m = _UNITS_M[fitting[0]]
        return unit_m, (
            f"{name}: it states no unit and is read in {fitting[0]}, in which it has {sizes.in_words(unit_m)}; if that "
            "is wrong, pass --units.",
        )
    which = f"its sizes fit {' and '.join(fitting)}" if fitting else "no doors or walls decide"
    raise SceneError(f"{name}: it states no unit and {which}, expected one; pass its unit, such as --units mm.")


def _wall_thickness(segments: FloatArray) -> float:
    """The median distance, by length, from a line to the nearest one beside it that runs the same way."""
    if len(segments) < 2:
        return float("nan")
    along = segments[:, 1] - segments[:, 0]
    length = np.hypot(along[:, 0], along[:, 1])
    longest = np.argsort(-length, kind="stable")[:_MOST_LINES]
    segments, along, length = segments[longest], along[longest], length[longest]
    angle = np.arctan2(along[:, 1], along[:, 0]) % np.pi
    group = np.rint(angle / _SAME_ANGLE_RAD).astype(np.int64) % round(np.pi / _SAME_ANGLE_RAD)
    nearest = np.full(len(segments), np.inf)
    least = 1e-5 * float(np.ptp(segments.reshape(-1, 2), axis=0).max())
    for number in np.unique(group).tolist():
        rows = np.flatnonzero(group == number)
        direction = np.array([np.cos(number * _SAME_ANGLE_RAD), np.sin(number * _SAME_ANGLE_RAD)])
        ends = np.sort(segments[rows] @ direction, axis=1)
        offset = (segments[rows] @ np.array([-direction[1], direction[0]])).mean(axis=1)
        gap = np.abs(offset[:, None] - offset[None, :])
        overlap = np.minimum(ends[:, None, 1], ends[None, :, 1]) - np.maximum(ends[:, None, 0], ends[None, :, 0])
        shorter = np.minimum(length[rows][:, None], length[rows][None, :])
        gap[(gap <= least) | (overlap < 0.5 * shorter)] = np.inf
        nearest[rows] = gap.min(axis=1)
    known = np.isfinite(nearest)
    if not known.any():
        return float("nan")
    order = np.argsort(nearest[known], kind="stable")
    weight = np.cumsum(length[known][order])
    return float(nearest[known][order][np.searchsorted(weight, 0.5 * weight[-1])])
