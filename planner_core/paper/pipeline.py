"""The method paper's pipeline: improve starting positions by spatial search, select by a genetic algorithm, repair.

`planner_core.planning` calls the three steps where `method` is `Paper`. Local frame, metres.

    starts --search by F2--> improved --genetic selection--> chosen --overlap repair--> stations

References
----------
López et al. 2023, sections 3.4 to 3.6 and Tables 1 to 3; docs/method/paper.md gives the defaults and their reasons.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner_core.engine.open_engine import device_of
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import Candidates, FloatArray, Int64Array, Paper, Survey
from planner_core.paper.genetic import select_genetic
from planner_core.paper.initialisation import sample_at_random
from planner_core.paper.overlap_repair import repair_overlap
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search import search
from planner_core.paper.search.improve import best_apart, one_per_cell
from planner_core.paper.search.station_fitness import StationFitness
from planner_core.positions.admissibility import RefusalTally, Tripods
from planner_core.positions.candidates import N_HALVINGS, candidates_of, find_candidates
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.problem import CoverProblem

#: Beams of a scan beyond which a search takes days: seconds a position, and hundreds of positions a start.
MAX_SEARCH_BEAMS = 4_000_000


def find_pool(tripods: Tripods, paper: Paper, *, seed: int = 0, progress: Progress = silent) -> Candidates:
    """Starts on each planned floor, improved floor by floor: what the genetic algorithm selects from.

    seed : of random starts.
    """
    if paper.starts == "random":
        starts = sample_at_random(tripods, n_each=paper.n_random, seed=seed, progress=progress)
    else:
        starts = find_candidates(tripods, n_halvings=N_HALVINGS if paper.halve_grid else 0, progress=progress)
    narrows = paper.thin_cell_m > 0 or paper.best_k > 0
    if not starts.floor.size or (paper.search == "none" and not narrows):
        return starts
    survey = tripods.survey
    _check_beams(survey)
    distribution = PointDistribution(survey.scene, survey.patches, tripods.engine, distance=paper.f2.distance)
    if paper.search != "none":
        starts = searched(tripods, paper, distribution, starts, progress)
    return _narrowed(survey, paper, distribution, starts, progress) if narrows else starts


def searched(
    tripods: Tripods,
    paper: Paper,
    distribution: PointDistribution,
    starts: Candidates,
    progress: Progress = silent,
) -> Candidates:
    """Improved positions, beside their starts where the pool is of both."""
    floors = tripods.survey.planned
    improved = [(index, *_improved(tripods, paper, distribution, starts, index, progress)) for index in floors]
    pool = replace(candidates_of(improved, RefusalTally()), n_tried=starts.n_tried, rejected=starts.rejected)
    return _joined(starts if paper.pool == "both" else starts.take(np.arange(0)), pool)


def _narrowed(
    survey: Survey, paper: Paper, distribution: PointDistribution, pool: Candidates, progress: Progress
) -> Candidates:
    """Keep the best of the pool by F2, floor by floor: one a cell, then so many that lie apart."""
    worth = distribution.of(survey.template, pool.position_m, progress=progress)
    kept: list[Int64Array] = []
    for floor in np.unique(pool.floor):
        at = np.flatnonzero(pool.floor == floor)
        if paper.thin_cell_m > 0:
            cell_m = (paper.thin_cell_m, paper.thin_cell_m, np.inf)
            at = at[one_per_cell(pool.position_m[at], worth.n_patches[at], worth.f2_m2[at], cell_m=cell_m)]
        if paper.best_k > 0:
            at = at[
                best_apart(
                    pool.position_m[at],
                    worth.n_patches[at],
                    worth.f2_m2[at],
                    n=paper.best_k,
                    least_distance_m=paper.best_apart_m,
                )
            ]
        kept.append(np.sort(at))
    return pool.take(np.concatenate(kept))


def _check_beams(survey: Survey) -> None:
    """Refuse to search with a scanner of very many beams: F2 needs every one, some thousand times a start."""
    rows, columns = survey.template.shape
    if rows * columns > MAX_SEARCH_BEAMS:
        raise RequirementError(
            f"scanner {survey.scanner.name}: got {rows * columns} beams a scan, expected at most {MAX_SEARCH_BEAMS} "
            "for a spatial search, which casts all of them for every position it looks at; pass --search none or a "
            "coarser mode of the scanner"
        )


def _improved(
    tripods: Tripods,
    paper: Paper,
    distribution: PointDistribution,
    starts: Candidates,
    floor: int,
    progress: Progress,
) -> tuple[FloatArray, FloatArray]:
    """Best positions (N, 3) of the agents of one floor, and their heights (N,) above its ground."""
    starts_m = starts.position_m[starts.floor == floor]
    if not starts_m.size:
        return np.empty((0, 3)), np.empty(0)
    fitness = StationFitness(tripods, distribution, floor=floor, published_tests=paper.published_tests)
    name = tripods.survey.floors[floor].name

    def tell(event: ProgressEvent) -> None:
        progress(replace(event, note=f"{name}: {event.note}"))

    result = search(paper.search, starts_m, fitness, paper.spatial, bounds_m=fitness.bounds_m, progress=tell)
    # Agents that started at valid positions stood at one; lattice cells may have moved a start to where none can stand.
    position_m = result.position_m[result.found]
    return position_m, position_m[:, 2] - tripods.ground(floor).below(position_m)


def _joined(first: Candidates, second: Candidates) -> Candidates:
    """Both, ordered by floor; of equal positions the first alone."""
    position_m = np.concatenate([first.position_m, second.position_m])
    floor = np.concatenate([first.floor, second.floor])
    height_m = np.concatenate([first.instrument_height_m, second.instrument_height_m])
    _, unique = np.unique(np.column_stack([floor, position_m]), axis=0, return_index=True)
    unique = np.sort(unique)
    order = unique[np.argsort(floor[unique], kind="stable")]
    return replace(first, position_m=position_m[order], floor=floor[order], instrument_height_m=height_m[order])


def select_by_genes(
    problem: CoverProblem, paper: Paper, engine: ScanEngine, *, progress: Progress = silent
) -> Int64Array:
    """Return candidates (K,) chosen by the genetic algorithm, on the engine's device where it has one."""
    device = device_of(engine)
    where = "host" if device is None else "device"
    result = select_genetic(problem, paper.genetic, engine=where, device=device, progress=progress)
    return result.chosen.astype(np.int64)


def shortfall(problem: CoverProblem, chosen: Int64Array) -> tuple[str, ...]:
    """Return a line for the user where candidates (K,) miss a target: no search promises to meet it."""
    n_missed = int(np.count_nonzero(problem.covered([int(candidate) for candidate in chosen]) < problem.least))
    if not n_missed:
        return ()
    return (
        f"genetic selection: ended with {n_missed} of {problem.least.size} coverage targets (each floor, and all "
        "together) not met; raise genetic.patience, set genetic.distinct to yes, or use method greedy",
    )


def repair(
    paper: Paper,
    required: float,
    candidates: Candidates,
    chosen: Int64Array,
    *,
    progress: Progress = silent,
) -> tuple[Int64Array, tuple[str, ...]]:
    """Add candidates until the circles of all stations overlap as `required`, a fraction, and are connected by floor.

    Returns
    -------
    All stations (K,), the chosen ones first; and a line for the user about what the pool could not repair.
    """
    if not paper.repair or not chosen.size:
        return chosen, ()
    if required >= 1.0:
        return chosen, ("overlap repair: left out, as no circles cover another one to 100 %; ask for less overlap",)
    left = np.setdiff1d(np.arange(candidates.floor.size), chosen)
    done = repair_overlap(
        candidates.position_m[chosen],
        candidates.position_m[left],
        radius_m=paper.overlap_radius_m,
        required=required,
        station_floor=candidates.floor[chosen],
        pool_floor=candidates.floor[left],
        progress=progress,
    )
    lines = []
    if done.short:
        lines.append(
            f"overlap repair: the circles of {len(done.short)} stations still overlap less than {100 * required:g} % "
            "and no candidate is left for them; use a finer grid step"
        )
    if not done.is_joined:
        lines.append(
            f"overlap repair: {len(done.sets)} separate sets of stations on {done.n_floors} floors, with no candidates "
            "between them; use a finer grid step"
        )
    return np.concatenate([chosen, left[done.added]]), tuple(lines)
