"""Photos of comments, beside the review: JPEG files <-> `review-photos/<SHA-256>.jpg` in a plan folder.

A comment bears the hash of its photo. Files are written beside and renamed; none is ever changed.
"""

from __future__ import annotations

import hashlib
import io
import re
import time
from collections.abc import Collection
from pathlib import Path

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.operating_system import sync
from planner_core.plan_folder.atomic import locked_folder, staged_file

FOLDER = "review-photos"
MOST_PHOTO_BYTES = 1024 * 1024
LONGEST_EDGE = 1600
MOST_PHOTOS = 500
MOST_OF_ALL_BYTES = 256 * 1024 * 1024
UNUSED_S = 3600.0
"""A photo without a comment may be of one that is being written, or that somebody takes out and puts back."""

_SHA256 = re.compile(r"[0-9a-f]{64}")
_END = b"\xff\xd9"
_NO_JPEG = "photo: got no whole JPEG picture, expected one; choose another file"


def photo_file(folder: Path, sha256: str) -> Path | None:
    """Return the photo of this hash in a plan folder; None where it has none."""
    file = folder / FOLDER / f"{sha256}.jpg"
    return file if _SHA256.fullmatch(sha256) and file.is_file() and not file.is_symlink() else None


def keep_photo(folder: Path, content: bytes, used: Collection[str]) -> str:
    """Write a photo into a plan folder; return its SHA-256. The same photo is kept once.

    used : hashes of those that comments name; others go where there is no more room.

    Raises
    ------
    ReviewError
        It is no JPEG, too large, or there is no more room.
    PlanFolderError
        It can't be written.
    """
    _check_jpeg(content)
    sha256 = hashlib.sha256(content).hexdigest()
    target = folder / FOLDER / f"{sha256}.jpg"
    with locked_folder(folder):
        if photo_file(folder, sha256) is not None:
            return sha256
        try:
            target.parent.mkdir(exist_ok=True)
            _make_room(target.parent, len(content), used)
            with staged_file(target) as staging:
                staging.write_bytes(content)
                sync(staging)
            sync(target.parent)
        except OSError as error:
            raise PlanFolderError(
                f"{target}: can't be written ({error.strerror or error}), so the photo was not kept; check the free "
                "space and the permissions"
            ) from error
    return sha256


def _make_room(folder: Path, n_bytes: int, used: Collection[str]) -> None:
    sizes = {file: file.stat().st_size for file in folder.glob("*.jpg")}

    def is_full() -> bool:
        return len(sizes) >= MOST_PHOTOS or sum(sizes.values()) + n_bytes > MOST_OF_ALL_BYTES

    if is_full():
        for file in [file for file in sizes if file.stem not in used and _age_s(file) > UNUSED_S]:
            file.unlink()
            del sizes[file]
    if is_full():
        raise ReviewError(
            f"photo: the review has {len(sizes)} of {sum(sizes.values()) >> 20} MiB, expected at most {MOST_PHOTOS} of "
            f"{MOST_OF_ALL_BYTES >> 20}; remove comments with photos, whose room is free an hour later"
        )


def _age_s(file: Path) -> float:
    return time.time() - file.stat().st_mtime


def _check_jpeg(content: bytes) -> None:
    from PIL import Image  # takes a tenth of a second, which only photos are worth

    if len(content) > MOST_PHOTO_BYTES:
        raise ReviewError(f"photo: got {len(content)} bytes, expected at most {MOST_PHOTO_BYTES}; make it smaller")
    try:
        with Image.open(io.BytesIO(content), formats=("JPEG",)) as picture:
            size = picture.size
            if max(size) <= LONGEST_EDGE:
                picture.load()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise ReviewError(_NO_JPEG) from error
    if max(size) > LONGEST_EDGE:
        raise ReviewError(
            f"photo: got {size[0]} x {size[1]} pixels, expected 1 to {LONGEST_EDGE} each way; make it smaller"
        )
    if not content.rstrip(b"\0").endswith(_END):  # nothing is hidden behind the picture
        raise ReviewError(_NO_JPEG)
