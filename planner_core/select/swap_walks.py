"""Local search of selection: station sets of a fixed size, annealed until one meets all targets.

Input a `CoverProblem` and sets of k candidates, output sets of k candidates and what each misses (ticks). A step
exchanges one station for a candidate; kernels/swap_walks.cl says how. With a `Network` a set misses something, too,
as long as it does not hang together. Walks are independent of each other and are the
work-items of a kernel; `planner_core.select.host_walks` has the same on the host, for where there is no OpenCL device:
everything is whole numbers, so that both walk the same way, bit for bit, on any number of cores.

References
----------
Kirkpatrick, Gelatt, Vecchi 1983 (annealing) and Metropolis et al. 1953 (the rule): known results, restated here.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from planner_core.device import Buffer, Device, list_devices, open_device
from planner_core.errors import DeviceError
from planner_core.model import Int32Array, Int64Array
from planner_core.select.bit_rows import classes_of
from planner_core.select.network import Network
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
#: What a set pays for each of its faults as a network, as a share of what a candidate sees in the mean: a fifth. With
#: an eightieth sets come apart faster than they join.
_PENALTY_DIVISOR = 5
#: Bits of a random number that choose one of the numbers of `luck`.
LUCK_BITS = 12
#: Classes are bits of a word in the kernel.
_MAX_CLASSES = 32
UInt32Array = NDArray[np.uint32]


class Walks(Protocol):
    """Walks on one problem."""

    def walk(
        self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int = 0
    ) -> Int64Array:
        """Go steps[0] .. steps[1] - 1 of `n_steps` with every set of (W, k), which is changed; return (W,) missing.

        The first `n_pinned` of a set, fewer than k, stay. Missing is 0 where all targets are met and the set hangs
        together; otherwise ticks, over all looks that are asked for, and `Terrain.penalty` for each `Network.faults`.
        """


class Terrain:
    """What walks know of a problem; arrays as in kernels/swap_walks.cl."""

    def __init__(self, problem: CoverProblem, *, seed: int, network: Network | None = None) -> None:
        class_of, counts = classes_of(problem)
        self.problem, self.seed, self.network = problem, seed, network
        self.n_levels = int(problem.seen_from.max(initial=1))
        self.class_of = class_of.astype(np.int32)
        self.counts = counts.astype(bool)
        self.classes = (self.counts * (1 << np.arange(counts.shape[1], dtype=np.uint64))).sum(axis=1).astype(np.uint32)
        self.near = alike(problem, N_NEAR)
        self.luck = luck()
        seen_ticks = int(problem.ticks[problem.row].sum())
        mean_ticks = seen_ticks // max(problem.n_candidates, 1)
        self.heat = heats(mean_ticks)
        self.penalty = max(mean_ticks // _PENALTY_DIVISOR, 1)


def open_walks(terrain: Terrain, *, device: Device | None = None, host: bool = False) -> Walks:
    """Walks on a CPU device, or on the host where none is usable or `host` says so; the same sets come out of all.

    Parameters
    ----------
    device
        Taken if it is a CPU: a walk is one thread, for which a GPU's are slow. Otherwise a CPU is looked for.
    """
    on_device = None if host or terrain.counts.shape[1] > _MAX_CLASSES else _on_device(terrain, device)
    if on_device is not None:
        return on_device
    from planner_core.select.host_walks import HostWalks  # brings numba along, which takes a while

    return HostWalks(terrain)


def _on_device(terrain: Terrain, device: Device | None) -> DeviceWalks | None:
    """Walks on the device or another CPU; None where there is none, or where it takes neither kernel nor problem."""
    try:
        if device is None or device.kind != "cpu":
            usable = [info for info in list_devices() if info.kind == "cpu" and not info.problem]
            device = open_device(str(usable[0].index)) if usable else None
        return None if device is None else DeviceWalks(terrain, device)
    except DeviceError:
        return None  # the host walks the same way


class DeviceWalks:
    """Walks as work-items of a kernel."""

    def __init__(self, terrain: Terrain, device: Device) -> None:
        self._terrain, self._device = terrain, device
        problem, network = terrain.problem, terrain.network
        defines = {
            "N_CLASSES": max(terrain.counts.shape[1], 1),
            "TRIES": TRIES,
            "LEVELS": terrain.n_levels,
            "NETWORK": int(network is not None),
            "LOOPS": int(network is not None and network.loops),
        }
        self._program = device.program("swap_walks.cl", defines)
        self._buffers = device.upload(
            "selection",
            {
                "starts": problem.starts.astype(np.int32),
                "row": problem.row,
                "class_of": terrain.class_of.astype(np.uint8),
                "ticks": problem.ticks,
                "required": problem.required,
                "seen_from": problem.seen_from.astype(np.int32),
                "classes": terrain.classes,
                "near": terrain.near,
                "luck": terrain.luck,
                "heat": terrain.heat,
            },
        )
        self._links = {} if network is None else device.upload("links of candidates", _link_arrays(network))

    def walk(
        self, sets: Int32Array, *, round_: int, steps: tuple[int, int], n_steps: int, n_pinned: int = 0
    ) -> Int64Array:
        """See `Walks`."""
        n_walks, n_set = sets.shape
        check_pinned(n_pinned, n_set)
        problem, held, terrain = self._terrain.problem, self._buffers, self._terrain
        missing = np.zeros(n_walks, dtype=np.int64)
        own = self._device.upload("selection's sets", {"sets": sets, "missing": missing})
        own["inside"] = self._device.allocate("selection's sets", n_walks * problem.n_candidates)
        own["count"] = self._device.allocate("selection's rows", 2 * n_walks * problem.n_rows)
        self._program.run(
            "swap_walks",
            (n_walks,),
            *(held[name] for name in ("starts", "row", "class_of", "ticks")),
            np.int32(problem.n_candidates),
            np.int32(problem.n_rows),
            held["required"],
            held["seen_from"],
            held["classes"],
            np.int32(problem.required.size),
            held["near"],
            np.int32(terrain.near.shape[1]),
            held["luck"],
            held["heat"],
            np.int32(terrain.heat.size),
            np.uint64(terrain.seed),
            *(np.int32(number) for number in (round_, *steps, n_steps, n_set, n_pinned)),
            *(own[name] for name in ("sets", "inside", "count", "missing")),
            *self._network_arguments(own, n_walks, n_set),
        )
        self._device.read(own["missing"], missing)
        self._device.read(own["sets"], sets)
        for buffer in own.values():
            buffer.release()
        return missing

    def _network_arguments(self, own: dict[str, Buffer], n_walks: int, n_set: int) -> list[Any]:
        """Links, the penalty, and room to look at the links of sets, which is added to `own`."""
        network, links = self._terrain.network, self._links
        if network is None:
            return []
        sizes = {"bits": n_set * -(-n_set // 32), "marks": 5 * n_set, "n_in_part": max(network.n_parts, 1)}
        for name, size in sizes.items():
            own[name] = self._device.allocate("selection's links", 4 * n_walks * size)
        return [
            *(links[name] for name in ("link_starts", "link", "link_bits", "part")),
            np.int32(network.n_parts),
            *(links[name] for name in ("spared_starts", "spared")),
            np.int64(self._terrain.penalty),
            *(own[name] for name in sizes),
        ]


def check_pinned(n_pinned: int, n_set: int) -> None:
    """Refuse walks of sets of which nothing may go."""
    if not 0 <= n_pinned < n_set:
        raise ValueError(f"pinned candidates: got {n_pinned} of {n_set}, expected fewer than there are in a set")


def _link_arrays(network: Network) -> dict[str, NDArray[Any]]:
    """Arrays of kernels/slot_network.h that belong to the candidates' graph."""
    n = network.n_candidates
    owner = np.repeat(np.arange(n), np.diff(network.starts))
    bits = np.zeros((n, -(-n // 32)), dtype=np.uint32)
    np.bitwise_or.at(bits, (owner, network.neighbour >> 5), np.uint32(1) << (network.neighbour & 31).astype(np.uint32))
    spared_starts, spared = network.spared_links()
    return {
        "link_starts": network.starts.astype(np.int32),
        "link": network.neighbour.astype(np.int32),
        "link_bits": bits,
        "part": network.part.astype(np.int32),
        "spared_starts": spared_starts,
        "spared": spared,
    }


def luck() -> UInt32Array:
    """(4096,) uint32: what an exponentially distributed number is, at evenly spread odds, in units of 2^-16."""
    n = 1 << LUCK_BITS
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
