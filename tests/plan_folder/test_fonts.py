"""Letters that the font of maps and sheets lacks: drawn with a font of the machine, else named with the remedy."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from PIL import Image

from planner_core.plan_folder.drawing import fonts
from planner_core.plan_folder.drawing.canvas import MM_PER_POINT
from planner_core.plan_folder.drawing.pdf_canvas import PdfBook
from planner_core.plan_folder.drawing.png_canvas import PngCanvas

NAMES = ["1階 - Story", "标高 2", "일층"]
LETTERS = "".join(sorted({letter for name in NAMES for letter in name if ord(letter) > 0x2E00}))
SIZE_PT = 72.0


def font_file(path: Path, *, has_curves: bool) -> Path:
    """A font of LETTERS, each a box of 0.8 x 0.8 em on the line, 1 em wide, as TrueType or with cubic outlines."""
    names = [".notdef", *(f"uni{ord(letter):04X}" for letter in LETTERS)]
    made = FontBuilder(1000, isTTF=not has_curves)
    made.setupGlyphOrder(names)
    made.setupCharacterMap({ord(letter): name for letter, name in zip(LETTERS, names[1:], strict=True)})
    glyphs = {}
    for name in names:
        pen = T2CharStringPen(1000, None) if has_curves else TTGlyphPen(None)
        pen.moveTo((100, 0))
        if has_curves:
            pen.curveTo((100, 300), (100, 500), (100, 800))
        else:
            pen.qCurveTo((100, 400), (100, 800))
        pen.lineTo((900, 800))
        pen.lineTo((900, 0))
        pen.closePath()
        glyphs[name] = pen.getCharString() if has_curves else pen.glyph()
    if has_curves:
        made.setupCFF("Boxes", {}, glyphs, {})
    else:
        made.setupGlyf(glyphs)
    made.setupHorizontalMetrics(dict.fromkeys(names, (1000, 100)))
    made.setupHorizontalHeader(ascent=800, descent=-200)
    made.setupNameTable({"familyName": f"Boxes {path.stem}", "styleName": "Regular"})
    made.setupOS2()
    made.setupPost()
    made.save(path)
    return path


@pytest.mark.parametrize("name", [fonts.REGULAR, fonts.BOLD])
def test_letters_are_as_wide_in_pictures_as_in_pdf(name: str) -> None:
    sheet = fonts.font(name)
    for letter in ["a", " ", "\u00a0", "²", "→", "Я", "\u0378", "\U0001d538"]:  # U+0378 is no letter
        assert fonts._advance(letter, name) == sheet.stringWidth(letter, 1000.0), letter
        assert fonts._has(letter) == (ord(letter) in sheet.face.charToGlyph), letter


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Call with the fonts that the machine has."""

    def has(*files: Path) -> None:
        monkeypatch.setattr(fonts, "machine_fonts", lambda: files)
        _forget()

    yield has
    _forget()


def _forget() -> None:
    for found in (fonts.letter_of, fonts._width_em, fonts._letters_in):
        found.cache_clear()


def test_letters_that_no_font_has_are_named_with_a_package(machine: Callable[..., None], tmp_path: Path) -> None:
    (tmp_path / "broken.ttf").write_bytes(b"no font")
    machine(tmp_path / "broken.ttf")
    assert fonts.lacking_letters(["Erdgeschoß", "Уровень 1", "Ισόγειο", "F0 · 1 m²"]) == ""
    line = fonts.lacking_letters(["Ground", *NAMES])
    assert "3 names, such as '1階 - Story', are drawn as boxes" in line and "package fonts-noto-cjk" in line
    assert "package fonts-noto-core" in fonts.lacking_letters(["ชั้น 1"])


@pytest.mark.parametrize("has_curves", [False, True], ids=["TrueType", "CFF"])
def test_letters_of_another_font_have_its_width_and_outline(
    machine: Callable[..., None], tmp_path: Path, has_curves: bool
) -> None:
    machine(font_file(tmp_path / f"boxes{has_curves}.otf", has_curves=has_curves))
    assert fonts.lacking_letters(NAMES) == ""
    story_mm = fonts.width_mm("1", SIZE_PT) + fonts.width_mm(" - Story", SIZE_PT)
    assert fonts.width_mm("1階 - Story", SIZE_PT) == pytest.approx(story_mm + SIZE_PT * MM_PER_POINT, abs=0.1)
    book = PdfBook(tmp_path / "a.pdf", title="标高", subject="")
    page = book.page(100, 60, title="标高")
    for y, align in ((10.0, "left"), (35.0, "right")):
        page.text({"left": (10.0, y), "right": (90.0, y)}[align], "2标", SIZE_PT, align=align)
    book.turn()
    book.close()
    with pypdfium2.PdfDocument(tmp_path / "a.pdf") as document:
        boxes = [each.get_bounds() for each in document[0].get_objects() if each.type == 2]  # paths
        words = document[0].get_textpage().get_text_range()
    pt = 1.0 / MM_PER_POINT
    left = 10 * pt + fonts.width_mm("2", SIZE_PT) * pt + 0.1 * SIZE_PT
    expected = [
        (left, 10 * pt, left + 0.8 * SIZE_PT, 10 * pt + 0.8 * SIZE_PT),
        (90 * pt - 0.9 * SIZE_PT, 35 * pt, 90 * pt - 0.1 * SIZE_PT, 35 * pt + 0.8 * SIZE_PT),
    ]
    assert [pytest.approx(each, abs=0.6) for each in expected] == boxes
    assert words.split() == ["2", "2"]


@pytest.mark.parametrize("has_curves", [False, True], ids=["TrueType", "CFF"])
def test_letters_of_another_font_are_drawn_in_pictures(
    machine: Callable[..., None], tmp_path: Path, has_curves: bool
) -> None:
    machine(font_file(tmp_path / f"boxes png {has_curves}.otf", has_curves=has_curves))
    canvas = PngCanvas(40.0, 40.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # matplotlib warns of glyphs that are missing
        canvas.text((5.0, 5.0), "階", SIZE_PT)
        canvas.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        dark = 255 - np.asarray(picture.convert("L"), dtype=float)
    area_mm2 = dark.sum() / 255 * (25.4 / 144) ** 2
    assert area_mm2 == pytest.approx((0.8 * SIZE_PT * MM_PER_POINT) ** 2, rel=0.02)
