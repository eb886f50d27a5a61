"""Allowed positions: everywhere a station of the plan may stand on real ground, those given beforehand among them.

Input the `Tripods` of a survey (local frame, metres) and its site, output `AllowedPositions`: candidates that a tripod
can be carried to, as rows of one array, and which of these rows are given.

Besides the grid there are candidates where surveyors like to stand: in doorways, in the middle of rooms, on landings
and flights of stairs. They pass the same tests, see `planner_core.positions.admissibility`.

Prior stations stand where they stand: nothing here moves or refuses one. A `PriorPosition` (local frame) has what is
odd about its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner_core.model import BoolArray, Candidates, FloatArray, Int32Array, Int64Array, PriorStation, Role, Survey
from planner_core.positions.admissibility import (
    FORBIDDEN,
    IN_KEEP_OUT,
    OUT_OF_SCOPE,
    UNREACHABLE,
    RefusalTally,
    Tripods,
)
from planner_core.positions.candidates import at_heights, find_candidates, is_near, local_of_written_m
from planner_core.positions.free_space import FreeSpace, free_space
from planner_core.positions.local_site import LocalSite, floors_in_words, index_of_floor
from planner_core.positions.reach import Reach, reachability, reachable
from planner_core.positions.rooms import centre_in_doorways, find_rooms
from planner_core.positions.stairs import find_flights, find_landings
from planner_core.progress import Progress, silent
from planner_core.scene.rooms import room_of_points

#: What a candidate is, by its number in `AllowedPositions.kind`.
KINDS = ("grid", "doorway", "centre", "landing", "flight", "prior")
_SPECIAL = np.array([KINDS.index(kind) for kind in ("doorway", "centre", "landing", "flight")], dtype=np.int64)
#: A special place this near to a candidate of the grid offers nothing new: that candidate is of its kind.
_NEAR_M = 0.1
#: Moving a place into the middle of its doorway changes the ground below by this much at most: a threshold.
_THRESHOLD_M = 0.3
_MAX_NAMES = 4
#: Of the grid outdoors one position is a candidate in each square of this side, in steps.
_OUTDOOR_STEPS = 2
#: Heights that differ by less are the same: stations are staked out to centimetres.
_SAME_HEIGHT_M = 0.05


@dataclass(frozen=True)
class PriorRow:
    """Candidate row `row` is the prior station `place.station`."""

    row: int
    place: PriorPosition


@dataclass(frozen=True)
class AllowedPositions:
    """candidates : by floor, y, x, height; after them the prior stations in the order of the site.

    `candidates.n_tried` and `rejected` count all but the prior ones. kind : (N,) int8 into `KINDS`. prior : those
    that have a row; kept stations that are no candidates any more are in a warning. warnings : one line each.
    """

    tripods: Tripods
    candidates: Candidates
    kind: np.ndarray[tuple[int], np.dtype[np.int8]]
    reach: Reach
    site: LocalSite
    prior: tuple[PriorRow, ...]
    warnings: tuple[str, ...]

    def allows(self, candidates: Candidates, *, out_of_scope: bool = False) -> BoolArray:
        """(N,) bool: whether the site, and the walk to them, lets stations stand at other candidates.

        out_of_scope : they may stand beside what is surveyed.
        """
        bad = _ruled_out(self.site, self.reach, _of_grid(candidates))
        if out_of_scope:
            del bad[OUT_OF_SCOPE]
        return np.asarray(~np.any(list(bad.values()), axis=0))

    def refused_on(self, floor: int) -> dict[str, int]:
        """Count the refused positions of a floor, by cause: its grid is tried again, by itself."""
        grid = find_candidates(self.tripods.on_floor(floor))
        tally = RefusalTally(grid.n_tried, dict(grid.rejected))
        _allowed(_of_grid(grid), self.site, self.reach, tally)
        return tally.rejected

    def keeping(self, rows: Int64Array) -> AllowedPositions:
        """Keep candidates (K,), sorted rows with those of all prior stations among them."""
        prior = tuple(replace(each, row=int(np.searchsorted(rows, each.row))) for each in self.prior)
        return replace(self, candidates=self.candidates.take(rows), kind=self.kind[rows], prior=prior)

    def rows_of(self, *roles: Role) -> Int64Array:
        """(K,) int64 rows of prior stations that have one of `roles`."""
        return np.array([each.row for each in self.prior if each.place.station.role in roles], dtype=np.int64)


@dataclass(frozen=True)
class _Admitted:
    """Admitted positions. position_m : (N, 3). floor, kind : (N,). height_m : (N,) instrument heights."""

    position_m: FloatArray
    floor: Int32Array
    height_m: FloatArray
    kind: Int32Array

    def take(self, which: BoolArray | Int64Array) -> _Admitted:
        return _Admitted(self.position_m[which], self.floor[which], self.height_m[which], self.kind[which])

    def candidates(self, tally: RefusalTally) -> Candidates:
        return Candidates(self.position_m, self.floor, self.height_m, tally.n_tried, tally.rejected)


def _of_grid(candidates: Candidates) -> _Admitted:
    return _Admitted(
        candidates.position_m,
        candidates.floor,
        candidates.instrument_height_m,
        np.zeros(candidates.floor.size, dtype=np.int32),
    )


def _ruled_out(site: LocalSite, reach: Reach, found: _Admitted) -> dict[str, BoolArray]:
    """(N,) bool, positions that are no candidates on this site, by reason, in the order in which these are reported."""
    plan_m, ground_m = found.position_m[:, :2], found.position_m.copy()
    ground_m[:, 2] -= found.height_m
    return {
        IN_KEEP_OUT: site.in_zone(plan_m, found.floor),
        FORBIDDEN: site.near_forbidden(plan_m, found.floor),
        OUT_OF_SCOPE: np.zeros(found.floor.size, bool) if site.scope is None else ~site.scope.admits(ground_m),
        UNREACHABLE: ~reachable(reach, found.candidates(RefusalTally())),
    }


def find_positions(
    tripods: Tripods,
    site: LocalSite,
    *,
    space: FreeSpace | None = None,
    progress: Progress = silent,
) -> AllowedPositions:
    """Find candidates on the planned floors, and give the site's prior stations their rows.

    `space` is the survey's free space without zones, where somebody has it.

    Raises
    ------
    RequirementError
        A site that does not fit the building: zones on floors that are not there, entrances off the ground, see
        `reachability`.
    """
    reach = _reach(tripods.survey, site, space, progress)
    grid = find_candidates(tripods, progress=progress)
    tally = RefusalTally(grid.n_tried, dict(grid.rejected))
    on_grid = _of_grid(grid)
    parts = [on_grid]
    if tripods.special_places:
        parts += _special(tripods, reach.space, on_grid, tally)
    found = _allowed(_joined(parts), site, reach, tally)
    found = found.take(_sparse_outdoors(site, found, tripods.grid_step_m))
    order = np.lexsort((found.height_m, found.position_m[:, 0], found.position_m[:, 1], found.floor))
    found = found.take(order)
    placed, remarks = _prior(tripods, site, reach)
    return AllowedPositions(
        tripods=tripods,
        candidates=_joined([found, _of_prior(placed)]).candidates(tally),
        kind=np.append(found.kind, np.full(len(placed), KINDS.index("prior"))).astype(np.int8),
        reach=reach,
        site=site,
        prior=tuple(PriorRow(found.floor.size + i, place) for i, place in enumerate(placed)),
        warnings=(*remarks, *_low_lines(tripods, found)),
    )


def places_as_they_are(
    tripods: Tripods,
    site: LocalSite,
    candidates: Candidates,
    *,
    space: FreeSpace | None = None,
    progress: Progress = silent,
) -> AllowedPositions:
    """Take candidates that somebody else found, but those that the site or the walk to them rules out.

    `space` is as in `find_positions`. Those ruled out are counted in `Candidates.rejected`, as it does; what is left
    stays in its order.

    Raises
    ------
    RequirementError
        As `find_positions`.
    """
    reach = _reach(tripods.survey, site, space, progress)
    tally = RefusalTally(candidates.n_tried, dict(candidates.rejected))
    found = _allowed(_of_grid(candidates), site, reach, tally)
    return AllowedPositions(
        tripods=tripods,
        candidates=found.candidates(tally),
        kind=found.kind.astype(np.int8),
        reach=reach,
        site=site,
        prior=(),
        warnings=(),
    )


def _reach(survey: Survey, site: LocalSite, space: FreeSpace | None, progress: Progress) -> Reach:
    space = free_space(survey, site.carrier, zones=site.zones, known=space, progress=progress)
    return reachability(survey, space, site.entrances_m)


def _joined(parts: list[_Admitted]) -> _Admitted:
    return _Admitted(
        position_m=np.ascontiguousarray(np.concatenate([part.position_m for part in parts])),
        floor=np.concatenate([part.floor for part in parts]).astype(np.int32),
        height_m=np.concatenate([part.height_m for part in parts]),
        kind=np.concatenate([part.kind for part in parts]),
    )


def _allowed(found: _Admitted, site: LocalSite, reach: Reach, tally: RefusalTally) -> _Admitted:
    """Leave out what the site or the walk to it rules out, and count it."""
    left = np.ones(found.floor.size, dtype=bool)
    for reason, bad in _ruled_out(site, reach, found).items():
        tally.refuse(reason, int(np.count_nonzero(bad & left)))
        left &= ~bad
    return found.take(left)


def _sparse_outdoors(site: LocalSite, found: _Admitted, grid_step_m: float) -> BoolArray:
    """(N,) bool: all but most of the grid outdoors of a survey of the interior, whose views differ little there."""
    if site.scope is None or not site.scope.outdoors_m:
        return np.ones(found.floor.size, dtype=bool)
    ground_m = found.position_m.copy()
    ground_m[:, 2] -= found.height_m
    spare: BoolArray = (found.kind == KINDS.index("grid")) & ~site.scope.surveys(ground_m)
    square = np.floor(found.position_m[:, :2] / (_OUTDOOR_STEPS * grid_step_m))
    key = np.column_stack([square, found.floor, np.round(found.height_m, 2)])[spare]
    _, first = np.unique(key, axis=0, return_index=True)
    spare[np.flatnonzero(spare)[first]] = False
    return ~spare


# ------------------------------------------------------------------------------------------ special places
def _special(tripods: Tripods, space: FreeSpace, grid: _Admitted, tally: RefusalTally) -> list[_Admitted]:
    """Doorways, middles of rooms, landings and flights where a tripod can stand and no candidate of the grid does.

    Candidates of the grid that stand in a doorway or in the middle of a room get that kind.
    """
    landing = find_landings(space, ring_radius_m=tripods.ring_radius_m, apart_m=tripods.grid_step_m)
    flight = find_flights(space, landing, apart_m=tripods.grid_step_m)
    parts = []
    for index in tripods.survey.planned:
        rooms = find_rooms(space, index)
        places = (
            _on_ground(space, centre_in_doorways(tripods.engine, space.position_m(rooms.doorway))),
            space.position_m(rooms.centre),
            space.position_m(landing[space.floor[landing] == index]),
            space.position_m(flight[space.floor[flight] == index]),
        )
        here = np.flatnonzero(grid.floor == index)
        on_grid = grid.position_m[here]
        on_grid[:, 2] -= grid.height_m[here]
        for number, place_m in zip(_SPECIAL.tolist(), places, strict=True):
            on_stairs = KINDS[number] in ("landing", "flight")
            at = place_m[~is_near(place_m, on_grid, _NEAR_M)]
            if not on_stairs:
                grid.kind[here[is_near(on_grid, place_m, _NEAR_M)]] = number
            if on_stairs:
                at[:, 2] = tripods.climbed_ground_m(at)
            position, ground, height = at_heights(tripods.heights.to_try_m, at[:, :2], at[:, 2])
            off_floor = np.zeros(ground.size, dtype=bool)
            kept, reasons = tripods.reject(index, position, ground, off_floor, treads=on_stairs)
            tally.n_tried += kept.size
            for reason, refused in reasons.items():
                tally.refuse(reason, refused)
            n = np.count_nonzero(kept)
            parts.append(
                _Admitted(position[kept], np.full(n, index, np.int32), height[kept], np.full(n, number, np.int32))
            )
    return parts


def _on_ground(space: FreeSpace, place_m: FloatArray) -> FloatArray:
    """Places (K, 3) put on the walkable ground below; those over none are left out."""
    out = place_m.copy()
    out[:, 2] = np.nan
    for row, place in enumerate(place_m):
        node = space.node_below(place + np.array([0.0, 0.0, _THRESHOLD_M]))
        if node >= 0 and abs(space.ground_m[node] - place[2]) <= _THRESHOLD_M:
            out[row, 2] = space.ground_m[node]
    return out[np.isfinite(out[:, 2])]


# ------------------------------------------------------------------------------------------ prior stations
def _prior(tripods: Tripods, site: LocalSite, reach: Reach) -> tuple[list[PriorPosition], tuple[str, ...]]:
    """Places of prior stations, and what is odd about them.

    One that is only kept from an earlier plan, or begun with, is dropped where no other station may stand: in a
    keep-out, at a forbidden position, or where nobody walks.
    """
    placed, remarks = [], []
    for station in site.prior:
        place = place_prior(tripods, station, reach.space)
        alone = _of_prior([place])
        reasons = [reason for reason, bad in _ruled_out(site, reach, alone).items() if bad[0]]
        if reasons and station.role == Role.KEPT:
            remarks.append(f"station {station.id} of the earlier plan is dropped: {', '.join(reasons)}")
            continue
        if station.role == Role.BEGUN:
            placed += [] if reasons else [place]
            continue
        remarks += [f"{station.role} station {station.id} is {reason}" for reason in reasons]
        remarks += place.remarks
        placed.append(place)
    return placed, tuple(remarks)


def _of_prior(placed: list[PriorPosition]) -> _Admitted:
    return _Admitted(
        position_m=np.array([place.position_m for place in placed], dtype=np.float64).reshape(-1, 3),
        floor=np.array([place.floor for place in placed], dtype=np.int32),
        height_m=np.array([place.instrument_height_m for place in placed], dtype=np.float64),
        kind=np.full(len(placed), KINDS.index("prior"), dtype=np.int32),
    )


def _low_lines(tripods: Tripods, found: _Admitted) -> tuple[str, ...]:
    """A line for each floor with rooms in which the tripod is lowered."""
    heights, scene = tripods.heights, tripods.survey.scene
    low = found.height_m < min(heights.to_try_m) - 1e-6
    lines = []
    for index in np.unique(found.floor[low]).tolist():
        here = found.take(low & (found.floor == index))
        rooms = room_of_points(scene, here.position_m)
        names = sorted({scene.rooms[number].name for number in rooms[rooms >= 0].tolist()})
        x, y = np.median(here.position_m[:, :2], axis=0) + scene.offset_m[:2]
        where = f"in {', '.join(map(repr, names[:_MAX_NAMES]))}" if names else f"about ({x:.2f}, {y:.2f})"
        where += f" and {len(names) - _MAX_NAMES} more rooms" if len(names) > _MAX_NAMES else ""
        least_m, most_m = float(here.height_m.min()), float(here.height_m.max())
        to_m = f"{least_m:.2f} m" if most_m - least_m < 1e-6 else f"{least_m:.2f} to {most_m:.2f} m"
        lines.append(
            f"floor {tripods.survey.floors[index].name!r}: too little headroom {where} for the usual instrument height "
            f"of {heights.to_try_m[0]:.2f} m, so the tripod is lowered there to {to_m}; --height sets another for all"
        )
    return tuple(lines)


@dataclass(frozen=True)
class PriorPosition:
    """position_m : (3,) float64, local, the sensor's origin. floor : index. remarks : one line each, for the user."""

    station: PriorStation
    position_m: FloatArray
    floor: int
    instrument_height_m: float
    remarks: tuple[str, ...]


def place_prior(tripods: Tripods, station: PriorStation, space: FreeSpace) -> PriorPosition:
    """Bring a station to the local frame, and find its floor and height, on stairs and landings of `space`, too."""
    survey = tripods.survey
    position_m = local_of_written_m(station.position_m, survey.scene.offset_m)
    index, remarks = _floor_of(survey, station, position_m)
    floor = survey.floors[index]
    below_m = tripods.ground(index).below(position_m[None])[0]
    ground_m = floor.elevation_m if np.isnan(below_m) else float(below_m)
    landing_m = _landing_below(space, position_m)
    on_stairs = landing_m is not None and landing_m > ground_m
    if landing_m is not None and on_stairs:
        ground_m = float(tripods.climbed_ground_m(np.array([[*position_m[:2], landing_m]]))[0])
    height_m = float(position_m[2] - ground_m)
    given_m = station.instrument_height_m
    if given_m is not None:
        if abs(given_m - height_m) > _SAME_HEIGHT_M:
            remarks.append(
                f"station {station.id}: instrument height {given_m:.3f} m is given, but the sensor is "
                f"{height_m:.3f} m above the ground of {floor.name!r}"
            )
        height_m = float(given_m)
    _, reasons = tripods.reject(index, position_m[None], np.array([ground_m]), np.array([not on_stairs]))
    remarks += [f"station {station.id}: no valid tripod position on {floor.name!r} ({reason})" for reason in reasons]
    return PriorPosition(station, position_m, index, height_m, tuple(remarks))


def _floor_of(survey: Survey, station: PriorStation, position_m: FloatArray) -> tuple[int, list[str]]:
    """Index of the floor a station stands on: the one it names, else the highest one below it; and remarks."""
    remarks = []
    if station.floor:
        named = index_of_floor(survey.floors, station.floor)
        if named is not None:
            return named, []
        there = floors_in_words(survey.floors)
        remarks.append(
            f"station {station.id}: there is no floor {station.floor!r} (there are {there}); taken by its height"
        )
    below = [i for i, floor in enumerate(survey.floors) if floor.elevation_m <= position_m[2]]
    index = below[-1] if below else 0
    low, high = survey.floors[index].bounds_m
    if not below or (position_m[:2] < low).any() or (position_m[:2] > high).any():
        remarks.append(f"station {station.id}: stands over no floor; counted for {survey.floors[index].name!r}")
    return index, remarks


def _landing_below(space: FreeSpace, position_m: FloatArray) -> float | None:
    """Height of the highest walkable ground straight below that is no floor's; None where there is none."""
    node = space.node_below(position_m)
    return None if node < 0 or space.on_ground[node] else float(space.ground_m[node])
