"""An executor on the workers of a Dask scheduler, of this machine or others: tasks and files go to them.

Input an address, output a `Cluster`, a `planner_core.executor.Executor`. Dask is imported when one is opened.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from planner_core.cluster.connection import LOST, Connection, connected, n_local_workers
from planner_core.cluster.file_jobs import files_of
from planner_core.cluster.task_dispatcher import TaskDispatcher
from planner_core.errors import ClusterError, MissingPackageError
from planner_core.executor import AnsweringFileJob, RemoteJob, Task
from planner_core.progress import Progress, ProgressEvent

_CONNECTS_WITHIN_S = 30.0
_LOOK_S = 0.5


class Cluster(Connection):
    """Workers of a Dask scheduler that work for this process; an `Executor`. Made by `open_cluster`."""

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
        """Return the answers to tasks, one or more, in their order; see `planner_core.executor.Executor.answers`.

        Raises
        ------
        ClusterError
            All workers that there are answer otherwise than this process, or are of another version.
        """
        progress(ProgressEvent(stage, 0, sum(task.size for task in tasks), "cluster"))
        return TaskDispatcher(self, self.payload(job), tasks, here, stage, progress, answered).answers()

    def files(self, job: AnsweringFileJob, tasks: Sequence[Task], folder: Path, **how: Any) -> list[bytes]:
        """Have the files of all tasks in a folder, and return what they answered; see `planner_core.executor.Executor`.

        Raises as `planner_core.cluster.file_jobs.files_of`.
        """
        return files_of(self, job, tasks, folder, **how)


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
        cluster = Cluster(address, connected(address, timeout_s=_CONNECTS_WITHIN_S), tell)
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
