"""PDF sheets as two readers of others find them: words by pypdf, marks and pixels by PDFium."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pypdf
import pypdfium2
from numpy.typing import NDArray

from planner_core.plan_folder.plan_source import PlanSource

MM_PER_POINT = 25.4 / 72


@dataclass(frozen=True)
class Mark:
    """Something drawn at once, and its box in millimetres from the lower left corner of the page. text : if any."""

    left: float
    bottom: float
    right: float
    top: float
    text: str = ""

    @property
    def middle(self) -> NDArray[np.float64]:
        return np.array([(self.left + self.right) / 2, (self.bottom + self.top) / 2])


@dataclass
class Pdf:
    path: Path
    remarks: tuple[str, ...] = ()

    @cached_property
    def texts(self) -> list[str]:
        """Words of every page."""
        return [page.extract_text() for page in pypdf.PdfReader(self.path).pages]

    @property
    def n_pages(self) -> int:
        return len(self.texts)

    def size_mm(self, page: int) -> tuple[int, int]:
        box = pypdf.PdfReader(self.path).pages[page].mediabox
        return round(float(box.width) * MM_PER_POINT), round(float(box.height) * MM_PER_POINT)

    def pages_with(self, words: str) -> list[int]:
        return [number for number, text in enumerate(self.texts) if words in text]

    def drawings(self, floor_name: str) -> list[int]:
        """Pages with a drawing of a floor."""
        named = re.compile(rf"^{floor_name}$", re.MULTILINE)
        return [page for page in self.pages_with("true to scale") if named.search(self.texts[page])]

    def drawing(self, floor_name: str) -> int:
        """The one page with the drawing of a floor."""
        (page,) = self.drawings(floor_name)
        return page

    def scale(self, page: int) -> int:
        """What a drawing says of its scale."""
        found = re.search(r"^1:(\d+)$", self.texts[page], re.MULTILINE)
        assert found is not None
        return int(found[1])

    @staticmethod
    def positions_m(plan: PlanSource, floor: str) -> NDArray[np.float64]:
        """(N, 2) of a floor's stations as plan.json has them."""
        return np.array([each["position"][:2] for each in plan.document["stations"] if each["floor"] == floor])

    def to_paper(self, page: int, plan: PlanSource, floor: str) -> Callable[[float, float], NDArray[np.float64]]:
        """From scene metres to millimetres on a page, by the marks of its stations: upright, to one scale."""
        mm_per_m = 1000.0 / self.scale(page)
        shift = (self.spots(page) - mm_per_m * self.positions_m(plan, floor)).mean(axis=0)
        return lambda x, y: mm_per_m * np.array([x, y]) + shift

    def words(self, page: int) -> list[Mark]:
        """Every piece of text of a page."""
        document = pypdfium2.PdfDocument(self.path)
        try:
            return list(_words(document[page]))
        finally:
            document.close()

    def paths(self, page: int) -> list[Mark]:
        """Everything that is drawn and is no word."""
        document = pypdfium2.PdfDocument(self.path)
        try:
            return [_box(item) for item in document[page].get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_PATH])]
        finally:
            document.close()

    def discs(self, page: int, *, least_mm: float, most_mm: float) -> list[Mark]:
        """Everything drawn that is as wide as high, and of that size."""
        wide = [(mark, mark.right - mark.left, mark.top - mark.bottom) for mark in self.paths(page)]
        return [mark for mark, x, y in wide if abs(x - y) < 0.01 and least_mm < x < most_mm]

    def spots(self, page: int) -> NDArray[np.float64]:
        """(N, 2) middles of the dots that say where stations are, in the order in which they are drawn."""
        return np.array([mark.middle for mark in self.discs(page, least_mm=1.7, most_mm=1.9)])

    def pixels(self, page: int, *, dpi: float = 100.0) -> NDArray[np.float64]:
        """(H, W, 3) in [0, 1]."""
        document = pypdfium2.PdfDocument(self.path)
        try:
            return np.asarray(document[page].render(scale=dpi / 72).to_pil().convert("RGB"), dtype=np.float64) / 255
        finally:
            document.close()


def _words(page: pypdfium2.PdfPage) -> Iterator[Mark]:
    text = page.get_textpage()
    for item in page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_TEXT]):
        left, bottom, right, top = item.get_bounds()
        found = text.get_text_bounded(left=left - 0.1, bottom=bottom - 0.1, right=right + 0.1, top=top + 0.1)
        yield _box(item, found.strip())


def _box(item: pypdfium2.PdfObject, text: str = "") -> Mark:
    return Mark(*(value * MM_PER_POINT for value in item.get_bounds()), text)
