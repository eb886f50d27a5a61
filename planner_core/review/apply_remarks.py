"""Changes of comments, verdicts, progress and the signature: each returns the review after it, and what undoes it."""

from __future__ import annotations

import dataclasses

from planner_core.errors import ReviewError
from planner_core.model.review import Comment, Review, SignOff, StationProgress, Verdict
from planner_core.review.apply_stations import existing_station
from planner_core.review.changes import (
    AddComment,
    Applied,
    AssignComment,
    Change,
    ClearVerdict,
    Context,
    EditComment,
    RemoveComment,
    ResolveComment,
    SetProgress,
    SetVerdict,
    Sign,
    Unsign,
)
from planner_core.review.rules import free_id, present, rounded_m, with_new, without


def add_comment(review: Review, change: AddComment, context: Context) -> Applied:
    """See `changes.AddComment`."""
    if isinstance(change.target, int) and not 0 <= change.target < context.plan.n_elements:
        raise ReviewError(
            f"comment: element {change.target} is not in the scene, expected 0 to {context.plan.n_elements - 1}; reload"
        )
    if isinstance(change.target, str) and not change.id:
        existing_station(review, change.target, context)
    comment = Comment(
        id=change.id or free_id("C", "comment", review.comments, review),
        text=change.text.replace("\r\n", "\n"),
        author=change.author or context.by.name,
        time=change.time or context.by.time,
        target=change.target,
        position_m=None if change.position_m is None else rounded_m("position", change.position_m),
        resolved=change.resolved,
        assignee=change.assignee,
        due=change.due,
        photo=change.photo,
    )
    comments = with_new("comment", review.comments, comment.id, comment)
    return Applied(dataclasses.replace(review, comments=comments), RemoveComment(comment.id), f"comment:{comment.id}")


def assign_comment(review: Review, change: AssignComment, context: Context) -> Applied:
    """See `changes.AssignComment`."""
    before = present("comment", review.comments, change.id)
    comment = dataclasses.replace(before, assignee=change.assignee, due=change.due)
    comments = {**review.comments, change.id: comment}
    back = AssignComment(change.id, before.assignee, before.due)
    return Applied(dataclasses.replace(review, comments=comments), back, f"comment:{change.id}")


def edit_comment(review: Review, change: EditComment, context: Context) -> Applied:
    """See `changes.EditComment`."""
    before = _own_comment(review, change.id, context)
    comment = dataclasses.replace(before, text=change.text.replace("\r\n", "\n"))
    comments = {**review.comments, change.id: comment}
    back = EditComment(change.id, before.text)
    return Applied(dataclasses.replace(review, comments=comments), back, f"comment:{change.id}")


def resolve_comment(review: Review, change: ResolveComment, context: Context) -> Applied:
    """See `changes.ResolveComment`."""
    before = present("comment", review.comments, change.id)
    comments = {**review.comments, change.id: dataclasses.replace(before, resolved=change.resolved)}
    back = ResolveComment(change.id, before.resolved)
    return Applied(dataclasses.replace(review, comments=comments), back, f"comment:{change.id}")


def remove_comment(review: Review, change: RemoveComment, context: Context) -> Applied:
    """See `changes.RemoveComment`."""
    comment = _own_comment(review, change.id, context)
    back = AddComment(**{field.name: getattr(comment, field.name) for field in dataclasses.fields(comment)})
    comments = without(review.comments, change.id)
    return Applied(dataclasses.replace(review, comments=comments), back, f"comment:{change.id}")


def _own_comment(review: Review, name: str, context: Context) -> Comment:
    comment = present("comment", review.comments, name)
    if comment.author != context.by.name:
        raise ReviewError(
            f"comment {name}: is {comment.author}'s, only they can change or remove it; resolve it, or add your own"
        )
    return comment


def set_verdict(review: Review, change: SetVerdict, context: Context) -> Applied:
    """See `changes.SetVerdict`."""
    if change.by is None:  # else it puts an earlier one back, also of a station that is gone
        existing_station(review, change.station, context)
    before = review.verdicts.get(change.station)
    verdict = Verdict(
        verdict=change.verdict,
        by=change.by or context.by.name,
        time=change.time or context.by.time,
        note=change.note.replace("\r\n", "\n"),
    )
    back: Change = ClearVerdict(change.station) if before is None else _verdict_again(change.station, before)
    verdicts = {**review.verdicts, change.station: verdict}
    return Applied(dataclasses.replace(review, verdicts=verdicts), back, f"verdict:{change.station}")


def clear_verdict(review: Review, change: ClearVerdict, context: Context) -> Applied:
    """See `changes.ClearVerdict`."""
    before = review.verdicts.get(change.station)
    if before is None:
        raise ReviewError(f"station {change.station[:40]}: has no verdict to clear; reload the review")
    verdicts = without(review.verdicts, change.station)
    back = _verdict_again(change.station, before)
    return Applied(dataclasses.replace(review, verdicts=verdicts), back, f"verdict:{change.station}")


def _verdict_again(station: str, verdict: Verdict) -> SetVerdict:
    return SetVerdict(station, verdict.verdict, verdict.note, verdict.by, verdict.time)


def set_progress(review: Review, change: SetProgress, context: Context) -> Applied:
    """See `changes.SetProgress`."""
    before = review.progress.get(change.station)
    progress = without(review.progress, change.station)
    if change.state is not None:
        if change.by is None:  # else it puts an earlier one back, also of a station that is gone
            existing_station(review, change.station, context)
        by, time = change.by or context.by.name, change.time or context.by.time
        progress[change.station] = StationProgress(change.state, by, time)
    elif before is None:
        raise ReviewError(f"station {change.station[:40]}: is neither done nor skipped; reload the review")
    back = SetProgress(change.station, None)
    if before is not None:
        back = SetProgress(change.station, before.state, before.by, before.time)
    return Applied(dataclasses.replace(review, progress=progress), back, f"progress:{change.station}")


def sign(review: Review, change: Sign, context: Context) -> Applied:
    """See `changes.Sign`."""
    if review.sign_off is not None:
        raise ReviewError(f"sign-off: {review.sign_off.name} signed already, expected none; withdraw that first")
    signed = change.earlier or SignOff(
        name=context.by.name,
        time=context.by.time,
        plan_sha256=context.plan.sha256,
        revision=context.revision,
        note=change.note.replace("\r\n", "\n"),
    )
    return Applied(dataclasses.replace(review, sign_off=signed), Unsign(), "sign_off")


def unsign(review: Review, change: Unsign, context: Context) -> Applied:
    """See `changes.Unsign`."""
    if review.sign_off is None:
        raise ReviewError("sign-off: got none to withdraw; reload the review")
    back = Sign(review.sign_off.note, review.sign_off)
    return Applied(dataclasses.replace(review, sign_off=None), back, "sign_off")
