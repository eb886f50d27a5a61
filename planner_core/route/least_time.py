"""Plans of least time in the field: sets of stations that meet all targets, with few stations and a short walk.

Input a `CoverProblem`, a set that meets it, and walking distances (metres); output a `LeastTime`. With n stations to
scan and a walk of length W through them, the time is

    T = n (scan + set-up) + W / speed

A station costs minutes, the way to the next seconds, so fewest stations come first by themselves; what is left is to
choose, among sets of about as many, one with a short walk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.route.exchange import Exchanges, exchange_detours_m, insertion_detours_m
from planner_core.route.visiting_order import visiting_order
from planner_core.select.check import check_selection
from planner_core.select.network import Network
from planner_core.select.problem import CoverProblem

#: Where there is no way: further than any walk, and finite, so that differences are numbers.
_FAR_M = 1e6
#: What saves less than this, in metres, is rounding.
_LEAST_GAIN_M = 1e-6
#: Exchanges of a step that are examined closely, the most promising first.
_MAX_TRIED = 200
#: Stations that are taken out together, at most, before others are put in.
_MAX_RUIN = 3
#: Ways over the cells' graph are so much longer than pulled taut, at most (2.8 %, rounded up): bounds allow for it.
GRAPH_DETOUR = 1.03


class RowOfDistances(Protocol):
    """Walking distances from one of many places, such as `planner_core.positions.walking.WalkingFrom`."""

    def row(self, place: int) -> FloatArray:
        """(P,) metres from one place to all; inf where there is no way."""


@dataclass(frozen=True)
class WalkingDistances:
    """Where candidates are on foot.

    distances : among N candidates and, after them, other places. floor : (N,) int32. start, end : places where the walk
    begins and ends, numbers from N on; None: where it is shortest. closed : it ends where it begins.
    """

    distances: RowOfDistances
    floor: Int32Array
    start: int | None = None
    end: int | None = None
    closed: bool = False


@dataclass(frozen=True)
class LeastTimeSettings:
    """per_station_s : of a scan and its set-up together. n_kicks : how often stations are taken out and others put in.

    Raises
    ------
    RequirementError
        Figures that make no sense.
    """

    per_station_s: float
    walking_m_per_s: float = 1.0
    n_kicks: int = 40
    seed: int = 0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.per_station_s) and self.per_station_s >= 0):
            raise RequirementError(f"seconds per station: got {self.per_station_s:g}, expected 0 or more; e.g. 180")
        if not (np.isfinite(self.walking_m_per_s) and self.walking_m_per_s > 0):
            raise RequirementError(
                f"walking speed: got {self.walking_m_per_s:g} m/s, expected more than 0; give e.g. 1"
            )
        if self.n_kicks < 0:
            raise RequirementError(f"n_kicks: got {self.n_kicks}, expected 0 or more; e.g. 40")


@dataclass(frozen=True)
class LeastTime:
    """chosen : candidates in the order of the walk, those already scanned last.

    walk_m : by the distances given, legs that can't be walked not counted. seconds : of the stations and this walk.
    started_s : the same of the set that the search began with. lower_bound_s : no set that meets the targets takes
    less, see `lower_bound_s`. interrupted : the search was cut short.
    """

    chosen: tuple[int, ...]
    walk_m: float
    seconds: float
    started_s: float
    lower_bound_s: float
    interrupted: bool = False


def least_time(
    problem: CoverProblem,
    start: Sequence[int],
    walks: WalkingDistances,
    settings: LeastTimeSettings,
    *,
    fewest: int = 0,
    given: Sequence[int] = (),
    scanned: Sequence[int] = (),
    network: Network | None = None,
    progress: Progress = silent,
) -> LeastTime:
    """Shorten the time of `start`, a set that meets all targets and is connected in `network`; never lengthen it.

    Parameters
    ----------
    fewest
        No set has fewer stations, `scanned` ones included: the bound that goes with `start`.
    given, scanned
        Candidates that stay in the set; of these, `scanned` are visited no more.
    progress
        A KeyboardInterrupt that it raises ends the search, not the call.

    Raises
    ------
    SelectionCheckError
        `start` misses a target or a given station.

    Notes
    -----
    Local search: leave out a station, or exchange one for a candidate, as long as time is saved, the largest saving
    first; then take out up to three stations near each other, put others in that add most for their time, and search
    on from there. Stops are ordered by local search inside storeys; `planner_core.route.route.plan_route` orders the
    final set exactly where that can be done.
    """
    given = (*given, *(c for c in scanned if c not in set(given)))
    check_selection(problem, start, given=given)
    search = _LeastTimeSearch(
        problem, walks, settings, fixed=frozenset(given), scanned=frozenset(scanned), network=network
    )
    best = began = search.visit(list(start))
    interrupted = False
    rng = np.random.default_rng(settings.seed)
    try:
        best = search.descend(began)
        for kick in range(settings.n_kicks):
            progress(ProgressEvent("least time", kick, settings.n_kicks, f"{best.seconds:.0f} s"))
            kicked = search.kicked(best, rng)
            if kicked is not None:
                found = search.descend(kicked)
                best = found if found.seconds < best.seconds - _LEAST_GAIN_M else best
        progress(ProgressEvent("least time", settings.n_kicks, settings.n_kicks, f"{best.seconds:.0f} s"))
    except KeyboardInterrupt:
        interrupted = True
    check_selection(problem, best.chosen, given=given)
    return LeastTime(
        chosen=(*best.order, *(c for c in best.chosen if c in search.scanned)),
        walk_m=best.walk_m,
        seconds=search.seconds(best.chosen, best.walk_m),
        started_s=search.seconds(began.chosen, began.walk_m),
        lower_bound_s=lower_bound_s(problem, walks, settings, fewest=fewest, scanned=scanned),
        interrupted=interrupted,
    )


def lower_bound_s(
    problem: CoverProblem,
    walks: WalkingDistances,
    settings: LeastTimeSettings,
    *,
    fewest: int,
    scanned: Sequence[int] = (),
) -> float:
    """Seconds that no set of these candidates that meets the targets stays below, by the distances given.

    Notes
    -----
    At least `fewest` stations, and from a start a walk as far as candidates are needed: let D be the least distance
    within which candidates, all together, meet the targets. A set that meets them has a station at D or further, the
    walk leads there, and a closed walk back. Without a start, only the stations count.
    """
    stations_s = max(0, fewest - len(set(scanned))) * settings.per_station_s
    if walks.start is None:
        return stations_s
    away_m = np.array(walks.distances.row(walks.start)[: problem.n_candidates], dtype=np.float64)
    away_m[list(scanned)] = 0.0  # nobody has to walk there
    order = np.argsort(away_m, kind="stable")
    low, high = 0, problem.n_candidates
    while low < high:  # the fewest nearest candidates that meet all targets
        middle = (low + high) // 2
        covered = problem.ticks_of(problem.times_seen(order[:middle].tolist()))
        low, high = (low, middle) if (covered >= problem.least).all() else (middle + 1, high)
    far_m = float(away_m[order[low - 1]]) if low else 0.0
    if not np.isfinite(far_m):
        far_m = 0.0  # a part that no way leads to: how one gets there, nobody knows
    return stations_s + far_m / GRAPH_DETOUR * (2.0 if walks.closed else 1.0) / settings.walking_m_per_s


@dataclass(frozen=True)
class _Visit:
    """A set, the order (without ends and scanned ones) in which it is walked, and the length of the walk."""

    chosen: list[int]
    order: list[int]
    tour: Int64Array
    """Stops of the closed tour: places, and -1 for the seam of an open walk."""
    walk_m: float
    """Legs that can't be walked not counted."""
    seconds: float
    """Such legs counted as `_FAR_M` each: no time is saved by going where nobody can."""


@dataclass
class _LeastTimeSearch:
    problem: CoverProblem
    walks: WalkingDistances
    settings: LeastTimeSettings
    fixed: frozenset[int]
    scanned: frozenset[int]
    network: Network | None
    _rows: dict[int, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._exchanges = Exchanges(self.problem)
        n_ends = len({self.walks.start, self.walks.end} - {None})
        self._floor = np.append(self.walks.floor, np.full(n_ends + 1, -1)).astype(np.int32)

    def seconds(self, chosen: Sequence[int], walk_m: float) -> float:
        """Time of a set with a walk."""
        n_scans = sum(c not in self.scanned for c in chosen)
        return n_scans * self.settings.per_station_s + walk_m / self.settings.walking_m_per_s

    def visit(self, chosen: list[int]) -> _Visit:
        """Find an order of a set."""
        stops = [c for c in chosen if c not in self.scanned]
        ends = [end for end in (self.walks.start, self.walks.end) if end is not None]
        stops += ends[:1] if len(set(ends)) == 1 else ends
        at = np.array(stops, dtype=np.int64)
        distance_m = self._away(at)[:, at]
        found = visiting_order(
            np.minimum(distance_m, distance_m.T),
            self._floor[at],
            start=None if self.walks.start is None else stops.index(self.walks.start),
            end=None if self.walks.end is None else stops.index(self.walks.end),
            closed=self.walks.closed,
            n_kicks=0,
            max_exact=0,
        )
        tour = at[found.order]
        closed = self.walks.closed or (self.walks.start is not None and self.walks.start == self.walks.end)
        return _Visit(
            chosen=chosen,
            order=[int(c) for c in tour if c < self.problem.n_candidates],
            tour=tour if closed else np.append(tour, -1),
            walk_m=found.length_m,
            seconds=self.seconds(chosen, found.length_m + found.n_unwalkable * _FAR_M),
        )

    def descend(self, visit: _Visit) -> _Visit:
        """Leave stations out and exchange them while that saves time."""
        while True:
            better = self._without_one(visit) or self._with_one_exchanged(visit)
            if better is None:
                return visit
            visit = better

    def kicked(self, visit: _Visit, rng: np.random.Generator) -> _Visit | None:
        """Take stations near each other out, and put others in until all is met again; None where that fails."""
        loose = [c for c in visit.order if c not in self.fixed]
        if not loose:
            return None
        first = loose[int(rng.integers(len(loose)))]
        away_m = self._row(first)[loose]
        n_out = int(rng.integers(1, _MAX_RUIN + 1))
        out = {loose[i] for i in np.argsort(away_m, kind="stable")[:n_out].tolist()}
        chosen = [c for c in visit.chosen if c not in out]
        # Not the same ones at once: the search would only walk back.
        excluded = np.isin(np.arange(self.problem.n_candidates), [first])
        while not self._exchanges.met(chosen) or self._n_violations(chosen):
            added = self._addition(chosen, excluded | np.isin(np.arange(excluded.size), chosen), rng)
            if added is None or len(chosen) > len(visit.chosen) + 1:
                return None
            chosen = [*chosen, added]
        return self.visit(chosen)

    def _addition(self, chosen: list[int], excluded: BoolArray, rng: np.random.Generator) -> int | None:
        """Choose a candidate that adds much for its time; where only links are missing, one that gives them."""
        gain = np.where(excluded, 0, self._exchanges.gains(chosen)).astype(np.float64)
        if not (gain > 0).any():
            return self._connector(chosen, excluded)
        some = np.flatnonzero(gain > 0)
        detour_m = np.maximum(self._detours_m(self.visit(chosen), some), 0.0)
        value = gain[some] / (1.0 + self.settings.per_station_s + detour_m / self.settings.walking_m_per_s)
        value *= rng.uniform(0.8, 1.0, size=some.size)
        return int(some[int(np.argmax(value))])

    def _connector(self, chosen: list[int], excluded: BoolArray) -> int | None:
        if self.network is None or not self._exchanges.met(chosen):
            return None
        near = np.unique(np.concatenate([self.network.neighbours(c) for c in chosen])) if chosen else np.empty(0, int)
        near = near[~excluded[near]].tolist()
        before = self._n_violations(chosen)
        violations = [self._n_violations([*chosen, c]) for c in near]
        return int(near[int(np.argmin(violations))]) if violations and min(violations) < before else None

    def _without_one(self, visit: _Visit) -> _Visit | None:
        spare = self._exchanges.superfluous(visit.chosen)
        loose = [c for c, free in zip(visit.chosen, spare.tolist(), strict=True) if free and c not in self.fixed]
        options = []
        for out in loose:
            chosen = [c for c in visit.chosen if c != out]
            if not self._n_violations(chosen):
                options.append(self.visit(chosen))
        best = min(options, key=lambda option: option.seconds, default=None)
        return best if best is not None and best.seconds < visit.seconds - _LEAST_GAIN_M else None

    def _with_one_exchanged(self, visit: _Visit) -> _Visit | None:
        """Make the exchange that shortens the walk most; estimated by detours, then walked."""
        n = self.problem.n_candidates
        place = np.flatnonzero((visit.tour >= 0) & (visit.tour < n))
        place = place[[int(c) not in self.fixed for c in visit.tour[place]]]
        candidates = np.setdiff1d(np.arange(n), visit.chosen)
        detour_m = self._exchange_detours_m(visit, candidates)[:, place]
        hopeful = np.flatnonzero((detour_m < -_LEAST_GAIN_M).any(axis=1))
        if not hopeful.size:
            return None
        column = [visit.chosen.index(int(c)) for c in visit.tour[place]]
        allowed = self._exchanges.allowed(visit.chosen, candidates[hopeful])[:, column]
        row, out = np.nonzero(allowed & (detour_m[hopeful] < -_LEAST_GAIN_M))
        order = np.lexsort((out, row, np.round(detour_m[hopeful][row, out], 9)))
        for k in order[:_MAX_TRIED].tolist():
            chosen = list(visit.chosen)
            chosen[column[int(out[k])]] = int(candidates[hopeful[row[k]]])
            if self._n_violations(chosen):
                continue
            tried = self.visit(chosen)
            if tried.seconds < visit.seconds - _LEAST_GAIN_M:
                return tried
        return None

    def _exchange_detours_m(self, visit: _Visit, candidates: Int64Array) -> FloatArray:
        away_m, between_m = self._around(visit, candidates)
        return exchange_detours_m(away_m, self._floor[visit.tour], between_m, self._floor[candidates])

    def _detours_m(self, visit: _Visit, candidates: Int64Array) -> FloatArray:
        away_m, between_m = self._around(visit, candidates)
        return insertion_detours_m(away_m, self._floor[visit.tour], between_m, self._floor[candidates])

    def _around(self, visit: _Visit, candidates: Int64Array) -> tuple[FloatArray, FloatArray]:
        """(T, M) from the stops of a tour to candidates, (T, T) among the stops; nothing to and from the seam."""
        rows = self._away(visit.tour)
        rows = np.where(np.isfinite(rows), rows, _FAR_M)
        return rows[:, candidates], rows[:, visit.tour]

    def _away(self, place: Int64Array) -> FloatArray:
        """(K, P + 1) distances from places to all, and to the seam, number -1."""
        return np.stack([self._row(int(p)) for p in place]) if place.size else np.empty((0, self._floor.size))

    def _row(self, place: int) -> FloatArray:
        if place not in self._rows:
            if place < 0:
                self._rows[place] = np.zeros(self._floor.size)
            else:
                self._rows[place] = np.append(self.walks.distances.row(place), 0.0)
        return self._rows[place]

    def _n_violations(self, chosen: list[int]) -> int:
        return 0 if self.network is None else self.network.n_violations(chosen)
