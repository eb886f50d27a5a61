"""Changes of a review, one dataclass a kind, which is also its document. `planner_core.review.apply` makes them.

Scene frame, metres. Fields that may be left out have a default.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, ConfigDict, Field, with_config

from planner_core.documents import YesNo
from planner_core.model.review import (
    Assignee,
    DoorId,
    DoorState,
    Due,
    Entrance,
    FloorId,
    ForbiddenPlace,
    Height,
    Id,
    Line,
    Note,
    Photo,
    PlanUnderReview,
    ProgressState,
    Review,
    SignOff,
    StationId,
    Target,
    Text,
    Time,
    VerdictWord,
    Zone,
)
from planner_core.model.site import NO_OTHER_KEYS, GroundPick, Point

AsNow = Literal["as_now"]
AS_NOW: Final[AsNow] = "as_now"


def _kind_is_needed(schema: dict[str, Any]) -> None:
    del schema["properties"]["kind"]["default"]
    schema["required"] = ["kind", *schema.get("required", [])]


_change = with_config(ConfigDict(**NO_OTHER_KEYS, json_schema_extra=_kind_is_needed))
"""What all changes are as documents."""


def _with_id(value: object) -> object:
    return {"id": "", **value} if isinstance(value, Mapping) else value


_OR_NEW = BeforeValidator(_with_id)
"""The id of what is added may be left out: the next free one."""


@dataclass(frozen=True)
class Signature:
    """Who makes a change, and when (UTC, ISO 8601 to the second)."""

    name: str
    time: str


@_change
@dataclass(frozen=True)
class MoveStation:
    """Set a station's pose. Position null: back where the plan has it, height and floor too.

    Height left out: as now; null: not known. Floor null: as now.
    """

    kind: Literal["move_station"] = field(default="move_station", kw_only=True)
    station: StationId
    position_m: Point | None
    instrument_height_m: Height | AsNow | None = AS_NOW
    floor: FloorId | None = None


@_change
@dataclass(frozen=True)
class SetHeight:
    """Raise or lower a station's sensor over the same spot."""

    kind: Literal["set_height"] = field(default="set_height", kw_only=True)
    station: StationId
    instrument_height_m: Height


@_change
@dataclass(frozen=True)
class AddStation:
    """Add a station. Its id null: the next free one."""

    kind: Literal["add_station"] = field(default="add_station", kw_only=True)
    position_m: Point
    floor: FloorId
    instrument_height_m: Height | None = None
    station: Id | None = None
    locked: YesNo | None = None


@_change
@dataclass(frozen=True)
class RemoveStation:
    """Remove a station."""

    kind: Literal["remove_station"] = field(default="remove_station", kw_only=True)
    station: StationId


@_change
@dataclass(frozen=True)
class RestoreStation:
    """Restore a removed station of the plan."""

    kind: Literal["restore_station"] = field(default="restore_station", kw_only=True)
    station: StationId


@_change
@dataclass(frozen=True)
class LockStation:
    """Keep a station in every new plan; null: as the plan has it; false: as `unlock_station`."""

    kind: Literal["lock_station"] = field(default="lock_station", kw_only=True)
    station: StationId
    locked: YesNo | None = True


@_change
@dataclass(frozen=True)
class UnlockStation:
    """Let new plans do without the station."""

    kind: Literal["unlock_station"] = field(default="unlock_station", kw_only=True)
    station: StationId


@_change
@dataclass(frozen=True)
class Forbid:
    """Keep stations away from a position."""

    kind: Literal["forbid"] = field(default="forbid", kw_only=True)
    place: Annotated[ForbiddenPlace, _OR_NEW]


@_change
@dataclass(frozen=True)
class Allow:
    """Allow a forbidden position again."""

    kind: Literal["allow"] = field(default="allow", kw_only=True)
    id: Id


@_change
@dataclass(frozen=True)
class AddZone:
    """Add a zone."""

    kind: Literal["add_zone"] = field(default="add_zone", kw_only=True)
    zone: Annotated[Zone, _OR_NEW]


@_change
@dataclass(frozen=True)
class ChangeZone:
    """Replace the zone of this id."""

    kind: Literal["change_zone"] = field(default="change_zone", kw_only=True)
    zone: Zone


@_change
@dataclass(frozen=True)
class RemoveZone:
    """Remove a zone."""

    kind: Literal["remove_zone"] = field(default="remove_zone", kw_only=True)
    id: Id


@_change
@dataclass(frozen=True)
class PickGround:
    """Mark the surface at a point as a walkable floor, or as none. Its id null: the next free one."""

    kind: Literal["pick_ground"] = field(default="pick_ground", kw_only=True)
    pick: GroundPick
    id: Id | None = None


@_change
@dataclass(frozen=True)
class UnpickGround:
    """Remove a mark: the surface is again what it was found to be."""

    kind: Literal["unpick_ground"] = field(default="unpick_ground", kw_only=True)
    id: Id


@_change
@dataclass(frozen=True)
class AddEntrance:
    """Add an entrance: the route begins at the first."""

    kind: Literal["add_entrance"] = field(default="add_entrance", kw_only=True)
    entrance: Annotated[Entrance, _OR_NEW]


@_change
@dataclass(frozen=True)
class RemoveEntrance:
    """Remove an entrance."""

    kind: Literal["remove_entrance"] = field(default="remove_entrance", kw_only=True)
    id: Id


@_change
@dataclass(frozen=True)
class SetDoor:
    """Have a door open or shut during scanning; null: as the plan has it. Counts when the plan is made again."""

    kind: Literal["set_door"] = field(default="set_door", kw_only=True)
    door: DoorId
    state: DoorState | None


@_change
@dataclass(frozen=True)
class AddComment:
    """Add a comment. Its id null: the next free one.

    Author and time null: whoever makes the change, now; they are there to take a removal back.
    """

    kind: Literal["add_comment"] = field(default="add_comment", kw_only=True)
    text: Text
    target: Target = None
    position_m: Point | None = None
    id: Id | None = None
    author: Line | None = None
    time: Time | None = None
    resolved: YesNo = False
    assignee: Assignee = ""
    due: Due = ""
    photo: Photo = ""


@_change
@dataclass(frozen=True)
class AssignComment:
    """Say who deals with a comment, and by when; anybody may."""

    kind: Literal["assign_comment"] = field(default="assign_comment", kw_only=True)
    id: Id
    assignee: Assignee = ""
    due: Due = ""


@_change
@dataclass(frozen=True)
class EditComment:
    """Edit a comment: its author may."""

    kind: Literal["edit_comment"] = field(default="edit_comment", kw_only=True)
    id: Id
    text: Text


@_change
@dataclass(frozen=True)
class ResolveComment:
    """Resolve a comment, or reopen it."""

    kind: Literal["resolve_comment"] = field(default="resolve_comment", kw_only=True)
    id: Id
    resolved: YesNo = True


@_change
@dataclass(frozen=True)
class RemoveComment:
    """Remove a comment: its author may."""

    kind: Literal["remove_comment"] = field(default="remove_comment", kw_only=True)
    id: Id


@_change
@dataclass(frozen=True)
class SetVerdict:
    """Accept or reject a station. By and time null: whoever makes the change, now."""

    kind: Literal["set_verdict"] = field(default="set_verdict", kw_only=True)
    station: StationId
    verdict: VerdictWord
    note: Note = ""
    by: Line | None = None
    time: Time | None = None


@_change
@dataclass(frozen=True)
class ClearVerdict:
    """Clear a verdict."""

    kind: Literal["clear_verdict"] = field(default="clear_verdict", kw_only=True)
    station: StationId


@_change
@dataclass(frozen=True)
class SetProgress:
    """Mark a station as done or skipped on site; state null: neither. By and time null: whoever marks it, now."""

    kind: Literal["set_progress"] = field(default="set_progress", kw_only=True)
    station: StationId
    state: ProgressState | None
    by: Line | None = None
    time: Time | None = None


@_change
@dataclass(frozen=True)
class Sign:
    """Sign the plan off as it stands; `earlier` restores a sign-off that was withdrawn."""

    kind: Literal["sign"] = field(default="sign", kw_only=True)
    note: Note = ""
    earlier: SignOff | None = None


@_change
@dataclass(frozen=True)
class Unsign:
    """Withdraw the sign-off."""

    kind: Literal["unsign"] = field(default="unsign", kw_only=True)


Change = Annotated[
    MoveStation | SetHeight | AddStation | RemoveStation | RestoreStation | LockStation | UnlockStation
    | Forbid | Allow | AddZone | ChangeZone | RemoveZone | PickGround | UnpickGround
    | AddEntrance | RemoveEntrance | SetDoor
    | AddComment | AssignComment | EditComment | ResolveComment | RemoveComment
    | SetVerdict | ClearVerdict | SetProgress | Sign | Unsign,
    Field(discriminator="kind"),
]  # fmt: skip
"""Any of them, by its `kind`."""


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
        case SetProgress():  # nor marks as done what stands elsewhere by now
            return f"progress:{change.station}", f"station:{change.station}"
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
        case AddComment() | AssignComment() | EditComment() | ResolveComment() | RemoveComment():
            return (f"comment:{change.id}",) if change.id else ()
        case Sign() | Unsign():
            return ("sign_off",)
