"""Overlap repair: stations added until every scan overlaps others enough and all scans of a floor are connected.

Input chosen stations and a pool of candidates (local frame, metres; only the plan counts), the range, the required
overlap; output `OverlapRepair`. Scans are circles in plan, as in the paper: walls play no part. What real surfaces say
afterwards is `planner_core.network.links`.

CONTROL FLOW: (1) `lift`: a station whose circle the others cover too little gets candidates in the order of Eq. 4.
(2) `join`: while a floor has several sets of overlapping stations, the two that are closest grow towards each other by
a candidate in the order of Eq. 5; where none leads nearer, by the path through the pool with the fewest stations. Every
station that is added goes through (1). Each step takes a candidate from the pool, so that both end.

References
----------
López et al. 2023, section 3.3.2, Eq. 3 to 5. docs/method/f3-overlap.md gives our reading of them.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.paper.circle_overlap import CELLS_ACROSS, filled_share, occupancy_grid, shared_fraction
from planner_core.progress import Progress, ProgressEvent, silent

#: Share of each circle that others cover, where no overlap is required.
OVERLAP_OF_CIRCLES = 0.30
#: Candidates nearer than this to a station in plan would overlap it wholly and show nothing new.
SAME_PLACE_M = 1e-6


class Reason(Enum):
    """Why a station was added."""

    OVERLAP = "overlap"
    """`of_station` overlapped the others too little (Eq. 4)."""
    JOIN = "join"
    """A step from the set of `of_station` towards the closest other one (Eq. 5)."""
    BRIDGE = "bridge"
    """On the shortest path from a set to another one, next after `of_station`: no step by Eq. 5 led nearer."""


@dataclass(frozen=True)
class Addition:
    """One station added. Stations are numbered from 0: those given, then those added in their order."""

    station: int
    candidate: int
    """Its place in the pool."""
    reason: Reason
    of_station: int
    share: float
    """F3 of the new station and `of_station`."""
    n_sets: int
    """Sets of overlapping stations, on all floors together, once it is there."""


@dataclass(frozen=True)
class OverlapRepair:
    """Stations added, and what stands then.

    added : (A,) int64 into the pool, in order. overlap : (S + A,) float64, share of each station's circle that others
    cover. sets : stations that are connected, in order of their first. short : stations below the required overlap, for
    which the pool has nothing left. n_floors : floors with stations.
    """

    added: Int64Array
    overlap: FloatArray
    sets: tuple[tuple[int, ...], ...]
    short: tuple[int, ...]
    history: tuple[Addition, ...]
    n_floors: int

    @property
    def is_joined(self) -> bool:
        """Whether the stations of every floor are connected. Where not, the pool has no path between them."""
        return len(self.sets) <= self.n_floors


def rank_by_overlap(share: FloatArray, *, required: float, radius_m: float) -> tuple[BoolArray, FloatArray]:
    """Eq. 4 of candidates with shares (N,): (N,) whether preferred, and (N,) score; greater pairs are better.

    Notes
    -----
    score = r - |o - F3|. The paper sets "the most significant bit" (1 << 32) of scores whose F3 reaches o. In 32 bits
    that bit does not exist, and on a float it means nothing; what is meant is that any candidate which reaches o comes
    before all that don't. So it is the first of two keys here.
    """
    preferred: BoolArray = share >= required
    return preferred, radius_m - np.abs(required - share)


def station_overlaps(
    positions_m: FloatArray, *, radius_m: float, floor: Int32Array | None = None, cells_across: int = CELLS_ACROSS
) -> FloatArray:
    """(N,) share of each station's circle that the circles of the others on its floor cover together.

    Parameters
    ----------
    positions_m : (N, 2) or (N, 3). floor : (N,) int32; None: one floor.
    """
    plan, floors = _checked("positions_m", positions_m, floor)
    return np.array(
        [
            _overlap_of(plan[i], np.delete(plan, i, axis=0)[np.delete(floors, i) == floors[i]], radius_m, cells_across)
            for i in range(len(plan))
        ]
    ).reshape(-1)


def repair_overlap(
    stations_m: FloatArray,
    pool_m: FloatArray,
    *,
    radius_m: float,
    required: float,
    station_floor: Int32Array | None = None,
    pool_floor: Int32Array | None = None,
    cells_across: int = CELLS_ACROSS,
    progress: Progress = silent,
) -> OverlapRepair:
    """Add candidates of the pool until every station overlaps others enough and the stations of a floor are connected.

    Parameters
    ----------
    stations_m : (S, 2) or (S, 3). pool_m : (N, 2) or (N, 3). station_floor : (S,), pool_floor : (N,) int32
        Floors; None: all on one. Circles of different floors do not overlap.
    radius_m
        The scanner's range, clamped to what counts; of all circles.
    required
        Share of a circle, 0 to below 1, that the others have to cover (`o` in the paper).
    cells_across
        Cells of the occupancy grid along a diameter.
    progress
        Hears of every station that is added; the total is not known.

    Raises
    ------
    RequirementError
        Arrays that do not fit, positions that are not finite, a radius or a share that makes no sense.
    """
    if not 0 <= required < 1:
        raise RequirementError(f"required: got an overlap of {required}, expected 0 to below 1; give e.g. 0.3")
    if not (np.isfinite(radius_m) and radius_m > 0):
        raise RequirementError(f"radius_m: got {radius_m}, expected a positive range in metres")
    stations = _checked("stations_m", stations_m, station_floor)
    pool = _checked("pool_m", pool_m, pool_floor)
    network = _Network(stations, pool, _Rules(radius_m, required, cells_across), progress)
    network.lift(range(len(stations_m)))
    network.join()
    return network.result()


_Positions = tuple[FloatArray, Int32Array]


class _Rules(NamedTuple):
    radius_m: float
    required: float
    cells_across: int


class _Network:
    """Stations, the free candidates, and the sets of stations that are connected."""

    def __init__(self, stations: _Positions, pool: _Positions, rules: _Rules, progress: Progress) -> None:
        self._at, self._floor = stations
        self._pool, self._pool_floor = pool
        self._radius_m, self._required, self._cells = rules
        self._progress = progress
        self._free = np.ones(len(self._pool), dtype=np.bool_)
        self._set = np.arange(len(self._at))
        self._history: list[Addition] = []
        for station in range(len(self._at)):
            self._free &= ~self._in_its_place(station)
            self._link(station)

    # ------------------------------------------------------------------ the two stages
    def lift(self, stations: range) -> None:
        """Bring stations, and all that are added for them, to the required overlap, as far as the pool allows."""
        waiting = deque(stations)
        while waiting:
            station = waiting.popleft()
            for candidate in self._by_overlap(station):
                before = self._overlap(station)
                if before >= self._required:
                    break
                if self._free[candidate] and self._overlap(station, self._pool[candidate]) > before:
                    waiting.append(self._add(int(candidate), Reason.OVERLAP, station))

    def join(self) -> None:
        """Join the sets of every floor, as far as the pool has paths between them."""
        alone: set[int] = set()  # sets from which no path leads to another one
        while (pair := self._closest(alone)) is not None:
            step = self._step(*pair) or self._step(*pair[::-1])
            n_before = len(self._at)
            if step is not None:
                self._add(step[1], Reason.JOIN, step[0])
            else:
                path = self._path(pair[0])
                if path is None:
                    alone.add(int(self._set[pair[0]]))
                    continue
                last = pair[0]
                for candidate in path:
                    last = self._add(candidate, Reason.BRIDGE, last)
            self.lift(range(n_before, len(self._at)))

    def result(self) -> OverlapRepair:
        """What stands now."""
        overlap = np.array([self._overlap(station) for station in range(len(self._at))]).reshape(-1)
        return OverlapRepair(
            added=np.array([addition.candidate for addition in self._history], dtype=np.int64),
            overlap=overlap,
            sets=tuple(tuple(np.flatnonzero(self._set == one).tolist()) for one in np.unique(self._set)),
            short=tuple(np.flatnonzero(overlap < self._required).tolist()),
            history=tuple(self._history),
            n_floors=int(np.unique(self._floor).size),
        )

    # ------------------------------------------------------------------ candidates in order
    def _by_overlap(self, station: int) -> Int64Array:
        """Free candidates whose circles meet the station's, best by Eq. 4 first; ties in order of the pool."""
        distance = self._to_pool(station)
        near = np.flatnonzero(self._free & (distance < 2.0 * self._radius_m))
        share = shared_fraction(distance[near], self._radius_m, self._radius_m)
        preferred, score = rank_by_overlap(share, required=self._required, radius_m=self._radius_m)
        return near[np.lexsort((near, -score, ~preferred))]

    def _step(self, origin: int, goal: int) -> tuple[int, int] | None:
        """(origin, candidate): the best step from a station towards another by Eq. 5; None where none leads nearer."""
        near = self._by_overlap(origin)
        whole = float(np.hypot(*(self._at[origin] - self._at[goal])))
        progress = (whole - self._to_pool(goal)[near]) / whole
        near, progress = near[progress > 0], progress[progress > 0]
        if near.size == 0:
            return None
        share = shared_fraction(self._to_pool(origin)[near], self._radius_m, self._radius_m)
        preferred, score = rank_by_overlap(share, required=self._required, radius_m=self._radius_m)
        return origin, int(near[np.lexsort((near, -progress * score, ~preferred))[0]])

    def _closest(self, alone: set[int]) -> tuple[int, int] | None:
        """The closest two stations of different sets on one floor, lower number first; None where there are none."""
        offset = self._at[:, None] - self._at[None]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        open_ = ~np.isin(self._set, list(alone))
        apart = (self._set[:, None] != self._set[None]) & (self._floor[:, None] == self._floor[None])
        distance[~(apart & open_[:, None] & open_[None])] = np.inf
        if not np.isfinite(distance).any():
            return None
        one, other = divmod(int(distance.argmin()), len(self._at))
        return one, other

    def _path(self, station: int) -> list[int] | None:
        """Free candidates that lead from a station's set to another, as few as possible; None where there is no way.

        Breadth first; of equally short ways, the one whose candidates come first in the pool.
        """
        mine = self._set == self._set[station]
        goals = self._at[~mine & (self._floor == self._floor[station])]
        left = np.flatnonzero(self._free & (self._pool_floor == self._floor[station]))
        at_goal: BoolArray = np.asarray(self._meet(self._pool[left], goals).any(axis=1))
        reached: BoolArray = np.asarray(self._meet(self._pool[left], self._at[mine]).any(axis=1))
        parent = np.full(left.size, -1)
        front = np.flatnonzero(reached)
        while front.size:
            ends = front[at_goal[front]]
            if ends.size:
                path = [int(ends[0])]
                while parent[path[-1]] >= 0:
                    path.append(int(parent[path[-1]]))
                return [int(left[place]) for place in reversed(path)]
            new = np.zeros_like(reached)
            for place in front:
                meets = np.flatnonzero(self._meet(self._pool[left], self._pool[left[place]][None])[:, 0] & ~reached)
                parent[meets] = place
                reached[meets] = new[meets] = True
            front = np.flatnonzero(new)
        return None

    # ------------------------------------------------------------------ figures and changes
    def _overlap(self, station: int, further: FloatArray | None = None) -> float:
        """Share of a station's circle that others cover, and a further circle."""
        same = self._floor == self._floor[station]
        same[station] = False
        others = self._at[same] if further is None else np.concatenate([self._at[same], further[None]])
        return _overlap_of(self._at[station], others, self._radius_m, self._cells)

    def _add(self, candidate: int, reason: Reason, of_station: int) -> int:
        """Make a station of a candidate."""
        station = len(self._at)
        self._at = np.concatenate([self._at, self._pool[candidate][None]])
        self._floor = np.append(self._floor, self._pool_floor[candidate])
        self._set = np.append(self._set, station)
        self._free &= ~self._in_its_place(station)
        self._link(station)
        distance = np.hypot(*(self._at[station] - self._at[of_station]))
        share = float(shared_fraction(distance, self._radius_m, self._radius_m))
        n_sets = int(np.unique(self._set).size)
        self._history.append(Addition(station, candidate, reason, of_station, share, n_sets))
        self._progress(ProgressEvent("overlap", len(self._history), 0, f"{n_sets} sets"))
        return station

    def _link(self, station: int) -> None:
        """Join the sets of all stations whose circles meet this one's; a set has the number of its first station."""
        met = self._meet(self._at, self._at[station][None])[:, 0] & (self._floor == self._floor[station])
        met &= np.arange(len(self._at)) <= station
        sets = np.unique(self._set[met])
        self._set[np.isin(self._set, sets)] = sets[0]

    def _to_pool(self, station: int) -> FloatArray:
        """(N,) distances in plan; inf to candidates of other floors."""
        offset = self._pool - self._at[station]
        distance: FloatArray = np.hypot(offset[:, 0], offset[:, 1])
        distance[self._pool_floor != self._floor[station]] = np.inf
        return distance

    def _in_its_place(self, station: int) -> BoolArray:
        there: BoolArray = self._to_pool(station) < SAME_PLACE_M
        return there

    def _meet(self, some_m: FloatArray, others_m: FloatArray) -> BoolArray:
        """(n, k) whether circles about (n, 2) and (k, 2) overlap: F3 > 0."""
        offset = some_m[:, None] - others_m[None]
        meet: BoolArray = np.hypot(offset[..., 0], offset[..., 1]) < 2.0 * self._radius_m
        return meet


def _overlap_of(at_m: FloatArray, others_m: FloatArray, radius_m: float, cells_across: int) -> float:
    """Share of a circle that others cover: on the grid, and at least that of the closest, which has a closed form."""
    if len(others_m) == 0:
        return 0.0
    distance = np.hypot(*(others_m - at_m).T).min()
    closest = float(shared_fraction(distance, radius_m, radius_m))
    return max(closest, filled_share(occupancy_grid(at_m, others_m, radius_m=radius_m, cells_across=cells_across)))


def _checked(name: str, positions_m: FloatArray, floor: Int32Array | None) -> _Positions:
    """Plan positions (N, 2) and floors (N,), or RequirementError."""
    positions = np.asarray(positions_m, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] not in (2, 3) or not np.isfinite(positions).all():
        raise RequirementError(
            f"{name}: got shape {positions.shape}, expected finite (N, 2) or (N, 3); pass one row a position"
        )
    floors = np.zeros(len(positions), dtype=np.int32) if floor is None else np.asarray(floor, dtype=np.int32)
    if floors.shape != (len(positions),):
        raise RequirementError(
            f"floors of {name}: got shape {floors.shape}, expected ({len(positions)},); pass one a position"
        )
    return np.ascontiguousarray(positions[:, :2]), floors
