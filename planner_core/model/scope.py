"""What of the building a survey is about: its inside, its outside, or all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model.arrays import BoolArray, FloatArray
from planner_core.model.choices import Scope

#: Positions farther than this from all walkable ground are neither indoors nor outdoors.
_NEAR_M = 1.0
#: Heights count twice: the ground of the storey above is not the nearest.
_HEIGHT_WEIGHT = 2.0


@dataclass(frozen=True)
class SurveyScope:
    """Which patches may count, and where stations may stand.

    kind : what was found, never `auto`. in_scope : (P,) bool, patches of that kind, but for those of which nothing is
    required: nobody looks at others. ground_m : (K, 3) float64, local,
    walkable places; indoors : (K,) bool, whether each is indoors; both empty where all is in scope.
    """

    kind: Scope
    in_scope: BoolArray
    ground_m: FloatArray
    indoors: BoolArray

    def admits(self, ground_m: FloatArray) -> BoolArray:
        """(N,) bool: whether stations over ground (N, 3), local frame, are on the side that is surveyed."""
        if self.kind == Scope.ALL:
            return np.ones(ground_m.shape[0], dtype=np.bool_)
        from scipy.spatial import cKDTree

        weight = np.array([1.0, 1.0, _HEIGHT_WEIGHT])
        tree = cKDTree(self.ground_m * weight)
        _, nearest = tree.query(ground_m * weight, distance_upper_bound=_NEAR_M)
        found = nearest < self.ground_m.shape[0]
        out = np.zeros(ground_m.shape[0], dtype=np.bool_)
        out[found] = self.indoors[nearest[found]] == (self.kind == Scope.INTERIOR)
        return out
