"""Changes of stations: each returns the review with the change made, and the change that takes it back."""

from __future__ import annotations

import dataclasses

from planner_core.errors import ReviewError
from planner_core.model.review import PlanUnderReview, Review, ReviewedStation, StationEdit, check_id
from planner_core.plan_folder.usd_names import prim_names_of_ids
from planner_core.review.changes import (
    AS_NOW,
    AddStation,
    Applied,
    Change,
    Context,
    LockStation,
    MoveStation,
    RemoveStation,
    RestoreStation,
    SetHeight,
    UnlockStation,
)
from planner_core.review.rules import checked_floor, free_id, rounded_height_m, rounded_m, without
from planner_core.review.stations import reviewed_station


def move_station(review: Review, change: MoveStation, context: Context) -> Applied:
    """See `changes.MoveStation`."""
    station = _editable(review, change.station, context)
    if station.locked:
        raise ReviewError(f"station {change.station}: is locked, so it stays where it is; unlock it first")
    edit = review.stations.get(change.station, StationEdit())
    back = MoveStation(change.station, edit.position_m, edit.instrument_height_m, edit.floor)
    if change.position_m is None:
        if edit.added:
            raise ReviewError(f"station {change.station}: was added, so the plan has no position for it; give one")
        moved = dataclasses.replace(edit, position_m=None, instrument_height_m=None, floor=None)
    else:
        height_m = station.instrument_height_m if change.instrument_height_m == AS_NOW else change.instrument_height_m
        moved = dataclasses.replace(
            edit,
            position_m=rounded_m("position", change.position_m),
            instrument_height_m=rounded_height_m(height_m),
            floor=station.floor if change.floor is None else checked_floor(change.floor, context),
        )
    return _with_station(review, change.station, moved, back)


def set_height(review: Review, change: SetHeight, context: Context) -> Applied:
    """See `changes.SetHeight`."""
    station = _editable(review, change.station, context)
    if station.instrument_height_m is None:
        raise ReviewError(
            f"station {change.station}: its height above the ground is not known, so it can't be raised by a height; "
            "move it to a position instead"
        )
    height_m = rounded_height_m(change.instrument_height_m)
    x, y, z = station.position_m
    raised = MoveStation(change.station, (x, y, z + (height_m or 0.0) - station.instrument_height_m), height_m)
    return move_station(review, raised, context)


def add_station(review: Review, change: AddStation, context: Context) -> Applied:
    """See `changes.AddStation`."""
    name = change.station
    if name is None:
        name = next_station_id(review, context.plan)
    check_id(name)
    # Names of prims and files too: they follow from the ids, and case does not count in them everywhere.
    planned = [station.id for station in context.plan.stations]
    taken = {key.lower() for key in (*planned, *prim_names_of_ids(planned), *review.stations)}
    if name.lower() in taken:
        raise ReviewError(f"station {name}: there is one already; leave the id out for a free one")
    edit = StationEdit(
        position_m=rounded_m("position", change.position_m),
        instrument_height_m=rounded_height_m(change.instrument_height_m),
        floor=checked_floor(change.floor, context),
        added=True,
        locked=change.locked,
    )
    return _with_station(review, name, edit, RemoveStation(name))


def remove_station(review: Review, change: RemoveStation, context: Context) -> Applied:
    """See `changes.RemoveStation`."""
    station = _editable(review, change.station, context)
    edit = review.stations.get(change.station, StationEdit())
    if not edit.added:
        gone = dataclasses.replace(edit, removed=True)
        return _with_station(review, change.station, gone, RestoreStation(change.station))
    back = AddStation(station.position_m, station.floor, edit.instrument_height_m, change.station, edit.locked)
    stations = without(review.stations, change.station)
    return Applied(dataclasses.replace(review, stations=stations), back, f"station:{change.station}")


def restore_station(review: Review, change: RestoreStation, context: Context) -> Applied:
    """See `changes.RestoreStation`."""
    edit = review.stations.get(change.station)
    if edit is None or not edit.removed:
        raise ReviewError(f"station {change.station}: was not taken out, so it can't be restored; reload the review")
    restored = dataclasses.replace(edit, removed=False)
    return _with_station(review, change.station, restored, RemoveStation(change.station))


def lock_station(review: Review, change: LockStation, context: Context) -> Applied:
    """See `changes.LockStation`."""
    existing_station(review, change.station, context)
    edit = review.stations.get(change.station, StationEdit())
    back = LockStation(change.station, edit.locked)
    return _with_station(review, change.station, dataclasses.replace(edit, locked=change.locked), back)


def unlock_station(review: Review, change: UnlockStation, context: Context) -> Applied:
    """See `changes.UnlockStation`."""
    return lock_station(review, LockStation(change.station, locked=False), context)


def _with_station(review: Review, name: str, edit: StationEdit, back: Change) -> Applied:
    """Keep an edit that changes nothing out of the review: it is then as it was before anybody touched it."""
    stations = without(review.stations, name)
    if edit != StationEdit():
        stations[name] = edit
    return Applied(dataclasses.replace(review, stations=stations), back, f"station:{name}")


def existing_station(review: Review, name: str, context: Context) -> ReviewedStation:
    """Return a station as it stands; raises `ReviewError` where there is none, or it was taken out."""
    planned = context.plan.station(name)
    edit = review.stations.get(name)
    if planned is None and (edit is None or not edit.added):
        raise ReviewError(f"station {name[:40]}: is neither in the plan nor added, expected one that is; reload")
    if edit is not None and edit.removed:
        raise ReviewError(f"station {name}: was taken out of the plan; restore it first")
    return reviewed_station(name, planned, edit)


def _editable(review: Review, name: str, context: Context) -> ReviewedStation:
    station = existing_station(review, name, context)
    if station.fixed:
        raise ReviewError(f"station {name}: is scanned already, so it stays where it is; add another one instead")
    return station


def next_station_id(review: Review, plan: PlanUnderReview) -> str:
    """Return the id after the last `S...` that is in use, or was: a comment or verdict may still speak of it."""
    spoken_of = (comment.target for comment in review.comments.values() if isinstance(comment.target, str))
    kept = (*(station.id for station in plan.stations), *review.stations, *review.verdicts, *spoken_of)
    return free_id("S", "station", kept, review)
