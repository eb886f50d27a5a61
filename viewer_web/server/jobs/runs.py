"""Runs: plans that are made again beside the plan that is shown, one at a time, each by a process of its own.

All of a run is in its folder, see `files`. Who may run is decided by a lock that a run's process holds, see
`turn`; so a run goes on where its server is killed, is found again by the next one, and counts as failed, or
cancelled, where its process is gone without a record of how it ended.
"""

import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner_core.errors import PlanFolderError, PlannerError
from planner_core.operating_system import HANDS_ON_LOCKS, apart
from planner_core.plan_folder.atomic import locked_folder
from planner_core.plan_folder.drawn_files import DrawnFiles, copy_drawn, read_drawn_file
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import ScenePaths, find_scene
from planner_core.review.store import REVIEW_FILE, ReviewStore
from viewer_web.server.jobs.documents import RunDocument, RunRequest
from viewer_web.server.jobs.files import (
    BASIS,
    CANCEL,
    DOCUMENT,
    OUTPUT,
    PLAN,
    RUNS,
    is_run_id,
    now,
    read_run,
    run_id,
    run_numbers,
    write_begun,
    write_run,
)
from viewer_web.server.jobs.turn import holder_of_turn, last_run, take_turn, tell_turn

PLAN_FILE = "plan.json"
_WATCH_S = 0.5
#: A run that has recorded its end gives its turn back once the disk holds that: in a moment, but of a busy disk.
_LEAVES_WITHIN_S = 20.0
_OUTPUT_TAIL_BYTES = 4096
_STOPPED = "`tlsplan view` was ended"


class RunNotFoundError(PlannerError):
    """There is no run of this name."""


class RunBusyError(PlannerError):
    """The request can't be met while a run is going, or while it is not."""


@dataclass(frozen=True)
class LeftRun:
    """A run that goes on when its server stops. is_ending : it has to end, and writes the best plan it has."""

    run: str
    is_ending: bool
    plan: Path


class Runs:
    """The runs of one plan folder. May be used by several threads, and by several servers.

    Parameters
    ----------
    plan_folder
        The folder that is shown.
    scene
        The scene file or files; None: searched for at the plan's paths.
    read_only
        Nothing is written: the end of a run whose process is gone is reported, not recorded.
    tell
        Gets the document of every run that changed while `watch` is on, and of one that is cancelled here.
    tell_deleted
        Gets the name of every run that was deleted here, or, while `watch` is on, by others; perhaps twice.
    """

    def __init__(
        self,
        plan_folder: Path,
        *,
        scene: ScenePaths = None,
        read_only: bool = False,
        tell: Callable[[Mapping[str, Any]], None] = lambda _: None,
        tell_deleted: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._plan_folder, self._scene = plan_folder, scene
        self._tell, self._tell_deleted = tell, tell_deleted
        self._scene_found: list[tuple[Path, object]] = []
        self._read_only = read_only
        self._lock = threading.Lock()
        self._child: tuple[str, subprocess.Popen[bytes]] | None = None
        self._stopping = threading.Event()
        self._watcher: threading.Thread | None = None

    # ------------------------------------------------------------------------------------------ reading
    def all(self) -> list[RunDocument]:
        """Return all runs that can be read, the oldest first."""
        found = []
        for number in run_numbers(self._runs):
            with contextlib.suppress(PlannerError):  # one that can't be read is refused when it is requested
                found.append(self.get(run_id(number)))
        return found

    def get(self, run: str) -> RunDocument:
        """Return how a run stands; raises `RunNotFoundError`, and `PlanFolderError` where it can't be read."""
        folder = self._folder(run)
        going = self._going()  # before reading: whoever ends has written how
        document = read_run(folder)
        if document.state == "running" and going != run:
            document = self._ended_without_a_word(folder, document)
        if document.state != "running":
            return document
        return document.model_copy(update={"cancelling": (folder / CANCEL).exists()})

    def obstacle(self) -> str | None:
        """Say why no run can be started: the scene that was planned is not there; None: nothing is known of."""
        if self._scene_found and all(_stamp(path) == stamp for path, stamp in self._scene_found):
            return None  # reading a large scene takes a while
        if not HANDS_ON_LOCKS:
            return "runs can't be started from the page on this system; plan with `tlsplan plan`"
        try:
            scene = find_scene(self._plan_folder, read_plan_json(self._plan_folder), self._scene)
        except PlannerError as error:
            return str(error)
        self._scene_found = [(path, _stamp(path)) for path in scene]
        return None

    # ------------------------------------------------------------------------------------------ changing
    def start(self, request: RunRequest, *, resumed_from: str | None = None) -> RunDocument:
        """Begin a run.

        Raises
        ------
        RunBusyError
            Another one is going.
        RequirementError, ReviewError
            The request makes no sense.
        PlanFolderError
            The plan, its review or its scene can't be read, or the folder can't be written.
        """
        from viewer_web.server.jobs.settings import run_settings  # the planner: a server that plans nothing needs none

        with self._lock:
            earlier = None if resumed_from is None else self._resumable(resumed_from)
            basis = self._plan_folder if earlier is None else self._folder(earlier.id) / BASIS
            begun_m = [] if earlier is None or earlier.best is None else earlier.best.stations
            run_settings(basis, request, begun_m=begun_m)
            document = read_plan_json(basis)
            scene = [path.resolve() for path in find_scene(self._plan_folder, document, self._scene)]
            of_drawing = None
            if request.from_drawing:
                of_drawing = DrawnFiles.beside(
                    self._plan_folder if earlier is None else self._folder(earlier.id) / PLAN
                )
                read_drawn_file(of_drawing.document)
            try:
                return self._begin(request, basis, scene, begun_m, resumed_from, of_drawing)
            except OSError as error:
                raise PlanFolderError(
                    f"{self._runs}: can't be written ({error.strerror or error}), the run was not started; check the "
                    "free space and the permissions"
                ) from error

    def resume(self, run: str) -> RunDocument:
        """Begin a new run that asks the same on the same plan, and begins with the best stations of `run`.

        Raises as `start` does, and `RunBusyError` where `run` still goes on.
        """
        return self.start(self.get(run).request, resumed_from=run)

    def cancel(self, run: str, *, discard: bool = False, why: str = "") -> RunDocument:
        """End a run: with its best plan so far, or, `discard`, without; returns at once.

        Raises
        ------
        RunNotFoundError, RunBusyError
            There is none, or it is not going on.
        """
        document = self.get(run)
        if document.state != "running":
            raise RunBusyError(f"run {run}: is {document.state} already, expected a running one; reload")
        # The marker first: a process that has not recorded its number yet looks for it once it has.
        with contextlib.suppress(FileExistsError), (self._folder(run) / CANCEL).open("x", encoding="utf-8") as marker:
            marker.write(why)
        if (pid := self._pid(run)) is not None:
            with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
                os.kill(pid, signal.SIGTERM if discard else signal.SIGINT)
        document = self.get(run)
        self._tell(document.model_dump())
        return document

    def delete(self, run: str) -> None:
        """Remove a run and all of its files.

        Raises
        ------
        RunNotFoundError, RunBusyError
            There is none, or it is going on.
        PlanFolderError
            Its folder can't be removed.
        """
        folder = self._folder(run)
        with self._lock:
            if self._going_on() == run:
                raise RunBusyError(f"run {run}: is running, expected one that has ended; cancel it first")
            try:
                gone = folder.with_name(f".deleted-{secrets.token_hex(4)}")
                folder.rename(gone)  # at once: nobody sees half a run
                shutil.rmtree(gone)
            except OSError as error:
                raise PlanFolderError(
                    f"{folder}: can't be removed ({error.strerror or error}); check the permissions, or remove it "
                    "yourself"
                ) from error
        # At once, as between two looks a run may have begun and gone: the watcher would know nothing of it.
        self._tell_deleted(run)

    # ------------------------------------------------------------------------------------------ watching
    def watch(self) -> None:
        """Tell what becomes of runs from now on, in a thread of its own, until `stop`."""
        known: dict[str, tuple[object, bool]] = {}
        self._look(known, tell=lambda _: None)
        self._watcher = threading.Thread(target=self._watch, args=(known,), name="runs", daemon=True)
        self._watcher.start()

    def stop(self) -> LeftRun | None:
        """Stop watching, and cancel the run that was started here: it writes its best plan so far by itself.

        Returns the run that goes on, this one or another server's; None: there is none.
        """
        self._stopping.set()
        child = self._child
        if child is not None and child[1].poll() is None:
            with contextlib.suppress(PlannerError):  # it ended by itself
                self.cancel(child[0], why=_STOPPED)
        try:
            left = self.get(self._going() or "")
        except PlannerError:
            return None
        return LeftRun(left.id, left.cancelling, self._runs / left.id / PLAN) if left.state == "running" else None

    def _watch(self, known: dict[str, tuple[object, bool]]) -> None:
        while not self._stopping.wait(_WATCH_S):
            self._look(known, tell=self._tell)

    def _look(self, known: dict[str, tuple[object, bool]], *, tell: Callable[[Mapping[str, Any]], None]) -> None:
        """Tell what has changed since the last look. known : of each run its file's stamp, and whether it went on."""
        going = self._going()
        there = [run_id(number) for number in run_numbers(self._runs)]
        for run in sorted(known.keys() - set(there)):
            del known[run]
            self._tell_deleted(run)
        for run in there:
            stamp, before = _stamp(self._runs / run / DOCUMENT), known.get(run)
            if before is not None and before[0] == stamp and not (before[1] and going != run):
                continue
            document = self._quietly(run)
            known[run] = stamp, document is not None and document.state == "running"
            if document is not None:
                tell(document.model_dump())

    def _quietly(self, run: str) -> RunDocument | None:
        try:
            return self.get(run)
        except PlannerError:  # deleted, or not to be read: a request for it is refused
            return None

    # ------------------------------------------------------------------------------------------ the work
    @property
    def _runs(self) -> Path:
        return self._plan_folder.absolute() / RUNS

    def _folder(self, run: str) -> Path:
        folder = self._runs / run
        if not is_run_id(run) or not folder.is_dir():
            raise RunNotFoundError(f"run {run[:20]}: not found; reload to see all runs")
        return folder

    def _going(self) -> str | None:
        """Return the run that has its turn."""
        holder = holder_of_turn(self._runs)
        if holder is not None:
            return holder.run
        child = self._child
        return child[0] if child is not None and child[1].poll() is None else None

    def _going_on(self) -> str | None:
        """Return the run that has its turn, but for one that has ended: that one is waited for."""
        until_s = time.monotonic() + _LEAVES_WITHIN_S
        while (going := self._going()) and time.monotonic() < until_s:
            try:
                if read_run(self._runs / going).state == "running":
                    return going
            except PlannerError:  # it is only just being made
                return going
            time.sleep(0.02)
        return going

    def _resumable(self, run: str) -> RunDocument:
        document = self.get(run)
        if document.state == "running":
            raise RunBusyError(f"run {run}: is running, expected one that has ended; cancel it first")
        return document

    def _begin(
        self,
        request: RunRequest,
        basis: Path,
        scene: Sequence[Path],
        begun_m: Sequence[Sequence[float]],
        resumed_from: str | None,
        of_drawing: DrawnFiles | None,
    ) -> RunDocument:
        self._runs.mkdir(exist_ok=True)
        turn = None if self._going_on() is not None else take_turn(self._runs)
        if turn is None:
            raise RunBusyError(
                f"run {self._going() or 'of another page'}: is running, expected none; cancel it, or wait until it ends"
            )
        try:
            self._clear_leftovers()
            self._check_space()
            run = run_id(max([*run_numbers(self._runs), _number(last_run(self._runs)), 0]) + 1)
            tell_turn(turn, run)
            folder = self._runs / run
            document = self._prepare(folder, request, basis, begun_m, resumed_from, of_drawing)
            try:
                self._child = run, _spawn(folder, scene, turn)
            except OSError:
                shutil.rmtree(folder)
                raise
            return document
        finally:
            os.close(turn)  # the run has inherited it

    def _prepare(
        self,
        folder: Path,
        request: RunRequest,
        basis: Path,
        begun_m: Sequence[Sequence[float]],
        resumed_from: str | None,
        of_drawing: DrawnFiles | None,
    ) -> RunDocument:
        """Make the folder of a run; it appears whole."""
        staging = folder.with_name(f".new-{secrets.token_hex(4)}")
        try:
            (staging / BASIS).mkdir(parents=True)
            with locked_folder(self._plan_folder):
                shutil.copyfile(basis / PLAN_FILE, staging / BASIS / PLAN_FILE)
                with contextlib.suppress(FileNotFoundError):  # nobody has reviewed it
                    shutil.copyfile(basis / REVIEW_FILE, staging / BASIS / REVIEW_FILE)
            store = ReviewStore(staging / BASIS)
            document = RunDocument(
                id=folder.name,
                title=request.title.strip() or f"Run {int(folder.name[1:])}",
                state="running",
                created=now(),
                request=request,
                resumed_from=resumed_from,
                plan_sha256=store.plan().sha256,
                revision=store.current().revision,
            )
            write_begun(staging, begun_m)
            if of_drawing is not None:
                copy_drawn(of_drawing, DrawnFiles.beside(staging / PLAN))
            write_run(staging, document, keep=True)
            staging.rename(folder)
        except BaseException:
            shutil.rmtree(staging, ignore_errors=True)
            raise
        return document

    def _clear_leftovers(self) -> None:
        """Remove what servers that were killed left; nobody else is at it, as we have the turn."""
        for pattern in (".new-*", ".deleted-*"):
            for left in self._runs.glob(pattern):
                shutil.rmtree(left, ignore_errors=True)

    def _check_space(self) -> None:
        """Refuse a run whose plan would not fit on the disk: it takes about as much as the plan that is shown."""
        shown = (
            path for entry in self._plan_folder.iterdir() if entry.name != RUNS for path in (entry, *_below(entry))
        )
        needed, free = sum(path.stat().st_size for path in shown), shutil.disk_usage(self._runs).free
        if free < needed:
            raise PlanFolderError(
                f"{self._runs}: its disk has {free / 1e6:.0f} MB left, expected {needed / 1e6:.0f} MB for a plan like "
                "this; free some, or delete runs"
            )

    def _pid(self, run: str) -> int | None:
        """Return the number of a run's process; None while it is only just starting, and once it is gone."""
        child, holder = self._child, holder_of_turn(self._runs)
        if child is not None and child[0] == run and child[1].poll() is None:
            return child[1].pid
        return holder.pid if holder is not None and holder.run == run else None

    def _ended_without_a_word(self, folder: Path, document: RunDocument) -> RunDocument:
        """Work out, and write down, what became of a run whose process is gone."""
        has_plan = (folder / PLAN / PLAN_FILE).is_file()
        is_cancelled = (folder / CANCEL).exists()
        last = _last_line(folder / OUTPUT)
        if has_plan:
            state, message = "finished", "its process ended without a result; its plan is complete"
        elif is_cancelled:
            state, message = "cancelled", "it was cancelled before it had a plan"
        else:
            state = "failed"
            message = (
                f"its process ended without a result{f' ({last})' if last else ''}, perhaps for lack of memory or a "
                "shutdown; resume it, or plan with larger patches"
            )
        gone = {"state": state, "message": message, "ended": now(), "plan": f"{RUNS}/{document.id}/{PLAN}"}
        ended = document.model_copy(update=gone if has_plan else {**gone, "plan": None})
        if not self._read_only:
            with contextlib.suppress(OSError):  # found out again the next time
                write_run(folder, ended, keep=True)
        return ended


def _spawn(folder: Path, scene: Sequence[Path], turn: int) -> "subprocess.Popen[bytes]":
    """Begin the process of a run, out of reach of a Ctrl-C that is meant for the server."""
    command = [sys.executable, "-P", "-m", "viewer_web.server.jobs.process", str(folder), "--scene", *map(str, scene)]
    with (folder / OUTPUT).open("ab") as output:
        return subprocess.Popen(
            [*command, "--turn", str(turn)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            **apart(turn),
        )


def _number(run: str) -> int:
    return int(run[1:]) if is_run_id(run) else 0


def _below(folder: Path) -> list[Path]:
    return list(folder.rglob("*")) if folder.is_dir() and not folder.is_symlink() else []


def _stamp(file: Path) -> object:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino


def _last_line(file: Path) -> str:
    """Return the last line that a process printed."""
    try:
        with file.open("rb") as output:
            output.seek(max(0, file.stat().st_size - _OUTPUT_TAIL_BYTES))
            lines = output.read().decode("utf-8", errors="replace").split("\n")
    except OSError:
        return ""
    messages = [" ".join(line.split()) for line in lines if line.strip()]
    return messages[-1][:200] if messages else ""
