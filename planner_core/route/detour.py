"""Detours: how much longer a walk gets with a stop for another one. Metres.

A walk is a closed tour; an open one is closed by one more stop, at no distance from any. Stops of a floor follow one
another, so a candidate goes beside a stop of its floor, or to where floors change if its floor has none.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int32Array


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
