"""`tlsplan scanners`: the scanners known by name."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from ..options import json_option

if TYPE_CHECKING:
    from planner_core.model import Scanner


@click.command("scanners", epilog="Example:  tlsplan scanners --json")
@json_option
def command(as_json: bool) -> None:
    """List the scanners that --scanner knows by name."""
    from planner_core.scan.scanners import list_scanners

    from .. import output

    scanners = list_scanners()
    if as_json:
        output.as_json({"scanners": [_document(scanner) for scanner in scanners]})
        return
    output.table(
        ("name", "scanner", "beams", "azimuth deg", "elevation deg", "range m", "mounting"),
        [
            (
                s.name,
                s.title,
                f"{s.n_azimuths} x {s.n_channels}",
                _azimuths(s),
                f"{math.degrees(s.elevation_rad[-1]):.1f} to {math.degrees(s.elevation_rad[0]):.1f}",
                f"{s.range_min_m:g} to {s.range_max_m:g}",
                _mounting(s),
            )
            for s in scanners
        ],
    )


def _document(scanner: Scanner) -> dict[str, Any]:
    sector = scanner.azimuth_range_rad
    return {
        "name": scanner.name,
        "title": scanner.title,
        "source": scanner.source,
        "range_min_m": scanner.range_min_m,
        "range_max_m": scanner.range_max_m,
        "instrument_height_min_m": scanner.instrument_height_min_m,
        "instrument_height_max_m": scanner.instrument_height_max_m,
        "n_azimuths": scanner.n_azimuths,
        "azimuth_range_deg": [_degrees(angle) for angle in sector] if sector else None,
        "azimuth_offset_deg": [_degrees(angle) for angle in scanner.azimuth_offset_rad],
        "n_channels": scanner.n_channels,
        "elevation_min_deg": _degrees(scanner.elevation_rad[-1]),
        "elevation_max_deg": _degrees(scanner.elevation_rad[0]),
        "mounting": _mounting(scanner),
    }


def _azimuths(scanner: Scanner) -> str:
    sector = scanner.azimuth_range_rad
    return "{:.1f} to {:.1f}".format(*map(math.degrees, sector)) if sector else "full turn"


def _mounting(scanner: Scanner) -> str:
    return "inverted" if scanner.inverted else "upright"


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 6)
