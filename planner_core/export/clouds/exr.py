"""Clouds as range images, one a station: EXR of the whole grid of beams, written row by row, and a PNG to look at.

`Clouds` -> a folder. What is in them: docs/formats/field-pack/clouds.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError
from planner_core.export.clouds.each_station import write_each
from planner_core.export.clouds.file_header import facts, facts_of, numbers
from planner_core.export.clouds.points import Clouds, ScanBlock, open_clouds
from planner_core.export.options import Options
from planner_core.model import Float32Array, UInt8Array
from planner_core.operating_system import not_written
from planner_core.plan_folder.palette import range_colour_index, range_ramp_srgb
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.progress import Progress
from planner_core.scanner.template import azimuth_step_rad, first_azimuths_rad

_RETURNS = ("range", "cosIncidence", "intensity")
_PREVIEW_WIDTH, _MOST_ROWS = 1500, 1500
_PREVIEW_MIN_HEIGHT = 240
_ROWS_AT_ONCE = 64
"""Of a preview, coloured in float64."""
_FAR = 0.99
"""Share of the returns that have colours of their own; the few beyond, through a door or two, are as dark."""
_SPOOLED_ROWS = 256
"""Rows of the second part that are read back at once."""


def write_exr(plan: PlanSource, folder: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write an EXR and a PNG a station into `folder`."""
    clouds = open_clouds(plan, options, progress=progress)
    write_each(clouds, [write_images], folder)
    remarks = clouds.remarks()
    if clouds.noise is not None and clouds.noise.angle_sigma_rad:
        remarks = (*remarks, "ranges of images have noise, angles are those of the grid")
    return remarks


def write_images(clouds: Clouds, station: FieldStation, path: Path, *, exr: bool = True, png: bool = True) -> None:
    """Write the images of one station's scan, or one of them: `path` with the suffix of each behind.

    Raises
    ------
    MissingPackageError
        OpenImageIO is missing.
    """
    preview = _Preview(clouds)
    if exr:
        _write_exr(clouds, station, path.with_name(f"{path.name}.exr"), preview)
    else:
        for block in clouds.blocks(station):
            preview.take(block)
    if png:
        preview.write(path.with_name(f"{path.name}.png"))


class _Preview:
    """Some of the beams of a scan, for a picture of it."""

    def __init__(self, clouds: Clouds) -> None:
        n_rows, n_columns = clouds.template.shape
        self._range_max_m = clouds.template.range_max_m
        of_columns = -(-n_columns // _PREVIEW_WIDTH)
        # As many rows as columns are left out, for the shape's sake, unless there are too few rows or far too many.
        of_rows = max(-(-n_rows // _MOST_ROWS), min(of_columns, n_rows // _PREVIEW_MIN_HEIGHT))
        self._steps = (of_rows, of_columns)
        self._range_m: list[Float32Array] = []
        self._cosine: list[Float32Array] = []

    def take(self, block: ScanBlock) -> None:
        rows, columns = self._steps
        first = -block.first_row % rows
        self._range_m.append(block.range_m[first::rows, ::columns].astype(np.float32))
        self._cosine.append(block.cos_incidence[first::rows, ::columns].copy())  # a view would keep all of the block

    def _far_m(self, range_m: Float32Array) -> float:
        """What is dark: nearly the farthest that this scan holds, as rooms are small beside a scanner's range."""
        returns = range_m[np.isfinite(range_m)]
        return float(np.quantile(returns, _FAR)) if returns.size else self._range_max_m

    def rgb(self) -> UInt8Array:
        """(rows, columns, 3) sRGB of what was taken."""
        range_m, cosine = np.concatenate(self._range_m), np.concatenate(self._cosine)
        return _preview_rgb(range_m, cosine, self._far_m(range_m))

    def write(self, path: Path) -> None:
        _write_rgb(self.rgb(), path)


def _write_exr(clouds: Clouds, station: FieldStation, path: Path, preview: _Preview) -> None:
    """Two parts, `returns` and `surfaces`: a file holds one after the other, so the second waits on disk."""
    returns, surfaces = _exr_parts(clouds.template.shape, _header(clouds, station))
    waiting = path.with_suffix(".surfaces")
    out = _open_image_io().ImageOutput.create(str(path))
    done = out.open(str(path), (returns, surfaces))
    try:
        with waiting.open("w+b") as spool:
            for block in clouds.blocks(station) if done else ():
                preview.take(block)
                spool.write(_ids(block))
                done = done and _write_rows(out, block.first_row, _values(block))
            spool.seek(0)
            done = done and out.open(str(path), surfaces, "AppendSubimage")
            for first, ids in _read_back(spool, clouds.template.shape) if done else ():
                done = done and _write_rows(out, first, ids)
    except BaseException:
        out.close()
        raise
    finally:
        waiting.unlink(missing_ok=True)
    _finish(out, done, path)


def _values(block: ScanBlock) -> Float32Array:
    """(R, C, 3) of the part `returns`."""
    return np.stack([block.range_m.astype(np.float32), block.cos_incidence, block.intensity], axis=-1)


def _ids(block: ScanBlock) -> bytes:
    """Of the part `surfaces`; -1, nothing, becomes the largest number."""
    return np.stack([block.triangle, block.patch], axis=-1).astype("<i4").tobytes()


def _read_back(spool: Any, shape: tuple[int, int]) -> Iterator[tuple[int, np.ndarray]]:
    """First row and (R, C, 2) uint32 of some rows at a time."""
    n_rows, n_columns = shape
    for first in range(0, n_rows, _SPOOLED_ROWS):
        rows = min(_SPOOLED_ROWS, n_rows - first)
        ids = np.frombuffer(spool.read(rows * n_columns * 8), dtype="<u4")
        yield first, ids.reshape(rows, n_columns, 2)


def _write_rows(out: Any, first_row: int, values: np.ndarray) -> bool:
    return bool(out.write_scanlines(first_row, first_row + values.shape[0], 0, np.ascontiguousarray(values)))


def _header(clouds: Clouds, station: FieldStation) -> dict[str, str]:
    template = clouds.template
    return {
        **facts(clouds),
        **facts_of(station),
        "sceneToSite": numbers(clouds.frame.matrix.ravel(), 9),
        "crs": clouds.frame.crs,
        "verticalCrs": clouds.frame.vertical_crs,
        "rangeMin": f"{template.range_min_m:.6f}",
        "rangeMax": f"{template.range_max_m:.6f}",
        "azimuthStep": f"{azimuth_step_rad(template):.12f}",
        "azimuths": numbers(first_azimuths_rad(template), 9),
        "elevations": numbers(template.elevation_rad, 9),
    }


def _preview_rgb(range_m: Float32Array, cosine: Float32Array, range_max_m: float) -> UInt8Array:
    """(rows, columns, 3) sRGB of beams (R, C): light is near, dark is far, shaded by incidence.

    Rows are repeated until the picture has a shape that people can read.
    """
    rgb: UInt8Array = np.empty((*range_m.shape, 3), dtype=np.uint8)
    for first in range(0, len(rgb), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        rgb[rows] = _shaded(range_m[rows], cosine[rows], range_max_m)
    return np.repeat(rgb, max(1, round(_PREVIEW_MIN_HEIGHT / range_m.shape[0])), axis=0)


def _shaded(range_m: Float32Array, cosine: Float32Array, range_max_m: float) -> UInt8Array:
    """(R, C, 3) sRGB of some rows."""
    hit = np.isfinite(range_m)
    ramp = range_ramp_srgb()
    index = range_colour_index(np.where(hit, range_m, 0), range_max_m)
    shade = 0.45 + 0.55 * np.where(hit, cosine, 0)
    rgb = np.where(hit[..., None], ramp[index] * shade[..., None], 0.06)
    return np.asarray(np.rint(255 * rgb), dtype=np.uint8)


def _open_image_io() -> Any:
    """Return OpenImageIO; raises MissingPackageError where it is missing."""
    try:
        import OpenImageIO
    except ImportError as error:
        raise MissingPackageError(
            f"scans as EXR and PNG need the package OpenImageIO ({error}): pip install openimageio"
        ) from error
    return OpenImageIO


def _exr_parts(shape: tuple[int, int], header: Mapping[str, str]) -> tuple[Any, Any]:
    """Return the specifications of both parts, floats `returns` and uint32 `surfaces`, of an EXR of (rows, columns)."""
    io, parts = _open_image_io(), []
    for name, channels, kind in (("returns", _RETURNS, io.FLOAT), ("surfaces", ("triangle", "patch"), io.UINT32)):
        spec = io.ImageSpec(shape[1], shape[0], len(channels), kind)
        spec.channelnames = channels
        spec.attribute("oiio:subimagename", name)
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", "")  # without it OpenImageIO writes the time of day
        for key, value in header.items():
            spec.attribute(f"tlsplan:{key}", value)
        parts.append(spec)
    return parts[0], parts[1]


def _write_rgb(rgb: UInt8Array, path: Path) -> None:
    """Write (rows, columns, 3) sRGB as a PNG."""
    io = _open_image_io()
    out = io.ImageOutput.create(str(path))
    spec = io.ImageSpec(rgb.shape[1], rgb.shape[0], 3, io.UINT8)
    _finish(out, out.open(str(path), spec) and out.write_image(rgb), path)


def _finish(out: Any, done: bool, path: Path) -> None:
    """Close an image; raises where it was not written."""
    closed = out.close()
    if not (done and closed):
        raise not_written(path, out.geterror() or "OpenImageIO could not write")
