"""What a station set is worth, as one whole number: the greater the better, and comparable exactly.

With A the ticks covered, T those of all rows, n the active stations of N candidates, and M the sum over targets of what
is missing, max(0, required - covered):

    fewest               M = 0: (N - n) (T + 1) + A;  else -(M (N + 1) + n)    fewest stations, then most area;
                                                                               sets that miss a target come last
    coverage-at-most-n   n <= n_max: A (N + 1) + N - n;  else n_max - n        most area, then fewest stations
    eq9                  floor(2^s A / n)                                      López et al. 2023, Eq. 9

kernels/genetic_population.cl (`key_of`) is the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import Int64Array
from planner_core.model.genetic import OBJECTIVES, GeneticSettings
from planner_core.paper.genetic.problem import MAX_KEY
from planner_core.select.problem import CoverProblem

#: Bits that the quotient of Eq. 9 keeps behind the point, at most.
_MAX_SHIFT = 20


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
    spare_bits = MAX_KEY.bit_length() - 1 - total.bit_length()
    return GeneticObjective(
        number=OBJECTIVES.index(settings.objective),
        n_candidates=problem.starts.size - 1,
        total=total,
        n_stations=settings.n_stations,
        shift=max(0, min(_MAX_SHIFT, spare_bits)),
    )
