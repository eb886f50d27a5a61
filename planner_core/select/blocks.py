"""Blocks of a problem: parts of its network that hardly see the same, as problems of their own.

Searches of single blocks (`BlockTask`) find few stations that meet a demand, or, the first turn of a proof, how many it
takes. They are independent of each other and may run in other processes, see `planner_core.executor`.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.executor import Kept
from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.progress import Progress, silent
from planner_core.select.branching import BranchAndBound
from planner_core.select.network import Network, network_within
from planner_core.select.polish import polish
from planner_core.select.problem import CoverProblem

#: Blocks that share more than this part of what the lesser one sees are one; the smallest are merged beyond so many.
_SHARED = 0.02
_MOST_BLOCKS = 6
#: Parts that are compared with each other, and parts by rows: a quarter of a gigabyte.
_MOST_PARTS, _MOST_ENTRIES = 1000, 32_000_000
#: Work of looking for a set that meets a demand.
_FIND_WORK = 0.5
#: Finds few candidates that meet all targets, and the work that took: of a problem and network, with candidates that
#: are in it, a set to begin with, if one is known, work to be done, and who hears of it.
Find = Callable[
    [CoverProblem, Network, tuple[int, ...], tuple[int, ...] | None, float, Progress], tuple[tuple[int, ...], float]
]


@dataclass(frozen=True)
class Block:
    """problem, network : of its candidates alone, `least` and `required` the demand on it at the moment.

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

    def demanding(self, demand: Int64Array) -> CoverProblem:
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


@dataclass(frozen=True)
class BlockTask:
    """One search of a block, by its number, for a demand, (K,): a set, or a proof that it takes `wanted` stations.

    wanted : 0: a set; start : one to begin with. known : stations that are taken at least. work : of a proof, at most.
    """

    number: int
    demand: Int64Array
    wanted: int = 0
    start: tuple[int, ...] | None = None
    known: int = 0
    work: float = 0.0

    @property
    def key(self) -> tuple[int, bytes]:
        """Block and demand."""
        return self.number, self.demand.tobytes()


@dataclass(frozen=True)
class BlockResult:
    """chosen : a set; of a proof a better one, empty: none. stations : that are taken at least. work : that it took."""

    chosen: tuple[int, ...]
    stations: int
    work: float


@dataclass(frozen=True)
class BlockJob:
    """Searches of blocks, independent of each other. find : see `Find`."""

    blocks: tuple[Block, ...]
    find: Find

    def answer(self, task: BlockTask, kept: Kept, progress: Progress = silent) -> bytes:
        """Run a task; the pickled `BlockResult`."""
        del kept
        found = self.first_turn(task, progress)[0] if task.wanted else self.found(task, progress)
        return pickle.dumps(found, protocol=5)

    def found(self, task: BlockTask, progress: Progress = silent) -> BlockResult:
        """Return a set of a block."""
        block = self.blocks[task.number]
        problem = block.demanding(task.demand)
        chosen, work = self.find(problem, block.network, block.pinned, task.start, _FIND_WORK, progress)
        return BlockResult(polish(problem, chosen, network=block.network, given=block.pinned), 0, work)

    def first_turn(
        self, task: BlockTask, progress: Progress = silent, begun: Callable[[BranchAndBound], None] = lambda _: None
    ) -> tuple[BlockResult, BranchAndBound]:
        """Return what the first turn of a proof finds, root and all, and its tree. begun : hears of that before."""
        block = self.blocks[task.number]
        tree = BranchAndBound(
            block.demanding(task.demand), n_stations=task.wanted, lower_bound=task.known, network=block.network,
            given=block.pinned,
        )  # fmt: skip
        begun(tree)
        tree.root(work=task.work, progress=progress)
        tree.advance(work=max(task.work - tree.work, 0.0), progress=progress)
        return BlockResult(tree.best or (), tree.lower_bound, tree.work), tree


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
    number = np.full(problem.n_rows, -1, dtype=np.int32)
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
