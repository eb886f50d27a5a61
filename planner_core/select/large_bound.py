"""A lower bound on the number of stations for large problems: prices of rows and targets, from the linear relaxation.

Input a `CoverProblem`, output a `LagrangeBound`: a bound that holds in exact arithmetic, what a station at each
candidate adds to it, and a solution of the relaxation that says which candidates matter.

Let n_r be the number of chosen candidates that see row r, and z_r^m = 1 where n_r >= m, for each m that a target asks
for in `seen_from`. Then m z_r^m <= n_r, and the rows of target k with z = 1 have at least least_k ticks. With prices
u >= 0 of the former and p >= 0 of the latter, and x_i = 1 where i is chosen, 0 elsewhere, every plan has at least

    sum over k of p_k least_k + sum over i of min over x_i of (1 - sum over m and r seen by i of u_r^m) x_i
                              + sum over m and r of min(0, m u_r^m - ticks_r sum over k of m that count r of p_k)

stations (Lagrangian relaxation). `price_bound` computes that in whole numbers for whole prices, whatever they are.

Good prices come from the saddle point of the same sum in x and z in [0, 1], u and p, where its value is that of the
linear relaxation. It is found by primal-dual steps: x and z go down the slope, u and p up the slope of twice the new
point less the old one, each coordinate in steps that its row or column of the matrix allows; from time to time they go
on from the mean of the points so far. A step is two products with the matrix of who sees what; nothing else grows with
its entries.

CONTROL FLOW, `large_bound`: it looks at point and mean every `_STEPS_A_LOOK` steps, keeps the best prices, and stops
where the relaxation is known well enough or no step could add a whole station.

References
----------
Chambolle, Pock 2011 (primal-dual steps), Pock, Chambolle 2011 (a step length for each coordinate), Applegate et al.
2021 (linear programs that way, going on from means): known results, restated here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.bit_rows import classes_of
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT

#: Prices of targets, stations a tick, are whole numbers of 1 / (BOUND_UNIT * TARGET_UNIT).
TARGET_UNIT = 2**20
#: Prices of all rows together must stay below this in 1 / BOUND_UNIT, so that 63 bits hold any sum of them.
_MOST_PRICES = 2**62
#: Steps between two looks, which cost about two steps each.
_STEPS_A_LOOK = 40
#: Work of a step besides what grows with the problem; and more steps bring nothing.
_STEP_WORK = 100_000
_MOST_STEPS = 20_000
#: It goes on from the mean of the points when that has closed so much of the gap, at the latest after so many looks.
_RESTART_GAP = 0.4
_RESTART_LOOKS = 8
#: Enough: the relaxation is known to this share.
_NEAR_ENOUGH = 2e-3
#: Steps of stations and rows are as much longer than those of prices as a candidate sees rows, times this.
_BALANCE = 0.1
#: What a target's price changes in a step if all of it is missing, as a share of a price that would pay for the plan.
_TARGET_PACE = 1.0


@dataclass(frozen=True)
class LagrangeBound:
    """What prices prove.

    scaled : lower bound on the number of stations, in 1 / BOUND_UNIT. margin : (N,) int64, what a station at i adds to
    it where i is not chosen yet, in 1 / BOUND_UNIT; negative: what leaving it out adds. given : (N,) bool, candidates
    that are in every plan. row_price : (M, R) int64, in 1 / BOUND_UNIT, for the M different numbers of `seen_from` in
    rising order. target_price : K whole numbers, a tick, in 1 / (BOUND_UNIT TARGET_UNIT). share : (N,) in [0, 1],
    nearly a solution of the relaxation. relaxation_at_most : what the relaxation is at most, but for rounding; nothing
    is proven by it. work : numbers looked at, in 1e9.
    """

    scaled: int
    margin: Int64Array
    given: BoolArray
    row_price: Int64Array
    constraint_price: tuple[int, ...]
    share: FloatArray
    relaxation_at_most: float
    work: float

    @property
    def stations(self) -> int:
        """The bound in whole stations."""
        return max(0, -(-self.scaled // BOUND_UNIT))

    @property
    def value(self) -> float:
        """The bound, not rounded up to whole stations."""
        return self.scaled / BOUND_UNIT

    def fixed_out(self, n_stations: int) -> BoolArray:
        """(N,) bool: candidates that no plan of fewer than `n_stations` holds."""
        spare = (n_stations - 1) * BOUND_UNIT - self.scaled
        out: BoolArray = (self.margin > max(spare, 0)) & ~self.given
        return out


def large_bound(
    problem: CoverProblem,
    *,
    n_stations: int,
    given: Sequence[int] = (),
    work_limit: float = 60.0,
    progress: Progress = silent,
) -> LagrangeBound:
    """Find good prices and what they prove.

    Parameters
    ----------
    n_stations
        Size of a plan that is known; scales the first steps, does not enter the bound.
    given
        Candidates that are in every plan; they count.
    work_limit
        Numbers to look at, in 1e9, roughly seconds of one core; a first look is taken in any case.
    """
    lower = np.zeros(problem.n_candidates, dtype=np.int64)
    lower[list(given)] = 1
    saddle = _Saddle(problem, lower.astype(np.float64), n_stations=max(n_stations, 1))
    n_steps = max(_STEPS_A_LOOK, min(int(work_limit / saddle.work_of_a_step), _MOST_STEPS))
    if not (problem.least > 0).any():
        n_steps = 0
    best, relaxed = saddle.look(mean=False), saddle.look(mean=False)
    restart_gap, looks = float("inf"), 0
    while saddle.n_steps < n_steps:
        for _ in range(min(_STEPS_A_LOOK, n_steps - saddle.n_steps)):
            saddle.step()
        looks += 1
        views = (saddle.look(mean=True), saddle.look(mean=False))
        best = max((best, *views), key=lambda view: view.value)
        relaxed = min((relaxed, *views), key=lambda view: view.at_most)
        note = f"at least {best.value:.1f}, relaxation at most {relaxed.at_most:.1f}"
        progress(ProgressEvent("bound", saddle.n_steps, n_steps, note))
        if best.value >= (1.0 - _NEAR_ENOUGH) * relaxed.at_most or np.ceil(best.value) >= relaxed.at_most:
            break
        gaps = [view.at_most - view.value for view in views]
        if min(gaps) <= _RESTART_GAP * restart_gap or looks >= _RESTART_LOOKS:
            saddle.restart(from_mean=gaps[0] < gaps[1])
            restart_gap, looks = min(gaps), 0
    prices = saddle.whole(*best.prices)
    work = saddle.n_steps * saddle.work_of_a_step
    scaled, margin = price_bound(problem, *prices, lower)
    return LagrangeBound(scaled, margin, lower > 0, *prices, relaxed.share, relaxed.at_most, work)


def price_bound(
    problem: CoverProblem, row_price: Int64Array, constraint_price: Sequence[int], lower: Int64Array
) -> tuple[int, Int64Array]:
    """Lower bound that prices prove, and every candidate's margin, in whole numbers: the formula above.

    Parameters
    ----------
    row_price, target_price
        (M, R) and K whole numbers, as in `LagrangeBound`; none may be negative.
    lower
        (N,) 1 for candidates that are in every plan, 0 for others.
    """
    times = np.unique(problem.seen_from)
    if row_price.shape != (times.size, problem.n_rows) or len(constraint_price) != problem.required.size:
        raise ValueError(
            f"prices: got {row_price.shape} of rows and {len(constraint_price)} of targets, expected "
            f"{(times.size, problem.n_rows)} and {problem.required.size}"
        )
    if (
        (row_price < 0).any()
        or min(constraint_price, default=0) < 0
        or sum(map(int, row_price.sum(axis=1))) >= _MOST_PRICES
    ):
        raise ValueError("prices: expected 0 or more, rows' less than 2^62 in all")
    # Sums wrap around, differences of them are below 2^63 and right again.
    running = np.concatenate([[0], np.cumsum(row_price.sum(axis=0)[problem.row])])
    margin = BOUND_UNIT - (running[problem.starts[1:]] - running[problem.starts[:-1]])
    at_best = np.minimum(margin, 0) * (1 - lower) + margin * lower
    scaled = TARGET_UNIT * sum(at_best[at_best != 0].tolist())
    scaled += sum(price * least for price, least in zip(constraint_price, problem.least.tolist(), strict=True))
    class_of, counts = classes_of(problem)
    ticks = problem.ticks.tolist()
    for m, prices in zip(times.tolist(), row_price, strict=True):
        of_class = [
            sum(p for p, c, n in zip(constraint_price, column, problem.seen_from, strict=True) if c and n == m)
            for column in counts.T.tolist()
        ]
        for tick, kind, price in zip(ticks, class_of.tolist(), prices.tolist(), strict=True):
            scaled += min(0, m * price * TARGET_UNIT - tick * of_class[kind])
    return scaled // TARGET_UNIT, margin


@dataclass(frozen=True)
class _View:
    """A point looked at: prices of rows (M, R) and targets (K,), their bound; stations, and what they amount to."""

    prices: tuple[FloatArray, FloatArray]
    value: float
    share: FloatArray
    at_most: float


class _Saddle:
    """The point of the steps. Areas are in units of the mean row's, prices in stations for that."""

    def __init__(self, problem: CoverProblem, lower: FloatArray, *, n_stations: int) -> None:
        from scipy import sparse

        n, r = problem.n_candidates, problem.n_rows
        one = np.ones(problem.row.size)
        self._sees: Any = sparse.csr_matrix((one, problem.row, problem.starts), shape=(n, r))
        self._seen_by: Any = self._sees.T.tocsr()
        self._lower = lower
        self._unit = max(float(problem.ticks.sum()) / max(r, 1), 1.0)
        self._weight = problem.ticks / self._unit
        self._least = problem.least / self._unit
        class_of, counts = classes_of(problem)
        self._class_of, self._counts = class_of, counts.astype(np.float64)
        self._times, self._layer = np.unique(problem.seen_from, return_inverse=True)
        self.n_steps = 0
        self.work_of_a_step = 1e-9 * (_STEP_WORK + 2 * problem.row.size + 20 * r * self._times.size)
        self._set_paces(n_stations)
        self._x = np.maximum(np.full(n, min(1.0, n_stations / max(n, 1))), lower)
        self._cover = self._seen_by @ self._x
        self._z = np.minimum(self._cover / self._times[:, None], 1.0)
        self._u = np.broadcast_to(self._first_price, self._z.shape).copy()
        self._p = self._first_constraint_price.copy()
        self._clear()

    def _set_paces(self, n_stations: int) -> None:
        """Lengths of steps, for every coordinate."""
        share = (1.0 / self._times).sum()
        seen = np.maximum(self._sees @ self._weight, 1e-9)
        balance = _BALANCE * float(seen.sum()) / seen.size
        seers = np.diff(self._seen_by.indptr)
        self._pace_x = balance / (seen * share)
        n_constraints = np.array([self._counts[:, c].sum() for c in range(self._counts.shape[1])])[self._class_of]
        self._pace_z = balance / np.maximum(self._weight * (1.0 + n_constraints), 1e-12)
        self._pace_u = self._weight / (balance * (1.0 + seers / self._times[:, None]))
        all_counted = np.maximum(self._covered(np.ones((self._times.size, self._weight.size))), 1e-9)
        asked = np.maximum(self._least, 1e-9)
        first = n_stations / float(asked.sum())
        self._first_constraint_price = np.full(asked.size, first)
        self._first_price = self._weight / float(seen.max())
        self._pace_p = np.minimum(_TARGET_PACE * first / asked, 1.0 / (balance * all_counted))

    # ------------------------------------------------------------------------------------------- the steps
    def step(self) -> None:
        """One step down in stations and rows, one up in prices."""
        down_x = 1.0 - self._sees @ (self._u / self._times[:, None]).sum(axis=0)
        x = np.clip(self._x - self._pace_x * down_x, self._lower, 1.0)
        z = np.clip(self._z - self._pace_z * (self._u - self._worth(self._p)), 0.0, 1.0)
        cover = self._seen_by @ x
        ahead = 2.0 * z - self._z
        short = ahead - (2.0 * cover - self._cover) / self._times[:, None]
        self._u = np.maximum(self._u + self._pace_u * short, 0.0)
        self._p = np.maximum(self._p + self._pace_p * (self._least - self._covered(ahead)), 0.0)
        self._x, self._z, self._cover = x, z, cover
        for total, part in zip(self._sums, (self._x, self._z, self._u, self._p), strict=True):
            total += part
        self._n_summed += 1
        self.n_steps += 1

    def restart(self, *, from_mean: bool) -> None:
        """Begin a new mean, and go on from the old one or from where it is."""
        if from_mean:
            self._x, self._z, self._u, self._p = (total / self._n_summed for total in self._sums)
            self._cover = self._seen_by @ self._x
        self._clear()

    def _clear(self) -> None:
        self._sums = [np.zeros_like(part) for part in (self._x, self._z, self._u, self._p)]
        self._n_summed = 0

    def _worth(self, p: FloatArray) -> FloatArray:
        """(M, R): what targets pay for each row."""
        worth = np.zeros((self._times.size, self._weight.size))
        for layer in range(self._times.size):
            of_class = np.zeros(self._counts.shape[1])
            for k in np.flatnonzero(self._layer == layer):
                of_class += p[k] * self._counts[k]
            worth[layer] = of_class[self._class_of] * self._weight
        return worth

    def _covered(self, z: FloatArray) -> FloatArray:
        """(K,): area of each target."""
        n_classes = self._counts.shape[1]
        by_class = [np.bincount(self._class_of, weights=self._weight * each, minlength=n_classes) for each in z]
        return np.array([(by_class[layer] * self._counts[k]).sum() for k, layer in enumerate(self._layer)])

    # ------------------------------------------------------------------------------------------- looking
    def look(self, *, mean: bool) -> _View:
        """Look what the point, or the mean of points, is worth."""
        x, _, u, p = (total / self._n_summed for total in self._sums) if mean else (self._x, self._z, self._u, self._p)
        worth = self._worth(p)
        u = np.minimum(u, worth)
        margin = 1.0 - self._sees @ (u / self._times[:, None]).sum(axis=0)
        stations = float(np.where(margin < 0, margin, self._lower * margin).sum())
        value = float((p * self._least).sum()) + stations - float((worth - u).sum())
        return _View((u, p), value, x, self._enough(x))

    def _enough(self, x: FloatArray) -> float:
        """Number of stations that x amounts to when multiplied so that it meets all targets."""
        cover = (self._seen_by @ x) / self._times[:, None]
        low, high = 0.0, 2.0
        for _ in range(24):
            middle = (low + high) / 2
            met = (self._covered(np.minimum(middle * cover, 1.0)) >= self._least).all()
            low, high = (low, middle) if met else (middle, high)
        return high * float(x.sum()) if high < 2.0 else float("inf")

    def whole(self, u: FloatArray, p: FloatArray) -> tuple[Int64Array, tuple[int, ...]]:
        """Prices in whole numbers; u here pays for m looks at once, in `LagrangeBound` for one."""
        row_price = np.floor(u / self._times[:, None] * BOUND_UNIT).astype(np.int64)
        return row_price, tuple(int(price / self._unit * BOUND_UNIT * TARGET_UNIT) for price in p.tolist())
