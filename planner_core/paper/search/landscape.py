"""The landscape that a search walks on: F1 and F2 of positions, from a `Fitness` or remembered by lattice cell.

Positions are kept in lattice coordinates, `position_m = lattice_origin_m + cell_m * at`, because sums of steps round:
after a thousand of them a position would be no multiple of the step any more, and a remembered cell another one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.model.spatial_search import SearchSettings

#: A coordinate this near to a whole number of cells is one: 0.5 / 0.05 and the like are not exact.
_WHOLE = 1e-6
#: Positions on the bounds lie inside, whatever the rounding of the sums that lead there.
_OUTSIDE_M = 1e-6
#: Cells a coordinate may have either way: three of 21 bits make one key of 63.
_REACH = 2**20


class Fitness(Protocol):
    """What positions are worth. A position's values depend on nothing but it: not on the others of a batch."""

    def evaluate(self, positions_m: FloatArray) -> tuple[BoolArray, Int64Array, FloatArray]:
        """Judge positions (N, 3), local frame.

        Returns
        -------
        valid (N,) bool: whether a tripod can stand there; f1 (N,) int64: patches reached; f2 (N,) float64, to be
        minimised. f1 and f2 of positions that are not valid are ignored, so that they need not be computed.
        """
        ...


@dataclass(frozen=True)
class Worth:
    """Of N positions: f1 (N,) int64, f2 (N,) float64; 0 and inf where a position is not valid."""

    f1: Int64Array
    f2: FloatArray

    def take(self, index: Int64Array | BoolArray) -> Worth:
        """The rows `index`."""
        return Worth(self.f1[index], self.f2[index])

    def pick(self, row: Int64Array, column: Int64Array) -> Worth:
        """Of an (A, D) worth, (K,) that at each pair of row and column."""
        return Worth(self.f1[row, column], self.f2[row, column])

    def beats(self, other: Worth) -> BoolArray:
        """(N,) bool: less F2, or the same and more F1."""
        return np.asarray((self.f2 < other.f2) | ((self.f2 == other.f2) & (self.f1 > other.f1)))

    def put(self, index: Int64Array | BoolArray, worth: Worth) -> None:
        """Overwrite the rows `index`."""
        self.f1[index], self.f2[index] = worth.f1, worth.f2

    def copy(self) -> Worth:
        """The same in arrays of its own."""
        return Worth(self.f1.copy(), self.f2.copy())

    @staticmethod
    def of_nothing(shape: tuple[int, ...]) -> Worth:
        """Worth of positions none of which is valid."""
        return Worth(np.zeros(shape, np.int64), np.full(shape, np.inf))


class Landscape:
    """Asks the fitness in batches, never outside the bounds, and once a cell where settings say `memoised`.

    `n_evaluations` counts positions evaluated by the fitness; `n_hits` those that were remembered, those met twice
    in one batch included.
    """

    def __init__(self, fitness: Fitness, settings: SearchSettings, bounds_m: FloatArray) -> None:
        self._fitness = fitness
        self.origin_m = lattice_origin_m(settings, bounds_m)
        self._cell_m = settings.cell_m
        self._bounds_m = bounds_m + np.array([[-_OUTSIDE_M], [_OUTSIDE_M]])
        self._memory = _Memory() if settings.memoised else None
        self.n_evaluations = 0
        self.n_hits = 0

    def coordinates(self, positions_m: FloatArray) -> FloatArray:
        """Lattice coordinates of positions (N, 3); whole numbers, those of the nearest cell, where memoised."""
        at = (positions_m - self.origin_m) / self._cell_m
        whole = np.rint(at)
        return whole if self._memory is not None else np.where(np.abs(at - whole) < _WHOLE, whole, at)

    def positions_m(self, at: FloatArray) -> FloatArray:
        """Positions of lattice coordinates (..., 3)."""
        return self.origin_m + self._cell_m * at

    def arrive(self, at: FloatArray) -> FloatArray:
        """Where moves to coordinates (..., 3) end: there, or in the middle of the cell where memoised."""
        return np.rint(at) if self._memory is not None else at

    def look(self, at: FloatArray) -> Worth:
        """Worth of coordinates (N, 3) that `arrive` has passed."""
        positions_m = self.positions_m(at)
        inside = np.flatnonzero(((positions_m >= self._bounds_m[0]) & (positions_m <= self._bounds_m[1])).all(axis=1))
        found = Worth.of_nothing((at.shape[0],))
        if inside.size:
            found.put(inside, self._ask(positions_m[inside]) if self._memory is None else self._recall(at[inside]))
        return found

    def _recall(self, at: FloatArray) -> Worth:
        assert self._memory is not None
        key, first, back = np.unique(keys(at), return_index=True, return_inverse=True)
        new = self._memory.unknown(key)
        if new.any():
            self._memory.learn(key[new], self._ask(self.positions_m(at[first[new]])))
        self.n_hits += at.shape[0] - int(np.count_nonzero(new))
        return self._memory.of(key).take(back.reshape(-1))

    def _ask(self, positions_m: FloatArray) -> Worth:
        self.n_evaluations += positions_m.shape[0]
        valid, f1, f2 = self._fitness.evaluate(positions_m)
        bad = valid & ~np.isfinite(f2)
        if bad.any():
            row = int(np.argmax(bad))
            raise RequirementError(
                f"fitness: F2 of the valid position {positions_m[row]} is {f2[row]}, expected a finite number; "
                "call such positions invalid"
            )
        return Worth(np.where(valid, f1, 0).astype(np.int64), np.where(valid, f2, np.inf))


class _Memory:
    """Worth by cell, as arrays sorted by key."""

    def __init__(self) -> None:
        self._key = np.empty(0, np.int64)
        self._worth = Worth(np.empty(0, np.int64), np.empty(0))

    def unknown(self, key: Int64Array) -> BoolArray:
        at = np.searchsorted(self._key, key)
        unknown = np.ones(key.size, dtype=bool)
        there = at < self._key.size
        unknown[there] = self._key[at[there]] != key[there]
        return unknown

    def learn(self, key: Int64Array, worth: Worth) -> None:
        at = np.searchsorted(self._key, key)
        self._key = np.insert(self._key, at, key)
        self._worth = Worth(np.insert(self._worth.f1, at, worth.f1), np.insert(self._worth.f2, at, worth.f2))

    def of(self, key: Int64Array) -> Worth:
        return self._worth.take(np.searchsorted(self._key, key))


def lattice_origin_m(settings: SearchSettings, bounds_m: FloatArray) -> FloatArray:
    """(3,) the origin of the settings; by default the middle of the bounds in plan, at their least height."""
    if settings.lattice_origin_m is not None:
        return np.array(settings.lattice_origin_m, dtype=np.float64)
    return np.array([*bounds_m.mean(axis=0)[:2], bounds_m[0, 2]])


def keys(cell: FloatArray) -> Int64Array:
    """One number, 0 or more, for each triple of whole coordinates (..., 3).

    Raises
    ------
    RequirementError
        Coordinates of a million cells and more.
    """
    if cell.size and not np.abs(cell).max() < _REACH:
        raise RequirementError(
            f"lattice_origin_m: a position is {np.abs(cell).max():.3g} cells from it, expected less than {_REACH}; "
            "choose an origin near the starts"
        )
    index = cell.astype(np.int64) + _REACH
    return np.asarray((index[..., 0] << 42) | (index[..., 1] << 21) | index[..., 2])
