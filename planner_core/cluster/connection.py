"""A connection to the workers of a Dask scheduler: sends them jobs and what they lack, and reports what went
wrong.

WHAT FAILS. A worker or scheduler that is gone or silent (`Cluster.is_lost`) is searched for again. One that reports
that it lacks something (`UnfitError`) is reported and not used. Anything else is a bug (`BugError`): reported with its
origin, counted, and the worker gets nothing more of that job; where nobody else is there, this process does the
rest.
"""

from __future__ import annotations

import contextlib
import logging
import re
import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from planner_core.cluster import worker
from planner_core.cluster.payloads import Packer, TaskPayload, squeezed
from planner_core.errors import ClusterError, MissingPackageError, one_line
from planner_core.operating_system import n_usable_cores
from planner_core.progress import Progress, ProgressEvent
from planner_core.spread import AnsweringFileJob, NotWantedError, RemoteJob, Task

LOCAL = "local"
_MOST_LOCAL = 1000
#: Without a scheduler or a worker for so long, this process goes on alone.
PATIENCE_S = 60.0
#: An answer of megabytes from a worker that is there; of a scheduler, who is there.
FETCHES_WITHIN_S = 15.0
_CONNECTS_WITHIN_S = 30.0
_LOOK_S = 0.5
#: What Dask raises of workers and results that are gone while the scheduler is there.
LOST = (OSError, TimeoutError, CancelledError, AsyncCancelledError)
_OF_DASK = ("dask", "distributed", "tornado")


class UnfitError(Exception):
    """A worker can't do its task; the message has the reason."""


class BugError(Exception):
    """Something failed at a worker that nobody foresaw; the message names what, and where."""


class Cluster:
    """Workers of a Dask scheduler that work for this process; a `Executor`. Made by `open_cluster`.

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

    def answers(
        self,
        job: RemoteJob,
        tasks: Sequence[Task],
        *,
        here: Callable[[Any], bytes],
        stage: str,
        progress: Progress,
        answered: Callable[[int, bytes], None] | None = None,
    ) -> list[bytes]:
        """Return the answers to tasks, one or more, in their order; see `planner_core.spread.Executor.answers`.

        Raises
        ------
        ClusterError
            All workers that there are answer otherwise than this process, or are of another version.
        """
        from planner_core.cluster.task_dispatcher import TaskDispatcher

        progress(ProgressEvent(stage, 0, sum(task.size for task in tasks), "cluster"))
        return TaskDispatcher(self, self.payload(job), tasks, here, stage, progress, answered).answers()

    def files(self, job: AnsweringFileJob, tasks: Sequence[Task], folder: Path, **how: Any) -> list[bytes]:
        """Have the files of all tasks in a folder, and return what they answered: `planner_core.spread.Executor.files`.

        Raises as `planner_core.cluster.file_jobs.files_of`.
        """
        from planner_core.cluster.file_jobs import files_of

        return files_of(self, job, tasks, folder, **how)

    # -------------------------------------------------------------------------------------------- workers
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
            self._client = _connected(self._address, timeout_s=5.0)
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


@contextlib.contextmanager
def open_cluster(address: str, *, tell: Callable[[str], None]) -> Iterator[Cluster]:
    """Connect to a scheduler, or start `local` or `local:N` workers on this machine, and end them afterwards.

    Parameters
    ----------
    address
        `tcp://HOST:PORT` of a scheduler that has workers; or local.
    tell
        Hears lines for the user: of workers that are not used.

    Raises
    ------
    MissingPackageError
        Dask is not installed.
    ClusterError
        There is no scheduler at the address, or it has no worker; or as `n_local_workers`.
    """
    try:
        import distributed
    except ImportError as error:
        raise MissingPackageError(
            f"scheduler: got {address}, but Dask is not installed ({error}), expected the package distributed; install "
            "it with `pip install tlsplan[cluster]`"
        ) from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with contextlib.ExitStack() as held:
        n_workers = n_local_workers(address)
        if n_workers:
            local = distributed.LocalCluster(
                n_workers=n_workers, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
            )
            held.callback(local.close, timeout=10)
            address = local.scheduler_address
        cluster = Cluster(address, _connected(address, timeout_s=_CONNECTS_WITHIN_S), tell)
        held.callback(cluster.close)
        until_s = time.monotonic() + _CONNECTS_WITHIN_S
        while not _some_there(cluster):
            if time.monotonic() > until_s:
                raise ClusterError(
                    f"scheduler {address}: got no workers for {_CONNECTS_WITHIN_S:.0f} s, expected one or more; start "
                    f"them with `dask worker {address} --nthreads 1`"
                )
            time.sleep(_LOOK_S)
        yield cluster


def _some_there(cluster: Cluster) -> bool:
    with contextlib.suppress(*LOST):  # a scheduler that went away at once: nobody is there
        return bool(cluster.workers())
    return False


def _connected(address: str, *, timeout_s: float) -> Any:
    from distributed import Client

    try:
        return Client(address, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"scheduler {address}: got no answer ({one_line(str(error))[:200]}), expected a Dask scheduler; start one "
            "with `dask scheduler`, and give its address"
        ) from error
