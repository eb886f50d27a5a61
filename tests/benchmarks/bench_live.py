"""How fast a dragged station is answered: previews of drags, on plans of several scenes and scanners.

    python tests/benchmarks/bench_live.py [--write docs/benchmarks/live.md] [--quick]

A drag goes from a station's place some metres in one direction, 5 cm a step, walls or not: every step is one preview.
`library` is `LivePlan.preview`; `server` the same over the application's routes in this process, from the question as
JSON to the answer's bytes. By the clock, and processor time of all threads. Plans are greedy and coarse: what counts is
how many stations and patches there are. Not a test: nothing here can fail.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import httpx
import numpy as np
from fastapi import FastAPI

import scenes_synthetic
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.model import Greedy, PlanSettings, Requirements, Review
from planner_core.plan_folder.plan_json import plan_text
from planner_core.plan_folder.viewer_layers import layer_files
from planner_core.planning.live.draft import DraftStation
from planner_core.planning.live.live_plan import LivePlan
from planner_core.planning.live.opening import open_live
from planner_core.planning.plan import plan_survey
from planner_core.review.stations import plan_under_review
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from scenes_synthetic.rooms import floor_plate
from viewer_web.server.live_api import create_live_router
from viewer_web.server.live_worker import LiveSide

REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
FLOOR_PLATE = "floor-plate"
CASES = (
    ("house", "hdl-64e"),
    ("house", "rtc360"),
    (FLOOR_PLATE, "rtc360"),
    ("duplex", "hdl-64e"),
    ("fzk-haus", "hdl-64e"),
)
#: So much takes some 16 stations there: what a crew sets up on an office's floor of 1500 m^2 in a day.
FLOOR_PLATE_COVERAGE, FLOOR_PLATE_GRID_M = 0.97, 6.0
STEP_M, STEPS_A_DRAG = 0.05, 25
LAYERS = ("times_seen", "range", "spacing")


@dataclass(frozen=True)
class Times:
    """Milliseconds of many calls, by the clock and of the processor."""

    wall_ms: np.ndarray
    cpu_ms: np.ndarray

    def cells(self) -> str:
        wall, cpu = self.wall_ms, self.cpu_ms
        return (
            f"{np.median(wall):.0f} | {np.quantile(wall, 0.95):.0f} | {wall.max():.0f} | "
            f"{np.median(cpu):.0f} | {np.quantile(cpu, 0.95):.0f}"
        )


@dataclass(frozen=True)
class Row:
    scene: str
    scanner: str
    mode: str
    n_stations: int
    n_patches: int
    n_triangles: int
    opening: Times
    library: Times
    server: Times
    figures: Times
    changed: float
    """Patches in a preview, median."""


def timed(calls: list[Callable[[], object]]) -> Times:
    wall, cpu = [], []
    for call in calls:
        start, busy = time.perf_counter(), time.process_time()
        call()
        wall.append(1e3 * (time.perf_counter() - start))
        cpu.append(1e3 * (time.process_time() - busy))
    return Times(np.array(wall), np.array(cpu))


def plan_folder(scene: str, scanner: str, folder: Path) -> Path:
    """Write what live editing reads of a plan folder."""
    file = IFC_FOLDER / f"{scene}.ifc"
    if not file.exists():
        file = folder / f"{scene}.ifc"
        scenes_synthetic.write(floor_plate() if scene == FLOOR_PLATE else scenes_synthetic.build(scene), file)
    settings = PlanSettings(
        scanner=load_scanner(scanner), grid_step_m=1.0, instrument_heights_m=(1.5,), refine=False, method=Greedy()
    )
    if scene == FLOOR_PLATE:
        settings = replace(
            settings, grid_step_m=FLOOR_PLATE_GRID_M, requirements=Requirements(coverage=FLOOR_PLATE_COVERAGE)
        )
    survey = make_survey(load_scene(file), settings)
    engine = open_engine(survey.scene, survey.patches)
    plan = plan_survey(survey, settings, engine)
    out = folder / f"{scene}-{scanner.replace(':', '-')}"
    for name, content in (("plan.json", plan_text(plan, out).encode()), *layer_files(plan, engine)):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(content)
    if not (folder / file.name).exists():
        (folder / file.name).symlink_to(file)
    return out


def drags(live: LivePlan, n_drags: int) -> list[tuple[DraftStation, tuple[float, float, float]]]:
    random = np.random.default_rng(1)
    out = []
    for number in random.permutation(len(live.draft.stations))[:n_drags]:
        station = live.draft.stations[int(number)]
        angle = random.uniform(0.0, 2.0 * np.pi)
        for step in range(1, STEPS_A_DRAG + 1):
            x, y, z = station.position_m
            away_m = step * STEP_M
            out.append((station, (x + away_m * np.cos(angle), y + away_m * np.sin(angle), z)))
    return out


def over_server(live: LivePlan, folder: Path, where: list[tuple[DraftStation, tuple[float, float, float]]]) -> Times:
    side = LiveSide(lambda progress: live)
    facts = plan_under_review(folder)
    app = FastAPI()
    app.include_router(create_live_router(side, Review, lambda: facts))
    side.start()
    side.wait()
    offset_m = live.survey.scene.offset_m

    async def ask() -> Times:
        wall, cpu = [], []
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            for number, (station, at_m) in enumerate(where):
                start, busy = time.perf_counter(), time.process_time()
                question = {
                    "station": station.id,
                    "floor": station.floor,
                    "position": (np.array(at_m) + offset_m).tolist(),
                    "instrument_height_m": station.instrument_height_m,
                    "layer": LAYERS[number % 3],
                    "sequence": number,
                }
                answer = await client.post("/api/live/preview", json=question)
                answer.raise_for_status()
                wall.append(1e3 * (time.perf_counter() - start))
                cpu.append(1e3 * (time.process_time() - busy))
        return Times(np.array(wall), np.array(cpu))

    return asyncio.run(ask())


def measure(scene: str, scanner: str, folder: Path, n_drags: int) -> Row:
    out = plan_folder(scene, scanner, folder)
    opened: list[LivePlan] = []
    opening = timed([lambda: opened.append(open_live(out))])
    live = opened[0]
    where = drags(live, n_drags)
    sizes = []

    def preview(number: int, station: DraftStation, at_m: tuple[float, float, float]) -> None:
        height_m = station.instrument_height_m or 1.5
        found = live.preview(live.draft, station.id, station.floor, at_m, height_m, layer=LAYERS[number % 3])
        sizes.append(found.patch.size)

    def figures(station: DraftStation, at_m: tuple[float, float, float]) -> Callable[[], object]:
        draft = live.preview(live.draft, station.id, station.floor, at_m, station.instrument_height_m or 1.5).draft
        return lambda: live.figures(draft)

    library = timed([lambda n=n, s=s, at=at: preview(n, s, at) for n, (s, at) in enumerate(where)])
    return Row(
        scene=scene,
        scanner=scanner,
        mode=live.survey.scan_mode,
        n_stations=len(live.draft.stations),
        n_patches=live.survey.patches.n_patches,
        n_triangles=live.survey.scene.n_triangles,
        opening=opening,
        library=library,
        server=over_server(open_live(out), out, where),
        figures=timed([figures(*each) for each in where[:: STEPS_A_DRAG // 2]]),
        changed=float(np.median(sizes)),
    )


def as_markdown(rows: list[Row]) -> str:
    cores = len(os.sched_getaffinity(0))
    lines = [
        "# Live previews",
        "Written by `tests/benchmarks/bench_live.py`, which says what is measured. The method: [live editing]"
        "(../method/live.md).",
        "",
        f"{cores} cores, {platform.machine()}, Python {platform.python_version()}. GPUs: [gpu.md](gpu.md). Load "
        f"average at the end {os.getloadavg()[1]:.0f}: with more than one a core, the clock also counts others' work.",
        "",
        f"A drag is {STEPS_A_DRAG} previews of places {100 * STEP_M:g} cm apart. Milliseconds a preview.",
        "",
        "| scene | scanner | by | stations | patches | patches that change | from | median | 95 % | most | CPU median "
        "| CPU 95 % |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        what = f"{row.scene} | {row.scanner} | {row.mode} | {row.n_stations} | {row.n_patches:,} | {row.changed:,.0f}"
        lines.append(f"| {what} | library | {row.library.cells()} |")
        lines.append(f"| {what} | server | {row.server.cells()} |")
    lines += [
        "",
        "What is done once: opening the plan folder, seconds; and figures of the draft after a change is committed, "
        "milliseconds.",
        "",
        "| scene | scanner | triangles | opening s | CPU s | figures ms | CPU ms |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row.scene} | {row.scanner} | {row.n_triangles:,} | {row.opening.wall_ms[0] / 1e3:.1f} | "
            f"{row.opening.cpu_ms[0] / 1e3:.1f} | {np.median(row.figures.wall_ms):.0f} | "
            f"{np.median(row.figures.cpu_ms):.0f} |"
        )
    return "\n".join([*lines, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the tables to this Markdown file")
    parser.add_argument("--quick", action="store_true", help="the house alone, two drags")
    parser.add_argument("--scene", action="append", help="this scene alone; may be given again")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for scene, scanner in CASES[:1] if options.quick else CASES:
            if options.scene and scene not in options.scene:
                continue
            if scene not in (*scenes_synthetic.names(), FLOOR_PLATE) and not (IFC_FOLDER / f"{scene}.ifc").is_file():
                print(f"{scene}.ifc is not in {IFC_FOLDER}, left out", file=sys.stderr)
                continue
            rows.append(measure(scene, scanner, Path(scratch), 2 if options.quick else 8))
            print(as_markdown(rows[-1:]), file=sys.stderr)
    text = as_markdown(rows)
    print(text)
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
