"""Where things are on a sheet: paper sizes, the band of legend and title, scales, and at which of them a floor fits.

Scales are those that rulers have, metric and of the United States.

Millimetres on paper, metres in plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import METRE, FloatArray, LengthUnit
from planner_core.plan_folder.drawing.canvas import Box

#: (short, long) side.
PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0)}
_ZOOM = {"A3": 1.2}
MARGIN_MM = 8.0
BAND_MM = 35.0
"""Height of the band with legend, scale and title at the foot of drawings."""
#: Tiles of one floor overlap by this much.
_OVERLAP_MM = 12.0
#: Between a floor and the frame of its drawing.
_AIR_MM = 7.0


_METRIC = (50, 75, 100, 125, 200, 250, 500)
#: Scales that architects and engineers draw feet at: so many inches are so many feet.
_OF_FEET = {
    24: '1/2" = 1\'-0"',
    48: '1/4" = 1\'-0"',
    64: '3/16" = 1\'-0"',
    96: '1/8" = 1\'-0"',
    128: '3/32" = 1\'-0"',
    192: '1/16" = 1\'-0"',
    240: "1\" = 20'",
    480: "1\" = 40'",
    1200: "1\" = 100'",
    2400: "1\" = 200'",
    6000: "1\" = 500'",
}


def sheet_scales(unit: LengthUnit) -> tuple[int, ...]:
    """Scales of sheets, largest first: 96 is 1:96."""
    return tuple(scale for scale in _OF_FEET if 48 <= scale <= 480) if unit.is_feet else _METRIC


def drawing_scales(unit: LengthUnit) -> tuple[int, ...]:
    """Scales of sheets in CAD drawings; as `sheet_scales`."""
    return tuple(_OF_FEET) if unit.is_feet else (20, 50, 100, 200, 500, 1000, 2000, 5000)


def scale_name(scale: int, unit: LengthUnit) -> str:
    """What a ruler in feet calls a scale, `1/8" = 1'-0"`; empty for metric ones, which have no other name."""
    return _OF_FEET.get(scale, "") if unit.is_feet else ""


@dataclass(frozen=True)
class Sheet:
    """A sheet of paper, this way up."""

    paper: str
    width_mm: float
    height_mm: float

    @property
    def frame(self) -> Box:
        """Inside the margins."""
        return Box(0, 0, self.width_mm, self.height_mm).inset(MARGIN_MM)

    @property
    def band(self) -> Box:
        """Of legend and title."""
        return Box(MARGIN_MM, MARGIN_MM, self.width_mm - 2 * MARGIN_MM, BAND_MM)

    @property
    def drawing(self) -> Box:
        """Above the band."""
        frame = self.frame
        return Box(frame.left, frame.bottom + BAND_MM, frame.width, frame.height - BAND_MM)


def sheet_of(paper: str, *, upright: bool) -> Sheet:
    """Return a sheet by the name of its paper, in any case.

    Raises
    ------
    RequirementError
        There is none of that name.
    """
    sides = PAPERS.get(paper.upper())
    if sides is None:
        raise RequirementError(f"paper: got {paper!r}, expected one of {', '.join(PAPERS)}; e.g. A3")
    short, long = sides
    return Sheet(paper.upper(), *((short, long) if upright else (long, short)))


def check_sheet(paper: str, cut_m: float) -> None:
    """Refuse a paper that there is none of, and a height to cut walls at that is none; raises RequirementError."""
    sheet_of(paper, upright=False)
    if not 0.0 < cut_m < math.inf:
        raise RequirementError(f"cut: got {cut_m:g} m, expected a height above the floor; e.g. 1.2")


def text_sheet(paper: str) -> tuple[Sheet, float]:
    """Return the sheet that pages without drawings are laid out on, and how many times as large it is printed.

    Words on large paper are larger: such sheets are read from farther away, or reduced by a copier.
    """
    sheet = sheet_of(paper, upright=False)
    zoom = _ZOOM.get(sheet.paper, 1.0)
    return Sheet(sheet.paper, sheet.width_mm / zoom, sheet.height_mm / zoom), zoom


@dataclass(frozen=True, eq=False)
class Tile:
    """One sheet's part of a floor. centre_m : (2,) of the drawing. column, row : from the lower left; of how many."""

    sheet: Sheet
    scale: int
    centre_m: FloatArray
    column: int = 0
    row: int = 0
    n_columns: int = 1
    n_rows: int = 1

    @property
    def mm_per_m(self) -> float:
        """On paper."""
        return 1000.0 / self.scale

    @property
    def window_m(self) -> FloatArray:
        """(2, 2) that the drawing shows."""
        box = self.sheet.drawing
        half_m = np.array([box.width, box.height]) / (2 * self.mm_per_m)
        return np.stack([self.centre_m - half_m, self.centre_m + half_m])

    def on_paper(self, points_m: FloatArray) -> FloatArray:
        """(..., 2) millimetres of points (..., 2) in metres."""
        box = self.sheet.drawing
        middle_mm = np.array([box.left + box.width / 2, box.bottom + box.height / 2])
        return np.asarray((points_m - self.centre_m) * self.mm_per_m + middle_mm)


def tiles_of(window_m: FloatArray, paper: str, *, scales: Sequence[int] = sheet_scales(METRE)) -> tuple[Tile, ...]:
    """Lay a floor out: on one sheet at the largest scale that holds it, else on several at the smallest one.

    The sheet stands upright where the floor is taller than wide, unless only the other way holds it. Tiles are in rows
    from the top left.

    Raises
    ------
    RequirementError
        There is no such paper.
    """
    size_m = window_m[1] - window_m[0]
    tall = bool(size_m[1] > size_m[0])
    sheets = [sheet_of(paper, upright=tall), sheet_of(paper, upright=not tall)]
    centre_m = window_m.mean(axis=0)
    for scale in scales:
        for sheet in sheets:
            if (size_m * 1000.0 / scale <= _room_mm(sheet)).all():
                return (Tile(sheet, scale, centre_m),)
    scale = max(scales)
    sheet = min(sheets, key=lambda each: math.prod(_tiling(size_m * 1000.0 / scale, each)))
    n_columns, n_rows = _tiling(size_m * 1000.0 / scale, sheet)
    step_m = (_room_mm(sheet) - _OVERLAP_MM) * scale / 1000.0
    first_m = centre_m - step_m * (np.array([n_columns, n_rows]) - 1) / 2
    return tuple(
        Tile(sheet, scale, first_m + step_m * np.array([column, row]), column, row, n_columns, n_rows)
        for row in reversed(range(n_rows))
        for column in range(n_columns)
    )


def _room_mm(sheet: Sheet) -> FloatArray:
    """Width and height of what a drawing holds."""
    room = sheet.drawing.inset(_AIR_MM)
    return np.array([room.width, room.height])


def _tiling(size_mm: FloatArray, sheet: Sheet) -> tuple[int, int]:
    """Columns and rows of sheets that hold a drawing of that size."""
    columns, rows = np.ceil((size_mm - _OVERLAP_MM) / (_room_mm(sheet) - _OVERLAP_MM)).astype(int).tolist()
    return max(1, columns), max(1, rows)
