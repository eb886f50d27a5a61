"""Proven selection against greedy and genetic selection, on what real candidates of real and synthetic buildings see.

    python tests/benchmarks/bench_selection.py [--write docs/benchmarks/selection.md] [--quick] [--work LIMIT]

Candidates stand on the planner's grid at 1.5 m, an HDL-64E of 5 m range looks around, 95 % are required on each floor
and in all. The buildings of shared/data/ifc are left out where they are not; glass returns beams.

- greedy: `select_greedy`. genetic: `select_genetic` on the device with the settings that did best in
  docs/method/genetic-selection.md (uniform crossover, distinct, started with the greedy set).
- ours: `select` with a limit of work, 60 unless told otherwise.
- bound before: `lower_bound`, which came with greedy selection.

CPU time of the process, so of all its threads. Every set is looked at by `check_coverage` in the end. Not a test.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from selection_report import machine, options_of, publish, timed

import scenes_synthetic
from planner_core.coverage.coverage import floor_of_patch, scope_of
from planner_core.coverage.survey import make_survey, visible_from
from planner_core.device import Device, open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import PlanSettings, Proven, Requirements, Scene
from planner_core.paper.genetic import GeneticSettings, select_genetic
from planner_core.positions.admissibility import Tripods
from planner_core.positions.candidates import find_candidates
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import LoadOptions, load_scene
from planner_core.select.check import check_coverage
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import Constraint, CoverProblem, cover_problem
from planner_core.select.proven import ProvenSelection, select
from planner_core.select.quick_bound import lower_bound

REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
RANGE_MAX_M, HEIGHT_M, COVERAGE = 5.0, 1.5, 0.95


@dataclass
class Task:
    name: str
    problem: CoverProblem
    check: Callable[[list[int]], None]


@dataclass
class Row:
    task: Task
    n_greedy: int
    greedy_s: float
    n_genetic: int
    genetic_s: float
    bound_before: int
    ours: ProvenSelection
    ours_s: float


def synthetic(name: str) -> Scene:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.glb"
        scenes_synthetic.write(scenes_synthetic.build(name), path)
        return load_scene(path)


def ifc(name: str) -> Scene | None:
    path = IFC_FOLDER / f"{name}.ifc"
    if not path.exists():
        print(f"{path.name}: not here, left out", file=sys.stderr)
        return None
    return load_scene(path, options=LoadOptions(glass="return"))


def task(name: str, scene: Scene, device: Device, *, grid_m: float, floors: tuple[str, ...] = ()) -> Task:
    """What every candidate sees, and the check of a set by patches and areas."""
    scanner = replace(load_scanner("hdl-64e"), range_max_m=RANGE_MAX_M)
    settings = PlanSettings(
        scanner=scanner,
        requirements=Requirements(floors=floors),
        instrument_heights_m=(HEIGHT_M,),
        grid_step_m=grid_m,
    )
    survey = make_survey(scene, settings)
    engine = OpenCLEngine(scene, survey.patches, device)
    planned = survey.planned
    candidates = find_candidates(Tripods(survey, settings, engine))
    visibility = visible_from(survey, engine, candidates.position_m)
    of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
    parts = (*(of_patch == index for index in planned), scope_of(of_patch, planned, len(survey.floors)))
    constraints = tuple(Constraint(part, COVERAGE) for part in parts)
    area_m2 = survey.patches.area_m2
    problem = cover_problem(visibility, area_m2, constraints)
    return Task(
        f"{name}, {grid_m:g} m", problem, lambda chosen: check_coverage(visibility, area_m2, constraints, chosen)
    )


def tasks(device: Device, *, quick: bool) -> list[Task]:
    house = synthetic("house")
    if quick:
        return [task("house", house, device, grid_m=1.0)]
    found = [task("house", house, device, grid_m=0.5)]
    duplex, fzk = ifc("duplex"), ifc("fzk-haus")
    if duplex is not None:
        found.append(task("duplex, level 1", duplex, device, grid_m=0.4, floors=("Level 1",)))
        found.append(task("duplex, level 2", duplex, device, grid_m=0.4, floors=("Level 2",)))
        found.append(task("duplex", duplex, device, grid_m=0.5))
    if fzk is not None:
        found.append(task("fzk-haus", fzk, device, grid_m=0.5))
    return [*found, task("basement", synthetic("basement"), device, grid_m=0.5)]


def measure(on: Task, device: Device, *, work: float) -> Row:
    problem = on.problem
    greedy, greedy_s = timed(lambda: select_greedy(problem).chosen)
    settings = GeneticSettings(
        crossover="uniform", distinct=True, individual_mutation_rate=1.0, gene_mutation_rate=0.002, patience=100
    )
    first = [np.array(greedy)]
    genetic, genetic_s = timed(lambda: select_genetic(problem, settings, device=device, given=first).chosen)
    before = lower_bound(problem, n_stations=len(greedy))
    ours, ours_s = timed(lambda: select(problem, Proven(work_limit=work)))
    for chosen in (greedy, genetic, ours.chosen):
        on.check([int(c) for c in chosen])
    row = Row(on, len(greedy), greedy_s, len(genetic), genetic_s, before, ours, ours_s)
    print(f"{on.name}: {replace(ours, chosen=())} {ours_s:.1f} s", file=sys.stderr)
    return row


def report(device: Device, *, quick: bool, work: float) -> str:
    from importlib.metadata import version

    rows = [measure(on, device, work=work) for on in tasks(device, quick=quick)]
    lines = [
        "# Selection",
        "Written by `tests/benchmarks/bench_selection.py`, which says what is measured and how. The method: "
        "[selection](../method/selection.md).",
        "",
        f"{machine(device)}, HiGHS {version('highspy')}. At most {work:g} units of work, about seconds.",
        "",
        "| scene, grid | candidates | rows | greedy | genetic | ours | bound before | bound | gap | |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        ours, problem = row.ours, row.task.problem
        lines.append(
            f"| {row.task.name} | {problem.n_candidates} | {problem.n_rows} | {row.n_greedy} | {row.n_genetic} | "
            f"{len(ours.chosen)} | {row.bound_before} | {ours.lower_bound} | {100 * ours.gap:.1f} % | "
            f"{ours.why_stopped} |"
        )
    lines += [
        "",
        "| scene, grid | CPU time of greedy | genetic | ours, all | ours, work until the set was found |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        found = next(point for point in row.ours.curve if point.stations == len(row.ours.chosen))
        lines.append(
            f"| {row.task.name} | {row.greedy_s:.2f} s | {row.genetic_s / row.greedy_s:.0f} times that | "
            f"{row.ours_s / row.greedy_s:.0f} times | {100 * found.work / max(row.ours.work, 1e-9):.0f} % of all |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    options = options_of(__doc__, work=60.0)
    publish(report(open_device(), quick=options.quick, work=options.work), options.write)


if __name__ == "__main__":
    main()
