"""Who carries the scanner, and where they may go: the settings of free space.

Lengths in metres, angles in radians, zones in the local frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int32Array
from planner_core.positions.outlines import over_polygon


@dataclass(frozen=True)
class Mover:
    """A body that walks or drives: an upright cylinder that climbs steps. The defaults are a person's.

    radius_m : of the body. step_m : greatest step up or down; what is lower is walked over. height_m : headroom needed:
    one ducks under beams and sloping roofs. stairs_height_m : headroom needed off the floors' ground, if that is less.
    max_slope_rad : steepest ground.
    opens_doors : doors (`IfcDoor`) are no obstacles, shut or open: models show them shut, a crew opens them.

    Raises
    ------
    RequirementError
        Lengths below zero or not finite, or a height that is not above two steps.
    """

    radius_m: float = 0.25
    step_m: float = 0.25
    height_m: float = 1.7
    stairs_height_m: float = 1.7
    max_slope_rad: float = math.radians(25.0)
    opens_doors: bool = True

    def __post_init__(self) -> None:
        for name in ("radius_m", "step_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise RequirementError(f"mover's {name}: got {value:g}, expected 0 or more metres; e.g. 0.25")
        for name in ("height_m", "stairs_height_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 2.0 * self.step_m):
                raise RequirementError(
                    f"mover's {name}: got {value:g}, expected more than two steps of {self.step_m:g} m; e.g. 1.7"
                )
        if not 0 <= self.max_slope_rad < math.pi / 2:
            raise RequirementError(
                f"mover's max_slope_rad: got {self.max_slope_rad:g}, expected an angle from 0 to below pi/2; e.g. 0.44"
            )


#: Codes allow risers of up to 0.22 m, and where models miss a screed one is higher by it: hence steps of 0.25 m.
#: A surveyor with a tripod over the shoulder.
PERSON = Mover()


@dataclass(frozen=True)
class WalkingZone:
    """An area of one floor that is kept out of, or that alone may be walked.

    outline_m : (K, 2) float64, corners of a simple polygon in plan, local frame. floor : index into `Survey.floors`.
    access : False: nobody goes in. True: on this floor nobody goes anywhere but into zones of access.
    """

    outline_m: FloatArray
    floor: int
    access: bool = False

    def __post_init__(self) -> None:
        outline = np.asarray(self.outline_m, dtype=np.float64)
        if outline.ndim != 2 or outline.shape[1] != 2 or outline.shape[0] < 3 or not np.isfinite(outline).all():
            raise RequirementError(
                f"zone's outline: got an array of shape {outline.shape}, expected at least three finite corners (x, y)"
            )
        object.__setattr__(self, "outline_m", outline)


def needed_height_m(mover: Mover, ground_floor: Int32Array) -> FloatArray:
    """(N,) headroom needed on grounds of floors (N,), -1 for what is none."""
    return np.where(ground_floor >= 0, mover.height_m, min(mover.height_m, mover.stairs_height_m))


def blocked_by_zones(zones: tuple[WalkingZone, ...], plan_m: FloatArray, floor: Int32Array) -> BoolArray:
    """(N,) bool: whether zones keep a body from places (N, 2) on floors (N,)."""
    blocked = np.zeros(plan_m.shape[0], dtype=bool)
    for index in sorted({zone.floor for zone in zones}):
        here = np.flatnonzero(floor == index)
        allowed = [over_polygon(plan_m[here], z.outline_m) for z in zones if z.floor == index and z.access]
        barred = [over_polygon(plan_m[here], z.outline_m) for z in zones if z.floor == index and not z.access]
        if allowed:
            blocked[here] |= ~np.logical_or.reduce(allowed)
        if barred:
            blocked[here] |= np.logical_or.reduce(barred)
    return blocked
