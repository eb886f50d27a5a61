"""Which planned station a listed one is: by its name, else by its place. Scene frame, metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError, StationListError
from planner_core.handover.actual_stations import ListedStation
from planner_core.handover.source import FieldStation
from planner_core.model import FloatArray

#: A crew sets up at most about so far from where it was told to.
WITHIN_M = 2.0
#: How stations may be matched.
MATCHES = ("name", "place")
#: From so many stations on, that all are off alike is worth telling.
_FEWEST_ALIKE = 3
_ALIKE_M, _TELLING_M = 0.05, 0.10
#: A list whose heights are this near to those of the planned ground points, nearly all of them, is one of these.
_AT_GROUND_M, _NEARLY_ALL = 0.05, 0.8


@dataclass(frozen=True, eq=False)
class Match:
    """planned, actual : None where there is no such, but never both. by : `name`, `place` or empty."""

    planned: FieldStation | None
    actual: ListedStation | None
    by: str = ""

    @property
    def moved_m(self) -> FloatArray:
        """(3,) float64, from the planned place to the actual one; of sensors, of grounds where the list has those."""
        assert self.planned is not None and self.actual is not None
        return _moved_m(self.planned, self.actual)


def matched(
    planned: Sequence[FieldStation], listed: Sequence[ListedStation], *, by: str = "name", within_m: float = WITHIN_M
) -> tuple[Match, ...]:
    """Match stations: planned ones in their order, then those that are additional, in theirs.

    Parameters
    ----------
    by
        `name`: those of one name belong together however far apart, upper and lower case alike; `place`: names don't
        count. The others: the nearest two first, so long as they are within `within_m`.

    Raises
    ------
    RequirementError
        Another word, or a distance that is none.
    """
    if by not in MATCHES:
        raise RequirementError(f"--match: got {by!r}, expected one of {', '.join(MATCHES)}")
    if not 0.0 <= within_m < float("inf"):
        raise RequirementError(f"--within: got {within_m} m, expected 0 or more; e.g. {WITHIN_M:g}")
    of_planned: dict[int, tuple[int, str]] = {}
    for spelt in (str, str.casefold) if by == "name" else ():  # those of the very same name first
        names = {spelt(each.id): k for k, each in enumerate(listed)}
        for i, station in enumerate(planned):
            k = names.get(spelt(station.id))
            if i not in of_planned and k is not None and k not in {taken for taken, _ in of_planned.values()}:
                of_planned[i] = (k, "name")
    of_planned.update((i, (k, "place")) for i, k in _nearest(planned, listed, of_planned, within_m))
    taken = {k for k, _ in of_planned.values()}
    found = [_match(station, listed, of_planned.get(i)) for i, station in enumerate(planned)]
    return (*found, *(Match(None, each) for k, each in enumerate(listed) if k not in taken))


def _match(station: FieldStation, listed: Sequence[ListedStation], found: tuple[int, str] | None) -> Match:
    return Match(station, None) if found is None else Match(station, listed[found[0]], found[1])


def _nearest(
    planned: Sequence[FieldStation],
    listed: Sequence[ListedStation],
    known: dict[int, tuple[int, str]],
    within_m: float,
) -> list[tuple[int, int]]:
    used = {k for k, _ in known.values()}
    pairs = (
        (float(np.linalg.norm(_moved_m(station, each))), i, k)
        for i, station in enumerate(planned)
        if i not in known
        for k, each in enumerate(listed)
        if k not in used
    )
    found: dict[int, int] = {}
    for _, i, k in sorted(pair for pair in pairs if pair[0] <= within_m):  # NaN, an unknown height, is not
        if i not in found and k not in found.values():
            found[i] = k
    return list(found.items())


def _moved_m(planned: FieldStation, actual: ListedStation) -> FloatArray:
    was_m = planned.ground_m if actual.is_ground else planned.position_m
    return np.asarray(actual.position_m - was_m)


def check_heights(
    planned: Sequence[FieldStation], listed: Sequence[ListedStation], *, by: str = "name", within_m: float = WITHIN_M
) -> None:
    """Refuse lists of sensors that are ground points: all figures would be of a scanner that lies on the floor.

    Raises
    ------
    StationListError
        Nearly all stations of the list are at the planned ground points, by their heights, and not at the sensors.
    """
    grounds = [replace(each, is_ground=True) for each in listed if not each.is_ground]
    pairs = [match for match in matched(planned, grounds, by=by, within_m=within_m) if _has_ground(match)]
    there = [match for match in pairs if _is_at_ground(match, within_m)]
    as_sensors = [match for match in matched(planned, listed, by=by, within_m=within_m) if _has_ground(match)]
    if there and len(there) >= _NEARLY_ALL * max(len(pairs), len(as_sensors)):
        raise StationListError(
            f"stations: the heights of {len(there)} of {len(pairs)} stations are those of the planned ground points, "
            "not of the sensors; give --heights ground"
        )


def _has_ground(match: Match) -> bool:
    return match.planned is not None and match.actual is not None and bool(np.isfinite(match.planned.ground_m).all())


def _is_at_ground(match: Match, within_m: float) -> bool:
    assert match.planned is not None
    dx, dy, dz = match.moved_m.tolist()
    is_low = match.planned.instrument_height_m <= 2.0 * _AT_GROUND_M  # sensor and ground are one
    return float(np.hypot(dx, dy)) <= within_m and abs(dz) <= _AT_GROUND_M and not is_low


def doubts(matches: Sequence[Match], within_m: float = WITHIN_M) -> tuple[str, ...]:
    """Lines on matches that may be wrong: names of other stations, coordinates that are all off alike."""
    pairs = [match for match in matches if match.planned is not None and match.actual is not None]
    lines = []
    far = [match for match in pairs if float(np.linalg.norm(match.moved_m)) > within_m]
    planned = [match.planned for match in matches if match.planned is not None]
    for match in far:
        assert match.planned is not None and match.actual is not None
        others = [(float(np.linalg.norm(_moved_m(each, match.actual))), each.id) for each in planned]
        away_m, nearest = min(others)
        told = f"station {match.planned.id}: is {np.linalg.norm(match.moved_m):.1f} m from its planned place"
        if nearest != match.planned.id and away_m <= within_m:
            told += f", and {away_m:.2f} m from {nearest}; if the crew named stations anew, give --match place"
        lines.append(told)
    if len(pairs) >= _FEWEST_ALIKE:
        moved_m = np.array([match.moved_m for match in pairs])
        shift_m = np.median(moved_m, axis=0)
        if float(np.linalg.norm(shift_m)) > _TELLING_M and float(np.ptp(moved_m, axis=0).max()) < _ALIKE_M:
            x, y, z = shift_m.tolist()
            lines.append(
                f"all stations are off alike, by {x:.2f}, {y:.2f}, {z:.2f} m: check the list's origin, and whether "
                "its heights are the ground's (--heights ground)"
            )
    return tuple(lines)
