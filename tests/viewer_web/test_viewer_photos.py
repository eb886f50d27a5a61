"""Photos of comments over HTTP: sent as JPEG by whoever may comment, sent back as nothing else."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest
from PIL import Image

from viewer_web.server.app import create_app
from viewer_web.server.session import Session

from .conftest import TOKEN, send

Ask = Callable[..., httpx.Response]
JPEG = {"content-type": "image/jpeg"}
PHOTOS = "/api/review/photos"


def jpeg() -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (40, 30), "teal").save(out, "JPEG")
    return out.getvalue()


def test_a_photo_is_kept_for_a_comment_and_sent_back_as_a_picture(ask: Ask) -> None:
    kept = ask(PHOTOS, "POST", JPEG, jpeg())
    assert (kept.status_code, kept.json()) == (200, {"sha256": hashlib.sha256(jpeg()).hexdigest()})
    sha256 = kept.json()["sha256"]
    comment = {"kind": "add_comment", "text": "Door locked", "target": "S001", "photo": sha256}
    answer = ask("/api/review/changes", "POST", body={"base_revision": 0, "author": "Ana", "changes": [comment]})
    assert answer.json()["review"]["comments"]["C001"]["photo"] == sha256
    photo = ask(f"{PHOTOS}/{sha256}")
    assert (photo.content, photo.headers["content-type"]) == (jpeg(), "image/jpeg")
    assert photo.headers["x-content-type-options"] == "nosniff"
    assert ask(f"{PHOTOS}/{sha256}", headers={"if-none-match": photo.headers["etag"]}).status_code == 304


@pytest.mark.parametrize(
    ("headers", "content", "status", "words"),
    [
        (JPEG, b"<html>", 422, "no whole JPEG"),
        (JPEG, b"", 422, "no whole JPEG"),
        (JPEG, bytes(1024 * 1024 + 1), 413, "expected at most 1048576"),
        ({"content-type": "text/plain"}, b"x", 415, "expected image/jpeg"),
        ({"content-type": "application/json"}, b"{}", 415, "expected image/jpeg"),
    ],
)
def test_what_is_no_photo_is_refused(
    ask: Ask, headers: dict[str, str], content: bytes, status: int, words: str
) -> None:
    answer = ask(PHOTOS, "POST", headers, content)
    assert (answer.status_code, words in answer.json()["message"]) == (status, True), answer.text


def test_a_comment_with_an_unknown_photo_is_refused(ask: Ask) -> None:
    comment = {"kind": "add_comment", "text": "Look", "photo": "0" * 64}
    answer = ask("/api/review/changes", "POST", body={"base_revision": 0, "author": "Ana", "changes": [comment]})
    assert (answer.status_code, "is not there" in answer.json()["message"]) == (422, True)


@pytest.mark.parametrize("name", ["0" * 64, "..%2Fplan.json", "0" * 63, "0" * 64 + ".jpg", "%2e%2e", "A" * 64])
def test_nothing_else_is_sent(ask: Ask, name: str) -> None:
    assert ask(f"{PHOTOS}/{name}").status_code in (404, 422)


def test_commenters_send_photos_and_nobody_without_a_token_or_where_it_is_read_only(
    plan_folder: Path, built_app: Path
) -> None:
    app = create_app(plan_folder, token=TOKEN, comment_token="of-commenters", built_app=built_app)
    assert send(app, PHOTOS, "POST", JPEG, jpeg(), token=None).status_code == 401
    assert send(app, PHOTOS, "POST", JPEG, jpeg(), token="of-commenters").status_code == 200
    sha256 = hashlib.sha256(jpeg()).hexdigest()
    assert send(app, f"{PHOTOS}/{sha256}", token=None).status_code == 401
    shown = create_app(plan_folder, token=TOKEN, session=Session(plan_folder, read_only=True), built_app=built_app)
    assert send(shown, PHOTOS, "POST", JPEG, jpeg()).status_code == 403
    assert send(shown, f"{PHOTOS}/{sha256}").status_code == 200
