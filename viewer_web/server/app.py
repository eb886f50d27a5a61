"""The ASGI application of the viewer: `/` is the built browser application, `/plan/` the plan folder, `/api/` the rest.

A request passes `RequestGuard` (who asks, and how) before a file is searched for (`files.find_file`) and sent, or a
route of the interface answers. Files are only read; what reviewers change goes through `/api/`.
"""

import re
from collections.abc import Iterable
from pathlib import Path

from fastapi import APIRouter, FastAPI
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.types import Receive, Scope, Send

from planner_core.errors import MissingPackageError, PlanFolderError
from planner_core.plan_folder.drawn_files import DrawnFiles
from viewer_web.server.answers import PREFIX, answer_errors, refusals
from viewer_web.server.files import find_file, send_file
from viewer_web.server.guard import RequestGuard
from viewer_web.server.review_api import review_router
from viewer_web.server.session import Session

BUILT_APP = Path(__file__).resolve().parent.parent / "dist"

# What of a plan folder the browser may read: the summary, what the viewer draws, and the report it links to. The same
# of the plans of runs, which lie below it.
PLAN_ENTRIES = frozenset({"plan.json", "stations.csv", "viewer", "report"})
_RUN = re.compile(r"runs/[A-Za-z0-9_-]{1,64}/plan/")

DESCRIPTION = """\
What the viewer asks the server that `tlsplan view` starts: the review of a plan, what changed stations are worth, runs.

Positions are in the scene frame, metres; angles in radians. Every other answer than the one described is JSON
with a `message` for people. Every request needs the token of this start of the server: the cookie that the printed
address sets, or the header `x-tlsplan-token`. See docs/viewer-api.md.
"""


def create_app(
    plan_folder: Path,
    *,
    token: str,
    comment_token: str = "",
    session: Session | None = None,
    routers: Iterable[APIRouter] = (),
    allowed_hosts: Iterable[str] = (),
    built_app: Path = BUILT_APP,
) -> Starlette:
    """Return the application that shows `plan_folder`.

    Parameters
    ----------
    plan_folder : Path
        A folder written by `write_plan_folder`. It is opened anew on every request, so a plan that is replaced
        while the viewer is open shows after a reload. Where only the drawing of such a folder is there yet, that is
        shown.
    token : str
        What requests must bring along, see `viewer_web.server.token`.
    comment_token : str
        The same of those who may comment and no more; empty: there are none.
    session : Session
        What the routes share; None: one that may change the review and has no live side.
    routers : iterable of APIRouter
        Further routes, with their whole paths below /api: the live side, runs.
    allowed_hosts : iterable of str
        Host names, without port, that a request may address besides the loopback names and the address at which it
        came in.
    built_app : Path
        The folder `npm run build` wrote.

    Raises
    ------
    PlanFolderError
        `plan_folder` holds no plan.json, and there is no drawing beside it.
    MissingPackageError
        The browser application was not built.
    """
    has_drawing = DrawnFiles.beside(plan_folder).document.is_file()  # which is corrected before it is planned
    if not (plan_folder / "plan.json").is_file() and not has_drawing:
        raise PlanFolderError(f"{plan_folder}: no plan.json in it, so not a plan folder. Make one with `tlsplan plan`.")
    if not (built_app / "index.html").is_file():
        raise MissingPackageError(f"{built_app}: the viewer is not built. Run `make viewer`, or install the wheel.")
    api = create_api(session or Session(plan_folder), routers)

    def send_plan(request: Request) -> Response:
        path = request.path_params["path"]
        within = path[found.end() :] if (found := _RUN.match(path)) else path
        return _send(request, plan_folder, path) if within.split("/", 1)[0] in PLAN_ENTRIES else _not_found()

    def send_app(request: Request) -> Response:
        return _send(request, built_app, request.path_params["path"] or "index.html")

    async def send_api(scope: Scope, receive: Receive, send: Send) -> None:
        await api({**scope, "root_path": ""}, receive, send)  # its routes bear their whole paths

    return Starlette(
        routes=[Mount(PREFIX, send_api), Route("/plan/{path:path}", send_plan), Route("/{path:path}", send_app)],
        middleware=[Middleware(RequestGuard, token=token, comment_token=comment_token, allowed_hosts=allowed_hosts)],
    )


def create_api(session: Session, routers: Iterable[APIRouter] = ()) -> FastAPI:
    """Return the routes below /api, and the document that describes them, unguarded."""
    app = FastAPI(
        title="tlsplan viewer",
        version="1",
        description=DESCRIPTION,
        openapi_url=f"{PREFIX}/openapi.json",
        docs_url=None,  # its scripts would come from another site
        redoc_url=None,
        separate_input_output_schemas=False,
    )
    answer_errors(app)
    for router in (review_router(session), *routers):
        app.include_router(router, responses=refusals())
    return app


def _send(request: Request, root: Path, relative: str) -> Response:
    file = find_file(root, relative)
    return _not_found() if file is None else send_file(file, request)


def _not_found() -> Response:
    return PlainTextResponse("not found\n", status_code=404)
