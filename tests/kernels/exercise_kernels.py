"""Every kernel once, through the library, on scenes of some dozens of triangles: what `check_kernels.py` has watched.

    python tests/kernels/exercise_kernels.py cpu|cpu-4|cpu-16|gpu [--save-tree FILE | --tree FILE] [--poison BYTE]

`cpu` takes packets of eight, `cpu-4` of four, `cpu-16` of sixteen; `gpu` takes the shape of tiles for GPUs, tells the
library that it is on one, and has work-groups as large as can be. Prints JSON: the kernels that were launched, and a
hash of all results, which must be the same however this is run.

--save-tree  keep the tree that the kernels built
--tree       take it from there: the checker's search for uninitialised values dies of the kernels that build it
--poison     write this byte to all memory of the device that is allocated, before anybody uses it
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl

from planner_core.device import Device, open_device, sort
from planner_core.device.choice import open_unchecked
from planner_core.engine import opencl, parts, patch_mode, tree
from planner_core.engine.in_parts import PartedEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.tree import Tree
from planner_core.engine.tuning import use_shape
from planner_core.model import BeamTemplate, LoadReport, Patches, Scene, SceneSource, Visibility
from planner_core.paper.genetic import GeneticSettings, on_device, select_genetic
from planner_core.paper.point_distribution import PointDistribution
from planner_core.scene.patches import make_patches
from planner_core.select.problem import Constraint, cover_problem

SHAPES = {"cpu": (4, 16, 8), "cpu-4": (4, 16, 4), "cpu-16": (4, 32, 16), "gpu": (4, 8, 1)}
#: 112 triangles: more than a treelet; and 28, which are one treelet.
N_BOXES, N_FEW_BOXES = 8, 1
TREE_SIZES = ("n_triangles", "n_nodes", "n_blocks", "n_levels")


def room(n_boxes: int) -> Scene:
    """A room of 4 x 3 x 2.5 m with small boxes in it, a needle, two triangles in one place and one without area."""
    rng = np.random.default_rng(1)
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    parts = [unit * [4.0, 3.0, 2.5] - [2.0, 1.5, 1.0]]
    for _ in range(n_boxes):
        parts.append(rng.uniform(-0.9, 0.9, 3) * [1.8, 1.3, 0.9] + unit * rng.uniform(0.05, 0.5, 3))
    triangles = [box + 8 * index for index in range(len(parts))]
    odd = np.array([[1, 1, 0], [1, -1, 0.5], [1, 0, 0.25 + 1e-7], [1.2, 0, 0], [1.2, 1, 0], [1.2, 0, 1.0]])
    more = np.array([[0, 1, 2], [3, 4, 5], [3, 4, 5], [3, 3, 5]]) + 8 * len(parts)
    cells = np.concatenate([*triangles, more]).astype(np.int32)
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=np.concatenate([*parts, odd]),
        triangles=cells,
        element_of_triangle=np.zeros(len(cells), dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(len(cells)),
    )


def results(kind: str, *, with_tree: bool, save_tree: Path | None) -> list[Any]:
    """Everything that the library asks of kernels; without the kernels that build the tree if `with_tree` is False."""
    # Under oclgrind the check of a new device would run all kernels in a child process first, for 28 s.
    device = open_unchecked(0) if "OCLGRIND_LOG" in os.environ else open_device()
    device.kind = kind.partition("-")[0]
    scene = room(N_BOXES)
    patches = make_patches(scene, max_area_m2=0.5)
    # Offsets, no full turn, a number of rows and columns that fills no tile.
    template = BeamTemplate(
        azimuth_rad=np.linspace(-1.0, 2.0, 21),
        elevation_rad=np.linspace(0.6, -0.7, 6),
        range_min_m=0.2,
        range_max_m=3.0,
        azimuth_offset_rad=np.array([0.3, -0.3, 0.1, 0.0, 0.2, -0.1]),
    )
    at = np.array([[0.1, 0.2, 0.3], [-0.5, 0.4, 0.1], [0.4, -0.6, 0.2]])
    rng = np.random.default_rng(2)
    found: list[Any] = []
    with use_shape(SHAPES[kind]):
        if with_tree:
            few = room(N_FEW_BOXES)
            OpenCLEngine(few, make_patches(few, max_area_m2=0.5), device)
        engine = OpenCLEngine(scene, patches, device)
        if save_tree is not None:
            keep(engine.tree, save_tree)
        found.append(engine.scan(template, at))
        found.append(engine.visible_patches(template, at))
        found.append(engine.patch_returns(template, at))
        found.append(engine.patch_returns(template, at, moments=True))
        found.append(engine.cast_rays(np.repeat(at, 7, axis=0), rng.normal(size=(21, 3)), range_max_m=np.inf))
        if with_tree:
            check_parts(scene, patches, device, template, at, found[:4])
        found.append(PatchMode(engine, scene, patches).see(template, at[:1]))
        found.append(PointDistribution(scene, patches, engine).sums(template, at))
    return found + evolved(kind, device)


def check_parts(
    scene: Scene, patches: Patches, device: Device, template: BeamTemplate, at: Any, expected: list[Any]
) -> None:
    """The same scene in two parts: the same results, else an error."""
    real = parts.split
    parts.split = lambda scene, most: real(scene, -(-scene.n_triangles // 2))
    engine = PartedEngine(scene, patches, device)
    parts.split = real
    rays = (np.repeat(at, 7, axis=0), np.random.default_rng(2).normal(size=(21, 3)))
    got = [engine.scan(template, at), engine.visible_patches(template, at), engine.patch_returns(template, at)]
    got += [engine.patch_returns(template, at, moments=True)]
    assert len(engine.parts.parts) == 2
    assert digest(got) == digest(expected), "parts give other results than one tree"
    engine.cast_rays(*rays, range_max_m=np.inf)


def evolved(kind: str, device: Device) -> list[Any]:
    """Genetic selections of a few generations on a few hundred rows, with every operator."""
    rng = np.random.default_rng(3)
    rows = [np.flatnonzero(row) for row in rng.random((40, 300)) < 0.1]
    starts = np.cumsum([0, *(row.size for row in rows)])
    visibility = Visibility(starts, np.concatenate(rows).astype(np.int32), 300)
    constraints = (Constraint(np.arange(300) < 100, 0.8), Constraint(np.full(300, True), 0.9))
    problem = cover_problem(visibility, rng.uniform(0.001, 0.04, 300), constraints)
    few = {"population": 9, "n_parents": 6, "max_iterations": 2, "individual_mutation_rate": 0.5}
    ways = (
        GeneticSettings(**few),
        GeneticSettings(**few, crossover="uniform", selection="elitist", replacement="generational", n_elite=2),
        GeneticSettings(**few, crossover="one-point", objective="coverage-at-most-n", n_stations=8, expected_active=1),
        GeneticSettings(**few, objective="eq9", gene_mutation_rate=0.5, distinct=True),
    )
    lanes = {"cpu": 8, "cpu-4": 4, "cpu-16": 8, "gpu": 1}[kind]
    shape = on_device.SHAPES["cpu"]
    on_device.SHAPES["cpu"] = replace(shape, lanes=lanes)
    found = [select_genetic(problem, way, device=device, given=[np.arange(3)]) for way in ways]
    on_device.SHAPES["cpu"] = shape
    return [replace(result, device="") for result in found]


def keep(tree: Tree, file: Path) -> None:
    """Write a tree's arrays and sizes."""
    arrays = {}
    for name, buffer in tree.on_device.items():
        arrays[name] = np.empty(buffer.n_bytes, dtype=np.uint8)
        tree.device.read(buffer, arrays[name])
    np.savez(file, sizes=[getattr(tree, name) for name in TREE_SIZES], **arrays)


def kept(file: Path, device: Device) -> Tree:
    """Read what `keep` wrote."""
    with np.load(file) as held:
        arrays = {name: held[name] for name in held.files if name != "sizes"}
        sizes = dict(zip(TREE_SIZES, (int(size) for size in held["sizes"]), strict=True))
    return Tree(device=device, on_device=device.upload("tree", arrays), **sizes)


def digest(found: list[Any]) -> str:
    """Hash of all arrays, bit by bit."""
    hashed = hashlib.sha256()
    for item in found:
        for name, value in sorted(vars(item).items()):
            hashed.update(name.encode())
            hashed.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
    return hashed.hexdigest()[:16]


def note_kernels() -> set[str]:
    """Names of the kernels that are launched from now on."""
    kernels: set[str] = set()
    real = pyopencl.enqueue_nd_range_kernel

    def noted(queue: Any, kernel: Any, size: tuple[int, ...], local: tuple[int, ...] | None = None) -> Any:
        kernels.add(kernel.function_name)
        return real(queue, kernel, size, group_of(queue, kernel, size) if local is None else local)

    pyopencl.enqueue_nd_range_kernel = noted
    return kernels


def group_of(queue: Any, kernel: Any, size: tuple[int, ...]) -> tuple[int, ...]:
    """The largest work-group that fits the NDRange, the kernel and the device: what a GPU's driver would take."""
    info = pyopencl.kernel_work_group_info
    left = int(kernel.get_work_group_info(info.WORK_GROUP_SIZE, queue.device))
    if kernel.get_work_group_info(info.LOCAL_MEM_SIZE, queue.device) > queue.device.local_mem_size:
        raise SystemExit(f"{kernel.function_name} takes more local memory than the device has")
    group = []
    for extent in size:
        group.append(max(n for n in range(1, left + 1) if extent % n == 0))
        left //= group[-1]
    return tuple(group)


def fill(queue: Any, buffer: Any, pattern: Any, first: int, n_bytes: int) -> Any:
    """Fill memory by a copy: oclgrind 21.10 takes what was filled for uninitialised."""
    return pyopencl.enqueue_copy(queue, buffer, np.full(n_bytes, pattern, dtype=np.uint8), dst_offset=first)


def poison_memory(byte: int) -> None:
    """Fill whatever is allocated from now on."""
    real = Device.allocate

    def poisoned(self: Device, what: str, n_bytes: int, *, is_filled: bool = False) -> Any:
        buffer = real(self, what, n_bytes, is_filled=is_filled)
        if n_bytes:
            fill(self.queue, buffer.handle, byte, 0, n_bytes)
        return buffer

    Device.allocate = poisoned  # type: ignore[method-assign]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=SHAPES)
    parser.add_argument("--save-tree", type=Path)
    parser.add_argument("--tree", type=Path)
    parser.add_argument("--poison", type=lambda text: int(text, 0))
    options = parser.parse_args()
    kernels = note_kernels()
    pyopencl.enqueue_fill_buffer = fill
    # Small scenes would be one work-item's: let several share the work, as they do in use.
    kind = options.kind.partition("-")[0]
    sort._MIN_CHUNK, patch_mode._GROUPS_A_RUN = 16, {kind: 2}
    tree._FEW_CLUSTERS, tree._FEW_NODES = {kind: 40}, {kind: 1}
    if options.poison is not None:
        poison_memory(options.poison)
    if options.tree is not None:
        opencl.build_tree = lambda _, device: kept(options.tree, device)  # type: ignore[attr-defined]
    found = results(options.kind, with_tree=options.tree is None, save_tree=options.save_tree)
    each = [f"{type(item).__name__} {digest([item])}" for item in found]
    print(json.dumps({"kernels": sorted(kernels), "results": digest(found), "each": each}))


if __name__ == "__main__":
    main()
