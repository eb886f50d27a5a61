"""Scans a second: our OpenCL engine against Open3D's RaycastingScene, same beams, same cores, one process, in turns.

    python tests/benchmarks/bench_scan.py [--write docs/benchmarks/scan.md] [--quick]

Ours is `scan`: kernel, and range, triangle, patch and incidence of every beam back in NumPy. Open3D's is `cast_rays`
alone (range, triangle, weights and normal), with the rays already made. `visibility` is our time a position in
`visible_patches`, which is what planning calls. Medians over stations and rounds. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import open3d

from planner_core.device import open_device
from planner_core.model import LoadReport, Scene, SceneSource
from planner_core.scan.opencl import OpenCLEngine
from planner_core.scan.scanners import load_scanner
from planner_core.scan.template import directions, make_template
from planner_core.scene.patches import make_patches

REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
PATCH_AREA_M2 = 0.04


@dataclass(frozen=True)
class Row:
    scene: str
    n_triangles: int
    what: str
    ours_ms: float
    open3d_ms: float
    visibility_ms: float
    other_triangle: float
    """Share of beams for which the engines name different triangles."""

    @property
    def ratio(self) -> float:
        return self.open3d_ms / self.ours_ms


def scene_of(vertices: np.ndarray, triangles: np.ndarray) -> Scene:
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=vertices,
        triangles=triangles.astype(np.int32),
        element_of_triangle=np.zeros(len(triangles), dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(len(triangles)),
    )


def grid_faces(low: np.ndarray, high: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The six faces of a box, each of cells x cells quads."""
    at = np.linspace(0.0, 1.0, cells + 1)
    u, v = (x.ravel() for x in np.meshgrid(at, at, indexing="ij"))
    quad = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    split = np.stack([quad, quad + cells + 1, quad + 1, quad + 1, quad + cells + 1, quad + cells + 2], axis=1)
    vertices, triangles = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            unit = np.insert(np.stack([u, v], axis=1), axis, side, axis=1)
            triangles.append(split.reshape(-1, 3) + sum(map(len, vertices)))
            vertices.append(low + unit * (high - low))
    return np.concatenate(vertices), np.concatenate(triangles)


def office(n_rooms: int, cells: int, *, seed: int) -> Scene:
    """Rooms of 6 x 5 x 3 m on a square grid with walls of 1 m gaps and thirty pieces of furniture each."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(n_rooms)))
    parts: list[tuple[np.ndarray, np.ndarray]] = []

    def add(low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
        parts.append(grid_faces(np.array(low), np.array(high), cells))

    add((0, 0, -0.2), (6 * side, 5 * side, 0))
    add((0, 0, 3), (6 * side, 5 * side, 3.2))
    for room in range(n_rooms):
        x, y = 6.0 * (room % side), 5.0 * (room // side)
        add((x, y, 0), (x + 2.5, y + 0.1, 3))
        add((x + 3.5, y, 0), (x + 6, y + 0.1, 3))
        add((x, y, 0), (x + 0.1, y + 2, 3))
        add((x, y + 3, 0), (x + 0.1, y + 5, 3))
        for _ in range(30):
            low = np.array([x, y, 0]) + rng.uniform((0.2, 0.2, 0), (5.2, 4.2, 1.0))
            add(tuple(low), tuple(low + rng.uniform(0.05, 0.7, 3)))
    vertices = np.concatenate([v for v, _ in parts])
    offsets = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return scene_of(vertices, np.concatenate([t + o for (_, t), o in zip(parts, offsets, strict=True)]))


def stations_of(scene: Scene, count: int, raycasting: open3d.t.geometry.RaycastingScene) -> np.ndarray:
    """Random points above which and below which there is something: inside the building."""
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    points = low + (high - low) * np.random.default_rng(2).uniform(0.1, 0.9, (4000, 3))
    rays = np.concatenate([np.repeat(points, 2, axis=0), np.tile([[0, 0, 1.0], [0, 0, -1.0]], (4000, 1))], axis=1)
    hit = raycasting.cast_rays(open3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy().reshape(-1, 2)
    inside = (hit > 0.3).all(axis=1) & (hit < 4.0).all(axis=1)
    return points[inside][:count]


def milliseconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - start)


def bench_scene(name: str, scene: Scene, *, rounds: int, say: Callable[[str], None]) -> list[Row]:
    patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    device = open_device()
    made: list[OpenCLEngine] = []
    build_ms = milliseconds(lambda: made.append(OpenCLEngine(scene, patches, device)))
    raycasting = open3d.t.geometry.RaycastingScene()

    def build_open3d() -> None:
        raycasting.add_triangles(
            open3d.core.Tensor(scene.vertices_m.astype(np.float32)),
            open3d.core.Tensor(scene.triangles.astype(np.uint32)),
        )
        # The first cast commits the scene: without it nothing has been built.
        raycasting.cast_rays(open3d.core.Tensor(np.ones((1, 6), dtype=np.float32)))

    build_open3d_ms = milliseconds(build_open3d)
    engine = made[0]
    say(
        f"{name}: {scene.n_triangles} triangles, {patches.n_patches} patches; tree {build_ms:.0f} ms "
        f"(Open3D {build_open3d_ms:.0f} ms), {engine.tree.n_bytes / scene.n_triangles:.0f} bytes a triangle"
    )
    stations = stations_of(scene, 6, raycasting)
    rows = [bench_template(name, scene, engine, raycasting, stations, limit, rounds) for limit in (5.0, np.inf)]
    rows.append(bench_rays(name, scene, engine, raycasting, rounds))
    return rows


def bench_template(
    name: str,
    scene: Scene,
    engine: OpenCLEngine,
    raycasting: open3d.t.geometry.RaycastingScene,
    stations: np.ndarray,
    range_max_m: float,
    rounds: int,
) -> Row:
    template = replace(make_template(load_scanner("hdl-64e")), range_max_m=range_max_m)
    beams = directions(template).astype(np.float32).reshape(-1, 3)
    engine.scan(template, stations[:1])
    engine.visible_patches(template, stations[:1])
    ours, theirs, other = [], [], []
    for round_ in range(rounds):
        for station in stations:
            rays = np.empty((len(beams), 6), dtype=np.float32)
            rays[:, :3], rays[:, 3:] = station, beams
            tensor = open3d.core.Tensor(rays)
            ours.append(milliseconds(lambda at=station[None]: engine.scan(template, at)))
            theirs.append(milliseconds(lambda tensor=tensor: raycasting.cast_rays(tensor)))
            if round_ == 0:
                hits = raycasting.cast_rays(tensor)
                triangle = hits["primitive_ids"].numpy().astype(np.int64)
                triangle[~(hits["t_hit"].numpy() <= range_max_m) | np.isinf(hits["t_hit"].numpy())] = -1
                other.append((triangle != engine.scan(template, station[None]).triangle.ravel()).mean())
    many = np.repeat(stations, 4, axis=0)
    visibility = [milliseconds(lambda: engine.visible_patches(template, many)) / len(many) for _ in range(rounds)]
    what = "beams, no limit" if np.isinf(range_max_m) else f"beams, {range_max_m:g} m"
    medians = (float(np.median(x)) for x in (ours, theirs, visibility))
    return Row(name, scene.n_triangles, what, *medians, float(np.mean(other)))


def bench_rays(
    name: str, scene: Scene, engine: OpenCLEngine, raycasting: open3d.t.geometry.RaycastingScene, rounds: int
) -> Row:
    """Random origins in the scene's box, random directions. Ours checks and normalises its float64 input, too."""
    rng = np.random.default_rng(3)
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    origins = rng.uniform(low, high, (300_000, 3))
    rays = rng.normal(size=origins.shape)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    tensor = open3d.core.Tensor(np.concatenate([origins, rays], axis=1).astype(np.float32))
    triangle = engine.cast_rays(origins, rays, range_max_m=np.inf).triangle
    ours, theirs = [], []
    for _ in range(rounds + 2):
        ours.append(milliseconds(lambda: engine.cast_rays(origins, rays, range_max_m=np.inf)))
        theirs.append(milliseconds(lambda: raycasting.cast_rays(tensor)))
    oracle = raycasting.cast_rays(tensor)["primitive_ids"].numpy().astype(np.uint32).view(np.int32)
    medians = (float(np.median(x)) for x in (ours, theirs))
    return Row(name, scene.n_triangles, "300 000 free rays", *medians, float("nan"), float((oracle != triangle).mean()))


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


def as_markdown(rows: list[Row], remarks: list[str]) -> str:
    lines = [
        "# Scans: ours against Open3D",
        "Written by `tests/benchmarks/bench_scan.py`, which says what is measured. HDL-64E, 4500 x 64 beams. "
        "Ratio = Open3D's time / ours. Other triangle: share of beams for which the engines name different triangles: "
        "in IFC models nearly all are two surfaces in one place.",
        "",
        "Free rays, which planning casts some ten thousand of to check candidates, are slower than Open3D's: a block's "
        "edge functions and their bounds are computed for one ray alone.",
        "",
        f"{open_device().label}, {os.cpu_count()} cores, {platform.machine()}, Open3D {open3d.__version__}, "
        f"Python {platform.python_version()}. GPUs: unmeasured.",
        "",
        "| scene | triangles | what | ours ms | Open3D ms | ratio | visibility ms | other triangle |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        visibility = "" if np.isnan(row.visibility_ms) else f"{row.visibility_ms:.1f}"
        lines.append(
            f"| {row.scene} | {row.n_triangles} | {row.what} | {row.ours_ms:.1f} | {row.open3d_ms:.1f} | "
            f"{row.ratio:.1f} | {visibility} | {row.other_triangle:.1e} |"
        )
    return "\n".join([*lines, "", *(f"- {remark}" for remark in remarks), ""])


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
    text = as_markdown(rows, remarks)
    print(text)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
