"""Greedy selection: stations one after the other, each the one that adds most of the area still missing.

Input a `CoverProblem`, output a `Selection`.

With A_k(S) the area of target k that the set S covers and R_k what it requires, the gain of c is that of

    F(S) = sum over k of min(A_k(S), R_k)

which is monotone and submodular: gains only shrink as S grows. So an old gain is an upper bound on the new one, and a
candidate whose fresh gain beats all old ones is the best without looking at the rest (lazy evaluation). Ties go to the
larger gain not capped at R_k, then to the lower number; both gains shrink, so lazy and plain selection agree exactly.

References
----------
Minoux 1978 (accelerated greedy), Wolsey 1982 (its logarithmic bound): known results, restated and tested here.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.problem import CoverProblem


@dataclass(frozen=True)
class Selection:
    """chosen : candidates in the order of choice, without those that proved unnecessary.

    dropped : how many those were. n_evaluations : gains computed, for the record.
    """

    chosen: tuple[int, ...]
    dropped: int
    n_evaluations: int


def select_greedy(problem: CoverProblem, *, progress: Progress = silent) -> Selection:
    """Choose candidates until every target is met, then drop those no longer needed.

    Targets are fractions of what the candidates see together, so they can always be met.
    """
    seen = np.zeros(problem.n_rows, dtype=bool)
    missing = problem.required.copy()
    heap = [(*_negative(_gain(problem, c, seen, missing)), c) for c in range(problem.n_candidates)]
    heapq.heapify(heap)
    chosen: list[int] = []
    n_evaluations = len(heap)
    whole = max(int(problem.required.sum()), 1)
    while (missing > 0).any():
        candidate = heap[0][2]
        fresh = (*_negative(_gain(problem, candidate, seen, missing)), candidate)
        n_evaluations += 1
        heapq.heappop(heap)
        if heap and fresh > heap[0]:
            heapq.heappush(heap, fresh)
            continue
        rows = problem.rows_of(candidate)
        new = rows[~seen[rows]]
        missing -= _per_target(problem, new)
        seen[new] = True
        chosen.append(candidate)
        left = int(np.maximum(missing, 0).sum())
        progress(ProgressEvent("select", int(1000 * (1 - left / whole)), 1000, f"{len(chosen)} stations"))
    kept = drop_redundant(problem, chosen)
    return Selection(tuple(kept), len(chosen) - len(kept), n_evaluations)


def drop_redundant(problem: CoverProblem, chosen: list[int]) -> list[int]:
    """Leave out stations without which every target is still met: smallest own area first, the latest of equals."""
    kept = list(chosen)
    n_seen = np.zeros(problem.n_rows, dtype=np.int64)
    for candidate in kept:
        n_seen[problem.rows_of(candidate)] += 1
    spare = (problem.counts_for * np.where(n_seen > 0, problem.ticks, 0)).sum(axis=1) - problem.required
    while kept:
        best: tuple[int, int] | None = None
        for place, candidate in enumerate(kept):
            rows = problem.rows_of(candidate)
            own = _per_target(problem, rows[n_seen[rows] == 1])
            if (own <= spare).all() and (best is None or (int(own.sum()), -place) < best):
                best = (int(own.sum()), -place)
        if best is None:
            break
        candidate = kept.pop(-best[1])
        rows = problem.rows_of(candidate)
        spare -= _per_target(problem, rows[n_seen[rows] == 1])
        n_seen[rows] -= 1
    return kept


def _gain(problem: CoverProblem, candidate: int, seen: BoolArray, missing: Int64Array) -> tuple[int, int]:
    """Area that a candidate adds: capped at what each target misses, and all of it."""
    rows = problem.rows_of(candidate)
    added = _per_target(problem, rows[~seen[rows]])
    return int(np.minimum(added, np.maximum(missing, 0)).sum()), int(added.sum())


def _per_target(problem: CoverProblem, rows: Int64Array) -> Int64Array:
    ticks = problem.ticks[rows]
    return np.array([ticks[counted[rows]].sum() for counted in problem.counts_for], dtype=np.int64)


def _negative(gain: tuple[int, int]) -> tuple[int, int]:
    return -gain[0], -gain[1]
