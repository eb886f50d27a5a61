"""Field time: what a crew needs for a plan, by its parts. Seconds.

Scanning and walking follow from the plan, set-up from experience: levelling, targets, moving the case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner_core.errors import RequirementError
from planner_core.model import Scanner

#: Levelling a tripod, checking the battery, starting the scan.
SET_UP_S = 60.0
#: At a stroll, with a tripod over the shoulder.
WALKING_M_PER_S = 1.0


@dataclass(frozen=True)
class FieldTime:
    """Seconds of a day's parts."""

    scanning_s: float
    set_up_s: float
    walking_s: float

    @property
    def total_s(self) -> float:
        """All parts together."""
        return self.scanning_s + self.set_up_s + self.walking_s


def field_time(
    scanner: Scanner,
    *,
    n_scans: int,
    walk_m: float,
    seconds_per_scan: float | None = None,
    set_up_s: float = SET_UP_S,
    walking_m_per_s: float = WALKING_M_PER_S,
) -> FieldTime:
    """Time for `n_scans` set-ups of `set_up_s` each and a walk of `walk_m`.

    A scan takes `seconds_per_scan`, or as long as the scanner's mode says.

    Raises
    ------
    RequirementError
        The scanner does not say and nobody told, or figures that are no times, lengths or speeds.
    """
    seconds = scanner.seconds_per_scan if seconds_per_scan is None else seconds_per_scan
    if seconds is None:
        raise RequirementError(
            f"seconds per scan: got none, and scanner {scanner.name!r} does not tell, expected seconds; give e.g. 120"
        )
    for name, value in (("seconds per scan", seconds), ("set-up seconds", set_up_s), ("walk", walk_m)):
        if not (math.isfinite(value) and value >= 0):
            raise RequirementError(f"{name}: got {value:g}, expected 0 or more")
    if not (math.isfinite(walking_m_per_s) and walking_m_per_s > 0):
        raise RequirementError(f"walking speed: got {walking_m_per_s:g} m/s, expected more than 0; give e.g. 1")
    return FieldTime(n_scans * seconds, n_scans * set_up_s, walk_m / walking_m_per_s)
