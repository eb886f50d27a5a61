"""Stations as lines of text for controllers and CAD, in walking order: column sets of letters, and known programs'.

Site frame, in its unit. A line has no quotes: few controllers read them, so texts lose their separators instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from planner_core.errors import RequirementError
from planner_core.export.chosen import (
    chosen_stations,
    coordinates_line,
    description_of,
    require_ground,
    stakeout_point,
    subtracted_remark,
    to_output_coordinates,
)
from planner_core.export.options import Options
from planner_core.export.point_names import fitted_names, plain_text
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
MAX_DECIMALS = 6
#: Where nothing else is known: Leica's and Trimble's controllers take names of 16 characters.
_NAME_LIMIT = 16


@dataclass(frozen=True)
class CsvProfile:
    """How a program wants its lines. columns : letters of `LETTERS`, in their order.

    header : its first line, with the names that it has in metres; empty: none. comment : what opens a line that the
    program passes over, for the coordinate system; empty: there is no such thing. numbered : points are numbers, not
    names. plain : ASCII only. checked : the manufacturer's documentation that this was read in; empty: it was not
    found.
    """

    name: str
    title: str
    columns: str
    header: str = ""
    separator: str = "comma"
    decimals: int = 4
    name_limit: int = _NAME_LIMIT
    comment: str = ""
    numbered: bool = False
    plain: bool = True
    checked: str = ""


#: Letters of column sets, and what they are called in messages.
LETTERS = {
    "P": "point",
    "E": "easting",
    "N": "northing",
    "X": "easting",
    "Y": "northing",
    "Z": "height of the point that is set out",
    "G": "height of the ground point",
    "H": "instrument height",
    "S": "height of the sensor",
    "C": "code (the floor's id)",
    "D": "description",
    "F": "floor",
    "O": "number on the route",
    "R": "coordinate reference system",
}

_PROFILES = (
    CsvProfile(
        name="generic",
        title="spreadsheets, and tlsplan itself",
        columns="PENGHSFODR",
        header="name,easting_m,northing_m,ground_z_m,instrument_height_m,sensor_z_m,floor,order,description,crs",
        name_limit=255,
        plain=False,
        checked="read back by tlsplan",
    ),
    CsvProfile(
        name="trimble-access",
        title="Trimble Access, CSV Grid points N-E",
        columns="PNEZC",
        plain=False,
        checked="Trimble Access help, Import file formats",
    ),
    CsvProfile(
        name="trimble-access-en",
        title="Trimble Access, CSV Grid points E-N",
        columns="PENZC",
        plain=False,
        checked="Trimble Access help, Import file formats",
    ),
    CsvProfile(
        name="leica",
        title="Leica Captivate, Viva, FlexLine and TPS: import ASCII, free format",
        columns="PENZC",
        checked="Leica LS10 and TPS1100 user manuals",
    ),
    CsvProfile(
        name="civil3d",
        title="Autodesk Civil 3D, point file format PENZD (comma delimited)",
        columns="PENZD",
        numbered=True,
        checked="Autodesk Civil 3D developer's guide, point file formats",
    ),
    CsvProfile(
        name="auf",
        title="Autodesk Uploadable File (.auf), PNEZD",
        columns="PNEZD",
        comment="#",
        numbered=True,
        checked="Autodesk Civil 3D help, Point File Format dialog box",
    ),
    CsvProfile(
        name="carlson",
        title="Carlson SurvCE and SurvPC, user defined P,N,E,Z,D",
        columns="PNEZD",
        checked="Carlson help, Import Text/ASCII File",
    ),
    CsvProfile(
        name="emlid-flow",
        title="Emlid Flow, points by name",
        columns="PCENZD",
        header="Name,Code,Easting,Northing,Elevation,Description",
        plain=False,
    ),
    CsvProfile(
        name="topcon-magnet",
        title="Topcon MAGNET, coordinates Name,N,E,Z,Code",
        columns="PNEZC",
        checked="Topcon MAGNET Tools product manual, Importing Control Points",
    ),
)

PROFILES: dict[str, CsvProfile] = {each.name: each for each in _PROFILES}
"""By the name that `--columns` takes in place of letters."""


def profile_of(options: Options) -> CsvProfile:
    """Return the profile that `columns` names, or one of its letters; separator and decimals as the options say.

    Raises
    ------
    RequirementError
        Letters that are none, come twice or lack a coordinate; a separator or decimals that are not there.
    """
    columns = options.columns
    found = PROFILES.get(columns.casefold())
    if found is None:
        found = CsvProfile(columns, columns.upper(), _checked_letters(columns), plain=False, name_limit=255)
    if options.separator:
        if options.separator not in SEPARATORS:
            raise RequirementError(f"--separator: got {options.separator!r}, expected {', '.join(SEPARATORS)}")
        found = replace(found, separator=options.separator)
    if options.decimals is not None:
        if not 0 <= options.decimals <= MAX_DECIMALS:
            raise RequirementError(f"--decimals: got {options.decimals}, expected 0 to {MAX_DECIMALS}; 4 is 0.1 mm")
        found = replace(found, decimals=options.decimals)
    return found


def _checked_letters(columns: str) -> str:
    letters = columns.upper()
    wrong = next((letter for letter in letters if letter not in LETTERS), None)
    if wrong is not None or not letters:
        raise RequirementError(
            f"--columns: got {columns!r}, expected letters of {''.join(LETTERS)} such as PENZD, or one of "
            f"{', '.join(PROFILES)}"
        )
    meant = [LETTERS[letter] for letter in letters]
    twice = next((what for what in meant if meant.count(what) > 1), None)
    if twice is not None:
        raise RequirementError(f"--columns: got {columns!r} with the {twice} twice, expected each once; e.g. PENZD")
    if not {"easting", "northing"} <= set(meant):
        raise RequirementError(f"--columns: got {columns!r}, expected E and N (or X and Y) among them; e.g. PENZD")
    return letters


def write_csv(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write a line a station; remarks tell of changed names and of coordinate systems that no line can name.

    Raises
    ------
    RequirementError
        Options that make no sense, see `profile_of`.
    ExportError
        A ground point that is not known.
    """
    profile = profile_of(options)
    stations = chosen_stations(plan, options)
    if _needs_ground(profile, options):
        require_ground(stations, "csv")
    names, remarks = _names(stations, profile)
    tell = _teller(plan, profile, options)
    rows = [
        [tell(letter, station, name) for letter in profile.columns]
        for station, name in zip(stations, names, strict=True)
    ]
    lines = [SEPARATORS[profile.separator].join(row) for row in rows]
    if profile.header:
        header = profile.header.replace("_m,", f"_{plan.frame.unit.symbol},")
        lines.insert(0, header.replace(",", SEPARATORS[profile.separator]))
    if profile.comment:
        lines.insert(0, f"{profile.comment} {plain_text(coordinates_line(plan, options))}")
    elif "R" not in profile.columns:
        remarks = (*remarks, f"the file can't state its coordinate system: {coordinates_line(plan, options)}")
    path.write_text("".join(f"{line}\r\n" for line in lines), encoding="utf-8", newline="")
    if "Z" in profile.columns and options.instrument == "sensor":
        remarks = (*remarks, "heights are those of sensors, not of ground points")
    if profile.name in PROFILES and not profile.checked:
        remarks = (*remarks, f"{profile.title}: no documentation was available, test with one point first")
    return (*remarks, *subtracted_remark(plan, options))


def _needs_ground(profile: CsvProfile, options: Options) -> bool:
    if profile.separator == "space" and {"G", "H"} & set(profile.columns):
        return True  # a cell that is empty would move the others up
    return "G" in profile.columns or ("Z" in profile.columns and options.instrument != "sensor")


def _names(stations: tuple[FieldStation, ...], profile: CsvProfile) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if "P" not in profile.columns:
        return ("",) * len(stations), ()
    if profile.numbered:
        return tuple(str(station.number) for station in stations), ()
    separator = SEPARATORS[profile.separator]
    refused = {'"', separator} | ({" "} if profile.separator == "space" else set())
    allowed = "[^" + "".join(f"\\x{ord(letter):02x}" for letter in sorted(refused)) + r"\x00-\x1f\x7f]"
    if profile.plain:
        allowed = rf"(?=[\x20-\x7e]){allowed}"
    what = profile.title if profile.name in PROFILES else f"a list separated by {profile.separator}"
    return fitted_names([station.id for station in stations], what=what, limit=profile.name_limit, allowed=allowed)


def _teller(plan: PlanSource, profile: CsvProfile, options: Options) -> Callable[[str, FieldStation, str], str]:
    """Return what writes one cell: of a letter, a station and its name in the list."""

    def tell(letter: str, station: FieldStation, name: str) -> str:
        at = stakeout_point(plan, station, options)
        if letter == "P":
            return name
        if letter in "DFRC":
            text = {
                "D": description_of(plan, station) + (" sensor" if options.instrument == "sensor" else ""),
                "F": station.floor_name,
                "C": station.floor_id,
                "R": coordinates_line(plan, options),
            }[letter]
            return _plain(text, profile)
        if letter == "O":
            return str(station.order)
        value = {
            "E": at[0],
            "X": at[0],
            "N": at[1],
            "Y": at[1],
            "Z": at[2],
            "G": to_output_coordinates(plan, station.site_ground_m, options)[2],
            "S": to_output_coordinates(plan, station.site_m, options)[2],
            "H": plan.frame.unit.of(station.instrument_height_m),
        }[letter]
        return figure(float(value), profile.decimals)

    return tell


def figure(value: float, decimals: int = 4) -> str:
    """Write a length; nothing where it is not known, and never -0.0000."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}" if math.isfinite(value) else ""


def _plain(text: str, profile: CsvProfile) -> str:
    """Take separators, quotes and line ends out of a text."""
    kept = plain_text(text) if profile.plain else text
    for letter in {SEPARATORS[profile.separator], '"', "\t", "\r", "\n"}:
        kept = kept.replace(letter, " ")
    return "_".join(kept.split()) if profile.separator == "space" else " ".join(kept.split())
