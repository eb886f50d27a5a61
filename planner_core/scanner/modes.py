"""Resolution modes of a scanner: a mode's angular steps, and the azimuths and channels that follow from them.

A mode's file entry (docs/formats/scanner.md) -> `ScanMode`; `ScanMode` and vertical field -> `Grid`. Radians inside.

A step rarely fits the turn and the vertical field a whole number of times. The nearest number of steps is taken, halves
upwards: floor(2 pi / step + 1/2) azimuths in a turn, and floor(field / step + 1/2) + 1 channels from the field's top to
its bottom, both included. So beams are even, and at most half a step in the whole field away from the step asked for.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from planner_core.scanner.fields import bad, check_keys, measure, shown, text

#: Where data sheets state the distance between neighbouring points.
SPACING_DISTANCE_M = 10.0
#: A coarser step is a mistake of units: a wall would get a handful of points.
_MAX_STEP_DEG = 30.0
_MAX_SPACING_MM = 5000.0
#: A finer one is a mistake as well; its number of steps need not be finite.
_LEAST = 1e-6
#: No scan takes a day.
_MAX_SECONDS = 86_400.0
_MAX_MODES = 100
_ID = re.compile(r"[a-z0-9][a-z0-9.+-]{0,39}")
_SPACING = re.compile(r"([0-9]{1,4}(?:\.[0-9]{1,4})?)mm")


@dataclass(frozen=True)
class ScanMode:
    """One resolution: what an operator picks on the instrument. Steps in radians; `seconds` None: not known."""

    id: str
    title: str
    azimuth_step_rad: float
    elevation_step_rad: float
    seconds: float | None = None


@dataclass(frozen=True)
class Grid:
    """Numbers of beams of a scan: columns and rows."""

    n_azimuths: int
    n_channels: int

    @property
    def n_beams(self) -> int:
        """Number of beams of a scan."""
        return self.n_azimuths * self.n_channels


def grid_of(mode: ScanMode, *, field_rad: float) -> Grid:
    """Round the steps of `mode` to a full turn and to a vertical field of `field_rad`; see the head of this file."""
    return Grid(
        n_azimuths=max(1, math.floor(2 * math.pi / mode.azimuth_step_rad + 0.5)),
        n_channels=1 + max(1, math.floor(field_rad / mode.elevation_step_rad + 0.5)),
    )


def spacing_mode(name: str) -> ScanMode | None:
    """Return the mode that `6mm` names, points so far apart at 10 m; None where `name` is no such spacing."""
    match = _SPACING.fullmatch(name.strip().lower().replace(" ", ""))
    if match is None or not 0 < float(match[1]) <= _MAX_SPACING_MM:
        return None
    spacing_mm = float(match[1])
    return _even(f"{spacing_mm:g}mm", f"{spacing_mm:g} mm at 10 m", _spacing_rad(spacing_mm))


def read_modes(value: Any, where: str) -> tuple[ScanMode, ...]:
    """Read the entry `modes` of a scanner file: at least one mode, no id twice."""
    if not isinstance(value, list) or not 1 <= len(value) <= _MAX_MODES:
        raise bad(where, f"modes = {shown(value)}", f"a list of 1 to {_MAX_MODES} modes")
    modes = tuple(_read_mode(item, f"mode {k}", where) for k, item in enumerate(value, 1))
    ids = [mode.id for mode in modes]
    if twice := sorted({name for name in ids if ids.count(name) > 1}):
        raise bad(where, f"mode id {twice[0]!r} twice", "another id for each mode")
    return modes


def pick_mode(asked: str, modes: tuple[ScanMode, ...], where: str) -> ScanMode:
    """Return the mode of that id, or the one of that spacing at 10 m.

    Raises
    ------
    RequirementError
        `asked` is neither; the message lists the ids.
    """
    name = asked.strip().lower()
    found = next((mode for mode in modes if mode.id == name), None) or spacing_mode(name)
    if found is None:
        ids = ", ".join(mode.id for mode in modes)
        raise bad(where, f"mode {shown(asked)}", f"{ids}, or a spacing at 10 m such as 6mm", "pick one of these")
    return found


def _read_mode(value: Any, what: str, where: str) -> ScanMode:
    steps = {"spacing_at_10m_mm", "step_deg", "azimuth_step_deg", "elevation_step_deg"}
    spec = check_keys(value, what, where, needed={"id", "title"}, optional={"seconds", *steps})
    name = text(spec["id"], f"{what}: id", where)
    if not _ID.fullmatch(name):
        raise bad(where, f"{what}: id = {shown(name)}", "small letters, digits, dots, dashes and pluses, at most 40")
    title = text(spec["title"], f"{what}: title", where)
    azimuth_rad, elevation_rad = _steps_rad(spec, what, where)
    spacing = spacing_mode(name)
    if spacing is not None and not math.isclose(spacing.azimuth_step_rad, azimuth_rad, rel_tol=1e-9):
        raise bad(where, f"{what}: id {name} with another spacing", "an id that is no spacing, or that spacing")
    seconds = spec.get("seconds")
    if seconds is not None:
        seconds = measure(seconds, f"{what}: seconds", where, above=0.0, most=_MAX_SECONDS)
    return ScanMode(name, title, azimuth_rad, elevation_rad, seconds)


def _steps_rad(spec: dict[str, Any], what: str, where: str) -> tuple[float, float]:
    """Steps of azimuth and elevation, from whichever of the three ways the file uses."""
    given = sorted(spec.keys() & {"spacing_at_10m_mm", "step_deg", "azimuth_step_deg", "elevation_step_deg"})
    if given == ["spacing_at_10m_mm"]:
        key = "spacing_at_10m_mm"
        step_rad = _spacing_rad(measure(spec[key], f"{what}: {key}", where, above=_LEAST, most=_MAX_SPACING_MM))
        return step_rad, step_rad
    if given not in (["step_deg"], ["azimuth_step_deg", "elevation_step_deg"]):
        got = f"{what}: {' and '.join(given) or 'no step'}"
        raise bad(where, got, "spacing_at_10m_mm, or step_deg, or azimuth_step_deg and elevation_step_deg")
    found = [math.radians(measure(spec[k], f"{what}: {k}", where, above=_LEAST, most=_MAX_STEP_DEG)) for k in given]
    return found[0], found[-1]


def _spacing_rad(spacing_mm: float) -> float:
    """Angle between points `spacing_mm` apart at 10 m, as an arc."""
    return spacing_mm / 1000.0 / SPACING_DISTANCE_M


def _even(name: str, title: str, step_rad: float) -> ScanMode:
    return ScanMode(name, title, step_rad, step_rad)
