"""Simulated clouds as files: memory, time and size of one scan of 10 and of 100 million beams, in every format.

    python tests/benchmarks/bench_clouds.py [--write FILE] [--quick]

Each export is a process of its own, `tlsplan export`, of one station of the synthetic house on its map; its greatest
resident memory is that which the system tells. Files are removed once measured; a format that the disk has no room for
is left out and named. Not a test: nothing can fail.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.model import PlanSettings, Requirements, Scanner
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.stations_csv import GivenStation
from planner_core.planning.evaluate import evaluate_stations
from planner_core.scene.load import load_scene

#: Rows and columns of beams: 10 and 100 million.
GRIDS = ((3163, 3163), (10_000, 10_000))
STATION = (3.0, 5.0, 1.3)
#: Format, with noise or not; the last figure: bytes a beam that the file may take.
CASES = (
    ("e57", False, 16),
    ("e57", True, 16),
    ("las", False, 42),
    ("laz", False, 20),
    ("ply", False, 56),
    ("exr", False, 30),
)
#: What is left to others on the disk, whatever is measured.
SPARE_BYTES = 2_500_000_000


#: The figures are of runs of their own, with variables of glibc set and with blocks as they were.
_MEMORY = """
## Memory
The greatest that was resident. Libraries are some 160 MiB of it; of the scan, half a million beams are held as they
were cast, and a block of 65 536 that is worked on. It does not grow with the scan, but for angles of rows and columns,
and for the preview that lies beside an EXR: its size is bounded.

While blocks were as large as what is cast, it was 390 to 550 MiB and looked as if it grew. glibc maps memory for large
arrays at first, but takes them from its heap once one of their size was freed; there arrays of 0.5 to 12 MB leave gaps
that the next ones do not fit, and how far the heap gets is a matter of luck. (Previews of EXR were coloured whole,
too.) 10 million beams to PLY, MiB:

| blocks | glibc | runs |
|---|---|---|
| 524 288 beams | as it is | 479, 485, 487 |
| 524 288 beams | one arena (`MALLOC_ARENA_MAX=1`) | 481 |
| 524 288 beams | maps all of 1 MiB and more (`MALLOC_MMAP_THRESHOLD_=1048576`) | 390 |
| 65 536 beams | as it is | 297, 299, 300 |

`tlsplan simulate` writes the same way. 10 million beams took 1911 MiB to PLY and 564 to EXR when it held whole scans,
and 255 and 297 since."""


@dataclass(frozen=True)
class Row:
    name: str
    noise: bool
    n_beams: int
    n_bytes: int
    memory_mib: float
    cpu_s: float
    wall_s: float


def scanner_of(n_rows: int, n_columns: int) -> Scanner:
    """One with figures such as those of data sheets, and a table of range noise made up."""
    return Scanner(
        name=f"grid-{n_rows}", title="Grid of beams", source="made up", range_min_m=0.5, range_max_m=130.0,
        n_azimuths=n_columns, elevation_rad=tuple(np.deg2rad(np.linspace(90, -60, n_rows))),
        instrument_height_min_m=1.0, instrument_height_max_m=2.0, angular_accuracy_rad=8.7e-5,
        range_noise=((1.0, 0.1, 0.0006), (40.0, 0.1, 0.003), (1.0, 0.9, 0.0003), (40.0, 0.9, 0.0008)),
    )  # fmt: skip


def write_plan(folder: Path, grid: tuple[int, int]) -> Path:
    """A plan folder of one station, evaluated with few beams and then said to be of many."""
    path = folder / "house.ifc"
    if not path.exists():
        scenes_synthetic.write(scenes_synthetic.on_map(scenes_synthetic.build("house", seed=0)), path)
    few = PlanSettings(
        scanner=scanner_of(60, 120), requirements=Requirements(coverage=0.01), grid_step_m=3.0,
        instrument_heights_m=(1.3,), special_places=False,
    )  # fmt: skip
    given = GivenStation("S001", np.array(STATION), STATION[2], None)
    plan = evaluate_stations(load_scene(path), few, [given])
    plan = replace(plan, settings=replace(plan.settings, scanner=scanner_of(*grid)))
    plan_folder = folder / f"plan-{grid[0]}"
    plan_folder.mkdir()
    (plan_folder / "plan.json").write_text(plan_text(plan, plan_folder), encoding="utf-8")
    return plan_folder


def measure(plan: Path, name: str, noise: bool, n_beams: int) -> Row:
    constraint = plan.parent / f"cloud.{name}"
    command = ["export", str(plan), "--format", name, "-o", str(constraint), "--quiet", *(["--noise"] if noise else [])]
    with get_context("spawn").Pool(1) as pool:  # children of a child: nobody else's are counted
        memory_mib, cpu_s, wall_s = pool.apply(_run, (command,))
    files = [constraint] if constraint.is_file() else list(constraint.iterdir())
    n_bytes = sum(file.stat().st_size for file in files)
    if constraint.is_dir():
        shutil.rmtree(constraint)
    else:
        constraint.unlink()
    return Row(name, noise, n_beams, n_bytes, memory_mib, cpu_s, wall_s)


def _run(command: list[str]) -> tuple[float, float, float]:
    started = time.perf_counter()
    subprocess.run([sys.executable, "-m", "tlsplan", *command], check=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_maxrss / 1024, used.ru_utime + used.ru_stime, time.perf_counter() - started


def as_markdown(rows: list[Row], left_out: list[str]) -> str:
    lines = [
        "# Simulated clouds",
        "Written by `tests/benchmarks/bench_clouds.py`, which says what is measured. The formats: [clouds]"
        "(../formats/field-pack/clouds.md).",
        "",
        f"{len(os.sched_getaffinity(0))} cores, {platform.machine()}, Python {platform.python_version()}. Load average "
        f"at the end {os.getloadavg()[1]:.0f}: with more than one a core, the clock also counts others' work.",
        "",
        "One station in the synthetic house, where all but a few beams come back. CPU is of all cores together.",
        "",
        "| format | noise | million beams | MB | bytes a beam | memory MiB | CPU s | clock s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row.name} | {'yes' if row.noise else 'no'} | {row.n_beams / 1e6:.0f} | {row.n_bytes / 1e6:,.0f} | "
        f"{row.n_bytes / row.n_beams:.1f} | {row.memory_mib:.0f} | {row.cpu_s:.0f} | {row.wall_s:.0f} |"
        for row in rows
    ]
    lines += [f"\nLeft out, for want of time or of room on the disk: {', '.join(left_out)}."] if left_out else []
    return "\n".join([*lines, _MEMORY, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the table to this Markdown file")
    parser.add_argument("--quick", action="store_true", help="10 million beams alone")
    options = parser.parse_args()
    rows, left_out = [], []
    with tempfile.TemporaryDirectory() as scratch:
        for grid in GRIDS[:1] if options.quick else GRIDS:
            plan, n_beams = write_plan(Path(scratch), grid), grid[0] * grid[1]
            for name, noise, bytes_a_beam in CASES:
                if shutil.disk_usage(scratch).free < n_beams * bytes_a_beam + SPARE_BYTES:
                    left_out.append(f"{name} of {n_beams / 1e6:.0f} million beams")
                    continue
                rows.append(measure(plan, name, noise, n_beams))
                print(rows[-1], file=sys.stderr)
    text = as_markdown(rows, left_out)
    print(text)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
