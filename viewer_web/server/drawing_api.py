"""The routes of drawings, /api/drawing: what was recognised in the drawings of a plan, and its corrections."""

from typing import Annotated, Any

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, Field

from planner_core.drawings.drawn_building import MOST_STOREYS, DrawnBuilding, floor_plan_of
from planner_core.plan_folder.drawn_files import DrawnFiles, read_drawn_file, read_lines, save_correction
from viewer_web.server.answers import PREFIX, UNCHANGED, Answer, json_answer, refusals, refuse
from viewer_web.server.files import send_file
from viewer_web.server.roles import is_commenter
from viewer_web.server.session import Session

_BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_READ_ONLY = "this plan is shown read-only; start `tlsplan view` without --read-only to correct its drawing"


class DrawnRoom(Answer):
    """A room, as walls and openings enclose it."""

    name: str
    long_name: str
    outline: Annotated[list[tuple[float, float]], Field(description="Corners x, y, plan coordinates, metres.")]


class DrawingDocument(Answer):
    """The drawing of the plan."""

    drawing: Annotated[DrawnBuilding | None, Field(description="Null: the plan was made from a model.")]
    rooms: Annotated[list[list[DrawnRoom]], Field(description="Of each storey.")]
    may_correct: Annotated[bool, Field(description="Whether this page may save corrections.")]
    file: Annotated[str, Field(description="Name of the drawing file, which `tlsplan plan` plans.")]
    has_plan: Annotated[bool, Field(description="Whether there is a plan of it already.")]


class DrawnLinesDocument(Answer):
    """All that is drawn of a storey."""

    lines: Annotated[
        list[list[int]],
        Field(
            description="Of each line x, y of its corners in turn, millimetres: the first, then steps; as recognised."
        ),
    ]
    picture: Annotated[
        tuple[float, float, float, float] | None,
        Field(description="x0, y0, x1, y1 of the storey's picture, metres, as recognised; null: there is none."),
    ]


class Correction(BaseModel):
    """The whole drawing as corrected."""

    base_revision: Annotated[int, Field(strict=True, ge=0, description="The revision that it was made from.")]
    drawing: DrawnBuilding


def create_drawing_router(session: Session) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix=f"{PREFIX}/drawing", tags=["drawing"])

    def standing(request: Request) -> dict[str, bool | str]:
        return {
            "may_correct": not session.read_only and not is_commenter(request.scope),
            "file": DrawnFiles.beside(session.plan_folder).document.name,
            "has_plan": (session.plan_folder / "plan.json").is_file(),
        }

    @router.get(
        "", response_model=DrawingDocument, responses={**refusals(422), **UNCHANGED}, summary="The drawing of the plan"
    )
    def get_drawing(request: Request) -> Response:
        """What was recognised in the drawings of the plan and corrected since; rooms follow from it."""
        path = DrawnFiles.beside(session.plan_folder).document
        if not path.is_file():
            return json_answer({"drawing": None, "rooms": [], **standing(request)}, request)
        return json_answer({**_drawn(read_drawn_file(path)), **standing(request)}, request)

    @router.get(
        "/lines/{storey}",
        response_model=DrawnLinesDocument,
        responses={**refusals(422), **UNCHANGED},
        summary="Lines of a storey",
    )
    def get_lines(storey: int, request: Request) -> Response:
        """All that is drawn of a storey, counted from 0; empty where it was not kept."""
        return json_answer(read_lines(DrawnFiles.beside(session.plan_folder).lines, storey), request)

    @router.get(
        "/picture/{storey}",
        response_class=Response,
        responses={
            200: {"content": {"image/png": _BINARY}, "description": "The picture."},
            **refusals(404, 422),
            **UNCHANGED,
        },
        summary="Picture of a storey",
    )
    def get_picture(storey: int, request: Request) -> Response:
        """The picture that a storey was recognised in, counted from 0, upright and without perspective."""
        path = DrawnFiles.beside(session.plan_folder).picture(storey)
        if not 0 <= storey < MOST_STOREYS or not path.is_file():
            return refuse(404, f"storey {storey} was not recognised in a picture")
        return send_file(path, request)

    @router.post(
        "", response_model=DrawingDocument, responses=refusals(400, 409, 413, 415, 422, 503), summary="Save corrections"
    )
    def post_drawing(sent: Correction, request: Request) -> Response:
        """Save a drawing as corrected, as a whole; it is on disk when this is answered.

        409 where another page saved one after `base_revision`: nothing is changed then.
        """
        if session.read_only:
            return refuse(403, _READ_ONLY)
        if not DrawnFiles.beside(session.plan_folder).document.is_file():
            return refuse(404, "this plan was made from a model, which has no drawing to correct")
        saved = save_correction(session.plan_folder, sent.base_revision, sent.drawing)
        if saved is None:
            return refuse(
                409,
                "another page saved corrections meanwhile, so these were not saved; load the newer ones, or keep yours",
            )
        return JSONResponse({**_drawn(saved), **standing(request)})

    return router


def _drawn(drawn: DrawnBuilding) -> dict[str, Any]:
    rooms = [
        [
            {"name": room.name, "long_name": room.long_name, "outline": _outline(room.outline)}
            for room in floor_plan_of(storey).rooms
        ]
        for storey in drawn.storeys
    ]
    return {"drawing": drawn.model_dump(mode="json", by_alias=True), "rooms": rooms}


def _outline(area: Any) -> list[tuple[float, float]]:
    return [(round(x, 3), round(y, 3)) for x, y in area.exterior.coords[:-1]]
