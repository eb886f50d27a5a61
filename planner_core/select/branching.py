"""Branch and bound on the relaxation by cuts: raises the lower bound until no smaller plan is possible, or gives up.

Input a `CoverProblem` and the size of a known plan, output a proven lower bound, and plans that turn up on the way.

A node is a set of candidates that are out and one of those that are in; and of groups of candidates that see much the
same (`groups_of`) how many are chosen, at least and at most. Its bound is `exact_bound`; it is closed where
that reaches the size of the best plan. The node with the least bound in whole stations is next, of equals the
deepest: the least of all open nodes bounds every plan, whenever one stops.

Of two groups either one holds the other or they share nobody. Candidates a step apart can stand in for each other, so
that leaving one out changes little; that a room takes three stations at most, or four at least, changes much.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.network import Network
from planner_core.select.network_cuts import NetworkCuts
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import BOUND_UNIT, Bound, Branch, Cut, CutMaker, CutProgram, exact_bound
from planner_core.select.separators import Separators

#: Rounds of cuts at a node, and the gain in stations for which another one is worth while.
_ROUNDS = 100
_ROUND_GAIN = 0.0005
#: The same at the root, over `_ROOT_WINDOW` rounds.
_ROOT_ROUNDS = 1000
_ROOT_WINDOW = 25
_ROOT_GAIN = 0.01
#: So often a node looks for separators of the network, when no round is worth while any more.
_NODE_SWEEPS = 3
#: Cuts are made for another point besides the solution, which follows it in such steps: docs/method/selection.md.
_ROOT_STEP, _NODE_STEP = 0.1, 0.15
#: Work of a flow between two candidates, with all that goes with it.
_FLOW_WORK = 200_000
#: The bound of no node.
_NOTHING = 2**31
#: Candidates that are tried before one is branched on.
_PROBES = 8
#: And so many groups, of which the solution takes no whole number: this far from a half at most.
_GROUP_PROBES = 8
_GROUP_DISTANCE = 0.4
#: How many of a group are chosen, at least and at most, by its number.
Counts = dict[int, tuple[int, int]]
#: Candidates nearer to 0 or 1 are taken for whole.
_WHOLE = 1e-6
#: Distances between all candidates are held at once: beyond so many there are no groups.
MOST_CANDIDATES = 2500


@dataclass(frozen=True)
class _Node:
    """out, inside : (n,) int64 candidates that are fixed; stations : bound; depth : branches down to here.

    counts : how many of some groups are chosen, at least and at most.
    """

    stations: int
    out: Int64Array
    inside: Int64Array
    depth: int = 0
    counts: Counts = field(default_factory=dict)


class BranchAndBound:
    """The search for a proof. `lower_bound` holds at any moment; `best` is the smallest plan found here, or None.

    Parameters
    ----------
    n_stations
        Size of a plan that meets `required`. Set `n_stations` lower when one of fewer stations is found elsewhere.
    network
        Plans are connected by it, the ones found here too.
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
        self._separators = Separators(self._maker, network) if network is not None else None
        self._groups = groups_of(problem)
        self._group_sizes = self._groups.sum(axis=1)
        self._program = CutProgram(n, slack_price=float(n_stations + 1), groups=self._groups)
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
        """Numbers read so far, roughly, in 1e9: the same for the same way through the tree."""
        n, rows, entries = self.problem.n_candidates, self.problem.n_rows, self.problem.row.size
        joining = 0
        for each in (self._joins, self._separators):
            if each is not None:
                joining += each.n_looks * (n * rows // 16 + 20 * rows) + each.n_flows * _FLOW_WORK
        return 1e-9 * (self._program.n_iterations * (20_000 + 50 * n) + self._n_looks * 3 * entries + joining)

    def stop(self) -> None:
        """End what is under way at the next opportunity; for callbacks of progress."""
        self._stopped = True

    def root(self, *, work: float = float("inf"), sweeping: float = float("inf"), progress: Progress = silent) -> None:
        """Solve the relaxation itself, and fix candidates that no smaller plan holds, or that each holds.

        work : with so much it ends, having done a little at least. sweeping : with so much it ends looking for
        separators of the network.
        """
        self._program.add(self._cuts_for(np.zeros(self.problem.n_candidates), joining=False))
        self._solve_root(work, 0.0, progress, joining=False)
        if self._joins is not None and not (self._stopped or self.work >= work or self._proven >= self.n_stations):
            self._solve_root(work, sweeping, progress, joining=True)

    def _solve_root(self, work: float, sweeping: float, progress: Progress, *, joining: bool) -> None:
        """Rounds of cuts: first those of coverage alone, which cost little and give most."""
        best, begun, values = 0, 0, [0.0]
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
            slow = number > begun + _ROOT_WINDOW and values[-1] - values[-1 - _ROOT_WINDOW] < _ROOT_GAIN
            if self._stopped or self.work >= work:
                break
            due = self.work < sweeping and (slow or number % _ROOT_WINDOW == 0)
            if due and self._add_separators(x):
                begun, slow = number, False
            if slow:
                break
            self._centre = self._centre + _ROOT_STEP * (x - self._centre)
            if not self._add_cuts(x, self._centre, joining=joining):
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
        lower, upper, counts = self._lower.copy(), self._upper.copy(), dict(node.counts)
        upper[node.out] = 0
        lower[node.inside] = 1
        stations, centre = node.stations, np.clip(self._centre, lower, upper)
        branch: Branch | None = None
        while branch is None:
            if not self._possible(lower, upper, counts):
                return
            self._program.set_range(lower, upper)
            self._program.set_counts(counts)
            stations, x, centre = self._tighten(stations, centre, lower, upper, counts)
            self._note_plan(x)
            if stations >= self.n_stations:
                return
            if (lower == upper).all():
                self._end_at(lower, stations)
                return
            branch = self._branch_at(x, lower, upper, counts)
        self._put_both(stations, branch, lower, upper, counts, node.depth + 1)

    def _put_both(
        self, stations: int, branch: Branch, lower: Int64Array, upper: Int64Array, counts: Counts, depth: int
    ) -> None:
        out, inside = np.flatnonzero(upper < self._upper), np.flatnonzero(lower > self._lower)
        if branch.group < 0:
            self._put(_Node(stations, np.append(out, branch.candidate), inside, depth, counts))
            self._put(_Node(stations, out, np.append(inside, branch.candidate), depth, counts))
            return
        for side in (0, 1):
            self._put(_Node(stations, out, inside, depth, self._on_side(branch, side, counts)))

    def _on_side(self, branch: Branch, side: int, counts: Counts) -> Counts:
        low, high = counts.get(branch.group, (0, int(self._group_sizes[branch.group])))
        return {**counts, branch.group: (low, branch.below) if side == 0 else (branch.below + 1, high)}

    def _end_at(self, fixed: Int64Array, stations: int) -> None:
        """All is fixed: a plan, or none, or one that meets `least` and not `required`, on which nobody can branch."""
        self._note_plan(fixed.astype(np.float64))
        smaller = int(fixed.sum()) < self.n_stations
        if smaller and self._hangs_together(np.flatnonzero(fixed).tolist()) and self._maker.reaches(fixed > 0):
            self._given_up = min(self._given_up, stations)

    def _tighten(
        self, stations: int, centre: FloatArray, lower: Int64Array, upper: Int64Array, counts: Counts
    ) -> tuple[int, FloatArray, FloatArray]:
        """Rounds of cuts at a node, fixing what they prove: bound in stations, solution, the point that follows it."""
        best, x, n_sweeps = 0, centre, 0
        for _ in range(_ROUNDS):
            x, bound = self._solve(lower, upper)
            gain, best = bound.scaled - best, max(best, bound.scaled)
            stations = max(stations, bound.stations)
            if stations >= self.n_stations:
                break
            if self._fix(bound, lower, upper):
                if not self._counts_fit(lower, upper, counts):
                    return self.n_stations, x, centre
                self._program.set_range(lower, upper)
            centre = centre + _NODE_STEP * (x - centre)
            # Nothing but cuts separates a whole point that is no plan from a plan: then they are worth while anyway.
            whole = not (np.minimum(x, 1 - x) > _WHOLE).any()
            if not self._add_cuts(x, centre) or (gain < _ROUND_GAIN * BOUND_UNIT and not whole):
                if whole or n_sweeps == _NODE_SWEEPS or not self._add_separators(x):
                    break
                n_sweeps += 1
        return stations, x, centre

    def _possible(self, lower: Int64Array, upper: Int64Array, counts: Counts) -> bool:
        """Whether a plan may lie in between; takes out of `upper` what cannot be joined with those that are in."""
        if not self._counts_fit(lower, upper, counts):
            return False
        if self._joins is not None:
            keep = self._joins.reachable(lower, upper)
            if keep is None:
                return False
            upper[~keep] = 0
        return self._counts_fit(lower, upper, counts) and self._maker.reaches(upper > 0)

    def _counts_fit(self, lower: Int64Array, upper: Int64Array, counts: Counts) -> bool:
        """Whether candidates can be chosen in between, in such numbers; fixes those of groups that leave no choice.

        Groups hold each other or share nobody: their numbers fit if, small groups first, each holds at least what
        those in it ask for, and allows no more than they do.
        """
        if (lower > upper).any():
            return False
        low, high = lower.copy(), upper.copy()  # a group's numbers are those of one member, the others have none
        for group in sorted(counts):
            at = self._groups[group]
            least, most = max(counts[group][0], int(low[at].sum())), min(counts[group][1], int(high[at].sum()))
            if least > most:
                return False
            first = int(np.argmax(at))
            low[at], high[at] = 0, 0
            low[first], high[first] = least, most
            if int(lower[at].sum()) == most:
                upper[at & (lower == 0)] = 0
            if int(upper[at].sum()) == least:
                lower[at & (upper == 1)] = 1
        return True

    def _branch_at(self, x: FloatArray, lower: Int64Array, upper: Int64Array, counts: Counts) -> Branch | None:
        """Branch whose two sides promise most: the product of what the bound gains on either.

        None where it turned out that some can be fixed: they are, in `lower`, `upper` and `counts`.
        """
        branches = self._branches(x, lower, upper)
        if len(branches) == 1:
            return branches[0]
        values, proofs = self._program.probe(branches, lower, upper, enough=float(self.n_stations - 1))
        if self._prove_probes(branches, proofs, lower, upper, counts):
            return None
        gain = np.maximum(values - float(x.sum()), 1e-4)
        return branches[int(np.argmax(gain[:, 0] * gain[:, 1]))]

    def _branches(self, x: FloatArray, lower: Int64Array, upper: Int64Array) -> list[Branch]:
        """Branches that are worth a trial: at least one, and one alone needs none."""
        distance = np.where(lower < upper, np.abs(x - 0.5), 1.0)
        likely = np.argsort(distance, kind="stable")[:_PROBES]
        likely = likely[distance[likely] < 0.5 - _WHOLE]
        branches = [Branch(candidate=int(i)) for i in likely] + self._group_branches(x)
        return branches or [Branch(candidate=int(np.argmin(distance)))]

    def _group_branches(self, x: FloatArray) -> list[Branch]:
        """Groups of which x takes about a half more than a whole number; of those with the same x the largest."""
        taken = self._groups @ x
        distance = np.abs(taken - np.floor(taken) - 0.5)
        found: dict[int, Branch] = {}
        order = np.lexsort((-self._group_sizes, distance))
        for group in order[distance[order] < _GROUP_DISTANCE].tolist():
            key = round(float(taken[group]) * 2**20)
            if key not in found:
                found[key] = Branch(group=group, below=int(np.floor(taken[group])))
            if len(found) == _GROUP_PROBES:
                break
        return list(found.values())

    def _prove_probes(
        self,
        branches: list[Branch],
        proofs: dict[tuple[int, int], FloatArray],
        lower: Int64Array,
        upper: Int64Array,
        counts: Counts,
    ) -> bool:
        """Whether prices of probes prove that a side of a branch holds nothing; then only the other one is left."""
        fixed = False
        for (number, side), price in proofs.items():
            branch, low, high = branches[number], lower.copy(), upper.copy()
            right, most = self._program.right, self._program.most
            if branch.group < 0:
                low[branch.candidate] = high[branch.candidate] = side
                if low[branch.candidate] < lower[branch.candidate] or high[branch.candidate] > upper[branch.candidate]:
                    continue
            else:
                right, most = self._program.sides(branch.group, *self._on_side(branch, side, counts)[branch.group])
            if (low <= high).all() and self._bound(price, low, high, right, most).stations >= self.n_stations:
                fixed = True
                # If its other side was ruled out as well, they now contradict each other: nothing is possible here.
                if branch.group >= 0:
                    counts[branch.group] = self._on_side(branch, 1 - side, counts)[branch.group]
                elif side:
                    upper[branch.candidate] = 0
                else:
                    lower[branch.candidate] = 1
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
        return self._network is None or self._network.n_violations(chosen) == 0

    def _solve(self, lower: Int64Array | None = None, upper: Int64Array | None = None) -> tuple[FloatArray, Bound]:
        x, price = self._program.solve()
        self._n_looks += 1
        lower, upper = self._lower if lower is None else lower, self._upper if upper is None else upper
        return x, self._bound(price, lower, upper)

    def _bound(
        self,
        price: FloatArray,
        lower: Int64Array,
        upper: Int64Array,
        right: Int64Array | None = None,
        most: Int64Array | None = None,
    ) -> Bound:
        program = self._program
        right, most = program.right if right is None else right, program.most if most is None else most
        return exact_bound(program.cuts, right, price, lower, upper, most)

    def _add_cuts(self, x: FloatArray, centre: FloatArray, *, joining: bool = True) -> bool:
        """Whether the solution violates any cut: if not, those of the other point would not raise the bound either."""
        self._program.drop_idle()
        own, more = self._cuts_for(x, joining=joining), self._cuts_for(centre, joining=joining)
        if own or more:
            self._program.add(own + more)
        return bool(own)

    def _cuts_for(self, x: FloatArray, *, joining: bool) -> list[Cut]:
        self._n_looks += 1
        joins = self._joins.violated(x) if self._joins is not None and joining else []
        through = self._separators.through(x) if joining and self._separators is not None else None
        return self._maker.violated(x, through) + joins

    def _add_separators(self, x: FloatArray) -> bool:
        """Look for separators of the network that the solution has little in; whether there are new ones."""
        if self._separators is None:
            return False
        n_before = len(self._separators.between)
        cuts = self._separators.sweep(x)
        self._program.add(cuts)
        return bool(cuts) or len(self._separators.between) > n_before

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


def groups_of(problem: CoverProblem) -> BoolArray:
    """(G, N) bool: members of groups of two or more candidates and fewer than all; small groups first.

    The two nearest groups are merged, again and again: near is what shares most rows of all that either sees, in the
    mean over pairs of members.
    """
    from scipy.cluster import hierarchy

    n = problem.n_candidates
    if not 3 <= n <= MOST_CANDIDATES:
        return np.zeros((0, n), dtype=bool)
    pairs = np.triu_indices(n, 1)
    merged = hierarchy.linkage(1.0 - _likeness(problem)[pairs], method="average")[:, :2].astype(np.int64)
    return _members(merged, n)


def _likeness(problem: CoverProblem) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(N, N): rows that two candidates share, over rows that either sees."""
    from scipy import sparse

    n = problem.n_candidates
    sees = sparse.csr_matrix(
        (np.ones(problem.row.size, dtype=np.int64), problem.row, problem.starts), shape=(n, problem.n_rows)
    )
    shared = (sees @ sees.T).toarray()
    size = np.diff(problem.starts)
    return np.asarray(shared / np.maximum(size[:, None] + size[None] - shared, 1))


def _members(merged: Int64Array, n: int) -> BoolArray:
    """Groups from (N - 1, 2) which two became one, the first n being single candidates; small ones first."""
    held: BoolArray = np.zeros((n + len(merged), n), dtype=bool)
    held[np.arange(n), np.arange(n)] = True
    for number, (a, b) in enumerate(merged.tolist()):
        held[n + number] = held[a] | held[b]
    groups = held[n:-1]
    return groups[np.argsort(groups.sum(axis=1), kind="stable")]
