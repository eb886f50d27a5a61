"""What may be chosen, as enumerations: their values are the words of files, of plan.json and of the command line."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

from planner_core.errors import PlannerError, RequirementError

_Choice = TypeVar("_Choice", bound=StrEnum)


class Objective(StrEnum):
    """What a plan is the best of: fewest stations, most coverage with a number of them, least time in the field."""

    FEWEST = "fewest"
    COVERAGE = "coverage"
    TIME = "time"


class VisibilityMode(StrEnum):
    """What candidates are judged by: beams, or samples of patches (`planner_core.engine.patch_mode`).

    Auto: patches for scanners of very many beams.
    """

    AUTO = "auto"
    BEAMS = "beams"
    PATCHES = "patches"


class NetworkKind(StrEnum):
    """How links must join the stations, as far as candidates can; redundant: also when any one link fails."""

    CONNECTED = "connected"
    REDUNDANT = "redundant"
    NONE = "none"

    @classmethod
    def _missing_(cls, value: object) -> NetworkKind | None:
        """Words of earlier versions, in files and plans that are kept."""
        return {"joined": cls.CONNECTED, "loops": cls.REDUNDANT}.get(str(value))


class OverlapMeasure(StrEnum):
    """What overlap of two stations is: what both see, as a share of what the one sees that sees more (the smaller of
    both shares), or of what either sees (Jaccard's index).
    """

    SMALLER_SHARE = "smaller-share"
    JACCARD = "jaccard"


class OverlapOf(StrEnum):
    """Which surface overlap is counted on: all that a station sees, or where it meets the limits required of all."""

    ALL_SEEN = "all-seen"
    SEEN_AS_REQUIRED = "seen-as-required"


class PreAlignment(StrEnum):
    """How well a scan's pose is known before it is registered: where registration starts.

    tracked: the instrument follows itself between set-ups, within some 3 cm and half a degree; manual: somebody places
    scans by hand, within some 15 cm and 3 degrees; level: only the vertical is known; none.
    """

    TRACKED = "tracked"
    MANUAL = "manual"
    LEVEL = "level"
    NONE = "none"


class Scope(StrEnum):
    """What a survey is about: rooms, what is seen from outside, or all; auto: rooms where there are any, else all."""

    AUTO = "auto"
    INTERIOR = "interior"
    EXTERIOR = "exterior"
    ALL = "all"


class Role(StrEnum):
    """Role of a station, or of a forbidden position, given before planning.

    scanned : its scan exists. locked : it must be in the plan. kept : it was in an earlier plan and stays where that
    costs nothing. begun : it is of a set that the search begins with, such as the best one of a search that was cut
    short, and nothing keeps it. forbidden : no station within `PriorStation.radius_m` of it.
    """

    SCANNED = "scanned"
    LOCKED = "locked"
    KEPT = "kept"
    BEGUN = "begun"
    FORBIDDEN = "forbidden"


class Glass(StrEnum):
    """What glass does to beams, see `planner_core.model.Optics`."""

    PASS = "pass"
    STOP = "stop"
    RETURN = "return"


class Doors(StrEnum):
    """Which doors are open, their leaves left out: none, those indoors, or all, see `planner_core.scene.doors`.

    `OPEN` opens exterior doors, too, where both sides are planned, see `planner_core.planning.open_survey`. With
    `OUTSIDE` all are, and stations may stand outdoors, too, see `planner_core.scene.outdoor_ground`.
    """

    SHUT = "shut"
    OPEN = "open"
    ALL = "all"
    OUTSIDE = "outside"


class UpAxis(StrEnum):
    """The upward axis of a file."""

    Y = "Y"
    Z = "Z"


def one_of(kind: type[_Choice], word: str, what: str, *, error: type[PlannerError] = RequirementError) -> _Choice:
    """Return the member of `kind` that `word` means; raises `error`, which names `what` and all there are."""
    try:
        return kind(word)
    except ValueError:
        raise error(f"{what}: got {word!r}, expected one of {', '.join(kind)}") from None
