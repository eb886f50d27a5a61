"""Lifting: the storeys of drawings -> a building of upright elements, as an author of IFC would model it.

            +---------------+  ceiling: the next storey's floor, or the roof
            | wall | lintel |
            |      +--------+  head of the door
            |      | door   |
     -------+------+--------+  elevation_m
       slab

Heights that no drawing shows come from `Heights`. What the drawing does not show for certain is marked doubtful.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from planner_core.drawings.floor_plan import FloorPlan
from planner_core.drawings.openings import Opening, OpeningKind
from planner_core.drawings.stairs import Flight, flights_between, rectangle
from planner_core.errors import SceneError
from planner_core.model import FloatArray


class Doubtful(StrEnum):
    """What doubtful elements are taken for."""

    AS_OPEN = "as-open"
    AS_WALL = "as-wall"


USUAL_ROOM_M = 2.8
LEAST_SLAB_M = 0.05


@dataclass(frozen=True)
class Heights:
    """Heights that a drawing does not show, metres."""

    room_m: float | None = None
    """From floor to ceiling; None: up to the slab of the next storey, of the highest `USUAL_ROOM_M`."""
    door_m: float = 2.1
    sill_m: float = 0.9
    """Of windows, above the floor."""
    window_head_m: float = 2.1
    storey_m: float | None = None
    """From floor to floor; None: by the drawing's own levels, else `room_m` and `slab_m`."""
    slab_m: float = 0.2

    def __post_init__(self) -> None:
        for name in ("room_m", "door_m", "window_head_m", "slab_m"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and 0.05 <= value <= 100.0):
                raise SceneError(
                    f"{name.removesuffix('_m')} height: got {value:g} m, expected 0.05 to 100 m; correct it"
                )
        if not 0.0 <= self.sill_m < self.window_head_m:
            raise SceneError(
                f"sill height: got {self.sill_m:g} m, expected 0 to less than the windows' head at "
                f"{self.window_head_m:g} m; correct it"
            )
        highest = max(self.door_m, self.window_head_m)
        if self.highest_room_m < highest:
            raise SceneError(
                f"room height: got {self.highest_room_m:g} m, expected at least the head of doors and windows at "
                f"{highest:g} m; correct it, or lower these, such as --door-height 2"
            )
        if self.storey_m is not None and self.storey_m < self.highest_room_m:
            raise SceneError(
                f"storey height: got {self.storey_m:g} m, expected at least the room height, {self.highest_room_m:g} "
                "m; correct it, or pass --room-height"
            )

    @property
    def highest_room_m(self) -> float:
        """From floor to ceiling of the highest storey."""
        return USUAL_ROOM_M if self.room_m is None else self.room_m


@dataclass(frozen=True)
class Prism:
    """An upright solid. area : shapely Polygon in plan; from low_m to high_m above its storey."""

    area: Any
    low_m: float
    high_m: float
    is_glass: bool = False


@dataclass(frozen=True)
class BuildingElement:
    """One element of a storey: its solids, and what is cut out of them or fills that."""

    kind: str
    """IFC class."""
    name: str
    prisms: tuple[Prism, ...]
    predefined_type: str = ""
    opening: Prism | None = None
    """Cut out of the element; filled by the element of the name `filled_by`."""
    filled_by: str = ""
    is_external: bool | None = None
    is_doubtful: bool = False


@dataclass(frozen=True)
class BuildingRoom:
    """A room of a storey. area : shapely Polygon."""

    name: str
    long_name: str
    area: Any
    height_m: float


@dataclass(frozen=True)
class BuildingStorey:
    """One storey, lowest first in `Building.storeys`; heights of its elements are above `elevation_m`."""

    name: str
    elevation_m: float
    elements: tuple[BuildingElement, ...]
    rooms: tuple[BuildingRoom, ...]


@dataclass(frozen=True)
class Building:
    """What drawings are lifted to."""

    name: str
    storeys: tuple[BuildingStorey, ...]
    warnings: tuple[str, ...] = ()
    north_deg: float | None = None
    """Direction of north, clockwise from +y; None: not known."""


#: Class of what is shown in a BIM editor, and is none of the building.
_NO_SURFACE = "IfcVirtualElement"
#: A jamb and a head of a door's frame; a leaf; a pane of a window.
_FRAME_M, _LEAF_M, _PANE_M = 0.05, 0.04, 0.02
#: Frames are as deep as walls, up to this.
_DEEPEST_FRAME_M = 0.16
#: A leaf leaves so much free to its frame, so that they are bodies of their own.
_FREE_M = 0.003
#: Openings reach so far out of what they cut: boolean subtraction wants no faces in one plane.
_THROUGH_M = 0.02
#: Risers are about so high, and steps so thick.
_RISER_M, _STEP_M = 0.175, 0.3
#: Rooms are searched for at this distance from the middle of a door.
_BESIDE_M = (0.3, 0.6)


def lifted(
    name: str,
    plans: Sequence[FloorPlan],
    elevations_m: Sequence[float],
    heights: Sequence[Heights],
    doubtful: Doubtful = Doubtful.AS_OPEN,
    *,
    north_deg: float | None = None,
) -> Building:
    """Raise storeys, the lowest first, to a building.

    elevations_m, heights : of each storey. north_deg : clockwise from +y of the plan; None: not known.
    """
    warnings = [line for plan in plans for line in plan.warnings]
    storeys = []
    for number, (plan, elevation_m, own) in enumerate(zip(plans, elevations_m, heights, strict=True)):
        above = plans[number + 1] if number + 1 < len(plans) else None
        room_m = own.highest_room_m
        rise_m = elevations_m[number + 1] - elevation_m if above is not None else room_m + own.slab_m
        elements = _elements(plan, room_m, own, doubtful)
        flights = [] if above is None else flights_between(plan.treads, above.treads)
        if number == 0:
            elements.append(_slab("Floor", plan.outline, -own.slab_m, 0.0, "BASESLAB"))
        elements += _ceiling(plan, above, flights, room_m, rise_m)
        if above is not None:
            elements += [_stair(flight, row, rise_m) for row, flight in enumerate(flights, 1)]
        elements += _stairs_in_doubt(plan, above, flights, room_m, doubtful)
        if above is None and number == 0 and plan.treads:
            warnings.append(_one_storey(plan))
        rooms = tuple(BuildingRoom(room.name, room.long_name, room.outline, room_m) for room in plan.rooms)
        storeys.append(BuildingStorey(plan.name, elevation_m, tuple(elements), rooms))
    return Building(name, tuple(storeys), tuple(warnings), north_deg)


def levels_of(plans: Sequence[FloorPlan], heights: Heights) -> tuple[list[float], list[float]]:
    """Elevation of each storey, and of its ceiling, metres: by the drawing's own levels, else by `heights`.

    Raises
    ------
    SceneError
        Rooms higher than storeys.
    """
    step_m = heights.storey_m or heights.highest_room_m + heights.slab_m
    elevations = [0.0]
    for below, plan in pairwise(plans):
        own = None if plan.height_m is None or below.height_m is None else plan.height_m - below.height_m
        elevations.append(elevations[-1] + (own if heights.storey_m is None and own is not None else step_m))
    if plans[0].height_m is not None:
        elevations = [round(each + plans[0].height_m, 4) for each in elevations]
    if heights.room_m is None:
        return elevations, [*(each - heights.slab_m for each in elevations[1:]), elevations[-1] + USUAL_ROOM_M]
    for own_m, next_m in pairwise(elevations):
        if own_m + heights.room_m > next_m - LEAST_SLAB_M + 1e-6:
            raise SceneError(
                f"room height: got {heights.room_m:g} m with floors {next_m - own_m:g} m above each other, expected at "
                f"most {next_m - own_m - LEAST_SLAB_M:g} m; lower it, or pass --storey-height"
            )
    return elevations, [each + heights.room_m for each in elevations]


def _elements(plan: FloorPlan, ceiling_m: float, heights: Heights, doubtful: Doubtful) -> list[BuildingElement]:
    """Walls, doors and windows."""
    elements = [
        BuildingElement("IfcWall", f"Wall {row}", (Prism(piece.area, 0.0, ceiling_m),))
        for row, piece in enumerate(plan.walls, 1)
    ]
    counts: dict[OpeningKind, int] = {}
    for opening in plan.openings:
        counts[opening.kind] = counts.get(opening.kind, 0) + 1
        elements += _opening(opening, counts[opening.kind], plan, ceiling_m, heights, doubtful)
    return elements


def _ceiling(
    plan: FloorPlan, above: FloorPlan | None, flights: Sequence[Flight], ceiling_m: float, rise_m: float
) -> list[BuildingElement]:
    """The slab over a storey, which is the next one's floor at `rise_m`, with voids over flights."""
    if above is None:
        return [_slab("Roof", plan.outline, ceiling_m, rise_m, "ROOF")]
    voids = shapely.union_all([flight.area for flight in flights])
    area = shapely.difference(shapely.union_all([plan.outline, above.outline]), voids)
    return [_slab("Ceiling", area, ceiling_m, rise_m, "FLOOR")]


def _stair(flight: Flight, number: int, rise_m: float) -> BuildingElement:
    """A flight of even steps, the last of which is the floor above."""
    n_steps = max(2, round(rise_m / _RISER_M))
    going_m, riser_m = flight.run_m / (n_steps - 1), rise_m / n_steps
    steps = []
    for step in range(n_steps - 1):
        top_m = (step + 1) * riser_m
        area = rectangle(flight.foot + step * going_m * flight.along, flight.along, going_m, flight.width_m)
        steps.append(Prism(area, max(0.0, top_m - _STEP_M), top_m))
    return BuildingElement("IfcStairFlight", f"Stair {number}", tuple(steps))


def _stairs_in_doubt(
    plan: FloorPlan, above: FloorPlan | None, flights: Sequence[Flight], ceiling_m: float, doubtful: Doubtful
) -> list[BuildingElement]:
    """Treads of which nothing shows which way they rise: without surface, or solid up to the ceiling."""
    kind = "IfcStair" if doubtful == Doubtful.AS_WALL else _NO_SURFACE
    known = shapely.union_all([flight.area for flight in flights])
    return [
        BuildingElement(kind, f"Stair {row} (doubtful)", (Prism(treads.area, 0.0, ceiling_m),), is_doubtful=True)
        for row, treads in enumerate(plan.treads, len(flights) + 1)
        if not shapely.intersects(treads.area, known)
    ]


def _one_storey(plan: FloorPlan) -> str:
    noun = "flight" if len(plan.treads) == 1 else "flights"
    return (
        f"{len(plan.treads)} {noun} of stairs: a single storey does not show which way they rise, so they are left "
        "out; add the drawing of the other storey, or count them as solid with --doubtful as-wall."
    )


def _slab(name: str, area: Any, low_m: float, high_m: float, predefined_type: str) -> BuildingElement:
    parts = (part for part in shapely.get_parts(area) if part.geom_type == "Polygon")
    prisms = tuple(Prism(part, low_m, high_m) for part in parts)
    return BuildingElement("IfcSlab", name, prisms, predefined_type)


def _opening(
    opening: Opening, number: int, plan: FloorPlan, ceiling_m: float, heights: Heights, doubtful: Doubtful
) -> list[BuildingElement]:
    """The elements of an opening: the wall across it with a hole, and what fills the hole."""
    if opening.kind == OpeningKind.PASSAGE and not opening.is_doubtful:
        return []
    if opening.kind == OpeningKind.PASSAGE:
        kind = "IfcWall" if doubtful == Doubtful.AS_WALL else _NO_SURFACE
        whole = (Prism(opening.area, 0.0, ceiling_m),)
        return [BuildingElement(kind, f"Gap {number} (doubtful)", whole, is_doubtful=True)]
    is_door = opening.kind == OpeningKind.DOOR
    low_m, high_m = (0.0, heights.door_m) if is_door else (heights.sill_m, heights.window_head_m)
    high_m = min(high_m, ceiling_m)
    low_m = min(low_m, high_m - heights.slab_m)
    title = f"{'Door' if is_door else 'Window'} {number}" + (f" {opening.name}" if opening.name else "")
    prisms = _door(opening, high_m) if is_door else _window(opening, low_m, high_m)
    external = _is_external(opening, plan) if is_door else None
    filling = BuildingElement("IfcDoor" if is_door else "IfcWindow", title, prisms, is_external=external)
    if high_m >= ceiling_m and low_m <= 0.0:
        return [filling]
    hole = Prism(_stretched(opening.corners_m, _THROUGH_M), low_m - (_THROUGH_M if low_m <= 0.0 else 0.0), high_m)
    across = BuildingElement(
        "IfcWall", f"Wall at {title}", (Prism(opening.area, 0.0, ceiling_m),), opening=hole, filled_by=title
    )
    return [across, filling]


def _frame_of(opening: Opening) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middle of the first jamb, unit vectors along and across an opening."""
    corners = opening.corners_m
    along = (corners[1] - corners[0]) / opening.width_m
    return 0.5 * (corners[0] + corners[3]), along, np.array([-along[1], along[0]])


def _bar(opening: Opening, begin_m: float, end_m: float, depth_m: float) -> Any:
    """The rectangle along an opening from one place to another, about its middle line."""
    foot, along, across = _frame_of(opening)
    half = 0.5 * depth_m * across
    ends = foot + begin_m * along, foot + end_m * along
    return shapely.Polygon([ends[0] - half, ends[1] - half, ends[1] + half, ends[0] + half])


def _door(opening: Opening, high_m: float) -> tuple[Prism, ...]:
    """Two jambs, a head, and the leaf between them."""
    depth, width = min(opening.thickness_m, _DEEPEST_FRAME_M), opening.width_m
    top = high_m - _FRAME_M
    return (
        Prism(_bar(opening, 0.0, _FRAME_M, depth), 0.0, top),
        Prism(_bar(opening, width - _FRAME_M, width, depth), 0.0, top),
        Prism(_bar(opening, 0.0, width, depth), top, high_m),
        Prism(_bar(opening, _FRAME_M + _FREE_M, width - _FRAME_M - _FREE_M, _LEAF_M), 0.0, top - _FREE_M),
    )


def _window(opening: Opening, low_m: float, high_m: float) -> tuple[Prism, ...]:
    """A pane of glass that fills the hole."""
    return (Prism(_bar(opening, 0.0, opening.width_m, _PANE_M), low_m, high_m, is_glass=True),)


def _stretched(corners_m: FloatArray, by_m: float) -> Any:
    """The rectangle of an opening, longer on all sides."""
    return shapely.buffer(shapely.Polygon(corners_m), by_m, join_style="mitre")


def _is_external(opening: Opening, plan: FloorPlan) -> bool | None:
    """Whether a door leads outdoors: a room lies on one of its sides alone. None: on neither."""
    foot, along, across = _frame_of(opening)
    middle = foot + 0.5 * opening.width_m * along
    half = 0.5 * opening.thickness_m
    sides = [
        any(
            shapely.contains_xy(room.outline, *(middle + sign * (half + away) * across))
            for room in plan.rooms
            for away in _BESIDE_M
        )
        for sign in (-1.0, 1.0)
    ]
    return None if not any(sides) else sides[0] != sides[1]
