"""Photos of comments: whole JPEG pictures and nothing else, kept once, in bounded room."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import numpy as np
import pytest
from oldest_plan import floor, oldest_plan, station
from PIL import Image

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.review import changes as c
from planner_core.review import photos
from planner_core.review.commit import Committed
from planner_core.review.store import ReviewStore

PLAN = oldest_plan(
    floors=[floor("F0", 0.0)],
    stations=[station("S001", "F0", 1, [1.0, 2.0, 1.5])],
    registration={"threshold": 0.3, "connected": True, "links": []},
)


def jpeg(width: int = 40, height: int = 30, shade: int = 90, **options: object) -> bytes:
    out = io.BytesIO()
    Image.new("RGB", (width, height), (shade, 120, 40)).save(out, "JPEG", **options)
    return out.getvalue()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    plan = tmp_path / "plan"
    plan.mkdir()
    (plan / "plan.json").write_text(json.dumps(PLAN))
    return plan


def kept(folder: Path) -> set[str]:
    return {file.name for file in (folder / photos.FOLDER).iterdir()}


@pytest.mark.parametrize("options", [{}, {"progressive": True}, {"comment": b"\xff\xd9"}, {"dpi": (72, 72)}])
def test_a_photo_is_kept_once_under_its_hash_and_a_comment_bears_it(folder: Path, options: dict[str, object]) -> None:
    store = ReviewStore(folder)
    sha256 = store.keep_photo(jpeg(1600, 1200, **options))
    assert store.keep_photo(jpeg(1600, 1200, **options)) == sha256
    assert kept(folder) == {f"{sha256}.jpg"}
    outcome = store.commit(0, [c.AddComment("Door locked", "S001", photo=sha256)], "Ana")
    assert isinstance(outcome, Committed)
    assert ReviewStore(folder).current().comments["C001"].photo == sha256
    removed = store.commit(1, [c.RemoveComment("C001")], "Ana")
    assert isinstance(removed, Committed)
    assert removed.undo[0].photo == sha256  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no whole JPEG"),
        (b"<svg onload='alert(1)'/>", "no whole JPEG"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "no whole JPEG"),
        (jpeg()[:-40], "no whole JPEG"),
        (b"\xff\xd8\xff\xd9", "no whole JPEG"),
        (b"\xff\xd8<script>alert(1)</script>\xff\xd9", "no whole JPEG"),
        (b"\xff\xd8\xff\xe0\xff\xff\xff\xd9", "no whole JPEG"),
        (b"\xff\xd8\xff\xe0\x00\x00\xff\xd9", "no whole JPEG"),
        (b"\xff\xd8" + b"\xff" * 500 + b"\xff\xd9", "no whole JPEG"),
        (jpeg(1601, 20), "1601 x 20 pixels, expected 1 to 1600"),
        (jpeg()[:-2] + bytes(photos.MOST_PHOTO_BYTES) + b"\xff\xd9", "expected at most 1048576"),
    ],
)
def test_what_is_no_photo_is_refused_in_one_line(folder: Path, content: bytes, message: str) -> None:
    with pytest.raises(ReviewError, match=message) as refused:
        ReviewStore(folder).keep_photo(content)
    assert "\n" not in str(refused.value)
    assert not (folder / photos.FOLDER).exists()


def test_damaged_photos_are_kept_or_refused_in_one_line(folder: Path) -> None:
    random, whole = np.random.default_rng(5), jpeg(64, 48, progressive=True)
    n_refused = 0
    for _ in range(100):
        damaged = bytearray(whole)
        for at in random.integers(0, len(whole), 3):
            damaged[at] = random.integers(256)
        try:
            photos.keep_photo(folder, bytes(damaged), ())
        except ReviewError as refused:
            assert "\n" not in str(refused)
            n_refused += 1
    assert 0 < n_refused < 100


@pytest.mark.parametrize("sha256", ["0" * 64, "../" + "0" * 61, "x" * 64, "0" * 63])
def test_a_comment_with_a_photo_that_is_not_there_is_refused(folder: Path, sha256: str) -> None:
    with pytest.raises(ReviewError, match="photo"):
        ReviewStore(folder).commit(0, [c.AddComment("Look", photo=sha256)], "Ana")
    assert photos.photo_file(folder, sha256) is None


def test_a_link_in_the_folder_is_no_photo(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    (folder / photos.FOLDER).mkdir()
    (folder / photos.FOLDER / f"{'0' * 64}.jpg").symlink_to(tmp_path / "secret")
    assert photos.photo_file(folder, "0" * 64) is None


def test_where_there_is_no_more_room_photos_without_a_comment_go(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(photos, "MOST_PHOTOS", 3)
    store = ReviewStore(folder)
    used, unused, young = (store.keep_photo(jpeg(shade=shade)) for shade in (1, 60, 120))
    store.commit(0, [c.AddComment("Look", photo=used)], "Ana")
    with pytest.raises(ReviewError, match=r"the review has 3 of .*expected at most 3"):
        store.keep_photo(jpeg(shade=200))
    for sha256 in (used, unused):
        os.utime(folder / photos.FOLDER / f"{sha256}.jpg", (1, 1))
    another = store.keep_photo(jpeg(shade=200))
    assert kept(folder) == {f"{sha256}.jpg" for sha256 in (used, young, another)}
    monkeypatch.setattr(photos, "MOST_OF_ALL_BYTES", 1000)
    with pytest.raises(ReviewError, match="remove comments with photos"):
        store.keep_photo(jpeg(shade=220))


def test_a_photo_that_cannot_be_written_is_one_line(folder: Path) -> None:
    (folder / photos.FOLDER).write_text("in the way")
    with pytest.raises(PlanFolderError, match="so the photo was not kept"):
        ReviewStore(folder).keep_photo(jpeg())
