"""The review as the interface speaks of it: JSON documents, checked where they come in; from and to the library's.

Keys are the fields of `planner_core.model.review` and `planner_core.review.changes`. Positions are in the scene frame.
"""

import dataclasses
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from planner_core.model.review import (
    FARTHEST_M,
    MOST_CORNERS,
    MOST_NAME_CHARACTERS,
    MOST_NOTE_BYTES,
    MOST_TEXT_BYTES,
    Entrance,
    ForbiddenPlace,
    Review,
    SignOff,
    Zone,
)
from planner_core.model.site import GroundPick
from planner_core.review.apply import KINDS
from planner_core.review.changes import Change
from planner_core.review.commit import MOST_CHANGES, EditConflict

Metres = Annotated[float, Field(strict=True, ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Point = Annotated[list[Metres], Field(min_length=3, max_length=3, description="x, y, z: scene frame, metres.")]
Corner = Annotated[list[Metres], Field(min_length=2, max_length=2)]
Outline = Annotated[
    list[Corner],
    Field(min_length=3, max_length=MOST_CORNERS, description="Corners x, y of a polygon that does not cross itself."),
]
Height = Annotated[
    float, Field(strict=True, ge=0, le=100, allow_inf_nan=False, description="Of the sensor above the ground, metres.")
]
StationId = Annotated[str, Field(min_length=1, max_length=200, description="Id of a station.")]
Id = Annotated[str, Field(min_length=1, max_length=32, pattern="^[A-Za-z][A-Za-z0-9_]*$")]
NewId = Annotated[
    str, Field(max_length=32, pattern="^([A-Za-z][A-Za-z0-9_]*)?$", description="Empty: the next free one.")
]
FloorId = Annotated[str, Field(max_length=200, description="Id of a floor of the plan, F0 ...")]
AnyFloor = Annotated[str, Field(max_length=200, description="Id of a floor of the plan; empty: all floors.")]
Line = Annotated[str, Field(min_length=1, max_length=MOST_NAME_CHARACTERS)]
Text = Annotated[str, Field(min_length=1, max_length=MOST_TEXT_BYTES, description="Plain text, 10 000 bytes of UTF-8.")]
Note = Annotated[str, Field(max_length=MOST_NOTE_BYTES, description="Plain text, 2 000 bytes of UTF-8.")]
Time = Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$", description="UTC.")]
Whole = Annotated[int, Field(strict=True, ge=0, le=2**53)]
Share = Annotated[float, Field(strict=True, gt=0, le=1, allow_inf_nan=False)]
Radius = Annotated[float, Field(strict=True, gt=0, le=1000, allow_inf_nan=False, description="Metres.")]
Target = Annotated[
    Annotated[str, Field(strict=True, min_length=1, max_length=200)] | Whole | None,
    Field(description="A station's id, an element's index in the scene, or null: the plan."),
]
DoorId = Annotated[str, Field(min_length=1, max_length=MOST_NAME_CHARACTERS, description="IFC GlobalId of a door.")]
DoorState = Literal["open", "shut"]
YesOrNo = Annotated[bool, Field(strict=True)]


class Document(BaseModel):
    """What all documents have in common: keys that are not known are refused, so that none is lost silently."""

    model_config = ConfigDict(extra="forbid")


# -------------------------------------------------------------------------------------------------- parts of a review
class StationEditDocument(Document):
    """What was changed of a station; null: as in the plan, which has no such station where it was `added`."""

    position_m: Point | None
    instrument_height_m: Height | None
    floor: str | None
    added: bool
    removed: bool
    locked: bool | None


class ForbiddenPlaceDocument(Document):
    """A position that stations keep away from."""

    id: NewId = ""
    position_m: Point
    radius_m: Radius = 0.5
    floor: AnyFloor = ""


class ZoneDocument(Document):
    """A drawn area: `keep_out`, or `priority` with the coverage required of it."""

    id: NewId = ""
    kind: Literal["keep_out", "priority"]
    outline_m: Outline
    floor: AnyFloor = ""
    name: Annotated[str, Field(max_length=MOST_NAME_CHARACTERS)] = ""
    coverage: Share | None = None


class GroundPickDocument(Document):
    """A surface marked as a walkable floor, or as none: the coplanar region around a point on it."""

    point_m: Point
    is_ground: YesOrNo = True
    floor: AnyFloor = ""


class EntranceDocument(Document):
    """Where the crew enters: a point on the ground of a floor."""

    id: NewId = ""
    position_m: Point
    floor: FloorId


class CommentDocument(Document):
    """A remark, pinned to a station, an element, a place or nothing."""

    id: Id
    text: Text
    author: Line
    time: Time
    target: Target
    position_m: Point | None
    resolved: bool


class VerdictDocument(Document):
    """What a reviewer thinks of a station."""

    verdict: Literal["accepted", "rejected"]
    by: Line
    time: Time
    note: Note


class SignOffDocument(Document):
    """Who signed off the plan, as reviewed; a later revision changed something since."""

    name: Line
    time: Time
    plan_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    revision: Whole
    note: Note


class TouchDocument(Document):
    """When an object was last changed, and by whom."""

    revision: Annotated[Whole, Field(description="The revision that the change made.", examples=[7])]
    by: Annotated[str, Field(examples=["Ben"])]
    at: Annotated[str, Field(description="UTC.", examples=["2026-11-21T16:45:00Z"])]


class ReviewDocument(Document):
    """Everything that reviewers changed, by id."""

    revision: Annotated[int, Field(ge=0, description="How often something was changed; 0: never.")]
    stations: dict[str, StationEditDocument]
    forbidden: dict[str, ForbiddenPlaceDocument]
    zones: dict[str, ZoneDocument]
    ground_picks: dict[str, GroundPickDocument]
    entrances: dict[str, EntranceDocument]
    doors: Annotated[dict[str, DoorState], Field(description="Doors that are open or shut whatever the plan has.")]
    comments: dict[str, CommentDocument]
    verdicts: dict[str, VerdictDocument]
    sign_off: SignOffDocument | None
    touched: Annotated[
        dict[str, TouchDocument],
        Field(
            description="Last change of every object, also of removed ones: `station:S001`, `zone:Z001`, "
            "`forbidden:P001`, `pick:G001`, `entrance:E001`, `door:GLOBALID`, `comment:C001`, `verdict:S001`, "
            "`sign_off`."
        ),
    ]


# ------------------------------------------------------------------------------------------------------------ changes
class MoveStation(Document):
    """Set a station's pose. Position null: back where the plan has it. Height left out: as now; null: not known."""

    kind: Literal["move_station"]
    station: StationId
    position_m: Point | None
    instrument_height_m: Height | None = None
    floor: FloorId | None = None


class SetHeight(Document):
    """Raise or lower a station's sensor over the same spot."""

    kind: Literal["set_height"]
    station: StationId
    instrument_height_m: Height


class AddStation(Document):
    """Add a station. Its id left out: the next free one."""

    kind: Literal["add_station"]
    position_m: Point
    floor: FloorId
    instrument_height_m: Height | None = None
    station: Id | None = None
    locked: YesOrNo | None = None


class RemoveStation(Document):
    """Remove a station."""

    kind: Literal["remove_station"]
    station: StationId


class RestoreStation(Document):
    """Restore a removed station of the plan."""

    kind: Literal["restore_station"]
    station: StationId


class LockStation(Document):
    """Keep a station in every new plan; null: as the plan has it."""

    kind: Literal["lock_station"]
    station: StationId
    locked: YesOrNo | None = True


class UnlockStation(Document):
    """Let new plans do without the station."""

    kind: Literal["unlock_station"]
    station: StationId


class Forbid(Document):
    """Keep stations away from a position."""

    kind: Literal["forbid"]
    place: ForbiddenPlaceDocument


class Allow(Document):
    """Allow a forbidden position again."""

    kind: Literal["allow"]
    id: Id


class AddZone(Document):
    """Add a zone."""

    kind: Literal["add_zone"]
    zone: ZoneDocument


class ChangeZone(Document):
    """Replace the zone of this id."""

    kind: Literal["change_zone"]
    zone: ZoneDocument


class RemoveZone(Document):
    """Remove a zone."""

    kind: Literal["remove_zone"]
    id: Id


class PickGround(Document):
    """Mark the surface at a point as a walkable floor, or as none."""

    kind: Literal["pick_ground"]
    pick: GroundPickDocument
    id: Id | None = None


class UnpickGround(Document):
    """Remove a mark: the surface is again what it was found to be."""

    kind: Literal["unpick_ground"]
    id: Id


class AddEntrance(Document):
    """Add an entrance: the route begins at the first."""

    kind: Literal["add_entrance"]
    entrance: EntranceDocument


class RemoveEntrance(Document):
    """Remove an entrance."""

    kind: Literal["remove_entrance"]
    id: Id


class SetDoor(Document):
    """Have a door open or shut during scanning; null: as the plan has it. Counts when the plan is made again."""

    kind: Literal["set_door"]
    door: DoorId
    state: DoorState | None


class AddComment(Document):
    """Add a comment. Author and time left out: whoever makes the change, now; they are there to take a removal back."""

    kind: Literal["add_comment"]
    text: Text
    target: Target = None
    position_m: Point | None = None
    id: Id | None = None
    author: Line | None = None
    time: Time | None = None
    resolved: YesOrNo = False


class EditComment(Document):
    """Edit a comment: its author may."""

    kind: Literal["edit_comment"]
    id: Id
    text: Text


class ResolveComment(Document):
    """Resolve a comment, or reopen it."""

    kind: Literal["resolve_comment"]
    id: Id
    resolved: YesOrNo = True


class RemoveComment(Document):
    """Remove a comment: its author may."""

    kind: Literal["remove_comment"]
    id: Id


class SetVerdict(Document):
    """Accept or reject a station. By and time left out: whoever makes the change, now."""

    kind: Literal["set_verdict"]
    station: StationId
    verdict: Literal["accepted", "rejected"]
    note: Note = ""
    by: Line | None = None
    time: Time | None = None


class ClearVerdict(Document):
    """Clear a verdict."""

    kind: Literal["clear_verdict"]
    station: StationId


class Sign(Document):
    """Sign the plan off as it stands; `earlier` restores a sign-off that was withdrawn."""

    kind: Literal["sign"]
    note: Note = ""
    earlier: SignOffDocument | None = None


class Unsign(Document):
    """Withdraw the sign-off."""

    kind: Literal["unsign"]


ChangeDocument = Annotated[
    MoveStation | SetHeight | AddStation | RemoveStation | RestoreStation | LockStation | UnlockStation
    | Forbid | Allow | AddZone | ChangeZone | RemoveZone | PickGround | UnpickGround
    | AddEntrance | RemoveEntrance | SetDoor
    | AddComment | EditComment | ResolveComment | RemoveComment | SetVerdict | ClearVerdict | Sign | Unsign,
    Field(discriminator="kind"),
]  # fmt: skip


class Changes(Document):
    """Changes to make together: all of them, or none."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "base_revision": 7,
                    "author": "Ana",
                    "changes": [
                        {"kind": "move_station", "station": "S003", "position_m": [12.5, 3.25, 1.6], "floor": "F0"},
                        {"kind": "add_comment", "target": "S003", "text": "Out of the doorway."},
                    ],
                }
            ]
        },
    )

    base_revision: Annotated[Whole, Field(description="The revision that they were decided on.")]
    author: Annotated[Line, Field(description="Who makes them: as given, not proven.")]
    changes: Annotated[list[ChangeDocument], Field(min_length=1, max_length=MOST_CHANGES)]
    plan_sha256: Annotated[
        str | None, Field(max_length=64, description="Of the plan that they were decided on; null: whichever it is.")
    ] = None


class CommittedDocument(Document):
    """What was kept. undo : changes that take it back, in the order to send them."""

    revision: Whole
    undo: list[ChangeDocument]
    review: ReviewDocument


class ClashDocument(Document):
    """An object that someone else changed meanwhile."""

    object: Annotated[str, Field(description="As in `touched` of a review.", examples=["station:S003"])]
    by: Annotated[str, Field(description="Who changed it last.", examples=["Ben"])]
    at: Annotated[str, Field(description="When, UTC.", examples=["2026-11-21T16:45:00Z"])]


class ConflictDocument(Document):
    """Nothing was changed, because someone else changed it first; `review` is as it stands."""

    message: str
    conflicts: list[ClashDocument]
    review: ReviewDocument


# --------------------------------------------------------------------------------------------------- to and fro
_NESTED = {"place": ForbiddenPlace, "zone": Zone, "pick": GroundPick, "entrance": Entrance, "earlier": SignOff}


def change_of(document: Document) -> Change:
    """Return the change of a document of `ChangeDocument`; raises `ReviewError` where it breaks a rule."""
    fields = document.model_dump(exclude={"kind"}, exclude_unset=True)
    for name in _NESTED.keys() & fields.keys():
        part: Document | None = getattr(document, name)
        fields[name] = None if part is None else _NESTED[name](**_tuples(part.model_dump()))
    kind: str = getattr(document, "kind")  # noqa: B009 - of the union, which has no type of its own
    change: Change = KINDS[kind](**_tuples(fields))
    return change


def change_document(change: Change) -> dict[str, Any]:
    """Return a change as plain JSON."""
    return {"kind": change.kind, **dataclasses.asdict(change)}


def review_document(review: Review) -> dict[str, Any]:
    """Return a review as plain JSON."""
    return dataclasses.asdict(review)


def clash_document(clash: EditConflict) -> dict[str, Any]:
    """Return a clash as plain JSON."""
    return dataclasses.asdict(clash)


def _tuples(fields: dict[str, Any]) -> dict[str, Any]:
    """JSON knows lists only; dataclasses are compared and kept, so they have tuples."""
    return {name: _tuple(value) if isinstance(value, list) else value for name, value in fields.items()}


def _tuple(values: list[Any]) -> tuple[Any, ...]:
    return tuple(_tuple(value) if isinstance(value, list) else value for value in values)
