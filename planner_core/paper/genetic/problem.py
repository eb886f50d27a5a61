"""How large a problem genetic selection takes: weights are whole numbers, so that sums are exact."""

from __future__ import annotations

import numpy as np

from planner_core.errors import RequirementError
from planner_core.select.problem import CoverProblem

#: Keys of the objectives have to stay below this; see `planner_core.paper.genetic.objective`.
MAX_KEY = 2**62


def check_problem(problem: CoverProblem) -> None:
    """Refuse what has nothing to choose from, or weighs more than 63-bit keys can tell apart.

    Raises
    ------
    RequirementError
        No candidates, or too large a total.
    """
    n_candidates = problem.starts.size - 1
    if n_candidates < 1:
        raise RequirementError(
            "genetic selection: got no candidates, expected at least one; use a finer grid step or less clearance"
        )
    total = max(float(problem.ticks.sum(dtype=np.float64)), float(problem.required.sum(dtype=np.float64)))
    if (total + 1) * (n_candidates + 1) >= MAX_KEY:
        raise RequirementError(
            f"genetic selection: got {n_candidates} candidates and {total:.3g} ticks of surface in all, expected a "
            f"product below {MAX_KEY:.3g}; plan fewer floors at a time or use a coarser grid step"
        )
