"""Changes of a review, one dataclass a kind. `planner_core.review.apply` makes them. Scene frame, metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from planner_core.model.review import Entrance, ForbiddenPlace, PlanUnderReview, Point, Review, SignOff, Zone
from planner_core.model.site import GroundPick

AsNow = Literal["as_now"]
AS_NOW: Final[AsNow] = "as_now"


@dataclass(frozen=True)
class Signature:
    """Who makes a change, and when (UTC, ISO 8601 to the second)."""

    name: str
    time: str


@dataclass(frozen=True)
class MoveStation:
    """Set a station's pose. position_m None: back where the plan has it, height and floor too.

    instrument_height_m : `AS_NOW`; None: not known. floor None: as now.
    """

    kind: ClassVar[str] = "move_station"
    station: str
    position_m: Point | None
    instrument_height_m: float | AsNow | None = AS_NOW
    floor: str | None = None


@dataclass(frozen=True)
class SetHeight:
    """Raise or lower a station's sensor over the same spot."""

    kind: ClassVar[str] = "set_height"
    station: str
    instrument_height_m: float


@dataclass(frozen=True)
class AddStation:
    """Add a station. station None: the next free id."""

    kind: ClassVar[str] = "add_station"
    position_m: Point
    floor: str
    instrument_height_m: float | None = None
    station: str | None = None
    locked: bool | None = None


@dataclass(frozen=True)
class RemoveStation:
    """Take a station out."""

    kind: ClassVar[str] = "remove_station"
    station: str


@dataclass(frozen=True)
class RestoreStation:
    """Bring a station of the plan back that was taken out."""

    kind: ClassVar[str] = "restore_station"
    station: str


@dataclass(frozen=True)
class LockStation:
    """Have a station in every plan that is made again. locked None: as the plan has it; False is `unlock_station`."""

    kind: ClassVar[str] = "lock_station"
    station: str
    locked: bool | None = True


@dataclass(frozen=True)
class UnlockStation:
    """Let a plan that is made again do without the station."""

    kind: ClassVar[str] = "unlock_station"
    station: str


@dataclass(frozen=True)
class Forbid:
    """Keep stations away from a place. An empty id: the next free one."""

    kind: ClassVar[str] = "forbid"
    place: ForbiddenPlace


@dataclass(frozen=True)
class Allow:
    """Take a forbidden place back."""

    kind: ClassVar[str] = "allow"
    id: str


@dataclass(frozen=True)
class AddZone:
    """Add a zone."""

    kind: ClassVar[str] = "add_zone"
    zone: Zone


@dataclass(frozen=True)
class ChangeZone:
    """Put another zone in the place of the one of its id."""

    kind: ClassVar[str] = "change_zone"
    zone: Zone


@dataclass(frozen=True)
class RemoveZone:
    """Take a zone out."""

    kind: ClassVar[str] = "remove_zone"
    id: str


@dataclass(frozen=True)
class PickGround:
    """Mark, or unmark, the surface at a point as ground. id None: the next free one."""

    kind: ClassVar[str] = "pick_ground"
    pick: GroundPick
    id: str | None = None


@dataclass(frozen=True)
class UnpickGround:
    """Take a pick back: the surface is again what it was found to be."""

    kind: ClassVar[str] = "unpick_ground"
    id: str


@dataclass(frozen=True)
class AddEntrance:
    """Have the crew enter at a place. An empty id: the next free one."""

    kind: ClassVar[str] = "add_entrance"
    entrance: Entrance


@dataclass(frozen=True)
class RemoveEntrance:
    """Take an entrance back."""

    kind: ClassVar[str] = "remove_entrance"
    id: str


@dataclass(frozen=True)
class SetDoor:
    """Have a door open or shut during scanning. door : the source's id of it. state None: as the plan has it."""

    kind: ClassVar[str] = "set_door"
    door: str
    state: str | None


@dataclass(frozen=True)
class AddComment:
    """Add a comment. author, time None: whoever makes the change, now. id None: the next free one."""

    kind: ClassVar[str] = "add_comment"
    text: str
    target: str | int | None = None
    position_m: Point | None = None
    id: str | None = None
    author: str | None = None
    time: str | None = None
    resolved: bool = False


@dataclass(frozen=True)
class EditComment:
    """Reword a comment: its author may."""

    kind: ClassVar[str] = "edit_comment"
    id: str
    text: str


@dataclass(frozen=True)
class ResolveComment:
    """Say that a comment is settled, or that it is not."""

    kind: ClassVar[str] = "resolve_comment"
    id: str
    resolved: bool = True


@dataclass(frozen=True)
class RemoveComment:
    """Take a comment out: its author may."""

    kind: ClassVar[str] = "remove_comment"
    id: str


@dataclass(frozen=True)
class SetVerdict:
    """Accept or reject a station. by, time None: whoever makes the change, now."""

    kind: ClassVar[str] = "set_verdict"
    station: str
    verdict: str
    note: str = ""
    by: str | None = None
    time: str | None = None


@dataclass(frozen=True)
class ClearVerdict:
    """Take a verdict back."""

    kind: ClassVar[str] = "clear_verdict"
    station: str


@dataclass(frozen=True)
class Sign:
    """Sign the plan off as it stands. earlier : a signature that was there, put back as it was."""

    kind: ClassVar[str] = "sign"
    note: str = ""
    earlier: SignOff | None = None


@dataclass(frozen=True)
class Unsign:
    """Take the signature back."""

    kind: ClassVar[str] = "unsign"


Change = (
    MoveStation | SetHeight | AddStation | RemoveStation | RestoreStation | LockStation | UnlockStation
    | Forbid | Allow | AddZone | ChangeZone | RemoveZone | PickGround | UnpickGround
    | AddEntrance | RemoveEntrance | SetDoor
    | AddComment | EditComment | ResolveComment | RemoveComment | SetVerdict | ClearVerdict | Sign | Unsign
)  # fmt: skip


@dataclass(frozen=True)
class Context:
    """What a change is applied in: the plan, who makes it, and the revision that it will make."""

    plan: PlanUnderReview
    by: Signature
    revision: int = 0


@dataclass(frozen=True)
class Applied:
    """The review after a change, what takes the change back, and what it touched, named as in `Review.touched`."""

    review: Review
    inverse: Change
    touched: str


def objects_of(change: Change) -> tuple[str, ...]:
    """Name what a change is decided on, as in `Review.touched`: somebody else's change of it makes a conflict.

    Nothing where it adds something under a free id. A signature is decided on everything, which its caller sees to.
    """
    match change:
        case SetVerdict() | ClearVerdict():  # nobody accepts a station that was moved meanwhile
            return f"verdict:{change.station}", f"station:{change.station}"
        case AddStation():
            return () if change.station is None else (f"station:{change.station}",)
        case MoveStation() | SetHeight() | RemoveStation() | RestoreStation() | LockStation() | UnlockStation():
            return (f"station:{change.station}",)
        case Forbid():
            return (f"forbidden:{change.place.id}",) if change.place.id else ()
        case Allow():
            return (f"forbidden:{change.id}",)
        case AddZone() | ChangeZone():
            return (f"zone:{change.zone.id}",) if change.zone.id else ()
        case RemoveZone():
            return (f"zone:{change.id}",)
        case PickGround() | UnpickGround():
            return (f"pick:{change.id}",) if change.id else ()
        case AddEntrance():
            return (f"entrance:{change.entrance.id}",) if change.entrance.id else ()
        case RemoveEntrance():
            return (f"entrance:{change.id}",)
        case SetDoor():
            return (f"door:{change.door}",)
        case AddComment() | EditComment() | ResolveComment() | RemoveComment():
            return (f"comment:{change.id}",) if change.id else ()
        case Sign() | Unsign():
            return ("sign_off",)
