"""Time and memory against triangles, from 10^4 to 3 * 10^7: what planning does with a scene, each size in a process.

    python -m tests.benchmarks.bench_scale [--write docs/benchmarks/scale.md] [--most 10000000] [--memory 600MB]

Scenes: the finely tessellated office of `bench_scan.py` in storeys of 3.4 m; rooms, storeys and triangles a face grow
together. Stages in their order, each by the processor time of all threads, since others use the machine, and by the
most memory that the process had meanwhile, with Python, NumPy, Open3D (0.2 GB in all) and the scene itself: that is
what has to fit into a machine. Scan: the HDL-64E's 288 000 beams without limit of range, a position. Slope: of the
logarithms, least squares, over the sizes from 10^5 on. `--memory`: 10^7 once more with that TLSPLAN_MEMORY, in parts.
Goes on where it was interrupted. Not a test.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve()
#: Storeys, rooms a storey, quads along an edge of a face.
SIZES = ((1, 4, 3), (2, 9, 4), (3, 16, 7), (4, 16, 11), (5, 25, 14), (6, 38, 18))
STAGES = ("scene", "patches", "floors", "engine", "scan", "visibility", "free rays")
STOREY_M = 3.4
CAP_BYTES = 8 * 10**9
#: The largest size that is scanned in parts as well: as much is seen, in less time.
IN_PARTS = 2 * 10**7


def n_triangles_of(size: tuple[int, int, int]) -> int:
    storeys, rooms, cells = size
    return storeys * (2 + 34 * rooms) * 12 * cells**2


def building(size: tuple[int, int, int]) -> Any:
    """Offices on top of each other."""
    from planner_core.model import Element, Storey
    from tests.benchmarks.offices import office, scene_of

    storeys, rooms, cells = size
    one = office(rooms, cells, seed=1)
    n_vertices, n_triangles = len(one.vertices_m), one.n_triangles
    vertices, triangles = np.empty((storeys * n_vertices, 3)), np.empty((storeys * n_triangles, 3), dtype=np.int32)
    for k in range(storeys):
        vertices[k * n_vertices : (k + 1) * n_vertices] = one.vertices_m + np.array([0, 0, STOREY_M * k])
        triangles[k * n_triangles : (k + 1) * n_triangles] = one.triangles + k * n_vertices
    levels = tuple(Storey(f"S{k}", "", STOREY_M * k) for k in range(storeys))
    return replace(scene_of(vertices, triangles), storeys=levels, elements=(Element("office", "Mesh", ""),))


def most_bytes() -> int:
    """Most memory that this process has had since `forget_peak`."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


def forget_peak() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def measure(size: tuple[int, int, int]) -> dict[str, Any]:
    """All stages of one size in this process."""
    from planner_core.engine.open_engine import open_engine
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scanner.template import make_template
    from planner_core.scene.floors import find_floors
    from planner_core.scene.patches import make_patches

    costs: dict[str, tuple[float, int]] = {}

    def stage(name: str, work: Callable[[], Any], *, share: int = 1) -> Any:
        forget_peak()
        start = time.process_time()
        out = work()
        costs[name] = ((time.process_time() - start) / share, most_bytes())
        print(f"  {name}: {costs[name][0]:.3f} s, {costs[name][1] / 1e9:.2f} GB", file=sys.stderr, flush=True)
        return out

    # Kernels are compiled once, not for every scene.
    tiny = building(SIZES[0])
    hdl = replace(make_template(load_scanner("hdl-64e")), range_max_m=np.inf)
    at = np.array([[1.0, 2.5, 1.7]])
    warm = open_engine(tiny, make_patches(tiny, max_area_m2=0.04), engine="opencl")
    for work in (warm.scan, warm.visible_patches):
        work(hdl, at)
    del warm, tiny
    scene = stage("scene", lambda: building(size))
    patches = stage("patches", lambda: make_patches(scene, max_area_m2=0.04))
    stage("floors", lambda: find_floors(replace(scene, storeys=())))
    engine = stage("engine", lambda: open_engine(scene, patches, engine="opencl"))
    rng = np.random.default_rng(2)
    stations = np.repeat(at, 8, axis=0)
    side = int(np.ceil(np.sqrt(size[1])))
    stations[:, 0] += 6.0 * rng.integers(0, side, 8)
    stations[:, 2] += STOREY_M * rng.integers(0, size[0], 8)
    engine.scan(hdl, stations[:1])  # programs for trees of this depth
    stage("scan", lambda: engine.scan(hdl, stations), share=8)
    engine.visible_patches(hdl, stations[:1])
    stage("visibility", lambda: engine.visible_patches(hdl, stations), share=8)
    low, high = scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0)
    origins, ways = rng.uniform(low, high, (300_000, 3)), rng.normal(size=(300_000, 3))
    engine.cast_rays(origins, ways, range_max_m=np.inf)
    stage("free rays", lambda: engine.cast_rays(origins, ways, range_max_m=np.inf))
    parts = getattr(engine, "parts", None)
    return {
        "size": size,
        "device": engine.device,
        "n_triangles": scene.n_triangles,
        "n_patches": patches.n_patches,
        "costs": costs,
        "n_parts": 1 if parts is None else len(parts.parts),
        "tree_bytes": engine.tree.n_bytes + 8 * scene.n_triangles if parts is None else 0,
    }


def run_one(index: int, memory: str | None) -> dict[str, Any]:
    """A size in a process of its own."""
    environment = dict(os.environ) if memory is None else {**os.environ, "TLSPLAN_MEMORY": memory}
    command = [sys.executable, str(HERE), "--one", str(index)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=environment)
    return dict(json.loads(done.stdout.splitlines()[-1]), memory=memory)


def slope(rows: list[dict[str, Any]], of: Callable[[dict[str, Any]], float]) -> str:
    """Of the logarithm against that of the triangles."""
    large = [row for row in rows if row["n_triangles"] >= 10**5]
    if len(large) < 3:
        return ""
    x, y = np.log([row["n_triangles"] for row in large]), np.log([of(row) for row in large])
    return f"{np.polyfit(x, y, 1)[0]:.2f}"


def as_markdown(rows: list[dict[str, Any]]) -> str:
    from tests.benchmarks.offices import processor

    lines = [
        "# Time and memory against triangles",
        "Written by `make bench-scale` (tests/benchmarks/bench_scale.py, which says what is measured). Every size is a "
        "process of its own; a stage's memory is the most that the process had meanwhile, Python, libraries, scene and "
        "all. Slope: of the logarithms, from 10^5 triangles on: 1 is in proportion, 0 is not at all.",
        "",
        f"{processor()}, {os.cpu_count()} cores; {rows[0]['device']}; Python {platform.python_version()}. Others "
        "use the machine, too: compare within a column.",
        "",
    ]
    for title, at, unit in (("Processor time, s", 0, 1.0), ("Memory, GB", 1, 1e9)):
        lines += [
            f"## {title}",
            "| triangles | patches | " + " | ".join(STAGES) + " | in |",
            "|---" * (len(STAGES) + 3) + "|",
        ]
        for row in rows:
            cells = [f"{row['costs'][name][at] / unit:.3g}" for name in STAGES]
            where = "one tree" if row["n_parts"] == 1 else f"{row['n_parts']} parts, {row['memory']}"
            lines.append(f"| {row['n_triangles']} | {row['n_patches']} | " + " | ".join(cells) + f" | {where} |")
        plain = [row for row in rows if row["n_parts"] == 1]
        slopes = [slope(plain, lambda row, name=name, at=at: row["costs"][name][at]) for name in STAGES]
        lines += [
            f"| slope | {slope(plain, lambda row: row['n_patches'])} | " + " | ".join(slopes) + " | one tree |",
            "",
        ]
    largest = rows[-1] if rows[-1]["n_parts"] == 1 else [row for row in rows if row["n_parts"] == 1][-1]
    most = max(n_bytes for _, n_bytes in largest["costs"].values())
    stage = max(STAGES, key=lambda name: largest["costs"][name][1])
    lines += [
        f"Target: 3 * 10^7 triangles in 8 GB. {largest['n_triangles']} took {most / 1e9:.2f} GB, in `{stage}`: "
        f"{'met' if most <= CAP_BYTES else 'missed'}. Geometry, tree and addresses are "
        f"{largest['tree_bytes'] / largest['n_triangles']:.0f} bytes a triangle.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--most", type=int, default=40_000_000, help="triangles of the largest scene, at most")
    parser.add_argument("--store", type=Path, default=Path("build/scale.jsonl"), help="what was measured before")
    parser.add_argument("--memory", help="scan one size in parts, too, with this TLSPLAN_MEMORY")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(measure(SIZES[options.one])))
        return
    options.store.parent.mkdir(parents=True, exist_ok=True)
    said = options.store.read_text().splitlines() if options.store.exists() else []
    kept = {(row["n_triangles"], row["memory"]): row for row in map(json.loads, said)}
    wanted = [(i, None) for i, size in enumerate(SIZES) if n_triangles_of(size) <= options.most]
    if options.memory:
        wanted.append((max(i for i, _ in wanted if n_triangles_of(SIZES[i]) <= IN_PARTS), options.memory))
    rows = []
    for index, memory in wanted:
        key = (n_triangles_of(SIZES[index]), memory)
        if key not in kept:
            kept[key] = run_one(index, memory)
            with options.store.open("a") as file:
                file.write(json.dumps(kept[key]) + "\n")
        rows.append(kept[key])
    text = as_markdown(rows)
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
