"""A lower bound on the number of stations in a second: no plan on these candidates can do with fewer.

Input a `CoverProblem`, output a whole number. Two bounds, the larger counts:

- Counting. For a target that needs R, any k stations cover at most the sum of the k largest areas single candidates
  cover of it; the smallest k for which that reaches R is a bound. So it is for all targets' sum, each capped at R.
  Where m looks are required, what a candidate sees counts for one mth.
- Prices of rows and targets, from the linear relaxation (large_bound.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import Int64Array
from planner_core.progress import Progress, silent
from planner_core.select.large_bound import large_bound
from planner_core.select.problem import CoverProblem

#: Work of prices, about seconds of one core: on duplex they are at 26 of 29 stations after it, and after three, too.
_PRICE_WORK = 1.0


def lower_bound(
    problem: CoverProblem, *, n_stations: int, given: Sequence[int] = (), progress: Progress = silent
) -> int:
    """Compute the larger of both bounds.

    Parameters
    ----------
    n_stations
        Size of a plan that is known to meet the targets; guides the prices, does not enter the bound.
    given
        Candidates that are in every plan; they count.
    """
    best = max(int((problem.least > 0).any()), len(given), counting_bound(problem))
    if best >= n_stations:
        return best
    prices = large_bound(problem, n_stations=n_stations, given=given, work_limit=_PRICE_WORK, progress=progress)
    return max(best, prices.stations)


def counting_bound(problem: CoverProblem) -> int:
    """Bound from the largest single areas."""
    owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))
    capped_sum = np.zeros(problem.n_candidates, dtype=np.int64)
    bound = 0
    for counted, required, m in zip(problem.counts_for, problem.least, problem.seen_from, strict=True):
        area = np.zeros(problem.n_candidates, dtype=np.int64)
        np.add.at(area, owner, np.where(counted[problem.row], problem.ticks[problem.row], 0))
        area = -(-area // m)
        if required > 0:
            bound = max(bound, int(m))
        capped_sum += np.minimum(area, required)
        bound = max(bound, _fewest(area, int(required)))
    return max(bound, _fewest(capped_sum, int(problem.least.sum())))


def _fewest(area: Int64Array, required: int) -> int:
    """Number of the largest areas that together reach `required`."""
    if required <= 0:
        return 0
    return int(np.searchsorted(np.cumsum(np.sort(area)[::-1]), required)) + 1
