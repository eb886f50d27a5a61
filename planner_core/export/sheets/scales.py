"""Scales of drawings: those that scale rulers have, metric and of the United States, and how they are called."""

from __future__ import annotations

from planner_core.model import LengthUnit

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
