"""The genetic loop on an OpenCL device: the host queues generations and looks at the best figures now and then.

CONTROL FLOW: chromosomes, fitness, ranking, replacement and the best solution stay on the device from start to end:
kernels/genetic_population.cl, kernels/genetic_cover.cl. `GENERATIONS_A_LOOK` generations are queued at once; a flag on
the device makes those after the last one do nothing, so that results do not depend on how often anybody looks.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, Program
from planner_core.model import BoolArray
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic.objective import EXHAUSTED, STALE, GeneticObjective, Trajectory, note
from planner_core.paper.genetic.operators import rate_range
from planner_core.paper.genetic.philox import threshold
from planner_core.progress import Progress
from planner_core.select.bit_rows import Tiles, lay_out, pack
from planner_core.select.problem import CoverProblem

#: Generations queued before the host looks at the state: looking costs a wait for the device.
GENERATIONS_A_LOOK = 16
_CROSSOVERS = {"one-point": 1, "two-point": 2, "uniform": 3}
_FACTS = 3
#: Iterations whose best figures the device keeps: those that can pass between two looks, and the one before.
_RING = GENERATIONS_A_LOOK + 1


@dataclass(frozen=True)
class WorkShape:
    """How work is cut for a kind of device; results do not depend on it.

    lanes, depth : words side by side, and vectors a work-item. slots : work-items that share a tile. n_runs : into how
    many runs individuals are divided; 0: each is one. n_breeders : work-items along words when breeding.
    """

    lanes: int
    depth: int
    slots: int
    n_runs: int
    n_breeders: int

    @property
    def words(self) -> int:
        """Words of a tile."""
        return self.lanes * self.depth * self.slots


#: CPU: measured on PoCL 3.0 (AVX2), docs/method/genetic-selection.md. Others: neighbours read neighbouring words.
SHAPES = {"cpu": WorkShape(lanes=8, depth=8, slots=1, n_runs=8, n_breeders=1)}
DEFAULT_SHAPE = WorkShape(lanes=1, depth=1, slots=32, n_runs=0, n_breeders=32)


def evolve_on_device(
    problem: CoverProblem,
    settings: GeneticSettings,
    objective: GeneticObjective,
    given: BoolArray,
    *,
    device: Device,
    progress: Progress,
) -> Trajectory:
    """Evolve a population whose first individuals are `given`, (n, N) bool.

    Raises
    ------
    DeviceError
        The device fails; `DeviceMemoryError` where coverage and population don't fit.
    """
    shape = SHAPES.get(device.kind, DEFAULT_SHAPE)
    tiles = lay_out(problem, words=shape.words)
    with Population(device, shape, tiles, settings, objective, problem) as population:
        population.start(given)
        history: list[NDArray[np.int64]] = []
        while True:
            state, recent = population.look()
            for iteration in range(len(history), int(state[0]) + 1):
                history.append(recent[iteration % len(recent)])
                note(progress, iteration, history[-1])
            if state[2]:
                return Trajectory(population.best(), np.array(history), STALE if state[2] == 1 else EXHAUSTED)
            for _ in range(GENERATIONS_A_LOOK):
                population.next_generation()


class Population:
    """Chromosomes and all that belongs to them on the device; a context manager, which gives the memory back.

    Methods queue the kernels of the same name, see kernels/genetic_population.cl; `look` and `best` wait for them.
    `buffers` holds the kernels' arrays by the names that they have there.
    """

    def __init__(
        self,
        device: Device,
        shape: WorkShape,
        tiles: Tiles,
        settings: GeneticSettings,
        objective: GeneticObjective,
        problem: CoverProblem,
    ) -> None:
        self._on, self._shape, self._settings = device, shape, settings
        self._n_tiles, self._n_genes = tiles.n_tiles, objective.n_candidates
        self._n_words = -(-self._n_genes // 32)
        self._program = device.program("genetic_population.cl", {})
        self._cover = device.program(
            "genetic_cover.cl", {"LANES": shape.lanes, "DEPTH": shape.depth, "TILE": shape.words}
        )
        self._n_classes, self._n_constraints = np.int32(tiles.counts.shape[1]), np.int32(tiles.counts.shape[0])
        arrays: dict[str, NDArray[Any]] = {
            "bits": tiles.bits,
            "weights": tiles.weights,
            "shift": tiles.shift,
            "near": tiles.near,
            "class_of": tiles.class_of,
            "counts": tiles.counts,
            "required": problem.required.astype(np.int64),
            "rules": _rules(settings, objective),
            "state": np.array([-1, 0, 0], dtype=np.int32),
        }
        sizes = self._sizes()
        device.reserve("genetic selection", {**{name: array.nbytes for name, array in arrays.items()}, **sizes})
        self.buffers: dict[str, Buffer] = device.upload("genetic selection", arrays)
        for name, size in sizes.items():
            self.buffers[name] = device.allocate(f"genetic selection: {name}", size)

    def __enter__(self) -> Population:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def release(self) -> None:
        """Give the memory back."""
        for buffer in self.buffers.values():
            buffer.release()

    def start(self, given: BoolArray) -> None:
        """Queue the first population: given individuals, then random ones; and its ranking."""
        n = self._settings.population
        if len(given):
            first = self._on.upload("genetic selection: given sets", {"given": pack(given)})["given"]
            self._run("take_given", (1,), "rules", np.int32(len(given)), first, "genes")
        self._run("start_population", (n - len(given),), "rules", "state", np.int32(len(given)), "genes")
        self.judge("genes", "facts", n)
        self.rank("facts", n, "order")
        self.note_best()

    def next_generation(self) -> None:
        """Queue one generation."""
        self.fill_pool()
        self.breed()
        self.judge("offspring", "offspring_facts", self._settings.n_offspring)
        self.replace()
        self.rank("facts", self._settings.population, "order")
        self.note_best()

    def fill_pool(self) -> None:
        """Queue the choice of parents."""
        self._run("fill_pool", (self._runs(self._settings.n_parents),), "rules", "state", "order", "pool")

    def breed(self) -> None:
        """Queue crossover and mutation."""
        size = (min(self._shape.n_breeders, self._n_words), self._runs(-(-self._settings.n_offspring // 2)))
        self._run("breed", size, "rules", "state", "pool", "genes", "offspring")

    def judge(self, genes: str, facts: str, n: int) -> None:
        """Queue mending and evaluating n individuals, whose chromosomes and facts are in the buffers named."""
        runs, slots, count = self._runs(n), self._shape.slots, np.int32(n)
        self._run("mend", (runs,), "rules", "state", count, genes, facts)
        tiles = ("bits", "weights", "shift", "near", np.int32(self._n_genes))
        self._run("cover", (slots, runs, self._n_tiles), "state", *tiles, genes, count, "sums", program=self._cover)
        sums = ("sums", np.int32(self._n_tiles), np.int32(slots))
        constraints = ("class_of", "counts", self._n_classes, "required", self._n_constraints)
        self._run("judge", (runs,), "rules", "state", count, *sums, *constraints, facts)

    def rank(self, facts: str, n: int, order: str) -> None:
        """Queue ordering n individuals, the best first."""
        self._run("rank", (self._runs(n),), "state", facts, np.int32(n), order)

    def replace(self) -> None:
        """Queue putting offspring in the places of individuals."""
        n = self._settings.n_offspring
        changed = ("offspring", "offspring_facts", "genes", "facts")
        if self._settings.replacement == "generational":
            self._run("replace_all", (self._runs(n),), "rules", "state", "order", *changed)
            return
        if self._settings.distinct:
            self._run("find_twins", (self._runs(n),), "rules", "state", "genes", "facts", *changed[:2], "twin")
            self._run("bar_twins", (self._runs(n),), "rules", "state", "twin", "offspring_facts")
        self.rank("offspring_facts", n, "offspring_order")
        self._run("replace_worst", (self._runs(n),), "rules", "state", "order", "offspring_order", *changed)

    def note_best(self) -> None:
        """Queue keeping the best solution and deciding whether to stop."""
        self._run("note_best", (1,), "rules", "state", "order", "genes", "facts", "history", "best")

    def look(self) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """Wait for everything queued; state (3,) and the history's ring, see the kernels."""
        state, recent = np.empty(3, dtype=np.int32), np.empty((_RING, _FACTS), dtype=np.int64)
        self._on.read(self.buffers["state"], state)
        self._on.read(self.buffers["history"], recent)
        return state, recent

    def best(self) -> BoolArray:
        """(N,) bool, the best chromosome of all."""
        words = np.empty(self._n_words, dtype=np.uint32)
        self._on.read(self.buffers["best"], words)
        bits = np.unpackbits(words.astype("<u4").view(np.uint8), count=self._n_genes, bitorder="little")
        return bits.astype(bool)

    def _run(self, kernel: str, size: tuple[int, ...], *arguments: object, program: Program | None = None) -> None:
        buffers = (self.buffers[item] if isinstance(item, str) else item for item in arguments)
        (program or self._program).run(kernel, size, *buffers)

    def _runs(self, n: int) -> int:
        return n if self._shape.n_runs == 0 else min(n, self._shape.n_runs)

    def _sizes(self) -> dict[str, int]:
        """Bytes of the buffers that kernels fill."""
        n, n_offspring = self._settings.population, self._settings.n_offspring
        return {
            "genes": 4 * n * self._n_words,
            "facts": 8 * _FACTS * n,
            "order": 4 * n,
            "pool": 4 * self._settings.n_parents,
            "offspring": 4 * n_offspring * self._n_words,
            "offspring_facts": 8 * _FACTS * n_offspring,
            "offspring_order": 4 * n_offspring,
            "twin": 4 * n_offspring,
            "sums": 8 * max(n, n_offspring) * self._n_tiles * self._shape.slots,
            "history": 8 * _FACTS * _RING,
            "best": 4 * self._n_words,
        }


def _rules(settings: GeneticSettings, objective: GeneticObjective) -> NDArray[np.uint64]:
    """Numbers in the order of RULE_ in kernels/genetic_population.cl."""
    low, span = rate_range(settings, objective.n_candidates)
    return np.array(
        [
            settings.seed or 0,
            objective.n_candidates,
            settings.population,
            settings.n_parents,
            settings.n_offspring,
            settings.n_elite,
            settings.tournament_size if settings.selection == "tournament" else 0,
            _CROSSOVERS[settings.crossover],
            threshold(settings.crossover_rate),
            threshold(settings.individual_mutation_rate),
            threshold(settings.gene_mutation_rate),
            low,
            span,
            objective.number,
            settings.n_stations,
            objective.total,
            objective.shift,
            settings.patience,
            settings.max_iterations,
            _RING,
        ],
        dtype=np.uint64,
    )
