"""Station lists from the field, read as they come and brought to the scene frame: CSV, E57 poses, plan folders.

Output `ListedStation`s, metres. In which coordinates a list is, it does not say itself: the one that lies at the plan.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner_core.as_scanned.coordinate_diagnosis import AT_STATION_M, guess, is_near, shape_doubts, swap_doubts
from planner_core.as_scanned.e57_poses import e57_poses
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


@dataclass(frozen=True, eq=False)
class ListedStation:
    """position_m : (3,) float64, the sensor; or, where `is_ground`, the point on the ground below it.

    is_identity : of a scan whose pose is the identity, which is what programs write that have none.
    """

    id: str
    position_m: FloatArray
    instrument_height_m: float | None
    floor: str | None
    is_ground: bool = False
    is_identity: bool = False


@dataclass(frozen=True)
class ActualList:
    """stations : in the scene frame, in the order of the files. coordinates : which they came in, `scene` or `site`.

    doubts : what may be wrong with a list that is at the plan, one line each.
    """

    stations: tuple[ListedStation, ...]
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


def _read_all(paths: Sequence[Path], heights: str, columns: str, unit: LengthUnit) -> list[ListedStation]:
    return [station for path in paths for station in _read(path, heights, columns, unit)]


def _read(path: Path, heights: str, columns: str, unit: LengthUnit) -> tuple[ListedStation, ...]:
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


def _poses(files: Sequence[Path]) -> tuple[ListedStation, ...]:
    return tuple(ListedStation(name, at_m, None, None, is_identity=lost) for name, at_m, lost in e57_poses(files))


def _check_apart(listed: Sequence[ListedStation]) -> None:
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
    listed: Sequence[ListedStation], at_m: FloatArray, stations: Sequence[FieldStation], within_m: float
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


def _listed(given: GivenStation, *, z_is_ground: bool) -> ListedStation:
    on_ground = z_is_ground and given.instrument_height_m is None
    return ListedStation(given.id, given.position_m, given.instrument_height_m, given.floor, on_ground)


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
    lists: Mapping[str, Sequence[ListedStation]], plan: PlanSource, coordinates: str, within_m: float
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
    if not is_near(at_m, plan.stations):
        distances = " and ".join(f"{_length(away_m[name])} as {name} coordinates" for name in readings)
        raise StationListError(
            f"stations: none of {len(listed)} is near the plan, they are off by {distances}; "
            f"{_guess(lists, tuple(readings), plan, within_m)}"
        )
    _check_identities(listed, at_m, plan.stations, within_m)
    stations = tuple(replace(each, position_m=place) for each, place in zip(listed, at_m, strict=True))
    doubts = swap_doubts(listed, at_m, chosen, plan, within_m) or shape_doubts(listed, at_m, chosen, plan, within_m)
    return ActualList(stations, chosen, doubts)


def _guess(
    lists: Mapping[str, Sequence[ListedStation]], readings: Sequence[str], plan: PlanSource, within_m: float
) -> str:
    """Say what may be wrong; first whether a list of site coordinates is in another unit than it was read in."""
    unit = plan.frame.unit
    if "site" in readings and unit.is_feet:
        as_metres = [replace(each, position_m=unit.of_array(each.position_m)) for each in lists["site"]]
        if is_near(plan.frame.to_scene(np.array([each.position_m for each in as_metres])), plan.stations):
            remedy = "name the unit in the header, or give --units m"
            return f"they were read as {unit.many}, as metres they are at it; {remedy}"
    return guess(lists["site" if "site" in readings else "scene"], tuple(readings), plan, within_m)


def _median_away_m(at_m: FloatArray, stations: Sequence[FieldStation]) -> float:
    return float(np.median([_away_m(place, stations) for place in at_m]))


def _away_m(place: FloatArray, stations: Sequence[FieldStation]) -> float:
    """Distance to the nearest planned station."""
    return min(float(np.linalg.norm(station.position_m - place)) for station in stations)


def _length(metres: float) -> str:
    if not math.isfinite(metres):
        return "an unknown distance"
    return f"{metres / 1000:.1f} km" if metres >= 1000 else f"{metres:.0f} m"
