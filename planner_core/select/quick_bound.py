"""A lower bound on the number of stations: no plan on these candidates can do with fewer.

Input a `CoverProblem`, output a whole number. Two bounds, the larger counts:

- Counting. For a target that needs R, any k stations cover at most the sum of the k largest areas single candidates
  cover of it; the smallest k for which that reaches R is a bound. So it is for all targets' sum, each capped at R.
- Lagrange. With x the stations, y the covered rows and prices u >= 0 on y_r <= sum of x_i that see r,

      L(u) = sum over i of min(0, 1 - sum of u_r seen by i) + sum over targets of min { u.y : area.y >= R, 0 <= y <= 1 }

  is at most the number of stations for every u. The last minimum is a fractional knapsack: the cheapest rows by price
  per area. Subgradient steps raise L(u) towards the value of the linear relaxation. Targets that overlap others (the
  whole building) are left out here and bounded by counting: leaving a demand out keeps the bound valid.

Where m looks are required, a row counts for at most the sum of x_i that see it, divided by m: in both bounds what a
candidate sees counts for one mth.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.problem import CoverProblem

_STEPS = 400
#: Rounding of L(u): sums of some ten thousand float64 prices are good to 1e-10.
_SLACK = 1e-6


def lower_bound(problem: CoverProblem, *, n_stations: int, progress: Progress = silent) -> int:
    """Compute the larger of both bounds.

    Parameters
    ----------
    n_stations
        Size of a plan that is known to meet the targets; guides the steps, does not enter the bound.
    """
    if not (problem.least > 0).any():
        return 0
    best = max(1, counting_bound(problem))
    if best >= n_stations:
        return best
    value = lagrange_bound(problem, n_stations=n_stations, progress=progress)
    return max(best, int(np.ceil(value - _SLACK)))


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


def lagrange_bound(problem: CoverProblem, *, n_stations: int, progress: Progress = silent) -> float:
    """Return the largest L(u) that the steps find."""
    from scipy import sparse

    parts = _disjoint(problem)
    shape = (problem.n_candidates, problem.n_rows)
    seen_by = sparse.csr_matrix((np.ones(problem.row.size), problem.row, problem.starts), shape=shape)
    sees = seen_by.T.tocsr()
    # Start: rows cost their share of what the best candidate that sees them covers; nothing is overpaid.
    ticks = problem.ticks.astype(np.float64)
    price = ticks / max(float((seen_by @ ticks).max()), 1.0)
    m = np.ones(problem.n_rows)
    for rows, _, seen_from in parts:
        m[rows] = seen_from
    best, stuck, pace = 0.0, 0, 1.0
    for step in range(_STEPS):
        paid = 1.0 - seen_by @ (price / m)
        taken = _cheapest_cover(problem, parts, price)
        value = float(np.minimum(paid, 0.0).sum() + (price * taken).sum())
        if value > best + 1e-4:
            best, stuck = value, 0
        else:
            stuck += 1
            if stuck == 15:
                pace, stuck = pace / 2, 0
        slope = taken - sees @ (paid < 0).astype(np.float64) / m
        norm = float((slope * slope).sum())
        if norm == 0.0:
            break
        price = np.maximum(price + pace * (n_stations - value) / norm * slope, 0.0)
        progress(ProgressEvent("bound", step + 1, _STEPS))
    return best


def _disjoint(problem: CoverProblem) -> list[tuple[Int64Array, int, int]]:
    """Targets that share no rows, smallest first taken: (rows, required ticks, looks required)."""
    taken: BoolArray = np.zeros(problem.n_rows, dtype=bool)
    parts = []
    for index in np.argsort(problem.counts_for.sum(axis=1), kind="stable"):
        rows = np.flatnonzero(problem.counts_for[index])
        if problem.least[index] > 0 and not taken[rows].any():
            taken[rows] = True
            parts.append((rows, int(problem.least[index]), int(problem.seen_from[index])))
    return parts


def _cheapest_cover(problem: CoverProblem, parts: list[tuple[Int64Array, int, int]], price: FloatArray) -> FloatArray:
    """(R,) float64 in [0, 1]: the rows that meet the targets at least price, the last one in part."""
    taken = np.zeros(problem.n_rows)
    for rows, required, _ in parts:
        ticks = problem.ticks[rows]
        order = np.argsort(price[rows] / np.maximum(ticks, 1), kind="stable")
        filled = np.cumsum(ticks[order])
        last = int(np.searchsorted(filled, required))
        taken[rows[order[:last]]] = 1.0
        before = int(filled[last - 1]) if last else 0
        taken[rows[order[last]]] = (required - before) / max(int(ticks[order[last]]), 1)
    return taken


def _fewest(area: Int64Array, required: int) -> int:
    """Number of the largest areas that together reach `required`."""
    if required <= 0:
        return 0
    return int(np.searchsorted(np.cumsum(np.sort(area)[::-1]), required)) + 1
