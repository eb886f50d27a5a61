"""Scanner specifications: JSON files beside this module, one a scanner, and files of the user's own.

What a file holds: docs/formats/scanner.md. A `Scanner` is one scanner in one mode: `rtc360` is the RTC360 in its
default mode, `rtc360:high` in another, `rtc360:4mm` with points 4 mm apart at 10 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Scanner
from planner_core.scanner.fields import (
    bad,
    check_keys,
    count,
    json_object,
    listed,
    measure,
    number,
    one_line,
    shown,
    text,
    whole_steps,
)
from planner_core.scanner.modes import ScanMode, grid_of, pick_mode, read_modes
from planner_core.scanner.range_noise import read_range_noise

#: A table larger than this is a mistake of units, or finer than a whole turn is ever scanned: it alone would need
#: gigabytes a station.
MAX_BEAMS = 200_000_000
#: Channels, or azimuths of a sector: finer than a ten-thousandth of a degree is a mistake as well.
_MAX_ANGLES = 1_000_000
_NUMBERS = ("range_min_m", "range_max_m", "instrument_height_min_m", "instrument_height_max_m")
_TEXTS = ("name", "title", "source")
_NEEDED = {*_NUMBERS, *_TEXTS, "elevation_deg"}
_GRID = {"n_azimuths", "azimuth_deg", "azimuth_offset_deg"}
_MODES = {"modes", "default_mode"}
_FIGURES = {
    "range_noise",
    "ranging_accuracy",
    "angular_accuracy_arcsec",
    "beam_divergence_mrad",
    "beam_diameter_mm",
    "beam_width_at",
    "wavelength_nm",
    "dual_axis_compensator",
}
_OPTIONAL = {*_GRID, *_MODES, *_FIGURES, "mounting"}
_MOUNTINGS = ("upright", "inverted")
_BEAM_WIDTHS = ("1/e", "1/e2", "FWHM")
#: A turn that ends this near to where it began has its first beam twice, in degrees.
_TURN_SLACK_DEG = 1e-6


@dataclass(frozen=True)
class _Beams:
    """What beams a file asks for, in one mode."""

    n_azimuths: int
    elevation_deg: FloatArray
    azimuth_range_rad: tuple[float, float] | None
    azimuth_offset_deg: FloatArray
    mode: ScanMode | None


def list_scanners() -> tuple[Scanner, ...]:
    """All scanners that come with the product, by name, each in its default mode."""
    return tuple(_read(content, where=name) for name, content in sorted(_own_files().items()))


def load_scanner(name_or_path: str | Path) -> Scanner:
    """Find a scanner by its name, or read one from a JSON file of the user's own.

    Parameters
    ----------
    name_or_path
        `NAME` or `FILE` for the default mode; `NAME:MODE` or `FILE:MODE` for another, by its id or by the spacing of
        points at 10 m (`rtc360:high`, `rtc360:4mm`). Names and modes in capitals or not.

    Raises
    ------
    RequirementError
        No such scanner, file or mode, or the file does not describe a scanner.
    """
    content, where, mode = _find(str(name_or_path))
    return _read(content, where=where, mode=mode)


def scan_modes(name_or_path: str | Path) -> tuple[ScanMode, ...]:
    """Modes of a scanner as its file lists them; empty where it has one resolution alone.

    Raises
    ------
    RequirementError
        As `load_scanner`.
    """
    content, where, _ = _find(str(name_or_path))
    spec = _spec(content, where)
    return read_modes(spec["modes"], where) if "modes" in spec else ()


def scanner_title(name_or_path: str | Path) -> str:
    """Title of a scanner whatever its mode; `Scanner.title` adds that.

    Raises
    ------
    RequirementError
        As `load_scanner`.
    """
    content, where, _ = _find(str(name_or_path))
    return str(_spec(content, where)["title"])


def _find(key: str) -> tuple[str, str, str | None]:
    """The text of the file that `key` means, what to call it, and the mode asked for, None for the default one."""
    own = _own_files()
    name, colon, mode = key.rpartition(":")
    if key.lower() in own:
        return own[key.lower()], key, None
    if colon and name.lower() in own:
        return own[name.lower()], name, mode
    if Path(key).is_file() or not colon:
        return _content(key, own), one_line(key), None
    return _content(name, own), one_line(name), mode


def _content(path: str, own: dict[str, str]) -> str:
    if not path.lower().endswith(".json") and not Path(path).is_file():
        raise RequirementError(
            f"scanner: got {shown(path)}, expected one of {', '.join(sorted(own))} or the path of a .json file; "
            "`tlsplan scanners` lists them"
        )
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: no UTF-8, or a path that no system takes
        raise RequirementError(
            f"scanner file {one_line(path)}: can't be read ({one_line(str(error))}); check the path"
        ) from error


def _own_files() -> dict[str, str]:
    folder = resources.files("planner_core.scanner")
    files = [file for file in folder.iterdir() if file.name.endswith(".json")]
    return {file.name.removesuffix(".json"): file.read_text(encoding="utf-8") for file in files}


def _read(content: str, *, where: str, mode: str | None = None) -> Scanner:
    spec = _spec(content, where)
    numbers = {key: number(spec[key], key, where) for key in _NUMBERS}
    _check_ranges(numbers, where)
    beams = _beams_of_mode(spec, mode, where) if "modes" in spec else _beams_of_file(spec, mode, where)
    mounting = spec.get("mounting", "upright")
    if mounting not in _MOUNTINGS:
        raise bad(where, f"mounting = {shown(mounting)}", " or ".join(_MOUNTINGS))
    return Scanner(
        name=spec["name"],
        title=spec["title"] if beams.mode is None else f"{spec['title']}, {beams.mode.title}",
        source=spec["source"],
        range_min_m=numbers["range_min_m"],
        range_max_m=numbers["range_max_m"],
        n_azimuths=beams.n_azimuths,
        elevation_rad=_radians(beams.elevation_deg),
        instrument_height_min_m=numbers["instrument_height_min_m"],
        instrument_height_max_m=numbers["instrument_height_max_m"],
        azimuth_range_rad=beams.azimuth_range_rad,
        azimuth_offset_rad=_radians(beams.azimuth_offset_deg),
        inverted=mounting == "inverted",
        mode="" if beams.mode is None else beams.mode.id,
        seconds_per_scan=None if beams.mode is None else beams.mode.seconds,
        **_figures(spec, where),
    )


def _spec(content: str, where: str) -> dict[str, Any]:
    spec = check_keys(json_object(content, where), "", where, needed=_NEEDED, optional=_OPTIONAL)
    for key in _TEXTS:
        text(spec[key], key, where)
    return spec


def _check_ranges(numbers: dict[str, float], where: str) -> None:
    if not 0 <= numbers["range_min_m"] < numbers["range_max_m"]:
        got = f"range_min_m = {numbers['range_min_m']:g}, range_max_m = {numbers['range_max_m']:g}"
        raise bad(where, got, "0 <= range_min_m < range_max_m")
    low, high = numbers["instrument_height_min_m"], numbers["instrument_height_max_m"]
    if not 0 < low <= high <= 100:  # no mast is longer
        got = f"instrument_height_min_m = {low:g}, instrument_height_max_m = {high:g}"
        raise bad(where, got, "0 < instrument_height_min_m <= instrument_height_max_m <= 100")


# ------------------------------------------------------------------------------------- beams by mode
def _beams_of_mode(spec: dict[str, Any], asked: str | None, where: str) -> _Beams:
    """Even beams over a full turn and the vertical field, in steps of the mode asked for or the default one."""
    modes = read_modes(spec["modes"], where)
    if given := sorted(spec.keys() & _GRID):
        raise bad(where, f"modes and {' and '.join(given)}", "either: modes say the azimuths of a full turn themselves")
    field = check_keys(spec["elevation_deg"], "elevation_deg", where, needed={"first", "last"})
    first, last = (_angle(field[end], f"elevation_deg.{end}", where) for end in ("first", "last"))
    if not first > last:
        raise bad(where, f"elevation_deg from {first:g} to {last:g}", "first > last: the highest angle comes first")
    default = pick_mode(_default_mode(spec, modes, where), modes, where)
    mode = default if asked is None else pick_mode(asked, modes, where)
    grid = grid_of(mode, field_rad=math.radians(first - last))
    if grid.n_beams > MAX_BEAMS or max(grid.n_azimuths, grid.n_channels) > _MAX_ANGLES:
        raise bad(
            where,
            f"mode {mode.id}, {grid.n_azimuths} azimuths x {grid.n_channels} channels",
            f"at most {MAX_BEAMS} beams in all",
            f"pick a coarser mode or spacing, such as {where}:6mm",
        )
    elevation_deg = np.linspace(first, last, grid.n_channels)
    return _Beams(grid.n_azimuths, elevation_deg, None, np.empty(0), mode)


def _default_mode(spec: dict[str, Any], modes: tuple[ScanMode, ...], where: str) -> str:
    if "default_mode" in spec:
        return text(spec["default_mode"], "default_mode", where)
    if len(modes) > 1:
        raise bad(where, f"{len(modes)} modes and no default_mode", "default_mode: the mode to take if none is named")
    return modes[0].id


def _angle(value: Any, key: str, where: str) -> float:
    degrees = number(value, key, where)
    if abs(degrees) > 90:
        raise bad(where, f"{key} = {degrees:g}", "degrees in -90..90")
    return degrees


# ----------------------------------------------------------------------------- beams listed one by one
def _beams_of_file(spec: dict[str, Any], asked: str | None, where: str) -> _Beams:
    """The beams of a file without modes: each channel's elevation and offset, azimuths of a turn or a sector."""
    if asked is not None:
        raise bad(where, f"mode {shown(asked)}", "no mode: it has one resolution alone", f"use {where}")
    if "default_mode" in spec:
        raise bad(where, "default_mode without modes", "both or none")
    elevation_deg = _elevation_deg(spec["elevation_deg"], where)
    n_azimuths, azimuth_range_rad = _azimuths(spec, where)
    if n_azimuths * elevation_deg.size > MAX_BEAMS:
        raise bad(where, f"{n_azimuths} azimuths x {elevation_deg.size} channels", f"at most {MAX_BEAMS} beams in all")
    offset_deg = _azimuth_offset_deg(spec.get("azimuth_offset_deg", []), elevation_deg.size, where)
    _check_channels(elevation_deg, offset_deg, where)
    return _Beams(n_azimuths, elevation_deg, azimuth_range_rad, offset_deg, None)


def _azimuths(spec: dict[str, Any], where: str) -> tuple[int, tuple[float, float] | None]:
    """Their number, and the first and the last in radians, or None for a full turn from 0."""
    if ("n_azimuths" in spec) == ("azimuth_deg" in spec):
        got = "both n_azimuths and azimuth_deg" if "n_azimuths" in spec else "neither n_azimuths nor azimuth_deg"
        raise bad(where, got, "n_azimuths for a full turn, or azimuth_deg, or modes")
    if "n_azimuths" in spec:
        return count(spec["n_azimuths"], "n_azimuths", where, MAX_BEAMS), None
    value = spec["azimuth_deg"]
    if isinstance(value, dict) and value.keys() == {"step"}:
        step = number(value["step"], "azimuth_deg.step", where)
        return whole_steps(360.0, step, "azimuth_deg", where, most=_MAX_ANGLES), None
    first, last, n = _even(value, "azimuth_deg", "{first, last, count}, {first, last, step} or {step}", where)
    if not (-360 <= first <= last <= 360 and (first < last) == (n > 1)):
        got = f"azimuth_deg from {first:g} to {last:g}, {n} in all"
        raise bad(where, got, "-360 <= first <= last <= 360, and first < last if there is more than one")
    if last - first >= 360 - _TURN_SLACK_DEG:
        got = f"azimuth_deg from {first:g} to {last:g}: the last beam is the first again"
        raise bad(where, got, 'less than a turn; for a full turn give n_azimuths or {"step": ...}')
    return n, (math.radians(first), math.radians(last))


def _elevation_deg(value: Any, where: str) -> FloatArray:
    if isinstance(value, list) and value:
        degrees = np.array([number(item, "elevation_deg", where) for item in value])
    else:
        expected = "a list of degrees, {first, last, count} or {first, last, step}"
        first, last, n = _even(value, "elevation_deg", expected, where)
        if (first > last) != (n > 1):
            got = f"elevation_deg from {first:g} to {last:g}, {n} in all"
            raise bad(where, got, "first > last if there is more than one")
        degrees = np.linspace(first, last, n)
    if np.any(np.abs(degrees) > 90):
        wrong = degrees[np.argmax(np.abs(degrees) > 90)]
        raise bad(where, f"elevation_deg = {wrong:g}", "degrees in -90..90")
    return degrees


def _even(value: Any, key: str, expected: str, where: str) -> tuple[float, float, int]:
    """First, last and count of {first, last, count} or {first, last, step}."""
    if not isinstance(value, dict):
        raise bad(where, f"{key} = {shown(value)}", expected)
    if value.keys() not in ({"first", "last", "count"}, {"first", "last", "step"}):
        raise bad(where, f"{key} with {listed(value)}", expected)
    first, last = (number(value[end], f"{key}.{end}", where) for end in ("first", "last"))
    if "count" in value:
        return first, last, count(value["count"], f"{key}.count", where, _MAX_ANGLES)
    step = number(value["step"], f"{key}.step", where)
    return first, last, 1 + whole_steps(abs(last - first), step, key, where, most=_MAX_ANGLES)


def _azimuth_offset_deg(value: Any, n_channels: int, where: str) -> FloatArray:
    if not isinstance(value, list) or len(value) not in (0, n_channels):
        got = f"a list of {len(value)}" if isinstance(value, list) else shown(value)
        raise bad(where, f"azimuth_offset_deg = {got}", f"a list of {n_channels} degrees, one a channel")
    offset_deg = np.array([number(item, "azimuth_offset_deg", where) for item in value])
    if np.any(np.abs(offset_deg) > 180):
        wrong = offset_deg[np.argmax(np.abs(offset_deg) > 180)]
        raise bad(where, f"azimuth_offset_deg = {wrong:g}", "degrees in -180..180")
    return offset_deg


def _check_channels(elevation_deg: FloatArray, offset_deg: FloatArray, where: str) -> None:
    """Channels go from the highest to the lowest, so that rows of a scan do; none is there twice."""
    drop = -np.diff(elevation_deg)
    rising = np.flatnonzero(drop < 0)
    if rising.size:
        k = int(rising[0])
        got = f"elevation_deg rising from {elevation_deg[k]:g} to {elevation_deg[k + 1]:g} at channel {k + 2}"
        raise bad(where, got, "the highest channel first; sort the channels, azimuth_offset_deg along with them")
    turned = offset_deg % 360.0 if offset_deg.size else np.zeros_like(elevation_deg)
    order = np.lexsort([turned, elevation_deg])
    twice = np.flatnonzero((np.diff(elevation_deg[order]) == 0) & (np.diff(turned[order]) == 0))
    if twice.size:
        first, second = sorted(order[twice[0] : twice[0] + 2].tolist())
        got = f"elevation_deg = {elevation_deg[first]:g} for channels {first + 1} and {second + 1}"
        raise bad(where, got, "channels that differ in elevation_deg or azimuth_offset_deg")


# --------------------------------------------------------------------------- figures of the data sheet
def _figures(spec: dict[str, Any], where: str) -> dict[str, Any]:
    """The optional figures as fields of `Scanner`; what the file does not tell stays None or empty."""
    compensator = spec.get("dual_axis_compensator")
    if compensator is not None and not isinstance(compensator, bool):
        raise bad(where, f"dual_axis_compensator = {shown(compensator)}", "true or false")
    arcsec = _optional(spec, "angular_accuracy_arcsec", where, most=3600.0)
    return {
        "range_noise": read_range_noise(spec.get("range_noise", []), where),
        "ranging_accuracy": _ranging_accuracy(spec, where),
        "angular_accuracy_rad": None if arcsec is None else math.radians(arcsec / 3600.0),
        "beam_divergence_rad": _scaled(_optional(spec, "beam_divergence_mrad", where, most=100.0), 1e3),
        "beam_diameter_m": _scaled(_optional(spec, "beam_diameter_mm", where, most=1000.0), 1e3),
        "beam_width_at": _beam_width_at(spec, where),
        "wavelength_m": _scaled(_optional(spec, "wavelength_nm", where, most=100_000.0), 1e9),
        "dual_axis_compensator": compensator,
    }


def _ranging_accuracy(spec: dict[str, Any], where: str) -> tuple[float, float] | None:
    """Millimetres and parts per million of the range, as data sheets write `1.0 mm + 10 ppm`."""
    if "ranging_accuracy" not in spec:
        return None
    value = check_keys(spec["ranging_accuracy"], "ranging_accuracy", where, needed={"mm"}, optional={"ppm"})
    constant_mm = measure(value["mm"], "ranging_accuracy.mm", where, above=0.0, most=1000.0)
    ppm = number(value.get("ppm", 0), "ranging_accuracy.ppm", where)
    if not 0 <= ppm <= 10_000:
        raise bad(where, f"ranging_accuracy.ppm = {ppm:g}", "0 to 10000")
    return constant_mm / 1000.0, ppm / 1e6


def _beam_width_at(spec: dict[str, Any], where: str) -> str:
    value = spec.get("beam_width_at", "")
    if "beam_width_at" in spec and value not in _BEAM_WIDTHS:
        raise bad(where, f"beam_width_at = {shown(value)}", " or ".join(_BEAM_WIDTHS))
    return str(value)


def _optional(spec: dict[str, Any], key: str, where: str, *, most: float) -> float | None:
    return measure(spec[key], key, where, above=0.0, most=most) if key in spec else None


def _scaled(value: float | None, parts: float) -> float | None:
    """`value` of a unit that goes `parts` times into the one we use: dividing rounds as the decimal fraction does."""
    return None if value is None else value / parts


def _radians(degrees: FloatArray) -> tuple[float, ...]:
    return tuple(float(angle) for angle in np.deg2rad(degrees))
