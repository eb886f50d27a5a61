"""What every format reads of a plan.json, looked at before any is written: floors, stations, links, areas, in words.

A document -> nothing, or one line with the place of the first value that is not as this version writes it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import PlanFolderError

MAX_COORDINATE_M = 1e9
"""No plan has a station further out: scenes take no vertex that is, see `planner_core.scene.repair`."""
#: No area in m2 and no strength of a link is larger.
_MOST = 1e12
#: Shares are rounded to 9 digits where they are written.
_ROUNDING = 1e-6
_METRES = f"finite numbers of metres, at most {MAX_COORDINATE_M:.0e}"


def check_plan(file: Path, document: Mapping[str, Any]) -> None:
    """Refuse floors, stations, links and areas that are none.

    Parameters
    ----------
    file
        plan.json, for messages.
    document
        Of it; values of keys that are not read here may be anything.

    Raises
    ------
    PlanFolderError
        The first that is missing, of another type, not finite or out of its range, by its place in the file.
    """
    floors = _rows(file, document, "floors")
    stations = _rows(file, document, "stations")
    for row in floors:
        _check_floor(row)
    for row in stations:
        _check_station(row)
    for rows in (floors, stations):
        _check_ids(rows)
    registration = _Row(f"{file}: registration", document["registration"])
    registration.number("threshold", 0.0, 1.0 + _ROUNDING, "a share from 0 to 1")
    registration.number("min_strength", 0.0, _MOST, "a number of 0 or more")
    for row in _rows(file, registration.mapping(), "links", "registration."):
        _check_link(row)
    _check_areas(file, document)


class _Row:
    """A mapping of plan.json, and what its place is called."""

    def __init__(self, where: str, values: Any, named: str = "") -> None:
        self.where = where
        self.values = values
        self.named = named

    def mapping(self) -> Mapping[str, Any]:
        if not isinstance(self.values, Mapping):
            raise PlanFolderError(f"{self.where}: got {_shown(self.values)}, expected an object; plan again")
        return self.values

    def refuse(self, key: str, value: Any, expected: str) -> PlanFolderError:
        of = f" of {self.named}" if self.named else ""
        return PlanFolderError(f"{self.where}.{key}{of}: got {_shown(value)}, expected {expected}; plan again")

    def value(self, key: str) -> Any:
        if key not in self.mapping():
            raise PlanFolderError(f"{self.where}: {key} is missing, expected a plan of this version; plan again")
        return self.values[key]

    def text(self, key: str, *, may_be_empty: bool = False) -> str:
        value = self.value(key)
        if not isinstance(value, str) or not (value or may_be_empty):
            raise self.refuse(key, value, "a text" if may_be_empty else "a text of one letter or more")
        return value

    def number(self, key: str, low: float, high: float, expected: str) -> None:
        value = self.value(key)
        if not _is_number(value, low, high):
            raise self.refuse(key, value, expected)

    def metres(self, key: str, shape: tuple[int, ...]) -> None:
        """Check a number or nested lists of numbers."""
        self._metres(key, self.value(key), shape)

    def _metres(self, key: str, value: Any, shape: tuple[int, ...]) -> None:
        if not shape:
            if not _is_number(value, -MAX_COORDINATE_M, MAX_COORDINATE_M):
                raise self.refuse(key, value, _METRES)
            return
        if not isinstance(value, list) or len(value) != shape[0]:
            raise self.refuse(key, value, f"a list of {shape[0]}")
        for place, each in enumerate(value):
            self._metres(f"{key}[{place}]", each, shape[1:])


def _rows(file: Path, document: Mapping[str, Any], key: str, prefix: str = "") -> list[_Row]:
    rows = document.get(key)
    if not isinstance(rows, list):
        raise PlanFolderError(f"{file}: {prefix}{key}: got {_shown(rows)}, expected a list; plan again")
    found = [_Row(f"{file}: {prefix}{key}[{place}]", row) for place, row in enumerate(rows)]
    for row in found:
        row.mapping()
    return found


def _check_floor(row: _Row) -> None:
    row.named = row.text("id")
    row.text("name", may_be_empty=True)
    row.metres("elevation_m", ())
    row.metres("bounds", (2, 2))
    (x0, y0), (x1, y1) = row.values["bounds"]
    if x1 < x0 or y1 < y0:
        raise row.refuse("bounds", row.values["bounds"], "the lower corner first, [[x_min, y_min], [x_max, y_max]]")


def _check_station(row: _Row) -> None:
    row.named = row.text("id")
    row.text("floor", may_be_empty=True)
    order = row.value("order")
    if not isinstance(order, int) or isinstance(order, bool):
        raise row.refuse("order", order, "a whole number")
    row.metres("position", (3,))
    if row.value("instrument_height_m") is not None:  # not known, of given stations
        row.metres("instrument_height_m", ())
    if not isinstance(row.value("fixed"), bool):
        raise row.refuse("fixed", row.values["fixed"], "true or false")
    for key in ("own_area_m2", "covered_area_m2"):
        _check_area(row, key)


def _check_ids(rows: list[_Row]) -> None:
    seen: set[str] = set()
    for row in rows:
        if row.named in seen:
            raise row.refuse("id", row.named, "one of its own, and an earlier one has it")
        seen.add(row.named)


def _check_link(row: _Row) -> None:
    row.named = f"{row.text('a')}-{row.text('b')}"
    row.number("overlap", 0.0, 1.0 + _ROUNDING, "a share from 0 to 1")
    if row.value("strength") is not None:  # not computed
        row.number("strength", 0.0, _MOST, "a number of 0 or more, or null")


def _check_area(row: _Row, key: str) -> None:
    row.number(key, -_ROUNDING, _MOST, "a finite number of m2, 0 or more")


def _check_areas(file: Path, document: Mapping[str, Any]) -> None:
    """Check what sheets say of coverage, where a plan tells of it."""
    if "coverage" not in document:
        return
    whole = _Row(f"{file}: coverage", document["coverage"])
    floors = _rows(file, whole.mapping(), "floors", "coverage.")
    for row in floors:
        row.named = row.text("floor")
    for row in (whole, *floors):
        for key in ("achievable_area_m2", "total_area_m2", "covered_area_m2"):
            _check_area(row, key)
        for key in ("fraction_of_achievable", "fraction_of_total"):
            row.number(key, 0.0, 1.0 + _ROUNDING, "a share from 0 to 1")


def _is_number(value: Any, low: float, high: float) -> bool:
    """Whether it is a finite number in a range: true is none, and a whole number may be too large for a float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return bool(low <= value <= high)


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
