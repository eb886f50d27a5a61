"""The routes of the review: what the server knows, what reviewers changed, changes, and events."""

from dataclasses import asdict
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse, Response, StreamingResponse
from pydantic import BaseModel, ConfigDict, Field
from starlette.types import Receive, Scope, Send

from planner_core.model.review import MOST_NAME_CHARACTERS, Line, Review, Whole, check_line
from planner_core.model.site import NO_OTHER_KEYS
from planner_core.review.changes import Change
from planner_core.review.commit import MOST_CHANGES, Conflict, EditConflict
from planner_core.review.photos import photo_file
from viewer_web.server.answers import PREFIX, UNCHANGED, Answer, json_answer, refusals, refuse
from viewer_web.server.connections import client_of, note_stream
from viewer_web.server.events import EventHub, Stream
from viewer_web.server.files import send_file
from viewer_web.server.roles import MAY_ONLY_COMMENT, is_commenter, may_commenter_make
from viewer_web.server.session import Session

SCHEMA = "tlsplan/api/1"
_Name = Annotated[str, Query(max_length=MOST_NAME_CHARACTERS, description="Who has the page open; empty: not named.")]
_JPEG: dict[str, Any] = {"image/jpeg": {"schema": {"type": "string", "format": "binary"}}}
_READ_ONLY = "this plan is shown read-only; start `tlsplan view` without --read-only to change it"


class LiveDocument(Answer):
    """How far the live side is: it answers what moved stations are worth, once the scene is loaded."""

    state: Literal["starting", "ready", "failed", "off"]
    step: Annotated[str | None, Field(description="What it does while it starts.")]
    fraction: Annotated[float | None, Field(description="Of the start, 0 to 1, as far as it is known.")]
    message: Annotated[str | None, Field(description="Why it failed or is off, and what helps.")]


class SessionDocument(Answer):
    """What a page needs to know first."""

    schema_: Annotated[Literal["tlsplan/api/1"], Field(alias="schema")]
    plan_sha256: Annotated[str, Field(description="Of plan.json: another one is another plan.")]
    revision: int
    read_only: bool
    comment_only: Annotated[bool, Field(description="The token of this page is for comments and verdicts only.")]
    live: LiveDocument


class Changes(BaseModel):
    """Changes to make together: all of them, or none."""

    model_config = ConfigDict(
        **NO_OTHER_KEYS,
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
    changes: Annotated[list[Change], Field(min_length=1, max_length=MOST_CHANGES)]
    plan_sha256: Annotated[
        str | None, Field(max_length=64, description="Of the plan that they were decided on; null: whichever it is.")
    ] = None


class CommittedDocument(Answer):
    """What was kept. undo : changes that take it back, in the order to send them."""

    revision: Whole
    undo: list[Change]
    review: Review


class ConflictDocument(Answer):
    """Nothing was changed, because someone else changed it first; `review` is as it stands."""

    message: str
    conflicts: list[EditConflict]
    review: Review


class PhotoDocument(Answer):
    """A photo that was kept."""

    sha256: Annotated[str, Field(description="What a comment names it by.")]


class _EventResponse(StreamingResponse):
    """The events of a page, whose room is given back however it ends, even before the first one is sent."""

    def __init__(self, hub: EventHub, stream: Stream) -> None:
        headers = {"cache-control": "no-store", "x-accel-buffering": "no"}
        super().__init__(hub.events(stream), media_type="text/event-stream", headers=headers)
        self._hub, self._stream = hub, stream

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the events."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._hub.leave(self._stream)


def review_router(session: Session) -> APIRouter:
    """Return the routes under /api that need no live side."""
    router = APIRouter(prefix=PREFIX, tags=["review"])

    @router.get(
        "/session",
        response_model=SessionDocument,
        responses={**refusals(503), **UNCHANGED},
        summary="Shown plan",
    )
    def get_session(request: Request) -> Response:
        """Which plan, which revision of its review, whether it may be changed, and how far the live side is."""
        return json_answer(
            {
                "schema": SCHEMA,
                "plan_sha256": session.plan().sha256,
                "revision": session.review().revision,
                "read_only": session.read_only,
                "comment_only": is_commenter(request.scope),
                "live": dict(session.live_state()),
            },
            request,
        )

    @router.get("/review", response_model=Review, responses={**refusals(503), **UNCHANGED}, summary="The review")
    def get_review(request: Request) -> Response:
        """Everything that reviewers changed, as it is on disk. The ETag is of its content."""
        return json_answer(asdict(session.review()), request)

    @router.post(
        "/review/changes",
        response_model=CommittedDocument,
        responses={
            **refusals(400, 413, 415, 422, 503),
            409: {"model": ConflictDocument, "description": "Somebody changed the same objects meanwhile."},
        },
        summary="Change the review",
    )
    def post_changes(sent: Changes, request: Request) -> Response:
        """Make changes, all or none. They are on disk when this is answered; `undo` takes them back.

        With the token of commenters those of comments and verdicts only: others are refused with 403.

        Objects have revisions of their own: a change of one that somebody changed after `base_revision` is refused
        with 409, with who and when.
        """
        if session.read_only:
            return refuse(403, _READ_ONLY)
        if is_commenter(request.scope) and not all(may_commenter_make(change) for change in sent.changes):
            return refuse(403, MAY_ONLY_COMMENT)
        outcome = session.store.commit(sent.base_revision, sent.changes, sent.author, plan_sha256=sent.plan_sha256)
        if isinstance(outcome, Conflict):
            conflicts = [asdict(clash) for clash in outcome.clashes]
            document: dict[str, Any] = {"message": outcome.message, "conflicts": conflicts}
            return JSONResponse({**document, "review": asdict(outcome.review)}, status_code=409)
        session.tell_review(outcome.review, sent.author, outcome.objects)
        return JSONResponse(
            {
                "revision": outcome.review.revision,
                "undo": [asdict(change) for change in outcome.undo],
                "review": asdict(outcome.review),
            }
        )

    @router.post(
        "/review/photos",
        response_model=PhotoDocument,
        responses=refusals(400, 413, 415, 422, 503),
        summary="Keep a photo",
        openapi_extra={"requestBody": {"required": True, "content": _JPEG}},
    )
    async def post_photo(request: Request) -> Response:
        """Keep a photo, which a comment may then name: JPEG, at most 1 MiB and 1600 pixels each way."""
        if session.read_only:
            return refuse(403, _READ_ONLY)
        content = await request.body()
        return JSONResponse({"sha256": await run_in_threadpool(session.store.keep_photo, content)})

    @router.get(
        "/review/photos/{sha256}",
        response_class=Response,
        responses={200: {"content": _JPEG, "description": "The photo."}, **refusals(404, 422), **UNCHANGED},
        summary="A photo",
    )
    def get_photo(sha256: Annotated[str, Path(pattern="^[0-9a-f]{64}$")], request: Request) -> Response:
        """A photo of a comment."""
        file = photo_file(session.plan_folder, sha256)
        if file is None:
            return refuse(404, f"photo {sha256[:8]}... is not there; reload the review")
        return send_file(file, request)

    @router.get(
        "/events",
        response_class=StreamingResponse,
        responses={
            200: {"content": {"text/event-stream": {"schema": {"type": "string"}}}, "description": "Events, for ever."},
            **refusals(422, 503),
        },
        summary="Events",
    )
    async def get_events(request: Request, name: _Name = "") -> Response:
        """Server-sent events, while the connection is open.

        `review` {revision, author, objects}: somebody changed the review. `live` {state, step, fraction, message}: how
        far the live side is. `run` {a document of /api/runs/...}: what became of a run. `run_deleted` {id}: somebody
        deleted a run. `people` {names}: who has a page open, as their pages name them, whenever that changes.
        """
        check_line("name", name, empty=True)
        client = client_of(request.client.host) if request.client else ""
        stream = session.events.open(client, name.strip())
        if stream is None:
            return refuse(503, "too many pages are open already; close some of them and reload")
        note_stream(request.scope)
        return _EventResponse(session.events, stream)

    return router
