"""Small problems, and the operators of both engines behind one face."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.model import Visibility
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic import operators as host
from planner_core.paper.genetic.objective import objective_of
from planner_core.paper.genetic.on_device import DEFAULT_SHAPE, SHAPES, Population
from planner_core.paper.genetic.philox import Draws
from planner_core.select.bit_rows import lay_out, pack
from planner_core.select.problem import Constraint, CoverProblem, cover_problem


def problem_of(sees: np.ndarray, ticks: np.ndarray, counts_for: np.ndarray, required: np.ndarray) -> CoverProblem:
    """A problem straight from a matrix: nothing is merged."""
    candidate, row = np.nonzero(sees)
    starts = np.searchsorted(candidate, np.arange(len(sees) + 1))
    required = np.asarray(required, dtype=np.int64)
    return CoverProblem(starts, row, np.asarray(ticks, dtype=np.int64), counts_for, required, required)


def random_problem(seed: int, *, n_candidates: int = 40, n_patches: int = 300, density: float = 0.1) -> CoverProblem:
    """Merged rows of random visibility, with two targets that overlap."""
    rng = np.random.default_rng(seed)
    rows = [np.flatnonzero(row) for row in rng.random((n_candidates, n_patches)) < density]
    starts = np.cumsum([0, *(row.size for row in rows)]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), n_patches)
    part = np.arange(n_patches) < n_patches // 3
    constraints = (Constraint(part, 0.8), Constraint(np.full(n_patches, True), 0.9))
    return cover_problem(visibility, rng.uniform(0.001, 0.3, n_patches), constraints)


def unpack(words: np.ndarray, n_genes: int) -> np.ndarray:
    return np.unpackbits(words.astype("<u4").view(np.uint8), axis=1, count=n_genes, bitorder="little").astype(bool)


class OnHost:
    """Operators in NumPy."""

    def __init__(self, settings: GeneticSettings, n_genes: int) -> None:
        self._settings, self._n_genes, self._draws = settings, n_genes, Draws(settings.seed)

    def start(self) -> np.ndarray:
        everybody = np.arange(self._settings.population)
        genes = host.random_individuals(self._draws, self._settings, everybody, self._n_genes)
        host.mend(self._draws, 0, genes)
        return genes

    def pool(self, iteration: int, order: np.ndarray) -> np.ndarray:
        return host.mating_pool(self._draws, self._settings, iteration, order)

    def breed(self, iteration: int, genes: np.ndarray, pool: np.ndarray) -> np.ndarray:
        return host.breed(self._draws, self._settings, iteration, genes, pool)

    def replace(self, genes: np.ndarray, key: np.ndarray, offspring: np.ndarray, offspring_key: np.ndarray) -> Any:
        genes, key, offspring_key = genes.copy(), key.copy(), offspring_key.copy()
        if self._settings.distinct:
            host.bar_twins(genes, offspring, offspring_key)
        taken, places = host.places_of_offspring(self._settings, host.rank(key), key, offspring_key)
        genes[places], key[places] = offspring[taken], offspring_key[taken]
        return genes, key


class OnDevice:
    """The same as kernels."""

    def __init__(self, settings: GeneticSettings, n_genes: int, device: Device) -> None:
        self._settings, self._n_genes, self._device = settings, n_genes, device
        sees = np.eye(n_genes, dtype=bool)
        problem = problem_of(sees, np.ones(n_genes), np.full((1, n_genes), True), np.array([1]))
        shape = SHAPES.get(device.kind, DEFAULT_SHAPE)
        tiles, objective = lay_out(problem, words=shape.words), objective_of(problem, settings)
        self.on = Population(device, shape, tiles, settings, objective, problem)

    def start(self) -> np.ndarray:
        self.on.start(np.zeros((0, self._n_genes), dtype=bool))
        return self._genes("genes", self._settings.population)

    def pool(self, iteration: int, order: np.ndarray) -> np.ndarray:
        self._write(state=np.array([iteration - 1, 0, 0]), order=order)
        self.on.fill_pool()
        return self._read("pool", self._settings.n_parents, np.int32)

    def breed(self, iteration: int, genes: np.ndarray, pool: np.ndarray) -> np.ndarray:
        self._write(state=np.array([iteration - 1, 0, 0]), pool=pool)
        self.on.buffers["genes"] = self._device.upload("test", {"genes": pack(genes)})["genes"]
        self.on.breed()
        self.on.judge("offspring", "offspring_facts", self._settings.n_offspring)
        return self._genes("offspring", self._settings.n_offspring)

    def replace(self, genes: np.ndarray, key: np.ndarray, offspring: np.ndarray, offspring_key: np.ndarray) -> Any:
        self._write(state=np.zeros(3))
        facts = {"genes": pack(genes), "offspring": pack(offspring)}
        facts |= {"facts": np.vstack([key, key * 0, key * 0]).astype(np.int64)}
        facts |= {"offspring_facts": np.vstack([offspring_key] * 3).astype(np.int64)}
        self.on.buffers |= self._device.upload("test", facts)
        self.on.rank("facts", self._settings.population, "order")
        self.on.replace()
        return (
            self._genes("genes", self._settings.population),
            self._read("facts", self._settings.population, np.int64),
        )

    def _write(self, **arrays: np.ndarray) -> None:
        self.on.buffers |= self._device.upload("test", {name: a.astype(np.int32) for name, a in arrays.items()})

    def _read(self, name: str, n: int, kind: type) -> np.ndarray:
        out = np.empty(n, dtype=kind)
        self._device.read(self.on.buffers[name], out)
        return out

    def _genes(self, name: str, n: int) -> np.ndarray:
        words = self._read(name, n * -(-self._n_genes // 32), np.uint32).reshape(n, -1)
        return unpack(words, self._n_genes)


@pytest.fixture(params=["host", pytest.param("device", marks=pytest.mark.slow)])
def operators(request: pytest.FixtureRequest, device: Device) -> Iterator[Callable[..., Any]]:
    """`operators(settings, n_genes)`: those of an engine; the same tests hold for both.

    Quick tests of the trajectory compare the kernels with the host.
    """
    made: list[OnDevice] = []

    def make(settings: GeneticSettings, n_genes: int) -> Any:
        if request.param == "host":
            return OnHost(settings, n_genes)
        made.append(OnDevice(settings, n_genes, device))
        return made[-1]

    yield make
    for each in made:
        each.on.release()


@pytest.fixture(scope="session")
def make_problem() -> Callable[..., CoverProblem]:
    return random_problem


@pytest.fixture(scope="session")
def matrix_problem() -> Callable[..., CoverProblem]:
    return problem_of


@pytest.fixture(scope="session")
def both_operators(device: Device) -> Callable[..., tuple[OnHost, OnDevice]]:
    """`both_operators(settings, n_genes)`: those of both engines; the caller releases `.on` of the second."""
    return lambda settings, n_genes: (OnHost(settings, n_genes), OnDevice(settings, n_genes, device))
