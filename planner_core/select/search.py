"""What the searches for stations share: their state, their limits of work and time, and annealing counted as work.

These searches are `proven` (fewest, with proof), `large` (fewest of many candidates) and `most_coverage`.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Int32Array, Int64Array, Proven
from planner_core.progress import Progress
from planner_core.select.annealing_problem import TRIES, AnnealingProblem
from planner_core.select.greedy import drop_redundant
from planner_core.select.network import Network, connect
from planner_core.select.problem import CoverProblem

if TYPE_CHECKING:
    from planner_core.select.annealing import Annealer

PROVEN = "proven"
WORK_DONE = "work limit"
TIME_OVER = "time limit"
INTERRUPTED = "interrupted"
#: There are as few stations as the caller wants, see `planner_core.select.proven.select`.
ENOUGH = "as few as wanted"


class Limits:
    """Limits of one search, whose clock runs from here on.

    why_stopped : `proven` as long as no limit was reached.
    """

    def __init__(self, *, work_limit: float, time_limit_s: float | None) -> None:
        self._work_limit, self._time_limit_s = work_limit, time_limit_s
        self._began_s = time.monotonic()
        self.why_stopped = PROVEN

    @property
    def left_s(self) -> float | None:
        """Seconds that are left; None: there is no limit of time."""
        if self._time_limit_s is None:
            return None
        return max(0.0, self._time_limit_s - (time.monotonic() - self._began_s))

    def reached(self, work: float) -> bool:
        """Whether so much work, or the time, is the limit; `why_stopped` is which, of both the time."""
        if self.left_s == 0.0:
            self.why_stopped = TIME_OVER
        elif work >= self._work_limit:
            self.why_stopped = WORK_DONE
        else:
            return False
        return True


class Search(ABC):
    """The state of one search: the best set, given candidates first, the bound, the work done, and the limits."""

    def __init__(
        self,
        problem: CoverProblem,
        settings: Proven,
        *,
        network: Network | None,
        given: tuple[int, ...],
        progress: Progress,
    ) -> None:
        self._problem, self._settings, self._network, self._given = problem, settings, network, given
        self._progress = progress
        self.limits = Limits(work_limit=settings.work_limit, time_limit_s=settings.time_limit_s)
        self._best: list[int] = []
        self._bound = 0
        self._work = 0.0

    @property
    def _is_proven(self) -> bool:
        """Whether the bound is reached."""
        return self._bound >= len(self._best)

    @property
    def _why_stopped(self) -> str:
        return PROVEN if self._is_proven else self.limits.why_stopped

    @abstractmethod
    def run(self) -> None:
        """Improve set and bound until they meet or a limit is reached."""

    def run_until_interrupted(self) -> None:
        """Run; a KeyboardInterrupt ends the search, not the call."""
        try:
            self.run()
        except KeyboardInterrupt:
            self.limits.why_stopped = INTERRUPTED

    def _total_work(self) -> float:
        return self._work

    def _go_on(self) -> bool:
        """Whether there is anything left to prove, and leave to do so."""
        return not self._is_proven and not self.limits.reached(self._total_work())

    def _fit(self, chosen: Sequence[int]) -> list[int]:
        """`chosen`, given ones first, connected, less what is dispensable."""
        whole = list(dict.fromkeys((*self._given, *chosen)))
        if self._network is not None:
            whole = connect(self._problem, self._network, whole)
        return drop_redundant(self._problem, whole, given=self._given, network=self._network)

    def _annealer(self, problem: CoverProblem, network: Network | None) -> Annealer:
        from planner_core.select.annealing import Annealer  # brings numba along, which takes a while

        return Annealer(AnnealingProblem(problem, seed=self._settings.seed or 0, network=network))

    def _anneal_in_turns(
        self, annealer: Annealer, sets: Int32Array, *, round_: int, n_steps: int, step_work: float
    ) -> Iterator[tuple[int, Int64Array]]:
        """Anneal `sets` and count the work: yields steps done and what each set misses."""
        turns = annealer.in_turns(sets, round_=round_, n_steps=n_steps, n_pinned=len(self._given))
        for done, n_new, missing in turns:
            self._work += 1e-9 * n_new * step_work
            yield done, missing

    def _work_of_a_step(self, problem: CoverProblem, network: Network | None, n_stations: int) -> float:
        """Numbers that one step of annealing looks at, for all sets of about `n_stations`."""
        rows = problem.row.size / problem.n_candidates
        links = 0 if network is None else n_stations * (1 + n_stations // 32)
        return self._settings.n_walks * (TRIES + 2) * (rows + 50 + links)


def without_one(chosen: Sequence[int], n_given: int, *, n_sets: int, first: int = 0) -> Int32Array:
    """(n_sets, k - 1), the given first: a set of k without one station, another one for each set if it can be."""
    out = [n_given + (first + number) % (len(chosen) - n_given) for number in range(n_sets)]
    return np.array([[c for place, c in enumerate(chosen) if place != gone] for gone in out], dtype=np.int32)


def check_input(
    problem: CoverProblem, network: Network | None, given: Sequence[int], start: Sequence[int] | None
) -> None:
    """Refuse a network of other candidates, and given ones or a start that are not different candidates."""
    n = problem.n_candidates
    if network is not None and network.n_candidates != n:
        raise RequirementError(f"network: got one of {network.n_candidates} candidates, expected the problem's {n}")
    for name, chosen in (("given candidates", given), ("start of selection", start or ())):
        if any(not 0 <= c < n for c in chosen) or len(set(chosen)) != len(chosen):
            raise RequirementError(f"{name}: got {list(chosen)}, expected different numbers from 0 to {n - 1}")
