"""How long work reports itself: a callback that gets one `ProgressEvent` at a time.

The library calls it often; whoever shows it decides how often to draw. To cancel, raise from the callback
(`KeyboardInterrupt` does so by itself): stages leave nothing half-written behind.
"""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class ProgressEvent:
    """`done` of `total` steps of `stage` are finished; `total` 0 means: not known. `note` is a short remark."""

    stage: str
    done: int
    total: int
    note: str = ""


Progress = Callable[[ProgressEvent], None]


def silent(event: ProgressEvent) -> None:
    """Ignore the event: the default of every stage."""
