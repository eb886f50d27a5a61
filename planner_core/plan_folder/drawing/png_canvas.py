"""Canvas of PNG pictures, by matplotlib's software renderer; independent of user settings, time and screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, UInt8Array
from planner_core.plan_folder.drawing.canvas import INK, MM_PER_POINT, PAPER, Box, Colour, Pen, clean
from planner_core.plan_folder.drawing.fonts import families

DPI = 144
"""Pixels an inch of paper: discs and letters are as large on a screen as printed sheets show them from near."""


def pixels(length_mm: float) -> int:
    """Whole pixels of a length on paper."""
    return round(length_mm / 25.4 * DPI)


def whole_pixels_mm(length_mm: float) -> float:
    """A length rounded to whole pixels: lines on pixels that are placed one to one are not off by a part of one."""
    return pixels(length_mm) / DPI * 25.4


def _matplotlib() -> Any:
    try:
        import matplotlib
    except ImportError as error:
        raise MissingPackageError(
            f"maps need the package matplotlib, which can't be imported ({error}): pip install matplotlib"
        ) from error
    return matplotlib


class PngCanvas:
    """`Canvas` of one picture. Areas are filled inside any ring: rings with holes are not drawn.

    zoom : drawn so many times as large as on paper.
    """

    def __init__(self, width_mm: float, height_mm: float, *, zoom: float = 1.0) -> None:
        matplotlib = _matplotlib()
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.box = Box(0.0, 0.0, width_mm, height_mm)
        with matplotlib.rc_context(matplotlib.rcParamsDefault):  # not a user's matplotlibrc
            size = (pixels(width_mm * zoom) / DPI / zoom, pixels(height_mm * zoom) / DPI / zoom)
            self.figure: Any = Figure(figsize=size, dpi=DPI * zoom, facecolor=PAPER)
            FigureCanvasAgg(self.figure)
            self._axes: Any = self.figure.add_axes((0, 0, 1, 1))
        self._axes.set_axis_off()
        self._axes.set_xlim(0, width_mm)
        self._axes.set_ylim(0, height_mm)
        self._clip: Any = None
        self._n_drawn = 0

    def lines(self, paths: Sequence[FloatArray], pen: Pen, *, closed: bool = False) -> None:
        """See `Canvas`."""
        from matplotlib.collections import LineCollection

        self._add(
            self._axes.add_collection,
            LineCollection(
                [np.concatenate([path, path[:1]]) if closed else path for path in paths],
                colors=[pen.colour],
                linewidths=pen.width_mm / MM_PER_POINT,
                linestyles=(0, [length / pen.width_mm for length in pen.dash_mm]) if pen.dash_mm else "solid",
                capstyle="projecting" if closed else "round" if pen.round else "butt",
                joinstyle="round" if pen.round else "miter",
            ),
        )

    def area(self, rings: Sequence[FloatArray], colour: Colour) -> None:
        """See `Canvas`."""
        from matplotlib.collections import PolyCollection

        self._add(self._axes.add_collection, PolyCollection(list(rings), facecolors=[colour], linewidths=0))

    def disc(self, centre: tuple[float, float], radius: float, fill: Colour, rim: Pen | None = None) -> None:
        """See `Canvas`."""
        from matplotlib.patches import Circle

        edge = {"linewidth": 0} if rim is None else {"linewidth": rim.width_mm / MM_PER_POINT, "edgecolor": rim.colour}
        self._add(self._axes.add_patch, Circle(centre, radius, facecolor=fill, **edge))

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
        words = clean(words)
        written = self._axes.text(
            *at, words, family=families(words), fontsize=size_pt, color=colour, weight="bold" if bold else "normal",
            ha="center" if align == "middle" else align, va="baseline", rotation=degrees(turn_rad),
            rotation_mode="anchor", parse_math=False,
        )  # fmt: skip
        self._add(None, written)

    def picture(self, path: Path, box: Box) -> None:
        """See `Canvas`."""
        from matplotlib.image import imread

        self._axes.imshow(imread(path), extent=(box.left, box.right, box.bottom, box.top), aspect="auto")

    def raster(self, rgb: UInt8Array, left_mm: float, bottom_mm: float) -> None:
        """Place pixels (H, W, 3) one to one, below all that is drawn; row 0 is the top."""
        self.figure.figimage(rgb, pixels(left_mm), pixels(bottom_mm), origin="upper", zorder=-1)

    @contextmanager
    def clip(self, box: Box) -> Iterator[None]:
        """See `Canvas`."""
        from matplotlib.patches import Rectangle

        self._clip = Rectangle((box.left, box.bottom), box.width, box.height, transform=self._axes.transData)
        yield
        self._clip = None

    def save(self, path: Path) -> None:
        """Write the PNG, without date or program name."""
        matplotlib = _matplotlib()
        path.parent.mkdir(parents=True, exist_ok=True)
        with matplotlib.rc_context(matplotlib.rcParamsDefault):
            self.figure.savefig(path, format="png", dpi="figure", facecolor=PAPER, metadata={"Software": None})

    def _add(self, place: Any, artist: Any) -> None:
        """Draw over all that was drawn before."""
        if place is not None:
            place(artist)
        self._n_drawn += 1
        artist.set_zorder(self._n_drawn)
        if self._clip is not None:
            artist.set_clip_path(self._clip)
            artist.set_clip_on(True)
