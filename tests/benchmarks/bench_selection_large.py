"""Selection of large problems: 10 000 candidates, 100 000 patches, against greedy selection and with the bound.

    python tests/benchmarks/bench_selection_large.py [--write FILE] [--quick] [--work LIMIT]

Problems are made here, at random from a fixed seed; patches are points of 0.02 to 0.04 m2, 95 % are required.

- rooms: two floors of 24 x 18 rooms of 6 m, doors in seven of ten walls, patches on walls and ground; a candidate sees
  what lies within 9 m and no wall hides. Targets: each floor, and all.
- clear discs: candidates and patches in a square; a candidate sees what lies in its disc of 540 patches. One target.
- hazy discs: the same with larger discs, of which a candidate sees 7 of 10 patches, others than its neighbours do. What
  stations see is nearly independent: the relaxation covers everything evenly and nothing twice, which no plan can.

CPU time of the process, so of all its threads. Sets are checked by `check_selection`. Not a test.
"""

from __future__ import annotations

import resource
import sys
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from selection_report import machine, options_of, publish, timed

from planner_core.device import Device, open_device
from planner_core.model import BoolArray, FloatArray, Int64Array, Proven, Visibility
from planner_core.select.greedy import select_greedy
from planner_core.select.large import select_large
from planner_core.select.large_bound import LagrangeBound, large_bound
from planner_core.select.most_coverage import MostCoverage, most_coverage
from planner_core.select.problem import Constraint, CoverProblem, cover_problem
from planner_core.select.proven import ProvenSelection

COVERAGE = 0.95
ROOM_M, RANGE_M, NEAR_WALL_M = 6.0, 9.0, 0.4
N_ROOMS = np.array([24, 18])


@dataclass
class Row:
    name: str
    problem: CoverProblem
    bound: LagrangeBound
    bound_s: float
    greedy_s: float
    found: ProvenSelection
    found_s: float
    curve: tuple[MostCoverage, ...]


def discs(n: int, n_patches: int, *, seen_share: float) -> CoverProblem:
    random = np.random.default_rng(0)
    candidates, patches = random.random((n, 2)), random.random((n_patches, 2))
    radius = np.sqrt(5.4e-3 / seen_share / np.pi)
    rows = cKDTree(patches).query_ball_point(candidates, radius, return_sorted=True)
    seen = [np.array(row, dtype=np.int32)[random.random(len(row)) < seen_share] for row in rows]
    return problem_of(seen, random.uniform(0.02, 0.04, n_patches), [np.ones(n_patches, dtype=bool)])


def rooms(n: int, n_patches: int, *, n_floors: int = 2) -> CoverProblem:
    random = np.random.default_rng(0)
    seen: list[np.ndarray] = []
    of_floor, n_here = n // n_floors, n_patches // n_floors
    for floor in range(n_floors):
        doors = [door_of_walls(random, axis) for axis in (0, 1)]
        room = random.integers(0, N_ROOMS, (of_floor, 2))
        candidates = room * ROOM_M + random.uniform(NEAR_WALL_M, ROOM_M - NEAR_WALL_M, (of_floor, 2))
        patches = random.random((n_here, 2)) * N_ROOMS * ROOM_M
        on_wall, axis = random.random(n_here) < 0.6, random.integers(0, 2, n_here)
        wall = np.flatnonzero(on_wall)
        side = random.integers(0, 2, wall.size)
        inside_m = np.where(side == 0, 1e-3, ROOM_M - 1e-3)
        patches[wall, axis[wall]] = patches[wall, axis[wall]] // ROOM_M * ROOM_M + inside_m
        near = cKDTree(patches).query_ball_point(candidates, RANGE_M, return_sorted=True)
        for candidate, row in zip(candidates, near, strict=True):
            at = np.array(row, dtype=np.int64)
            seen.append((at[no_wall_between(candidate, patches[at], doors)] + floor * n_here).astype(np.int32))
    floor_of_patch = np.arange(n_here * n_floors) // n_here
    parts = [floor_of_patch == floor for floor in range(n_floors)]
    area_m2 = random.uniform(0.02, 0.04, floor_of_patch.size)
    return problem_of(seen, area_m2, [*parts, np.ones(floor_of_patch.size, dtype=bool)])


def door_of_walls(random: np.random.Generator, axis: int) -> tuple[FloatArray, FloatArray]:
    """Where the door of each wall across `axis` is, from its room's corner, and its width; 0: there is none."""
    shape = (int(N_ROOMS[0]) + 1 - axis, int(N_ROOMS[1]) + axis)
    width_m = np.where(random.random(shape) < 0.7, np.where(random.random(shape) < 0.2, 3.0, 1.0), 0.0)
    if axis == 0:
        width_m[[0, -1]] = 0.0
    else:
        width_m[:, [0, -1]] = 0.0
    return random.uniform(1.5, ROOM_M - 1.5, shape), width_m


def no_wall_between(
    candidate_m: FloatArray, patches_m: FloatArray, doors: list[tuple[FloatArray, FloatArray]]
) -> BoolArray:
    """Whether the straight line passes each wall that it crosses through its door."""
    free = np.ones(len(patches_m), dtype=bool)
    for axis, (door_m, width_m) in enumerate(doors):
        across, along = candidate_m[axis], candidate_m[1 - axis]
        first = np.minimum(across, patches_m[:, axis]) // ROOM_M + 1
        last = np.maximum(across, patches_m[:, axis]) // ROOM_M
        for step in range(int(RANGE_M / ROOM_M) + 1):
            wall = first + step
            at = np.flatnonzero(free & (wall <= last))
            share = (wall[at] * ROOM_M - across) / (patches_m[at, axis] - across)
            place = along + share * (patches_m[at, 1 - axis] - along)
            room = np.clip((place // ROOM_M).astype(int), 0, N_ROOMS[1 - axis] - 1)
            which = (wall[at].astype(int), room) if axis == 0 else (room, wall[at].astype(int))
            free[at] = np.abs(place - room * ROOM_M - door_m[which]) <= width_m[which] / 2
    return free


def problem_of(seen: list[np.ndarray], area_m2: FloatArray, parts: list[BoolArray]) -> CoverProblem:
    starts: Int64Array = np.concatenate([[0], np.cumsum([row.size for row in seen])]).astype(np.int64)
    visibility = Visibility(starts, np.concatenate(seen), area_m2.size)
    return cover_problem(visibility, area_m2, tuple(Constraint(part, COVERAGE) for part in parts))


def measure(name: str, problem: CoverProblem, *, work: float) -> Row:
    n_greedy, greedy_s = timed(lambda: len(select_greedy(problem).chosen))
    bound, bound_s = timed(lambda: large_bound(problem, n_stations=n_greedy, work_limit=work))
    found, found_s = timed(lambda: select_large(problem, Proven(work_limit=work)))
    print(f"{name}: {len(found.chosen)} of {n_greedy}, bound {bound.value:.2f}, {found_s:.1f} s", file=sys.stderr)
    points = [max(1, len(found.chosen) * part // 4) for part in (1, 2, 3)]
    curve: list[MostCoverage] = []
    for point in points:
        start = curve[-1].chosen if curve else None
        curve.append(most_coverage(problem, point, Proven(work_limit=work / 4), start=start))
    return Row(name, problem, bound, bound_s, greedy_s, found, found_s, tuple(curve))


def report(device: Device, *, quick: bool, work: float) -> str:
    n, n_patches = (600, 6000) if quick else (10_000, 100_000)
    made = {
        "rooms": lambda: rooms(n, n_patches),
        "clear discs": lambda: discs(n, n_patches, seen_share=1.0),
        "hazy discs": lambda: discs(n, n_patches, seen_share=0.7),
    }
    rows = [measure(name, make(), work=work) for name, make in made.items()]
    memory_gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    lines = [
        "# Selection of large problems",
        "Written by `tests/benchmarks/bench_selection_large.py`, which says what is measured and how. The method: "
        "[large selections](../method/selection-large.md).",
        "",
        f"{machine(device)}. At most {work:g} units of work a set; {memory_gib:.1f} GiB of memory at most, for all.",
        "",
        "| problem | candidates | rows | entries | greedy | ours | bound | gap | relaxation | |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        found, bound = row.found, row.bound
        lines.append(
            f"| {row.name} | {row.problem.n_candidates} | {row.problem.n_rows} | {row.problem.row.size / 1e6:.1f} "
            f"million | {found.n_greedy} | {len(found.chosen)} | {found.lower_bound} | {100 * found.gap:.1f} % | "
            f"{bound.value:.1f} to {bound.relaxation_at_most:.1f} | {found.why_stopped} |"
        )
    lines += ["", "| problem | CPU time of greedy | of the bound alone | of ours, all | stations after work |"]
    lines += ["|---|---|---|---|---|"]
    for row in rows:
        way = ", ".join(f"{point.stations} ({point.work:.1f})" for point in row.found.curve[1:])
        lines.append(f"| {row.name} | {row.greedy_s:.1f} s | {row.bound_s:.1f} s | {row.found_s:.0f} s | {way} |")
    lines += ["", f"Most coverage with n stations, at most {work / 4:g} units of work each:", ""]
    lines += ["| problem | n | covered | at most |", "|---|---|---|---|"]
    for row in rows:
        lines += [
            f"| {row.name} | {point.n_stations} | {100 * point.fraction:.2f} % | {100 * point.bound_fraction:.2f} % |"
            for point in row.curve
        ]
    return "\n".join(lines) + "\n"


def main() -> None:
    options = options_of(__doc__, work=16.0)
    publish(report(open_device(), quick=options.quick, work=options.work), options.write)


if __name__ == "__main__":
    main()
