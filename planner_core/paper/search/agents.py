"""The agents of a search: where each stands, what that is worth, the best it has seen, and how it came there.

All agents step together, so that a landscape evaluates many positions at once. Nothing of an agent depends on the
others: each has its own random stream, of the seed and its number among the starts.

A position is moved in one of these directions, in steps:

    cube, 14: 6 faces and 8 corners         sphere, n: even directions
    square, 8 (fixed height)                circle, n (fixed height)

       o   o   o                                 . o .
       o   x   o   the square, seen            o       o    the circle
       o   o   o   from above                  .   x   .
                                               o       o
                                                 . o .

Every direction has its opposite, so that a move can be undone (and refused as undoing).

References
----------
López et al. 2023, section 3.5.1 and Fig. 8. They call all 14 vectors of the cube unit vectors and say that positions
repeat "due to the constant step length". Both hold only of the faces: corners here have components of one step, so that
positions stay on a lattice of one step, which is what their optimised version lives on.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.model.spatial_search import SearchSettings
from planner_core.paper.search.landscape import Fitness, Landscape, Worth

_GOLDEN_ANGLE_RAD = np.pi * (3.0 - np.sqrt(5.0))


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


def directions(settings: SearchSettings) -> FloatArray:
    """(D, 3) float64, moves in steps; z is zero at fixed height. Direction D - 1 - d is the opposite of d."""
    if settings.neighbourhood == "cube":
        return square() if settings.fixed_height else cube()
    return circle(settings.n_directions) if settings.fixed_height else sphere(settings.n_directions)


def cube() -> FloatArray:
    """(14, 3): (1, 0, 0) and the like, (1, 1, 1) and the like."""
    return np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(v) in (1, 3)])


def square() -> FloatArray:
    """(8, 3): the eight neighbours of a cell in a plane."""
    return np.array([(x, y, 0.0) for x, y in product((-1.0, 0.0, 1.0), repeat=2) if x or y])


def circle(n: int) -> FloatArray:
    """(n, 3): unit vectors in the plane, evenly from +x, n even."""
    angle = np.arange(n // 2) * (2.0 * np.pi / n)
    return _with_opposites(np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n // 2)]))


def sphere(n: int) -> FloatArray:
    """(n, 3): unit vectors, n even: the upper half of a Fibonacci lattice and its opposites.

    Notes
    -----
    Point k of m = n / 2 has height 1 - (k + 1/2) / m, so that each stands for the same area (Archimedes), and the
    golden angle more azimuth than the one before. The usual lattice of the whole sphere has no opposite directions.
    """
    k = np.arange(n // 2)
    up = 1.0 - (k + 0.5) / (n // 2)
    level, angle = np.sqrt(1.0 - up**2), k * _GOLDEN_ANGLE_RAD
    return _with_opposites(np.column_stack([level * np.cos(angle), level * np.sin(angle), up]))


def undoing(moves: FloatArray, slack: float) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """(D, D) bool: whether a move (column) undoes the last one (row): unit vectors' dot product < slack - 1."""
    unit = moves / np.linalg.norm(moves, axis=1)[:, None]
    return np.asarray(unit @ unit.T < slack - 1.0)


def _stream(seed: int, agent: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(agent,))))


def _with_opposites(half: FloatArray) -> FloatArray:
    return np.concatenate([half, -half[::-1]])
