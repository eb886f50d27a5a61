"""One change of a review: Review, Change -> Review, and the change that takes it back.

Knows nothing of revisions, files or other reviewers: `planner_core.review.store` does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from planner_core.errors import ReviewError
from planner_core.model.review import MOST_OBJECTS, Review
from planner_core.review import apply_areas, apply_remarks, apply_stations, changes
from planner_core.review.changes import Applied, Change, Context


def apply(review: Review, change: Change, context: Context) -> Applied:
    """Return `review` with one change made; its revision and `touched` stay.

    Applying the inverse next gives the same review again.

    Raises
    ------
    ReviewError
        The change names what is not there, or what is there already; or what it brings breaks a rule.
    """
    apply_one: Callable[[Review, Any, Context], Applied] = _APPLY[type(change)]
    applied = apply_one(review, change, context)
    if applied.review.n_objects > max(MOST_OBJECTS, review.n_objects):
        raise ReviewError(f"review: it would hold more than {MOST_OBJECTS} objects; remove some first")
    return applied


_APPLY: dict[type[Any], Callable[[Review, Any, Context], Applied]] = {
    changes.MoveStation: apply_stations.move_station,
    changes.SetHeight: apply_stations.set_height,
    changes.AddStation: apply_stations.add_station,
    changes.RemoveStation: apply_stations.remove_station,
    changes.RestoreStation: apply_stations.restore_station,
    changes.LockStation: apply_stations.lock_station,
    changes.UnlockStation: apply_stations.unlock_station,
    changes.Forbid: apply_areas.forbid,
    changes.Allow: apply_areas.allow,
    changes.AddZone: apply_areas.add_zone,
    changes.ChangeZone: apply_areas.change_zone,
    changes.RemoveZone: apply_areas.remove_zone,
    changes.PickGround: apply_areas.pick_ground,
    changes.UnpickGround: apply_areas.unpick_ground,
    changes.AddEntrance: apply_areas.add_entrance,
    changes.RemoveEntrance: apply_areas.remove_entrance,
    changes.SetDoor: apply_areas.set_door,
    changes.AddComment: apply_remarks.add_comment,
    changes.AssignComment: apply_remarks.assign_comment,
    changes.EditComment: apply_remarks.edit_comment,
    changes.ResolveComment: apply_remarks.resolve_comment,
    changes.RemoveComment: apply_remarks.remove_comment,
    changes.SetVerdict: apply_remarks.set_verdict,
    changes.ClearVerdict: apply_remarks.clear_verdict,
    changes.SetProgress: apply_remarks.set_progress,
    changes.Sign: apply_remarks.sign,
    changes.Unsign: apply_remarks.unsign,
}

KINDS = {change.kind: change for change in _APPLY}
"""Every kind of change by its name."""
