"""Coverage of many chromosomes on the host: bits OR-ed by NumPy, on all cores.

NumPy lets go of the interpreter's lock in what takes time here, so threads are enough.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np

from planner_core.genetic.problem import CoverRows
from planner_core.model import BoolArray, Int64Array


class HostCoverage:
    """Coverage by bits, eight rows a byte; a context manager, which ends its threads.

    Rows are those of `CoverRows` in order; sums are of whole numbers, so they do not hang on the number of threads.
    """

    def __init__(self, problem: CoverRows, *, n_threads: int | None = None) -> None:
        n_candidates, n_rows = problem.starts.size - 1, problem.ticks.size
        sees = np.zeros((n_candidates, -(-n_rows // 64) * 64), dtype=bool)
        sees[np.repeat(np.arange(n_candidates), np.diff(problem.starts)), problem.row] = True
        self._bits = np.packbits(sees, axis=1, bitorder="little").view(np.uint64)
        self._n_rows = n_rows
        #: One row for the whole and one for each target.
        self._weights = np.vstack([problem.ticks[None], np.where(problem.counts_for, problem.ticks, 0)])
        self._required = problem.required
        self._n_threads = len(os.sched_getaffinity(0)) if n_threads is None else n_threads
        self._threads = ThreadPoolExecutor(self._n_threads, thread_name_prefix="genetic")

    def __enter__(self) -> HostCoverage:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._threads.shutdown(cancel_futures=True)

    def evaluate(self, genes: BoolArray) -> tuple[Int64Array, Int64Array]:
        """Covered and missing ticks of (n, N) bool chromosomes, each (n,) int64."""
        parts = np.array_split(genes, min(len(genes), 4 * self._n_threads))
        sums = np.concatenate(list(self._threads.map(self._sums, parts)), axis=0)
        missing: Int64Array = np.maximum(self._required - sums[:, 1:], 0).sum(axis=1)
        return sums[:, 0], missing

    def _sums(self, genes: BoolArray) -> Int64Array:
        out = np.empty((len(genes), len(self._weights)), dtype=np.int64)
        for row, chromosome in enumerate(genes):
            seen = np.bitwise_or.reduce(self._bits[np.flatnonzero(chromosome)], axis=0)
            bits = np.unpackbits(seen.view(np.uint8), count=self._n_rows, bitorder="little").view(bool)
            out[row] = self._weights[:, bits].sum(axis=1)
        return out
