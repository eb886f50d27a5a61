"""What a user says of how formats are written; each format takes its own of these, see `Format.options`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """Options of all formats.

    A new one: a field with a default here, its name in `Format.options` of who takes it, and a line in the table
    `FORMAT_OPTIONS` of cli/commands/export.py.
    """

    columns: str = "PENZD"
    """Column set of station lists."""
    instrument: str = "ground"
    """Which height is a station's own where a format has one only: of the `ground` point or of the `sensor`."""
    paper: str = "A3"
    floors: tuple[str, ...] = ()
    """Ids or names; empty: all."""
    noise: bool = False
    """Range noise and dropouts by the scanner's own figures."""
    seed: int = 0
    max_points: int | None = None
    """A cloud holds no more points than these; None: all."""
