"""Selection for large problems: prices first, then annealing among the candidates that the prices leave interesting.

Input a `CoverProblem` of, say, 10 000 candidates and 100 000 rows, output a `ProvenSelection` as of `select`, which is
for problems small enough to prove. CONTROL FLOW, `select_large`:

1. greedy selection                                                                             greedy.py
2. parts of the set, taken out and recreated                                                     ruin_recreate.py
3. prices: the bound, what each candidate adds to it, nearly a solution of the relaxation        large_bound.py
4. greedy selection again, begun with the candidates of which that solution takes the most
5. one station less, annealed from the best set on, and as 2, in turn, until the work is done    annealing.py
   without a network, or for several looks or loops, 6 and 7 instead of 2 and 5
6. the core: candidates that the solution takes part of or that cost little, and the best set
7. sets of fewer stations of the core, annealed; what they miss in the end is filled up greedily    annealing.py

With a network fewest components come first, then fewest stations: a set in fewer parts of it is the better one as long
as it has no more stations than greedy selection's. The bound is one of sets in no more parts than the best.

The set of 7 is far smaller at first: it is aimed at half-way between the best and the bound, then nearer to the best as
filling up shows how many stations were missing. One station less at a time would take as many annealings as stations
are saved. Work is counted, not timed; same problem and same settings give the same set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Int64Array, Proven
from planner_core.progress import BestSoFar, Progress, ProgressEvent, silent
from planner_core.select.check import check_selection
from planner_core.select.greedy import select_greedy
from planner_core.select.large_bound import LagrangeBound, large_bound
from planner_core.select.network import Network, network_within
from planner_core.select.problem import CoverProblem
from planner_core.select.proven import Point, ProvenSelection, select
from planner_core.select.relaxation import BOUND_UNIT
from planner_core.select.search import Search, check_input, without_one

if TYPE_CHECKING:
    from planner_core.select.annealing import Annealer
    from planner_core.select.ruin_recreate import RuinRecreate

#: Beyond so many candidates, or entries (candidates times the rows that each sees), prices serve better than `select`.
_MOST_CANDIDATES, _MOST_ENTRIES = 1000, 3_000_000
#: A candidate is of the core if nearly a solution of the relaxation takes so much of it, or it costs so little more.
_CORE_SHARE = 1e-3
_CORE_MARGIN = BOUND_UNIT // 50
#: Candidates of which that solution takes so much begin another greedy selection.
_FIRST_SHARES = (0.9, 0.7, 0.5, 0.3)
#: Share of the work that prices may do at most.
_BOUND_SHARE = 0.3
#: And what is done before them, which finds how many parts of the network a set has.
_FIRST_LOCAL_SHARE = 0.15
#: Work of growing again between two looks.
_LOCAL_TURN = 0.2
#: Steps of the first annealing that goes on from a grown set, a candidate: sets that growing does not leave are often
#: left by few.
_SHORT_STEPS_A_CANDIDATE = 1
#: Steps of the first annealing, a candidate of the core; the next one after a failure gets twice as many.
_FIRST_STEPS_A_CANDIDATE = 50
_MOST_STEPS = 2**28
_DEFAULTS = Proven()
#: One station besides the given ones, and not proven: there is no smaller set to be annealed.
EXHAUSTED = "nothing left to exchange"


@dataclass(frozen=True)
class Core:
    """A problem with few of the candidates, which has good solutions of the whole one.

    candidate : (N',) int64, numbers in the whole problem, rising. network : links between them; parts keep their
    numbers.
    """

    problem: CoverProblem
    candidate: Int64Array
    network: Network | None = field(repr=False, default=None)

    def whole(self, chosen: Sequence[int]) -> list[int]:
        """Numbers in the whole problem."""
        return [int(self.candidate[c]) for c in chosen]

    def own(self, chosen: Sequence[int]) -> list[int]:
        """Numbers in the core of candidates that are in it.

        Raises
        ------
        ValueError
            One is not: a fault of ours.
        """
        at = np.searchsorted(self.candidate, np.array(chosen, dtype=np.int64))
        if not np.array_equal(self.candidate[np.minimum(at, self.candidate.size - 1)], chosen):
            raise ValueError(f"core of selection: got {list(chosen)}, expected candidates that are in it")
        return [int(c) for c in at]


def core_problem(
    problem: CoverProblem,
    bound: LagrangeBound,
    *,
    n_stations: int,
    also: Sequence[int] = (),
    network: Network | None = None,
) -> Core:
    """Keep candidates that may be of use in a plan of fewer than `n_stations`, and those of `also`.

    With a network of loops all candidates stay: which bridges no choice avoids hangs on all of them.
    """
    keep = (bound.share > _CORE_SHARE) | (bound.margin < _CORE_MARGIN)
    keep &= ~bound.fixed_out(n_stations)
    keep[list(also)] = True
    if network is not None and network.loops:
        keep[:] = True
    size = np.diff(problem.starts)
    restricted = replace(
        problem,
        starts=np.concatenate([[0], np.cumsum(size[keep])]).astype(np.int64),
        row=problem.row[np.repeat(keep, size)],
    )
    return Core(restricted, np.flatnonzero(keep), None if network is None else network_within(network, keep))


def select_large(
    problem: CoverProblem,
    settings: Proven = _DEFAULTS,
    *,
    network: Network | None = None,
    given: Sequence[int] = (),
    start: Sequence[int] | None = None,
    progress: Progress = silent,
) -> ProvenSelection:
    """Find few candidates that meet every target, and a lower bound on how few could: as `select`, for large problems.

    Parameters
    ----------
    network, given, start, progress
        See `planner_core.select.proven.select`. The result is no larger than `start` (where that holds all of `given`
        and is connected), nor than greedy selection's set, connected where a network is required. With a network it
        is in the fewest of its parts that were found, whatever number of stations up to these that takes.

    Raises
    ------
    RequirementError
        `given` or `start` are no candidates, `start` misses a target, or the network is one of other candidates.
    SelectionCheckError
        The result is not what it should be: a fault of ours.
    """
    check_input(problem, network, given, start)
    if start is not None and (problem.covered(list(start)) < problem.required).any():
        raise RequirementError(
            f"start of selection: got {len(start)} candidates that do not meet all targets, expected a set that does"
        )
    search = _LargeSearch(problem, settings, network=network, given=tuple(given), progress=progress)
    search.begin(start)
    search.run_until_interrupted()
    result = search.result()
    check_selection(problem, result.chosen, given=given, network=network)
    return result


def select_by_size(
    problem: CoverProblem, settings: Proven = _DEFAULTS, *, enough: int = 0, **how: Any
) -> ProvenSelection:
    """`select` for problems that it is made for, `select_large` for others; see there for `how`.

    enough : for `select` alone; as few stations may be in fewer parts of the network, which the other looks for.
    """
    return (
        select_large(problem, settings, **how) if is_large(problem) else select(problem, settings, enough=enough, **how)
    )


def is_large(problem: CoverProblem) -> bool:
    """Whether a problem is for `select_large`."""
    return problem.n_candidates > _MOST_CANDIDATES or problem.row.size > _MOST_ENTRIES


class _LargeSearch(Search):
    """One `select_large`."""

    def __init__(
        self,
        problem: CoverProblem,
        settings: Proven,
        *,
        network: Network | None,
        given: tuple[int, ...],
        progress: Progress,
    ) -> None:
        super().__init__(problem, settings, network=network, given=given, progress=progress)
        self._n_greedy = self._most = 0
        self._local_search: RuinRecreate | None = None
        self._curve: list[Point] = []

    # ------------------------------------------------------------------------------------------ the flow
    def begin(self, start: Sequence[int] | None) -> None:
        """Take a first set; from here on there is a result."""
        greedy = select_greedy(self._problem, given=self._given, progress=self._progress).chosen
        self._best = self._fit(list(greedy))
        self._n_greedy = len(self._best)
        self._most = len(self._best)
        self._note()
        if start is not None:
            known = self._fit([*self._given, *start])
            self._offer(known)
            if len(known) < self._most:  # the result is never larger
                self._best, self._most = known, len(known)
                self._note()

    def run(self) -> None:
        """Improve bound and set until they meet or a limit is reached."""
        if not self._go_on():
            return
        several = bool((self._problem.seen_from > 1).any())
        grows = not several and self._network is not None and not self._network.loops
        if grows:
            self._search_locally(_FIRST_LOCAL_SHARE * self._settings.work_limit)
            if not self._go_on():
                return
        prices = large_bound(
            self._problem,
            n_stations=len(self._best),
            given=self._given,
            network=self._network,
            n_parts=self._n_parts(self._best),
            work_limit=_BOUND_SHARE * self._settings.work_limit,
            progress=self._progress,
        )
        self._work += prices.work
        self._bound = min(max(self._bound, prices.stations), len(self._best))
        self._note()
        for share in _FIRST_SHARES:
            if not self._go_on():
                return
            likely = np.argsort(-prices.share, kind="stable")[: int((prices.share > share).sum())]
            self._offer(self._completed(self._problem, [*self._given, *likely.tolist()]))
        if grows:
            self._search_in_turn()
        elif self._go_on():
            self._anneal(prices)

    def result(self) -> ProvenSelection:
        """What was found so far."""
        return ProvenSelection(
            chosen=tuple(self._best),
            lower_bound=self._bound,
            why_stopped=self._why_stopped,
            work=self._work,
            n_greedy=self._n_greedy,
            curve=tuple(self._curve),
        )

    def _note(self) -> None:
        self._curve.append(Point(self._work, len(self._best), self._bound))

    # ------------------------------------------------------------------------------------------- sets
    def _offer(self, chosen: list[int]) -> bool:
        """Keep a better set that meets all and is joined: in fewer parts, or in as many with fewer stations."""
        better = (self._n_parts(chosen), len(chosen)) < (self._n_parts(self._best), len(self._best))
        fits = len(chosen) <= self._most
        if not better or not fits or (self._network is not None and self._network.n_violations(chosen) > 0):
            return False
        self._best, self._local_search = chosen, None
        self._note()
        return True

    def _n_parts(self, chosen: Sequence[int]) -> int:
        """Parts of the network that a set has anybody in."""
        return 0 if self._network is None else int(np.unique(self._network.part[list(chosen)]).size)

    def _completed(self, problem: CoverProblem, chosen: Sequence[int]) -> list[int]:
        """`chosen` and greedily more until all targets are met, less what is spare, joined."""
        begun = list(dict.fromkeys(chosen))
        return self._fit(list(select_greedy(problem, given=begun).chosen))

    # ------------------------------------------------------------------------------------------- growing
    def _search_locally(self, work: float) -> None:
        """Grow parts of the best set again for so much work, or until a limit is reached."""
        from planner_core.select.ruin_recreate import RuinRecreate  # brings numba along, which takes a while

        if self._local_search is None:
            self._local_search = RuinRecreate(
                self._problem,
                self._best,
                network=self._network,
                given=self._given,
                most=self._most,
                seed=self._settings.seed or 0,
            )
        local_search, n_tries, end = self._local_search, 1, self._work + work
        while self._go_on() and self._work < end:
            before = local_search.work
            better = local_search.tries(n_tries)
            self._work += local_search.work - before
            n_tries = max(1, min(2 * n_tries, int(n_tries * _LOCAL_TURN / max(local_search.work - before, 1e-9))))
            if better:
                self._best = local_search.chosen
                self._note()
            note = f"{len(self._best)} stations, at least {self._bound}, growing parts anew"
            best = BestSoFar(len(self._best), self._bound, tuple(self._best))
            self._progress(ProgressEvent("select", int(1000 * self._work), 0, note, best=best))

    # ------------------------------------------------------------------------------------------- annealing
    def _search_in_turn(self) -> None:
        """Grow parts anew while that finds something, else one station less by annealing, each for as much work."""
        annealer: Annealer | None = None
        n_steps, round_, annealed, grown = _SHORT_STEPS_A_CANDIDATE * self._problem.n_candidates, 0, 0.0, 0.0
        grows = True
        while self._go_on():
            before, stations = self._work, len(self._best)
            if grows or grown < annealed or stations - 1 <= len(self._given):
                self._search_locally(max(annealed - grown, _LOCAL_TURN))
                grown += self._work - before
                grows = len(self._best) < stations
            else:
                annealer = annealer or self._annealer(self._problem, self._network)
                round_ += 1
                if not self._one_less(annealer, round_=round_, n_steps=n_steps):
                    n_steps = min(2 * n_steps, _MOST_STEPS)
                annealed += self._work - before

    def _one_less(self, annealer: Annealer, *, round_: int, n_steps: int) -> bool:
        """Look once for a set of one station less; say whether there is one."""
        sets = without_one(self._best, len(self._given), n_sets=self._settings.n_walks, first=round_)
        step_work = self._work_of_a_step(self._problem, self._network, len(self._best))
        for done, missing in self._anneal_in_turns(annealer, sets, round_=round_, n_steps=n_steps, step_work=step_work):
            note = f"{len(self._best)} stations, trying one less; at least {self._bound}"
            best = BestSoFar(len(self._best), self._bound, tuple(self._best))
            self._progress(ProgressEvent("select", done, n_steps, note, best=best))
            met = np.flatnonzero(missing == 0)
            if met.size:
                return self._offer(self._fit(sets[met[0]].tolist()))
            if not self._go_on():
                break
        return False

    def _anneal(self, prices: LagrangeBound) -> None:
        """Sets of fewer stations of the core, one size after the other, until a limit is reached."""
        core, annealer = self._core_of(prices)
        less, round_, n_steps = 0, 0, self._first_steps(core)
        while self._go_on():
            if not np.isin(self._best, core.candidate).all():
                core, annealer = self._core_of(prices)  # sets are filled up from all candidates, and begun with again
            aimed = max(1, less or (len(self._best) - self._bound) // 2)
            size = max(len(self._best) - aimed, self._bound, len(self._given) + 1)
            if size >= len(self._best):
                self.limits.why_stopped = EXHAUSTED
                return
            round_ += 1
            reached = self._annealed(core, annealer, size, round_=round_, n_steps=n_steps)
            if len(reached) > size:
                less = (len(reached) - size + 1) // 2
            if not self._offer(reached):
                n_steps = min(2 * n_steps, _MOST_STEPS)

    def _core_of(self, prices: LagrangeBound) -> tuple[Core, Annealer]:
        """Candidates that matter, those of the best set among them, and their annealer."""
        core = core_problem(self._problem, prices, n_stations=len(self._best), also=self._best, network=self._network)
        return core, self._annealer(core.problem, core.network)

    def _annealed(self, core: Core, annealer: Annealer, size: int, *, round_: int, n_steps: int) -> list[int]:
        """Anneal sets of `size` stations; return the one that misses least, filled up."""
        sets = self._smaller_sets(core, size)
        step_work = self._work_of_a_step(core.problem, core.network, len(self._best))
        for done, missing in self._anneal_in_turns(annealer, sets, round_=round_, n_steps=n_steps, step_work=step_work):
            note = f"{len(self._best)} stations, trying {size}; at least {self._bound}"
            best = BestSoFar(len(self._best), self._bound, tuple(self._best))
            self._progress(ProgressEvent("select", done, n_steps, note, best=best))
            if (missing == 0).any() or not self._go_on():
                break
        return self._completed(self._problem, core.whole(sets[int(np.argmin(missing))]))

    def _smaller_sets(self, core: Core, size: int) -> np.ndarray[tuple[int, int], np.dtype[np.int32]]:
        """(W, size): the best set without some of its stations, others for each set; given ones first."""
        own = core.own(self._best)
        n_given, n_out = len(self._given), len(self._best) - size
        loose = len(own) - n_given
        sets = []
        for number in range(self._settings.n_walks):
            out = {n_given + (number + i * loose // n_out) % loose for i in range(n_out)}
            sets.append([c for place, c in enumerate(own) if place not in out])
        return np.array(sets, dtype=np.int32)

    def _first_steps(self, core: Core) -> int:
        return _FIRST_STEPS_A_CANDIDATE * core.candidate.size
