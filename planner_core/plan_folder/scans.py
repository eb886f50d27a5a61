"""Scans of a plan's stations as files, one a station: range image (EXR) and preview (PNG).

Survey, station, ScanBatch -> files. What is in them: docs/formats/scans.md. No file has the time at which it was
written.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner_core.errors import MissingPackageError, PlanFolderError, RequirementError
from planner_core.model import Float32Array, ScanBatch, Station, Survey, UInt8Array
from planner_core.operating_system import not_written
from planner_core.plan_folder.atomic import staged_file
from planner_core.plan_folder.palette import range_colour_index, range_ramp_srgb
from planner_core.scanner.template import azimuth_step_rad, first_azimuths_rad

PREVIEW_WIDTH = 1500
PREVIEW_MIN_HEIGHT = 240
_ROWS_AT_ONCE = 64
"""Of a preview, coloured in float64."""


def write_scan(survey: Survey, station: Station, scan: ScanBatch, path: Path) -> Path:
    """Write the first scan of `scan`, taken from `station`; the file appears whole or not at all.

    Parameters
    ----------
    path
        Its suffix chooses the format: .exr or .png.

    Raises
    ------
    RequirementError
        Another suffix; nothing is written.
    PlanFolderError
        The file can't be written.
    MissingPackageError
        OpenImageIO is missing.
    """
    writers = {".exr": _write_exr, ".png": _write_png}
    if path.suffix not in writers:
        raise RequirementError(
            f"{path}: format is {path.suffix!r}, expected one of {', '.join(writers)}; give the file such a name"
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with staged_file(path) as staging:
            writers[path.suffix](survey, station, scan, staging)
    except OSError as error:
        raise PlanFolderError(
            f"{path}: can't be written ({error.strerror or error}), expected a writable disk with space; free some"
        ) from error
    return path


def preview_rgb(scan: ScanBatch, range_max_m: float) -> UInt8Array:
    """Return (rows, columns, 3) sRGB of the first scan: light is near, dark is far, shaded by incidence.

    Rows are repeated and columns left out until the picture has a shape that people can read.
    """
    step = max(1, scan.range_m.shape[2] // PREVIEW_WIDTH)
    range_m, cosine = scan.range_m[0, :, ::step], scan.cos_incidence[0, :, ::step]
    rgb: UInt8Array = np.empty((*range_m.shape, 3), dtype=np.uint8)
    for first in range(0, len(rgb), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        rgb[rows] = _shaded(range_m[rows], cosine[rows], range_max_m)
    return np.repeat(rgb, max(1, round(PREVIEW_MIN_HEIGHT / range_m.shape[0])), axis=0)


def _shaded(range_m: Float32Array, cosine: Float32Array, range_max_m: float) -> UInt8Array:
    """(R, C, 3) sRGB of some rows."""
    hit = np.isfinite(range_m)
    ramp = range_ramp_srgb()
    index = range_colour_index(np.where(hit, range_m, 0), range_max_m)
    shade = 0.45 + 0.55 * np.where(hit, cosine, 0)
    rgb = np.where(hit[..., None], ramp[index] * shade[..., None], 0.06)
    return np.asarray(np.rint(255 * rgb), dtype=np.uint8)


def open_image_io() -> Any:
    """Return OpenImageIO; raises MissingPackageError where it is missing."""
    try:
        import OpenImageIO
    except ImportError as error:
        raise MissingPackageError(
            f"scans as EXR and PNG need the package OpenImageIO ({error}): pip install openimageio"
        ) from error
    return OpenImageIO


def _write_exr(survey: Survey, station: Station, scan: ScanBatch, path: Path) -> None:
    """Two parts: `returns` (float range and cosIncidence), `surfaces` (uint32 triangle and patch)."""
    io = open_image_io()
    returns, surfaces = exr_parts(survey.template.shape, ("range", "cosIncidence"), _pose(survey, station))
    ids = np.stack([scan.triangle[0], scan.patch[0]], axis=-1).astype(np.int32).view(np.uint32)
    values = np.stack([scan.range_m[0], scan.cos_incidence[0]], axis=-1)
    out = io.ImageOutput.create(str(path))
    done = out.open(str(path), (returns, surfaces)) and out.write_image(np.ascontiguousarray(values))
    done = done and out.open(str(path), surfaces, "AppendSubimage") and out.write_image(np.ascontiguousarray(ids))
    finish(out, done, path)


def _write_png(survey: Survey, station: Station, scan: ScanBatch, path: Path) -> None:
    del station  # a picture to look at, no carrier of figures
    write_rgb(preview_rgb(scan, survey.template.range_max_m), path)


def exr_parts(shape: tuple[int, int], returns: tuple[str, ...], header: Mapping[str, str]) -> tuple[Any, Any]:
    """Return the specifications of both parts, floats `returns` and uint32 `surfaces`, of an EXR of (rows, columns)."""
    io, parts = open_image_io(), []
    for name, channels, kind in (("returns", returns, io.FLOAT), ("surfaces", ("triangle", "patch"), io.UINT32)):
        spec = io.ImageSpec(shape[1], shape[0], len(channels), kind)
        spec.channelnames = channels
        spec.attribute("oiio:subimagename", name)
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", "")  # without it OpenImageIO writes the time of day
        for key, value in header.items():
            spec.attribute(f"tlsplan:{key}", value)
        parts.append(spec)
    return parts[0], parts[1]


def write_rgb(rgb: UInt8Array, path: Path) -> None:
    """Write (rows, columns, 3) sRGB as a PNG."""
    io = open_image_io()
    out = io.ImageOutput.create(str(path))
    spec = io.ImageSpec(rgb.shape[1], rgb.shape[0], 3, io.UINT8)
    finish(out, out.open(str(path), spec) and out.write_image(rgb), path)


def finish(out: Any, done: bool, path: Path) -> None:
    """Close an image; raises where it was not written."""
    closed = out.close()
    if not (done and closed):
        raise not_written(path, out.geterror() or "OpenImageIO could not write")


def _pose(survey: Survey, station: Station) -> dict[str, str]:
    """Texts, because EXR headers as OpenImageIO writes them hold no float64."""
    position_m = station.position_m + survey.scene.offset_m
    template = survey.template
    return {
        "station": station.id,
        "floor": station.floor,
        "positionScene": " ".join(f"{value:.6f}" for value in position_m),
        "instrumentHeight": f"{station.instrument_height_m:.6f}",
        "rangeMin": f"{template.range_min_m:.6f}",
        "rangeMax": f"{template.range_max_m:.6f}",
        "azimuthStep": f"{azimuth_step_rad(template):.12f}",
        "azimuths": " ".join(f"{value:.9f}" for value in first_azimuths_rad(template)),
        "elevations": " ".join(f"{value:.9f}" for value in template.elevation_rad),
    }
