"""Tabu search: like local search, but never twice into one voxel, and anew elsewhere when there is nowhere to go.

References
----------
López et al. 2023, section 3.5.4. An agent begins anew where all its neighbours are tabu (or not valid), where the best
of the others is worse than both its present and its best position, or where it has found no new best for some
iterations. The best is never worse than the present one, so that the second rule reads: worse than the present one.
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
