"""Deliverables: named sets of limits, for users who know what they owe and not which point spacing that takes.

A name -> limits of points and the overlap of links. Figures, their derivation and their sources:
docs/method/deliverables.md, whose table a test holds against this one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from planner_core.errors import RequirementError

#: No limits at all: scanned is what a beam reaches.
NO_DELIVERABLE: Final = "none"
#: Of `tlsplan plan`, `evaluate` and `tlsplan.settings`, where neither options nor a requirements file name one.
DEFAULT_DELIVERABLE: Final = "survey"
_MOST_SHOWN = 40


@dataclass(frozen=True)
class Deliverable:
    """What a deliverable asks where nobody asks otherwise. None: no limit."""

    name: str
    title: str
    spacing_m: float | None = None
    range_m: float | None = None
    incidence_deg: float | None = None
    noise_m: float | None = None
    """One sigma of a range; only where it is finer than what survey scanners are sold by."""
    overlap: float = 0.0
    """Of links between stations, a share; 0: none is required, links count by their probability."""


_ALL = (
    Deliverable(NO_DELIVERABLE, "no limits: seen at all"),
    Deliverable("visual", "point cloud to look at", 0.025, None, 80.0),
    Deliverable("survey", "measured survey of a building, drawn at 1:50 to 1:100", 0.010, 25.0, 75.0),
    Deliverable("loa10", "USIBD LOA 10, 15 cm", 0.100, None, 80.0),
    Deliverable("loa20", "USIBD LOA 20, 5 cm", 0.050, None, 80.0),
    Deliverable("loa30", "USIBD LOA 30, 15 mm", 0.015, 40.0, 75.0),
    Deliverable("loa40", "USIBD LOA 40, 5 mm", 0.006, 10.0, 60.0, 0.0017, 0.40),
    Deliverable("loa50", "USIBD LOA 50, 1 mm", 0.001, 5.0, 60.0, 0.00035, 0.50),
    Deliverable("gsa1", "GSA level 1, 51 mm", 0.050, None, 80.0),
    Deliverable("gsa2", "GSA level 2, 13 mm", 0.008, 34.0, 75.0),
    Deliverable("gsa3", "GSA level 3, 6 mm", 0.004, 12.0, 70.0),
    Deliverable("gsa4", "GSA level 4, 3 mm", 0.0035, 5.0, 60.0, 0.001, 0.40),
)
#: By name, `none` first.
DELIVERABLES: Final = {each.name: each for each in _ALL}


def deliverable_named(name: str) -> Deliverable:
    """Return the deliverable of that name; capitals, spaces and hyphens do not matter.

    Raises
    ------
    RequirementError
        There is none; the message lists them.
    """
    key = name.casefold().translate(str.maketrans("", "", " -_"))
    if key not in DELIVERABLES:
        raise RequirementError(
            f"got the deliverable {name[:_MOST_SHOWN]!r}, expected one of {', '.join(DELIVERABLES)}; see "
            "docs/method/deliverables.md"
        )
    return DELIVERABLES[key]
