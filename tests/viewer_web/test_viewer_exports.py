"""The routes of exports: files of the plan as reviewed, one at a time, within limits, and refusals of one line."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from urllib.parse import unquote

import httpx
import pytest
from starlette.applications import Starlette

from planner_core.errors import PlannerError
from viewer_web.server import exports as exporting
from viewer_web.server.app import create_app
from viewer_web.server.exports import Exports
from viewer_web.server.exports_api import create_exports_router
from viewer_web.server.session import Session

from .conftest import TOKEN, send

Ask = Callable[..., httpx.Response]


@pytest.fixture
def exports(plan_folder: Path) -> Exports:
    return Exports(Session(plan_folder))


@pytest.fixture
def exports_app(plan_folder: Path, built_app: Path, exports: Exports) -> Starlette:
    return create_app(plan_folder, token=TOKEN, built_app=built_app, routers=[create_exports_router(exports)])


@pytest.fixture
def ask(exports_app: Starlette) -> Ask:
    return lambda *arguments, **named: send(exports_app, *arguments, **named)


def test_without_the_token_nothing_is_made(ask: Ask) -> None:
    assert ask("/api/exports", token=None).status_code == 401
    assert ask("/api/exports/csv", token=None).status_code == 401


def test_what_can_be_had_is_listed_with_what_stands_in_the_way(ask: Ask) -> None:
    document = ask("/api/exports").json()
    assert document["edited_stations"] == 0
    listed = {each["name"]: each for each in document["exports"]}
    assert {"csv", "pdf", "html", "ifc", "bcf"} <= set(listed)
    assert listed["csv"]["obstacle"] is None
    move = {"kind": "move_station", "station": "S001", "position_m": [500001.5, 4000002.0, 101.5]}
    body = {"base_revision": 0, "author": "Kim", "changes": [move]}
    assert ask("/api/review/changes", "POST", body=body).status_code == 200
    document = ask("/api/exports").json()
    assert document["edited_stations"] == 1
    listed = {each["name"]: each["obstacle"] for each in document["exports"]}
    assert listed["csv"] is None
    assert "computed from the scene" in listed["pdf"]


def test_sheets_from_another_entrance_need_the_scene_and_lists_do_not(ask: Ask) -> None:
    entrance = {"position_m": [500001.5, 4000002.0, 100.0], "floor": "F0"}
    before = {each["name"]: each["obstacle"] for each in ask("/api/exports").json()["exports"]}
    body = {"base_revision": 0, "author": "Kim", "changes": [{"kind": "add_entrance", "entrance": entrance}]}
    assert ask("/api/review/changes", "POST", body=body).status_code == 200
    document = ask("/api/exports").json()
    assert document["edited_stations"] == 0
    after = {each["name"]: each["obstacle"] for each in document["exports"]}
    assert before["html"] is None
    assert "entrances were edited" in after["html"]
    assert after["csv"] is None


def test_a_station_list_is_that_of_the_review_and_leaves_nothing_behind(ask: Ask, plan_folder: Path) -> None:
    move = {"kind": "move_station", "station": "S001", "position_m": [500009.5, 4000002.0, 101.5]}
    body = {"base_revision": 0, "author": "Kim", "changes": [move]}
    assert ask("/api/review/changes", "POST", body=body).status_code == 200
    before = sorted(path.name for path in plan_folder.iterdir())
    answer = ask("/api/exports/csv")
    assert answer.status_code == 200, answer.text
    assert 'filename="stations.csv"' in answer.headers["content-disposition"]
    assert answer.headers["cache-control"] == "no-store"
    first = next(line for line in answer.text.splitlines() if line.startswith("S001,"))
    assert "500009.5" in first
    assert "as reviewed (S001 edited)" in unquote(answer.headers["x-tlsplan-remarks"])
    assert sorted(path.name for path in plan_folder.iterdir()) == before


@pytest.mark.parametrize("name", ["..%2f..%2fsecret", "las", "web", "stations.csv", "%00"])
def test_only_what_is_offered_is_made(ask: Ask, name: str) -> None:
    answer = ask(f"/api/exports/{name}")
    assert answer.status_code == 404
    assert "content-disposition" not in answer.headers


@pytest.mark.slow
def test_what_can_not_be_made_is_told_in_one_line(ask: Ask, plan_folder: Path) -> None:
    (plan_folder / "plan.json").write_text("{")
    answer = ask("/api/exports/csv")
    assert answer.status_code == 422
    message = answer.json()["message"]
    assert "plan.json" in message and "\n" not in message


def test_one_is_made_at_a_time(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def slow(*_: object, **__: object) -> tuple[str, ...]:
        begun.set()
        go_on.wait(60)
        raise PlannerError("csv: enough")

    monkeypatch.setattr(exporting, "run_isolated", slow)
    answers: list[httpx.Response] = []
    first = threading.Thread(target=lambda: answers.append(ask("/api/exports/csv")))
    first.start()
    assert begun.wait(60)
    busy = ask("/api/exports/csv")
    go_on.set()
    first.join()
    assert (busy.status_code, "another export" in busy.json()["message"]) == (503, True)
    assert (answers[0].status_code, answers[0].json()["message"]) == (422, "csv: enough")


@pytest.mark.slow
def test_what_takes_too_long_or_gets_too_large_is_ended_with_the_way_around(plan_folder: Path) -> None:
    session = Session(plan_folder)
    with pytest.raises(PlannerError, match=r"took more than 0 s.*tlsplan export --format csv"):
        Exports(session, longest_s=0).make("csv")
    with pytest.raises(PlannerError, match=r"larger than 0 MB.*tlsplan export --format csv"):
        Exports(session, largest_bytes=10).make("csv")


def test_what_nobody_waits_for_is_ended(exports: Exports) -> None:
    with pytest.raises(PlannerError, match="nobody waits"):
        exports.make("csv", is_wanted=lambda: False)
    assert exports.make("csv").path.read_text(encoding="utf-8").count("S00") >= 3


def test_nothing_is_left_when_the_server_stops(exports: Exports) -> None:
    made = exports.make("csv")
    assert made.path.is_file()
    exports.stop()
    assert not made.path.parent.exists()
    with pytest.raises(PlannerError, match="the server stops"):
        exports.make("csv")
