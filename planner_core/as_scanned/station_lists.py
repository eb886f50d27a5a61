"""Station lists from the field, read as they come and brought to the scene frame: CSV, E57 poses, plan folders.

Output `GivenStation`s, metres. In which coordinates a list is, it does not say itself: the one that lies at the plan.
Of one that is not at the plan, or only seems to be, a line for the user names what would bring it there: columns
exchanged, another unit, a shift that all have, or the plan's shape turned and shifted. No list is moved.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner_core.as_scanned.e57_poses import e57_poses
from planner_core.as_scanned.shape import AT_STATION_M as SHAPE_M
from planner_core.as_scanned.shape import ShapeFit, shape_fit
from planner_core.errors import RequirementError, StationListError
from planner_core.model import METRE, FloatArray, LengthUnit
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.plan_folder.stations_csv import GivenStation, read_station_list, stations_of_text

#: Coordinate systems that a list may be in.
COORDINATES = ("auto", "scene", "site")
#: Heights that a column may hold.
HEIGHTS = ("sensor", "ground")
#: A tripod that was moved stands farther away: coordinates of one place differ by their rounding only.
_ONE_PLACE_M = 0.001
_EXPORT_POSES = "the poses are missing: export the scans after registration"
#: Names that a line lists.
_MOST_NAMED = 3
_HEADERS = {
    "P": "id", "E": "x", "X": "x", "N": "y", "Y": "y", "Z": "z", "S": "z", "G": "ground_z",
    "H": "instrument_height", "F": "floor", "C": "code", "D": "description", "O": "order", "R": "crs",
}  # fmt: skip
#: Lists are at the plan where a station is no further than this from the box around the planned ones.
_NEAR_M = 100.0
#: Differences of stations of the same names that vary by less are one shift.
_SAME_SHIFT_M = 1.0
#: Shifts whose spreads differ by less are as good as one another.
_SAME_SPREAD_M = 0.05
#: Another reading fits where so many of the stations are at planned ones: known by their names, or only by places.
_MOST, _MOST_BY_PLACE, _FEWEST, _FEWEST_BY_PLACE = 0.6, 0.8, 2, 3
AT_STATION_M = 2.0
"""Stations this near to a planned one are at it."""
#: In another unit, a list may be so much smaller than the plan, or that larger.
_LEAST_SIZE = 0.3
_SCALES = ((0.001, "millimetres"), (0.01, "centimetres"), (0.3048, "feet"), (1200.0 / 3937.0, "US survey feet"))
_SWAPPED = "easting and northing may be swapped; name the columns, or give --columns"


@dataclass(frozen=True)
class ActualList:
    """stations : in the scene frame, in the order of the files. coordinates : which they came in, `scene` or `site`.

    doubts : what may be wrong with a list that is at the plan, one line each.
    """

    stations: tuple[GivenStation, ...]
    coordinates: str
    doubts: tuple[str, ...] = ()


def read_actual(
    paths: Sequence[Path],
    plan: PlanSource,
    *,
    coordinates: str = "auto",
    heights: str = "sensor",
    columns: str = "",
    within_m: float = AT_STATION_M,
) -> ActualList:
    """Read where stations really stood.

    Parameters
    ----------
    paths
        CSV as of `read_station_list`, E57 (the poses of its scans; no points are read), plan folders. Ids are made
        distinct over all of them.
    coordinates
        Of `COORDINATES`; `auto`: scene or site, by which the list is nearer to the plan's stations.
    heights
        Whose a CSV's column of heights is, of `HEIGHTS`; poses are the sensor's.
    columns
        Letters of a CSV without a header line, such as `PENZ`; empty: it has one.
    within_m
        Stations this near to a planned one are at it, for telling columns that are swapped.

    Raises
    ------
    StationListError
        What can't be read; a list that is nowhere near the plan, with what may be wrong.
    RequirementError
        Words that are none of those.
    """
    for value, words, option in ((coordinates, COORDINATES, "--coordinates"), (heights, HEIGHTS, "--heights")):
        if value not in words:
            raise RequirementError(f"{option}: got {value!r}, expected one of {', '.join(words)}")
    frame = plan.frame
    # Numbers without a unit are in that of the coordinates: the scene's are metres, unless the user gives another.
    listed = _read_all(paths, heights, columns, frame.unit if frame.is_scene else METRE)
    in_feet = frame.unit.is_feet and not frame.is_scene
    lists = {"scene": listed, "site": _read_all(paths, heights, columns, frame.unit) if in_feet else listed}
    twice = next((each.id for k, each in enumerate(listed) if each.id in {s.id for s in listed[:k]}), None)
    if twice is not None:
        raise StationListError(f"stations: id {twice!r} occurs twice, expected one per station; rename one")
    if not listed:
        raise StationListError("stations: got no list, expected at least one; give --stations")
    _check_apart(listed)
    if not plan.stations:
        raise StationListError("stations: the plan has none, expected some to compare the list with; plan again")
    return _at_plan(lists, plan, coordinates, within_m)


def _read_all(paths: Sequence[Path], heights: str, columns: str, unit: LengthUnit) -> list[GivenStation]:
    return [station for path in paths for station in _read(path, heights, columns, unit)]


def _read(path: Path, heights: str, columns: str, unit: LengthUnit) -> tuple[GivenStation, ...]:
    if path.suffix.lower() == ".e57":
        return _poses([path])
    is_list = path.is_dir() or path.suffix.lower() == ".json"
    if is_list and not (path / "plan.json").is_file() and path.is_dir():
        files = sorted(each for each in path.iterdir() if each.suffix.lower() == ".e57")
        if files:  # a folder of one file a station
            return _poses(files)
    z_is_ground = heights == "ground" and not is_list
    if columns and not is_list:
        header = _header(columns)
        given = stations_of_text(path, _without_remarks(path), z_is_ground=z_is_ground, header=header, unit=unit)
    else:
        given = read_station_list(path, z_is_ground=z_is_ground, unit=unit)
    return tuple(_listed(each, z_is_ground=z_is_ground) for each in given)


def _poses(files: Sequence[Path]) -> tuple[GivenStation, ...]:
    return tuple(GivenStation(name, at_m, None, None, is_identity=lost) for name, at_m, lost in e57_poses(files))


def _check_apart(listed: Sequence[GivenStation]) -> None:
    """Refuse lists of stations that all stand at one place, as poses do that were lost or are in the points."""
    if all(each.is_identity for each in listed):
        raise StationListError(
            f"stations: got {len(listed)} {'scan' if len(listed) == 1 else 'scans'} with the pose of no translation "
            f"and no rotation, expected where the scanner stood; {_EXPORT_POSES}"
        )
    at_m = np.array([each.position_m for each in listed])
    if len(listed) > 1 and float(np.ptp(at_m, axis=0).max()) <= _ONE_PLACE_M:
        x, y, z = at_m[0].tolist()
        raise StationListError(
            f"stations: got all {len(listed)} at one place, ({x:.3f}, {y:.3f}, {z:.3f}), expected a place of its own "
            f"for each; where these are poses of scans, {_EXPORT_POSES}"
        )


def _check_identities(
    listed: Sequence[GivenStation], at_m: FloatArray, stations: Sequence[FieldStation], within_m: float
) -> None:
    """Refuse scans without pose among others with one, unless a station was planned at the origin.

    There the first scan of a registration stands, where the model was made in its coordinates.
    """
    away_m = (_away_m(place, stations) if each.is_identity else 0.0 for each, place in zip(listed, at_m, strict=True))
    lost = [each.id for each, away in zip(listed, away_m, strict=True) if away > within_m]
    if lost:
        more = f" and {len(lost) - _MOST_NAMED} more" if len(lost) > _MOST_NAMED else ""
        names = f"{', '.join(lost[:_MOST_NAMED])}{more}"
        raise StationListError(
            f"stations: got {names} of {len(listed)} with the pose of no translation and no "
            f"rotation, expected where the scanner stood; {_EXPORT_POSES}, or leave these out"
        )


def _listed(given: GivenStation, *, z_is_ground: bool) -> GivenStation:
    on_ground = z_is_ground and given.instrument_height_m is None
    return replace(given, is_ground=on_ground)


def _header(columns: str) -> list[str]:
    letters = columns.upper()
    wrong = next((letter for letter in letters if letter not in _HEADERS), None)
    if wrong is not None:
        raise RequirementError(f"--columns: got {columns!r}, expected letters of {''.join(_HEADERS)}, such as PENZ")
    return [_HEADERS[letter] for letter in letters]


def _without_remarks(path: Path) -> str:
    """Return a CSV's text; lines that are remarks are empty in it, so that the others keep their numbers."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise StationListError(f"{path}: can't be read ({error}), expected a CSV in UTF-8; check the file") from error
    return "\n".join("" if line.lstrip().startswith("#") else line for line in text.splitlines())


# ---------------------------------------------------------------------------------------------- coordinates
def _at_plan(
    lists: Mapping[str, Sequence[GivenStation]], plan: PlanSource, coordinates: str, within_m: float
) -> ActualList:
    """Choose the reading at the plan. lists : metres, as read in scene and in site coordinates."""
    if plan.frame.is_scene and coordinates == "site":
        raise StationListError(
            "stations: got site coordinates, but the coordinate system of the site is not known; give --crs and "
            "--origin, or --control-points"
        )
    readings = {"scene": np.array([each.position_m for each in lists["scene"]])}
    if not plan.frame.is_scene:
        readings["site"] = plan.frame.to_scene(np.array([each.position_m for each in lists["site"]]))
    if coordinates != "auto":
        readings = {coordinates: readings[coordinates]}
    away_m = {name: _median_away_m(at_m, plan.stations) for name, at_m in readings.items()}
    chosen = min(readings, key=lambda name: away_m[name])  # the first, the scene's own, where both are as near
    at_m, listed = readings[chosen], lists[chosen]
    if not _is_near(at_m, plan.stations):
        distances = " and ".join(f"{_length(away_m[name])} as {name} coordinates" for name in readings)
        raise StationListError(
            f"stations: none of {len(listed)} is near the plan, they are off by {distances}; "
            f"{_guess(lists, tuple(readings), plan, within_m)}"
        )
    _check_identities(listed, at_m, plan.stations, within_m)
    stations = tuple(replace(each, position_m=place) for each, place in zip(listed, at_m, strict=True))
    doubts = _swap_doubts(listed, at_m, chosen, plan, within_m) or _shape_doubts(listed, at_m, chosen, plan, within_m)
    return ActualList(stations, chosen, doubts)


def _guess(
    lists: Mapping[str, Sequence[GivenStation]], readings: Sequence[str], plan: PlanSource, within_m: float
) -> str:
    """Say what may be wrong; first whether a list of site coordinates is in another unit than it was read in."""
    unit = plan.frame.unit
    if "site" in readings and unit.is_feet:
        as_metres = [replace(each, position_m=unit.of_array(each.position_m)) for each in lists["site"]]
        if _is_near(plan.frame.to_scene(np.array([each.position_m for each in as_metres])), plan.stations):
            remedy = "name the unit in the header, or give --units m"
            return f"they were read as {unit.many}, as metres they are at it; {remedy}"
    return _guess_in_metres(lists["site" if "site" in readings else "scene"], tuple(readings), plan, within_m)


def _median_away_m(at_m: FloatArray, stations: Sequence[FieldStation]) -> float:
    return float(np.median([_away_m(place, stations) for place in at_m]))


def _away_m(place: FloatArray, stations: Sequence[FieldStation]) -> float:
    """Distance to the nearest planned station."""
    return min(float(np.linalg.norm(station.position_m - place)) for station in stations)


def _length(metres: float) -> str:
    if not math.isfinite(metres):
        return "an unknown distance"
    return f"{metres / 1000:.1f} km" if metres >= 1000 else f"{metres:.0f} m"


# ---------------------------------------------------------------------------------------------- what may be wrong
def _is_near(at_m: FloatArray, stations: Sequence[FieldStation]) -> bool:
    """Whether any of places (N, 3), scene frame, is less than `_NEAR_M` from the box around the planned ones."""
    planned_m = np.array([station.position_m for station in stations])
    low, high = planned_m.min(axis=0) - _NEAR_M, planned_m.max(axis=0) + _NEAR_M
    return bool(((at_m >= low) & (at_m <= high)).all(axis=1).any())


def _guess_in_metres(listed: Sequence[GivenStation], readings: Sequence[str], plan: PlanSource, within_m: float) -> str:
    """Return what may be wrong with a list that is elsewhere, by what would bring it to the plan."""
    as_listed = np.array([each.position_m for each in listed])
    swapped = {name: _in_scene(as_listed[:, [1, 0, 2]], name, plan) for name in readings}
    if any(_fits(listed, at_m, plan, within_m) for at_m in swapped.values()):
        return _SWAPPED
    shift = _shift(listed, readings, plan)
    if shift:
        return shift
    for scale, unit in _SCALES:
        if any(_fits(listed, _in_scene(scale * as_listed, name, plan), plan, AT_STATION_M) for name in readings):
            return f"they may be in {unit}, expected metres; convert them"
    if "site" in swapped and _is_near(swapped["site"], plan.stations):
        return _SWAPPED
    shape = _shape(listed, readings, plan)
    if shape:
        return shape
    what = "scene coordinates" if plan.frame.is_scene else "scene coordinates or in the site's"
    return f"expected them in {what}; give the site's with --crs and --origin or --control-points"


def _in_scene(values: FloatArray, coordinates: str, plan: PlanSource) -> FloatArray:
    return plan.frame.to_scene(values) if coordinates == "site" else values


def _shift(listed: Sequence[GivenStation], readings: Sequence[str], plan: PlanSource) -> str:
    """Return what to do about a shift that all stations have; empty where they have none in common."""
    known = {station.id.casefold(): station for station in plan.stations}
    pairs = [(each, known[each.id.casefold()]) for each in listed if each.id.casefold() in known]
    if len(pairs) < _FEWEST:
        return ""
    best: tuple[float, FloatArray, str, bool] | None = None
    for name in readings:
        for of_ground in (False, True):
            shifts_m = np.array(
                [each.position_m - _place(was, name, of_ground or each.is_ground) for each, was in pairs]
            )
            spread_m = float(np.ptp(shifts_m, axis=0).max())  # NaN, an unknown height, is not less
            if spread_m < (_SAME_SHIFT_M if best is None else best[0] - _SAME_SPREAD_M):
                best = spread_m, np.median(shifts_m, axis=0), name, of_ground
    if best is None:
        return ""
    _, shift_m, name, of_ground = best
    ground = "; their heights look like the ground's (--heights ground)" if of_ground else ""
    return f"{_shifted_words('all', shift_m, name, plan)}{ground}"


def _shifted_words(which: str, shift_m: FloatArray, coordinates: str, plan: PlanSource) -> str:
    e, n, h = (np.round(shift_m, 2) + 0.0).tolist()
    by = f"{which} are shifted by the same {e:.2f}, {n:.2f}, {h:.2f} m"
    if plan.frame.is_scene:
        return f"{by}: where that is the site's origin, give --origin {e:.2f},{n:.2f},{h:.2f}"
    return (
        f"{by} from the plan's {coordinates} coordinates: add the offset they were reduced by, or check origin and CRS"
    )


def _place(station: FieldStation, coordinates: str, of_ground: bool) -> FloatArray:
    if coordinates == "site":
        return station.site_ground_m if of_ground else station.site_m
    return station.ground_m if of_ground else station.position_m


# ---------------------------------------------------------------------------------------------- by shape
def _shape(listed: Sequence[GivenStation], readings: Sequence[str], plan: PlanSource) -> str:
    """Return what to do about a list whose names match nothing, by its shape; empty where that is not the plan's."""
    as_listed = np.array([each.position_m for each in listed])
    doubtful = ""
    for prefix, values in _variants(as_listed, _planned_m(listed, "scene", plan)):
        for name in readings:
            fit = shape_fit(values, _planned_m(listed, name, plan), may_turn=False)
            if fit is not None and fit.is_certain:
                which = f"{prefix}by their shape {_agreeing(fit, listed)}"
                return _shifted_words(which, fit.shift_m, name, plan) + _names_words(fit, listed, plan)
        fit = shape_fit(values, _planned_m(listed, "scene", plan))
        if fit is not None and fit.is_certain:
            origin = ",".join(f"{value + 0.0:.3f}" for value in fit.shift_m.tolist())
            return (
                f"{prefix}by their shape {_agreeing(fit, listed)} lie as planned, turned by {_degrees(fit)} degrees: "
                f"where that is right, give --origin {origin} --rotation {_degrees(fit)}"
                f"{_names_words(fit, listed, plan)}"
            )
        if fit is not None and not doubtful:
            doubtful = (
                f"{prefix}they have the plan's shape, but fit it in several ways, so that stations can't be "
                "distinguished; give the scene's position with --origin or --control-points"
            )
    return doubtful


def _variants(as_listed: FloatArray, planned_m: FloatArray) -> list[tuple[str, FloatArray]]:
    """The list as it is, with its columns exchanged, and in other units where its size suggests one."""
    size_m = float(np.ptp(as_listed[:, :2], axis=0).max())
    planned_size_m = float(np.ptp(planned_m[:, :2], axis=0).max())
    found = [("", as_listed), ("easting and northing look swapped (name the columns, or give --columns): exchanged, ",
                               as_listed[:, [1, 0, 2]])]  # fmt: skip
    for scale, unit in _SCALES[:3]:
        if _LEAST_SIZE * planned_size_m < scale * size_m < planned_size_m / _LEAST_SIZE:
            found.append((f"they may be in {unit}, expected metres (convert them): converted, ", scale * as_listed))
    return found


def _planned_m(listed: Sequence[GivenStation], coordinates: str, plan: PlanSource) -> FloatArray:
    """(M, 3) where the plan has stations, or the ground below them where the list has that."""
    of_ground = all(each.is_ground for each in listed)
    return np.array([_place(station, coordinates, of_ground) for station in plan.stations])


def _agreeing(fit: ShapeFit, listed: Sequence[GivenStation]) -> str:
    return f"{len(fit.pairs)} of {len(listed)} (to {fit.rms_m:.2f} m)"


def _degrees(fit: ShapeFit) -> str:
    return f"{math.degrees(fit.turn_rad) + 0.0:.4f}"


def _names_words(fit: ShapeFit, listed: Sequence[GivenStation], plan: PlanSource) -> str:
    """Say so where names that the plan has, too, are those of other stations."""
    planned = [station.id.casefold() for station in plan.stations]
    others = [listed[i].id.casefold() for i, k in fit.pairs.tolist() if listed[i].id.casefold() != planned[k]]
    return (
        "; its names belong to other stations than in the plan: give --match place"
        if set(others) & set(planned)
        else ""
    )


def _shape_doubts(
    listed: Sequence[GivenStation], at_m: FloatArray, coordinates: str, plan: PlanSource, within_m: float
) -> tuple[str, ...]:
    """Return a line where a list (N, 3), read in the scene frame, is at the plan but fits it elsewhere only.

    coordinates : of the list, `scene` or `site`; in them a shift is given. Lists of planned names that are all off
    alike are reported when they are matched, see `matching.doubts`.
    """
    now = max(_at_stations(listed, at_m, plan.stations, within_m))
    if now >= _MOST * len(listed):
        return ()
    as_listed = np.array([each.position_m for each in listed])
    fit = shape_fit(as_listed, _planned_m(listed, coordinates, plan))
    if fit is None or len(fit.pairs) < 2 * now:
        return ()
    if not fit.is_certain:
        return (
            f"as listed, {now} of {len(listed)} stations are within {within_m:g} m of planned ones, and the list fits "
            "the plan's shape in several other ways: check the origin of its coordinates",
        )
    known = {station.id.casefold(): k for k, station in enumerate(plan.stations)}
    named = sum(known.get(listed[i].id.casefold()) == k for i, k in fit.pairs.tolist())
    if fit.turn_rad == 0.0 and named >= _MOST * len(listed):
        return ()
    axes = ("E", "N", "H") if coordinates == "site" else ("x", "y", "z")
    shifts = zip(axes, (np.round(fit.shift_m, 2) + 0.0).tolist(), strict=True)
    by = ", ".join(f"{axis} {value:+.2f}" for axis, value in shifts)
    moved = f"turned by {_degrees(fit)} degrees and shifted" if fit.turn_rad else f"shifted by {by} m"
    return (
        f"the list has the plan's shape, but {moved}: without that, {len(fit.pairs)} of {len(listed)} "
        f"stations are within {SHAPE_M:g} m of planned ones, as listed {now} within {within_m:g} m; check the origin "
        f"of its coordinates{_names_words(fit, listed, plan)}",
    )


# ---------------------------------------------------------------------------------------------- at the plan
def _swap_doubts(
    listed: Sequence[GivenStation], at_m: FloatArray, coordinates: str, plan: PlanSource, within_m: float
) -> tuple[str, ...]:
    """Return a line where a list at the plan fits it with its first two columns exchanged, and does not as it is."""
    as_listed = np.array([each.position_m for each in listed])
    swapped_m = _in_scene(as_listed[:, [1, 0, 2]], coordinates, plan)
    now = _at_stations(listed, at_m, plan.stations, within_m)
    then = _at_stations(listed, swapped_m, plan.stations, within_m)
    if _are_most(*then, len(listed), by_name_only=True):
        were, are = now[0], then[0]
    elif _are_most(*then, len(listed)):
        were, are = max(now), then[1]
    else:
        return ()
    if 2 * were > are:
        return ()
    names = "x and y" if coordinates == "scene" else "easting and northing"
    return (
        f"{names} of the list may be swapped: exchanged, {are} of {len(listed)} stations are within "
        f"{within_m:g} m of planned ones, as listed {were}; name the columns, or give --columns",
    )


def _fits(listed: Sequence[GivenStation], at_m: FloatArray, plan: PlanSource, within_m: float) -> bool:
    """Whether most stations, (N, 3) in the scene frame, are at planned ones."""
    return _are_most(*_at_stations(listed, at_m, plan.stations, within_m), len(listed))


def _are_most(by_name: int, by_place: int, n_listed: int, *, by_name_only: bool = False) -> bool:
    if by_name >= max(_FEWEST, _MOST * n_listed):
        return True
    return not by_name_only and by_place >= max(_FEWEST_BY_PLACE, _MOST_BY_PLACE * n_listed)


def _at_stations(
    listed: Sequence[GivenStation], at_m: FloatArray, stations: Sequence[FieldStation], within_m: float
) -> tuple[int, int]:
    """Count stations at the planned one of their name; and at any, each of which counts once."""
    away_m = np.array([_distances_m(at_m, station) for station in stations])
    number = {station.id.casefold(): k for k, station in enumerate(stations)}
    known = [(number[each.id.casefold()], i) for i, each in enumerate(listed) if each.id.casefold() in number]
    by_name = sum(bool(away_m[k, i] <= within_m) for k, i in known)
    taken: set[int] = set()
    there: set[int] = set()
    for k, i in sorted(np.argwhere(away_m <= within_m).tolist(), key=lambda pair: float(away_m[pair[0], pair[1]])):
        if k not in taken and i not in there:
            taken.add(k)
            there.add(i)
    return by_name, len(taken)


def _distances_m(at_m: FloatArray, station: FieldStation) -> FloatArray:
    """Distances of places to a station's sensor, or to its ground point where that is nearer."""
    to_sensor = np.linalg.norm(at_m - station.position_m, axis=1)
    return np.asarray(np.fmin(to_sensor, np.linalg.norm(at_m - station.ground_m, axis=1)))
