"""The solvers that the library's page compares, each as it comes: an instance in, a plan and a bound out.

    greedy         one station after the other                                          planner_core.select.greedy
    greedy-links   the same, joined by shortest ways where links matter                 planner_core.select
    paper          genetic selection of López et al. 2023, Table 3, and its repair      planner_core.paper
    highs          HiGHS' MIP on the model of `mip_model`
    cp-sat         OR-Tools' CP-SAT on the same in its own terms; an optional package
    large          what method `proven` does where problems are too large to prove      planner_core.select.large
    proven         method `proven`                                                      planner_core.select

Time is CPU time of the process, all threads together; so is the limit of the two general solvers: a watcher stops them.
Ours stops by its count of work. The general models: y_r is 1 where row r counts; of constraint k

    sum of ticks_r y_r >= required_k      y_r m_k <= sum of x_i over those who see r

and, where links matter, one root: a flow of one unit to every other station runs over links of stations (`highs`), or
every station but the root has a linked one of a lower level (`cp-sat`).
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError, PlannerError
from planner_core.model import FloatArray, Proven
from planner_core.model.methods import GeneticSettings
from planner_core.paper.genetic import select_genetic
from planner_core.paper.overlap_repair import repair_overlap
from planner_core.select.greedy import drop_redundant, select_greedy
from planner_core.select.large import select_large
from planner_core.select.network import connect
from planner_core.select.proven import select

from .cp_sat import NO_ORTOOLS
from .instance import Instance
from .stop_watch import stopped_after

#: Run on large instances alone: it is not made for others.
LARGE = "large"
#: What the paper's repair asks of circles of the scanner's range.
_REPAIR_OVERLAP = 0.3


@dataclass(frozen=True)
class Outcome:
    """chosen : the plan, empty: none. bound : proven to be the least, 0: none. valid : it meets everything."""

    chosen: tuple[int, ...]
    bound: int
    valid: bool
    cpu_s: float
    ended: str


def solve(name: str, instance: Instance, *, limit_s: float, work: float) -> Outcome:
    """Run one solver, within so much CPU time or, ours, so much work."""
    _ = instance.problem, instance.network  # made before the clock runs
    began = time.process_time()
    chosen, bound, ended, *elsewhere_s = SOLVERS[name](instance, limit_s, work)
    cpu_s = elsewhere_s[0] if elsewhere_s else time.process_time() - began
    return Outcome(tuple(chosen), bound, bool(chosen) and instance.is_solved_by(chosen), cpu_s, ended)


# ---------------------------------------------------------------------------------------------------- ours
#: Plan, bound, why it ended; and CPU time where that was another process's.
Found = tuple[list[int], int, str] | tuple[list[int], int, str, float]


def _greedy(instance: Instance, limit_s: float, work: float) -> Found:
    return list(select_greedy(instance.problem).chosen), 0, "done"


def _greedy_links(instance: Instance, limit_s: float, work: float) -> Found:
    chosen = list(select_greedy(instance.problem).chosen)
    if instance.network is not None:
        whole = connect(instance.problem, instance.network, chosen)
        chosen = drop_redundant(instance.problem, whole, network=instance.network)
    return chosen, 0, "done"


def _paper(instance: Instance, limit_s: float, work: float) -> Found:
    found = select_genetic(instance.problem, GeneticSettings())
    chosen = [int(i) for i in found.chosen]
    if instance.links is not None:
        places = instance.candidates_cm / 100.0
        left = np.setdiff1d(np.arange(instance.n_candidates), chosen)
        more = repair_overlap(
            places[chosen], places[left], radius_m=instance.about["range_cm"] / 100.0, required=_REPAIR_OVERLAP
        )
        chosen += [int(i) for i in left[more.added]]
    return chosen, 0, found.why_stopped


def _large(instance: Instance, limit_s: float, work: float) -> Found:
    found = select_large(instance.problem, Proven(work_limit=work), network=instance.network)
    return [int(i) for i in found.chosen], found.lower_bound, found.why_stopped


def _proven(instance: Instance, limit_s: float, work: float) -> Found:
    found = select(instance.problem, Proven(work_limit=work), network=instance.network)
    return [int(i) for i in found.chosen], found.lower_bound, found.why_stopped


# ------------------------------------------------------------------------------------------ general solvers
class _Rows:
    """Rows of a linear program as they come."""

    def __init__(self) -> None:
        self.low: list[float] = []
        self.high: list[float] = []
        self.starts: list[int] = [0]
        self.column: list[int] = []
        self.value: list[float] = []

    def add(self, low: float, high: float, column: Any, value: Any) -> None:
        self.low.append(low)
        self.high.append(high)
        self.column += list(column)
        self.value += list(value)
        self.starts.append(len(self.column))


@dataclass(frozen=True)
class MipModel:
    """Columns x (N), y, and where links matter roots (N) and flows: their bounds, which are whole, and rows."""

    upper: FloatArray
    whole: np.ndarray[tuple[int], np.dtype[np.bool_]]
    rows: _Rows


def mip_model(instance: Instance) -> MipModel:
    """The least number of stations as a mixed-integer program."""
    problem, n = instance.problem, instance.n_candidates
    rows, upper, whole = _Rows(), [1.0] * n, [True] * n
    columns: dict[tuple[int, int], int] = {}
    seers = [np.flatnonzero(column) for column in instance.sees.T]
    for need in instance.needs:
        at = np.flatnonzero(need.rows)
        for r in at.tolist():
            if (r, need.seen_from) not in columns:
                y = columns[r, need.seen_from] = len(upper)
                upper.append(1.0)
                whole.append(need.seen_from > 1)
                m = float(need.seen_from)
                rows.add(0.0, math.inf, [*seers[r], y], [*np.ones(seers[r].size), -m])
        ticks = problem.ticks[at].astype(np.float64)
        rows.add(float(need.required), math.inf, [columns[r, need.seen_from] for r in at.tolist()], ticks)
    if instance.links is not None:
        root, flow = len(upper), len(upper) + n
        ends = np.argwhere(instance.links)
        upper += [1.0] * n + [float(n)] * len(ends)
        whole += [True] * n + [False] * len(ends)
        rows.add(1.0, 1.0, range(root, root + n), np.ones(n))
        for i in range(n):
            rows.add(0.0, math.inf, [i, root + i], [1.0, -1.0])
            into, out = np.flatnonzero(ends[:, 1] == i), np.flatnonzero(ends[:, 0] == i)
            # What comes in and is not passed on is one unit, but for the root, which sends as much as is needed.
            rows.add(
                0.0,
                math.inf,
                [*(flow + into), *(flow + out), i, root + i],
                [*np.ones(into.size), *-np.ones(out.size), -1.0, float(n)],
            )
            rows.add(-math.inf, 0.0, [*(flow + into), i], [*np.ones(into.size), -float(n)])
    return MipModel(np.array(upper), np.array(whole), rows)


def _highs(instance: Instance, limit_s: float, work: float) -> Found:
    import highspy

    model = mip_model(instance)
    n, size = instance.n_candidates, model.upper.size
    solver: Any = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)
    # The objective counts whole stations: a gap below one is none.
    solver.setOptionValue("mip_rel_gap", 0.0)
    solver.setOptionValue("mip_abs_gap", 0.999)
    none = np.zeros(0, dtype=np.int32)
    cost = np.where(np.arange(size) < n, 1.0, 0.0)
    solver.addCols(size, cost, np.zeros(size), model.upper, 0, none, none, np.zeros(0))
    rows = model.rows
    infinite = highspy.kHighsInf
    low, high = (np.clip(np.array(side), -infinite, infinite) for side in (rows.low, rows.high))
    starts, column = (np.array(values, dtype=np.int32) for values in (rows.starts[:-1], rows.column))
    solver.addRows(len(low), low, high, column.size, starts, column, np.array(rows.value))
    kind = [highspy.HighsVarType.kInteger if w else highspy.HighsVarType.kContinuous for w in model.whole]
    solver.changeColsIntegrality(size, np.arange(size, dtype=np.int32), np.array(kind))
    solver.HandleUserInterrupt = True
    with stopped_after(limit_s, solver.cancelSolve):
        solver.solve()
    info = solver.getInfo()
    optimal = solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    chosen = []
    if info.primal_solution_status == 2:
        chosen = np.flatnonzero(np.array(solver.getSolution().col_value[:n]) > 0.5).tolist()
    bound = info.mip_dual_bound
    return chosen, rounded_up(bound) if math.isfinite(bound) else 0, "proven" if optimal else "time limit"


def _cp_sat(instance: Instance, limit_s: float, work: float) -> Found:
    """In a process of its own: OR-Tools brings another HiGHS, and one process cannot hold both."""
    command = [sys.executable, "-m", "tlsplib.cp_sat", str(limit_s)]
    done = subprocess.run(command, input=instance.raw, capture_output=True, check=False)
    if done.returncode == NO_ORTOOLS:
        raise MissingPackageError(
            "OR-Tools is missing: got no module ortools, expected it for cp-sat; install requirements/tlsplib.lock, or "
            "leave that solver out"
        )
    if done.returncode:
        raise PlannerError(f"cp-sat: got exit code {done.returncode}: {done.stderr.decode(errors='replace')[-300:]}")
    result = json.loads(done.stdout)
    return result["chosen"], rounded_up(result["bound"]), result["ended"], result["cpu_s"]


def rounded_up(bound: float) -> int:
    """Whole stations that a bound of floating-point numbers amounts to."""
    return math.ceil(bound - 1e-6)


SOLVERS: dict[str, Callable[[Instance, float, float], Found]] = {
    "greedy": _greedy,
    "greedy-links": _greedy_links,
    "paper": _paper,
    "highs": _highs,
    "cp-sat": _cp_sat,
    LARGE: _large,
    "proven": _proven,
}
