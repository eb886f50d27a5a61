"""Lines of a picture: a mask of ink -> polylines along the middle of its lines, and outlines of its filled areas.

1. what is thicker than a line is filled: its outline is the contour at half of a pixel (contourpy);
2. the rest is thinned to lines of one pixel by Zhang's and Suen's algorithm;
3. lines are followed from crossing to crossing, and straightened to `_OFF_PX`.

Pixel coordinates (x, y): the middle of the pixel in row i and column j is (j, i).

Source: T. Y. Zhang and C. Y. Suen, A fast parallel algorithm for thinning digital patterns, 1984.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from scipy import ndimage

from planner_core.compiled import compiled
from planner_core.model import BoolArray, FloatArray, Int64Array, UInt8Array

_OFF_PX = 1.0
"""Straightened lines leave the thinned ones by less."""
_SPUR_PX = 4.0
"""Loose ends shorter than this, and than the ink is thick, come from thinning."""


def filled_areas(ink: BoolArray, line_px: float) -> tuple[list[list[FloatArray]], BoolArray]:
    """Areas of ink that are thicker than `line_px`, and the ink without them.

    Returns
    -------
    Rings (K, 2) of each area, its outline first; (H, W) bool, the lines.
    """
    reach = max(1, round(0.5 * line_px))
    core = ndimage.binary_erosion(ink, np.ones((2 * reach + 1, 2 * reach + 1)))
    if not core.any():
        return [], ink
    thick = ndimage.binary_dilation(core, np.ones((2 * reach + 1, 2 * reach + 1))) & ink
    lines = ink & ~ndimage.binary_dilation(thick, np.ones((3, 3)))
    return _contours(thick), lines


def _contours(mask: BoolArray) -> list[list[FloatArray]]:
    from contourpy import FillType, contour_generator

    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    low = np.array([columns[0] - 1, rows[0] - 1])
    part = np.pad(mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1].astype(np.float32), 1)
    filled = contour_generator(z=part, fill_type=FillType.OuterOffset).filled(0.5, 2.0)
    areas = []
    for points, offsets in zip(*filled, strict=True):
        rings = [points[a:b] + low for a, b in pairwise(offsets)]
        areas.append([shapely.get_coordinates(shapely.simplify(shapely.LinearRing(ring), _OFF_PX)) for ring in rings])
    return areas


def traced_lines(ink: BoolArray) -> list[FloatArray]:
    """Polylines (K, 2) along the middle of lines of ink (H, W), closed ones with their first point repeated."""
    if not ink.any():
        return []
    image = np.pad(ink, 1).astype(np.uint8)
    _thin(image, np.argwhere(image))
    points, starts = _chains(image, np.argwhere(image))
    lines = np.split(points, starts[1:-1])
    ends = np.array([[line[0], line[-1]] for line in lines]).reshape(-1, 2)
    _, at, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    loose = (count[at.reshape(-1)] == 1).reshape(-1, 2).any(axis=1)
    strokes = [
        line[:, ::-1].astype(np.float64) - 1.0
        for line, is_loose in zip(lines, loose.tolist(), strict=True)
        if not (is_loose and len(line) <= _SPUR_PX and count.size > 2) and len(line) > 1
    ]
    if not strokes:
        return []
    indices = np.repeat(np.arange(len(strokes)), [len(stroke) for stroke in strokes])
    straight = shapely.simplify(shapely.linestrings(np.concatenate(strokes), indices=indices), _OFF_PX)
    return [shapely.get_coordinates(line) for line in straight]


@compiled
def _thin(image: UInt8Array, pixels: Int64Array) -> None:
    """Thin a padded image (H, W) in place; pixels : (N, 2) row and column of its ink."""
    left = pixels.copy()
    n_left = left.shape[0]
    gone = np.empty(n_left, dtype=np.int64)
    changed = True
    while changed:
        changed = False
        for half in range(2):
            n_gone = 0
            for k in range(n_left):
                i, j = left[k, 0], left[k, 1]
                p2, p3, p4 = image[i - 1, j], image[i - 1, j + 1], image[i, j + 1]
                p5, p6, p7 = image[i + 1, j + 1], image[i + 1, j], image[i + 1, j - 1]
                p8, p9 = image[i, j - 1], image[i - 1, j - 1]
                around = p2 + p3 + p4 + p5 + p6 + p7 + p8 + p9
                if around < 2 or around > 6:
                    continue
                steps = 0
                steps += p2 == 0 and p3 == 1
                steps += p3 == 0 and p4 == 1
                steps += p4 == 0 and p5 == 1
                steps += p5 == 0 and p6 == 1
                steps += p6 == 0 and p7 == 1
                steps += p7 == 0 and p8 == 1
                steps += p8 == 0 and p9 == 1
                steps += p9 == 0 and p2 == 1
                if steps != 1:
                    continue
                if half == 0:
                    goes = p2 * p4 * p6 == 0 and p4 * p6 * p8 == 0
                else:
                    goes = p2 * p4 * p8 == 0 and p2 * p6 * p8 == 0
                if goes:
                    gone[n_gone] = k
                    n_gone += 1
            for m in range(n_gone):
                image[left[gone[m], 0], left[gone[m], 1]] = 0
            if n_gone > 0:
                changed = True
                n_kept = 0
                for k in range(n_left):
                    if image[left[k, 0], left[k, 1]] == 1:
                        left[n_kept, 0], left[n_kept, 1] = left[k, 0], left[k, 1]
                        n_kept += 1
                n_left = n_kept


@compiled
def _degree(image: UInt8Array, i: int, j: int) -> int:
    """Number of lines that leave a pixel: diagonal neighbours count where no straight one leads there."""
    count = 0
    for di in range(-1, 2):
        for dj in range(-1, 2):
            if (di != 0 or dj != 0) and image[i + di, j + dj] > 0:
                if di != 0 and dj != 0 and (image[i + di, j] > 0 or image[i, j + dj] > 0):
                    continue
                count += 1
    return count


@compiled
def _chains(image: UInt8Array, pixels: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Follow thinned lines. Returns points (N, 2) row and column, and where each line starts, CSR.

    Pixels are 1; those passed become 2. Ends and crossings (degree other than 2) begin and end lines; what is left
    then are rings.
    """
    n = pixels.shape[0]
    points = np.empty((8 * n + 16, 2), dtype=np.int64)
    starts = np.empty(8 * n + 16, dtype=np.int64)
    n_points, n_lines = 0, 0
    degree = np.empty(n, dtype=np.int64)
    is_node = np.zeros(image.shape, dtype=np.uint8)
    for k in range(n):
        i, j = pixels[k, 0], pixels[k, 1]
        degree[k] = _degree(image, i, j)
        if degree[k] != 2:
            is_node[i, j] = 1
    for rings in range(2):
        for k in range(n):
            i0, j0 = pixels[k, 0], pixels[k, 1]
            if rings == 0 and is_node[i0, j0] == 0:
                continue
            if rings == 1 and (is_node[i0, j0] == 1 or image[i0, j0] == 2):
                continue
            for straight in range(2):
                for di in range(-1, 2):
                    for dj in range(-1, 2):
                        if (di == 0 and dj == 0) or (di == 0 or dj == 0) != (straight == 0):
                            continue
                        i, j = i0 + di, j0 + dj
                        if image[i, j] == 0:
                            continue
                        if di != 0 and dj != 0 and (image[i, j0] > 0 or image[i0, j] > 0):
                            continue
                        if is_node[i, j] == 1:
                            if rings == 0 and (i > i0 or (i == i0 and j > j0)):
                                starts[n_lines] = n_points
                                n_lines += 1
                                points[n_points, 0], points[n_points, 1] = i0, j0
                                points[n_points + 1, 0], points[n_points + 1, 1] = i, j
                                n_points += 2
                            continue
                        if image[i, j] == 2:
                            continue
                        starts[n_lines] = n_points
                        n_lines += 1
                        points[n_points, 0], points[n_points, 1] = i0, j0
                        n_points += 1
                        before_i, before_j = i0, j0
                        while True:
                            points[n_points, 0], points[n_points, 1] = i, j
                            n_points += 1
                            if is_node[i, j] == 1 or (i == i0 and j == j0):
                                break
                            image[i, j] = 2
                            next_i, next_j = -1, -1
                            for turn in range(2):
                                for ei in range(-1, 2):
                                    for ej in range(-1, 2):
                                        if (ei == 0 and ej == 0) or (ei == 0 or ej == 0) != (turn == 0):
                                            continue
                                        u, v = i + ei, j + ej
                                        if image[u, v] == 0 or (u == before_i and v == before_j) or next_i >= 0:
                                            continue
                                        if ei != 0 and ej != 0 and (image[u, j] > 0 or image[i, v] > 0):
                                            continue
                                        closes = u == i0 and v == j0
                                        if image[u, v] == 1 or is_node[u, v] == 1 or closes:
                                            next_i, next_j = u, v
                            if next_i < 0:
                                break
                            before_i, before_j = i, j
                            i, j = next_i, next_j
                        if rings == 1:
                            image[i0, j0] = 2
    starts[n_lines] = n_points
    return points[:n_points].copy(), starts[: n_lines + 1].copy()
