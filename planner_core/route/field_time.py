"""Field time: what a crew needs for a plan, by its parts. Seconds.

Scanning and walking follow from the plan, set-up from experience: levelling, targets, moving the case.
"""

from __future__ import annotations

from planner_core.model import FieldTime, PlanSettings


def field_time(settings: PlanSettings, *, n_scans: int, walk_m: float) -> FieldTime:
    """Time for `n_scans` stations that are still to be scanned and a walk of `walk_m`.

    Where nobody knows how long a scan takes, the time of scanning is not known either.
    """
    seconds = settings.scanning_s
    return FieldTime(
        None if seconds is None else n_scans * seconds,
        n_scans * settings.set_up_s,
        walk_m / settings.walking_m_per_s,
    )
