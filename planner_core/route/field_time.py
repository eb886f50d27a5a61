"""Field time: what a crew needs for a plan, by its parts. Seconds.

Scanning and walking follow from the plan, set-up from experience: levelling, targets, moving the case.
"""

from __future__ import annotations

import math

from planner_core.errors import RequirementError
from planner_core.model import FieldTime, PlanSettings, Scanner

#: Levelling a tripod, checking the battery, starting the scan.
SET_UP_S = 60.0
#: At a stroll, with a tripod over the shoulder.
WALKING_M_PER_S = 1.0


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

    A scan takes `seconds_per_scan`, or as long as the scanner's mode says; where neither is known, neither is the time
    of scanning.

    Raises
    ------
    RequirementError
        Figures that are no times, lengths or speeds.
    """
    seconds = scanner.seconds_per_scan if seconds_per_scan is None else seconds_per_scan
    _check_times(seconds, set_up_s, walk_m, walking_m_per_s)
    scanning_s = None if seconds is None else n_scans * seconds
    return FieldTime(scanning_s, n_scans * set_up_s, walk_m / walking_m_per_s)


def field_time_of(settings: PlanSettings, *, n_scans: int, walk_m: float) -> FieldTime:
    """`field_time` by the settings of a plan. n_scans : stations that are still to be scanned."""
    return field_time(
        settings.scanner,
        n_scans=n_scans,
        walk_m=walk_m,
        seconds_per_scan=settings.seconds_per_scan,
        set_up_s=settings.set_up_s,
        walking_m_per_s=settings.walking_m_per_s,
    )


def check_field_settings(settings: PlanSettings) -> None:
    """Refuse seconds and speeds that make no sense, before any work.

    Raises
    ------
    RequirementError
        As `field_time`; and for the objective `time`, seconds per scan that nobody knows.
    """
    known_s = field_time_of(settings, n_scans=0, walk_m=0.0).scanning_s
    if settings.objective == "time" and known_s is None:
        raise RequirementError(
            f"seconds per scan: got none, and scanner {settings.scanner.name!r} does not tell, expected them for a "
            "plan of least time; give e.g. 120"
        )


def _check_times(seconds: float | None, set_up_s: float, walk_m: float, walking_m_per_s: float) -> None:
    for name, value in (("seconds per scan", seconds), ("set-up seconds", set_up_s), ("walk", walk_m)):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise RequirementError(f"{name}: got {value:g}, expected 0 or more; e.g. 60")
    if not (math.isfinite(walking_m_per_s) and walking_m_per_s > 0):
        raise RequirementError(f"walking speed: got {walking_m_per_s:g} m/s, expected more than 0; give e.g. 1")
