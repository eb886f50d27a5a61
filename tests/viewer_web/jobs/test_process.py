"""The work of a run, in this process: what it tells, what it writes, and what signals mean to it."""

from __future__ import annotations

import json
import os
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes_synthetic
from planner_core.model import Entrance, Greedy, PlanSettings, Requirements
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.plan_json import read_plan_json
from planner_core.plan_folder.plan_settings import load_options_of, settings_of
from planner_core.planning.plan import make_plan
from planner_core.progress import BestSoFar, ProgressEvent
from planner_core.review.changes import AddEntrance, SetDoor
from planner_core.review.store import ReviewStore
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scene.load import load_scene
from viewer_web.server.jobs import process
from viewer_web.server.jobs.documents import RunDocument, RunRequest
from viewer_web.server.jobs.files import BASIS, CANCEL, LOG, read_run, write_begun, write_run
from viewer_web.server.jobs.process import Interrupts, Telling
from viewer_web.server.jobs.settings import run_settings


def make_run(hall: Path, folder: Path, request: RunRequest) -> Path:
    (folder / BASIS).mkdir(parents=True)
    shutil.copy(hall / "plan" / "plan.json", folder / BASIS)
    write_begun(folder, [])
    document = RunDocument(
        id="R001",
        title="t",
        state="running",
        created="2026-11-21T16:30:00Z",
        request=request,
        plan_sha256="",
        revision=0,
    )
    write_run(folder, document, keep=False)
    return folder


@pytest.mark.slow
def test_a_run_writes_the_plan_that_was_asked_for_and_tells_its_figures(hall: Path, tmp_path: Path) -> None:
    request = RunRequest(requirements={"coverage": "70 %"}, time_limit_s=0.5)
    folder = make_run(hall, tmp_path / "R001", request)
    assert process.run(folder, hall / "hall.ply") == 0
    told, plan = read_run(folder), read_plan_json(folder / "plan")
    assert (told.state, told.plan, told.stage, told.message) == ("finished", "runs/R001/plan", None, None)
    assert settings_of(plan) == run_settings(hall / "plan", request)
    assert told.best is not None
    assert told.best.n_stations == len(plan["stations"])
    assert told.best.lower_bound == plan["optimality"]["lower_bound"]
    assert told.best.fraction_of_achievable == pytest.approx(plan["coverage"]["fraction_of_achievable"], abs=1e-6)
    assert np.allclose(told.best.stations, [station["position"] for station in plan["stations"]], atol=1e-5)
    lines = [json.loads(line) for line in (folder / LOG).read_text().splitlines()]
    assert {"load", "candidates", "scan", "select", "export"} <= {line.get("stage") for line in lines}
    assert lines[-1]["state"] == "finished"


@pytest.mark.slow
def test_a_run_enters_where_the_review_does_and_opens_the_door_that_it_opens(tmp_path: Path) -> None:
    scene = scenes_synthetic.write(scenes_synthetic.build("doors-shut"), tmp_path / "doors.ifc")
    loaded = load_scene(scene)
    door, other, _ = (element.source_id for element in loaded.elements if element.kind == "IfcDoor")
    coarse = PlanSettings(
        scanner=replace(load_scanner("hdl-64e"), n_azimuths=900),
        requirements=Requirements(coverage=0.5, network="none"),
        grid_step_m=1.0,
        instrument_heights_m=(1.3,),
        max_patch_area_m2=0.25,
        method=Greedy(),
    )
    write_plan_folder(make_plan(loaded, coarse), tmp_path / "plan")
    last = read_plan_json(tmp_path / "plan")["stations"][-1]
    x, y, z = last["position"]
    ground = (x, y, z - 1.3)
    store = ReviewStore(tmp_path / "plan")
    changes = [AddEntrance(Entrance("", ground, last["floor"])), SetDoor(door, "open"), SetDoor(other, "shut")]
    store.commit(0, changes, "Ana")
    folder = make_run(tmp_path, tmp_path / "R001", RunRequest(from_review=True, time_limit_s=0.5))
    shutil.copy(tmp_path / "plan" / "review.usda", folder / BASIS)
    assert process.run(folder, [scene]) == 0
    plan = read_plan_json(folder / "plan")
    assert plan["scene"]["n_doors_open"] == 1
    assert plan["scene"]["load_options"]["doors_open"] == [door]
    assert plan["route"]["start"] == pytest.approx(ground, abs=0.5)
    # And it is opened for editing with the door as it was planned with.
    (options,) = load_options_of(plan)
    assert (options.doors_open, options.doors_shut) == ((door,), (other,))


def test_a_door_that_the_scene_has_not_fails_in_words(hall: Path, tmp_path: Path) -> None:
    folder = make_run(hall, tmp_path / "R001", RunRequest(from_review=True))
    ReviewStore(folder / BASIS).commit(0, [SetDoor("nothing", "open")], "Ana")
    assert process.run(folder, [hall / "hall.ply"]) == 3
    assert "door: got 'nothing', expected the GlobalId of one of the 0 doors" in (read_run(folder).message or "")


def test_a_run_that_was_cancelled_before_it_heard_signals_plans_nothing(hall: Path, tmp_path: Path) -> None:
    folder = make_run(hall, tmp_path / "R001", RunRequest())
    (folder / CANCEL).write_text("it is late", encoding="utf-8")
    assert process.run(folder, hall.parent / "no-such.ifc") == 130
    ended = read_run(folder)
    assert (ended.state, ended.plan) == ("cancelled", None)
    assert "because it is late before it had a plan" in str(ended.message)


def test_what_can_not_be_planned_fails_in_the_words_of_the_library(hall: Path, tmp_path: Path) -> None:
    folder = make_run(hall, tmp_path / "R001", RunRequest(requirements={"planned_floors": ["attic"]}))
    assert process.run(folder, hall / "hall.ply") == 3
    told = read_run(folder)
    assert (told.state, told.plan) == ("failed", None)
    assert "attic" in str(told.message)


def test_a_full_disk_and_little_memory_are_told_in_words(
    hall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number, (error, word) in enumerate(
        [(OSError(28, "No space left", "f.bin"), "No space"), (MemoryError(), "mem")]
    ):
        folder = make_run(hall, tmp_path / f"R{number}", RunRequest())

        def fail(*_: object, error: BaseException = error) -> None:
            raise error

        monkeypatch.setattr(process, "plan_run", fail)
        assert process.run(folder, hall / "hall.ply") > 0
        assert (read_run(folder).state, word in str(read_run(folder).message)) == ("failed", True)


def test_the_best_so_far_is_told_in_the_scene_frame_and_keeps_its_bound(hall: Path, tmp_path: Path) -> None:
    telling = Telling(make_run(hall, tmp_path / "R001", RunRequest()), Interrupts())
    telling.offset_m = np.array([500_000.0, 4_000_000.0, 100.0])
    places = ((1.5, 2.0, 1.25), (3.0, 4.0, 1.25))
    telling.show(ProgressEvent("select", 1, 2, "x", best=BestSoFar(5, 3, (1, 2), places)))
    telling.show(ProgressEvent("refine", 1, 2))
    best = read_run(telling.folder).best
    assert best is not None
    assert best.stations == [[500_001.5, 4_000_002.0, 101.25], [500_003.0, 4_000_004.0, 101.25]]
    telling.show(ProgressEvent("select", 1, 2, best=BestSoFar(2, None, (1, 2), places)))
    told = read_run(telling.folder)
    assert (told.stage, told.best and (told.best.n_stations, told.best.lower_bound)) == ("select", (2, 2))


def test_before_there_is_a_plan_an_interrupt_ends_all_at_once() -> None:
    interrupts = Interrupts()
    interrupts.install()
    interrupts.follow(ProgressEvent("scan", 1, 10))
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("stage", ["select", "bound", "prove", "refine", "least time"])
def test_with_a_plan_an_interrupt_ends_the_search_that_goes_on(stage: str) -> None:
    interrupts = Interrupts()
    interrupts.install()
    interrupts.follow(ProgressEvent("select", 0, 0, settles_interrupts=True))
    interrupts.follow(ProgressEvent(stage, 1, 10))
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_between_searches_an_interrupt_waits_for_the_next_and_after_the_last_for_none() -> None:
    interrupts = Interrupts()
    interrupts.install()
    interrupts.follow(ProgressEvent("select", 0, 0, settles_interrupts=True))
    interrupts.follow(ProgressEvent("scan", 1, 10))
    os.kill(os.getpid(), signal.SIGINT)
    interrupts.follow(ProgressEvent("route", 1, 10))
    with pytest.raises(KeyboardInterrupt):
        interrupts.follow(ProgressEvent("refine", 0, 2))
    interrupts.spare()
    os.kill(os.getpid(), signal.SIGINT)
    interrupts.follow(ProgressEvent("export", 1, 10))


def test_who_wants_no_plan_gets_none_at_any_time() -> None:
    interrupts = Interrupts()
    interrupts.install()
    interrupts.follow(ProgressEvent("select", 0, 0, settles_interrupts=True))
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        interrupts.follow(ProgressEvent("select", 0, 0, settles_interrupts=True))
    with pytest.raises(KeyboardInterrupt):
        interrupts.spare()
    interrupts.close()
    os.kill(os.getpid(), signal.SIGTERM)
