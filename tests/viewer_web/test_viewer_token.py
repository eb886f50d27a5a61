"""The token: who has it gets in, who has not gets words, and bodies are what our own page sends."""

from __future__ import annotations

from pathlib import Path

import pytest

from viewer_web.server.app import create_app
from viewer_web.server.token import is_token, new_token

from .conftest import TOKEN, Ask, send

GUARDED = ["/plan/plan.json", "/plan/viewer/clouds/S001.u16", "/plan/nothing", "/api/session", "/api/openapi.json",
           "/plan", "/api", "/api/", "/%70lan/plan.json", "/api/events"]  # fmt: skip


@pytest.mark.parametrize(
    ("path", "token"),
    [
        *((path, None) for path in GUARDED),
        *(("/plan/plan.json", token) for token in ("", "wrong", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "é")),
    ],
)
def test_without_the_token_nothing_of_the_plan_is_told(ask: Ask, path: str, token: str | None) -> None:
    headers = {} if token is None else {"x-tlsplan-token": token.encode()}
    answer = ask(path, headers=headers, token=None)
    assert answer.status_code == 401
    assert "tlsplan view" in answer.text
    assert "F0" not in answer.text


def test_the_application_itself_is_no_secret(ask: Ask) -> None:
    assert ask("/", token=None).status_code == 200
    assert ask("/assets/index-abc123.js", token=None).status_code == 200


def test_the_first_address_hands_the_token_in_for_a_cookie_and_goes_where_it_is_not_seen(ask: Ask) -> None:
    first = ask(f"/?token={TOKEN}", token=None)
    assert first.status_code == 303
    assert first.headers["location"] == "/"
    assert first.headers["cache-control"] == "no-store"
    cookie = first.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= {part.strip() for part in cookie.split(";")}
    name_and_value = cookie.partition(";")[0]
    assert ask("/plan/plan.json", headers={"cookie": name_and_value}, token=None).status_code == 200
    several = f"theme=dark; {name_and_value}; odd=[1,2]"
    assert ask("/plan/plan.json", headers={"cookie": several}, token=None).status_code == 200


def test_a_wrong_token_in_the_address_is_refused_in_words_and_sets_nothing(ask: Ask) -> None:
    for query in ("token=wrong", "token=", f"token=wrong&token={TOKEN}", "a=1&token=wrong"):
        answer = ask(f"/?{query}", token=None)
        assert (answer.status_code, "set-cookie" in answer.headers) == (401 if query != "token=" else 200, False)


def test_a_cookie_of_another_port_of_this_machine_is_not_ours(ask: Ask) -> None:
    cookie = ask(f"/?token={TOKEN}", token=None, headers={"host": "127.0.0.1:8001"}).headers["set-cookie"]
    assert cookie.startswith("tlsplan-8001=")
    answer = ask("/plan/plan.json", headers={"cookie": cookie.partition(";")[0]}, token=None)
    assert answer.status_code == 401


def test_tokens_differ_and_are_compared_whole() -> None:
    one, other = new_token(), new_token()
    assert one != other
    assert len(one) >= 43
    assert is_token(one, one)
    assert not is_token(one, other)
    assert not is_token("\u00e9", one)


@pytest.mark.parametrize(
    ("path", "method", "headers", "status"),
    [
        ("/plan/plan.json", "POST", {}, 405),
        ("/", "POST", {}, 405),
        ("/", "DELETE", {}, 405),
        ("/api/review", "PUT", {}, 405),
        ("/api/review", "PATCH", {}, 405),
        ("/api/review", "OPTIONS", {}, 405),
        ("/api/review", "HEAD", {}, 405),
        ("/api/review", "POST", {}, 405),
        ("/api/review/changes", "GET", {}, 405),
        ("/api/nothing", "GET", {}, 404),
        ("/api/review/changes", "POST", {"origin": "http://evil.example"}, 403),
        ("/api/review/changes", "POST", {"sec-fetch-site": "same-site", "sec-fetch-mode": "cors"}, 403),
        ("/api/review/changes", "POST", {"host": "evil.example"}, 421),
    ],
)
def test_routes_take_their_methods_from_our_own_page(
    ask: Ask, path: str, method: str, headers: dict[str, str], status: int
) -> None:
    answer = ask(path, method, headers=headers)
    assert answer.status_code == status
    if path.startswith("/api/") and method != "HEAD":
        assert answer.json()["message"]
    if status == 405:
        assert method not in answer.headers["allow"].split(", ")


JSON = {"content-type": "application/json"}


@pytest.mark.parametrize(
    ("content", "headers", "status"),
    [
        (b'{"base_revision": 0}', {"content-type": "text/plain"}, 415),
        (b'{"base_revision": 0}', {"content-type": "application/x-www-form-urlencoded"}, 415),
        (b'{"base_revision": 0}', {}, 415),
        (b"x" * (1024 * 1024 + 1), JSON, 413),
        (b"", JSON, 422),
        (b"{", JSON, 422),
        (b"[" * 200_000, JSON, 400),
        (b"\xff\xfe{}", JSON, 422),
        (b'{"base_revision": ' + b"9" * 5000 + b"}", JSON, 400),
        (b"null", JSON, 422),
    ],
)
def test_bodies_that_are_no_short_json_are_refused_in_words(
    ask: Ask, content: bytes, headers: dict[str, str], status: int
) -> None:
    answer = ask("/api/review/changes", "POST", headers=headers, content=content)
    assert answer.status_code in (status, 422 if status == 400 else status)
    assert answer.json()["message"]


def test_a_drawing_may_be_larger_than_other_bodies(ask: Ask) -> None:
    answer = ask("/api/drawing", "POST", headers=JSON, content=b" " * (1024 * 1024) + b"{}")
    assert answer.status_code == 404  # the guard let it pass to the routes, of which this plan has none for drawings
    answer = ask("/api/drawing", "POST", headers=JSON | {"content-length": str(16 * 1024 * 1024 + 1)})
    assert answer.status_code == 413 and "expected at most 16777216" in answer.json()["message"]


def test_a_body_where_none_is_expected_and_one_of_unknown_length_are_refused(ask: Ask) -> None:
    assert ask("/api/review", content=b"x").status_code == 413
    assert ask("/api/runs/R001", "DELETE", content=b"{}").status_code == 413
    headers = {"transfer-encoding": "chunked", "content-type": "application/json"}
    assert ask("/api/review/changes", "POST", headers=headers).status_code == 413
    assert ask("/api/review/changes", "POST", headers={"content-length": "1e3"}).status_code == 413


def test_long_addresses_are_refused(ask: Ask) -> None:
    assert ask("/api/" + "a" * 2000).status_code == 414
    assert ask("/api/review?" + "a" * 2000).status_code == 414


def test_plans_of_runs_are_shown_and_nothing_else_of_runs(plan_folder: Path, built_app: Path) -> None:
    run = plan_folder / "runs" / "R001"
    (run / "plan" / "report").mkdir(parents=True)
    (run / "plan" / "plan.json").write_text("{}")
    (run / "plan" / "report" / "index.html").write_text("<b>report</b>")
    (run / "plan" / "review.usda").write_text("#usda 1.0")
    (run / "run.json").write_text("{}")
    (run / "log").write_text("x")
    app = create_app(plan_folder, token=TOKEN, built_app=built_app)
    statuses = {
        path: send(app, f"/plan/runs/{path}").status_code
        for path in ("R001/plan/plan.json", "R001/plan/report/index.html", "R001/plan/review.usda", "R001/run.json",
                     "R001/log", "R001", "R001/plan", "../plan/plan.json", "R001/plan/%2e%2e/%2e%2e/%2e%2e/plan.json",
                     "R001/plan/runs/R001/plan/plan.json")
    }  # fmt: skip
    assert [path for path, status in statuses.items() if status == 200] == [
        "R001/plan/plan.json", "R001/plan/report/index.html",
    ]  # fmt: skip
    report = send(app, "/plan/runs/R001/plan/report/index.html")
    assert "style-src 'unsafe-inline'" in report.headers["content-security-policy"]
