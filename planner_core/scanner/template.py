"""The beam template: all beams of one scan as azimuths and elevations, the same for every station.

Radians; azimuth counter-clockwise from +x seen from above, elevation up from the horizontal; row 0 is the highest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate, FloatArray, Scanner

#: Azimuth steps that a template may be off a full turn and still be taken for one.
_TURN_SLACK = 1e-6
#: Bands of more rows than this are cut to a multiple of it: tiles are 1 to 16 rows high, and a cut one is not full.
_BAND_ROWS = 16
#: Beams of a preview. With its range image, points and picture a station's files stay below 3 MB, whatever the scanner.
PREVIEW_BEAMS = 200_000


@dataclass(frozen=True)
class Band:
    """Rows `first_row` and on of a template, as a template of their own."""

    first_row: int
    template: BeamTemplate


def make_template(scanner: Scanner) -> BeamTemplate:
    """Beams of `scanner` in the scene: its channels by its azimuths, turned about x where it hangs upside down.

    The turn takes (x, y, z) to (x, -y, -z): azimuth and elevation change sign. Rows and columns are put in order again,
    so that row 0 is the highest as the scene sees it, and azimuths rise: channel k of an inverted scanner is row
    n_channels - 1 - k, and a full turn starts at 0 as ever.
    """
    azimuth = _azimuths(scanner)
    elevation = np.array(scanner.elevation_rad, dtype=np.float64)
    offset = np.array(scanner.azimuth_offset_rad, dtype=np.float64) if scanner.azimuth_offset_rad else None
    if scanner.inverted:
        elevation = -elevation[::-1]
        offset = None if offset is None else -offset[::-1]
        # A full turn is the same set of azimuths either way round.
        azimuth = azimuth if scanner.azimuth_range_rad is None else -azimuth[::-1]
    return BeamTemplate(
        azimuth_rad=azimuth,
        elevation_rad=elevation,
        range_min_m=scanner.range_min_m,
        range_max_m=scanner.range_max_m,
        azimuth_offset_rad=offset,
    )


def _azimuths(scanner: Scanner) -> FloatArray:
    if scanner.azimuth_range_rad is None:
        return np.arange(scanner.n_azimuths, dtype=np.float64) * (2.0 * np.pi / scanner.n_azimuths)
    return np.linspace(*scanner.azimuth_range_rad, scanner.n_azimuths)


def directions(template: BeamTemplate) -> FloatArray:
    """Unit directions (rows, columns, 3) float64 of all beams: (cos e cos a, cos e sin a, sin e).

    Engines round these very values to float32; they never compute directions of their own.
    """
    out = np.empty((*template.shape, 3))
    elevation, azimuth = template.elevation_rad[:, None], template.azimuth_rad[None, :]
    if template.azimuth_offset_rad is not None:
        azimuth = azimuth + template.azimuth_offset_rad[:, None]
    cosine = np.cos(elevation)
    np.multiply(cosine, np.cos(azimuth), out=out[..., 0])
    np.multiply(cosine, np.sin(azimuth), out=out[..., 1])
    out[..., 2] = np.sin(elevation)
    return out


def azimuth_step_rad(template: BeamTemplate) -> float:
    """Angle between neighbouring columns; 0 where there is one column alone."""
    azimuth = template.azimuth_rad
    return float(azimuth[-1] - azimuth[0]) / (azimuth.size - 1) if azimuth.size > 1 else 0.0


def first_azimuths_rad(template: BeamTemplate) -> FloatArray:
    """(R,) azimuth of each row's first beam; the others follow in steps of `azimuth_step_rad`."""
    first: FloatArray = np.full(template.elevation_rad.size, template.azimuth_rad[0])
    return first if template.azimuth_offset_rad is None else first + template.azimuth_offset_rad


def is_full_turn(template: BeamTemplate) -> bool:
    """Whether the column after the last one would be the first again."""
    step = azimuth_step_rad(template)
    return step > 0 and abs(step * template.azimuth_rad.size - 2 * np.pi) <= _TURN_SLACK * step


def preview_template(template: BeamTemplate, *, max_beams: int = PREVIEW_BEAMS) -> BeamTemplate:
    """Leave out rows and columns evenly until `max_beams` are left; a template that has no more is its own preview.

    The direction in which beams are closer is thinned first, so that the beams of a preview are about square.
    """
    n_rows, n_columns = template.shape
    elevation_step = float(np.ptp(template.elevation_rad)) / max(1, n_rows - 1)
    azimuth_step = azimuth_step_rad(template)
    every_row, every_column = 1, 1
    while -(-n_rows // every_row) * -(-n_columns // every_column) > max_beams:
        columns_are_closer = every_column * azimuth_step <= every_row * elevation_step
        if n_rows <= every_row or (columns_are_closer and n_columns > every_column):
            every_column += 1
        else:
            every_row += 1
    if every_row == every_column == 1:
        return template
    offset = template.azimuth_offset_rad
    return replace(
        template,
        azimuth_rad=template.azimuth_rad[::every_column],
        elevation_rad=template.elevation_rad[::every_row],
        azimuth_offset_rad=None if offset is None else offset[::every_row],
    )


def window_template(
    template: BeamTemplate, azimuth_rad: float, width_rad: float, elevation_rad: tuple[float, float]
) -> BeamTemplate | None:
    """Return the beams within a window, all of them; None where there are none.

    Parameters
    ----------
    azimuth_rad, width_rad
        Where the window begins, and how far it goes on counterclockwise. Rows that begin at azimuths of their own go
        as far beyond it. A scanner that does not turn all round has all its columns in a window over its gap.
    elevation_rad
        Lowest and highest.
    """
    rows = np.flatnonzero((template.elevation_rad >= elevation_rad[0]) & (template.elevation_rad <= elevation_rad[1]))
    # From the window's begin on: across the end of a turn azimuths go on, so that they rise as in any template.
    beyond_rad = np.mod(template.azimuth_rad - azimuth_rad, 2.0 * np.pi)
    columns = np.flatnonzero(beyond_rad <= width_rad)
    if not rows.size or not columns.size:
        return None
    azimuths_rad = azimuth_rad + np.sort(beyond_rad[columns])
    if not is_full_turn(template) and columns.size < 1 + columns[-1] - columns[0]:
        azimuths_rad = template.azimuth_rad  # it looks over the gap
    offset = template.azimuth_offset_rad
    return replace(
        template,
        azimuth_rad=azimuths_rad,
        elevation_rad=template.elevation_rad[rows],
        azimuth_offset_rad=None if offset is None else offset[rows],
    )


def bands(template: BeamTemplate, *, max_beams: int) -> Iterator[Band]:
    """Cut a template into bands of whole rows, of `max_beams` beams at most but of one row at least, top to bottom.

    Scanning one band after the other needs memory for one alone. A beam's result is the same bits in any band. A
    template that fits is its own band: the very object.

    Raises
    ------
    RequirementError
        `max_beams` is not positive.
    """
    if max_beams < 1:
        raise RequirementError(f"max_beams: got {max_beams}, expected at least 1; a million suits most devices")
    n_rows, n_columns = template.shape
    at_once = max(1, max_beams // max(1, n_columns))
    if at_once >= n_rows:
        yield Band(0, template)
        return
    if at_once > _BAND_ROWS:
        at_once -= at_once % _BAND_ROWS
    for first in range(0, n_rows, at_once):
        rows = slice(first, min(first + at_once, n_rows))
        offset = template.azimuth_offset_rad
        yield Band(
            first,
            replace(
                template,
                elevation_rad=template.elevation_rad[rows],
                azimuth_offset_rad=None if offset is None else offset[rows],
            ),
        )
