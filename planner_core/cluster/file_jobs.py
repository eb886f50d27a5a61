"""Gives file jobs to Dask workers, one at a time each, and fetches the files that they make, in pieces.

Whole jobs of a batch and clouds of stations go this way. A worker that dies loses its file job to another; one whose
disk is full, or that lacks something else, is reported and not used, and so is one at which a bug strikes; when none
wait, idle workers get copies of those that are out for much longer than others took, and the first one that ends
counts. What is fetched is whole: of what is not wanted any more nothing is written, and what was is removed.
"""

from __future__ import annotations

import hashlib
import secrets
import shutil
import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from planner_core.cluster import worker_files
from planner_core.cluster.connection import BugError, Connection, UnfitError
from planner_core.cluster.payloads import TaskPayload
from planner_core.cluster.worker import LackingError
from planner_core.cluster.worker_pool import MOST_COPIES, MOST_FAILURES, WorkerPool, answers_alike
from planner_core.errors import ClusterError, ExportError, one_line
from planner_core.executor import AnsweringFileJob, Kept, NotWantedError, Outcome, Task
from planner_core.progress import Progress, ProgressEvent

#: How long a worker waits for the end of a file job before it reports its progress.
_WAIT_S = 0.5
_LOOK_S = 0.1
_DROPS_WITHIN_S = 5.0
#: A file job that is out for longer, and for twice as long as any that was done, is given to an idle worker, too.
_LONG_S = 60.0
_MOST_THREADS = 1000


@dataclass(frozen=True, eq=False)
class Order:
    """A file job to be done. files : that it needs, by their hashes. made : a free name for the folder of its files."""

    key: Hashable
    payload: TaskPayload
    task: Any
    files: Mapping[str, Path]
    made: Path


class _RefusedError(Exception):
    """Nobody can do it."""


class _HereError(Exception):
    """What is fetched can't be written here. error : why."""

    def __init__(self, error: OSError) -> None:
        super().__init__(str(error))
        self.error = error


class _Out:
    """An order that is out at a worker. made : where its files come to."""

    def __init__(self, order: Order, address: str) -> None:
        self.order, self.address = order, address
        self.made = order.made.with_name(f"{order.made.name}-{secrets.token_hex(4)}")
        self.begun_s = time.monotonic()
        self.note = ""
        self.is_wanted = True
        self.done: Future[Outcome] = Future()
        self._lock = Lock()

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Write something of what comes, as long as it is wanted; raises `NotWantedError` and `_HereError`."""
        with self._lock:
            if not self.is_wanted:
                raise NotWantedError
            try:
                yield
            except OSError as error:
                raise _HereError(error) from error

    def end(self) -> None:
        """Want it no more: nothing is written from now on, and what was is removed."""
        with self._lock:
            self.is_wanted = False
            shutil.rmtree(self.made, ignore_errors=True)


class FileJobDispatcher:
    """Orders that workers do. is_fit : asks a worker, see `WorkerPool`. most : at the same time, copies included."""

    def __init__(self, cluster: Connection, is_fit: Callable[[str], bool], *, most: int | None = None) -> None:
        self._cluster, self._pool, self._most = cluster, WorkerPool(cluster, is_fit), most or _MOST_THREADS
        self._threads = ThreadPoolExecutor(_MOST_THREADS, thread_name_prefix="file-job")
        self._waiting: list[Order] = []
        self._out: list[_Out] = []
        self._was_idle: set[str] = set()
        self._losses: dict[Order, int] = {}
        self._struck: dict[Order, int] = {}
        self._for_here: list[Order] = []
        self._are_for_here = False
        self._given_up: list[tuple[Order, Outcome]] = []
        self._longest_s: float | None = None

    def free(self) -> int:
        """How many more orders would be begun at once."""
        return min(len(self._idle()), self._most - len(self._out)) - len(self._waiting)

    def orders(self) -> dict[Order, str]:
        """Orders that are not done, and the messages of each."""
        waiting = [*self._waiting, *self._for_here]
        return {**dict.fromkeys(waiting, ""), **{out.order: out.note for out in self._wanted()}}

    def give(self, order: Order) -> None:
        """Have an order done."""
        self._waiting.append(order)

    def left_alone(self) -> list[Order] | None:
        """Return all orders that are left where no worker can do them, for this process to do; else None."""
        # Whoever gives orders has had a chance to give more since the last look.
        before, self._are_for_here = self._are_for_here, bool(self._for_here) and not self._waiting and not self._out
        if self._are_for_here and before:
            self._cluster.tell("no worker can do what is left: this machine goes on alone")
        elif not self._pool.is_gone():
            return None
        orders = list(self.orders())
        self.stop()
        return orders

    def done(self) -> list[tuple[Order, Outcome]]:
        """TaskDispatcher orders out, and return those that were done since, or that nobody can do.

        Raises
        ------
        ClusterError
            No worker that there is can be used, and nothing was done yet.
        OSError
            What was made can't be written here.
        """
        try:
            if not self._cluster.is_connected and not self._cluster.reconnect():
                self._pool.forget()
            else:
                there = self._pool.find(nothing_done=self._longest_s is None and not self._out)
                for out in [each for each in self._out if each.address not in there and not each.done.done()]:
                    self._lose(out, "it is gone")
                self._dispatch()
        except ClusterError:
            raise
        except (Exception, AsyncCancelledError) as error:  # noqa: BLE001 - reported unless Dask may raise it
            if not self._cluster.is_lost(error):
                self._pool.give_up(error)
            self._pool.forget()
        return self._collected()

    def stop(self) -> None:
        """End all orders, and remove what is half-fetched."""
        for each in self._out:
            each.end()
        # Their threads tell the workers. One whose worker does not answer waits on, and has nothing to write.
        wait([each.done for each in self._out], timeout=_DROPS_WITHIN_S + 2 * _WAIT_S)
        self._out.clear()
        self._waiting.clear()
        self._for_here.clear()
        self._pool.close()
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _idle(self) -> set[str]:
        return self._pool.used - {each.address for each in self._out}

    def _dispatch(self) -> None:
        idle = sorted(self._idle())
        while idle and self._waiting and len(self._out) < self._most:
            self._send(self._waiting.pop(0), idle.pop())
        # Whoever gives orders has had a chance to give one to those that were idle at the last look.
        late_s = time.monotonic() - max(_LONG_S, 2 * (self._longest_s or 0.0))
        late = [order for order in {out.order: None for out in self._wanted() if out.begun_s < late_s}
                if sum(each.order is order for each in self._out) < MOST_COPIES]  # fmt: skip
        for address, order in zip([each for each in idle if each in self._was_idle], late, strict=False):
            if len(self._out) < self._most:
                self._send(order, address)
        self._was_idle = self._idle()

    def _wanted(self) -> list[_Out]:
        return [out for out in self._out if out.is_wanted]

    def _send(self, order: Order, address: str) -> None:
        out = _Out(order, address)
        self._out.append(out)
        out.done = self._threads.submit(self._attend, out)

    def _collected(self) -> list[tuple[Order, Outcome]]:
        ended = []
        for out in [each for each in self._out if each.done.done()]:
            self._out.remove(out)
            error, order = out.done.exception(), out.order
            if not out.is_wanted:
                continue
            if error is not None:
                out.end()
            if isinstance(error, _HereError):
                raise error.error
            if isinstance(error, UnfitError):
                self._pool.used.discard(out.address)
                self._cluster.refuse(out.address, f"{error}; what it had is given to others")
                self._put_back(order)
            elif error is None or isinstance(error, _RefusedError):
                for each in [each for each in self._out if each.order is order]:
                    each.end()
                self._longest_s = max(self._longest_s or 0.0, time.monotonic() - out.begun_s)
                if error is None:
                    self._cluster.has_helped = True
                    out.made.replace(order.made)
                ended.append((order, out.done.result() if error is None else Outcome(str(error))))
            elif self._cluster.is_lost(error):
                self._pool.used.discard(out.address)
                self._lose(out, one_line(str(error) or type(error).__name__))
            else:
                self._pool.spare(out.address, error)
                self._struck[order] = self._struck.get(order, 0) + 1
                self._put_back(order)
        given_up, self._given_up = self._given_up, []
        return ended + given_up

    def _lose(self, out: _Out, why: str) -> None:
        """Take an order from a worker that is gone; its thread may wait for long, but has nothing to write."""
        if out in self._out:
            self._out.remove(out)
            if not out.is_wanted:
                return
            out.end()
        self._losses[out.order] = self._losses.get(out.order, 0) + 1
        if self._losses[out.order] < MOST_FAILURES:
            self._put_back(out.order)
        elif all(each.order is not out.order for each in self._wanted()):
            message = f"{MOST_FAILURES} workers were lost over it ({why}); run the same command to try again"
            self._given_up.append((out.order, Outcome(message)))

    def _put_back(self, order: Order) -> None:
        """Have an order done anew, unless it is being done; at which bugs strike again and again, by this process."""
        if order not in self.orders():
            (self._waiting if self._struck.get(order, 0) < MOST_FAILURES else self._for_here).insert(0, order)

    # ------------------------------------------------------------------------------------------ a worker's thread
    def _attend(self, out: _Out) -> Outcome:
        """See one order through at one worker."""
        order, address, number = out.order, out.address, secrets.token_hex(8)
        self._cluster.supply(address, order.payload)
        self._send_files(out)
        ask = self._cluster.ask
        ask(address, worker_files.begin, number, order.payload.digest, order.task)
        try:
            state = ask(address, worker_files.state, number, _WAIT_S)
            while state.outcome is None and out.is_wanted:
                out.note = state.note
                state = ask(address, worker_files.state, number, _WAIT_S)
            if state.outcome is None:
                raise NotWantedError
            if state.outcome.is_bug:
                raise BugError(state.outcome.message)
            if state.outcome.is_of_worker:
                raise UnfitError(state.outcome.message)
            self._fetch(number, state.made, out)
            outcome: Outcome = state.outcome
            return outcome
        finally:
            with suppress(Exception, AsyncCancelledError):
                self._cluster.submit(address, worker_files.drop, number).result(timeout=_DROPS_WITHIN_S)

    def _send_files(self, out: _Out) -> None:
        files, sender = out.order.files, secrets.token_hex(4)
        for digest in self._cluster.ask(out.address, worker_files.lacks_files, list(files)):
            offset = 0
            for content, is_last in _pieces(files[digest], digest):
                if not out.is_wanted:
                    raise NotWantedError
                self._cluster.ask(out.address, worker_files.take_piece, digest, sender, offset, content, is_last)
                offset += len(content)

    def _fetch(self, number: str, made: tuple[tuple[str, int], ...], out: _Out) -> None:
        content, offset = b"", 0
        with out.writing():
            out.made.mkdir(parents=True)
        for name, size in made:
            path, left = out.made / name, size
            with out.writing():
                if size < 0:
                    path.mkdir()
                else:
                    path.touch()
            while left > 0:
                if not content:
                    content = self._cluster.ask(out.address, worker_files.piece, number, offset)
                    offset += len(content)
                    if not content:
                        raise LackingError(name)
                part, content = content[:left], content[left:]
                left -= len(part)
                with out.writing(), path.open("ab") as file:
                    file.write(part)


def _pieces(path: Path, digest: str) -> Iterator[tuple[bytes, bool]]:
    """Pieces of a file of this machine, and whether each is the last, of which there is one of an empty file, too.

    Raises
    ------
    _RefusedError
        It can't be read, or is not what it was.
    """
    found = hashlib.sha256()
    try:
        with path.open("rb") as file:
            content, more = file.read(worker_files.PIECE_BYTES), True
            while more:
                following = file.read(worker_files.PIECE_BYTES)
                found.update(content)
                more = bool(following)
                if not more and found.hexdigest() != digest:
                    raise _RefusedError(f"{path}: changed meanwhile, expected the same; run the same command again")
                yield content, not more
                content = following
    except OSError as error:
        raise _RefusedError(f"{path}: can't be read ({error.strerror or error}); check the file") from error


def files_of(
    cluster: Connection,
    job: AnsweringFileJob,
    tasks: Sequence[Task],
    folder: Path,
    *,
    kept: Kept,
    here: Callable[[Any], bytes],
    stage: str,
    progress: Progress,
) -> list[bytes]:
    """Have the files of all tasks in a folder; see `planner_core.executor.Executor.files`.

    Raises
    ------
    ClusterError
        All workers that there are scan otherwise than this process, or are of another version.
    ExportError
        A worker can't write what another one can't, either.
    OSError
        The folder can't be written.
    """
    payload, expected = cluster.payload(job), job.answer(tasks[0].of, kept)
    dispatcher = FileJobDispatcher(
        cluster, lambda address: answers_alike(cluster, address, payload, tasks[0].of, expected)
    )
    waiting, answers = list(range(len(tasks))), dict[int, bytes]()
    n_steps = sum(task.size for task in tasks)

    def show(note: str) -> None:
        progress(ProgressEvent(stage, sum(tasks[number].size for number in answers), n_steps, note))

    try:
        while waiting or dispatcher.orders():
            while waiting and dispatcher.free() > 0:
                number = waiting.pop(0)
                dispatcher.give(Order(number, payload, tasks[number].of, {}, folder / f".{number}"))
            for order, outcome in dispatcher.done():
                done = order.key
                assert isinstance(done, int)
                if outcome.message:
                    raise ExportError(f"{tasks[done].name}: {outcome.message}")
                for path in order.made.iterdir():
                    path.rename(folder / path.name)
                order.made.rmdir()
                answers[done] = outcome.answer
            if dispatcher.left_alone() is not None:
                for number in sorted(set(range(len(tasks))) - answers.keys()):
                    answers[number] = here(tasks[number].of)
                    show("alone")
                break
            show("workers")
            time.sleep(_LOOK_S)
    finally:
        dispatcher.stop()
    return [answers[number] for number in range(len(tasks))]
