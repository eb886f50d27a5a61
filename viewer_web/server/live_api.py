"""The routes below /api/live: figures, previews, maps and clouds of the draft that the review makes of the plan.

Binary answers are framed: 4 bytes little endian with the length of a JSON head, the head, padded with spaces so that
what follows begins at a multiple of 4 bytes, then the arrays, little endian.
"""

from __future__ import annotations

import hashlib
import math
import struct
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel

from planner_core.errors import PlannerError
from planner_core.model.review import PlanUnderReview, Review
from planner_core.planning.live.draft import Draft, draft_of_review, local_place
from planner_core.planning.live.figures import TIMES_SEEN
from planner_core.planning.live.live_plan import LivePlan
from planner_core.review.stations import reviewed_stations
from viewer_web.server.answers import PREFIX, json_answer, refusals, refuse
from viewer_web.server.files import etag_matches
from viewer_web.server.live_documents import (
    CloudHead,
    FiguresOfDraft,
    GroundHead,
    PreviewHead,
    PreviewQuestion,
    RouteOfDraft,
    cloud_head,
    draft_route_document,
    figures_document,
    ground_head,
    preview_head,
)
from viewer_web.server.live_worker import LiveSide, NotReadyError

#: Pages whose latest question is known.
_MOST_PAGES = 64

_TURN_RAD = 2 * math.pi
_BYTES = "application/octet-stream"
_BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_REFUSED = refusals(422, 503)
_READ: dict[int | str, dict[str, Any]] = {
    304: {"description": "The browser has it already."},
    **refusals(404, 422, 503),
}


class _NotThereError(PlannerError):
    """A name in the path is none of the draft's."""


def create_live_router(
    side: LiveSide, get_review: Callable[[], Review], get_plan: Callable[[], PlanUnderReview]
) -> APIRouter:
    """Return the routes; without `side.start` they answer that live editing is not available.

    Parameters
    ----------
    get_review, get_plan
        Called for every request, from worker threads: the review as it is, and the plan that it is of.
    """
    router = APIRouter(prefix=f"{PREFIX}/live", tags=["live"])
    drafts = _DraftAnswers(side, get_review, get_plan)
    _add_figures(router, drafts)
    _add_files(router, drafts)
    return router


def _add_figures(router: APIRouter, drafts: _DraftAnswers) -> None:
    """Add what is worked out of the draft, or of one station put elsewhere."""
    latest = _Latest()

    @router.get("/figures", response_model=FiguresOfDraft, responses=_REFUSED, summary="Figures of the draft")
    def figures(request: Request) -> Response:
        """Coverage, requirements, stations, registration and what is left unseen, of the plan as reviewed."""
        return drafts.document(request, lambda live, draft, n: figures_document(live, live.figures(draft), n))

    @router.get("/route", response_model=RouteOfDraft, responses=_REFUSED, summary="Route through the draft")
    def get_route(request: Request) -> Response:
        """Route from station to station, and field time; takes a second or more."""
        return drafts.document(
            request, lambda live, draft, n: draft_route_document(live.figures(draft), live.walk(draft), n)
        )

    @router.post(
        "/preview",
        response_class=Response,
        responses={
            200: _framed(PreviewHead),
            204: {"description": "A newer question of the page came."},
            **refusals(400, 413, 415, 422, 503),
        },
        summary="Preview of a station elsewhere",
    )
    def preview(question: PreviewQuestion) -> Response:
        """Figures of the draft with one station moved, raised or added, without changing it; arrays: `PreviewHead`."""
        latest.note(question)

        def answer(live: LivePlan, draft: Draft, revision: int) -> Response:
            if latest.is_overtaken(question):
                return Response(status_code=204)
            return _preview(live, draft, question, revision)

        return drafts.answer(answer)


def _add_files(router: APIRouter, drafts: _DraftAnswers) -> None:
    """Add what the plan folder holds as files, for the draft."""

    @router.get(
        "/ground/{floor}",
        response_class=Response,
        responses={200: _framed(GroundHead), **_READ},
        summary="Valid tripod positions on a floor",
    )
    def ground(request: Request, floor: str) -> Response:
        """A map of cells; see `GroundHead`. Made when it is first requested."""

        def answer(live: LivePlan, draft: Draft) -> bytes:
            if floor not in [each.id for each in live.survey.floors]:
                raise _NotThereError(f"floor: got {floor!r}, expected {', '.join(f.id for f in live.survey.floors)}")
            found = live.ground(draft, floor)
            return framed(ground_head(live, found), found.values.tobytes())

        return drafts.cached(request, f"ground {floor}", answer, of=lambda draft: (draft.keep_out, draft.forbidden))

    @router.get(
        "/layers/{layer}",
        response_class=Response,
        responses={200: {"content": {_BYTES: _BINARY}}, **_READ},
        summary="A layer of the draft",
    )
    def layer(request: Request, layer: str) -> Response:
        """`times_seen`: a uint8 a patch, as viewer/patches.u8; others: a uint16, as viewer/layers."""

        def answer(live: LivePlan, draft: Draft) -> bytes:
            if layer == TIMES_SEEN:
                return live.times_seen(draft).tobytes()
            if layer not in live.layers:
                raise _NotThereError(f"layer: got {layer!r}, expected {', '.join((TIMES_SEEN, *live.layers))}")
            return live.layer(draft, layer).astype("<u2").tobytes()

        return drafts.cached(request, f"layer {layer}", answer, of=lambda draft: draft.stations)

    @router.get(
        "/stations/{station:path}/seen",
        response_class=Response,
        responses={200: {"content": {_BYTES: _BINARY}}, **_READ},
        summary="Surface seen by a station",
    )
    def seen(request: Request, station: str) -> Response:
        """As viewer/seen: a bit a patch, the lowest of a byte first; with limits, another row within them."""
        return drafts.cached(
            request,
            f"seen {station}",
            lambda live, draft: live.seen(draft, station),
            of=lambda draft: _in(draft, station).station(station).position_m,
        )

    @router.get(
        "/stations/{station:path}/lost",
        response_class=Response,
        responses={200: {"content": {_BYTES: _BINARY}}, **_READ},
        summary="Loss without a station",
    )
    def lost(request: Request, station: str) -> Response:
        """As viewer/lost: how many patches each requirement would lose, then which."""
        return drafts.cached(
            request,
            f"lost {station}",
            lambda live, draft: live.lost(draft, station),
            of=lambda draft: _in(draft, station).stations,
        )

    @router.get(
        "/stations/{station:path}/cloud",
        response_class=Response,
        responses={200: {"content": {_BYTES: _BINARY}}, **_READ},
        summary="Point cloud of a station",
    )
    def cloud(request: Request, station: str) -> Response:
        """As viewer/clouds: ranges, then intensities, deflated."""
        return drafts.cached(
            request,
            f"cloud {station}",
            lambda live, draft: live.cloud(draft, station),
            of=lambda draft: _in(draft, station).station(station).position_m,
        )

    @router.get(
        "/stations/{station:path}/cloud-window",
        response_class=Response,
        responses={200: _framed(CloudHead), **_READ},
        summary="Part of a station's point cloud, in more detail",
    )
    def cloud_window(
        request: Request,
        station: str,
        azimuth: Annotated[float, Query(ge=-_TURN_RAD, le=_TURN_RAD, description="Where it begins, radians.")],
        width: Annotated[float, Query(gt=0, le=_TURN_RAD, description="Counterclockwise from there, radians.")],
        low: Annotated[float, Query(ge=-_TURN_RAD / 4, le=_TURN_RAD / 4, description="Lowest elevation, radians.")],
        high: Annotated[float, Query(ge=-_TURN_RAD / 4, le=_TURN_RAD / 4, description="Highest, radians.")],
    ) -> Response:
        """All beams that the scanner sends into a window, thinned evenly to a million at most; see `CloudHead`."""

        def answer(live: LivePlan, draft: Draft) -> bytes:
            window = live.cloud_window(draft, station, azimuth, width, (low, high))
            return framed(cloud_head(window), window.content)

        return drafts.cached(
            request,
            f"window {station} {azimuth} {width} {low} {high}",
            answer,
            of=lambda draft: _in(draft, station).station(station).position_m,
        )


def framed(head: BaseModel, arrays: bytes) -> bytes:
    """Put a head before arrays, see the head of this module."""
    text = head.model_dump_json().encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + arrays


class _DraftAnswers:
    """Turns requests into questions about the draft of now. Errors are answered in words by the application."""

    def __init__(
        self, side: LiveSide, get_review: Callable[[], Review], get_plan: Callable[[], PlanUnderReview]
    ) -> None:
        self._side, self._get_review, self._get_plan = side, get_review, get_plan

    def answer(self, question: Callable[[LivePlan, Draft, int], Response]) -> Response:
        """Answer by what `question` returns for the draft and its revision."""

        def ask(live: LivePlan) -> Response:
            # Read when it is our turn: what was committed meanwhile counts.
            review, plan = self._get_review(), self._get_plan()
            if plan.sha256 != live.plan_sha256:
                raise NotReadyError("the plan was replaced since live editing began; restart `tlsplan view`")
            stations = reviewed_stations(plan, review)
            draft = draft_of_review(review, stations, live.survey.floors, live.survey.scene.offset_m)
            return question(live, draft, review.revision)

        try:
            return self._side.ask(ask)
        except _NotThereError as error:
            return refuse(404, str(error))

    def document(self, request: Request, question: Callable[[LivePlan, Draft, int], BaseModel]) -> Response:
        """Answer by a document."""
        return self.answer(
            lambda live, draft, revision: json_answer(question(live, draft, revision).model_dump(), request)
        )

    def cached(
        self,
        request: Request,
        name: str,
        question: Callable[[LivePlan, Draft], bytes],
        *,
        of: Callable[[Draft], object],
    ) -> Response:
        """Answer by bytes; 304 where the browser has them already. `of` is all of the draft that they depend on."""

        def answer(live: LivePlan, draft: Draft, revision: int) -> Response:
            del revision
            tag = f'"{hashlib.sha256(repr((live.plan_sha256, name, of(draft))).encode()).hexdigest()[:32]}"'
            headers = {"etag": tag, "cache-control": "no-cache"}
            if etag_matches(request, tag):
                return Response(status_code=304, headers=headers)
            return Response(question(live, draft), media_type=_BYTES, headers=headers)

        return self.answer(answer)


class _Latest:
    """The newest question of each page."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sequences: OrderedDict[str, int] = OrderedDict()

    def note(self, question: PreviewQuestion) -> None:
        """Remember a question that came."""
        with self._lock:
            self._sequences[question.client] = max(self._sequences.get(question.client, 0), question.sequence)
            self._sequences.move_to_end(question.client)
            if len(self._sequences) > _MOST_PAGES:
                self._sequences.popitem(last=False)

    def is_overtaken(self, question: PreviewQuestion) -> bool:
        """Whether the page has a newer request."""
        with self._lock:
            return bool(question.client) and self._sequences.get(question.client, 0) > question.sequence


def _preview(live: LivePlan, draft: Draft, question: PreviewQuestion, revision: int) -> Response:
    x, y, z = local_place([*question.position, 0.0][:3], live.survey.scene.offset_m)
    found = live.preview(
        draft,
        question.station,
        question.floor,
        (x, y, z) if len(question.position) == 3 else (x, y),
        question.instrument_height_m,
        layer=question.layer,
    )
    head = preview_head(live, found, sequence=question.sequence, revision=revision)
    arrays = (found.patch.astype("<u4"), found.values.astype("<u2"), found.times_seen)
    return Response(framed(head, b"".join(array.tobytes() for array in arrays)), media_type=_BYTES)


def _in(draft: Draft, station: str) -> Draft:
    """Return the draft, if it has a station of that id."""
    if station not in draft.ids:
        raise _NotThereError(f"station: got {station!r}, expected one of {', '.join(draft.ids) or 'none'}")
    return draft


def _framed(head: type[BaseModel]) -> dict[str, Any]:
    return {
        "model": head,
        "description": "Bytes: a head, here described as JSON, and arrays; see the description.",
        "content": {_BYTES: _BINARY},
    }
