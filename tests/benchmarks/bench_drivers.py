"""OpenCL drivers beside each other, and the host without any: scans and visibility, one process, in turns.

    python -m tests.benchmarks.bench_drivers [--write docs/benchmarks/drivers.md]

Every device that works here, and Open3D, the fallback. With PYTHONPATH=tests/machines/unknown_processor PoCL is as on
processors that it does not know, and LEVEL=x86-64-v3 compiles for a lower level than this one has. Scan and visibility
as in bench_scan.py, HDL-64E, against `cast_rays` of Open3D alone. Results: whether all those of the scans are those of
the first device, to the bit. Medians over stations and rounds. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner_core.device import Device, list_devices, pocl, problem_of_device
from planner_core.device.choice import open_unchecked
from planner_core.engine.open3d import Open3DEngine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import BeamTemplate, Scene, Visibility
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import directions, make_template
from planner_core.scene.load import load_scene
from planner_core.scene.patches import make_patches
from tests.benchmarks.bench_scan import IFC_FOLDER, PATCH_AREA_M2, Watch, open3d, stations_of
from tests.benchmarks.offices import office

_ROUNDS = 5


def drivers() -> Iterator[tuple[str, Device | None]]:
    """Every device that works, and None for the host, each with its label."""
    for info in list_devices():
        if not problem_of_device(info):
            as_what = f", compiled for {info.compiled_for}" if info.compiled_for else ""
            yield f"{info.platform}{as_what}", open_unchecked(info.index)
    yield "no OpenCL: Open3D", None


def engine_of(scene: Scene, device: Device | None) -> ScanEngine:
    patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    return Open3DEngine(scene, patches) if device is None else OpenCLEngine(scene, patches, device)


def template_of(range_max_m: float) -> BeamTemplate:
    return replace(make_template(load_scanner("hdl-64e")), range_max_m=range_max_m)


def bench(name: str, scene: Scene, there: list[tuple[str, Device | None]], range_max_m: float) -> list[str]:
    """Rows of the table for one scene and range limit."""
    template = template_of(range_max_m)
    beams = directions(template).astype(np.float32).reshape(-1, 3)
    raycasting = open3d.t.geometry.RaycastingScene()
    raycasting.add_triangles(
        open3d.core.Tensor(scene.vertices_m.astype(np.float32)), open3d.core.Tensor(scene.triangles.astype(np.uint32))
    )
    stations = stations_of(scene, 6, raycasting)
    labels = [label for label, _ in there]
    engines: list[tuple[str, ScanEngine]] = []
    scans, visibility = {label: Watch() for label in labels}, {label: Watch() for label in labels}
    bits = {label: hashlib.sha256() for label in labels}
    seen: dict[str, Visibility] = {}
    cast = Watch()
    for label, device in there:
        engine = engine_of(scene, device)
        engine.scan(template, stations[:1])
        seen[label] = engine.visible_patches(template, stations)
        engines.append((label, engine))
    for round_ in range(_ROUNDS):
        for station in stations:
            rays = open3d.core.Tensor(
                np.concatenate([np.tile(station, (len(beams), 1)), beams], axis=1, dtype=np.float32)
            )
            cast.time(lambda rays=rays: raycasting.cast_rays(rays))
            for label, engine in engines:
                batch = scans[label].time(lambda engine=engine, at=station[None]: engine.scan(template, at))
                if round_ == 0:
                    for array in (batch.range_m, batch.triangle, batch.patch, batch.cos_incidence):
                        bits[label].update(array.tobytes())
        for label, engine in engines:
            visibility[label].time(lambda engine=engine: engine.visible_patches(template, stations))
    limit = "no limit" if np.isinf(range_max_m) else f"{range_max_m:g} m"
    first = labels[0]
    rows = []
    for label in labels:
        scan_ms, seen_ms = scans[label].cost.wall_ms, visibility[label].cost.wall_ms / len(stations)
        rows.append(
            f"| {name}, {limit} | {label} | {cast.cost.wall_ms / scan_ms:.2f} | {cast.cost.wall_ms / seen_ms:.2f} | "
            f"{'same' if bits[label].digest() == bits[first].digest() else _difference(seen[first], seen[label])} |"
        )
    return rows


def _difference(one: Visibility, other: Visibility) -> str:
    """How many pairs of position and patch only one of the two has."""
    pairs = [
        set(zip(np.repeat(np.arange(v.n_positions), np.diff(v.starts)).tolist(), v.patch.tolist(), strict=True))
        for v in (one, other)
    ]
    return f"{len(pairs[0] ^ pairs[1])} of {len(pairs[0])} patches seen"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the table to this Markdown file")
    options = parser.parse_args()
    there = list(drivers())
    scenes = {"synthetic office": office(36, 3, seed=1)}
    if (IFC_FOLDER / "duplex.ifc").is_file():
        scenes["duplex"] = load_scene(IFC_FOLDER / "duplex.ifc")
    rows = [
        row for name, scene in scenes.items() for limit in (5.0, np.inf) for row in bench(name, scene, there, limit)
    ]
    versions = "; ".join(f"{info.platform} {info.version}" for info in list_devices())
    lines = [
        "# OpenCL drivers, and the host without any",
        "Written by `make bench-drivers` (tests/benchmarks/bench_drivers.py, which says what is measured). Scan and "
        "visibility: how many times as fast as Open3D's own `cast_rays` of the same beams (HDL-64E, 4500 x 64), by the "
        "clock. Results: whether ranges, triangles, patches and incidences of all scans are those of the first row to "
        "the bit; else how many patches are seen by only one of the two.",
        "",
        f"{versions}; {os.cpu_count()} cores, {platform.machine()}, {pocl.level_of(pocl.processor_flags())}, Open3D "
        f"{open3d.__version__}, Python {platform.python_version()}.",
        "",
        "| scene, range | driver | scan | visibility | results |",
        "|---|---|---|---|---|",
        *rows,
        "",
    ]
    text = "\n".join(lines)
    print(text)
    if options.write is not None:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
