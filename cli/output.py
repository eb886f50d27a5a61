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
    from planner_core.errors import escaped

    click.echo(escaped(text))


def alarm(text: str) -> None:
    """Print a line of result in red, where a terminal shows it."""
    from planner_core.errors import escaped

    click.secho(escaped(text), fg="red")


def repairs(report: LoadReport, *, listed_in: str) -> tuple[str, ...]:
    """Return the line on what loading dropped, and where each face is listed: no repair is silent."""
    counts = {
        "duplicate": report.n_duplicate,
        "degenerate": report.n_degenerate,
        "not finite": report.n_non_finite,
        "with a bad index": report.n_bad_index,
        "far away from the rest": report.n_stray,
    }
    parts = [f"{count} {name}" for name, count in counts.items() if count]
    if not parts:
        return ()
    return (f"{', '.join(parts)} of {report.n_faces_read} faces were dropped; {listed_in} lists them",)


def materials(glass_area_m2: float, mirror_area_m2: float, *, glass: str) -> tuple[str, ...]:
    """Lines on glass and mirrors, where the file has any: they decide what is seen, and users may know better."""
    does = {
        "stop": "ends beams",
        "pass": "lets beams pass, surfaces behind it count as seen",
        "return": "counts as a wall",
    }
    lines = []
    if glass_area_m2 > 0:
        lines.append(f"glass         {glass_area_m2:.1f} m2 {does[glass]} (--glass {glass})")
    if mirror_area_m2 > 0:
        lines.append(f"mirrors       {mirror_area_m2:.1f} m2 end beams")
    return tuple(lines)


def as_json(document: Any) -> None:
    """Print a document as JSON; not-a-number has no place in it."""
    from planner_core.errors import escaped

    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    click.echo(escaped(text, lambda sign: json.dumps(sign)[1:-1]))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print an aligned table: first column left, cells that look like numbers right."""
    from planner_core.errors import one_line

    lines = [tuple(map(one_line, row)) for row in (header, *rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    for line in lines:
        cells = [
            cell.rjust(width) if _is_number(cell) else cell.ljust(width)
            for cell, width in zip(line, widths, strict=True)
        ]
        say("  ".join(cells).rstrip())


def _is_number(cell: str) -> bool:
    return cell.replace(".", "", 1).replace("-", "", 1).replace("%", "", 1).strip().isdigit()
