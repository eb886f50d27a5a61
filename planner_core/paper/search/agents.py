"""The agents of a search: where each stands, what that is worth, the best it has seen, and how it came there.

All agents step together, so that a landscape evaluates many positions at once. Nothing of an agent depends on the
others: each has its own random stream, of the seed and its number among the starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.search.landscape import Fitness, Landscape, Worth
from planner_core.paper.search.neighbourhood import directions, undoing


@dataclass(frozen=True)
class SearchHistory:
    """Where each of N agents was after each of I iterations, row 0 being its start. An agent that ended stays.

    position_m : (I + 1, N, 3) float64, local frame. f1 : (I + 1, N) int64. f2 : (I + 1, N) float64; 0 and inf where the
    position is not valid, which only starts can be. restarted : (I + 1, N) bool, whether tabu search began anew there.
    n_iterations : (N,) int64, how many iterations the agent took part in; that in which it found nothing counts.
    """

    position_m: FloatArray
    f1: Int64Array
    f2: FloatArray
    restarted: BoolArray
    n_iterations: Int64Array


@dataclass(frozen=True)
class SearchResult:
    """What N agents found.

    position_m : (N, 3) float64, local frame, the best position of each: least F2, among equals most F1, among those the
    first. f1 : (N,) int64. f2 : (N,) float64, inf where an agent never stood at a valid position.
    """

    position_m: FloatArray
    f1: Int64Array
    f2: FloatArray
    history: SearchHistory
    n_evaluations: int
    """Positions evaluated by the fitness."""
    n_hits: int
    """Positions that were remembered instead."""

    @property
    def found(self) -> BoolArray:
        """(N,) bool: whether the agent stood at a valid position at all."""
        return np.isfinite(self.f2)


class SearchState:
    """The state of a search that its methods change, in lattice coordinates, see `planner_core.paper.search.landscape`.

    at (N, 3), worth; moving (N,) bool, whether an agent still searches; last (N,) the direction of its last move, -1
    after a restart or where it did not move.
    """

    def __init__(self, starts_m: FloatArray, fitness: Fitness, settings: SearchSettings, bounds_m: FloatArray) -> None:
        self.settings = settings
        self.bounds_m = bounds_m
        self.landscape = Landscape(fitness, settings, bounds_m)
        self.at = self.landscape.coordinates(starts_m)
        self.worth = self.landscape.look(self.at)
        self.best_at, self.best = self.at.copy(), self.worth.copy()
        self.moving = np.ones(self.n_agents, dtype=bool)
        self.last = np.full(self.n_agents, -1, dtype=np.int64)
        self.restarted = np.zeros(self.n_agents, dtype=bool)
        moves = directions(settings)
        self._moves = moves * settings.cells_a_step
        # The last row answers for agents without a last move, whose direction is -1.
        self._undoing = np.vstack([undoing(moves, settings.reversal_slack), np.zeros((1, moves.shape[0]), dtype=bool)])
        self._streams: list[np.random.Generator] = []
        self._n_iterations = np.zeros(self.n_agents, dtype=np.int64)
        self._rows: list[tuple[FloatArray, Worth, BoolArray]] = []
        self.record()

    @property
    def n_agents(self) -> int:
        """Number of agents."""
        return int(self.at.shape[0])

    @property
    def n_directions(self) -> int:
        """Number of neighbours of a position."""
        return int(self._moves.shape[0])

    def random(self, agents: Int64Array, n: int) -> FloatArray:
        """(A, n) uniform numbers in [0, 1), each row from its agent's own stream."""
        if not self._streams:
            self._streams = [_stream(self.settings.seed or 0, agent) for agent in range(self.n_agents)]
        return np.array([self._streams[agent].random(n) for agent in agents]).reshape(agents.size, n)

    def neighbours(self, agents: Int64Array) -> FloatArray:
        """(A, D, 3): where each direction leads."""
        return self.landscape.arrive(self.at[agents, None, :] + self._moves)

    def undoes(self, agents: Int64Array) -> BoolArray:
        """(A, D): whether a direction undoes the agent's last move."""
        return np.asarray(self._undoing[self.last[agents]])

    def look(self, at: FloatArray, wanted: BoolArray) -> Worth:
        """Worth of coordinates (A, D, 3) where `wanted` (A, D), that of invalid positions elsewhere."""
        out = Worth.of_nothing(wanted.shape)
        out.put(wanted, self.landscape.look(at[wanted]))
        return out

    def go(self, agents: Int64Array, at: FloatArray, worth: Worth, direction: Int64Array | int) -> None:
        """Move agents to coordinates (A, 3) of known worth."""
        self.at[agents], self.last[agents] = at, direction
        self.worth.put(agents, worth)
        new = worth.beats(self.best.take(agents))
        self.best_at[agents[new]] = at[new]
        self.best.put(agents[new], worth.take(new))

    def record(self) -> None:
        """Append the present state to the history."""
        self._rows.append((self.at.copy(), self.worth.copy(), self.restarted.copy()))

    def count_iteration(self) -> None:
        """Count an iteration for all that are still moving."""
        self._n_iterations[self.moving] += 1

    def result(self) -> SearchResult:
        """What was found so far."""
        history = SearchHistory(
            position_m=self.landscape.positions_m(np.stack([at for at, _, _ in self._rows])),
            f1=np.stack([worth.f1 for _, worth, _ in self._rows]),
            f2=np.stack([worth.f2 for _, worth, _ in self._rows]),
            restarted=np.stack([restarted for _, _, restarted in self._rows]),
            n_iterations=self._n_iterations,
        )
        return SearchResult(
            position_m=self.landscape.positions_m(self.best_at),
            f1=self.best.f1,
            f2=self.best.f2,
            history=history,
            n_evaluations=self.landscape.n_evaluations,
            n_hits=self.landscape.n_hits,
        )


def best_neighbour(worth: Worth) -> tuple[Int64Array, Worth]:
    """(A,) the best of each row of (A, D), the lower number among equals, and its worth (A,)."""
    least = worth.f2 == worth.f2.min(axis=1, keepdims=True)
    choice = np.argmax(np.where(least, worth.f1, -1), axis=1)
    return choice, worth.pick(np.arange(choice.size), choice)


def _stream(seed: int, agent: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(agent,))))
