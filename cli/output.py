"""How results look on a terminal: aligned tables, warnings, JSON. Results go to standard output, the rest to error."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from planner_core.model import LoadReport


def say(text: str = "") -> None:
    """Print a line of result."""
    click.echo(text)


def warn(warnings: Iterable[str]) -> None:
    """Print warnings to standard error, one line each; they are shown even with --quiet."""
    for line in warnings:
        click.echo(f"warning: {line}", err=True)


def tell_repairs(report: LoadReport, *, listed_in: str) -> None:
    """Say on standard error what loading dropped, and where each face is listed: no repair is silent."""
    counts = {
        "duplicate": report.n_duplicate,
        "degenerate": report.n_degenerate,
        "not finite": report.n_non_finite,
        "with a bad index": report.n_bad_index,
    }
    parts = [f"{count} {name}" for name, count in counts.items() if count]
    if parts:
        click.echo(
            f"repaired: dropped {', '.join(parts)} of {report.n_faces_read} faces; {listed_in} lists them", err=True
        )


def as_json(document: Any) -> None:
    """Print a document as JSON; not-a-number has no place in it."""
    click.echo(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print an aligned table: first column left, cells that look like numbers right."""
    lines = [tuple(header), *(tuple(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    for line in lines:
        cells = [
            cell.rjust(width) if _is_number(cell) else cell.ljust(width)
            for cell, width in zip(line, widths, strict=True)
        ]
        say("  ".join(cells).rstrip())


def _is_number(cell: str) -> bool:
    return cell.replace(".", "", 1).replace("-", "", 1).replace("%", "", 1).strip().isdigit()
