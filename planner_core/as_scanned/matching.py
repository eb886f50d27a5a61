"""Which planned station a listed one is: by its name, else by its place. Scene frame, metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError, StationListError
from planner_core.model import FloatArray, SiteFrame
from planner_core.plan_folder.plan_source import FieldStation
from planner_core.plan_folder.stations_csv import GivenStation

#: A crew sets up at most about so far from the planned place.
WITHIN_M = 2.0
#: How stations may be matched.
MATCHES = ("name", "place")
#: From so many stations on, that all are off alike is worth telling.
_FEWEST_ALIKE = 3
_ALIKE_M, _TELLING_M = 0.05, 0.10
#: Moves of stations of the same names that vary by less are a shift of the list, however well it fits elsewhere.
_SHIFT_M = 1.0
#: So much of a height is off where a list has ground points for sensors.
_LOW_M = 0.5
#: Names in a line.
_MOST_NAMED = 3
#: A list whose heights are this near to those of the planned ground points, nearly all of them, is one of these.
_AT_GROUND_M, _NEARLY_ALL = 0.05, 0.8


@dataclass(frozen=True, eq=False)
class Match:
    """planned, actual : None where there is no such, but never both. by : `name`, `place` or empty.

    exchanged : the list has this place under the name of another planned station, which is not where it was planned.
    """

    planned: FieldStation | None
    actual: GivenStation | None
    by: str = ""
    exchanged: bool = False

    @property
    def moved_m(self) -> FloatArray:
        """(3,) float64, from the planned place to the actual one; of sensors, of grounds where the list has those."""
        assert self.planned is not None and self.actual is not None
        return _moved_m(self.planned, self.actual)


def matched(
    planned: Sequence[FieldStation], listed: Sequence[GivenStation], *, by: str = "name", within_m: float = WITHIN_M
) -> tuple[Match, ...]:
    """Match stations: planned ones in their order, then those that are additional, in theirs.

    Parameters
    ----------
    by
        `name`: those of one name belong together however far apart, upper and lower case alike, unless names were
        exchanged; `place`: names don't count. The others: the nearest two first, so long as they are within `within_m`.

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
    exchanged = _exchanged(planned, listed, of_planned, within_m) if by == "name" else {}
    if exchanged:
        moved = set(exchanged.values())
        of_planned = {i: each for i, each in of_planned.items() if each[0] not in moved}
        of_planned.update((i, (k, "place")) for i, k in exchanged.items())
    taken = {k for k, _ in of_planned.values()}
    found = [_match(station, listed, of_planned.get(i), i in exchanged) for i, station in enumerate(planned)]
    return (*found, *(Match(None, each) for k, each in enumerate(listed) if k not in taken))


def _match(
    station: FieldStation, listed: Sequence[GivenStation], found: tuple[int, str] | None, exchanged: bool
) -> Match:
    return Match(station, None) if found is None else Match(station, listed[found[0]], found[1], exchanged)


def _exchanged(
    planned: Sequence[FieldStation],
    listed: Sequence[GivenStation],
    known: dict[int, tuple[int, str]],
    within_m: float,
) -> dict[int, int]:
    """Planned stations and those at their places that bear names of others, which are not where these were planned.

    Only where most that are far from the place of their name are at another: a list that is shifted, or a crew that
    dodges, meets other places by chance.
    """
    named = {i: k for i, (k, by) in known.items() if by == "name"}
    moves_m = {i: _moved_m(planned[i], listed[k]) for i, k in named.items()}
    far = {i: k for i, k in named.items() if float(np.linalg.norm(moves_m[i])) > within_m}
    near = {i: each for i, each in known.items() if i not in far}
    # Those with names of no planned station may fill no place of the others.
    near.update((-1 - k, (k, "")) for k in range(len(listed)) if k not in far.values())
    found = dict(_nearest(planned, listed, near, within_m))
    if 2 * len(found) < len(far) or not found:
        return {}
    spread_m = float(np.ptp(np.array(list(moves_m.values())), axis=0).max())
    if len(found) < len(far) and len(named) >= _FEWEST_ALIKE and spread_m < _SHIFT_M:
        return {}
    return found


def _nearest(
    planned: Sequence[FieldStation],
    listed: Sequence[GivenStation],
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


def _moved_m(planned: FieldStation, actual: GivenStation) -> FloatArray:
    was_m = planned.ground_m if actual.is_ground else planned.position_m
    return np.asarray(actual.position_m - was_m)


def check_heights(
    planned: Sequence[FieldStation], listed: Sequence[GivenStation], *, by: str = "name", within_m: float = WITHIN_M
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


def doubts(matches: Sequence[Match], within_m: float = WITHIN_M, frame: SiteFrame | None = None) -> tuple[str, ...]:
    """Lines on matches that may be wrong: names of other stations, coordinates that are all off alike.

    frame : of a list in site coordinates, in which a shift is given; None: it is in the scene's.
    """
    pairs = [match for match in matches if match.planned is not None and match.actual is not None]
    shifted = _shift_line(pairs, frame)
    each = (shifted,) if shifted else _far_lines(matches, pairs, within_m)
    return (*_exchanged_line(matches), *each)


def _shift_line(pairs: Sequence[Match], frame: SiteFrame | None) -> str:
    if len(pairs) < _FEWEST_ALIKE:
        return ""
    moved_m = np.array([match.moved_m if frame is None else _moved_in(frame, match) for match in pairs])
    shift_m = np.median(moved_m, axis=0)
    if not float(np.linalg.norm(shift_m)) > _TELLING_M or not float(np.ptp(moved_m, axis=0).max()) < _ALIKE_M:
        return ""
    axes = ("x", "y", "z") if frame is None else ("E", "N", "H")
    by = ", ".join(f"{axis} {value:+.2f}" for axis, value in zip(axes, (shift_m.round(2) + 0.0).tolist(), strict=True))
    grounds = ""
    if float(shift_m[2]) < -_LOW_M and not any(match.actual.is_ground for match in pairs if match.actual is not None):
        grounds = ", and whether its heights are the ground's (--heights ground)"
    return f"all stations are off by the same {by} m: check the list's origin{grounds}"


def _moved_in(frame: SiteFrame, match: Match) -> FloatArray:
    """Like `Match.moved_m`, in site coordinates."""
    assert match.actual is not None
    at_m = match.actual.position_m
    ways_m: FloatArray = frame.to_site(np.stack([at_m, at_m - match.moved_m]))
    return np.asarray(ways_m[0] - ways_m[1])


def _exchanged_line(matches: Sequence[Match]) -> tuple[str, ...]:
    found = [match for match in matches if match.exchanged]
    if not found:
        return ()
    renamed = [f"{match.planned.id} as {match.actual.id}" for match in found if match.planned and match.actual]
    more = f" and {len(renamed) - _MOST_NAMED} more" if len(renamed) > _MOST_NAMED else ""
    names = f"{', '.join(renamed[:_MOST_NAMED])}{more}"
    planned = [match for match in matches if match.planned is not None]
    if all(match.actual is not None for match in planned):
        return (
            f"all {len(planned)} planned positions were scanned, only names differ: {len(found)} are listed under "
            f"names of other stations ({names}), and were matched by position",
        )
    return (f"{len(found)} positions are listed under names of other stations ({names}), and were matched by position",)


def _far_lines(matches: Sequence[Match], pairs: Sequence[Match], within_m: float) -> tuple[str, ...]:
    lines = []
    planned = [match.planned for match in matches if match.planned is not None]
    for match in pairs:
        if float(np.linalg.norm(match.moved_m)) <= within_m:
            continue
        assert match.planned is not None and match.actual is not None
        others = [(float(np.linalg.norm(_moved_m(each, match.actual))), each.id) for each in planned]
        away_m, nearest = min(others)
        line = f"station {match.planned.id}: is {np.linalg.norm(match.moved_m):.1f} m from its planned position"
        if nearest != match.planned.id and away_m <= within_m:
            line += f", and {away_m:.2f} m from {nearest}; if the crew renamed stations, give --match place"
        lines.append(line)
    return tuple(lines)
