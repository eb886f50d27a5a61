"""The review over the wire: what is changed, what is answered, and who is told."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.applications import Starlette
from starlette.types import Message

from planner_core.errors import PlanFolderError
from planner_core.review import changes as c
from planner_core.review.store import ReviewStore
from viewer_web.server import events
from viewer_web.server.app import create_app
from viewer_web.server.events import EventHub
from viewer_web.server.review_api import _EventResponse
from viewer_web.server.session import Session

from .conftest import TOKEN, Ask, send

HERE = [500005.25, 4000005.5, 101.75]
SQUARE = [[500000.0, 4000000.0], [500002.0, 4000000.0], [500002.0, 4000002.0]]


def post(ask: Ask, base: int, *changes: dict[str, Any], author: str = "Ana", status: int = 200) -> dict[str, Any]:
    body = {"base_revision": base, "author": author, "changes": list(changes)}
    answer = ask("/api/review/changes", "POST", body=body)
    assert answer.status_code == status, answer.text
    return dict(answer.json())


def test_session_says_what_is_shown(ask: Ask, plan_folder: Path) -> None:
    session = ask("/api/session").json()
    assert session == {
        "schema": "tlsplan/api/1",
        "plan_sha256": ReviewStore(plan_folder).plan().sha256,
        "revision": 0,
        "read_only": False,
        "comment_only": False,
        "live": {"state": "off", "step": None, "fraction": None, "message": None},
    }


def test_changes_are_on_disk_when_they_are_answered_and_undo_takes_them_back(ask: Ask, plan_folder: Path) -> None:
    answer = post(
        ask,
        0,
        {"kind": "move_station", "station": "S001", "position_m": HERE, "instrument_height_m": 1.75, "floor": "F1"},
        {"kind": "add_station", "position_m": HERE, "floor": "F0"},
        {"kind": "add_zone", "zone": {"kind": "priority", "outline_m": SQUARE, "coverage": 0.98}},
        {"kind": "forbid", "place": {"position_m": HERE}},
        {"kind": "pick_ground", "pick": {"point_m": HERE, "is_ground": False}},
        {"kind": "add_comment", "text": "Out of the doorway.", "target": "S001"},
        {"kind": "set_verdict", "station": "S003", "verdict": "accepted"},
        {"kind": "sign"},
    )
    assert answer["revision"] == answer["review"]["revision"] == 1
    assert answer["review"] == ask("/api/review").json()
    review = ReviewStore(plan_folder).current()
    assert review.stations["S001"].position_m == tuple(HERE)
    assert [set(kind) for kind in (review.zones, review.forbidden, review.stations)] == [
        {"Z001"}, {"P001"}, {"S001", "S004"},
    ]  # fmt: skip
    undone = post(ask, 1, *answer["undo"])["review"]
    assert {key: value for key, value in undone.items() if value and key != "touched"} == {"revision": 2}


def test_undo_can_itself_be_undone(ask: Ask) -> None:
    first = post(ask, 0, {"kind": "move_station", "station": "S001", "position_m": HERE, "instrument_height_m": None})
    undone = post(ask, 1, *first["undo"])
    redone = post(ask, 2, *undone["undo"])
    assert undone["review"]["stations"] == {}
    assert redone["review"]["stations"] == first["review"]["stations"]
    assert first["review"]["stations"]["S001"]["instrument_height_m"] is None


def test_a_height_that_is_left_out_stays_as_it_is(ask: Ask) -> None:
    answer = post(ask, 0, {"kind": "move_station", "station": "S001", "position_m": HERE})
    assert answer["review"]["stations"]["S001"]["instrument_height_m"] == 1.5


def test_who_was_second_is_told_who_was_first_and_gets_the_review_as_it_is(ask: Ask) -> None:
    post(ask, 0, {"kind": "lock_station", "station": "S001"})
    conflict = post(ask, 0, {"kind": "remove_station", "station": "S001"}, author="Ben", status=409)
    assert "station S001 was changed in the meantime, last by Ana" in conflict["message"]
    assert [(clash["object"], clash["by"]) for clash in conflict["conflicts"]] == [("station:S001", "Ana")]
    assert conflict["review"]["revision"] == 1
    assert post(ask, 0, {"kind": "lock_station", "station": "S003"}, author="Ben")["revision"] == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "lock_station", "station": "S009"}, "neither in the plan nor added"),
        ({"kind": "move_station", "station": "S002", "position_m": HERE}, "scanned already"),
        ({"kind": "move_station", "station": "S001", "position_m": [1, 2]}, "position_m"),
        ({"kind": "move_station", "station": "S001", "position_m": ["1", 2, 3]}, "position_m"),
        ({"kind": "move_station", "station": "S001", "position_m": [1e300, 2, 3]}, "position_m"),
        ({"kind": "move_station", "station": "S001"}, "position_m"),
        ({"kind": "lock_station", "station": "S001", "lokked": True}, "lokked"),
        ({"kind": "fly"}, "kind"),
        ({}, "kind"),
        (
            {"kind": "add_zone", "zone": {"kind": "keep_out", "outline_m": SQUARE, "coverage": 0.5}},
            "coverage goes with",
        ),
        ({"kind": "add_comment", "text": "é" * 9000}, "18000 bytes"),
        ({"kind": "add_comment", "text": "x" * 10001}, "text"),
        ({"kind": "add_comment", "text": "x", "target": True}, "target"),
        ({"kind": "add_comment", "text": "\ud800"}, ""),
    ],
)
def test_what_makes_no_sense_is_refused_in_words_and_changes_nothing(
    ask: Ask, change: dict[str, Any], message: str
) -> None:
    refused = post(ask, 0, {"kind": "lock_station", "station": "S001"}, change, status=422)
    assert message in refused["message"]
    assert "\n" not in refused["message"]
    assert ask("/api/review").json()["revision"] == 0


def test_markup_in_texts_is_kept_as_the_text_it_is(ask: Ask) -> None:
    text = "<img src=x onerror=alert(1)> & </script> \"'` ${x}"
    post(ask, 0, {"kind": "add_comment", "text": text}, author="<b>Ana</b>")
    answer = ask("/api/review")
    assert answer.headers["content-type"] == "application/json"
    comment = answer.json()["comments"]["C001"]
    assert (comment["text"], comment["author"]) == (text, "<b>Ana</b>")


def test_more_changes_than_allowed_are_refused(ask: Ask) -> None:
    lock = {"kind": "lock_station", "station": "S001"}
    assert "changes" in post(ask, 0, *[lock] * 1001, status=422)["message"]
    assert post(ask, 0, *[lock] * 1000)["revision"] == 1


def test_a_review_that_did_not_change_is_not_sent_again(ask: Ask) -> None:
    tag = ask("/api/review").headers["etag"]
    assert ask("/api/review", headers={"if-none-match": tag}).status_code == 304
    post(ask, 0, {"kind": "add_comment", "text": "x" * 5000})
    changed = ask("/api/review", headers={"if-none-match": tag, "accept-encoding": "gzip"})
    assert changed.status_code == 200
    assert changed.headers["content-encoding"] == "gzip"
    assert int(changed.headers["content-length"]) < 2000


def test_a_plan_that_is_shown_read_only_is_not_changed(plan_folder: Path, built_app: Path) -> None:
    app = create_app(plan_folder, token=TOKEN, session=Session(plan_folder, read_only=True), built_app=built_app)
    body = {"base_revision": 0, "author": "Ana", "changes": [{"kind": "lock_station", "station": "S001"}]}
    answer = send(app, "/api/review/changes", "POST", body=body)
    assert answer.status_code == 403
    assert "--read-only" in answer.json()["message"]
    assert send(app, "/api/session").json()["read_only"]
    assert not (plan_folder / "review.usda").exists()


def test_a_review_that_can_not_be_read_is_told_and_left_alone(ask: Ask, plan_folder: Path) -> None:
    (plan_folder / "review.usda").write_text("my notes")
    for answer in (
        ask("/api/review"),
        ask("/api/session"),
        ask("/api/review/changes", "POST", body={
            "base_revision": 0, "author": "Ana", "changes": [{"kind": "lock_station", "station": "S001"}],
        }),
    ):  # fmt: skip
        assert answer.status_code == 503
        assert "damaged (it does not begin with #usda)" in answer.json()["message"]
    assert (plan_folder / "review.usda").read_text() == "my notes"
    assert ask("/plan/plan.json").status_code == 200


def test_pages_are_told_when_a_review_can_be_read_again(plan_folder: Path) -> None:
    session, told = Session(plan_folder), []
    session.events.publish = lambda name, document: told.append((name, document["revision"]))  # type: ignore[method-assign, assignment]
    session.look()
    (plan_folder / "review.usda").write_text("my notes")
    session.look()
    session.look()
    assert told == []
    (plan_folder / "review.usda").rename(plan_folder / "notes.txt")
    session.look()
    session.look()
    assert told == [("review", 0)]


@pytest.mark.parametrize("ask", [Session.review, Session.plan])
def test_pages_are_told_of_a_review_mended_before_the_first_look(
    plan_folder: Path, ask: Callable[[Session], object]
) -> None:
    session, told = Session(plan_folder), []
    session.events.publish = lambda name, document: told.append((name, document["revision"]))  # type: ignore[method-assign, assignment]
    review = plan_folder / "review.usda"
    review.write_text("my notes")
    with pytest.raises(PlanFolderError, match="damaged"):
        ask(session)
    review.unlink()
    session.look()
    session.look()
    assert told == [("review", 0)]


def test_pages_are_told_of_a_change_between_their_answer_and_the_first_look(plan_folder: Path) -> None:
    session, told = Session(plan_folder), []
    session.events.publish = lambda name, document: told.append((name, document["revision"]))  # type: ignore[method-assign, assignment]
    assert session.review().revision == 0
    ReviewStore(plan_folder).commit(0, [c.LockStation("S001")], "Ben")
    session.look()
    session.look()
    assert told == [("review", 1)]


def test_a_fault_of_ours_is_told_in_words(app: Starlette, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(session: Session) -> None:
        raise ZeroDivisionError("by a bug")

    monkeypatch.setattr(Session, "review", broken)

    async def exchange() -> httpx.Response:
        transport = httpx.ASGITransport(app=app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8000") as client:
            return await client.get("/api/review", headers={"x-tlsplan-token": TOKEN})

    answer = asyncio.run(exchange())
    assert answer.status_code == 500
    assert "ZeroDivisionError" in answer.json()["message"]
    assert "by a bug" not in answer.text
    assert answer.headers["x-content-type-options"] == "nosniff"


# ---------------------------------------------------------------------------------------------------- events
async def heard(app: Starlette, act: Callable[[], None], n_events: int) -> list[tuple[str, dict[str, Any]]]:
    """Open the stream as a browser does, act once it is open, and return what is told."""
    told: list[tuple[str, dict[str, Any]]] = []
    text, opened, done = "", asyncio.Event(), asyncio.Event()
    scope = {
        "type": "http", "method": "GET", "path": "/api/events", "raw_path": b"/api/events", "query_string": b"",
        "headers": [(b"host", b"127.0.0.1:8000"), (b"x-tlsplan-token", TOKEN.encode())],
        "server": ("127.0.0.1", 8000), "http_version": "1.1", "scheme": "http", "asgi": {"version": "3.0"},
    }  # fmt: skip

    async def receive() -> dict[str, Any]:
        await done.wait()
        return {"type": "http.disconnect"}

    async def take(message: dict[str, Any]) -> None:
        nonlocal text
        if message["type"] == "http.response.start":
            assert message["status"] == 200
            assert (b"content-type", b"text/event-stream; charset=utf-8") in message["headers"]
        else:
            text += message.get("body", b"").decode()
            opened.set()
        *whole, text = text.split("\n\n")
        for event in whole:
            fields = dict(line.split(": ", 1) for line in event.splitlines() if not line.startswith(":"))
            if "event" in fields:
                told.append((fields["event"], json.loads(fields["data"])))
        if len(told) >= n_events:
            done.set()

    stream = asyncio.create_task(app(scope, receive, take))
    await asyncio.wait_for(opened.wait(), 120)
    await asyncio.to_thread(act)
    await asyncio.wait_for(done.wait(), 120)
    await asyncio.wait_for(stream, 120)  # it ends when the page goes
    return told


def test_pages_are_told_of_changes_as_they_are_made(app: Starlette, ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "LOOK_S", 1000.0)  # a look between the commit and its telling tells of it, too

    def act() -> None:
        post(ask, 0, {"kind": "lock_station", "station": "S001"}, {"kind": "add_comment", "text": "x"}, author="Ben")

    told = asyncio.run(heard(app, act, 1))
    assert told == [("review", {"revision": 1, "author": "Ben", "objects": ["station:S001", "comment:C001"]})]


def test_pages_are_told_of_changes_that_another_process_made(
    app: Starlette, ask: Ask, plan_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events, "LOOK_S", 0.02)
    post(ask, 0, {"kind": "lock_station", "station": "S001"})

    def act() -> None:
        ReviewStore(plan_folder).commit(1, [c.LockStation("S003")], "Carl")

    told = asyncio.run(heard(app, act, 1))
    assert told == [("review", {"revision": 2, "author": "Carl", "objects": ["station:S003"]})]


def streamed(hub: EventHub, act: Callable[[], None], *, limit: int = 100) -> list[bytes]:
    async def listen() -> list[bytes]:
        parts: list[bytes] = []
        stream = hub.open("a")
        assert stream is not None
        async for part in hub.events(stream):
            if not parts:
                act()
            parts.append(part)
            if len(parts) >= limit:
                break
        return parts

    return asyncio.run(asyncio.wait_for(listen(), 120))


def test_a_stream_ends_when_the_server_stops_and_none_begins_after() -> None:
    hub = EventHub()
    assert streamed(hub, hub.close) == [b"retry: 1000\n\n"]
    assert hub.n_streams == 0
    assert hub.open("a") is None


def test_an_idle_stream_beats_and_looks_around(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "LOOK_S", 0.01)
    monkeypatch.setattr(events, "BEAT_S", 0.03)
    looks: list[int] = []
    parts = streamed(EventHub(lambda: looks.append(1)), lambda: None, limit=3)
    assert parts[1:] == [b": still here\n\n"] * 2
    assert len(looks) >= 6


def test_a_page_that_reads_too_slowly_is_cut_off() -> None:
    hub = EventHub()

    def flood() -> None:
        for number in range(events.MOST_WAITING + 5):
            hub.publish("run", {"number": number})
        assert hub.n_streams == 1

    parts = streamed(hub, flood)  # no event is left out between two that are told
    assert parts[1:] == [f'event: run\ndata: {{"number":{n}}}\n\n'.encode() for n in range(len(parts) - 1)]
    assert len(parts) < 5
    assert hub.n_streams == 0


def test_pages_get_the_names_of_whoever_has_one_open_and_two_of_one_person_are_one() -> None:
    async def names() -> list[list[str]]:
        hub, heard = EventHub(), []
        first = hub.open("a", "Ana")
        assert first is not None
        others = [hub.open("a", name) for name in ("Zoë", "Ana", "")]
        for stream in reversed(others):
            assert stream is not None
            hub.leave(stream)
            hub.leave(stream)
        await asyncio.sleep(0)
        while not first.queue.empty():
            event, told = (first.queue.get_nowait() or b"").decode().split("\n", 1)
            assert event == "event: people"
            heard.append(json.loads(told.removeprefix("data: "))["names"])
        return heard

    heard = asyncio.run(names())
    assert heard[:2] == [["Ana"], ["Ana", "Zoë"]]
    assert heard[-2:] == [["Ana", "Zoë"], ["Ana"]]
    assert len(heard) == 5  # nobody is told that a page without a name, or a second one of a person, has gone


@pytest.mark.parametrize("name", ["x" * 101, "a%0Ab", "a%00b", "%E2%80%AEnaa"])
def test_a_page_with_a_name_that_nobody_can_have_is_refused_in_one_line(app: Starlette, name: str) -> None:
    answer = send(app, f"/api/events?name={name}")
    assert (answer.status_code, "name" in answer.json()["message"]) == (422, True)


def test_only_so_many_pages_may_listen(app: Starlette, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events, "MOST_STREAMS", 0)
    answer = send(app, "/api/events")
    assert answer.status_code == 503
    assert "too many" in answer.json()["message"]


def test_streams_that_are_asked_for_at_once_keep_the_limit(app: Starlette) -> None:
    """Two hundred requests are answered before the first of their streams is read: each 200 has taken its room."""
    released = asyncio.Event()

    async def status() -> int:
        said: list[int] = []

        async def send_on(message: Message) -> None:
            if message["type"] == "http.response.start":
                said.append(message["status"])
            elif said[0] != 503:
                await released.wait()  # the page does not read yet

        async def receive() -> Message:
            await released.wait()
            return {"type": "http.disconnect"}

        headers = [(b"host", b"127.0.0.1:8000"), (b"x-tlsplan-token", TOKEN.encode())]
        scope = {
            "type": "http", "method": "GET", "path": "/api/events", "raw_path": b"/api/events", "query_string": b"",
            "headers": headers, "server": ("127.0.0.1", 8000), "client": ("127.0.0.1", 5000), "http_version": "1.1",
            "scheme": "http", "root_path": "",
        }  # fmt: skip
        await app(scope, receive, send_on)
        return said[0]

    async def attack() -> tuple[list[int], int]:
        asked = [asyncio.create_task(status()) for _ in range(200)]
        await asyncio.sleep(0.1)
        released.set()
        first = await asyncio.wait_for(asyncio.gather(*asked), 60)
        released.clear()
        again = asyncio.create_task(status())
        await asyncio.sleep(0.05)
        released.set()
        return first, await again

    first, again = asyncio.run(attack())
    assert sorted(first) == [200] * events.MOST_OF_ONE_CLIENT + [503] * (200 - events.MOST_OF_ONE_CLIENT)
    assert again == 200, "pages that have gone give their room back"


def test_a_page_that_goes_before_its_first_event_gives_its_room_back() -> None:
    async def leave_at_once() -> int:
        hub = EventHub()
        stream = hub.open("a")
        assert stream is not None and hub.n_streams == 1

        async def fail(_: Message) -> None:
            raise OSError("the connection is gone")

        async def hear_nothing() -> Message:
            return {"type": "http.disconnect"}

        with pytest.raises(BaseException):  # noqa: B017 - of whatever kind the server makes of it
            await _EventResponse(hub, stream)({"type": "http"}, hear_nothing, fail)
        return hub.n_streams

    assert asyncio.run(leave_at_once()) == 0


def test_events_are_one_line_of_json_each() -> None:
    hub = EventHub()
    parts = streamed(hub, lambda: hub.publish("run", {"note": "two\nlines\r\n\u2028é"}), limit=2)
    name, told = parts[1].decode().removesuffix("\n\n").split("\n")
    assert name == "event: run"
    assert json.loads(told.removeprefix("data: ")) == {"note": "two\nlines\r\n\u2028é"}
