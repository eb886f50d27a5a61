"""Visiting order of stations over walking distances: a storey at a time, from a start, to an end or back.

Metres. The order of storeys is sought too: for small plans among all orders, for others the one with the shortest ways
from storey to storey.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int32Array, Int64Array
from planner_core.route.tour import MAX_EXACT, exact_tour, improved_tour, paths_through, tour_length_m

#: All orders of so many storeys are tried; of more, they are taken as they lie, part by part, from below or above.
MAX_STOREYS = 6
N_KICKS = 60


@dataclass(frozen=True)
class VisitingOrder:
    """Stops in the order of the walk.

    order : (N,) int64, each stop once. length_m : of the walk, legs that can't be walked not counted; a closed walk's
    way back included. n_unwalkable : legs between stops that no way joins. exact : no shorter order exists.
    """

    order: Int64Array
    length_m: float
    n_unwalkable: int
    exact: bool


def visiting_order(
    distance_m: FloatArray,
    floor: Int32Array,
    *,
    start: int | None = None,
    end: int | None = None,
    closed: bool = False,
    seed: int = 0,
    n_kicks: int = N_KICKS,
    max_exact: int = MAX_EXACT,
) -> VisitingOrder:
    """Order stops so that the walk is short, all stops of a floor one after another.

    Parts that no way joins, such as the flats of a house, are visited one after the other, each floor by floor.

    Parameters
    ----------
    distance_m
        (N, N) float64, symmetric, inf where there is no way: `planner_core.positions.walking.Walking`.
    floor
        (N,) int32, floor of each stop.
    start, end
        Stops (indices) that come first and last, whatever their floor: an entrance, or a station.
    closed
        The walk ends where it starts; so it does where `start` and `end` are the same stop.
    seed, n_kicks
        Of the search where a floor has more than `max_exact` stops: more kicks, shorter walks.
    max_exact
        Floors of up to so many stops, 12 at most, are ordered exactly.

    Raises
    ------
    RequirementError
        A matrix that is not square or symmetric, or an end and a closed walk at once.
    """
    distance_m = np.asarray(distance_m, dtype=np.float64)
    _check(distance_m, floor, start, end, closed=closed)
    closed = closed or (start is not None and start == end)
    n = floor.size
    if n == 0:
        return VisitingOrder(np.empty(0, np.int64), 0.0, 0, True)
    padded = _padded(distance_m)
    ends = {stop for stop in (start, end) if stop is not None}
    inner = np.array([stop for stop in range(n) if stop not in ends], dtype=np.int64)
    storeys = _storeys(distance_m, floor, inner)
    head = [] if start is None else [np.array([start])]
    tail = [] if end is None or closed else [np.array([end])]
    # An open walk is a tour over one more stop, no way from anywhere.
    seam = [] if closed else [np.array([n])]
    small = max((storey.size for storey in storeys), default=0) <= max_exact and len(storeys) <= MAX_STOREYS
    if small:
        tours = _exact_tours(padded, [*seam, *head], storeys, tail)
    else:
        order = _storey_order(padded, storeys, head, tail, closed=closed)
        rng = np.random.default_rng(seed)
        blocks = [*seam, *head, *(storeys[k] for k in order), *tail]
        tours = [improved_tour(padded, blocks, n_kicks=n_kicks, rng=rng)]
    lengths = [tour_length_m(padded, tour) for tour in tours]
    tour = tours[int(np.argmin(np.round(lengths, 9)))]
    tour = tour[tour != n]
    legs = distance_m[tour[:-1], tour[1:]]
    if closed and n > 1:
        legs = np.append(legs, distance_m[tour[-1], tour[0]])
    walked = np.isfinite(legs)
    return VisitingOrder(tour, float(legs[walked].sum()), int((~walked).sum()), small)


def _check(distance_m: FloatArray, floor: Int32Array, start: int | None, end: int | None, *, closed: bool) -> None:
    n = floor.size
    if distance_m.shape != (n, n):
        raise RequirementError(
            f"distances: got an array of shape {distance_m.shape}, expected ({n}, {n}), a row and a column a stop"
        )
    if np.isnan(distance_m).any() or (distance_m < 0).any() or not np.array_equal(distance_m, distance_m.T):
        raise RequirementError("distances: got negative, undefined or one-way ones, expected a symmetric matrix")
    for name, stop in (("start", start), ("end", end)):
        if stop is not None and not 0 <= stop < n:
            raise RequirementError(f"{name}: got stop {stop}, expected an index from 0 to {n - 1}")
    if closed and end is not None and end != start:
        raise RequirementError("end: got one for a closed route, expected none; leave it out, or leave `closed` out")


def _storeys(distance_m: FloatArray, floor: Int32Array, inner: Int64Array) -> list[Int64Array]:
    """Stops `inner` by floor, those of each part that hangs together for itself, from below: parts by their lowest."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, part = connected_components(coo_array(np.isfinite(distance_m)), directed=False)
    lowest = np.full(part.size, np.iinfo(np.int32).max, dtype=np.int32)
    np.minimum.at(lowest, part[inner], floor[inner])
    keys = np.column_stack([lowest[part[inner]], part[inner], floor[inner]])
    return [inner[(keys == key).all(axis=1)] for key in np.unique(keys, axis=0)]


def _padded(distance_m: FloatArray) -> FloatArray:
    """(N + 1, N + 1): unwalkable legs longer than any walk, and a stop at no distance from all."""
    n = distance_m.shape[0]
    finite = np.isfinite(distance_m)
    out = np.zeros((n + 1, n + 1))
    out[:n, :n] = np.where(finite, distance_m, 1.0 + (n + 1) * float(distance_m[finite].max(initial=0.0)))
    return out


def _exact_tours(
    distance_m: FloatArray, head: list[Int64Array], storeys: list[Int64Array], tail: list[Int64Array]
) -> list[Int64Array]:
    """Find the shortest tour of every order of storeys, as they lie from below first."""
    through = {id(block): paths_through(distance_m[np.ix_(block, block)]) for block in (*head, *storeys, *tail)}
    tours = []
    for order in permutations(storeys):
        blocks = [*head, *order, *tail]
        tours.append(exact_tour(distance_m, blocks, [through[id(block)] for block in blocks]))
    return tours


def _storey_order(
    distance_m: FloatArray, storeys: list[Int64Array], head: list[Int64Array], tail: list[Int64Array], *, closed: bool
) -> tuple[int, ...]:
    """Order of storeys with the least sum of shortest ways between them, from the start and to the end."""
    n = len(storeys)
    upward = tuple(range(n))
    orders = list(permutations(upward)) if n <= MAX_STOREYS else [upward, upward[::-1]]

    def gaps_m(order: tuple[int, ...]) -> float:
        chain = [*head, *(storeys[k] for k in order), *tail]
        if closed:
            chain.append(chain[0])
        return round(sum(float(distance_m[np.ix_(a, b)].min()) for a, b in pairwise(chain)), 9)

    return min(orders, key=gaps_m)  # the first of equals
