"""Options of formats; each format takes its own of these, see `Format.options`."""

from __future__ import annotations

from collections.abc import Collection
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
    """The cloud of a station holds no more points than these; None: all."""
    stations: tuple[str, ...] = ()
    """Ids of the stations whose clouds are wanted; empty: all."""
    separator: str = ""
    """Of columns: `comma`, `semicolon`, `tab` or `space`; empty: the column set's own."""
    decimals: int | None = None
    """Of lengths in station lists, metres or feet; None: the column set's own."""
    subtract: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Taken off every easting, northing and height as they are written, for programs that can't hold large ones."""
    gsi_unit: str = ""
    """Last digit of GSI words: `mm` or `0.1mm`, of feet `0.001ft` or `0.0001ft`; empty: the first in GSI-8, the second
    in GSI-16."""
    geojson_crs: str = "wgs84"
    """`wgs84`: longitude and latitude; `local`: the site's own coordinates, which few programs expect."""
    kml_heights: str = "relative"
    """`relative`: above the lowest floor, which is put on the ground; `absolute`: as they are, as if above the sea."""
    cut_m: float = 1.2
    """Height above the ground at which drawings cut walls."""
    max_topics: int = 50
    """Rooms and elements with a topic of BCF of their own, most unseen first."""

    def only(self, names: Collection[str]) -> Options:
        """Return those of some names, all others at their defaults."""
        return Options(**{name: getattr(self, name) for name in names})
