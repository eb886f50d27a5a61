"""Work that other processes do for this one, to the bit: questions, their tasks, and who answers them meanwhile.

A question goes to each of them once, its tasks one by one; an answer is bytes. `planner_core.cluster` has who answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Protocol

from planner_core.progress import Progress

Kept = Callable[[str, Callable[[], Any]], Any]
"""What a process keeps by a key that tells its contents, such as an engine: made where it is not there."""


class Question(Protocol):
    """What others are asked. Its tasks are answered alone, in any order: the same bytes by whoever is fit."""

    def answer(self, task: Any, kept: Kept) -> bytes:
        """Do one task."""
        ...


@dataclass(frozen=True)
class Task:
    """A part of a question. of : what `answer` gets. size : steps of progress."""

    of: Any
    size: int


class Spread(Protocol):
    """Other processes that answer for this one."""

    def key_of(self, value: object) -> str:
        """Return a key that tells a value's contents."""
        ...

    def answers(
        self, question: Question, tasks: Sequence[Task], *, here: Callable[[Any], bytes], stage: str, progress: Progress
    ) -> list[bytes]:
        """Return the answers in the order of the tasks. here : does one of them in this process; the first always."""
        ...


_spread: ContextVar[Spread | None] = ContextVar("spread", default=None)


def who_answers() -> Spread | None:
    """Return who works for this process at present; None: nobody."""
    return _spread.get()


@contextmanager
def spread_over(spread: Spread | None) -> Iterator[None]:
    """Let others work, too, for what is planned meanwhile; None: nobody."""
    token = _spread.set(spread)
    try:
        yield
    finally:
        _spread.reset(token)


def parts_of_row(n: int, *, first: int, each: int) -> list[tuple[int, int]]:
    """Return where parts of n things begin and end: a small first one, which everybody is asked, and the others."""
    begins = [0, *range(min(first, n), n, each)]
    return [(begin, end) for begin, end in zip(begins, [*begins[1:], n], strict=True) if end > begin]
