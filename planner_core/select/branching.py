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
from planner_core.select.relaxation import BOUND_UNIT, Bound, Cut, CutMaker, CutProgram, exact_bound

#: Rounds of cuts at a node, and the gain in stations for which another one is worth while.
_ROUNDS = 100
_ROUND_GAIN = 0.0005
#: The same at the root, over `_ROOT_WINDOW` rounds.
_ROOT_ROUNDS = 1000
_ROOT_WINDOW = 25
_ROOT_GAIN = 0.01
#: Cuts are made for another point besides the solution, which follows it in such steps: docs/method/selection.md.
_ROOT_STEP, _NODE_STEP = 0.1, 0.15
#: The bound of no node.
_NOTHING = 2**31
#: Candidates that are tried before one is branched on.
_PROBES = 8
#: Candidates nearer to 0 or 1 are taken for whole.
_WHOLE = 1e-6


@dataclass(frozen=True)
class _Node:
    """out, inside : (n,) int64 candidates that are fixed; stations : bound; depth : branches down to here."""

    stations: int
    out: Int64Array
    inside: Int64Array
    depth: int = 0


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
        n_looks = self._n_looks + (self._joins.n_looks if self._joins is not None else 0)
        return 1e-9 * (self._program.n_iterations * (20_000 + 50 * n) + n_looks * 6 * self.problem.row.size)

    def stop(self) -> None:
        """End what is under way at the next opportunity; for callbacks of progress."""
        self._stopped = True

    def root(self, *, progress: Progress = silent) -> None:
        """Solve the relaxation itself, and fix candidates that no smaller plan holds, or that each holds."""
        best, values = 0, [0.0]
        self._program.add(self._cuts_for(np.zeros(self.problem.n_candidates)))
        for number in range(_ROOT_ROUNDS):
            x, bound = self._solve()
            if self._fix(bound, self._lower, self._upper):
                self._program.set_range(self._lower, self._upper)
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
        stations, centre = node.stations, np.clip(self._centre, lower, upper)
        at: int | None = None
        while at is None:
            if not self._possible(lower, upper):
                return
            self._program.set_range(lower, upper)
            stations, x, centre = self._tighten(stations, centre, lower, upper)
            self._note_plan(x)
            if stations >= self.n_stations:
                return
            if (lower == upper).all():
                self._end_at(lower, stations)
                return
            at = self._branch_at(x, lower, upper)
        out, inside = np.flatnonzero(upper < self._upper), np.flatnonzero(lower > self._lower)
        self._put(_Node(stations, np.append(out, at), inside, node.depth + 1))
        self._put(_Node(stations, out, np.append(inside, at), node.depth + 1))

    def _end_at(self, fixed: Int64Array, stations: int) -> None:
        """All is fixed: a plan, or none, or one that meets `least` and not `required`, on which nobody can branch."""
        self._note_plan(fixed.astype(np.float64))
        smaller = int(fixed.sum()) < self.n_stations
        if smaller and self._hangs_together(np.flatnonzero(fixed).tolist()) and self._maker.reaches(fixed > 0):
            self._given_up = min(self._given_up, stations)

    def _tighten(
        self, stations: int, centre: FloatArray, lower: Int64Array, upper: Int64Array
    ) -> tuple[int, FloatArray, FloatArray]:
        """Rounds of cuts at a node, fixing what they prove: bound in stations, solution, the point that follows it."""
        best, x = 0, centre
        for _ in range(_ROUNDS):
            x, bound = self._solve(lower, upper)
            gain, best = bound.scaled - best, max(best, bound.scaled)
            stations = max(stations, bound.stations)
            if stations >= self.n_stations:
                break
            if self._fix(bound, lower, upper):
                self._program.set_range(lower, upper)
            centre = centre + _NODE_STEP * (x - centre)
            # Nothing but cuts tells a whole point that is no plan from a plan: then they are worth while anyway.
            whole = not (np.minimum(x, 1 - x) > _WHOLE).any()
            if not self._add_cuts(x, centre) or (gain < _ROUND_GAIN * BOUND_UNIT and not whole):
                break
        return stations, x, centre

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

    def _branch_at(self, x: FloatArray, lower: Int64Array, upper: Int64Array) -> int | None:
        """Candidate whose two branches promise most: the product of what the bound gains in either.

        None where it turned out that some can be fixed: they are, in `lower` and `upper`.
        """
        distance = np.where(lower < upper, np.abs(x - 0.5), 1.0)
        likely = np.argsort(distance, kind="stable")[:_PROBES]
        likely = likely[distance[likely] < 0.5 - _WHOLE]
        if likely.size < 2:
            return int(np.argmin(distance))
        values, proofs = self._program.probe(likely, lower, upper, enough=float(self.n_stations - 1))
        if self._prove_probes(likely, proofs, lower, upper):
            return None
        gain = np.maximum(values - float(x.sum()), 1e-4)
        return int(likely[np.argmax(gain[:, 0] * gain[:, 1])])

    def _prove_probes(
        self, at: Int64Array, proofs: dict[tuple[int, int], FloatArray], lower: Int64Array, upper: Int64Array
    ) -> bool:
        """Whether prices of probes prove that candidates are in, or out; then they are from here on."""
        fixed = False
        for (number, value), price in proofs.items():
            low, high = lower.copy(), upper.copy()
            low[at[number]] = high[at[number]] = value
            if (low <= high).all() and self._bound(price, low, high).stations >= self.n_stations:
                fixed = True
                # If its other value was ruled out as well, they now contradict each other: nothing is possible here.
                if value:
                    upper[at[number]] = 0
                else:
                    lower[at[number]] = 1
        return fixed

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
        return x, self._bound(price, lower, upper)

    def _bound(self, price: FloatArray, lower: Int64Array, upper: Int64Array) -> Bound:
        return exact_bound(self._program.cuts, self._program.right, price, lower, upper)

    def _add_cuts(self, x: FloatArray, centre: FloatArray) -> bool:
        """Whether the solution violates any cut: if not, those of the other point would not raise the bound either."""
        self._program.drop_idle()
        own, more = self._cuts_for(x), self._cuts_for(centre)
        if own or more:
            self._program.add(own + more)
        return bool(own)

    def _cuts_for(self, x: FloatArray) -> list[Cut]:
        self._n_looks += 1
        return self._maker.violated(x) + (self._joins.violated(x) if self._joins is not None else [])

    def _fix(self, bound: Bound, lower: Int64Array, upper: Int64Array) -> bool:
        """Fix candidates with which, or without which, no plan in between is smaller than the best; whether any."""
        enough = (self.n_stations - 1) * BOUND_UNIT  # above this a plan has n_stations or more
        free = lower < upper
        out = free & (bound.margin > max(enough - bound.scaled, 0))
        inside = free & (bound.margin < min(bound.scaled - enough, 0))
        upper[out] = 0
        lower[inside] = 1
        return bool(out.any() or inside.any())

    def _put(self, node: _Node) -> None:
        self._number += 1
        heapq.heappush(self._open, (node.stations, -node.depth, -self._number, node))
