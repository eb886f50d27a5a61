"""Plans that are cut short: a limit of time, Ctrl-C while stations are chosen, and a second Ctrl-C."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import small_pictures

import scenes_synthetic
from planner_core.model import Plan, PlanSettings, Proven
from planner_core.planning.plan import make_plan
from planner_core.progress import ProgressEvent

#: Runs another program of this folder, and stops once it has told that it was interrupted: it would go on meanwhile.
STOPPING = """
import os, runpy, signal, sys
from tlsplan.progress import ProgressReporter
def warn(self, lines, warn=ProgressReporter.warn):
    told = list(lines)
    warn(self, told)
    if any("interrupted" in line for line in told):
        os.kill(os.getpid(), signal.SIGSTOP)
ProgressReporter.warn = warn
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
Planned = Callable[[str, PlanSettings], Plan]


@pytest.fixture(scope="module")
def comb_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "comb.ifc"
    scenes_synthetic.write(scenes_synthetic.build("corridor-comb"), path)
    return path


def started(building: Path, folder: Path, *before: str) -> "subprocess.Popen[str]":
    """A plan that would take minutes, in the midst of choosing stations; `before` : what runs it."""
    asked = folder.parent / "asked.yaml"
    asked.write_text(
        "coverage: 97 %\nseen_from: 2\nclasses:\n  IfcSlab: {coverage: 98 %}\nfloors:\n  F0: {coverage: 96 %}\n"
    )
    options = ["--grid", "0.8", "--patch-area", "0.4", "--set", "work_limit=1000"]
    program = [sys.executable, *before, small_pictures.__file__, "tlsplan"]
    process = subprocess.Popen(
        [*program, "plan", building, "-o", folder, "--requirements", asked, *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    for line in process.stderr:
        # There is a plan once the bound is looked for.
        if line.startswith(("bound:", "prove:")):
            return process
    pytest.fail(f"stations were never chosen: ended with {process.wait()}")


@pytest.mark.slow  # tests/cli/test_interrupted_work.py, from outside
def test_an_interrupt_while_stations_are_chosen_leaves_the_best_plan_so_far(comb_file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    process = started(comb_file, folder)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    assert "interrupted: keeping the best plan so far" in said
    assert json.loads((folder / "plan.json").read_text())["optimality"]["why_stopped"] == "interrupted"


@pytest.mark.slow
def test_a_second_interrupt_leaves_nothing(comb_file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "plan"
    process = started(comb_file, folder, "-c", STOPPING)
    process.send_signal(signal.SIGINT)
    is_stopped = os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT).si_code == os.CLD_STOPPED
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGCONT)
    _, said = process.communicate(timeout=300)
    assert is_stopped, said
    assert process.returncode == 130
    assert "interrupted: keeping the best plan so far" in said
    assert said.splitlines()[-1].startswith("tlsplan: interrupted")
    assert "Traceback" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["asked.yaml"]


@pytest.mark.slow
def test_who_asks_the_process_to_end_gets_no_plan(comb_file: Path, tmp_path: Path) -> None:
    process = started(comb_file, tmp_path / "plan")
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 130, said
    assert "best plan so far" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["asked.yaml"]


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["fewest", "coverage", "time"])
def test_a_limit_of_no_time_still_gives_a_plan_with_its_bound(objective: str, small: PlanSettings) -> None:
    settings = replace(
        small,
        objective=objective,
        max_stations=3 if objective == "coverage" else None,
        seconds_per_scan=60.0,
        refine=True,
        method=Proven(time_limit_s=0),
    )
    plan = make_plan(scenes_synthetic.build("corridor-comb").scene, settings)
    assert plan.stations
    if objective != "coverage":
        assert all(result.met for result in plan.requirements)
        assert 0 <= plan.lower_bound <= len(plan.stations)
    if objective != "fewest":
        assert plan.objective_value is not None
        assert plan.objective_bound is not None
    assert plan.why_stopped in ("time limit", "proven")


class Interrupting:
    """Progress that interrupts once, at the nth event of a stage, and notes what is said afterwards."""

    def __init__(self, stage: str, event: int) -> None:
        self.stage, self.left, self.prior = stage, event, 0

    def __call__(self, event: ProgressEvent) -> None:
        self.prior += event.settles_interrupts and bool(event.note)
        if event.stage == self.stage and not event.settles_interrupts:
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("stage", "event", "objective"),
    [("refine", 1, "fewest"), ("bound", 1, "fewest"), ("least time", 1, "time"),
     *(pytest.param(*late, marks=pytest.mark.slow)
       for late in (("refine", 2, "fewest"), ("least time", 3, "time"), ("bound", 1, "coverage")))],
)  # fmt: skip
def test_an_interrupt_of_any_step_of_the_choice_gives_the_plan_so_far(
    stage: str, event: int, objective: str, small: PlanSettings, planned: Planned
) -> None:
    settings = replace(
        small,
        objective=objective,
        max_stations=4 if objective == "coverage" else None,
        seconds_per_scan=60.0,
        refine=stage == "refine",
        method=Proven(work_limit=0.1) if stage == "bound" else small.method,
    )
    interrupting = Interrupting(stage, event)
    plan = make_plan(scenes_synthetic.build("two-rooms").scene, settings, progress=interrupting)
    assert interrupting.left == 0
    assert interrupting.prior == 1
    assert plan.why_stopped == "interrupted"
    if objective == "coverage":
        assert plan.objective_bound is not None
        assert plan.objective_value is not None
        assert plan.objective_value <= plan.objective_bound
        return
    assert all(result.met for result in plan.requirements)
    assert 0 < plan.lower_bound <= len(plan.stations)
    if stage == "refine":
        assert len(plan.stations) <= len(planned("two-rooms", replace(settings, refine=False)).stations)


def test_a_limit_of_time_is_for_all_steps_together(small: PlanSettings, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[tuple[str, float]] = []
    hours_s = iter(range(0, 10**9, 3600))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(hours_s)))

    def note(event: ProgressEvent) -> None:
        steps.append((event.stage, event.done))

    settings = replace(small, refine=True, method=Proven(time_limit_s=600))
    plan = make_plan(scenes_synthetic.build("two-rooms").scene, settings, progress=note)
    assert all(result.met for result in plan.requirements)
    # Ten minutes are over at the first look at the clock: nothing is refined.
    assert "refine" not in {stage for stage, _ in steps}
