"""The ground of one floor as cells of a map: where it is walked on, and how high it is at any place.

Input the `Tripods` of a survey and its `Reach` (local frame, metres). Cells are every so many of the free space's.
Heights come from the floor's own triangles; on landings and stairs, ground of no floor, from what is walked on there.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import BoolArray, FloatArray, Int64Array
from planner_core.positions.admissibility import Tripods
from planner_core.positions.reach import Reach

#: Cells of a map are about this wide, more where a floor would have more cells than `_MOST_CELLS`: each costs 42 rays.
MAP_CELL_M = 0.1
_MOST_CELLS = 250_000
#: Ground of the floor's triangles and walkable ground this near in height are the same.
_SAME_GROUND_M = 0.3


class GroundCells:
    """Cells of floor `index`.

    low_m : (2,) low corner of the map. cell_m : width of its cells. shape : (ny, nx). number : (K,) int64, cells that
    have walkable ground, numbered row by row. place_m : (K, 3), their centres on the ground. on_floor : (K,) bool,
    ground of the floor itself.
    """

    def __init__(self, tripods: Tripods, reach: Reach, index: int) -> None:
        self.index, self.floor = index, tripods.survey.floors[index]
        self._tripods, self._space = tripods, reach.space
        self._surface = tripods.ground(index)
        grid = reach.space.grid
        n_fine = max(1, round(MAP_CELL_M / grid.cell_m))
        while (grid.nx // n_fine) * (grid.ny // n_fine) > _MOST_CELLS:
            n_fine += 1
        picture = reach.space.floor_map(index, every=n_fine).ground_m
        self.shape, self.cell_m = (picture.shape[0], picture.shape[1]), n_fine * grid.cell_m
        # A map's cell is centred on the cell of the free space that it shows.
        self.low_m: FloatArray = grid.low_m + grid.cell_m * (n_fine // 2 + 0.5) - 0.5 * self.cell_m
        self.number: Int64Array = np.flatnonzero(np.isfinite(picture))
        row, column = self.number // self.shape[1], self.number % self.shape[1]
        plan_m = self.low_m + self.cell_m * (np.column_stack([column, row]) + 0.5)
        self.place_m, self.on_floor = self._on_ground(plan_m, picture.ravel()[self.number])

    def below(self, plan_m: tuple[float, float], ground_z_m: float | None) -> tuple[FloatArray, bool] | None:
        """Place (3,) on the ground at (x, y), and whether it is the floor's own; None where there is none.

        Of several grounds the one nearest to `ground_z_m` counts, without it the lowest.
        """
        at = np.array([plan_m], dtype=np.float64)
        walked_m = self._walked_m(at[0])
        if not walked_m.size:
            z_m = float(self._surface.below(np.array([[*plan_m, self._surface.high_m + 1.0]]))[0])
            return (np.array([*plan_m, z_m]), True) if np.isfinite(z_m) else None
        nearest = 0 if ground_z_m is None else int(np.abs(walked_m - ground_z_m).argmin())
        place_m, on_floor = self._on_ground(at, walked_m[nearest : nearest + 1])
        return place_m[0], bool(on_floor[0])

    def _walked_m(self, plan_m: FloatArray) -> FloatArray:
        """(N,) heights of walkable ground of this floor in the cell of a place (2,), rising."""
        space = self._space
        ix, iy = space.grid.index_of(plan_m[None])[0].tolist()
        if not (0 <= ix < space.grid.nx and 0 <= iy < space.grid.ny):
            return np.empty(0)
        column = iy * space.grid.nx + ix
        first, end = np.searchsorted(space.column, [column, column + 1]).tolist()
        heights_m: FloatArray = space.ground_m[first:end][space.floor[first:end] == self.index]
        return heights_m

    def _on_ground(self, plan_m: FloatArray, walked_m: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Places (K, 3) on the ground at (K, 2) where walkable ground is so high, and whether it is the floor's own."""
        above_m = np.column_stack([plan_m, walked_m + _SAME_GROUND_M])
        exact_m = self._surface.below(above_m)
        on_floor = np.abs(exact_m - walked_m) <= _SAME_GROUND_M  # NaN: there is none
        off = ~on_floor
        exact_m[off] = self._tripods.climbed_ground_m(np.column_stack([plan_m, walked_m])[off])
        return np.column_stack([plan_m, exact_m]), np.asarray(on_floor)
