"""The letters of sheets: DejaVu Sans, which matplotlib brings along, and how wide words are in it.

It has Latin, Greek and Cyrillic letters and what plans need besides; what it has not, such as Chinese, is told.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from planner_core.errors import MissingPackageError
from planner_core.plan_folder.drawing.ink import MM_PER_POINT, clean

REGULAR, BOLD = "SheetSans", "SheetSans-Bold"
_FILES = {REGULAR: "DejaVuSans.ttf", BOLD: "DejaVuSans-Bold.ttf"}
ELLIPSIS = "…"
#: Blanks at which no line is broken: between a number and its unit, or what stands in brackets behind it.
_KEPT = r"(?:%|m²?|mm|min)(?![\w²])|\(\d"
_KEPT_BLANK, _BLANK = re.compile(rf"(?<=\d) (?={_KEPT})"), re.compile(rf" (?!{_KEPT})|(?<!\d) ")


@cache
def font(name: str) -> Any:
    """Return reportlab's font of that name, known to it from now on.

    Raises
    ------
    MissingPackageError
        reportlab or matplotlib is missing.
    """
    try:
        import matplotlib
        from reportlab.pdfbase import pdfmetrics  # type: ignore[import-untyped]
        from reportlab.pdfbase.ttfonts import TTFont  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingPackageError(
            f"sheets need the packages reportlab and matplotlib, one of which can't be imported ({error}): pip install "
            "reportlab matplotlib"
        ) from error
    made = TTFont(name, str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / _FILES[name]))
    pdfmetrics.registerFont(made)
    return made


def width_mm(words: str, size_pt: float, *, bold: bool = False) -> float:
    """Width of one line."""
    return _width_em(words, bold=bold) * size_pt * MM_PER_POINT


@lru_cache(maxsize=4096)
def _width_em(words: str, *, bold: bool) -> float:
    return float(font(BOLD if bold else REGULAR).stringWidth(words, 1000.0)) / 1000.0


def has_letters(words: str) -> bool:
    """Whether the font has all letters of `words`."""
    glyphs = font(REGULAR).face.charToGlyph
    return all(ord(letter) in glyphs for letter in clean(words))


def fitted(words: str, size_pt: float, room_mm: float, *, bold: bool = False) -> str:
    """Return the words, cut short with an ellipsis where they are wider than there is room."""
    words = clean(words)
    if width_mm(words, size_pt, bold=bold) <= room_mm:
        return words
    fits, too_long = 0, len(words)
    while too_long - fits > 1:
        middle = (fits + too_long) // 2
        if width_mm(words[:middle].rstrip() + ELLIPSIS, size_pt, bold=bold) <= room_mm:
            fits = middle
        else:
            too_long = middle
    return words[:fits].rstrip() + ELLIPSIS


def unbroken(words: str) -> str:
    """Return words for programs that break lines by themselves: blanks where none is to be broken are no-break ones."""
    return _KEPT_BLANK.sub("\u00a0", clean(words))


def wrapped(words: str, size_pt: float, room_mm: float, *, bold: bool = False) -> list[str]:
    """Lines of at most `room_mm`, broken at blanks, and inside words only where one is wider than that."""
    lines: list[str] = []
    line = ""
    for word in _BLANK.split(clean(words)):
        joined = f"{line} {word}" if line else word
        if width_mm(joined, size_pt, bold=bold) <= room_mm:
            line = joined
            continue
        if line:
            lines.append(line)
        *full, line = _pieces(word, size_pt, room_mm, bold=bold)
        lines += full
    return [*lines, line] if line or not lines else lines


def _pieces(word: str, size_pt: float, room_mm: float, *, bold: bool) -> list[str]:
    """Cut a word into pieces that fit; one letter at least each."""
    pieces = []
    while len(word) > 1 and width_mm(word, size_pt, bold=bold) > room_mm:
        n = max(1, len(word) - 1)
        while n > 1 and width_mm(word[:n], size_pt, bold=bold) > room_mm:
            n -= 1
        pieces.append(word[:n])
        word = word[n:]
    return [*pieces, word]
