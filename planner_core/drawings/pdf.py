"""PDF pages -> `Drawing`, by PDFium: lines and areas by colour and width, texts; pages that are pictures, traced.

The unit is the point, 1/72 inch; y points up, and the page is as viewers show it, turned and cropped. Layers of CAD are
mostly lost in PDF, pens are not: a layer is a colour and a width (`black 0.50 mm`), of filled areas a colour.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from planner_core import child_process
from planner_core.drawings.drawing import NO_FILL, Drawing, DrawingParts, DrawingText
from planner_core.drawings.pictures import COLOURS, colours_of, drawing_of_pixels
from planner_core.errors import MissingPackageError, SceneError, grouped, reason_of
from planner_core.model import FloatArray, UInt8Array
from planner_core.progress import ProgressEvent

POINT_M = 0.0254 / 72.0
MOST_STROKES = 3_000_000
_DOTS_PER_INCH = 200
"""Pages that are pictures are drawn at this resolution: scans have 150 to 300."""
_MOST_SIDE_PX = 16_000
_DEEPEST = 16
_CURVE_STEPS = np.linspace(0.0, 1.0, 9)[1:, None]
_PROGRESS_EACH = 5000
_LEAST_STROKES = 8
"""Pages with fewer lines and a picture are scans with a frame."""
_WHITE = 250


def read_pdf(path: str, page: int = 0) -> Drawing:
    """Read a page, counted from 1; 0: the only one.

    Raises
    ------
    SceneError
        Not a PDF, encrypted, no such page, several pages and none named, or nothing drawn on it.
    MissingPackageError
        pypdfium2 is not installed.
    """
    return _read_page(_page(path, page), Path(path).name)


def page_pixels(path: str, page: int) -> UInt8Array:
    """(H, W, 3) uint8 of a page that is a picture, as `read_pdf` traces it; raises what that raises."""
    return _rendered(_page(path, page))[0]


def _page(path: str, page: int) -> Any:
    file = Path(path)
    try:
        import pypdfium2
    except ImportError as error:
        raise MissingPackageError(
            f"{file.name}: reading PDF needs the package pypdfium2, which is missing; run pip install pypdfium2."
        ) from error
    child_process.at("the file as a whole")
    try:
        document = pypdfium2.PdfDocument(file)
    except (pypdfium2.PdfiumError, OSError) as error:
        raise SceneError(
            f"{file.name}: PDFium can't read it ({reason_of(error)}), expected a PDF without a password; print it to "
            "PDF again."
        ) from error
    n_pages = len(document)
    if not 0 <= page <= n_pages or (page == 0 and n_pages != 1):
        got = f"page {page}" if page else "no page"
        raise SceneError(
            f"{file.name}: it has {n_pages} pages and got {got}, expected one with a floor plan; name it, such as "
            f"--page {min(max(page, 1), max(n_pages, 1))}."
        )
    child_process.at(f"page {page or 1}")
    return document[max(page, 1) - 1]


def _read_page(page: Any, name: str) -> Drawing:
    from pypdfium2 import raw

    upright, height = _to_upright(page)
    parts = DrawingParts()
    n_pictures = 0
    for number, (item, matrix) in enumerate(_items(page, raw)):
        if number % _PROGRESS_EACH == 0:
            child_process.progress_of_child(ProgressEvent("load", number, 0, f"{grouped(number)} objects"))
        kind = raw.FPDFPageObj_GetType(item)
        if kind == raw.FPDF_PAGEOBJ_IMAGE:
            n_pictures += 1
        elif kind == raw.FPDF_PAGEOBJ_PATH:
            _add_path(parts, raw, item, upright @ matrix, name)
    if n_pictures and parts.n_strokes < _LEAST_STROKES:
        return _traced(page, name)
    if not parts.n_strokes:
        raise SceneError(
            f"{name}: nothing is drawn on its page, expected a floor plan; name another page with --page, or print the "
            "plan to PDF again."
        )
    _add_texts(parts, page, upright)
    return parts.drawing(name, unit_m=None, paper_unit_m=POINT_M, page_height=height)


def _to_upright(page: Any) -> tuple[FloatArray, float]:
    """(3, 3) from the page's own coordinates to those of the page as shown; and its height."""
    left, bottom, right, top = page.get_cropbox()
    width, height = right - left, top - bottom
    shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -bottom], [0.0, 0.0, 1.0]])
    turns = {
        0: np.eye(3),
        90: np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, width], [0.0, 0.0, 1.0]]),
        180: np.array([[-1.0, 0.0, width], [0.0, -1.0, height], [0.0, 0.0, 1.0]]),
        270: np.array([[0.0, -1.0, height], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    }
    rotation = page.get_rotation() % 360
    return turns[rotation] @ shift, float(width if rotation in (90, 270) else height)


def _items(page: Any, raw: Any) -> Iterator[tuple[Any, FloatArray]]:
    """Objects of a page, those inside of forms among them, with what places them on the page."""
    stack = [(raw.FPDFPage_GetObject(page, n), np.eye(3), 0) for n in range(raw.FPDFPage_CountObjects(page))][::-1]
    while stack:
        item, around, depth = stack.pop()
        if raw.FPDFPageObj_GetType(item) != raw.FPDF_PAGEOBJ_FORM:
            yield item, around
        elif depth < _DEEPEST:
            inner = around @ _matrix(raw, item)
            n_inside = raw.FPDFFormObj_CountObjects(item)
            stack += [(raw.FPDFFormObj_GetObject(item, n), inner, depth + 1) for n in range(n_inside)][::-1]


def _matrix(raw: Any, item: Any) -> FloatArray:
    """(3, 3) of an object, from its own coordinates to those around it."""
    matrix = raw.FS_MATRIX()
    if not raw.FPDFPageObj_GetMatrix(item, matrix):
        return np.eye(3)
    return np.array([[matrix.a, matrix.c, matrix.e], [matrix.b, matrix.d, matrix.f], [0.0, 0.0, 1.0]])


def _add_path(parts: DrawingParts, raw: Any, item: Any, around: FloatArray, name: str) -> None:
    fill_mode, is_stroked = ctypes.c_int(), ctypes.c_int()
    raw.FPDFPath_GetDrawMode(item, fill_mode, is_stroked)
    is_filled = fill_mode.value != raw.FPDF_FILLMODE_NONE
    matrix = around @ _matrix(raw, item)
    lines = list(_lines(raw, item))
    size = float(np.sqrt(abs(np.linalg.det(matrix[:2, :2]))))
    if is_filled and (colour := _colour(raw.FPDFPageObj_GetFillColor, item)):
        fill = parts.new_fill()
        for line in lines:
            _add(parts, matrix, line, colour, name, fill=fill)
    if is_stroked.value and (colour := _colour(raw.FPDFPageObj_GetStrokeColor, item)):
        width = ctypes.c_float()
        raw.FPDFPageObj_GetStrokeWidth(item, width)
        for line in lines:
            _add(parts, matrix, line, f"{colour} {width.value * size * POINT_M * 1000:.2f} mm", name)


def _add(parts: DrawingParts, matrix: FloatArray, line: FloatArray, layer: str, name: str, fill: int = NO_FILL) -> None:
    if parts.n_strokes >= MOST_STROKES:
        raise SceneError(
            f"{name}: its page has more than {grouped(MOST_STROKES)} lines, expected a floor plan; print the layers of "
            "walls, doors and windows alone."
        )
    at = line @ matrix[:2, :2].T + matrix[:2, 2]
    parts.add_stroke(at, layer, fill=fill, closed=fill != NO_FILL)


def _lines(raw: Any, item: Any) -> Iterator[FloatArray]:
    """Polylines (K, 2) of a path, Bezier curves flattened."""
    points: list[tuple[float, float]] = []
    controls: list[tuple[float, float]] = []
    x, y = ctypes.c_float(), ctypes.c_float()
    for number in range(raw.FPDFPath_CountSegments(item)):
        segment = raw.FPDFPath_GetPathSegment(item, number)
        raw.FPDFPathSegment_GetPoint(segment, x, y)
        at = (float(x.value), float(y.value))
        kind = raw.FPDFPathSegment_GetType(segment)
        if kind == raw.FPDF_SEGMENT_MOVETO:
            if len(points) > 1:
                yield np.array(points)
            points, controls = [at], []
        elif kind == raw.FPDF_SEGMENT_LINETO:
            points.append(at)
        else:
            controls.append(at)
            if len(controls) == 3 and points:
                a, (b, c, d), t = np.array(points[-1]), (np.array(each) for each in controls), _CURVE_STEPS
                curve = (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t * t * c + t**3 * d
                points += [(float(u), float(v)) for u, v in curve]
                controls = []
        if raw.FPDFPathSegment_GetClose(segment) and len(points) > 1:
            yield np.array([*points, points[0]])
            points = [points[0]]
    if len(points) > 1:
        yield np.array(points)


def _colour(read: Any, item: Any) -> str:
    """Name of a colour; empty where it is not seen on paper."""
    values = [ctypes.c_uint() for _ in range(4)]
    if not read(item, *values):
        return COLOURS[0]
    red, green, blue, alpha = (value.value for value in values)
    if not alpha or min(red, green, blue) >= _WHITE:
        return ""
    return COLOURS[int(colours_of(np.array([[red, green, blue]], dtype=np.uint8))[0])]


def _add_texts(parts: DrawingParts, page: Any, upright: FloatArray) -> None:
    text_page = page.get_textpage()
    for number in range(text_page.count_rects()):
        left, bottom, right, top = text_page.get_rect(number)
        text = " ".join(text_page.get_text_bounded(left, bottom, right, top).split())
        x, y, _ = upright @ np.array([(left + right) / 2, (bottom + top) / 2, 1.0])
        if text:
            parts.texts.append(DrawingText(text, float(x), float(y), 0.0, "text"))


def _traced(page: Any, name: str) -> Drawing:
    """A page that is a picture, drawn and traced."""
    rgb, point_px = _rendered(page)
    child_process.at("the picture on its page")
    drawing = drawing_of_pixels(rgb, name)
    height = page.get_height()
    size = 1.0 / point_px
    # A point of the page is its unit, as of pages with lines; pixels are counted from the middle of the lowest row.
    from_pixels = np.array([[size, 0.0, 0.5 * size], [0.0, size, height - (len(rgb) - 0.5) * size], [0.0, 0.0, 1.0]])
    points = drawing.points * [size, size, 1.0] + [*from_pixels[:2, 2], 0.0]
    return replace(drawing, points=points, paper_unit_m=POINT_M, page_height=float(height), from_picture=from_pixels)


def _rendered(page: Any) -> tuple[UInt8Array, float]:
    """(H, W, 3) uint8 of a page, and pixels in a point of it."""
    dots = min(_DOTS_PER_INCH, _MOST_SIDE_PX / max(page.get_size()) * 72.0)
    pixels = page.render(scale=dots / 72.0, rev_byteorder=True).to_numpy()
    return np.ascontiguousarray(pixels[..., :3]), dots / 72.0
