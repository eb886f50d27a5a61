"""The routes of runs: what they answer, and to whom they refuse."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import GenerationMode
from schemathesis.checks import load_all_checks
from starlette.applications import Starlette

from planner_core.errors import PlanFolderError
from viewer_web.server.app import create_app
from viewer_web.server.jobs.api import create_runs_router
from viewer_web.server.jobs.documents import RunDocument, RunRequest
from viewer_web.server.jobs.runs import RunBusyError, RunNotFoundError, Runs

load_all_checks()
TOKEN = "token"
Ask = Callable[..., httpx.Response]
RUN = RunDocument(
    id="R001",
    title="t",
    state="running",
    created="2026-11-21T16:30:00Z",
    request=RunRequest(),
    plan_sha256="",
    revision=0,
)


class Recorded(Runs):
    """Runs that begin no process: what was asked, and one answer or refusal for all."""

    def __init__(self, answer: RunDocument | Exception) -> None:
        super().__init__(Path())
        self.asked: list[tuple[Any, ...]] = []
        self._answer = answer

    def _told(self, *asked: Any) -> RunDocument:
        self.asked.append(asked)
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer

    def obstacle(self) -> str | None:
        return "no scene"

    def all(self) -> list[RunDocument]:
        return [self._told("all")]

    def get(self, run: str) -> RunDocument:
        return self._told("get", run)

    def start(self, request: RunRequest, *, resumed_from: str | None = None) -> RunDocument:
        return self._told("start", request, resumed_from)

    def resume(self, run: str) -> RunDocument:
        return self._told("resume", run)

    def cancel(self, run: str, *, discard: bool = False, why: str = "") -> RunDocument:
        return self._told("cancel", run, discard)

    def delete(self, run: str) -> None:
        self._told("delete", run)


@pytest.fixture
def serving(hall: Path, tmp_path: Path) -> Callable[..., Starlette]:
    built = tmp_path / "dist"
    built.mkdir()
    (built / "index.html").write_text("viewer")

    def make(runs: Runs, *, read_only: bool = False) -> Starlette:
        router = create_runs_router(runs, read_only=read_only)
        return create_app(hall / "plan", token=TOKEN, routers=[router], built_app=built)

    return make


@pytest.fixture
def asking(serving: Callable[..., Starlette]) -> Callable[..., Ask]:
    def make(runs: Runs, *, read_only: bool = False) -> Ask:
        app = serving(runs, read_only=read_only)

        def ask(method: str, path: str, **more: Any) -> httpx.Response:
            async def exchange() -> httpx.Response:
                transport = httpx.ASGITransport(app=app)
                async with httpx.AsyncClient(
                    transport=transport, base_url="http://127.0.0.1:8000", headers={"x-tlsplan-token": TOKEN}
                ) as client:
                    return await client.request(method, f"/api/{path}", **more)

            return asyncio.run(exchange())

        return ask

    return make


@pytest.mark.slow
def test_each_route_asks_the_runs_and_answers_with_the_run(asking: Callable[..., Ask]) -> None:
    runs = Recorded(RUN)
    ask = asking(runs)
    body = {"title": "x", "objective": "coverage", "max_stations": 4, "from_review": True, "time_limit_s": 2.5}
    assert ask("GET", "runs").json() == {"runs": [RUN.model_dump()], "obstacle": "no scene"}
    answers = [
        ask("POST", "runs", json=body),
        ask("GET", "runs/R001"),
        ask("POST", "runs/R001/cancel"),
        ask("POST", "runs/R001/cancel?discard=true"),
        ask("POST", "runs/R001/resume"),
    ]
    assert [answer.status_code for answer in answers] == [201, 200, 200, 200, 201]
    assert all(answer.json() == RUN.model_dump() for answer in answers)
    gone = ask("DELETE", "runs/R001")
    assert (gone.status_code, gone.content) == (204, b"")
    assert runs.asked == [
        ("all",),
        ("start", RunRequest(**body), None),
        ("get", "R001"),
        ("cancel", "R001", False),
        ("cancel", "R001", True),
        ("resume", "R001"),
        ("delete", "R001"),
    ]


@pytest.mark.parametrize(
    ("error", "status"),
    [(RunNotFoundError("no such"), 404), (RunBusyError("busy"), 409), (PlanFolderError("broken"), 503)],
)
def test_refusals_are_told_in_words(asking: Callable[..., Ask], error: Exception, status: int) -> None:
    ask = asking(Recorded(error))
    for method, path in (("GET", "runs/R001"), ("POST", "runs/R001/cancel"), ("DELETE", "runs/R001")):
        answer = ask(method, path)
        assert (answer.status_code, answer.json()) == (status, {"message": str(error)})


@pytest.mark.parametrize(
    "body",
    [
        {"titel": "x"},
        {"title": "a\nb"},
        {"title": "x" * 201},
        {"objective": "fastest"},
        {"max_stations": 0},
        {"max_stations": True},
        {"time_limit_s": -1},
        {"from_review": "yes"},
        {"requirements": [1]},
        [],
    ],
)
def test_what_is_no_request_is_refused_before_anything_is_done(asking: Callable[..., Ask], body: Any) -> None:
    runs = Recorded(RUN)
    answer = asking(runs)("POST", "runs", json=body)
    assert answer.status_code == 422
    assert answer.json()["message"]
    assert runs.asked == []


@pytest.mark.parametrize(
    "body",
    [
        '{"time_limit_s": Infinity}',
        '{"requirements": {"spacing": NaN}}',
        '{"requirements": {"site": {"keep_out": [{"name": "\\ud800"}]}}}',
        '{"title": "\\udfff"}',
        '{"requirements": {"site": ' + "[" * 20_000 + "]" * 20_000 + "}}",
    ],
)
def test_what_only_some_take_for_json_is_refused(asking: Callable[..., Ask], body: str) -> None:
    runs = Recorded(RUN)
    answer = asking(runs)("POST", "runs", content=body.encode(), headers={"content-type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.json()["message"]
    assert runs.asked == []


def test_who_may_only_read_sees_runs_and_begins_none(asking: Callable[..., Ask]) -> None:
    runs = Recorded(RUN)
    ask = asking(runs, read_only=True)
    assert ask("GET", "runs/R001").status_code == 200
    for method, path in (("POST", "runs/R001/cancel"), ("POST", "runs/R001/resume"), ("DELETE", "runs/R001")):
        answer = ask(method, path)
        assert (answer.status_code, "--read-only" in answer.json()["message"]) == (403, True)
    assert ask("POST", "runs", json={}).status_code == 403
    assert runs.asked == [("get", "R001")]


@pytest.mark.slow
@pytest.mark.parametrize("answer", [RUN, RunBusyError("busy")])
@pytest.mark.parametrize(
    "mode", [GenerationMode.POSITIVE, pytest.param(GenerationMode.NEGATIVE, marks=pytest.mark.slow)]
)
def test_every_answer_is_one_that_the_document_describes(
    serving: Callable[..., Starlette], answer: RunDocument | Exception, mode: GenerationMode
) -> None:
    told = {"x-tlsplan-token": TOKEN, "host": "127.0.0.1:8000"}
    schema = schemathesis.openapi.from_asgi("/api/openapi.json", serving(Recorded(answer)), headers=told)
    excluded = schemathesis.checks.CHECKS.get_by_names(["positive_data_acceptance"])
    asked = set()
    for found in schema.include(path_regex="^/api/runs").get_all_operations():
        operation = found.ok()
        can_be_wrong = bool(operation.body) or mode is GenerationMode.POSITIVE
        can_be_busy = operation.method != "get" or answer is RUN
        if not (can_be_wrong and can_be_busy):
            continue
        asked.add((operation.method, operation.path))

        @settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
        @given(case=operation.as_strategy(generation_mode=mode))
        def check(case: schemathesis.Case) -> None:
            case.call_and_validate(base_url="http://127.0.0.1:8000", headers=told, excluded_checks=excluded)

        check()
    n_all = 6 if answer is RUN else 4
    assert len(asked) == (n_all if mode is GenerationMode.POSITIVE else 1)
