"""Few candidates first: a plan of them within seconds, and which of the others are worth observing from.

Input as for `planner_core.planning.pool.make_pool`, output what these candidates see, progress, and the candidates to
plan with. These are all of them, and the plan that follows is the same without the first one, but on large sites: there
they are the first few and those near to what the first plan, or the relaxation of its problem, takes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Candidates, Int64Array, Proven, Role, Survey
from planner_core.model.arrays import dots
from planner_core.model.stored_rows import VISIBILITY_VARIABLE, visibility_budget
from planner_core.planning.pool import Pool, make_pool
from planner_core.positions.allowed_positions import AllowedPositions
from planner_core.positions.candidates import is_near
from planner_core.progress import BestSoFar, Progress, ProgressEvent
from planner_core.requirements.demand import KnownObservations
from planner_core.requirements.goals import Goals
from planner_core.requirements.observe_candidates import observe_candidates
from planner_core.select.large import select_by_size
from planner_core.select.large_bound import large_bound
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
#: Sites of more candidates are large, and of more candidates times triangles: observing takes as long among furniture.
#: docs/benchmarks/where-time-goes.md has what is saved there.
_LARGE, _LARGE_AMONG_TRIANGLES = 2000, 1e9
#: Of large sites: how near to what is worth a closer look the grid is taken, in steps of it: the eight around.
_NEAR_STEPS = 1.5
#: Share of a candidate in a solution of the relaxation from which on its surroundings are worth a closer look.
_LEAST_SHARE = 0.1
#: Work of that relaxation, as `Proven.work_limit` counts it.
_PRICE_WORK = 1.0


def observe_few(
    survey: Survey, goals: Goals, engine: ScanEngine, places: AllowedPositions, progress: Progress
) -> KnownObservations | None:
    """Look around from few candidates, far apart, with all special places and prior stations among them.

    None where there are hardly more anyway.
    """
    n_candidates = places.candidates.floor.size
    if n_candidates <= _FEW:
        return None
    special = np.flatnonzero(places.kind > 0)
    most = min(_MOST, n_candidates // _WORTH - special.size)
    if most < 1:
        return None
    rows = np.union1d(far_apart(places.candidates, _APART_M, most=most), special)
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
) -> Int64Array | None:
    """Report stations to `progress` that meet the requirements, as far as the few candidates of `known` see them.

    Nothing is reported where the plan begins with stations of an earlier one.

    Returns
    -------
    Of a large site (K,) rows of candidates that are worth a closer look: those stations, and what the relaxation of the
    same problem takes. None elsewhere, and where the few candidates can't meet the requirements.
    """
    n_candidates, is_first = places.candidates.floor.size, not places.rows_of(Role.KEPT, Role.BEGUN).size
    is_large = n_candidates > _LARGE or n_candidates * survey.scene.n_triangles > _LARGE_AMONG_TRIANGLES
    if not (is_large or is_first):
        return None
    few, all_of_them = places.candidates.take(known.row), np.arange(known.row.size)
    given = np.searchsorted(known.row, places.rows_of(Role.SCANNED, Role.LOCKED))
    none = np.empty(0, dtype=np.int64)
    try:
        pool = make_pool(
            survey, goals, engine, few, given=given, kept=none, linked=True,
            known=KnownObservations(all_of_them, known.observations),
        )  # fmt: skip
    except RequirementError:
        return None  # what few candidates can't meet, all of them may; if they can't either, that is reported then
    if not pool.rows.met.n_entries:
        return None
    found = select_by_size(
        pool.problem,
        replace(selection, work_limit=0.0, time_limit_s=None),
        network=pool.network,
        given=pool.given,
    )
    if found.why_stopped == INTERRUPTED:
        raise KeyboardInterrupt  # there is no plan to keep yet
    stations_m = tuple((x, y, z) for x, y, z in few.position_m[list(found.chosen)].tolist())
    if is_first:
        best = BestSoFar(len(found.chosen), positions_m=stations_m)
        n_steps = known.row.size + 1
        progress(ProgressEvent(STAGE, n_steps, n_steps, f"{len(found.chosen)} stations", best=best))
    return known.row[_worth_a_look(pool, found.chosen)] if is_large else None


def _worth_a_look(pool: Pool, chosen: tuple[int, ...]) -> Int64Array:
    """(K,) rows of the pool: those chosen, and those that a solution of the relaxation takes much of."""
    network = pool.network
    prices = large_bound(
        pool.problem,
        n_stations=len(chosen),
        given=pool.given,
        network=network,
        n_parts=None if network is None else np.unique(network.part[list(chosen)]).size,
        work_limit=_PRICE_WORK,
    )
    return np.union1d(np.array(chosen, dtype=np.int64), np.flatnonzero(prices.share > _LEAST_SHARE))


def as_needed(
    places: AllowedPositions, known: KnownObservations | None, worth_a_look: Int64Array | None
) -> tuple[AllowedPositions, KnownObservations | None, tuple[str, ...]]:
    """Leave out candidates that no plan is likely to need, or that memory would not hold; and a line if so.

    Doorways, middles of rooms, landings, prior stations, what stands in an open door and what is known stay. All
    candidates do where a budget of memory is given: what is beyond it goes to disk.

    Parameters
    ----------
    known
        What the first few see, by which it is known what memory would hold; None: all stay.
    worth_a_look
        (K,) rows as of `tell_first_plan`: others that are not near one of them are left out. None: none is for that.
    """
    n_candidates = places.candidates.floor.size
    if known is None or visibility_budget() is not None:
        return places, known, ()
    stay = np.union1d(np.flatnonzero((places.kind > 0) | _in_doors(places)), known.row)
    rows = np.arange(n_candidates) if worth_a_look is None else np.union1d(stay, _near(places, worth_a_look))
    each = known.observations.rows.seen.n_entries / known.row.size
    most = int(_MOST_ENTRIES / max(each, 1.0))
    if rows.size > most:
        evenly = far_apart(places.candidates.take(rows), _APART_M / 4, most=max(most - stay.size, 1))
        rows = np.union1d(stay, rows[evenly])
        line = (
            f"evenly spread, for what all of them see, {n_candidates * each / 1e6:.0f} million patches, is too much "
            f"for memory; plan floor by floor (--floor), or let them go to disk ({VISIBILITY_VARIABLE}=500MB), for all "
            "of them"
        )
    elif rows.size < n_candidates:
        line = (
            "evenly spread, with all that are near to a station of a first plan or of its relaxation; the lower bound "
            f"is one on these; set {VISIBILITY_VARIABLE}=8GB to plan with all of them"
        )
    else:
        return places, known, ()
    line = f"candidates: {rows.size} of {n_candidates} valid positions are planned with, {line}"
    return places.keeping(rows), KnownObservations(np.searchsorted(rows, known.row), known.observations), (line,)


def _near(places: AllowedPositions, rows: Int64Array) -> Int64Array:
    """(M,) candidates within `_NEAR_STEPS` steps of the grid of some (K,) rows, on the floors of these."""
    at, apart_m = places.candidates, _NEAR_STEPS * places.tripods.grid_step_m
    near = [np.empty(0, dtype=np.int64)]
    for floor in np.unique(at.floor[rows]).tolist():
        here = np.flatnonzero(at.floor == floor)
        there_m = at.position_m[rows[at.floor[rows] == floor]]
        near.append(here[is_near(at.position_m[here], there_m, apart_m)])
    return np.concatenate(near)


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
        order = np.lexsort((dots(away_m, away_m), *cube.T, candidates.floor))
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
