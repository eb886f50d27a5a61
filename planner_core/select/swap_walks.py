"""Local search of selection: station sets of a fixed size, annealed until one meets all targets.

Input a `CoverProblem` and sets of k candidates, output sets of k candidates and what each misses (ticks). A step
exchanges one station for a candidate; kernels/swap_walks.cl says how. Walks are independent of each other and are the
work-items of a kernel; `HostWalks` are the same in NumPy, for where there is no OpenCL device: everything is whole
numbers, so that both walk the same way, bit for bit, on any number of cores.

References
----------
Kirkpatrick, Gelatt, Vecchi 1983 (annealing) and Metropolis et al. 1953 (the rule): known results, restated here.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Device, list_devices, open_device
from planner_core.errors import DeviceError, MissingPackageError
from planner_core.genetic.layout import classes_of
from planner_core.genetic.philox import philox
from planner_core.model import Int32Array, Int64Array
from planner_core.select.problem import CoverProblem

#: Candidates tried for the place of one station, so that taking it out serves more than one.
TRIES = 4
#: Candidates that see most nearly the same, whom a station is exchanged for three times of four.
N_NEAR = 24
#: Rows that likeness is judged by.
_SAMPLE_ROWS = 2048
#: Heat at the start, as a share of what a candidate sees in the mean, and what is left of it from one to the next of
#: N_HEATS, in 2^-16: it ends at a fiftieth. Several times as hot or cold starts or ends cost stations.
_FIRST_HEAT_DIVISOR = 20
_HEAT_LEFT = 64538
N_HEATS = 256
#: Steps between two looks of the host: some tenths of a second.
STEPS_A_LOOK = 20_000
_LUCK_BITS = 12
#: Classes are bits of a word in the kernel.
_MAX_CLASSES = 32
UInt32Array = NDArray[np.uint32]


class Walks(Protocol):
    """Walks on one problem."""

    def walk(self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int) -> Int64Array:
        """Go steps[0] .. steps[1] - 1 of `n_steps` with every set of (W, k), which is changed; return (W,) missing."""


class Terrain:
    """What walks know of a problem; arrays as in kernels/swap_walks.cl."""

    def __init__(self, problem: CoverProblem, *, seed: int) -> None:
        class_of, counts = classes_of(problem)
        self.problem, self.seed = problem, seed
        self.class_of = class_of.astype(np.uint8)
        self.counts = counts.astype(bool)
        self.classes = (self.counts * (1 << np.arange(counts.shape[1], dtype=np.uint64))).sum(axis=1).astype(np.uint32)
        self.near = alike(problem, N_NEAR)
        self.luck = luck()
        seen_ticks = int(problem.ticks[problem.row].sum())
        self.heat = heats(seen_ticks // max(problem.n_candidates, 1))


def open_walks(terrain: Terrain, *, device: Device | None = None, host: bool = False) -> Walks:
    """Walks on a CPU device, or on the host where none is or `host` says so; the same sets come out of all.

    Parameters
    ----------
    device
        Taken if it is a CPU: a walk is one thread, for which a GPU's are slow. Otherwise a CPU is looked for.
    """
    if host or terrain.counts.shape[1] > _MAX_CLASSES:
        return HostWalks(terrain)
    if device is None or device.kind != "cpu":
        device = _cpu()
    return HostWalks(terrain) if device is None else DeviceWalks(terrain, device)


def _cpu() -> Device | None:
    try:
        usable = [info for info in list_devices() if info.kind == "cpu" and not info.problem]
        return open_device(str(usable[0].index)) if usable else None
    except (DeviceError, MissingPackageError):
        return None  # the host walks the same way


class DeviceWalks:
    """Walks as work-items of a kernel."""

    def __init__(self, terrain: Terrain, device: Device) -> None:
        self._terrain, self._device = terrain, device
        n_classes = terrain.counts.shape[1]
        self._program = device.program("swap_walks.cl", {"N_CLASSES": max(n_classes, 1), "TRIES": TRIES})
        problem = terrain.problem
        self._buffers = device.upload(
            "selection",
            {
                "starts": problem.starts.astype(np.int32),
                "row": problem.row.astype(np.int32),
                "class_of": terrain.class_of,
                "ticks": problem.ticks,
                "required": problem.required,
                "classes": terrain.classes,
                "near": terrain.near,
                "luck": terrain.luck,
                "heat": terrain.heat,
            },
        )

    def walk(self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int) -> Int64Array:
        """See `Walks`."""
        n_walks, n_set = sets.shape
        problem, held, terrain = self._terrain.problem, self._buffers, self._terrain
        missing = np.zeros(n_walks, dtype=np.int64)
        own = self._device.upload("selection's sets", {"sets": sets, "missing": missing})
        inside = self._device.allocate("selection's sets", n_walks * problem.n_candidates)
        count = self._device.allocate("selection's rows", 2 * n_walks * problem.n_rows)
        self._program.run(
            "swap_walks",
            (n_walks,),
            *(held[name] for name in ("starts", "row", "class_of", "ticks")),
            np.int32(problem.n_candidates),
            np.int32(problem.n_rows),
            held["required"],
            held["classes"],
            np.int32(problem.required.size),
            held["near"],
            np.int32(terrain.near.shape[1]),
            held["luck"],
            held["heat"],
            np.int32(terrain.heat.size),
            np.uint64(terrain.seed),
            *(np.int32(number) for number in (round_, *steps, n_steps, n_set)),
            own["sets"],
            inside,
            count,
            own["missing"],
        )
        self._device.read(own["missing"], missing)
        self._device.read(own["sets"], sets)
        for buffer in (*own.values(), inside, count):
            buffer.release()
        return missing


class HostWalks:
    """The same in NumPy, one walk after the other."""

    def __init__(self, terrain: Terrain) -> None:
        self._terrain = terrain

    def walk(self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int) -> Int64Array:
        """See `Walks`."""
        return np.array(
            [self._walk(number, each, round_, steps, n_steps) for number, each in enumerate(sets)], dtype=np.int64
        )

    def _walk(self, number: int, chosen: Int32Array, round_: int, steps: tuple[int, int], n_steps: int) -> int:
        terrain, problem = self._terrain, self._terrain.problem
        count = np.zeros(problem.n_rows, dtype=np.int64)
        inside = np.zeros(problem.n_candidates, dtype=bool)
        for candidate in chosen:
            inside[candidate] = True
            count[problem.rows_of(int(candidate))] += 1
        covered = self._by_class(np.flatnonzero(count > 0))
        missing = self._missing(covered)
        for step in range(*steps):
            if missing <= 0:
                break
            x = self._draws(round_, step, number)
            warmth = int(terrain.heat[step * terrain.heat.size // n_steps])
            place = x[0][0] * chosen.size >> 32
            out = int(chosen[place])
            rows = problem.rows_of(out)
            count[rows] -= 1
            without = covered - self._by_class(rows[count[rows] == 0])
            taken = out
            for first, second, third, _ in x[1:]:
                other = self._candidate(out, first, second)
                if inside[other]:
                    continue
                seen = problem.rows_of(other)
                then_covered = without + self._by_class(seen[count[seen] == 0])
                then = self._missing(then_covered)
                if then - missing <= (warmth * int(terrain.luck[third >> 20])) >> 16:
                    taken, missing, covered = other, then, then_covered
                    break
            count[problem.rows_of(taken)] += 1
            chosen[place] = taken
            inside[out] = False
            inside[taken] = True
        return missing

    def _draws(self, round_: int, step: int, number: int) -> list[list[int]]:
        words = [np.uint64(word) for word in (round_, step, number)]
        drawn = philox((*words, np.arange(TRIES + 1, dtype=np.uint64)), self._terrain.seed)
        table: list[list[int]] = np.stack([np.broadcast_to(word, TRIES + 1) for word in drawn], axis=1).tolist()
        return table

    def _candidate(self, out: int, first: int, second: int) -> int:
        near = self._terrain.near
        if first * 4 >> 32:
            return int(near[out, second * near.shape[1] >> 32])
        return second * self._terrain.problem.n_candidates >> 32

    def _by_class(self, rows: Int64Array) -> Int64Array:
        ticks: Int64Array = np.zeros(self._terrain.counts.shape[1], dtype=np.int64)
        np.add.at(ticks, self._terrain.class_of[rows], self._terrain.problem.ticks[rows])
        return ticks

    def _missing(self, covered: Int64Array) -> int:
        left = self._terrain.problem.required - self._terrain.counts @ covered
        return int(np.maximum(left, 0).sum())


def luck() -> UInt32Array:
    """(4096,) uint32: what an exponentially distributed number is, at evenly spread odds, in units of 2^-16."""
    n = 1 << _LUCK_BITS
    return np.array([round(-math.log((i + 0.5) / n) * 65536) for i in range(n)], dtype=np.uint32)


def heats(mean_ticks: int) -> Int64Array:
    """(N_HEATS,) int64, ticks: falling evenly in proportion, in whole numbers."""
    heat = [mean_ticks // _FIRST_HEAT_DIVISOR]
    for _ in range(N_HEATS - 1):
        heat.append(heat[-1] * _HEAT_LEFT >> 16)
    return np.array(heat, dtype=np.int64)


def alike(problem: CoverProblem, n_near: int) -> Int32Array:
    """(N, M) int32, M = min(n_near, N - 1): candidates that share the greatest part of what either sees, best first.

    Judged by a sample of rows, evenly spread; ties go to the lower number. Sums of zeros and ones are exact in float32,
    so that the order of summing does not matter.
    """
    n, m = problem.n_candidates, min(n_near, problem.n_candidates - 1)
    if m < 1:
        return np.zeros((n, 0), dtype=np.int32)
    n_sample = min(_SAMPLE_ROWS, problem.n_rows)
    sample = np.arange(n_sample) * problem.n_rows // max(n_sample, 1)
    place = np.full(problem.n_rows, -1)
    place[sample] = np.arange(n_sample)
    owner = np.repeat(np.arange(n), np.diff(problem.starts))
    kept = place[problem.row] >= 0
    sees = np.zeros((n, n_sample), dtype=np.float32)
    sees[owner[kept], place[problem.row[kept]]] = 1.0
    size = sees.sum(axis=1)
    near = np.empty((n, m), dtype=np.int32)
    for begin in range(0, n, 512):
        shared = sees[begin : begin + 512] @ sees.T
        part = shared / np.maximum(size[begin : begin + 512, None] + size[None] - shared, 1.0)
        part[np.arange(part.shape[0]), begin + np.arange(part.shape[0])] = -1.0
        near[begin : begin + 512] = np.argsort(-part, axis=1, kind="stable")[:, :m]
    return near
