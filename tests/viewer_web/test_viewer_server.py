"""The viewer's server: what it gives, and everything it must refuse."""

import asyncio
import gzip
import os
from pathlib import Path

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.types import Message, Receive, Scope, Send

from planner_core.errors import MissingPackageError, PlanFolderError
from viewer_web.server import files
from viewer_web.server.app import create_app
from viewer_web.server.files import find_file
from viewer_web.server.guard import MOST_STRANGERS, RequestGuard

from .conftest import TOKEN, send

SERVED = ["/", "/plan/plan.json", "/plan/viewer/clouds/S001.u16", "/plan/report/index.html"]


@pytest.mark.slow
@pytest.mark.parametrize("path", SERVED)
def test_server_gives_the_app_and_the_known_parts_of_the_plan(ask, path) -> None:
    assert ask(path).status_code == 200


def test_server_gives_files_byte_for_byte(ask) -> None:
    assert ask("/plan/viewer/clouds/S001.u16").content == bytes(range(256))


@pytest.mark.parametrize(
    "path",
    [
        "/plan/../secret.txt",
        "/plan/viewer/../../secret.txt",
        "/plan/viewer/%2e%2e/%2e%2e/secret.txt",
        "/plan/viewer/..%2f..%2fsecret.txt",
        "/plan/viewer/%2e%2e%2f%2e%2e%2fsecret.txt",
        "/plan/viewer/..%5c..%5csecret.txt",
        "/plan/viewer//etc/passwd",
        "/plan//etc/passwd",
        "/plan/viewer/%00",
        "/plan/viewer/.draft",
        "/plan/viewer/./plan.json",
        "/plan/viewer",
        "/plan/",
        "/plan/stage/building.usdc",
        "/plan/plan.json/x",
        "/plan/plan.json::$DATA",
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/assets",
        "/nothing.js",
        "/plan/viewer/" + "a" * 900,
    ],
)
def test_server_does_not_find_paths_outside_what_it_serves(ask, path) -> None:
    response = ask(path)
    assert response.status_code == 404
    assert b"secret" not in response.content


def test_server_does_not_follow_links_out_of_the_plan(ask, plan_folder: Path) -> None:
    (plan_folder / "viewer" / "out.txt").symlink_to(plan_folder.parent / "secret.txt")
    (plan_folder / "viewer" / "up").symlink_to(plan_folder.parent)
    (plan_folder / "viewer" / "seen.txt").symlink_to(plan_folder / "viewer" / ".draft")
    (plan_folder / "viewer" / "loop").symlink_to(plan_folder / "viewer" / "loop")
    for path in ("out.txt", "up/secret.txt", "seen.txt", "loop"):
        assert ask(f"/plan/viewer/{path}").status_code == 404


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(relative=st.text(alphabet="./\\ab%:~\x00\n", max_size=24))
def test_found_files_always_lie_in_the_root(plan_folder: Path, relative: str) -> None:
    (plan_folder.parent / "a").write_text("outside")
    (plan_folder / "b").write_text("inside")
    found = find_file(plan_folder, relative)
    assert found in (None, plan_folder.resolve() / "b")


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:8000",
        "192.0.2.7:8000",
        "127.0.0.2:8000",
        "0.0.0.0:8000",
        "2130706433:8000",
        "127.0.0.1.evil.example:8000",
        "localhost@evil.example:8000",
        "",
        "localhost:8000:1",
        "127.0.0.1:port",
        "127.0.0.1:99999",
        "[127.0.0.1:8000",
    ],
)
def test_server_refuses_foreign_host_names(ask, host) -> None:
    assert ask("/plan/plan.json", headers={"host": host}).status_code == 421


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "localhost:8000", "LOCALHOST:8000", "[::1]:8000"])
def test_server_answers_to_loopback_names(ask, host) -> None:
    assert ask("/plan/plan.json", headers={"host": host}).status_code == 200


@pytest.mark.parametrize("host", ["localhost:9000", "127.0.0.1:9000", "localhost"])
def test_server_answers_through_a_tunnel_from_another_port(ask, host) -> None:
    assert ask("/plan/plan.json", headers={"host": host, "origin": f"http://{host}"}).status_code == 200


@pytest.mark.parametrize("origin", ["http://localhost:8000", "http://localhost", "https://localhost:9000"])
def test_origin_is_compared_with_the_port_through_a_tunnel_too(ask, origin) -> None:
    assert ask("/plan/plan.json", headers={"host": "localhost:9000", "origin": origin}).status_code == 403


@pytest.mark.parametrize(
    ("local", "host", "expected"),
    [
        ("192.0.2.2", "192.0.2.2:8000", 200),
        ("192.0.2.2", "192.0.2.2", 200),
        ("192.0.2.2", "192.0.2.3:8000", 421),
        ("192.0.2.2", "192.0.2.2.evil.example:8000", 421),
        ("fd00::2", "[FD00:0::2]:8000", 200),
        ("fe80::2%eth0", "[fe80::2]:8000", 200),
        ("fd00::2", "[fd00::3]:8000", 421),
        ("evil.example", "evil.example:8000", 421),
    ],
)
def test_server_answers_to_the_address_a_connection_came_in_at(local: str, host: str, expected: int) -> None:
    said: list[Message] = []

    async def hear_nothing() -> Message:
        return {"type": "http.disconnect"}

    async def keep(message: Message) -> None:
        said.append(message)

    scope = {
        "type": "http", "method": "GET", "path": "/", "raw_path": b"/", "query_string": b"",
        "headers": [(b"host", host.encode())], "server": (local, 8000),
    }  # fmt: skip
    asyncio.run(RequestGuard(PlainTextResponse("plan"), token="secret")(scope, hear_nothing, keep))
    assert said[0]["status"] == expected


def test_requests_without_the_token_take_a_limited_share_of_the_work() -> None:
    """Many hold what they are answered with; the next one is refused at once, and who has the token is not."""
    release = asyncio.Event()
    answered = PlainTextResponse("page")

    async def slow(scope: Scope, receive: Receive, send: Send) -> None:
        await release.wait()
        await answered(scope, receive, send)

    guard = RequestGuard(slow, token="secret")

    async def status(*headers: tuple[bytes, bytes]) -> int:
        said: list[Message] = []

        async def keep(message: Message) -> None:
            said.append(message)

        scope = {
            "type": "http", "method": "GET", "path": "/", "raw_path": b"/", "query_string": b"",
            "headers": [(b"host", b"127.0.0.1"), *headers], "server": ("127.0.0.1", 8000),
        }  # fmt: skip
        await guard(scope, hear_nothing, keep)
        return int(said[0]["status"])

    async def hear_nothing() -> Message:
        return {"type": "http.disconnect"}

    async def attack() -> tuple[list[int], int, int, int]:
        first = [asyncio.create_task(status()) for _ in range(MOST_STRANGERS)]
        await asyncio.sleep(0)
        refused = await asyncio.wait_for(status(), 60)
        admitted = asyncio.create_task(status((b"x-tlsplan-token", b"secret")))
        release.set()
        return await asyncio.gather(*first), refused, await admitted, await status()

    assert asyncio.run(attack()) == ([200] * MOST_STRANGERS, 503, 200, 200)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "PROPFIND"])
def test_server_refuses_methods_that_are_not_reads(ask, method) -> None:
    response = ask("/plan/plan.json", method)
    assert response.status_code == 405
    assert response.headers["allow"] == "GET, HEAD"


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://localhost:3000"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors", "sec-fetch-dest": "image"},
        {"sec-fetch-site": "same-site", "sec-fetch-mode": "cors", "sec-fetch-dest": "empty"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "iframe"},
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_server_refuses_requests_that_other_sites_make(ask, method, headers) -> None:
    response = ask("/plan/plan.json", method, headers=headers)
    assert response.status_code == 403
    assert "access-control-allow-origin" not in response.headers


def status_of(app: Starlette, path: str, headers: list[tuple[bytes, bytes]]) -> int:
    """Status of a GET with these headers and no others, each as often as it is there."""
    said: list[Message] = []

    async def keep(message: Message) -> None:
        said.append(message)

    async def hear_nothing() -> Message:
        return {"type": "http.disconnect"}

    scope = {
        "type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "query_string": b"",
        "headers": headers, "server": ("127.0.0.1", 8000), "client": ("127.0.0.1", 5000), "http_version": "1.1",
        "scheme": "http", "root_path": "",
    }  # fmt: skip
    asyncio.run(app(scope, hear_nothing, keep))
    return int(said[0]["status"])


@pytest.mark.parametrize(
    "headers",
    [
        [("origin", "http://127.0.0.1:8000"), ("origin", "http://evil.example")],
        [("origin", "http://127.0.0.1:8000"), ("Origin", "http://127.0.0.1:8000")],
        [("host", "127.0.0.1:8000"), ("host", "evil.example")],
        [("sec-fetch-site", "same-origin"), ("sec-fetch-site", "cross-site")],
        [("origin", "http://127.0.0.1:8000 http://evil.example")],  # a list, as RFC 6454 allows
        [("origin", "http://127.0.0.1:8000, http://evil.example")],  # two, as proxies join them
        [("origin", "")],
    ],
)
def test_server_refuses_headers_that_say_two_things(app: Starlette, headers: list[tuple[str, str]]) -> None:
    raw = [(b"x-tlsplan-token", TOKEN.encode()), *((name.lower().encode(), value.encode()) for name, value in headers)]
    raw += [] if any(name == b"host" for name, _ in raw) else [(b"host", b"127.0.0.1:8000")]
    assert status_of(app, "/plan/plan.json", raw) == 403


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://127.0.0.1:8000", "sec-fetch-site": "same-origin"},
        {"sec-fetch-site": "none", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"},
        {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"},
    ],
)
def test_server_answers_its_own_page_and_followed_links(ask, headers) -> None:
    assert ask("/", headers=headers).status_code == 200


def test_server_refuses_bodies_and_long_paths(ask) -> None:
    assert ask("/plan/plan.json", content=b"x" * 10).status_code == 413
    assert ask("/plan/" + "a" * 2000).status_code == 414


@pytest.mark.parametrize("path", [*SERVED, "/nothing"])
def test_every_answer_carries_the_security_headers(ask, path) -> None:
    headers = ask(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "http" not in headers["content-security-policy"]
    assert "unsafe" not in headers["content-security-policy"] or path.startswith("/plan/report/")
    assert not any(name.startswith("access-control-") for name in headers)


def test_refusals_carry_the_security_headers_too(ask) -> None:
    assert ask("/", headers={"host": "evil.example"}).headers["x-content-type-options"] == "nosniff"


def test_range_requests_give_the_asked_bytes(ask) -> None:
    response = ask("/plan/viewer/clouds/S001.u16", headers={"range": "bytes=10-19"})
    assert response.status_code == 206
    assert response.content == bytes(range(10, 20))
    assert response.headers["content-range"] == "bytes 10-19/256"
    assert ask("/plan/viewer/clouds/S001.u16", headers={"range": "bytes=900-"}).status_code == 416


def test_head_gives_the_headers_of_get_without_a_body(ask) -> None:
    head, get = ask("/plan/plan.json", "HEAD"), ask("/plan/plan.json")
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == get.headers["content-length"]
    assert head.headers["etag"] == get.headers["etag"]


def test_unchanged_files_are_not_sent_again_and_changed_ones_are(ask, plan_folder: Path) -> None:
    tag = ask("/plan/plan.json").headers["etag"]
    assert ask("/plan/plan.json", headers={"if-none-match": tag}).status_code == 304
    (plan_folder / "plan.json").write_text("{}")
    assert ask("/plan/plan.json", headers={"if-none-match": tag}).status_code == 200


def test_files_that_were_written_again_with_the_same_content_are_not_sent_again(ask, plan_folder: Path) -> None:
    tag = ask("/plan/viewer/clouds/S001.u16").headers["etag"]
    os.utime(plan_folder / "viewer" / "clouds" / "S001.u16", ns=(1, 1))
    assert ask("/plan/viewer/clouds/S001.u16", headers={"if-none-match": tag}).status_code == 304


def test_files_that_are_too_large_to_be_hashed_are_told_apart_by_their_times(
    ask, plan_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "LARGEST_HASHED_BYTES", 100)
    tag = ask("/plan/viewer/clouds/S001.u16").headers["etag"]
    assert ask("/plan/viewer/clouds/S001.u16", headers={"if-none-match": tag}).status_code == 304
    os.utime(plan_folder / "viewer" / "clouds" / "S001.u16", ns=(1, 1))
    assert ask("/plan/viewer/clouds/S001.u16", headers={"if-none-match": tag}).status_code == 200


def test_scripts_are_compressed_where_the_browser_takes_it(ask, built_app: Path) -> None:
    path, text = "/assets/index-abc123.js", (built_app / "assets" / "index-abc123.js").read_bytes()
    packed = ask(path, headers={"accept-encoding": "gzip"})
    plain = ask(path, headers={"accept-encoding": "identity"})
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.content == plain.content == text
    assert int(packed.headers["content-length"]) < len(text) == int(plain.headers["content-length"])
    assert int(packed.headers["content-length"]) == len(gzip.compress(text, compresslevel=6, mtime=0))
    assert packed.headers["etag"] != plain.headers["etag"]
    assert "immutable" in plain.headers["cache-control"]


@pytest.mark.parametrize(
    ("name", "is_packed"),
    [
        ("stage.usdc", True),
        ("patches.u8", True),
        ("pieces.i32", True),
        ("seen/S001.bits", True),
        ("clouds/S002.cloud", False),
    ],
)
def test_what_a_page_reads_whole_is_compressed_and_clouds_are_not(
    ask, plan_folder: Path, name: str, is_packed: bool
) -> None:
    file = plan_folder / "viewer" / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(bytes(4096))
    answer = ask(f"/plan/viewer/{name}", headers={"accept-encoding": "gzip"})
    assert answer.content == bytes(4096)
    assert ("content-encoding" in answer.headers) == is_packed


def test_a_replaced_plan_folder_shows_without_a_restart(ask, plan_folder: Path, tmp_path: Path) -> None:
    plan_folder.rename(tmp_path / "old")
    assert ask("/plan/plan.json").status_code == 404
    plan_folder.mkdir()
    (plan_folder / "plan.json").write_text("{}")
    assert ask("/plan/plan.json").content == b"{}"


def test_a_folder_without_a_plan_is_refused(tmp_path: Path, built_app: Path) -> None:
    with pytest.raises(PlanFolderError, match=r"no plan\.json"):
        create_app(tmp_path, token="secret", built_app=built_app)


def test_a_viewer_that_is_not_built_is_told(plan_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(MissingPackageError, match="make viewer"):
        create_app(plan_folder, token="secret", built_app=tmp_path / "nowhere")


def test_further_host_names_can_be_allowed(plan_folder: Path, built_app: Path) -> None:
    async def status(host: str) -> int:
        app = create_app(plan_folder, token="secret", allowed_hosts=["Survey-PC"], built_app=built_app)
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app=app), base_url="http://x:8000") as client:
            return (await client.get("/", headers={"host": host})).status_code

    assert asyncio.run(status("survey-pc:8000")) == 200
    assert asyncio.run(status("other-pc:8000")) == 421


@pytest.mark.parametrize(
    ("host", "origin", "expected"),
    [
        ("plans.example", "https://plans.example", 200),
        ("plans.example", "http://plans.example", 200),
        ("plans.example:8443", "https://plans.example:8443", 200),
        ("plans.example", "https://plans.example:8443", 403),
        ("plans.example", "https://other.example", 403),
        ("localhost", "https://localhost", 403),
    ],
)
def test_a_proxy_with_tls_may_stand_before_names_that_were_allowed(
    plan_folder: Path, built_app: Path, host: str, origin: str, expected: int
) -> None:
    app = create_app(plan_folder, token="secret", allowed_hosts=["plans.example", "localhost"], built_app=built_app)
    headers = {"host": host, "origin": origin}
    assert send(app, "/api/session", headers=headers, token="secret").status_code == expected
