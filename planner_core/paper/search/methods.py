"""The methods of spatial search: how each agent of a `SearchState` makes one step.

- Greedy local search goes to the best neighbour while it is better than where one stands.
- Simulated annealing tries neighbours in random order, and accepts worse ones the more rarely the colder it is.
- Tabu search is like local search, but goes never twice into one voxel, and anew elsewhere when there is nowhere to go.

References
----------
López et al. 2023, sections 3.5.2, 3.5.3 and 3.5.4. Of their annealing: as printed, Eq. 8, exp((f' - f) / T), is at
least 1 for a worse f': every move would be accepted. The sign has to be the other one (Kirkpatrick et al.'s Metropolis
rule, which the paper calls traditional). The paper doesn't say which neighbour is tried; a sweep through all of them in
random order, taking the first that is accepted, is a random walk while it is hot and a local search when it is cold.

Of their tabu search: an agent begins anew where all its neighbours are tabu (or not valid), where the best of the
others is worse than both its present and its best position, or where it has found no new best for some iterations. The
best is never worse than the present one, so that the second rule reads: worse than the present one.
"""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.paper.search.agents import SearchState, best_neighbour
from planner_core.paper.search.landscape import keys

#: Random places that an agent tries at a time when it begins anew: first few, as mostly one will do, then ever more.
#: If none of these 127 is valid it waits for the next iteration; where 5 % of the places are, so does one in 700.
DRAWS = (1, 2, 4, 8, 16, 32, 64)


class LocalSearch:
    """One step of each agent at a time; an agent whose neighbours are no better has ended."""

    def __init__(self, state: SearchState) -> None:
        self._state = state

    def step(self, iteration: int) -> None:
        """Move every agent to its best neighbour, but never back to where it came from, or end it."""
        del iteration
        state = self._state
        agents = np.flatnonzero(state.moving)
        at = state.neighbours(agents)
        choice, worth = best_neighbour(state.look(at, ~state.undoes(agents)))
        better = worth.beats(state.worth.take(agents))
        state.go(agents[better], at[better, choice[better]], worth.take(better), choice[better])
        state.moving[agents[~better]] = False


class Annealing:
    """One step of each agent at a time; all end together, when it is colder than the threshold."""

    def __init__(self, state: SearchState) -> None:
        self._state = state

    def step(self, iteration: int) -> None:
        """Move every agent to the first neighbour, of a random order, that is accepted; or leave it where it is."""
        state, settings = self._state, self._state.settings
        temperature = settings.initial_temperature * settings.cooling ** (iteration - 1)
        agents = np.flatnonzero(state.moving)
        # All random numbers of an iteration are drawn at once, whatever comes of them: streams stay in step.
        drawn = state.random(agents, 2 * state.n_directions)
        order = np.argsort(drawn[:, : state.n_directions], axis=1, kind="stable")
        chance = drawn[:, state.n_directions :]
        at = np.take_along_axis(state.neighbours(agents), order[:, :, None], axis=1)
        wanted = np.take_along_axis(~state.undoes(agents), order, axis=1)
        waiting = np.arange(agents.size)
        state.last[agents] = -1
        start = 0
        while start < state.n_directions and waiting.size:
            # Most are soon accepted while it is hot: few are evaluated first, then ever more at a time.
            part = slice(start, start + max(1, start))
            worth = state.look(at[waiting, part], wanted[waiting, part])
            accepted = chance[waiting, part] < acceptance(
                worth.f2, state.worth.f2[agents[waiting], None], temperature=temperature
            )
            moves = np.flatnonzero(accepted.any(axis=1))
            first = accepted[moves].argmax(axis=1)
            who = waiting[moves]
            state.go(agents[who], at[who, start + first], worth.pick(moves, first), order[who, start + first])
            waiting = np.delete(waiting, moves)
            start = part.stop
        state.moving[:] = temperature * settings.cooling >= settings.least_temperature


def acceptance(new_f2: FloatArray, f2: FloatArray, *, temperature: float) -> FloatArray:
    """Probability of accepting `new_f2` in place of `f2`: exp(-(f' - f) / T), 1 where it is no worse.

    0 where the new position is not valid (inf), whatever the old one is.
    """
    with np.errstate(invalid="ignore"):  # inf - inf: from one invalid position to another
        chance = np.exp(-np.maximum(new_f2 - f2, 0.0) / temperature)
    return np.where(np.isfinite(new_f2), chance, 0.0)


class TabuSearch:
    """One step of each agent at a time; they go on to the last iteration."""

    def __init__(self, state: SearchState) -> None:
        self._state = state
        self._voxel_cells = state.settings.tabu_voxel_steps * state.settings.cells_a_step
        self._visited = self._voxels(state.at)[:, None]
        self._stale = np.zeros(state.n_agents, dtype=np.int64)
        self._low, self._n_places = self._places()

    def step(self, iteration: int) -> None:
        """Move every agent to its best neighbour that is neither tabu nor worse, or let it begin anew."""
        del iteration
        state = self._state
        state.restarted[:] = False
        best_before = state.best.copy()
        fresh = self._stale < state.settings.max_without_improvement
        moved = np.zeros(state.n_agents, dtype=bool)
        moved[self._walk_on(np.flatnonzero(fresh))] = True
        self._begin_anew(np.flatnonzero(~moved))
        self._visited = np.hstack([self._visited, self._voxels(state.at)[:, None]])
        improved = state.best.beats(best_before)
        self._stale = np.where(improved | state.restarted, 0, self._stale + 1)

    def is_tabu(self, agents: Int64Array, at: FloatArray) -> BoolArray:
        """(A, D) bool: whether coordinates (A, D, 3) lie in a voxel where the agent has been."""
        voxel = self._voxels(at)
        return np.asarray((voxel[:, :, None] == self._visited[agents][:, None, :]).any(axis=2))

    def _walk_on(self, agents: Int64Array) -> Int64Array:
        """Agents that found a neighbour to go to."""
        state = self._state
        at = state.neighbours(agents)
        choice, worth = best_neighbour(state.look(at, ~self.is_tabu(agents, at)))
        goes = np.isfinite(worth.f2) & ~state.worth.take(agents).beats(worth)
        state.go(agents[goes], at[goes, choice[goes]], worth.take(goes), choice[goes])
        return agents[goes]

    def _begin_anew(self, agents: Int64Array) -> None:
        """Put each agent at the first of its random places that is valid and not tabu."""
        state = self._state
        for n in DRAWS:
            if not agents.size:
                return
            at = self._draw(agents, n)
            worth = state.look(at, ~self.is_tabu(agents, at))
            good = np.isfinite(worth.f2)
            found = np.flatnonzero(good.any(axis=1))
            first = good[found].argmax(axis=1)
            state.go(agents[found], at[found, first], worth.pick(found, first), -1)
            state.restarted[agents[found]] = True
            agents = np.delete(agents, found)

    def _draw(self, agents: Int64Array, n: int) -> FloatArray:
        """(A, n, 3) random coordinates: whole steps from the lattice's origin, inside the bounds."""
        state = self._state
        drawn = state.random(agents, 3 * n).reshape(-1, n, 3)
        place = self._low + np.floor(drawn * self._n_places)
        at = state.landscape.arrive(place * state.settings.cells_a_step)
        if state.settings.fixed_height:
            at[:, :, 2] = state.at[agents, 2][:, None]
        return at

    def _places(self) -> tuple[FloatArray, FloatArray]:
        """First whole step inside the bounds and how many there are, both (3,)."""
        state = self._state
        steps = (state.bounds_m - state.landscape.origin_m) / state.settings.step_m
        low, high = np.ceil(steps[0] - 1e-9), np.floor(steps[1] + 1e-9)
        n_axes = 2 if state.settings.fixed_height else 3
        if (high < low)[:n_axes].any():
            raise RequirementError(
                f"bounds_m: got {state.bounds_m.tolist()}, expected room for at least one step of "
                f"{state.settings.step_m:g} m each way; widen them or shorten step_m"
            )
        return low, np.maximum(high - low + 1.0, 1.0)

    def _voxels(self, at: FloatArray) -> Int64Array:
        return keys(np.floor(at / self._voxel_cells))
