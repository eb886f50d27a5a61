"""The genetic loop on the host: one page that reads like the algorithm, and the trajectory of the device, bit for bit.

Input `CoverProblem` and settings, output a `Trajectory`. The operators are NumPy. Coverage is bits OR-ed
by NumPy on all cores: it lets go of the interpreter's lock in what takes time here, so threads are enough.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic.objective import EXHAUSTED, STALE, GeneticObjective, Trajectory, note
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
from planner_core.progress import Progress
from planner_core.select.bit_rows import classes_of
from planner_core.select.problem import CoverProblem

#: Fewer cost more calls, more leave the cache: 8 rows of 20 000 whole numbers take 1.3 MB.
_CHROMOSOMES_A_TASK = 8


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


class HostCoverage:
    """Coverage by bits, eight rows a byte; a context manager, which ends its threads.

    Rows are those of `CoverProblem` in order; sums are of whole numbers, so they do not hang on the number of threads.
    """

    def __init__(self, problem: CoverProblem, *, n_threads: int | None = None) -> None:
        n_candidates, n_rows = problem.starts.size - 1, problem.ticks.size
        class_of_row, counts = classes_of(problem)
        # Rows of a class side by side: one running sum gives all classes.
        order = np.argsort(class_of_row, kind="stable")
        place = np.empty(n_rows, dtype=np.int64)
        place[order] = np.arange(n_rows)
        sees = np.zeros((n_candidates, -(-n_rows // 64) * 64), dtype=bool)
        sees[np.repeat(np.arange(n_candidates), np.diff(problem.starts)), place[problem.row]] = True
        self._bits = np.packbits(sees, axis=1, bitorder="little").view(np.uint64)
        self._ticks = problem.ticks[order]
        self._first = np.searchsorted(class_of_row[order], np.arange(counts.shape[1]))
        self._counts, self._required = counts.astype(np.int64), problem.required
        self._n_threads = n_threads or os.cpu_count() or 1
        self._threads = ThreadPoolExecutor(self._n_threads, thread_name_prefix="genetic")

    def __enter__(self) -> HostCoverage:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._threads.shutdown(cancel_futures=True)

    def evaluate(self, genes: BoolArray) -> tuple[Int64Array, Int64Array]:
        """Covered and missing ticks of (n, N) bool chromosomes, each (n,) int64."""
        if self._ticks.size == 0:
            none = np.zeros(len(genes), dtype=np.int64)
            return none, none + int(np.maximum(self._required, 0).sum())
        parts = np.array_split(genes, -(-len(genes) // _CHROMOSOMES_A_TASK))
        by_class = np.concatenate(list(self._threads.map(self._sums, parts)), axis=0)
        missing: Int64Array = np.maximum(self._required - by_class @ self._counts.T, 0).sum(axis=1)
        return by_class.sum(axis=1), missing

    def _sums(self, genes: BoolArray) -> Int64Array:
        """(n, n_classes) ticks."""
        seen = np.stack([np.bitwise_or.reduce(self._bits[np.flatnonzero(row)], axis=0) for row in genes])
        bits = np.unpackbits(seen.view(np.uint8), axis=1, count=self._ticks.size, bitorder="little")
        sums: Int64Array = np.add.reduceat(bits * self._ticks, self._first, axis=1)
        return sums


def _facts(coverage: HostCoverage, objective: GeneticObjective, genes: BoolArray) -> Int64Array:
    """(n, 3): key, covered ticks, active stations."""
    covered, missing = coverage.evaluate(genes)
    active = genes.sum(axis=1, dtype=np.int64)
    return np.stack([objective.keys(covered, active, missing), covered, active], axis=1)
