"""Pictures of floor plans (PNG, JPEG, TIFF, BMP, WebP) -> `Drawing`: lines and filled areas by their colours.

Ink is what is darker or more coloured than the paper around it, so that shadows of photographs do not count. Each
colour is a layer (`black`, `red`, `yellow`, `green`, `cyan`, `blue`, `magenta`). The unit is a pixel; y points up.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from planner_core import child_process
from planner_core.drawings.drawing import Drawing, DrawingParts
from planner_core.drawings.line_tracing import filled_areas, traced_lines
from planner_core.errors import MissingPackageError, SceneError, grouped, shortened
from planner_core.model import BoolArray, UInt8Array
from planner_core.progress import ProgressEvent

COLOURS = ("black", "red", "yellow", "green", "cyan", "blue", "magenta")
MOST_PIXELS = 200_000_000
"""A sheet A0 at 300 dots per inch has 140 million."""
_LEAST_PIXELS = 10_000
_INK_SHARE = 0.2
"""Ink is darker than its paper by this share of the paper's brightness."""
_PAPER_PX = 64
"""The paper's brightness is that of squares of this side, as bright as all but a tenth of them."""
_COLOURED = 0.4
_MOST_INK = 0.4
"""Of a drawing's pixels; photographs of rooms have more."""
_LINE_PX = 6.0
"""Lines are thinner at the usual resolutions; what is thicker is a filled area."""


def read_picture(path: str) -> Drawing:
    """Read a picture.

    Raises
    ------
    SceneError
        Not a picture, too large, or nothing drawn on it.
    MissingPackageError
        OpenImageIO is not installed.
    """
    file = Path(path)
    child_process.at("the picture")
    rgb, paper_unit_m = picture_pixels(file)
    return drawing_of_pixels(rgb, file.name, paper_unit_m=paper_unit_m)


def drawing_of_pixels(rgb: UInt8Array, name: str, *, paper_unit_m: float | None = None) -> Drawing:
    """Trace the lines of a picture (H, W, 3) uint8. paper_unit_m : metres of paper in a pixel; None: not known."""
    ink = _ink(rgb)
    share = float(ink.mean())
    if share > _MOST_INK or not ink.any():
        what = "nothing is drawn on it" if not ink.any() else f"{100 * share:.0f} % of it is ink"
        raise SceneError(
            f"{name}: {what}, expected dark or coloured lines on plain paper; crop it to the plan, or raise its "
            "contrast."
        )
    parts = DrawingParts()
    height = rgb.shape[0]
    colour = _colours(rgb, ink)
    for number, layer in enumerate(COLOURS):
        child_process.progress_of_child(ProgressEvent("load", number, len(COLOURS), "tracing lines"))
        mask = np.zeros(ink.shape, dtype=np.bool_)
        mask[ink] = colour == number
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not rows.size:
            continue
        shift = np.array([columns[0], rows[0]])
        part = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        areas, lines = filled_areas(part, _LINE_PX)
        for rings in areas:
            fill = parts.new_fill()
            for ring in rings:
                parts.add_stroke(_up(ring + shift, height), layer, fill=fill, closed=True)
        for line in traced_lines(lines):
            parts.add_stroke(_up(line + shift, height), layer)
    page_height = float(height - 1)
    return parts.drawing(name, unit_m=None, paper_unit_m=paper_unit_m, page_height=page_height, from_picture=np.eye(3))


def _up(points: Any, height: int) -> Any:
    return np.column_stack([points[:, 0], height - 1 - points[:, 1]])


def picture_pixels(file: Path) -> tuple[UInt8Array, float | None]:
    """(H, W, 3) uint8, on white paper, upright; and metres of paper in a pixel, where the file has its resolution."""
    try:
        import OpenImageIO as oiio  # noqa: N813
    except ImportError as error:
        raise MissingPackageError(
            f"{file.name}: reading pictures needs the package OpenImageIO, which is missing; run pip install "
            "openimageio."
        ) from error
    picture = oiio.ImageBuf(str(file))
    if picture.has_error or picture.spec().width == 0:
        raise SceneError(
            f"{file.name}: it can't be read as a picture ({shortened(picture.geterror())}), expected PNG, JPEG, TIFF, "
            "BMP or WebP; save it again."
        )
    spec = picture.spec()
    n_pixels = spec.width * spec.height
    if not _LEAST_PIXELS <= n_pixels <= MOST_PIXELS:
        raise SceneError(
            f"{file.name}: it has {grouped(n_pixels)} pixels, expected {grouped(_LEAST_PIXELS)} to "
            f"{grouped(MOST_PIXELS)}; scan it at 100 to 300 dots per inch, or crop it to the plan."
        )
    if spec.get_int_attribute("Orientation", 1) != 1:
        picture = oiio.ImageBufAlgo.reorient(picture)
    values = picture.get_pixels(oiio.UINT8)
    if values is None:
        raise SceneError(f"{file.name}: its pixels can't be read, expected a whole picture; save it again.")
    return _on_white(np.asarray(values, dtype=np.uint8)), _paper_unit_m(spec)


def _paper_unit_m(spec: Any) -> float | None:
    """Metres in a pixel by the file's resolution; a screen's 72 or 96 dots per inch stand for none."""
    resolution, unit = spec.get_float_attribute("XResolution", 0.0), spec.get_string_attribute("ResolutionUnit", "")
    per_m = resolution / {"in": 0.0254, "inch": 0.0254, "cm": 0.01, "m": 1.0}.get(unit, np.inf)
    return 1.0 / per_m if per_m > 100.0 / 0.0254 - 1e-6 else None


def _on_white(values: UInt8Array) -> UInt8Array:
    n_channels = values.shape[2] if values.ndim == 3 else 1
    values = values.reshape(values.shape[0], values.shape[1], n_channels)
    if n_channels in (2, 4):  # alpha is multiplied in
        rest = 255 - values[..., -1:]
        values = values[..., :-1] + np.minimum(rest, 255 - values[..., :-1])
    return np.repeat(values, 3, axis=2) if values.shape[2] == 1 else np.ascontiguousarray(values[..., :3])


def _ink(rgb: UInt8Array) -> BoolArray:
    """(H, W) bool: what is darker in some channel than the paper around it; of light lines on dark paper, those."""
    if float(np.median(rgb[::7, ::7])) < 100:
        rgb = 255 - rgb
    darkest = rgb.min(axis=2)
    height, width = darkest.shape
    n_down, n_across = -(-height // _PAPER_PX), -(-width // _PAPER_PX)
    padded = np.pad(darkest, ((0, n_down * _PAPER_PX - height), (0, n_across * _PAPER_PX - width)), mode="edge")
    squares = padded.reshape(n_down, _PAPER_PX, n_across, _PAPER_PX).swapaxes(1, 2).reshape(n_down, n_across, -1)
    paper = np.sort(squares[..., ::16], axis=2)[..., int(0.9 * squares[..., ::16].shape[2])]
    paper = ndimage.median_filter(ndimage.maximum_filter(paper, 3), 5)
    limit = ((1.0 - _INK_SHARE) * paper).astype(np.uint8)
    whole = np.repeat(np.repeat(limit, _PAPER_PX, axis=0), _PAPER_PX, axis=1)[:height, :width]
    return np.asarray(darkest < whole)


def _colours(rgb: UInt8Array, ink: BoolArray) -> UInt8Array:
    """(N,) uint8 into `COLOURS` of the pixels that are ink."""
    values = rgb[ink]
    if float(np.median(rgb[::7, ::7])) < 100:
        plain = values.max(axis=1, keepdims=True) - values.min(axis=1, keepdims=True) < 60
        values = np.where(plain, 255 - values, values)
    return colours_of(values)


def colours_of(rgb: UInt8Array) -> UInt8Array:
    """(N,) uint8 into `COLOURS` of colours (N, 3) on white paper: black, or the nearest of six hues."""
    values = rgb.astype(np.int16)
    high, low = values.max(axis=1), values.min(axis=1)
    spread = np.maximum(high - low, 1)
    red, green, blue = values.T
    after_red, after_green, after_blue = (green - blue) / spread, (blue - red) / spread, (red - green) / spread
    hue = np.where(high == red, after_red, np.where(high == green, 2 + after_green, 4 + after_blue))
    nearest = np.rint(hue).astype(np.int64) % 6 + 1
    coloured = (high - low) > _COLOURED * np.maximum(255 - low, 1)
    return np.where(coloured, nearest, 0).astype(np.uint8)
