"""Greedy selection: stations one after the other, each the one that adds most of the area still missing.

Input a `CoverProblem`, output a `Selection`.

With A_k(S) the area of target k that the set S covers and R_k what it requires, the gain of c is that of

    F(S) = sum over k of min(A_k(S), R_k)

which is monotone and submodular: gains only shrink as S grows. So an old gain is an upper bound on the new one, and a
candidate whose fresh gain beats all old ones is the best without looking at the rest (lazy evaluation). Ties go to the
larger gain not capped at R_k, then to the lower number; both gains shrink, so lazy and plain selection agree exactly.

Where a row counts only once m stations see it, area covered is not submodular: the first look is worth nothing, the
last one all. Each of the first m looks counts instead, so A_k(S) = sum of ticks_r min(looks at r, m), which is; and
there is no cap, since A_k(S) = m R_k does not mean that the target is met. Until it is met its looks count in full,
then for nothing: gains still only shrink.

References
----------
Minoux 1978 (accelerated greedy), Wolsey 1982 (its logarithmic bound): known results, restated and tested here.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.model import Int32Array, Int64Array, Visibility
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem


@dataclass(frozen=True)
class Selection:
    """chosen : candidates in the order of choice, without those that proved unnecessary.

    dropped : how many those were. n_evaluations : gains computed, for the record.
    """

    chosen: tuple[int, ...]
    dropped: int
    n_evaluations: int


def select_greedy(problem: CoverProblem, *, given: Sequence[int] = (), progress: Progress = silent) -> Selection:
    """Choose candidates until every target is met, then drop those no longer needed.

    Targets are fractions of what the candidates see together, so they can always be met. `given` ones come first and
    stay.
    """
    n_seen = problem.times_seen(list(given))
    missing = problem.required - problem.ticks_of(n_seen)
    others = np.setdiff1d(np.arange(problem.n_candidates), np.array(given, dtype=np.int64)).tolist()
    heap = [(*_negative(_gain(problem, c, n_seen, missing)), c) for c in others]
    heapq.heapify(heap)
    chosen: list[int] = list(given)
    n_evaluations = len(heap)
    whole = max(int(problem.required.sum()), 1)
    while (missing > 0).any():
        candidate = heap[0][2]
        fresh = (*_negative(_gain(problem, candidate, n_seen, missing)), candidate)
        n_evaluations += 1
        heapq.heappop(heap)
        if heap and fresh > heap[0]:
            heapq.heappush(heap, fresh)
            continue
        rows = problem.rows_of(candidate)
        missing -= _at_count(problem, rows, n_seen, problem.seen_from - 1)
        n_seen[rows] += 1
        chosen.append(candidate)
        left = int(np.maximum(missing, 0).sum())
        progress(ProgressEvent("select", int(1000 * (1 - left / whole)), 1000, f"{len(chosen)} stations"))
    kept = drop_redundant(problem, chosen, given=given)
    return Selection(tuple(kept), len(chosen) - len(kept), n_evaluations)


def drop_redundant(
    problem: CoverProblem, chosen: list[int], *, given: Sequence[int] = (), network: Network | None = None
) -> list[int]:
    """Leave out stations without which every target is still met: smallest own area first, the latest of equals.

    `given` ones stay; with a network so do those without whom the others are not connected.
    """
    kept, is_fixed = np.array(chosen, dtype=np.int64), np.isin(chosen, list(given))
    n_seen = problem.times_seen(chosen)
    spare = problem.ticks_of(n_seen) - problem.required
    rows_of = [problem.rows_of(candidate) for candidate in chosen]
    of_row = Visibility(
        np.cumsum([0, *(rows.size for rows in rows_of)], dtype=np.int64),
        np.concatenate([np.empty(0, dtype=np.int32), *rows_of]),
        problem.n_rows,
    ).turned()
    own = np.array([_at_count(problem, rows, n_seen, problem.seen_from) for rows in rows_of], dtype=np.int64)
    own = own.reshape(kept.size, spare.size)
    left = np.arange(kept.size)
    while left.size:
        places = np.flatnonzero(~is_fixed[left] & (own[left] <= spare).all(axis=1))
        places = places[np.lexsort((-places, own[left[places]].sum(axis=1)))]
        may_go = (lambda _: True) if network is None else network.can_spare(kept[left].tolist())
        spared = next((place for place in places.tolist() if may_go(place)), None)
        if spared is None:
            break
        gone, left = left[spared], np.delete(left, spared)
        rows = rows_of[gone]
        spare -= own[gone]
        n_seen[rows] -= 1
        # Only who shares a row with it needs to be updated.
        for other in np.unique(np.concatenate([left[:0], *(of_row.row(row) for row in rows.tolist())])).tolist():
            own[other] = _at_count(problem, rows_of[other], n_seen, problem.seen_from)
    return [int(candidate) for candidate in kept[left]]


def _gain(problem: CoverProblem, candidate: int, n_seen: Int64Array, missing: Int64Array) -> tuple[int, int]:
    """Looks that a candidate adds, in ticks: those of targets not met, capped where one is enough; and all of them."""
    rows = problem.rows_of(candidate)
    ticks, times = problem.ticks[rows], n_seen[rows]
    gain = whole = 0
    for counted, enough, left in zip(problem.counts_for, problem.seen_from.tolist(), missing.tolist(), strict=True):
        added = int(ticks[counted[rows] & (times < enough)].sum())
        whole += added
        if left > 0:
            gain += min(added, left) if enough == 1 else added
    return gain, whole


def _at_count(problem: CoverProblem, rows: Int32Array, n_seen: Int64Array, count: Int64Array) -> Int64Array:
    """(K,) ticks of each target among `rows` that are seen exactly `count` (K,) times."""
    ticks, times = problem.ticks[rows], n_seen[rows]
    return np.array(
        [ticks[counted[rows] & (times == n)].sum() for counted, n in zip(problem.counts_for, count, strict=True)],
        dtype=np.int64,
    )


def _negative(gain: tuple[int, int]) -> tuple[int, int]:
    return -gain[0], -gain[1]
