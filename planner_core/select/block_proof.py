"""Proof by blocks: where parts of the network hardly see the same, each is searched alone, and the shares are split.

Input a `CoverProblem`, its `Network` and a known plan, output a proven lower bound, and plans that turn up on the way.

Flats behind one front, or storeys, share next to nothing but the target that they have to meet together. A search of
all of them as one multiplies what there is to decide in each. Here a node only bounds how much each block covers
of each target: at least `low`, at most `high`. A plan covers at most what its blocks cover each, added up (rows that
two see count twice: that only weakens the bound), so

    low_b = least - sum over the other blocks of high        and        stations >= sum over blocks of fewest_b(low_b)

where fewest_b is bounded by branch and bound on the block alone; a bound for one demand holds for every larger one. The
sets that are known for these demands decide what is next. Together fewer stations than the plan, and all targets met:
a better plan. Fewer, and a target missed: two nodes, in one of which a block covers more than its set does. As many as
the plan: prove them.

The first search of a block, for a set or for a proof, depends on no other block: it is a task (blocks.py), and
other processes run some of these within `spread_over` (`_run`). What comes next depends on all results.
"""

from __future__ import annotations

import heapq
import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner_core.executor import Executor, Task, current_executor
from planner_core.model import Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.blocks import Block, BlockJob, BlockResult, BlockTask, Find
from planner_core.select.branching import BranchAndBound
from planner_core.select.problem import CoverProblem
from planner_core.select.relaxation import independent_constraints

#: Work of one turn of a proof, and of its first turn, the root included.
_PROOF_WORK, _FIRST_PROOF_WORK = 1.0, 5.0
#: Blocks that have fewer entries together are searched sooner here than they are sent.
_WORTH_SPREADING = 10_000


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
    searched: set[bytes] = field(default_factory=set)

    def bound(self, demand: Int64Array) -> int:
        """Stations that a demand takes at least."""
        return max((stations for bounded, stations in self.bounds if (bounded <= demand).all()), default=0)

    def best(self, demand: Int64Array) -> tuple[Int64Array, tuple[int, ...]] | None:
        """The smallest known set that meets a demand, of equals the one that covers most."""
        fit = [(len(chosen), -int(ticks.sum()), at) for at, (ticks, chosen) in enumerate(self.sets)
               if (ticks >= demand).all()]  # fmt: skip
        return self.sets[min(fit)[2]] if fit else None


@dataclass
class _Turns:
    """Of one proof. first : the first one, which took `work`. tree : None: others did that, and have it."""

    first: BlockTask
    work: float
    tree: BranchAndBound | None

    @property
    def all_work(self) -> float:
        """That counts: a tree that is made anew is where it was."""
        return self.work if self.tree is None else max(self.work, self.tree.work)


class _StoppedError(Exception):
    """The search was stopped while other processes ran tasks."""


class BlockProof:
    """The search. `lower_bound` holds at any moment; `best` is the smallest plan found here, or None.

    Parameters
    ----------
    n_stations
        Size of a plan that meets `required`.
    find
        See `Find`; what it returns is a set, no larger than the one it begins with where that is one, and its work.
    sent_find
        The same for other processes, which it is sent to: a function of a module.
    work_limit
        First turns of proofs do no more together, `find` left aside.
    """

    def __init__(
        self,
        problem: CoverProblem,
        blocks: Sequence[Block],
        *,
        n_stations: int,
        find: Find,
        sent_find: Find | None = None,
        work_limit: float = float("inf"),
    ) -> None:
        self.n_stations = n_stations
        self.best: tuple[int, ...] | None = None
        self.n_nodes = 0
        self._done = 0.0  # work of looking for sets, and of proofs that are over
        independent = independent_constraints(problem)
        self._problem, self._sent_find, self._work_limit = problem, sent_find, work_limit
        self._least = problem.least[independent]
        self._blocks = tuple(block.of_constraints(independent) for block in blocks)
        self._known = [_Known() for _ in blocks]
        self._turns: dict[tuple[int, bytes], _Turns] = {}
        self._growing: BranchAndBound | None = None  # in its first turn
        self._grown: dict[tuple[int, bytes], BranchAndBound] = {}
        self._job = BlockJob(self._blocks, find)
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
        """Numbers read so far, roughly, in 1e9."""
        return self._done + sum(turns.all_work for turns in self._turns.values())

    def stop(self) -> None:
        """End what is under way at the next opportunity; for callbacks of progress."""
        self._stopped = True
        for tree in (self._growing, *(turns.tree for turns in self._turns.values())):
            if tree is not None:
                tree.stop()

    def advance(self, *, work: float, progress: Progress = silent) -> None:
        """Look at nodes until about `work` more is done, or until all is proven; some turns do more."""
        end = self.work + work
        while self.work < end and not self.finished and not self._stopped:
            # An interrupt may come at any moment: a node stays open until all that is left of it is.
            node = self._open[0][3]
            left = [node]  # of a task that is broken off; its bound may have risen
            try:
                left = self._look_at(node, progress)
            except _StoppedError:
                pass
            finally:
                for rest in left:
                    self._put(rest)
                self._open.remove(next(entry for entry in self._open if entry[3] is node))
                heapq.heapify(self._open)
            self.n_nodes += 1

    # ------------------------------------------------------------------------------------------ nodes
    def _look_at(self, node: _Node, progress: Progress) -> list[_Node]:
        """What is left to search of a node: nothing, itself once more, or two."""
        if self._stations(node) >= self.n_stations:
            return []
        sets = self._sets_for(node.low, progress)
        together = sum(len(chosen) for _, chosen in sets)
        if together >= self.n_stations:
            may_rise = self._prove(node.low, [len(chosen) for _, chosen in sets], progress)
            return [node] if may_rise else self._give_up(node)
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
    def _sets_for(self, demands: Int64Array, progress: Progress) -> list[tuple[Int64Array, tuple[int, ...]]]:
        """The best set that is known of each block for its demand, after a search for one."""
        tasks = []
        for number, (demand, known) in enumerate(zip(demands, self._known, strict=True)):
            if demand.tobytes() not in known.searched:
                begun = known.best(demand)
                tasks.append(BlockTask(number, demand, start=None if begun is None else begun[1]))
        self._run(tasks, self._take_set, progress)
        sets = [known.best(demand) for known, demand in zip(self._known, demands, strict=True)]
        return [each for each in sets if each is not None]  # all: one of each block was put there

    def _take_set(self, task: BlockTask, found: BlockResult) -> None:
        self._done += found.work
        self._keep(task.number, found.chosen)
        self._known[task.number].searched.add(task.demand.tobytes())

    def _keep(self, number: int, chosen: tuple[int, ...]) -> None:
        self._known[number].sets.append((self._blocks[number].problem.covered(list(chosen)), chosen))

    def _prove(self, demands: Int64Array, sizes: list[int], progress: Progress) -> bool:
        """Work on the bounds of blocks; whether there is one whose bound may rise."""
        bounds = [known.bound(demand) for known, demand in zip(self._known, demands, strict=True)]
        lacking = self.n_stations - sum(bounds)
        new: list[BlockTask] = []
        due: list[tuple[float, int]] = []
        for number, (bound, size, demand) in enumerate(zip(bounds, sizes, demands, strict=True)):
            task = BlockTask(number, demand, wanted=min(size, bound + lacking), known=bound)
            turns = self._turns.get(task.key)
            if bound >= task.wanted:
                continue
            if turns is None or turns.first.wanted < task.wanted:
                new.append(task)
            else:
                due.append((turns.all_work, number))
        if new:
            self._begin(new, progress)
        elif due:
            self._go_on(self._turns[min(due)[1], demands[min(due)[1]].tobytes()], progress)
        return bool(new or due)

    def _begin(self, tasks: Sequence[BlockTask], progress: Progress) -> None:
        """Do the first turns of some proofs."""
        each = min(_FIRST_PROOF_WORK, max(self._work_limit - self.work, 0.0) / len(tasks))
        self._run([replace(task, work=each) for task in tasks], self._take_turn, progress)

    def _take_turn(self, task: BlockTask, found: BlockResult) -> None:
        before = self._turns.get(task.key)
        self._done += 0.0 if before is None else before.all_work
        self._turns[task.key] = _Turns(task, found.work, self._grown.pop(task.key, None))
        self._take(task, found.stations, found.chosen)

    def _go_on(self, turns: _Turns, progress: Progress) -> None:
        """Do another turn of a proof."""
        if turns.tree is None:
            turns.tree = self._job.first_turn(turns.first, progress, self._grow)[1]
            self._growing = None
        turns.tree.advance(work=_PROOF_WORK, progress=progress)
        self._take(turns.first, turns.tree.lower_bound, turns.tree.best or ())

    def _take(self, task: BlockTask, stations: int, chosen: tuple[int, ...]) -> None:
        self._known[task.number].bounds.append((task.demand, stations))
        if chosen:
            self._keep(task.number, chosen)

    # ------------------------------------------------------------------------------------------ tasks
    def _run(
        self, tasks: Sequence[BlockTask], take: Callable[[BlockTask, BlockResult], None], progress: Progress
    ) -> None:
        """Run tasks here or, within `spread_over`, in other processes: same results, taken in the same order.

        Others are not waited for once the search is stopped or `progress` raises: what is here by then is taken.

        Raises
        ------
        _StoppedError
            Not all tasks are here.
        """
        if tasks:
            progress(ProgressEvent("prove", 0, len(tasks)))
        executor, entries = current_executor(), [self._blocks[task.number].problem.row.size for task in tasks]
        pays = len(tasks) > 1 and sum(entries) >= _WORTH_SPREADING and not self._stopped  # then all end at once
        if pays and executor is not None and self._sent_find is not None:
            least = tasks[entries.index(min(entries))]
            self._run_elsewhere(executor, self._sent_find, tasks, least, take, progress)
            return
        for task, found in [(task, self._run_here(task, progress)) for task in tasks]:
            take(task, found)

    def _run_elsewhere(
        self,
        executor: Executor,
        find: Find,
        tasks: Sequence[BlockTask],
        least: BlockTask,
        take: Callable[[BlockTask, BlockResult], None],
        progress: Progress,
    ) -> None:
        """Run tasks in other processes. least : each process first does a short one on its block, as a probe."""
        probe = replace(least, wanted=len(self._blocks[least.number].candidate), start=None, work=0.0)
        job, answers = BlockJob(self._blocks, find), dict[int, bytes]()

        def here(task: BlockTask) -> bytes:
            if task is probe:
                return job.answer(task, lambda _, make: make())
            return pickle.dumps(self._run_here(task, progress), protocol=5)

        def heard(event: ProgressEvent) -> None:
            progress(event)
            if self._stopped:
                raise _StoppedError

        sent = [Task(probe, 0), *(Task(task, 1) for task in tasks)]
        try:
            executor.answers(job, sent, here=here, stage="prove", progress=heard, answered=answers.__setitem__)
        except _StoppedError:
            if len(answers) < len(sent):
                raise
        finally:
            for number, task in enumerate(tasks, start=1):
                if number in answers:
                    take(task, pickle.loads(answers[number]))

    def _run_here(self, task: BlockTask, progress: Progress) -> BlockResult:
        if task.wanted == 0:
            return self._job.found(task, progress)
        found, self._grown[task.key] = self._job.first_turn(task, progress, self._grow)
        self._growing = None
        return found

    def _grow(self, tree: BranchAndBound) -> None:
        self._growing = tree
