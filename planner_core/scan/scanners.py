"""Scanner specifications: JSON files beside this module, one a scanner, and files of the user's own.

A file holds `name`, `title`, `source`, `range_min_m`, `range_max_m`, `n_azimuths`, `instrument_height_min_m`,
`instrument_height_max_m` and `elevation_deg`: either a list, highest first, or
`{"first": highest, "last": lowest, "count": n}`, evenly spaced with both ends included.
"""

from __future__ import annotations

import json
import math
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import Scanner

#: A table larger than this is a mistake of units, not a scanner: it alone would need gigabytes a station.
MAX_BEAMS = 200_000_000
_NUMBERS = ("range_min_m", "range_max_m", "n_azimuths", "instrument_height_min_m", "instrument_height_max_m")
_TEXTS = ("name", "title", "source")


def list_scanners() -> tuple[Scanner, ...]:
    """All scanners that come with the product, by name."""
    return tuple(_read(text, where=name) for name, text in sorted(_own_files().items()))


def load_scanner(name_or_path: str | Path) -> Scanner:
    """Find a scanner by its name, or read one from a JSON file of the user's own.

    Raises
    ------
    RequirementError
        No such scanner or file, or the file does not describe one.
    """
    own = _own_files()
    key = str(name_or_path)
    if key.lower() in own:
        return _read(own[key.lower()], where=key)
    path = Path(name_or_path)
    if path.suffix.lower() != ".json" and not path.is_file():
        raise RequirementError(
            f"scanner: got {key!r}, expected one of {', '.join(sorted(own))} or the path of a .json file; "
            "`tlsplan scanners` lists them"
        )
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RequirementError(f"scanner file {key}: can't be read ({error}); check the path") from error
    return _read(text, where=key)


def _own_files() -> dict[str, str]:
    folder = resources.files("planner_core.scan")
    files = [file for file in folder.iterdir() if file.name.endswith(".json")]
    return {file.name.removesuffix(".json"): file.read_text(encoding="utf-8") for file in files}


def _read(text: str, *, where: str) -> Scanner:
    try:
        spec = json.loads(text)
    except json.JSONDecodeError as error:
        raise _bad(where, f"not JSON (line {error.lineno}: {error.msg})", "a JSON object") from error
    if not isinstance(spec, dict):
        raise _bad(where, f"a {type(spec).__name__}", "a JSON object")
    expected = {*_NUMBERS, *_TEXTS, "elevation_deg"}
    if missing := sorted(expected - spec.keys()):
        raise _bad(where, f"no {', '.join(missing)}", "all of " + ", ".join(sorted(expected)))
    if unknown := sorted(spec.keys() - expected):
        raise _bad(where, f"unknown {', '.join(unknown)}", "only " + ", ".join(sorted(expected)))
    for key in _TEXTS:
        if not (isinstance(spec[key], str) and spec[key].strip()):
            raise _bad(where, f"{key} = {spec[key]!r}", "a text")
    number = {key: _number(spec[key], key, where) for key in _NUMBERS}
    elevation_rad = _elevation_rad(spec["elevation_deg"], where)
    _check_numbers(number, len(elevation_rad), where)
    return Scanner(
        name=spec["name"],
        title=spec["title"],
        source=spec["source"],
        range_min_m=number["range_min_m"],
        range_max_m=number["range_max_m"],
        n_azimuths=int(number["n_azimuths"]),
        elevation_rad=elevation_rad,
        instrument_height_min_m=number["instrument_height_min_m"],
        instrument_height_max_m=number["instrument_height_max_m"],
    )


def _number(value: object, key: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise _bad(where, f"{key} = {value!r}", "a finite number")
    return float(value)


def _check_numbers(number: dict[str, float], n_channels: int, where: str) -> None:
    n_azimuths = number["n_azimuths"]
    if n_azimuths != int(n_azimuths) or not 1 <= n_azimuths * n_channels <= MAX_BEAMS:
        raise _bad(
            where, f"n_azimuths = {n_azimuths:g}", f"a whole number, at least 1, at most {MAX_BEAMS} beams in all"
        )
    if not 0 <= number["range_min_m"] < number["range_max_m"]:
        got = f"range_min_m = {number['range_min_m']:g}, range_max_m = {number['range_max_m']:g}"
        raise _bad(where, got, "0 <= range_min_m < range_max_m")
    low, high = number["instrument_height_min_m"], number["instrument_height_max_m"]
    if not 0 < low <= high <= 100:  # no mast is longer
        got = f"instrument_height_min_m = {low:g}, instrument_height_max_m = {high:g}"
        raise _bad(where, got, "0 < instrument_height_min_m <= instrument_height_max_m <= 100")


def _elevation_rad(value: Any, where: str) -> tuple[float, ...]:
    expected = "a list of degrees in -90..90, highest first, or {first, last, count}"
    if isinstance(value, dict):
        if value.keys() != {"first", "last", "count"}:
            raise _bad(where, f"elevation_deg with {', '.join(sorted(map(str, value)))}", expected)
        first, last, count = (_number(value[key], f"elevation_deg.{key}", where) for key in ("first", "last", "count"))
        if count != int(count) or not 1 <= count <= MAX_BEAMS:
            raise _bad(where, f"elevation_deg.count = {count:g}", "a whole number, at least 1")
        degrees = np.linspace(first, last, int(count))
    elif isinstance(value, list) and value:
        degrees = np.array([_number(item, "elevation_deg", where) for item in value])
    else:
        raise _bad(where, f"elevation_deg = {value!r}"[:80], expected)
    if np.any(np.abs(degrees) > 90) or np.any(np.diff(degrees) >= 0):
        raise _bad(where, f"elevation_deg from {degrees[0]:g} to {degrees[-1]:g}", expected)
    return tuple(float(angle) for angle in np.deg2rad(degrees))


def _bad(where: str, got: str, expected: str) -> RequirementError:
    return RequirementError(f"scanner {where}: got {got}, expected {expected}; compare docs/formats/scanner.md")
