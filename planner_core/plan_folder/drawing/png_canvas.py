"""Canvas of PNG pictures, by matplotlib's software renderer; independent of user settings, time and screen."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import cos, degrees, sin
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, UInt8Array
from planner_core.plan_folder.drawing.canvas import INK, MM_PER_POINT, Box, Colour, Pen, clean
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


_COMPRESSION = 4
"""Takes two thirds of the time of the usual 6, for 2 to 5 % more bytes."""

_ALONG_MM = 1e-6
"""A line that gets off an axis by no more runs along it."""

_Mark = Callable[[Any, Any, Any], None]
"""Draws with matplotlib's renderer, its graphics context, and the transform from millimetres to pixels."""
_NO_PEN = Pen(0.0)


class PngCanvas:
    """`Canvas` of one picture. Areas are filled inside any ring: rings with holes are not drawn.

    zoom : drawn so many times as large as on paper.

    It is drawn at once at the end, by the renderer itself: figures, axes and artists above it take as long as that.
    """

    def __init__(self, width_mm: float, height_mm: float, *, zoom: float = 1.0) -> None:
        self.box = Box(0.0, 0.0, width_mm, height_mm)
        self._dots_per_inch = DPI * zoom
        self._size = pixels(width_mm * zoom), pixels(height_mm * zoom)
        self._rasters: list[tuple[UInt8Array, int, int]] = []
        self._marks: list[tuple[_Mark, Pen, Box | None]] = []
        self._clip: Box | None = None

    def lines(self, paths: Sequence[FloatArray], pen: Pen, *, closed: bool = False) -> None:
        """See `Canvas`."""

        def draw(renderer: Any, look: Any, to_pixels: Any) -> None:
            if pen.dash_mm:
                look.set_dashes(0, [length_mm / MM_PER_POINT for length_mm in pen.dash_mm])
            look.set_capstyle("projecting" if closed else "round" if pen.round else "butt")
            look.set_joinstyle("round" if pen.round else "miter")
            # Thousands of lines are drawn at once: those along the axes, which become sharp by it, on whole pixels.
            parts: tuple[list[FloatArray], list[FloatArray]] = ([], [])
            for path in paths:
                whole = np.concatenate([path, path[:1]]) if closed else path
                parts[bool((np.abs(whole[1:] - whole[:-1]).min(axis=1) < _ALONG_MM).all())].append(whole)
            for is_along, some in enumerate(parts):
                if some:
                    look.set_snap(bool(is_along))
                    renderer.draw_path(look, _outlines(some), to_pixels)

        self._add(draw, pen)

    def area(self, rings: Sequence[FloatArray], colour: Colour) -> None:
        """See `Canvas`."""

        def draw(renderer: Any, look: Any, to_pixels: Any) -> None:
            for ring in rings:
                renderer.draw_path(look, _outlines([ring]), to_pixels, colour)

        self._add(draw)

    def disc(self, centre: tuple[float, float], radius: float, fill: Colour, rim: Pen | None = None) -> None:
        """See `Canvas`."""

        def draw(renderer: Any, look: Any, to_pixels: Any) -> None:
            from matplotlib.path import Path as Outline

            renderer.draw_path(look, Outline.circle(centre, radius), to_pixels, fill)

        self._add(draw, rim)

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

        def draw(renderer: Any, look: Any, to_pixels: Any) -> None:
            from matplotlib.font_manager import FontProperties

            line = clean(words)
            font = FontProperties(family=families(line), size=size_pt, weight="bold" if bold else "normal")
            before = {"left": 0.0, "middle": 0.5, "right": 1.0}[align]
            before *= renderer.get_text_width_height_descent(line, font, False)[0] if before else 0.0
            x, y = to_pixels.transform(at) - before * np.array([cos(turn_rad), sin(turn_rad)])
            renderer.draw_text(look, x, self._size[1] - y, line, font, degrees(turn_rad))

        self._add(draw, Pen(0.0, colour))

    def picture(self, path: Path, box: Box) -> None:
        """See `Canvas`; below all that is drawn."""
        from PIL import Image

        with Image.open(path) as image:
            size = pixels(box.width), pixels(box.height)
            self.raster(np.asarray(image.convert("RGB").resize(size)), box.left, box.bottom)

    def raster(self, rgb: UInt8Array, left_mm: float, bottom_mm: float) -> None:
        """Place pixels (H, W, 3) one to one, below all that is drawn; row 0 is the top."""
        self._rasters.append((rgb, pixels(left_mm), pixels(bottom_mm)))

    @contextmanager
    def clip(self, box: Box) -> Iterator[None]:
        """See `Canvas`."""
        self._clip = box
        yield
        self._clip = None

    def drawn(self) -> UInt8Array:
        """(H, W, 4) sRGB and opacity of all that is on the canvas; row 0 is the top."""
        matplotlib = _matplotlib()
        from matplotlib.backends.backend_agg import RendererAgg
        from matplotlib.transforms import Affine2D, Bbox

        width, height = self._size
        to_pixels = Affine2D().scale(width / self.box.width, height / self.box.height)
        # Not a user's matplotlibrc; naming a backend, though, would load half of matplotlib to choose it.
        defaults = {name: matplotlib.rcParamsDefault[name] for name in matplotlib.rcParamsDefault if name != "backend"}
        with matplotlib.rc_context(defaults):
            renderer: Any = RendererAgg(width, height, self._dots_per_inch)  # type: ignore[no-untyped-call]
            canvas: UInt8Array = np.asarray(renderer.buffer_rgba())
            canvas[:] = 255
            for rgb, left, bottom in self._rasters:
                top = height - bottom - len(rgb)
                place = canvas[max(top, 0) : top + len(rgb), left : left + rgb.shape[1], :3]
                place[:] = rgb[max(-top, 0) :, : place.shape[1]]
            for draw, pen, clip in self._marks:
                look = renderer.new_gc()
                look.set_foreground(pen.colour)
                look.set_linewidth(pen.width_mm / MM_PER_POINT)
                if clip is not None:
                    inside = Bbox.from_extents(clip.left, clip.bottom, clip.right, clip.top)
                    look.set_clip_rectangle(inside.transformed(to_pixels))
                draw(renderer, look, to_pixels)
        return canvas

    def save(self, path: Path) -> None:
        """Write the PNG, without date or program name."""
        from PIL import Image

        path.parent.mkdir(parents=True, exist_ok=True)
        dpi = self._dots_per_inch, self._dots_per_inch
        image = Image.fromarray(self.drawn()).convert("RGB")
        image.save(path, format="PNG", dpi=dpi, compress_level=_COMPRESSION)

    def _add(self, draw: _Mark, pen: Pen | None = None) -> None:
        """Draw over all that was drawn before. pen : of outlines and letters; None: no outlines."""
        self._marks.append((draw, pen or _NO_PEN, self._clip))


def _outlines(paths: Sequence[FloatArray]) -> Any:
    """One of matplotlib's paths for all of these (N, 2)."""
    from matplotlib.path import Path as Outline

    lengths = [len(path) for path in paths]
    codes = np.full(sum(lengths), Outline.LINETO, dtype=Outline.code_type)
    codes[np.cumsum([0, *lengths[:-1]])] = Outline.MOVETO
    return Outline(np.concatenate(paths), codes)
