"""Scans a second: our OpenCL engine against Open3D's RaycastingScene, same beams, same cores, one process, in turns.

    python -m tests.benchmarks.bench_scan [--write docs/benchmarks/scan.md] [--quick]

Beams: ours is `scan`, kernel and range, triangle, patch and incidence of every beam back in NumPy; Open3D's is
`cast_rays` alone (range, triangle, weights and normal), with the rays already made. Free rays: both have them in
float32 already; `checked` is `cast_rays` of ours with its float64 checks. Visibility is `visible_patches` a position,
which is what planning calls, against the same `cast_rays`. Tree: a whole `OpenCLEngine` against adding the triangles
and committing them. Patch mode is `PatchMode.visible_patches` a position. Links: `candidate_links` against the scans of
the same candidates, not against Open3D. Medians over stations and rounds. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.device import open_device
from planner_core.engine.open3d import import_open3d
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.tuning import tile_shape
from planner_core.model import BeamTemplate, LinkLimits, Patches, Scene
from planner_core.network.candidate_links import candidate_links
from planner_core.network.links import surface_of_patches
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import directions, make_template
from planner_core.scene.patches import make_patches
from tests.benchmarks.offices import dome, office, processor

open3d = import_open3d()
REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
PATCH_AREA_M2 = 0.04


@dataclass(frozen=True)
class Cost:
    """Medians of one kind of work: by the clock, and processor time of all threads."""

    wall_ms: float
    cpu_ms: float


#: Where there is nothing to compare with.
NOTHING = Cost(float("nan"), float("nan"))


@dataclass(frozen=True)
class Row:
    scene: str
    what: str
    ours: Cost
    open3d: Cost
    target: float | None
    other_triangle: float = float("nan")
    """Share of beams for which the engines name different triangles."""
    remark: str = ""

    @property
    def ratio(self) -> float:
        return self.open3d.wall_ms / self.ours.wall_ms

    @property
    def cpu_ratio(self) -> float:
        return self.open3d.cpu_ms / self.ours.cpu_ms


def raycasting_of(scene: Scene) -> Any:  # an open3d.t.geometry.RaycastingScene
    raycasting = open3d.t.geometry.RaycastingScene()
    raycasting.add_triangles(
        open3d.core.Tensor(scene.vertices_m.astype(np.float32)), open3d.core.Tensor(scene.triangles.astype(np.uint32))
    )
    # The first cast commits the scene: without it nothing has been built.
    raycasting.cast_rays(open3d.core.Tensor(np.ones((1, 6), dtype=np.float32)))
    return raycasting


def stations_of(scene: Scene, count: int, raycasting: Any) -> np.ndarray:
    """Random points above which and below which there is something: inside the building."""
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    points = low + (high - low) * np.random.default_rng(2).uniform(0.1, 0.9, (4000, 3))
    rays = np.concatenate([np.repeat(points, 2, axis=0), np.tile([[0, 0, 1.0], [0, 0, -1.0]], (4000, 1))], axis=1)
    hit = raycasting.cast_rays(open3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy().reshape(-1, 2)
    inside = (hit > 0.3).all(axis=1) & (hit < 4.0).all(axis=1)
    return np.asarray(points[inside][:count])


class Watch:
    """Times pieces of work; `cost` is their medians."""

    def __init__(self) -> None:
        self._wall: list[float] = []
        self._cpu: list[float] = []

    def time(self, work: Callable[[], Any]) -> Any:
        wall, cpu = time.perf_counter(), time.process_time()
        out = work()
        self._cpu.append(1e3 * (time.process_time() - cpu))
        self._wall.append(1e3 * (time.perf_counter() - wall))
        return out

    @property
    def cost(self) -> Cost:
        return Cost(float(np.median(self._wall)), float(np.median(self._cpu)))


@dataclass(frozen=True)
class Subject:
    name: str
    scene: Scene
    patches: Patches
    engine: OpenCLEngine
    raycasting: Any
    stations: np.ndarray
    rounds: int
    fine: bool
    """Many small triangles: the targets are others."""


def bench_scene(name: str, scene: Scene, *, rounds: int, say: Callable[[str], None]) -> list[Row]:
    patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    device = open_device()
    # What beams meet: both engines go through the same glass.
    traced = OpenCLEngine(scene, patches, device).traced.scene  # programs are compiled once
    ours, theirs = Watch(), Watch()
    for _ in range(3):
        engine = ours.time(lambda: OpenCLEngine(scene, patches, device))
        raycasting = theirs.time(lambda: raycasting_of(traced))
    say(
        f"{name}: {scene.n_triangles} triangles, {patches.n_patches} patches, "
        f"{engine.tree.n_bytes / scene.n_triangles:.0f} bytes a triangle for geometry and tree, SAH cost "
        f"{engine.tree.sah_cost:.1f}"
    )
    fine = scene.n_triangles > 1_000_000
    subject = Subject(name, scene, patches, engine, raycasting, stations_of(scene, 6, raycasting), rounds, fine)
    hdl = make_template(load_scanner("hdl-64e"))
    pandar = make_template(load_scanner("pandar64"))
    return [
        *bench_template(subject, "HDL-64E, 5 m", replace(hdl, range_max_m=5.0), *((6, None) if fine else (9, 20))),
        *bench_template(
            subject, "HDL-64E, no limit", replace(hdl, range_max_m=np.inf), *((4, None) if fine else (8, 15))
        ),
        *bench_template(subject, "Pandar64, no limit", replace(pandar, range_max_m=np.inf), 2.5 if fine else 6),
        *bench_template(subject, "dome of 2000 x 833, no limit", dome()),
        bench_rays(subject),
        bench_patch_mode(subject),
        Row(name, "tree", ours.cost, theirs.cost, 3.0 if fine else 1.0),
    ]


def bench_template(
    subject: Subject,
    what: str,
    template: BeamTemplate,
    target: float | None = None,
    visibility_target: float | None = None,
) -> list[Row]:
    """All results, and visibility a position."""
    engine, stations = subject.engine, subject.stations
    beams = directions(template).astype(np.float32).reshape(-1, 3)
    engine.scan(template, stations[:1])
    engine.visible_patches(template, stations[:1])
    ours, theirs, visibility, other = Watch(), Watch(), Watch(), []
    for round_ in range(subject.rounds):
        for station in stations:
            rays = np.empty((len(beams), 6), dtype=np.float32)
            rays[:, :3], rays[:, 3:] = station, beams
            tensor = open3d.core.Tensor(rays)
            scan = ours.time(partial(engine.scan, template, station[None]))
            hits = theirs.time(partial(subject.raycasting.cast_rays, tensor))
            if round_ == 0:
                triangle, range_m = hits["primitive_ids"].numpy().astype(np.int64), hits["t_hit"].numpy()
                triangle[~(range_m <= template.range_max_m) | np.isinf(range_m)] = -1
                other.append((engine.traced.in_whole_scene(triangle) != scan.triangle.ravel()).mean())
        many = np.repeat(stations, 4, axis=0)
        visibility.time(partial(engine.visible_patches, template, many))
    of_all, n = visibility.cost, 4 * len(stations)
    a_position = Cost(of_all.wall_ms / n, of_all.cpu_ms / n)
    return [
        Row(subject.name, what, ours.cost, theirs.cost, target, float(np.mean(other))),
        Row(subject.name, f"{what}: visibility", a_position, theirs.cost, visibility_target),
    ]


def bench_rays(subject: Subject) -> Row:
    """Random origins in the scene's box, random directions."""
    rng = np.random.default_rng(3)
    low, high = subject.scene.vertices_m.min(axis=0), subject.scene.vertices_m.max(axis=0)
    origins = rng.uniform(low, high, (300_000, 3))
    rays = rng.normal(size=origins.shape)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    packed = np.concatenate([origins, rays], axis=1).astype(np.float32)
    tensor = open3d.core.Tensor(packed)
    raycasting = raycasting_of(subject.scene)  # glass stops free rays
    ours, theirs, checked = Watch(), Watch(), Watch()
    subject.engine.cast_prepared(packed, range_max_m=np.inf)
    for _ in range(2 * subject.rounds + 1):
        hits = ours.time(lambda: subject.engine.cast_prepared(packed, range_max_m=np.inf))
        oracle = theirs.time(lambda: raycasting.cast_rays(tensor))
        checked.time(lambda: subject.engine.cast_rays(origins, rays, range_max_m=np.inf))
    other = oracle["primitive_ids"].numpy().astype(np.uint32).view(np.int32) != hits.triangle
    remark = f"checked {checked.cost.wall_ms:.1f}"
    target = 1.5 if subject.fine else 1.2
    return Row(subject.name, "300 000 free rays", ours.cost, theirs.cost, target, float(other.mean()), remark)


def bench_patch_mode(subject: Subject) -> Row:
    """RTC360 with points 6 mm apart at 10 m, a position; docs/method/patch-mode.md compares the kernel before."""
    mode, template = PatchMode(subject.engine, subject.scene, subject.patches), make_template(load_scanner("rtc360"))
    many, watch = np.repeat(subject.stations, 4, axis=0), Watch()
    mode.visible_patches(template, many[:1])
    for _ in range(subject.rounds):
        watch.time(lambda: mode.visible_patches(template, many))
    a_position = Cost(watch.cost.wall_ms / len(many), watch.cost.cpu_ms / len(many))
    remark = f"{a_position.cpu_ms:.1f} ms of processor time"
    return Row(subject.name, "patch mode, RTC360 6 mm, a position", a_position, NOTHING, None, remark=remark)


def bench_links(n_candidates: int) -> Row:
    """Links between random places in the synthetic office, and the HDL-64E scans that they are made of."""
    scene = office(36, 3, seed=1)
    patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    engine, template = OpenCLEngine(scene, patches, open_device()), make_template(load_scanner("hdl-64e"))
    low, high = scene.vertices_m.min(axis=0)[:2] + 0.3, scene.vertices_m.max(axis=0)[:2] - 0.3
    places = np.random.default_rng(2).uniform(low, high, (n_candidates, 2))
    positions = np.column_stack([places, np.full(n_candidates, 1.7)])
    engine.visible_patches(template, positions[:10])
    scans, links = Watch(), Watch()
    seen = scans.time(lambda: engine.visible_patches(template, positions))
    is_seen = np.zeros(patches.n_patches, dtype=bool)
    is_seen[seen.patch] = True
    surface = surface_of_patches(scene, patches, is_seen)
    for _ in range(3):  # functions are compiled in the first
        found = links.time(
            lambda: candidate_links(seen, patches.area_m2, surface, positions, limits=LinkLimits(0.3, 0.01))
        )
    remark = f"{found.n_links} links; scans in place of Open3D"
    return Row("synthetic office", f"links of {n_candidates} candidates", links.cost, scans.cost, 10.0, remark=remark)


def scenes(*, quick: bool) -> dict[str, Callable[[], Scene]]:
    found: dict[str, Callable[[], Scene]] = {"synthetic office": lambda: office(36, 3, seed=1)}
    if not quick:
        found["finely tessellated office"] = lambda: office(16, 20, seed=1)
    for path in sorted(IFC_FOLDER.glob("*.ifc")):

        def load(path: Path = path) -> Scene:
            from planner_core.scene.load import load_scene

            return load_scene(path)

        found[path.stem] = load
    return found


def as_markdown(rows: list[Row], remarks: list[str], shape: str) -> str:
    device = open_device()
    lines = [
        "# Scans: ours against Open3D",
        "Written by `make bench` (tests/benchmarks/bench_scan.py, which says what is measured). HDL-64E has 4500 x 64 "
        "beams, Pandar64 1800 x 64. Ratio = Open3D's time / ours by the clock, CPU ratio the same of processor time, "
        "which is what counts where others use the machine too. What was tried, and which targets are missed and why: "
        "[the scan engine](../method/scan-engine.md).",
        "",
        f"{processor()}, {os.cpu_count()} cores, {platform.machine()}; {device.label}, "
        f"compiled for {device.compiled_for or 'what its driver finds'}; tiles of {shape}, Open3D "
        f"{open3d.__version__}, Python {platform.python_version()}. GPUs: [gpu.md](gpu.md).",
        "",
        "| scene | what | ours ms | Open3D ms | ratio | CPU ratio | target | met | other triangle | remark |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        target = "" if row.target is None else f"{row.target:g}"
        met = "" if row.target is None else "yes" if row.ratio >= row.target else "no"
        other = "" if np.isnan(row.other_triangle) else f"{row.other_triangle:.1e}"
        theirs = f"{row.open3d.wall_ms:.1f} | {row.ratio:.2f} | {row.cpu_ratio:.2f}"
        if row.open3d is NOTHING:
            theirs = " | | "
        lines.append(
            f"| {row.scene} | {row.what} | {row.ours.wall_ms:.2f} | {theirs} | "
            f"{target} | {met} | {other} | {row.remark} |"
        )
    explained = (
        "Other triangle: share of beams for which the engines name different triangles; in IFC models nearly all are "
        "two surfaces in one place. Checked: free rays with the checks of their float64 input, ms. HELIOS++, the best "
        "known open simulator, can't be installed from a package index and was not run here; we were told of 430 to "
        "590 ms for 283 000 pulses on two cores of another machine."
    )
    return "\n".join([*lines, "", explained, "", *(f"- {remark}" for remark in remarks), ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the table to this Markdown file")
    parser.add_argument("--quick", action="store_true", help="fewer rounds, no large scene")
    options = parser.parse_args()
    rows: list[Row] = []
    remarks: list[str] = []
    for name, make in scenes(quick=options.quick).items():
        rows += bench_scene(name, make(), rounds=2 if options.quick else 5, say=remarks.append)
        print(remarks[-1], file=sys.stderr)
    rows.append(bench_links(500 if options.quick else 5000))
    tile_rows, tile_columns, lanes = tile_shape(open_device())
    text = as_markdown(rows, remarks, f"{tile_rows} x {tile_columns} beams in packets of {lanes}")
    print(text)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
