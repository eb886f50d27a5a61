"""How long work reports itself: a callback that gets one `ProgressEvent` at a time.

The library calls it often; whoever shows it decides how often to draw. To cancel, raise from the callback
(`KeyboardInterrupt` does so by itself): stages leave nothing half-written behind. Searches that have a result by then
end with that instead, and say so by an event that `settles_interrupts`.
"""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class BestSoFar:
    """The best that a search has found while it goes on.

    lower_bound : no plan on these candidates has fewer stations; None: not known yet. chosen : candidates by number,
    whichever the search numbers. positions_m : of the stations, local frame; empty: the sender knows numbers only.
    fraction : of the achievable area that is covered; None: not counted.
    """

    n_stations: int
    lower_bound: int | None = None
    chosen: tuple[int, ...] = ()
    positions_m: tuple[tuple[float, float, float], ...] = ()
    fraction: float | None = None


@dataclass(frozen=True)
class ProgressEvent:
    """`done` of `total` steps of `stage` are finished; `total` 0 means: not known. `note` is a short remark.

    settles_interrupts : a search is over, and so is every interrupt until now: where there was one, `note` is what
    became of it. best : what a search has so far, where it reports that.
    """

    stage: str
    done: int
    total: int
    note: str = ""
    settles_interrupts: bool = False
    best: BestSoFar | None = None


Progress = Callable[[ProgressEvent], None]


def silent(event: ProgressEvent) -> None:
    """Ignore the event: the default of every stage."""
