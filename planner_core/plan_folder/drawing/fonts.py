"""The letters of maps and sheets: DejaVu Sans, which matplotlib brings along, and how wide words are in it.

It has Latin, Greek and Cyrillic letters and what plans need besides. What it lacks, such as Chinese, is drawn with a
font of this machine that has it, in PDF as outlines; else `lacking_letters` names the package that brings one.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, UInt8Array
from planner_core.plan_folder.drawing.canvas import MM_PER_POINT, clean

REGULAR, BOLD = "SheetSans", "SheetSans-Bold"
_FILES = {REGULAR: "DejaVuSans.ttf", BOLD: "DejaVuSans-Bold.ttf"}
ELLIPSIS = "…"
#: Blanks at which no line is broken: between a number and its unit, or what stands in brackets behind it.
_KEPT = r"(?:%|m²?|mm|min)(?![\w²])|\(\d"
_KEPT_BLANK, _BLANK = re.compile(rf"(?<=\d) (?={_KEPT})"), re.compile(rf" (?!{_KEPT})|(?<!\d) ")

#: Fonts that hold the letters of East Asian scripts are tried first, and fonts for signs without serifs of those.
_EAST_ASIAN = re.compile(
    r"cjk|fallback|wqy|hei|ming|song|sim(sun|hei)|msyh|gothic|meiryo|ipa[eg]|takao|nanum|malgun|pingfang|hiragino|unifont"
    r"|arial unicode",
    re.IGNORECASE,
)
_PLAIN = re.compile(r"bold|black|light|thin|italic|oblique|serif|mono|ming|song", re.IGNORECASE)
#: Debian packages with the letters of a script, by how Unicode names them; all others are in the first.
_PACKAGES = {"": "fonts-noto-core", "CJK": "fonts-noto-cjk", "HANGUL": "fonts-noto-cjk", "HIRAGANA": "fonts-noto-cjk",
             "KATAKANA": "fonts-noto-cjk"}  # fmt: skip
_OUTLINE_EM = 100.0


@dataclass(frozen=True, eq=False)
class Letter:
    """A letter of another font than DejaVu Sans. In units of the font's size, from the letter's origin, y up.

    advance : to the next letter. corner : (N, 2) of its outlines. code : (N,) of each, as matplotlib's paths have them.
    """

    file: Path
    advance: float
    corner: FloatArray
    code: UInt8Array


@cache
def font(name: str) -> Any:
    """Return reportlab's font of that name, known to it from now on.

    Raises
    ------
    MissingPackageError
        reportlab or matplotlib is missing.
    """
    try:
        import matplotlib  # noqa: F401
        from reportlab.pdfbase import pdfmetrics  # type: ignore[import-untyped]
        from reportlab.pdfbase.ttfonts import TTFont  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingPackageError(
            f"sheets need the packages reportlab and matplotlib, one of which can't be imported ({error}): pip install "
            "reportlab matplotlib"
        ) from error
    made = TTFont(name, _file(name))
    pdfmetrics.registerFont(made)
    return made


def _file(name: str) -> str:
    import matplotlib

    return str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / _FILES[name])


def width_mm(words: str, size_pt: float, *, bold: bool = False) -> float:
    """Width of one line."""
    return _width_em(words, bold=bold) * size_pt * MM_PER_POINT


@lru_cache(maxsize=4096)
def _width_em(words: str, *, bold: bool) -> float:
    name = BOLD if bold else REGULAR
    width = 0.0
    for part in runs(words):
        width += sum(_advance(letter, name) for letter in part) / 1000 if isinstance(part, str) else part.advance
    return width


@lru_cache(maxsize=4096)
def _advance(letter: str, name: str) -> float:
    """Width of a letter of DejaVu Sans in thousandths of its size: reportlab's, which takes 0.1 s to read a font."""
    from matplotlib.ft2font import LoadFlags

    face = _face(name)
    glyph = face.load_glyph(face.get_char_index(ord(letter)), flags=LoadFlags.NO_SCALE)
    return float(glyph.horiAdvance) * (1000 / float(face.units_per_EM))


@cache
def _face(name: str) -> Any:
    """Return matplotlib's font of that name. Raises MissingPackageError where matplotlib is missing."""
    try:
        from matplotlib.ft2font import FT2Font
    except ImportError as error:
        raise MissingPackageError(
            f"maps need the package matplotlib, which can't be imported ({error}): pip install matplotlib"
        ) from error
    return FT2Font(_file(name))


def runs(words: str) -> list[str | Letter]:
    """Words in parts: texts of DejaVu Sans, and single letters of other fonts; what no font has stays in the texts."""
    if all(map(_has, words)):
        return [words]
    parts: list[str | Letter] = []
    for found, letters in groupby(words, key=lambda each: None if _has(each) else letter_of(each)):
        text = "".join(letters)
        parts += [text] if found is None else [found] * len(text)
    return parts


def _has(letter: str) -> bool:
    """Whether DejaVu Sans has a letter."""
    return bool(_face(REGULAR).get_char_index(ord(letter)))


def families(words: str) -> list[str]:
    """Names of the fonts that matplotlib draws words with, DejaVu Sans first."""
    from matplotlib import font_manager

    files = [part.file for part in runs(words) if isinstance(part, Letter)]
    names = []
    for file in dict.fromkeys(files):
        font_manager.fontManager.addfont(file)
        names.append(font_manager.FontProperties(fname=file).get_name())
    return ["DejaVu Sans", *names]


@cache
def letter_of(letter: str) -> Letter | None:
    """Find a letter in the other fonts of this machine; None where none has it."""
    from matplotlib.ft2font import FT2Font, LoadFlags

    for file in machine_fonts():
        if ord(letter) not in _letters_in(file):
            continue
        face = FT2Font(str(file))
        face.set_size(_OUTLINE_EM, 72)
        advance = face.load_char(ord(letter), flags=LoadFlags.NO_HINTING).linearHoriAdvance / 65536.0
        corner, code = face.get_path()
        return Letter(file, advance / _OUTLINE_EM, corner / _OUTLINE_EM, np.asarray(code, dtype=np.uint8))
    return None


@cache
def machine_fonts() -> tuple[Path, ...]:
    """Fonts of this machine, those for East Asian scripts first, plain ones before bold ones and serifs."""
    from matplotlib import font_manager

    files = {Path(file) for file in font_manager.findSystemFonts()}
    return tuple(
        sorted(files, key=lambda f: (not _EAST_ASIAN.search(f.name), bool(_PLAIN.search(f.name)), f.name, str(f)))
    )


@cache
def _letters_in(file: Path) -> frozenset[int]:
    """Code points that a font has; none of a file that is no font."""
    from matplotlib.ft2font import FT2Font

    try:
        return frozenset(FT2Font(str(file)).get_charmap())
    except (OSError, RuntimeError):
        return frozenset()


def lacking_letters(names: Iterable[str]) -> str:
    """A line on names with letters that no font of this machine has, and the package that brings one; else empty."""
    lacking: dict[str, str] = {}
    for name in names:
        for letter in clean(name):
            if not _has(letter) and letter_of(letter) is None:
                lacking.setdefault(name, letter)
    if not lacking:
        return ""
    name, letter = next(iter(lacking.items()))
    script = unicodedata.name(letter, "").split(" ")[0].split("-")[0]
    package = _PACKAGES.get(script, _PACKAGES[""])
    n = len(lacking)
    return (
        f"letters of {n} name{'' if n == 1 else 's'}, such as {name!r}, are drawn as boxes: no font of this machine "
        f"has them; install one, such as Debian's package {package}, and write again"
    )


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
