"""What reviewers say about a plan and change in it: the plan itself stays as it is.

SCENE frame, metres, like `site`: what people say. Ids of all that a reviewer makes are identifiers (`Z001`), times are
UTC as ISO 8601 to the second (`2026-11-21T16:30:00Z`).

The dataclasses are also the documents that the server and the viewer exchange: pydantic reads them and makes their
schema, from the types below.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Annotated, Any

from pydantic import ConfigDict, Field, WithJsonSchema, with_config

from planner_core.documents import YesNo
from planner_core.errors import ReviewError
from planner_core.model.site import FARTHEST_M, NO_OTHER_KEYS, AnyFloor, GroundPick, Metres, Point

ZONE_KINDS = ("keep_out", "priority")
VERDICTS = ("accepted", "rejected")
PROGRESS_STATES = ("done", "skipped")
DOOR_STATES = ("open", "shut")

MOST_OBJECTS = 10_000
"""Of all kinds together: more than anybody reviews, and still written in a second."""
MOST_TEXT_BYTES = 10_000
MOST_NOTE_BYTES = 2_000
MOST_NAME_CHARACTERS = 100
MOST_CORNERS = 1_000


def _one_of(words: tuple[str, ...]) -> tuple[Any, ...]:
    return Field(pattern=f"^({'|'.join(words)})$"), WithJsonSchema({"enum": list(words), "type": "string"})


Corner = tuple[Metres, Metres]
Outline = Annotated[
    tuple[Corner, ...],
    Field(min_length=3, max_length=MOST_CORNERS, description="Corners x, y of a polygon that does not cross itself."),
]
Height = Annotated[
    float, Field(strict=True, ge=0, le=100, allow_inf_nan=False, description="Of the sensor above the ground, metres.")
]
Id = Annotated[str, Field(min_length=1, max_length=32, pattern="^[A-Za-z][A-Za-z0-9_]*$")]
NewId = Annotated[
    str, Field(max_length=32, pattern="^([A-Za-z][A-Za-z0-9_]*)?$", description="Empty: the next free one.")
]
StationId = Annotated[str, Field(min_length=1, max_length=200, description="Id of a station.")]
FloorId = Annotated[str, Field(max_length=200, description="Id of a floor of the plan, F0 ...")]
DoorId = Annotated[str, Field(min_length=1, max_length=MOST_NAME_CHARACTERS, description="IFC GlobalId of a door.")]
Whole = Annotated[int, Field(strict=True, ge=0, le=2**53)]
Share = Annotated[float, Field(strict=True, gt=0, le=1, allow_inf_nan=False)]
Radius = Annotated[float, Field(strict=True, gt=0, le=1000, allow_inf_nan=False, description="Metres.")]
Line = Annotated[str, Field(min_length=1, max_length=MOST_NAME_CHARACTERS)]
Text = Annotated[str, Field(min_length=1, max_length=MOST_TEXT_BYTES, description="Plain text, 10 000 bytes of UTF-8.")]
Note = Annotated[str, Field(max_length=MOST_NOTE_BYTES, description="Plain text, 2 000 bytes of UTF-8.")]
Time = Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$", description="UTC.")]
Assignee = Annotated[str, Field(max_length=MOST_NAME_CHARACTERS, description="Who is to deal with it; empty: nobody.")]
Due = Annotated[str, Field(pattern=r"^(\d{4}-\d\d-\d\d)?$", description="The day by which, 2026-12-01; empty: none.")]
Photo = Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$", description="SHA-256 of a photo; empty: none.")]
Target = Annotated[
    Annotated[str, Field(strict=True, min_length=1, max_length=200)] | Whole | None,
    Field(description="A station's id, an element's index in the scene, or null: the plan."),
]
ZoneKind = Annotated[str, *_one_of(ZONE_KINDS)]
VerdictWord = Annotated[str, *_one_of(VERDICTS)]
ProgressState = Annotated[str, *_one_of(PROGRESS_STATES)]
DoorState = Annotated[str, *_one_of(DOOR_STATES)]

_ID = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
_SHA256 = re.compile(r"[0-9a-f]{64}")
_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class StationEdit:
    """What was changed of a station; null: as in the plan, which has no such station where it was `added`.

    With a position, that of the sensor, height and floor go with it.
    """

    position_m: Point | None = None
    instrument_height_m: Height | None = None
    floor: str | None = None
    added: YesNo = False
    removed: YesNo = False
    locked: YesNo | None = None

    def __post_init__(self) -> None:
        if self.position_m is not None:
            check_point("position", self.position_m)
        if self.instrument_height_m is not None:
            check_height(self.instrument_height_m)
        if self.added and (self.position_m is None or self.removed):
            raise ReviewError("added station: got one without a position, expected one; give x, y, z in metres")


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class ForbiddenPlace:
    """A position that stations keep away from."""

    id: NewId
    position_m: Point
    radius_m: Radius = 0.5
    floor: AnyFloor = ""

    def __post_init__(self) -> None:
        if self.id:
            check_id(self.id)
        check_point("position", self.position_m)
        if not 0 < self.radius_m <= 1000:
            raise ReviewError(f"radius: got {self.radius_m} m, expected above 0 and at most 1000; give metres")


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class Zone:
    """A drawn area: `keep_out`, or `priority` with the coverage required of it, a fraction of what is achievable."""

    id: NewId
    kind: ZoneKind
    outline_m: Outline
    floor: AnyFloor = ""
    name: Annotated[str, Field(max_length=MOST_NAME_CHARACTERS)] = ""
    coverage: Share | None = None

    def __post_init__(self) -> None:
        if self.id:
            check_id(self.id)
        if self.kind not in ZONE_KINDS:
            raise ReviewError(f"zone: kind is {self.kind!r}, expected one of {', '.join(ZONE_KINDS)}")
        if not 3 <= len(self.outline_m) <= MOST_CORNERS:
            raise ReviewError(f"zone: got {len(self.outline_m)} corners, expected 3 to {MOST_CORNERS}; draw it again")
        for corner in self.outline_m:
            check_point("corner of the outline", (*corner, 0.0))
        check_line("name of the zone", self.name, empty=True)
        if (self.coverage is None) == (self.kind == "priority"):
            raise ReviewError("zone: coverage goes with kind priority and with no other; give it there, e.g. 0.98")
        if self.coverage is not None and not 0 < self.coverage <= 1:
            raise ReviewError(f"coverage: got {self.coverage}, expected above 0 and at most 1; e.g. 0.98")


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class Entrance:
    """Where the crew enters: a point on the ground of a floor."""

    id: NewId
    position_m: Point
    floor: FloorId

    def __post_init__(self) -> None:
        if self.id:
            check_id(self.id)
        check_point("position", self.position_m)


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class Comment:
    """A remark, pinned to a station, an element, a position or nothing."""

    id: Id
    text: Text
    author: Line
    time: Time
    target: Target = None
    position_m: Point | None = None
    resolved: YesNo = False
    assignee: Assignee = ""
    due: Due = ""
    photo: Photo = ""

    def __post_init__(self) -> None:
        check_id(self.id)
        check_text("comment", self.text, MOST_TEXT_BYTES)
        check_line("author", self.author)
        check_time(self.time)
        check_line("assignee", self.assignee, empty=True)
        check_day("due", self.due)
        if self.photo and not _SHA256.fullmatch(self.photo):
            raise ReviewError(f"photo: got {self.photo[:40]!r}, expected 64 hexadecimal digits, or none; send it first")
        if self.position_m is not None:
            check_point("position", self.position_m)


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class Verdict:
    """What a reviewer thinks of a station."""

    verdict: VerdictWord
    by: Line
    time: Time
    note: Note = ""

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ReviewError(f"verdict: got {self.verdict!r}, expected one of {', '.join(VERDICTS)}")
        check_line("name", self.by)
        check_time(self.time)
        check_text("note", self.note, MOST_NOTE_BYTES, empty=True)


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class StationProgress:
    """How far the crew came with a station: scanned, or skipped."""

    state: ProgressState
    by: Line
    time: Time

    def __post_init__(self) -> None:
        if self.state not in PROGRESS_STATES:
            raise ReviewError(f"progress: got {self.state!r}, expected one of {', '.join(PROGRESS_STATES)}")
        check_line("name", self.by)
        check_time(self.time)


@with_config(NO_OTHER_KEYS)
@dataclass(frozen=True)
class SignOff:
    """Who signed off the plan, as reviewed; a later revision of the review changed something since.

    The SHA-256 is that of plan.json.
    """

    name: Line
    time: Time
    plan_sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    revision: Whole
    note: Note = ""

    def __post_init__(self) -> None:
        check_line("name", self.name)
        check_time(self.time)
        check_text("note", self.note, MOST_NOTE_BYTES, empty=True)
        if not _SHA256.fullmatch(self.plan_sha256):
            raise ReviewError("sign-off: plan_sha256 is not a SHA-256, expected 64 hexadecimal digits of plan.json's")


@dataclass(frozen=True)
class LastChange:
    """When an object was last changed, and by whom."""

    revision: Annotated[Whole, Field(description="The revision that the change made.", examples=[7])]
    by: Annotated[str, Field(examples=["Ben"])]
    at: Annotated[str, Field(description="UTC.", examples=["2026-11-21T16:45:00Z"])]


@with_config(ConfigDict(defer_build=True))  # servers describe it in each of their routes
@dataclass(frozen=True)
class Review:
    """Everything that reviewers changed, by id."""

    revision: Annotated[int, Field(ge=0, description="How often something was changed; 0: never.")] = 0
    stations: Mapping[str, StationEdit] = field(default_factory=dict)
    forbidden: Mapping[str, ForbiddenPlace] = field(default_factory=dict)
    zones: Mapping[str, Zone] = field(default_factory=dict)
    ground_picks: Mapping[str, GroundPick] = field(default_factory=dict)
    entrances: Mapping[str, Entrance] = field(default_factory=dict)
    doors: Annotated[
        Mapping[str, DoorState],
        Field(description="Doors that are open or shut whatever the plan has, by the source's id of the element."),
    ] = field(default_factory=dict)
    comments: Mapping[str, Comment] = field(default_factory=dict)
    verdicts: Mapping[str, Verdict] = field(default_factory=dict)
    progress: Mapping[str, StationProgress] = field(default_factory=dict)
    sign_off: SignOff | None = None
    touched: Annotated[
        Mapping[str, LastChange],
        Field(
            description="Last change of every object, also of removed ones: `station:S001`, `zone:Z001`, "
            "`forbidden:P001`, `pick:G001`, `entrance:E001`, `door:GLOBALID`, `comment:C001`, `verdict:S001`, "
            "`progress:S001`, `sign_off`."
        ),
    ] = field(default_factory=dict)

    @property
    def n_objects(self) -> int:
        """How many things the review holds, of all kinds."""
        drawn = (self.forbidden, self.zones, self.ground_picks, self.entrances, self.doors)
        return sum(len(kind) for kind in (self.stations, *drawn, self.comments, self.verdicts, self.progress))

    @property
    def entrances_m(self) -> tuple[Point, ...]:
        """Where the entrances are, in the order in which they were set: the route begins at the first."""
        in_order = sorted(self.entrances.items(), key=lambda item: (len(item[0]), item[0]))
        return tuple(entrance.position_m for _, entrance in in_order)


@dataclass(frozen=True)
class ReviewedStation:
    """A station as it stands: the plan's, or as the review has it. position_m : sensor's origin, scene frame.

    instrument_height_m : None where the plan does not know it. locked : it must be in a plan that is made again.
    fixed : its scan exists, so nobody moves it.
    """

    id: str
    floor: str
    position_m: Point
    instrument_height_m: float | None
    fixed: bool = False
    locked: bool = False
    added: bool = False
    moved: bool = False


@dataclass(frozen=True)
class PlanUnderReview:
    """What of a plan a review refers to; scene frame.

    stations : as planned. floor_elevations_m : of every floor id. links : pairs of station ids, in the plan's order.
    offset_m : scene = local + offset.
    """

    sha256: str
    stations: tuple[ReviewedStation, ...]
    floor_elevations_m: Mapping[str, float]
    n_elements: int
    offset_m: Point = (0.0, 0.0, 0.0)
    links: tuple[tuple[str, str], ...] = ()

    def station(self, station_id: str) -> ReviewedStation | None:
        """The plan's station of this id; None where it has none."""
        return next((station for station in self.stations if station.id == station_id), None)


def check_door_state(state: str | None) -> None:
    """Refuse what no door can be; None, not given, can. Raises `ReviewError`."""
    if state is not None and state not in DOOR_STATES:
        raise ReviewError(f"door: state is {state[:40]!r}, expected one of {', '.join(DOOR_STATES)}")


def check_id(text: str) -> None:
    """Refuse what can't name an object of a review; raises `ReviewError`."""
    if not _ID.fullmatch(text):
        raise ReviewError(
            f"id: got {text[:40]!r}, expected a letter and up to 31 letters, digits or _; leave it out for a new one"
        )


def check_point(what: str, point_m: Point) -> None:
    """Refuse places off the Earth; raises `ReviewError`."""
    if len(point_m) != 3 or not all(math.isfinite(value) and abs(value) <= FARTHEST_M for value in point_m):
        raise ReviewError(f"{what}: got {point_m}, expected metres within {FARTHEST_M:.0f} of the origin; check it")


def check_height(height_m: float) -> None:
    """Refuse instrument heights that no tripod has; raises `ReviewError`."""
    if not 0 <= height_m <= 100:
        raise ReviewError(f"instrument height: got {height_m} m, expected 0 to 100; give metres above the ground")


def check_line(what: str, text: str, *, empty: bool = False) -> None:
    """Refuse names that are too long, empty unless they may be, or more than one line; raises `ReviewError`."""
    if not (empty or text.strip()):
        raise ReviewError(f"{what}: got none, expected one; give it")
    if len(text) > MOST_NAME_CHARACTERS:
        raise ReviewError(f"{what}: got {len(text)} characters, expected at most {MOST_NAME_CHARACTERS}; shorten it")
    if "\n" in text or "\t" in text:
        raise ReviewError(f"{what}: has a line break or tab, expected one line; take it out")
    _check_characters(what, text)


def check_text(what: str, text: str, most_bytes: int, *, empty: bool = False) -> None:
    """Refuse texts that are too long as UTF-8, or empty unless they may be; raises `ReviewError`."""
    _check_characters(what, text)
    if not (empty or text.strip()):
        raise ReviewError(f"{what}: got no text, expected some; write it")
    if (n_bytes := len(text.encode())) > most_bytes:
        raise ReviewError(f"{what}: got {n_bytes} bytes, expected at most {most_bytes}; shorten it")


def check_time(text: str) -> None:
    """Refuse other times than `2026-11-21T16:30:00Z`; raises `ReviewError`."""
    if not _TIME.fullmatch(text):
        raise ReviewError(f"time: got {text[:40]!r}, expected UTC as 2026-11-21T16:30:00Z")


def check_day(what: str, text: str) -> None:
    """Refuse what is no day such as `2026-12-01`, but for none; raises `ReviewError`."""
    try:
        is_day = not text or date.fromisoformat(text).isoformat() == text
    except ValueError:
        is_day = False
    if not is_day:
        raise ReviewError(f"{what}: got {text[:40]!r}, expected a day as 2026-12-01, or none; correct it")


def _check_characters(what: str, text: str) -> None:
    """Control characters, and those that turn the direction of writing, can make a text look like another one."""
    if _CONTROL.search(text):
        raise ReviewError(f"{what}: has a control character, expected text and line breaks; take it out")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ReviewError(f"{what}: is half a surrogate pair, expected Unicode text; type it again") from error
