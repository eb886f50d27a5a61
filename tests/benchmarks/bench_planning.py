"""The whole planner against its rivals, on every scene: the same candidates, the same requirements, the same links.

    nice python tests/benchmarks/bench_planning.py [--record docs/benchmarks/planning.json] [--only TEXT ...]
        [--write docs/benchmarks/planning.md] [--page-alone] [--minutes N]

Every row goes into the record as soon as it is there; rows that the record has are not worked out again, so that an
interrupted run goes on where it was. Delete the record after changing the planner. What the columns are: the page's
head, in `planning_page.py`; which scenes: `planning_cases.py`. The exit status is 1 where a promise of the planner is
broken: more stations than a rival whose set meets the same, or than a puzzle needs.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from planning_cases import Case, cases
from planning_page import page

from planner_core.coverage.survey import make_survey
from planner_core.engine.open_engine import open_engine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import Candidates, Paper, Proven, Survey
from planner_core.paper.pipeline import repair, searched, select_by_genes
from planner_core.paper.point_distribution import PointDistribution
from planner_core.planning.pool import Pool, extended, make_pool
from planner_core.planning.refine import WORK_SHARE, Refined, refine
from planner_core.positions.admissibility import Tripods
from planner_core.positions.allowed_positions import AllowedPositions, find_positions
from planner_core.positions.local_site import local_site
from planner_core.requirements.demand import rows_from
from planner_core.requirements.goals import goals_of
from planner_core.select.check import SelectionCheckError, check_coverage, check_selection
from planner_core.select.greedy import drop_redundant, select_greedy
from planner_core.select.large import select_by_size
from planner_core.select.network import Network, connect
from planner_core.select.problem import CoverProblem, cover_problem
from planner_core.select.proven import ProvenSelection

T = TypeVar("T")
#: What the planner was when a row was measured, for readers of the page: change it with the planner.
STATE = "proof by blocks and groups"


@dataclass
class Found:
    """A set of stations. networks : that registration leaves; parts : the fewest that these candidates allow them.

    met : whether the set meets every target. joined : whether it is in no more networks. cpu_s : of the process.
    near_work : of a search, work until its gap was at most 2 % or one station; None: it never was. candidates : what it
    chose from, where that is more than the row's.
    """

    stations: int
    networks: int
    parts: int
    met: bool
    joined: bool
    cpu_s: float
    bound: int | None = None
    why_stopped: str = ""
    work: float = 0.0
    near_work: float | None = None
    wall_s: float = 0.0
    candidates: int | None = None


@dataclass(frozen=True)
class Ready:
    """A case's scene looked at from everywhere: what all methods choose from.

    parts : networks that are left without candidates that would be a network of their own for nothing.
    """

    case: Case
    survey: Survey
    engine: ScanEngine
    places: AllowedPositions
    pool: Pool
    network: Network
    parts: int

    @cached_property
    def whole(self) -> CoverProblem:
        """The problem with all candidates; that of `pool` lets those see nothing that would be a network for nothing.

        Made when somebody asks: `tlsplan plan` never holds both.
        """
        return whole_problem(self.pool)


def ready(case: Case) -> Ready | None:
    """Load, find places, look around; None where the scene is not here."""
    scene = case.load()
    if scene is None:
        return None
    survey = make_survey(scene, case.settings)
    engine = open_engine(survey.scene, survey.patches)
    tripods, site = Tripods(survey, case.settings, engine), local_site(survey, case.settings.site)
    places = find_positions(tripods, site)
    none, goals = np.zeros(0, dtype=np.int64), goals_of(survey, case.settings.requirements)
    pool = make_pool(survey, goals, engine, places.candidates, given=none, kept=none, linked=True)
    network = pool.network
    assert network is not None, "these cases all ask for a network"
    parts = int(np.unique(network.part[~pool.excluded]).size)
    return Ready(case, survey, engine, places, pool, network, parts)


def whole_problem(pool: Pool) -> CoverProblem:
    """The problem of a pool with no candidate excluded: what methods are about that ask for no network."""
    return cover_problem(pool.rows.met, pool.demand.area_m2, pool.constraints)


def timed(call: Callable[[], T]) -> tuple[T, float, float]:
    """What it returns, its CPU time and its wall time in seconds."""
    wall, begin = time.perf_counter(), time.process_time()
    result = call()
    return result, time.process_time() - begin, time.perf_counter() - wall


def judged(on: Ready, chosen: Sequence[int], cpu_s: float, wall_s: float, *, later: Pool | None = None) -> Found:
    """Look at a set by the means of `select.check`, which no method uses to find one.

    later : the pool with the places off the grid that the set takes.
    """
    pool = on.pool if later is None else later
    problem = on.whole if later is None else whole_problem(later)
    network = pool.network
    assert network is not None
    meets = True
    try:
        check_selection(problem, chosen)
        check_coverage(pool.rows.met, pool.demand.area_m2, pool.constraints, chosen)
    except SelectionCheckError:
        meets = False
    networks = int(np.unique(network.part[list(chosen)]).size) + network.n_violations(list(chosen))
    hangs = networks <= on.parts
    try:
        check_selection(replace(problem, required=np.zeros_like(problem.required)), chosen, network=network)
    except SelectionCheckError:
        hangs = False
    return Found(len(chosen), networks, on.parts, meets, hangs, cpu_s, wall_s=wall_s)


def rivals(on: Ready) -> dict[str, Found]:
    """Greedy selection alone and repaired, and the paper's selection and repair."""
    pool, problem, within, settings = on.pool, on.whole, on.pool.problem, on.case.settings
    paper = replace(settings, method=Paper(search="none")).seeded_method
    assert isinstance(paper, Paper)

    def repaired(chosen: Sequence[int], by: Paper) -> list[int]:
        return with_circles(on, by, pool.candidates, chosen)

    greedy, greedy_s, greedy_wall_s = timed(lambda: list(select_greedy(problem).chosen))
    linked, linked_s, linked_wall_s = timed(
        lambda: drop_redundant(
            within, connect(within, on.network, list(select_greedy(within).chosen)), network=on.network
        )
    )
    circles, circles_s, circles_wall_s = timed(lambda: repaired(greedy, paper))
    genes, genes_s, genes_wall_s = timed(lambda: repaired(select_by_genes(problem, paper, on.engine).tolist(), paper))
    return {
        "greedy": judged(on, greedy, greedy_s, greedy_wall_s),
        "greedy_links": judged(on, linked, linked_s, linked_wall_s),
        "greedy_circles": judged(on, circles, greedy_s + circles_s, greedy_wall_s + circles_wall_s),
        "paper": judged(on, genes, genes_s, genes_wall_s),
    }


def with_circles(on: Ready, paper: Paper, candidates: Candidates, chosen: Sequence[int]) -> list[int]:
    """A set and what the method paper's repair adds to it."""
    overlap = on.case.settings.requirements.overlap
    rows = repair(paper, overlap, candidates, np.array(chosen, dtype=np.int64))[0]
    return [int(row) for row in rows]


def paper_with_search(on: Ready) -> Found:
    """The paper's whole method: annealing from every candidate, selection from these and what it found, repair."""
    settings, pool = on.case.settings, on.pool
    paper = replace(settings, method=Paper(pool="both")).seeded_method
    assert isinstance(paper, Paper)

    def searched_through() -> tuple[Pool, list[int]]:
        distribution = PointDistribution(on.survey.scene, on.survey.patches, on.engine, distance=paper.f2.distance)
        both = searched(on.places.tripods, paper, distribution, pool.candidates)
        starts = set(map(tuple, pool.candidates.position_m.tolist()))
        new = [row for row, place in enumerate(both.position_m.tolist()) if tuple(place) not in starts]
        more = both.take(np.array(new, dtype=np.int64))
        wide = extended(pool, more, rows_from(on.survey, on.engine, more.position_m, pool.demand), on.engine)
        chosen = select_by_genes(whole_problem(wide), paper, on.engine).tolist()
        return wide, with_circles(on, paper, wide.candidates, chosen)

    (wide, chosen), cpu_s, wall_s = timed(searched_through)
    return replace(judged(on, chosen, cpu_s, wall_s, later=wide), candidates=wide.n_candidates)


def ours(on: Ready) -> tuple[dict[str, Found], float]:
    """Stations that only cover, that are connected, and that left the grid besides; and memory in GiB.

    Memory is the most that the process took to look around and find the last two, as `tlsplan plan` does.
    """
    settings = on.case.settings.seeded_method
    assert isinstance(settings, Proven)

    def searched(network: Network | None, problem: CoverProblem, work: float) -> tuple[ProvenSelection, float, float]:
        limit = replace(settings, work_limit=work)
        return timed(lambda: select_by_size(problem, limit, network=network))

    linked, *linked_s = searched(on.network, on.pool.problem, on.case.work)
    off_grid, cpu_s, wall_s = timed(lambda: refined(on, linked.chosen))
    memory_gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    off_grid_s = (linked_s[0] + cpu_s, linked_s[1] + wall_s)
    cover, *cover_s = searched(None, on.whole, on.case.cover_work)
    return {
        "cover": proven(judged(on, cover.chosen, *cover_s), cover),
        "joined": proven(judged(on, linked.chosen, *linked_s), linked),
        "refined": judged(on, off_grid.chosen, *off_grid_s, later=off_grid.pool),
    }, memory_gib


def proven(found: Found, selection: ProvenSelection) -> Found:
    """`found` with what the search says of itself."""
    near = (p.work for p in selection.curve if p.stations - p.bound <= max(1.0, 0.02 * p.stations))
    return replace(
        found,
        bound=selection.lower_bound,
        why_stopped=selection.why_stopped,
        work=selection.work,
        near_work=next(near, None),
    )


def refined(on: Ready, chosen: tuple[int, ...]) -> Refined:
    """Leave the grid as `planner_core.planning.choose` does."""
    method = on.case.settings.seeded_method
    assert isinstance(method, Proven)
    work = replace(method, work_limit=WORK_SHARE * on.case.work, prove=False)
    return refine(on.pool, chosen, on.places, on.engine, work)


def broken_promises(case: Case, found: dict[str, Found]) -> list[str]:
    """What the planner promises of every row, and did not keep."""
    cover, linked, off_grid = found["cover"], found["joined"], found["refined"]
    said = [f"{name} misses a target" for name in ("cover", "joined", "refined") if not found[name].met]
    said += [f"{name} is not connected" for name in ("joined", "refined") if not found[name].joined]
    if cover.stations > found["greedy"].stations:
        said.append(f"cover takes {cover.stations}, greedy {found['greedy'].stations}")
    if off_grid.stations > linked.stations:
        said.append(f"refined takes {off_grid.stations}, joined {linked.stations}")
    for name in ("greedy_links", "greedy_circles", "paper"):
        rival = found[name]
        if rival.met and rival.networks < min(linked.networks, off_grid.networks):
            said.append(f"joined leaves {linked.networks} networks, {name} {rival.networks}")
        if rival.met and cover.stations > rival.stations:
            said.append(f"cover takes {cover.stations}, {name} {rival.stations}")
        if rival.met and rival.joined and linked.stations > rival.stations:
            said.append(f"joined takes {linked.stations}, {name} {rival.stations}")
    if linked.bound is not None and cover.bound is not None and cover.bound > linked.stations:
        said.append(f"bound of cover {cover.bound} is above the {linked.stations} stations of joined")
    if case.known_best is not None and cover.stations != case.known_best:
        said.append(f"cover takes {cover.stations}, the puzzle's best is {case.known_best}")
    return said


def measure(case: Case) -> dict[str, Any] | None:
    """One row of the record; None where the scene is not here."""
    on, cpu_s, wall_s = timed(lambda: ready(case))
    if on is None:
        return None
    problem = on.whole
    mine, memory_gib = ours(on)
    found = {**rivals(on), **mine}
    if case.search:
        found["paper_search"] = paper_with_search(on)
    return {
        "state": STATE,
        "group": case.group,
        "scene": case.scene,
        "told": case.told,
        "known_best": case.known_best,
        "work_limit": case.work,
        "cover_work_limit": case.cover_work,
        "candidates": problem.n_candidates,
        "excluded": int(on.pool.excluded.sum()),
        "rows": problem.n_rows,
        "entries": int(problem.row.size),
        "links": int(on.network.neighbour.size) // 2,
        "pool_cpu_s": cpu_s,
        "pool_wall_s": wall_s,
        "plan_memory_gib": memory_gib,
        "engine": f"{on.engine.name}: {on.engine.device}",
        "methods": {name: asdict(each) for name, each in found.items()},
    }


def judge(case: Case, row: dict[str, Any]) -> None:
    """Say in a row of the record what it breaks."""
    row["broken"] = broken_promises(case, {name: Found(**each) for name, each in row["methods"].items()})


def machine() -> str:
    """What all this ran on."""
    return (
        f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}, "
        f"HiGHS {version('highspy')}"
    )


def run(record: Path, only: Sequence[str], minutes: float) -> dict[str, Any]:
    """Work out the rows that are missing, and write each into the record."""
    begin = time.monotonic()
    known: dict[str, Any] = {"machine": machine(), "rows": {}}
    if record.exists():
        known = json.loads(record.read_text(encoding="utf-8"))
        for case in cases():
            if case.key in known["rows"]:
                judge(case, known["rows"][case.key])
    for case in cases():
        if is_done(case, known["rows"]) or (only and not any(text in case.key for text in only)):
            continue
        if time.monotonic() - begin > 60.0 * minutes:
            break
        row = measure(case)
        if row is None:
            print(f"{case.key}: not here, left out", flush=True)
            continue
        judge(case, row)
        known["rows"][case.key] = row
        record.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
        print(told(case.key, row), flush=True)
    return known


def is_done(case: Case, rows: dict[str, Any]) -> bool:
    """Whether the record has all that a row asks for."""
    return case.key in rows and (not case.search or "paper_search" in rows[case.key]["methods"])


def told(key: str, row: dict[str, Any]) -> str:
    """A row in one line."""
    sets = ", ".join(
        f"{name} {each['stations']}/{each['networks']}{'' if each['met'] else ' MISSED'} {each['cpu_s']:.2f} s"
        for name, each in row["methods"].items()
    )
    bounds = " ".join(f"{row['methods'][name]['bound']}" for name in ("cover", "joined"))
    broken = f"; BROKEN: {'; '.join(row['broken'])}" if row["broken"] else ""
    return f"{key}: {row['candidates']} candidates, pool {row['pool_cpu_s']:.1f} s; {sets}; bounds {bounds}{broken}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--record", type=Path, default=Path("docs/benchmarks/planning.json"))
    parser.add_argument("--write", type=Path, help="write the page here")
    parser.add_argument("--only", nargs="+", default=(), metavar="TEXT", help="rows whose name has one of these")
    parser.add_argument("--page-alone", action="store_true", help="work nothing out: the page from the record")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no row after so long")
    options = parser.parse_args()
    minutes = -1.0 if options.page_alone else options.minutes
    known = run(options.record, options.only, minutes)
    if options.write is not None:
        left = [case.key for case in cases() if not is_done(case, known["rows"])]
        options.write.write_text(page(known, left, state=STATE), encoding="utf-8")
    return 1 if any(row["broken"] for row in known["rows"].values()) else 0


if __name__ == "__main__":
    sys.exit(main())
