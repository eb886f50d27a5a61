"""Work that other processes do for this one, to the bit: jobs, their tasks, and who answers them meanwhile.

A job goes to each of them once, its tasks one by one; an answer is bytes, and a file job leaves files, too.
`planner_core.cluster` has who answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from planner_core.progress import Progress, silent

Kept = Callable[[str, Callable[[], Any]], Any]
"""What a process keeps by a key of its contents, such as an engine: made where it is not there."""


class NotWantedError(Exception):
    """Nobody waits any more for what is being done."""


class RemoteJob(Protocol):
    """Work for other processes. Its tasks are answered alone, in any order: the same bytes by whoever is fit."""

    def answer(self, task: Any, kept: Kept, progress: Progress = silent) -> bytes:
        """Do one task. progress : raises `NotWantedError` once nobody waits for it."""
        ...


@dataclass(frozen=True)
class Place:
    """Where a file job is done. made : the folder that is fetched. file : where a file is that was sent, by its hash.

    is_wanted : whether to go on. tell : a line on how far it is.
    """

    folder: Path
    made: Path
    file: Callable[[str], Path]
    is_wanted: Callable[[], bool]
    tell: Callable[[str], None]
    kept: Kept


@dataclass(frozen=True)
class Outcome:
    """message : why it failed; empty: it did not. is_of_worker : another worker may do it. answer : besides files.

    is_bug : it failed in a way that nobody foresaw; message : where.
    """

    message: str = ""
    is_of_worker: bool = False
    is_bug: bool = False
    answer: bytes = b""


class FileJob(Protocol):
    """A job whose tasks leave files."""

    def do(self, task: Any, place: Place) -> Outcome:
        """Do one task.

        What is raised means: of disk, memory, device or packages, that the worker can't; any other `PlannerError`, that
        nobody can; anything else, a bug.
        """
        ...


class AnsweringFileJob(FileJob, RemoteJob, Protocol):
    """A file job that answers, too: by whose first answer it is known who does it as this process would."""


@dataclass(frozen=True)
class Task:
    """A part of a job. of : what `answer` and `do` get. size : steps of progress. name : for messages."""

    of: Any
    size: int
    name: str = ""


class Executor(Protocol):
    """Other processes that answer for this one."""

    def key_of(self, value: object) -> str:
        """Return a key of a value's contents."""
        ...

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
        """Return the answers in the order of the tasks.

        here : does one of them in this process; the first always. progress : called twice a second, or after seconds
        where somebody is silent; what it raises ends the wait, and the work of others. answered : hears of each answer,
        by the number of its task, once it is here: what is left of them then.
        """
        ...

    def files(
        self,
        job: AnsweringFileJob,
        tasks: Sequence[Task],
        folder: Path,
        *,
        kept: Kept,
        here: Callable[[Any], bytes],
        stage: str,
        progress: Progress,
    ) -> list[bytes]:
        """Have the files of all tasks in a folder, and return what `do` answered, in their order.

        kept : what this process has, to answer the first task. here : does one in this process, files and answer.
        """
        ...


_executor: ContextVar[Executor | None] = ContextVar("executor", default=None)


def current_executor() -> Executor | None:
    """Return who works for this process at present; None: nobody."""
    return _executor.get()


@contextmanager
def spread_over(executor: Executor | None) -> Iterator[None]:
    """Let others work, too, for what is planned meanwhile; None: nobody."""
    token = _executor.set(executor)
    try:
        yield
    finally:
        _executor.reset(token)


def parts_of_row(n: int, *, first: int, each: int) -> list[tuple[int, int]]:
    """Return where parts of n things begin and end: a small first one, which everybody gets, and the others."""
    begins = [0, *range(min(first, n), n, each)]
    return [(begin, end) for begin, end in zip(begins, [*begins[1:], n], strict=True) if end > begin]
