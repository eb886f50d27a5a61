"""Which candidates can be registered with each other, and how the chosen ones have to be connected.

Made by `planner_core.network.candidate_links` from overlap and strength of links; selection only sees a graph.

A set of candidates is connected where the links between them join all that are of one part. With `loops` none of
these links may be a bridge (one whose failure parts what it joined), but for two exceptions: the only link of a part
with two chosen candidates, and a bridge of the candidates' graph itself, which no choice avoids. So the set of all
candidates always is connected, and adding candidates can make any set do so.

`connect` adds few candidates to a set so that it is connected, which selection with a network starts from. What is
close is joined first: two components by a shortest path of candidates between any two, again until each part has one.
With `loops` a bridge gets a way round, a shortest one again. Of equally short ways that which sees most that is not
covered.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from planner_core.model import BoolArray, Int32Array, Int64Array
from planner_core.select.problem import CoverProblem

_FAR = 2**31


@dataclass(frozen=True)
class Network:
    """A graph over N candidates. Chosen candidates of one part must be joined by links between chosen candidates.

    starts, neighbour : CSR rows, (N + 1,) int64 and int32, sorted, symmetric, without loops.
    part : (N,) int32, connected component of the whole graph: no plan can join two parts, so none has to.
    loops : the chosen ones of a part must stay joined when any one link between them fails, see above.
    """

    starts: Int64Array
    neighbour: Int32Array
    part: Int32Array
    loops: bool = False

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return int(self.starts.size - 1)

    def neighbours(self, candidate: int) -> Int32Array:
        """Sorted candidates that one is linked to."""
        return self.neighbour[self.starts[candidate] : self.starts[candidate + 1]]

    @cached_property
    def n_parts(self) -> int:
        """One more than the largest number of a part."""
        return int(self.part.max(initial=-1)) + 1

    def __getstate__(self) -> dict[str, Any]:
        """What travels: what was worked out from it stays here."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def graph(self) -> Any:
        """(N, N) sparse, 1 where two are linked."""
        from scipy import sparse

        one, n = np.ones(self.neighbour.size, dtype=np.int32), self.n_candidates
        return sparse.csr_matrix((one, self.neighbour, self.starts), shape=(n, n))

    @cached_property
    def opposite(self) -> Int64Array:
        """(M,) for each entry of `neighbour`, a link one way, the entry of the same link the other way."""
        n = self.n_candidates
        tail = np.repeat(np.arange(n, dtype=np.int64), np.diff(self.starts))
        found: Int64Array = np.searchsorted(tail * n + self.neighbour, self.neighbour * np.int64(n) + tail).astype(
            np.int64
        )
        return found

    @cached_property
    def bridges(self) -> frozenset[tuple[int, int]]:
        """Links (a, b), a < b, whose failure parts the candidates' graph itself: with `loops` they are let pass."""
        linked = [self.neighbours(candidate).tolist() for candidate in range(self.n_candidates)]
        return frozenset(_components_bridges_and_pieces(linked)[1])

    def spared_links(self) -> tuple[Int32Array, Int32Array]:
        """Other ends of each candidate's `bridges` as CSR rows, (N + 1,) and (M,) int32; none without `loops`."""
        bridges = self.bridges if self.loops else frozenset()
        ends = np.array(sorted([*bridges, *((b, a) for a, b in bridges)]), dtype=np.int32).reshape(-1, 2)
        return np.searchsorted(ends[:, 0], np.arange(self.n_candidates + 1)).astype(np.int32), ends[:, 1].copy()

    def links_among(self, chosen: Sequence[int]) -> list[list[int]]:
        """Places in `chosen` that each of the chosen candidates is linked to, in ascending order."""
        place = np.full(self.n_candidates, -1, dtype=np.int64)
        place[list(chosen)] = np.arange(len(chosen))
        found = []
        for candidate in chosen:
            at = place[self.neighbours(candidate)]
            found.append(np.sort(at[at >= 0]).tolist())
        return found

    def n_violations(self, chosen: Sequence[int]) -> int:
        """Components of `chosen` beyond one a part, and with `loops` avoidable bridges; 0: it is connected."""
        n_components, bridges, _ = _components_bridges_and_pieces(self.links_among(chosen))
        parts, n_of_part = np.unique(self.part[list(chosen)], return_counts=True)
        n_violations = n_components - int(parts.size)
        if self.loops:
            n_violations += sum(self._is_avoidable(chosen[a], chosen[b], parts, n_of_part) for a, b in bridges)
        return n_violations

    def completes(self, rest: Sequence[int]) -> Callable[[int], bool]:
        """Return a test of a candidate, not of `rest`: whether it and `rest` are connected.

        The same as `n_violations([*rest, candidate]) == 0`, for many candidates: without `loops` each costs its links
        alone.
        """
        component = np.full(self.n_candidates, -1, dtype=np.int64)
        component[list(rest)] = _components_of(self.links_among(rest))
        parts = {int(part) for part in self.part[list(rest)]}
        n_components = int(component.max(initial=-1)) + 1

        def hang_together(candidate: int) -> bool:
            near = component[self.neighbours(candidate)]
            n_left = n_components + 1 - np.unique(near[near >= 0]).size
            if n_left > len(parts | {int(self.part[candidate])}):
                return False
            return not self.loops or self.n_violations([*rest, candidate]) == 0

        return hang_together

    def can_spare(self, chosen: Sequence[int]) -> Callable[[int], bool]:
        """Return a test of a place in `chosen`: whether the others are connected without the candidate there.

        The same as `n_violations` of the others being 0, for many places: without `loops` all of them cost one search.
        """
        n_components, _, n_pieces = _components_bridges_and_pieces(self.links_among(chosen))
        parts, of_part, n_of_part = np.unique(self.part[list(chosen)], return_inverse=True, return_counts=True)

        def hang_together(place: int) -> bool:
            alone = int(n_of_part[of_part[place]]) == 1
            if n_components - 1 + n_pieces[place] > parts.size - alone:
                return False
            return not self.loops or self.n_violations([*chosen[:place], *chosen[place + 1 :]]) == 0

        return hang_together

    def avoidable_bridges(self, chosen: Sequence[int]) -> list[tuple[int, int]]:
        """Links (a, b) of `chosen`, a < b, that are bridges and might not be: what `loops` forbids."""
        parts, n_of_part = np.unique(self.part[list(chosen)], return_counts=True)
        return sorted(
            (min(chosen[a], chosen[b]), max(chosen[a], chosen[b]))
            for a, b in _components_bridges_and_pieces(self.links_among(chosen))[1]
            if self._is_avoidable(chosen[a], chosen[b], parts, n_of_part)
        )

    def _is_avoidable(self, a: int, b: int, parts: Int32Array, n_of_part: Int64Array) -> bool:
        n_chosen = int(n_of_part[np.searchsorted(parts, self.part[a])])
        return n_chosen > 2 and (min(a, b), max(a, b)) not in self.bridges


def network_within(network: Network, keep: BoolArray) -> Network:
    """The links among some candidates, (N,) bool, numbered anew; parts keep their numbers."""
    if keep.all():
        return network
    number = np.cumsum(keep) - 1
    owner = np.repeat(np.arange(network.n_candidates), np.diff(network.starts))
    kept = keep[owner] & keep[network.neighbour]
    n_links = np.bincount(number[owner[kept]], minlength=int(keep.sum()))
    return Network(
        starts=np.concatenate([[0], np.cumsum(n_links)]).astype(np.int64),
        neighbour=number[network.neighbour[kept]].astype(np.int32),
        part=network.part[keep],
        loops=network.loops,
    )


def _components_of(linked: list[list[int]]) -> list[int]:
    """Number of each node's component, from 0 in the order of their first nodes."""
    number = [-1] * len(linked)
    n_components = 0
    for root in range(len(linked)):
        if number[root] >= 0:
            continue
        number[root] = n_components
        front = [root]
        while front:
            for other in linked[front.pop()]:
                if number[other] < 0:
                    number[other] = n_components
                    front.append(other)
        n_components += 1
    return number


def connect(problem: CoverProblem, network: Network, chosen: Sequence[int]) -> list[int]:
    """Connect `chosen` by further candidates; it always can be, see `Network`."""
    now = list(chosen)
    while (more := _between_components(problem, network, now)) is not None:
        now += more
    if network.loops:
        while bridges := network.avoidable_bridges(now):
            now += _way_round(problem, network, now, bridges[0])
    return now


class _Gains:
    """Ticks of looks that candidates add to those of a set, over all targets."""

    def __init__(self, problem: CoverProblem, chosen: list[int]) -> None:
        n_seen = problem.times_seen(chosen)
        self._problem = problem
        self._wanted = (problem.counts_for & (n_seen < problem.seen_from[:, None])).sum(axis=0) * problem.ticks

    def of(self, candidates: Int64Array) -> Int64Array:
        """(N',) ticks."""
        return np.array([self._wanted[self._problem.rows_of(c)].sum() for c in candidates], dtype=np.int64)


def _components_bridges_and_pieces(linked: list[list[int]]) -> tuple[int, list[tuple[int, int]], list[int]]:
    """Number of components, links (a, b), a < b, whose failure makes one more of them, and pieces around each node.

    Pieces: what a node's component falls into without it, none where it is alone. Depth first, without recursion: a
    link to a node from which nothing before it can be reached another way is a bridge (Tarjan 1974).
    """
    n = len(linked)
    found, low, parent, following = [0] * n, [0] * n, [-1] * n, [0] * n
    bridges = []
    n_pieces = [0] * n
    n_components = time = 0
    for root in range(n):
        if found[root]:
            continue
        n_components += 1
        time += 1
        found[root] = low[root] = time
        node = root
        while node >= 0:
            if following[node] < len(linked[node]):
                other = linked[node][following[node]]
                following[node] += 1
                if not found[other]:
                    time += 1
                    found[other] = low[other] = time
                    parent[other] = node
                    node = other
                elif other != parent[node]:
                    low[node] = min(low[node], found[other])
                continue
            above = parent[node]
            if above >= 0:
                n_pieces[node] += 1  # what is above it
                n_pieces[above] += low[node] >= found[above]
                low[above] = min(low[above], low[node])
                if low[node] > found[above]:
                    bridges.append((min(above, node), max(above, node)))
            node = above
    return n_components, bridges, n_pieces


def _between_components(problem: CoverProblem, network: Network, chosen: list[int]) -> list[int] | None:
    """Candidates of a shortest way between two components of one part; None: there are no two."""
    side = np.full(network.n_candidates, -1, dtype=np.int64)
    side[chosen] = _components_of(network.links_among(chosen))
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
    component = np.array(_components_of(linked))
    side = np.full(network.n_candidates, -1, dtype=np.int64)
    for end in ends:
        side[np.array(chosen)[component == component[end]]] = component[end]
    return _shortest_way(problem, network, chosen, side, excluded=bridge)


def _shortest_way(
    problem: CoverProblem,
    network: Network,
    chosen: list[int],
    side: Int64Array,
    *,
    excluded: tuple[int, int] | None = None,
) -> list[int]:
    """Candidates, none of them chosen, by which two sides become linked: the fewest.

    side : (N,), the side of all chosen candidates of the parts in question, -1 elsewhere. There must be a way.
    """
    source = np.repeat(np.arange(network.n_candidates), np.diff(network.starts))
    ends = np.stack([source, network.neighbour])
    if excluded is not None:
        ends = ends[:, ~((np.sort(ends, axis=0) == np.array(excluded)[:, None]).all(axis=0))]
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
