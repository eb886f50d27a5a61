"""What a reproduced figure is: the paper's finding, our outcome, and the place that both are written to."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

from planner_core.progress import Progress, ProgressEvent, silent

#: Whether a figure bears the paper out. `not comparable`: this run is smaller than the paper's in what decides it, the
#: columns of a scan. `not tested`: what the paper compares is not at hand, such as a GPU.
Verdict: TypeAlias = Literal["yes", "partly", "no", "not comparable", "not tested"]


def by_share(holds: Iterable[bool]) -> Verdict:
    """`yes` where all findings hold, `partly` where some do, `no` where none does."""
    found = list(holds)
    return "yes" if all(found) else "partly" if any(found) else "no"


def at_native_columns(numbers: Mapping[str, Any], verdict: Callable[[], Verdict]) -> Verdict:
    """Ask for the verdict only where all scans of a run had their scanner's columns.

    Thinned scans reach patches by few returns, which costs more than not to reach them: what F2 rewards changes sign.
    """
    columns = numbers.get("columns", {})
    native = columns and all(one["used"] == one["native"] for one in columns.values())
    return verdict() if native else "not comparable"


@dataclass(frozen=True)
class Picture:
    """An image file in the output folder and what it shows, in a sentence."""

    file: str
    shows: str


@dataclass(frozen=True)
class Outcome:
    """What a run found.

    found : sentences with numbers of this run. agrees : whether that is what the paper found. numbers : the figures
    behind the sentences, which alone decide the verdict: plain values that JSON can hold.
    """

    found: str
    agrees: Verdict
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
    """What the paper shows and states, in our words."""
    run: Callable[[Bench], Outcome]
    small_size: str
    """What a run without `--full` is smaller by, in a sentence."""
    verdict: Callable[[Mapping[str, Any]], Verdict] | None = None
    """The verdict that a run's `numbers` lead to; None where a module judges otherwise."""
    revision: int = 1
    """Raised whenever a module measures something else, so that `--resume` runs the figure again."""

    def fingerprint(self, *, full: bool, seed: int) -> str:
        """What decides the numbers of a run besides the library: equal fingerprints need no second run."""
        settings = [self.name, self.revision, self.small_size, full, seed]
        return hashlib.sha256(json.dumps(settings).encode()).hexdigest()[:16]
