"""Work over Dask workers against one process: ratios, overhead of a task, what travels.

`make bench-cluster` writes docs/benchmarks/cluster.md. Workers are processes of this machine and share its cores: what
is gained there says little of many machines, what a task costs says much.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import scenes_synthetic
from planner_core.cluster import worker
from planner_core.cluster.executor import Cluster, open_cluster
from planner_core.cluster.payloads import Packer, squeezed
from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.executor import Task, spread_over
from planner_core.export.clouds.each_station import StationClouds
from planner_core.export.clouds.points import every_nth, thinning_step
from planner_core.export.clouds.simulated import FORMATS, simulated_clouds, write_simulated_scans
from planner_core.model import (
    FloatArray,
    LinkLimits,
    OverlapMeasure,
    PlanSettings,
    PointLimits,
    Proven,
    Requirements,
    Station,
    Survey,
    VisibilityMode,
)
from planner_core.network.candidate_links import LinkJob, candidate_links
from planner_core.network.links import surface_of_patches
from planner_core.network.pair_overlap import ROWS_A_BLOCK
from planner_core.operating_system import n_usable_cores
from planner_core.progress import silent
from planner_core.requirements.goals import goals_of
from planner_core.requirements.observe_candidates import (
    TASK_POSITIONS,
    ObservationJob,
    observe_candidates_here,
    observe_elsewhere,
    pack_observations,
)
from planner_core.scanner.load_scanner import load_scanner
from planner_core.select.blocks import BlockJob, BlockTask, blocks_of
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem
from planner_core.select.proven import _find_in_block

N_POSITIONS, N_TASKS, N_LINKED, N_STATIONS, N_JOBS = 164, 100, 1500, 4, 2
MARK = "<!-- measured -->"


def seconds(work: Callable[[], Any]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def sent_bytes(job: object) -> int:
    """Compressed, as a worker gets it."""
    payload = Packer().payload(job)
    return len(payload.body) + sum(len(squeezed(each)) for each in payload.arrays.values())


def measure_links(rounds: int) -> str:
    survey, engine, settings = opened_house()
    goals = goals_of(survey, settings.requirements)
    at_m = positions_m(survey, N_LINKED)
    rows = observe_candidates_here(survey, engine, at_m, goals, notes_needed=False, progress=silent)
    seen = rows.rows.seen
    is_seen = np.zeros(seen.n_patches, dtype=bool)
    is_seen[seen.patch] = True
    surface, area_m2 = surface_of_patches(survey.scene, survey.patches, is_seen), survey.patches.area_m2

    def find() -> Any:
        return candidate_links(seen, area_m2, surface, at_m, limits=LinkLimits(0.3, 0.01))

    unscanned = np.zeros(len(at_m), dtype=bool)
    limits, start = LinkLimits(0.3, 0.01), survey.scanner.pre_alignment
    job = LinkJob(seen, area_m2, surface, at_m, limits, start, OverlapMeasure.SMALLER_SHARE, unscanned)
    sent = sent_bytes(job)  # before it keeps what it worked out
    n_links, answer = find().n_links, len(job.answer((0, ROWS_A_BLOCK)))
    in_answer = job.links_of_rows(0, ROWS_A_BLOCK)[1].size
    lines = [
        f"Links: house, {N_LINKED} positions that see {seen.patch.size / 1e6:.1f} million patches together, {n_links} "
        f"links, tasks of {ROWS_A_BLOCK} rows.",
        "",
        "| what | figure |",
        "|---|---|",
        f"| sent to a worker once, compressed | {sent / 1e6:.1f} MB |",
        f"| sent back by the first task | {answer / 1e3:.0f} kB for {in_answer} links, {answer / in_answer:.1f} bytes "
        "each |",
    ]
    for count in (1, 2):
        with open_cluster(f"local:{count}", tell=print) as cluster:

            def spread_out(cluster: Any = cluster) -> Any:
                with spread_over(cluster):
                    return find()

            spread_out()
            pairs = [(seconds(find), seconds(spread_out)) for _ in range(rounds)]
            lines.append(
                f"| {count} worker{'s' * (count > 1)} here, time of one process | "
                f"{statistics.median(there / one for one, there in pairs):.2f} of "
                f"{statistics.median(one for one, _ in pairs):.1f} s |"
            )
    return "\n".join(lines)


def measure_scans(rounds: int) -> str:
    survey, engine, settings = opened_house()
    stations = [
        Station(f"S{order:03d}", "F0", order, at_m, instrument_height_m=1.5)
        for order, at_m in enumerate(positions_m(survey, N_STATIONS), start=1)
    ]
    thin = replace(survey, template=every_nth(survey.template, thinning_step(survey.template.shape, 10**6)))
    clouds = simulated_clouds(thin, settings, stations, engine)
    job = StationClouds(replace(clouds, scan_engine=None), (), engine.name, "x" * 64)
    lines = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def write(by: Cluster | None = None) -> float:
            with spread_over(by):
                return seconds(lambda: write_simulated_scans(clouds, FORMATS, folder / "out", overwrite=True))

        write()
        size = sum(path.stat().st_size for path in (folder / "out").iterdir()) / N_STATIONS
        n_beams = clouds.template.shape[0] * clouds.template.shape[1]
        lines += [
            f"Scans: house, {N_STATIONS} stations of {n_beams / 1e6:.1f} million beams, all formats.",
            "",
            "| what | figure |",
            "|---|---|",
            f"| sent to a worker once, compressed | {sent_bytes(job) / 1e6:.2f} MB |",
            f"| sent back per station | {size / 1e6:.0f} MB, {size / n_beams:.0f} bytes a beam, in pieces of 4 MB |",
        ]
        for count in (1, 2):
            with open_cluster(f"local:{count}", tell=print) as cluster:
                write(cluster)
                pairs = [(write(), write(cluster)) for _ in range(rounds)]
                lines.append(
                    f"| {count} worker{'s' * (count > 1)} here, time of one process | "
                    f"{statistics.median(there / one for one, there in pairs):.2f} of "
                    f"{statistics.median(one for one, _ in pairs):.1f} s |"
                )
    return "\n".join(lines)


def measure_jobs() -> str:
    """Small jobs: what a job over a worker costs besides its plan, and what it ships."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for number in range(N_JOBS):
            scenes_synthetic.write(scenes_synthetic.build("box"), folder / f"s{number}.obj")
        options = "{grid: 1, patch_area: 0.5, coverage: 50, verify: 0, method: greedy}"
        (folder / "sites.yaml").write_text(f"defaults: {options}\nsites: [scene: s*.obj]\n", encoding="utf-8")

        def batch(out: str, *more: str) -> float:
            words = ["batch", str(folder / "sites.yaml"), "-o", str(folder / out), "--quiet", *more]
            return seconds(lambda: subprocess.run([sys.executable, "-m", "tlsplan", *words], check=True))

        here, there = batch("here", "--jobs", "1"), batch("there", "--scheduler", "local:1")
        plan = folder / "there" / "plans" / "s0"
        size = sum(path.stat().st_size for path in plan.rglob("*") if path.is_file())
        known = [json.loads(path.read_text())["seconds"] for path in sorted((folder / "there/jobs").glob("*.json"))]
        return "\n".join([
            f"Jobs: {N_JOBS} boxes, one at a time.", "",
            "| what | figure |",
            "|---|---|",
            f"| sent back per job | {size / 1e6:.1f} MB |",
            f"| by this machine, {N_JOBS} jobs | {here:.0f} s |",
            f"| by one worker of this machine | {there:.0f} s, of which {sum(known):.0f} s are jobs, and the rest the "
            "start of the worker and its first scan |",
        ])  # fmt: skip


def measure_blocks(rounds: int) -> str:
    """First looks at blocks of a selection: flats of a chance of their own, each a part of the network."""
    problem, network = flats()
    blocks = blocks_of(problem, network)
    find = partial(_find_in_block, Proven(prove=False), {"host": False})
    job = BlockJob(tuple(blocks), find)
    sets = [BlockTask(number, (block.ticks * 17 // 20).astype(np.int64)) for number, block in enumerate(blocks)]
    found = [job.found(look) for look in sets]
    proofs = [replace(look, wanted=len(one.chosen), work=2.0) for look, one in zip(sets, found, strict=True)]
    least = replace(proofs[0], work=0.0)

    def here() -> Any:
        return [job.answer(look, made) for look in (*sets, *proofs)]

    lines = [
        f"Blocks of selection: {len(blocks)} flats of {blocks[0].candidate.size} candidates, {problem.row.size} "
        "entries together.",
        "",
        "| what | figure |",
        "|---|---|",
        f"| sent to a worker once, compressed | {sent_bytes(job) / 1e6:.2f} MB |",
        f"| sent back per task | {max(len(job.answer(look, made)) for look in sets)} bytes and less |",
    ]
    for count in (1, 2):
        with open_cluster(f"local:{count}", tell=print) as cluster:

            def there(looks: Any, cluster: Any = cluster) -> Any:
                tasks = [Task(look, 1) for look in looks]
                return cluster.answers(
                    job, tasks, here=lambda look: job.answer(look, made), stage="prove", progress=silent
                )

            def both(there: Any = there) -> Any:
                return [there([least, *sets]), there([least, *proofs])]

            both()
            alone = statistics.median(seconds(lambda: job.answer(least, made)) for _ in range(5))
            empty = seconds(lambda: there([least] * N_TASKS)) / N_TASKS
            pairs = [(seconds(here), seconds(both)) for _ in range(rounds)]
            lines += [
                f"| {count} worker{'s' * (count > 1)} here, a task that does hardly anything | "
                f"{1e3 * empty:.0f} ms, {1e3 * alone:.0f} ms in this process |",
                f"| {count} worker{'s' * (count > 1)} here, time of one process | "
                f"{statistics.median(there_s / one for one, there_s in pairs):.2f} of "
                f"{statistics.median(one for one, _ in pairs):.1f} s |",
            ]
    return "\n".join(lines)


def made(key: str, make: Callable[[], Any]) -> Any:
    return make()


def flats(n_flats: int = 3, n: int = 40, n_rows: int = 300) -> tuple[CoverProblem, Network]:
    """Candidates of a flat see four tenths of its rows, and are linked in a row."""
    chance = np.random.default_rng(1)
    sees = np.kron(np.eye(n_flats), np.ones((n, n_rows))).astype(bool)
    sees &= chance.random(sees.shape) < 0.4
    ticks = chance.integers(50, 100, n_flats * n_rows)
    counts_for = sees.any(axis=0)[None]
    least = (counts_for @ ticks * 17 // 20).astype(np.int64)
    problem = CoverProblem(
        starts=np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64), row=np.nonzero(sees)[1],
        ticks=ticks, counts_for=counts_for, required=least, least=least,
    )  # fmt: skip
    linked = np.kron(np.eye(n_flats), np.eye(n, k=1) + np.eye(n, k=-1)).astype(bool)
    network = Network(
        starts=np.concatenate([[0], np.cumsum(linked.sum(axis=1))]).astype(np.int64),
        neighbour=np.nonzero(linked)[1].astype(np.int32), part=np.repeat(np.arange(n_flats, dtype=np.int32), n),
        loops=False,
    )  # fmt: skip
    return problem, network


def opened_house() -> tuple[Survey, ScanEngine, PlanSettings]:
    settings = PlanSettings(
        scanner=load_scanner("rtc360"),
        requirements=Requirements(limits=PointLimits(spacing_m=0.006, range_m=20.0)),
        scan_mode=VisibilityMode.PATCHES,
        max_patch_area_m2=0.16,
    )
    survey = make_survey(scenes_synthetic.build("house").scene, settings)
    return survey, open_engine(survey.scene, survey.patches), settings


def positions_m(survey: Survey, n: int) -> FloatArray:
    low, high = survey.scene.vertices_m.min(axis=0), survey.scene.vertices_m.max(axis=0)
    return np.random.default_rng(1).uniform(low + 0.5, high - 0.5, (n, 3))


def measure_looks(rounds: int) -> str:
    survey, engine, settings = opened_house()
    goals = goals_of(survey, settings.requirements)
    at_m = positions_m(survey, N_POSITIONS)

    def here(positions_m: Any = at_m) -> Any:
        return observe_candidates_here(survey, engine, positions_m, goals, notes_needed=True, progress=silent)

    observed = here(at_m[:TASK_POSITIONS])
    supplied = sent_bytes(ObservationJob(survey, goals, True, engine.name, "x" * 64))
    entries, answer = observed.rows.seen.patch.size + observed.rows.met.patch.size, len(pack_observations(observed))
    alone = [seconds(lambda: here(at_m[:TASK_POSITIONS])) for _ in range(5)]
    at_once = seconds(here)
    lines = [
        f"Scene: house, {survey.patches.n_patches} patches, {N_POSITIONS} positions, batches of {TASK_POSITIONS}; "
        f"{n_usable_cores()} cores, engine {engine.name}.",
        "",
        "| what | figure |",
        "|---|---|",
        f"| sent to a worker once: scene and job, compressed | {supplied / 1e6:.2f} MB |",
        f"| sent per batch | {at_m[:TASK_POSITIONS].nbytes + 500} bytes, about |",
        f"| sent back per batch | {answer / 1e3:.0f} kB for {entries} observations, {8 * answer / entries:.1f} bits "
        "each |",
        f"| a batch in this process, beside its share of all positions at once | "
        f"{statistics.median(alone) / (at_once * TASK_POSITIONS / N_POSITIONS):.2f} |",
    ]
    rows = []
    for count in (1, 2, 4):
        with open_cluster(f"local:{count}", tell=print) as cluster:

            def spread_out(cluster: Any = cluster) -> Any:
                return observe_elsewhere(cluster, survey, engine, at_m, goals, notes_needed=True, progress=silent)

            first = seconds(spread_out)
            pairs = [(seconds(here), seconds(spread_out)) for _ in range(rounds)]
            ratio = statistics.median(there / one for one, there in pairs)
            address = sorted(cluster.workers())[0]
            each = seconds(lambda: [cluster.submit(address, worker.greet).result() for _ in range(N_TASKS)]) / N_TASKS  # noqa: B023
            batch = statistics.median(one for one, _ in pairs) * TASK_POSITIONS / N_POSITIONS
            rows.append(f"| {count} | {ratio:.2f} | {first / pairs[0][0]:.1f} | {each / batch:.3f} |")
    return "\n".join([
        *lines, "",
        "| workers here | time, of one process | first time, engines built | an empty task, of a batch |",
        "|---|---|---|---|", *rows,
    ])  # fmt: skip


PARTS: dict[str, Callable[[int], str]] = {
    "looks": measure_looks, "links": measure_links, "blocks": measure_blocks, "scans": measure_scans,
    "jobs": lambda rounds: measure_jobs(),
}  # fmt: skip

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="all are needed to write")
    told = parser.parse_args()
    table = "\n\n".join(PARTS[part](told.rounds) for part in told.parts)
    print(table)
    if told.write is not None:
        if told.parts != list(PARTS):
            parser.error("--write: the page has all parts; leave out --parts")
        page = told.write.read_text(encoding="utf-8")
        before, _, after = page.split(MARK)
        told.write.write_text(f"{before}{MARK}\n{table}\n{MARK}{after}", encoding="utf-8")
