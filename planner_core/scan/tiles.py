"""Tiles of the beam template: neighbouring beams and the pyramid that bounds them; layout in kernels/trace_tile.h.

Made once a template: a station only moves the origin.

A template is cut into strips of rows, a strip into tiles. Where rows have azimuth offsets, they are shifted against one
another by whole columns, so that the beams of a tile look the same way. How many rows a strip has follows the beams'
directions: a tile is about as wide as high, near the zenith too where azimuths crowd, and never too wide to be bounded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner_core.model import BeamTemplate, BoolArray, Float32Array, FloatArray, Int32Array, Int64Array
from planner_core.scan.template import azimuth_step_rad, directions, is_full_turn

TILE_FLOATS = 40
"""Floats a tile: 4 planes, 4 corners, a zero, axis, right, up, 6 spare."""

#: The pyramid is larger than its beams by this, radians: boxes and corners are compared in float32 (ulp 6e-8, a dozen
#: roundings), and a computed hit may lie a few ulp outside its triangle.
_MARGIN = 4e-6
#: Widest and highest that a tile may be, radians: a pyramid of more than some 50 degrees from its axis bounds nothing.
_LARGEST_RAD = np.deg2rad(30.0)
#: Work of a tile goes as (width + this) (height + this): what it meets besides its own beams, in boxes and triangles.
_SURROUNDINGS_RAD = np.deg2rad(4.0)
#: The device's own shape of tile, which was measured, is kept until another one is better by more than this.
_WORTH = 1.25


@dataclass(frozen=True)
class TileGrid:
    """beams : (K, packets, 3, lanes) float32. bounds : (K, 40) float32. rectangles : (K, 4, packets) float32.

    places : (K, packets, 2) int32, where the beams lie in the template's image: kernels/template.h.
    """

    beams: Float32Array
    bounds: Float32Array
    rectangles: Float32Array
    places: Int32Array

    @property
    def n_tiles(self) -> int:
        """Number of tiles."""
        return int(self.bounds.shape[0])


@dataclass(frozen=True)
class _Strip:
    """Rows that one row of tiles covers; a tile has `across` packets side by side, and `columns` beams of them used."""

    first_row: int
    n_rows: int
    across: int
    columns: int


@dataclass(frozen=True)
class _Columns:
    """Columns of tiles: column v of a tile's row r is column v + shift[r] of the template's; from `first` to `end`."""

    shift: Int64Array
    first: int
    end: int
    full_turn: bool
    step_rad: float


def make_tiles(template: BeamTemplate, *, tile_rows: int, tile_columns: int, lanes: int) -> TileGrid:
    """Cut a template into tiles of `tile_rows` x `tile_columns` beams, or as many in another arrangement.

    Lanes without a beam of their own repeat one of their tile.
    """
    packets = tile_rows * tile_columns // lanes
    columns = _columns(template)
    parts = [
        _tile_strip(template, strip, columns, packets, lanes)
        for strip in _strips(template, columns, tile_rows, packets, lanes)
    ]
    return TileGrid(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _columns(template: BeamTemplate) -> _Columns:
    n_rows, n_columns = template.shape
    step, full_turn = azimuth_step_rad(template), is_full_turn(template)
    shift = np.zeros(n_rows, dtype=np.int64)
    if template.azimuth_offset_rad is not None and step > 0:
        shift = -np.rint(template.azimuth_offset_rad / step).astype(np.int64)
    if full_turn:
        return _Columns(shift % n_columns, 0, n_columns, True, step)
    return _Columns(shift, -int(shift.max()), n_columns - int(shift.min()), False, step)


def _strips(template: BeamTemplate, columns: _Columns, tile_rows: int, packets: int, lanes: int) -> Iterator[_Strip]:
    """Rows from top to bottom, each strip in the arrangement of packets that promises least work a beam."""
    elevation = template.elevation_rad
    own_across = packets // tile_rows
    arrangements = [own_across] + [n for n in range(packets, 0, -1) if packets % n == 0 and n != own_across]
    row = 0
    while row < elevation.size:
        best, best_work = None, np.inf
        for across in arrangements:
            strip = _strip_at(row, elevation, columns, packets // across, across, lanes)
            work = _work(strip, elevation, columns) * (1.0 if across == own_across else _WORTH)
            if work < best_work:
                best, best_work = strip, work
        assert best is not None
        yield best
        row += best.n_rows


def _strip_at(row: int, elevation: FloatArray, columns: _Columns, most_rows: int, across: int, lanes: int) -> _Strip:
    """The largest strip from `row` on whose tiles are not larger than may be."""
    below = elevation[row : row + most_rows]
    n_rows = int(np.count_nonzero(below[0] - below <= _LARGEST_RAD))
    most = min(across * lanes, columns.end - columns.first)
    while most > 1 and _width_rad(below[:n_rows], columns, most) > _LARGEST_RAD:
        most = (most + 1) // 2
    return _Strip(row, n_rows, across, most)


def _width_rad(elevation: FloatArray, columns: _Columns, n_columns: int) -> float:
    """Angle between the first and the last of some columns, in the row where it is largest."""
    turn = min(np.pi, (n_columns - 1 + (columns.shift != 0).any()) * columns.step_rad)
    return float(2.0 * np.arcsin(np.cos(elevation).max() * np.sin(turn / 2.0)))


def _work(strip: _Strip, elevation: FloatArray, columns: _Columns) -> float:
    """Expected work a beam of a strip's tiles, in no unit."""
    rows = elevation[strip.first_row : strip.first_row + strip.n_rows]
    height, width = rows[0] - rows[-1], _width_rad(rows, columns, strip.columns)
    n_columns = columns.end - columns.first
    used = n_columns / (-(-n_columns // strip.columns) * strip.columns)  # the last tile of a row is seldom full
    return float((width + _SURROUNDINGS_RAD) * (height + _SURROUNDINGS_RAD) / (strip.n_rows * strip.columns * used))


def _tile_strip(
    template: BeamTemplate, strip: _Strip, columns: _Columns, packets: int, lanes: int
) -> tuple[Float32Array, Float32Array, Float32Array, Int32Array]:
    """Beams, bounds, rectangles and places of a strip's tiles."""
    rows = slice(strip.first_row, strip.first_row + strip.n_rows)
    offset = template.azimuth_offset_rad
    beams = directions(
        replace(
            template,
            elevation_rad=template.elevation_rad[rows],
            azimuth_offset_rad=None if offset is None else offset[rows],
        )
    )
    column, real = _lanes(template, strip, columns, packets, lanes)
    held = np.flatnonzero(real.any(axis=(1, 2)))
    column, real = column[held], real[held]
    row = np.minimum(np.arange(packets) // strip.across, strip.n_rows - 1)[:, None]
    own = row * template.shape[1] + column
    tiles = beams.reshape(-1, 3)[_repeated(own, real).reshape(own.shape[0], -1)]
    bounds, plane = _bounds(tiles, real.reshape(own.shape[0], -1))
    packed = tiles.astype(np.float32).reshape(-1, packets, lanes, 3).transpose(0, 1, 3, 2)
    places = _places(row, strip.first_row, column, real, template.shape[1])
    return np.ascontiguousarray(packed), bounds, _rectangles(plane, packets, lanes), places


def _lanes(
    template: BeamTemplate, strip: _Strip, columns: _Columns, packets: int, lanes: int
) -> tuple[Int64Array, BoolArray]:
    """Column (n, packets, lanes) of every lane of a strip's tiles, and whether it is a beam."""
    n_tiles = -(-(columns.end - columns.first) // strip.columns)
    packet = np.arange(packets)
    row, across = packet // strip.across, packet % strip.across
    within = (across * lanes)[:, None] + np.arange(lanes)
    at = columns.first + np.arange(n_tiles)[:, None, None] * strip.columns + within
    shift = columns.shift[np.minimum(strip.first_row + row, columns.shift.size - 1)]
    column = at + shift[:, None]
    real: BoolArray = (within < strip.columns) & (at < columns.end) & (row < strip.n_rows)[:, None]
    if columns.full_turn:
        return column % template.shape[1], real
    return column, real & (column >= 0) & (column < template.shape[1])


def _repeated(own: Int64Array, real: BoolArray) -> Int64Array:
    """`own` (n, packets, lanes) where real; elsewhere the packet's first real lane's, or else the tile's."""
    lane = real.argmax(axis=2)[..., None]
    of_packet = np.take_along_axis(own, lane, axis=2)
    some: BoolArray = np.asarray(real.any(axis=2))
    of_tile = np.take_along_axis(of_packet[..., 0], some.argmax(axis=1)[:, None], axis=1)
    return np.where(real, own, np.where(some[..., None], of_packet, of_tile[..., None]))


def _places(row: Int64Array, first_row: int, column: Int64Array, real: BoolArray, n_columns: int) -> Int32Array:
    """(n, packets, 2) of kernels/template.h."""
    lanes = real.shape[2]
    begin = real.argmax(axis=2)
    end = begin + real.sum(axis=2)
    # Lanes follow one another but for the end of the turn, after which columns begin anew.
    wrap = np.where(np.diff(column, axis=2) < 0, np.arange(1, lanes), lanes).min(axis=2, initial=lanes)
    first = (first_row + row[:, 0]) * n_columns + column[..., 0]
    return np.stack([first, begin | end << 8 | wrap << 16], axis=2).astype(np.int32)


def _bounds(tiles: FloatArray, real: BoolArray) -> tuple[Float32Array, FloatArray]:
    """Bounds of each tile's beams (K, n, 3), and x, y (K, n, 2) of the beams in the plane one metre along its axis."""
    axis = np.einsum("kni,kn->ki", tiles, real.astype(np.float64))  # repeated beams would draw it aside
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    # Right lies level, so that rows of a tile run along the rectangle. Any right will do for a tile about a pole.
    level = np.hypot(axis[:, 0], axis[:, 1])[:, None] > 1e-9
    right = np.cross(np.where(level, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]), axis)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(axis, right)
    seen = tiles @ np.stack([right, up, axis], axis=2)
    plane = seen[..., :2] / seen[..., 2:]
    (left, low), (east, high) = plane.min(axis=1).T - _MARGIN, plane.max(axis=1).T + _MARGIN
    corners = np.stack(
        [
            axis + s[:, None] * right + t[:, None] * up
            for s, t in ((left, low), (east, low), (east, high), (left, high))
        ],
        axis=1,
    )
    planes = np.cross(corners, np.roll(corners, -1, axis=1))
    planes /= np.linalg.norm(planes, axis=2, keepdims=True)
    bounds = np.zeros((tiles.shape[0], TILE_FLOATS), dtype=np.float32)
    bounds[:, :12] = planes.reshape(-1, 12)
    bounds[:, 12:24] = corners.reshape(-1, 12)
    bounds[:, 25:34] = np.concatenate([axis, right, up], axis=1)
    return bounds, plane


def _rectangles(plane: FloatArray, n_packets: int, lanes: int) -> Float32Array:
    """Least and greatest x, then y, of every packet's beams (K, n, 2)."""
    packets = plane.reshape(plane.shape[0], n_packets, lanes, 2)
    low, high = packets.min(axis=2) - _MARGIN, packets.max(axis=2) + _MARGIN
    return np.stack([low[..., 0], high[..., 0], low[..., 1], high[..., 1]], axis=1).astype(np.float32)
