"""Canvas of PDF pages, by reportlab: vectors, embedded letters, the same bytes for the same drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.model import FloatArray
from planner_core.plan_folder.drawing.canvas import INK, MM_PER_POINT, Box, Colour, Pen, clean
from planner_core.plan_folder.drawing.fonts import BOLD, REGULAR, Letter, font, runs, width_mm

_POINTS_PER_MM = 1.0 / MM_PER_POINT
_EVEN_ODD, _NON_ZERO = 0, 1
#: Codes of matplotlib's paths.
_MOVE, _LINE, _QUADRATIC, _CUBIC = 1, 2, 3, 4


class PdfBook:
    """A PDF that is being written, page after page.

    Parameters
    ----------
    title, subject
        What readers show as the document's properties.
    """

    def __init__(self, path: Path, *, title: str, subject: str) -> None:
        for name in (REGULAR, BOLD):
            font(name)
        from reportlab.pdfgen.canvas import Canvas  # type: ignore[import-untyped]

        # invariant: neither the time nor a random id.
        self.canvas: Any = Canvas(str(path), invariant=1, pageCompression=1)
        self.canvas.setTitle(clean(title))
        self.canvas.setSubject(clean(subject))
        self.canvas.setAuthor("")
        self.canvas.setCreator("tlsplan")

    def page(self, width_mm: float, height_mm: float, *, title: str, zoom: float = 1.0) -> PdfCanvas:
        """Begin a page, `zoom` times as large as this, with all that is on it; `title` is its line in the outline."""
        self.canvas.setPageSize((width_mm * zoom * _POINTS_PER_MM, height_mm * zoom * _POINTS_PER_MM))
        self.canvas.scale(zoom, zoom)
        key = f"page{self.canvas.getPageNumber()}"
        self.canvas.bookmarkPage(key)
        self.canvas.addOutlineEntry(clean(title), key, 0, closed=False)
        return PdfCanvas(self.canvas)

    def turn(self) -> None:
        """End the page."""
        self.canvas.showPage()

    def close(self) -> None:
        """Write the file."""
        self.canvas.save()


class PdfCanvas:
    """`Canvas` of one page."""

    def __init__(self, canvas: Any) -> None:
        self._canvas = canvas

    def lines(self, paths: Sequence[FloatArray], pen: Pen, *, closed: bool = False) -> None:
        """See `Canvas`."""
        if not len(paths):
            return
        self._take(pen)
        self._canvas.drawPath(self._path(paths, closed=closed), stroke=1, fill=0)

    def area(self, rings: Sequence[FloatArray], colour: Colour) -> None:
        """See `Canvas`."""
        if not len(rings):
            return
        self._canvas.setFillColorRGB(*colour)
        self._canvas.drawPath(self._path(rings, closed=True), stroke=0, fill=1, fillMode=_EVEN_ODD)

    def disc(self, centre: tuple[float, float], radius: float, fill: Colour, rim: Pen | None = None) -> None:
        """See `Canvas`."""
        self._canvas.setFillColorRGB(*fill)
        if rim is not None:
            self._take(rim)
        x, y = (value * _POINTS_PER_MM for value in centre)
        self._canvas.circle(x, y, radius * _POINTS_PER_MM, stroke=int(rim is not None), fill=1)

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
        """See `Canvas`."""
        canvas, words = self._canvas, clean(words)
        canvas.setFillColorRGB(*colour)
        canvas.setFont(BOLD if bold else REGULAR, size_pt)
        x, y = (value * _POINTS_PER_MM for value in at)
        draw = {"left": canvas.drawString, "middle": canvas.drawCentredString, "right": canvas.drawRightString}[align]
        parts = runs(words)
        if turn_rad == 0.0 and parts == [words]:
            draw(x, y, words)
            return
        canvas.saveState()
        canvas.translate(x, y)
        canvas.rotate(degrees(turn_rad))
        if parts == [words]:
            draw(0, 0, words)
        else:
            self._draw_parts(parts, size_pt, bold=bold, align=align)
        canvas.restoreState()

    def _draw_parts(self, parts: list[str | Letter], size_pt: float, *, bold: bool, align: str) -> None:
        """Draw words at the origin, letters of other fonts than the sheet's as their outlines."""
        widths = [
            part.advance * size_pt if isinstance(part, Letter) else width_mm(part, size_pt, bold=bold) * _POINTS_PER_MM
            for part in parts
        ]
        x = {"left": 0.0, "middle": -0.5 * sum(widths), "right": -sum(widths)}[align]
        for part, width in zip(parts, widths, strict=True):
            if isinstance(part, Letter):
                path = self._canvas.beginPath()
                _trace(path, part.corner * size_pt + (x, 0.0), part.code.tolist())
                self._canvas.drawPath(path, stroke=0, fill=1, fillMode=_NON_ZERO)
            else:
                self._canvas.drawString(x, 0.0, part)
            x += width

    def picture(self, path: Path, box: Box) -> None:
        """See `Canvas`."""
        left, bottom, width, height = (v * _POINTS_PER_MM for v in (box.left, box.bottom, box.width, box.height))
        self._canvas.drawImage(str(path), left, bottom, width, height, preserveAspectRatio=True)

    @contextmanager
    def clip(self, box: Box) -> Iterator[None]:
        """See `Canvas`."""
        canvas = self._canvas
        canvas.saveState()
        path = canvas.beginPath()
        path.rect(*(v * _POINTS_PER_MM for v in (box.left, box.bottom, box.width, box.height)))
        canvas.clipPath(path, stroke=0, fill=0)
        yield
        canvas.restoreState()

    def _take(self, pen: Pen) -> None:
        canvas = self._canvas
        canvas.setStrokeColorRGB(*pen.colour)
        canvas.setLineWidth(pen.width_mm * _POINTS_PER_MM)
        canvas.setLineCap(1 if pen.round else 0)
        canvas.setLineJoin(1 if pen.round else 0)
        canvas.setDash([length * _POINTS_PER_MM for length in pen.dash_mm])

    def _path(self, paths: Sequence[FloatArray], *, closed: bool) -> Any:
        path = self._canvas.beginPath()
        for corners in paths:
            (x, y), *others = (corners * _POINTS_PER_MM).tolist()
            path.moveTo(x, y)
            for x, y in others:
                path.lineTo(x, y)
            if closed:
                path.close()
        return path


def _trace(path: Any, corner: FloatArray, codes: list[int]) -> None:
    """Draw a path of matplotlib's, corners (N, 2) in points and their codes, on one of reportlab's."""
    row, last = 0, corner[:1][0] if len(corner) else corner
    while row < len(codes):
        code = codes[row]
        if code == _MOVE:
            path.moveTo(*corner[row].tolist())
        elif code == _LINE:
            path.lineTo(*corner[row].tolist())
        elif code == _QUADRATIC:  # as a cubic one: its control points lie two thirds of the way to the one
            control, end = corner[row], corner[row + 1]
            points = (last + 2 * (control - last) / 3, end + 2 * (control - end) / 3, end)
            path.curveTo(*np.concatenate(points).tolist())
        elif code == _CUBIC:
            path.curveTo(*corner[row : row + 3].ravel().tolist())
        else:
            path.close()
        row += {_QUADRATIC: 2, _CUBIC: 3}.get(code, 1)
        last = corner[row - 1]
