"""Station lists: stations.csv written, and CSV or plan.json read back as given stations. Scene frame, metres."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.coordinates.text_file import column_unit
from planner_core.errors import PlanFolderError, StationListError
from planner_core.model import METRE, FloatArray, LengthUnit, Plan, Role, Station
from planner_core.plan_folder.plan_json import read_plan
from planner_core.scene.file_formats import is_scene_file

COLUMNS = ("id", "floor", "order", "x_m", "y_m", "z_m", "ground_z_m", "instrument_height_m", "status")
"""z_m is the sensor's origin; ground_z_m is z_m less the instrument height. status : of `_status`."""

_MEANINGS = {
    "id": re.compile(
        r"(station|stn|point|pt|pnt|setup|scan|target|punkt|pkt|standpunkt)?(id|name|label|number|num|no|nr)"
        r"|station|stn|point|pt|pnt|setup|scan|punkt|pkt|standpunkt"
    ),
    "floor": re.compile("floor|level|storey"),
    "x": re.compile("x|east|easting"),
    "y": re.compile("y|north|northing"),
    "z": re.compile("z|elev|elevation"),
    "ground_z": re.compile("groundz|ground"),
    "instrument_height": re.compile("instrumentheight|ih|hi"),
    "height": re.compile("height"),
}
"""Meanings of columns, for names brought to the form of `_plain_name`. Of two columns of one meaning the first counts.

`height` means z where nothing else does; beside ground_z it may be either height, and is refused."""


@dataclass(frozen=True, eq=False)
class GivenStation:
    """A station that somebody else chose, or that was scanned.

    position_m : (3,) float64, scene frame, the sensor's origin; or, where `is_ground`, the ground below it.
    is_identity : of a scan whose pose is the identity, which is what programs write that have none.
    """

    id: str
    position_m: FloatArray
    instrument_height_m: float | None
    floor: str | None
    is_ground: bool = False
    is_identity: bool = False


def stations_csv(plan: Plan) -> str:
    """Return the text of stations.csv: a row a station, in the plan's order, to 0.1 mm; an unknown height is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    scanned = {station.id for station in plan.settings.site.prior if station.role == Role.SCANNED}
    for station in plan.stations:
        x, y, z = (float(value) for value in station.position_m + plan.survey.scene.offset_m)
        height = station.instrument_height_m
        figures = [_metres(value) for value in (x, y, z, z - height, height)]
        writer.writerow([station.id, station.floor, station.order, *figures, _status(station, scanned)])
    return text.getvalue()


def _status(station: Station, scanned: Collection[str]) -> str:
    """Whether the scan exists, is still to be made, or nobody knows: of a list that was given to be evaluated."""
    if station.id in scanned:
        return "scanned"
    return "given" if station.fixed else "to scan"


def _metres(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}" if math.isfinite(value) else ""


def read_station_list(path: Path, *, z_is_ground: bool = False, unit: LengthUnit = METRE) -> tuple[GivenStation, ...]:
    """Read stations from a CSV, a plan.json or a plan folder.

    A CSV needs a header line with x, y and z, or x, y, ground_z and instrument_height; floor and instrument_height
    are taken where present. So is the id, under one of many names (`Point No`, `Pt`, `Name`, `Station` ...). Only a
    list that has no other column than these goes without: it is numbered S001, S002, ... line by line. Otherwise
    columns of other names are ignored; but a line has as many fields as the header, so that none is taken for
    another's. Upper and lower case, separators comma, semicolon and tab, a byte order mark: all the same. A column
    may name its unit, metres or one of the two feet (`x_m`, `X [ft]`, `easting_ftUS`).

    Parameters
    ----------
    z_is_ground
        A CSV's z is that of the ground point. A line without instrument height then gives the ground point as its
        position, and None as its height.
    unit
        Of columns that name none. Positions are metres, whatever the list is in.

    Raises
    ------
    StationListError
        With line and column of what is wrong.
    """
    if path.is_dir() or path.suffix.lower() == ".json":
        return _from_plan(path)
    if is_scene_file(path):
        raise StationListError(
            f"{path}: is a scene file, expected a station list; give a CSV, a plan folder or, to compare, an E57"
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise StationListError(f"{path}: no such file, expected a station list; check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise StationListError(f"{path}: can't be read ({error}), expected a CSV in UTF-8; check the file") from error
    return stations_of_text(path, text, z_is_ground=z_is_ground, unit=unit)


def _from_plan(path: Path) -> tuple[GivenStation, ...]:
    try:
        rows = read_plan(path).stations
    except PlanFolderError as error:
        raise StationListError(str(error)) from error
    return _checked(
        path,
        tuple(GivenStation(row.id, np.array(row.position), row.instrument_height_m, row.floor or None) for row in rows),
    )


def stations_of_text(
    path: Path, text: str, *, z_is_ground: bool = False, header: Sequence[str] = (), unit: LengthUnit = METRE
) -> tuple[GivenStation, ...]:
    """Read stations from the text of a CSV as `read_station_list` does.

    path : for messages. header : names of the columns of a text that has no header line.
    """
    lines = text.splitlines()
    header_line = next((line for line in lines if line.strip()), "")
    separator = max(",;\t", key=header_line.count)
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    names = list(header)
    columns = _columns(path, 1, names, z_is_ground=z_is_ground) if names else None
    stations: list[GivenStation] = []
    try:
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            if columns is None:
                names, columns = row, _columns(path, rows.line_num, row, z_is_ground=z_is_ground)
            else:
                _check_fields(f"{path}, line {rows.line_num}", row, names, separator, has_header=bool(header))
                line = _Row(path, rows.line_num, row, columns, unit)
                stations.append(_station(line, len(stations), separator, z_is_ground=z_is_ground))
    except csv.Error as error:
        raise StationListError(f"{path}, line {rows.line_num}: {error}, expected CSV; repair the line") from error
    return _checked(path, tuple(stations))


def _check_fields(where: str, row: list[str], names: list[str], separator: str, *, has_header: bool) -> None:
    """Refuse a line of another number of fields than the header: its figures would be those of other columns.

    Empty fields at the end, of the line or the header, are none.
    """
    n, n_expected = len(row), len(names)
    if not any(cell.strip() for cell in (*row[n_expected:], *names[n:])):
        return
    remedy = "an empty one needs its separator, too"
    if n > n_expected:
        remedy = "text with a separator in it needs quotes"
        if separator == ",":
            remedy = "decimal commas need semicolons or tabs between the fields, text with commas needs quotes"
    stated_by = "--columns" if has_header else "the header"
    raise StationListError(f"{where}: has {n} fields, {stated_by} {n_expected}, expected as many; {remedy}")


def _checked(path: Path, stations: tuple[GivenStation, ...]) -> tuple[GivenStation, ...]:
    if not stations:
        raise StationListError(f"{path}: no stations in it, expected a header line and one line per station; add some")
    seen: set[str] = set()
    for station in stations:
        if station.id in seen:
            raise StationListError(f"{path}: id {station.id!r} occurs twice, expected one per station; rename one")
        seen.add(station.id)
    return stations


def _columns(path: Path, line: int, header: list[str], *, z_is_ground: bool) -> dict[str, tuple[int, str]]:
    """Meaning -> (column, name as written)."""
    found: dict[str, tuple[int, str]] = {}
    unknown = []
    for index, name in enumerate(header):
        key = _plain_name(name)
        meaning = next((meaning for meaning, names in _MEANINGS.items() if names.fullmatch(key)), None)
        if meaning is None:
            unknown.append(name.strip())
        else:
            found.setdefault(meaning, (index, name.strip()))
    where = f"{path}, line {line}"
    _settle_height(where, found)
    if z_is_ground and "z" in found:
        found.setdefault("ground_z", found.pop("z"))
    has_height = "ground_z" in found if z_is_ground else _gives_sensor(found)
    if not ({"x", "y"} <= set(found) and has_height):
        raise StationListError(
            f"{where}: columns are {', '.join(name.strip() for name in header)}; expected at least x_m, y_m, "
            f"z_m (or ground_z_m and instrument_height_m); name them in the header, for example {','.join(COLUMNS)}"
        )
    if "id" not in found and any(unknown):
        raise StationListError(
            f"{where}: none of the columns {', '.join(name for name in unknown if name)} is known to hold the "
            "stations' ids, expected one named id; rename it, or leave these columns out to have the stations numbered"
        )
    return found


def _gives_sensor(found: dict[str, tuple[int, str]]) -> bool:
    return "z" in found or {"ground_z", "instrument_height"} <= set(found)


def _settle_height(where: str, found: dict[str, tuple[int, str]]) -> None:
    """Take a column `height` as z where there is no other; refuse it where it may as well be the instrument's."""
    height = found.pop("height", None)
    if height is None or _gives_sensor(found):
        return
    if "ground_z" in found:
        raise StationListError(
            f"{where}: column {height[1]} may be the sensor's z or its height above {found['ground_z'][1]}, expected "
            "one of the two; rename it z_m or instrument_height_m"
        )
    found["z"] = height


def _plain_name(name: str) -> str:
    """`X [m]`, `x_ft` and `X(m)` are all `x`."""
    return re.sub(r"[^a-z]", "", column_unit(name)[0].lower().replace("#", "no"))


@dataclass(frozen=True)
class _Row:
    path: Path
    line: int
    cells: list[str]
    columns: dict[str, tuple[int, str]]
    unit: LengthUnit

    def text(self, meaning: str) -> str | None:
        if meaning not in self.columns:
            return None
        index = self.columns[meaning][0]
        return self.cells[index].strip() if index < len(self.cells) else ""

    def id(self) -> str | None:
        """The station's id; None where the list has no ids."""
        text = self.text("id")
        if text == "":
            raise StationListError(
                f"{self.path}, line {self.line}, column {self.columns['id'][1]}: is empty, expected the station's id; "
                "give it one"
            )
        return text

    def metres(self, meaning: str, *, decimal_comma: bool) -> float | None:
        text = self.text(meaning)
        if text is None:
            return None
        unit = column_unit(self.columns[meaning][1])[1] or self.unit
        try:
            value = float(text.replace(",", ".") if decimal_comma else text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise StationListError(
                f"{self.path}, line {self.line}, column {self.columns[meaning][1]}: got {text!r}, "
                f"expected a number of {unit.many}; correct it"
            )
        return value * unit.metres


def _station(row: _Row, n_before: int, separator: str, *, z_is_ground: bool) -> GivenStation:
    comma = separator != ","  # a list of 1,50;2,00 is how half of Europe writes it
    x, y = row.metres("x", decimal_comma=comma), row.metres("y", decimal_comma=comma)
    height = row.metres("instrument_height", decimal_comma=comma) if row.text("instrument_height") else None
    z = row.metres("z", decimal_comma=comma)
    if z is None and not (z_is_ground and not row.text("instrument_height")):
        height = row.metres("instrument_height", decimal_comma=comma)
    if z is None:
        z = (row.metres("ground_z", decimal_comma=comma) or 0.0) + (height or 0.0)
    return GivenStation(
        id=row.id() or f"S{n_before + 1:03d}",
        position_m=np.array([x, y, z], dtype=np.float64),
        instrument_height_m=height,
        floor=row.text("floor") or None,
    )
