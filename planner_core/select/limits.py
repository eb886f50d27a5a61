"""When a search has to end: nothing left to prove, work done, or time over.

Input the limits of the settings and what was done so far, output whether to go on, and why not.
"""

from __future__ import annotations

import time

PROVEN = "proven"
WORK_DONE = "work limit"
TIME_OVER = "time limit"
INTERRUPTED = "interrupted"


class Limits:
    """Limits of one search, whose clock runs from here on.

    why_stopped : `proven` as long as no limit was reached.
    """

    def __init__(self, *, work_limit: float, time_limit_s: float | None) -> None:
        self._work_limit, self._time_limit_s = work_limit, time_limit_s
        self._began_s = time.monotonic()
        self.why_stopped = PROVEN

    @property
    def left_s(self) -> float | None:
        """Seconds that are left; None: there is no limit of time."""
        if self._time_limit_s is None:
            return None
        return max(0.0, self._time_limit_s - (time.monotonic() - self._began_s))

    def reached(self, work: float) -> bool:
        """Whether so much work, or the time, is the limit; `why_stopped` says which, of both the time."""
        if self.left_s == 0.0:
            self.why_stopped = TIME_OVER
        elif work >= self._work_limit:
            self.why_stopped = WORK_DONE
        else:
            return False
        return True
