"""What a search on one floor of a real scene is guided by: whether a tripod can stand at a position, and its F1 and F2.

Local frame, metres. Validity comes first; only what is valid is scanned.

References
----------
López et al. 2023, sections 3.4 (validity) and 3.5 (F2 guides the search).
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, InstrumentHeights, Int64Array
from planner_core.paper.initialisation import stands_by_published_tests
from planner_core.paper.point_distribution import PointDistribution
from planner_core.positions.admissibility import MAX_STEP_M, Tripods

#: Heights of grids are sums of steps: the last one may exceed the limit by rounding.
_HEIGHT_SLACK_M = 1e-6


class StationFitness:
    """The `Fitness` of positions on `survey.floors[floor]`.

    Parameters
    ----------
    distribution
        F1 and F2 of positions of this scene.
    published_tests
        Whether the paper's three tests decide what is valid, instead of ours.

    Attributes
    ----------
    bounds_m : (2, 3) float64: the floor's bounds, and the heights a sensor may have above its ground.
    height_limits_m : least and greatest height above the ground below. One given height allows what feet may differ by,
    since agents of fixed height keep their level, not their height, where the ground rises a little.
    n_scans : positions scanned so far.
    """

    def __init__(
        self, tripods: Tripods, distribution: PointDistribution, *, floor: int, published_tests: bool = False
    ) -> None:
        self._tripods, self._floor = tripods, floor
        self._distribution, self._published_tests = distribution, published_tests
        self._ground = tripods.ground(floor)
        self.height_limits_m = low, high = height_limits_m(tripods.heights)
        levels_m = [self._ground.low_m + low, self._ground.high_m + high]
        self.bounds_m: FloatArray = np.column_stack([tripods.survey.floors[floor].bounds_m, levels_m])
        self.n_scans = 0

    def evaluate(self, positions_m: FloatArray) -> tuple[BoolArray, Int64Array, FloatArray]:
        """See `planner_core.paper.search.landscape.Fitness`: F1 and F2, in m^2, of positions (N, 3)."""
        valid = self.is_valid(positions_m)
        f1, f2_m2 = np.zeros(valid.size, dtype=np.int64), np.full(valid.size, np.inf)
        if valid.any():
            found = self._distribution.of(self._tripods.survey.template, positions_m[valid])
            f1[valid], f2_m2[valid] = found.n_patches, found.f2_m2
            self.n_scans += int(np.count_nonzero(valid))
        return valid, f1, f2_m2

    def is_valid(self, positions_m: FloatArray) -> BoolArray:
        """(N,) bool: over ground of this floor, at a height the scanner may have, and a tripod can stand there."""
        ground_m = self._ground.below(positions_m)
        with np.errstate(invalid="ignore"):  # NaN where there is no ground
            height_m = positions_m[:, 2] - ground_m
            low, high = self.height_limits_m
            valid = (height_m >= low - _HEIGHT_SLACK_M) & (height_m <= high + _HEIGHT_SLACK_M)
        left = np.flatnonzero(valid)
        valid[left] = self._stands(positions_m[left], ground_m[left])
        return valid

    def _stands(self, positions_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        if self._published_tests:
            return stands_by_published_tests(self._tripods, self._floor, positions_m)
        return self._tripods.tests(self._floor).reject(positions_m, ground_m)[0]


def height_limits_m(heights: InstrumentHeights) -> tuple[float, float]:
    """Least and greatest instrument height: of those given, or the scanner's range."""
    if not heights.fixed_m:
        return heights.low_m, heights.high_m
    low, high = heights.fixed_m[0], heights.fixed_m[-1]
    return (low, high) if low < high else (low - MAX_STEP_M, high + MAX_STEP_M)
