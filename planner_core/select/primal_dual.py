"""Primal-dual steps for prices of large problems: the point that `planner_core.select.large_bound` moves, compiled.

Input a `CoverProblem` and its `AttachmentModes`, output shares of modes and prices. Areas are in units of the mean
row's, prices in stations for that. A step is two sums over who sees what. All sums have one order, on any number of
cores.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.compiled import compiled, share_out
from planner_core.model import FloatArray, Int64Array
from planner_core.select.attachments import AttachmentModes, attachment_modes, sums_of_modes
from planner_core.select.bit_rows import classes_of
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT, TARGET_UNIT

#: Work of a step besides what grows with the problem.
_STEP_WORK = 100_000
#: Steps of stations and rows are as much longer than those of prices as a candidate sees rows, times this; and where
#: candidates have more than one mode.
_BALANCE, _BALANCE_OF_MODES = 0.1, 0.03
#: Modes of a candidate that move at once: of more than two hardly any has a share. Counted in full, steps are so short
#: that basement is at 72.8 where it could be at 75.4.
_MOVING_MODES = 2
#: What a target's price changes in a step if all of it is missing, as a share of a price that would pay for the plan.
_TARGET_PACE = 1.0
#: How much longer or shorter the steps of one side may become at once.
_MOST_SHIFT = 2.0


@dataclass(frozen=True)
class EvaluatedPoint:
    """An evaluated point: prices of rows (M, R) and targets (K,), their bound; stations, and what they amount to."""

    prices: tuple[FloatArray, FloatArray]
    value: float
    share: FloatArray
    at_most: float


class PrimalDual:
    """The point of the steps: x of modes, z of rows; prices u of rows, p of targets, s of being the first of a part.

    The last of s is the price of having one more part, of which there are `n_parts` at most.
    """

    def __init__(
        self, problem: CoverProblem, modes: AttachmentModes, lower: FloatArray, *, n_stations: int, n_parts: int
    ) -> None:
        n, r = problem.n_candidates, problem.n_rows
        self._problem, self._modes, self._lower = problem, modes, lower
        self._owner = modes.owner()
        self._unit = max(float(problem.ticks.sum()) / max(r, 1), 1.0)
        self._weight = problem.ticks / self._unit
        self._least = problem.least / self._unit
        self._class_of, counts = classes_of(problem)
        self._counts = counts.astype(np.float64)
        times, self._layer = np.unique(problem.seen_from, return_inverse=True)
        self._times = times.astype(np.float64)
        self.n_steps = 0
        self.work_of_a_step = 1e-9 * (
            _STEP_WORK + 2 * (problem.row.size + modes.again.size) + 20 * r * self._times.size
        )
        self._n_parts = int(modes.first_of.max(initial=-1)) + 1
        self._most_first = np.append(np.ones(self._n_parts), float(min(n_parts, self._n_parts)))
        self._set_paces(n_stations)
        n_modes = np.diff(modes.starts)
        self._x = np.maximum(np.full(n, min(1.0, n_stations / max(n, 1))), lower)[self._owner] / n_modes[self._owner]
        self._cover = self._cover_of(self._x)
        self._z = np.minimum(self._cover / self._times[:, None], 1.0)
        self._u = np.broadcast_to(self._first_price, self._z.shape).copy()
        self._p = self._first_constraint_price.copy()
        self._s = np.zeros(self._n_parts + 1)
        self._clear()

    def _set_paces(self, n_stations: int) -> None:
        """Lengths of steps, for every coordinate."""
        problem, modes = self._problem, self._modes
        share = (1.0 / self._times).sum()
        each = attachment_modes(problem, None)  # sums over entries, without an array of them; nobody repeats anything
        whole = sums_of_modes(problem, each, self._weight, self._weight)
        seen = np.maximum(whole, 1e-9)
        factor = _BALANCE if modes.n_modes == problem.n_candidates else _BALANCE_OF_MODES
        balance = factor * float(seen.sum()) / max(seen.size, 1)
        used, seers = np.minimum(np.diff(modes.starts), _MOVING_MODES).astype(np.float64), np.zeros(problem.n_rows)
        _cover(problem.starts, problem.row, each.starts, each.again_starts, each.again, used, seers, seers)
        self._pace_x = balance / (seen * share)
        n_constraints = np.array([self._counts[:, c].sum() for c in range(self._counts.shape[1])])[self._class_of]
        self._pace_z = balance / np.maximum(self._weight * (1.0 + n_constraints), 1e-12)
        self._pace_u = self._weight / (balance * (1.0 + seers / self._times[:, None]))
        all_counted = np.maximum(self._covered(np.ones((self._times.size, self._weight.size))), 1e-9)
        demanded = np.maximum(self._least, 1e-9)
        first = n_stations / float(demanded.sum())
        self._first_constraint_price = np.full(demanded.size, first)
        self._first_price = self._weight / float(seen.max())
        self._pace_p = np.minimum(_TARGET_PACE * first / demanded, 1.0 / (balance * all_counted))
        in_part = self._firsts(np.ones(modes.n_modes))
        self._pace_s = 1.0 / (factor * np.maximum(in_part, 1.0))

    # ------------------------------------------------------------------------------------------- the steps
    def step(self) -> None:
        """One step down in stations and rows, one up in prices."""
        modes = self._modes
        x = self._x - self._pace_x[self._owner] * self._margins(self._u, self._s)
        share_out(lambda begin, end: _project(modes.starts, self._lower, x, begin, end), self._lower.size)
        cover = self._cover_of(x)
        worth = self._worth_of_class(self._p)
        covered = np.zeros(self._counts.shape)
        for layer in range(self._times.size):
            by_class = np.zeros(self._counts.shape[1])
            _step_rows(
                self._weight, self._class_of, worth[layer], self._times[layer], self._pace_z, self._pace_u[layer],
                cover[layer], self._cover[layer], self._z[layer], self._u[layer], self._sums[1][layer],
                self._sums[2][layer], by_class,
            )  # fmt: skip
            at = self._layer == layer
            covered[at] = self._counts[at] * by_class
        self._p = np.maximum(self._p + self._pace_p * (self._least - covered.sum(axis=1)), 0.0)
        ahead = self._firsts(2.0 * x - self._x)
        self._s = np.maximum(self._s + self._pace_s * (ahead - self._most_first), 0.0)
        self._x, self._cover = x, cover
        for at_sum, part in ((0, self._x), (3, self._p), (4, self._s)):
            self._sums[at_sum] += part
        self._n_summed += 1
        self.n_steps += 1

    def restart(self, *, from_mean: bool) -> None:
        """Begin a new mean, and go on from the old one or from where it is."""
        if from_mean:
            self._x, self._z, self._u, self._p, self._s = (total / self._n_summed for total in self._sums)
            self._cover = self._cover_of(self._x)
        self._shift_balance()
        self._clear()

    def _shift_balance(self) -> None:
        """Longer steps for stations and rows and shorter ones for prices, or the reverse: for the side that moves most.

        Both sides ought to come equally far between two means, each in units of its steps (Applegate et al. 2021).
        """
        x, z, u, p = (new - old for new, old in zip((self._x, self._z, self._u, self._p), self._begun, strict=True))
        here = float((x**2 / self._pace_x[self._owner]).sum() + (z**2 / self._pace_z).sum())
        there = float((u**2 / self._pace_u).sum() + (p**2 / self._pace_p).sum())
        if here <= 0.0 or there <= 0.0:
            return
        # The ratio of distances, half of the way on a scale of logarithms: balances swing otherwise.
        shift = min(max((here / there) ** 0.25, 1.0 / _MOST_SHIFT), _MOST_SHIFT)
        self._pace_x, self._pace_z = self._pace_x * shift, self._pace_z * shift
        self._pace_u, self._pace_p, self._pace_s = self._pace_u / shift, self._pace_p / shift, self._pace_s / shift

    def _clear(self) -> None:
        self._begun = (self._x, self._z.copy(), self._u.copy(), self._p)
        self._sums = [np.zeros_like(part) for part in (self._x, self._z, self._u, self._p, self._s)]
        self._n_summed = 0

    def _margins(self, u: FloatArray, s: FloatArray) -> FloatArray:
        """(W,): what a mode adds to the bound, with the price of being first."""
        paid = (u / self._times[:, None]).sum(axis=0)
        once = u[0] if self._times[0] == 1 else np.zeros_like(paid)
        margin: FloatArray = 1.0 - sums_of_modes(self._problem, self._modes, paid, once)
        first = self._modes.first_of >= 0
        margin[first] += s[self._modes.first_of[first]] + s[-1]
        return margin

    def _firsts(self, x: FloatArray) -> FloatArray:
        """(P + 1,): share of firsts in each part, and in all."""
        first = self._modes.first_of >= 0
        of_part = np.bincount(self._modes.first_of[first], weights=x[first], minlength=self._n_parts)
        return np.append(of_part, of_part.sum())

    def _cover_of(self, x: FloatArray) -> FloatArray:
        """(M, R): looks at each row, as each number of looks counts them."""
        modes, problem = self._modes, self._problem
        cover, again = np.zeros(problem.n_rows), np.zeros(problem.n_rows)
        _cover(problem.starts, problem.row, modes.starts, modes.again_starts, modes.again, x, cover, again)
        return np.stack([cover - again if m == 1 else cover for m in self._times])

    def _worth_of_class(self, p: FloatArray) -> FloatArray:
        """(M, n_classes): what targets pay for a row's area."""
        worth = np.zeros((self._times.size, self._counts.shape[1]))
        for k, layer in enumerate(self._layer):
            worth[layer] += p[k] * self._counts[k]
        return worth

    def _covered(self, z: FloatArray) -> FloatArray:
        """(K,): area of each target."""
        n_classes = self._counts.shape[1]
        by_class = [np.bincount(self._class_of, weights=self._weight * each, minlength=n_classes) for each in z]
        return np.array([(by_class[layer] * self._counts[k]).sum() for k, layer in enumerate(self._layer)])

    # ------------------------------------------------------------------------------------------- looking
    def look(self, *, mean: bool) -> EvaluatedPoint:
        """Look what the point, or the mean of points, is worth."""
        parts = (self._x, self._z, self._u, self._p, self._s)
        x, _, u, p, s = (total / self._n_summed for total in self._sums) if mean else parts
        worth = self._worth_of_class(p)[:, self._class_of] * self._weight
        u = np.minimum(u, worth)
        modes = self._modes
        least = np.minimum.reduceat(self._margins(u, s), modes.starts[:-1]) if self._lower.size else np.zeros(0)
        stations = float(np.where(least < 0, least, self._lower * least).sum()) - float((s * self._most_first).sum())
        value = float((p * self._least).sum()) + stations - float((worth - u).sum())
        share: FloatArray = np.bincount(self._owner, weights=x, minlength=self._lower.size).astype(np.float64)
        return EvaluatedPoint((u, p), value, share, self._enough(x))

    def _enough(self, x: FloatArray) -> float:
        """Number of stations that x amounts to when multiplied so that it meets all targets, and of firsts too many."""
        cover = self._cover_of(x) / self._times[:, None]
        low, high = 0.0, 2.0
        for _ in range(24):
            middle = (low + high) / 2
            met = (self._covered(np.minimum(middle * cover, 1.0)) >= self._least).all()
            low, high = (low, middle) if met else (middle, high)
        too_many = float(np.maximum(high * self._firsts(x) - self._most_first, 0).sum())
        return high * float(x.sum()) + too_many if high < 2.0 else float("inf")

    def whole(self, u: FloatArray, p: FloatArray) -> tuple[Int64Array, tuple[int, ...]]:
        """Prices in whole numbers; u here pays for m looks at once, in `LagrangeBound` for one."""
        row_price = np.floor(u / self._times[:, None] * BOUND_UNIT).astype(np.int64)
        return row_price, tuple(int(price / self._unit * BOUND_UNIT * TARGET_UNIT) for price in p.tolist())


@compiled
def _project(mode_starts: Any, lower: Any, x: Any, first: int, end: int) -> None:
    """Bring the modes of each candidate to the nearest point of 0 or more each, `lower` to 1 together."""
    for i in range(first, end):
        begin, stop = mode_starts[i], mode_starts[i + 1]
        total = 0.0
        for w in range(begin, stop):
            total += max(x[w], 0.0)
        if total <= 1.0 and total >= lower[i]:
            for w in range(begin, stop):
                x[w] = max(x[w], 0.0)
            continue
        demanded = min(max(total, lower[i]), 1.0)
        order = np.sort(x[begin:stop])[::-1]
        run, level = 0.0, 0.0
        for k in range(order.size):
            run += order[k]
            if order[k] > (run - demanded) / (k + 1):
                level = (run - demanded) / (k + 1)
        for w in range(begin, stop):
            x[w] = max(x[w] - level, 0.0)


@compiled
def _cover(
    starts: Any, row: Any, mode_starts: Any, again_starts: Any, again: Any, x: Any, cover: Any, less: Any
) -> None:  # fmt: skip
    """Add up looks at rows, and those that modes do not count."""
    for i in range(starts.size - 1):
        total = 0.0
        for w in range(mode_starts[i], mode_starts[i + 1]):
            if x[w] == 0.0:
                continue
            total += x[w]
            for e in range(again_starts[w], again_starts[w + 1]):
                less[again[e]] += x[w]
        if total != 0.0:
            for e in range(starts[i], starts[i + 1]):
                cover[row[e]] += total


@compiled
def _step_rows(
    weight: Any, class_of: Any, worth: Any, m: float, pace_z: Any, pace_u: Any, cover: Any, cover_before: Any,
    z: Any, u: Any, sum_z: Any, sum_u: Any, by_class: Any,
) -> None:  # fmt: skip
    """Steps of all rows for m looks: z and u change, are added to their sums, and covered areas to those of classes."""
    for r in range(weight.size):
        before = z[r]
        after = min(max(before - pace_z[r] * (u[r] - worth[class_of[r]] * weight[r]), 0.0), 1.0)
        ahead = 2.0 * after - before
        short = ahead - (2.0 * cover[r] - cover_before[r]) / m
        price = max(u[r] + pace_u[r] * short, 0.0)
        z[r] = after
        u[r] = price
        sum_z[r] += after
        sum_u[r] += price
        by_class[class_of[r]] += ahead * weight[r]
