"""`tlsplan scanners`: the scanners known by name."""

from __future__ import annotations

import math

import click

from ..options import json_option


@click.command("scanners", epilog="Example:  tlsplan scanners --json")
@json_option
def command(as_json: bool) -> None:
    """List the scanners that --scanner knows by name."""
    from planner_core.scan.scanners import list_scanners

    from .. import output

    scanners = list_scanners()
    if as_json:
        output.as_json(
            {
                "scanners": [
                    {
                        "name": s.name,
                        "title": s.title,
                        "source": s.source,
                        "range_min_m": s.range_min_m,
                        "range_max_m": s.range_max_m,
                        "n_azimuths": s.n_azimuths,
                        "n_channels": s.n_channels,
                        "elevation_min_deg": round(math.degrees(s.elevation_rad[-1]), 6),
                        "elevation_max_deg": round(math.degrees(s.elevation_rad[0]), 6),
                    }
                    for s in scanners
                ]
            }
        )
        return
    output.table(
        ("name", "scanner", "beams", "elevation deg", "range m"),
        [
            (
                s.name,
                s.title,
                f"{s.n_azimuths} x {s.n_channels}",
                f"{math.degrees(s.elevation_rad[-1]):.1f} to {math.degrees(s.elevation_rad[0]):.1f}",
                f"{s.range_min_m:g} to {s.range_max_m:g}",
            )
            for s in scanners
        ],
    )
