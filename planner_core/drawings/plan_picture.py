"""The picture under a storey: that which it was recognised in, in plan coordinates, metres."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from planner_core.drawings.pdf import page_pixels
from planner_core.drawings.pictures import picture_pixels
from planner_core.errors import shortened
from planner_core.model import UInt8Array

_PLAN_PICTURE_PX = 2400
"""Of the longer side."""


def write_plan_picture(path: str, to: str, matrix: list[list[float]], box_m: list[float], page: int = 0) -> None:
    """Write the part of a picture that shows a box of the plan, upright and without perspective, as PNG.

    Parameters
    ----------
    page
        Of a PDF, the page that is the picture, from 1; 0: the file is a picture.
    matrix
        (3, 3) homography from pixels, y up, to the plan, metres.
    box_m
        x0, y0, x1, y1: of its corners.
    """
    import OpenImageIO as oiio  # noqa: N813

    rgb = page_pixels(path, page) if page else picture_pixels(Path(path))[0]
    x0, y0, x1, y1 = box_m
    per_m = _PLAN_PICTURE_PX / max(x1 - x0, y1 - y0)
    width, height = max(1, round(per_m * (x1 - x0))), max(1, round(per_m * (y1 - y0)))
    inverse = np.linalg.inv(np.array(matrix))
    height_px = rgb.shape[0]
    step = max(1, int(_pixels_per_m(inverse, np.array([(x0 + x1) / 2, (y0 + y1) / 2])) / per_m))
    rgb = _shrunk(rgb, step)
    out = np.full((height, width, 3), 255, dtype=np.uint8)
    x = x0 + (np.arange(width) + 0.5) / per_m
    for row in range(height):  # a row at a time: what is in between takes no memory
        at = inverse @ np.stack([x, np.full(width, y1 - (row + 0.5) / per_m), np.ones(width)])
        column, line = np.rint(at[0] / at[2]) // step, (height_px - 1 - np.rint(at[1] / at[2])) // step
        inside = (column >= 0) & (column < rgb.shape[1]) & (line >= 0) & (line < rgb.shape[0])
        out[row, inside] = rgb[line[inside].astype(np.int64), column[inside].astype(np.int64)]
    picture = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, oiio.UINT8))
    picture.set_pixels(picture.roi, out)
    if not picture.write(to):
        raise OSError(0, shortened(picture.geterror()), to)


def _pixels_per_m(inverse: Any, at_m: Any) -> float:
    """Pixels in a metre about a point of the plan."""
    corners = at_m + np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]])
    images = np.column_stack([corners, np.ones(3)]) @ inverse.T
    places = images[:, :2] / images[:, 2:]
    return float(np.sqrt(abs(np.linalg.det(places[1:] - places[0])))) / 1e-3


def _shrunk(rgb: UInt8Array, step: int) -> UInt8Array:
    """The means of squares of `step` pixels: thin lines fade, but stay."""
    if step == 1:
        return rgb
    n_down, n_across = rgb.shape[0] // step, rgb.shape[1] // step
    out = np.empty((n_down, n_across, 3), dtype=np.uint8)
    for row in range(n_down):
        block = rgb[row * step : (row + 1) * step, : n_across * step]
        out[row] = block.reshape(step, n_across, step, 3).mean(axis=(0, 2))
    return out
