"""The folder of a batch: plans, what became of each job, and whose turn it is.

==================  ===================================================================================================
`plans/<job>/`      a plan folder, whole or not there
`jobs/<job>.json`   how the job ended (`JobRecord`), whole or not there
`jobs/<job>.log`    messages of its process; of the last try
`jobs/.fetched/`    what comes from workers, until it is whole
`index.html` ...    the summary
`.batch.lock`       locked (`flock`) by the batch that is at work, and by its jobs while they live
==================  ===================================================================================================
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from planner_core.documents import Document
from planner_core.errors import OutputExistsError, PlanFolderError
from planner_core.operating_system import sync, take_lock
from planner_core.plan_folder.atomic import staged_file

from .jobs import Job

LOCK = ".batch.lock"
#: With less than this no job is begun: plan folders have tens of megabytes.
LEAST_FREE_BYTES = 50_000_000


class JobRecord(Document):
    """How a job ended."""

    name: str
    key: str
    """Hash of all that it depends on."""
    state: Literal["planned", "failed"]
    message: str = ""
    """Why it failed."""
    seconds: float
    plan_sha256: str = ""
    """Of its plan.json: one that was changed, or is gone, is planned again."""
    floors: tuple[tuple[str, str], ...] = ()
    """Ids and names of the storeys that it found."""


class BatchFolder:
    """The files of a batch."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def plan(self, job: Job) -> Path:
        """Return where the job's plan folder is."""
        return self.root / "plans" / job.name

    def log(self, job: Job) -> Path:
        """Return where the job's process writes its messages."""
        return self._beside(job, "log")

    def fetched(self, job: Job) -> Path:
        """Return where what the job's worker made comes to."""
        return self.fetched_folder / self._beside(job, "made").name

    @property
    def fetched_folder(self) -> Path:
        """Where what comes from workers waits until it is whole."""
        return self.root / "jobs" / ".fetched"

    def output(self, job: Job) -> Path:
        """Return where the job's process prints its result."""
        return self._beside(job, "out")

    @contextlib.contextmanager
    def turn(self) -> Iterator[int]:
        """Take the lock while this batch is at work, and yield its handle.

        Raises
        ------
        OutputExistsError
            Another batch is at work here, or there is something that no batch wrote.
        """
        lock = self.root / LOCK
        if self.root.is_dir() and any(self.root.iterdir()) and not lock.exists():
            raise OutputExistsError(
                f"{self.root}: exists and is no folder of a batch, expected one or a free name; give another folder"
            )
        (self.root / "jobs").mkdir(parents=True, exist_ok=True)
        handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            try:
                take_lock(handle, wait=False)
            except BlockingIOError:
                raise OutputExistsError(
                    f"{self.root}: another batch is at work in it, expected none; wait for it or give another folder"
                ) from None
            except OSError:  # a file system without locks
                pass
            shutil.rmtree(self.fetched_folder, ignore_errors=True)  # of one that was killed
            yield handle
        finally:
            os.close(handle)

    def record(self, job: Job) -> JobRecord | None:
        """Return how the job ended; None where it has not, where it asks something else now, or its plan is gone."""
        try:
            record = JobRecord.model_validate_json(self._beside(job, "json").read_bytes())
        except (OSError, ValidationError):
            return None
        if record.key != job.key:
            return None
        if record.state == "planned" and not job.finds_floors and self._plan_sha256(job) != record.plan_sha256:
            return None
        return record

    def keep(
        self, job: Job, *, seconds: float, message: str = "", floors: tuple[tuple[str, str], ...] = ()
    ) -> JobRecord:
        """Write down how the job ended: message : why it failed.

        Raises
        ------
        OSError
            It can't be written; the one before stays.
        """
        record = JobRecord(
            name=job.name,
            key=job.key,
            state="failed" if message else "planned",
            message=message,
            seconds=round(seconds, 1),
            plan_sha256="" if message or job.finds_floors else self._plan_sha256(job),
            floors=floors,
        )
        with staged_file(self._beside(job, "json")) as staging:
            staging.write_text(record.model_dump_json(indent=1) + "\n", encoding="utf-8")
            sync(staging)
        sync(self.root / "jobs")
        return record

    def check_space(self) -> None:
        """Refuse to begin a job that the disk would not hold.

        Raises
        ------
        PlanFolderError
            It has too little left.
        """
        free = shutil.disk_usage(self.root).free
        if free < LEAST_FREE_BYTES:
            raise PlanFolderError(
                f"{self.root}: its disk has {free / 1e6:.0f} MB left, expected {LEAST_FREE_BYTES / 1e6:.0f} MB for a "
                "plan; what is planned is kept; free some and run the same command"
            ) from OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.root))

    def _plan_sha256(self, job: Job) -> str:
        try:
            with (self.plan(job) / "plan.json").open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            return ""

    def _beside(self, job: Job, ending: str) -> Path:
        return self.root / "jobs" / f"{job.name}{'.floors' if job.finds_floors else ''}.{ending}"
