"""The most coverage with at most n stations: of one target, with a bound on how much any n stations could cover.

Input a `CoverProblem` and n, output a `MostCoverage`. What counts is the LAST target alone, everything in scope; what
the others require is dropped, since n stations may be too few for it.

CONTROL FLOW, `most_coverage`:

1. stations one after the other, each the one that adds most; with a network among those that keep the set joined
2. sets of n stations, annealed towards what the whole target has (annealing.py), longer and longer; the best is kept
3. a bound from the prices of a smallest plan that covers about as much (large_bound.py)

The bound. For any prices, u >= 0 of rows and p > 0 of a tick, m the looks that the target asks for, a set S that holds
the given candidates G covers at most

    1 / p (sum over rows of max(0, ticks_r p - m u_r) + sum over G of a_i + the n - |G| largest a_i of the others)

with a_i the sum of u_r over the rows that i sees: p ticks_r <= max(0, p ticks_r - m u_r) + m u_r where r counts, and
then m <= n_r. It is computed in whole numbers. The best prices are those that bound the stations of a plan which covers
what is covered at best, so a guess at that, then the bound itself, is what `large_bound` gets. A network only
makes less possible: the bound holds with it, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Int64Array, Proven
from planner_core.progress import BestSoFar, Progress, ProgressEvent, silent
from planner_core.select.check import check_selection
from planner_core.select.greedy import drop_redundant
from planner_core.select.large_bound import LagrangeBound, large_bound
from planner_core.select.network import Network, connect
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT, TARGET_UNIT
from planner_core.select.search import Search, check_input

#: Steps of the first annealing, a candidate; the next one gets twice as many.
_FIRST_STEPS_A_CANDIDATE = 50
_MOST_STEPS = 2**28
#: How often prices are made for the bound found so far, and the share of the work that all of them may do.
_BOUND_ROUNDS = 6
_BOUND_SHARE = 0.4
_DEFAULTS = Proven()
#: With `loops`: no candidate has the links that would keep the set joined, and it has fewer stations than allowed.
NOBODY_JOINS = "no further station can be connected"


@dataclass(frozen=True)
class MostCoverage:
    """A set of at most n candidates, and how far from the best it can be.

    chosen : given ones first. ticks : what it covers of the target, see `CoverProblem`. bound_ticks : no set of n
    candidates covers more. whole_ticks : all of the target. why_stopped : `proven`, `work limit`, `time limit`,
    `interrupted`, or see `NOBODY_JOINS`. work : numbers read, in 1e9.
    """

    n_stations: int
    chosen: tuple[int, ...]
    ticks: int
    bound_ticks: int
    whole_ticks: int
    why_stopped: str
    work: float

    @property
    def fraction(self) -> float:
        """Covered / whole; 1 where there is nothing to cover."""
        return self.ticks / self.whole_ticks if self.whole_ticks else 1.0

    @property
    def bound_fraction(self) -> float:
        """What `fraction` is at most, for any set of so many candidates."""
        return self.bound_ticks / self.whole_ticks if self.whole_ticks else 1.0


def most_coverage(
    problem: CoverProblem,
    n_stations: int,
    settings: Proven = _DEFAULTS,
    *,
    network: Network | None = None,
    given: Sequence[int] = (),
    start: Sequence[int] | None = None,
    progress: Progress = silent,
) -> MostCoverage:
    """Find at most `n_stations` candidates that cover much of the last target, and a bound on how much could be.

    Parameters
    ----------
    network
        The set has to be connected; None: not required.
    given
        Candidates that are in the set anyway; they count.
    start
        Another set of at most so many candidates. The result covers no less, where it holds all of `given` and hangs
        together.
    progress
        A KeyboardInterrupt that it raises ends the search, not the call, once there is a set.

    Raises
    ------
    RequirementError
        Fewer than 1 station, or fewer than are given or needed to join these; no target; unknown candidates.
    SelectionCheckError
        The result is not what it should be: a fault of ours.
    """
    _check_input(problem, n_stations, given, start, network)
    search = _CoverageSearch(_last_constraint(problem), n_stations, settings, network, tuple(given), progress)
    search.begin(start)
    search.run_until_interrupted()
    return search.result()


def coverage_bound(problem: CoverProblem, prices: LagrangeBound, n_stations: int) -> int:
    """Ticks of the only target that no set of `n_stations` candidates with the given ones exceeds: the formula above.

    Prices may be any; those of a tick above 0.
    """
    (price,) = prices.constraint_price
    (looks,) = problem.seen_from.tolist()
    (row_price,) = prices.row_price.tolist()
    worth = sum(
        max(0, tick * price - looks * each * TARGET_UNIT)
        for tick, each, counts in zip(problem.ticks.tolist(), row_price, problem.counts_for[0].tolist(), strict=True)
        if counts
    )
    seen = BOUND_UNIT - prices.margin
    others = np.sort(seen[~prices.given])[::-1][: max(n_stations - int(prices.given.sum()), 0)]
    worth += TARGET_UNIT * (sum(seen[prices.given].tolist()) + sum(others.tolist()))
    return int(min(worth // price, _whole(problem)))


def _last_constraint(problem: CoverProblem) -> CoverProblem:
    """The problem with its last target alone, all of it required."""
    last = replace(
        problem,
        counts_for=problem.counts_for[-1:],
        seen_from=problem.seen_from[-1:],
        required=problem.required[-1:],
        least=problem.least[-1:],
    )
    return _requiring(last, _whole(last))


def _requiring(problem: CoverProblem, ticks: int) -> CoverProblem:
    return replace(problem, required=np.array([ticks], dtype=np.int64), least=np.array([ticks], dtype=np.int64))


def _whole(problem: CoverProblem) -> int:
    return int(problem.ticks[problem.counts_for[0]].sum())


def _check_input(
    problem: CoverProblem,
    n_stations: int,
    given: Sequence[int],
    start: Sequence[int] | None,
    network: Network | None,
) -> None:
    if n_stations < max(1, len(given)):
        raise RequirementError(
            f"stations: got at most {n_stations}, expected {max(1, len(given))} or more: that many are given"
        )
    if problem.required.size == 0:
        raise RequirementError("most coverage: got no target, expected one to be covered")
    check_input(problem, network, given, start)
    if start is not None and len(start) > n_stations:
        raise RequirementError(f"start of selection: got {len(start)} candidates, expected at most {n_stations}")


class _CoverageSearch(Search):
    """One `most_coverage`; its bound is one of ticks."""

    def __init__(
        self,
        problem: CoverProblem,
        n_stations: int,
        settings: Proven,
        network: Network | None,
        given: tuple[int, ...],
        progress: Progress,
    ) -> None:
        super().__init__(problem, settings, network=network, given=given, progress=progress)
        self._n = min(n_stations, problem.n_candidates)
        self._allowed = n_stations
        self._whole = self._bound = _whole(problem)
        self._ticks = -1

    @property
    def _is_proven(self) -> bool:
        return self._ticks >= self._bound

    # ------------------------------------------------------------------------------------------ the flow
    def begin(self, start: Sequence[int] | None) -> None:
        """Take a first set; from here on there is a result."""
        first = list(self._given)
        if self._network is not None and self._network.n_violations(first) > 0:
            first = connect(self._problem, self._network, first)
        if len(first) > self._n:
            raise RequirementError(
                f"stations: got at most {self._allowed}, expected {len(first)} or more: as many as it takes to connect "
                f"the {len(self._given)} given ones"
            )
        self._offer(fill(self._problem, first, self._n, network=self._network))
        if start is not None and set(self._given) <= set(start):
            known = list(dict.fromkeys((*self._given, *start)))
            if self._network is None or self._network.n_violations(known) == 0:
                self._offer(known)
                self._offer(fill(self._problem, known, self._n, network=self._network))

    def run(self) -> None:
        """Improve set and bound until they meet or a limit is reached."""
        if self._n <= len(self._given):
            self._bound = self._ticks  # there is no other set
        self._prove()
        if not self._go_on():
            return
        annealer = self._annealer(self._problem, self._network)
        step_work = self._work_of_a_step(self._problem, self._network, self._n)
        round_, n_steps = 0, _FIRST_STEPS_A_CANDIDATE * self._problem.n_candidates
        while self._go_on():
            round_ += 1
            whole_set = fill(self._problem, self._best, self._n, network=self._network, fully=True)
            if len(whole_set) <= len(self._given):
                self.limits.why_stopped = NOBODY_JOINS
                return
            sets = np.array([whole_set] * self._settings.n_walks, dtype=np.int32)
            for done, _ in self._anneal_in_turns(annealer, sets, round_=round_, n_steps=n_steps, step_work=step_work):
                for each in sets.tolist():
                    if self._network is None or self._network.n_violations(each) == 0:
                        self._offer(each)
                share = self._ticks / self._whole
                best = BestSoFar(len(self._best), chosen=tuple(self._best), fraction=share)
                self._progress(ProgressEvent("select", done, n_steps, f"{share:.2%} covered", best=best))
                if not self._go_on():
                    break
            n_steps = min(2 * n_steps, _MOST_STEPS)

    def result(self) -> MostCoverage:
        """What was found so far, without stations that nothing hangs on."""
        met = _requiring(self._problem, self._ticks)
        chosen = drop_redundant(met, self._best, given=self._given, network=self._network)
        check_selection(met, chosen, given=self._given, network=self._network)
        ticks, why = self._ticks, self._why_stopped
        return MostCoverage(self._allowed, tuple(chosen), ticks, self._bound, self._whole, why, self._work)

    # ------------------------------------------------------------------------------------------- the turns
    def _offer(self, chosen: list[int]) -> None:
        """Keep a set that covers more."""
        ticks = int(self._problem.covered(chosen)[0])
        if ticks > self._ticks:
            self._best, self._ticks = list(chosen), ticks

    def _prove(self) -> None:
        """Bound by prices for about what can be covered: what is, at first, then the bound itself."""
        about = max(self._ticks, 1)
        for _ in range(_BOUND_ROUNDS):
            if self._whole == 0 or not self._go_on():
                return
            prices = large_bound(
                _requiring(self._problem, about),
                n_stations=self._n,
                given=self._given,
                work_limit=_BOUND_SHARE / _BOUND_ROUNDS * self._settings.work_limit,
                progress=self._progress,
            )
            self._work += prices.work
            before = self._bound
            if prices.constraint_price[0] > 0:
                self._bound = min(before, coverage_bound(self._problem, prices, self._n))
            if self._bound < before:
                about = self._bound  # Newton's step: the least number of stations is convex in what they cover
            elif prices.stations < self._n:
                about = (about + before) // 2  # it led beyond the whole: too far to the left
            else:
                return


def fill(
    problem: CoverProblem,
    chosen: Sequence[int],
    n_stations: int,
    *,
    network: Network | None = None,
    fully: bool = False,
) -> list[int]:
    """`chosen` and, one after the other, the candidate that adds most looks, until there are `n_stations`.

    It ends earlier where nobody adds anything, unless `fully`. With a network only those may come who keep `chosen`,
    which is connected, joined: by one link in their part, or by two with `loops` where two or more are there. Of
    equals the lowest number.
    """
    (looks,) = problem.seen_from.tolist()
    seer_starts, seers = problem.seers()
    starts = seer_starts.tolist()
    worth = np.where(problem.counts_for[0], problem.ticks, 0)
    running = np.concatenate([[0], np.cumsum(worth[problem.row])])
    gain: Int64Array = running[problem.starts[1:]] - running[problem.starts[:-1]]
    n_seen = np.zeros(problem.n_rows, dtype=np.int64)
    gate = None if network is None else _Gate(network)
    now: list[int] = []

    def take(candidate: int) -> None:
        rows = problem.rows_of(candidate)
        n_seen[rows] += 1
        for row in rows[n_seen[rows] == looks].tolist():
            gain[seers[starts[row] : starts[row + 1]]] -= worth[row]
        gain[candidate] = -1
        now.append(candidate)
        if gate is not None:
            gate.let_in(candidate)

    for candidate in chosen:
        take(candidate)
    while len(now) < n_stations:
        left = gain if gate is None else np.where(gate.open, gain, -1)
        best = int(np.argmax(left))
        if left[best] < 0 or (left[best] == 0 and not fully):
            break
        take(best)
    return now


class _Gate:
    """Which candidates keep a set joined when they come to it."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._n_links = np.zeros(network.n_candidates, dtype=np.int64)
        self._n_of_part = np.zeros(network.n_parts, dtype=np.int64)
        self.open: BoolArray = np.ones(network.n_candidates, dtype=bool)

    def let_in(self, candidate: int) -> None:
        """Take one into the set."""
        part = self._network.part[candidate]
        self._n_links[self._network.neighbours(candidate)] += 1
        self._n_of_part[part] += 1
        members = self._network.part == part
        needed = min(int(self._n_of_part[part]), 2 if self._network.loops else 1)
        self.open[members] = self._n_links[members] >= needed
