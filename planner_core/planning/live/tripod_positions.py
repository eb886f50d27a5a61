"""Tripod positions: where a station may be dragged to. A map of each floor, and the nearest valid position.

Input the `Tripods` of a survey (local frame, metres), its site and a `Reach`; output a `GroundMap` per floor and
`TripodPosition`s. The tests are those of candidates (`planner_core.positions.admissibility`) and of the way there, so
that whatever a station is dragged to could have been a candidate. A map holds their outcome at one height; a position
is tested where it is.

A map's cells are every so many of the free space's. Heights come from the floor's own triangles; on landings and
stairs, ground of no floor, from what is walked on there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int64Array, Site
from planner_core.planning.live.draft import Draft, Place, rounded_place
from planner_core.positions.admissibility import NO_GROUND, UNREACHABLE, Tripods
from planner_core.positions.local_site import LocalSite, floor_named, local_site
from planner_core.positions.reach import Reach

#: Values of `GroundMap.values`.
NOTHING, WALKABLE, ADMISSIBLE, KEPT_OUT = range(4)
#: Places tried around one where nothing can stand, nearest first.
_N_NEAREST = 32
#: Instrument heights reach this far beyond what the tripod has: rounding.
_SLACK_M = 1e-6
#: Cells of a map are about this wide, more where a floor would have more cells than `_MOST_CELLS`: each costs 42 rays.
MAP_CELL_M = 0.1
_MOST_CELLS = 250_000
#: Ground of the floor's triangles and walkable ground this near in height are the same.
_SAME_GROUND_M = 0.3


@dataclass(frozen=True)
class GroundMap:
    """One floor from above. origin_m : (2,) local, low corner. values : (ny, nx) uint8, row iy along y.

    0: nothing to walk on, or no way there. 1: walkable, but no tripod can stand, or the plan's site keeps it free.
    2: one can. 3: the review keeps it free.
    """

    floor: str
    origin_m: FloatArray
    cell_m: float
    values: NDArray[np.uint8]


@dataclass(frozen=True)
class TripodPosition:
    """Where a station would stand. position_m : (x, y, z), local. admissible : whether a tripod can stand there.

    reason : why it is not the requested place, or why nothing can stand there; empty where it is that place.
    """

    position_m: Place
    admissible: bool
    reason: str


@dataclass(frozen=True)
class _Floor:
    """A floor whose cells are tested. value : (K,) uint8, as in `GroundMap`, as far as the plan's own site goes."""

    cells: _GroundCells
    value: NDArray[np.uint8]


class TripodPositions:
    """Spots on all floors of a survey; a floor's cells are tested when it is first needed.

    height_m : the instrument height that maps are made for.
    """

    def __init__(self, tripods: Tripods, site: LocalSite, reach: Reach, *, height_m: float) -> None:
        self._survey, self._tripods, self._site = tripods.survey, tripods, site
        self._reach, self._height_m = reach, height_m
        self._footing = reach.footing
        self._floors: dict[int, _Floor] = {}
        self._free: dict[tuple[int, object, object], tuple[FloatArray, BoolArray, cKDTree]] = {}

    def ground(self, name: str, draft: Draft) -> GroundMap:
        """Return the map of a floor, by its id or name.

        Raises
        ------
        RequirementError
            There is no such floor, or the draft's outlines are none.
        """
        index = floor_named(self._survey.floors, name, "ground")
        floor = self._floor(index)
        cells, value = floor.cells, floor.value
        picture = np.zeros(cells.shape[0] * cells.shape[1], dtype=np.uint8)
        kept_out = self._is_barred(self._site_of(draft), index, cells.place_m) & (value != NOTHING)
        picture[cells.number] = np.where(kept_out, KEPT_OUT, value)
        return GroundMap(self._survey.floors[index].id, cells.low_m, cells.cell_m, picture.reshape(cells.shape))

    def nearest(
        self, floor: str, plan_m: tuple[float, float], draft: Draft, *, height_m: float, sensor_z_m: float | None = None
    ) -> TripodPosition:
        """Find the spot at, or nearest to, a place (x, y), local frame, for an instrument `height_m` above the ground.

        sensor_z_m : where several grounds lie above each other, as on stairs, the one that fits this height counts.

        Raises
        ------
        RequirementError
            There is no such floor, the height is none, or the place is not finite.
        """
        index = floor_named(self._survey.floors, floor, "station")
        if not (math.isfinite(plan_m[0]) and math.isfinite(plan_m[1]) and math.isfinite(height_m)):
            raise RequirementError(f"position: got {plan_m} and height {height_m}, expected finite metres; check them")
        cells = self._floor(index).cells
        found = cells.below(plan_m, None if sensor_z_m is None else sensor_z_m - height_m)
        place_m, on_floor = found or (np.array([*plan_m, cells.floor.elevation_m]), True)
        requested = self._above(place_m, height_m)
        if wrong := self._wrong_height(height_m):
            return TripodPosition(requested, False, wrong)
        site = self._site_of(draft)
        reason = NO_GROUND
        if found is not None:
            reason = self._refusal(index, requested, on_floor, site, height_m)
            if not reason:
                return TripodPosition(requested, True, "")
        beside = self._beside(index, plan_m, draft, site, height_m)
        if beside is None:
            return TripodPosition(requested, False, f"{reason}, and no tripod can stand nearby")
        away_m = math.hypot(beside[0] - plan_m[0], beside[1] - plan_m[1])
        return TripodPosition(beside, True, f"{reason}; moved by {away_m:.2f} m")

    def _above(self, place_m: FloatArray, height_m: float) -> Place:
        return rounded_place(place_m + _up(height_m), self._survey.scene.offset_m)

    def _wrong_height(self, height_m: float) -> str:
        heights = self._tripods.heights
        low_m, high_m = min((heights.low_m, *heights.fixed_m)), max((heights.high_m, *heights.fixed_m))
        if low_m - _SLACK_M <= height_m <= high_m + _SLACK_M:
            return ""
        return f"the tripod puts the instrument {low_m:g} to {high_m:g} m above the ground, not {height_m:g} m"

    def _refusal(self, index: int, position: Place, on_floor: bool, site: LocalSite, height_m: float) -> str:
        """Why no station may stand at a position; empty where one may."""
        at_m = np.array([position])
        place_m = at_m - _up(height_m)
        for where, whose in ((self._site, "of the plan"), (site, "of the review")):
            of_floor = np.array([index], dtype=np.int32)
            if where.in_zone(at_m[:, :2], of_floor)[0]:
                return f"in a keep-out {whose}"
            if where.near_forbidden(at_m[:, :2], of_floor)[0]:
                return f"at a forbidden position {whose}"
        if self._footing.nodes(place_m)[0] < 0:
            return UNREACHABLE
        _, reasons = self._rejected(index, place_m, np.array([on_floor]), height_m)
        return next(iter(reasons), "")

    def _beside(
        self, index: int, plan_m: tuple[float, float], draft: Draft, site: LocalSite, height_m: float
    ) -> Place | None:
        """Nearest place of the map at which a station of this height may stand."""
        key = (index, draft.keep_out, draft.forbidden)
        if key not in self._free:
            cells = self._floor(index).cells
            free = (self._floor(index).value == ADMISSIBLE) & ~self._is_barred(site, index, cells.place_m)
            self._free = {key: (cells.place_m[free], cells.on_floor[free], cKDTree(cells.place_m[free, :2]))}
        place_m, on_floor, tree = self._free[key]
        if not place_m.shape[0]:
            return None
        _, near = tree.query(plan_m, k=np.arange(1, min(_N_NEAREST, place_m.shape[0]) + 1))
        positions = [self._above(place, height_m) for place in place_m[near]]
        at_m = np.array(positions)
        kept, _ = self._rejected(index, at_m - _up(height_m), on_floor[near], height_m)
        # Rounding may have moved one over the rim of what is kept free.
        kept &= ~self._is_barred(self._site, index, at_m) & ~self._is_barred(site, index, at_m)
        return positions[int(np.argmax(kept))] if kept.any() else None

    def _rejected(
        self, index: int, place_m: FloatArray, on_floor: BoolArray, height_m: float
    ) -> tuple[BoolArray, dict[str, int]]:
        """Which places (N, 3) on the ground pass the tests of candidates, and the reasons of the others."""
        return self._tripods.reject(index, place_m + _up(height_m), place_m[:, 2], on_floor)

    def _floor(self, index: int) -> _Floor:
        """Return a floor, tested."""
        if index not in self._floors:
            cells = _GroundCells(self._tripods, self._reach, index)
            floor = _Floor(cells, np.full(cells.number.size, NOTHING, dtype=np.uint8))
            floor.value[self._footing.nodes(cells.place_m) >= 0] = WALKABLE
            free = np.flatnonzero((floor.value == WALKABLE) & ~self._is_barred(self._site, index, cells.place_m))
            kept, _ = self._rejected(index, cells.place_m[free], cells.on_floor[free], self._height_m)
            floor.value[free[kept]] = ADMISSIBLE
            self._floors[index] = floor
        return self._floors[index]

    def _is_barred(self, site: LocalSite, index: int, place_m: FloatArray) -> BoolArray:
        """(N,) bool: whether a site keeps places (N, 3) free of stations."""
        of_floor = np.full(place_m.shape[0], index, dtype=np.int32)
        return site.in_zone(place_m[:, :2], of_floor) | site.near_forbidden(place_m[:, :2], of_floor)

    def _site_of(self, draft: Draft) -> LocalSite:
        """Return what the review keeps free."""
        return local_site(self._survey, Site(keep_out=draft.keep_out, prior=draft.forbidden))


class _GroundCells:
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


def _up(height_m: float) -> FloatArray:
    return np.array([0.0, 0.0, height_m])
