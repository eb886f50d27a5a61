"""Canvas of drawings inside an HTML page: one SVG each, its pictures inside, nothing from elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from math import degrees
from pathlib import Path

from planner_core.model import FloatArray
from planner_core.plan_folder.drawing.canvas import INK, MM_PER_POINT, Box, Colour, Pen, clean

_ANCHOR = {"left": "start", "middle": "middle", "right": "end"}


class SvgCanvas:
    """`Canvas` of one drawing.

    Parameters
    ----------
    shown
        The part of the page that is shown.
    name
        Of this drawing in its page: letters and digits, none other has it.
    title
        What it shows, for those who can't see it.
    """

    def __init__(self, shown: Box, *, name: str, title: str) -> None:
        self._shown = shown
        self._name, self._title = name, title
        self._marks: list[str] = []
        self._n_clips = 0

    def svg(self) -> str:
        """Return the drawing: an <svg> element of its size on paper."""
        width, height = _number(self._shown.width), _number(self._shown.height)
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" viewBox="0 0 {width} '
            f'{height}" role="img" font-family="DejaVu Sans,Verdana,sans-serif"><title>{escape(clean(self._title))}'
            f"</title>\n" + "\n".join(self._marks) + "\n</svg>"
        )

    def lines(self, paths: Sequence[FloatArray], pen: Pen, *, closed: bool = False) -> None:
        """See `Canvas`."""
        if len(paths):
            self._marks.append(f'<path d="{self._path(paths, closed=closed)}" fill="none"{_stroke(pen)}/>')

    def area(self, rings: Sequence[FloatArray], colour: Colour) -> None:
        """See `Canvas`."""
        if len(rings):
            path = self._path(rings, closed=True)
            self._marks.append(f'<path d="{path}" fill="{_hex(colour)}" fill-rule="evenodd"/>')

    def disc(self, centre: tuple[float, float], radius: float, fill: Colour, rim: Pen | None = None) -> None:
        """See `Canvas`."""
        x, y = self._at(centre)
        edge = "" if rim is None else _stroke(rim)
        self._marks.append(f'<circle cx="{x}" cy="{y}" r="{_number(radius)}" fill="{_hex(fill)}"{edge}/>')

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
        x, y = self._at(at)
        weight = ' font-weight="bold"' if bold else ""
        turn = f' transform="rotate({_number(-degrees(turn_rad))} {x} {y})"' if turn_rad else ""
        self._marks.append(
            f'<text x="{x}" y="{y}" font-size="{_number(size_pt * MM_PER_POINT)}" fill="{_hex(colour)}" '
            f'text-anchor="{_ANCHOR[align]}"{weight}{turn}>{escape(clean(words))}</text>'
        )

    def picture(self, path: Path, box: Box) -> None:
        """See `Canvas`."""
        x, y = self._at((box.left, box.top))
        content = base64.b64encode(path.read_bytes()).decode("ascii")
        self._marks.append(
            f'<image x="{x}" y="{y}" width="{_number(box.width)}" height="{_number(box.height)}" '
            f'href="data:image/png;base64,{content}"/>'
        )

    @contextmanager
    def clip(self, box: Box) -> Iterator[None]:
        """See `Canvas`."""
        self._n_clips += 1
        name = f"{self._name}clip{self._n_clips}"
        x, y = self._at((box.left, box.top))
        self._marks.append(
            f'<clipPath id="{name}"><rect x="{x}" y="{y}" width="{_number(box.width)}" '
            f'height="{_number(box.height)}"/></clipPath><g clip-path="url(#{name})">'
        )
        yield
        self._marks.append("</g>")

    def _at(self, point: tuple[float, float]) -> tuple[str, str]:
        return _number(point[0] - self._shown.left), _number(self._shown.top - point[1])

    def _path(self, paths: Sequence[FloatArray], *, closed: bool) -> str:
        end = "Z" if closed else ""
        return "".join("M" + "L".join(" ".join(self._at((x, y))) for x, y in c.tolist()) + end for c in paths)


def _number(value: float) -> str:
    """Thousandths of a millimetre, without needless noughts."""
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)


def _stroke(pen: Pen) -> str:
    dash = f' stroke-dasharray="{" ".join(_number(length) for length in pen.dash_mm)}"' if pen.dash_mm else ""
    ends = ' stroke-linecap="round" stroke-linejoin="round"' if pen.round else ""
    return f' stroke="{_hex(pen.colour)}" stroke-width="{_number(pen.width_mm)}"{dash}{ends}'
