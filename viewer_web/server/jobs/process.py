"""The process of one run: plans, reports its progress, and writes the plan: `python -m viewer_web.server.jobs.process`.

It is on its own: what it needs is in its folder, its messages go there, and the server may end and start again
meanwhile. SIGINT ends the search, and the best plan so far is written; SIGTERM ends everything.
"""

import argparse
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from planner_core.errors import PlanFolderError, PlannerError
from planner_core.model import FloatArray, Plan
from planner_core.operating_system import lower_priority
from planner_core.plan_folder.drawn_files import DrawnFiles, write_raised
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.planning.independent_check import with_independent_check
from planner_core.planning.open_survey import open_survey
from planner_core.planning.plan import plan_survey
from planner_core.progress import BestSoFar, ProgressEvent
from planner_core.scene.load import load_scene
from planner_core.select.proven import INTERRUPTED
from viewer_web.server.jobs.documents import RunBest
from viewer_web.server.jobs.files import BASIS, CANCEL, LOG, PLAN, RUNS, now, read_begun, read_run, write_run
from viewer_web.server.jobs.settings import run_load_options, run_settings
from viewer_web.server.jobs.turn import tell_turn

#: The viewer answers first: whoever moves stations meanwhile would notice.
_NICENESS = 5
_WRITE_S, _LOG_S = 0.5, 5.0
#: Stages that an interrupt ends with the best plan so far, see `planner_core.planning.choose`.
_SEARCHES = frozenset({"select", "bound", "prove", "refine", "least time"})


class Interrupts:
    """What signals mean for a run.

    Until there is a plan an interrupt ends everything at once. Then it ends the search that goes on; one that comes
    between two searches waits for the next, and one that comes after the last has nothing to end.
    """

    def __init__(self) -> None:
        self._must_end = False
        self._discards = False
        self._has_plan = False
        self._searches = False

    def install(self) -> None:
        """Take SIGINT and SIGTERM."""
        signal.signal(signal.SIGINT, self._hear)
        signal.signal(signal.SIGTERM, self._hear)

    def follow(self, event: ProgressEvent) -> None:
        """Look what the work is at; raises KeyboardInterrupt where one was not heard."""
        if event.settles_interrupts:
            self._must_end, self._has_plan, self._searches = self._discards, True, False
        else:
            self._searches = event.stage in _SEARCHES
        if self._must_end and self._ends_something:
            self._must_end = False
            raise KeyboardInterrupt

    def spare(self) -> None:
        """From here on only SIGTERM ends anything: the plan is complete."""
        self._has_plan, self._searches = True, False
        if self._discards:
            raise KeyboardInterrupt

    def close(self) -> None:
        """From here on nothing ends anything: how it ended is being written down."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)

    @property
    def _ends_something(self) -> bool:
        return self._discards or self._searches or not self._has_plan

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self._must_end = True
        self._discards = self._discards or number == signal.SIGTERM
        if self._ends_something:
            raise KeyboardInterrupt


class Telling:
    """Keeps `run.json` and the log of a run up with the work."""

    def __init__(self, folder: Path, interrupts: Interrupts) -> None:
        self.folder = folder
        self.run = read_run(folder)
        self.offset_m: FloatArray | None = None
        self._interrupts = interrupts
        self._written_s = self._logged_s = -_LOG_S
        self._began_s = time.monotonic()

    def show(self, event: ProgressEvent) -> None:
        """Take an event of the work."""
        self._interrupts.follow(event)
        before, best = self.run, self.run.best if event.best is None else self._best(event.best)
        if event.settles_interrupts:
            return
        shown = {"stage": event.stage, "done": event.done, "total": event.total, "note": event.note or None}
        self.run = before.model_copy(update={**shown, "best": best})
        is_news = event.stage != before.stage or (best is not None and best != before.best)
        now_s = time.monotonic()
        if is_news or now_s - self._logged_s >= _LOG_S:
            self._logged_s = now_s
            self._log(shown | {"best": None if best is None else best.model_dump(exclude={"stations"})})
        if is_news or now_s - self._written_s >= _WRITE_S:
            self._written_s = now_s
            write_run(self.folder, self.run, keep=False)

    def chosen(self, plan: Plan) -> None:
        """Tell what the plan is worth, before its folder is written, which takes longer than planning may."""
        self.run = self.run.model_copy(update={"best": best_of(plan), "warnings": list(plan.warnings)})
        write_run(self.folder, self.run, keep=False)

    def end(self, state: str, message: str | None, **more: Any) -> None:
        """Tell how it ended."""
        shown = {"state": state, "message": message, "ended": now(), "stage": None, "done": None, "total": None}
        self.run = self.run.model_copy(update={**shown, "note": None, **more})
        self._log({"state": state, "message": message})
        write_run(self.folder, self.run, keep=True)

    def _best(self, best: BestSoFar) -> RunBest:
        known = self.run.best
        bound = best.lower_bound
        if bound is None and known is not None and known.lower_bound is not None:
            bound = min(known.lower_bound, best.n_stations)
        return RunBest(
            n_stations=best.n_stations,
            lower_bound=bound,
            fraction_of_achievable=best.fraction,
            stations=[] if self.offset_m is None else in_scene(best.positions_m, self.offset_m),
        )

    def _log(self, document: dict[str, Any]) -> None:
        line = json.dumps({"seconds": round(time.monotonic() - self._began_s, 2), **document}, ensure_ascii=False)
        with (self.folder / LOG).open("a", encoding="utf-8") as log:
            log.write(line + "\n")


def in_scene(places_m: Sequence[Sequence[float] | FloatArray], offset_m: FloatArray) -> list[list[float]]:
    """Bring places from the local frame to the scene's, rounded to hundredths of a millimetre."""
    at_m = np.array(places_m, dtype=np.float64).reshape(-1, 3) + offset_m
    places: list[list[float]] = at_m.round(5).tolist()
    return places


def best_of(plan: Plan) -> RunBest:
    """What runs tell of a plan that was chosen."""
    return RunBest(
        n_stations=len(plan.stations),
        lower_bound=plan.lower_bound or None,
        fraction_of_achievable=plan.coverage.fraction_of_achievable,
        stations=in_scene([station.position_m for station in plan.stations], plan.survey.scene.offset_m),
    )


def plan_run(folder: Path, scene: Sequence[Path], telling: Telling, interrupts: Interrupts) -> Plan:
    """Plan as the run asks, and write the plan's folder."""
    # An interrupt before `install` is lost where the server was started with interrupts off, as by `nohup ... &`.
    if (folder / CANCEL).exists():
        raise KeyboardInterrupt
    basis, place = folder / BASIS, folder.stat().st_ino
    if telling.run.request.from_drawing:
        drawn = DrawnFiles.beside(folder / PLAN)
        write_raised(drawn)
        scene = [drawn.ifc, *scene[1:]]  # what drawings are raised to is the first file of the scene
    settings = run_settings(basis, telling.run.request, begun_m=read_begun(folder))
    loaded = load_scene(scene, options=run_load_options(basis, telling.run.request), progress=telling.show)
    telling.offset_m = loaded.offset_m
    survey, engine = open_survey(loaded, settings, progress=telling.show)
    plan = plan_survey(survey, settings, engine, progress=telling.show)
    interrupts.spare()
    plan = with_independent_check(plan, engine, progress=telling.show)
    telling.chosen(plan)
    write_plan_folder(plan, folder / PLAN, engine=engine, progress=telling.show)
    if folder.stat().st_ino != place:  # files that were just being written may have stayed behind
        raise PlanFolderError("the plan was replaced during this run; resume the run")
    return plan


def run(folder: Path, scene: Sequence[Path]) -> int:
    """Do all of a run; return the exit status of its process."""
    interrupts = Interrupts()
    interrupts.install()
    telling = Telling(folder, interrupts)
    try:
        plan = plan_run(folder, scene, telling, interrupts)
        interrupts.close()
    except KeyboardInterrupt:
        interrupts.close()
        telling.end("cancelled", f"it was cancelled{_why(folder)} before it had a plan")
        return 130
    except PlannerError as error:
        telling.end("failed", str(error))
        return 3
    except MemoryError:
        telling.end("failed", "out of memory; plan with larger patches or a wider grid, or floor by floor")
        return 6
    except OSError as error:
        telling.end("failed", f"{error.filename or 'a file'}: can't be read or written ({error.strerror or error})")
        return 3
    except Exception as error:
        telling.end("failed", f"internal error: {type(error).__name__}: {error}; please report it with its output.txt")
        raise
    _tell_plan(telling, plan)
    return 0


def _tell_plan(telling: Telling, plan: Plan) -> None:
    is_cut_short = plan.why_stopped == INTERRUPTED
    telling.end(
        "cancelled" if is_cut_short else "finished",
        f"it was cancelled{_why(telling.folder)}: this is the best plan so far" if is_cut_short else None,
        best=best_of(plan),
        warnings=list(plan.warnings),
        plan=f"{RUNS}/{telling.run.id}/{PLAN}",
    )


def _why(folder: Path) -> str:
    marker = folder / CANCEL
    reason = marker.read_text(encoding="utf-8") if marker.is_file() else ""
    return f" because {reason}" if reason else ""


def main(arguments: list[str] | None = None) -> int:
    """Read the command line, say whose process this is, and run."""
    parser = argparse.ArgumentParser(prog="process", description="Plan as a run of `tlsplan view` asks.")
    parser.add_argument("folder", type=Path, help="folder of the run")
    parser.add_argument("--scene", type=Path, nargs="+", required=True, help="the scene files")
    parser.add_argument("--turn", type=int, default=None, help="handle of the lock that this process inherits")
    parsed = parser.parse_args(arguments)
    if parsed.turn is not None:
        os.set_inheritable(parsed.turn, False)
        tell_turn(parsed.turn, parsed.folder.name, os.getpid())
    lower_priority(_NICENESS)
    try:
        return run(parsed.folder, parsed.scene)
    finally:
        if parsed.turn is not None:
            os.close(parsed.turn)  # the next one need not wait until all of this process is gone


if __name__ == "__main__":
    sys.exit(main())
