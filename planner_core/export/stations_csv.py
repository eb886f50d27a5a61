"""Station lists: stations.csv written, and CSV or plan.json read back as given stations. Scene frame, metres."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.errors import PlanFolderError, StationListError
from planner_core.export.plan_json import read_plan_json
from planner_core.model import FloatArray, Plan

COLUMNS = ("id", "floor", "order", "x_m", "y_m", "z_m", "ground_z_m", "instrument_height_m")
"""z_m is the sensor's origin; ground_z_m is z_m less the instrument height."""

_ALIASES = {
    "id": ("id", "name", "station", "stationid", "point", "nr", "no"),
    "floor": ("floor", "level", "storey"),
    "x": ("x", "east", "easting"),
    "y": ("y", "north", "northing"),
    "z": ("z", "height", "elevation"),
    "ground_z": ("groundz", "ground"),
    "instrument_height": ("instrumentheight", "ih", "hi"),
}


@dataclass(frozen=True)
class GivenStation:
    """A station that somebody else chose. position_m : (3,) float64, SCENE frame, the sensor's origin."""

    id: str
    position_m: FloatArray
    instrument_height_m: float | None
    floor: str | None


def stations_csv(plan: Plan) -> str:
    """Return the text of stations.csv: a row a station, in the plan's order, to 0.1 mm; an unknown height is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for station in plan.stations:
        x, y, z = (float(value) for value in station.position_m + plan.survey.scene.offset_m)
        height = station.instrument_height_m
        figures = [_metres(value) for value in (x, y, z, z - height, height)]
        writer.writerow([station.id, station.floor, station.order, *figures])
    return text.getvalue()


def _metres(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}" if math.isfinite(value) else ""


def read_station_list(path: Path) -> tuple[GivenStation, ...]:
    """Read stations from a CSV, a plan.json or a plan folder.

    A CSV needs a header line with x, y and z, or x, y, ground_z and instrument_height; id, floor and
    instrument_height are taken where present, other columns are ignored. Upper and lower case, units in the name
    (`x_m`, `X [m]`), separators comma, semicolon and tab, a byte order mark: all the same.

    Raises
    ------
    StationListError
        With line and column of what is wrong.
    """
    if path.is_dir() or path.suffix.lower() == ".json":
        return _from_plan(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise StationListError(f"{path}: no such file, expected a station list; check the path") from None
    except (OSError, UnicodeDecodeError) as error:
        raise StationListError(f"{path}: can't be read ({error}), expected a CSV in UTF-8; check the file") from error
    return _from_csv(path, text)


def _from_plan(path: Path) -> tuple[GivenStation, ...]:
    try:
        document = read_plan_json(path)
        stations = tuple(
            GivenStation(
                id=str(row["id"]),
                position_m=_checked_position(row["position"]),
                instrument_height_m=None if row["instrument_height_m"] is None else float(row["instrument_height_m"]),
                floor=str(row["floor"]) or None,
            )
            for row in document["stations"]
        )
    except PlanFolderError as error:
        raise StationListError(str(error)) from error
    except (KeyError, TypeError, ValueError) as error:
        raise StationListError(
            f"{path}: its stations are not those of a plan ({error!r}), expected id, floor, position and "
            "instrument_height_m in each; plan again or give a CSV"
        ) from error
    return _checked(path, stations)


def _checked_position(values: Sequence[float]) -> FloatArray:
    position = np.asarray(values, dtype=np.float64)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise ValueError(f"position {values!r}")
    return position


def _from_csv(path: Path, text: str) -> tuple[GivenStation, ...]:
    lines = text.splitlines()
    header_line = next((line for line in lines if line.strip()), "")
    separator = max(",;\t", key=header_line.count)
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    columns: dict[str, tuple[int, str]] | None = None
    stations: list[GivenStation] = []
    try:
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            if columns is None:
                columns = _columns(path, row)
            else:
                stations.append(_station(_Row(path, rows.line_num, row, columns), len(stations), separator))
    except csv.Error as error:
        raise StationListError(f"{path}, line {rows.line_num}: {error}, expected CSV; repair the line") from error
    return _checked(path, tuple(stations))


def _checked(path: Path, stations: tuple[GivenStation, ...]) -> tuple[GivenStation, ...]:
    if not stations:
        raise StationListError(f"{path}: no stations in it, expected a header line and a line a station; add some")
    seen: set[str] = set()
    for station in stations:
        if station.id in seen:
            raise StationListError(f"{path}: id {station.id!r} occurs twice, expected one a station; rename one")
        seen.add(station.id)
    return stations


def _columns(path: Path, header: list[str]) -> dict[str, tuple[int, str]]:
    """Meaning -> (column, name as written)."""
    found: dict[str, tuple[int, str]] = {}
    for index, name in enumerate(header):
        key = _plain_name(name)
        meaning = next((meaning for meaning, names in _ALIASES.items() if key in names), None)
        if meaning is not None and meaning not in found:
            found[meaning] = (index, name.strip())
    if not ({"x", "y"} <= set(found) and ("z" in found or {"ground_z", "instrument_height"} <= set(found))):
        raise StationListError(
            f"{path}, line 1: columns are {', '.join(name.strip() for name in header)}; expected at least x_m, y_m, "
            f"z_m (or ground_z_m and instrument_height_m); name them in the header, for example {','.join(COLUMNS)}"
        )
    return found


def _plain_name(name: str) -> str:
    """`X [m]`, `x_m` and `X(m)` are all `x`."""
    lowered = re.sub(r"[\[(].*?[\])]", "", name.strip().lower())
    return re.sub(r"[^a-z]", "", re.sub(r"[\s_\-]m(et(er|re)s?)?$", "", lowered.strip()))


@dataclass(frozen=True)
class _Row:
    path: Path
    line: int
    cells: list[str]
    columns: dict[str, tuple[int, str]]

    def text(self, meaning: str) -> str | None:
        if meaning not in self.columns:
            return None
        index = self.columns[meaning][0]
        return self.cells[index].strip() if index < len(self.cells) else ""

    def number(self, meaning: str, *, decimal_comma: bool) -> float | None:
        text = self.text(meaning)
        if text is None:
            return None
        try:
            value = float(text.replace(",", ".") if decimal_comma else text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise StationListError(
                f"{self.path}, line {self.line}, column {self.columns[meaning][1]}: got {text!r}, "
                "expected a number of metres; correct it"
            )
        return value


def _station(row: _Row, n_before: int, separator: str) -> GivenStation:
    comma = separator != ","  # a list of 1,50;2,00 is how half of Europe writes it
    x, y = row.number("x", decimal_comma=comma), row.number("y", decimal_comma=comma)
    height = row.number("instrument_height", decimal_comma=comma) if row.text("instrument_height") else None
    z = row.number("z", decimal_comma=comma)
    if z is None:
        height = row.number("instrument_height", decimal_comma=comma)
        z = (row.number("ground_z", decimal_comma=comma) or 0.0) + (height or 0.0)
    return GivenStation(
        id=row.text("id") or f"S{n_before + 1:03d}",
        position_m=np.array([x, y, z], dtype=np.float64),
        instrument_height_m=height,
        floor=row.text("floor") or None,
    )
