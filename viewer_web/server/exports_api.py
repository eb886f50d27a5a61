"""The routes of exports, /api/exports: what can be had of the plan as reviewed, and the files."""

import asyncio
import shutil
import threading
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, Response
from pydantic import Field
from starlette.background import BackgroundTask

from planner_core.errors import PlannerError
from viewer_web.server.answers import PREFIX, UNCHANGED, Answer, json_answer, refusals, refuse
from viewer_web.server.exports import ExportBusyError, Exports, ExportUnknownError

#: In this header of a file, remarks on it: percent-encoded UTF-8, a line each.
REMARKS = "x-tlsplan-remarks"
_BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}
_LOOK_S = 0.5


class OfferedExport(Answer):
    """A format that the plan can be had in."""

    name: Annotated[str, Field(description="As `tlsplan export --format` takes it.")]
    title: str
    file_name: str
    obstacle: Annotated[str | None, Field(description="Why it can't be made now; null: nothing is known of.")]


class ExportList(Answer):
    """What can be had of the plan, stations as reviewed."""

    exports: list[OfferedExport]
    edited_stations: Annotated[int, Field(description="Stations that were moved, added or taken out.")]


def create_exports_router(exports: Exports) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix=f"{PREFIX}/exports", tags=["exports"])

    @router.get("", response_model=ExportList, responses={**refusals(503), **UNCHANGED}, summary="What can be exported")
    def get_exports(request: Request) -> Response:
        """Formats, and why one can't be had."""
        offered = exports.offered()
        rows = [
            {
                "name": each.format.name,
                "title": each.format.title,
                "file_name": each.format.file_name,
                "obstacle": each.obstacle,
            }
            for each in offered
        ]
        return json_answer(
            {"exports": rows, "edited_stations": max((each.edited for each in offered), default=0)}, request
        )

    @router.get(
        "/{name}",
        response_class=Response,
        responses={
            200: {"content": {"application/octet-stream": _BINARY}, "description": "The file."},
            **refusals(404, 422, 503),
        },
        summary="An export",
    )
    async def get_export(name: str, request: Request) -> Response:
        """Make one and send it; seconds, or minutes where stations were edited. One at a time: 503 meanwhile.

        The header `x-tlsplan-remarks` has what is to be known of it, percent-encoded, a line each.
        """
        gone = threading.Event()
        making = asyncio.ensure_future(run_in_threadpool(exports.make, name, is_wanted=lambda: not gone.is_set()))
        while not making.done():
            await asyncio.wait({making}, timeout=_LOOK_S)
            if await request.is_disconnected():
                gone.set()
        try:
            made = making.result()
        except ExportUnknownError as error:
            return refuse(404, str(error))
        except ExportBusyError as error:
            return refuse(503, str(error))
        except PlannerError as error:
            return refuse(422, str(error))
        return FileResponse(
            made.path,
            filename=made.path.name,
            media_type="application/octet-stream",
            headers={"cache-control": "no-store", REMARKS: quote("\n".join(made.remarks))},
            background=BackgroundTask(shutil.rmtree, made.path.parent, ignore_errors=True),
        )

    return router
