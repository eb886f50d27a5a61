"""Changes of several people, one after another: Review, changes, the revision they were made on -> Review or Conflict.

Objects have revisions of their own: two people who change different stations do not get in each other's way, and who
changes one that somebody else changed meanwhile learns who did and when.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from planner_core.errors import ReviewError
from planner_core.model.review import LastChange, PlanUnderReview, Review, check_line
from planner_core.review.apply import apply
from planner_core.review.changes import Change, Context, Sign, Signature, objects_of

MOST_CHANGES = 1_000
MOST_GONE = 2_000
"""Removed objects whose last change is remembered: they only say who removed what somebody still shows."""


@dataclass(frozen=True)
class Committed:
    """The review with all changes made. undo : changes that take them back, in the order to make them."""

    review: Review
    undo: tuple[Change, ...]
    objects: tuple[str, ...]


@dataclass(frozen=True)
class EditConflict:
    """An object that someone else changed meanwhile."""

    object: Annotated[str, Field(description="As in `touched` of a review.", examples=["station:S003"])]
    by: Annotated[str, Field(description="Who changed it last.", examples=["Ben"])]
    at: Annotated[str, Field(description="When, UTC.", examples=["2026-11-21T16:45:00Z"])]


@dataclass(frozen=True)
class Conflict:
    """Nothing was changed: somebody else was first. review : as it stands."""

    message: str
    clashes: tuple[EditConflict, ...]
    review: Review


def commit(
    review: Review, base_revision: int, changes: Sequence[Change], plan: PlanUnderReview, by: Signature
) -> Committed | Conflict:
    """Make all changes, or none.

    Parameters
    ----------
    base_revision
        The revision that whoever makes the changes was looking at.

    Raises
    ------
    ReviewError
        A change can't be made, see `planner_core.review.apply.apply`; its number is named where there are several.
    """
    check_line("author", by.name)
    if not 1 <= len(changes) <= MOST_CHANGES:
        raise ReviewError(f"changes: got {len(changes)}, expected 1 to {MOST_CHANGES}; send them in parts")
    if base_revision > review.revision:
        return Conflict(
            f"this page shows revision {base_revision} of the review, but there are only {review.revision}: the plan "
            "was replaced, or the review put back; reload",
            (),
            review,
        )
    if clashes := _clashes(review, base_revision, changes):
        return Conflict(_text(clashes), clashes, review)
    context = Context(plan, by, review.revision + 1)
    after, undo, objects = review, list[Change](), dict[str, None]()
    for number, change in enumerate(changes, start=1):
        try:
            applied = apply(after, change, context)
        except ReviewError as error:
            raise ReviewError(f"change {number}: {error}" if len(changes) > 1 else str(error)) from error
        after = applied.review
        undo.append(applied.inverse)
        objects[applied.touched] = None
    touched = {**review.touched, **dict.fromkeys(objects, LastChange(context.revision, by.name, by.time))}
    done = dataclasses.replace(after, revision=context.revision, touched=_remembered(after, touched))
    return Committed(done, tuple(reversed(undo)), tuple(objects))


def _clashes(review: Review, base_revision: int, changes: Sequence[Change]) -> tuple[EditConflict, ...]:
    names = {name: None for change in changes for name in objects_of(change)}
    if any(isinstance(change, Sign) for change in changes):
        names.update(dict.fromkeys(review.touched))  # whoever signs answers for everything
    newer = ((name, review.touched[name]) for name in names if name in review.touched)
    return tuple(EditConflict(name, touch.by, touch.at) for name, touch in newer if touch.revision > base_revision)


def _text(clashes: tuple[EditConflict, ...]) -> str:
    first = clashes[0]
    more = f" and {len(clashes) - 1} more were" if len(clashes) > 1 else " was"
    return (
        f"{described(first.object)}{more} changed in the meantime, last by {first.by} at {first.at[11:19]} UTC; "
        "your change was not applied: check the current state, then repeat or drop it"
    )


def described(name: str) -> str:
    """Return an object's name in words: `station S001`."""
    kind, _, rest = name.partition(":")
    words = {
        "forbidden": "forbidden position",
        "pick": "ground pick",
        "sign_off": "the sign-off",
        "verdict": "the verdict on station",
        "progress": "the progress of station",
    }
    return f"{words.get(kind, kind)} {rest}".strip()


def _remembered(review: Review, touched: dict[str, LastChange]) -> dict[str, LastChange]:
    """Forget the oldest of objects that are gone: a review of years would else carry all of them."""
    there = {
        *(f"forbidden:{name}" for name in review.forbidden),
        *(f"zone:{name}" for name in review.zones),
        *(f"pick:{name}" for name in review.ground_picks),
        *(f"entrance:{name}" for name in review.entrances),
        *(f"door:{name}" for name in review.doors),
        *(f"comment:{name}" for name in review.comments),
    }
    kinds = ("forbidden:", "zone:", "pick:", "entrance:", "door:", "comment:")
    gone = [name for name in touched if name.startswith(kinds)]
    gone = sorted((name for name in gone if name not in there), key=lambda name: touched[name].revision)
    forgotten = set(gone[:-MOST_GONE])
    return {name: touch for name, touch in touched.items() if name not in forgotten}
