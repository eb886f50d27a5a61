"""Proof by blocks: where parts of the network hardly see the same, each is looked at alone, and the shares are split.

Input a `CoverProblem`, its `Network` and a known plan, output a proven lower bound, and plans that turn up on the way.

Flats behind one front, or storeys, share next to nothing but the target that they have to meet together. A search that
looks at all of them as one multiplies what there is to decide in each. Here a node only says how much each block covers
of each target: at least `low`, at most `high`. A plan covers at most what its blocks cover each, added up (rows that
two see count twice: that only weakens the bound), so

    low_b = least - sum over the other blocks of high        and        stations >= sum over blocks of fewest_b(low_b)

where fewest_b is bounded by branch and bound on the block alone; a bound for one demand holds for every larger one. The
sets that are known for these demands tell what to do next. Together fewer stations than the plan, and all targets met:
a better plan. Fewer, and a target missed: two nodes, in one of which a block covers more than its set does. As many as
the plan: prove them.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, silent
from planner_core.select.branching import BranchAndBound
from planner_core.select.network import Network, network_within
from planner_core.select.polish import polish
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import independent_constraints

#: Blocks that share more than this part of what the lesser one sees are one; the smallest are merged beyond so many.
_SHARED = 0.02
_MOST_BLOCKS = 6
#: Parts that are compared with each other, and parts by rows: a quarter of a gigabyte.
_MOST_PARTS, _MOST_ENTRIES = 1000, 32_000_000
#: Work of looking for a set that meets a demand, and of one turn of a proof.
_FIND_WORK, _PROOF_WORK = 0.5, 1.0
#: Finds few candidates that meet all targets, and says what work it was: of a problem and network, with candidates that
#: are in it, a set to begin with, if one is known, and work to be done.
Find = Callable[[CoverProblem, Network, tuple[int, ...], tuple[int, ...] | None, float], tuple[tuple[int, ...], float]]


@dataclass(frozen=True)
class Block:
    """problem, network : of its candidates alone, `least` and `required` whatever is asked of it at the moment.

    candidate : (N',) int64, numbers in the whole problem. pinned : its own numbers of those that are in every plan.
    ticks : (K,) int64, what it can cover of each target.
    """

    problem: CoverProblem
    network: Network
    candidate: Int64Array
    pinned: tuple[int, ...]
    ticks: Int64Array

    def of_constraints(self, which: Sequence[int]) -> Block:
        """The block with some of the targets."""
        at = list(which)
        problem = replace(
            self.problem,
            counts_for=self.problem.counts_for[at],
            required=self.problem.required[at],
            least=self.problem.least[at],
            seen_from=self.problem.seen_from[at],
        )
        return replace(self, problem=problem, ticks=self.ticks[at])

    def asked(self, demand: Int64Array) -> CoverProblem:
        """The problem of covering (K,) ticks."""
        return replace(self.problem, required=demand, least=demand)


def blocks_of(problem: CoverProblem, network: Network, pinned: Sequence[int] = ()) -> list[Block]:
    """Parts of the network, those together that share rows, with what they see; none where that is one block.

    None either where a target asks for several looks and blocks share rows: a row may then count for the whole that
    counts for no block. Nor where there are too many parts to compare.
    """
    part_of_entry = np.repeat(network.part, np.diff(problem.starts))
    used = np.union1d(part_of_entry, network.part[list(pinned)])
    if used.size < 2 or used.size > _MOST_PARTS or used.size * problem.n_rows > _MOST_ENTRIES:
        return []
    sees = np.zeros((used.size, problem.n_rows))
    sees[np.searchsorted(used, part_of_entry), problem.row] = 1.0
    groups = _apart(sees.copy(), problem.ticks)
    if len(groups) < 2:
        return []
    if (problem.seen_from > 1).any() and (np.array([sees[g].any(axis=0) for g in groups]).sum(axis=0) > 1).any():
        return []
    groups = sorted(used[group].tolist() for group in groups)
    return [_block(problem, network, np.isin(network.part, group), pinned) for group in groups]


def _apart(sees: FloatArray, ticks: Int64Array) -> list[list[int]]:
    """Merge parts, of which `sees`, (P, M), is 1 where one sees a row, until no two share much, and there are few.

    The two that share most go first. A merged group has the next number: of equals the latest are merged. `sees` is
    overwritten.
    """
    n = len(sees)
    groups = {number: [number] for number in range(n)}
    place = np.arange(n)  # of a group's row: where the first of its parts was
    number_at = np.arange(n)  # of the group that is there; -1 where it became part of another
    area = sees @ ticks
    share = (sees * ticks) @ sees.T / np.maximum(1, np.minimum(area[:, None], area))
    np.fill_diagonal(share, -1.0)
    most = share.max(axis=1)
    while len(groups) > 1:
        first = _latest(np.flatnonzero(most == most.max()), number_at)
        second = _latest(np.flatnonzero(share[first] == most[first]), number_at)
        if most[first] <= _SHARED:
            if len(groups) <= _MOST_BLOCKS:
                break
            order = place[np.lexsort((number_at[place], area[place]))]
            first, second = order[0], order[1]
        a, b = sorted((first, second), key=lambda at: int(number_at[at]), reverse=True)
        groups[n] = groups.pop(int(number_at[b])) + groups.pop(int(number_at[a]))
        number_at[b], number_at[a], n = n, -1, n + 1
        place = np.flatnonzero(number_at >= 0)
        np.maximum(sees[b], sees[a], out=sees[b])
        area[b] = sees[b] @ ticks
        share[a], share[:, a] = -1.0, -1.0
        share[b] = -1.0
        others = place[place != b]
        both = sees @ (sees[b] * ticks)
        share[b, others] = both[others] / np.maximum(1, np.minimum(area[b], area[others]))
        share[:, b] = share[b]
        most = share.max(axis=1)
    return list(groups.values())


def _latest(at: Int64Array, number_at: Int64Array) -> int:
    return int(at[np.argmax(number_at[at])])


def _block(problem: CoverProblem, network: Network, keep: BoolArray, pinned: Sequence[int]) -> Block:
    size = np.diff(problem.starts)
    own = problem.row[np.repeat(keep, size)]
    rows = np.unique(own)
    number = np.full(problem.n_rows, -1, dtype=np.int64)
    number[rows] = np.arange(rows.size)
    counts_for = problem.counts_for[:, rows] & (
        np.bincount(number[own], minlength=rows.size) >= problem.seen_from[:, None]
    )
    place = np.cumsum(keep) - 1
    return Block(
        problem=replace(
            problem,
            starts=np.concatenate([[0], np.cumsum(size[keep])]).astype(np.int64),
            row=number[own],
            ticks=problem.ticks[rows],
            counts_for=counts_for,
        ),
        network=network_within(network, keep),
        candidate=np.flatnonzero(keep),
        pinned=tuple(int(place[c]) for c in pinned if keep[c]),
        ticks=np.asarray((counts_for * problem.ticks[rows]).sum(axis=1), dtype=np.int64),
    )


@dataclass(frozen=True)
class _Node:
    """low, high : (B, K) int64, ticks of each target that each block covers. depth : splits down to here."""

    low: Int64Array
    high: Int64Array
    depth: int = 0


@dataclass
class _Known:
    """Of one block: sets with what they cover, (K,); demands, (K,), with stations that they take at least."""

    sets: list[tuple[Int64Array, tuple[int, ...]]] = field(default_factory=list)
    bounds: list[tuple[Int64Array, int]] = field(default_factory=list)
    looked_for: set[bytes] = field(default_factory=set)

    def bound(self, demand: Int64Array) -> int:
        """Stations that a demand takes at least."""
        return max((stations for asked, stations in self.bounds if (asked <= demand).all()), default=0)

    def best(self, demand: Int64Array) -> tuple[Int64Array, tuple[int, ...]] | None:
        """The smallest known set that meets a demand, of equals the one that covers most."""
        fit = [(len(chosen), -int(ticks.sum()), at) for at, (ticks, chosen) in enumerate(self.sets)
               if (ticks >= demand).all()]  # fmt: skip
        return self.sets[min(fit)[2]] if fit else None


class BlockProof:
    """The search. `lower_bound` holds at any moment; `best` is the smallest plan found here, or None.

    Parameters
    ----------
    n_stations
        Size of a plan that meets `required`.
    find
        See `Find`; what it returns is a set, no larger than the one it begins with where that is one, and its work.
    """

    def __init__(self, problem: CoverProblem, blocks: Sequence[Block], *, n_stations: int, find: Find) -> None:
        self.n_stations = n_stations
        self.best: tuple[int, ...] | None = None
        self.n_nodes = 0
        self._done = 0.0  # work of looking for sets, and of proofs that are over
        asked = independent_constraints(problem)
        self._problem, self._find = problem, find
        self._least = problem.least[asked]
        self._blocks = [block.of_constraints(asked) for block in blocks]
        self._known = [_Known() for _ in blocks]
        self._trees: dict[tuple[int, bytes], BranchAndBound] = {}
        self._open: list[tuple[int, int, int, _Node]] = []
        self._given_up = 2**31
        self._number = 0
        self._stopped = False
        high = np.array([block.ticks for block in self._blocks])
        self._put(_Node(np.zeros_like(high), high))

    @property
    def lower_bound(self) -> int:
        """No plan has fewer stations."""
        return min(self._open[0][0] if self._open else self.n_stations, self._given_up, self.n_stations)

    @property
    def finished(self) -> bool:
        """Whether more work can change anything."""
        return not self._open or self.lower_bound >= self.n_stations

    @property
    def work(self) -> float:
        """Numbers looked at so far, roughly, in 1e9."""
        return self._done + sum(tree.work for tree in self._trees.values())

    def stop(self) -> None:
        """End what is under way at the next opportunity; for callbacks of progress."""
        self._stopped = True
        for tree in self._trees.values():
            tree.stop()

    def advance(self, *, work: float, progress: Progress = silent) -> None:
        """Look at nodes until about `work` more is done, or until all is proven; some turns do more."""
        end = self.work + work
        while self.work < end and not self.finished and not self._stopped:
            # An interrupt may come at any moment: a node stays open until all that is left of it is.
            node = self._open[0][3]
            for rest in self._look_at(node, progress):
                self._put(rest)
            self._open.remove(next(entry for entry in self._open if entry[3] is node))
            heapq.heapify(self._open)
            self.n_nodes += 1

    # ------------------------------------------------------------------------------------------ nodes
    def _look_at(self, node: _Node, progress: Progress) -> list[_Node]:
        """What is left to look at of a node: nothing, itself once more, or two."""
        if self._stations(node) >= self.n_stations:
            return []
        sets = [self._set_for(number, demand) for number, demand in enumerate(node.low)]
        together = sum(len(chosen) for _, chosen in sets)
        if together >= self.n_stations:
            return [node] if self._prove(node, [len(chosen) for _, chosen in sets], progress) else self._give_up(node)
        plan = [int(block.candidate[c]) for block, (_, chosen) in zip(self._blocks, sets, strict=True) for c in chosen]
        if (self._problem.covered(plan) >= self._problem.required).all():
            self.best, self.n_stations = tuple(plan), together
            return [node]
        return self._split(node, np.array([ticks for ticks, _ in sets])) or self._give_up(node)

    def _split(self, node: _Node, covered: Int64Array) -> list[_Node]:
        """Two nodes, in one of which a block covers more of a target that `covered`, (B, K), misses; or none."""
        missing = self._least - covered.sum(axis=0)
        constraint = int(np.argmax(missing))
        if missing[constraint] <= 0:
            return []
        room = node.high[:, constraint] - covered[:, constraint]
        block = int(np.argmax(room))
        more = int(covered[block, constraint]) + min(int(room[block]), (int(missing[constraint]) + 1) // 2)
        low, high = node.low.copy(), node.high.copy()
        low[block, constraint] = max(more, low[block, constraint])
        high[block, constraint] = more - 1
        found = (self._tightened(low, node.high, node.depth), self._tightened(node.low, high, node.depth))
        return [each for each in found if each is not None]

    def _tightened(self, low: Int64Array, high: Int64Array, depth: int) -> _Node | None:
        """Ask of each block what all others leave; None where nobody can cover that."""
        low = np.maximum(low, self._least - (high.sum(axis=0) - high))
        return None if (low > high).any() else _Node(low, high, depth + 1)

    def _give_up(self, node: _Node) -> list[_Node]:
        """Only rounding, or rows that two blocks see, are in the way: this node's bound is final."""
        self._given_up = min(self._given_up, self._stations(node))
        return []

    def _stations(self, node: _Node) -> int:
        return sum(known.bound(demand) for known, demand in zip(self._known, node.low, strict=True))

    def _put(self, node: _Node) -> None:
        self._number += 1
        heapq.heappush(self._open, (self._stations(node), -node.depth, -self._number, node))

    # ------------------------------------------------------------------------------------------ blocks
    def _set_for(self, number: int, demand: Int64Array) -> tuple[Int64Array, tuple[int, ...]]:
        """The best set that is known of a block for a demand, having looked for one."""
        block, known = self._blocks[number], self._known[number]
        if demand.tobytes() not in known.looked_for:
            asked, begun = block.asked(demand), known.best(demand)
            start = None if begun is None else begun[1]
            chosen, work = self._find(asked, block.network, block.pinned, start, _FIND_WORK)
            self._done += work
            self._keep(number, polish(asked, chosen, network=block.network, given=block.pinned))
            known.looked_for.add(demand.tobytes())
        best = known.best(demand)
        assert best is not None  # one was just put there
        return best

    def _keep(self, number: int, chosen: tuple[int, ...]) -> None:
        self._known[number].sets.append((self._blocks[number].problem.covered(list(chosen)), chosen))

    def _prove(self, node: _Node, sizes: list[int], progress: Progress) -> bool:
        """Work on the bound of one block; whether there is one whose bound may rise."""
        bounds = [known.bound(demand) for known, demand in zip(self._known, node.low, strict=True)]
        lacking = self.n_stations - sum(bounds)
        due = []
        for number, (bound, size) in enumerate(zip(bounds, sizes, strict=True)):
            tree = self._trees.get((number, node.low[number].tobytes()))
            wanted = min(size, bound + lacking)
            if bound < wanted:
                due.append((0.0 if tree is None else tree.work, number, wanted))
        if not due:
            return False
        _, number, wanted = min(due)
        self._raise(number, node.low[number], wanted, progress)
        return True

    def _raise(self, number: int, demand: Int64Array, wanted: int, progress: Progress) -> None:
        """One turn of proving that a block takes `wanted` stations for a demand."""
        block, known, key = self._blocks[number], self._known[number], (number, demand.tobytes())
        tree = self._trees.get(key)
        if tree is None or tree.n_stations < wanted:
            self._done += 0.0 if tree is None else tree.work
            tree = BranchAndBound(
                block.asked(demand),
                n_stations=wanted,
                lower_bound=known.bound(demand),
                network=block.network,
                given=block.pinned,
            )
            self._trees[key] = tree
            tree.root(progress=progress)
        else:
            tree.advance(work=_PROOF_WORK, progress=progress)
        known.bounds.append((demand, tree.lower_bound))
        if tree.best is not None:
            self._keep(number, tree.best)
