"""Control points: a CSV of places whose scene and site coordinates are both known."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.coordinates.text_file import column_unit, text_of
from planner_core.errors import CoordinatesError
from planner_core.model import METRE, FloatArray, LengthUnit

COLUMNS = ("name", "x", "y", "z", "E", "N", "H", "weight")
"""Of a header; z, H and weight may be left out, and be empty."""
_NEEDED = ("name", "x", "y", "E", "N")
_OF_SITE = ("E", "N", "H")
_MEANINGS = {
    "name": re.compile("name|id|point|pt|station|no"),
    "x": re.compile("(scene|model|local)?x"),
    "y": re.compile("(scene|model|local)?y"),
    "z": re.compile("(scene|model|local)?z"),
    "E": re.compile("e|east|easting|site(x|e)"),
    "N": re.compile("n|north|northing|site(y|n)"),
    "H": re.compile("h|height|elev|elevation|site(z|h)"),
    "weight": re.compile("weight|w"),
}


@dataclass(frozen=True, eq=False)
class ControlPoints:
    """M points. scene_m, site_m : (M, 3) float64, x y z and E N H; NaN where there is no height. weights : (M,)."""

    names: tuple[str, ...]
    scene_m: FloatArray
    site_m: FloatArray
    weights: FloatArray

    def without(self, index: int) -> ControlPoints:
        """All points but one."""
        names = self.names[:index] + self.names[index + 1 :]
        return ControlPoints(names, *(np.delete(of, index, axis=0) for of in (self.scene_m, self.site_m, self.weights)))


def read_control_points(path: Path, site_unit: LengthUnit = METRE) -> ControlPoints:
    """Read a CSV with a header of the columns `COLUMNS`, in any order; separated by commas, semicolons or tabs.

    A column may name its unit: `E_ftUS`, `x (ft)`. Others are in metres (x, y, z) or in `site_unit` (E, N, H).

    Raises
    ------
    CoordinatesError
        With the line of what is wrong.
    """
    text = text_of(path, "a CSV of control points", CoordinatesError)
    lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    lines = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise CoordinatesError(f"{path}: holds no points, expected a header {','.join(COLUMNS)} and one line per point")
    separator = max(",;\t", key=lines[0][1].count)
    cells = [_cells(f"{path}, line {number}", line, separator) for number, line in lines]
    columns = _columns(path, cells[0])
    units = {
        meaning: column_unit(cells[0][index])[1] or (site_unit if meaning in _OF_SITE else METRE)
        for meaning, index in columns.items()
    }
    rows = [
        _Row(f"{path}, line {number}", row, columns, units, decimal_comma=separator != ",")
        for (number, _), row in zip(lines[1:], cells[1:], strict=True)
    ]
    for row in rows:
        row.check_width(len(cells[0]))
    names = [row.text("name") for row in rows]
    for index, name in enumerate(names):
        if not name or name in names[:index]:
            raise CoordinatesError(f"{rows[index].where}: name is {name!r}, expected a unique one; name every point")
    scene_m = np.array([[row.metres("x"), row.metres("y"), row.height("z")] for row in rows], dtype=np.float64)
    site_m = np.array([[row.metres("E"), row.metres("N"), row.height("H")] for row in rows], dtype=np.float64)
    weights = np.array([row.weight() for row in rows], dtype=np.float64)
    return ControlPoints(tuple(names), scene_m, site_m, weights)


def _cells(where: str, line: str, separator: str) -> list[str]:
    try:
        [row] = csv.reader([line], delimiter=separator, strict=True)
    except csv.Error as error:
        raise CoordinatesError(
            f"{where}: {error}, expected CSV; mind the quotes, and keep a point on one line"
        ) from error
    return [cell.strip() for cell in row]


def _columns(path: Path, header: list[str]) -> dict[str, int]:
    """Column by meaning."""
    found: dict[str, int] = {}
    for index, cell in enumerate(header):
        key = re.sub(r"[^a-z]", "", column_unit(cell)[0].lower())
        meaning = next((meaning for meaning, names in _MEANINGS.items() if names.fullmatch(key)), None)
        if meaning is not None:
            found.setdefault(meaning, index)
    missing = [name for name in _NEEDED if name not in found]
    if missing:
        raise CoordinatesError(
            f"{path}: columns are {', '.join(header)}, without {', '.join(missing)}; expected a header "
            f"{','.join(COLUMNS)}; rename the columns"
        )
    return found


@dataclass(frozen=True)
class _Row:
    where: str
    cells: list[str]
    columns: dict[str, int]
    units: dict[str, LengthUnit]
    decimal_comma: bool

    def check_width(self, n_columns: int) -> None:
        if any(self.cells[n_columns:]):
            raise CoordinatesError(
                f"{self.where}: has {len(self.cells)} cells, expected {n_columns} as in the header; with decimal "
                "commas, separate columns by semicolons"
            )

    def text(self, meaning: str) -> str:
        index = self.columns.get(meaning, len(self.cells))
        return self.cells[index] if index < len(self.cells) else ""

    def number(self, meaning: str) -> float:
        text = self.text(meaning)
        try:
            value = float(text.replace(",", ".") if self.decimal_comma else text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            what = "" if meaning == "weight" else f" of {self.units[meaning].many}"
            raise CoordinatesError(f"{self.where}: {meaning} is {text!r}, expected a number{what}; correct it")
        return value

    def metres(self, meaning: str) -> float:
        return self.number(meaning) * self.units[meaning].metres

    def height(self, meaning: str) -> float:
        return self.metres(meaning) if self.text(meaning) else math.nan

    def weight(self) -> float:
        value = self.number("weight") if self.text("weight") else 1.0
        if value <= 0:
            raise CoordinatesError(
                f"{self.where}: weight is {value:g}, expected more than 0; leave the point out instead"
            )
        return value
