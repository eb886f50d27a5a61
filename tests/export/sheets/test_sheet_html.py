"""The HTML page by Python's own parsers: one file, nothing from elsewhere, drawings to scale."""

import re
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from planner_core.plan_folder.plan_source import PlanSource

_VOID = {"meta", "img", "br", "link", "input", "hr", "wbr"}
_SVG = "{http://www.w3.org/2000/svg}"


class _Page(HTMLParser):
    """Elements with their attributes, cells of tables, and whether all elements are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.cells: list[str] = []
        self.words: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in _VOID:
            self._open.append(tag)
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)
        if self._open and self._open[-1] in ("td", "th"):
            self.cells[-1] += data


@pytest.fixture(scope="module")
def page(site_plan: PlanSource, html_of: Callable[..., str]) -> str:
    return html_of(site_plan, paper="A4")


def _drawings(page: str) -> list[ElementTree.Element]:
    """Drawings of floors."""
    return [ElementTree.fromstring(svg) for svg in re.findall(r'<figure class="sheet[^>]*>(<svg.*?</svg>)', page, re.S)]


def test_page_loads_nothing_from_elsewhere(page: str) -> None:
    for tag, attributes in _Page(page).elements:
        assert tag not in ("script", "link", "iframe", "object")
        for name in ("src", "href", "action", "srcset", "xlink:href"):
            value = attributes.get(name)
            assert value is None or value.startswith("data:image/png;base64,"), (tag, name)
    assert "@import" not in page and re.findall(r"url\((?!#)", page) == []
    assert set(re.findall(r"https?://[^\s\"'<]+", page)) == {"http://www.w3.org/2000/svg"}


def test_every_station_is_in_the_tables_once(page: str, site_plan: PlanSource) -> None:
    cells = _Page(page).cells
    ids = [each["id"] for each in site_plan.document["stations"]]
    assert [cell for cell in cells if cell in ids] == ids


def test_cells_say_what_they_are_where_no_head_has_room(page: str) -> None:
    tables = re.findall(r'<table class="rows">(.*?)</table>', page, re.DOTALL)
    assert len(tables) >= 5
    for table in tables:
        head, body = table.split("</thead>")
        names = re.findall(r"<th(?: [^>]*)?>(.*?)</th>", head)
        rows = re.findall(r"<tr>(.*?)</tr>", body)
        assert rows and all(names)
        assert all(re.findall(r'<td[^>]* data-name="([^"]*)"', row) == names for row in rows)


def test_numbers_and_their_units_stay_on_one_line(page: str) -> None:
    words = "".join(_Page(page).words)
    assert re.search(r"[\d.]+\u00a0% of the [\d.]+\u00a0m² scannable", words)
    assert not re.search(r"\d (%|m²|m\b|\(\d)", words.partition("Drawing of")[0])


def test_drawings_are_to_scale_on_paper(page: str, site_plan: PlanSource) -> None:
    drawings = _drawings(page)
    assert len(drawings) == 2
    for svg, floor in zip(drawings, ("F0", "F1"), strict=True):
        left, top, width, height = (float(value) for value in svg.attrib["viewBox"].split())
        assert (left, top) == (0, 0)
        assert svg.attrib["width"] == f"{width:g}mm" and svg.attrib["height"] == f"{height:g}mm"
        spots = np.array([
            (float(disc.attrib["cx"]), -float(disc.attrib["cy"]))
            for disc in svg.iter(f"{_SVG}circle") if float(disc.attrib["r"]) == 0.7
        ])  # fmt: skip
        at_m = np.array([s["position"][:2] for s in site_plan.document["stations"] if s["floor"] == floor])
        words = "".join(text.text or "" for text in svg.iter(f"{_SVG}text"))
        scale = int(re.search(r"1:(\d+)", words)[1])  # type: ignore[index]
        np.testing.assert_allclose(spots - spots[0], (at_m - at_m[0]) * 1000 / scale, atol=0.002)


def test_page_says_what_the_pdf_says(page: str) -> None:
    words = "".join(_Page(page).words)
    for expected in ("EPSG:25832", "Required and reached", "Registration of scans", "Point spacing"):
        assert expected in words


@pytest.mark.slow
def test_names_that_are_markup_stay_words(
    edited: Callable[..., PlanSource], html_of: Callable[..., str], rename_station: Callable[..., None]
) -> None:
    def rename(document: dict[str, Any]) -> None:
        document["floors"][0]["name"] = "</title><script>alert(1)</script>"
        rename_station(document, "S001", '"><img src=x onerror=alert(1)>\x00')
        document["scene"]["file"] = "a&b<i>.ifc"

    text = html_of(edited(rename))
    page = _Page(text)
    assert "script" not in {tag for tag, _ in page.elements}
    assert all("onerror" not in attributes for _, attributes in page.elements)
    assert "a&b<i>.ifc" in "".join(page.words)
    assert len(_drawings(text)) == 2


def test_same_plan_gives_the_same_page(site_plan: PlanSource, html_of: Callable[..., str], page: str) -> None:
    assert html_of(site_plan, paper="A4") == page
