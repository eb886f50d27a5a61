"""F3 by circles: the share of one scan's circle, in plan, that another scan's covers; surfaces and walls play no part.

Input plan positions and radii (metres), output m^2 or shares in [0, 1]. The figure on real surfaces is
`planner_core.network.links`; this one ranks positions that nobody has scanned from. docs/method/f3-overlap.md.

References
----------
López et al. 2023, Eq. 3. As printed it takes circles that cut each other for granted; the other cases are ours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planner_core.model import FloatArray


def shared_area_m2(distance_m: ArrayLike, radius_i_m: ArrayLike, radius_j_m: ArrayLike) -> FloatArray:
    """Area that two circles share, float64; arguments broadcast.

    Parameters
    ----------
    distance_m
        Between the middles, at least 0.
    radius_i_m, radius_j_m
        Positive.

    Notes
    -----
    Eq. 3 with d_i = (d^2 + r_i^2 - r_j^2) / 2 d and d_j = d - d_i, both signed: the chord may lie beyond a middle.
    Apart (d >= r_i + r_j): 0. One in the other (d <= |r_i - r_j|, d = 0 among them): the smaller circle; there the arc
    cosine of Eq. 3 has no value, and d_i none for d = 0. For r_i = r_j, d_i = d_j = d / 2: the printed short form.
    """
    d, r, s = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (distance_m, radius_i_m, radius_j_m)))
    cut = (d < r + s) & (d > np.abs(r - s))
    d_i = (d * d + r * r - s * s) / (2.0 * np.where(cut, d, 1.0))
    lens = _segment_m2(r, d_i) + _segment_m2(s, d - d_i)
    smaller = np.pi * np.minimum(r, s) ** 2
    area: FloatArray = np.where(cut, lens, np.where(d < r + s, smaller, 0.0))
    return area


def _segment_m2(radius_m: FloatArray, to_chord_m: FloatArray) -> FloatArray:
    """Area of a circle beyond a chord at a signed distance from its middle."""
    share = np.clip(to_chord_m / radius_m, -1.0, 1.0)
    area: FloatArray = radius_m**2 * (np.arccos(share) - share * np.sqrt(1.0 - share * share))
    return area


def shared_fraction(distance_m: ArrayLike, radius_i_m: ArrayLike, radius_j_m: ArrayLike) -> FloatArray:
    """F3 (Eq. 3): `shared_area_m2` over the area of circle i. Symmetric for equal radii only."""
    own = np.pi * np.asarray(radius_i_m, dtype=np.float64) ** 2
    share: FloatArray = shared_area_m2(distance_m, radius_i_m, radius_j_m) / own
    return share
