"""What the routes of the interface have in common: how they answer, and how they say no."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException as StarletteHTTPException

from planner_core.errors import PlanFolderError, PlannerError, RequirementError, ReviewError
from viewer_web.server.files import etag_matches, packed

PREFIX = "/api"
LEAST_PACKED_BYTES = 1024


class Answer(BaseModel):
    """What a route answers. Its schema is made where somebody asks for it: no route checks its answers."""

    model_config = ConfigDict(defer_build=True)


class Refusal(Answer):
    """Why something was not done, in words for people."""

    message: str


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Describe error answers for OpenAPI; some can come from every route."""
    descriptions = {
        400: "The body is no JSON.",
        401: "The token is missing: open the address that `tlsplan view` printed.",
        403: "Another site asks, the server was started with --read-only, or the token is for comments only.",
        404: "Nothing has this name.",
        409: "Someone else changed this first, or a run is going on.",
        413: "The body is larger than 1 MiB (a drawing: 16 MiB), or there is one where none is expected.",
        414: "The path is too long.",
        415: "The content type of the body is not JSON (a photo: JPEG).",
        421: "This host name is not served.",
        422: "The request makes no sense; the message names what was expected.",
        500: "A fault of the server; its terminal has details.",
        503: "The plan folder, or something in it, can't be read or written; or too many ask at once.",
    }
    everywhere = {401, 403, 414, 421, 500}
    return {
        status: {"model": Refusal, "description": descriptions[status]} for status in sorted({*everywhere, *statuses})
    }


UNCHANGED: dict[int | str, dict[str, Any]] = {304: {"description": "Not changed: the browser has it already."}}
"""For OpenAPI: what `json_answer` may say besides."""


def refuse(status: int, message: str) -> JSONResponse:
    """Say no, in words."""
    return JSONResponse({"message": message}, status_code=status)


def json_answer(document: Mapping[str, Any], request: Request) -> Response:
    """Answer with a document: 304 where the browser has the same one, compressed where that is worth it."""
    body = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    tag = f'"{hashlib.sha256(body).hexdigest()[:32]}"'
    headers = {"etag": tag, "cache-control": "no-cache", "vary": "accept-encoding"}
    if etag_matches(request, tag):
        return Response(status_code=304, headers=headers)
    if len(body) >= LEAST_PACKED_BYTES and "gzip" in request.headers.get("accept-encoding", ""):
        body = packed(body)
        headers["content-encoding"] = "gzip"
    return Response(body, headers=headers, media_type="application/json")


def answer_errors(app: FastAPI) -> None:
    """Answer every error of the interface in words, as `Refusal`."""

    async def of_library(request: Request, error: Exception) -> Response:
        status = 422 if isinstance(error, ReviewError | RequirementError) else 503
        return refuse(status, str(error))

    async def of_nobody(request: Request, error: Exception) -> Response:
        return refuse(
            500, f"the server failed at this ({type(error).__name__}), its terminal has details; reload the page"
        )

    async def of_validation(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        return refuse(422, _first_problem(error))

    async def of_http(request: Request, error: Exception) -> Response:
        assert isinstance(error, StarletteHTTPException)
        return JSONResponse({"message": str(error.detail)}, status_code=error.status_code, headers=error.headers)

    app.add_exception_handler(PlannerError, of_library)
    app.add_exception_handler(PlanFolderError, of_library)
    app.add_exception_handler(Exception, of_nobody)
    app.add_exception_handler(RequestValidationError, of_validation)
    app.add_exception_handler(StarletteHTTPException, of_http)


def _first_problem(error: RequestValidationError) -> str:
    first = error.errors()[0]
    own = first.get("ctx", {}).get("error")
    if isinstance(own, PlannerError):  # raised by a check of the library: the whole message
        return str(own)
    place = ".".join(str(part) for part in first["loc"] if part not in ("body", "query", "path"))
    return f"{place or 'the request'}: {first['msg']}; see /api/openapi.json for what is expected"
