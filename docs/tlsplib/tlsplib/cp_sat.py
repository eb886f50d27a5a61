"""OR-Tools' CP-SAT on an instance, as a program of its own: it reads an instance's text and writes what it found.

    python -m tlsplib.cp_sat CPU_SECONDS < INSTANCE.json

OR-Tools brings its own HiGHS, whose symbols clash with those of highspy: no process can hold both, and nothing that is
imported here may import highspy.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

from .instance import Instance, from_raw
from .stop_watch import stopped_after

#: Searches of CP-SAT beside each other: its usual portfolio. With two it often has no bound at all.
WORKERS = 8
#: Exit code where OR-Tools is not installed.
NO_ORTOOLS = 6


def main() -> int:
    """Solve what comes in; the answer is JSON."""
    try:
        from ortools.sat.python import cp_model
    except ImportError as error:
        sys.stderr.write(f"{error}\n")
        return NO_ORTOOLS
    instance = from_raw(sys.stdin.buffer.read())
    began = time.process_time()
    model, x = model_of(cp_model, instance)
    solver: Any = cp_model.CpSolver()
    solver.parameters.num_workers = WORKERS
    with stopped_after(float(sys.argv[1]), solver.stop_search):
        status = solver.solve(model)
    found = status in (cp_model.OPTIMAL, cp_model.FEASIBLE)
    result = {
        "chosen": [i for i, variable in enumerate(x) if found and solver.boolean_value(variable)],
        "bound": max(0.0, solver.best_objective_bound),
        "ended": "proven" if status == cp_model.OPTIMAL else "time limit",
        "cpu_s": time.process_time() - began,
    }
    sys.stdout.write(json.dumps(result))
    return 0


def model_of(cp_model: Any, instance: Instance) -> tuple[Any, list[Any]]:
    """The model in CP-SAT's own terms, and its variables of stations."""
    model = cp_model.CpModel()
    n, ticks = instance.n_candidates, instance.ticks.tolist()
    x = [model.new_bool_var("") for _ in range(n)]
    counts: dict[tuple[int, int], Any] = {}
    for need in instance.needs:
        at = np.flatnonzero(need.rows).tolist()
        for r in at:
            if (r, need.seen_from) not in counts:
                y = counts[r, need.seen_from] = model.new_bool_var("")
                seers = [x[i] for i in np.flatnonzero(instance.sees[:, r])]
                if need.seen_from == 1:
                    model.add_bool_or(seers).only_enforce_if(y)
                else:
                    model.add(sum(seers) >= need.seen_from).only_enforce_if(y)
        model.add(sum(ticks[r] * counts[r, need.seen_from] for r in at) >= need.required)
    if instance.links is not None:
        _join(model, np.argwhere(instance.links).tolist(), x)
    model.minimize(sum(x))
    return model, x


def _join(model: Any, links: list[list[int]], x: list[Any]) -> None:
    """Every station but one root has a linked station of a lower level before it."""
    n = len(x)
    root, level = [model.new_bool_var("") for _ in x], [model.new_int_var(0, n - 1, "") for _ in x]
    before: list[list[Any]] = [[] for _ in x]
    for i, j in links:
        arc = model.new_bool_var("")
        model.add_implication(arc, x[i])
        model.add(level[j] >= level[i] + 1).only_enforce_if(arc)
        before[j].append(arc)
    for j in range(n):
        model.add_exactly_one([*before[j], root[j], x[j].negated()])
    model.add_exactly_one(root)


if __name__ == "__main__":
    sys.exit(main())
