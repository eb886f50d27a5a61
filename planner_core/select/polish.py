"""A better set of as many stations: closer to an earlier plan, then with more covered.

Input a `CoverProblem` and a set that meets its targets, output one of the same size that does so, too. One station at a
time is exchanged for a candidate while all targets stay met and the set hangs together. First for candidates `keep`, as
long as one more of them comes in; then for whatever covers more, without losing any of them. All is whole numbers, and
each exchange makes (kept ones, ticks covered) larger, so that it ends, always in the same set.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem


def polish(
    problem: CoverProblem,
    chosen: Sequence[int],
    *,
    network: Network | None = None,
    given: Sequence[int] = (),
    keep: Sequence[int] = (),
) -> tuple[int, ...]:
    """Exchange stations one by one, as the head of the module says.

    Parameters
    ----------
    chosen
        Candidates that meet all targets, and hang together where a network is given; their order is kept.
    given
        Candidates that stay.
    keep
        Candidates to bring back where that costs no station, such as those of an earlier plan.

    Returns
    -------
    As many candidates; no fewer of `keep`, and of equally many no less covered (summed over targets).
    """
    return _Polish(problem, chosen, network, given, keep).run()


class _Polish:
    def __init__(
        self,
        problem: CoverProblem,
        chosen: Sequence[int],
        network: Network | None,
        given: Sequence[int],
        keep: Sequence[int],
    ) -> None:
        self._problem, self._network, self._chosen = problem, network, [int(c) for c in chosen]
        self._loose = [place for place, c in enumerate(self._chosen) if c not in set(given)]
        self._keep: BoolArray = np.zeros(problem.n_candidates, dtype=bool)
        self._keep[list(keep)] = True
        self._n_seen = problem.times_seen(self._chosen)

    def run(self) -> tuple[int, ...]:
        """Bring back, then cover more, until neither finds anything: covering more may make room for one to keep."""
        while self._sweep(bring_back=True) or self._sweep(bring_back=False):
            pass
        return tuple(self._chosen)

    def _sweep(self, *, bring_back: bool) -> bool:
        """Exchange each station once where that is better; say whether any was."""
        found = False
        for place in self._loose:
            out = self._chosen[place]
            if bring_back and self._keep[out]:
                continue
            self._n_seen[self._problem.rows_of(out)] -= 1
            into = self._best_for(place, bring_back=bring_back)
            self._n_seen[self._problem.rows_of(into)] += 1
            self._chosen[place] = into
            found = found or into != out
        return found

    def _best_for(self, place: int, *, bring_back: bool) -> int:
        """Candidate for the place, whose station is counted no longer: it itself where there is no better one."""
        problem, out = self._problem, self._chosen[place]
        covered = problem.ticks_of(self._n_seen)[:, None] + self._added()
        worth = covered.sum(axis=0)
        better = self._keep if bring_back else (worth > worth[out]) & (self._keep >= self._keep[out])
        allowed = np.flatnonzero((covered >= problem.required[:, None]).all(axis=0) & better)
        allowed = np.setdiff1d(allowed, self._chosen)
        for other in allowed[np.argsort(-worth[allowed], kind="stable")].tolist():
            rest = [*self._chosen[:place], other, *self._chosen[place + 1 :]]
            if self._network is None or self._network.faults(rest) == 0:
                return int(other)
        return out

    def _added(self) -> Int64Array:
        """(K, N) ticks of each target that one look more by each candidate covers."""
        problem = self._problem
        wanted = problem.counts_for & (self._n_seen == problem.seen_from[:, None] - 1)
        added = np.empty((problem.required.size, problem.n_candidates), dtype=np.int64)
        for target, rows in enumerate(wanted):
            before = np.concatenate([[0], np.cumsum(np.where(rows, problem.ticks, 0)[problem.row])])
            added[target] = before[problem.starts[1:]] - before[problem.starts[:-1]]
        return added
