"""Range noise: one sigma of a measured range, by range and reflectivity, as a scanner's data sheet tabulates it.

`range_noise` of a scanner file -> rows of `Scanner.range_noise`; a scanner, ranges, reflectivities -> sigma in metres.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planner_core.model import FloatArray, Scanner
from planner_core.scanner.fields import bad, check_keys, measure, shown

_MAX_ROWS = 1000
_MAX_RANGE_M = 100_000.0
#: A metre of noise is a mistake of units.
_MAX_SIGMA_MM = 1000.0


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


def read_range_noise(value: Any, where: str) -> tuple[tuple[float, float, float], ...]:
    """Read the entry `range_noise` of a scanner file: rows of range_m, reflectivity and sigma_mm, in any order."""
    if not isinstance(value, list) or len(value) > _MAX_ROWS:
        raise bad(where, f"range_noise = {shown(value)}", f"a list of at most {_MAX_ROWS} rows")
    rows = sorted(_row(item, f"range_noise row {k}", where) for k, item in enumerate(value, 1))
    for (one, range_m, _), (other, same_m, _) in pairwise(rows):
        if (one, range_m) == (other, same_m):
            raise bad(where, f"range_noise twice at {range_m:g} m and reflectivity {one:g}", "one figure for each")
    return tuple((range_m, reflectivity, sigma_m) for reflectivity, range_m, sigma_m in rows)


def _row(value: Any, what: str, where: str) -> tuple[float, float, float]:
    """Reflectivity, range in metres and sigma in metres: the order to sort by."""
    spec = check_keys(value, what, where, needed={"range_m", "reflectivity", "sigma_mm"})
    range_m = measure(spec["range_m"], f"{what}: range_m", where, above=0.0, most=_MAX_RANGE_M)
    reflectivity = measure(spec["reflectivity"], f"{what}: reflectivity", where, above=0.0, most=1.0)
    sigma_mm = measure(spec["sigma_mm"], f"{what}: sigma_mm", where, above=0.0, most=_MAX_SIGMA_MM)
    return reflectivity, range_m, sigma_mm / 1000.0
