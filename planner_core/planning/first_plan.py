"""Few candidates first: a plan of them within seconds, and how much memory all would take.

Input as for `planner_core.planning.pool.make_pool`, output what these candidates see, progress, and candidates that
memory holds. The plan that follows is the same without the first one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Candidates, Int64Array, Proven, Role, Survey
from planner_core.model.stored_rows import VISIBILITY_VARIABLE, visibility_budget
from planner_core.planning.pool import make_pool
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.progress import BestSoFar, Progress, ProgressEvent
from planner_core.requirements.demand import KnownObservations
from planner_core.requirements.goals import Goals
from planner_core.requirements.observe_candidates import observe_candidates
from planner_core.select.large import select_by_size
from planner_core.select.proven import INTERRUPTED

STAGE = "first plan"
#: Crews stand further apart than this, and rooms are larger.
_APART_M = 1.25
#: Of large sites, candidates that are observed from in seconds; others are further apart.
_MOST = 400
#: Patches that all candidates see, each by itself: about 40 bytes of memory each where it is highest.
_MOST_ENTRIES = 60_000_000
#: From the middle of a door, with a leaf ajar, too.
_IN_DOOR_M = 0.6
#: A pool that is not much larger, or of so few, is observed as soon.
_WORTH, _FEW = 3, 100


def observe_few(
    survey: Survey, goals: Goals, engine: ScanEngine, places: AllowedPositions, progress: Progress
) -> KnownObservations | None:
    """Look around from few candidates, far apart, with all special places and prior stations among them.

    None where there are hardly more anyway.
    """
    n_candidates = places.candidates.floor.size
    if n_candidates <= _FEW:
        return None
    rows = np.union1d(far_apart(places.candidates, _APART_M, most=_MOST), np.flatnonzero(places.kind > 0))
    if _WORTH * rows.size > n_candidates:
        return None
    at_m = places.candidates.position_m[rows]
    return KnownObservations(rows, observe_candidates(survey, engine, at_m, goals, progress=_as_one_stage(progress)))


def tell_first_plan(
    survey: Survey,
    goals: Goals,
    engine: ScanEngine,
    places: AllowedPositions,
    known: KnownObservations,
    selection: Proven,
    progress: Progress,
) -> None:
    """Report stations to `progress` that meet the requirements, as far as the few candidates of `known` see them.

    Nothing is reported where the plan begins with stations of an earlier one.
    """
    if places.rows_of(Role.KEPT, Role.BEGUN).size:
        return
    few, all_of_them = places.candidates.take(known.row), np.arange(known.row.size)
    given = np.searchsorted(known.row, places.rows_of(Role.SCANNED, Role.LOCKED))
    none = np.empty(0, dtype=np.int64)
    try:
        known = KnownObservations(all_of_them, known.observations)
        pool = make_pool(survey, goals, engine, few, given=given, kept=none, linked=True, known=known)
    except RequirementError:
        return  # what few candidates can't meet, all of them may; if they can't either, that is reported then
    if not pool.rows.met.n_entries:
        return
    found = select_by_size(
        pool.problem,
        replace(selection, work_limit=0.0, time_limit_s=None),
        network=pool.network,
        given=pool.given,
    )
    if found.why_stopped == INTERRUPTED:
        raise KeyboardInterrupt  # there is no plan to keep yet
    stations_m = tuple((x, y, z) for x, y, z in few.position_m[list(found.chosen)].tolist())
    best = BestSoFar(len(found.chosen), positions_m=stations_m)
    n_steps = known.row.size + 1
    progress(ProgressEvent(STAGE, n_steps, n_steps, f"{len(found.chosen)} stations", best=best))


def as_memory_holds(
    places: AllowedPositions, known: KnownObservations | None
) -> tuple[AllowedPositions, KnownObservations | None, tuple[str, ...]]:
    """Leave out candidates that memory would not hold, evenly, by what the first few see; and a line if so.

    Doorways, middles of rooms, landings, prior stations, what stands in an open door and what is known stay. All do
    where a budget of memory is given: what is beyond it goes to disk.
    """
    n_candidates = places.candidates.floor.size
    if known is None or visibility_budget() is not None:
        return places, known, ()
    each = known.observations.rows.seen.n_entries / known.row.size
    most = int(_MOST_ENTRIES / max(each, 1.0))
    if n_candidates <= most:
        return places, known, ()
    stay = np.union1d(np.flatnonzero((places.kind > 0) | _in_doors(places)), known.row)
    rows = np.union1d(stay, far_apart(places.candidates, _APART_M / 4, most=max(most - stay.size, 1)))
    line = (
        f"candidates: {rows.size} of {n_candidates} valid positions are planned with, evenly spread, for what all of "
        f"them see, {n_candidates * each / 1e6:.0f} million patches, is too much for memory; plan floor by floor "
        f"(--floor), or let them go to disk ({VISIBILITY_VARIABLE}=500MB), for all of them"
    )
    return places.keeping(rows), KnownObservations(np.searchsorted(rows, known.row), known.observations), (line,)


def _in_doors(places: AllowedPositions) -> BoolArray:
    """(N,) bool: candidates around the middle of an open door, through which rooms are linked."""
    at = places.candidates
    near = np.zeros(at.floor.size, dtype=np.bool_)
    for door in places.tripods.survey.scene.open_doors:
        off_m = at.position_m - np.array([*door.box_m[:, :2].mean(axis=0), door.box_m[0, 2]])
        near |= (np.hypot(off_m[:, 0], off_m[:, 1]) <= _IN_DOOR_M) & (off_m[:, 2] > 0.0) & (off_m[:, 2] < door.height_m)
    return near


def far_apart(candidates: Candidates, apart_m: float, *, most: int) -> Int64Array:
    """(K,) rows, sorted: of each floor and cube the candidate nearest the middle. At most so many, or one a floor."""
    from_m = candidates.position_m - candidates.position_m.min(axis=0)
    most = max(most, np.unique(candidates.floor).size)
    while True:
        cube = np.floor(from_m / apart_m)
        away_m = from_m - apart_m * (cube + 0.5)
        order = np.lexsort(((away_m * away_m).sum(axis=1), *cube.T, candidates.floor))
        of_cube = np.column_stack([candidates.floor, cube])[order]
        first = np.ones(order.size, dtype=np.bool_)
        first[1:] = (of_cube[1:] != of_cube[:-1]).any(axis=1)
        if np.count_nonzero(first) <= most:
            return np.sort(order[first])
        apart_m *= 1.25


def _as_one_stage(progress: Progress) -> Progress:
    """Progress of looking around, under this stage's name; of what is quick, nothing."""

    def passed_on(event: ProgressEvent) -> None:
        if event.stage == "scan":
            progress(ProgressEvent(STAGE, event.done, event.total + 1))

    return passed_on
