"""A connection to the workers of a Dask scheduler: sends them jobs and what they lack, and reports what went
wrong.

WHAT FAILS. A worker or scheduler that is gone or silent (`Connection.is_lost`) is searched for again. One that reports
that it lacks something (`UnfitError`) is reported and not used. Anything else is a bug (`BugError`): reported with its
origin, counted, and the worker gets nothing more of that job; where nobody else is there, this process does the
rest.
"""

from __future__ import annotations

import contextlib
import re
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from typing import Any

from planner_core.cluster import worker
from planner_core.cluster.payloads import Packer, TaskPayload, squeezed
from planner_core.errors import ClusterError, one_line
from planner_core.executor import NotWantedError
from planner_core.operating_system import n_usable_cores

LOCAL = "local"
_MOST_LOCAL = 1000
#: Without a scheduler or a worker for so long, this process goes on alone.
PATIENCE_S = 60.0
#: An answer of megabytes from a worker that is there; of a scheduler, who is there.
FETCHES_WITHIN_S = 15.0
#: What Dask raises of workers and results that are gone while the scheduler is there.
LOST = (OSError, TimeoutError, CancelledError, AsyncCancelledError)
_OF_DASK = ("dask", "distributed", "tornado")


class UnfitError(Exception):
    """A worker can't do its task; the message has the reason."""


class BugError(Exception):
    """Something failed at a worker that nobody foresaw; the message names what, and where."""


class Connection:
    """A connection of one process to the workers of a Dask scheduler.

    has_helped : whether any of them has answered a task. n_bugs : how often something failed that nobody foresaw.
    """

    def __init__(self, address: str, client: Any, tell: Callable[[str], None]) -> None:
        self._address, self._client, self.tell = address, client, tell
        self._packer = Packer()
        self._refused: set[str] = set()
        self._bugs: set[str] = set()
        self.has_helped, self.n_bugs = False, 0

    def key_of(self, value: object) -> str:
        """Return a key of a value's contents."""
        return self._packer.payload(value).digest

    def payload(self, value: object) -> TaskPayload:
        """Return a value as it is sent."""
        return self._packer.payload(value)

    def workers(self) -> set[str]:
        """Addresses of the workers that the scheduler knows; raises what Dask does where it is gone or silent."""
        return set(self._client.sync(self._client.scheduler.identity, callback_timeout=FETCHES_WITHIN_S)["workers"])

    def refuse(self, address: str, why: str) -> None:
        """Use a worker no more, and tell why."""
        if address not in self._refused:
            self._refused.add(address)
            self.tell(f"worker {address} is not used: {one_line(why)}")

    def is_refused(self, address: str) -> bool:
        """Whether this worker is not used."""
        return address in self._refused

    def note_bug(self, who: str, what: str) -> None:
        """Tell of a bug, each once, and count it. who : worker or machine where it struck."""
        self.n_bugs += 1
        if what not in self._bugs:
            self._bugs.add(what)
            self.tell(one_line(f"{who}: internal error: {what}. This is a bug: please report it; the work goes on"))

    def last_words(self) -> list[str]:
        """Return the message at the end."""
        if self.n_bugs == 0:
            return []
        errors = "1 internal error" if self.n_bugs == 1 else f"{self.n_bugs} internal errors"
        return [
            f"workers: {errors}, reported above (please report them); what failed was done again by others or by this "
            "machine, and nothing is missing"
        ]

    def submit(self, address: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Ask a worker; a future."""
        return self._client.submit(function, *arguments, workers=[address], pure=False, retries=0)

    def ask(self, address: str, function: Callable[..., Any], *arguments: Any, within_s: float | None = None) -> Any:
        """Ask a worker, and return its answer. within_s : `PATIENCE_S` if not given.

        Raises
        ------
        LackingError, UnfitError, BugError
            As `fault_of`.
        Exception
            One of those that `is_lost` knows.
        """
        client = self._client
        future = self.submit(address, function, *arguments)
        try:
            return future.result(timeout=within_s or PATIENCE_S)
        except (Exception, AsyncCancelledError) as error:
            if future.status == "error":
                raise fault_of(future) from error
            if not isinstance(error, LOST) and client.status != "running":
                raise ConnectionError(str(error)) from error
            raise

    def is_lost(self, error: BaseException) -> bool:
        """Whether an error is of a worker, scheduler or connection that is gone or silent; else it is a bug."""
        of = type(error).__module__.partition(".")[0]
        return isinstance(error, (*LOST, worker.LackingError)) or of in _OF_DASK or not self.is_connected

    def take_back(self, futures: Sequence[Any]) -> None:
        """Wait no more for the tasks of workers: what has begun there ends, too."""
        with contextlib.suppress(Exception):  # of a scheduler that is gone there is nothing to take back
            self._client.cancel(futures)

    def supply(self, address: str, payload: TaskPayload) -> None:
        """Send a worker what it lacks of a job; raises as `ask`."""
        lacking, names = self.ask(address, worker.lacks, payload.digest, list(payload.arrays))
        for name in names:
            content = self._client.scatter(squeezed(payload.arrays[name]), workers=[address], hash=False)
            self.ask(address, worker.take_array, name, content)
        if lacking or names:
            self.ask(address, worker.take_job, payload.digest, payload.body, list(payload.arrays))

    def reconnect(self) -> bool:
        """Try to reach the scheduler again; whether it is there."""
        with contextlib.suppress(Exception):  # what is left of a lost connection
            self._client.close(timeout=1)
        try:
            self._client = connected(self._address, timeout_s=5.0)
        except ClusterError:
            return False
        return True

    def close(self) -> None:
        """End the connection."""
        with contextlib.suppress(Exception):  # the work is done; one that is gone needs no closing
            self._client.close(timeout=5)

    @property
    def is_connected(self) -> bool:
        """Whether the scheduler is there."""
        return bool(self._client.status == "running")


def fault_of(future: Any) -> Exception:
    """Return why a task ended in an error at its worker.

    `LackingError`: it has to be sent the job again. `UnfitError`: the worker lacks something else. `BugError`.
    ConnectionError: it was lost.
    """
    error = future.exception(timeout=PATIENCE_S)
    if isinstance(error, worker.LackingError):
        return error
    of_dask = type(error).__module__.partition(".")[0] in _OF_DASK
    if of_dask or isinstance(error, (CancelledError, AsyncCancelledError, NotWantedError)):
        return ConnectionError(str(error))
    if isinstance(error, worker.FAULTS):
        return UnfitError(str(error) or type(error).__name__)
    return BugError(worker.bug_of(error, future.traceback(timeout=PATIENCE_S)))


def n_local_workers(address: str) -> int:
    """Return how many workers of this machine an address asks for; 0: those of a scheduler.

    Raises
    ------
    ClusterError
        It is neither `tcp://HOST:PORT`, or another protocol's, nor `local` or `local:N`.
    """
    if address == LOCAL:
        return n_usable_cores()
    name, _, count = address.partition(":")
    if name == LOCAL and count.isascii() and count.isdigit() and 1 <= int(count) <= _MOST_LOCAL:
        return int(count)
    if not re.fullmatch(r"[a-z]+://\S+", address):
        raise ClusterError(
            f"scheduler: got {address}, expected tcp://HOST:PORT, {LOCAL}, or {LOCAL}:N with 1 to {_MOST_LOCAL} workers"
        )
    return 0


def connected(address: str, *, timeout_s: float) -> Any:
    """Return a Dask client of a scheduler; raises `ClusterError` where none answers."""
    from distributed import Client

    try:
        return Client(address, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"scheduler {address}: got no answer ({one_line(str(error))[:200]}), expected a Dask scheduler; start one "
            "with `dask scheduler`, and give its address"
        ) from error
