"""The list of reproduced figures, in the paper's order, with what the paper found."""

from __future__ import annotations

from . import eq9
from .figure import Figure

FIGURES: tuple[Figure, ...] = (
    Figure(
        "eq9",
        "Eq. 9: coverage over the number of stations",
        "dividing the number of reached polygons by the number of active stations orients the genetic algorithm "
        "towards the most polygons with the fewest scans.",
        eq9.run,
        "a grid of 1 m and 900 columns a scan instead of 0.5 m and 4500",
    ),
)
