"""The linear relaxation of selection by cutting planes, and bounds of it that hold in exact arithmetic.

Input a `CoverProblem`, output `Cut`s, prices of them and a lower bound on the number of stations.

Let x_i be 1 where candidate i is chosen. What a set covers of target k is the sum of ticks_r min(1, cover_r(x)), with
cover_r the number of chosen candidates that see row r. For ANY set S of rows this is at most what S holds in all, and
for the others ticks_r cover_r(x). So each S gives an inequality in x alone (Benders 1962; Nemhauser, Wolsey 1981 for
submodular functions), with A_i what i sees of target k outside S:

    sum over i of A_i x_i >= least_k - ticks of S counted by k =: need        (needs need > 0)

A_i may be cut down to `need`: for x in {0, 1} that changes no solution, and the relaxation gets tighter. All cuts
together are the linear relaxation, and more. The one that x violates most has S = rows with cover_r(x) >= 1.

The bound. For any prices p >= 0 and any lower <= x <= upper,

    sum of x >= sum over cuts of p_c + sum over i of min over x_i of (1 - sum over cuts of p_c A_ci / need_c) x_i

Cuts are kept as whole numbers: A / need in units of 2^-24, rounded UP, which only weakens them. The solver (HiGHS) gets
just these numbers; its prices are rounded to units of 2^-20, and the bound is then a sum of whole numbers. Whatever the
solver does in floating point, the bound holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.select.problem import CoverProblem

#: A cut's right side. Rounding up costs a bound of n stations n * 2^-23 at most.
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
_PROBE_ITERATIONS = 40
_NO_LIMIT = 2**31 - 1


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


class CutMaker:
    """Cuts of a problem that points x violate."""

    def __init__(self, problem: CoverProblem) -> None:
        from scipy import sparse

        shape = (problem.n_candidates, problem.n_rows)
        one = np.ones(problem.row.size)
        self.problem = problem
        self._sees = sparse.csr_matrix((one, problem.row, problem.starts), shape=shape)
        self._seen_by = self._sees.T.tocsr()
        self._weight = np.where(problem.counts_for, problem.ticks, 0).astype(np.float64)
        #: Whole numbers below 2^53 add up exactly in float64, in any order.
        self._exact_in_float = int(problem.ticks.sum()) < 2**53
        self._owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))

    def violated(self, x: FloatArray) -> list[Int64Array]:
        """Cuts, one a target that x in [0, 1]^N does not meet: (N,) int64 in 1 / CUT_UNIT, their right side is 1."""
        problem = self.problem
        cover = self._seen_by @ x
        full = cover >= 1.0 - 1e-9
        part = np.minimum(cover, 1.0)
        cuts = []
        for counted, weight, least in zip(problem.counts_for, self._weight, problem.least, strict=True):
            # Not as a product of vectors: libraries add those up differently on other numbers of cores.
            if least > 0 and float((part * weight).sum()) < float(least) * (1.0 - _VIOLATION):
                cut = self.cut(counted, int(least), full)
                if cut is not None:
                    cuts.append(cut)
        return cuts

    def cut(self, counted: BoolArray, least: int, full: BoolArray) -> Int64Array | None:
        """Return the cut of the rows `full`; None where they alone meet the target."""
        ticks = self.problem.ticks
        need = least - int(ticks[counted & full].sum())
        if need <= 0:
            return None
        seen = np.minimum(self._sum_seen(np.where(counted & ~full, ticks, 0)), need)
        scaled = np.floor(seen / need * CUT_UNIT + _QUOTIENT_SLACK).astype(np.int64) + 1
        result: Int64Array = np.where(seen > 0, np.minimum(scaled, CUT_UNIT), 0)
        return result

    def reaches(self, allowed: BoolArray) -> bool:
        """Whether all allowed candidates together reach `least` of every target."""
        seen = np.zeros(self.problem.n_rows, dtype=bool)
        seen[self.problem.row[allowed[self._owner]]] = True
        covered = (self.problem.counts_for * np.where(seen, self.problem.ticks, 0)).sum(axis=1)
        return bool((covered >= self.problem.least).all())

    def _sum_seen(self, ticks: Int64Array) -> Int64Array:
        if self._exact_in_float:
            summed: Int64Array = (self._sees @ ticks.astype(np.float64)).astype(np.int64)
            return summed
        total = np.zeros(self.problem.n_candidates, dtype=np.int64)
        np.add.at(total, self._owner, ticks[self.problem.row])
        return total


def exact_bound(cuts: Int64Array, price: FloatArray, lower: Int64Array, upper: Int64Array) -> Bound:
    """Lower bound of sum x over lower <= x <= upper and the cuts, for any prices; see the head of this module.

    Parameters
    ----------
    cuts
        (C, N) int64, in 1 / CUT_UNIT.
    price
        (C,) of a cut with right side 1; negative ones count as 0. Their sum must be below 2^18.
    lower, upper
        (N,) 0 or 1.
    """
    whole = np.floor(np.clip(price, 0.0, 2.0**18) * PRICE_UNIT).astype(np.int64)
    used = np.flatnonzero(whole)
    if int(whole.sum()) >= 2**38:
        raise ValueError(f"prices: got a sum of {whole.sum() / PRICE_UNIT:g}, expected less than {2**18}")
    margin = BOUND_UNIT - whole[used] @ cuts[used]
    at_best = np.where(margin < 0, upper, lower) * margin
    return Bound(int(whole.sum()) * CUT_UNIT + sum(at_best[at_best != 0].tolist()), margin)


class CutProgram:
    """A linear program in HiGHS: least sum of x within bounds and cuts. It is solved from where it was solved last.

    A slack that serves all cuts, at a price of more stations than any plan needs, keeps it solvable.
    """

    def __init__(self, n_candidates: int, *, slack_price: float) -> None:
        import highspy

        self.n_candidates = n_candidates
        self.cuts: Int64Array = np.zeros((0, n_candidates), dtype=np.int64)
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

    def add(self, cuts: list[Int64Array]) -> None:
        """Add rows."""
        for cut in cuts:
            at = np.append(np.flatnonzero(cut), self.n_candidates).astype(np.int32)
            value = np.append(cut[at[:-1]] / CUT_UNIT, 1.0)
            self._highs.addRow(1.0, self._infinity, at.size, at, value)
        self.cuts = np.concatenate([self.cuts, np.array(cuts, dtype=np.int64).reshape(-1, self.n_candidates)])
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

    def probe(self, at: Int64Array, lower: Int64Array, upper: Int64Array) -> FloatArray:
        """(n, 2): about how much the least sum is if x is 0 and if it is 1, for each of the candidates `at`.

        After a few iterations from the last solution, which is kept: a guide for branching, nothing is proven by it.
        """
        solver = self._highs
        basis = solver.getBasis()
        values = np.empty((at.size, 2))
        solver.setOptionValue("simplex_iteration_limit", _PROBE_ITERATIONS)
        for number, candidate in enumerate(at.tolist()):
            for value in (0, 1):
                solver.changeColBounds(candidate, float(value), float(value))
                solver.run()
                values[number, value] = solver.getObjectiveValue()
                self.n_iterations += max(int(solver.getInfo().simplex_iteration_count), 0)
                solver.changeColBounds(candidate, float(lower[candidate]), float(upper[candidate]))
                solver.setBasis(basis)
        solver.setOptionValue("simplex_iteration_limit", _NO_LIMIT)
        return values

    def drop_idle(self) -> None:
        """Leave out cuts that had no price for long."""
        idle = np.flatnonzero(self._idle >= _IDLE_SOLUTIONS).astype(np.int32)
        if idle.size:
            self._highs.deleteRows(idle.size, idle)
            self.cuts = np.delete(self.cuts, idle, axis=0)
            self._idle = np.delete(self._idle, idle)
