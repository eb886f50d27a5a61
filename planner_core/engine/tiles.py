"""Tiles of the beam template: neighbouring beams and the pyramid that bounds them; layout in kernels/trace_tile.h.

Made once a template: a station only moves the origin.

A template is cut into strips of rows, a strip into tiles. Where rows have azimuth offsets, they are shifted by whole
columns, so that the beams of a tile look the same way. How many rows a strip has is the device's choice (tuning.py)
unless the template's angles make such tiles long and narrow; no tile is too wide to be bounded.

A `TiledTemplate` is a template on the device: its tiles, and the programs that walk the tree with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from planner_core.device import Buffer, Device, Program
from planner_core.engine.tuning import shape_state, tile_shape
from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate, BoolArray, Float32Array, FloatArray, Int32Array, Int64Array
from planner_core.scanner.template import azimuth_step_rad, directions, is_full_turn

TILE_FLOATS = 40
"""Floats a tile: 4 planes, 4 corners, a zero, axis, right, up, 6 spare."""
#: The pyramid is larger than its beams by this, radians: boxes and corners are compared in float32 (ulp 6e-8, a dozen
#: roundings), and a computed hit may lie a few ulp outside its triangle.
_MARGIN = 4e-6
#: Widest and highest that a tile may be, radians: a pyramid of more than some 50 degrees from its axis bounds nothing.
_LARGEST_RAD = np.deg2rad(30.0)
#: Work of a tile goes as (width + this) (height + this): what it meets besides its own beams, in boxes and triangles.
_SURROUNDINGS_RAD = np.deg2rad(8.0)
#: The device's own shape of tile, which was measured, is kept until another one is better by more than this.
_WORTH = 1.25
#: Beams of a template of one column are sorted into columns of this width by their offsets.
_LONE_STEP_RAD = np.deg2rad(1.0)


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
    """Columns of tiles: column v of a tile's row r is column v + shift[r] of the template's; from `first` to `end`.

    beside_rad : (R,), by how much the row's beams then still lie beside those of a row without offset.
    """

    shift: Int64Array
    beside_rad: FloatArray
    first: int
    end: int
    full_turn: bool
    step_rad: float


def make_tiles(template: BeamTemplate, *, tile_rows: int, tile_columns: int, lanes: int) -> TileGrid:
    """Cut a template into tiles of `tile_rows` x `tile_columns` beams, or as many in another arrangement.

    Lanes without a beam of their own repeat one of their tile.

    Raises
    ------
    RequirementError
        The template's azimuths are not in even steps.
    """
    packets = tile_rows * tile_columns // lanes
    columns = _columns(template)
    parts = [
        _tile_strip(template, strip, columns, packets, lanes)
        for strip in _strips(template.elevation_rad, columns, tile_rows, packets, lanes)
    ]
    return TileGrid(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


class TiledTemplate:
    """Tiles of one template in one shape; `walk` has the defines of tree.h for the scene.

    Kernels of `trace_tile.h` take the scene's arguments, then `beam_arguments`.

    A template too large for the device goes there in `scanner.template.bands`, one after the other: give each
    its `first_row` and the number of rows of the whole, so that `scan_tiles` writes it to its place in whole images.
    """

    def __init__(
        self,
        template: BeamTemplate,
        device: Device,
        *,
        walk: Mapping[str, int],
        first_row: int = 0,
        image_rows: int | None = None,
    ) -> None:
        self._shape_state = shape_state()
        self.shape = tile_shape(device)
        self._on = device
        rows, columns, lanes = self.shape
        self._defines: Mapping[str, int] = {**walk, "LANES": lanes, "TILE_ROWS": rows, "TILE_COLUMNS": columns}
        self._programs: dict[tuple[object, ...], Program] = {}
        grid = make_tiles(template, tile_rows=rows, tile_columns=columns, lanes=lanes)
        buffers = device.upload(
            "beams",
            {"tiles": grid.bounds, "beams": grid.beams, "rectangles": grid.rectangles, "places": grid.places},
        )
        self.n_tiles = grid.n_tiles
        n_rows, n_columns = template.shape
        self.beam_arguments: tuple[Buffer | np.generic, ...] = (
            *buffers.values(),
            np.int32(n_columns),
            np.int32(n_columns * (n_rows if image_rows is None else image_rows)),
            np.int32(n_columns * first_row),
            np.float32(template.range_min_m),
            np.float32(template.range_max_m),
        )

    @property
    def has_wanted_shape(self) -> bool:
        """Whether these tiles have the shape that is wanted now."""
        return self._shape_state == shape_state()

    def release(self) -> None:
        """Give the device memory back; nothing can be scanned with these tiles afterwards."""
        for item in self.beam_arguments:
            if isinstance(item, Buffer):
                item.release()

    def program(self, file: str, **more: int) -> Program:
        """Build a kernel file for tiles of this shape, and more defines of its own; a second call finds it built."""
        key = (file, *more.items())
        if key not in self._programs:
            self._programs[key] = self._on.program(file, {**self._defines, **more})
        return self._programs[key]


def _columns(template: BeamTemplate) -> _Columns:
    n_rows, n_columns = template.shape
    step = azimuth_step_rad(template) or _LONE_STEP_RAD
    even = template.azimuth_rad[0] + azimuth_step_rad(template) * np.arange(n_columns)
    if np.abs(template.azimuth_rad - even).max() > step / 2:  # columns of a tile would not be neighbours
        raise RequirementError(
            f"azimuth_rad: got {n_columns} azimuths in uneven steps, expected even ones; "
            "give what differs between rows as azimuth_offset_rad"
        )
    offset = np.zeros(n_rows) if template.azimuth_offset_rad is None else template.azimuth_offset_rad
    shift = -np.rint(offset / step).astype(np.int64)
    beside = offset + shift * step
    if is_full_turn(template):
        return _Columns(shift % n_columns, beside, 0, n_columns, True, step)
    return _Columns(shift, beside, -int(shift.max()), n_columns - int(shift.min()), False, step)


def _strips(elevation: FloatArray, columns: _Columns, tile_rows: int, packets: int, lanes: int) -> tuple[_Strip, ...]:
    """Rows from top to bottom, in the one arrangement of packets for which tiles promise the least work in all."""
    own = packets // tile_rows
    others = (n for n in range(packets, 0, -1) if packets % n == 0 and n != own)
    strips = _arranged(elevation, columns, own, packets // own, lanes)
    least = _work(strips, elevation, columns) / _WORTH
    for across in others:
        other = _arranged(elevation, columns, across, packets // across, lanes)
        work = _work(other, elevation, columns)
        if work < least:
            strips, least = other, work
    return strips


def _arranged(elevation: FloatArray, columns: _Columns, across: int, down: int, lanes: int) -> tuple[_Strip, ...]:
    """Strips whose tiles have `down` rows of `across` packets, or fewer beams where they would be too large."""
    strips: list[_Strip] = []
    row = 0
    while row < elevation.size:
        near = elevation[row : row + down]
        height = np.maximum.accumulate(near) - np.minimum.accumulate(near)
        n_rows = int(np.count_nonzero(height <= _LARGEST_RAD))
        while n_rows > 1 and _width_rad(slice(row, row + n_rows), elevation, columns, 1) > _LARGEST_RAD:
            n_rows = (n_rows + 1) // 2
        rows = slice(row, row + n_rows)
        most = min(across * lanes, columns.end - columns.first)
        while most > 1 and _width_rad(rows, elevation, columns, most) > _LARGEST_RAD:
            most = (most + 1) // 2
        strips.append(_Strip(row, n_rows, across, most))
        row += n_rows
    return tuple(strips)


def _width_rad(rows: slice, elevation: FloatArray, columns: _Columns, n_columns: int) -> float:
    """Angle between the first and the last of some columns, in the row where it is largest."""
    beside = columns.beside_rad[rows]
    turn = min(np.pi, (n_columns - 1) * columns.step_rad + float(beside.max() - beside.min()))
    return float(2.0 * np.arcsin(np.cos(elevation[rows]).max() * np.sin(turn / 2.0)))


def _work(strips: tuple[_Strip, ...], elevation: FloatArray, columns: _Columns) -> float:
    """Expected work of all tiles, in no unit."""
    work = 0.0
    for strip in strips:
        rows = slice(strip.first_row, strip.first_row + strip.n_rows)
        height = float(np.ptp(elevation[rows]))
        width = _width_rad(rows, elevation, columns, strip.columns)
        n_tiles = -(-(columns.end - columns.first) // strip.columns)
        work += n_tiles * (width + _SURROUNDINGS_RAD) * (height + _SURROUNDINGS_RAD)
    return work


def _tile_strip(
    template: BeamTemplate, strip: _Strip, columns: _Columns, packets: int, lanes: int
) -> tuple[Float32Array, Float32Array, Float32Array, Int32Array]:
    """Beams, bounds, rectangles and places of a strip's n tiles.

    Arrays in between are (packets, lanes, n): tiles of a strip are alike, so that NumPy's inner loops run over tiles.
    """
    rows = slice(strip.first_row, strip.first_row + strip.n_rows)
    offset = template.azimuth_offset_rad
    beams = directions(
        replace(
            template,
            elevation_rad=template.elevation_rad[rows],
            azimuth_offset_rad=None if offset is None else offset[rows],
        )
    )
    row = np.minimum(np.arange(packets) // strip.across, strip.n_rows - 1)[:, None, None]
    column, real = _lanes(template, strip, columns, packets, lanes)
    own = row * template.shape[1] + column
    held = np.take(np.ascontiguousarray(beams.reshape(-1, 3).T), _repeated(own, real), axis=1)
    bounds, rectangles = _bounds(held, real)
    packed = np.ascontiguousarray(held.transpose(3, 1, 0, 2), dtype=np.float32)
    return packed, bounds, rectangles, _places(own + strip.first_row * template.shape[1], column, real)


def _lanes(
    template: BeamTemplate, strip: _Strip, columns: _Columns, packets: int, lanes: int
) -> tuple[Int64Array, BoolArray]:
    """Column (packets, lanes, n) of every lane of a strip's tiles, and whether it is a beam; each tile has some."""
    n_tiles = -(-(columns.end - columns.first) // strip.columns)
    row, across = np.divmod(np.arange(packets)[:, None, None], strip.across)
    within = across * lanes + np.arange(lanes)[:, None]
    at = columns.first + within + np.arange(n_tiles) * strip.columns
    column = at + columns.shift[np.minimum(strip.first_row + row, columns.shift.size - 1)]
    real = (within < strip.columns) & (at < columns.end) & (row < strip.n_rows)
    if columns.full_turn:
        return column % template.shape[1], real
    real = real & (column >= 0) & (column < template.shape[1])
    held = np.flatnonzero(real.any(axis=(0, 1)))
    return column[..., held], real[..., held]


def _repeated(own: Int64Array, real: BoolArray) -> Int64Array:
    """`own` (packets, lanes, n) where real; elsewhere the packet's first real lane's, or else the tile's."""
    if real.all():
        return own
    of_packet = np.take_along_axis(own, real.argmax(axis=1)[:, None], axis=1)
    some: BoolArray = np.asarray(real.any(axis=1, keepdims=True))
    of_tile = np.take_along_axis(of_packet, some.argmax(axis=0)[None], axis=0)
    return np.where(real, own, np.where(some, of_packet, of_tile))


def _places(own: Int64Array, column: Int64Array, real: BoolArray) -> Int32Array:
    """(n, packets, 2) of kernels/template.h; own is row * columns + column."""
    lanes = real.shape[1]
    begin = real.argmax(axis=1)
    end = begin + real.sum(axis=1)
    # Lanes follow one another but for the end of the turn, after which columns begin anew.
    behind = np.diff(column, axis=1) < 0
    wrap = np.where(behind.any(axis=1), behind.argmax(axis=1) + 1, lanes) if lanes > 1 else np.ones_like(begin)
    return np.ascontiguousarray(np.stack([own[:, 0], begin | end << 8 | wrap << 16]).T, dtype=np.int32)


def _bounds(beams: FloatArray, real: BoolArray) -> tuple[Float32Array, Float32Array]:
    """Bounds (n, 40) and rectangles (n, 4, packets) of beams (3, packets, lanes, n)."""
    axis = np.einsum("ipln,pln->in", beams, real)  # beams that are there twice would draw it aside
    axis /= np.linalg.norm(axis, axis=0)
    # Right lies level, so that rows of a tile run along the rectangle. Any right will do for a tile about a pole.
    flat = np.hypot(axis[0], axis[1])
    polar = flat < 1e-9
    right = np.stack([np.where(polar, 1.0, -axis[1]), np.where(polar, 0.0, axis[0]), np.zeros_like(flat)])
    right /= np.where(polar, 1.0, flat)
    up = np.cross(axis, right, axis=0)
    ahead = _along(beams, axis)
    x, y = _along(beams, right) / ahead, _along(beams, up) / ahead
    rectangles = np.stack([x.min(axis=1), x.max(axis=1), y.min(axis=1), y.max(axis=1)])
    rectangles += np.array([-_MARGIN, _MARGIN, -_MARGIN, _MARGIN])[:, None, None]
    west, south = rectangles[0].min(axis=0), rectangles[2].min(axis=0)
    east, north = rectangles[1].max(axis=0), rectangles[3].max(axis=0)
    corners = np.stack(
        [axis + s * right + t * up for s, t in ((west, south), (east, south), (east, north), (west, north))]
    )
    planes = np.cross(corners, np.roll(corners, -1, axis=0), axis=1)
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    n_tiles = flat.size
    bounds = np.zeros((n_tiles, TILE_FLOATS), dtype=np.float32)
    bounds[:, :12] = planes.reshape(12, n_tiles).T
    bounds[:, 12:24] = corners.reshape(12, n_tiles).T
    bounds[:, 25:34] = np.concatenate([axis, right, up]).T
    return bounds, np.ascontiguousarray(rectangles.transpose(2, 0, 1), dtype=np.float32)


def _along(beams: FloatArray, way: FloatArray) -> FloatArray:
    """Dot products (packets, lanes, n) of each tile's beams (3, packets, lanes, n) with its way (3, n)."""
    along: FloatArray = beams[0] * way[0] + beams[1] * way[1] + beams[2] * way[2]
    return along
