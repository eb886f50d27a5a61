"""Tiles of the beam template: neighbouring beams and the pyramid that bounds them; layout in kernels/trace_tile.h.

Made once a template: a station only moves the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner_core.model import BeamTemplate, Float32Array, FloatArray
from planner_core.scan.template import directions

TILE_FLOATS = 40
"""Floats a tile: 4 planes, 4 corners, a mark of tiles too wide to be bounded, axis, right, up, 6 spare."""

#: The pyramid is larger than its beams by this, radians: boxes and corners are compared in float32 (ulp 6e-8, a dozen
#: roundings), and a computed hit may lie a few ulp outside its triangle.
_MARGIN = 4e-6
#: A tile with a beam farther from its axis than this (cosine) is not bounded at all: all planes and corners are zero,
#: and nothing is culled by them. Only templates of a few very coarse beams have such tiles.
_LEAST_COS = 0.5


@dataclass(frozen=True)
class TileGrid:
    """beams : (K, packets, 3, lanes) float32. bounds : (K, 40) float32. rectangles : (K, 4, packets) float32."""

    beams: Float32Array
    bounds: Float32Array
    rectangles: Float32Array
    tiles_across: int

    @property
    def n_tiles(self) -> int:
        """Number of tiles."""
        return int(self.bounds.shape[0])


def make_tiles(template: BeamTemplate, *, tile_rows: int, tile_columns: int, lanes: int) -> TileGrid:
    """Cut a template into tiles; beams past the last row or column repeat it."""
    beams = directions(template)
    n_down, n_across = -(-beams.shape[0] // tile_rows), -(-beams.shape[1] // tile_columns)
    row = np.minimum(np.arange(n_down * tile_rows), beams.shape[0] - 1)
    column = np.minimum(np.arange(n_across * tile_columns), beams.shape[1] - 1)
    padded = beams[row][:, column].reshape(n_down, tile_rows, n_across, tile_columns, 3)
    tiles: FloatArray = padded.transpose(0, 2, 1, 3, 4).reshape(n_down * n_across, tile_rows * tile_columns, 3)
    packets = tiles.astype(np.float32).reshape(tiles.shape[0], -1, lanes, 3).transpose(0, 1, 3, 2)
    bounds, plane = _bounds(tiles)
    return TileGrid(
        beams=np.ascontiguousarray(packets),
        bounds=bounds,
        rectangles=_rectangles(plane, packets.shape[1], lanes),
        tiles_across=n_across,
    )


def _bounds(tiles: FloatArray) -> tuple[Float32Array, FloatArray]:
    """Bounds of each tile's beams (K, n, 3), and x, y (K, n, 2) of the beams in the plane one metre along its axis."""
    axis = tiles.mean(axis=1)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 1e-9)
    # Right lies level where it can, so that rows of a tile run along the rectangle.
    upright = np.abs(axis[:, 2:]) < 0.99
    right = np.cross(np.where(upright, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]), axis)
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-9)
    up = np.cross(axis, right)
    ahead = np.einsum("kni,ki->kn", tiles, axis)
    wide = ahead.min(axis=1) < _LEAST_COS
    ahead = np.where(wide[:, None], 1.0, ahead)
    x = np.einsum("kni,ki->kn", tiles, right) / ahead
    y = np.einsum("kni,ki->kn", tiles, up) / ahead
    left, east = x.min(axis=1) - _MARGIN, x.max(axis=1) + _MARGIN
    low, high = y.min(axis=1) - _MARGIN, y.max(axis=1) + _MARGIN
    corners = np.stack(
        [
            axis + s[:, None] * right + t[:, None] * up
            for s, t in ((left, low), (east, low), (east, high), (left, high))
        ],
        axis=1,
    )
    planes = np.cross(corners, np.roll(corners, -1, axis=1))
    inward = np.einsum("kci,ki->kc", planes, axis)
    planes *= np.sign(inward)[..., None]
    planes /= np.maximum(np.linalg.norm(planes, axis=2, keepdims=True), 1e-30)
    bounds = np.zeros((tiles.shape[0], TILE_FLOATS), dtype=np.float32)
    bounds[:, :12] = planes.reshape(-1, 12)
    bounds[:, 12:24] = corners.reshape(-1, 12)
    bounds[:, 25:34] = np.concatenate([axis, right, up], axis=1)
    bounds[wide] = 0.0
    bounds[wide, 24] = 1e30
    return bounds, np.stack([x, y], axis=2)


def _rectangles(plane: FloatArray, n_packets: int, lanes: int) -> Float32Array:
    """Least and greatest x, then y, of every packet's beams (K, n, 2)."""
    packets = plane.reshape(plane.shape[0], n_packets, lanes, 2)
    low, high = packets.min(axis=2) - _MARGIN, packets.max(axis=2) + _MARGIN
    return np.stack([low[..., 0], high[..., 0], low[..., 1], high[..., 1]], axis=1).astype(np.float32)
