"""Scanner specifications: JSON files beside this module, one a scanner, and files of the user's own.

What a file holds: docs/formats/scanner.md. A `Scanner` is one scanner in one mode: `rtc360` is the RTC360 in its
default mode, `rtc360:high` in another, `rtc360:4mm` with points 4 mm apart at 10 m.
"""

from __future__ import annotations

import json
import math
from importlib import resources
from pathlib import Path

import numpy as np

from planner_core.documents import read_as, shown
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, PreAlignment, Scanner
from planner_core.scanner.modes import ScanMode, bad, grid_of, pick_mode
from planner_core.scanner.scanner_file import MAX_ANGLES, MAX_BEAMS, ScannerFile


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

    Where `Scanner.mode` is "" by default, they come besides the resolution that has no name.

    Raises
    ------
    RequirementError
        As `load_scanner`.
    """
    content, where, _ = _find(str(name_or_path))
    spec = _specification(content, where)
    return tuple(entry.mode() for entry in spec.modes or ()) + _channel_modes(spec)


def scanner_title(name_or_path: str | Path) -> str:
    """Title of a scanner whatever its mode; `Scanner.title` adds that.

    Raises
    ------
    RequirementError
        As `load_scanner`.
    """
    content, where, _ = _find(str(name_or_path))
    return _specification(content, where).title


def _find(key: str) -> tuple[str, str, str | None]:
    """The text of the file that `key` means, what to call it, and the mode required, None for the default one."""
    own = _own_files()
    name, colon, mode = key.rpartition(":")
    if key.lower() in own:
        return own[key.lower()], key, None
    if colon and name.lower() in own:
        return own[name.lower()], name, mode
    if Path(key).is_file() or not colon:
        return _content(key, own), _one_line(key), None
    return _content(name, own), _one_line(name), mode


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
            f"scanner file {_one_line(path)}: can't be read ({_one_line(str(error))}); check the path"
        ) from error


def _own_files() -> dict[str, str]:
    folder = resources.files("planner_core.scanner")
    files = [file for file in folder.iterdir() if file.name.endswith(".json")]
    return {file.name.removesuffix(".json"): file.read_text(encoding="utf-8") for file in files}


def _one_line(name: str) -> str:
    """A path or name as a message may hold it: line breaks and what else can't be printed as question marks."""
    return "".join(character if character.isprintable() else "?" for character in name)


def _specification(content: str, where: str) -> ScannerFile:
    try:
        spec = json.loads(content)
    except json.JSONDecodeError as error:
        raise bad(where, f"not JSON (line {error.lineno}: {error.msg})", "a JSON object") from error
    except (ValueError, RecursionError) as error:  # whole numbers of thousands of digits; a thousand brackets
        raise bad(where, "numbers or brackets beyond what JSON readers take", "a JSON object") from error
    return read_as(ScannerFile, spec, f"scanner {where}: ", remedy="mind the unit, compare docs/formats/scanner.md")


def _read(content: str, *, where: str, mode: str | None = None) -> Scanner:
    spec = _specification(content, where)
    picked: ScanMode | None
    if spec.modes:
        picked, n_azimuths, elevation_deg = _beams_of_mode(spec, mode, where)
        sector_deg = None
    else:
        picked = None if mode is None else _channel_mode(spec, mode, where)
        elevation_deg = np.array(spec.channels_deg()) if picked is None else np.rad2deg(picked.elevation_rad)
        n_azimuths, sector_deg = spec.azimuths()
    accuracy, arcsec = spec.ranging_accuracy, spec.angular_accuracy_arcsec
    noise = sorted((row.reflectivity, row.range_m, row.sigma_mm / 1000.0) for row in spec.range_noise)
    return Scanner(
        name=spec.name,
        title=spec.title if picked is None else f"{spec.title}, {picked.title}",
        source=spec.source,
        range_min_m=spec.range_min_m,
        range_max_m=spec.range_max_m,
        n_azimuths=n_azimuths,
        elevation_rad=_radians(elevation_deg),
        instrument_height_min_m=spec.instrument_height_min_m,
        instrument_height_usual_m=spec.instrument_height_usual_m,
        instrument_height_max_m=spec.instrument_height_max_m,
        azimuth_range_rad=None if sector_deg is None else (math.radians(sector_deg[0]), math.radians(sector_deg[1])),
        azimuth_offset_rad=_radians(np.array(spec.azimuth_offset_deg)),
        inverted=spec.mounting == "inverted",
        mode="" if picked is None else picked.id,
        seconds_per_scan=None if picked is None else picked.seconds,
        range_noise=tuple((range_m, reflectivity, sigma_m) for reflectivity, range_m, sigma_m in noise),
        ranging_accuracy=None if accuracy is None else (accuracy.mm / 1000.0, accuracy.ppm / 1e6),
        angular_accuracy_rad=None if arcsec is None else math.radians(arcsec / 3600.0),
        beam_divergence_rad=_scaled(spec.beam_divergence_mrad, 1e3),
        beam_diameter_m=_scaled(spec.beam_diameter_mm, 1e3),
        beam_width_at=spec.beam_width_at or "",
        wavelength_m=_scaled(spec.wavelength_nm, 1e9),
        dual_axis_compensator=spec.dual_axis_compensator,
        pre_alignment=PreAlignment(spec.pre_alignment),
    )


def _beams_of_mode(spec: ScannerFile, mode_name: str | None, where: str) -> tuple[ScanMode, int, FloatArray]:
    """Even beams over a full turn and the vertical field, in steps of the mode required or the default one."""
    modes = tuple(entry.mode() for entry in spec.modes or ())
    default = pick_mode(spec.default_mode or modes[0].id, modes, where)
    mode = default if mode_name is None else pick_mode(mode_name, modes, where)
    field = spec.vertical_field()
    grid = grid_of(mode, field_rad=math.radians(field.first - field.last))
    if grid.n_beams > MAX_BEAMS or max(grid.n_azimuths, grid.n_channels) > MAX_ANGLES:
        raise bad(
            where,
            f"mode {mode.id}, {grid.n_azimuths} azimuths x {grid.n_channels} channels",
            f"at most {MAX_BEAMS} beams in all",
            f"pick a coarser mode or spacing, such as {where}:6mm",
        )
    return mode, grid.n_azimuths, np.linspace(field.first, field.last, grid.n_channels)


def _channel_modes(spec: ScannerFile) -> tuple[ScanMode, ...]:
    return tuple(entry.mode(spec.azimuths()[0]) for entry in spec.channel_modes)


def _channel_mode(spec: ScannerFile, mode_name: str, where: str) -> ScanMode:
    """The table of channels that is required, of a scanner that lists channels one by one."""
    modes = {mode.id: mode for mode in _channel_modes(spec)}
    if not modes:
        raise bad(where, f"mode {shown(mode_name)}", "no mode: it has one resolution alone", f"use {where}")
    found = modes.get(mode_name.strip().lower())
    if found is None:
        raise bad(where, f"mode {shown(mode_name)}", " or ".join(modes), f"pick one, or {where} for its default")
    return found


def _scaled(value: float | None, parts: float) -> float | None:
    """`value` of a unit that goes `parts` times into the one we use: dividing rounds as the decimal fraction does."""
    return None if value is None else value / parts


def _radians(degrees: FloatArray) -> tuple[float, ...]:
    return tuple(float(angle) for angle in np.deg2rad(degrees))
