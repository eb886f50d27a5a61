"""`tlsplan scanners`: the scanners known by name, and docs/reference/scanners.md, the page on them.

`python -m tlsplan.commands.scanners docs/reference/scanners.md` writes the page anew.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..options import json_option

if TYPE_CHECKING:
    from planner_core.model import Scanner
    from planner_core.scanner.modes import ScanMode

_HEAD = """# Scanners

Written by `python -m tlsplan.commands.scanners docs/reference/scanners.md` from the files in `planner_core/scanner/`.
`--scanner NAME` takes the default mode, in bold here; `NAME:MODE` another; `NAME:6mm` any spacing at 10 m. What the
keys mean, and how to add your own: [scanner files](../formats/scanner.md).

A dash: the figure is not known. The makers' sheets could not be opened, so most figures are second hand: compare
your instrument's sheet before you rely on one. What is marked as unconfirmed is not even that.
"""
_UNCONFIRMED = """## Unconfirmed
FARO Focus Premium (70, 150, 350) and Trimble X7, X9 and X12 are here with the least that a plan needs: field of view
and range. No source for some of these could be opened, so they are recalled figures, and their names say "unconfirmed"
(of the X7 its field of view alone is): check them against the data sheet, or write a
[file of your own](../formats/scanner.md).
"""


@click.command("scanners", epilog="Example:  tlsplan scanners --json")
@json_option
def command(as_json: bool) -> None:
    """List the scanners known by name, with their modes."""
    from planner_core.scanner.load_scanner import list_scanners

    from .. import output

    scanners = list_scanners()
    if as_json:
        output.as_json({"scanners": [_document(scanner) for scanner in scanners]})
        return
    output.table(
        ("name", "scanner", "modes", "beams", "azimuth deg", "elevation deg", "range m", "mounting"),
        [
            (
                s.name,
                s.title,
                _mode_names(s),
                f"{s.n_azimuths} x {s.n_channels}",
                _azimuths(s),
                f"{math.degrees(s.elevation_rad[-1]):.1f} to {math.degrees(s.elevation_rad[0]):.1f}",
                f"{s.range_min_m:g} to {s.range_max_m:g}",
                _mounting(s),
            )
            for s in scanners
        ],
    )


def _modes(scanner: Scanner) -> tuple[ScanMode, ...]:
    from planner_core.scanner.load_scanner import scan_modes

    return scan_modes(scanner.name)


def _mode_names(scanner: Scanner) -> str:
    """Return the modes' ids, and `default` for one without."""
    ids = " ".join(mode.id for mode in _modes(scanner))
    return "one" if not ids else ids if scanner.mode else f"default, or {ids}"


def _document(scanner: Scanner) -> dict[str, Any]:
    sector = scanner.azimuth_range_rad
    accuracy = scanner.ranging_accuracy
    return {
        "name": scanner.name,
        "title": scanner.title,
        "source": scanner.source,
        "range_min_m": scanner.range_min_m,
        "range_max_m": scanner.range_max_m,
        "instrument_height_min_m": scanner.instrument_height_min_m,
        "instrument_height_max_m": scanner.instrument_height_max_m,
        "mode": scanner.mode or None,
        "modes": [_mode_document(mode, scanner) for mode in _modes(scanner)],
        "seconds_per_scan": scanner.seconds_per_scan,
        "n_azimuths": scanner.n_azimuths,
        "azimuth_range_deg": [_degrees(angle) for angle in sector] if sector else None,
        "azimuth_offset_deg": [_degrees(angle) for angle in scanner.azimuth_offset_rad],
        "n_channels": scanner.n_channels,
        "elevation_min_deg": _degrees(scanner.elevation_rad[-1]),
        "elevation_max_deg": _degrees(scanner.elevation_rad[0]),
        "mounting": _mounting(scanner),
        "range_noise": [
            {"range_m": range_m, "reflectivity": reflectivity, "sigma_m": sigma_m}
            for range_m, reflectivity, sigma_m in scanner.range_noise
        ],
        "ranging_accuracy": {"constant_m": accuracy[0], "per_metre": accuracy[1]} if accuracy else None,
        "angular_accuracy_rad": scanner.angular_accuracy_rad,
        "beam_divergence_rad": scanner.beam_divergence_rad,
        "beam_diameter_m": scanner.beam_diameter_m,
        "beam_width_at": scanner.beam_width_at or None,
        "wavelength_m": scanner.wavelength_m,
        "dual_axis_compensator": scanner.dual_axis_compensator,
        "pre_alignment": scanner.pre_alignment,
    }


def _mode_document(mode: ScanMode, scanner: Scanner) -> dict[str, Any]:
    from planner_core.scanner.modes import grid_of

    grid = grid_of(mode, field_rad=scanner.elevation_rad[0] - scanner.elevation_rad[-1])
    return {
        "id": mode.id,
        "title": mode.title,
        "seconds": mode.seconds,
        "azimuth_step_deg": _degrees(mode.azimuth_step_rad),
        "elevation_step_deg": None if mode.elevation_step_rad is None else _degrees(mode.elevation_step_rad),
        "n_azimuths": grid.n_azimuths,
        "n_channels": grid.n_channels,
    }


def _azimuths(scanner: Scanner) -> str:
    sector = scanner.azimuth_range_rad
    return "{:.1f} to {:.1f}".format(*map(math.degrees, sector)) if sector else "full turn"


def _mounting(scanner: Scanner) -> str:
    return "inverted" if scanner.inverted else "upright"


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 6)


# ------------------------------------------------------------------------------------------- the page
def reference_page() -> str:
    """Return docs/reference/scanners.md: tables of all scanners that come along, and where their figures are from."""
    from planner_core.scanner.load_scanner import list_scanners, scanner_title

    documents = [_document(scanner) for scanner in list_scanners()]
    titles = {d["name"]: scanner_title(d["name"]) for d in documents}
    parts = [
        _HEAD,
        _table(
            "name | scanner | range m | elevation deg | accuracy of range | of angles arcsec | noise of range",
            [_figures_row(d, titles[d["name"]]) for d in documents],
        ),
        _table(
            "name | beam divergence mrad | width at | wavelength nm | compensator | pre-alignment",
            [_beam_row(d) for d in documents],
        ),
        "## Modes\nBeams of a whole scan: azimuths x channels. `default`: what the name alone takes, where "
        "that has no name of its own.\n",
        _table("name | mode | step deg | beams | seconds", [row for d in documents for row in _mode_rows(d)]),
        "## Sources\n",
        *(f"- **{titles[d['name']]}** (`{d['name']}`): {d['source']}\n" for d in documents),
    ]
    parts.append(_UNCONFIRMED)
    text = "\n".join(part.rstrip("\n") + "\n" for part in parts)
    return text.replace("\n\n- **", "\n- **").replace("## Sources\n- ", "## Sources\n- ")


def _table(head: str, rows: list[tuple[str, ...]]) -> str:
    names = head.split(" | ")
    lines = [names, ["---"] * len(names), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def _figures_row(d: dict[str, Any], title: str) -> tuple[str, ...]:
    accuracy, angle = d["ranging_accuracy"], d["angular_accuracy_rad"]
    return (
        f"`{d['name']}`",
        title,
        f"{d['range_min_m']:g} to {d['range_max_m']:g}",
        f"{d['elevation_min_deg']:g} to {d['elevation_max_deg']:g}",
        f"{accuracy['constant_m'] * 1e3:g} mm + {accuracy['per_metre'] * 1e6:g} ppm" if accuracy else "-",
        f"{math.degrees(angle) * 3600:.1f}" if angle else "-",
        f"{len(d['range_noise'])} rows" if d["range_noise"] else "-",
    )


def _beam_row(d: dict[str, Any]) -> tuple[str, ...]:
    divergence, wavelength, compensator = d["beam_divergence_rad"], d["wavelength_m"], d["dual_axis_compensator"]
    return (
        f"`{d['name']}`",
        f"{divergence * 1e3:g}" if divergence else "-",
        d["beam_width_at"] or "-",
        f"{wavelength * 1e9:.0f}" if wavelength else "-",
        "-" if compensator is None else "two axes" if compensator else "none",
        d["pre_alignment"],
    )


def _mode_rows(d: dict[str, Any]) -> list[tuple[str, ...]]:
    """One row a mode, with the default one in bold, also where it is none of the instrument's own."""
    rows = [(m["id"], m["title"], _step_of(m), m["n_azimuths"], m["n_channels"], m["seconds"]) for m in d["modes"]]
    if d["mode"] not in {row[0] for row in rows}:
        own = (
            d["mode"] or "default",
            "chosen for tlsplan, not a mode of the instrument",
            "-",
            d["n_azimuths"],
            d["n_channels"],
        )
        rows.append((*own, d["seconds_per_scan"]))
    cells: list[tuple[str, ...]] = []
    for mode, title, step, n_azimuths, n_channels, seconds in rows:
        cell = f"`{mode}`" if d["mode"] is None or mode != d["mode"] else f"**`{mode}`**"
        note = f" ({title})" if mode != "default" else ""
        beams = f"{n_azimuths} x {n_channels}"
        cells.append((f"`{d['name']}`", cell + note, step, beams, f"{seconds:g}" if seconds else "-"))
    return cells


def _step_of(mode: dict[str, Any]) -> str:
    """Return the step of a mode, where it is the same both ways."""
    return "-" if mode["elevation_step_deg"] is None else f"{mode['azimuth_step_deg']:.4f}"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference_page(), encoding="utf-8")
