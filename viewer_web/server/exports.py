"""Exports for whoever looks at the plan: made of the plan as reviewed, one at a time, in a process of their own.

A file is written to a folder of the system for temporary files, never into the plan folder, and is gone once it was
sent. Its format is one of a list; no part of any path comes from a request.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from planner_core.child_process import ChildLimits, LostChildError, limits_for, run_isolated
from planner_core.errors import PlannerError
from planner_core.export.formats import FORMATS, Format
from planner_core.export.reviewed import OFFERED, WITH_FIGURES, edited_stations
from planner_core.plan_folder.plan_settings import ScenePaths
from planner_core.plan_folder.plan_source import open_plan
from planner_core.progress import ProgressEvent
from viewer_web.server.session import Session

LONGEST_S = 300.0
LARGEST_BYTES = 256 * 1024 * 1024
_STAGE = "export"
_FUNCTION = "planner_core.export.reviewed:export_in_child"


class ExportBusyError(PlannerError):
    """Somebody else's is being made."""


class ExportUnknownError(PlannerError):
    """No such format is made here."""


@dataclass(frozen=True)
class Offered:
    """A format that can be had. obstacle : why not now; None: nothing is known of. edited : stations edited since."""

    format: Format
    obstacle: str | None
    edited: int


@dataclass(frozen=True)
class Made:
    """A file that was written, in a folder of its own. remarks : one line each, for the user."""

    path: Path
    remarks: tuple[str, ...]


class _EndedError(Exception):
    """Raised from progress to end the child; `str(error)` is the reason."""


class Exports:
    """Makes exports of one plan folder. May be used by several threads.

    Parameters
    ----------
    scene
        Where the scene files are, where they are not beside the plan.
    longest_s, largest_bytes
        Of one export.
    """

    def __init__(
        self,
        session: Session,
        scene: ScenePaths = None,
        *,
        longest_s: float = LONGEST_S,
        largest_bytes: int = LARGEST_BYTES,
    ) -> None:
        self._session, self._scene = session, scene
        self._longest_s, self._largest_bytes = longest_s, largest_bytes
        self._making = threading.Lock()
        self._stopping = threading.Event()
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def offered(self) -> tuple[Offered, ...]:
        """Return what can be had of the plan as it is now; raises `PlanFolderError` where that can't be read."""
        plan = open_plan(self._session.plan_folder, scene=self._scene)
        review = self._session.review()
        edited = len(edited_stations(self._session.plan(), review))
        without = ""
        try:
            plan.scene_paths()
        except PlannerError as error:
            without = str(error)
        is_ifc = plan.document["scene"]["format"] == "ifc"
        return tuple(
            Offered(each, _obstacle(each, without, is_edited=edited > 0 or bool(review.entrances)), edited)
            for each in (FORMATS[name] for name in OFFERED)
            if is_ifc or each.name != "ifc-model"
        )

    def make(self, name: str, *, is_wanted: Callable[[], bool] = lambda: True) -> Made:
        """Write one; whoever gets it deletes its folder.

        Parameters
        ----------
        is_wanted
            Called all the time, from this thread: where it is False, the export ends.

        Raises
        ------
        ExportUnknownError
            No such format.
        ExportBusyError
            Another one is being made.
        PlannerError
            It can't be made, took too long, or became too large; the message names the remedy.
        """
        if name not in OFFERED:
            raise ExportUnknownError(f"export: got {name[:40]!r}, expected one of {', '.join(OFFERED)}")
        if not self._making.acquire(blocking=False):
            raise ExportBusyError("another export is being made; try again when it is done")
        try:
            return self._make(FORMATS[name], is_wanted)
        finally:
            self._making.release()

    def stop(self) -> None:
        """End what is being made, and delete what was not sent yet."""
        self._stopping.set()
        with self._making:
            if self._folder is not None:
                self._folder.cleanup()

    def _make(self, chosen: Format, is_wanted: Callable[[], bool]) -> Made:
        if self._stopping.is_set():
            raise PlannerError("the server stops")
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="tlsplan-exports-")
        path = Path(tempfile.mkdtemp(dir=self._folder.name)) / chosen.file_name
        until_s = time.monotonic() + self._longest_s
        command = f"`tlsplan export --format {chosen.name}` has no such limit"

        def look(_: ProgressEvent) -> None:
            if self._stopping.is_set() or not is_wanted():
                raise _EndedError(f"{chosen.name}: nobody waits for it any more")
            if time.monotonic() > until_s:
                raise _EndedError(f"{chosen.name}: took more than {self._longest_s:.0f} s and was ended; {command}")
            self._check_size(chosen, path.parent, command)

        paths = (self._scene,) if isinstance(self._scene, Path) else self._scene
        arguments = {
            "name": chosen.name,
            "folder": str(self._session.plan_folder),
            "target": str(path),
            "scene": None if paths is None else [str(each) for each in paths],
        }
        limits = ChildLimits(silent_s=None, memory_bytes=limits_for(0).memory_bytes)
        try:
            remarks = run_isolated(_FUNCTION, arguments, classes=(), limits=limits, stage=_STAGE, progress=look)
            # A short one may be done before anybody waited.
            look(ProgressEvent(_STAGE, 1, 1))
        except LostChildError as error:
            raise PlannerError(
                f"{chosen.name}: its export {error}; {command.partition('` ')[0]}` has details"
            ) from error
        except _EndedError as error:
            raise PlannerError(str(error)) from error
        return Made(path, tuple(remarks))

    def _check_size(self, chosen: Format, folder: Path, command: str) -> None:
        n_bytes = sum(each.stat().st_size for each in list(folder.iterdir()) if each.is_file())
        if n_bytes > self._largest_bytes:
            raise _EndedError(
                f"{chosen.name}: became larger than {self._largest_bytes / 1e6:.0f} MB and was ended; {command}"
            )


def _obstacle(chosen: Format, without_scene: str, *, is_edited: bool) -> str | None:
    """Why a format can't be had; None: nothing is known of."""
    if not without_scene:
        return None
    if chosen.needs_scene:
        return without_scene
    if is_edited and chosen.name in WITH_FIGURES:
        return f"stations or entrances were edited, and figures and route are computed from the scene: {without_scene}"
    return None
