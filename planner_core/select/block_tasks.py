"""Searches of single blocks: for few stations that meet a demand, or the first turn of a proof how many it takes.

They are independent of each other and may run in other processes, see `planner_core.spread`.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass

from planner_core.model import Int64Array
from planner_core.progress import Progress, silent
from planner_core.select.blocks import Block
from planner_core.select.branching import BranchAndBound
from planner_core.select.network import Network
from planner_core.select.polish import polish
from planner_core.select.problem import CoverProblem
from planner_core.spread import Kept

#: Work of looking for a set that meets a demand.
_FIND_WORK = 0.5
#: Finds few candidates that meet all targets, and the work that took: of a problem and network, with candidates that
#: are in it, a set to begin with, if one is known, work to be done, and who hears of it.
Find = Callable[
    [CoverProblem, Network, tuple[int, ...], tuple[int, ...] | None, float, Progress], tuple[tuple[int, ...], float]
]


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
