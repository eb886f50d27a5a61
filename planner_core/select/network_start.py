"""Candidates that make a set of stations hang together: what selection with a network starts from.

Input a `CoverProblem`, a `Network` and chosen candidates, output these and more, few of them. What is close is joined
first: two components by a shortest path of candidates between any two, again until each part has one. With
`loops` a bridge gets a way round, a shortest one again. Of equally short ways that which sees most that is not covered.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner_core.model import Int64Array
from planner_core.select.network import Network, components_of
from planner_core.select.problem import CoverProblem

_FAR = 2**31


def connect(problem: CoverProblem, network: Network, chosen: Sequence[int]) -> list[int]:
    """Connect `chosen` by further candidates; it always can be, see `Network`."""
    now = list(chosen)
    while (more := _between_components(problem, network, now)) is not None:
        now += more
    if network.loops:
        while bridges := network.avoidable_bridges(now):
            now += _way_round(problem, network, now, bridges[0])
    return now


def _between_components(problem: CoverProblem, network: Network, chosen: list[int]) -> list[int] | None:
    """Candidates of a shortest way between two components of one part; None: there are no two."""
    side = np.full(network.n_candidates, -1, dtype=np.int64)
    side[chosen] = components_of(network.links_among(chosen))
    of_part = np.unique(np.stack([network.part[chosen], side[chosen]]), axis=1)[0]
    split = np.unique(of_part[:-1][np.diff(of_part) == 0])
    if split.size == 0:
        return None
    return _shortest_way(problem, network, chosen, np.where(np.isin(network.part, split), side, -1))


def _way_round(problem: CoverProblem, network: Network, chosen: list[int], bridge: tuple[int, int]) -> list[int]:
    """Candidates of a shortest way from one side of a bridge to the other that does not go over it."""
    place = {candidate: i for i, candidate in enumerate(chosen)}
    ends = place[bridge[0]], place[bridge[1]]
    linked = network.links_among(chosen)
    for a, b in (ends, ends[::-1]):
        linked[a].remove(b)
    component = np.array(components_of(linked))
    side = np.full(network.n_candidates, -1, dtype=np.int64)
    for end in ends:
        side[np.array(chosen)[component == component[end]]] = component[end]
    return _shortest_way(problem, network, chosen, side, barred=bridge)


def _shortest_way(
    problem: CoverProblem,
    network: Network,
    chosen: list[int],
    side: Int64Array,
    *,
    barred: tuple[int, int] | None = None,
) -> list[int]:
    """Candidates, none of them chosen, by which two sides become linked: the fewest.

    side : (N,), the side of all chosen candidates of the parts in question, -1 elsewhere. There must be a way.
    """
    source = np.repeat(np.arange(network.n_candidates), np.diff(network.starts))
    ends = np.stack([source, network.neighbour])
    if barred is not None:
        ends = ends[:, ~((np.sort(ends, axis=0) == np.array(barred)[:, None]).all(axis=0))]
    gains = _Gains(problem, chosen)
    side, distance = side.copy(), np.where(side >= 0, 0, _FAR)
    seen, before = np.zeros(side.size, dtype=np.int64), np.full(side.size, -1)
    for step in range(1, side.size):
        a, b = ends[:, (distance[ends[0]] == step - 1) & (side[ends[1]] < 0)]
        if a.size == 0:
            break
        order = np.lexsort((a, -seen[a], b))
        a, b = a[order], b[order]
        first = np.append(True, np.diff(b) != 0)
        a, b = a[first], b[first]
        side[b], distance[b], before[b] = side[a], step, a
        # The ends of a meeting are at most one step apart: ways that are found later are longer.
        if _meetings(ends, side).size:
            break
        seen[b] = seen[a] + gains.of(b)
    between = _meetings(ends, side)
    length = distance[between].sum(axis=0)
    a, b = between[:, length == length.min()]
    late = np.unique(np.concatenate([a, b]))
    late = late[distance[late] > 0]
    seen[late] = seen[before[late]] + gains.of(late)
    best = np.lexsort((b, a, -(seen[a] + seen[b])))[0]
    way = []
    for node in (int(a[best]), int(b[best])):
        while distance[node] > 0:
            way.append(node)
            node = int(before[node])
    return way


def _meetings(ends: Int64Array, side: Int64Array) -> Int64Array:
    """(2, L): links, of (2, M), between two sides."""
    met: Int64Array = ends[:, (side[ends[0]] >= 0) & (side[ends[1]] >= 0) & (side[ends[0]] != side[ends[1]])]
    return met


class _Gains:
    """Ticks of looks that candidates add to those of a set, over all targets."""

    def __init__(self, problem: CoverProblem, chosen: list[int]) -> None:
        n_seen = problem.times_seen(chosen)
        self._problem = problem
        self._wanted = (problem.counts_for & (n_seen < problem.seen_from[:, None])).sum(axis=0) * problem.ticks

    def of(self, candidates: Int64Array) -> Int64Array:
        """(N',) ticks."""
        return np.array([self._wanted[self._problem.rows_of(c)].sum() for c in candidates], dtype=np.int64)
