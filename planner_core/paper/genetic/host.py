"""The genetic loop on the host: one page that reads like the algorithm, and the trajectory of the device, bit for bit.

Input `CoverProblem` and settings, output a `Trajectory`. Coverage takes all cores; the operators are NumPy.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.model.genetic import GeneticSettings
from planner_core.paper.genetic.coverage import HostCoverage
from planner_core.paper.genetic.objective import GeneticObjective
from planner_core.paper.genetic.operators import (
    bar_twins,
    breed,
    mating_pool,
    mend,
    places_of_offspring,
    random_individuals,
    rank,
)
from planner_core.paper.genetic.philox import Draws
from planner_core.paper.genetic.trajectory import EXHAUSTED, STALE, Trajectory, note
from planner_core.progress import Progress
from planner_core.select.problem import CoverProblem


def evolve_on_host(
    problem: CoverProblem,
    settings: GeneticSettings,
    objective: GeneticObjective,
    given: BoolArray,
    *,
    progress: Progress,
    n_threads: int | None = None,
) -> Trajectory:
    """Evolve a population whose first individuals are `given`, (n, N) bool."""
    draws = Draws(settings.seed or 0)
    with HostCoverage(problem, n_threads=n_threads) as coverage:
        # 1. Start: given individuals, then random ones.
        others = np.arange(len(given), settings.population)
        genes = np.concatenate([given, random_individuals(draws, settings, others, objective.n_candidates)])
        mend(draws, 0, genes)
        facts = _facts(coverage, objective, genes)
        best, improved, iteration = genes[:0], 0, 0
        rows: list[Int64Array] = []
        while True:
            # 2. The best so far, and whether it is time to stop.
            order = rank(facts[:, 0])
            if not rows or facts[order[0], 0] > rows[-1][0]:
                best, improved = genes[order[0]].copy(), iteration
                rows.append(facts[order[0]].copy())
            else:
                rows.append(rows[-1])
            note(progress, iteration, rows[-1])
            if iteration - improved >= settings.patience or iteration >= settings.max_iterations:
                break
            # 3. The next generation.
            iteration += 1
            offspring = breed(draws, settings, iteration, genes, mating_pool(draws, settings, iteration, order))
            offspring_facts = _facts(coverage, objective, offspring)
            if settings.distinct:
                bar_twins(genes, offspring, offspring_facts[:, 0])
            taken, places = places_of_offspring(settings, order, facts[:, 0], offspring_facts[:, 0])
            genes[places], facts[places] = offspring[taken], offspring_facts[taken]
    history = np.array(rows, dtype=np.int64)
    return Trajectory(best, history, STALE if iteration - improved >= settings.patience else EXHAUSTED)


def _facts(coverage: HostCoverage, objective: GeneticObjective, genes: BoolArray) -> Int64Array:
    """(n, 3): key, covered ticks, active stations."""
    covered, missing = coverage.evaluate(genes)
    active = genes.sum(axis=1, dtype=np.int64)
    return np.stack([objective.keys(covered, active, missing), covered, active], axis=1)
