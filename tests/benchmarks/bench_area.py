"""Time and memory of planning against floor area: the generated campus, from a pavilion on, each size in a process.

    python tests/benchmarks/bench_area.py [--write docs/benchmarks/area.md] [--most 3600000]

Coarse, so that growth is seen rather than good plans: HDL-64E at 1.3 m, by beams, grid 2 m, patches of 0.25 m2, greedy
selection, and links of all candidates besides. Stages by the processor time of all threads, since others use the
machine. Memory: the most that the process had, Python, libraries and scene in it. What candidates see goes to disk
beyond 1 MB. Slope: of the logarithms, least squares. Sizes that were not run are told. Also the store alone: a stream
of made-up rows, packed and read. Goes on where it was interrupted. Not a test.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve()
#: Triangles of the campus: one to three pavilions, one with a school, two schools, an office with these.
SIZES = (150_000, 300_000, 450_000, 700_000, 1_300_000, 3_600_000)
STAGES = ("load", "candidates", "scan", "links", "select", "figures")
WANTED_M2 = (1e2, 1e3, 1e4, 1e5, 1e6)
BUDGET = "1MB"
#: Of the store alone: positions, patches, share of the patches that a position sees.
STREAM = (10_000, 1_000_000, 0.01)


def most_bytes() -> int:
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


def measure(n_triangles: int) -> dict[str, Any]:
    """Plan one campus in this process."""
    from planner_core.engine.scan_engine import open_engine
    from planner_core.model import Greedy, PlanSettings, Requirements, ScanBy, stored_rows
    from planner_core.planning import plan as flow
    from planner_core.planning import pool as pools
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scene.load import load_scene
    from scenes_synthetic.campus import write_campus

    seconds: dict[str, float] = dict.fromkeys(STAGES, 0.0)
    peak: dict[str, int] = {}
    disk, pool = [0], []

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        start = time.process_time()
        yield
        seconds[name] = seconds.get(name, 0.0) + time.process_time() - start
        peak[name] = most_bytes()
        print(f"  {name}: {seconds[name]:.1f} s, {peak[name] / 1e9:.2f} GB", file=sys.stderr, flush=True)

    class Processor(flow.Stopwatch):
        def stage(self, name: str) -> Any:
            return stage({"scope": "candidates", "first plan": "scan"}.get(name, name))

    write, make = stored_rows._PackedFile.write, flow.make_pool

    def counted(self: Any, patch: Any) -> None:
        before = self.n_bytes
        write(self, patch)
        disk[0] += self.n_bytes - before

    def kept(*args: Any, **options: Any) -> Any:
        pool.append(make(*args, **options))
        return pool[-1]

    stored_rows._PackedFile.write = counted  # type: ignore[method-assign]
    flow.Stopwatch, flow.make_pool = Processor, kept  # type: ignore[misc]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "campus.ply"
        campus = write_campus(path, n_triangles=n_triangles)
        settings = PlanSettings(
            load_scanner("hdl-64e"), Requirements(), method=Greedy(), grid_step_m=2.0, instrument_heights_m=(1.3,),
            max_patch_area_m2=0.25, scan_mode=ScanBy.BEAMS, special_places=False,
        )  # fmt: skip
        with stage("load"):
            scene = load_scene(path)
            survey = flow.make_survey(scene, settings)
            engine = open_engine(scene, survey.patches)
        plan = flow.plan_survey(survey, settings, engine)
    # By itself, after the plan: greedy selection asks for no links, others do, of the same rows.
    with stage("links"):
        links = pools._links(pool[0].survey, pool[0].demand, pool[0].rows, lambda _: None)
    seen = pool[0].rows.seen
    return {
        "n_triangles": n_triangles,
        "area_m2": sum(building.floor_area_m2 for building in campus.buildings),
        "buildings": len(campus.buildings),
        "device": engine.device,
        "n_patches": seen.n_patches,
        "n_candidates": seen.n_positions,
        "n_entries": seen.n_entries,
        "packed_bytes": getattr(seen, "disk_bytes", 0),
        "disk_bytes": disk[0],
        "n_links": 0 if links is None else links.n_links,
        "n_stations": len(plan.stations),
        "seconds": seconds,
        "peak": peak,
    }


def stream() -> dict[str, Any]:
    """The store alone: rows in runs, as surfaces are, packed, read again for a problem's keys, and unpacked never."""
    from planner_core.model.stored_rows import PatchColumn
    from planner_core.select.problem import Constraint, cover_problem

    n, n_patches, share = STREAM
    rng = np.random.default_rng(0)
    column, sizes = PatchColumn(10**7), [0]
    start, made = time.process_time(), 0.0
    for _ in range(n):
        began = time.process_time()
        # Patches in runs of about ten with holes, about a place of the building.
        about = rng.integers(0, n_patches)
        gaps = np.where(rng.random(int(share * n_patches)) < 0.1, rng.integers(2, 200, int(share * n_patches)), 1)
        row = np.unique((about + np.cumsum(gaps)) % n_patches).astype(np.int32)
        made += time.process_time() - began
        column.add(row)
        sizes.append(row.size)
    seen = column.rows(np.cumsum(sizes, dtype=np.int64), n_patches)
    packed, peak_packed = time.process_time() - start - made, most_bytes()
    start = time.process_time()
    for _ in seen.pieces():
        pass
    read = time.process_time() - start
    start = time.process_time()
    problem = cover_problem(seen, np.full(n_patches, 0.04), (Constraint(np.ones(n_patches, dtype=bool), 0.95),))
    return {
        "stream": True,
        "n_entries": seen.n_entries,
        "disk_bytes": seen.disk_bytes,  # type: ignore[attr-defined]
        "packed_s": packed,
        "read_s": read,
        "problem_s": time.process_time() - start,
        "n_rows": problem.n_rows,
        "problem_entries": int(problem.row.size),
        "peak_packed": peak_packed,
        "peak": most_bytes(),
    }


def slope(rows: list[dict[str, Any]], of: Callable[[dict[str, Any]], float]) -> str:
    values = [(row["area_m2"], of(row)) for row in rows if of(row) > 0]
    if len(values) < 3:
        return ""
    x, y = np.log(np.array(values)).T
    return f"{np.polyfit(x, y, 1)[0]:.2f}"


def as_markdown(rows: list[dict[str, Any]], store: dict[str, Any] | None) -> str:
    from bench_scan import processor

    figures: list[tuple[str, Callable[[dict[str, Any]], float], str]] = [
        ("triangles", lambda row: row["n_triangles"], ".0f"),
        ("candidates", lambda row: row["n_candidates"], ".0f"),
        ("patches", lambda row: row["n_patches"], ".0f"),
        ("seen, millions", lambda row: row["n_entries"] / 1e6, ".1f"),
        ("links", lambda row: row["n_links"], ".0f"),
        ("stations", lambda row: row["n_stations"], ".0f"),
        *((f"{name}, s", lambda row, name=name: row["seconds"][name], ".1f") for name in STAGES),
        ("all, s", lambda row: sum(row["seconds"].values()), ".1f"),
        ("memory to stations, GB", lambda row: row["peak"]["figures"] / 1e9, ".2f"),
        ("memory with links, GB", lambda row: max(row["peak"].values()) / 1e9, ".2f"),
        ("written to disk, MB", lambda row: row["disk_bytes"] / 1e6, ".1f"),
    ]  # fmt: skip
    lines = [
        "# Time and memory against floor area",
        "Written by `make bench-area` (tests/benchmarks/bench_area.py, which says what is measured): the generated "
        "campus, planned coarsely, every size in a process of its own. Seconds are processor time of all threads. "
        "Slope: of the logarithms against that of the area: 1 is in proportion, 2 its square.",
        "",
        f"{processor()}, {os.cpu_count()} cores; {rows[0]['device']}; Python {platform.python_version()}. "
        f"TLSPLAN_VISIBILITY_MEMORY={BUDGET}.",
        "",
        "| floor area, m2 | " + " | ".join(f"{row['area_m2']:.0f}" for row in rows) + " | slope |",
        "|---" * (len(rows) + 2) + "|",
    ]
    for title, of, form in figures:
        lines.append(f"| {title} | " + " | ".join(f"{of(row):{form}}" for row in rows) + f" | {slope(rows, of)} |")
    low, high = rows[0]["area_m2"], rows[-1]["area_m2"]
    missed = [f"10^{int(np.log10(m2))}" for m2 in WANTED_M2 if not 0.5 * low <= m2 <= 2 * high]
    if missed:
        lines += [
            "",
            f"Asked for and not run: {', '.join(missed)} m2. The smallest campus is one pavilion, {low:.0f} m2.",
        ]
    if len(rows) < 3:
        lines += ["", "Fewer than three sizes were run: no slopes."]
    if not rows[0]["disk_bytes"]:
        lines += [
            "",
            "Of the smallest nothing goes to disk: up to 256 candidates are looked from at once, and that in memory.",
        ]
    if store is not None:
        n, n_patches, _ = STREAM
        each = store["disk_bytes"] / store["n_entries"]
        density = store["n_entries"] / n / n_patches
        lines += [
            "",
            "## The store alone",
            f"Made-up rows, nine gaps of ten being 1, easier to pack than buildings may be, and no two patches "
            f"alike: {n} positions x {n_patches} patches, {store['n_entries'] / 1e6:.0f} million entries "
            f"({100 * density:.2f} %): {store['disk_bytes'] / 1e6:.0f} MB on disk, {each:.2f} bytes an entry "
            f"of 4 in memory. Packing takes {store['packed_s']:.1f} s, reading {store['read_s']:.1f} s; the problem of "
            f"selection, streamed, {store['problem_s']:.1f} s. The process had {store['peak_packed'] / 1e9:.2f} GB "
            f"when all was packed and {store['peak'] / 1e9:.2f} GB after the problem, whose {store['n_rows']} rows "
            f"have {store['problem_entries'] / 1e6:.0f} million entries of 8 bytes in memory.",
        ]
        if rows[-1]["packed_bytes"]:
            each = rows[-1]["packed_bytes"] / rows[-1]["n_entries"]
            lines.append(f"Of the largest campus above: {each:.2f} bytes an entry.")
        seen = rows[-1]["n_entries"] / rows[-1]["n_candidates"]
        lines += [
            "",
            f"Extrapolated, not measured: 10^5 candidates x 10^7 patches, each seeing {seen:.0f} patches as in the "
            f"largest campus, are {1e5 * seen / 1e9:.2f} thousand million entries, {1e5 * seen * each / 1e9:.2f} GB on "
            f"disk; each seeing 1 % of the patches, 10 thousand million entries and {1e10 * each / 1e9:.0f} GB.",
        ]
    return "\n".join([*lines, ""])


def run_one(*words: str) -> dict[str, Any]:
    environment = {**os.environ, "TLSPLAN_VISIBILITY_MEMORY": BUDGET}
    done = subprocess.run(
        [sys.executable, str(HERE), *words], stdout=subprocess.PIPE, text=True, check=True, env=environment
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--most", type=int, default=3_600_000, help="triangles of the largest campus, at most")
    parser.add_argument("--store", type=Path, default=Path("build/area.jsonl"), help="what was measured before")
    parser.add_argument("--as-is", action="store_true", help="write the page of what was measured before, no more")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--stream", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None or options.stream:
        print(json.dumps(stream() if options.stream else measure(options.one)))
        return
    options.store.parent.mkdir(parents=True, exist_ok=True)
    said = options.store.read_text().splitlines() if options.store.exists() else []
    kept = {row.get("n_triangles", 0): row for row in map(json.loads, said)}
    wanted = [n for n in SIZES if n <= options.most]
    if options.as_is:
        wanted = [n for n in wanted if n in kept]
    for n in [0, *wanted]:
        if n not in kept:
            kept[n] = run_one("--one", str(n)) if n else run_one("--stream")
            with options.store.open("a") as file:
                file.write(json.dumps(kept[n]) + "\n")
    text = as_markdown([kept[n] for n in wanted], kept[0])
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
