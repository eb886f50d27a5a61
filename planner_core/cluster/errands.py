"""Gives errands to Dask workers, one at a time each, and fetches the files that they make, in pieces.

Whole jobs of a batch and clouds of stations go this way. A worker that dies loses its errand to another; one whose disk
is full, or that lacks something else, is told and not used; when none wait, idle workers get copies of those that are
out for much longer than others took, and the first one that ends counts. What is fetched is whole: folders of what is
not are removed.
"""

from __future__ import annotations

import secrets
import shutil
import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

from planner_core.cluster import spread, workplace
from planner_core.cluster.parcels import Parcel
from planner_core.cluster.spread import LOST, MOST_COPIES, MOST_FAILURES, Cluster, Crew
from planner_core.cluster.worker import LackingError
from planner_core.errors import ClusterError, is_of_full_disk

#: How long a worker waits for the end of an errand before it says how far it is.
_WAIT_S = 0.5
_DROPS_WITHIN_S = 5.0
#: An errand that is out for longer, and for twice as long as any that was done, is given to an idle worker, too.
_LONG_S = 60.0
_MOST_THREADS = 1000


@dataclass(frozen=True, eq=False)
class Order:
    """An errand to be done. files : that it needs, by their hashes. made : a free name for the folder of its files."""

    key: Hashable
    parcel: Parcel
    task: Any
    files: Mapping[str, Path]
    made: Path


class _FaultError(Exception):
    """A worker can't do it; another one may."""


class _HereError(Exception):
    """What is fetched can't be written here."""


@dataclass(eq=False)
class _Out:
    order: Order
    address: str
    made: Path
    done: Future[str]
    is_wanted: Event
    begun_s: float
    note: str = ""


class Errands:
    """Orders that workers do. is_fit : asks a worker, see `Crew`."""

    def __init__(self, cluster: Cluster, is_fit: Callable[[str], bool]) -> None:
        self._cluster, self._crew = cluster, Crew(cluster, is_fit)
        self._threads = ThreadPoolExecutor(_MOST_THREADS, thread_name_prefix="errand")
        self._waiting: list[Order] = []
        self._out: list[_Out] = []
        self._gone: list[_Out] = []
        self._losses: dict[Order, int] = {}
        self._given_up: list[tuple[Order, str]] = []
        self._longest_s: float | None = None

    def free(self) -> int:
        """How many more orders would be begun at once."""
        return len(self._crew.used - {each.address for each in self._out}) - len(self._waiting)

    def orders(self) -> dict[Order, str]:
        """Orders that are not done, and what each tells."""
        return {**dict.fromkeys(self._waiting, ""), **{out.order: out.note for out in self._wanted()}}

    def give(self, order: Order) -> None:
        """Have an order done."""
        self._waiting.append(order)

    def left_alone(self) -> list[Order] | None:
        """Return all orders where workers have been gone for too long, for this process to do; else None."""
        if not self._crew.is_gone():
            return None
        orders = list(self.orders())
        self._cluster.tell(f"no worker for {spread.PATIENCE_S:.0f} s: this machine goes on alone")
        self.stop()
        return orders

    def done(self) -> list[tuple[Order, str]]:
        """Deal orders out, and return those that were done since: why they failed, or an empty text.

        Raises
        ------
        ClusterError
            No worker that there is can be used, and nothing was done yet.
        OSError
            What was made can't be written here.
        """
        try:
            if not self._cluster.is_connected and not self._cluster.reconnect():
                self._crew.forget()
            else:
                there = self._crew.find(nothing_done=self._longest_s is None and not self._out)
                for out in [each for each in self._out if each.address not in there and not each.done.done()]:
                    self._lose(out, "it is gone")
                self._deal()
        except ClusterError:
            raise
        except (Exception, AsyncCancelledError):  # noqa: BLE001 - whatever Dask raises of a scheduler that is gone
            self._crew.forget()
        return self._collected()

    def stop(self) -> None:
        """End all orders, and remove what is half-fetched."""
        for each in self._out:
            each.is_wanted.clear()
        for each in self._out:
            with suppress(Exception, AsyncCancelledError):
                each.done.result(timeout=_DROPS_WITHIN_S + 2 * _WAIT_S)
        for each in (*self._out, *self._gone):
            shutil.rmtree(each.made, ignore_errors=True)
        self._out.clear()
        self._waiting.clear()
        self._crew.close()
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _deal(self) -> None:
        idle = sorted(self._crew.used - {each.address for each in self._out})
        while idle and self._waiting:
            self._send(self._waiting.pop(0), idle.pop())
        # Whoever gives orders gives as many as are free: where somebody is idle, none wait.
        late_s = time.monotonic() - max(_LONG_S, 2 * (self._longest_s or 0.0))
        for order in {out.order: None for out in self._wanted() if out.begun_s < late_s}:
            n_copies = sum(each.order is order for each in self._out)
            if idle and n_copies < MOST_COPIES:
                self._send(order, idle.pop())

    def _wanted(self) -> list[_Out]:
        return [out for out in self._out if out.is_wanted.is_set()]

    def _send(self, order: Order, address: str) -> None:
        made = order.made.with_name(f"{order.made.name}-{secrets.token_hex(4)}")
        out = _Out(order, address, made, Future(), Event(), time.monotonic())
        out.is_wanted.set()
        self._out.append(out)
        out.done = self._threads.submit(self._attend, out)

    def _collected(self) -> list[tuple[Order, str]]:
        ended = []
        for out in [each for each in self._out if each.done.done()]:
            self._out.remove(out)
            order = out.order
            try:
                message = out.done.result()
            except _HereError as error:
                self._out.append(out)  # it is removed with the others
                raise OSError(*error.args) from error
            except (_FaultError, *LOST, LackingError, RuntimeError, ImportError, MemoryError) as error:
                shutil.rmtree(out.made, ignore_errors=True)
                if not out.is_wanted.is_set():
                    continue
                self._crew.used.discard(out.address)
                if isinstance(error, _FaultError):
                    self._cluster.refuse(out.address, f"{error}; what it had is given to others")
                    self._put_back(order)
                else:
                    self._lose(out, str(error) or type(error).__name__)
                continue
            if not out.is_wanted.is_set():  # a copy was first
                shutil.rmtree(out.made, ignore_errors=True)
                continue
            for each in self._out:
                if each.order is order:
                    each.is_wanted.clear()
            self._longest_s = max(self._longest_s or 0.0, time.monotonic() - out.begun_s)
            out.made.replace(order.made)
            ended.append((order, message))
        given_up, self._given_up = self._given_up, []
        return ended + given_up

    def _lose(self, out: _Out, why: str) -> None:
        """Take an order from a worker that is gone; its thread may wait for long, but has nothing to write."""
        if out in self._out:
            self._out.remove(out)
            self._gone.append(out)
        was_wanted = out.is_wanted.is_set()
        out.is_wanted.clear()
        if not was_wanted:
            return
        self._losses[out.order] = self._losses.get(out.order, 0) + 1
        if self._losses[out.order] < MOST_FAILURES:
            self._put_back(out.order)
        elif all(each.order is not out.order for each in self._wanted()):
            message = f"{MOST_FAILURES} workers were lost over it ({why}); run the same command to try again"
            self._given_up.append((out.order, message))

    def _put_back(self, order: Order) -> None:
        if order not in self._waiting and all(each.order is not order for each in self._wanted()):
            self._waiting.insert(0, order)

    # ------------------------------------------------------------------------------------------ a worker's thread
    def _attend(self, out: _Out) -> str:
        """See one order through at one worker; returns why it failed there."""
        order, address, number = out.order, out.address, secrets.token_hex(8)
        try:
            self._cluster.supply(address, order.parcel)
            self._send_files(address, order.files)
            self._ask(address, workplace.begin, number, order.parcel.digest, order.task)
        except OSError as error:
            if is_of_full_disk(error):
                raise _FaultError(str(error)) from error
            raise
        try:
            state = self._ask(address, workplace.state, number, _WAIT_S)
            while state.outcome is None and out.is_wanted.is_set():
                out.note = state.note
                state = self._ask(address, workplace.state, number, _WAIT_S)
            if state.outcome is None:
                return ""
            if state.outcome.is_of_worker:
                raise _FaultError(state.outcome.message)
            self._fetch(address, number, state.made, out)
            message: str = state.outcome.message
            return message
        finally:
            with suppress(Exception, AsyncCancelledError):
                self._cluster.submit(address, workplace.drop, number).result(timeout=_DROPS_WITHIN_S)

    def _ask(self, address: str, function: Callable[..., Any], *arguments: Any) -> Any:
        return self._cluster.submit(address, function, *arguments).result(timeout=spread.PATIENCE_S)

    def _send_files(self, address: str, files: Mapping[str, Path]) -> None:
        sender = secrets.token_hex(4)
        for digest in self._ask(address, workplace.lacks_files, list(files)):
            try:
                size, offset = files[digest].stat().st_size, 0
                with files[digest].open("rb") as file:
                    while offset == 0 or offset < size:
                        content = file.read(workplace.PIECE_BYTES)
                        is_last = offset + len(content) >= size
                        self._ask(address, workplace.take_piece, digest, sender, offset, content, is_last)
                        offset += max(len(content), 1)
            except FileNotFoundError as error:
                raise _HereError(*error.args) from error

    def _fetch(self, address: str, number: str, made: tuple[tuple[str, int], ...], out: _Out) -> None:
        content, offset = b"", 0
        with _writing_here():
            out.made.mkdir(parents=True)
        for name, size in made:
            path, left = out.made / name, size
            with _writing_here():
                if size < 0:
                    path.mkdir()
                else:
                    path.touch()
            while left > 0:
                if not content:
                    content = self._ask(address, workplace.piece, number, offset)
                    offset += len(content)
                    if not content:
                        raise LackingError(name)
                part, content = content[:left], content[left:]
                left -= len(part)
                with _writing_here(), path.open("ab") as file:
                    file.write(part)
            if not out.is_wanted.is_set():
                return


@contextmanager
def _writing_here() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise _HereError(error.errno, error.strerror, error.filename) from error
