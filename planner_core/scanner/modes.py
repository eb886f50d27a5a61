"""Resolution modes of a scanner: a mode's angular steps, and the azimuths and channels that follow from them.

A mode's file entry (docs/formats/scanner.md) -> `ScanMode`; `ScanMode` and vertical field -> `BeamGrid`. Radians.

A step rarely fits the turn and the vertical field a whole number of times. The nearest number of steps is taken, halves
upwards: floor(2 pi / step + 1/2) azimuths in a turn, and floor(field / step + 1/2) + 1 channels from the field's top to
its bottom, both included. So beams are even, and at most half a step in the whole field away from the step required.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

from planner_core.documents import shown
from planner_core.errors import RequirementError

#: Where data sheets state the distance between neighbouring points.
SPACING_DISTANCE_M = 10.0
_MAX_SPACING_MM = 5000.0
#: Steps are given with three digits.
_SAME_STEP = 1e-3
_SPACING = re.compile(r"([0-9]{1,4}(?:\.[0-9]{1,4})?)mm")


def bad(where: str, got: str, expected: str, remedy: str = "compare docs/formats/scanner.md") -> RequirementError:
    """Return the error to raise; `where` is the file or the scanner's name."""
    return RequirementError(f"scanner {where}: got {got}, expected {expected}; {remedy}")


@dataclass(frozen=True)
class ScanMode:
    """One resolution: what an operator picks on the instrument. Steps in radians; `seconds` None: not known.

    elevation_rad : each channel, highest first, where they are listed one by one; there is no elevation step then.
    """

    id: str
    title: str
    azimuth_step_rad: float
    elevation_step_rad: float | None
    seconds: float | None = None
    elevation_rad: tuple[float, ...] = ()


@dataclass(frozen=True)
class BeamGrid:
    """Numbers of beams of a scan: columns and rows."""

    n_azimuths: int
    n_channels: int

    @property
    def n_beams(self) -> int:
        """Number of beams of a scan."""
        return self.n_azimuths * self.n_channels


def grid_of(mode: ScanMode, *, field_rad: float) -> BeamGrid:
    """Round the steps of `mode` to a full turn and to a vertical field of `field_rad`; see the head of this file."""
    n_azimuths = max(1, math.floor(2 * math.pi / mode.azimuth_step_rad + 0.5))
    if mode.elevation_step_rad is None:
        return BeamGrid(n_azimuths, len(mode.elevation_rad))
    return BeamGrid(n_azimuths, 1 + max(1, math.floor(field_rad / mode.elevation_step_rad + 0.5)))


def spacing_mode(name: str) -> ScanMode | None:
    """Return the mode that `6mm` names, points so far apart at 10 m; None where `name` is no such spacing."""
    match = _SPACING.fullmatch(name.strip().lower().replace(" ", ""))
    if match is None or not 0 < float(match[1]) <= _MAX_SPACING_MM:
        return None
    spacing_mm = float(match[1])
    step_rad = spacing_mm / 1000.0 / SPACING_DISTANCE_M  # as an arc
    return ScanMode(f"{spacing_mm:g}mm", f"{spacing_mm:g} mm at 10 m", step_rad, step_rad)


def pick_mode(mode_name: str, modes: tuple[ScanMode, ...], where: str) -> ScanMode:
    """Return the mode of that id, or the one of that spacing at 10 m.

    A spacing that one of the scanner's own modes has takes its time, too; of others no time is known.

    Raises
    ------
    RequirementError
        `mode_name` is neither; the message lists the ids.
    """
    name = mode_name.strip().lower()
    found = next((mode for mode in modes if mode.id == name), None) or spacing_mode(name)
    if found is None:
        ids = ", ".join(mode.id for mode in modes)
        raise bad(where, f"mode {shown(mode_name)}", f"{ids}, or a spacing at 10 m such as 6mm", "pick one of these")
    if found.seconds is None:
        same = (mode for mode in modes if _has_same_steps(mode, found))
        found = replace(found, seconds=next((mode.seconds for mode in same), None))
    return found


def _has_same_steps(mode: ScanMode, other: ScanMode) -> bool:
    """Whether two modes have the same points; of steps that were rounded in degrees and as an arc, too."""
    if mode.elevation_step_rad is None or other.elevation_step_rad is None:
        return False
    return math.isclose(mode.azimuth_step_rad, other.azimuth_step_rad, rel_tol=_SAME_STEP) and math.isclose(
        mode.elevation_step_rad, other.elevation_step_rad, rel_tol=_SAME_STEP
    )
