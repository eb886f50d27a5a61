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

Where stations are connected, a separator of the network (separators.py) may bound a row by less than those who see it
have: its ticks then go to A_i of all candidates in the separator instead.

The bound. For any prices p >= 0 of cuts A_c x >= b_c and any lower <= x <= upper,

    sum of x >= sum over cuts of p_c b_c + sum over i of min over x_i of (1 - sum over cuts of p_c A_ci) x_i

Cuts are kept as whole numbers: A / need in units of 2^-24, rounded UP, which only weakens them. The solver (HiGHS) gets
just these numbers; its prices are rounded to units of 2^-20, and the bound is then a sum of whole numbers. Whatever the
solver does in floating point, the bound holds. Nothing of it asks that A be positive, or b be 1: cuts that join
stations (network_cuts.py) have b = 1, 0 or -1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array, UInt8Array
from planner_core.select.problem import CoverProblem

#: 1, in coefficients and right sides of cuts. Rounding up costs a bound of n stations n * 2^-23 at most.
CUT_UNIT = 2**24
PRICE_UNIT = 2**20
#: Stations in units of a bound.
BOUND_UNIT = CUT_UNIT * PRICE_UNIT
#: Prices of targets, stations a tick, are whole numbers of 1 / (BOUND_UNIT * TARGET_UNIT).
TARGET_UNIT = 2**20
#: Quotients below 2^24 in float64 are good to 2^-28.
_QUOTIENT_SLACK = 2.0**-20
#: `most` of cuts that bound on one side alone.
NO_MOST = 2**62
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
class Branch:
    """One candidate, or how many of a group are chosen: `below` or fewer on one side, more on the other."""

    candidate: int = -1
    group: int = -1
    below: int = 0


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
class SeparatorUse:
    """What a point has in separators (separators.py) at the rows that these bound.

    part : (R,) least x(Z) of any; 1 where there is none below. number : (R,) int64, of that separator; -1: none.
    between : of each separator the candidates, (M,) int64.
    """

    part: FloatArray
    number: Int64Array
    between: Sequence[Int64Array]


@dataclass(frozen=True)
class Shares:
    """What a point covers of each row at most, where `seen_from` candidates must see it.

    part : (R,), 1 or more is all. n_out : (R,) int64, the number t of candidates that are left out. row, owner : (E,)
    int32 and int64, which ones. through : (R,) int64, which of `between`, separators of the network, bounds a row;
    -1: none.
    """

    seen_from: int
    part: FloatArray
    n_out: Int64Array
    row: Int32Array
    owner: Int64Array
    through: Int64Array | None = None
    between: Sequence[Int64Array] = ()

    def by(self, through: SeparatorUse) -> Shares:
        """The same, with rows bounded by separators where these have less."""
        less = through.part < self.part
        part = np.where(less, through.part, self.part)
        return replace(self, part=part, through=np.where(less, through.number, -1), between=through.between)


class CutMaker:
    """Cuts of a problem that points x violate. first_seer, seer : who sees each row, see `CoverProblem.seers`."""

    def __init__(self, problem: CoverProblem) -> None:
        self.problem = problem
        self.first_seer, self.seer = problem.seers()
        #: (K, R): what counts, and is seen by as many candidates as required.
        self._counted: BoolArray = problem.counts_for & (np.diff(self.first_seer) >= problem.seen_from[:, None])
        self._weight = np.where(self._counted, problem.ticks, 0).astype(np.float64)
        self._all_ticks = int(problem.ticks.sum())
        self._owner = np.repeat(np.arange(problem.n_candidates), np.diff(problem.starts))
        self._constraints = independent_constraints(problem)

    def violated(self, x: FloatArray, through: SeparatorUse | None = None) -> list[Cut]:
        """Cuts, one a target that x in [0, 1]^N does not meet. through : rows may be counted by separators."""
        problem = self.problem
        shares = {m: self.shares(x, m) for m in set(problem.seen_from[self._constraints].tolist())}
        if through is not None and through.between and 1 in shares:
            shares[1] = shares[1].by(through)
        cuts = []
        for constraint in self._constraints:
            weight, least = self._weight[constraint], int(problem.least[constraint])
            share = shares[int(problem.seen_from[constraint])]
            # Not as a product of vectors: libraries add those up differently on other numbers of cores.
            if least > 0 and float((np.minimum(share.part, 1.0) * weight).sum()) < least * (1.0 - _VIOLATION):
                cut = self.cut(constraint, share.part >= 1.0 - 1e-9, share)
                if cut is not None:
                    cuts.append(cut)
        return cuts

    def shares(self, x: FloatArray, seen_from: int) -> Shares:
        """How far x covers each row at most, where `seen_from` candidates are required, and whom to leave out."""
        cover = self.cover(x)
        n_rows = self.problem.n_rows
        none = np.zeros(0, dtype=np.int64)
        best = Shares(seen_from, cover / seen_from, np.zeros(n_rows, dtype=np.int64), none.astype(np.int32), none)
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

    def cover(self, x: FloatArray) -> FloatArray:
        """(R,) the sum of x over those who see each row."""
        from planner_core.select import compiled_cuts

        cover = np.zeros(self.problem.n_rows)
        compiled_cuts.add_up(self.problem.starts, self.problem.row, x, cover)
        return cover

    def cut(self, constraint: int, full: BoolArray, share: Shares | None = None) -> Cut | None:
        """Return the cut of the rows `full`; None where they alone meet the target. share : for other than t = 0."""
        from planner_core.select import compiled_cuts

        problem = self.problem
        counted, m = self._counted[constraint], int(problem.seen_from[constraint])
        need = int(problem.least[constraint]) - int(problem.ticks[counted & full].sum())
        if need <= 0:
            return None
        unit = self._unit(m)
        n_out = np.zeros(problem.n_rows, dtype=np.int64) if share is None else share.n_out
        ticks = np.where(counted & ~full, problem.ticks, 0) * (unit // (m - n_out))
        seen = np.zeros(problem.n_candidates, dtype=np.int64)
        if share is not None and share.through is not None:
            for number in np.unique(share.through[(share.through >= 0) & (ticks > 0)]).tolist():
                at = share.through == number
                seen[share.between[number]] += int(ticks[at].sum())
                ticks[at] = 0
        compiled_cuts.add_up(self.first_seer, self.seer, ticks, seen)
        if share is not None and share.row.size:
            np.subtract.at(seen, share.owner, ticks[share.row])
        seen = np.minimum(seen, min(need * unit, 2**63 - 1))
        scaled = np.floor(seen / float(need * unit) * CUT_UNIT + _QUOTIENT_SLACK).astype(np.int64) + 1
        return Cut(np.where(seen > 0, np.minimum(scaled, CUT_UNIT), 0))

    def reaches(self, allowed: BoolArray) -> bool:
        """Whether all allowed candidates together reach `least` of every target."""
        problem = self.problem
        if (problem.seen_from == 1).all():
            seen_by = np.bitwise_or.reduce(self._bits[allowed], axis=0)  # of nobody: nothing
            seen = np.unpackbits(seen_by, count=problem.n_rows).astype(bool)[None]
        else:
            cover = np.bincount(problem.row[allowed[self._owner]], minlength=problem.n_rows)
            seen = cover >= problem.seen_from[:, None]
        covered = (problem.counts_for * np.where(seen, problem.ticks, 0)).sum(axis=1)
        return bool((covered >= problem.least).all())

    @cached_property
    def _bits(self) -> UInt8Array:
        """(N, ceil(R / 8)) uint8: rows of each candidate, as bits."""
        bits = np.zeros((self.problem.n_candidates, -(-self.problem.n_rows // 8)), dtype=np.uint8)
        sees = np.zeros(self.problem.n_rows, dtype=bool)
        for candidate in range(self.problem.n_candidates):
            rows = self.problem.rows_of(candidate)
            sees[rows] = True
            bits[candidate] = np.packbits(sees)
            sees[rows] = False
        return bits

    def _unit(self, seen_from: int) -> int:
        """A multiple of 1 .. seen_from, by which ticks can be divided; `seen_from` itself where that is too large."""
        unit = math.lcm(*range(1, seen_from + 1))
        return unit if self._all_ticks * unit < 2**62 else seen_from


def independent_constraints(problem: CoverProblem) -> list[int]:
    """Targets that others do not imply: those of disjoint parts of it, required as often, that add up to as much."""
    # Few rows first, of equals those that ask for less: what is left in the end has no twin.
    kept = np.lexsort((problem.least, problem.counts_for.sum(axis=1))).tolist()
    for constraint in list(kept):
        m = problem.seen_from[constraint]
        left, implied = problem.counts_for[constraint].copy(), 0
        for other in kept:
            part = problem.counts_for[other]
            if other != constraint and problem.seen_from[other] >= m and not (part & ~left).any():
                left &= ~part
                implied += int(problem.least[other])
        if implied >= problem.least[constraint]:
            kept.remove(constraint)
    return sorted(kept)


def exact_bound(
    cuts: Int64Array,
    right: Int64Array,
    price: FloatArray,
    lower: Int64Array,
    upper: Int64Array,
    most: Int64Array | None = None,
) -> Bound:
    """Lower bound of sum x over lower <= x <= upper and the cuts, for any prices; see the head of this module.

    Parameters
    ----------
    cuts, right
        (C, N) and (C,) int64, in 1 / CUT_UNIT.
    price
        (C,); negative ones count as 0, but for cuts that have a `most`. Their sum must be below 2^18.
    lower, upper
        (N,) 0 or 1.
    most
        (C,) int64, in 1 / CUT_UNIT: what each sum of a cut is at most, too; `NO_MOST` where that is not known. A
        negative price -p is p for the cut turned round: -A_c x >= -most.
    """
    least_price = np.zeros(price.size) if most is None else np.where(most < NO_MOST, -(2.0**18), 0.0)
    whole = np.trunc(np.clip(price, least_price, 2.0**18) * PRICE_UNIT).astype(np.int64)
    used = np.flatnonzero(whole)
    if int(np.abs(whole).sum()) >= 2**38:
        raise ValueError(f"prices: got a sum of {np.abs(whole).sum() / PRICE_UNIT:g}, expected less than {2**18}")
    margin = BOUND_UNIT - whole[used] @ cuts[used]
    at_best = np.where(margin < 0, upper, lower) * margin
    sides = right if most is None else np.where(whole < 0, most, right)
    paid = sum(p * b for p, b in zip(whole[used].tolist(), sides[used].tolist(), strict=True))
    return Bound(paid + sum(at_best[at_best != 0].tolist()), margin)


class CutProgram:
    """A linear program in HiGHS: least sum of x within bounds and cuts. It is solved from where it was solved last.

    A slack that serves all cuts, at a price of more stations than any plan needs, keeps it solvable.

    groups : (G, N) bool, candidates whose number can be bounded, see `set_counts`. cuts, right, most : (C, N), (C,),
    (C,) what it holds now, as `exact_bound` takes it.
    """

    def __init__(self, n_candidates: int, *, slack_price: float, groups: BoolArray | None = None) -> None:
        import highspy

        self.n_candidates = n_candidates
        self.groups: BoolArray = np.zeros((0, n_candidates), dtype=bool) if groups is None else groups
        self.cuts: Int64Array = np.zeros((0, n_candidates), dtype=np.int64)
        self.right: Int64Array = np.zeros(0, dtype=np.int64)
        self.most: Int64Array = np.zeros(0, dtype=np.int64)
        self.n_iterations = 0
        self._group = np.zeros(0, dtype=np.int64)  # of each row of the program, -1: it is a cut
        self._counts: dict[int, tuple[int, int]] = {}
        self._idle = np.zeros(0, dtype=np.int64)
        self._infinity = highspy.kHighsInf
        self._optimal = highspy.HighsModelStatus.kOptimal
        self._infeasible = highspy.HighsModelStatus.kInfeasible
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
        n = len(cuts)
        self._keep_rows(
            np.array([cut.coefficient for cut in cuts], dtype=np.int64).reshape(-1, self.n_candidates),
            np.array([cut.right for cut in cuts], dtype=np.int64),
            np.full(n, NO_MOST, dtype=np.int64),
            np.full(n, -1, dtype=np.int64),
        )

    def _keep_rows(self, cuts: Int64Array, right: Int64Array, most: Int64Array, group: Int64Array) -> None:
        self.cuts = np.concatenate([self.cuts, cuts])
        self.right, self.most = np.append(self.right, right), np.append(self.most, most)
        self._group = np.append(self._group, group)
        self._idle = np.append(self._idle, np.zeros(group.size, dtype=np.int64))

    def set_range(self, lower: Int64Array, upper: Int64Array) -> None:
        """Let every x_i lie in lower_i .. upper_i."""
        at = np.arange(self.n_candidates, dtype=np.int32)
        self._highs.changeColsBounds(at.size, at, lower.astype(np.float64), upper.astype(np.float64))

    def set_counts(self, counts: dict[int, tuple[int, int]]) -> None:
        """Let x of groups add up to least .. most, by number of the group; of all others to anything."""
        self._counts = dict(counts)
        for group in sorted(set(counts) - set(self._group.tolist())):
            at = np.flatnonzero(self.groups[group]).astype(np.int32)
            self._highs.addRow(0.0, float(at.size), at.size, at, np.ones(at.size))
            coefficient = np.where(self.groups[group], CUT_UNIT, 0).astype(np.int64)
            most = np.array([at.size * CUT_UNIT], dtype=np.int64)
            self._keep_rows(coefficient[None], np.zeros(1, dtype=np.int64), most, np.array([group]))
        for row in np.flatnonzero(self._group >= 0).tolist():
            group = int(self._group[row])
            least, most_ = counts.get(group, (0, int(self.groups[group].sum())))
            if (least * CUT_UNIT, most_ * CUT_UNIT) != (self.right[row], self.most[row]):
                self.right[row], self.most[row] = least * CUT_UNIT, most_ * CUT_UNIT
                self._highs.changeRowBounds(row, float(least), float(most_))

    def sides(self, group: int, least: int, most: int) -> tuple[Int64Array, Int64Array]:
        """`right` and `most` with another count of a group."""
        row = self._row_of(group)
        right, sides = self.right.copy(), self.most.copy()
        right[row], sides[row] = least * CUT_UNIT, most * CUT_UNIT
        return right, sides

    def _row_of(self, group: int) -> int:
        return int(np.flatnonzero(self._group == group)[0])

    def solve(self) -> tuple[FloatArray, FloatArray]:
        """X (N,) in [0, 1] and prices (C,) of the cuts; nothing is claimed of them, see `exact_bound`."""
        self._highs.run()
        if self._highs.getModelStatus() != self._optimal:
            self._highs.clearSolver()  # a start from scratch, once: the old basis may be singular by now
            self._highs.run()
        self.n_iterations += max(int(self._highs.getInfo().simplex_iteration_count), 0)
        found: Any = self._highs.getSolution()
        x = np.clip(np.array(found.col_value[:-1], dtype=np.float64), 0.0, 1.0)
        price = np.array(found.row_dual, dtype=np.float64)
        price = np.where(self._group < 0, np.maximum(price, 0.0), price)
        self._idle = np.where(price != 0, 0, self._idle + 1)
        return x, price

    def probe(
        self, branches: list[Branch], lower: Int64Array, upper: Int64Array, *, enough: float
    ) -> tuple[FloatArray, dict[tuple[int, int], FloatArray]]:
        """(n, 2): about how much the least sum is on either side of each branch: `below` or less, or more.

        After some iterations from the last solution, which is kept: a guide for branching. For (number in `branches`,
        0 or 1) where it is more than `enough`, also prices of the cuts: they may prove it, see `exact_bound`.
        """
        solver = self._highs
        self.set_counts(
            {**{b.group: (0, int(self.groups[b.group].sum())) for b in branches if b.group >= 0}, **self._counts}
        )
        basis = solver.getBasis()
        values = np.empty((len(branches), 2))
        prices: dict[tuple[int, int], FloatArray] = {}
        solver.setOptionValue("simplex_iteration_limit", _PROBE_ITERATIONS)
        for number, branch in enumerate(branches):
            for side in (0, 1):
                self._change(branch, side, lower, upper)
                solver.run()
                values[number, side] = solver.getObjectiveValue()
                if solver.getModelStatus() == self._infeasible:
                    values[number, side] = enough + 1.0
                elif values[number, side] > enough:
                    prices[number, side] = np.array(solver.getSolution().row_dual, dtype=np.float64)
                self.n_iterations += max(int(solver.getInfo().simplex_iteration_count), 0)
                self._change(branch, None, lower, upper)
                solver.setBasis(basis)
        solver.setOptionValue("simplex_iteration_limit", _NO_LIMIT)
        return values, prices

    def _change(self, branch: Branch, side: int | None, lower: Int64Array, upper: Int64Array) -> None:
        """Go to a side of a branch, or back."""
        if branch.group < 0:
            low, high = (int(lower[branch.candidate]), int(upper[branch.candidate])) if side is None else (side, side)
            self._highs.changeColBounds(branch.candidate, float(low), float(high))
            return
        row = self._row_of(branch.group)
        low, high = int(self.right[row]) // CUT_UNIT, int(self.most[row]) // CUT_UNIT
        if side is not None:
            low, high = (low, branch.below) if side == 0 else (branch.below + 1, high)
        self._highs.changeRowBounds(row, float(low), float(high))

    def drop_idle(self) -> None:
        """Leave out cuts that had no price for long, and groups whose number nobody bounds."""
        bounded = np.isin(self._group, list(self._counts))
        idle = np.flatnonzero((self._idle >= _IDLE_SOLUTIONS) & ~bounded).astype(np.int32)
        if idle.size:
            self._highs.deleteRows(idle.size, idle)
            self.cuts = np.delete(self.cuts, idle, axis=0)
            self.right, self.most = np.delete(self.right, idle), np.delete(self.most, idle)
            self._group, self._idle = np.delete(self._group, idle), np.delete(self._idle, idle)
