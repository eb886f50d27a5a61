"""Walks of `planner_core.select.swap_walks` in NumPy: what kernel and host must do."""

from __future__ import annotations

import numpy as np

from planner_core.model import Int32Array, Int64Array
from planner_core.paper.genetic.philox import philox
from planner_core.select.swap_walks import TRIES, Terrain


class NumpyWalks:
    """See `Walks`; one walk after the other."""

    def __init__(self, terrain: Terrain) -> None:
        self._terrain = terrain

    def walk(
        self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int = 0
    ) -> Int64Array:
        """See `Walks`."""
        return np.array(
            [self._walk(number, each, round_, steps, n_steps, n_pinned) for number, each in enumerate(sets)],
            dtype=np.int64,
        )

    def _walk(
        self, number: int, chosen: Int32Array, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int
    ) -> int:
        terrain, problem = self._terrain, self._terrain.problem
        count = problem.times_seen(chosen.tolist())
        inside = np.zeros(problem.n_candidates, dtype=bool)
        inside[chosen] = True
        covered = self._by_class(np.arange(problem.n_rows), count, down=True)
        missing = self._missing(covered) + self._penalty(chosen)
        for step in range(*steps):
            if missing <= 0:
                break
            x = self._draws(round_, step, number)
            warmth = int(terrain.heat[step * terrain.heat.size // n_steps])
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
                most = missing + (warmth * int(terrain.luck[draw[2] >> 20]) >> 16)
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
        drawn = philox((*words, np.arange(TRIES + 1, dtype=np.uint64)), self._terrain.seed)
        table: list[list[int]] = np.stack([np.broadcast_to(word, TRIES + 1) for word in drawn], axis=1).tolist()
        return table

    def _candidate(self, chosen: Int32Array, out: int, draw: list[int]) -> int | None:
        """Whom to try for the place of `out`, which `chosen` still holds; None: nobody."""
        first, second, _, fourth = draw
        near, network = self._terrain.near, self._terrain.network
        way = first * (4 if network is None else 8) >> 32
        if network is not None and way in (1, 2):
            linked = network.neighbours(int(chosen[fourth * chosen.size >> 32]))
            return int(linked[second * linked.size >> 32]) if linked.size else None
        if way:
            return int(near[out, second * near.shape[1] >> 32])
        return second * self._terrain.problem.n_candidates >> 32

    def _by_class(self, rows: Int64Array, count: Int64Array, *, down: bool = False) -> Int64Array:
        """(classes, levels) ticks of `rows` that one more look brings to 1 .. levels; `down`: that have so many."""
        ticks: Int64Array = np.zeros((self._terrain.counts.shape[1], self._terrain.n_levels), dtype=np.int64)
        looks, class_of, worth = count[rows], self._terrain.class_of[rows], self._terrain.problem.ticks[rows]
        for level in range(self._terrain.n_levels):
            counts = looks > level if down else looks == level
            np.add.at(ticks[:, level], class_of[counts], worth[counts])
        return ticks

    def _missing(self, covered: Int64Array) -> int:
        problem = self._terrain.problem
        left = np.maximum(problem.required[:, None] - self._terrain.counts @ covered, 0)
        return int(left[np.arange(left.shape[1]) < problem.seen_from[:, None]].sum())

    def _penalty(self, chosen: Int32Array) -> int:
        network = self._terrain.network
        return 0 if network is None else self._terrain.penalty * network.faults(chosen.tolist())
