"""Scanning over Dask workers against one process: ratios, overhead of a task, what travels.

`make bench-cluster` writes docs/benchmarks/cluster.md. Workers are processes of this machine and share its cores: what
is gained there says little of many machines, what a task costs says much.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import scenes_synthetic
from planner_core.cluster import worker
from planner_core.cluster.parcels import Packer, pack_looked, squeezed
from planner_core.cluster.spread import _BATCH, open_cluster
from planner_core.coverage.survey import make_survey
from planner_core.engine.scan_engine import open_engine
from planner_core.model import PlanSettings, PointLimits, Requirements, ScanBy
from planner_core.operating_system import n_usable_cores
from planner_core.progress import silent
from planner_core.requirements.goals import goals_of
from planner_core.requirements.look_around import look_around_here
from planner_core.scanner.load_scanner import load_scanner

N_POSITIONS, N_TASKS = 164, 100
MARK = "<!-- measured -->"


def seconds(work: Callable[[], Any]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def measure(rounds: int) -> str:
    settings = PlanSettings(
        scanner=load_scanner("rtc360"),
        requirements=Requirements(asked=PointLimits(spacing_m=0.006, range_m=20.0)),
        scan_mode=ScanBy.PATCHES,
        max_patch_area_m2=0.16,
    )
    survey = make_survey(scenes_synthetic.build("house").scene, settings)
    engine = open_engine(survey.scene, survey.patches)
    goals = goals_of(survey, settings.requirements)
    low, high = survey.scene.vertices_m.min(axis=0), survey.scene.vertices_m.max(axis=0)
    at_m = np.random.default_rng(1).uniform(low + 0.5, high - 0.5, (N_POSITIONS, 3))

    def here(positions_m: Any = at_m) -> Any:
        return look_around_here(survey, engine, positions_m, goals, notes_needed=True, progress=silent)

    looked = here(at_m[:_BATCH])
    question = worker.Question(survey, goals, True, engine.name, "")
    parcel = Packer().parcel((replace(question, engine_of="x" * 64), survey.patches))
    supplied = len(parcel.body) + sum(len(squeezed(each)) for each in parcel.arrays.values())
    entries, answer = looked.rows.seen.patch.size + looked.rows.met.patch.size, len(pack_looked(looked))
    alone = [seconds(lambda: here(at_m[:_BATCH])) for _ in range(5)]
    at_once = seconds(here)
    lines = [
        f"Scene: house, {survey.patches.n_patches} patches, {N_POSITIONS} positions, batches of {_BATCH}; "
        f"{n_usable_cores()} cores, engine {engine.name}.",
        "",
        "| what | figure |",
        "|---|---|",
        f"| sent to a worker once: scene and question, compressed | {supplied / 1e6:.2f} MB |",
        f"| sent per batch | {at_m[:_BATCH].nbytes + 500} bytes, about |",
        f"| sent back per batch | {answer / 1e3:.0f} kB for {entries} observations, {8 * answer / entries:.1f} bits "
        "each |",
        f"| a batch in this process, beside its share of all positions at once | "
        f"{statistics.median(alone) / (at_once * _BATCH / N_POSITIONS):.2f} |",
    ]
    rows = []
    for count in (1, 2, 4):
        with open_cluster(f"local:{count}", tell=print) as cluster:

            def spread_out(cluster: Any = cluster) -> Any:
                return cluster.look_around(survey, engine, at_m, goals, notes_needed=True, progress=silent)

            first = seconds(spread_out)
            pairs = [(seconds(here), seconds(spread_out)) for _ in range(rounds)]
            ratio = statistics.median(there / one for one, there in pairs)
            address = sorted(cluster.workers())[0]
            each = seconds(lambda: [cluster.submit(address, worker.greet).result() for _ in range(N_TASKS)]) / N_TASKS  # noqa: B023
            batch = statistics.median(one for one, _ in pairs) * _BATCH / N_POSITIONS
            rows.append(f"| {count} | {ratio:.2f} | {first / pairs[0][0]:.1f} | {each / batch:.3f} |")
    return "\n".join([
        *lines, "",
        "| workers here | time, of one process | first time, engines built | an empty task, of a batch |",
        "|---|---|---|---|", *rows,
    ])  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    told = parser.parse_args()
    table = measure(told.rounds)
    print(table)
    if told.write is not None:
        page = told.write.read_text(encoding="utf-8")
        before, _, after = page.split(MARK)
        told.write.write_text(f"{before}{MARK}\n{table}\n{MARK}{after}", encoding="utf-8")
