"""What a reproduced figure is: the paper's finding, our outcome, and the place that both are written to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from planner_core.progress import Progress, ProgressEvent, silent


@dataclass(frozen=True)
class Picture:
    """An image file in the output folder and what it shows, in a sentence."""

    file: str
    shows: str


@dataclass(frozen=True)
class Outcome:
    """What a run found.

    found : sentences with numbers of this run. agrees : whether that is what the paper found; not
    compared: the machine lacks what it takes. numbers : the figures
    behind the sentences, for whoever wants to compare: plain values that JSON can hold.
    """

    found: str
    agrees: Literal["yes", "partly", "no", "not compared"]
    pictures: tuple[Picture, ...]
    numbers: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Bench:
    """Where and how large to run.

    full : the paper's sizes; otherwise sizes that run in minutes on two cores. seed : of everything random. warn : gets
    lines for the user.
    """

    folder: Path
    full: bool = False
    seed: int = 0
    progress: Progress = silent
    warn: Callable[[Iterable[str]], None] = lambda _: None

    def at(self, small: Any, full: Any) -> Any:
        """Return the value for the size of this run."""
        return full if self.full else small

    def tell(self, done: int, total: int, note: str = "") -> None:
        """Report progress of the figure."""
        self.progress(ProgressEvent("reproduce", done, total, note))


@dataclass(frozen=True)
class Figure:
    """A figure of the paper that can be reproduced."""

    name: str
    """What the command line calls it: `fig04`, `eq9`."""
    title: str
    paper_found: str
    """What the paper shows and says, in our words."""
    run: Callable[[Bench], Outcome]
    small_size: str
    """What a run without `--full` is smaller by, in a sentence."""
