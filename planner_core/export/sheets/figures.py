"""Lengths and areas as sheets say them: metres, or feet and inches. Metres and square metres in, text out."""

from __future__ import annotations

from planner_core.model import FOOT, LengthUnit
from planner_core.model.length_units import feet_and_inches


def length_words(unit: LengthUnit, length_m: float, digits: int) -> str:
    """`1.20 m`; in feet `3' 11 1/4"`, and without digits `12 ft`. Coordinates have decimals instead."""
    if not unit.is_feet:
        return f"{length_m:.{digits}f} m"
    return FOOT.text(length_m, 0) if digits == 0 else feet_and_inches(length_m)


def cut_words(unit: LengthUnit, height_m: float) -> str:
    """Height of a section plane: `1.2 m`, `3' 11 1/4"`."""
    return feet_and_inches(height_m) if unit.is_feet else f"{height_m:.3g} m"


def short_length_words(unit: LengthUnit, length_m: float) -> str:
    """Millimetres, or inches."""
    return f"{length_m / 0.0254:.3g} in" if unit.is_feet else f"{1000 * length_m:g} mm"


def area(unit: LengthUnit, area_m2: float) -> float:
    """Square metres, or square feet."""
    return area_m2 / FOOT.metres**2 if unit.is_feet else area_m2


def area_unit(unit: LengthUnit) -> str:
    """Unit of `area`."""
    return "sq ft" if unit.is_feet else "m²"


def area_words(unit: LengthUnit, area_m2: float, digits: int = 0) -> str:
    """An area and its unit."""
    return f"{area(unit, area_m2):.{digits}f} {area_unit(unit)}"
