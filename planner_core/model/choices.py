"""What may be chosen, as enumerations: their values are the words of files, of plan.json and of the command line."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

from planner_core.errors import PlannerError, RequirementError

_Choice = TypeVar("_Choice", bound=StrEnum)


class Objective(StrEnum):
    """What a plan is the best of."""

    FEWEST = "fewest"
    """Stations."""
    COVERAGE = "coverage"
    """Most of it, with a number of stations."""
    TIME = "time"
    """Least time in the field."""


class ScanBy(StrEnum):
    """What candidates are judged by."""

    AUTO = "auto"
    """Patches for scanners of very many beams."""
    BEAMS = "beams"
    PATCHES = "patches"
    """Samples of patches, see `planner_core.engine.patch_mode`."""


class NetworkKind(StrEnum):
    """How stations hang together by links, as far as candidates can."""

    JOINED = "joined"
    LOOPS = "loops"
    """Also when any one link fails."""
    NONE = "none"
    """Not asked."""


class Role(StrEnum):
    """What is settled of a station, or a place, before planning."""

    SCANNED = "scanned"
    """Its scan exists."""
    LOCKED = "locked"
    """It must be in the plan."""
    KEPT = "kept"
    """It was in an earlier plan and stays where that costs nothing."""
    BEGUN = "begun"
    """It is of a set that the search begins with, such as the best one of a search that was cut short; nothing keeps
    it."""
    FORBIDDEN = "forbidden"
    """No station within `SettledStation.radius_m` of it."""


class Glass(StrEnum):
    """What glass does to beams, see `planner_core.model.Optics`."""

    PASS = "pass"
    STOP = "stop"
    RETURN = "return"


class Doors(StrEnum):
    """Whose leaves are left out, see `planner_core.scene.doors`."""

    SHUT = "shut"
    """None: as modelled."""
    OPEN = "open"
    """Of doors indoors."""
    ALL = "all"


class UpAxis(StrEnum):
    """The upward axis of a file."""

    Y = "Y"
    Z = "Z"


def one_of(kind: type[_Choice], word: str, what: str, *, error: type[PlannerError] = RequirementError) -> _Choice:
    """Return the member of `kind` that `word` is the value of.

    Raises
    ------
    RequirementError
        Or `error`: there is none; the message names `what`, and all there are.
    """
    if word not in list(kind):
        raise error(f"{what}: got {word!r}, expected one of {', '.join(kind)}")
    return kind(word)
