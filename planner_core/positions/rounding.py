"""Places as files have them: rounded before anything is seen from them, so that plans read back are the same plans.

Input places in the local frame, metres; output the same places with as many digits as plan.json keeps, or fewer. The
local frame is whole metres off the scene frame, so that a place has as many digits in the one as in the other.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner_core.model import FloatArray

#: Digits of metres that plan.json keeps of places and heights: micrometres.
WRITTEN_DIGITS = 6
#: Digits of places that are chosen freely, off the grid: nobody sets up a tripod to less than 0.1 mm, and
#: stations.csv has no more either.
SET_UP_DIGITS = 4


def as_written_m(value_m: FloatArray, digits: int = WRITTEN_DIGITS) -> FloatArray:
    """Round metres of any shape; what is rounded stays as it is, bit by bit."""
    rounded: FloatArray = np.round(value_m, digits) + 0.0  # + 0.0 turns -0.0 into 0.0
    return rounded


def local_of_written_m(scene_m: Iterable[float], offset_m: FloatArray) -> FloatArray:
    """(3,) float64, local frame: a place (3,) of the scene frame, as a plan or a review has it.

    Far from the origin a sum with the offset loses its last bits; rounding brings back those that were written.
    """
    return as_written_m(np.array(list(scene_m), dtype=np.float64) - offset_m)
