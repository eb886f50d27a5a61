"""Trees: ours against top-down binned SAH splits and against Open3D's building time, with what scans then cost.

    python -m tests.benchmarks.bench_tree [--quick]

Prints the table of docs/benchmarks/tuning-engine.md. Times are processor time of all threads, medians of interleaved
rounds: ours is a whole `OpenCLEngine`, Open3D's adding the triangles and committing them. The reference is
`binned_sah.py` in NumPy, whose own time is no measure; scenes of more than 200 000 triangles go without it. Not a test:
nothing can fail.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from unittest import mock

import numpy as np

from planner_core.device import Device, open_device
from planner_core.engine import opencl
from planner_core.engine.open3d import import_open3d
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.traced_surfaces import round_surfaces
from planner_core.engine.tree import Tree
from planner_core.model import Patches, Scene
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template
from planner_core.scene.patches import make_patches, squared_edges
from tests.benchmarks import binned_sah
from tests.benchmarks.bench_scan import PATCH_AREA_M2, scenes, stations_of

open3d = import_open3d()
MAX_REFERENCE_TRIANGLES = 200_000
OPEN3D = "Open3D (Embree)"


@dataclass(frozen=True)
class Row:
    builder: str
    tree: Tree
    build_ms: float
    scan_ms: tuple[float, float]


def cpu_ms(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return 1e3 * (time.process_time() - start)


def reference_tree(scene: Scene, device: Device) -> Tree:
    surfaces = round_surfaces(scene)
    found = binned_sah.build(surfaces.corners_m)
    packed = np.concatenate([surfaces.corners_m.reshape(-1, 9), surfaces.normal], axis=1)
    held = np.where(found.triangle >= 0, found.triangle, found.triangle.max(axis=1, keepdims=True))
    slot = np.empty(scene.n_triangles, dtype=np.int32)
    slot[found.triangle[found.triangle >= 0]] = np.flatnonzero(found.triangle >= 0)
    arrays = {
        "boxes": found.boxes,
        "children": found.children,
        "geometry": np.ascontiguousarray(packed[held].transpose(0, 2, 1)),
        "triangle": found.triangle,
        "slot": slot,
        "edges": squared_edges(scene.vertices_m[scene.triangles]),
    }
    sizes = (scene.n_triangles, len(found.boxes), len(found.triangle), found.n_levels)
    return Tree(device, device.upload("reference", arrays), *sizes)


def build_open3d(scene: Scene) -> open3d.t.geometry.RaycastingScene:
    raycasting = open3d.t.geometry.RaycastingScene()
    raycasting.add_triangles(
        open3d.core.Tensor(scene.vertices_m.astype(np.float32)),
        open3d.core.Tensor(scene.triangles.astype(np.uint32)),
    )
    # The first cast commits the scene: without it nothing has been built.
    raycasting.cast_rays(open3d.core.Tensor(np.ones((1, 6), dtype=np.float32)))
    return raycasting


def scan_ms(engines: list[OpenCLEngine], positions: np.ndarray, rounds: int) -> list[tuple[float, float]]:
    """Processor time a scan of each engine, HDL-64E, range 5 m and without limit."""
    template = make_template(load_scanner("hdl-64e"))
    costs = []
    for limit in (5.0, np.inf):
        limited = replace(template, range_max_m=limit)
        taken: list[list[float]] = [[] for _ in engines]
        for _ in range(rounds):
            for engine, times in zip(engines, taken, strict=True):
                engine.scan(limited, positions[:1])
                times.append(np.mean([cpu_ms(partial(engine.scan, limited, at[None])) for at in positions]))
        costs.append([float(np.median(times)) for times in taken])
    return list(zip(*costs, strict=True))


def bench_scene(scene: Scene, rounds: int) -> list[Row]:
    device = open_device()
    patches: Patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    engines = [OpenCLEngine(scene, patches, device)]
    raycasting = build_open3d(scene)
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(cpu_ms(lambda: OpenCLEngine(scene, patches, device)))
        theirs.append(cpu_ms(lambda: build_open3d(scene)))
    builders, times = ["PLOC and treelets"], [float(np.median(ours))]
    if scene.n_triangles <= MAX_REFERENCE_TRIANGLES:
        tree = reference_tree(scene, device)
        with mock.patch.object(opencl, "build_tree", lambda scene, device: tree):
            engines.append(OpenCLEngine(scene, patches, device))
        builders.append("binned SAH, reference")
        times.append(float("nan"))
    scans = scan_ms(engines, stations_of(scene, 6, raycasting), rounds)
    rows = [Row(b, e.tree, t, s) for b, e, t, s in zip(builders, engines, times, scans, strict=True)]
    return [*rows, Row(OPEN3D, rows[0].tree, float(np.median(theirs)), (float("nan"), float("nan")))]


TITLES = (
    *("scene", "triangles", "builder", "SAH cost", "nodes", "triangles a block", "levels", "bytes a triangle"),
    *("build ms", "scan 5 m ms", "scan ms"),
)


def cells_of(tree: Tree) -> list[str]:
    n = tree.n_triangles
    return [
        *(f"{tree.sah_cost:.2f}", str(tree.n_nodes), f"{n / tree.n_blocks:.2f}", str(tree.n_levels)),
        f"{tree.n_bytes / n:.0f}",
    ]


def show(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds, no large scene")
    options = parser.parse_args()
    print("| " + " | ".join(TITLES) + " |\n" + "|---" * len(TITLES) + "|")
    for name, make in scenes(quick=options.quick).items():
        for row in bench_scene(make(), rounds=3 if options.quick else 7):
            of_tree = cells_of(row.tree) if row.builder != OPEN3D else [""] * 5
            times = [show(row.build_ms, 0), *(show(x, 2) for x in row.scan_ms)]
            print(
                "| " + " | ".join([name, str(row.tree.n_triangles), row.builder, *of_tree, *times]) + " |", flush=True
            )


if __name__ == "__main__":
    main()
