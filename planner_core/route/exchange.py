"""Exchanges of one station for a candidate: which keep all targets met, and what they cost on foot.

CoverProblem, chosen candidates -> bool. With n_r how many chosen candidates see row r and s_k how many target k asks
for, taking c out loses the rows of c with n_r = s_k, putting d in gains the rows of d with n_r = s_k - 1, and rows of
both are neither lost nor gained.

On foot, a detour is how much longer a walk gets with a stop for another one, metres. A walk is a closed tour; an open
one is closed by one more stop, at no distance from any. Stops of a floor follow one another, so a candidate goes beside
a stop of its floor, or to where floors change if its floor has none.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.select.problem import CoverProblem


class Exchanges:
    """Exchanges in one problem; whole numbers throughout."""

    def __init__(self, problem: CoverProblem) -> None:
        from scipy.sparse import csr_array

        self._problem = problem
        shape = (problem.n_candidates, problem.n_rows)
        ones = np.ones(problem.row.size, dtype=np.int64)
        self._sees = csr_array((ones, problem.row, problem.starts), shape=shape)

    def allowed(self, chosen: list[int], candidates: Int64Array) -> BoolArray:
        """(M, S) bool: whether targets stay met with a candidate (M,) in the place of a chosen one (S,)."""
        n_seen, spare = self._state(chosen)
        some, out = self._sees[candidates], self._sees[np.array(chosen, dtype=np.int64)].T.tocsr()
        good = np.ones((candidates.size, len(chosen)), dtype=bool)
        for k in range(spare.size):
            critical, awaited = self._weights(k, n_seen)
            balance = spare[k] + (some @ awaited)[:, None] - (critical @ out)[None, :]
            balance += (some @ _scaled(out, critical)).toarray()
            if self._problem.seen_from[k] > 1:
                balance -= (some @ _scaled(out, awaited)).toarray()
            good &= balance >= 0
        return good

    def superfluous(self, chosen: list[int]) -> BoolArray:
        """(S,) bool: chosen candidates without which all targets are still met, each taken out alone."""
        n_seen, spare = self._state(chosen)
        mine = self._sees[np.array(chosen, dtype=np.int64)]
        lost = np.array([mine @ self._weights(k, n_seen)[0] for k in range(spare.size)])
        return np.asarray((lost.reshape(spare.size, len(chosen)) <= spare[:, None]).all(axis=0))

    def gains(self, chosen: list[int]) -> Int64Array:
        """(N,) ticks that each candidate adds to targets not met, capped at what these miss."""
        n_seen, spare = self._state(chosen)
        gain = np.zeros(self._problem.n_candidates, dtype=np.int64)
        for k in np.flatnonzero(spare < 0).tolist():
            added = self._sees @ self._weights(k, n_seen)[1]
            gain += np.minimum(added, -spare[k])
        return gain

    def met(self, chosen: list[int]) -> bool:
        """Whether all targets are met."""
        return bool((self._state(chosen)[1] >= 0).all())

    def _state(self, chosen: list[int]) -> tuple[Int64Array, Int64Array]:
        """How many see each row (R,), and what each target has to spare (K,)."""
        n_seen = self._problem.times_seen(chosen)
        return n_seen, self._problem.ticks_of(n_seen) - self._problem.required

    def _weights(self, k: int, n_seen: Int64Array) -> tuple[Int64Array, Int64Array]:
        """Ticks (R,) of rows that one look less takes from target k, and of rows that one look more gives it."""
        ticks = np.where(self._problem.counts_for[k], self._problem.ticks, 0)
        enough = int(self._problem.seen_from[k])
        return np.where(n_seen == enough, ticks, 0), np.where(n_seen == enough - 1, ticks, 0)


def exchange_detours_m(away_m: FloatArray, floor: Int32Array, between_m: FloatArray, to: Int32Array) -> FloatArray:
    """(M, T) change in length of a tour of T stops when a candidate (M,) takes the place of one of its stops.

    The candidate goes to the best place of the tour without that stop.

    Parameters
    ----------
    away_m
        (T, M) from each stop of the tour, in its order, to each candidate.
    floor
        (T,) of the stops; -1 for ends and the seam of an open walk.
    between_m
        (T, T) among the stops.
    to
        (M,) floor of the candidates.
    """
    n = floor.size
    if n <= 1:  # a walk of no length remains one
        return np.zeros((to.size, n))
    here = np.arange(n)
    after, before = (here + 1) % n, (here - 1) % n
    step = between_m[here, after]
    cost = np.where(_beside(floor, floor[after], to), away_m + away_m[after] - step[:, None], np.inf)
    bridge = between_m[before, after]
    saved = step[before] + step - bridge
    # A stop that is alone on its floor leaves its place to candidates of that floor.
    own = _beside(floor[before], floor[after], to) | (floor[:, None] == to[None])
    in_place = np.where(own, away_m[before] + away_m[after] - bridge[:, None], np.inf)
    return np.asarray((np.minimum(_best_elsewhere(cost), in_place) - saved[:, None]).T)


def insertion_detours_m(away_m: FloatArray, floor: Int32Array, between_m: FloatArray, to: Int32Array) -> FloatArray:
    """(M,) change in length of a tour with one stop more, at its best place; parameters as above."""
    if not floor.size:  # a closed walk of one stop has no length
        return np.zeros(to.size)
    after = (np.arange(floor.size) + 1) % floor.size
    step = between_m[np.arange(floor.size), after]
    cost = np.where(_beside(floor, floor[after], to), away_m + away_m[after] - step[:, None], np.inf)
    return np.asarray(cost.min(axis=0))


def _scaled(rows: Any, weight: Int64Array) -> Any:
    """Rows of a sparse matrix times weights (R,), those of weight zero left out."""
    from scipy.sparse import csr_array

    keep = np.flatnonzero(weight)
    counts = np.diff(rows.indptr)
    some = rows[keep]
    starts = np.zeros(rows.shape[0] + 1, dtype=np.int64)
    kept_counts = np.zeros(rows.shape[0], dtype=np.int64)
    kept_counts[keep] = counts[keep]
    starts[1:] = np.cumsum(kept_counts)
    return csr_array((np.repeat(weight[keep], counts[keep]), some.indices, starts), shape=rows.shape)


def _beside(floor: Int32Array, next_floor: Int32Array, to: Int32Array) -> BoolArray:
    """(T, M) bool: whether a candidate may go between a stop and the next."""
    beside = (floor[:, None] == to[None]) | (next_floor[:, None] == to[None])
    new = ~np.isin(to, floor)
    change = (floor != next_floor) | (floor < 0)
    if not change.any():  # a closed walk of one floor: it is left for another one anywhere
        change = np.ones_like(change)
    return np.asarray(beside | (new[None] & change[:, None]))


def _best_elsewhere(cost: FloatArray) -> FloatArray:
    """(T, M) least cost (T, M) over the steps, without the step before and the step from each stop."""
    n = cost.shape[0]
    order = np.argsort(cost, axis=0, kind="stable")[: min(3, n)]
    best = np.full(cost.shape, np.inf)
    here = np.arange(n)[:, None]
    for rank in order[::-1]:
        taken = (rank[None] == here) | (rank[None] == (here - 1) % n)
        best = np.where(taken, best, cost[rank, np.arange(cost.shape[1])][None])
    return best
