"""Deals positions out to Dask workers, few at a time, and puts what they see in order: the bytes of one process.

CONTROL FLOW. Each worker gets its next batch when it gives one back, so a slow one holds nobody up; when none are left,
idle workers get copies of those that are out longest, and the first answer counts. A worker is used once it is of the
same version and, asked about the first few positions, answers what this process finds itself, bit by bit. One that
dies loses its batches to the others. Where the scheduler is gone it is waited for; where nobody is left for
`PATIENCE_S`, this process does the rest. Answers that are here are kept, whatever happens.

Sent to a worker: the scene and the question, once, by content; a batch is a few hundred bytes. Sent back: compressed
rows. At most `_AHEAD` batches a worker are out, so that neither side ever holds more than that.
"""

from __future__ import annotations

import contextlib
import logging
import time
from asyncio import CancelledError as AsyncCancelledError
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import asdict, replace
from threading import Event
from typing import Any

from planner_core.cluster import worker
from planner_core.cluster.parcels import Packer, Parcel, pack_looked, squeezed, unpack_looked
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import ClusterError, MissingPackageError, one_line
from planner_core.model import FloatArray, Survey
from planner_core.progress import Progress, ProgressEvent
from planner_core.requirements.goals import Goals
from planner_core.requirements.look_around import Looked, in_a_row, look_around_here

LOCAL = "local"
#: Without a scheduler or a worker for so long, this process goes on alone.
PATIENCE_S = 60.0
_CONNECTS_WITHIN_S = 30.0
#: Positions of a batch: enough that a batch outweighs its overhead, few enough that the last ones are soon done.
_BATCH, _PROBE = 16, 4
#: Batches of a worker: one at work, one waiting there.
_AHEAD = 2
#: Workers that are asked at the same time whether they are fit: others scan meanwhile.
_JOIN_AT_ONCE = 16
#: Of the same batch, at the end.
_MOST_COPIES = 2
_LOOK_S = 0.5
#: An answer of megabytes from a worker that is there.
_FETCHES_WITHIN_S = 15.0
#: A worker may crash over batches of its own; one batch that fails so often is done here.
_MOST_FAILURES = 3
#: What Dask raises of workers and results that are gone while the scheduler is there.
_LOST = (OSError, TimeoutError, CancelledError, AsyncCancelledError)


class Cluster:
    """Workers of a Dask scheduler that look around for this process; a `Spread`. Made by `open_cluster`."""

    def __init__(self, address: str, client: Any, tell: Callable[[str], None]) -> None:
        self._address, self._client, self.tell = address, client, tell
        self._packer = Packer()
        self._refused: set[str] = set()

    def look_around(
        self,
        survey: Survey,
        engine: ScanEngine,
        positions_m: FloatArray,
        goals: Goals,
        *,
        notes_needed: bool,
        progress: Progress,
    ) -> Looked:
        """Look from each of positions (N, 3), as `look_around_here`.

        Raises
        ------
        ClusterError
            All workers that there are scan otherwise than this process, or are of another version.
        """
        scene = self._packer.parcel((survey.scene, replace(survey.patches, counted=None)))
        question = worker.Question(survey, goals, notes_needed, engine.name, scene.digest)
        parcel = self._packer.parcel(question)

        def here(batch: FloatArray) -> Looked:
            return look_around_here(
                survey, engine, batch, goals, notes_needed=notes_needed, progress=lambda event: None
            )

        progress(ProgressEvent("scan", 0, len(positions_m), "cluster"))
        deal = _Deal(self, parcel, positions_m, here, progress)
        answers = deal.answers()
        n_patches = survey.patches.n_patches
        n_stacked = n_patches if goals.plain else n_patches * len(goals.qualities)
        return in_a_row([unpack_looked(answers[first], n_patches, n_stacked) for first in sorted(answers)])

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


class _Deal:
    """One question, dealt out in batches: by their first position, `waiting`, `out` at workers, or answered."""

    def __init__(
        self,
        cluster: Cluster,
        parcel: Parcel,
        positions_m: FloatArray,
        here: Callable[[FloatArray], Looked],
        progress: Progress,
    ) -> None:
        self._cluster, self._parcel, self._positions, self._here = cluster, parcel, positions_m, here
        self._progress = progress
        probe = min(_PROBE, len(positions_m))
        self._size = {0: probe} | {
            first: min(_BATCH, len(positions_m) - first) for first in range(probe, len(positions_m), _BATCH)
        }
        self._answers = {0: pack_looked(here(positions_m[:probe]))}
        self._waiting = [first for first in reversed(self._size) if first != 0]
        self._out: dict[Any, tuple[str, int]] = {}
        self._used: set[str] = set()
        self._failures: dict[int, int] = {}
        self._alone_s = time.monotonic()
        self._some_done = Event()
        self._joining: dict[str, Future[bool]] = {}
        self._askers = ThreadPoolExecutor(_JOIN_AT_ONCE, thread_name_prefix="join")

    def answers(self) -> dict[int, bytes]:
        """All answers, by the first position of each batch."""
        try:
            self._work()
        finally:
            self._askers.shutdown(wait=False, cancel_futures=True)
            for future in self._out:  # copies of what is answered
                with contextlib.suppress(Exception):
                    future.cancel()
        return self._answers

    def _work(self) -> None:
        while len(self._answers) < len(self._size):
            try:
                if not self._cluster.is_connected and not self._cluster.reconnect():
                    self._forget_workers()
                else:
                    self._find_workers()
                    self._deal()
                    self._collect()
            except (Exception, AsyncCancelledError) as error:
                if isinstance(error, ClusterError):
                    raise
                self._forget_workers()
            if self._used or self._joining:
                self._alone_s = time.monotonic()
            elif time.monotonic() - self._alone_s > PATIENCE_S:
                self._cluster.tell(f"no worker for {PATIENCE_S:.0f} s: this machine goes on alone")
                self._do_here()
            n_done = sum(self._size[first] for first in self._answers)
            self._progress(ProgressEvent("scan", n_done, len(self._positions), f"{len(self._used)} workers"))

    def _find_workers(self) -> None:
        there = self._cluster.workers()
        self._used &= there
        for address in self._joining.keys() - there:  # its thread waits for an answer until the connection is closed
            del self._joining[address]
        for future, (address, first) in list(self._out.items()):
            if address not in there:
                del self._out[future]
                self._put_back(first)
        for address in sorted(there - self._used - self._joining.keys()):
            if not self._cluster.is_refused(address):
                self._joining[address] = self._askers.submit(self._is_fit, address)
                self._joining[address].add_done_callback(lambda _: self._some_done.set())
        for address, fit in [each for each in self._joining.items() if each[1].done()]:
            del self._joining[address]
            with contextlib.suppress(*_LOST, worker.LackingError):  # if it still is there, it is asked again
                if fit.result() and address in there:
                    self._used.add(address)
        is_alone = not self._used and not self._joining and len(self._answers) == 1
        if there and is_alone and all(map(self._cluster.is_refused, there)):
            raise ClusterError(
                f"cluster: none of {len(there)} workers scans as this machine does, expected one that does; start "
                "workers of the same version of tlsplan and the same kind of device"
            )

    def _is_fit(self, address: str) -> bool:
        """Whether a worker is of this version and scans the first positions as this process does, bit by bit."""
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
        self._cluster.supply(address, self._parcel)
        try:
            future = self._cluster.submit(address, worker.look, self._parcel.digest, self._positions[: self._size[0]])
            looked = future.result(timeout=10 * PATIENCE_S)
        except (ImportError, RuntimeError) as error:  # DeviceError among them
            self._cluster.refuse(address, f"got no scan of it ({error}), expected one; see `tlsplan doctor` there")
            return False
        if looked != self._answers[0]:
            self._cluster.refuse(
                address, "got a scan that differs from this machine's, expected the same bits; give it the same device"
            )
            return False
        return True

    def _deal(self) -> None:
        load = dict.fromkeys(sorted(self._used), 0)
        copies: dict[int, int] = {}
        for address, first in self._out.values():
            load[address] = load.get(address, 0) + 1
            copies[first] = copies.get(first, 0) + 1
        for ahead in range(_AHEAD):
            for address in load:
                if address in self._used and load[address] == ahead and self._waiting:
                    self._send(address, self._waiting.pop())
                    load[address] += 1
        if not self._waiting:  # what is out longest comes first
            for address in (each for each in load if load[each] == 0):
                late = [
                    first
                    for at, first in self._out.values()
                    if at != address and first not in self._answers and copies[first] < _MOST_COPIES
                ]
                if late:
                    copies[late[0]] += 1
                    self._send(address, late[0])

    def _send(self, address: str, first: int) -> None:
        batch = self._positions[first : first + self._size[first]]
        future = self._cluster.submit(address, worker.look, self._parcel.digest, batch)
        self._out[future] = address, first
        future.add_done_callback(lambda _: self._some_done.set())

    def _collect(self) -> None:
        self._some_done.wait(_LOOK_S)
        self._some_done.clear()
        for future in [each for each in self._out if each.done()]:
            address, first = self._out.pop(future)
            try:
                if future.status == "finished":
                    self._answers.setdefault(first, future.result(timeout=_FETCHES_WITHIN_S))
                else:
                    self._failed(address, first, future)
                future.release()
            except _LOST:  # it was done, and its worker died before it gave the answer away
                self._put_back(first)
                self._used.discard(address)

    def _failed(self, address: str, first: int, future: Any) -> None:
        """Put a batch back; what a worker lacks is sent again; what fails again and again is done here."""
        error = future.exception(timeout=PATIENCE_S) if future.status == "error" else None
        self._put_back(first)
        if isinstance(error, worker.LackingError):
            self._used.discard(address)  # it is looked at anew
            return
        self._failures[first] = self._failures.get(first, 0) + 1
        if isinstance(error, RuntimeError | MemoryError):
            self._cluster.refuse(address, f"got no scan of it ({error}), expected one; see `tlsplan doctor` there")
            self._used.discard(address)
        if self._failures[first] >= _MOST_FAILURES and first in self._waiting:
            self._waiting.remove(first)
            self._answers[first] = pack_looked(self._here(self._positions[first : first + self._size[first]]))

    def _put_back(self, first: int) -> None:
        is_out = any(other == first for _, other in self._out.values())
        if first not in self._answers and first not in self._waiting and not is_out:
            self._waiting.append(first)

    def _forget_workers(self) -> None:
        firsts = [first for _, first in self._out.values()]
        self._out.clear()
        self._used.clear()
        for first in firsts:
            self._put_back(first)
        time.sleep(_LOOK_S)

    def _do_here(self) -> None:
        for first in sorted(set(self._size) - set(self._answers)):
            self._answers[first] = pack_looked(self._here(self._positions[first : first + self._size[first]]))
            n_done = sum(self._size[each] for each in self._answers)
            self._progress(ProgressEvent("scan", n_done, len(self._positions), "alone"))


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
