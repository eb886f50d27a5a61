"""The directions in which a position is moved, in steps.

    cube, 14: 6 faces and 8 corners         sphere, n: even directions
    square, 8 (fixed height)                circle, n (fixed height)

       o   o   o                                 . o .
       o   x   o   the square, seen            o       o    the circle
       o   o   o   from above                  .   x   .
                                               o       o
                                                 . o .

Every direction has its opposite, so that a move can be undone (and refused as undoing).

References
----------
López et al. 2023, section 3.5.1 and Fig. 8. They call all 14 vectors of the cube unit vectors and say that positions
repeat "due to the constant step length". Both hold only of the faces: corners here have components of one step, so
that positions stay on a lattice of one step, which is what their optimised version lives on.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from planner_core.model import FloatArray
from planner_core.model.spatial_search import SearchSettings

_GOLDEN_ANGLE_RAD = np.pi * (3.0 - np.sqrt(5.0))


def directions(settings: SearchSettings) -> FloatArray:
    """(D, 3) float64, moves in steps; z is zero at fixed height. Direction D - 1 - d is the opposite of d."""
    if settings.neighbourhood == "cube":
        return square() if settings.fixed_height else cube()
    return circle(settings.n_directions) if settings.fixed_height else sphere(settings.n_directions)


def cube() -> FloatArray:
    """(14, 3): (1, 0, 0) and the like, (1, 1, 1) and the like."""
    return np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(v) in (1, 3)])


def square() -> FloatArray:
    """(8, 3): the eight neighbours of a cell in a plane."""
    return np.array([(x, y, 0.0) for x, y in product((-1.0, 0.0, 1.0), repeat=2) if x or y])


def circle(n: int) -> FloatArray:
    """(n, 3): unit vectors in the plane, evenly from +x, n even."""
    angle = np.arange(n // 2) * (2.0 * np.pi / n)
    return _with_opposites(np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n // 2)]))


def sphere(n: int) -> FloatArray:
    """(n, 3): unit vectors, n even: the upper half of a Fibonacci lattice and its opposites.

    Notes
    -----
    Point k of m = n / 2 has height 1 - (k + 1/2) / m, so that each stands for the same area (Archimedes), and the
    golden angle more azimuth than the one before. The usual lattice of the whole sphere has no opposite directions.
    """
    k = np.arange(n // 2)
    up = 1.0 - (k + 0.5) / (n // 2)
    level, angle = np.sqrt(1.0 - up**2), k * _GOLDEN_ANGLE_RAD
    return _with_opposites(np.column_stack([level * np.cos(angle), level * np.sin(angle), up]))


def _with_opposites(half: FloatArray) -> FloatArray:
    return np.concatenate([half, -half[::-1]])


def undoing(moves: FloatArray, slack: float) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """(D, D) bool: whether a move (column) undoes the last one (row): unit vectors' dot product < slack - 1."""
    unit = moves / np.linalg.norm(moves, axis=1)[:, None]
    return np.asarray(unit @ unit.T < slack - 1.0)
