"""A better set of as many stations: closer to an earlier plan, then with more covered.

Input a `CoverProblem` and a set that meets its targets, output one of the same size that does so, too. One station at a
time is exchanged for a candidate while all targets stay met and the set is connected. First for candidates `keep`, as
long as one more of them comes in; then for whatever covers more, without losing any of them. All is whole numbers, and
each exchange makes (kept ones, ticks covered) larger, so that it ends, always in the same set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

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
    """Exchange stations one by one, as the head of the module describes.

    Parameters
    ----------
    chosen
        Candidates that meet all targets, and are connected where a network is given; their order is kept.
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
        self._looks = _Looks(problem)
        for candidate in self._chosen:
            self._looks.change(candidate, 1)

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
            self._looks.change(out, -1)
            into = self._best_for(place, bring_back=bring_back)
            self._looks.change(into, 1)
            self._chosen[place] = into
            found = found or into != out
        return found

    def _best_for(self, place: int, *, bring_back: bool) -> int:
        """Candidate for the place, whose station is counted no longer: it itself where there is no better one."""
        problem, out = self._problem, self._chosen[place]
        covered = self._looks.covered[:, None] + self._looks.added
        worth = covered.sum(axis=0)
        better = self._keep if bring_back else (worth > worth[out]) & (self._keep >= self._keep[out])
        allowed = np.flatnonzero((covered >= problem.required[:, None]).all(axis=0) & better)
        allowed = np.setdiff1d(allowed, self._chosen)
        if not allowed.size:
            return out
        hang_together = self._completes([*self._chosen[:place], *self._chosen[place + 1 :]])
        others = allowed[np.argsort(-worth[allowed], kind="stable")]
        return next((int(other) for other in others if hang_together(int(other))), out)

    def _completes(self, rest: list[int]) -> Callable[[int], bool]:
        return (lambda _: True) if self._network is None else self._network.completes(rest)


class _Looks:
    """What a set covers, and what one candidate more would: kept up to date as candidates come and go.

    covered : (K,) ticks of each target. added : (K, N) ticks of each target that one look more by a candidate covers.
    """

    def __init__(self, problem: CoverProblem) -> None:
        self._problem = problem
        self._first, self._seer = problem.seers()
        self._n_seen = np.zeros(problem.n_rows, dtype=np.int64)
        self.covered = problem.ticks_of(self._n_seen)
        self.added = np.zeros((problem.required.size, problem.n_candidates), dtype=np.int64)
        for constraint, enough in enumerate(problem.seen_from):
            if enough == 1:
                self._spread(constraint, np.arange(problem.n_rows), problem.counts_for[constraint] * problem.ticks)

    def change(self, candidate: int, by: int) -> None:
        """Let a candidate come (1) or go (-1)."""
        problem, rows = self._problem, self._problem.rows_of(candidate)
        before = self._n_seen[rows]
        after = before + by
        self._n_seen[rows] = after
        for constraint, enough in enumerate(problem.seen_from):
            ticks = np.where(problem.counts_for[constraint, rows], problem.ticks[rows], 0)
            self.covered[constraint] += int((ticks * ((after >= enough).astype(np.int64) - (before >= enough))).sum())
            turned = ticks * ((after == enough - 1).astype(np.int64) - (before == enough - 1))
            self._spread(constraint, rows[turned != 0], turned[turned != 0])

    def _spread(self, constraint: int, rows: Int64Array, ticks: Int64Array) -> None:
        """Add ticks of rows to what all who see them would add."""
        n_seers = self._first[rows + 1] - self._first[rows]
        before = np.concatenate([[0], np.cumsum(n_seers)])
        entry = np.arange(before[-1]) + np.repeat(self._first[rows] - before[:-1], n_seers)
        np.add.at(self.added[constraint], self._seer[entry], np.repeat(ticks, n_seers))
