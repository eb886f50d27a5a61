"""`planner_core.select.annealing` in NumPy: what the compiled form must do."""

from __future__ import annotations

import numpy as np

from planner_core.model import Int32Array, Int64Array
from planner_core.paper.genetic.philox import philox
from planner_core.select.annealing_problem import TRIES, AnnealingProblem


class NumpyAnnealer:
    """See `Annealer`; one set after the other."""

    def __init__(self, annealed: AnnealingProblem) -> None:
        self._annealed = annealed

    def anneal(
        self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int = 0
    ) -> Int64Array:
        """See `Annealer`."""
        return np.array(
            [self._anneal(number, each, round_, steps, n_steps, n_pinned) for number, each in enumerate(sets)],
            dtype=np.int64,
        )

    def _anneal(
        self, number: int, chosen: Int32Array, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int
    ) -> int:
        annealed, problem = self._annealed, self._annealed.problem
        count = problem.times_seen(chosen.tolist())
        inside = np.zeros(problem.n_candidates, dtype=bool)
        inside[chosen] = True
        covered = self._by_class(np.arange(problem.n_rows), count, down=True)
        missing = self._missing(covered) + self._penalty(chosen)
        for step in range(*steps):
            if missing <= 0:
                break
            x = self._draws(round_, step, number)
            at_ticks = int(annealed.temperature[step * annealed.temperature.size // n_steps])
            place = n_pinned + (x[0][0] * (chosen.size - n_pinned) >> 32)
            out = int(chosen[place])
            rows = problem.rows_of(out)
            count[rows] -= 1
            without = covered - self._by_class(rows, count)
            for draw in x[1:]:
                other = self._candidate(chosen, out, draw)
                if other is None or inside[other]:
                    continue
                then_covered = without + self._by_class(problem.rows_of(other), count)
                then = self._missing(then_covered)
                most = missing + (at_ticks * int(annealed.acceptance[draw[2] >> 20]) >> 16)
                if then > most:
                    continue
                chosen[place] = other
                then += self._penalty(chosen)
                if then <= most:
                    missing, covered = then, then_covered
                    break
                chosen[place] = out
            count[problem.rows_of(int(chosen[place]))] += 1
            inside[out] = False
            inside[chosen[place]] = True
        return missing

    def _draws(self, round_: int, step: int, number: int) -> list[list[int]]:
        words = [np.uint64(word) for word in (round_, step, number)]
        drawn = philox((*words, np.arange(TRIES + 1, dtype=np.uint64)), self._annealed.seed)
        table: list[list[int]] = np.stack([np.broadcast_to(word, TRIES + 1) for word in drawn], axis=1).tolist()
        return table

    def _candidate(self, chosen: Int32Array, out: int, draw: list[int]) -> int | None:
        """Whom to try for the place of `out`, which `chosen` still holds; None: nobody."""
        first, second, _, fourth = draw
        nearest, network = self._annealed.nearest, self._annealed.network
        way = first * (4 if network is None else 8) >> 32
        if network is not None and way in (1, 2):
            linked = network.neighbours(int(chosen[fourth * chosen.size >> 32]))
            return int(linked[second * linked.size >> 32]) if linked.size else None
        if way:
            return int(nearest[out, second * nearest.shape[1] >> 32])
        return second * self._annealed.problem.n_candidates >> 32

    def _by_class(self, rows: Int64Array, count: Int64Array, *, down: bool = False) -> Int64Array:
        """(classes, levels) ticks of `rows` that one more look brings to 1 .. levels; `down`: that have so many."""
        ticks: Int64Array = np.zeros((self._annealed.counts.shape[1], self._annealed.n_levels), dtype=np.int64)
        looks, class_of, worth = count[rows], self._annealed.class_of[rows], self._annealed.problem.ticks[rows]
        for level in range(self._annealed.n_levels):
            counts = looks > level if down else looks == level
            np.add.at(ticks[:, level], class_of[counts], worth[counts])
        return ticks

    def _missing(self, covered: Int64Array) -> int:
        problem = self._annealed.problem
        left = np.maximum(problem.required[:, None] - self._annealed.counts @ covered, 0)
        return int(left[np.arange(left.shape[1]) < problem.seen_from[:, None]].sum())

    def _penalty(self, chosen: Int32Array) -> int:
        network = self._annealed.network
        return 0 if network is None else self._annealed.penalty * network.n_violations(chosen.tolist())
