"""Clouds as range images, one a station: EXR of the whole grid of beams, written row by row, and a PNG to look at.

`Clouds` -> a folder. What is in them: docs/formats/field-pack/clouds.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.export.clouds.each_station import write_each
from planner_core.export.clouds.file_header import facts, facts_of, numbers
from planner_core.export.clouds.points import Clouds, ScanBlock, open_clouds
from planner_core.export.options import Options
from planner_core.model import Float32Array, ScanBatch, UInt8Array
from planner_core.plan_folder.plan_source import FieldStation, PlanSource
from planner_core.plan_folder.scans import (
    PREVIEW_MIN_HEIGHT,
    PREVIEW_WIDTH,
    exr_parts,
    finish,
    open_image_io,
    preview_rgb,
    write_rgb,
)
from planner_core.progress import Progress
from planner_core.scanner.template import azimuth_step_rad, first_azimuths_rad

_RETURNS = ("range", "cosIncidence", "intensity")
_MOST_ROWS = 1500
"""Of a preview."""
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
        of_columns = -(-n_columns // PREVIEW_WIDTH)
        # As many rows as columns are left out, for the shape's sake, unless there are too few rows or far too many.
        of_rows = max(-(-n_rows // _MOST_ROWS), min(of_columns, n_rows // PREVIEW_MIN_HEIGHT))
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
        range_m, cosine = np.concatenate(self._range_m)[None], np.concatenate(self._cosine)[None]
        nothing = np.full(range_m.shape, -1, dtype=np.int32)
        return preview_rgb(ScanBatch(range_m, nothing, nothing, cosine), self._far_m(range_m))

    def write(self, path: Path) -> None:
        write_rgb(self.rgb(), path)


def _write_exr(clouds: Clouds, station: FieldStation, path: Path, preview: _Preview) -> None:
    """Two parts, `returns` and `surfaces`: a file holds one after the other, so the second waits on disk."""
    returns, surfaces = exr_parts(clouds.template.shape, _RETURNS, _header(clouds, station))
    waiting = path.with_suffix(".surfaces")
    out = open_image_io().ImageOutput.create(str(path))
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
    finish(out, done, path)


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
