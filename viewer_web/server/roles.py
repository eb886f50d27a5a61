"""What the holder of a token may do: everything, or comment on the plan, judge stations and mark them done, no more."""

from starlette.types import Scope

from planner_core.review.changes import (
    AddComment,
    AssignComment,
    Change,
    ClearVerdict,
    EditComment,
    RemoveComment,
    ResolveComment,
    SetProgress,
    SetVerdict,
)

MAY_ONLY_COMMENT = (
    "this address is for comments and verdicts only; to edit stations, plan again or sign off, ask whoever started "
    "`tlsplan view` for the other address"
)
_OF_COMMENTERS = (
    AddComment, AssignComment, EditComment, ResolveComment, RemoveComment, SetVerdict, ClearVerdict, SetProgress,
)  # fmt: skip
_COMMENTER = "is_commenter"


def note_commenter(scope: Scope) -> None:
    """Remember of a request that its token is that of commenters."""
    scope.setdefault("state", {})[_COMMENTER] = True


def is_commenter(scope: Scope) -> bool:
    """Whether the token of a request is that of commenters."""
    return _COMMENTER in scope.get("state", {})


def may_commenter_make(change: Change) -> bool:
    """Whether commenters may make this change of a review: those of comments, verdicts and progress."""
    return isinstance(change, _OF_COMMENTERS)
