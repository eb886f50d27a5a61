"""Greedy local search: go to the best neighbour while it is better than where one stands.

References
----------
López et al. 2023, section 3.5.2.
"""

from __future__ import annotations

import numpy as np

from planner_core.paper.search.agents import SearchState, best_neighbour


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
