"""What a genetic run leaves behind, wherever it ran."""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.model import BoolArray, Int64Array
from planner_core.progress import Progress, ProgressEvent

STALE = "no improvement"
EXHAUSTED = "iterations"


@dataclass(frozen=True)
class Trajectory:
    """How the best solution came about.

    best : (N,) bool, its chromosome. history : (iterations + 1, 3) int64: key, covered ticks and active stations of the
    best so far after every iteration, the start included. why_stopped : `STALE` or `EXHAUSTED`.
    """

    best: BoolArray
    history: Int64Array
    why_stopped: str


def note(progress: Progress, iteration: int, facts: Int64Array) -> None:
    """Report an iteration; how many there will be is not known before the last."""
    progress(ProgressEvent("genetic", iteration, 0, f"{int(facts[2])} stations"))
