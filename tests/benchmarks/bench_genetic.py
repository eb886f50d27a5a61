"""Genetic selection: the loop on a device against the same loop on the host, and against DEAP, at equal evaluations.

    python tests/benchmarks/bench_genetic.py [--write docs/benchmarks/genetic.md] [--quick]

The problem is real: candidates of a building on the planner's grid, what an HDL-64E of 5 m range sees from each, its
patches merged into rows. All solve it from a random start with the same operators and rates:

- device: `select_genetic(engine="device")`, the whole loop in kernels.
- host: `select_genetic(engine="host")`, NumPy on all cores, the same trajectory.
- DEAP, matrix: DEAP as its users write it: lists of 0 and 1, tools.selTournament, algorithms.varAnd with
  tools.cxTwoPoint and tools.mutFlipBit, tools.selBest of old and new; the fitness is NumPy on a matrix of booleans.
- DEAP, bits: the same with the fitness on packed bits, as fast as NumPy makes it for one individual.

DEAP does not evaluate children that neither crossover nor mutation touched; it goes on until it has as many evaluations
as the others. One process, in turns; medians. Evaluations a second of the clock, and CPU time of the process, so of all
its threads, an evaluation; arranging the problem and building the population included. Not a test: nothing here can
fail.
"""

from __future__ import annotations

import argparse
import os
import platform
import random
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import scenes_synthetic
from planner_core.coverage.coverage import floor_of_patch, scope_of
from planner_core.coverage.survey import make_survey, visible_from
from planner_core.device import Device, open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.model import PlanSettings, Scene
from planner_core.paper.genetic import GeneticSettings, select_genetic
from planner_core.positions.admissibility import Tripods
from planner_core.positions.candidates import find_candidates
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import Constraint, CoverProblem, cover_problem

REPOSITORY = Path(__file__).resolve().parents[2]
IFC_FOLDER = REPOSITORY.parent / "shared" / "data" / "ifc"
RANGE_MAX_M = 5.0
GENERATIONS, QUICK_GENERATIONS = 100, 6
ROUNDS, QUICK_ROUNDS = 3, 1
#: Mean number of stations of the random start: about twice what a plan needs.
EXPECTED_ACTIVE = 100.0

Fitness = Callable[[list[int]], tuple[float]]


@dataclass
class Task:
    name: str
    problem: CoverProblem
    n_greedy: int


@dataclass
class Run:
    """One run of one solver."""

    n_evaluations: int
    n_stations: int
    wall_s: float
    cpu_s: float


def task(name: str, scene: Scene, heights_m: tuple[float, ...], device: Device) -> Task:
    """Merged rows of what every candidate of a building sees."""
    scanner = replace(load_scanner("hdl-64e"), range_max_m=RANGE_MAX_M)
    settings = PlanSettings(scanner=scanner, instrument_heights_m=heights_m)
    survey = make_survey(scene, settings)
    engine = OpenCLEngine(scene, survey.patches, device)
    floors = survey.planned
    candidates = find_candidates(Tripods(survey, settings, engine))
    visibility = visible_from(survey, engine, candidates.position_m)
    of_patch = floor_of_patch(survey.patches, survey.floor_of_triangle)
    scope = scope_of(of_patch, floors, len(survey.floors))
    parts = (*(of_patch == index for index in floors), scope)
    constraints = tuple(Constraint(part, 0.95) for part in parts)
    problem = cover_problem(visibility, survey.patches.area_m2, constraints)
    return Task(name, problem, len(select_greedy(problem).chosen))


def house() -> Scene:
    """The synthetic house, for where the data are not."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "house.glb"
        scenes_synthetic.write(scenes_synthetic.build("house"), path)
        return load_scene(path)


def tasks(device: Device, *, quick: bool) -> list[Task]:
    duplex = IFC_FOLDER / "duplex.ifc"
    name, scene = ("duplex", load_scene(duplex)) if duplex.exists() else ("house", house())
    found = [task(f"{name}, one height", scene, (1.5,), device)]
    if not quick:
        found.append(task(f"{name}, two heights", scene, (1.0, 1.8), device))
    return found


# -------------------------------------------------------------------------------------------------- DEAP
def matrix_fitness(problem: CoverProblem) -> Fitness:
    """Coverage by a matrix of booleans: rows that any active candidate sees, times weights."""
    sees = np.zeros((problem.n_candidates, problem.n_rows), dtype=bool)
    for candidate in range(problem.n_candidates):
        sees[candidate, problem.rows_of(candidate)] = True
    weights = (problem.counts_for * problem.ticks).astype(np.float64)

    def fitness(individual: list[int]) -> tuple[float]:
        seen = sees[np.flatnonzero(individual)].any(axis=0)
        return penalised(problem, weights @ seen, sum(individual))

    return fitness


def bits_fitness(problem: CoverProblem) -> Fitness:
    """Coverage by packed bits, and one product for all targets."""
    sees = np.zeros((problem.n_candidates, -(-problem.n_rows // 64) * 64), dtype=bool)
    for candidate in range(problem.n_candidates):
        sees[candidate, problem.rows_of(candidate)] = True
    words = np.packbits(sees, axis=1).view(np.uint64)
    weights = np.ascontiguousarray((problem.counts_for * problem.ticks).astype(np.float64).T)

    def fitness(individual: list[int]) -> tuple[float]:
        union = np.bitwise_or.reduce(words[np.flatnonzero(individual)], axis=0)
        seen = np.unpackbits(union.view(np.uint8), count=problem.n_rows)
        return penalised(problem, seen.astype(np.float64) @ weights, sum(individual))

    return fitness


def penalised(problem: CoverProblem, covered: np.ndarray, n_active: int) -> tuple[float]:
    """Fewest stations that meet the targets; sets that miss them are worth less than all that meet them."""
    missing = float(np.maximum(problem.required - covered, 0).sum())
    return (-missing - problem.n_candidates if missing > 0 else -float(n_active),)


def deap_solver(problem: CoverProblem, fitness: Callable[[CoverProblem], Fitness], n_evaluations: int) -> Run:
    from deap import algorithms, base, creator, tools

    wall, cpu = time.perf_counter(), time.process_time()
    evaluate = fitness(problem)
    if not hasattr(creator, "Individual"):
        creator.create("Best", base.Fitness, weights=(1.0,))
        creator.create("Individual", list, fitness=creator.Best)
    defaults = GeneticSettings()
    random.seed(1)

    def individual() -> list[int]:
        rate = random.random() * 2 * EXPECTED_ACTIVE / problem.n_candidates
        genes = creator.Individual(int(random.random() < rate) for _ in range(problem.n_candidates))
        genes[random.randrange(len(genes))] = 1
        return genes

    toolbox = base.Toolbox()
    toolbox.register("evaluate", evaluate)
    toolbox.register("mate", tools.cxTwoPoint)
    toolbox.register("mutate", tools.mutFlipBit, indpb=defaults.gene_mutation_rate)
    toolbox.register("select", tools.selTournament, tournsize=defaults.tournament_size)
    population = [individual() for _ in range(defaults.population)]
    evaluated, new = 0, population
    while True:
        fresh = [each for each in new if not each.fitness.valid]
        for each, value in zip(fresh, map(toolbox.evaluate, fresh), strict=True):
            each.fitness.values = value
        evaluated += len(fresh)
        if new is not population:
            population = tools.selBest(population + new, defaults.population)
        if evaluated >= n_evaluations:
            break
        parents = toolbox.select(population, defaults.n_parents)
        new = algorithms.varAnd(parents, toolbox, defaults.crossover_rate, defaults.individual_mutation_rate)
    best = tools.selBest(population, 1)[0]
    return Run(evaluated, sum(best), time.perf_counter() - wall, time.process_time() - cpu)


# -------------------------------------------------------------------------------------------------- ours
def our_solver(problem: CoverProblem, settings: GeneticSettings, engine: str, device: Device) -> Run:
    wall, cpu = time.perf_counter(), time.process_time()
    result = select_genetic(problem, settings, engine=engine, device=device)
    return Run(result.n_evaluations, result.chosen.size, time.perf_counter() - wall, time.process_time() - cpu)


def measure(on: Task, device: Device, *, quick: bool) -> dict[str, list[Run]]:
    """All solvers in turns; a first, uncounted run each has kernels built and memory touched."""
    generations = QUICK_GENERATIONS if quick else GENERATIONS
    settings = GeneticSettings(max_iterations=generations, patience=generations + 1, expected_active=EXPECTED_ACTIVE)
    n_evaluations = settings.population + generations * settings.n_offspring
    problem = on.problem
    solvers: dict[str, Callable[[], Run]] = {
        "device": lambda: our_solver(problem, settings, "device", device),
        "host": lambda: our_solver(problem, settings, "host", device),
        "DEAP, matrix": lambda: deap_solver(problem, matrix_fitness, n_evaluations),
        "DEAP, bits": lambda: deap_solver(problem, bits_fitness, n_evaluations),
    }
    our_solver(problem, settings, "device", device)
    runs: dict[str, list[Run]] = {name: [] for name in solvers}
    for _ in range(QUICK_ROUNDS if quick else ROUNDS):
        for name, solve in solvers.items():
            runs[name].append(solve())
            print(f"{on.name}: {name}: {runs[name][-1]}", file=sys.stderr)
    return runs


def section(on: Task, runs: dict[str, list[Run]]) -> list[str]:
    problem = on.problem
    wall = {name: statistics.median(run.wall_s / run.n_evaluations for run in each) for name, each in runs.items()}
    cpu = {name: statistics.median(run.cpu_s / run.n_evaluations for run in each) for name, each in runs.items()}
    lines = [
        f"## {on.name}",
        f"{problem.n_candidates} candidates, {problem.n_rows} rows, {len(problem.required)} targets; "
        f"{runs['device'][0].n_evaluations} evaluations a run, {len(runs['device'])} runs. "
        f"Greedy selection: {on.n_greedy} stations.",
        "",
        "| solver | evaluations a second | CPU time an evaluation | device over it, clock | CPU time | best set |",
        "|---|---|---|---|---|---|",
    ]
    for name, each in runs.items():
        lines.append(
            f"| {name} | {1 / wall[name]:,.0f} | {1e6 * cpu[name]:,.1f} us | {wall[name] / wall['device']:.1f} | "
            f"{cpu[name] / cpu['device']:.1f} | {each[0].n_stations} stations |"
        )
    return [*lines, ""]


def report(device: Device, *, quick: bool) -> str:
    from deap import __version__ as deap_version

    lines = [
        "# Genetic selection",
        "Written by `tests/benchmarks/bench_genetic.py`, which says what is measured and how. The method: [genetic "
        "selection](../method/genetic-selection.md). The row of the host is the counterpart of Fig. 16 of López et al. "
        "2023.",
        "",
        f"{device.label}, {os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, NumPy "
        f"{np.__version__}, DEAP {deap_version}. GPUs: [gpu.md](gpu.md).",
        "",
    ]
    for on in tasks(device, quick=quick):
        lines += section(on, measure(on, device, quick=quick))
    lines.append(
        "Ratios of the clock hang on what else the machine does: the device and the host use all cores, DEAP one. "
        "Sets are those after these evaluations, far from the end of the search."
    )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="write the report here besides printing it")
    parser.add_argument("--quick", action="store_true", help="few evaluations, one round: does it run?")
    options = parser.parse_args()
    text = report(open_device(), quick=options.quick)
    print(text)
    if options.write is not None:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
