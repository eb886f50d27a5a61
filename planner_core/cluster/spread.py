"""Deals tasks out to Dask workers, few at a time, and puts their answers in order: the bytes of one process.

CONTROL FLOW. Each worker gets its next task when it gives one back, so a slow one holds nobody up; when none are left,
idle workers get copies of those that are out longest, and the first answer counts. A worker is used once it is of the
same version and, asked the first task, answers what this process finds itself, bit by bit (`Crew`). One that dies loses
its tasks to the others. Where the scheduler is gone it is waited for; where nobody is left for `PATIENCE_S`, this
process does the rest. Answers that are here are kept, whatever happens. Progress is told at each look, some times a
second: what it raises ends the wait, and the tasks that are out are taken back, which ends them at workers.

WHAT FAILS. A worker or scheduler that is gone or silent is looked for again. One that says that it lacks something
(`UnfitError`) is told and not used. Anything else is a bug (`BugError`): told with where it came from, counted, and the
worker asked nothing more of that question; where nobody else is there, this process does the rest.

Sent to a worker: the question, once, by content; a task is a few hundred bytes. Sent back: bytes. At most `_AHEAD`
tasks a worker are out, so that neither side ever holds more than that.
"""

from __future__ import annotations

import contextlib
import logging
import time
from asyncio import CancelledError as AsyncCancelledError
from collections import Counter
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
from planner_core.spread import AskedErrand, NotWantedError, Question, Task

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
#: An answer of megabytes from a worker that is there; of a scheduler, who is there.
_FETCHES_WITHIN_S = 15.0
#: A worker may crash over tasks of its own; one task that fails so often is done here.
MOST_FAILURES = 3
#: What Dask raises of workers and results that are gone while the scheduler is there.
LOST = (OSError, TimeoutError, CancelledError, AsyncCancelledError)
_OF_DASK = ("dask", "distributed", "tornado")


class UnfitError(Exception):
    """A worker can't do what it is asked; the message says why."""


class BugError(Exception):
    """Something failed at a worker that nobody foresaw; the message says what, and where."""


class Cluster:
    """Workers of a Dask scheduler that work for this process; a `Spread`. Made by `open_cluster`.

    has_helped : whether any of them has answered a task. n_bugs : how often something failed that nobody foresaw.
    """

    def __init__(self, address: str, client: Any, tell: Callable[[str], None]) -> None:
        self._address, self._client, self.tell = address, client, tell
        self._packer = Packer()
        self._refused: set[str] = set()
        self._bugs: set[str] = set()
        self.has_helped, self.n_bugs = False, 0

    def key_of(self, value: object) -> str:
        """Return a key that tells a value's contents."""
        return self._packer.parcel(value).digest

    def parcel(self, value: object) -> Parcel:
        """Return a value as it is sent."""
        return self._packer.parcel(value)

    def answers(
        self,
        question: Question,
        tasks: Sequence[Task],
        *,
        here: Callable[[Any], bytes],
        stage: str,
        progress: Progress,
        answered: Callable[[int, bytes], None] | None = None,
    ) -> list[bytes]:
        """Return the answers to tasks, one or more, in their order; see `planner_core.spread.Spread.answers`.

        Raises
        ------
        ClusterError
            All workers that there are answer otherwise than this process, or are of another version.
        """
        progress(ProgressEvent(stage, 0, sum(task.size for task in tasks), "cluster"))
        return _Deal(self, self.parcel(question), tasks, here, stage, progress, answered).answers()

    def files(self, errand: AskedErrand, tasks: Sequence[Task], folder: Path, **how: Any) -> list[bytes]:
        """Have the files of all tasks in a folder, and return what they answered: `planner_core.spread.Spread.files`.

        Raises as `planner_core.cluster.errands.files_of`.
        """
        from planner_core.cluster.errands import files_of

        return files_of(self, errand, tasks, folder, **how)

    # -------------------------------------------------------------------------------------------- workers
    def workers(self) -> set[str]:
        """Addresses of the workers that the scheduler knows; raises what Dask does where it is gone or silent."""
        return set(self._client.sync(self._client.scheduler.identity, callback_timeout=_FETCHES_WITHIN_S)["workers"])

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
        """Return what has to be said at the end."""
        if self.n_bugs == 0:
            return []
        errors = "1 internal error" if self.n_bugs == 1 else f"{self.n_bugs} internal errors"
        return [
            f"workers: {errors}, told above, a bug to report; what failed was done again by others or by this machine, "
            "and nothing is missing"
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
        """Wait no more for what workers were asked: what has begun there ends, too."""
        with contextlib.suppress(Exception):  # of a scheduler that is gone there is nothing to take back
            self._client.cancel(futures)

    def supply(self, address: str, parcel: Parcel) -> None:
        """Send a worker what it lacks of a question; raises as `ask`."""
        lacking, names = self.ask(address, worker.lacks, parcel.digest, list(parcel.arrays))
        for name in names:
            content = self._client.scatter(squeezed(parcel.arrays[name]), workers=[address], hash=False)
            self.ask(address, worker.take_array, name, content)
        if lacking or names:
            self.ask(address, worker.take_question, parcel.digest, parcel.body, list(parcel.arrays))

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

    `LackingError`: it has to be sent the question again. `UnfitError`: the worker lacks something else. `BugError`.
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
        self._spared: set[str] = set()
        """Those at which a bug struck."""
        self._there: set[str] = set()
        self._was_used = self._gave_up = False
        self._askers = ThreadPoolExecutor(_JOIN_AT_ONCE, thread_name_prefix="join")
        self._alone_s = time.monotonic()

    def find(self, *, nothing_done: bool) -> set[str]:
        """Look who is there, and have new ones asked; returns who is there.

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
                self._joining[address] = self._askers.submit(self._asked, address)
                self._joining[address].add_done_callback(lambda _: self.some_done.set())
        for address, fit in [each for each in self._joining.items() if each[1].done()]:
            del self._joining[address]
            try:
                self._silent.discard(address)
                if fit.result() and address in there:
                    self.used.add(address)
                    self._was_used = True
            except (Exception, AsyncCancelledError) as error:  # noqa: BLE001 - told unless Dask may raise it
                if self._cluster.is_lost(error):  # if it still is there, it is asked again
                    self._silent.add(address)
                else:
                    self.spare(address, error)
        is_alone = not self.used and not self._joining and nothing_done and not self._cluster.has_helped
        if there and is_alone and all(map(self._cluster.is_refused, there)):
            raise ClusterError(
                f"cluster: none of {len(there)} workers can be used, for the reasons told, expected one; mend "
                "these, or start workers of the same version of tlsplan and the same kind of device"
            )
        return there

    def spare(self, address: str, error: BaseException) -> None:
        """Ask a worker nothing more here: a bug struck there, or here over it, and is told."""
        self.used.discard(address)
        self._spared.add(address)
        self._note(f"worker {address}", error)

    def give_up(self, error: BaseException) -> None:
        """Use nobody any more: a bug struck here, and is told."""
        self._gave_up = True
        self._note("this machine", error)

    def forget(self) -> None:
        """Use nobody until they are found again."""
        self.used.clear()
        self._there = set()
        self.some_done.wait(_LOOK_S)
        self.some_done.clear()

    def is_gone(self) -> bool:
        """Whether nobody was there for too long, or can do it; told."""
        if self.used or self._joining.keys() - self._silent:
            self._alone_s = time.monotonic()
        if self._gave_up or self._is_no_use():
            why = "no worker can do this"
        elif time.monotonic() - self._alone_s > PATIENCE_S:
            why = f"no worker for {PATIENCE_S:.0f} s"
        else:
            return False
        self._cluster.tell(f"{why}: this machine goes on alone")
        return True

    def _is_no_use(self) -> bool:
        """Whether nobody who is there may be asked; where one was of use and none is a bug's, others may still come."""
        if not self._there or self.used or self._joining or (self._was_used and not self._spared):
            return False
        return all(address in self._spared or self._cluster.is_refused(address) for address in self._there)

    def _note(self, who: str, error: BaseException) -> None:
        is_told = isinstance(error, BugError)
        self._cluster.note_bug(who, str(error) if is_told else worker.bug_of(error, error.__traceback__))

    def close(self) -> None:
        """Ask nobody any more."""
        self._askers.shutdown(wait=False, cancel_futures=True)

    def _asked(self, address: str) -> bool:
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
            self._cluster.refuse(address, _no_answer(error))
            return False


def _no_answer(error: UnfitError) -> str:
    return f"got no answer ({error}), expected one; see `tlsplan doctor` there"


def answers_alike(cluster: Cluster, address: str, parcel: Parcel, task: Any, expected: bytes) -> bool:
    """Whether a worker answers a task as this process does, bit by bit; refused where it does not. Raises as `ask`."""
    cluster.supply(address, parcel)
    if cluster.ask(address, worker.answer, parcel.digest, task, within_s=10 * PATIENCE_S) != expected:
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
        answered: Callable[[int, bytes], None] | None,
    ) -> None:
        self._cluster, self._parcel, self._tasks, self._here = cluster, parcel, tasks, here
        self._stage, self._progress, self._answered = stage, progress, answered
        self._answers: dict[int, bytes] = {}
        first = self._here_too(0)
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
            self._cluster.take_back(list(self._out))  # copies of what is answered, or all where progress raised
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
            except ClusterError:
                raise
            except (Exception, AsyncCancelledError) as error:  # noqa: BLE001 - told unless Dask may raise it
                if not self._cluster.is_lost(error):
                    self._crew.give_up(error)
                self._forget_workers()
            while self._for_here:  # what it raises is this process's own
                self._here_too(self._for_here.pop())
            if self._crew.is_gone():
                self._do_here()
            self._show(f"{len(self._crew.used)} workers")

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

    def _deal(self) -> None:
        load = dict.fromkeys(sorted(self._crew.used), 0)
        for address, _ in self._out.values():
            load[address] = load.get(address, 0) + 1
        for ahead in range(_AHEAD):
            for address in load:
                if address in self._crew.used and load[address] == ahead and self._waiting:
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
        future.add_done_callback(lambda _: self._crew.some_done.set())

    def _collect(self) -> None:
        self._crew.some_done.wait(_LOOK_S)
        self._crew.some_done.clear()
        for future in [each for each in self._out if each.done()]:
            address, number = self._out.pop(future)
            try:
                if future.status == "finished":
                    self._keep(number, future.result(timeout=_FETCHES_WITHIN_S))
                    self._cluster.has_helped = True
                else:
                    self._failed(address, number, future)
                future.release()
            except LOST:  # it was done, and its worker died before it gave the answer away
                self._put_back(number)
                self._crew.used.discard(address)

    def _failed(self, address: str, number: int, future: Any) -> None:
        """Put a task back; what a worker lacks is sent again; what fails again and again is done here."""
        error = fault_of(future) if future.status == "error" else None
        self._put_back(number)
        if isinstance(error, worker.LackingError):
            self._crew.used.discard(address)  # it is looked at anew
            return
        self._failures[number] = self._failures.get(number, 0) + 1
        if isinstance(error, UnfitError):
            self._cluster.refuse(address, _no_answer(error))
            self._crew.used.discard(address)
        elif isinstance(error, BugError):
            self._crew.spare(address, error)
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
        self._crew.forget()

    def _do_here(self) -> None:
        for number in sorted(set(range(len(self._tasks))) - set(self._answers)):
            self._here_too(number)
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
