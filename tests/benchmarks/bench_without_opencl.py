"""What the host takes for what kernels do otherwise: looks, patch mode; medians, by turns.

    python tests/benchmarks/bench_without_opencl.py        # prints the table of docs/benchmarks/machines.md

The demo house, 12 places at eye level, patches of 0.04 m2. Both do the same work in one process: processor time of
all threads, and the clock, which on a machine that others use counts their work, too. Not a test: it cannot fail.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import scenes_synthetic
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import PatchMode
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import directions, make_template
from planner_core.scene.load import load_scene
from planner_core.scene.patches import make_patches

_ROUNDS = 5

Work = dict[str, Callable[[], object]]


def main() -> None:
    with TemporaryDirectory() as aside:
        scene = load_scene(scenes_synthetic.write(scenes_synthetic.build("house"), Path(aside, "house.ifc")))
    patches = make_patches(scene, max_area_m2=0.04)
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    at_m = np.random.default_rng(0).uniform(0.8 * low, 0.8 * high, (12, 3))
    at_m[:, 2] = low[2] + 1.6
    device = open_engine(scene, patches, engine="opencl")
    host = Open3DEngine(scene, patches)
    print(f"{device.device}; {host.device}\n")
    print("| what | OpenCL, CPU ms | host, CPU ms | Open3D's cast alone, CPU ms | host / cast, CPU | by the clock |")
    print("|---|---|---|---|---|---|")
    for range_m in (5.0, 100.0):
        template = replace(make_template(load_scanner("hdl-64e")), range_max_m=range_m)
        rays = np.zeros((int(np.prod(template.shape)), 6), dtype=np.float32)
        rays[:, 3:] = directions(template).reshape(-1, 3)

        def cast(rays: np.ndarray = rays) -> None:
            for position in at_m:
                rays[:, :3] = position
                host._raycasting.cast_rays(host._core.Tensor.from_numpy(rays))

        for what, moments in (("patches seen", None), ("returns by patch", False), ("moments by patch", True)):

            def look(engine: object, template: object = template, moments: bool | None = moments) -> object:
                if moments is None:
                    return engine.visible_patches(template, at_m)
                return engine.patch_returns(template, at_m, moments=moments)

            works = {"opencl": lambda look=look: look(device), "host": lambda look=look: look(host), "cast": cast}
            tell(f"hdl-64e, {range_m:g} m: {what}", works, per=len(at_m))
    modes = {"opencl": PatchMode(device, scene, patches), "host": PatchMode(host, scene, patches)}
    template = make_template(load_scanner("rtc360:6mm"))
    works = {name: lambda mode=mode: mode.visible_patches(template, at_m) for name, mode in modes.items()}
    tell("rtc360:6mm: patch mode", works, per=len(at_m))


def tell(what: str, works: Work, *, per: float) -> None:
    """Print a line of the table."""
    cpu_ms: dict[str, list[float]] = {name: [] for name in works}
    wall_ms: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()  # compiles
    for _ in range(_ROUNDS):
        for name, work in works.items():
            cpu_s, wall_s = time.process_time(), time.perf_counter()
            work()
            cpu_ms[name].append(1e3 * (time.process_time() - cpu_s) / per)
            wall_ms[name].append(1e3 * (time.perf_counter() - wall_s) / per)
    cpu = {name: statistics.median(values) for name, values in cpu_ms.items()}
    against = [""] * 3
    if "cast" in works:
        by_clock = statistics.median(np.array(wall_ms["host"]) / np.array(wall_ms["cast"]))
        against = [f"{cpu['cast']:.1f}", f"{cpu['host'] / cpu['cast']:.2f}", f"{by_clock:.2f}"]
    print("|", " | ".join((what, f"{cpu['opencl']:.1f}", f"{cpu['host']:.1f}", *against)), "|")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
