"""When a search has to end: nothing left to prove, work done, or time over; and how much work annealing is.

Input the limits of the settings and what was done so far, output whether to go on, and why not.
"""

from __future__ import annotations

import time

from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

PROVEN = "proven"
WORK_DONE = "work limit"
TIME_OVER = "time limit"
INTERRUPTED = "interrupted"
#: Candidates that a step of annealing tries for the place of one station, so that taking it out serves more than one.
TRIES = 4


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


def work_of_a_step(problem: CoverProblem, network: Network | None, *, n_sets: int, n_stations: int) -> float:
    """Numbers that one step of annealing looks at, for so many sets of about `n_stations`."""
    rows = problem.row.size / problem.n_candidates
    links = 0 if network is None else n_stations * (1 + n_stations // 32)
    return n_sets * (TRIES + 2) * (rows + 50 + links)
