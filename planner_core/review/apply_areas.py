"""Changes of places, zones, ground picks, entrances, doors: each returns the changed review and what takes it back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from planner_core.errors import ReviewError
from planner_core.model.review import (
    ForbiddenPlace,
    Review,
    ReviewedStation,
    Zone,
    check_door_state,
    check_line,
)
from planner_core.model.site import GroundPick
from planner_core.positions.outlines import area_of_outline_m2, crossing_sides
from planner_core.review.changes import (
    AddEntrance,
    AddZone,
    Allow,
    Applied,
    ChangeZone,
    Context,
    Forbid,
    PickGround,
    RemoveEntrance,
    RemoveZone,
    SetDoor,
    UnpickGround,
)
from planner_core.review.rules import DIGITS, checked_floor, free_id, present, rounded_m, with_new, without
from planner_core.review.stations import reviewed_stations

LEAST_ZONE_AREA_M2 = 1e-4
"""Less is a slip: a square centimetre, as of outlines in requirements files."""


def forbid(review: Review, change: Forbid, context: Context) -> Applied:
    """See `changes.Forbid`."""
    place = dataclasses.replace(
        change.place,
        id=change.place.id or free_id("P", "forbidden", review.forbidden, review),
        position_m=rounded_m("position", change.place.position_m),
        radius_m=round(change.place.radius_m, DIGITS),
        floor=checked_floor(change.place.floor, context, empty=True),
    )
    if not change.place.id:  # one with an id was there before, and comes back
        _check_no_lock(place, reviewed_stations(context.plan, review))
    forbidden = with_new("forbidden position", review.forbidden, place.id, place)
    return Applied(dataclasses.replace(review, forbidden=forbidden), Allow(place.id), f"forbidden:{place.id}")


def _check_no_lock(place: ForbiddenPlace, stations: Iterable[ReviewedStation]) -> None:
    for station in stations:
        away_m = math.dist(station.position_m[:2], place.position_m[:2])
        if station.locked and place.floor in ("", station.floor) and away_m < place.radius_m:
            raise ReviewError(
                f"forbidden position: station {station.id} is locked {away_m:.2f} m away, within its radius of "
                f"{place.radius_m:g} m; unlock or remove the station first, or make the radius smaller"
            )


def allow(review: Review, change: Allow, context: Context) -> Applied:
    """See `changes.Allow`."""
    place = present("forbidden position", review.forbidden, change.id)
    forbidden = without(review.forbidden, change.id)
    return Applied(dataclasses.replace(review, forbidden=forbidden), Forbid(place), f"forbidden:{change.id}")


def add_zone(review: Review, change: AddZone, context: Context) -> Applied:
    """See `changes.AddZone`."""
    zone = _checked_zone(change.zone, context)
    zone = dataclasses.replace(zone, id=zone.id or free_id("Z", "zone", review.zones, review))
    zones = with_new("zone", review.zones, zone.id, zone)
    return Applied(dataclasses.replace(review, zones=zones), RemoveZone(zone.id), f"zone:{zone.id}")


def change_zone(review: Review, change: ChangeZone, context: Context) -> Applied:
    """See `changes.ChangeZone`."""
    before = present("zone", review.zones, change.zone.id)
    zone = _checked_zone(change.zone, context)
    zones = {**review.zones, zone.id: zone}
    return Applied(dataclasses.replace(review, zones=zones), ChangeZone(before), f"zone:{zone.id}")


def remove_zone(review: Review, change: RemoveZone, context: Context) -> Applied:
    """See `changes.RemoveZone`."""
    zone = present("zone", review.zones, change.id)
    zones = without(review.zones, change.id)
    return Applied(dataclasses.replace(review, zones=zones), AddZone(zone), f"zone:{change.id}")


def _checked_zone(zone: Zone, context: Context) -> Zone:
    outline_m = tuple((round(x, DIGITS), round(y, DIGITS)) for x, y in zone.outline_m)
    corners_m = np.array(outline_m, dtype=np.float64)
    if len(set(outline_m)) < len(outline_m):
        raise ReviewError(
            "outline: has a corner twice, expected each once, the last joined to the first; draw it again"
        )
    if (crossing := crossing_sides(corners_m)) is not None:
        raise ReviewError(f"outline: sides {crossing[0]} and {crossing[1]} cross, expected none to; draw it again")
    # About its first corner: products of national coordinates would leave no digits for the area.
    if area_of_outline_m2(corners_m - corners_m[0]) < LEAST_ZONE_AREA_M2:
        raise ReviewError("outline: encloses nothing, expected at least a square centimetre; draw it again")
    return dataclasses.replace(zone, outline_m=outline_m, floor=checked_floor(zone.floor, context, empty=True))


def pick_ground(review: Review, change: PickGround, context: Context) -> Applied:
    """See `changes.PickGround`."""
    name = change.id or free_id("G", "pick", review.ground_picks, review)
    pick = GroundPick(
        point_m=rounded_m("point", change.pick.point_m),
        is_ground=change.pick.is_ground,
        floor=checked_floor(change.pick.floor, context, empty=True),
    )
    picks = with_new("ground pick", review.ground_picks, name, pick)
    return Applied(dataclasses.replace(review, ground_picks=picks), UnpickGround(name), f"pick:{name}")


def unpick_ground(review: Review, change: UnpickGround, context: Context) -> Applied:
    """See `changes.UnpickGround`."""
    pick = present("ground pick", review.ground_picks, change.id)
    picks = without(review.ground_picks, change.id)
    return Applied(dataclasses.replace(review, ground_picks=picks), PickGround(pick, change.id), f"pick:{change.id}")


def add_entrance(review: Review, change: AddEntrance, context: Context) -> Applied:
    """See `changes.AddEntrance`."""
    entrance = dataclasses.replace(
        change.entrance,
        id=change.entrance.id or free_id("E", "entrance", review.entrances, review),
        position_m=rounded_m("position", change.entrance.position_m),
        floor=checked_floor(change.entrance.floor, context),
    )
    entrances = with_new("entrance", review.entrances, entrance.id, entrance)
    after = dataclasses.replace(review, entrances=entrances)
    return Applied(after, RemoveEntrance(entrance.id), f"entrance:{entrance.id}")


def remove_entrance(review: Review, change: RemoveEntrance, context: Context) -> Applied:
    """See `changes.RemoveEntrance`."""
    entrance = present("entrance", review.entrances, change.id)
    entrances = without(review.entrances, change.id)
    return Applied(dataclasses.replace(review, entrances=entrances), AddEntrance(entrance), f"entrance:{change.id}")


def set_door(review: Review, change: SetDoor, context: Context) -> Applied:
    """See `changes.SetDoor`."""
    check_line("door", change.door)
    check_door_state(change.state)
    before = review.doors.get(change.door)
    doors = without(review.doors, change.door)
    if change.state is not None:
        doors[change.door] = change.state
    return Applied(dataclasses.replace(review, doors=doors), SetDoor(change.door, before), f"door:{change.door}")
