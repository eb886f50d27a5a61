"""What a station set is worth, as one whole number: the greater the better, and comparable exactly.

With A the ticks covered, T those of all rows, n the active stations of N candidates, and M the sum over targets of what
is missing, max(0, required - covered):

    fewest               M = 0: (N - n) (T + 1) + A;  else -(M (N + 1) + n)    fewest stations, then most area;
                                                                               sets that miss a target come last
    coverage-at-most-n   n <= n_max: A (N + 1) + N - n;  else n_max - n        most area, then fewest stations
    eq9                  floor(2^s A / n)                                      López et al. 2023, Eq. 9

Weights are whole numbers, so that sums are exact: that limits how large a problem may be. A `Trajectory` is what a run
leaves behind, wherever it ran.

kernels/genetic_population.cl (`key_of`) is the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, Int64Array
from planner_core.model.methods import OBJECTIVES, GeneticSettings
from planner_core.progress import Progress, ProgressEvent
from planner_core.select.problem import CoverProblem

#: Bits that the quotient of Eq. 9 keeps behind the point, at most.
_MAX_SHIFT = 20
#: Keys of the objectives have to stay below this; see `planner_core.paper.genetic.objective`.
_MAX_KEY = 2**62
STALE = "no improvement"
EXHAUSTED = "iterations"


@dataclass(frozen=True)
class GeneticObjective:
    """An objective on one problem."""

    number: int
    """Index into `OBJECTIVES`."""
    n_candidates: int
    total: int
    n_stations: int
    shift: int

    def keys(self, covered: Int64Array, active: Int64Array, missing: Int64Array) -> Int64Array:
        """(n,) int64 keys of n individuals, from their ticks, active stations and missing ticks."""
        n = self.n_candidates
        if OBJECTIVES[self.number] == "eq9":
            return (covered << self.shift) // active
        if OBJECTIVES[self.number] == "coverage-at-most-n":
            return np.where(active <= self.n_stations, covered * (n + 1) + (n - active), self.n_stations - active)
        met = (n - active) * (self.total + 1) + covered
        return np.where(missing == 0, met, -(missing * (n + 1) + active))


def objective_of(problem: CoverProblem, settings: GeneticSettings) -> GeneticObjective:
    """The settings' objective on a problem that `check_problem` let through."""
    total = int(problem.ticks.sum())
    spare_bits = _MAX_KEY.bit_length() - 1 - total.bit_length()
    return GeneticObjective(
        number=OBJECTIVES.index(settings.objective),
        n_candidates=problem.starts.size - 1,
        total=total,
        n_stations=settings.n_stations,
        shift=max(0, min(_MAX_SHIFT, spare_bits)),
    )


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
    if (total + 1) * (n_candidates + 1) >= _MAX_KEY:
        raise RequirementError(
            f"genetic selection: got {n_candidates} candidates and {total:.3g} ticks of surface in all, expected a "
            f"product below {_MAX_KEY:.3g}; plan fewer floors at a time or use a coarser grid step"
        )


@dataclass(frozen=True)
class Trajectory:
    """How the best solution came about.

    best : (N,) bool, its chromosome. history : (iterations + 1, 3) int64: key, covered ticks and active stations of the
    best so far after every iteration, the start included. why_stopped : `STALE` or `EXHAUSTED`.
    """

    best: BoolArray
    history: Int64Array
    why_stopped: str


def note(progress: Progress, iteration: int, facts: Int64Array) -> None:
    """Report an iteration; how many there will be is not known before the last."""
    progress(ProgressEvent("genetic", iteration, 0, f"{int(facts[2])} stations"))
