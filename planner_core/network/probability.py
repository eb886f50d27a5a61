"""Probability that two scans register, of what is known before anybody scans.

Input pairs' overlap, the area that holds their weakest shift (m^2), the range of what they have in common (m) and where
registration starts; output probabilities in [0, 1].

A logistic rule, made of the campaign of docs/benchmarks/registration.md, which has its derivation and how well it does
on scenes that it has not seen; a test makes it anew from the campaign's rows. Registered: by point-to-plane ICP with
normals compared, within 10 mm and 0.1 degrees.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np

from planner_core.model import FloatArray, PreAlignment

#: Of a constant and the three figures of `link_figures`, by where registration starts.
WEIGHTS: Final = MappingProxyType(
    {
        PreAlignment.TRACKED: (8.66, 1.82, 0.91, -1.73),
        PreAlignment.MANUAL: (7.74, 1.58, 1.13, -1.93),
        PreAlignment.LEVEL: (-0.71, 0.85, 0.76, -1.61),
        PreAlignment.NONE: (-1.35, 0.74, 1.00, -1.74),
    }
)
_LEAST_SHARE, _LEAST_HOLD_M2, _LEAST_RANGE_M = 1e-3, 0.01, 0.1


def link_figures(share: FloatArray, hold_m2: FloatArray, range_m: FloatArray) -> FloatArray:
    """(K, 3) what the rule takes of pairs.

    share : (K,) overlap, the smaller of both shares. hold_m2 : (K,) smallest eigenvalue of sum a n n' over the common
    surface. range_m : (K,) its root mean square range, from the station for which it is more.
    """
    share = np.clip(share, _LEAST_SHARE, 1.0 - _LEAST_SHARE)
    hold_m2, range_m = np.maximum(hold_m2, _LEAST_HOLD_M2), np.maximum(range_m, _LEAST_RANGE_M)
    return np.column_stack([np.log(share / (1.0 - share)), np.log(hold_m2), np.log(range_m)])


def probabilities(share: FloatArray, hold_m2: FloatArray, range_m: FloatArray, start: PreAlignment) -> FloatArray:
    """(K,) probability that each pair registers from `start`; figures as in `link_figures`."""
    constant, *weight = WEIGHTS[start]
    x = link_figures(share, hold_m2, range_m)
    # Summed one by one: a matrix product's order of sums may depend on the number of pairs.
    odds = constant + weight[0] * x[:, 0] + weight[1] * x[:, 1] + weight[2] * x[:, 2]
    return np.asarray(1.0 / (1.0 + np.exp(-odds)))
