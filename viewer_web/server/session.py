"""What one start of the server knows: the plan folder, its review, who listens, and what may be done."""

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from planner_core.errors import PlannerError
from planner_core.model import PlanUnderReview, Review
from planner_core.review.store import ReviewStore
from viewer_web.server.events import EventHub

#: In place of a revision: pages get a message as soon as there is one again.
_UNREADABLE = -1
LIVE_OFF: Mapping[str, Any] = {"state": "off", "step": None, "fraction": None, "message": None}


class Session:
    """The state that the routes share. May be used by several threads.

    Parameters
    ----------
    plan_folder
        The folder that is shown.
    read_only
        Nothing is written into it.
    """

    def __init__(self, plan_folder: Path, *, read_only: bool = False) -> None:
        self.plan_folder = plan_folder
        self.read_only = read_only
        self.store = ReviewStore(plan_folder)
        self.events = EventHub(self.look)
        self.live_state: Callable[[], Mapping[str, Any]] = lambda: LIVE_OFF
        self._revision_lock = threading.Lock()
        self._sent_revision: int | None = None

    def review(self) -> Review:
        """Return the review as it is on disk; raises `PlanFolderError` where it can't be read.

        The caller gets events of all that comes after the answer, though nobody read it before.
        """
        try:
            review = self.store.current()
        except PlannerError:
            self._remember_unreadable()
            raise
        with self._revision_lock:
            if self._sent_revision is None:
                self._sent_revision = review.revision
        return review

    def plan(self) -> PlanUnderReview:
        """Return what the review refers to; raises `PlanFolderError` where that or the review can't be read."""
        try:
            return self.store.plan()
        except PlannerError:
            self._remember_unreadable()
            raise

    def tell_review(self, review: Review, author: str, objects: tuple[str, ...]) -> None:
        """Tell all pages of a commit that was made here."""
        with self._revision_lock:
            self._sent_revision = review.revision
        document = {"revision": review.revision, "author": author, "objects": list(objects)}
        self.events.publish("review", document)

    def look(self) -> None:
        """Tell all pages where another process changed the review on disk."""
        try:
            review = self.store.current()
        except PlannerError:  # a request for the review is refused
            self._remember_unreadable()
            return
        with self._revision_lock:
            known, self._sent_revision = self._sent_revision, review.revision
        if known is not None and known != review.revision:
            newer = {name: touch for name, touch in review.touched.items() if touch.revision > known}
            last = max(newer.values(), key=lambda touch: touch.revision, default=None)
            author = "another program" if last is None else last.by
            self.events.publish("review", {"revision": review.revision, "author": author, "objects": sorted(newer)})

    def _remember_unreadable(self) -> None:
        with self._revision_lock:
            self._sent_revision = _UNREADABLE
