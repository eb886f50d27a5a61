"""How the command line shows progress: bars with time left on a terminal, plain lines otherwise, nothing if quiet.

Everything goes to standard error, so that standard output stays clean for results and `--json`.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable
from types import TracebackType
from typing import TYPE_CHECKING, TextIO

from planner_core.errors import one_line

from .environment import raise_if_interrupted, settle_interrupts

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from planner_core.progress import ProgressEvent

PLAIN_LINE_EVERY_S = 10.0
"""Between the first and the last line of a stage: often enough to see life in a log, rarely enough to read it."""


NOTE_WIDTH = 24
"""Columns for the remark behind a bar: name, bar, count and time take the other 50 of a common terminal."""


class ProgressReporter:
    """Shows `ProgressEvent`s; use as a context manager and pass `reporter.show` to the library.

    `shown` are warnings that were shown before: commands with several reporters hand one set to all of them.
    """

    def __init__(self, *, quiet: bool, stream: TextIO | None = None, shown: set[str] | None = None) -> None:
        self._quiet = quiet
        self._stream = stream if stream is not None else sys.stderr
        self._bars: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._last_line_s: dict[str, float] = {}
        self._finished: set[str] = set()
        self._shown = set() if shown is None else shown
        self._last: list[str] = []

    def __enter__(self) -> ProgressReporter:
        """Open the bars where the stream is a terminal."""
        if not self._quiet and self._stream.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._bars = Progress(
                TextColumn("{task.description:<10}"), BarColumn(bar_width=20), MofNCompleteColumn(),
                TimeRemainingColumn(compact=True, elapsed_when_finished=True),
                TextColumn("{task.fields[note]}", markup=False),
                console=Console(file=self._stream), transient=False,
            )  # fmt: skip
            self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bars, so that whatever is printed next starts on a line of its own; last words follow."""
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
        self.warn(self._last)

    def warn_last(self, warnings: Iterable[str]) -> None:
        """Print warnings when all is over."""
        self._last += warnings

    def warn(self, warnings: Iterable[str]) -> None:
        """Print warnings at once, one line each, and each of them once; `quiet` does not hide them."""
        for line in map(one_line, warnings):
            if line in self._shown:
                continue
            self._shown.add(line)
            if self._bars is not None:
                self._bars.console.print(f"warning: {line}", markup=False, highlight=False, soft_wrap=True)
            else:
                self._print(f"warning: {line}")

    def say(self, line: str) -> None:
        """Print a line beside the progress, as of a part of the work that is done; not if quiet."""
        if self._quiet:
            return
        if self._bars is not None:
            self._bars.console.print(one_line(line), markup=False, highlight=False, soft_wrap=True)
        else:
            self._print(one_line(line))

    def show(self, event: ProgressEvent) -> None:
        """Draw one event; raises KeyboardInterrupt where a Ctrl-C got lost inside a package."""
        if event.settles_interrupts:
            settle_interrupts()
            raise_if_interrupted()  # a process that must end writes no plan, and reports none
            if event.note:
                self.warn([event.note])
        raise_if_interrupted()
        if self._quiet or event.settles_interrupts:
            return
        if self._bars is not None:
            self._show_bar(event)
        else:
            self._show_line(event)

    def _show_bar(self, event: ProgressEvent) -> None:
        assert self._bars is not None
        total = event.total or None
        if event.stage not in self._tasks:
            self._tasks[event.stage] = self._bars.add_task(event.stage, total=total, note="")
        note = one_line(event.note)
        note = note if len(note) <= NOTE_WIDTH else f"{note[: NOTE_WIDTH - 1]}…"
        self._bars.update(self._tasks[event.stage], completed=event.done, total=total, note=note)

    def _show_line(self, event: ProgressEvent) -> None:
        now_s = time.monotonic()
        finished = event.total > 0 and event.done >= event.total
        if finished and event.stage in self._finished:
            return
        due = now_s - self._last_line_s.get(event.stage, -PLAIN_LINE_EVERY_S) >= PLAIN_LINE_EVERY_S
        if not (due or finished):
            return
        if finished:
            self._finished.add(event.stage)
        else:
            self._finished.discard(event.stage)
        self._last_line_s[event.stage] = now_s
        count = f"{event.done} of {event.total}" if event.total else f"{event.done}" if event.done else "..."
        note = f"  {one_line(event.note)}" if event.note else ""
        self._print(f"{event.stage}: {count}{note}")

    def _print(self, line: str) -> None:
        try:
            print(line, file=self._stream, flush=True)
        except BrokenPipeError:  # who read went away (`2>&1 | head`): the work is for the disk, and goes on
            os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
