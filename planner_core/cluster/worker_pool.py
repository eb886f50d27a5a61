"""Who of a cluster's workers may be used: those of this version that answer as this process does, bit by bit."""

from __future__ import annotations

import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from threading import Event
from typing import Any

from planner_core.cluster import connection, worker
from planner_core.cluster.connection import BugError, Connection, UnfitError
from planner_core.cluster.payloads import TaskPayload
from planner_core.errors import ClusterError

#: Workers that are checked at the same time: others work meanwhile.
_JOIN_AT_ONCE = 16
#: Of the same task, at the end.
MOST_COPIES = 2
#: A worker may crash over tasks of its own; one task that fails so often is done here.
MOST_FAILURES = 3
_LOOK_S = 0.5


class WorkerPool:
    """Workers that are there and, checked once, were found fit. is_fit : checks one, and refuses it where it is not."""

    def __init__(self, cluster: Connection, is_fit: Callable[[str], bool]) -> None:
        self._cluster, self._is_fit = cluster, is_fit
        self.used: set[str] = set()
        self.some_done = Event()
        """Set where somebody has answered, or may be dealt to."""
        self._joining: dict[str, Future[bool]] = {}
        self._silent: set[str] = set()
        """Those that did not answer in time: they are checked again, and count for nobody until they do."""
        self._spared: set[str] = set()
        """Those at which a bug struck."""
        self._there: set[str] = set()
        self._was_used = self._gave_up = False
        self._askers = ThreadPoolExecutor(_JOIN_AT_ONCE, thread_name_prefix="join")
        self._alone_s = time.monotonic()

    def find(self, *, nothing_done: bool) -> set[str]:
        """Look who is there, and have new ones checked; returns who is there.

        Raises
        ------
        ClusterError
            Nobody who is there is fit, and nobody has done anything yet.
        """
        there = self._there = self._cluster.workers()
        self.used &= there
        for address in self._joining.keys() - there:  # its thread waits for an answer until the connection is closed
            del self._joining[address]
        for address in sorted(there - self.used - self._spared - self._joining.keys()):
            if not self._cluster.is_refused(address):
                self._joining[address] = self._askers.submit(self._check, address)
                self._joining[address].add_done_callback(lambda _: self.some_done.set())
        for address, fit in [each for each in self._joining.items() if each[1].done()]:
            del self._joining[address]
            try:
                self._silent.discard(address)
                if fit.result() and address in there:
                    self.used.add(address)
                    self._was_used = True
            except (Exception, AsyncCancelledError) as error:  # noqa: BLE001 - reported unless Dask may raise it
                if self._cluster.is_lost(error):  # if it still is there, it is checked again
                    self._silent.add(address)
                else:
                    self.spare(address, error)
        is_alone = not self.used and not self._joining and nothing_done and not self._cluster.has_helped
        if there and is_alone and all(map(self._cluster.is_refused, there)):
            raise ClusterError(
                f"cluster: none of {len(there)} workers can be used, for the reasons above, expected one; mend "
                "these, or start workers of the same version of tlsplan and the same kind of device"
            )
        return there

    def spare(self, address: str, error: BaseException) -> None:
        """Use a worker no more here: a bug struck there, or here over it, and is reported."""
        self.used.discard(address)
        self._spared.add(address)
        self._note(f"worker {address}", error)

    def give_up(self, error: BaseException) -> None:
        """Use nobody any more: a bug struck here, and is reported."""
        self._gave_up = True
        self._note("this machine", error)

    def forget(self) -> None:
        """Use nobody until they are found again."""
        self.used.clear()
        self._there = set()
        self.some_done.wait(_LOOK_S)
        self.some_done.clear()

    def is_gone(self) -> bool:
        """Whether nobody was there for too long, or can do it; reported."""
        if self.used or self._joining.keys() - self._silent:
            self._alone_s = time.monotonic()
        if self._gave_up or self._is_no_use():
            why = "no worker can do this"
        elif time.monotonic() - self._alone_s > connection.PATIENCE_S:
            why = f"no worker for {connection.PATIENCE_S:.0f} s"
        else:
            return False
        self._cluster.tell(f"{why}: this machine goes on alone")
        return True

    def _is_no_use(self) -> bool:
        """Whether nobody who is there may be used; where one was of use and none is a bug's, others may still come."""
        if not self._there or self.used or self._joining or (self._was_used and not self._spared):
            return False
        return all(address in self._spared or self._cluster.is_refused(address) for address in self._there)

    def _note(self, who: str, error: BaseException) -> None:
        is_known = isinstance(error, BugError)
        self._cluster.note_bug(who, str(error) if is_known else worker.bug_of(error, error.__traceback__))

    def close(self) -> None:
        """Ask nobody any more."""
        self._askers.shutdown(wait=False, cancel_futures=True)

    def _check(self, address: str) -> bool:
        """Whether a worker is of this version, and fit."""
        own = asdict(worker.identity())
        try:
            found = self._cluster.ask(address, worker.greet)
        except (UnfitError, BugError) as error:
            self._cluster.refuse(address, f"got no tlsplan that it understands ({error}), expected {own['version']}")
            return False
        if found != own:
            name = next(name for name in own if found.get(name) != own[name])
            self._cluster.refuse(
                address, f"got {name} {found.get(name)}, expected {own[name]}; install the same tlsplan there"
            )
            return False
        try:
            return self._is_fit(address)
        except UnfitError as error:
            self._cluster.refuse(address, no_answer(error))
            return False


def no_answer(error: UnfitError) -> str:
    """Return why a worker that lacks something is not used."""
    return f"got no answer ({error}), expected one; see `tlsplan doctor` there"


def answers_alike(cluster: Connection, address: str, payload: TaskPayload, task: Any, expected: bytes) -> bool:
    """Whether a worker answers a task as this process does, bit by bit; refused where it does not. Raises as `ask`."""
    cluster.supply(address, payload)
    if cluster.ask(address, worker.answer, payload.digest, task, within_s=10 * connection.PATIENCE_S) != expected:
        cluster.refuse(
            address, "got an answer that differs from this machine's, expected the same bits; give it the same device"
        )
        return False
    return True
