"""The searches, many agents at once, against one agent at a time in plain Python written from the paper's text."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.paper.search import SearchSettings, search
from planner_core.paper.search.agents import directions

BOUNDS = np.array([[-1.0, -1.0, 0.5], [1.0, 1.0, 2.0]])
ORIGIN = (0.01, -0.02, 0.6)


class LoneAgent:
    """One agent. `position = origin + step * at`; a worth is (F2, -F1), so that less is better."""

    def __init__(self, fitness, options: SearchSettings, start_m, number: int) -> None:
        self.fitness, self.options = fitness, options
        self.moves = [tuple(move) for move in directions(options)]
        self.stream = np.random.Generator(np.random.Philox(np.random.SeedSequence(options.seed, spawn_key=(number,))))
        raw = [(start_m[k] - options.lattice_origin_m[k]) / options.step_m for k in range(3)]
        self.at = tuple(float(round(x)) if abs(x - round(x)) < 1e-6 else x for x in raw)
        self.last = None
        self.path = [self.at]

    def metres(self, at):
        return np.array([o + self.options.step_m * x for o, x in zip(self.options.lattice_origin_m, at, strict=True)])

    def worth(self, at):
        where = self.metres(at)
        if any(where < BOUNDS[0]) or any(where > BOUNDS[1]):
            return (math.inf, 0)
        valid, f1, f2 = self.fitness.evaluate(where[None])
        return (float(f2[0]), -int(f1[0])) if valid[0] else (math.inf, 0)

    def constraint(self, d):
        return tuple(a + m for a, m in zip(self.at, self.moves[d], strict=True))

    def goes_back(self, d):
        if self.last is None:
            return False
        g, h = self.moves[d], self.moves[self.last]
        dot = sum(a * b for a, b in zip(g, h, strict=True)) / (math.hypot(*g) * math.hypot(*h))
        return dot < self.options.reversal_slack - 1

    def ls(self):
        for _ in range(self.options.max_iterations):
            choices = [(self.worth(self.constraint(d)), d) for d in range(len(self.moves)) if not self.goes_back(d)]
            if not min(choices)[0] < self.worth(self.at):
                break
            self.last = min(choices)[1]
            self.at = self.constraint(self.last)
            self.path.append(self.at)
        return self.path

    def sa(self):
        temperature = self.options.initial_temperature
        for _ in range(self.options.max_iterations):
            if temperature < self.options.least_temperature:
                break
            n = len(self.moves)
            drawn = self.stream.random(2 * n)
            present = self.worth(self.at)[0]
            order = sorted(range(n), key=lambda d: drawn[d])
            chosen = None
            for d, chance in zip(order, drawn[n:], strict=True):
                new = self.worth(self.constraint(d))[0]
                if self.goes_back(d) or new == math.inf:
                    continue
                if new - present < 0 or chance < math.exp(-(new - present) / temperature):
                    chosen = d
                    break
            self.last = chosen
            self.at = self.at if chosen is None else self.constraint(chosen)
            self.path.append(self.at)
            temperature *= self.options.cooling
        return self.path

    def random_places(self, places):
        for n in (1, 2, 4, 8, 16, 32, 64):  # drawn at a time, whether or not all are needed
            for drawn in self.stream.random(3 * n).reshape(n, 3).tolist():
                place = [float(r[math.floor(u * len(r))]) for r, u in zip(places, drawn, strict=True)]
                yield (place[0], place[1], self.at[2] if self.options.fixed_height else place[2])

    def ts(self):
        o = self.options
        voxel = lambda at: tuple(math.floor(x / o.tabu_voxel_steps) for x in at)  # noqa: E731
        places = [
            range(
                math.ceil((BOUNDS[0][k] - o.lattice_origin_m[k]) / o.step_m - 1e-9),
                math.floor((BOUNDS[1][k] - o.lattice_origin_m[k]) / o.step_m + 1e-9) + 1,
            )
            for k in range(3)
        ]
        tabu, best, stale = {voxel(self.at)}, self.worth(self.at), 0
        for _ in range(o.max_iterations):
            choices = [(self.worth(self.constraint(d)), d) for d in range(len(self.moves))]
            choices = [(w, d) for w, d in choices if voxel(self.constraint(d)) not in tabu and w[0] < math.inf]
            anew = stale >= o.max_without_improvement or not choices or min(choices)[0] > self.worth(self.at)
            if anew:
                for at in self.random_places(places):
                    if voxel(at) not in tabu and self.worth(at)[0] < math.inf:
                        self.at, stale = at, 0
                        break
            else:
                self.at = self.constraint(min(choices)[1])
                stale += 1
            if self.worth(self.at) < best:
                best, stale = self.worth(self.at), 0
            tabu.add(voxel(self.at))
            self.path.append(self.at)
        return self.path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "neighbourhood", "fixed_height"), list(product(("ls", "sa", "ts"), ("cube", "sphere"), (False, True)))
)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 2**31), off=st.integers(-300, 300))
def test_many_agents_go_the_way_of_one_alone(method, neighbourhood, fixed_height, seed, off, make_rugged) -> None:
    options = SearchSettings(
        seed=seed,
        max_iterations=25,
        max_without_improvement=4,
        neighbourhood=neighbourhood,
        fixed_height=fixed_height,
        initial_temperature=20.0,
        memoised=False,
        lattice_origin_m=ORIGIN,
    )
    terrain = make_rugged((0.003 * off, 0.2, 1.2))
    steps = np.random.default_rng(seed).integers(-15, 15, (5, 3))
    starts = np.array(ORIGIN) + 0.05 * steps
    starts[3] += 0.017  # one agent is off the lattice
    found = search(method, starts, terrain, options, bounds_m=BOUNDS)
    for number, start in enumerate(starts):
        lone = LoneAgent(make_rugged((0.003 * off, 0.2, 1.2)), options, start, number)
        path = np.array([lone.metres(at) for at in getattr(lone, method)()])
        path = np.concatenate([path, np.repeat(path[-1:], found.history.f2.shape[0] - len(path), axis=0)])
        np.testing.assert_array_equal(found.history.position_m[:, number], path, err_msg=f"seed {seed} agent {number}")
