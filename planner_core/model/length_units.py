"""Units of length that people survey in: of what comes in and goes out; inside the library every length is in metres.

The two feet differ by 2 parts per million: at a State Plane coordinate of 2 000 000 ft by 1.2 m. So each has its name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from planner_core.model.arrays import FloatArray


@dataclass(frozen=True)
class LengthUnit:
    """symbol : as options, headers and file names have it. many : of several, for people. metres : of one of it."""

    symbol: str
    many: str
    metres: float

    @property
    def is_feet(self) -> bool:
        """Whether it is one of the two feet."""
        return self != METRE

    def of(self, length_m: float) -> float:
        """Metres -> this unit."""
        return length_m / self.metres

    def of_array(self, lengths_m: FloatArray) -> FloatArray:
        """Metres -> this unit, of any shape."""
        return lengths_m / self.metres if self.is_feet else lengths_m

    def text(self, length_m: float, digits: int) -> str:
        """Write a length, metres, in this unit and with its symbol."""
        return f"{self.of(length_m):.{digits}f} {self.symbol}"


METRE = LengthUnit("m", "metres", 1.0)
FOOT = LengthUnit("ft", "feet", 0.3048)
"""The international foot, exactly 0.3048 m."""
US_SURVEY_FOOT = LengthUnit("ftUS", "US survey feet", 1200.0 / 3937.0)
"""The foot of most State Plane systems of NAD83: 1200/3937 m."""
LENGTH_UNITS = {unit.symbol: unit for unit in (METRE, FOOT, US_SURVEY_FOOT)}

_NAMES = {
    METRE: ("m", "metre", "metres", "meter", "meters"),
    FOOT: ("ft", "foot", "feet", "ift", "international foot", "international feet"),
    US_SURVEY_FOOT: ("ftus", "usft", "us ft", "sft", "survey foot", "survey feet", "us survey foot", "us survey feet",
                     "us survey ft", "survey ft", "foot us", "feet us", "ft us", "us foot", "us feet"),
}  # fmt: skip
_UNIT_OF_NAME = {name: unit for unit, names in _NAMES.items() for name in names}


def unit_named(name: str) -> LengthUnit | None:
    """Return the unit that a file or a person means, such as `US survey foot`, `US_Survey_Feet`, `ftUS`; None: none."""
    plain = " ".join(name.casefold().replace(".", "").replace("_", " ").replace("-", " ").split())
    return _UNIT_OF_NAME.get(plain)


def unit_of_size(metres: float) -> LengthUnit | None:
    """Return the unit of this length in metres, to a billionth; None: none of these."""
    return next((unit for unit in LENGTH_UNITS.values() if math.isclose(unit.metres, metres, rel_tol=1e-9)), None)


def feet_and_inches(length_m: float, *, parts: int = 8) -> str:
    """Write a length as crews read it off a tape: `5' 3 1/4"`, to an inch divided in `parts`, a power of two.

    The two feet are the same to such digits below a kilometre: the international one is taken.
    """
    if not math.isfinite(length_m):
        return "not known"
    count = round(abs(length_m) / 0.0254 * parts)
    feet, rest = divmod(count, 12 * parts)
    inches, part = divmod(rest, parts)
    common = math.gcd(part, parts)
    fraction = f" {part // common}/{parts // common}" if part else ""
    return f"{'-' if length_m < 0 and count else ''}{feet}' {inches}{fraction}\""
