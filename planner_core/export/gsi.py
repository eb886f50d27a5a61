"""Stations as Leica GSI-8 and GSI-16: a block a station, of words for point, easting, northing and height.

Site frame. A word is its index (2 characters), information (4), a sign and 8 or 16 characters of data, filled with
zeros from the left; a blank ends it. In GSI-16 a block opens with an asterisk. There is no decimal point: position 6
gives the unit of the last digit, 0 a millimetre, 6 a tenth of one; 1 a thousandth of a foot, 7 a tenth of that. Which
foot it is, no position gives: the first block does.

    110002+0000S001 81..10+00009000 82..10+00005000 83..10+00000000 88..10+00001300 71....+000000F0

Source: Leica TPS1100 user manual 2.2.1, chapter "Data format".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from planner_core.errors import ExportError, RequirementError
from planner_core.export.chosen import chosen_stations, require_ground, stakeout_point, subtracted_remark
from planner_core.export.options import Options
from planner_core.export.point_names import fitted_names, plain_text
from planner_core.model import METRE, SiteFrame
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress

#: Option -> position 6 of a word, and digits of a metre or of a foot.
UNITS = {"mm": ("0", 3), "0.1mm": ("6", 4)}
FEET = {"0.001ft": ("1", 3), "0.0001ft": ("7", 4)}
#: Position 5: put in by hand, not measured.
_INPUT_MODE = "1"
#: Of blocks, position 3 to 6 of their first word.
_MAX_BLOCK = 10_000
#: Signs and the asterisk open words and blocks, a full stop stands for no information.
_NAME_CHARACTERS = r"[A-Za-z0-9_\-]"


@dataclass(frozen=True)
class _Layout:
    """One of the two formats. width : characters of data in a word."""

    title: str
    width: int
    mark: str
    unit: str

    def text(self, index: str, text: str, information: str = "....") -> str:
        return f"{index}{information}+{text.rjust(self.width, '0')} "

    def length(self, index: str, value: float, what: str) -> str:
        """Write a word of a length, metres or feet as `unit` is; `what` it is, for the error."""
        code, digits = (UNITS | FEET)[self.unit]
        count = round(value * 10**digits)
        if len(str(abs(count))) > self.width:
            remedy = "export GSI-16, or subtract a whole number with --subtract E,N,H"
            symbol, coarser = ("ft", "0.001ft") if self.unit in FEET else ("m", "mm")
            if self.unit != coarser:
                remedy = f"--gsi-unit {coarser} holds ten times as much; or {remedy}"
            raise ExportError(
                f"{self.title}: {what} of {value:.3f} {symbol} has {len(str(abs(count)))} digits to the {self.unit}, "
                f"expected at most {self.width}; {remedy}"
            )
        return f"{index}..{_INPUT_MODE}{code}{'-' if count < 0 else '+'}{str(abs(count)).rjust(self.width, '0')} "


def write_gsi8(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write GSI-8: names of 8 characters, coordinates of 8 digits; to the millimetre, or to 0.001 ft, where
    no other is given.

    Raises
    ------
    ExportError
        A coordinate or a subtraction of more digits, or a ground point that is not known.
    """
    return _write(plan, path, options, _Layout("GSI-8", 8, "", _unit(plan, options, 0)))


def write_gsi16(plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write GSI-16: names of 16 characters, coordinates of 16 digits; to 0.1 mm, or to 0.0001 ft, where nothing
    else is given.

    Raises
    ------
    ExportError
        A subtraction of more digits, or a ground point that is not known.
    """
    return _write(plan, path, options, _Layout("GSI-16", 16, "*", _unit(plan, options, 1)))


def _unit(plan: PlanSource, options: Options, usual: int) -> str:
    of_frame = plan.frame.unit
    units = FEET if of_frame.is_feet else UNITS
    unit = options.gsi_unit or list(units)[usual]
    if unit not in units:
        raise RequirementError(
            f"--gsi-unit: got {unit!r} for coordinates in {of_frame.many}, expected {' or '.join(units)}; leave it "
            "out, or give --units"
        )
    return unit


def _write(plan: PlanSource, path: Path, options: Options, layout: _Layout) -> tuple[str, ...]:
    stations = chosen_stations(plan, options)
    if options.instrument != "sensor":
        require_ground(stations, layout.title)
    names, remarks = fitted_names(
        [station.id for station in stations], what=layout.title, limit=layout.width, allowed=_NAME_CHARACTERS
    )
    blocks = [_system_block(plan.frame, options, layout)]
    for number, (station, name) in enumerate(zip(stations, names, strict=True), start=2):
        blocks.append(_station_block(plan, station, name, number % _MAX_BLOCK, options, layout))
    path.write_text("".join(f"{layout.mark}{block}\r\n" for block in blocks), encoding="ascii", newline="")
    zeros = [name for name in names if name.startswith("0")]
    lost = f"{layout.title} pads names with zeros, leading zeros of {', '.join(zeros[:4])} look like padding"
    return (*remarks, *((lost,) if zeros else ()), *subtracted_remark(plan, options))


def _system_block(frame: SiteFrame, options: Options, layout: _Layout) -> str:
    """Return a code block: which point is meant, in which system; readers of points pass it over."""
    words = _system_words(frame, options, layout)
    texts = [layout.text(str(42 + place), word[: layout.width]) for place, word in enumerate(words)]
    return layout.text("41", "CRS", f"{1:04d}") + "".join(texts)


def _system_words(frame: SiteFrame, options: Options, layout: _Layout) -> list[str]:
    """Return words such as GROUND, EPSG, 25832, HEIGHTS, EPSG, 7837; a code has a word of its own, for want of room.

    Feet are named after the code, as FT or FTUS; metres only where the system is in feet.
    """
    words = ["SENSOR" if options.instrument == "sensor" else "GROUND", *_name_words(frame)]
    if not frame.unit == frame.crs_unit == METRE:
        words.append(frame.unit.symbol.upper())
    if any(options.subtract):
        # The heights' system gives way: there are eight words, and these tell how to get back.
        return [*words, "LESS", *(_less_word(value, layout) for value in options.subtract)]
    return words + (["HEIGHTS", *_crs_words(frame.vertical_crs)] if frame.vertical_crs else [])


def _less_word(value: float, layout: _Layout) -> str:
    """Return what is taken off as a word's data; one that is cut off would lead back to another place."""
    text = f"{value:.15g}"
    if len(text) > layout.width or "e" in text or float(text) != value:
        raise ExportError(
            f"--subtract: got {value!r}, expected numbers of at most {layout.width} characters, as {layout.title} "
            f"holds in its first block; subtract whole {'feet' if layout.unit in FEET else 'metres'}"
        )
    return text


def _name_words(frame: SiteFrame) -> list[str]:
    if frame.is_scene:
        return ["SCENE", "NO_CRS"]
    return _crs_words(frame.crs) if frame.crs else ["LOCAL", "NO_CRS"]


def _crs_words(crs: str) -> list[str]:
    """Return the two parts of `EPSG:25832`; of a system that is written out, only that it is."""
    authority, _, code = crs.partition(":")
    return [authority, code] if authority.isalnum() and code.isalnum() else ["WKT"]


def _station_block(
    plan: PlanSource, station: FieldStation, name: str, number: int, options: Options, layout: _Layout
) -> str:
    east, north, height = stakeout_point(plan, station, options).tolist()
    words = [
        layout.text("11", name, f"{number:04d}"),
        layout.length("81", east, f"the easting of {station.id}"),
        layout.length("82", north, f"the northing of {station.id}"),
        layout.length("83", height, f"the height of {station.id}"),
    ]
    if math.isfinite(station.instrument_height_m):
        words.append(
            layout.length(
                "88", plan.frame.unit.of(station.instrument_height_m), f"the instrument height of {station.id}"
            )
        )
    words.append(layout.text("71", _remark(station.floor_id, layout.width)))
    return "".join(words)


def _remark(text: str, width: int) -> str:
    """Return the floor as a word's data: no blanks, which would end it."""
    return "_".join(plain_text(text).split())[:width]
