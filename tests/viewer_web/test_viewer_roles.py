"""The second token: who has it reads, comments and judges; the server refuses all else, in words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import APIRouter
from starlette.applications import Starlette

from planner_core.review.apply import KINDS
from viewer_web.server import serve as serving
from viewer_web.server.app import create_app
from viewer_web.server.serve import runs_side
from viewer_web.server.session import Session

from .conftest import TOKEN, send

COMMENT_TOKEN = "the-token-of-commenters"
Ask = Callable[..., httpx.Response]

ALLOWED: list[dict[str, Any]] = [
    {"kind": "add_comment", "text": "Move it?", "target": "S001"},
    {"kind": "set_verdict", "station": "S001", "verdict": "rejected", "note": "in the way"},
    {"kind": "clear_verdict", "station": "S001"},
    {"kind": "set_progress", "station": "S001", "state": "done"},
]
REFUSED: list[dict[str, Any]] = [
    {"kind": "move_station", "station": "S001", "position_m": [500001.5, 4000002.0, 101.5]},
    {"kind": "set_height", "station": "S001", "instrument_height_m": 1.6},
    {"kind": "add_station", "position_m": [500001.5, 4000002.0, 101.5], "floor": "F0"},
    {"kind": "remove_station", "station": "S001"},
    {"kind": "lock_station", "station": "S001"},
    {"kind": "add_zone", "zone": {"kind": "keep_out", "outline_m": [[0, 0], [1, 0], [1, 1]]}},
    {"kind": "sign"},
]


@pytest.fixture
def roles_app(plan_folder: Path, built_app: Path) -> Starlette:
    session = Session(plan_folder)
    routers: list[APIRouter] = [runs_side(session).router]
    return create_app(
        plan_folder,
        token=TOKEN,
        comment_token=COMMENT_TOKEN,
        session=session,
        routers=routers,
        built_app=built_app,
    )


@pytest.fixture
def comment(roles_app: Starlette) -> Ask:
    return lambda *arguments, **named: send(roles_app, *arguments, token=COMMENT_TOKEN, **named)


def _change(*changes: dict[str, Any]) -> dict[str, Any]:
    return {"base_revision": 0, "author": "Kim", "changes": list(changes)}


def test_a_commenter_reads_the_plan_and_is_told_what_the_page_is_for(roles_app: Starlette, comment: Ask) -> None:
    assert comment("/plan/plan.json").status_code == 200
    assert comment("/api/session").json()["comment_only"] is True
    assert send(roles_app, "/api/session").json()["comment_only"] is False


def test_a_commenter_comments_and_judges(comment: Ask) -> None:
    answer = comment("/api/review/changes", "POST", body=_change(*ALLOWED[:2]))
    assert answer.status_code == 200
    review = comment("/api/review").json()
    assert [each["text"] for each in review["comments"].values()] == ["Move it?"]
    assert review["verdicts"]["S001"]["note"] == "in the way"
    undone = comment("/api/review/changes", "POST", body=_change(*answer.json()["undo"]) | {"base_revision": 1})
    assert undone.json()["review"]["verdicts"] == {}
    again = _change(*ALLOWED[1:]) | {"base_revision": 2}
    assert comment("/api/review/changes", "POST", body=again).status_code == 200


@pytest.mark.parametrize("change", REFUSED, ids=lambda change: change["kind"])
def test_a_commenter_changes_nothing_else(
    roles_app: Starlette, comment: Ask, plan_folder: Path, change: dict[str, Any]
) -> None:
    answer = comment("/api/review/changes", "POST", body=_change(ALLOWED[0], change))
    assert answer.status_code == 403
    assert "comments and verdicts only" in answer.json()["message"]
    assert not (plan_folder / "review.usda").exists()
    assert send(roles_app, "/api/review/changes", "POST", body=_change(change)).status_code == 200


def test_every_kind_of_change_but_those_of_comments_and_verdicts_is_refused() -> None:
    from viewer_web.server.roles import may_commenter_make

    allowed = {kind for kind, of in KINDS.items() if may_commenter_make(object.__new__(of))}
    assert allowed == {
        "add_comment", "assign_comment", "edit_comment", "resolve_comment", "remove_comment", "set_verdict",
        "clear_verdict", "set_progress",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("method", "path"),
    [("POST", "/api/runs"), ("POST", "/api/runs/R001/cancel"), ("DELETE", "/api/runs/R001"), ("POST", "/api/new")],
)
def test_a_commenter_starts_and_ends_no_runs_nor_what_comes_later(comment: Ask, method: str, path: str) -> None:
    answer = comment(path, method, body={} if method == "POST" else None)
    assert (answer.status_code, "other address" in answer.json()["message"]) == (403, True)


def test_the_address_of_commenters_hands_their_token_in(roles_app: Starlette) -> None:
    first = send(roles_app, f"/?token={COMMENT_TOKEN}", token=None)
    cookie = first.headers["set-cookie"].partition(";")[0]
    assert send(roles_app, "/api/session", headers={"cookie": cookie}, token=None).json()["comment_only"] is True


def test_without_a_token_of_commenters_nobody_is_one(plan_folder: Path, built_app: Path) -> None:
    app = create_app(plan_folder, token=TOKEN, built_app=built_app)
    assert send(app, "/api/session", token="").status_code == 401
    assert send(app, "/?token=", token=None).headers.get("set-cookie") is None


@pytest.mark.parametrize(
    ("told", "n_addresses", "is_commenter"),
    [({}, 2, False), ({"comment_only": True}, 1, True), ({"read_only": True}, 1, False)],
)
def test_serve_announces_an_address_for_each_role(
    plan_folder: Path,
    built_app: Path,
    monkeypatch: pytest.MonkeyPatch,
    told: dict[str, bool],
    n_addresses: int,
    is_commenter: bool,
) -> None:
    made: list[Starlette] = []
    monkeypatch.setattr(serving, "create_app", lambda *a, **k: made.append(create_app(*a, **k)) or made[-1])
    monkeypatch.setattr(serving._AnnouncingServer, "run", lambda self, sockets: self._announce())
    addresses: list[str] = []
    serving.serve(
        plan_folder,
        built_app=built_app,
        live=False,
        on_ready=addresses.append,
        on_comment_address=addresses.append,
        **told,
    )
    tokens = [address.partition("token=")[2] for address in addresses]
    found = [send(made[0], "/api/session", token=token).json()["comment_only"] for token in tokens]
    assert (len(set(tokens)), found[0]) == (n_addresses, is_commenter)
    assert found[1:] == [True] * (n_addresses - 1)
