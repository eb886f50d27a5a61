"""Deals tasks out to Dask workers, few at a time, and puts their answers in order: the bytes of one process.

CONTROL FLOW. Each worker gets its next task when it gives one back, so a slow one holds nobody up; when none are left,
idle workers get copies of those that are out longest, and the first answer counts. A worker is used once it is of the
same version and, asked the first task, answers what this process finds itself, bit by bit (`Crew`). One that dies loses
its tasks to the others. Where the scheduler is gone it is waited for; where nobody is left for `PATIENCE_S`, this
process does the rest. Answers that are here are kept, whatever happens.

Sent to a worker: the question, once, by content; a task is a few hundred bytes. Sent back: bytes. At most `_AHEAD`
tasks a worker are out, so that neither side ever holds more than that.
"""

from __future__ import annotations

import contextlib
import logging
import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from threading import Event
from typing import Any

from planner_core.cluster import worker
from planner_core.cluster.parcels import Packer, Parcel, squeezed
from planner_core.errors import ClusterError, MissingPackageError, one_line
from planner_core.progress import Progress, ProgressEvent
from planner_core.spread import AskedErrand, Question, Task

LOCAL = "local"
#: Without a scheduler or a worker for so long, this process goes on alone.
PATIENCE_S = 60.0
_CONNECTS_WITHIN_S = 30.0
#: Tasks of a worker: one at work, one waiting there.
_AHEAD = 2
#: Workers that are asked at the same time whether they are fit: others work meanwhile.
_JOIN_AT_ONCE = 16
#: Of the same task, at the end.
MOST_COPIES = 2
_LOOK_S = 0.5
#: An answer of megabytes from a worker that is there.
_FETCHES_WITHIN_S = 15.0
#: A worker may crash over tasks of its own; one task that fails so often is done here.
MOST_FAILURES = 3
#: What Dask raises of workers and results that are gone while the scheduler is there.
LOST = (OSError, TimeoutError, CancelledError, AsyncCancelledError)


class Cluster:
    """Workers of a Dask scheduler that work for this process; a `Spread`. Made by `open_cluster`."""

    def __init__(self, address: str, client: Any, tell: Callable[[str], None]) -> None:
        self._address, self._client, self.tell = address, client, tell
        self._packer = Packer()
        self._refused: set[str] = set()

    def key_of(self, value: object) -> str:
        """Return a key that tells a value's contents."""
        return self._packer.parcel(value).digest

    def parcel(self, value: object) -> Parcel:
        """Return a value as it is sent."""
        return self._packer.parcel(value)

    def answers(
        self, question: Question, tasks: Sequence[Task], *, here: Callable[[Any], bytes], stage: str, progress: Progress
    ) -> list[bytes]:
        """Return the answers to tasks, one or more, in their order.

        Raises
        ------
        ClusterError
            All workers that there are answer otherwise than this process, or are of another version.
        """
        progress(ProgressEvent(stage, 0, sum(task.size for task in tasks), "cluster"))
        return _Deal(self, self.parcel(question), tasks, here, stage, progress).answers()

    def files(self, errand: AskedErrand, tasks: Sequence[Task], folder: Path, **how: Any) -> list[bytes]:
        """Have the files of all tasks in a folder, and return what they answered: `planner_core.spread.Spread.files`.

        Raises as `planner_core.cluster.errands.files_of`.
        """
        from planner_core.cluster.errands import files_of

        return files_of(self, errand, tasks, folder, **how)

    # -------------------------------------------------------------------------------------------- workers
    def workers(self) -> set[str]:
        """Addresses of the workers that the scheduler knows."""
        return set(self._client.scheduler_info(n_workers=-1)["workers"])

    def refuse(self, address: str, why: str) -> None:
        """Use a worker no more, and tell why."""
        if address not in self._refused:
            self._refused.add(address)
            self.tell(f"worker {address} is not used: {one_line(why)}")

    def is_refused(self, address: str) -> bool:
        """Whether this worker is not used."""
        return address in self._refused

    def submit(self, address: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Ask a worker; a future."""
        return self._client.submit(function, *arguments, workers=[address], pure=False, retries=0)

    def supply(self, address: str, parcel: Parcel) -> None:
        """Send a worker what it lacks of a question."""
        lacking, names = self.submit(address, worker.lacks, parcel.digest, list(parcel.arrays)).result(
            timeout=PATIENCE_S
        )
        for name in names:
            content = self._client.scatter(squeezed(parcel.arrays[name]), workers=[address], hash=False)
            self.submit(address, worker.take_array, name, content).result(timeout=PATIENCE_S)
        if lacking or names:
            told = self.submit(address, worker.take_question, parcel.digest, parcel.body, list(parcel.arrays))
            told.result(timeout=PATIENCE_S)

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


class Crew:
    """Workers that are there and, asked once, were found fit. is_fit : asks one, and refuses it where it is not."""

    def __init__(self, cluster: Cluster, is_fit: Callable[[str], bool]) -> None:
        self._cluster, self._is_fit = cluster, is_fit
        self.used: set[str] = set()
        self.some_done = Event()
        """Set where somebody has answered, or may be dealt to."""
        self._joining: dict[str, Future[bool]] = {}
        self._silent: set[str] = set()
        """Those that did not answer in time: they are asked again, and count for nobody until they do."""
        self._askers = ThreadPoolExecutor(_JOIN_AT_ONCE, thread_name_prefix="join")
        self._alone_s = time.monotonic()

    def find(self, *, nothing_done: bool) -> set[str]:
        """Look who is there, and have new ones asked; returns who is there.

        Raises
        ------
        ClusterError
            Nobody who is there is fit, and nothing was done yet.
        """
        there = self._cluster.workers()
        self.used &= there
        for address in self._joining.keys() - there:  # its thread waits for an answer until the connection is closed
            del self._joining[address]
        for address in sorted(there - self.used - self._joining.keys()):
            if not self._cluster.is_refused(address):
                self._joining[address] = self._askers.submit(self._asked, address)
                self._joining[address].add_done_callback(lambda _: self.some_done.set())
        for address, fit in [each for each in self._joining.items() if each[1].done()]:
            del self._joining[address]
            try:
                self._silent.discard(address)
                if fit.result() and address in there:
                    self.used.add(address)
            except (Exception, AsyncCancelledError):  # noqa: BLE001 - if it still is there, it is asked again
                self._silent.add(address)
        is_alone = not self.used and not self._joining and nothing_done
        if there and is_alone and all(map(self._cluster.is_refused, there)):
            raise ClusterError(
                f"cluster: none of {len(there)} workers can be used, for the reasons told, expected one; mend "
                "these, or start workers of the same version of tlsplan and the same kind of device"
            )
        return there

    def forget(self) -> None:
        """Use nobody until they are found again."""
        self.used.clear()
        self.some_done.wait(_LOOK_S)
        self.some_done.clear()

    def is_gone(self) -> bool:
        """Whether nobody was there for too long."""
        if self.used or self._joining.keys() - self._silent:
            self._alone_s = time.monotonic()
        return time.monotonic() - self._alone_s > PATIENCE_S

    def close(self) -> None:
        """Ask nobody any more."""
        self._askers.shutdown(wait=False, cancel_futures=True)

    def _asked(self, address: str) -> bool:
        """Whether a worker is of this version, and fit."""
        own = asdict(worker.identity())
        try:
            found = self._cluster.submit(address, worker.greet).result(timeout=PATIENCE_S)
        except (ImportError, AttributeError) as error:
            self._cluster.refuse(address, f"got no tlsplan that it understands ({error}), expected {own['version']}")
            return False
        if found != own:
            name = next(name for name in own if found.get(name) != own[name])
            self._cluster.refuse(
                address, f"got {name} {found.get(name)}, expected {own[name]}; install the same tlsplan there"
            )
            return False
        return self._is_fit(address)


def answers_alike(cluster: Cluster, address: str, parcel: Parcel, task: Any, expected: bytes) -> bool:
    """Whether a worker answers a task as this process does, bit by bit; refused where it does not."""
    cluster.supply(address, parcel)
    try:
        found = cluster.submit(address, worker.answer, parcel.digest, task).result(timeout=10 * PATIENCE_S)
    except (ImportError, RuntimeError) as error:  # DeviceError among them
        cluster.refuse(address, f"got no answer ({error}), expected one; see `tlsplan doctor` there")
        return False
    if found != expected:
        cluster.refuse(
            address, "got an answer that differs from this machine's, expected the same bits; give it the same device"
        )
        return False
    return True


class _Deal:
    """One question, dealt out: tasks by their numbers, `waiting`, `out` at workers, or answered."""

    def __init__(
        self,
        cluster: Cluster,
        parcel: Parcel,
        tasks: Sequence[Task],
        here: Callable[[Any], bytes],
        stage: str,
        progress: Progress,
    ) -> None:
        self._cluster, self._parcel, self._tasks, self._here = cluster, parcel, tasks, here
        self._stage, self._progress = stage, progress
        first = here(tasks[0].of)
        self._answers = {0: first}
        self._waiting = list(range(len(tasks) - 1, 0, -1))
        self._out: dict[Any, tuple[str, int]] = {}
        self._failures: dict[int, int] = {}
        self._for_here: list[int] = []
        self._crew = Crew(cluster, lambda address: answers_alike(cluster, address, parcel, tasks[0].of, first))

    def answers(self) -> list[bytes]:
        """All answers, in the order of the tasks."""
        try:
            self._work()
        finally:
            self._crew.close()
            for future in self._out:  # copies of what is answered
                with contextlib.suppress(Exception):
                    future.cancel()
        return [self._answers[number] for number in range(len(self._tasks))]

    def _work(self) -> None:
        while len(self._answers) < len(self._tasks):
            try:
                if not self._cluster.is_connected and not self._cluster.reconnect():
                    self._forget_workers()
                else:
                    there = self._crew.find(nothing_done=len(self._answers) == 1)
                    for future, (address, number) in list(self._out.items()):
                        if address not in there:
                            del self._out[future]
                            self._put_back(number)
                    self._deal()
                    self._collect()
            except (Exception, AsyncCancelledError) as error:
                if isinstance(error, ClusterError):
                    raise
                self._forget_workers()
            while self._for_here:  # what it raises is this process's own
                number = self._for_here.pop()
                self._answers[number] = self._here(self._tasks[number].of)
            if self._crew.is_gone():
                self._cluster.tell(f"no worker for {PATIENCE_S:.0f} s: this machine goes on alone")
                self._do_here()
            self._show(f"{len(self._crew.used)} workers")

    def _show(self, note: str) -> None:
        n_done = sum(self._tasks[number].size for number in self._answers)
        self._progress(ProgressEvent(self._stage, n_done, sum(task.size for task in self._tasks), note))

    def _deal(self) -> None:
        load = dict.fromkeys(sorted(self._crew.used), 0)
        copies: dict[int, int] = {}
        for address, number in self._out.values():
            load[address] = load.get(address, 0) + 1
            copies[number] = copies.get(number, 0) + 1
        for ahead in range(_AHEAD):
            for address in load:
                if address in self._crew.used and load[address] == ahead and self._waiting:
                    self._send(address, self._waiting.pop())
                    load[address] += 1
        if not self._waiting:  # what is out longest comes first
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
        future.add_done_callback(lambda _: self._crew.some_done.set())

    def _collect(self) -> None:
        self._crew.some_done.wait(_LOOK_S)
        self._crew.some_done.clear()
        for future in [each for each in self._out if each.done()]:
            address, number = self._out.pop(future)
            try:
                if future.status == "finished":
                    self._answers.setdefault(number, future.result(timeout=_FETCHES_WITHIN_S))
                else:
                    self._failed(address, number, future)
                future.release()
            except LOST:  # it was done, and its worker died before it gave the answer away
                self._put_back(number)
                self._crew.used.discard(address)

    def _failed(self, address: str, number: int, future: Any) -> None:
        """Put a task back; what a worker lacks is sent again; what fails again and again is done here."""
        error = future.exception(timeout=PATIENCE_S) if future.status == "error" else None
        self._put_back(number)
        if isinstance(error, worker.LackingError):
            self._crew.used.discard(address)  # it is looked at anew
            return
        self._failures[number] = self._failures.get(number, 0) + 1
        if isinstance(error, RuntimeError | MemoryError | OSError):
            self._cluster.refuse(address, f"got no answer ({error}), expected one; see `tlsplan doctor` there")
            self._crew.used.discard(address)
        if self._failures[number] >= MOST_FAILURES and number in self._waiting:
            self._waiting.remove(number)
            self._for_here.append(number)

    def _put_back(self, number: int) -> None:
        is_out = any(other == number for _, other in self._out.values())
        if number not in self._answers and number not in self._waiting and not is_out:
            self._waiting.append(number)

    def _forget_workers(self) -> None:
        numbers = [number for _, number in self._out.values()]
        self._out.clear()
        for number in numbers:
            self._put_back(number)
        self._crew.forget()

    def _do_here(self) -> None:
        for number in sorted(set(range(len(self._tasks))) - set(self._answers)):
            self._answers[number] = self._here(self._tasks[number].of)
            self._show("alone")


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
        There is no scheduler at the address, or it has no worker.
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
        if address == LOCAL or address.startswith(f"{LOCAL}:"):
            from planner_core.operating_system import n_usable_cores

            count = address.partition(":")[2]
            if count and not (count.isdigit() and 1 <= int(count) <= 1000):
                raise ClusterError(f"scheduler: got {address}, expected a number of workers; e.g. local:4")
            local = distributed.LocalCluster(
                n_workers=int(count) if count else n_usable_cores(), threads_per_worker=1, dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )  # fmt: skip
            held.callback(local.close, timeout=10)
            address = local.scheduler_address
        cluster = Cluster(address, _connected(address, timeout_s=_CONNECTS_WITHIN_S), tell)
        held.callback(cluster.close)
        until_s = time.monotonic() + _CONNECTS_WITHIN_S
        while not cluster.workers():
            if time.monotonic() > until_s:
                raise ClusterError(
                    f"scheduler {address}: got no workers for {_CONNECTS_WITHIN_S:.0f} s, expected one or more; start "
                    f"them with `dask worker {address} --nthreads 1`"
                )
            time.sleep(_LOOK_S)
        yield cluster


def _connected(address: str, *, timeout_s: float) -> Any:
    from distributed import Client

    try:
        return Client(address, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"scheduler {address}: got no answer ({one_line(str(error))[:200]}), expected a Dask scheduler; start one "
            "with `dask scheduler`, and give its address"
        ) from error
