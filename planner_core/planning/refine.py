"""Joint refinement: stations leave the grid. Places around all of them are scanned, and the set is chosen anew.

Input a `Pool` and a chosen set that meets the requirements; output a pool with the places taken from off the grid, and
a set that is never worse: as many stations or fewer, and of as many one that covers no less.

Every round scans places on circles around each station and at other heights, adds them to ALL candidates, looks for one
station less among them (`planner_core.select.proven`), and exchanges one station after the other for what covers more
(`planner_core.select.polish`). What is required stays what the grid can achieve, so that before and after compare.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Candidates, Proven
from planner_core.planning.pool import Pool, extended, narrowed
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.positions.candidates import places_nearby
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.requirements.demand import rows_from
from planner_core.select.large import select_by_size
from planner_core.select.polish import polish
from planner_core.select.proven import INTERRUPTED

#: Circles around a station, and steps up and down, as parts of the grid's steps; finer in the second round.
_CIRCLES = ((0.35, 0.7), (0.15, 0.3))
_RISES = (0.5, 0.25)
#: Share of the selection's work that each round may do.
WORK_SHARE = 0.1


@dataclass(frozen=True)
class Refined:
    """pool : the candidates of before, in their order, and after them those of `chosen` that are off the grid.

    interrupted : the search was cut short.
    """

    pool: Pool
    chosen: tuple[int, ...]
    interrupted: bool = False


def refine(
    pool: Pool,
    chosen: tuple[int, ...],
    places: AllowedPositions,
    engine: ScanEngine,
    selection: Proven,
    *,
    progress: Progress = silent,
) -> Refined:
    """Look for better places off the grid.

    Parameters
    ----------
    chosen
        Rows of the pool that meet the requirements, and are connected where a network is required.
    places
        Where the site lets stations stand.
    selection
        `work_limit` is how much work each round may do; `time_limit_s` is for all rounds, and their scans, together.
    progress
        A KeyboardInterrupt that it raises ends the search, not the call.
    """
    n_first, began_s, interrupted = pool.n_candidates, time.monotonic(), False
    for number, (circles, rise) in enumerate(zip(_CIRCLES, _RISES, strict=True)):
        left = _left(selection, began_s)
        if left.time_limit_s == 0.0:
            break
        try:
            progress(ProgressEvent("refine", number, len(_CIRCLES), f"{len(chosen)} stations"))
            more = _around(pool, chosen, places, circles, rise, progress)
            if not more.floor.size:
                continue
            at_m = more.position_m
            observed = [rows_from(pool.survey, engine, at_m, pool.demand, progress=progress)]
            # Which forgets what was observed: links take memory.
            wide = extended(pool, more, observed.pop(), engine, progress=progress)
            best, interrupted = _better(wide, chosen, left, progress)
            pool, chosen = _without_unused(wide, best, n_first)
        except KeyboardInterrupt:
            interrupted = True
        if interrupted:
            break
    if not interrupted:
        progress(ProgressEvent("refine", len(_CIRCLES), len(_CIRCLES), f"{len(chosen)} stations"))
    return Refined(pool=pool, chosen=chosen, interrupted=interrupted)


def _left(selection: Proven, began_s: float) -> Proven:
    """Settings with as much time as is left, where it is limited."""
    if selection.time_limit_s is None:
        return selection
    return replace(selection, time_limit_s=max(0.0, selection.time_limit_s - (time.monotonic() - began_s)))


def _around(
    pool: Pool,
    chosen: tuple[int, ...],
    places: AllowedPositions,
    circles: tuple[float, ...],
    rise: float,
    progress: Progress,
) -> Candidates:
    """Places around the chosen stations that may move, where a station may stand; `circles` and `rise` in steps."""
    movable = np.array([c for c in chosen if c not in pool.given], dtype=np.int64)
    rise_m = rise * places.tripods.heights.step_m
    around = places_nearby(
        places.tripods,
        pool.take(movable),
        radii_m=tuple(share * places.tripods.grid_step_m for share in circles),
        rises_m=(rise_m, -rise_m),
        progress=progress,
    )
    return around.take(places.allows(around))


def _better(wide: Pool, chosen: tuple[int, ...], selection: Proven, progress: Progress) -> tuple[tuple[int, ...], bool]:
    """A set of fewer stations, or else of as many that cover more; and whether the search for it was interrupted."""
    found = select_by_size(
        wide.problem,
        selection,
        network=wide.network,
        given=wide.given,
        start=chosen,
        progress=wide.placing(progress, bounds=False),
    )
    best = found.chosen if len(found.chosen) < len(chosen) else chosen
    if found.why_stopped == INTERRUPTED:
        return best, True
    return polish(wide.problem, best, network=wide.network, given=wide.given), False


def _without_unused(wide: Pool, chosen: tuple[int, ...], n_first: int) -> tuple[Pool, tuple[int, ...]]:
    """Drop places off the grid that are not chosen; also return the rows of those that are."""
    off_grid = sorted(c for c in chosen if c >= n_first)
    rows = np.array([*range(n_first), *off_grid], dtype=np.int64)
    place = {int(row): new for new, row in enumerate(rows)}
    return narrowed(wide, rows), tuple(place[c] for c in chosen)
