"""Landscapes whose every value is known, computed by additions, multiplications and whole numbers alone.

Those round the same way in batches of any size, so that trajectories can be compared bit by bit.
"""

from collections.abc import Callable

import numpy as np
import pytest


class Terrain:
    """A `Fitness` from functions of positions (N, 3), that remembers what it was asked."""

    def __init__(
        self,
        f2: Callable[[np.ndarray], np.ndarray],
        *,
        f1: Callable[[np.ndarray], np.ndarray] | None = None,
        valid: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> None:
        self.f2, self.f1, self.valid = f2, f1, valid
        self.asked: list[np.ndarray] = []

    def evaluate(self, positions_m):
        self.asked.append(positions_m.copy())
        n = len(positions_m)
        valid = np.ones(n, dtype=bool) if self.valid is None else self.valid(positions_m)
        f1 = np.zeros(n, dtype=np.int64) if self.f1 is None else self.f1(positions_m)
        f2 = np.asarray(self.f2(positions_m), dtype=float)
        return valid, np.where(valid, f1, 10**6), np.where(valid, f2, -1e9)  # tempting, but not valid


def bowl(centre, *, per_m2: float = 1000.0):
    """F2 that grows with the square of the distance from `centre`."""
    return lambda p: per_m2 * ((p - np.array(centre)) ** 2).sum(axis=1)


def hashed(p: np.ndarray, n: int, *, per_m: float = 80.0) -> np.ndarray:
    """Whole numbers in [0, n), as good as random, by cells of 1 / per_m."""
    q = np.rint(p * per_m).astype(np.int64)
    mixed = q[:, 0] * 73856093 ^ q[:, 1] * 19349663 ^ q[:, 2] * 83492791
    return (mixed ^ mixed >> 13) % n


def rugged(centre) -> Terrain:
    """A bowl with many pits and ties, and holes where nothing is valid."""
    return Terrain(
        lambda p: np.floor(bowl(centre, per_m2=40.0)(p)) + hashed(p, 7),
        f1=lambda p: hashed(p + 5.0, 3),
        valid=lambda p: hashed(p - 3.0, 10) > 0,
    )


@pytest.fixture(scope="session")
def make_terrain():
    return Terrain


@pytest.fixture(scope="session")
def make_bowl():
    return bowl


@pytest.fixture(scope="session")
def make_rugged():
    return rugged
