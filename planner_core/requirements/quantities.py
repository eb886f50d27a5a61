"""Figures as surveyors write them, `6 mm`, `5 ft 3 in`, `95 %`, `65 deg`, to metres, fractions, radians.

Numbers without a unit are taken only where they can't be misread; each refusal is one line.
"""

from __future__ import annotations

import math
import re

from planner_core.documents import shown
from planner_core.errors import RequirementError
from planner_core.model import FOOT, METRE, US_SURVEY_FOOT, LengthUnit

_METRES = {
    "µm": 1e-6,  # micro sign
    "μm": 1e-6,  # Greek mu
    "um": 1e-6,
    "mm": 1e-3,
    "cm": 1e-2,
    "m": 1.0,
    "km": 1e3,
    "ft": FOOT.metres,
    "ftus": US_SURVEY_FOOT.metres,
    "in": 0.0254,
    "inch": 0.0254,
    "inches": 0.0254,
    '"': 0.0254,
    "foot": FOOT.metres,
    "feet": FOOT.metres,
    "'": FOOT.metres,
    "us survey foot": US_SURVEY_FOOT.metres,
    "us survey feet": US_SURVEY_FOOT.metres,
}
for _name, _prefix in (("millimetre", 1e-3), ("centimetre", 1e-2), ("metre", 1.0)):
    for _word in (_name, _name.replace("tre", "ter")):
        _METRES[_word] = _METRES[_word + "s"] = _prefix
_RADIANS = {
    **dict.fromkeys(("deg", "degree", "degrees", "°"), math.pi / 180),
    **dict.fromkeys(("rad", "radian", "radians"), 1.0),
    **dict.fromkeys(("gon", "grad"), math.pi / 200),
}
_FRACTIONS = dict.fromkeys(("%", "percent", "per cent"), 0.01)

_NUMBER = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?)\s*(.*)", re.IGNORECASE | re.DOTALL)
#: `5 ft 3 in`, `5' 3 1/2"`, `3 1/2 in`, `3/4 in`.
_FEET_AND_INCHES = re.compile(
    r"(?P<sign>[+-]?)(?:(?P<feet>\d+)\s*(?:ft|foot|feet|')\s*-?\s*)?"
    r"(?:(?P<whole>\d+(?:\.\d*)?)|(?:(?P<before>\d+)[\s-]+)?(?P<numerator>\d+)\s*/\s*(?P<denominator>[1-9]\d*))"
    r"\s*(?:in|inch|inches|\")",
    re.IGNORECASE,
)
#: A comma and three digits: thousands to some, thousandths to others.
_TWO_WAYS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def _refused(value: object, expected: str, remedy: str) -> RequirementError:
    return RequirementError(f"got {shown(value)}, expected {expected}; {remedy}")


def length_m(value: object, *, bare: tuple[float, float], most: float, example: str) -> float:
    """Read a length above 0 and at most `most` metres.

    Parameters
    ----------
    bare
        Numbers without a unit from the first to the second are metres; others are refused.
    example
        Of how to write it, for messages.
    """
    metres, has_unit = _metres(value, f"a length such as {example}")
    if not has_unit and not bare[0] <= metres <= bare[1]:
        raise _refused(value, f"a length with its unit, such as {example}", "say whether it is mm or m")
    if not 0 < metres <= most:
        raise _refused(value, f"more than 0 and at most {most:g} m", f"mind the unit, e.g. {example}")
    return metres


def angle_rad(value: object, *, example: str = "65 deg") -> float:
    """Read an angle above 0 and at most a right one. Bare numbers above 2 are degrees; others may be either."""
    number, unit = _number_and_unit(value, _RADIANS, f"an angle such as {example}")
    if not unit and number <= 2:
        raise _refused(value, f"an angle with its unit, such as {example}", "say whether it is deg or rad")
    radians = number * _RADIANS[unit or "deg"]
    # 90 degrees, or 100 gon, may round to more than half of pi.
    if not 0 < radians <= math.pi / 2 * (1 + 1e-12):
        raise _refused(value, "more than 0 and at most 90 degrees", f"mind the unit, e.g. {example}")
    return min(radians, math.pi / 2)


def share(value: object, *, zero: bool = False, example: str = "95 %") -> float:
    """Read a share up to the whole as a fraction: `95 %`, 95 and 0.95 alike.

    A bare 1 may be 1 % or the whole, and 0.95 % is a slip for 0.95: both are refused. zero : whether none will do.
    """
    fraction_too = f"{example} or {float(example.split()[0]) / 100:g}"
    number, unit = _number_and_unit(value, _FRACTIONS, f"a share such as {fraction_too}")
    if number == 0 and zero:
        return 0.0
    if not unit and number == 1:
        raise _refused(value, "a share that can't be misread", "write 1 % or 100 %")
    if unit and 0 < number < 1:
        # Options of the command line are percentages, and arrive here with a % that nobody typed.
        raise _refused(value, f"a share such as {example}", f"give {example.split()[0]} for {example}")
    # Dividing rounds once: 95 % is the number that 0.95 is.
    fraction = number / 100 if unit or number > 1 else number
    if not 0 < fraction <= 1:
        raise _refused(value, f"{'0' if zero else 'more than 0'} to 100 %", f"e.g. {fraction_too}")
    return fraction


def count(value: object, *, most: int = 100) -> int:
    """Read a whole number from 1 to `most`."""
    number, _ = _number_and_unit(value, {}, "a whole number")
    if number != int(number) or not 1 <= number <= most:
        raise _refused(value, f"a whole number from 1 to {most}", "e.g. 2")
    return int(number)


def plain_number(value: object, *, least: float, most: float) -> float:
    """Read a number without a unit from `least` to `most`."""
    number, _ = _number_and_unit(value, {}, "a number")
    if not least <= number <= most:
        raise _refused(value, f"a number from {least:g} to {most:g}", "leave it out for the default")
    return number


def coordinate_m(value: object, *, unit: LengthUnit = METRE) -> float:
    """Read a coordinate or a distance, to metres; bare numbers are of `unit`."""
    metres, has_unit = _metres(value, f"a number of {unit.many}")
    return metres if has_unit else metres * unit.metres


def _metres(value: object, expected: str) -> tuple[float, bool]:
    """Read a length; and whether it has a unit. Metres, or a bare number as it is."""
    match = _FEET_AND_INCHES.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None or not (match["feet"] or match["denominator"]):
        number, unit = _number_and_unit(value, _METRES, expected)
        return number * _METRES[unit or "m"], bool(unit)
    inches = float(match["whole"] or match["before"] or 0)
    inches += int(match["numerator"]) / int(match["denominator"]) if match["denominator"] else 0.0
    if match["feet"] and inches >= 12:
        raise _refused(value, expected, "after feet write less than 12 inches, such as 5 ft 3 1/2 in")
    metres = (12 * int(match["feet"] or 0) + inches) * 0.0254
    return -metres if match["sign"] == "-" else metres, True


def _number_and_unit(value: object, units: dict[str, float], expected: str) -> tuple[float, str]:
    """Split a value; the unit is empty where there is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise _refused(value, expected, "write a number and its unit")
    number, unit = value, ""
    if isinstance(value, str):
        split = _NUMBER.fullmatch(value.strip())
        if split is None or _TWO_WAYS.fullmatch(split[1]):
            remedy = "write a number and its unit" if split is None else "write it without a comma"
            raise _refused(value, expected, remedy)
        number, unit = float(split[1].replace(",", ".")), split[2].strip().casefold()
    if unit and unit not in units:
        known = ", ".join(list(units)[:8]) if units else "none"
        raise _refused(value, expected, f"its unit {shown(unit)} is not known there, known are: {known}")
    try:
        number = float(number)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _refused(value, expected, "write a finite number")
    return number, unit
