"""Greedy local search: go to the best neighbour while it is better than where one stands.

References
----------
López et al. 2023, section 3.5.2.
"""

from __future__ import annotations

import numpy as np

from planner_core.paper.search.walk import Walk, best_neighbour


class LocalSearch:
    """One step of each agent at a time; an agent whose neighbours are no better has ended."""

    def __init__(self, walk: Walk) -> None:
        self._walk = walk

    def step(self, iteration: int) -> None:
        """Move every agent to its best neighbour, but never back to where it came from, or end it."""
        del iteration
        walk = self._walk
        agents = np.flatnonzero(walk.moving)
        at = walk.neighbours(agents)
        choice, worth = best_neighbour(walk.look(at, ~walk.undoes(agents)))
        better = worth.beats(walk.worth.take(agents))
        walk.go(agents[better], at[better, choice[better]], worth.take(better), choice[better])
        walk.moving[agents[~better]] = False
