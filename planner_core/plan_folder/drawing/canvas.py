"""What sheets are drawn with, whatever they become: lines, areas, discs, words and pictures on a page in millimetres.

The origin of a page is its lower left corner, x to the right, y up. `pdf_canvas`, `svg_canvas`
and `png_canvas` are the kinds of it.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from planner_core.model import FloatArray

Colour = tuple[float, float, float]

MM_PER_POINT = 25.4 / 72
INK: Colour = (0.0, 0.0, 0.0)
ALARM: Colour = (0.70, 0.08, 0.11)
"""Red: what must not be missed."""
QUIET: Colour = (0.36, 0.38, 0.40)
"""Of words beside more important ones: still dark enough for a poor copy."""
RULE: Colour = (0.62, 0.64, 0.66)
PAPER: Colour = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Pen:
    """How a line looks. dash_mm : lengths drawn and left out in turn; empty: drawn through."""

    width_mm: float
    colour: Colour = INK
    dash_mm: tuple[float, ...] = ()
    round: bool = False


@dataclass(frozen=True)
class Box:
    """A rectangle of a page, millimetres."""

    left: float
    bottom: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Of its right edge."""
        return self.left + self.width

    @property
    def top(self) -> float:
        """Of its upper edge."""
        return self.bottom + self.height

    def inset(self, by: float) -> Box:
        """As much smaller on all sides."""
        return Box(self.left + by, self.bottom + by, self.width - 2 * by, self.height - 2 * by)


class Canvas(Protocol):
    """A page that is being drawn."""

    def lines(self, paths: Sequence[FloatArray], pen: Pen, *, closed: bool = False) -> None:
        """Draw lines with corners (N, 2) each."""

    def area(self, rings: Sequence[FloatArray], colour: Colour) -> None:
        """Fill what is inside an odd number of the closed rings (N, 2)."""

    def disc(self, centre: tuple[float, float], radius: float, fill: Colour, rim: Pen | None = None) -> None:
        """Fill a circle, and draw its rim."""

    def text(
        self,
        at: tuple[float, float],
        words: str,
        size_pt: float,
        *,
        colour: Colour = INK,
        bold: bool = False,
        align: str = "left",
        turn_rad: float = 0.0,
    ) -> None:
        """Write one line. at : left, middle or right end of its base line, by `align`."""

    def picture(self, path: Path, box: Box) -> None:
        """Place a PNG."""

    def clip(self, box: Box) -> AbstractContextManager[None]:
        """Draw nothing outside `box` meanwhile."""


#: More than any page has room for; measuring them would take minutes.
_MOST_LETTERS = 4000


def clean(words: str) -> str:
    """Make words of files fit for one line: no controls and halves of characters, blanks for breaks, no whole books."""
    return "".join(_fit(letter) for letter in words[:_MOST_LETTERS])


def _fit(letter: str) -> str:
    kind = unicodedata.category(letter)
    if kind in ("Zs", "Zl", "Zp") or letter in "\t\n\r\v\f":
        return " "
    if kind in ("Cc", "Cs", "Cn") or letter in "\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069":
        return "\ufffd"
    return letter
