"""A lower bound on the number of stations for large problems: prices of rows and targets, from the linear relaxation.

Input a `CoverProblem`, output a `LagrangeBound`: a bound that holds in exact arithmetic, what a station at each
candidate adds to it, and a solution of the relaxation: which candidates matter.

Let n_r be the number of chosen candidates that see row r, and z_r^m = 1 where n_r >= m, for each m that a target asks
for in `seen_from`. Then m z_r^m <= n_r, and the rows of target k with z = 1 have at least least_k ticks. With prices
u >= 0 of the former and p >= 0 of the latter, and x_i = 1 where i is chosen, 0 elsewhere, every plan has at least

    sum over k of p_k least_k + sum over i of min over x_i of (1 - sum over m and r seen by i of u_r^m) x_i
                              + sum over m and r of min(0, m u_r^m - ticks_r sum over k of m that count r of p_k)

stations (Lagrangian relaxation). `price_bound` computes that in whole numbers for whole prices, whatever they are.

Where stations are connected, each but one a part has a parent and need not be counted for what that sees, too
(attachments.py). The sum over i is then over its modes, of which x takes one at most; u^1 alone is counted less. Of a
part one station at most is the first, and n_parts in all: they are those that make the sum least.

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
from typing import TYPE_CHECKING

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.bit_rows import classes_of
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT, TARGET_UNIT

if TYPE_CHECKING:
    from planner_core.select.attachments import AttachmentModes

#: Prices of all rows together must stay below this in 1 / BOUND_UNIT, so that 63 bits hold any sum of them.
_MOST_PRICES = 2**62
#: Of a mode that there is not.
_NEVER = 2**62
#: Steps between two looks, which cost about two steps each.
_STEPS_A_LOOK = 40
#: More steps bring nothing.
_MOST_STEPS = 20_000
#: It goes on from the mean of the points when that has closed so much of the gap, at the latest after so many looks.
_RESTART_GAP = 0.4
_RESTART_LOOKS = 8
#: Enough: the relaxation is known to this share.
_NEAR_ENOUGH = 2e-3


@dataclass(frozen=True)
class LagrangeBound:
    """What prices prove.

    scaled : lower bound on the number of stations, in 1 / BOUND_UNIT. margin : (N,) int64, what a station at i adds to
    it where i is not chosen yet, in 1 / BOUND_UNIT; negative: what leaving it out adds. given : (N,) bool, candidates
    that are in every plan. row_price : (M, R) int64, in 1 / BOUND_UNIT, for the M different numbers of `seen_from` in
    rising order. target_price : K whole numbers, a tick, in 1 / (BOUND_UNIT TARGET_UNIT). share : (N,) in [0, 1],
    nearly a solution of the relaxation. relaxation_at_most : what the relaxation is at most, but for rounding; nothing
    is proven by it. work : numbers read, in 1e9.
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
    network: Network | None = None,
    n_parts: int | None = None,
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
    network
        Plans are connected by it: what a station's neighbour sees, too, counts once. None: not required.
    n_parts
        Of plans that are in no more parts of the network; None: in any.
    work_limit
        Numbers to look at, in 1e9, roughly seconds of one core; a first look is taken in any case.
    """
    from planner_core.select.attachments import attachment_modes
    from planner_core.select.primal_dual import PrimalDual  # brings numba along, which takes a while

    lower = np.zeros(problem.n_candidates, dtype=np.int64)
    lower[list(given)] = 1
    modes = attachment_modes(problem, network)
    n_parts = problem.n_candidates if n_parts is None else n_parts
    primal_dual = PrimalDual(problem, modes, lower.astype(np.float64), n_stations=max(n_stations, 1), n_parts=n_parts)
    n_steps = max(_STEPS_A_LOOK, min(int(work_limit / primal_dual.work_of_a_step), _MOST_STEPS))
    if not (problem.least > 0).any():
        n_steps = 0
    best, relaxed = primal_dual.look(mean=False), primal_dual.look(mean=False)
    restart_gap, looks = float("inf"), 0
    while primal_dual.n_steps < n_steps:
        for _ in range(min(_STEPS_A_LOOK, n_steps - primal_dual.n_steps)):
            primal_dual.step()
        looks += 1
        views = (primal_dual.look(mean=True), primal_dual.look(mean=False))
        best = max((best, *views), key=lambda view: view.value)
        relaxed = min((relaxed, *views), key=lambda view: view.at_most)
        note = f"at least {best.value:.1f}, relaxation at most {relaxed.at_most:.1f}"
        progress(ProgressEvent("bound", primal_dual.n_steps, n_steps, note))
        if best.value >= (1.0 - _NEAR_ENOUGH) * relaxed.at_most or np.ceil(best.value) >= relaxed.at_most:
            break
        gaps = [view.at_most - view.value for view in views]
        if min(gaps) <= _RESTART_GAP * restart_gap or looks >= _RESTART_LOOKS:
            primal_dual.restart(from_mean=gaps[0] < gaps[1])
            restart_gap, looks = min(gaps), 0
    prices = primal_dual.whole(*best.prices)
    work = primal_dual.n_steps * primal_dual.work_of_a_step
    scaled, margin = price_bound(problem, *prices, lower, modes, n_parts=n_parts)
    return LagrangeBound(scaled, margin, lower > 0, *prices, relaxed.share, relaxed.at_most, work)


def price_bound(
    problem: CoverProblem,
    row_price: Int64Array,
    constraint_price: Sequence[int],
    lower: Int64Array,
    modes: AttachmentModes,
    *,
    n_parts: int = 2**31,
) -> tuple[int, Int64Array]:
    """Lower bound that prices prove, and every candidate's margin, in whole numbers: the formula above.

    Parameters
    ----------
    row_price, target_price
        (M, R) and K whole numbers, as in `LagrangeBound`; none may be negative.
    lower
        (N,) 1 for candidates that are in every plan, 0 for others.
    modes
        In which plans hold each candidate. n_parts : parts of the network that plans have anybody in, at most.
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
    at_best, margin = _margins(problem, row_price, lower, modes, n_parts)
    scaled = TARGET_UNIT * at_best
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


def _margins(
    problem: CoverProblem, row_price: Int64Array, lower: Int64Array, modes: AttachmentModes, n_parts: int
) -> tuple[int, Int64Array]:
    """Least that all candidates together add for these prices, and each one's margin, in 1 / BOUND_UNIT."""
    from planner_core.select.attachments import sums_of_modes

    times = np.unique(problem.seen_from)
    once = row_price[0] if times[:1].tolist() == [1] else np.zeros(problem.n_rows, dtype=np.int64)
    # Sums wrap around, differences of them are below 2^63 and right again.
    of_mode = BOUND_UNIT - sums_of_modes(problem, modes, row_price.sum(axis=0), once)
    if not problem.n_candidates:
        return 0, of_mode
    is_first = modes.first_of >= 0
    joined = np.minimum.reduceat(np.where(is_first, _NEVER, of_mode), modes.starts[:-1])
    if not is_first.any():
        return _sum(np.where(lower > 0, joined, np.minimum(joined, 0))), joined
    first, part = of_mode[is_first], modes.first_of[is_first]  # one a candidate
    base = np.where(lower > 0, np.where(joined < _NEVER, joined, first), np.minimum(joined, 0))
    # Of the candidates of a part one may be its first: whom this makes cheapest by most. So it is of n_parts parts.
    spared = np.zeros(int(part.max(initial=-1)) + 1, dtype=np.int64)
    np.minimum.at(spared, part, first - base)
    order = np.argsort(spared, kind="stable")
    most = order[:n_parts]
    instead = np.full(spared.size, spared[most[-1]] if 0 < n_parts <= spared.size else 0)
    instead[most] = spared[most]  # what another first of a part is in place of
    margin = np.minimum(joined, first - instead[part])
    return _sum(base) + _sum(spared[most]), margin


def _sum(numbers: Int64Array) -> int:
    """Of any size."""
    return sum(numbers[numbers != 0].tolist())
