"""The routes of runs, /api/runs: plan again from the browser."""

from collections.abc import Callable

from fastapi import APIRouter, Query, Request
from fastapi.responses import JSONResponse, Response

from viewer_web.server.answers import PREFIX, json_answer, refusals, refuse
from viewer_web.server.jobs.documents import RunDocument, RunList, RunRequest
from viewer_web.server.jobs.runs import RunBusyError, RunNotFoundError, Runs

_READ_ONLY = "this plan is shown read-only; start `tlsplan view` without --read-only to plan from here"


def create_runs_router(runs: Runs, *, read_only: bool = False) -> APIRouter:
    """Return the routes; those that change something are refused where `read_only`."""
    router = APIRouter(prefix=f"{PREFIX}/runs", tags=["runs"])

    def answer(question: Callable[[], RunDocument | None], *, changes: bool = True, status: int = 200) -> Response:
        if changes and read_only:
            return refuse(403, _READ_ONLY)
        try:
            document = question()
        except RunNotFoundError as error:
            return refuse(404, str(error))
        except RunBusyError as error:
            return refuse(409, str(error))
        if document is None:
            return Response(status_code=204)
        return JSONResponse(document.model_dump(), status_code=status)

    @router.get("", response_model=RunList, responses=refusals(503), summary="All runs")
    def get_runs(request: Request) -> Response:
        """The runs of this plan folder, the oldest first, and what prevents another one."""
        return json_answer({"runs": [run.model_dump() for run in runs.all()], "obstacle": runs.obstacle()}, request)

    @router.post(
        "",
        response_model=RunDocument,
        status_code=201,
        responses=refusals(400, 409, 413, 415, 422, 503),
        summary="Start a run",
    )
    def post_run(requested: RunRequest) -> Response:
        """Plan again, beside the plan that is shown, in a process of its own. One run at a time: 409 while one goes on.

        Its progress and result come by the event `run` of /api/events. It outlives this server, unless that is ended
        with Ctrl-C: then it is cancelled, and writes its best plan so far.
        """
        return answer(lambda: runs.start(requested), status=201)

    @router.get("/{run}", response_model=RunDocument, responses=refusals(404, 422, 503), summary="A run")
    def get_run(run: str) -> Response:
        """How it stands."""
        return answer(lambda: runs.get(run), changes=False)

    @router.post(
        "/{run}/cancel", response_model=RunDocument, responses=refusals(404, 409, 422, 503), summary="Cancel a run"
    )
    def post_cancel(
        run: str, discard: bool = Query(default=False, description="Write no plan, whether or not there is one.")
    ) -> Response:
        """End a run. Where it has a plan by now it writes the best one, and takes a while: see its state."""
        return answer(lambda: runs.cancel(run, discard=discard))

    @router.post(
        "/{run}/resume",
        response_model=RunDocument,
        status_code=201,
        responses=refusals(404, 409, 422, 503),
        summary="Resume a run",
    )
    def post_resume(run: str) -> Response:
        """Begin a new run that asks the same of the same plan and review, from the best stations of this one on."""
        return answer(lambda: runs.resume(run), status=201)

    @router.delete(
        "/{run}",
        status_code=204,
        response_class=Response,
        responses=refusals(404, 409, 422, 503),
        summary="Delete a run",
    )
    def delete_run(run: str) -> Response:
        """Remove all files of a run that has ended, its plan among them."""

        def remove() -> None:
            runs.delete(run)

        return answer(remove)

    return router
