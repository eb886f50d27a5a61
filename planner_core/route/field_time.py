"""Field time: what a crew needs for a plan, by its parts. Seconds.

Scanning and walking follow from the plan, set-up from experience: levelling, targets, moving the case.
"""

from __future__ import annotations

from planner_core.model import Crew, FieldTime


def field_time(crew: Crew, *, n_scans: int, walk_m: float) -> FieldTime:
    """Time for `n_scans` stations that are still to be scanned and a walk of `walk_m`.

    Where nobody knows how long a scan takes, the time of scanning is not known either.
    """
    scanning_s = None if crew.scan_s is None else n_scans * crew.scan_s
    return FieldTime(scanning_s, n_scans * crew.set_up_s, walk_m / crew.walking_m_per_s)
