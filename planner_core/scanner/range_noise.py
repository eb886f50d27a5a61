"""Range noise: one sigma of a measured range, by range and reflectivity, as a scanner's data sheet tabulates it.

A scanner, ranges, reflectivities -> sigma in metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planner_core.model import FloatArray, Scanner


def range_noise_m(scanner: Scanner, range_m: ArrayLike, *, reflectivity: ArrayLike) -> FloatArray:
    """Range noise, linear between the figures of the scanner's table and NaN where these do not reach.

    Parameters
    ----------
    range_m
        Metres, any shape.
    reflectivity
        0 to 1 (a white wall is near 0.8, black paint near 0.1), of a shape that broadcasts with `range_m`.

    Returns
    -------
    FloatArray
        One sigma in metres, of the broadcast shape. NaN outside of the table: nearer or farther than its rows for that
        reflectivity, between two reflectivities of which one has no figure at this range, beyond the least and the
        greatest reflectivity, and everywhere where the scanner has no table. We do not extrapolate.
    """
    ranges, wanted = np.broadcast_arrays(np.asarray(range_m, dtype=np.float64), np.asarray(reflectivity, np.float64))
    if not scanner.range_noise:
        return np.full(ranges.shape, np.nan)
    table = np.array(scanner.range_noise, dtype=np.float64)
    known = np.unique(table[:, 1])
    sigma = np.stack([_at_range(table[table[:, 1] == one], ranges) for one in known])
    below = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, known.size - 1)
    above = np.minimum(below + 1, known.size - 1)
    gap = known[above] - known[below]
    share = np.divide(wanted - known[below], gap, out=np.zeros(ranges.shape), where=gap > 0)
    low = np.take_along_axis(sigma, below[None], axis=0)[0]
    high = np.take_along_axis(sigma, above[None], axis=0)[0]
    # At a tabulated reflectivity the next one does not matter, and it may have no figure at this range.
    between = np.where(share == 0, low, low + share * (high - low))
    inside = (wanted >= known[0]) & (wanted <= known[-1])
    result: FloatArray = np.where(inside, between, np.nan)
    return result


def _at_range(rows: FloatArray, range_m: FloatArray) -> FloatArray:
    """Rows of one reflectivity, by range -> sigma at `range_m`, NaN outside of them."""
    found: FloatArray = np.interp(range_m, rows[:, 0], rows[:, 2], left=np.nan, right=np.nan)
    return found
