"""Deals tasks out to Dask workers, few at a time, and puts their answers in order: the bytes of one process.

Each worker gets its next task when it gives one back, so a slow one holds nobody up; when none are left, idle workers
get copies of those that are out longest, and the first answer counts. A worker is used once it is fit (`WorkerPool`).
One that dies loses its tasks to the others. Where the scheduler is gone it is waited for; where nobody is left for
`PATIENCE_S`, this process does the rest. Answers that are here are kept, whatever happens. Progress is reported at each
look, some times a second: what it raises ends the wait, and the tasks that are out are taken back, which ends them at
workers.

Sent to a worker: the job, once, by content; a task is a few hundred bytes. Sent back: bytes. At most `_AHEAD`
tasks a worker are out, so that neither side ever holds more than that.
"""

from __future__ import annotations

from asyncio import CancelledError as AsyncCancelledError
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from planner_core.cluster import worker
from planner_core.cluster.connection import FETCHES_WITHIN_S, LOST, BugError, Connection, UnfitError, fault_of
from planner_core.cluster.payloads import TaskPayload
from planner_core.cluster.worker_pool import MOST_COPIES, MOST_FAILURES, WorkerPool, answers_alike, no_answer
from planner_core.errors import ClusterError
from planner_core.executor import Task
from planner_core.progress import Progress, ProgressEvent

#: Tasks of a worker: one at work, one waiting there.
_AHEAD = 2
_LOOK_S = 0.5


class TaskDispatcher:
    """One job, dealt out: tasks by their numbers, `waiting`, `out` at workers, or answered."""

    def __init__(
        self,
        cluster: Connection,
        payload: TaskPayload,
        tasks: Sequence[Task],
        here: Callable[[Any], bytes],
        stage: str,
        progress: Progress,
        answered: Callable[[int, bytes], None] | None,
    ) -> None:
        self._cluster, self._parcel, self._tasks, self._here = cluster, payload, tasks, here
        self._stage, self._progress, self._answered = stage, progress, answered
        self._answers: dict[int, bytes] = {}
        first = self._here_too(0)
        self._waiting = list(range(len(tasks) - 1, 0, -1))
        self._out: dict[Any, tuple[str, int]] = {}
        self._failures: dict[int, int] = {}
        self._for_here: list[int] = []
        self._pool = WorkerPool(cluster, lambda address: answers_alike(cluster, address, payload, tasks[0].of, first))

    def answers(self) -> list[bytes]:
        """All answers, in the order of the tasks."""
        try:
            self._work()
        finally:
            self._pool.close()
            self._cluster.take_back(list(self._out))  # copies of what is answered, or all where progress raised
        return [self._answers[number] for number in range(len(self._tasks))]

    def _work(self) -> None:
        while len(self._answers) < len(self._tasks):
            try:
                if not self._cluster.is_connected and not self._cluster.reconnect():
                    self._forget_workers()
                else:
                    there = self._pool.find(nothing_done=len(self._answers) == 1)
                    for future, (address, number) in list(self._out.items()):
                        if address not in there:
                            del self._out[future]
                            self._put_back(number)
                    self._dispatch()
                    self._collect()
            except ClusterError:
                raise
            except (Exception, AsyncCancelledError) as error:  # noqa: BLE001 - reported unless Dask may raise it
                if not self._cluster.is_lost(error):
                    self._pool.give_up(error)
                self._forget_workers()
            while self._for_here:  # what it raises is this process's own
                self._here_too(self._for_here.pop())
            if self._pool.is_gone():
                self._do_here()
            self._show(f"{len(self._pool.used)} workers")

    def _here_too(self, number: int) -> bytes:
        """Do a task in this process."""
        self._keep(number, self._here(self._tasks[number].of))
        return self._answers[number]

    def _keep(self, number: int, answer: bytes) -> None:
        if number not in self._answers:
            self._answers[number] = answer
            if self._answered is not None:
                self._answered(number, answer)

    def _show(self, note: str) -> None:
        n_done = sum(self._tasks[number].size for number in self._answers)
        self._progress(ProgressEvent(self._stage, n_done, sum(task.size for task in self._tasks), note))

    def _dispatch(self) -> None:
        load = dict.fromkeys(sorted(self._pool.used), 0)
        for address, _ in self._out.values():
            load[address] = load.get(address, 0) + 1
        for ahead in range(_AHEAD):
            for address in load:
                if address in self._pool.used and load[address] == ahead and self._waiting:
                    self._send(address, self._waiting.pop())
                    load[address] += 1
        if not self._waiting:  # what is out longest comes first
            copies = Counter(number for _, number in self._out.values())
            for address in (each for each in load if load[each] == 0):
                late = [
                    number
                    for at, number in self._out.values()
                    if at != address and number not in self._answers and copies[number] < MOST_COPIES
                ]
                if late:
                    copies[late[0]] += 1
                    self._send(address, late[0])

    def _send(self, address: str, number: int) -> None:
        future = self._cluster.submit(address, worker.answer, self._parcel.digest, self._tasks[number].of)
        self._out[future] = address, number
        future.add_done_callback(lambda _: self._pool.some_done.set())

    def _collect(self) -> None:
        self._pool.some_done.wait(_LOOK_S)
        self._pool.some_done.clear()
        for future in [each for each in self._out if each.done()]:
            address, number = self._out.pop(future)
            try:
                if future.status == "finished":
                    self._keep(number, future.result(timeout=FETCHES_WITHIN_S))
                    self._cluster.has_helped = True
                else:
                    self._failed(address, number, future)
                future.release()
            except LOST:  # it was done, and its worker died before it gave the answer away
                self._put_back(number)
                self._pool.used.discard(address)

    def _failed(self, address: str, number: int, future: Any) -> None:
        """Put a task back; what a worker lacks is sent again; what fails again and again is done here."""
        error = fault_of(future) if future.status == "error" else None
        self._put_back(number)
        if isinstance(error, worker.LackingError):
            self._pool.used.discard(address)  # it is checked anew
            return
        self._failures[number] = self._failures.get(number, 0) + 1
        if isinstance(error, UnfitError):
            self._cluster.refuse(address, no_answer(error))
            self._pool.used.discard(address)
        elif isinstance(error, BugError):
            self._pool.spare(address, error)
        done = number in self._answers or number in self._for_here
        if self._failures[number] >= MOST_FAILURES and not done:  # whether or not a copy is out
            self._waiting = [each for each in self._waiting if each != number]
            self._for_here.append(number)

    def _put_back(self, number: int) -> None:
        is_out = any(other == number for _, other in self._out.values())
        if number not in self._answers and number not in self._waiting and not is_out:
            self._waiting.append(number)

    def _forget_workers(self) -> None:
        self._out.clear()
        there = {*self._answers, *self._for_here}
        self._waiting = [number for number in range(len(self._tasks) - 1, 0, -1) if number not in there]
        self._pool.forget()

    def _do_here(self) -> None:
        for number in sorted(set(range(len(self._tasks))) - set(self._answers)):
            self._here_too(number)
            self._show("alone")
