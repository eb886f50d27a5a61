"""The ASGI application of the viewer: `/` is the built browser application, `/plan/` the plan folder, both read-only.

A request passes `RequestGuard` (who asks, and how) before a file is looked for (`files.find_file`) and sent.
"""

from collections.abc import Iterable
from pathlib import Path

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from planner_core.errors import MissingPackageError, PlanFolderError
from viewer_web.server.files import find_file, send_file
from viewer_web.server.guard import RequestGuard

BUILT_APP = Path(__file__).resolve().parent.parent / "dist"

# What of a plan folder the browser may read: the summary, what the viewer draws, and the report it links to.
PLAN_ENTRIES = frozenset({"plan.json", "stations.csv", "viewer", "report"})


def create_app(plan_folder: Path, *, allowed_hosts: Iterable[str] = (), built_app: Path = BUILT_APP) -> Starlette:
    """Return the application that shows `plan_folder`.

    Parameters
    ----------
    plan_folder : Path
        A folder written by `write_plan_folder`. It is looked up anew on every request, so a plan that is replaced
        while the viewer is open shows after a reload.
    allowed_hosts : iterable of str
        Host names, without port, that a request may address besides the loopback names and the address at which it
        came in.
    built_app : Path
        The folder `npm run build` wrote.

    Raises
    ------
    PlanFolderError
        `plan_folder` holds no plan.json.
    MissingPackageError
        The browser application was not built.
    """
    if not (plan_folder / "plan.json").is_file():
        raise PlanFolderError(f"{plan_folder}: no plan.json in it, so not a plan folder. Make one with `tlsplan plan`.")
    if not (built_app / "index.html").is_file():
        raise MissingPackageError(f"{built_app}: the viewer is not built. Run `make viewer`, or install the wheel.")

    async def send_plan(request: Request) -> Response:
        path = request.path_params["path"]
        return _send(request, plan_folder, path) if path.split("/", 1)[0] in PLAN_ENTRIES else _not_found()

    async def send_app(request: Request) -> Response:
        return _send(request, built_app, request.path_params["path"] or "index.html")

    return Starlette(
        routes=[Route("/plan/{path:path}", send_plan), Route("/{path:path}", send_app)],
        middleware=[Middleware(RequestGuard, allowed_hosts=allowed_hosts)],
    )


def _send(request: Request, root: Path, relative: str) -> Response:
    file = find_file(root, relative)
    return _not_found() if file is None else send_file(file, request)


def _not_found() -> Response:
    return PlainTextResponse("not found\n", status_code=404)
