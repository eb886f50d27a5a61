"""Beams by the hundred million at shared edges and vertices of closed meshes: none may pass between two triangles.

    python tests/soak/soak_watertight.py [--beams 1.1e8] [--seed 1] [--write docs/benchmarks/watertight.md] [--fresh]

Every mesh of `meshes.py` is scaled to radii from 0.05 to 300 m and set down at several distances from the local origin.
Beams start at points inside, and outside, and are aimed at edges (anywhere along them, and a hair from their ends) and
vertices of the mesh as float32 has it. They go two ways: `cast_rays`, and `scan`, whose templates are made of the very
directions. Each beam is checked in float64 and against Open3D, see `verdicts.py`.

Jobs that are done are kept in build/soak-watertight.jsonl, by seed, size and state of the kernels: an interrupted run
goes on where it was. Exit code 1 where a beam leaks, a range is wrong or a disagreement stays unexplained.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import meshes
import numpy as np
import verdicts
from meshes import Mesh
from numpy.typing import NDArray
from verdicts import Floats, Ints

from planner_core.device import Device, open_device
from planner_core.device.sources import kernels_hash
from planner_core.engine.open3d import import_open3d
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.tuning import tile_shape, use_shape
from planner_core.model import BeamTemplate, LoadReport, Scene, SceneSource
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches

open3d = import_open3d()
REPOSITORY = Path(__file__).resolve().parents[2]
#: Of the mesh's centre from the local origin, metres; the last is ten kilometres in a skew direction.
DISTANCES_M = (0.0, 1.0, 100.0, 10_000.0)
RADII_M = (0.05, 2.0, 300.0)
AWAY = np.array([0.48, -0.6, 0.64])
PATHS = ("rays", "scan", "scan, one lane", "grid scan")
#: How beams are shared out: rows of a template are a tile's worth of work each, so that fewer are cast that way.
SHARES = {"rays": 0.6, "scan": 0.02, "scan, one lane": 0.02, "grid scan": 0.36}
BATCH = 400_000
#: Of so many hits one is asked whether its range is that of its triangle.
RANGE_SAMPLE = 8
#: Rows of a template of one column: beams of one sector, from the highest to the lowest.
ROWS = 4096
SECTOR_RAD = np.deg2rad(12.0)


REMARKS = (
    "- rays: `cast_rays`. scan: templates of one column, a row a beam, in the device's own shape of tile; one",
    "  lane: in the shape for GPUs. grid scan: templates whose azimuths are those of a mesh's meridians, so",
    "  that whole columns run along edges.",
    "- Both along a shared edge or vertex, two surfaces in one place: ranges agree. In our margin: triangles",
    "  are larger by the bound of rounding, and the beam meets only that. In Open3D's rounding: a triangle",
    "  that one engine names and the other passes, nearer to an edge than float32 can tell. Beside a line: one",
    "  of the triangles is, seen from the origin, thinner than float32 can tell, a needle or seen edge-on;",
    "  beams that pass beside its end in its plane may be stopped (block.h). Let through by Open3D: a triangle",
    "  that the beam meets in float64, and Open3D goes on behind it.",
    "- Wrong ranges: of one hit in eight, those whose range is not that of the plane of their triangle; not asked",
    "  of lines.",
    "- Sizes that float32 can't hold at a place (less than 32 steps across) are left out: slivers and small",
    "  meshes far away.",
)


@dataclass(frozen=True)
class Job:
    """One mesh, in one size, at one place, one way of casting."""

    mesh: str
    path: str
    radius_m: float
    distance_m: float
    n_beams: int
    seed: int

    @property
    def key(self) -> str:
        return json.dumps(asdict(self), sort_keys=True)


@dataclass
class Tally:
    """What became of a job's beams."""

    n_beams: int = 0
    leaks: int = 0
    wrong_ranges: int = 0
    other_triangle: int = 0
    reasons: list[int] = field(default_factory=lambda: [0] * len(verdicts.REASONS))
    examples: list[str] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        self.n_beams += other.n_beams
        self.leaks += other.leaks
        self.wrong_ranges += other.wrong_ranges
        self.other_triangle += other.other_triangle
        self.reasons = [a + b for a, b in zip(self.reasons, other.reasons, strict=True)]
        self.examples = (self.examples + other.examples)[:20]


class Target:
    """A mesh in its place, as float32 has it, both engines, and which triangles meet where beams are aimed."""

    def __init__(self, mesh: Mesh, radius_m: float, distance_m: float, device: Device) -> None:
        self.mesh, self.radius_m = mesh, radius_m
        self.centre = np.float32(distance_m * AWAY).astype(np.float64)
        self.vertices = np.float32(mesh.vertices * radius_m + self.centre).astype(np.float64)
        self.cells = mesh.triangles.astype(np.int64)
        self.corners = self.vertices[self.cells]
        self.inside = np.float32(mesh.inside * radius_m + self.centre).astype(np.float64)
        scene = scene_of(self.vertices, mesh.triangles)
        self.engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e12), device)
        self.oracle = open3d.t.geometry.RaycastingScene()
        self.oracle.add_triangles(
            open3d.core.Tensor(self.vertices.astype(np.float32)), open3d.core.Tensor(mesh.triangles.astype(np.uint32))
        )
        self.edges, self.beside_edge, self.around_vertex = incidence(self.cells, len(self.vertices))

    def is_worth_it(self) -> bool:
        """Whether float32 leaves the mesh its inside at this size and place: 32 steps across where it is thinnest."""
        extent = np.ptp(self.vertices, axis=0).min()
        return bool(extent >= 32 * np.spacing(np.float32(np.abs(self.vertices).max())))


def scene_of(vertices: Floats, triangles: NDArray[np.int32]) -> Scene:
    """A scene of exactly these triangles: nothing welded, dropped or moved."""
    return Scene(
        source=SceneSource(Path("memory"), "", "memory", "metre", 1.0, "Z"),
        vertices_m=vertices,
        triangles=triangles,
        element_of_triangle=np.zeros(len(triangles), dtype=np.int32),
        elements=(),
        storeys=(),
        offset_m=np.zeros(3),
        report=LoadReport(len(triangles)),
    )


def incidence(cells: Ints, n_vertices: int) -> tuple[Ints, Ints, Ints]:
    """Edges (E, 2); triangles beside each edge (E, <= 4); triangles around each vertex (V, <= 12); -1 where no more."""
    triangle = np.repeat(np.arange(len(cells)), 3)
    pairs = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, of = np.unique(pairs, axis=0, return_inverse=True)
    return (
        edges,
        _grouped(of.reshape(-1), triangle, len(edges), 4),
        _grouped(cells.reshape(-1), triangle, n_vertices, 12),
    )


def _grouped(of: Ints, value: Ints, n: int, most: int) -> Ints:
    order = np.argsort(of, kind="stable")
    of, value = of[order], value[order]
    rank = np.arange(len(of)) - np.searchsorted(of, of)
    table = np.full((n, most), -1, dtype=np.int64)
    kept = rank < most
    table[of[kept], rank[kept]] = value[kept]
    return table


def aim(target: Target, count: int, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """Points on edges and vertices (N, 3), and the triangles that meet there (N, 12)."""
    edge = rng.integers(len(target.edges), size=count)
    along = rng.uniform(size=count)
    kind = rng.integers(10, size=count)
    # A tenth at vertices, a tenth a hair from an edge's end.
    along[kind == 0] = 0.0
    along[kind == 1] = 10.0 ** rng.uniform(-9, -3, size=int((kind == 1).sum()))
    a, b = target.vertices[target.edges[edge, 0]], target.vertices[target.edges[edge, 1]]
    others = target.around_vertex[target.edges[edge, 0]]
    others[kind > 1] = -1
    others[kind > 1, :4] = target.beside_edge[edge[kind > 1]]
    return a + along[:, None] * (b - a), others


def origins_of(target: Target, count: int, rng: np.random.Generator) -> tuple[Floats, NDArray[np.bool_]]:
    """Where beams start (N, 3), and whether they must end; a fifth starts outside, 1.3 to 40 radii away."""
    origins = target.inside[rng.integers(len(target.inside), size=count)]
    must_end = rng.uniform(size=count) < 0.8
    away = rng.normal(size=(count, 3))
    away *= (target.radius_m * 1.3 * 10 ** rng.uniform(0, 1.5, size=count) / np.linalg.norm(away, axis=1))[:, None]
    out = np.float32(target.centre + away).astype(np.float64)
    return np.where(must_end[:, None], origins, out), must_end


def judge(
    target: Target,
    origins: Floats,
    beams: NDArray[np.float32],
    must_end: NDArray[np.bool_],
    others: Ints,
    triangle: NDArray[np.int32],
    range_m: NDArray[np.float32],
) -> Tally:
    """Compare hits of N beams with float64 and with Open3D. `others` (N, K): triangles that beams were aimed at."""
    rays = np.concatenate([origins.astype(np.float32), beams], axis=1)
    found = target.oracle.cast_rays(open3d.core.Tensor(np.ascontiguousarray(rays)))
    oracle = found["primitive_ids"].numpy().astype(np.uint32).view(np.int32).astype(np.int64)
    oracle_m = found["t_hit"].numpy().astype(np.float64)
    oracle[~np.isfinite(oracle_m)] = -1
    ours, ours_m = triangle.astype(np.int64), range_m.astype(np.float64)
    wide = beams.astype(np.float64)
    let_through = np.zeros(len(origins), dtype=bool)
    # Beams that hit one of the triangles they were aimed at need no float64: they were not let through.
    asked = np.flatnonzero((ours < 0) | ~(others == ours[:, None]).any(axis=1) | (ours != oracle))
    if asked.size:
        let_through[asked] = verdicts.leaks(
            origins[asked],
            wide[asked],
            target.corners,
            ours[asked],
            ours_m[asked],
            must_end[asked],
            np.concatenate([others[asked], oracle[asked, None]], axis=1),
        )
    tally = Tally(len(origins), int(let_through.sum()))
    sample = np.flatnonzero(ours >= 0)[::RANGE_SAMPLE]
    off = verdicts.wrong_ranges(origins[sample], wide[sample], target.corners[ours[sample]], ours_m[sample])
    tally.wrong_ranges = int(off.sum())
    differing = np.flatnonzero(ours != oracle)
    tally.other_triangle = int(differing.size)
    reason = verdicts.explain(
        origins[differing],
        wide[differing],
        target.corners,
        target.cells,
        (ours[differing], ours_m[differing]),
        (oracle[differing], oracle_m[differing]),
    )
    tally.reasons = np.bincount(reason, minlength=len(verdicts.REASONS)).tolist()
    unexplained = differing[reason == len(verdicts.REASONS) - 1]
    bad = np.unique(np.concatenate([np.flatnonzero(let_through), unexplained, sample[off]]))
    tally.examples = [
        f"origin {[float(x).hex() for x in origins[i]]} beam {[float(x).hex() for x in wide[i]]}: "
        f"ours {ours[i]} at {ours_m[i]!r}, Open3D {oracle[i]} at {oracle_m[i]!r}{', LEAK' if let_through[i] else ''}"
        for i in bad[:5]
    ]
    return tally


# ------------------------------------------------------------------------------------------------- ways of casting
def cast(target: Target, count: int, rng: np.random.Generator) -> Tally:
    """Free rays."""
    points, others = aim(target, count, rng)
    origins, must_end = origins_of(target, count, rng)
    aims = points - origins
    unit = aims / np.linalg.norm(aims, axis=1, keepdims=True)
    hits = target.engine.cast_rays(origins, unit, range_max_m=np.inf)
    # The engine makes directions unit again before it rounds them: the same beams, but for the last bit of float64.
    again = unit / np.sqrt(np.einsum("ij,ij->i", unit, unit))[:, None]
    return judge(target, origins, again.astype(np.float32), must_end, others, hits.triangle, hits.range_m)


def scan_rows(target: Target, count: int, rng: np.random.Generator) -> Tally:
    """Scans whose every row is one beam: any directions, in sectors so that tiles are as slim as they are in use."""
    tally = Tally()
    while tally.n_beams < count:
        points, others = aim(target, 40 * ROWS, rng)
        origin = target.inside[rng.integers(len(target.inside))]
        aims = points - origin
        elevation = np.arctan2(aims[:, 2], np.hypot(aims[:, 0], aims[:, 1]))
        azimuth = np.arctan2(aims[:, 1], aims[:, 0])
        sector = np.floor(azimuth / SECTOR_RAD).astype(np.int64)
        for number in np.unique(sector):
            chosen = np.flatnonzero(sector == number)[:ROWS]
            chosen = chosen[np.argsort(-elevation[chosen], kind="stable")]
            middle = (number + 0.5) * SECTOR_RAD
            template = BeamTemplate(
                np.array([middle]), elevation[chosen], 0.0, np.inf, azimuth_offset_rad=azimuth[chosen] - middle
            )
            batch = target.engine.scan(template, origin[None])
            beams = directions(template).astype(np.float32).reshape(-1, 3)
            origins = np.broadcast_to(origin, (len(beams), 3))
            must_end = np.ones(len(beams), dtype=bool)
            tally.add(
                judge(target, origins, beams, must_end, others[chosen], batch.triangle.ravel(), batch.range_m.ravel())
            )
            if tally.n_beams >= count:
                break
    return tally


def scan_grid(target: Target, count: int, rng: np.random.Generator) -> Tally:
    """Scans of meshes whose vertices lie on a grid of elevations and azimuths: along all meridians, at all vertices."""
    assert target.mesh.grid is not None
    elevation, azimuth = target.mesh.grid
    tally = Tally()
    while tally.n_beams < count:
        extra = rng.uniform(elevation[-1], elevation[0], size=max(16, BATCH // azimuth.size - elevation.size))
        rows = np.sort(np.concatenate([elevation, extra]))[::-1].copy()
        template = BeamTemplate(azimuth, rows, 0.0, np.inf)
        origin = target.inside[0]
        batch = target.engine.scan(template, origin[None])
        beams = directions(template).astype(np.float32).reshape(-1, 3)
        tally.add(
            judge(
                target,
                np.broadcast_to(origin, (len(beams), 3)),
                beams,
                np.ones(len(beams), dtype=bool),
                np.full((len(beams), 1), -1),
                batch.triangle.ravel(),
                batch.range_m.ravel(),
            )
        )
    return tally


def do(job: Job, target: Target) -> Tally:
    """Cast a job's beams; the same ones whenever job and seed are the same."""
    rng = np.random.default_rng(
        [job.seed, zlib.crc32(f"{job.mesh} {job.path} {job.radius_m} {job.distance_m}".encode())]
    )
    if job.path == "grid scan":
        return scan_grid(target, job.n_beams, rng)
    if job.path == "scan":
        return scan_rows(target, job.n_beams, rng)
    if job.path == "scan, one lane":
        with use_shape((4, 8, 1)):
            return scan_rows(target, job.n_beams, rng)
    tally = Tally()
    while tally.n_beams < job.n_beams:
        tally.add(cast(target, min(BATCH, job.n_beams - tally.n_beams), rng))
    return tally


def jobs_of(n_beams: int, seed: int) -> Iterator[tuple[Mesh, float, float, list[Job]]]:
    """All jobs, grouped by mesh in its place; every way of casting gets its share, evenly over what it is used on."""
    everything = meshes.all_meshes(seed=seed)
    places = [(r, d) for d in DISTANCES_M for r in RADII_M]
    n_grids = sum(mesh.grid is not None for mesh in everything)
    for mesh in everything:
        assert meshes.odd_edges(mesh.triangles) == 0, f"{mesh.name} is not closed"
        paths = [path for path in PATHS if path != "grid scan" or mesh.grid is not None]
        for radius_m, distance_m in places:
            share = {
                path: SHARES[path] / len(places) / (n_grids if path == "grid scan" else len(everything))
                for path in paths
            }
            yield (
                mesh,
                radius_m,
                distance_m,
                [
                    Job(mesh.name, path, radius_m, distance_m, max(1, round(n_beams * share[path])), seed)
                    for path in paths
                ],
            )


def run(n_beams: int, seed: int, store: Path | None) -> list[tuple[Job, Tally]]:
    """Do all jobs, or take them from `store`; a size that float32 can't hold at a place is left out."""
    device = open_device()
    kernels = f"{kernels_hash()} {tile_shape(device)}"
    kept: dict[str, dict[str, object]] = {}
    if store is not None and store.exists():
        for line in store.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            if entry["kernels"] == kernels:
                kept[entry["job"]] = entry["tally"]
    results: list[tuple[Job, Tally]] = []
    started_s, done = time.monotonic(), 0
    for mesh, radius_m, distance_m, jobs in jobs_of(n_beams, seed):
        target: Target | None = None
        for job in jobs:
            if job.key in kept:
                results.append((job, Tally(**kept[job.key])))  # type: ignore[arg-type]
                continue
            target = target or Target(mesh, radius_m, distance_m, device)
            tally = do(job, target) if target.is_worth_it() else Tally()
            results.append((job, tally))
            done += tally.n_beams
            if store is not None:
                store.parent.mkdir(parents=True, exist_ok=True)
                with store.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"kernels": kernels, "job": job.key, "tally": asdict(tally)}) + "\n")
        total = sum(tally.n_beams for _, tally in results)
        print(
            f"{total / 1e6:6.1f} million beams, {sum(t.leaks for _, t in results)} leaks, "
            f"{sum(t.reasons[-1] for _, t in results)} unexplained; {mesh.name}, {radius_m:g} m at {distance_m:g} m; "
            f"{time.monotonic() - started_s:.0f} s",
            file=sys.stderr,
            flush=True,
        )
    return results


def as_markdown(results: list[tuple[Job, Tally]], seed: int) -> str:
    total = summed(results)
    lines = [
        "# Watertight: beams at shared edges and vertices",
        "Written by `make soak` (`tests/soak/soak_watertight.py`, which says how beams are aimed; `verdicts.py` beside "
        "it says what counts as what). How the kernels do it: [Watertight](../method/watertight.md).",
        "",
        f"{total.n_beams / 1e6:.1f} million beams, seed {seed}: **{total.leaks} leaks, {total.wrong_ranges} wrong "
        f"ranges, {total.reasons[-1]} unexplained disagreements with Open3D.** {open_device().label}, "
        f"{os.cpu_count()} cores, {platform.machine()}, Open3D {open3d.__version__}, kernels {kernels_hash()}. "
        "GPUs: unmeasured.",
        "",
        "A leak: a beam from inside that ends nowhere, or any beam that goes on behind a triangle which it meets in "
        "float64. Other triangle: the engines name different ones. Beams run along edges here, so that most of these "
        "are one edge's two triangles at one range.",
        "",
        *table("mesh", by(results, lambda job: job.mesh)),
        "",
        *table("from the local origin", by(results, lambda job: f"{job.distance_m:g} m")),
        "",
        *table("radius", by(results, lambda job: f"{job.radius_m:g} m")),
        "",
        *table("way", by(results, lambda job: job.path)),
        "",
        *REMARKS,
        "",
    ]
    return "\n".join(lines)


def summed(results: list[tuple[Job, Tally]]) -> Tally:
    total = Tally()
    for _, tally in results:
        total.add(tally)
    return total


def by(results: list[tuple[Job, Tally]], name: object) -> dict[str, Tally]:
    grouped: dict[str, Tally] = {}
    for job, tally in results:
        grouped.setdefault(name(job), Tally()).add(tally)  # type: ignore[operator]
    return grouped


def table(title: str, rows: dict[str, Tally]) -> list[str]:
    header = ("beams, millions", "leaks", "wrong ranges", "other triangle", *verdicts.REASONS)
    lines = [f"| {title} | {' | '.join(header)} |", f"|---{'|---' * len(header)}|"]
    for name, tally in rows.items():
        cells = (f"{tally.n_beams / 1e6:.2f}", tally.leaks, tally.wrong_ranges, tally.other_triangle, *tally.reasons)
        lines.append(f"| {name} | {' | '.join(map(str, cells))} |")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beams", type=float, default=1.1e8, help="how many, before sizes are left out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--fresh", action="store_true", help="do not go on where an earlier run was interrupted")
    parser.add_argument("--store", type=Path, default=REPOSITORY / "build" / "soak-watertight.jsonl")
    options = parser.parse_args()
    if options.fresh:
        options.store.unlink(missing_ok=True)
    results = run(int(options.beams), options.seed, options.store)
    total = summed(results)
    text = as_markdown(results, options.seed)
    print(text)
    for example in total.examples:
        print(example, file=sys.stderr)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")
    return int(total.leaks > 0 or total.wrong_ranges > 0 or total.reasons[-1] > 0)


if __name__ == "__main__":
    sys.exit(main())
