"""Scanner specifications: JSON files beside this module, one a scanner, and files of the user's own.

What a file holds: docs/formats/scanner.md.
"""

from __future__ import annotations

import json
import math
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Scanner

#: A table larger than this is a mistake of units, not a scanner: it alone would need gigabytes a station.
MAX_BEAMS = 200_000_000
#: Channels, or azimuths of a sector: finer than a ten-thousandth of a degree is a mistake as well.
_MAX_ANGLES = 1_000_000
_NUMBERS = ("range_min_m", "range_max_m", "instrument_height_min_m", "instrument_height_max_m")
_TEXTS = ("name", "title", "source")
_NEEDED = {*_NUMBERS, *_TEXTS, "elevation_deg"}
_OPTIONAL = {"n_azimuths", "azimuth_deg", "azimuth_offset_deg", "mounting"}
_MOUNTINGS = ("upright", "inverted")
#: Steps that first and last may be apart by more or less than a whole number: decimal fractions of a degree.
_STEP_SLACK = 1e-6


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
    spec = _spec(text, where)
    number = {key: _number(spec[key], key, where) for key in _NUMBERS}
    _check_ranges(number, where)
    elevation_deg = _elevation_deg(spec["elevation_deg"], where)
    n_azimuths, azimuth_range_rad = _azimuths(spec, where)
    if n_azimuths * elevation_deg.size > MAX_BEAMS:
        raise _bad(where, f"{n_azimuths} azimuths x {elevation_deg.size} channels", f"at most {MAX_BEAMS} beams in all")
    offset_deg = _azimuth_offset_deg(spec.get("azimuth_offset_deg", []), elevation_deg.size, where)
    _check_channels(elevation_deg, offset_deg, where)
    mounting = spec.get("mounting", "upright")
    if mounting not in _MOUNTINGS:
        raise _bad(where, f"mounting = {mounting!r}", " or ".join(_MOUNTINGS))
    return Scanner(
        name=spec["name"],
        title=spec["title"],
        source=spec["source"],
        range_min_m=number["range_min_m"],
        range_max_m=number["range_max_m"],
        n_azimuths=n_azimuths,
        elevation_rad=_radians(elevation_deg),
        instrument_height_min_m=number["instrument_height_min_m"],
        instrument_height_max_m=number["instrument_height_max_m"],
        azimuth_range_rad=azimuth_range_rad,
        azimuth_offset_rad=_radians(offset_deg),
        inverted=mounting == "inverted",
    )


def _spec(text: str, where: str) -> dict[str, Any]:
    try:
        spec = json.loads(text)
    except json.JSONDecodeError as error:
        raise _bad(where, f"not JSON (line {error.lineno}: {error.msg})", "a JSON object") from error
    except (ValueError, RecursionError) as error:  # whole numbers of thousands of digits; a thousand brackets
        raise _bad(where, "numbers or brackets beyond what JSON readers take", "a JSON object") from error
    if not isinstance(spec, dict):
        raise _bad(where, f"a {type(spec).__name__}", "a JSON object")
    if missing := sorted(_NEEDED - spec.keys()):
        raise _bad(where, f"no {', '.join(missing)}", "all of " + ", ".join(sorted(_NEEDED)))
    if unknown := sorted(spec.keys() - _NEEDED - _OPTIONAL):
        raise _bad(where, f"unknown {', '.join(unknown)}", "only " + ", ".join(sorted(_NEEDED | _OPTIONAL)))
    for key in _TEXTS:
        if not (isinstance(spec[key], str) and spec[key].strip() and _is_text(spec[key])):
            raise _bad(where, f"{key} = {spec[key]!r}", "a text")
    return spec


def _is_text(value: str) -> bool:
    """Whether other programs can have it: half a character (a lone surrogate) is none in UTF-8."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _number(value: object, key: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= sys.float_info.max:
        raise _bad(
            where, f"{key} = {str(value)[:40]}" if isinstance(value, int) else f"{key} = {value!r}", "a finite number"
        )
    return float(value)


def _count(value: object, key: str, where: str, most: int) -> int:
    count = _number(value, key, where)
    if count != int(count) or not 1 <= count <= most:
        raise _bad(where, f"{key} = {count:g}", f"a whole number from 1 to {most}")
    return int(count)


def _check_ranges(number: dict[str, float], where: str) -> None:
    if not 0 <= number["range_min_m"] < number["range_max_m"]:
        got = f"range_min_m = {number['range_min_m']:g}, range_max_m = {number['range_max_m']:g}"
        raise _bad(where, got, "0 <= range_min_m < range_max_m")
    low, high = number["instrument_height_min_m"], number["instrument_height_max_m"]
    if not 0 < low <= high <= 100:  # no mast is longer
        got = f"instrument_height_min_m = {low:g}, instrument_height_max_m = {high:g}"
        raise _bad(where, got, "0 < instrument_height_min_m <= instrument_height_max_m <= 100")


def _azimuths(spec: dict[str, Any], where: str) -> tuple[int, tuple[float, float] | None]:
    """Their number, and the first and the last in radians, or None for a full turn from 0."""
    if ("n_azimuths" in spec) == ("azimuth_deg" in spec):
        got = "both n_azimuths and azimuth_deg" if "n_azimuths" in spec else "neither n_azimuths nor azimuth_deg"
        raise _bad(where, got, "n_azimuths for a full turn, or azimuth_deg")
    if "n_azimuths" in spec:
        return _count(spec["n_azimuths"], "n_azimuths", where, MAX_BEAMS), None
    value = spec["azimuth_deg"]
    if isinstance(value, dict) and value.keys() == {"step"}:
        step = _number(value["step"], "azimuth_deg.step", where)
        return _whole_steps(360.0, step, "azimuth_deg", where), None
    first, last, count = _even(value, "azimuth_deg", "{first, last, count}, {first, last, step} or {step}", where)
    if not (-360 <= first <= last <= 360 and (first < last) == (count > 1)):
        got = f"azimuth_deg from {first:g} to {last:g}, {count} in all"
        raise _bad(where, got, "-360 <= first <= last <= 360, and first < last if there is more than one")
    if last - first >= 360 - _STEP_SLACK:
        got = f"azimuth_deg from {first:g} to {last:g}: the last beam is the first again"
        raise _bad(where, got, 'less than a turn; for a full turn give n_azimuths or {"step": ...}')
    return count, (math.radians(first), math.radians(last))


def _elevation_deg(value: Any, where: str) -> FloatArray:
    if isinstance(value, list) and value:
        degrees = np.array([_number(item, "elevation_deg", where) for item in value])
    else:
        expected = "a list of degrees, {first, last, count} or {first, last, step}"
        first, last, count = _even(value, "elevation_deg", expected, where)
        if (first > last) != (count > 1):
            got = f"elevation_deg from {first:g} to {last:g}, {count} in all"
            raise _bad(where, got, "first > last if there is more than one")
        degrees = np.linspace(first, last, count)
    if np.any(np.abs(degrees) > 90):
        wrong = degrees[np.argmax(np.abs(degrees) > 90)]
        raise _bad(where, f"elevation_deg = {wrong:g}", "degrees in -90..90")
    return degrees


def _even(value: Any, key: str, expected: str, where: str) -> tuple[float, float, int]:
    """First, last and count of {first, last, count} or {first, last, step}."""
    if not isinstance(value, dict):
        raise _bad(where, f"{key} = {value!r}"[:80], expected)
    if value.keys() not in ({"first", "last", "count"}, {"first", "last", "step"}):
        raise _bad(where, f"{key} with {', '.join(sorted(map(str, value))) or 'nothing'}", expected)
    first, last = (_number(value[end], f"{key}.{end}", where) for end in ("first", "last"))
    if "count" in value:
        return first, last, _count(value["count"], f"{key}.count", where, _MAX_ANGLES)
    step = _number(value["step"], f"{key}.step", where)
    return first, last, 1 + _whole_steps(abs(last - first), step, key, where)


def _whole_steps(span_deg: float, step_deg: float, key: str, where: str) -> int:
    if not step_deg > 0 or span_deg / step_deg >= _MAX_ANGLES:
        raise _bad(where, f"{key}.step = {step_deg:g}", f"a positive angle, less than {_MAX_ANGLES} steps")
    steps = span_deg / step_deg
    if abs(steps - round(steps)) > _STEP_SLACK * max(1.0, steps):
        got = f"{key}.step = {step_deg:g}, {steps:.6g} times in {span_deg:g} degrees"
        raise _bad(where, got, "a whole number of steps; change the step or give a count")
    return round(steps)


def _azimuth_offset_deg(value: Any, n_channels: int, where: str) -> FloatArray:
    if not isinstance(value, list) or len(value) not in (0, n_channels):
        got = f"a list of {len(value)}" if isinstance(value, list) else repr(value)[:60]
        raise _bad(where, f"azimuth_offset_deg = {got}", f"a list of {n_channels} degrees, one a channel")
    offset_deg = np.array([_number(item, "azimuth_offset_deg", where) for item in value])
    if np.any(np.abs(offset_deg) > 180):
        wrong = offset_deg[np.argmax(np.abs(offset_deg) > 180)]
        raise _bad(where, f"azimuth_offset_deg = {wrong:g}", "degrees in -180..180")
    return offset_deg


def _check_channels(elevation_deg: FloatArray, offset_deg: FloatArray, where: str) -> None:
    """Channels go from the highest to the lowest, so that rows of a scan do; none is there twice."""
    drop = -np.diff(elevation_deg)
    rising = np.flatnonzero(drop < 0)
    if rising.size:
        k = int(rising[0])
        got = f"elevation_deg rising from {elevation_deg[k]:g} to {elevation_deg[k + 1]:g} at channel {k + 2}"
        raise _bad(where, got, "the highest channel first; sort the channels, azimuth_offset_deg along with them")
    turned = offset_deg % 360.0 if offset_deg.size else np.zeros_like(elevation_deg)
    order = np.lexsort([turned, elevation_deg])
    twice = np.flatnonzero((np.diff(elevation_deg[order]) == 0) & (np.diff(turned[order]) == 0))
    if twice.size:
        first, second = sorted(order[twice[0] : twice[0] + 2].tolist())
        got = f"elevation_deg = {elevation_deg[first]:g} for channels {first + 1} and {second + 1}"
        raise _bad(where, got, "channels that differ in elevation_deg or azimuth_offset_deg")


def _radians(degrees: FloatArray) -> tuple[float, ...]:
    return tuple(float(angle) for angle in np.deg2rad(degrees))


def _bad(where: str, got: str, expected: str) -> RequirementError:
    return RequirementError(f"scanner {where}: got {got}, expected {expected}; compare docs/formats/scanner.md")
