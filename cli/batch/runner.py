"""Runs the jobs of a batch, some at a time, each in a process of its own: a crash there is one line here."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from planner_core.child_process import why_ended
from planner_core.errors import one_line
from planner_core.operating_system import apart

from .folder import BatchFolder
from .jobs import Job, floor_jobs

_LOOK_S = 0.1
#: A job that gets the signal to end removes what is half-written; then it is killed.
_ENDS_WITHIN_S = 15.0
_TAIL_BYTES = 4096
_PREFIX = "tlsplan: "
_PROGRAM = (sys.executable, "-P", "-m", "tlsplan.batch.child")


@dataclass(frozen=True)
class Ended:
    """A job that ended. message : why it failed; empty where it did not."""

    job: Job
    message: str


class Runner(Protocol):
    """Who runs jobs: this machine, or a cluster."""

    def free(self) -> int:
        """How many more jobs may be begun."""
        ...

    def begin(self, job: Job) -> None:
        """Begin a job."""
        ...

    def ended(self) -> list[Ended]:
        """Jobs that ended since the last call."""
        ...

    def doing(self) -> list[tuple[Job, str]]:
        """Jobs at work, and the messages of each."""
        ...

    def stop(self) -> None:
        """End all jobs; what is half-written goes."""
        ...


class ThisMachine:
    """Jobs as processes of this machine. handle : of the batch's lock, which they inherit."""

    def __init__(self, folder: BatchFolder, handle: int, *, most: int, engine: Sequence[str]) -> None:
        self._folder, self._handle, self._most, self._engine = folder, handle, most, engine
        self._running: dict[Job, subprocess.Popen[bytes]] = {}

    def free(self) -> int:
        """How many more jobs may be begun."""
        return self._most - len(self._running)

    def begin(self, job: Job) -> None:
        """Begin a job's process, out of reach of a Ctrl-C that is meant for the batch."""
        words = job.words(self._folder.plan(job), engine=self._engine)
        with self._folder.log(job).open("wb") as log, self._folder.output(job).open("wb") as output:
            self._running[job] = subprocess.Popen(
                program(*words),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=log,
                **apart(self._handle),
            )

    def ended(self) -> list[Ended]:
        """Jobs that ended since the last call."""
        done = [job for job, process in self._running.items() if process.poll() is not None]
        return [
            Ended(job, failure_of(self._running.pop(job).returncode, last_line(self._folder.log(job)))) for job in done
        ]

    def doing(self) -> list[tuple[Job, str]]:
        """Jobs at work, and the last line of each."""
        return [(job, last_line(self._folder.log(job))) for job in self._running]

    def stop(self) -> None:
        """End all jobs: first politely."""
        end_all(list(self._running.values()))
        self._running.clear()


def end_all(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    """End processes: first politely."""
    for process in processes:
        process.terminate()
    until_s = time.monotonic() + _ENDS_WITHIN_S
    for process in processes:
        try:
            process.wait(max(until_s - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def program(*words: str) -> list[str]:
    """Return the words of a job's process, which ends with this one."""
    return [*_PROGRAM, str(os.getpid()), *words]


def failure_of(code: int, line: str) -> str:
    """Return why a job failed, by its process's exit code and last line; empty where it did not."""
    if code == 0:
        return ""
    if line.startswith(_PREFIX):
        return line.removeprefix(_PREFIX)
    return f"its process {why_ended(code)}; run the same command to try again, with fewer --jobs if memory is short"


def work(
    jobs: Sequence[Job],
    folder: BatchFolder,
    runner: Runner,
    *,
    engine: Sequence[str],
    report: Callable[[Job, str, bool], None],
    look: Callable[[int, int, list[tuple[Job, str]]], None],
) -> list[Job]:
    """Do all jobs that have not been done before, and those that become known on the way; return all that plan.

    Parameters
    ----------
    report
        Hears how each job ended: why it failed, or an empty text; and whether it was done before.
    look
        Hears some times a second how many jobs are done, of how many, and what is going on; raising from it ends all.

    Raises
    ------
    PlanFolderError, OSError
        The disk of the batch's folder is full; jobs that are at work are ended.
    """
    waiting, known, begun_s = list(jobs), [job for job in jobs if not job.finds_floors], dict[Job, float]()
    n_done = 0

    def done(job: Job, message: str, floors: Sequence[tuple[str, str]], *, before: bool) -> None:
        nonlocal n_done
        if job.finds_floors and not message:
            more = floor_jobs(job.site, floors, engine=engine)
            waiting[:0] = more
            known.extend(more)
            if not more:
                message = "it has none of the required storeys; `tlsplan floors` lists them"
        else:
            n_done += 1
        if message or not job.finds_floors:
            report(job, message, before)

    try:
        while waiting or runner.doing():
            while waiting and runner.free() > 0:
                job = waiting.pop(0)
                record = folder.record(job)
                if record is not None and record.state == "planned":
                    done(job, "", record.floors, before=True)
                    continue
                folder.check_space()
                begun_s[job] = time.monotonic()
                runner.begin(job)
            for end in runner.ended():
                floors = () if end.message or not end.job.finds_floors else _floors(folder.output(end.job))
                seconds = time.monotonic() - begun_s[end.job]
                folder.keep(end.job, seconds=seconds, message=end.message, floors=floors)
                folder.output(end.job).unlink(missing_ok=True)
                done(end.job, end.message, floors, before=False)
            look(n_done, n_done + len(waiting) + len(runner.doing()), runner.doing())
            if waiting or runner.doing():
                time.sleep(_LOOK_S)
    finally:
        runner.stop()
    return known


def _floors(output: Path) -> tuple[tuple[str, str], ...]:
    listed = json.loads(output.read_text(encoding="utf-8"))["floors"]
    return tuple((floor["id"], floor["name"]) for floor in listed)


def last_line(log: Path) -> str:
    """Return the last line of a process's messages."""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - _TAIL_BYTES))
        lines = file.read().decode("utf-8", errors="replace").splitlines()
    return next((one_line(line) for line in reversed(lines) if line.strip()), "")
