"""F3 by circles: the share of one scan's circle, in plan, that those of others cover; surfaces and walls play no part.

Input plan positions and radii (metres), output m^2 or shares in [0, 1]. The figure on real surfaces is
`planner_core.network.links`; this one ranks positions that nobody has scanned from. docs/method/f3-overlap.md.

Of one circle and all others together there is no closed form where several overlap each other: occupancy is counted on
a grid.

          . . # # .       cells whose middle lies in the circle; # filled by another circle, . free.
        . . # # # # .     The paper fills a cell where a point sampled in another circle falls into it; we ask
        . . # # # # .     whether the cell's middle lies in another circle, which is that with endless points.
          . . # # .

References
----------
López et al. 2023, Eq. 3, section 3.3.2 and Fig. 6. As printed it takes circles that cut each other for granted; the
other cases are ours.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner_core.errors import RequirementError
from planner_core.model import FloatArray
from planner_core.paper.reference_distance import HALTON_BASES, radical_inverse

#: Cells across a circle: some 3200 in it, and shares to 0.3 %.
CELLS_ACROSS = 64


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


def shared_fraction(distance_m: ArrayLike, radius_i_m: ArrayLike, radius_j_m: ArrayLike) -> FloatArray:
    """F3 (Eq. 3): `shared_area_m2` over the area of circle i. Symmetric for equal radii only."""
    own = np.pi * np.asarray(radius_i_m, dtype=np.float64) ** 2
    share: FloatArray = shared_area_m2(distance_m, radius_i_m, radius_j_m) / own
    return share


class Cell(IntEnum):
    """What a cell of the grid is."""

    OUTSIDE = -1
    FREE = 0
    FILLED = 1


def occupancy_grid(
    middle_m: FloatArray,
    others_m: FloatArray,
    *,
    radius_m: float,
    cells_across: int = CELLS_ACROSS,
    n_points: int | None = None,
) -> NDArray[np.int8]:
    """Cells (c, c) of the square about one circle as `Cell`, rows along y, columns along x.

    Parameters
    ----------
    middle_m : (2,), of the circle. others_m : (K, 2), of the other circles.
    radius_m
        Of all circles.
    cells_across
        Cells along a diameter.
    n_points
        As in the paper: so many points, by the Halton sequence, are strewn over each other circle, and a cell is filled
        where one falls into it. None: a cell is filled where its middle lies in another circle.

    Raises
    ------
    RequirementError
        A radius that is not positive and finite, no cells, or no points.
    """
    _check(radius_m, cells_across, n_points)
    at = (np.arange(cells_across) + 0.5) * (2.0 / cells_across) - 1.0
    inside = at[None, :] ** 2 + at[:, None] ** 2 <= 1.0
    offsets = (np.asarray(others_m, dtype=np.float64).reshape(-1, 2) - middle_m) / radius_m
    near = offsets[(offsets**2).sum(axis=1) < 4.0]
    filled = np.zeros(inside.shape, dtype=np.bool_)
    for x, y in near:
        if n_points is None:
            filled |= (at[None, :] - x) ** 2 + (at[:, None] - y) ** 2 <= 1.0
        else:
            _strew(filled, disc_points(n_points) + np.array([x, y]))
    return np.where(inside, filled, Cell.OUTSIDE).astype(np.int8)


def disc_points(n: int) -> FloatArray:
    """(n, 2) float64, points of the unit disc by the Halton sequence: sqrt(u) from its middle, 2 pi v around it."""
    u, v = (radical_inverse(n, base) for base in HALTON_BASES)
    return np.stack([np.sqrt(u) * np.cos(2.0 * np.pi * v), np.sqrt(u) * np.sin(2.0 * np.pi * v)], axis=1)


def filled_share(grid: NDArray[np.int8]) -> float:
    """Filled cells over those inside the circle."""
    return float(np.count_nonzero(grid == Cell.FILLED) / np.count_nonzero(grid != Cell.OUTSIDE))


def _segment_m2(radius_m: FloatArray, to_chord_m: FloatArray) -> FloatArray:
    """Area of a circle beyond a chord at a signed distance from its middle."""
    share = np.clip(to_chord_m / radius_m, -1.0, 1.0)
    area: FloatArray = radius_m**2 * (np.arccos(share) - share * np.sqrt(1.0 - share * share))
    return area


def _strew(filled: NDArray[np.bool_], points: FloatArray) -> None:
    """Fill the cells that points (n, 2) fall into, in units of the radius."""
    n = len(filled)
    cell = np.floor((points + 1.0) * (n / 2.0)).astype(np.int64)
    cell = cell[((cell >= 0) & (cell < n)).all(axis=1)]
    filled[cell[:, 1], cell[:, 0]] = True


def _check(radius_m: float, cells_across: int, n_points: int | None) -> None:
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise RequirementError(
            f"radius_m: got {radius_m}, expected a positive range in metres; clamp an endless range to what counts"
        )
    if cells_across < 1:
        raise RequirementError(
            f"cells_across: got {cells_across}, expected at least 1; leave it out for {CELLS_ACROSS}"
        )
    if n_points is not None and n_points < 1:
        raise RequirementError(f"n_points: got {n_points}, expected at least 1; leave it out to test cells' middles")
