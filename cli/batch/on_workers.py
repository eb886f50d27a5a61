"""Jobs of a batch as file jobs of Dask workers: the same command there, in a folder laid out as the files lie here.

What is sent: the files that a job is planned from, by content, each once to a worker. What comes back: the plan folder.
No folder has to be shared. A worker is used once it is of the same version, with the same libraries, and scans a small
room as this machine does. Where all are gone for a minute, this machine does the rest.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from planner_core.errors import OutputExistsError, PlanFolderError, is_of_full_disk
from planner_core.executor import Outcome, Place
from planner_core.operating_system import own_session

from ..exit_codes import FULL_DISK
from ..inputs import opened_cluster
from .folder import BatchFolder
from .jobs import Job, digest_of, files_of
from .runner import Ended, Runner, ThisMachine, end_all, failure_of, last_line, program

if TYPE_CHECKING:
    from planner_core.cluster.executor import Cluster
    from planner_core.cluster.file_jobs import Order

    from ..progress import ProgressReporter

#: Stands in words for the folder that a worker lays files out in, as for the root of this machine's.
_ROOT = "//tlsplan-root/"
_LOOK_S = 0.1
#: Exit codes of a machine that lacks something.
_LACKS = (6, FULL_DISK)


@dataclass(frozen=True)
class Command:
    """A command of a worker; a job of one task. files : where they lie below the root, and their hashes.

    folder : that it writes, and at : that it is run in, below the root.
    """

    words: tuple[str, ...]
    files: tuple[tuple[str, str], ...]
    folder: str
    at: str

    def do(self, task: Any, place: Place) -> Outcome:
        """Run it; its files, output and messages are in the folder that is fetched."""
        from planner_core.cluster.worker_files import linked

        root, log = place.folder / "root", place.made / "log"
        for name, digest in self.files:
            linked(place.file(digest), root / name)
        (root / self.at).mkdir(parents=True, exist_ok=True)
        words = [word.replace(_ROOT, f"{root.as_posix()}/") for word in self.words]
        with log.open("wb") as messages, (place.made / "out").open("wb") as output:
            process = subprocess.Popen(
                program(*words), cwd=root / self.at, stdin=subprocess.DEVNULL, stdout=output, stderr=messages,
                **own_session(),
            )  # fmt: skip
            try:
                while process.poll() is None and place.is_wanted():
                    place.tell(last_line(log).replace(str(root), ""))
                    time.sleep(_LOOK_S)
            finally:
                end_all([process] if process.poll() is None else [])
        message = failure_of(process.returncode, last_line(log)).replace(str(root), "")
        if not message and (root / self.folder).is_dir():
            (root / self.folder).replace(place.made / "plan")
        return Outcome(message, is_of_worker=process.returncode in _LACKS)


class OnWorkers:
    """Jobs that workers do. most : at the same time; None: one per worker. here : does them where workers are gone."""

    def __init__(
        self,
        here: ThisMachine,
        folder: BatchFolder,
        cluster: Cluster,
        is_fit: Callable[[str], bool],
        *,
        most: int | None,
        engine: Sequence[str],
    ) -> None:
        from planner_core.cluster.file_jobs import FileJobDispatcher

        self._here, self._folder, self._cluster, self._engine = here, folder, cluster, engine
        self._dispatcher = FileJobDispatcher(cluster, is_fit, most=most)
        self._alone: list[Job] | None = None
        self._refused: list[Ended] = []

    def free(self) -> int:
        """How many more jobs may be begun."""
        if self._alone is not None:
            return self._here.free() - len(self._alone)
        return self._dispatcher.free()

    def begin(self, job: Job) -> None:
        """Give a job to a worker."""
        from planner_core.plan_folder.folder import check_output

        if self._alone is not None:
            self._alone.append(job)
            return
        try:
            if not job.finds_floors:  # the worker has another folder
                check_output(self._folder.plan(job), overwrite=True)
            self._dispatcher.give(self._order(job))
        except (OutputExistsError, PlanFolderError) as error:
            self._refused.append(Ended(job, str(error)))

    def ended(self) -> list[Ended]:
        """Jobs that ended since the last call; the plans of those that did not fail are in place."""
        ended, self._refused = self._refused, []
        if self._alone is None:
            ended += [self._kept(order, outcome.message) for order, outcome in self._dispatcher.done()]
            left = self._dispatcher.left_alone()
            if left is not None:
                self._alone = [_job_of(order) for order in left]
            return ended
        while self._alone and self._here.free() > 0:
            self._here.begin(self._alone.pop(0))
        return ended + self._here.ended()

    def doing(self) -> list[tuple[Job, str]]:
        """Jobs at work, and the messages of each."""
        given = [(_job_of(order), note) for order, note in self._dispatcher.orders().items()]
        return [*given, *((job, "") for job in self._alone or ()), *((each.job, "") for each in self._refused),
                *self._here.doing()]  # fmt: skip

    def stop(self) -> None:
        """End all jobs; what is half-fetched goes."""
        self._dispatcher.stop()
        self._here.stop()
        shutil.rmtree(self._folder.fetched_folder, ignore_errors=True)

    def _order(self, job: Job) -> Order:
        from planner_core.cluster.file_jobs import Order

        folder = self._folder.plan(job)
        files = {_below_root(file): (file, digest_of(file)) for file in files_of(job.site)}
        paths = {str(path) for path in (folder, *(file for file, _ in files.values())) if path.is_absolute()}
        known = re.compile("|".join(map(re.escape, sorted(paths, key=len, reverse=True))) or r"(?!)")
        command = Command(
            tuple(
                known.sub(lambda found: _ROOT + _below_root(Path(found[0])), word)
                for word in job.words(folder, engine=self._engine)
            ),
            tuple((name, digest) for name, (_, digest) in files.items() if digest),
            _below_root(folder),
            _below_root(Path.cwd()),
        )
        sent = {digest: file for file, digest in files.values() if digest}
        return Order(job, self._cluster.payload(command), None, sent, self._folder.fetched(job))

    def _kept(self, order: Order, message: str) -> Ended:
        """Put what was fetched in its places."""
        from planner_core.plan_folder.folder import staged_plan_folder

        job, made = _job_of(order), order.made
        for name, target in (("log", self._folder.log(job)), ("out", self._folder.output(job))):
            if (made / name).is_file():
                (made / name).replace(target)
        if not message and not job.finds_floors:
            try:
                with staged_plan_folder(self._folder.plan(job), overwrite=True) as staging:
                    for path in sorted((made / "plan").iterdir()):
                        path.rename(staging / path.name)
            except (OutputExistsError, PlanFolderError) as error:  # it was reviewed meanwhile
                if is_of_full_disk(error):
                    raise
                message = str(error)
        shutil.rmtree(made, ignore_errors=True)
        return Ended(job, message)


@contextlib.contextmanager
def opened_runner(
    here: ThisMachine,
    folder: BatchFolder,
    scheduler: str | None,
    *,
    most: int | None,
    engine: tuple[str, str | None],
    reporter: ProgressReporter,
) -> Iterator[Runner]:
    """Give who runs jobs: this machine, or the workers of a scheduler; raises as `open_cluster`."""
    with opened_cluster(scheduler, reporter) as cluster:
        if cluster is None:
            yield here
            return
        words = [f"--engine={engine[0]}", *([] if engine[1] is None else [f"--device={engine[1]}"])]
        yield OnWorkers(here, folder, cluster, fit_for_jobs(cluster, *engine), most=most, engine=words)


def fit_for_jobs(cluster: Cluster, engine: str, device: str | None) -> Callable[[str], bool]:
    """Give what asks a worker whether it scans a small room as this machine does."""
    import numpy as np

    import scenes_synthetic
    from planner_core.cluster.worker_pool import answers_alike
    from planner_core.coverage.survey import make_survey
    from planner_core.engine.open_engine import open_engine
    from planner_core.model import PlanSettings
    from planner_core.requirements.goals import goals_of
    from planner_core.requirements.observe_candidates import ObservationJob
    from planner_core.scanner import DEFAULT_SCANNER
    from planner_core.scanner.load_scanner import load_scanner

    settings = PlanSettings(scanner=load_scanner(DEFAULT_SCANNER), max_patch_area_m2=0.5)
    survey = make_survey(scenes_synthetic.build("two-rooms").scene, settings)
    opened = open_engine(survey.scene, survey.patches, engine=engine, device=device)
    goals = goals_of(survey, settings.requirements)
    job = ObservationJob(survey, goals, True, opened.name, cluster.key_of((survey.scene, survey.patches)))
    low, high = survey.scene.vertices_m.min(axis=0), survey.scene.vertices_m.max(axis=0)
    at_m = low + (high - low) * np.array([[0.3, 0.4, 0.5], [0.7, 0.6, 0.5]])
    payload, expected = cluster.payload(job), job.answer(at_m, lambda key, make: opened)
    return lambda address: answers_alike(cluster, address, payload, at_m, expected)


def _job_of(order: Order) -> Job:
    assert isinstance(order.key, Job)
    return order.key


def _below_root(path: Path) -> str:
    whole = PurePath(os.path.abspath(path))  # noqa: PTH100 - links stay: names are those of the command
    return whole.relative_to(whole.anchor).as_posix()
