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
from planner_core.genetic.layout import Tiles, lay_out, pack
from planner_core.genetic.objective import Objective
from planner_core.genetic.operators import rate_range
from planner_core.genetic.philox import threshold
from planner_core.genetic.problem import CoverRows
from planner_core.genetic.settings import GeneticSettings
from planner_core.genetic.trajectory import EXHAUSTED, STALE, Trajectory, note
from planner_core.model import BoolArray
from planner_core.progress import Progress

#: Generations queued before the host looks at the state: looking costs a wait for the device.
GENERATIONS_A_LOOK = 16
_CROSSOVERS = {"one-point": 1, "two-point": 2, "uniform": 3}
_FACTS = 3


@dataclass(frozen=True)
class Shape:
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
SHAPES = {"cpu": Shape(lanes=8, depth=8, slots=1, n_runs=8, n_breeders=1)}
DEFAULT_SHAPE = Shape(lanes=1, depth=1, slots=32, n_runs=0, n_breeders=32)


def evolve_on_device(
    problem: CoverRows,
    settings: GeneticSettings,
    objective: Objective,
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
    with _Population(device, shape, lay_out(problem, words=shape.words), settings, objective, problem) as population:
        population.start(given)
        looked = 0
        while True:
            state, history = population.look()
            for iteration in range(looked, int(state[0]) + 1):
                note(progress, settings, iteration, history[iteration])
            looked = int(state[0]) + 1
            if state[2]:
                best = population.best()
                return Trajectory(best, history[:looked].copy(), STALE if state[2] == 1 else EXHAUSTED)
            for _ in range(GENERATIONS_A_LOOK):
                population.breed_generation()


class _Population:
    """Chromosomes and all that belongs to them on the device; a context manager, which gives the memory back."""

    def __init__(
        self,
        device: Device,
        shape: Shape,
        tiles: Tiles,
        settings: GeneticSettings,
        objective: Objective,
        problem: CoverRows,
    ) -> None:
        self._on, self._shape, self._settings = device, shape, settings
        self._n_tiles, self._n_genes = tiles.n_tiles, objective.n_candidates
        self._n_words = -(-self._n_genes // 32)
        self._population = device.program("genetic_population.cl", {})
        self._cover = device.program(
            "genetic_cover.cl",
            {"LANES": shape.lanes, "DEPTH": shape.depth, "TILE": shape.words},
        )
        self._history = np.zeros((settings.max_iterations + 1, _FACTS), dtype=np.int64)
        self._counts = (np.int32(tiles.counts.shape[1]), np.int32(tiles.counts.shape[0]))
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
        self._at: dict[str, Buffer] = device.upload("genetic selection", arrays)
        for name, size in sizes.items():
            self._at[name] = device.allocate(f"genetic selection: {name}", size)

    def __enter__(self) -> _Population:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for buffer in self._at.values():
            buffer.release()

    def start(self, given: BoolArray) -> None:
        """Queue the first population: given individuals, then random ones; and its ranking."""
        n, words = self._settings.population, self._n_words
        packed = np.zeros((n, words), dtype=np.uint32)
        packed[: len(given)] = pack(given)
        self._at["genes"] = self._on.upload("genetic selection: genes", {"genes": packed})["genes"]
        self._run("start_population", (n - len(given),), "rules", "state", np.int32(len(given)), "genes")
        self._judge("genes", "facts", n)
        self._rank("facts", n, "order")
        self._note()

    def breed_generation(self) -> None:
        """Queue one generation."""
        settings, shape = self._settings, self._shape
        n_offspring = settings.n_offspring
        self._run("fill_pool", (self._runs(settings.n_parents),), "rules", "state", "order", "pool")
        breeders = (min(shape.n_breeders, self._n_words), self._runs(-(-n_offspring // 2)))
        self._run("breed", breeders, "rules", "state", "pool", "genes", "offspring")
        self._judge("offspring", "offspring_facts", n_offspring)
        changed = ("offspring", "offspring_facts", "genes", "facts")
        if settings.replacement == "stationary":
            self._rank("offspring_facts", n_offspring, "offspring_order")
            self._run(
                "replace_worst", (self._runs(n_offspring),), "rules", "state", "order", "offspring_order", *changed
            )
        else:
            self._run("replace_all", (self._runs(n_offspring),), "rules", "state", "order", *changed)
        self._rank("facts", settings.population, "order")
        self._note()

    def look(self) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """Wait for everything queued; state (kernels/genetic_population.cl) and the history up to its iteration."""
        state = np.empty(3, dtype=np.int32)
        self._on.read(self._at["state"], state)
        head = self._history[: state[0] + 1]
        self._on.read(self._at["history"], head)
        return state, head

    def best(self) -> BoolArray:
        """(N,) bool, the best chromosome of all."""
        words = np.empty(self._n_words, dtype=np.uint32)
        self._on.read(self._at["best"], words)
        bits = np.unpackbits(words.astype("<u4").view(np.uint8), count=self._n_genes, bitorder="little")
        return bits.astype(bool)

    def _judge(self, genes: str, facts: str, n: int) -> None:
        """Queue mending and evaluating n individuals."""
        runs, slots, count = self._runs(n), self._shape.slots, np.int32(n)
        self._run("mend", (runs,), "rules", "state", count, genes, facts)
        tiles = ("bits", "weights", "shift", "near", np.int32(self._n_genes))
        self._run("cover", (slots, runs, self._n_tiles), "state", *tiles, genes, count, "sums", program=self._cover)
        sums = ("sums", np.int32(self._n_tiles), np.int32(slots))
        targets = ("class_of", "counts", self._counts[0], "required", self._counts[1])
        self._run("judge", (runs,), "rules", "state", count, *sums, *targets, facts)

    def _rank(self, facts: str, n: int, order: str) -> None:
        self._run("rank", (self._runs(n),), "state", facts, np.int32(n), order)

    def _note(self) -> None:
        self._run("note_best", (1,), "rules", "state", "order", "genes", "facts", "history", "best")

    def _run(self, kernel: str, size: tuple[int, ...], *arguments: object, program: Program | None = None) -> None:
        buffers = (self._at[item] if isinstance(item, str) else item for item in arguments)
        (program or self._population).run(kernel, size, *buffers)

    def _runs(self, n: int) -> int:
        return n if self._shape.n_runs == 0 else min(n, self._shape.n_runs)

    def _sizes(self) -> dict[str, int]:
        """Bytes of the buffers that kernels fill."""
        n, n_offspring = self._settings.population, self._settings.n_offspring
        most = max(n, n_offspring)
        return {
            "sums": 8 * most * self._n_tiles * self._shape.slots,
            "facts": 8 * _FACTS * n,
            "order": 4 * n,
            "pool": 4 * self._settings.n_parents,
            "offspring": 4 * n_offspring * self._n_words,
            "offspring_facts": 8 * _FACTS * n_offspring,
            "offspring_order": 4 * n_offspring,
            "history": self._history.nbytes,
            "best": 4 * self._n_words,
        }


def _rules(settings: GeneticSettings, objective: Objective) -> NDArray[np.uint64]:
    """Numbers in the order of RULE_ in kernels/genetic_population.cl."""
    low, span = rate_range(settings, objective.n_candidates)
    return np.array(
        [
            settings.seed,
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
        ],
        dtype=np.uint64,
    )
