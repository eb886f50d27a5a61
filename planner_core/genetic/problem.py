"""What genetic selection is about: which rows of surface every candidate covers, what they weigh, what is required.

`planner_core.select.problem.CoverProblem` is one of these. Weights are whole numbers, so that sums are exact.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Int64Array

#: Keys of the objectives have to stay below this; see `planner_core.genetic.objective`.
MAX_KEY = 2**62


class CoverRows(Protocol):
    """Rows (patches that the same candidates see) with their weights, and targets on them.

    Attributes are those of `CoverProblem`, int64 unless said otherwise; a candidate has each of its rows once.
    """

    @property
    def starts(self) -> Int64Array:
        """(N + 1,) where each candidate's rows begin in `row`."""

    @property
    def row(self) -> Int64Array:
        """(starts[-1],) rows that candidates cover."""

    @property
    def ticks(self) -> Int64Array:
        """(R,) weight of each row, 0 or more."""

    @property
    def counts_for(self) -> BoolArray:
        """(K, R) bool, rows that each target counts."""

    @property
    def required(self) -> Int64Array:
        """(K,) ticks that meet each target."""


def check_problem(problem: CoverRows) -> None:
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
