"""Simulated annealing: try neighbours in random order, and accept worse ones the more rarely the colder it is.

References
----------
López et al. 2023, section 3.5.3 and Eq. 8. As printed, exp((f' - f) / T) is at least 1 for a worse f': every move would
be accepted. The sign has to be the other one (Kirkpatrick et al.'s Metropolis rule, which the paper calls traditional).
The paper doesn't say which neighbour is tried; a sweep through all of them in random order, taking the first that is
accepted, is a random walk while it is hot and a local search when it is cold.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray
from planner_core.paper.search.agents import SearchState


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
