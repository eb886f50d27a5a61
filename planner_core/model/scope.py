"""What of the building a survey is about: its inside, its outside, or all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model.arrays import BoolArray, FloatArray, Int64Array
from planner_core.model.choices import Scope

#: Positions farther than this from all walkable ground are neither indoors nor outdoors.
_NEAR_M = 1.0
#: Heights count twice: the ground of the storey above is not the nearest.
_HEIGHT_WEIGHT = 2.0


@dataclass(frozen=True)
class SurveyScope:
    """Which patches may count, and where stations may stand.

    kind : what was found, never `auto`. in_scope : (P,) bool, patches of that kind, but for those of which nothing is
    required. observed : (P,) bool, those that anybody looks at: in scope, and outdoors where stations of the interior
    may stand there to join it, which is `outdoors_m` from rooms at most; 0: they may not. ground_m : (K, 3) float64,
    local, walkable places; indoors : (K,) bool, whether each is indoors; both empty where all is in scope.
    """

    kind: Scope
    in_scope: BoolArray
    observed: BoolArray
    ground_m: FloatArray
    indoors: BoolArray
    outdoors_m: float = 0.0

    def surveys(self, ground_m: FloatArray) -> BoolArray:
        """(N,) bool: whether ground (N, 3), local frame, is on the side that is surveyed."""
        if self.kind == Scope.ALL:
            return np.ones(ground_m.shape[0], dtype=np.bool_)
        is_there, nearest = self._near(ground_m, self.ground_m, _NEAR_M)
        is_there[is_there] = self.indoors[nearest[is_there]] == (self.kind == Scope.INTERIOR)
        return is_there

    def admits(self, ground_m: FloatArray) -> BoolArray:
        """(N,) bool: whether stations may stand over ground (N, 3), local frame."""
        admitted = self.surveys(ground_m)
        if self.outdoors_m:
            is_ground, _ = self._near(ground_m, self.ground_m, _NEAR_M)
            is_beside, _ = self._near(ground_m, self.ground_m[self.indoors], self.outdoors_m)
            admitted |= is_ground & is_beside
        return admitted

    @staticmethod
    def _near(ground_m: FloatArray, places_m: FloatArray, within_m: float) -> tuple[BoolArray, Int64Array]:
        """(N,) whether one of places (K, 3) is near, and the nearest."""
        from scipy.spatial import cKDTree

        weight = np.array([1.0, 1.0, _HEIGHT_WEIGHT])
        _, nearest = cKDTree(places_m * weight).query(ground_m * weight, distance_upper_bound=within_m)
        return nearest < places_m.shape[0], nearest
