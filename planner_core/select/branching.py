"""Branch and bound on the relaxation by cuts: raises the lower bound until no smaller plan is possible, or gives up.

Input a `CoverProblem` and the size of a known plan, output a proven lower bound, and plans that turn up on the way.

A node is a set of candidates that are out and one of those that are in. Its bound is `exact_bound`; it is closed where
that reaches the size of the best plan. The node with the least bound in whole stations is looked at next, of equals the
deepest: the least of all open nodes bounds every plan, whenever one stops.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.network import Network
from planner_core.select.network_cuts import NetworkCuts
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT, Bound, CutMaker, CutProgram, exact_bound

#: Rounds of cuts at a node, and the gain in stations for which another one is worth while.
_ROUNDS = 12
_ROUND_GAIN = 0.004
#: The same at the root, over `_ROOT_WINDOW` rounds.
_ROOT_ROUNDS = 1000
_ROOT_WINDOW = 25
_ROOT_GAIN = 0.01
#: Cuts are made for another point besides the solution, which follows it in such steps: docs/method/selection.md.
_ROOT_STEP, _NODE_STEP = 0.1, 0.3
#: The bound of no node.
_NOTHING = 2**31
#: Candidates that are tried before one is branched on.
_PROBES = 8
#: Candidates nearer to 0 or 1 are taken for whole.
_WHOLE = 1e-6


@dataclass(frozen=True)
class _Node:
    """out, inside : (n,) int64 candidates that are fixed; stations : bound."""

    stations: int
    out: Int64Array
    inside: Int64Array


class BranchAndBound:
    """The search for a proof. `lower_bound` holds at any moment; `best` is the smallest plan found here, or None.

    Parameters
    ----------
    n_stations
        Size of a plan that meets `required`. Set `n_stations` lower when one of fewer stations is found elsewhere.
    network
        Plans hang together by it, the ones found here too.
    given
        Candidates that are in every plan, and count.
    """

    def __init__(
        self,
        problem: CoverProblem,
        *,
        n_stations: int,
        lower_bound: int = 0,
        network: Network | None = None,
        given: Sequence[int] = (),
    ) -> None:
        n = problem.n_candidates
        self.problem, self.n_stations = problem, n_stations
        self.best: tuple[int, ...] | None = None
        self.n_nodes = 0
        self._maker = CutMaker(problem)
        self._network = network
        self._joins = NetworkCuts(network, self._maker.reaches) if network is not None else None
        self._program = CutProgram(n, slack_price=float(n_stations + 1))
        self._lower, self._upper = np.zeros(n, dtype=np.int64), np.ones(n, dtype=np.int64)
        self._lower[list(given)] = 1
        self._program.set_range(self._lower, self._upper)
        self._open: list[tuple[int, int, int, _Node]] = []
        self._proven = lower_bound
        self._given_up = self._at_hand = _NOTHING
        self._centre = np.full(n, 0.5)
        self._number = 0
        self._n_looks = 0
        self._stopped = False
        none = np.zeros(0, dtype=np.int64)
        self._put(_Node(lower_bound, none, none))

    @property
    def lower_bound(self) -> int:
        """No plan has fewer stations."""
        still_open = self._open[0][0] if self._open else self.n_stations
        return max(self._proven, min(still_open, self._at_hand, self._given_up, self.n_stations))

    @property
    def finished(self) -> bool:
        """Whether more work can change anything."""
        return self.lower_bound >= self.n_stations or (not self._open and self._at_hand >= _NOTHING)

    @property
    def work(self) -> float:
        """Numbers looked at so far, roughly, in 1e9: the same for the same way through the tree."""
        n = self.problem.n_candidates
        return 1e-9 * (self._program.n_iterations * (20_000 + 50 * n) + self._n_looks * 6 * self.problem.row.size)

    def stop(self) -> None:
        """End what is under way at the next opportunity; for callbacks of progress."""
        self._stopped = True

    def root(self, *, progress: Progress = silent) -> None:
        """Solve the relaxation itself, and fix candidates that no smaller plan holds, or that each holds."""
        best, values = 0, [0.0]
        self._add_cuts(np.zeros(self.problem.n_candidates))
        for number in range(_ROOT_ROUNDS):
            x, bound = self._solve()
            self._fix(bound)
            best = max(best, bound.scaled)
            self._proven = max(self._proven, min(-(-best // BOUND_UNIT), self.n_stations))
            values.append(best / BOUND_UNIT)
            progress(ProgressEvent("bound", number + 1, _ROOT_ROUNDS, f"at least {self._proven} stations"))
            if self._proven >= self.n_stations:
                break
            slow = number > _ROOT_WINDOW and values[-1] - values[-1 - _ROOT_WINDOW] < _ROOT_GAIN
            if slow or self._stopped:
                break
            self._centre = self._centre + _ROOT_STEP * (x - self._centre)
            if not self._add_cuts(x, self._centre):
                break

    def advance(self, *, work: float, progress: Progress = silent) -> None:
        """Look at nodes until about `work` more is done, or until all is proven."""
        end = self.work + work
        while self.work < end and not self.finished and not self._stopped:
            # An interrupt may come at any moment: a node counts as open until all that is left of it is.
            self._at_hand = self._open[0][0]
            self._look_at(heapq.heappop(self._open)[3])
            self._at_hand = _NOTHING
            self.n_nodes += 1
            progress(ProgressEvent("prove", self.n_nodes, 0, f"at least {self.lower_bound} of {self.n_stations}"))

    def _look_at(self, node: _Node) -> None:
        if node.stations >= self.n_stations:
            return
        lower, upper = self._lower.copy(), self._upper.copy()
        upper[node.out] = 0
        lower[node.inside] = 1
        if not self._possible(lower, upper):
            return
        self._program.set_range(lower, upper)
        stations, best, x, centre = node.stations, 0, np.zeros(0), np.clip(self._centre, lower, upper)
        for _ in range(_ROUNDS):
            x, bound = self._solve(lower, upper)
            gain, best = bound.scaled - best, max(best, bound.scaled)
            stations = max(stations, bound.stations)
            if stations >= self.n_stations:
                return
            centre = centre + _NODE_STEP * (x - centre)
            # Nothing but cuts tells a whole point that is no plan from a plan: then they are worth while anyway.
            whole = not (np.minimum(x, 1 - x) > _WHOLE).any()
            if not self._add_cuts(x, centre) or (gain < _ROUND_GAIN * BOUND_UNIT and not whole):
                break
        self._branch(node, x, stations, lower, upper)

    def _possible(self, lower: Int64Array, upper: Int64Array) -> bool:
        """Whether a plan may lie in between; takes out of `upper` what cannot be joined with those that are in."""
        if (lower > upper).any():
            return False
        if self._joins is not None:
            keep = self._joins.reachable(lower, upper)
            if keep is None:
                return False
            upper[~keep] = 0
        return self._maker.reaches(upper > 0)

    def _branch(self, node: _Node, x: FloatArray, stations: int, lower: Int64Array, upper: Int64Array) -> None:
        free = lower < upper
        self._note_plan(x)
        if stations >= self.n_stations:
            return
        if not free.any():
            # All is fixed, and neither too many stations nor a plan. If it hangs together it meets `least`, not
            # `required`: that is the rounding of areas, and there is nothing left to branch on.
            if self._hangs_together(np.flatnonzero(lower).tolist()):
                self._given_up = min(self._given_up, stations)
            return
        depth = node.out.size + node.inside.size
        at = np.array([self._branch_at(x, lower, upper)], dtype=np.int64)
        self._put(_Node(stations, np.concatenate([node.out, at]), node.inside), depth + 1)
        self._put(_Node(stations, node.out, np.concatenate([node.inside, at])), depth + 1)

    def _branch_at(self, x: FloatArray, lower: Int64Array, upper: Int64Array) -> int:
        """Candidate whose two branches promise most: the product of what the bound gains in either."""
        distance = np.where(lower < upper, np.abs(x - 0.5), 1.0)
        likely = np.argsort(distance, kind="stable")[:_PROBES]
        likely = likely[distance[likely] < 0.5 - _WHOLE]
        if likely.size < 2:
            return int(np.argmin(distance))
        gain = np.maximum(self._program.probe(likely, lower, upper) - float(x.sum()), 1e-4)
        return int(likely[np.argmax(gain[:, 0] * gain[:, 1])])

    def _note_plan(self, x: FloatArray) -> None:
        """Keep x where it is a plan."""
        if (np.minimum(x, 1 - x) > _WHOLE).any():
            return
        chosen = [int(i) for i in np.flatnonzero(x > 0.5)]
        if (
            len(chosen) < self.n_stations
            and self._hangs_together(chosen)
            and (self.problem.covered(chosen) >= self.problem.required).all()
        ):
            self.best, self.n_stations = tuple(chosen), len(chosen)

    def _hangs_together(self, chosen: list[int]) -> bool:
        return self._network is None or self._network.faults(chosen) == 0

    def _solve(self, lower: Int64Array | None = None, upper: Int64Array | None = None) -> tuple[FloatArray, Bound]:
        x, price = self._program.solve()
        self._n_looks += 1
        lower, upper = self._lower if lower is None else lower, self._upper if upper is None else upper
        return x, exact_bound(self._program.cuts, self._program.right, price, lower, upper)

    def _add_cuts(self, *points: FloatArray) -> bool:
        self._program.drop_idle()
        cuts = [cut for x in points for cut in self._maker.violated(x)]
        if self._joins is not None:
            cuts += [cut for x in points for cut in self._joins.violated(x)]
        self._n_looks += len(points)
        if cuts:
            self._program.add(cuts)
        return bool(cuts)

    def _fix(self, bound: Bound) -> None:
        """Candidates with which, or without which, a plan is no smaller than the best: out, or in, for good."""
        enough = (self.n_stations - 1) * BOUND_UNIT  # above this a plan has n_stations or more
        free = self._lower < self._upper
        out = free & (bound.margin > max(enough - bound.scaled, 0))
        inside = free & (bound.margin < min(bound.scaled - enough, 0))
        if out.any() or inside.any():
            self._upper[out] = 0
            self._lower[inside] = 1
            self._program.set_range(self._lower, self._upper)

    def _put(self, node: _Node, depth: int = 0) -> None:
        self._number += 1
        heapq.heappush(self._open, (node.stations, -depth, -self._number, node))
