"""Time and memory of planning against floor area: campuses of bare pavilions, each size in a process of its own.

    python -m tests.benchmarks.bench_area [--write docs/benchmarks/area.md] [--most 10000]

Coarse, so that growth is seen rather than good plans, and the same for all sizes: HDL-64E at 1.3 m, by beams, grid 3 m,
clearance 1.2 m, patches of up to 1 m2, greedy selection, and links of all candidates besides. Stages by the processor
time of all threads, since others use the machine; of `figures`, `route` is told apart. A pavilion is planned before, so
that what is compiled once is not counted. Memory: the most that the process had, Python, libraries and scene in it.
What candidates see goes to disk beyond 1 MB. Slope: of the logarithms, least squares. Sizes that were not run are told.
Also the store alone: a stream of made-up rows, packed, read, and made into a problem of selection. Goes on where it was
interrupted. Not a test.
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
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from planner_core.model import Survey
    from planner_core.planning.pool import Pool
    from planner_core.positions.free_space import FreeSpace

HERE = Path(__file__).resolve()
#: Pavilions of the campuses, of 100 m2 each: from a small house on.
SIZES = (1, 2, 3, 5, 10, 20, 50, 100, 300, 1000, 3000, 10_000)
STAGES = ("load", "candidates", "scan", "links", "select", "route", "figures")
BUDGET = "1MB"
#: Where slopes are told from on: what costs the same at all sizes bends those of smaller ones.
LARGE_M2 = 1000.0
#: Of the store alone: positions, patches, patches that a position sees.
STREAM = (100_000, 10_000_000, 2000)
Row = dict[str, Any]


def most_bytes() -> int:
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


class Watched:
    """The flow's stages by processor time and highest memory, and what it had in hand."""

    def __init__(self) -> None:
        from planner_core.model import stored_rows
        from planner_core.planning.results import Stopwatch

        # Its imports are replaced, which are nobody's to know of.
        flow: Any = import_module("planner_core.planning.plan")
        self.seconds: dict[str, float] = dict.fromkeys(STAGES, 0.0)
        self.peak: dict[str, int] = {}
        self.n_written = 0
        self.pool: list[Pool] = []
        self.space: list[FreeSpace] = []
        watch = self

        class Processor(Stopwatch):
            def stage(self, name: str) -> Any:
                return watch.stage({"scope": "candidates", "first plan": "scan"}.get(name, name))

        make, route, free, write = flow.make_pool, flow.route_through, flow.free_space, stored_rows._PackedFile.write

        def kept(*args: Any, **options: Any) -> Pool:
            self.pool.append(make(*args, **options))
            return self.pool[-1]

        def spaced(survey: Survey, **options: Any) -> FreeSpace:
            self.space.append(free(survey, **options))
            return self.space[-1]

        def routed(*args: Any, **options: Any) -> Any:
            before = self.seconds["route"]
            with self.stage("route"):
                found = route(*args, **options)
            self.seconds["figures"] -= self.seconds["route"] - before
            return found

        def counted(file: Any, patch: Any) -> None:
            before = file.n_bytes
            write(file, patch)
            self.n_written += file.n_bytes - before

        for owner, name, put in (
            (flow, "Stopwatch", Processor),
            (flow, "make_pool", kept),
            (flow, "free_space", spaced),
            (flow, "route_through", routed),
            (stored_rows._PackedFile, "write", counted),
        ):
            setattr(owner, name, put)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = time.process_time()
        yield
        self.seconds[name] += time.process_time() - start
        self.peak[name] = most_bytes()
        print(f"  {name}: {self.seconds[name]:.1f} s, {self.peak[name] / 1e9:.2f} GB", file=sys.stderr, flush=True)


def measure(n_pavilions: int) -> Row:
    """Plan one campus in this process."""
    from planner_core.engine.open_engine import open_engine
    from planner_core.model import Greedy, PlanSettings, Requirements, VisibilityMode
    from planner_core.planning import plan as flow
    from planner_core.planning import pool as pools
    from planner_core.scanner.load_scanner import load_scanner
    from planner_core.scene.load import load_scene
    from scenes_synthetic.campus import write_pavilions

    settings = PlanSettings(
        load_scanner("hdl-64e"), Requirements(), method=Greedy(), grid_step_m=3.0, instrument_heights_m=(1.3,),
        clearance_m=1.2, max_patch_area_m2=1.0, scan_mode=VisibilityMode.BEAMS, special_places=False,
    )  # fmt: skip
    watch, area_m2 = Watched(), 0.0
    with tempfile.TemporaryDirectory() as folder:
        for n in (1, n_pavilions):
            watch.seconds.update(dict.fromkeys(STAGES, 0.0))
            watch.n_written = 0
            path = Path(folder) / f"campus-{n}.ply"
            area_m2 = write_pavilions(path, n_pavilions=n)
            with watch.stage("load"):
                scene = load_scene(path)
                survey = flow.make_survey(scene, settings)
                engine = open_engine(scene, survey.patches)
            plan = flow.plan_survey(survey, settings, engine)
            pool = watch.pool[-1]
            # By itself, after the plan: greedy selection asks for no links, others do, of the same rows.
            with watch.stage("links"):
                links = pools._links(pool.survey, pool.demand, pool.rows, lambda _: None)
    seen = pool.rows.seen
    return {
        "n_pavilions": n_pavilions,
        "area_m2": area_m2,
        "device": engine.device,
        "n_patches": seen.n_patches,
        "n_candidates": seen.n_positions,
        "n_entries": seen.n_entries,
        "disk_bytes": watch.n_written,
        "n_links": 0 if links is None else links.n_links,
        "n_stations": len(plan.stations),
        "coverage": plan.coverage.covered_area_m2 / plan.coverage.achievable_area_m2,
        "cell_m": watch.space[-1].grid.cell_m,
        "seconds": watch.seconds,
        "peak": watch.peak,
    }


def stream() -> Row:
    """The store alone: rows in runs, as surfaces are, packed, read again for a problem's keys, and unpacked never."""
    from planner_core.model.stored_rows import PatchColumn
    from planner_core.select.problem import Constraint, cover_problem

    n, n_patches, n_seen = STREAM
    rng = np.random.default_rng(0)
    column, sizes = PatchColumn(10**7), [0]
    start, made = time.process_time(), 0.0
    for _ in range(n):
        began = time.process_time()
        # Patches in runs of about ten with holes, about a place of the building.
        about = rng.integers(0, n_patches)
        gaps = np.where(rng.random(n_seen) < 0.1, rng.integers(2, 200, n_seen), 1)
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
        "n_pavilions": 0,
        "n_entries": seen.n_entries,
        "disk_bytes": getattr(seen, "disk_bytes", 0),
        "packed_s": packed,
        "read_s": read,
        "problem_s": time.process_time() - start,
        "n_rows": problem.n_rows,
        "problem_entries": int(problem.row.size),
        "problem_bytes": sum(int(part.nbytes) for part in vars(problem).values()),
        "peak_packed": peak_packed,
        "peak": most_bytes(),
    }


def slope(rows: list[Row], of: Callable[[Row], float]) -> str:
    values = [(row["area_m2"], of(row)) for row in rows if of(row) > 0]
    if len(values) < 3:
        return ""
    x, y = np.log(np.array(values)).T
    return f"{np.polyfit(x, y, 1)[0]:.2f}"


def _stage(name: str) -> tuple[str, Callable[[Row], float], str]:
    return f"{name}, s", lambda row: float(row["seconds"][name]), ".2f"


FIGURES: tuple[tuple[str, Callable[[Row], float], str], ...] = (
    ("candidates", lambda row: row["n_candidates"], ".0f"),
    ("patches, thousands", lambda row: row["n_patches"] / 1e3, ".0f"),
    ("stations", lambda row: row["n_stations"], ".0f"),
    ("cell, m", lambda row: row["cell_m"], ".2f"),
    *(_stage(name) for name in STAGES),
    ("all, s", lambda row: sum(row["seconds"].values()), ".1f"),
    ("memory, GB", lambda row: max(row["peak"].values()) / 1e9, ".2f"),
    ("on disk, MB", lambda row: row["disk_bytes"] / 1e6, ".2f"),
)


def as_markdown(rows: list[Row], store: Row | None) -> str:
    from tests.benchmarks.offices import processor

    large = [row for row in rows if row["area_m2"] >= LARGE_M2]
    lines = [
        "# Time and memory against floor area",
        "Written by `make bench-area` (tests/benchmarks/bench_area.py, which says what is measured): campuses of bare "
        "pavilions of 100 m2, four rooms each, planned coarsely, every size in a process of its own. Seconds are "
        "processor time of all threads. Slope: of the logarithms against that of the area: 1 is in proportion, 2 its "
        "square.",
        "",
        f"{processor()}, {os.cpu_count()} cores; {rows[0]['device']}; Python {platform.python_version()}. "
        f"TLSPLAN_VISIBILITY_MEMORY={BUDGET}.",
        "",
        "| floor area, m2 | " + " | ".join(title for title, _, _ in FIGURES) + " |",
        "|---" * (len(FIGURES) + 1) + "|",
    ]
    for row in rows:
        lines.append(f"| {row['area_m2']:.0f} | " + " | ".join(f"{of(row):{form}}" for _, of, form in FIGURES) + " |")
    for title, some in (("slope", rows), (f"slope from {LARGE_M2:.0f} m2 on", large)):
        lines.append(f"| {title} | " + " | ".join(slope(some, of) for _, of, _ in FIGURES) + " |")
    lines += [
        "",
        "Cell: side of the cells in which walkable ground is looked for, 0.05 m, and up to 0.25 m on larger sites "
        "([free space](../method/free-space.md)): `candidates` and a part of `route` go with their number. Doorways "
        "are 0.9 m wide.",
    ]
    missed = [f"{100 * n}" for n in SIZES if 100.0 * n not in {row["area_m2"] for row in rows}]
    if missed:
        last, times = rows[-1], SIZES[-1] / rows[-1]["n_pavilions"]
        total_s, gb = sum(last["seconds"].values()), max(last["peak"].values()) / 1e9
        by_time = float(slope(large, lambda row: sum(row["seconds"].values())) or 1.0)
        by_memory = float(slope(large, lambda row: max(row["peak"].values())) or 1.0)
        lines += [
            "",
            f"Not run: {', '.join(missed)} m2. Extrapolated, not measured: by the slopes from {LARGE_M2:.0f} m2 on, "
            f"the largest of them would take {total_s * times**by_time / 60:.0f} minutes of processor time and "
            f"{gb * times**by_memory:.0f} GB; in proportion to the largest that was run, {total_s * times / 60:.0f} "
            f"minutes and {gb * times:.0f} GB.",
        ]
    if store is not None:
        n, n_patches, _ = STREAM
        each = store["disk_bytes"] / store["n_entries"]
        lines += [
            "",
            "## The store alone",
            f"Made-up rows, nine gaps of ten being 1, easier to pack than buildings may be, and no two patches alike: "
            f"{n} positions x {n_patches} patches, {store['n_entries'] / n:.0f} seen by each, "
            f"{store['n_entries'] / 1e6:.0f} million entries: {store['disk_bytes'] / 1e6:.0f} MB on disk, {each:.2f} "
            f"bytes an entry of 4 in memory. Packing takes {store['packed_s']:.1f} s, reading {store['read_s']:.1f} s; "
            f"the problem of selection, streamed, {store['problem_s']:.1f} s. The process had "
            f"{store['peak_packed'] / 1e9:.2f} GB when all was packed and {store['peak'] / 1e9:.2f} GB at most while "
            f"the problem was made, whose {store['n_rows']} rows have {store['problem_entries'] / 1e6:.0f} million "
            f"entries: {store['problem_bytes'] / 1e9:.2f} GB with all of its arrays.",
        ]
    return "\n".join([*lines, ""])


def run_one(*words: str) -> Row:
    environment = {**os.environ, "TLSPLAN_VISIBILITY_MEMORY": BUDGET}
    done = subprocess.run(
        [sys.executable, str(HERE), *words], stdout=subprocess.PIPE, text=True, check=True, env=environment
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--most", type=int, default=SIZES[-1], help="pavilions of the largest campus, at most")
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
    kept = {row["n_pavilions"]: row for row in map(json.loads, said) if "n_pavilions" in row}
    wanted = [n for n in SIZES if n <= options.most]
    if options.as_is:
        wanted = [n for n in wanted if n in kept]
    for n in [*wanted, *([] if options.as_is else [0])]:
        if n not in kept:
            kept[n] = run_one("--one", str(n)) if n else run_one("--stream")
            with options.store.open("a") as file:
                file.write(json.dumps(kept[n]) + "\n")
    text = as_markdown([kept[n] for n in wanted], kept.get(0))
    print(text)
    if options.write:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
