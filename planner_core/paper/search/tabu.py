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
from planner_core.paper.search.landscape import keys
from planner_core.paper.search.walk import Walk, best_neighbour

#: Random places that an agent tries at a time when it begins anew: first few, as mostly one will do, then ever more.
#: If none of these 127 is valid it waits for the next iteration; where 5 % of the places are, so does one in 700.
DRAWS = (1, 2, 4, 8, 16, 32, 64)


class TabuSearch:
    """One step of each agent at a time; they go on to the last iteration."""

    def __init__(self, walk: Walk) -> None:
        self._walk = walk
        self._voxel_cells = walk.settings.tabu_voxel_steps * walk.settings.cells_a_step
        self._visited = self._voxels(walk.at)[:, None]
        self._stale = np.zeros(walk.n_agents, dtype=np.int64)
        self._low, self._n_places = self._places()

    def step(self, iteration: int) -> None:
        """Move every agent to its best neighbour that is neither tabu nor worse, or let it begin anew."""
        del iteration
        walk = self._walk
        walk.restarted[:] = False
        best_before = walk.best.copy()
        fresh = self._stale < walk.settings.max_without_improvement
        moved = np.zeros(walk.n_agents, dtype=bool)
        moved[self._walk_on(np.flatnonzero(fresh))] = True
        self._begin_anew(np.flatnonzero(~moved))
        self._visited = np.hstack([self._visited, self._voxels(walk.at)[:, None]])
        improved = walk.best.beats(best_before)
        self._stale = np.where(improved | walk.restarted, 0, self._stale + 1)

    def is_tabu(self, agents: Int64Array, at: FloatArray) -> BoolArray:
        """(A, D) bool: whether coordinates (A, D, 3) lie in a voxel where the agent has been."""
        voxel = self._voxels(at)
        return np.asarray((voxel[:, :, None] == self._visited[agents][:, None, :]).any(axis=2))

    def _walk_on(self, agents: Int64Array) -> Int64Array:
        """Agents that found a neighbour to go to."""
        walk = self._walk
        at = walk.neighbours(agents)
        choice, worth = best_neighbour(walk.look(at, ~self.is_tabu(agents, at)))
        goes = np.isfinite(worth.f2) & ~walk.worth.take(agents).beats(worth)
        walk.go(agents[goes], at[goes, choice[goes]], worth.take(goes), choice[goes])
        return agents[goes]

    def _begin_anew(self, agents: Int64Array) -> None:
        """Put each agent at the first of its random places that is valid and not tabu."""
        walk = self._walk
        for n in DRAWS:
            if not agents.size:
                return
            at = self._draw(agents, n)
            worth = walk.look(at, ~self.is_tabu(agents, at))
            good = np.isfinite(worth.f2)
            found = np.flatnonzero(good.any(axis=1))
            first = good[found].argmax(axis=1)
            walk.go(agents[found], at[found, first], worth.pick(found, first), -1)
            walk.restarted[agents[found]] = True
            agents = np.delete(agents, found)

    def _draw(self, agents: Int64Array, n: int) -> FloatArray:
        """(A, n, 3) random coordinates: whole steps from the lattice's origin, inside the bounds."""
        walk = self._walk
        drawn = walk.random(agents, 3 * n).reshape(-1, n, 3)
        place = self._low + np.floor(drawn * self._n_places)
        at = walk.landscape.arrive(place * walk.settings.cells_a_step)
        if walk.settings.fixed_height:
            at[:, :, 2] = walk.at[agents, 2][:, None]
        return at

    def _places(self) -> tuple[FloatArray, FloatArray]:
        """First whole step inside the bounds and how many there are, both (3,)."""
        walk = self._walk
        steps = (walk.bounds_m - walk.landscape.origin_m) / walk.settings.step_m
        low, high = np.ceil(steps[0] - 1e-9), np.floor(steps[1] + 1e-9)
        n_axes = 2 if walk.settings.fixed_height else 3
        if (high < low)[:n_axes].any():
            raise RequirementError(
                f"bounds_m: got {walk.bounds_m.tolist()}, expected room for at least one step of "
                f"{walk.settings.step_m:g} m each way; widen them or shorten step_m"
            )
        return low, np.maximum(high - low + 1.0, 1.0)

    def _voxels(self, at: FloatArray) -> Int64Array:
        return keys(np.floor(at / self._voxel_cells))
