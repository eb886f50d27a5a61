"""The linear relaxation of selection by cutting planes, and bounds of it that hold in exact arithmetic.

Input a `CoverProblem`, output `Cut`s, prices of them and a lower bound on the number of stations.

Let x_i be 1 where candidate i is chosen. What a set covers of target k is the sum of ticks_r min(1, cover_r(x)), with
cover_r the number of chosen candidates that see row r. For ANY set S of rows this is at most what S holds in all, and
for the others ticks_r cover_r(x). So each S gives an inequality in x alone (Benders 1962; Nemhauser, Wolsey 1981 for
submodular functions), with A_i what i sees of target k outside S:

    sum over i of A_i x_i >= least_k - ticks of S counted by k =: need        (needs need > 0)

A_i may be cut down to `need`: for x in {0, 1} that changes no solution, and the relaxation gets tighter. All cuts
together are the linear relaxation, and more. The one that x violates most has S = rows with cover_r(x) >= 1.

Where a row counts for target k only when m = seen_from_k chosen candidates see it, then for any set T of t < m of those
who do, at least m - t of the others are chosen too:

    [cover_r(x) >= m]  <=  sum of x_i over those who see r and are not in T, / (m - t)

So A_i adds up ticks_r / (m - t_r) over the rows where i is not in T_r. T_r are the t_r largest x_i, and t_r is what
makes the right side least; S has the rows where that is 1 or more. With m = 1 this is the above.

The bound. For any prices p >= 0 of cuts A_c x >= b_c and any lower <= x <= upper,

    sum of x >= sum over cuts of p_c b_c + sum over i of min over x_i of (1 - sum over cuts of p_c A_ci) x_i

Cuts are kept as whole numbers: A / need in units of 2^-24, rounded UP, which only weakens them. The solver (HiGHS) gets
just these numbers; its prices are rounded to units of 2^-20, and the bound is then a sum of whole numbers. Whatever the
solver does in floating point, the bound holds. Nothing of it asks that A be positive, or b be 1: cuts that join
stations (network_cuts.py) have b = 1, 0 or -1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.select.problem import CoverProblem

#: 1, in coefficients and right sides of cuts. Rounding up costs a bound of n stations n * 2^-23 at most.
CUT_UNIT = 2**24
PRICE_UNIT = 2**20
#: Stations in units of a bound.
BOUND_UNIT = CUT_UNIT * PRICE_UNIT
#: Quotients below 2^24 in float64 are good to 2^-28.
_QUOTIENT_SLACK = 2.0**-20
#: A target is met by x, for the solver, from here on.
_VIOLATION = 1e-6
#: A row of the linear program that had no price for so many solutions is left out.
_IDLE_SOLUTIONS = 12
#: Of the dual simplex method, for one probe of a branch.
_PROBE_ITERATIONS = 100
_NO_LIMIT = 2**31 - 1


@dataclass(frozen=True)
class Cut:
    """Sum of coefficient_i x_i >= right. coefficient : (N,) int64, none beyond +-CUT_UNIT; both in 1 / CUT_UNIT."""

    coefficient: Int64Array
    right: int = CUT_UNIT


@dataclass(frozen=True)
class Bound:
    """scaled : lower bound on the number of stations, in 1 / BOUND_UNIT.

    margin : (N,) int64, what a station at i adds to it where i is not chosen yet; negative: what leaving i out adds.
    """

    scaled: int
    margin: Int64Array

    @property
    def stations(self) -> int:
        """The bound in whole stations."""
        return -(-self.scaled // BOUND_UNIT)


@dataclass(frozen=True)
class Shares:
    """What a point covers of each row at most, where `seen_from` candidates must see it.

    part : (R,), 1 or more is all. n_out : (R,) int64, the number t of candidates that are left out. row, owner : (E,)
    int64, which ones.
    """

    seen_from: int
    part: FloatArray
    n_out: Int64Array
    row: Int64Array
    owner: Int64Array


class CutMaker:
    """Cuts of a problem that points x violate."""

    def __init__(self, problem: CoverProblem) -> None:
        from scipy import sparse

        shape = (problem.n_candidates, problem.n_rows)
        one = np.ones(problem.row.size)
        self.problem = problem
        self._sees = sparse.csr_matrix((one, problem.row, problem.starts), shape=shape)
        #: (K, R): what counts, and is seen by as many candidates as are asked for.
        n_viewers = np.bincount(problem.row, minlength=problem.n_rows)
        self._counted: BoolArray = problem.counts_for & (n_viewers >= problem.seen_from[:, None])
        self._weight = np.where(self._counted, problem.ticks, 0).astype(np.float64)
        self._all_ticks = int(problem.ticks.sum())
        self._owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))
        self._targets = _independent_targets(problem)

    def violated(self, x: FloatArray) -> list[Cut]:
        """Cuts, one a target that x in [0, 1]^N does not meet."""
        problem = self.problem
        shares = {m: self.shares(x, m) for m in set(problem.seen_from[self._targets].tolist())}
        cuts = []
        for target in self._targets:
            weight, least = self._weight[target], int(problem.least[target])
            share = shares[int(problem.seen_from[target])]
            # Not as a product of vectors: libraries add those up differently on other numbers of cores.
            if least > 0 and float((np.minimum(share.part, 1.0) * weight).sum()) < least * (1.0 - _VIOLATION):
                cut = self.cut(target, share.part >= 1.0 - 1e-9, share)
                if cut is not None:
                    cuts.append(cut)
        return cuts

    def shares(self, x: FloatArray, seen_from: int) -> Shares:
        """How far x covers each row at most, where `seen_from` candidates are asked for, and whom to leave out."""
        at = np.flatnonzero(x)
        cover = self._sees[at].T @ x[at]
        n_rows = self.problem.n_rows
        none = np.zeros(0, dtype=np.int64)
        best = Shares(seen_from, cover / seen_from, np.zeros(n_rows, dtype=np.int64), none, none)
        if seen_from == 1:
            return best
        # Entries (row, candidate) of candidates with a share, largest first within each row.
        entry = np.flatnonzero(x[self._owner] > 0)
        row, owner = self.problem.row[entry], self._owner[entry]
        order = np.lexsort((owner, -x[owner], row))
        row, owner = row[order], owner[order]
        place = np.arange(row.size) - np.searchsorted(row, row)
        part, n_out = best.part, best.n_out
        for t in range(1, seen_from):
            at = place == t - 1
            cover[row[at]] -= x[owner[at]]
            if self._unit(seen_from) % (seen_from - t):
                continue
            smaller = cover / (seen_from - t) < part - 1e-9
            part, n_out = np.where(smaller, cover / (seen_from - t), part), np.where(smaller, t, n_out)
        out = place < n_out[row]
        return Shares(seen_from, part, n_out, row[out], owner[out])

    def cut(self, target: int, full: BoolArray, share: Shares | None = None) -> Cut | None:
        """Return the cut of the rows `full`; None where they alone meet the target. share : for other than t = 0."""
        problem = self.problem
        counted, m = self._counted[target], int(problem.seen_from[target])
        need = int(problem.least[target]) - int(problem.ticks[counted & full].sum())
        if need <= 0:
            return None
        unit = self._unit(m)
        n_out = np.zeros(problem.n_rows, dtype=np.int64) if share is None else share.n_out
        ticks = np.where(counted & ~full, problem.ticks, 0) * (unit // (m - n_out))
        seen = self._sum_seen(ticks, exact_in_float=self._all_ticks * unit < 2**53)
        if share is not None and share.row.size:
            np.subtract.at(seen, share.owner, ticks[share.row])
        seen = np.minimum(seen, min(need * unit, 2**63 - 1))
        scaled = np.floor(seen / float(need * unit) * CUT_UNIT + _QUOTIENT_SLACK).astype(np.int64) + 1
        return Cut(np.where(seen > 0, np.minimum(scaled, CUT_UNIT), 0))

    def reaches(self, allowed: BoolArray) -> bool:
        """Whether all allowed candidates together reach `least` of every target."""
        problem = self.problem
        cover = np.bincount(problem.row[allowed[self._owner]], minlength=problem.n_rows)
        seen = cover >= problem.seen_from[:, None]
        covered = (problem.counts_for * np.where(seen, problem.ticks, 0)).sum(axis=1)
        return bool((covered >= problem.least).all())

    def _unit(self, seen_from: int) -> int:
        """A multiple of 1 .. seen_from, by which ticks can be divided; `seen_from` itself where that is too large."""
        unit = math.lcm(*range(1, seen_from + 1))
        return unit if self._all_ticks * unit < 2**62 else seen_from

    def _sum_seen(self, ticks: Int64Array, *, exact_in_float: bool) -> Int64Array:
        # Whole numbers below 2^53 add up exactly in float64, in any order.
        if exact_in_float:
            summed: Int64Array = (self._sees @ ticks.astype(np.float64)).astype(np.int64)
            return summed
        total = np.zeros(self.problem.n_candidates, dtype=np.int64)
        np.add.at(total, self._owner, ticks[self.problem.row])
        return total


def _independent_targets(problem: CoverProblem) -> list[int]:
    """Targets that others do not imply: those of disjoint parts of it, asked for as often, that add up to as much."""
    # Few rows first, of equals those that ask for less: what is left in the end has no twin.
    kept = np.lexsort((problem.least, problem.counts_for.sum(axis=1))).tolist()
    for target in list(kept):
        m = problem.seen_from[target]
        left, implied = problem.counts_for[target].copy(), 0
        for other in kept:
            part = problem.counts_for[other]
            if other != target and problem.seen_from[other] >= m and not (part & ~left).any():
                left &= ~part
                implied += int(problem.least[other])
        if implied >= problem.least[target]:
            kept.remove(target)
    return sorted(kept)


def exact_bound(cuts: Int64Array, right: Int64Array, price: FloatArray, lower: Int64Array, upper: Int64Array) -> Bound:
    """Lower bound of sum x over lower <= x <= upper and the cuts, for any prices; see the head of this module.

    Parameters
    ----------
    cuts, right
        (C, N) and (C,) int64, in 1 / CUT_UNIT.
    price
        (C,); negative ones count as 0. Their sum must be below 2^18.
    lower, upper
        (N,) 0 or 1.
    """
    whole = np.floor(np.clip(price, 0.0, 2.0**18) * PRICE_UNIT).astype(np.int64)
    used = np.flatnonzero(whole)
    if int(whole.sum()) >= 2**38:
        raise ValueError(f"prices: got a sum of {whole.sum() / PRICE_UNIT:g}, expected less than {2**18}")
    margin = BOUND_UNIT - whole[used] @ cuts[used]
    at_best = np.where(margin < 0, upper, lower) * margin
    paid = sum(p * b for p, b in zip(whole[used].tolist(), right[used].tolist(), strict=True))
    return Bound(paid + sum(at_best[at_best != 0].tolist()), margin)


class CutProgram:
    """A linear program in HiGHS: least sum of x within bounds and cuts. It is solved from where it was solved last.

    A slack that serves all cuts, at a price of more stations than any plan needs, keeps it solvable.
    """

    def __init__(self, n_candidates: int, *, slack_price: float) -> None:
        import highspy

        self.n_candidates = n_candidates
        self.cuts: Int64Array = np.zeros((0, n_candidates), dtype=np.int64)
        self.right: Int64Array = np.zeros(0, dtype=np.int64)
        self.n_iterations = 0
        self._idle = np.zeros(0, dtype=np.int64)
        self._infinity = highspy.kHighsInf
        self._optimal = highspy.HighsModelStatus.kOptimal
        self._highs: Any = highspy.Highs()  # type: ignore[no-untyped-call]
        for name, value in (("output_flag", False), ("threads", 1), ("parallel", "off"), ("random_seed", 0)):
            self._highs.setOptionValue(name, value)
        cost = np.append(np.ones(n_candidates), slack_price)
        upper = np.append(np.ones(n_candidates), self._infinity)
        none = np.zeros(0, dtype=np.int32)
        self._highs.addCols(cost.size, cost, np.zeros(cost.size), upper, 0, none, none, np.zeros(0))

    def add(self, cuts: list[Cut]) -> None:
        """Add rows."""
        for cut in cuts:
            at = np.append(np.flatnonzero(cut.coefficient), self.n_candidates).astype(np.int32)
            value = np.append(cut.coefficient[at[:-1]] / CUT_UNIT, 1.0)
            self._highs.addRow(cut.right / CUT_UNIT, self._infinity, at.size, at, value)
        rows = np.array([cut.coefficient for cut in cuts], dtype=np.int64).reshape(-1, self.n_candidates)
        self.cuts = np.concatenate([self.cuts, rows])
        self.right = np.append(self.right, np.array([cut.right for cut in cuts], dtype=np.int64))
        self._idle = np.append(self._idle, np.zeros(len(cuts), dtype=np.int64))

    def set_range(self, lower: Int64Array, upper: Int64Array) -> None:
        """Let every x_i lie in lower_i .. upper_i."""
        at = np.arange(self.n_candidates, dtype=np.int32)
        self._highs.changeColsBounds(at.size, at, lower.astype(np.float64), upper.astype(np.float64))

    def solve(self) -> tuple[FloatArray, FloatArray]:
        """X (N,) in [0, 1] and prices (C,) of the cuts; nothing is claimed of them, see `exact_bound`."""
        self._highs.run()
        if self._highs.getModelStatus() != self._optimal:
            self._highs.clearSolver()  # a start from scratch, once: the old basis may be singular by now
            self._highs.run()
        self.n_iterations += max(int(self._highs.getInfo().simplex_iteration_count), 0)
        found: Any = self._highs.getSolution()
        x = np.clip(np.array(found.col_value[:-1], dtype=np.float64), 0.0, 1.0)
        price = np.maximum(np.array(found.row_dual, dtype=np.float64), 0.0)
        self._idle = np.where(price > 0, 0, self._idle + 1)
        return x, price

    def probe(
        self, at: Int64Array, lower: Int64Array, upper: Int64Array, *, enough: float
    ) -> tuple[FloatArray, dict[tuple[int, int], FloatArray]]:
        """(n, 2): about how much the least sum is if x is 0 and if it is 1, for each of the candidates `at`.

        After some iterations from the last solution, which is kept: a guide for branching. For (number in `at`, 0 or
        1) where it is more than `enough`, also prices of the cuts: they may prove it, see `exact_bound`.
        """
        solver = self._highs
        basis = solver.getBasis()
        values = np.empty((at.size, 2))
        prices: dict[tuple[int, int], FloatArray] = {}
        solver.setOptionValue("simplex_iteration_limit", _PROBE_ITERATIONS)
        for number, candidate in enumerate(at.tolist()):
            for value in (0, 1):
                solver.changeColBounds(candidate, float(value), float(value))
                solver.run()
                values[number, value] = solver.getObjectiveValue()
                if values[number, value] > enough:
                    prices[number, value] = np.array(solver.getSolution().row_dual, dtype=np.float64)
                self.n_iterations += max(int(solver.getInfo().simplex_iteration_count), 0)
                solver.changeColBounds(candidate, float(lower[candidate]), float(upper[candidate]))
                solver.setBasis(basis)
        solver.setOptionValue("simplex_iteration_limit", _NO_LIMIT)
        return values, prices

    def drop_idle(self) -> None:
        """Leave out cuts that had no price for long."""
        idle = np.flatnonzero(self._idle >= _IDLE_SOLUTIONS).astype(np.int32)
        if idle.size:
            self._highs.deleteRows(idle.size, idle)
            self.cuts = np.delete(self.cuts, idle, axis=0)
            self.right = np.delete(self.right, idle)
            self._idle = np.delete(self._idle, idle)
