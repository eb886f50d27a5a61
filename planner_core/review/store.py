"""The review of a plan folder on disk: read when it changed, written whole before its change is confirmed.

Several processes may have the same folder open: every commit reads the file anew under the folder's lock. What is
written goes to a file beside it, is synced and renamed, so a process killed at any moment leaves the review as it was,
or with the whole commit in it.
"""

from __future__ import annotations

import contextlib
import shutil
import threading
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from planner_core.errors import PlanFolderError, ReviewError
from planner_core.model.review import PlanUnderReview, Review
from planner_core.operating_system import sync
from planner_core.plan_folder.atomic import locked_folder, staged_file
from planner_core.plan_folder.usd_stage import empty_review
from planner_core.review.changes import AddComment, Change, Signature
from planner_core.review.commit import Committed, Conflict, commit
from planner_core.review.photos import keep_photo, photo_file
from planner_core.review.stations import plan_under_review
from planner_core.review.usd import damaged
from planner_core.review.usd_read import read_review
from planner_core.review.usd_write import review_text

REVIEW_FILE = "review.usda"
MOST_REVIEW_BYTES = 32 * 1024 * 1024
"""Ten thousand objects with long comments stay below; what is larger is not written by hand."""

_Stamp = tuple[int, int, int] | None


def now() -> str:
    """The time as it is written in reviews."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


class ReviewStore:
    """The review of one plan folder. May be used by several threads.

    Parameters
    ----------
    plan_folder
        As `write_plan_folder` writes it. It may be replaced by another plan meanwhile.
    clock
        Gives the time of a commit.
    """

    def __init__(self, plan_folder: Path, *, clock: Callable[[], str] = now) -> None:
        self._folder = plan_folder
        self._file = plan_folder / REVIEW_FILE
        self._clock = clock
        self._lock = threading.Lock()
        self._read: tuple[_Stamp, _Stamp, PlanUnderReview, Review] | None = None

    def plan(self) -> PlanUnderReview:
        """Return what the review refers to; raises as `current`."""
        return self._state()[0]

    def current(self) -> Review:
        """Return the review as it is on disk.

        Raises
        ------
        PlanFolderError
            The plan or the review can't be read; the message names the remedy.
        """
        return self._state()[1]

    def commit(
        self, base_revision: int, changes: Sequence[Change], author: str, *, plan_sha256: str | None = None
    ) -> Committed | Conflict:
        """Make changes and have the disk hold them.

        Parameters
        ----------
        base_revision
            The revision that `author` was looking at.
        plan_sha256
            The plan that they were looking at; None: whichever is there.

        Raises
        ------
        ReviewError
            A change can't be made: it makes no sense, names a photo that is not there, or the review would get too
            large.
        PlanFolderError
            The review can't be read, and is left as it is; or it can't be written, and nothing was changed.
        """
        with self._lock, locked_folder(self._folder):
            plan, review = self._look()
            if plan_sha256 is not None and plan_sha256 != plan.sha256:
                return Conflict("the plan was replaced by another one since this page was loaded; reload", (), review)
            for change in changes:
                if isinstance(change, AddComment) and change.photo and photo_file(self._folder, change.photo) is None:
                    raise ReviewError(
                        f"photo {change.photo[:8]}...: is not there, expected one that was sent; send it first"
                    )
            outcome = commit(review, base_revision, changes, plan, Signature(author, self._clock()))
            if isinstance(outcome, Committed):
                self._write(outcome.review, plan)
            return outcome

    def keep_photo(self, content: bytes) -> str:
        """Keep a photo for a comment; return its SHA-256. Raises as `photos.keep_photo`."""
        return keep_photo(self._folder, content, {comment.photo for comment in self.current().comments.values()})

    def _state(self) -> tuple[PlanUnderReview, Review]:
        with self._lock:
            return self._look()

    def _look(self) -> tuple[PlanUnderReview, Review]:
        """Read what changed on disk since the last time."""
        stamps = _stamp(self._folder / "plan.json"), _stamp(self._file)
        if self._read is None or self._read[:2] != stamps:
            plan = plan_under_review(self._folder)
            text = self._text()
            review = read_review(text, plan, name=str(self._file)) if text else Review()
            self._read = (*stamps, plan, review)
        return self._read[2:]

    def _text(self) -> str:
        try:
            if self._file.stat().st_size > MOST_REVIEW_BYTES:
                raise PlanFolderError(
                    f"{self._file}: is larger than {MOST_REVIEW_BYTES >> 20} MiB, expected a review; rename it to "
                    "begin a new one: nothing is deleted"
                )
            return self._file.read_text(encoding="utf-8")
        except FileNotFoundError:
            return ""
        except UnicodeDecodeError as error:
            raise damaged(str(self._file), f"byte {error.start + 1} is not text") from error
        except OSError as error:
            raise PlanFolderError(
                f"{self._file}: can't be read ({error.strerror or error}), expected the review of the plan; check its "
                "permissions, or rename it to begin a new review: nothing is deleted"
            ) from error

    def _write(self, review: Review, plan: PlanUnderReview) -> None:
        content = review_text(review, plan, self._text() or empty_review(), name=str(self._file)).encode()
        if len(content) > MOST_REVIEW_BYTES:
            raise ReviewError(
                f"review: it would take {len(content) >> 20} MiB, expected at most {MOST_REVIEW_BYTES >> 20}; remove "
                "comments or zones first"
            )
        self._read = None
        try:
            for left in self._folder.glob(".review.partial-*.usda"):  # of a process that was killed: we hold the lock
                left.unlink(missing_ok=True)
            with staged_file(self._file) as staging:
                staging.write_bytes(content)
                with contextlib.suppress(FileNotFoundError):
                    shutil.copymode(self._file, staging)
                sync(staging)
        except OSError as error:
            raise PlanFolderError(
                f"{self._file}: can't be written ({error.strerror or error}), your change was not kept; check the "
                "free space and the permissions"
            ) from error
        try:
            sync(self._folder)
        except OSError as error:
            raise PlanFolderError(
                f"{self._file}: is written, but the disk does not confirm it ({error.strerror or error}); check the "
                "disk and reload"
            ) from error
        self._read = (_stamp(self._folder / "plan.json"), _stamp(self._file), plan, review)


def _stamp(file: Path) -> _Stamp:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
